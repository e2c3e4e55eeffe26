"""Events located in time: closed forms of drops, decays and stick-slip; stops; users' events."""

import numpy as np
import pytest
from systems import basis, friction_oscillator, impact_oscillator

from fecontact import (
    ContactSystem,
    Event,
    InputError,
    Load,
    Status,
    event,
    read_case,
    simulate,
    write_case,
)
from fecontact.integrate import (
    CVODE,
    Auto,
    ContactEvents,
    Crossing,
    PowerSeries,
    Radau,
    Rodas5P,
    Scipy,
)
from fecontact.integrate.reference.watched import _set_interpolant
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.rodas5p.checkpoint import Checkpoint
from fecontact.integrate.rodas5p.driver import start
from fecontact.laws import JenkinsFriction, LinearContact


def drop():
    """SDND108: mass 1, gravity 10, a spring of 100 whose top lies 2 below the start."""
    shape = np.array([[0.0], [1.0]])
    return ContactSystem(basis([0.0], [0.0], shape, shape), normal=LinearContact(100.0, 0.0),
                         load=Load(10.0), gap=2.0)


START = np.array([0.0, -1.0])
# Solvers that locate events, and the error of their times at rtol = 1e-10.
LOCATING = pytest.mark.parametrize(("solver", "error"), [
    (Rodas5P(), 1e-9), (PowerSeries(), 1e-10), (Scipy("Radau"), 1e-7), (Scipy("BDF"), 1e-7),
    (Scipy("LSODA"), 1e-7), (CVODE(), 1e-7)], ids=lambda one: getattr(one, "name", None))


@LOCATING
def test_drop_on_a_spring(solver, error):
    run = simulate(drop(), 1.1, initial=START, outputs=3, events=ContactEvents(), rtol=1e-10,
                   solver=solver)
    assert run.events.only("touch-down").time == pytest.approx([0.54031242374328], abs=error)
    assert run.events.only("lift-off").time == pytest.approx([0.88545615307643], abs=error)
    assert run.events.states[0, 0] == pytest.approx(-2.0, abs=10.0 * error)
    assert (run.events.node == 0).all()
    assert run.status is Status.FINISHED
    # Frictionless: x never moves, so the node sticks while it touches.
    assert run.events.kind == ("touch-down", "stick", "lift-off")


@LOCATING
@pytest.mark.parametrize(("stop", "when"), [
    ("touch-down", 0.54031242374328), ("lift-off", 0.88545615307643)])
def test_a_run_stops_at_an_event(stop, when, solver, error):
    run = simulate(drop(), 1.1, initial=START, outputs=111, events=ContactEvents(stop=stop),
                   rtol=1e-10, solver=solver)
    assert run.status is Status.EVENT
    assert run.time[-1] == pytest.approx(when, abs=error)
    assert run.events.time[-1] == run.time[-1]
    assert run.states[-1] == pytest.approx(run.events.states[-1])
    assert len(run.time) == 2 + int(when / 0.01)
    assert run.energies.imbalance < 10.0 * error
    whole = simulate(drop(), 1.1, initial=START, outputs=111, rtol=1e-10)
    assert run.states[:-1] == pytest.approx(whole.states[: len(run.time) - 1], abs=10.0 * error)


@LOCATING
@pytest.mark.parametrize("stop", ["touch-down", "lift-off"])
def test_runs_from_stop_to_stop(stop, solver, error):
    """A mass that bounces on a spring: a run goes on from the event at which the last ended."""
    settings = {"outputs": 3, "rtol": 1e-10, "solver": solver}
    whole = simulate(drop(), 4.0, initial=START, events=ContactEvents(), **settings)
    expected = whole.events.only(stop).time
    run, found = START, []
    while len(found) < len(expected):
        run = simulate(drop(), 4.0, initial=run, events=ContactEvents(stop=stop), **settings)
        assert run.status is Status.EVENT
        assert run.events.kind.count(stop) == 1
        found.append(run.time[-1])
    assert len(expected) > 1
    assert found == pytest.approx(expected, abs=10.0 * error)


