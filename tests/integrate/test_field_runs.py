"""Runs of vector fields: order of convergence, stiff problems, events, fields of Python."""

import numpy as np
import pytest
from fields_in_time import LORENZ, Pendulum
from scipy.integrate import quad, solve_ivp
from systems import TURN, impact_oscillator

import fecontact as fc
from fecontact.bifurcation import (
    VectorField,
    contact_field,
    lyapunov_exponents,
    periodic_motion,
    vector_field,
)
from fecontact.integrate import ContactEvents, Crossing, PowerSeries, Rodas5P, Scipy
from fecontact.integrate.field_runs.stepper import start_field


def forced(t, x, p, out):
    """x = cos(w t) + sin(t), v = x', beside a stiff state that follows cos(t)."""
    out[0] = x[1]
    out[1] = -p[0] ** 2 * x[0] + (p[0] ** 2 - 1.0) * np.sin(t)
    out[2] = -50.0 * (x[2] - np.cos(t)) - np.sin(t)


def forced_exactly(t, w=2.0):
    return np.stack([np.cos(w * t) + np.sin(t), -w * np.sin(w * t) + np.cos(t), np.cos(t)], axis=-1)


FORCED = vector_field(forced, {"w": 2.0}, ["x", "v", "z"], period=lambda p: 2.0 * np.pi)


def rates(field):
    """The rates of a field as other programs take them."""
    return lambda t, x: field.rates(np.array([t]), np.array(x).reshape(1, -1), field.values)[0]


@pytest.mark.parametrize("way", ["complex", "differences", "jacobian"])
def test_errors_fall_with_the_fifth_power_of_the_step(way):
    def jacobian(t, x, p, out):
        out[:, :] = 0.0
        out[0, 1], out[1, 0], out[2, 2] = 1.0, -p[0] ** 2, -50.0

    options = {"jacobian": jacobian} if way == "jacobian" else {"differentiation": way}
    field = vector_field(forced, {"w": 2.0}, 3, **options)
    errors = []
    for steps in (40, 80, 160):
        run = fc.simulate(field, 4.0, initial=forced_exactly(0.0), outputs=2, rtol=1e-2,
                          max_step=4.0 / steps)
        assert steps <= run.statistics["steps"] <= steps + 2  # the first ones are shorter
        errors.append(np.abs(run.states[-1] - forced_exactly(4.0)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 4.7) & (orders < 5.6)).all(), orders


def test_outputs_between_steps_are_as_good_as_the_tolerance():
    for rtol, allowed in ((1e-6, 3e-5), (1e-9, 3e-8)):
        run = fc.simulate(FORCED, 20.0, initial=forced_exactly(0.0), outputs=777, rtol=rtol)
        assert np.abs(run.states - forced_exactly(run.time)).max() < allowed
        assert run.statistics["steps"] < 700
    assert run.statistics["method"] == "rodas5p"


def test_runs_agree_with_dop853():
    start, times = np.array([1.0, 1.0, 1.0]), np.linspace(0.0, 5.0, 26)
    known = solve_ivp(rates(LORENZ), (0.0, 5.0), start, method="DOP853", rtol=1e-13, atol=1e-13,
                      t_eval=times)
    run = fc.simulate(LORENZ, 5.0, initial=start, outputs=times, rtol=1e-11)
    assert np.abs(run.states - known.y.T).max() < 1e-8
    # The growth of errors along the attractor is some hundredfold.
    again = fc.simulate(LORENZ, 5.0, initial=fc.simulate(LORENZ, 2.0, initial=start, rtol=1e-11),
                        rtol=1e-11)
    assert again.time[0] == 2.0
    assert np.abs(again.states[-1] - known.y[:, -1]).max() < 1e-8


def robertson(t, x, p, out):
    out[0] = -0.04 * x[0] + 1e4 * x[1] * x[2]
    out[2] = 3e7 * x[1] * x[1]
    out[1] = -out[0] - out[2]


def test_stiff_kinetics_of_robertson():
    # y(40) of E. Hairer, G. Wanner, Solving ODEs II, and Radau at tight tolerances.
    field = vector_field(robertson, {}, 3)
    run = fc.simulate(field, 40.0, initial=[1.0, 0.0, 0.0], outputs=5, rtol=1e-8)
    known = solve_ivp(rates(field), (0.0, 40.0), [1.0, 0.0, 0.0], method="Radau", rtol=1e-11,
                      atol=1e-15)
    assert run.states[-1] == pytest.approx([0.7158270688, 9.185534765e-6, 0.2841637457], rel=1e-6)
    assert run.states[-1] == pytest.approx(known.y[:, -1], rel=1e-7)
    # Explicit methods need some 30,000 steps.
    assert run.statistics["steps"] < 400


