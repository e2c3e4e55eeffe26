"""Events, ensembles and derivatives of set-valued runs, against closed forms."""

import numpy as np
import pytest
from set_valued_runs import start_set_valued
from systems import TURN
from systems import belt_of_unit_mass as belt
from systems import last_speed_of_stick_slip as last_speed

import fecontact as fc
from fecontact import Status
from fecontact.bifurcation import Axis, basins
from fecontact.integrate import ContactEvents, Crossing, SetValued, strobe
from fecontact.integrate.nonsmooth.problem import AT_EVENT, IDLE
from fecontact.integrate.step_loop import FINISHED, MINIMUM_STEP, RUNNING, STEP
from fecontact.laws import (
    ConstantFriction,
    Harmonic,
    LinearContact,
    PrescribedForce,
    RoughSurface,
)

UPWARDS = [[0.0], [1.0], [0.0]]
STATIC = SetValued(static_coefficient=1.0)


def ball(**parts):
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [UPWARDS], "C": UPWARDS})
    return fc.ContactSystem(basis, **{"normal": RoughSurface(1e5, 1e-4), "load": fc.Load(10.0),
                                      "friction": ConstantFriction(0.0), **parts})


def test_events_of_stick_and_slip():
    """Stick until x = 1; slip on a circle about x = 1/2 until the speed is that of the belt."""
    passing = Crossing("B", "x", 0.5, sense="falling")
    run = fc.simulate(belt(), 30.0, initial=[0.5, 0.2], outputs=3, solver=STATIC, rtol=1e-11,
                      events=(ContactEvents(), passing))
    slip = 2.0 * np.pi - 2.0 * np.arctan(2.5)
    begins = 2.5 + (5.0 + slip) * np.arange(4)
    assert run.events.only("slip").time == pytest.approx(begins[begins < 30.0], abs=1e-8)
    assert run.events.only("stick").time == pytest.approx(begins[:3] + slip, abs=1e-8)
    assert run.events.only("event 0").time == pytest.approx(
        begins[:3] + np.pi - np.arctan(2.5), abs=1e-8)
    states = run.events.only("slip").states
    assert states == pytest.approx(np.tile([1.0, 0.2], (len(states), 1)), abs=1e-8)
    assert set(run.events.kind) == {"stick", "slip", "event 0"}


@pytest.mark.parametrize("events", [
    ContactEvents(stop="stick"), Crossing("B", "x", 0.5, sense="falling", stop=True)])
def test_a_run_ends_at_an_event(events):
    run = fc.simulate(belt(), 30.0, initial=[0.5, 0.2], outputs=301, solver=STATIC, rtol=1e-11,
                      events=events)
    half = 2.5 + np.pi - np.arctan(2.5)
    end = half if isinstance(events, Crossing) else 2.5 + 2.0 * np.pi - 2.0 * np.arctan(2.5)
    assert run.status is Status.EVENT
    assert run.time[-1] == pytest.approx(end, abs=1e-8)
    assert run.states[-1] == pytest.approx(
        [0.5, -np.sqrt(0.29)] if isinstance(events, Crossing) else [0.0, 0.2], abs=1e-8)
    assert run.time[:-1] == pytest.approx(0.1 * np.arange(len(run.time) - 1), abs=1e-12)


@fc.event
def _velocity(t, y, p):
    return y[1]


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize(("sense", "first", "every"), [("both", 1, 1), ("rising", 1, 2),
                                                       ("falling", 2, 2)])
def test_turning_points_on_ground_at_rest(friction, sense, first, every):
    """The slip ends at each of them: it passes half a period after the one before."""
    system = belt(0.0, friction=ConstantFriction(friction), normal=PrescribedForce(0.1))
    half = 0.5 * TURN
    for watched in (Crossing("B", "x", of="velocity", sense=sense), fc.Event(_velocity, (), sense)):
        run = fc.simulate(system, 9.5 * half, initial=[1.0, 0.0], outputs=3, solver=SetValued(),
                          rtol=1e-10, events=watched)
        assert run.events.time == pytest.approx(half * np.arange(first, 10, every), abs=1e-8)
        assert np.abs(run.events.states[:, 1]).max() < 1e-14


