"""Touches, slip reversals and crossings within a step, against closed forms."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from set_valued_runs import start_set_valued
from systems import TURN, basis

from fecontact import (
    ContactSystem,
    Event,
    Ground,
    InputError,
    Load,
    Status,
    ensemble,
    event,
    sensitivity,
    simulate,
)
from fecontact.integrate import ContactEvents, Crossing, Rodas5P, Scipy
from fecontact.laws import (
    ExponentialFriction,
    HarmonicSpeed,
    LinearContact,
    PrescribedForce,
    Profile,
    RoughSurface,
    TwoSidedStop,
    ground_profile,
)

UP = np.array([[0.0], [1.0]])
ALONG = np.array([[1.0], [0.0]])
HERTZ = 0.5 / np.pi


def swing(normal, gap=1.0, frequency=HERTZ):
    """x'' + w^2 x = 0 in y, with w = 1 rad/s by default, over ground one below."""
    return ContactSystem(basis([frequency], [0.0], UP, UP), normal=normal, gap=gap)


def touches(amplitude, stiffness, t_end):
    """Times of touch-down: free swings between contacts on a spring without damping."""
    speed, w = np.sqrt(amplitude**2 - 1.0), np.sqrt(1.0 + stiffness)
    first = np.arccos(-1.0 / amplitude)
    contact = 2.0 * np.arctan(speed * w) / w
    times = first + np.arange(int(t_end)) * (2.0 * first + contact)
    return times[times < t_end]


@pytest.mark.parametrize("amplitude", [1.01, 1.001, 1.0001])
def test_no_touch_is_missed(amplitude):
    """A stop that is met at the turning points alone, each by a closed form, however long."""
    found = {}
    for t_end in (100.0, 1000.0):
        run = simulate(swing(LinearContact(1e6)), t_end, initial=np.array([amplitude, 0.0]),
                       outputs=int(10 * t_end) + 1, events=ContactEvents())
        assert run.status is Status.FINISHED
        down = run.events.only("touch-down").time
        wanted = touches(amplitude, 1e6, t_end)
        assert len(down) == len(run.events.only("lift-off").time) == len(wanted)
        early = wanted < 100.0
        assert down[early] == pytest.approx(wanted[early], abs=2e-3)
        depth = np.sqrt(amplitude**2 - 1.0) / np.sqrt(1.0 + 1e6)
        assert run.states[:, 0].min() > -1.0 - 1.05 * depth
        assert run.energies.imbalance < 2e-5 * t_end / 100.0
        found[t_end] = run.states[:1000]
    assert found[100.0] == pytest.approx(found[1000.0], abs=1e-6)


def test_touches_of_a_surface_that_is_soft_at_first():
    """Rough ground, whose stiffness begins at zero: the same energy after each impact."""
    run = simulate(swing(RoughSurface(1e6, 1e-5, 0.0)), 100.0, initial=np.array([1.001, 0.0]),
                   outputs=10001, rtol=1e-4)
    assert run.status is Status.FINISHED
    assert run.states[:, 0].min() > -1.0 - 1e-4
    assert run.states[9000:, 0].max() == pytest.approx(1.001, abs=3e-4)


def test_both_stops_are_met():
    """Play of 2 about the middle: stops above and below, met at the turning points alone."""
    run = simulate(swing(TwoSidedStop(1e6, 2.0)), 60.0, initial=np.array([0.0, 1.0005]),
                   outputs=6001, rtol=1e-5)
    assert run.status is Status.FINISHED
    assert np.abs(run.states[:, 0]).max() < 1.0 + 4e-5


def sliding(excess, friction, phase=0.0, **parts):
    """A unit mass on a spring, w = 1 rad/s, pressed with 1 N on a belt of 1 m/s."""
    system = ContactSystem(
        basis([HERTZ], [0.0], ALONG, ALONG), normal=PrescribedForce(1.0),
        friction=ExponentialFriction(friction, friction, 0.0, 1e8), ground=Ground(speed=1.0),
        **parts)
    # Slipping back all the time, it swings about the place to which friction pulls it.
    return system, np.array([friction - (1.0 + excess) * np.cos(phase),
                             (1.0 + excess) * np.sin(phase)])


def test_no_reversal_of_slip_is_missed():
    """A mass that would run 1e-4 faster than its belt for 0.03 s sticks to it instead.

    From then on the amplitude of its velocity is that of the belt. By how much the first step
    that could miss that is shifted depends on the start.
    """
    for phase in np.linspace(0.0, 1.2, 25):
        system, start = sliding(1e-4, 0.1, phase)
        run = simulate(system, 5.0 - phase, initial=start, outputs=501, rtol=1e-5)
        assert run.status is Status.FINISHED
        late = run.time > 2.0 - phase
        amplitude = np.hypot(run.states[late, 0] - 0.1, run.states[late, 1])
        assert amplitude == pytest.approx(1.0, abs=1e-5)


def test_reversal_on_a_belt_whose_speed_changes():
    """Reversal on a belt whose speed swings: bounds on its speed, not polynomials."""
    for phase in np.linspace(0.0, 1.2, 25):
        system, start = sliding(1e-4, 0.1, phase)
        system = system.with_(ground=Ground(speed=1.0, motion=HarmonicSpeed(1e-5, 0.3 / TURN)))
        coarse, fine = (simulate(system, 3.0 - phase, initial=start, outputs=101, rtol=1e-5,
                                 max_step=step) for step in (None, 1e-3))
        assert coarse.states == pytest.approx(fine.states, abs=2e-5)


def test_crests_that_pass_between_the_stages():
    """A mass that floats 1e-4 below the crests of waves is struck by the first that passes."""
    waves = Ground(speed=-1.0, amplitude=0.1, wavelength=1.0)
    system = ContactSystem(basis([0.0], [0.0], UP, UP), normal=RoughSurface(1e3, 1e-5, 0.0),
                           ground=waves)
    for height in (0.0999, 0.099):
        coarse, fine = (simulate(system, 3.0, initial=np.array([height, 0.0]), outputs=31,
                                 rtol=1e-7, max_step=step) for step in (None, 1e-4))
        # Thrown up once and for all.
        assert fine.states[-1, 1] > 5e-4
        assert coarse.states == pytest.approx(fine.states, rel=1e-4, abs=1e-6)


def thrown():
    """A unit mass under 10 m/s2, whose motion every step resolves exactly."""
    return ContactSystem(basis([0.0], [0.0], UP, UP), normal=LinearContact(1.0), load=Load(10.0),
                         gap=100.0)


def test_crossings_close_to_each_other_within_a_step():
    """Up and down again through places just below the highest, 5 m after 1 s."""
    below = [1e-2, 1e-6, 1e-10]
    run = simulate(thrown(), 2.0, initial=np.array([0.0, 10.0]), rtol=1e-3, outputs=3,
                   events=[Crossing("B", "y", 5.0 - d) for d in below])
    assert run.statistics["steps"] < 40
    for k, d in enumerate(below):
        times = run.events.only(f"event {k}").time
        assert times == pytest.approx([1.0 - np.sqrt(d / 5.0), 1.0 + np.sqrt(d / 5.0)], abs=1e-7)


def test_touches_too_soft_to_matter_are_events_all_the_same():
    run = simulate(swing(LinearContact(1e-9)), 20.0, initial=np.array([1.0001, 0.0]), outputs=3,
                   rtol=1e-5, events=ContactEvents())
    first = np.arccos(-1.0 / 1.0001)
    wanted = first + 2.0 * np.pi * np.arange(3)
    assert run.events.only("touch-down").time == pytest.approx(wanted, abs=1e-3)
    assert run.events.only("lift-off").time == pytest.approx(
        wanted + 2.0 * (np.pi - first), abs=1e-3)


@event
def _above(t, y, p):
    return y[0] - p[0]


def test_functions_of_ones_own_are_looked_at_more_often():
    """Two changes of sign a tenth of a step apart."""
    run = simulate(thrown(), 2.0, initial=np.array([0.0, 10.0]), rtol=1e-3, outputs=3,
                   max_step=0.5, events=Event(_above, [4.99]))
    assert run.events.time == pytest.approx([1.0 - np.sqrt(0.002), 1.0 + np.sqrt(0.002)], abs=1e-9)


@pytest.mark.parametrize("solver", [Rodas5P(), Scipy("Radau"), Scipy("BDF"), Scipy("LSODA")],
                         ids=lambda solver: solver.name)
def test_longest_step(solver):
    free = simulate(thrown(), 1.0, initial=np.array([0.0, 0.0]), solver=solver, outputs=2)
    run = simulate(thrown(), 1.0, initial=np.array([0.0, 0.0]), solver=solver, outputs=2,
                   max_step=1e-3)
    assert run.statistics["steps"] >= 1000 > free.statistics["steps"]
    assert run.states[-1] == pytest.approx([-5.0, -10.0], rel=1e-4)


@pytest.mark.parametrize(("step", "longest"), [(None, 0.02), (1e-3, 1e-3), (10.0, 0.02)])
def test_longest_step_of_set_valued_runs(step, longest):
    """The longest step is handed on, unless signals or the run ask for a shorter one."""
    run = start_set_valued(thrown(), np.zeros(2), np.array([0.0, 1.0]), restitution=0.0,
                           max_step=step)
    assert run.loop.args[0].limits.longest == pytest.approx(longest)


def test_longest_step_of_other_runs():
    times = np.array([0.0, 1.0])
    limited = ensemble(thrown(), times, initial=np.zeros(2), max_step=1e-3)
    assert limited.steps[0] >= 1000
    coarse = sensitivity(thrown(), 1.0, initial=np.zeros(2), max_step=0.1)
    assert coarse.monodromy == pytest.approx(np.array([[1.0, 1.0], [0.0, 1.0]]))
    for wrong in (0.0, -1.0, np.nan, np.inf, "1", True):
        for run in (lambda step: simulate(thrown(), 1.0, initial=np.zeros(2), max_step=step),
                    lambda step: ensemble(thrown(), times, initial=np.zeros(2), max_step=step),
                    lambda step: sensitivity(thrown(), 1.0, initial=np.zeros(2), max_step=step)):
            with pytest.raises(InputError, match=r"max_step = .* must be a finite time above zero"):
                run(wrong)


@ground_profile
def _tilted(xi, p):
    return p[0] + 0.1 * xi, 0.1, 0.0


@dataclass(frozen=True)
class Tilted(Profile):
    kernel: ClassVar = _tilted
    shortest_wavelength: ClassVar = 1.0


def test_profiles_that_do_not_say_their_bounds_are_named():
    system = thrown().with_(ground=Ground(profile=Tilted()))
    with pytest.raises(InputError, match=r"Tilted\(\) must say its height_range and its steepest_"):
        simulate(system, 1.0, initial=np.zeros(2))
