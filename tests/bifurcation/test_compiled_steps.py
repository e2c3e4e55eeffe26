"""Compiled steps of frequency responses beside plain ones; preloads; corners of responses."""

from types import SimpleNamespace

import numpy as np
import pytest
from oscillators import duffing, jenkins_amplitude, jenkins_system, one_mode
from systems import TURN

from fecontact import ContactSystem, Drive, basis_from_matrices, io, plot, simulate
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
    orbit_branch,
)
from fecontact.bifurcation.harmonic.compiled import arrays
from fecontact.bifurcation.harmonic.compiled.balance import CompiledBalance
from fecontact.core.errors import InputError
from fecontact.laws import BilateralPolynomial, Frictionless, JenkinsFriction, PrescribedForce

BOUNDS = (0.6 / TURN, 1.8 / TURN)


def cubic_system(force=0.18):
    """The Duffing oscillator of :func:`oscillators.duffing`, as a contact system in y.

    The end of a spring with a dashpot moves as A sin W t; its force is F sin(W t + phase).
    """
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    basis = basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                damping=[[0.05]])
    return ContactSystem(basis, normal=BilateralPolynomial(0.0, 0.1), drive=Drive(
        stiffness_y=1.0, amplitude_y=force, frequency_hz=0.8 / TURN))


def row_of_masses():
    """Three masses in a row, two of them on Jenkins elements."""
    rows = np.zeros((2, 3, 3))
    rows[0, 0, 0], rows[1, 0, 2] = 1.0, 1.0
    B = np.zeros((3, 3))
    B[0, 1] = 1.0
    K = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    basis = basis_from_matrices(np.eye(3), K, {"contact": rows, "B": B, "C": B}, damping=0.04 * K)
    return ContactSystem(
        basis, normal=PrescribedForce((1.0, 0.4)), friction=JenkinsFriction((0.5, 0.3), 0.5),
        drive=Drive(stiffness_x=1.0, amplitude_x=0.8, frequency_hz=0.9 / TURN))


def test_the_cubic_spring_has_the_published_fold_and_amplitudes():
    found = frequency_response(cubic_system(), BOUNDS, observe=("B", "y"))
    plain = frequency_response(duffing(), (0.6, 1.8), "W")
    branch, other = found.branches[0], plain.branches[0]
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    assert TURN * branch.special[1].parameter == pytest.approx(1.11570025, abs=1e-8)
    assert branch.parameter[[0, -1]] == pytest.approx(BOUNDS)
    field = contact_field(cubic_system(), ["drive.frequency_hz"])
    for which in range(3):
        mine, theirs = branch.at(field, 1.2 / TURN, which), other.at(duffing(), 1.2, which)
        assert mine.values["maximum"] == pytest.approx(theirs.values["maximum"], rel=1e-9)
        pairs = (np.sort(one.values["multipliers"].imag) for one in (mine, theirs))
        assert next(pairs) == pytest.approx(next(pairs), abs=1e-9)
        assert mine.values["stable"] == theirs.values["stable"]


@pytest.mark.parametrize("system", [cubic_system, jenkins_system])
def test_compiled_steps_are_those_of_plain_code(system, monkeypatch):
    """Points, what they store and special points, however the branch was followed."""
    bounds, observe = (BOUNDS, ("B", "y")) if system is cubic_system else (
        (1.02 / TURN, 1.3 / TURN), ("B", "x"))
    method = HarmonicBalance(5, samples=128)
    fast = frequency_response(system(), bounds, observe=observe, method=method)
    monkeypatch.setattr(CompiledBalance, "of", lambda problem: None)
    slow = frequency_response(system(), bounds, observe=observe, method=method)
    one, other = fast.branches[0], slow.branches[0]
    assert [point.kind for point in one.special] == [point.kind for point in other.special]
    for mine, theirs in zip(one.special, other.special, strict=True):
        assert mine.parameter == pytest.approx(theirs.parameter, rel=1e-9)
    field = contact_field(system(), ["drive.frequency_hz"])
    for part in (0.2, 0.5, 0.8):
        value = bounds[0] + part * (bounds[1] - bounds[0])
        mine, theirs = one.at(field, value), other.at(field, value)
        assert mine.u == pytest.approx(theirs.u, rel=1e-6, abs=1e-8)
        for name in ("minimum", "maximum", "period", "truncation_error", "residual"):
            assert mine.values[name] == pytest.approx(theirs.values[name], rel=1e-4, abs=1e-7)
    # Values that compiled steps store of a regular point follow from its unknowns.
    for point in one.points[5:40:7]:
        restored = frequency_values(field, point)
        for name in ("truncation_error", "residual"):
            assert point.values[name] == pytest.approx(restored[name], rel=0.02)
        for name in ("minimum", "maximum"):
            assert point.values[name] == pytest.approx(restored[name], rel=1e-6, abs=1e-9)
        assert np.abs(point.values["multipliers"]) == pytest.approx(
            np.abs(restored["multipliers"]), abs=1e-6)