@pytest.mark.parametrize("number", range(3))
def test_slip_that_ends_and_begins_again(number):
    """Velocities that leave zero to the side from which they came have passed nothing."""
    rng = np.random.default_rng(number)
    shapes = rng.normal(size=(4, 4))
    rows = np.zeros((2, 3, 4))
    rows[:, 0] = np.eye(4)[:2]
    basis = fc.basis_from_matrices(np.eye(4), 50.0 * shapes @ shapes.T + 100.0 * np.eye(4),
                                   {"contact": rows, "B": rows[0]}, damping=0.5 * np.eye(4))
    system = fc.ContactSystem(
        basis, normal=PrescribedForce((6.0, 4.0)), friction=ConstantFriction(0.3),
        load=fc.Load(forces=[fc.PointLoad(point="B", component="x", signal=Harmonic(6.0, 0.7))]))
    start = np.concatenate([0.02 * rng.normal(size=4), 0.3 * rng.normal(size=4)])
    run = fc.simulate(system, 4.0, initial=start, outputs=200001, rtol=1e-9, solver=SetValued(),
                      events=[Crossing(node, "x", of="velocity") for node in range(2)])
    for node in range(2):
        speed = run.velocity(node)[:, 0]
        moving = np.abs(speed) > 1e-9
        sides, times = np.sign(speed[moving]), run.time[moving]
        passed = times[1:][sides[1:] != sides[:-1]]
        assert len(passed) > 0
        assert run.events.only(f"event {node}").time == pytest.approx(passed, abs=5e-5)


@pytest.mark.parametrize("events", [
    ContactEvents(stop="slip"), ContactEvents(stop="stick"),
    Crossing("B", "x", 0.1, of="velocity", stop=True)])
def test_runs_from_stop_to_stop(events):
    watched = (ContactEvents() if isinstance(events, ContactEvents) else
               Crossing("B", "x", 0.1, of="velocity"))
    whole = fc.simulate(belt(), 30.0, initial=[0.5, 0.2], outputs=3, solver=STATIC, rtol=1e-11,
                        events=watched)
    kind = events.stop[0] if isinstance(events, ContactEvents) else "event 0"
    expected = whole.events.only(kind).time
    run, found = [0.5, 0.2], []
    while len(found) <= len(expected):
        run = fc.simulate(belt(), 30.0, initial=run, outputs=3, solver=STATIC, rtol=1e-11,
                          events=events)
        found.append(run.time[-1])
    assert len(expected) > 1
    assert found == pytest.approx([*expected, 30.0], abs=1e-7)


def test_events_of_a_bouncing_ball():
    e = 0.6
    run = fc.simulate(ball(), 6.0, initial=[1.0, 0.0], outputs=3, rtol=1e-10,
                      solver=SetValued(restitution=e), events=ContactEvents())
    down, up = run.events.only("touch-down"), run.events.only("lift-off")
    moments = np.sqrt(0.2) * (1.0 + 2.0 * np.cumsum(np.concatenate([[0.0], e ** np.arange(1, 15)])))
    assert down.time[:15] == pytest.approx(moments, abs=1e-10)
    assert up.time[:15] == pytest.approx(moments, abs=1e-10)
    assert down.states[0, 1] == pytest.approx(e * 10.0 * np.sqrt(0.2), rel=1e-10)
    # It comes to rest at the last.
    assert len(down) == len(up) + 1
    assert down.time[-1] == pytest.approx(np.sqrt(0.2) * (1 + e) / (1 - e), rel=1e-5)


def test_events_of_compliant_contact_while_it_slips():
    """A mass that bounces on a spring while it slides: contact for a known time."""
    rows = np.eye(3)[:, :2]
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": [rows], "C": rows})
    system = fc.ContactSystem(basis, normal=LinearContact(1e4), friction=ConstantFriction(0.1))
    C = basis.T[1, :2]
    state = np.concatenate([np.linalg.solve(C, [0.0, 0.1]), np.linalg.solve(C, [5.0, -1.0])])
    run = fc.simulate(system, 0.3, initial=state, outputs=3, solver=SetValued(), rtol=1e-10,
                      events=ContactEvents())
    assert run.events.kind == ("touch-down", "lift-off")
    assert run.events.time == pytest.approx([0.1, 0.1 + np.pi / 100.0], abs=1e-9)


def test_ensemble_gives_what_single_runs_give():
    starts = np.array([[0.5, 0.2], [0.1, -0.3], [2.0, 0.0]])
    times = np.linspace(0.0, 12.0, 5)
    found = [fc.ensemble(belt(), times, initial=starts, solver=STATIC, rtol=1e-9,
                         events=ContactEvents(), workers=workers) for workers in (1, 2)]
    for k, start in enumerate(starts):
        run = fc.simulate(belt(), 12.0, initial=start, outputs=times, solver=STATIC, rtol=1e-9,
                          events=ContactEvents())
        for each in found:
            assert (each.states[k] == run.states).all()
            assert (each.events[k].time == run.events.time).all()
            assert each.steps[k] == run.statistics["steps"]
    assert found[0].finished.all()
    chained = fc.ensemble([belt(), belt()], times[:2], initial=starts[0], solver=STATIC, chain=2)
    assert (chained.states[1, 0] == chained.states[0, 1]).all()