def test_turning_points_are_crossings():
    """Free fall from 1 m/s upwards is highest after 0.1 s, 0.05 m higher."""
    top = Crossing("B", "y", of="velocity", sense="falling")
    run = simulate(drop(), 0.5, initial=np.array([0.0, 1.0]), events=top, rtol=1e-10)
    assert run.events.time == pytest.approx([0.1], abs=1e-10)
    assert run.events.states[0] == pytest.approx([0.05, 0.0], abs=1e-9)
    assert run.events.kind == ("event 0",)
    assert run.events.node.tolist() == [-1]
    rising = Crossing("B", "y", of="velocity", sense="rising")
    assert len(simulate(drop(), 0.5, initial=np.array([0.0, 1.0]), events=rising).events) == 0


@event
def _energy(t, y, p):
    return 0.5 * y[1] ** 2 - p[0]


@pytest.mark.parametrize("solver", [Auto(), Scipy("Radau"), Scipy("BDF"), Scipy("LSODA"), CVODE()],
                         ids=lambda one: one.name)
def test_own_events(solver):
    """Free fall with 10 m/s2 from rest: 2 J of kinetic energy at t = 0.2 s."""
    run = simulate(drop(), 0.5, initial=np.zeros(2), rtol=1e-10, solver=solver,
                   events=[Event(_energy, [2.0], stop=True), Crossing("B", "y", value=-0.05)])
    assert run.events.kind == ("event 1", "event 0")
    assert run.events.time == pytest.approx([0.1, 0.2], abs=1e-10 if solver == Auto() else 1e-8)
    assert run.status is Status.EVENT


def test_stick_and_slip_of_the_belt_oscillator():
    """Without excitation, constant normal force: period 1.264348 s of the smoothed law."""
    system = friction_oscillator(2, **{"drive.amplitude_x": 0.0})
    run = simulate(system, 9.0, outputs=90001, events=ContactEvents(), rtol=1e-8)
    slips, sticks = run.events.only("slip").time, run.events.only("stick").time
    assert np.diff(slips)[2:] == pytest.approx(1.264348, rel=1e-4)
    assert np.diff(sticks)[2:] == pytest.approx(1.264348, rel=1e-4)
    state = run.contact_state[:, 0]
    changed = np.flatnonzero(np.diff(state) != 0)
    found = run.events.time[[kind in ("stick", "slip") for kind in run.events.kind]]
    found = found[found > 0.0]
    assert len(found) == len(changed)
    assert (run.time[changed] <= found).all()
    assert (found <= run.time[changed + 1]).all()


@pytest.mark.parametrize("solver", [Scipy("Radau"), CVODE()],
                         ids=lambda one: one.name)
@pytest.mark.parametrize(("parts", "end"), [
    ({"drive.amplitude_x": 0.0}, 3.0), ({"friction": JenkinsFriction(2e5, 0.4)}, 1.0)],
    ids=["Stribeck", "Jenkins"])
def test_other_solvers_find_the_events_of_the_compiled_one(solver, parts, end):
    """Stick and slip, and passages either way, with elements that end to slide within steps."""
    system = friction_oscillator(2, **parts)
    settings = {"rtol": 1e-7, "outputs": 11,
                "events": [ContactEvents(), Crossing("B", "x", of="velocity")]}
    own = simulate(system, end, **settings).events
    other = simulate(system, end, solver=solver, **settings).events
    assert {"stick", "slip", "event 0"} <= set(own.kind)
    assert other.kind == own.kind
    assert (other.node == own.node).all()
    assert other.time == pytest.approx(own.time, abs=2e-5)
    assert other.states[:, :2] == pytest.approx(own.states[:, :2], abs=2e-6)