def frequency_values(field, point):
    """Values that plain code stores of a point."""
    from fecontact.bifurcation.harmonic.starts import restored

    problem, u, tangent = restored(field, point)
    return problem.point(u, problem.linearise(u), tangent)


def mixed_row():
    """Four masses: a Jenkins element, a smooth contact, a cubic spring and none."""
    rows = np.zeros((3, 3, 4))
    for node, (axis, mass) in enumerate(((0, 0), (0, 1), (1, 2))):
        rows[node, axis, mass] = 1.0
    B = np.zeros((3, 4))
    B[0, 1] = 1.0
    K = 3.0 * np.eye(4) - np.diag([1.0] * 3, 1) - np.diag([1.0] * 3, -1)
    faces = {"base": rows[:1], "rail": rows[1:2], "spring": rows[2:]}
    basis = basis_from_matrices(np.eye(4), K, {"contact": faces, "B": B, "C": B}, damping=0.04 * K)
    return ContactSystem(
        basis, normal={"base": PrescribedForce(1.0), "rail": PrescribedForce(1.0),
                       "spring": BilateralPolynomial(0.0, 1.0)},
        friction={"base": JenkinsFriction(0.5, 0.5), "rail": Frictionless(),
                  "spring": Frictionless()},
        drive=Drive(stiffness_x=1.0, amplitude_x=0.8, frequency_hz=0.9 / TURN))


@pytest.fixture
def garbage(monkeypatch):
    """Arrays of compiled harmonic balance come filled with what is no number."""
    def filled(shape, dtype=float):
        return np.full(shape, np.nan) if dtype is float else np.full(shape, -1000, dtype=dtype)

    monkeypatch.setattr(arrays, "np", SimpleNamespace(**{**vars(np), "empty": filled}))


@pytest.mark.usefixtures("garbage")
@pytest.mark.parametrize("system", [row_of_masses, mixed_row, cubic_system])
def test_derivatives_of_several_modes_with_memory_are_those_of_the_residual(system):
    from fecontact.bifurcation.harmonic.problem import CompiledLinearisation
    from fecontact.bifurcation.harmonic.starts import problem_for

    field = contact_field(system(), ["drive.frequency_hz"])
    problem = problem_for(field, field.values, 0, HarmonicBalance(3, 48),
                          np.ones(field.dimension + 2))
    u = np.append(np.random.default_rng(2).normal(size=problem.size), 0.9 / TURN)
    here = problem.linearise(u)
    assert isinstance(here, CompiledLinearisation)
    differences = np.empty(here.condensed.shape)
    for k in range(len(u)):
        h = 1e-6 * np.eye(len(u))[k]
        differences[:, k] = (problem.linearise(u + h).residual
                             - problem.linearise(u - h).residual) / 2e-6
    assert here.condensed == pytest.approx(differences, abs=2e-7 * np.abs(differences).max())


@pytest.mark.usefixtures("garbage")
@pytest.mark.parametrize("system", [row_of_masses, mixed_row, cubic_system])
def test_responses_do_not_depend_on_what_was_in_memory(system):
    branch = frequency_response(system(), BOUNDS, observe=("B", "x"),
                                method=HarmonicBalance(5, 128, stability=None)).branches[0]
    assert len(branch) > 10
    assert np.isfinite(branch.column("observed_amplitude")).all()


