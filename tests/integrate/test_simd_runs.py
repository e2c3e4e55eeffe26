"""Eight runs side by side: the numbers of single runs, whatever else is run, and closed forms."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from systems import TURN, basis, friction_oscillator
from test_small_systems import system as block

from fecontact import (
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    PointLoad,
    Status,
    ensemble,
    simulate,
)
from fecontact.integrate import Rodas5P, Scipy
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.simd import driver as lane_driver
from fecontact.integrate.simd.driver import SideBySide, kind_of, side_by_side
from fecontact.integrate.simd.step_loop import SMALL
from fecontact.laws import (
    BoucWenFriction,
    ConstantFriction,
    DahlFriction,
    ExponentialFriction,
    GaussianSurface,
    Harmonic,
    HarmonicSpeed,
    HyperbolicFriction,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    LuGreFriction,
    NormalLaw,
    ParabolicSurface,
    ParallelSliders,
    PowerContact,
    PrescribedForce,
    ProductFriction,
    Pulse,
    RoughSurface,
    Sine,
    TwoSidedStop,
    normal_law,
)

UP, ALONG = np.array([[0.0], [1.0]]), np.array([[1.0], [0.0]])
HERTZ = 0.5 / np.pi
LANES_ONLY = Rodas5P()


@normal_law
def halved(u, v, p):
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    return 0.5 * p[0] * u, 0.5 * p[0], 0.0


@dataclass(frozen=True)
class Halved(NormalLaw):
    """Law of a user: half a stiffness."""

    kernel: ClassVar = halved

    stiffness: float = 1.0

    @property
    def penetration_scale(self):
        return 2.0 / self.stiffness


def slider(**parts):
    """One mode along a belt under a given force."""
    r = 1.0 / np.sqrt(5.632)
    return ContactSystem(basis([0.0], [0.0], r * ALONG, r * ALONG), **{
        "normal": PrescribedForce(14.0),
        "friction": ExponentialFriction(0.8, 0.55, 1000.0, 1e6), "ground": Ground(speed=1e-3),
        "drive": Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                       frequency_hz=13.8 / TURN), **parts})


def single(system, state, times, rtol, **options):
    run = driver.start(system, state, times, rtol=rtol, work=False,
                       **{"method": "rodas5p"} | options)
    run.advance(10**9)
    assert run.outputs == len(times)
    return run


CASES = {
    "prescribed": slider(),
    "uniform": friction_oscillator(2),
    "three modes": friction_oscillator(3),
    "two nodes": block(2, 2),
    "moving ground": slider(ground=Ground(
        speed=1e-3, motion=HarmonicSpeed(4e-4, 30.0 / TURN, 0.3))),
    "tanh": slider(friction=HyperbolicFriction(0.8, 0.55, 2e-3, 1e5, 0.3, smoothing="tanh")),
    "square root": slider(friction=ConstantFriction(0.5, 1e5, smoothing="square-root")),
    "product": slider(friction=ProductFriction(0.4, 0.6, 900.0, 1e5)),
    "Hertz": friction_oscillator(2, normal=PowerContact(3e9, 1.5, 0.4)),
    "a power": friction_oscillator(2, normal=PowerContact(3e9, 1.4, 0.4)),
    "parabolic": friction_oscillator(2, normal=ParabolicSurface(1e7, 1e-5, 40.0)),
    "linear": friction_oscillator(2, normal=LinearContact(1e7, 40.0)),
    "two stops": friction_oscillator(2, normal=TwoSidedStop(1e7, 1e-5, 1.0, 0.2)),
    # Laws with branches, which are called for one lane after the other.
    "Gaussian": friction_oscillator(2, normal=GaussianSurface(1e7, 1e-5, 40.0)),
    "own law": friction_oscillator(2, normal=Halved(2e7)),
    "load in time": friction_oscillator(2, load=Load(14.0, (
        PointLoad("C", "y", signal=Harmonic(-3.0, 40.0 / TURN)),))),
}


def test_cases_are_of_all_sizes():
    sizes = {(one.basis.modes, one.basis.contact_nodes) for one in CASES.values()}
    assert sizes == set(SMALL.sizes)


def assert_as_a_single_one(system, state, times, states, steps):
    """Check errors against a run of tight tolerance: those of a single run of the same tolerance.

    But at two outputs at most, within a step in which a contact changes: a single run too is up to
    ten times as far off there.
    """
    exact = single(system, state, times, 1e-11).states
    own = single(system, state, times, 1e-7, method="rodas5p")
    size = np.abs(exact).max(axis=0) + 1e-300
    off, usual = (np.sort((np.abs(one - exact) / size).max(axis=1)) for one in (states, own.states))
    assert off[-3] < max(2e-5, 3.0 * usual[-3])
    assert off[-1] < 2e-4
    assert steps == pytest.approx(own.statistics["steps"], rel=0.1)


@pytest.mark.parametrize("name", CASES)
def test_each_run_is_that_of_a_single_one(name):
    base = CASES[name]
    systems = [base.with_(**{"drive.frequency_hz": w / TURN}) for w in np.linspace(11.0, 16.0, 11)]
    assert all(kind_of(one, 0.0, 0.4) is not None for one in systems)
    state, times = np.zeros(base.size), np.linspace(0.0, 0.4, 81)
    found = ensemble(systems, times, initial=state, rtol=1e-7)
    assert found.finished.all()
    assert (found.states[:, 0] == 0.0).all()
    for system, states, steps in zip(systems, found.states, found.steps, strict=True):
        assert_as_a_single_one(system, state, times, states, steps)


BRISTLES = LuGreFriction(0.8, 0.5, 1e-3, 2.0, 1e5, 300.0, 0.4, 1.0)
MEMORY = {
    "Dahl": slider(friction=DahlFriction(0.5, 1e5)),
    "LuGre": slider(friction=BRISTLES),
    "LuGre, two nodes": block(2, 2, friction=BRISTLES),
    "Bouc-Wen": slider(friction=BoucWenFriction(0.5, 1e-5)),
    "Jenkins": slider(friction=JenkinsFriction(1e5, 0.5)),
    "Iwan": slider(friction=IwanFriction(1e5, 0.5, 3)),
    "Iwan, many elements": slider(friction=IwanFriction(1e5, 0.5, 16)),
    "Jenkins, two nodes": block(2, 2, friction=JenkinsFriction(1e5, 0.5)),
}


@pytest.mark.parametrize("name", MEMORY)
def test_friction_with_internal_variables(name):
    """Many runs of it go side by side, with the errors of single ones; few do not."""
    base = MEMORY[name]
    systems = [base.with_(**{"drive.frequency_hz": w / TURN}) for w in np.linspace(11.0, 16.0, 64)]
    state, times = np.zeros(base.size), np.linspace(0.0, 0.4, 41)
    rows = np.tile(times, (64, 1))
    one, = side_by_side(systems, lambda _: state, rows, 1e-7, None, "auto")
    assert one.numbers == list(range(64))
    assert not side_by_side(systems[1:], lambda _: state, rows[1:], 1e-7, None, "auto")
    found = ensemble(systems, times, initial=state, rtol=1e-7)
    assert found.finished.all()
    part = ensemble(systems[:9], times, initial=state, rtol=1e-7, in_all=64)
    assert (part.states == found.states[:9]).all()
    for k in range(0, 64, 13):
        assert_as_a_single_one(systems[k], state, times, found.states[k], found.steps[k])


def test_many_internal_variables_side_by_side_as_one_by_one():
    """Twelve springs and sliders of a node: the motion of single runs, to a third of its error."""
    springs = tuple(1.3 ** np.arange(12.0))
    base = block(2, 2, friction=ParallelSliders(1e5, 0.5, springs, springs[::-1]))
    systems = [base.with_(**{"drive.frequency_hz": w / TURN}) for w in np.linspace(11.0, 16.0, 64)]
    state, times = np.zeros(base.size), np.linspace(0.0, 0.1, 11)
    assert kind_of(base, 0.0, 0.1).size == (2, 2, 12)
    found = ensemble(systems, times, initial=state, rtol=1e-8)
    for k in range(0, 64, 9):
        alone = single(systems[k], state, times, 1e-8)
        assert found.steps[k] == pytest.approx(alone.statistics["steps"], rel=0.03)
        size = np.abs(alone.states).max(axis=0) + 1e-300
        assert (np.abs(found.states[k] - alone.states) / size).max() < 1e-7


def test_against_an_integrator_of_another_library():
    systems = [slider().with_(**{"drive.frequency_hz": w / TURN}) for w in (11.0, 13.8)]
    times = np.linspace(0.0, 0.5, 6)
    found = ensemble(systems, times, initial=np.zeros(2), rtol=1e-8)
    for system, states in zip(systems, found.states, strict=True):
        other = simulate(system, 0.5, initial=np.zeros(2), outputs=times, rtol=1e-8,
                         solver=Scipy("Radau")).states
        assert states == pytest.approx(other, abs=1e-5 * np.abs(other).max(axis=0).min())


def test_results_do_not_depend_on_what_runs_beside():
    """Bit for bit: alone, in any order, with others of other laws, by one worker or by two."""
    rng = np.random.default_rng(3)
    systems, states = [], []
    for k in range(29):
        base = friction_oscillator(2) if k % 3 else friction_oscillator(
            2, normal=PowerContact(3e9, 1.5, 0.4))
        systems.append(base.with_(**{"drive.frequency_hz": rng.uniform(10.0 / TURN, 16.0),
                                     "ground.speed": rng.uniform(5e-4, 2e-3)}))
        states.append(rng.normal(size=4) * np.array([1e-4, 1e-6, 1e-3, 1e-5]))
    times = np.sort(rng.uniform(0.0, 0.4, (29, 5)), axis=1)
    wanted = ensemble(systems, times, initial=np.array(states), workers=1)
    assert wanted.finished.all()
    for workers in (1, 2):
        order = rng.permutation(29)
        found = ensemble([systems[k] for k in order], times[order],
                         initial=np.array([states[k] for k in order]), workers=workers)
        assert (found.states == wanted.states[order]).all()
        assert (found.steps == wanted.steps[order]).all()
    for k in (0, 1, 28):
        alone = ensemble(systems[k], times[k], initial=states[k])
        assert (alone.states[0] == wanted.states[k]).all()


def test_a_chain_hands_on_its_states():
    """A chain equals runs one after the other, each from the end of the one before."""
    frequencies = np.linspace(11.0, 16.0, 11)
    systems = [slider().with_(**{"drive.frequency_hz": w / TURN}) for w in frequencies]
    times = np.linspace(0.0, 0.2, 3)
    found = ensemble(systems, times, initial=np.array([1e-4, 0.0]), chain=4, workers=2)
    assert found.finished.all()
    for first in (0, 4, 8):
        state = np.array([1e-4, 0.0])
        for index in range(first, min(first + 4, 11)):
            assert (found.states[index, 0] == state).all()
            alone = ensemble(systems[index], times, initial=state)
            assert (found.states[index] == alone.states[0]).all()
            assert found.steps[index] == alone.steps[0]
            state = alone.states[0, -1]


def test_a_chain_goes_on_behind_a_run_that_failed():
    """From the own initial state of the next one."""
    starts = np.zeros((6, 4))
    starts[0], starts[1, 2], starts[2, 2] = [0.0, -1e50, 0.0, -1e50], 1e-3, 3e-3
    found = ensemble(friction_oscillator(2), [0.0, 0.1], initial=starts, chain=3)
    assert found.finished.tolist() == [False] + [True] * 5
    assert (found.states[1, 0] == starts[1]).all()
    assert (found.states[2, 0] == found.states[1, -1]).all()
    assert (found.states[3, 0] == 0.0).all()
    alone = ensemble(friction_oscillator(2), [0.0, 0.1], initial=starts[1])
    assert (found.states[1] == alone.states[0]).all()


def test_a_run_that_was_left_goes_on_bit_for_bit(monkeypatch):
    systems = [slider().with_(**{"drive.frequency_hz": w / TURN}) for w in np.linspace(11, 16, 13)]
    times = np.linspace(0.0, 0.4, 5)
    wanted = ensemble(systems, times, initial=np.zeros(2))
    monkeypatch.setattr(lane_driver, "_STEPS", 3)
    monkeypatch.setattr(lane_driver, "_DEALT", 2)
    found = ensemble(systems, times, initial=np.zeros(2), workers=1)
    assert (found.states == wanted.states).all()


def test_simd_runs_are_at_work():
    """Runs of very different lengths: a lane that is done takes the next run at once."""
    times = np.linspace(0.0, 1.0, 2) * np.linspace(0.2, 2.0, 240)[::-1, None]
    one = SideBySide(kind_of(slider(), 0.0, 2.0), list(range(240)), [slider()] * 240,
                     lambda _: np.zeros(2), [False] * 240, times, 1e-6, None)
    one.work(1, lambda: True)
    assert one.done == 240
    assert set(one.status) == {Status.FINISHED}
    tried = one.runs.ends[:, 2:].sum()
    assert tried > 0.95 * 8.0 * one.attempts


def many(count, state_of, times=(0.0, 0.2)):
    """Runs of one system in lanes."""
    return SideBySide(kind_of(slider(), *times), list(range(count)), [slider()] * count, state_of,
                      [False] * count, np.tile(times, (count, 1)), 1e-6, None)


def test_initial_states_are_asked_for_once_and_not_before_their_runs():
    asked = []

    def state_of(run):
        asked.append(run)
        return np.zeros(2)

    one, turns = many(100, state_of), iter([True, False])
    assert not asked
    one.work(1, lambda: next(turns))
    assert asked == list(range(32))
    one.work(1, lambda: True)
    assert asked == list(range(100))


def test_parameters_of_a_system_are_looked_up_once(monkeypatch):
    looked_at, own = [], lane_driver.control_for
    monkeypatch.setattr(lane_driver, "control_for", lambda system, *given, **settings: (
        looked_at.append(system) or own(system, *given, **settings)))
    ensemble(slider(), [0.0, 0.1], initial=np.zeros((20, 2)))
    # For the runs, and for the checks of single lanes.
    assert len(looked_at) == 2


def test_checks_of_single_lanes_know_one_set_of_blocks():
    one = many(1, lambda _: np.zeros(2))
    spare = one.spare(one.lanes())
    assert spare.workspace.near is spare.problem.blocks


def test_no_reversal_of_slip_is_missed():
    """A mass that would run 1e-4 faster than its belt for 0.03 s sticks to it instead.

    Unit mass and spring, pressed with 1 N: from then on the amplitude of its velocity is that of
    the belt, whatever the start.
    """
    system = ContactSystem(
        basis([HERTZ], [0.0], ALONG, ALONG), normal=PrescribedForce(1.0),
        friction=ExponentialFriction(0.1, 0.1, 0.0, 1e8), ground=Ground(speed=1.0))
    phases = np.linspace(0.0, 1.2, 25)
    starts = np.column_stack([0.1 - 1.0001 * np.cos(phases), 1.0001 * np.sin(phases)])
    times = np.column_stack([0.0 * phases, 2.5 - phases, 3.5 - phases, 5.0 - phases])
    found = ensemble(system, times, initial=starts, rtol=1e-5)
    amplitude = np.hypot(found.states[:, 1:, 0] - 0.1, found.states[:, 1:, 1])
    assert amplitude == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(("normal", "start"), [
    (RoughSurface(1e6, 1e-5, 0.0), [1.001, 0.0]), (TwoSidedStop(1e6, 2.0), [0.0, 1.0005])])
def test_stops_that_are_met_at_turning_points_alone(normal, start):
    """x'' + x = 0 between stops at one below, and above: they are not passed."""
    system = ContactSystem(basis([HERTZ], [0.0], UP, UP), normal=normal, gap=1.0)
    starts = np.array(start) * np.linspace(1.0, 1.0002, 9)[:, None]
    assert kind_of(system, 0.0, 50.0) is not None
    found = ensemble(system, np.linspace(0.0, 50.0, 5001), initial=starts, rtol=1e-5,
                     solver=LANES_ONLY)
    lowest = found.states[:, :, 0].min(axis=1)
    assert (lowest > -1.0 - 1e-4).all()
    assert (lowest < -0.999).all()
    if isinstance(normal, TwoSidedStop):
        assert (found.states[:, :, 0].max(axis=1) < 1.0 + 1e-4).all()


def test_a_run_that_cannot_go_on_leaves_the_others():
    system, times = friction_oscillator(2), [0.0, 0.1, 0.2]
    starts = np.zeros((3, 4))
    starts[0, 3], starts[1, :] = -1e50, [0.0, -1e59, 0.0, -1e59]
    found = ensemble(system, times, initial=starts)
    assert [status is Status.FINISHED for status in found.status] == [False, False, True]
    assert (found.states[:2, 0] == starts[:2]).all()
    assert np.isnan(found.states[:2, 1:]).all()
    alone = ensemble(system, times, initial=starts[2])
    assert (found.states[2] == alone.states[0]).all()


def test_one_output_time_gives_the_start():
    chained = ensemble(slider(), [0.5], initial=np.array([[1e-3, 0.0], [2e-3, 1e-3]]), chain=2)
    assert chained.states[:, 0].tolist() == [[1e-3, 0.0], [1e-3, 0.0]]
    found = ensemble(slider(), [0.5], initial=np.array([[1e-3, 0.0], [2e-3, 1e-3]]))
    assert found.finished.all()
    assert found.states[:, 0].tolist() == [[1e-3, 0.0], [2e-3, 1e-3]]


def test_longest_step_holds():
    found = ensemble(slider(), [0.0, 0.5], initial=np.zeros((2, 2)), max_step=1e-4)
    assert (found.steps >= 5000).all()


def test_progress_counts_all_runs():
    seen = []
    ensemble(slider(), [0.0, 0.5], initial=np.zeros((20, 2)), progress=seen.append)
    assert seen[-1] == 20


def test_initial_states_that_are_not_finite():
    with pytest.raises(InputError, match="must be finite"):
        ensemble(slider(), [0.0, 0.5], initial=np.full((2, 2), np.nan))


@pytest.mark.parametrize("other", [
    friction_oscillator(2, ground=Ground(speed=1e-3, profile=Sine(1e-4, 2.5e-3))),
    friction_oscillator(2, friction=DahlFriction(0.5, 1e-6)),
    friction_oscillator(2, friction=IwanFriction(1e5, 0.5, 161)),
    block(4, 1), block(1, 2), block(3, 2), block(2, 3),
    friction_oscillator(2, load=Load(14.0, (
        PointLoad("C", "y", signal=Pulse("half-sine", -3.0, 0.01, 0.05)),))),
])
def test_other_systems_are_run_one_by_one(other):
    """Results of other systems are those of single runs bit for bit."""
    assert not side_by_side([other] * 2, lambda _: np.zeros(other.size), np.array([[0.0, 0.1]] * 2),
                            1e-6, None, "auto")
    times, start = np.linspace(0.0, 0.1, 3), np.zeros((2, other.size))
    found = ensemble([other, other], times, initial=start)
    run = driver.start(other, start[0], times, rtol=1e-6, work=False)
    run.advance(10**9)
    assert (found.states == run.states).all()


def test_motion_expanded_in_power_series_is_left_to_them():
    frictionless = ContactSystem(basis([HERTZ], [0.01], UP, UP), normal=LinearContact(1e3, 1.0),
                                 gap=0.5)
    members, times = [frictionless] * 2, np.array([[0.0, 1.0]] * 2)
    starts = np.zeros((2, 2))
    assert side_by_side(members, starts.__getitem__, times, 1e-6, None, "auto") == []
    found = side_by_side(members, starts.__getitem__, times, 1e-6, None, "never")
    assert [one.numbers for one in found] == [[0, 1]]