def test_pieces_of_steps_of_other_solvers_are_exact_to_degree_four():
    """Five states determine the polynomial that the search takes."""
    coefficients = np.array([[0.3, -1.0], [2.0, 0.5], [-0.7, 1.5], [1.1, -2.0], [0.9, 0.4]])

    def course(s):
        return sum(c * s**k for k, c in enumerate(coefficients))

    run = start(drop(), START, np.array([0.0, 1.0]), rtol=1e-6, work=False, method="rodas5p")
    _set_interpolant(np.array([course(s) for s in np.linspace(0.0, 1.0, 5)]), run.progress,
                     run.workspace)
    for s in (0.0, 0.1, 0.4, 0.8, 1.0):
        found = [tableau.one_interpolated.py_func(s, k, run.progress.state, run.workspace.after,
                                                  run.workspace.dense) for k in range(2)]
        assert found == pytest.approx(course(s), rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("solver", [Scipy("BDF"), CVODE()], ids=lambda one: one.name)
def test_events_do_not_change_the_steps_of_other_solvers(solver):
    settings = {"initial": START, "outputs": 23, "rtol": 1e-7, "solver": solver}
    alone = simulate(drop(), 1.1, **settings)
    watched = simulate(drop(), 1.1, **settings, events=[ContactEvents(), Crossing("B", "y")])
    np.testing.assert_array_equal(watched.states, alone.states)
    assert watched.statistics["steps"] == alone.statistics["steps"]


def test_friction_with_memory_by_the_same_definition_as_plots():
    system = friction_oscillator(2, friction=JenkinsFriction(2e5, 0.4))
    run = simulate(system, 1.5, outputs=30001, events=ContactEvents(), rtol=1e-7)
    state = run.contact_state[:, 0]
    changed = np.flatnonzero(np.diff(state) != 0)
    found = run.events.time[1:] if run.events.time[0] == 0.0 else run.events.time
    assert len(changed) > 5
    assert len(found) == len(changed)
    assert (run.time[changed] <= found + 1e-9).all()
    assert (found <= run.time[changed + 1] + 1e-9).all()


def test_many_impacts_fill_the_table_more_than_once():
    """Chatter: hundreds of events, each touch-down followed by a lift-off of the same node."""
    system = impact_oscillator(2, 9.845)
    run = simulate(system, 12.0, initial=np.zeros(4), events=ContactEvents())
    assert len(run.events) > 300
    assert (np.diff(run.events.time) >= 0.0).all()
    down, up = run.events.only("touch-down", node=0).time, run.events.only("lift-off").time
    count = min(len(down), len(up))
    assert (down[:count] < up[:count]).all()
    assert (up[: count - 1] < down[1:count]).all()
    plain = simulate(system, 12.0, initial=np.zeros(4))
    assert (plain.states == run.states).all()


def test_events_are_stored(tmp_path):
    run = simulate(impact_oscillator(2), 0.5, initial=np.zeros(4), events=ContactEvents())
    stored = read_case(write_case(tmp_path / "run.h5", run)).trajectory.events
    assert len(stored) > 5
    assert (stored.time == run.events.time).all()
    assert stored.kind == run.events.kind
    assert (stored.node == run.events.node).all()
    assert (stored.states == run.events.states).all()


def test_bad_input():
    with pytest.raises(InputError, match="'touchdown' must be one of"):
        ContactEvents(stop="touchdown")
    with pytest.raises(InputError, match="component = 'w'"):
        Crossing("B", "w")
    with pytest.raises(InputError, match="component 'z' at 'B' must be one of 'phi', 'x', 'y'"):
        simulate(drop(), 1.0, initial=START, events=[Crossing("B", "z")])
    with pytest.raises(InputError, match="sense = 'up'"):
        Crossing("B", "x", sense="up")
    with pytest.raises(InputError, match="value = nan"):
        Crossing("B", "x", value=float("nan"))
    with pytest.raises(InputError, match="events: 'touch-down' must be"):
        simulate(drop(), 1.0, initial=START, events=["touch-down"])
    with pytest.raises(InputError, match=r"Radau\(.*\) is not one that locates events; take"):
        simulate(drop(), 1.0, initial=START, events=ContactEvents(), solver=Radau())


def test_events_of_the_piece_that_is_interrupted_are_kept():
    """A signal that comes while compiled code runs shows when that has returned."""
    given = impact_oscillator(2, 9.845), np.zeros(4), np.linspace(0.0, 30.0, 301)
    run, whole = (start(*given, rtol=1e-6, events=[ContactEvents()], method="rodas5p")
                  for _ in range(2))
    step = run._loop

    def interrupted(steps):
        step(steps)
        raise KeyboardInterrupt

    vars(run)["_loop"] = interrupted
    with pytest.raises(KeyboardInterrupt):
        run.advance(2000)
    whole.advance(2000)
    assert run.time == whole.time
    assert len(whole.events) > 10
    assert np.array_equal(run.events.time, whole.events.time)


def test_events_survive_a_checkpoint(tmp_path):
    """A run that is interrupted and taken up again finds the same events."""
    system, file = impact_oscillator(2, 9.845), tmp_path / "run.checkpoint"
    whole = simulate(system, 30.0, initial=np.zeros(4), events=ContactEvents(),
                     solver=Rodas5P())

    def stop(time):
        if time > 5.0:
            raise KeyboardInterrupt

    part = simulate(system, 30.0, initial=np.zeros(4), events=ContactEvents(),
                    solver=Rodas5P(file), progress=stop)
    assert part.status is Status.INTERRUPTED
    rest = simulate(system, 30.0, initial=np.zeros(4), events=ContactEvents(),
                    solver=Rodas5P(file))
    assert 0 < len(part.events) < len(whole.events)
    assert (rest.events.time == whole.events.time).all()
    assert rest.events.kind == whole.events.kind
    assert (rest.events.states == whole.events.states).all()
    assert (rest.states == whole.states).all()


def test_kinds_and_functions_that_are_no_events_are_named():
    run = simulate(drop(), 1.0, initial=np.zeros(2), events=ContactEvents())
    with pytest.raises(InputError, match=r"kind = 'touchdown' must be one of 'lift-off', "):
        run.events.only("touchdown")
    assert len(run.events.only("event 0")) == 0

    @event
    def root(t, y, p):
        return np.sqrt(0.5 - t)

    with pytest.raises(InputError, match=r"'event 0' is not a finite number before t = "):
        simulate(drop(), 1.0, initial=np.zeros(2), events=Event(root))

    @event
    def beyond(t, y, p):
        return y[0] - p[3]

    with pytest.raises(InputError, match=r"beyond .* states: 2, parameters: 1; give as many"):
        simulate(drop(), 1.0, initial=np.zeros(2), events=Event(beyond, [1.0]))


@pytest.mark.long
def test_more_events_than_steps_of_a_piece(tmp_path, monkeypatch):
    """80,000 turning points of a fast oscillator fill the table of events hundreds of times.

    Progress is reported, and the checkpoint is kept, all along.
    """
    monkeypatch.setattr(Checkpoint, "keep", Checkpoint.write)
    shape = np.array([[0.0], [1.0]])
    system = ContactSystem(basis([1000.0], [0.0], shape, shape), normal=LinearContact(1.0),
                           gap=10.0)
    file, told = tmp_path / "run.checkpoint", []

    def tell(time):
        told.append((time, file.exists()))

    run = simulate(system, 40.0, initial=np.array([1e-3, 0.0]), outputs=3, rtol=1e-5,
                   events=[Crossing("B", "y", of="velocity"), ContactEvents()], progress=tell,
                   solver=Rodas5P(file))
    assert run.status is Status.FINISHED
    assert len(run.events.only("event 0")) in (79_999, 80_000, 80_001)
    times = [time for time, _ in told]
    assert len(times) > 3
    assert (np.diff(times) > 0.0).all()
    assert all(there for _, there in told[1:])
    assert not file.exists()