def test_strobed_states_of_den_hartogs_oscillator():
    """Force cos(w t) and friction 0.4 over the stiffness, at 0.8 of the resonance."""
    system = belt(0.0, friction=ConstantFriction(0.4), drive=fc.Drive(
        stiffness_x=1.0, amplitude_x=1.0, frequency_hz=0.8 * np.sqrt(2.0) / TURN))
    found = strobe(system, transient_periods=60, keep=4, initial=np.zeros(2), solver=SetValued(),
                   rtol=1e-10)
    assert np.ptp(found.states[0], axis=0) == pytest.approx(0.0, abs=1e-6)


def test_derivatives_through_the_end_of_slip():
    """A circle about x = 1/2 from (x, v) keeps only x: dx = cos(t) dx + sin(t) dv."""
    start, end = np.array([1.0, -0.1]), 7.0
    run = fc.simulate(belt(), end, initial=start, solver=STATIC, rtol=1e-11,
                      events=ContactEvents())
    assert run.events.kind == ("stick",)
    sticks = float(run.events.time[0])
    found = fc.sensitivity(belt(), end, initial=start, parameter="ground.speed", solver=STATIC)
    assert found.monodromy == pytest.approx(
        np.array([[np.cos(sticks), np.sin(sticks)], [0.0, 0.0]]), abs=1e-6)
    # The belt carries it from there on.
    assert found.parameter_derivative == pytest.approx([end - sticks, 1.0], abs=1e-6)


def test_multipliers_of_stick_slip():
    """One is trivial, and stick makes the other zero."""
    period = 5.0 + 2.0 * np.pi - 2.0 * np.arctan(2.5)
    start = [0.5, -np.sqrt(0.29)]
    found = fc.sensitivity(belt(), period, initial=start, solver=STATIC)
    assert found.states[-1] == pytest.approx(start, abs=1e-7)
    multipliers = np.linalg.eigvals(found.monodromy)
    assert np.sort(np.abs(multipliers)) == pytest.approx([0.0, 1.0], abs=1e-5)


def test_end_of_stick_slip_over_the_speed_of_the_belt():
    """Followed by runs alone: below the last speed slip ends again, above it never does."""
    dashpot = 0.1
    last = last_speed(dashpot)
    speeds = last * np.array([0.5, 0.9, 1.0 - 1e-6, 1.0 + 1e-6, 1.1])
    found = fc.ensemble([belt(speed, dashpot) for speed in speeds], [0.0, 300.0],
                        initial=[[0.9 - dashpot * speed, speed] for speed in speeds],
                        solver=STATIC, rtol=1e-11, events=ContactEvents())
    again = [len(events.only("stick")) > 0 for events in found.events]
    assert again == [True, True, True, False, False]
    # Above it the mass comes to rest in the steady state.
    assert found.states[-1, -1] == pytest.approx([0.5, 0.0], abs=1e-5)


def test_basins_of_stick_slip_and_steady_sliding():
    """Below the last speed both exist, and a start that never meets the belt's speed spirals in."""
    dashpot = 0.1
    speed = 0.6 * last_speed(dashpot)
    places = 0.5 + np.array([0.2 * speed, 0.5 * speed, 1.0])
    found = basins(belt(speed, dashpot), (Axis("B", "x"), places),
                   (Axis("B", "x", of="velocity"), [0.0, 0.1 * speed]), transient=150.0,
                   section=Crossing("B", "x", 0.5, sense="falling"), solver=STATIC)
    labels = found.label
    assert labels[0, 0] == labels[1, 1] != labels[2, 0] == labels[2, 1]


@pytest.mark.parametrize(("system", "end", "options"), [
    (belt(), 30.0, {"method": "event-driven"}), (belt(), 30.0, {"method": "time-stepping"}),
    (ball(), 3.0, {"restitution": 0.6}),
])
def test_runs_in_pieces_are_the_same_to_the_last_bit(system, end, options):
    times = np.linspace(0.0, end, 301)
    found = []
    for piece in (1, 7, 10**6):
        run = start_set_valued(system, np.array([0.5, 0.2]), times, rtol=1e-6, **options)
        while (status := run.advance(piece)) == RUNNING:
            pass
        assert status == FINISHED
        found.append((run.output.states, run.output.friction, run.progress.numbers,
                      run.progress.counts))
    for other in found[:2]:
        for one, whole in zip(other, found[2], strict=True):
            np.testing.assert_array_equal(one, whole)


def test_a_run_without_time_between_its_events_ends_whatever_its_pieces():
    run = start_set_valued(belt(), np.array([0.5, 0.2]), np.linspace(0.0, 30.0, 301), rtol=1e-6)
    run.advance(5)
    # State after many changes of contact without progress in time, in calls before.
    run.progress.counts[[IDLE, AT_EVENT]] = 200, 1
    run.progress.numbers[STEP] = 0.0
    assert run.advance(1) == MINIMUM_STEP
