"""Step loops of small systems: what they take for granted, and that their results are the same."""

import numpy as np
import pytest
from systems import TURN, friction_oscillator, two_mass_system

from fecontact import ContactSystem, Drive, Ground, Load, ModalBasis
from fecontact.core.simd.kinds import WIDTH
from fecontact.integrate import small_systems
from fecontact.integrate.rodas5p import driver, method, variational
from fecontact.integrate.rodas5p.state import Output
from fecontact.integrate.rodas5p.variational import Variation
from fecontact.integrate.simd import step_loop as lanes_loop
from fecontact.integrate.simd.driver import side_by_side
from fecontact.laws import DahlFriction, ExponentialFriction, RoughSurface


def system(modes, nodes, **changes):
    """A block on a belt, of rigid modes and elastic ones, on one or two nodes."""
    rng = np.random.default_rng(modes)
    T = np.zeros((2 + nodes, 3, modes))
    T[:, 0, 0] = 0.4
    T[:, 1, min(1, modes - 1)] = 0.4
    T[:, :2, 2:] = 0.2 * rng.uniform(-1.0, 1.0, (2 + nodes, 2, max(modes - 2, 0)))
    w = np.array([0.0, 0.0, 200.0, 400.0, 700.0])[:modes]
    basis = ModalBasis(w, np.diag(0.02 * w), T, np.zeros((2 + nodes, 2)),
                       np.full(nodes, 1.0 / nodes))
    return ContactSystem(basis, **{
        "normal": RoughSurface(10e6, 10e-6, 40.0),
        "friction": ExponentialFriction(0.8, 0.55, 1000.0, 1e6), "ground": Ground(speed=1e-3),
        "drive": Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                       frequency_hz=13.8 / TURN),
        "load": Load(14.0), **changes})


def run_of(system, **options):
    state = np.zeros(2 * system.basis.modes + system.basis.contact_nodes * system.memory)
    return driver.start(system, state, np.linspace(0.0, 0.5, 101), rtol=1e-6, **options)


def assert_as_said(values, said):
    """Check that constants of a record, and of records within, hold."""
    found = 0
    for field, expected in said.get(type(values), {}).items():
        value = getattr(values, field)
        if isinstance(expected, tuple):
            # Arrays of eight numbers each have these as a last axis.
            assert value.shape[len(expected) :] in ((), (WIDTH,)), field
            for length, wanted in zip(value.shape[: len(expected)], expected, strict=True):
                assert wanted in (length, None), field
        elif isinstance(expected, np.ndarray):
            np.testing.assert_array_equal(value, expected, field)
        else:
            assert value == expected, field
        found += 1
    for value in values:
        if hasattr(value, "_fields"):
            found += assert_as_said(value, said)
    return found


@pytest.mark.parametrize(("modes", "nodes"), small_systems.SIZES)
def test_what_step_loops_take_for_granted(modes, nodes):
    said = method.SMALL.values(modes, nodes)
    run = run_of(system(modes, nodes))
    tuples = (run.problem, run.progress, run.workspace, run.output, run.variation)
    found = sum(assert_as_said(values, said) for values in tuples)
    assert found >= sum(map(len, said.values()))


@pytest.mark.parametrize(("modes", "nodes"), lanes_loop.SMALL.sizes)
def test_what_step_loops_of_lanes_take_for_granted(modes, nodes):
    one, times = system(modes, nodes), np.array([[0.0, 0.1]])
    begun = side_by_side([one], lambda _: np.zeros(2 * modes), times, 1e-6, None, "auto")[0]
    said = lanes_loop.SMALL.values(modes, nodes)
    lanes, runs = begun.lanes(), begun.runs
    spare = begun.spare(lanes)
    found = sum(assert_as_said(values, said) for values in (lanes, runs, *spare))
    unused = sum(len(said[kind]) for kind in said if kind in (Output, Variation))
    assert found >= sum(map(len, said.values())) - unused


@pytest.mark.parametrize(("modes", "nodes"), small_systems.SIZES)
def test_same_results_as_by_the_step_loop_of_all_systems(modes, nodes):
    # Steps of one length: where they follow the error, rounding shifts their ends.
    own, other = (run_of(system(modes, nodes), max_step=2e-5) for _ in range(2))
    assert method.advance_for(own.problem, own.variation) is not method.advance
    own.advance(400)
    method.advance(method.Data(other.problem, other.progress, other.workspace, other.output,
                               other.kept, other.variation, other.watch), 400)
    assert own.statistics == other.statistics
    assert own.time == pytest.approx(other.time, rel=1e-12)
    for name in ("state", "rate", "work", "power"):
        found, expected = getattr(own.progress, name), getattr(other.progress, name)
        assert found == pytest.approx(expected, rel=1e-8, abs=1e-9 * np.abs(expected).max()), name


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_what_derivatives_take_for_granted(modes):
    said = variational.SMALL.values(modes, 1)
    run = run_of(system(modes, 1), vary=True)
    tuples = (run.problem, run.progress, run.workspace, run.output, run.variation)
    found = sum(assert_as_said(values, said) for values in tuples)
    assert found >= sum(map(len, said.values()))


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_same_derivatives_as_by_the_code_of_all_systems(modes, monkeypatch):
    block = system(modes, 1)
    above, below = (block.with_(**{"ground.speed": speed}) for speed in (1.00001e-3, 0.99999e-3))
    vary = above, below, 2e-8
    # Steps of one length, as above; those of the run alone.
    found = []
    for small, parts in ((True, False), (False, False), (False, True)):
        if not small:
            monkeypatch.setattr(variational, "is_small", lambda problem: False)
            monkeypatch.setattr(method, "is_small", lambda problem: False)
            monkeypatch.setattr(variational, "in_parts", lambda problem, parts=parts: parts)
            monkeypatch.setattr(driver, "in_parts", lambda problem, parts=parts: parts)
        run = run_of(block, vary=vary, vary_rtol=1e9, max_step=2e-5)
        run.advance(300)
        found.append((run.time, run.variation.variation.columns))
    (end, own), (end_of_all, of_all), (end_of_parts, of_parts) = found
    assert [end, end_of_parts] == pytest.approx([end_of_all, end_of_all], rel=1e-12)
    sizes = np.abs(of_all).max(axis=0)
    assert (np.abs(own - of_all) <= 1e-7 * sizes).all()
    # Along the motion, instead of those of the steps.
    assert (np.abs(of_parts - of_all) <= 1e-6 * sizes).all()


def test_systems_with_more_to_them_have_the_step_loop_of_all():
    small = friction_oscillator()
    for other in (system(5, 1), system(2, 3), small.with_(friction=DahlFriction(0.3, 1e6))):
        run = run_of(other)
        assert method.advance_for(run.problem, run.variation) is method.advance
    run = run_of(small, vary=True)
    assert method.advance_for(run.problem, run.variation) is method.advance
    for other in (small, two_mass_system()):
        run = run_of(other)
        assert method.advance_for(run.problem, run.variation) is not method.advance