def vanderpol(t, x, p, out):
    out[0] = x[1]
    out[1] = p[0] * (1.0 - x[0] ** 2) * x[1] - x[0]


@pytest.mark.slow
def test_relaxation_oscillations_agree_with_radau():
    field = vector_field(vanderpol, {"mu": 200.0}, ["x", "v"], scales=[1.0, 100.0])
    times = np.linspace(0.0, 400.0, 41)
    known = solve_ivp(rates(field), (0.0, 400.0), [2.0, 0.0], method="Radau", rtol=1e-10,
                      atol=1e-12, t_eval=times)
    run = fc.simulate(field, 400.0, initial=[2.0, 0.0], outputs=times, rtol=1e-9)
    assert run.state("x") == pytest.approx(known.y[0], abs=1e-5)


def test_crossings_are_met_to_rounding_and_counted():
    run = fc.simulate(FORCED.with_(w=3.0), 20.0, initial=[1.0, 1.0, 1.0], rtol=1e-10,
                      events=Crossing("x", value=0.5, sense="rising"))
    assert np.abs(run.events.states[:, 0] - 0.5).max() < 1e-14
    fine = np.linspace(0.0, 20.0, 200001)
    x = forced_exactly(fine, 3.0)[:, 0]
    known = fine[1:][(x[:-1] < 0.5) & (x[1:] >= 0.5)]
    assert len(run.events) == len(known)
    assert run.events.time == pytest.approx(known, abs=1.1e-4)
    exact = forced_exactly(run.events.time, 3.0)
    assert np.abs(run.events.states - exact).max() < 1e-7
    assert set(run.events.kind) == {"event 0"}


def test_short_visits_beyond_a_section_are_seen():
    # The peaks of 1.125 are above the value for 0.007, a tenth of a step.
    run = fc.simulate(FORCED, 20.0, initial=forced_exactly(0.0), rtol=1e-7,
                      events=Crossing("x", value=1.12498))
    x = forced_exactly(np.linspace(0.0, 20.0, 2000001))[:, 0] - 1.12498
    assert np.median(20.0 / run.statistics["steps"]) > 0.05
    assert len(run.events) == np.count_nonzero(x[:-1] * x[1:] < 0.0) > 8


@fc.event
def beyond(t, y, p):
    return y[0] - p[0]


def test_runs_end_at_events():
    run = fc.simulate(FORCED, 20.0, initial=[0.0, 1.0, 1.0], rtol=1e-9,
                      events=[fc.Event(beyond, [0.3], stop=True), Crossing(1)])
    assert run.status is fc.Status.EVENT
    assert run.time[-1] == run.events.time[-1]
    assert run.states[-1] == pytest.approx(run.events.states[-1], abs=1e-14)
    assert run.states[-1, 0] == pytest.approx(0.3, abs=1e-13)


@pytest.mark.parametrize("watched", [
    lambda stop: Crossing("x", sense="falling", stop=stop), lambda stop: Crossing("v", stop=stop),
    lambda stop: fc.Event(beyond, [0.3], stop=stop)])
def test_runs_go_on_from_stop_to_stop(watched):
    whole = fc.simulate(FORCED, 30.0, initial=[0.0, 1.0, 1.0], rtol=1e-10, events=watched(False))
    run, found = [0.0, 1.0, 1.0], []
    while len(found) <= len(whole.events):
        run = fc.simulate(FORCED, 30.0, initial=run, rtol=1e-10, events=watched(True))
        found.append(run.time[-1])
    assert len(found) > 4
    assert found == pytest.approx([*whole.events.time, 30.0], abs=1e-7)


def test_fields_of_python_run_as_compiled_ones_do():
    def swinging(t, x, p, out):
        out[0] = x[1]
        out[1] = -p[0] * np.sin(x[0])

    compiled = vector_field(swinging, {"g": 1.0}, ["angle", "speed"])
    both = [fc.simulate(field.with_(g=2.0), 30.0, initial=[2.5, 0.0], rtol=1e-8,
                        events=Crossing("angle", sense="rising"))
            for field in (Pendulum(), compiled)]
    assert both[0].states == pytest.approx(both[1].states, abs=1e-11)
    assert both[0].parameters == {"g": 2.0}
    energy = 0.5 * both[0].state("speed") ** 2 - 2.0 * np.cos(both[0].state("angle"))
    assert np.ptp(energy) < 1e-6
    # The period is 4 K(sin(1.25)) / sqrt(g).
    from scipy.special import ellipk

    period = 4.0 * ellipk(np.sin(1.25) ** 2) / np.sqrt(2.0)
    assert np.diff(both[0].events.time) == pytest.approx(period, rel=5e-7)