def test_folds_are_found_without_stability(tmp_path):
    options = {"observe": ("B", "y")}
    found = [frequency_response(cubic_system(), BOUNDS, method=HarmonicBalance(
        9, stability=stability), **options) for stability in ("transitions", None)]
    places = [[point.parameter for point in one.branches[0].special] for one in found]
    assert places[1] == pytest.approx(places[0], abs=1e-9 / TURN)
    assert "stable" not in found[1].branches[0].points[3].values
    stored = io.read_response(io.write_response(tmp_path / "response.h5", found[1]))
    on = orbit_branch(contact_field(cubic_system(), ["drive.frequency_hz"]),
                      stored.branches[0].points[20], bounds=BOUNDS,
                      options=ContinuationOptions(points=3))
    assert on.method.stability is None
    plot.plot_response(stored, path=tmp_path / "response.png")
    assert (tmp_path / "response.png").stat().st_size > 10_000
    assert found[1].amplitude().max() == pytest.approx(found[0].amplitude().max(), rel=1e-3)


def test_steps_pass_the_corners_of_a_jenkins_element():
    """Beginning and end of sliding within the range: few points, amplitudes as by the closed form.

    Below 2 N / (k_d) the element sticks, and the response is that of a spring.
    """
    found = frequency_response(jenkins_system(amplitude=0.6), (0.8 / TURN, 1.6 / TURN),
                               method=HarmonicBalance(1, samples=512))
    W, A = TURN * found.branches[0].parameter, np.abs(found.harmonic(1))
    exact = [jenkins_amplitude(w, 0.6) if slides(w) else stuck(w) for w in W[::6]]
    assert A[::6] == pytest.approx(np.array(exact), rel=2e-3)
    assert (A > 2.0).any()
    assert (A < 2.0).any()
    assert len(W) < 175


def stuck(w, force=0.6):
    return force / abs(1.5 - w**2 + 0.02j * w)


def slides(w):
    return stuck(w) > 2.0


def preloaded(left):
    """A mass in the middle, its element having slid back by ``left`` before; response at 0.5."""
    system = jenkins_system(0.5, amplitude=1.0)
    rest = 0.5 * left / 1.5
    state = np.array([rest, 0.0, rest - left])
    found = frequency_response(system, (0.45 / TURN, 0.55 / TURN), preload=state,
                               method=HarmonicBalance(9, samples=256),
                               options=ContinuationOptions(largest_step=0.2))
    field = contact_field(system, ["drive.frequency_hz"])
    return system, state, found.branches[0].at(field, 0.5 / TURN)


def test_an_element_keeps_the_deflection_of_its_preload():
    """A run from the preload comes to the same vibration, about another place than zero."""
    system, state, here = preloaded(0.4)
    T = TURN / 0.5
    run = simulate(system, 120.0 * T, initial=state, rtol=1e-9,
                   outputs=np.array([0.0, 119.0 * T, 120.0 * T]))
    run = simulate(system, T, initial=run.states[-1], rtol=1e-9, outputs=1001)
    mean = np.trapezoid(run.states[:, 0], run.time) / T
    assert mean == pytest.approx(0.2 / 1.5, rel=1e-3)
    assert here.u[0] == pytest.approx(mean, rel=1e-3)
    assert here.values["maximum"][:2] == pytest.approx(run.states.max(axis=0)[:2], rel=1e-3)
    assert here.values["minimum"][2] == pytest.approx(run.states.min(axis=0)[2], rel=1e-3)


def test_a_deflection_too_large_to_be_kept_slides_back_to_the_limit():
    """The element then touches its limit 2 m once a period; its vibration is that of a spring."""
    _, state, here = preloaded(2.4)
    amplitude = 1.0 / abs(1.5 - 0.25 + 0.01j)
    assert abs(state[2]) + amplitude > 2.2
    assert here.values["minimum"][2] == pytest.approx(-2.0, rel=1e-3)
    assert here.u[0] == pytest.approx(0.5 * (2.0 - amplitude), rel=2e-3)


def test_a_preload_of_a_vector_field_is_refused():
    with pytest.raises(InputError, match="preload is for contact systems"):
        frequency_response(duffing(), (0.6, 1.8), "W", preload=np.zeros(2))


def test_an_element_under_static_load_is_at_rest_without_deflection():
    """Without a preload the elements have no deflection at rest: static loads rest on springs."""
    system = ContactSystem(
        one_mode(), normal=PrescribedForce(1.0), friction=JenkinsFriction(0.5, 1.0),
        drive=Drive(stiffness_x=1.0, damping_x=0.1, amplitude_x=0.2, frequency_hz=0.5 / TURN))
    found = frequency_response(system, (0.45 / TURN, 0.55 / TURN), method=HarmonicBalance(3),
                               options=ContinuationOptions(largest_step=0.2))
    assert np.abs(found.harmonic(0)).max() < 1e-9