class Pulse(VectorField):
    """x' = -x + exp(-((t - 3) / 0.3)^2)."""

    def __init__(self):
        self.parameters, self.state_names = {}, ("x",)

    def rates(self, t, x, values):
        return -x + np.exp(-((t[:, None] - 3.0) / 0.3) ** 2)

    def derivatives(self, t, x, values, active=()):
        return self.rates(t, x, values), np.full((len(t), 1, 1), -1.0), np.zeros((len(t), 1, 0))


@pytest.mark.parametrize("end", [5.0, 10.0, 30.0, 300.0, 1e4, 1e6])
def test_the_end_of_a_run_does_not_change_its_begin(end):
    wanted = quad(lambda s: np.exp(s - 4.0 - ((s - 3.0) / 0.3) ** 2), 0.0, 4.0, points=[3.0])[0]
    run = fc.simulate(Pulse(), end, initial=[0.0], outputs=[0.0, 4.0, end], rtol=1e-8)
    assert run.states[1, 0] == pytest.approx(wanted, rel=1e-6)


class Failing(Pendulum):
    def rates(self, t, x, values):
        if t[0] > 1.0:
            raise ZeroDivisionError("no rates")
        return super().rates(t, x, values)


def test_ensembles_of_fields_are_their_single_runs():
    times = np.linspace(0.0, 10.0, 5)
    starts = np.array([[0.5, 0.0], [1.0, 0.2], [2.0, 0.0], [0.1, 1.0]])
    for field in (Pendulum(), Pendulum().with_(g=3.0)):
        many = fc.ensemble(field, times, initial=starts, workers=2, events=Crossing("angle"))
        for start, states, events in zip(starts, many.states, many.events, strict=True):
            alone = fc.simulate(field, 10.0, initial=start, outputs=times, events=Crossing("angle"))
            assert (alone.states == states).all()
            assert (alone.events.time == events.time).all()
    mixed = fc.ensemble([LORENZ, LORENZ.with_(rho=0.5)], [0.0, 30.0], initial=[1.0, 1.0, 1.0],
                        chain=2)
    # The second goes on where the first one ended, and comes to rest.
    assert np.abs(mixed.states[0, -1]).max() > 1.0
    assert np.abs(mixed.states[1, -1]).max() < 1e-5
    with pytest.raises(ZeroDivisionError):
        fc.ensemble(Failing(), times, initial=starts, workers=2)


def test_what_a_field_of_python_raises_comes_through():
    with pytest.raises(ZeroDivisionError, match="no rates"):
        fc.simulate(Failing(), 3.0, initial=[1.0, 0.0])


class Interrupted(Pendulum):
    def rates(self, t, x, values):
        if t[0] > 8.0:
            raise KeyboardInterrupt
        return super().rates(t, x, values)


def test_events_before_an_interruption_are_kept():
    watch = Crossing("angle")
    run = fc.simulate(Interrupted(), 20.0, initial=[1.0, 0.0], outputs=201, events=watch)
    assert run.status is fc.Status.INTERRUPTED
    whole = fc.simulate(Pendulum(), 20.0, initial=[1.0, 0.0], outputs=201, events=watch)
    before = whole.events.time[whole.events.time < run.time[-1]]
    assert len(before) > 1
    assert run.events.time == pytest.approx(before, rel=1e-6)


def exploding(t, x, p, out):
    out[0] = x[0] ** 2


def test_a_motion_that_blows_up_ends_with_a_status():
    run = fc.simulate(vector_field(exploding, {}, 1), 3.0, initial=[1.0])
    assert run.status in (fc.Status.MINIMUM_STEP, fc.Status.NOT_FINITE)
    assert 0.999 < run.time[-1] <= 1.0 + 1e-6
    assert run.states[:300, 0] == pytest.approx(1.0 / (1.0 - run.time[:300]), rel=1e-3)


def test_transitions_are_the_derivatives_of_the_motion():
    times = np.array([0.0, 0.7, 1.5])
    run = start_field(LORENZ, np.array([1.0, 2.0, 20.0]), times, rtol=1e-10, vary=True)
    run.advance(10**6)
    for k in (1, 2):
        start, found = run.states[k - 1], np.empty((3, 3))
        for i in range(3):
            sides = [fc.simulate(LORENZ, times[k], t_start=times[k - 1], outputs=2, rtol=1e-12,
                                 initial=start + step * np.eye(3)[i]).states[-1]
                     for step in (1e-5, -1e-5)]
            found[:, i] = (sides[0] - sides[1]) / 2e-5
        assert run.transitions[k] == pytest.approx(found, abs=1e-6 * np.abs(found).max())
    # Liouville: the volume shrinks by exp(-(sigma + 1 + b) t).
    assert np.linalg.det(run.transitions[1]) == pytest.approx(np.exp(-(41.0 / 3.0) * 0.7), rel=1e-6)


def test_runs_of_contact_fields_are_those_of_their_systems():
    field = contact_field(impact_oscillator(2), {"drive.frequency_hz": None})
    run = fc.simulate(field.with_(**{"drive.frequency_hz": 63.0 / TURN}), 0.2, initial=np.zeros(4))
    system = impact_oscillator(2).with_(**{"drive.frequency_hz": 63.0 / TURN})
    assert (run.states == fc.simulate(system, 0.2, initial=np.zeros(4)).states).all()
    assert run.state_names == ("q1", "q2", "q1'", "q2'")


def test_starts_of_contact_fields():
    system = impact_oscillator(2)
    field = contact_field(system, {"drive.frequency_hz": None})
    rest = fc.simulate(field, 0.1, initial="rest")
    assert (rest.states == fc.simulate(system, 0.1).states).all()
    # A run goes on from its end, in runs, ensembles, exponents and on the way to orbits.
    on = fc.simulate(field, 0.2, initial=rest)
    assert on.time[0] == rest.time[-1]
    assert (on.states[0] == rest.states[-1]).all()
    many = fc.ensemble(field, [0.1, 0.2], initial=rest)
    assert (many.states[0, 0] == rest.states[-1]).all()
    chaos = [lyapunov_exponents(field, 0.2, initial=start).exponents
             for start in (rest, rest.states[-1])]
    assert (chaos[0] == chaos[1]).all()
    motions = [periodic_motion(field, initial=start, transient=2.0, longest_period=0.5)
               for start in (rest, rest.states[-1])]
    assert (motions[0].states == motions[1].states).all()


def test_parts_of_runs():
    run = fc.simulate(LORENZ, 2.0, initial=[1.0, 1.0, 1.0], outputs=21)
    assert run.between(0.5).events is None
    part = run.between(0.5, 1.0)
    assert part.time[0] == 0.5
    assert (part.states == run.states[5:11]).all()
    assert "rho = 28" in repr(run)
    swing = fc.simulate(Pendulum(), 20.0, initial=[1.0, 0.0], outputs=21, events=Crossing("angle"))
    late = swing.between(10.0).events
    assert (late.time == swing.events.time[swing.events.time >= 10.0]).all()
    assert len(late.kind) == len(late.node) == len(late.states) == len(late) > 1


@pytest.mark.parametrize(("arguments", "told"), [
    ({}, "no place at rest"),
    ({"initial": [1.0, 2.0]}, "must be 3 finite numbers, x, y, z"),
    ({"initial": [1.0, 2.0, np.nan]}, "must be 3 finite numbers"),
    ({"initial": np.ones(3), "solver": Scipy("Radau")}, "not one that runs vector fields"),
    ({"initial": np.ones(3), "solver": Rodas5P(checkpoint="a.npz")}, "keep no checkpoint"),
    ({"initial": np.ones(3), "solver": PowerSeries()}, r"take one of Auto\(\), Rodas5P\(\)\."),
    ({"initial": np.ones(3), "events": ContactEvents()}, "no contact nodes"),
    ({"initial": np.ones(3), "events": Crossing("w")}, "no state 'w'"),
    ({"initial": np.ones(3), "events": Crossing("x", "y")}, "the name of one alone"),
    ({"initial": np.ones(3), "rtol": 0.5}, "rtol"),
])
def test_errors_of_runs(arguments, told):
    with pytest.raises(fc.InputError, match=told):
        fc.simulate(LORENZ, 1.0, **arguments)


def test_ensembles_keep_no_checkpoint():
    with pytest.raises(fc.InputError, match="keep no checkpoint; leave it out"):
        fc.ensemble(impact_oscillator(2), [0.0, 0.1], solver=Rodas5P(checkpoint="a.npz"))
    with pytest.raises(fc.InputError, match="not one that runs vector fields"):
        fc.ensemble(LORENZ, [0.0, 0.1], initial=np.ones(3), solver=PowerSeries())


def test_contact_systems_need_a_component():
    with pytest.raises(fc.InputError, match="component is missing"):
        fc.simulate(impact_oscillator(2), 0.1, events=Crossing("B"))
