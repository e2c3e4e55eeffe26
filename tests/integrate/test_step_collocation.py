"""Steps by collocation: their order, kinks of forces, and independent integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems import TURN, friction_oscillator, impact_oscillator, mass_in_plane, mass_in_y
from test_small_systems import assert_as_said
from test_small_systems import system as block

import fecontact as fc
from fecontact import ContactSystem, Drive, Ground, Load, PointLoad, Status, simulate
from fecontact.core.errors import InputError
from fecontact.integrate import Auto, ContactEvents, Radau, Rodas5P, step_loop
from fecontact.integrate.collocation import tableau
from fecontact.integrate.collocation.method import SMALL
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.rodas5p.variational import Variation
from fecontact.laws import (
    ConstantFriction,
    DahlFriction,
    ExponentialFriction,
    Harmonics,
    HarmonicSpeed,
    LinearContact,
    PowerContact,
    PrescribedForce,
    RoughSurface,
    Step,
)

LONG, STEPS = Radau(), Rodas5P()


def mass_in_x(spring=0.0, **parts):
    """A unit mass that moves along the ground only."""
    rows = np.array([[1.0], [0.0], [0.0]])
    modes = fc.basis_from_matrices([[1.0]], [[spring]], {"contact": rows[None], "B": rows,
                                                         "C": rows})
    return ContactSystem(modes, **{"normal": PrescribedForce(0.0),
                                   "friction": ConstantFriction(0.0), **parts})


def progressed(system, state, times, rtol, pieces=10**9, **options):
    """A run by collocation, in pieces of so many steps."""
    run = driver.start(system, np.array(state), np.array(times), rtol=rtol,
                       method="radau", **options)
    while (status := run.advance(pieces)) == step_loop.RUNNING:
        pass
    assert status == step_loop.FINISHED
    return run


# Order -------------------------------------------------------------------------------------------

def test_points_of_radau():
    """The points, and integrals exact up to degree 2 s - 2 at the end."""
    known = (0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0)
    assert pytest.approx(known, abs=2e-15) == tableau.POINTS
    for power in range(tableau.ORDER):
        at_end = tableau.ONCE[-1] @ tableau.POINTS**power
        assert at_end == pytest.approx(1.0 / (power + 1), rel=1e-13)
    assert tableau.ONCE[-1] @ tableau.POINTS**tableau.ORDER != pytest.approx(
        1.0 / (tableau.ORDER + 1), rel=1e-7)


def test_the_order_of_steps_and_within_them():
    """A damped mass on a spring: order nine at the ends of steps; eight and seven between them."""
    w, D, end = 3.0, 0.1, 8.0
    system = mass_in_x(w**2, drive=Drive(damping_x=2.0 * D * w))
    damped = w * np.sqrt(1.0 - D**2)

    def exact(t):
        sine = w / damped * np.exp(-D * w * t) * np.sin(damped * t)
        return np.array([np.exp(-D * w * t) * np.cos(damped * t) + D * sine, -w * sine]).T

    ends, between = [], []
    for count in (32, 64):
        h = end / count
        run = progressed(system, [1.0, 0.0], np.linspace(0.0, end, 1601), 1e9,
                         max_step=h, work=False)
        error = np.abs(run.states - exact(run.times))
        first = 1600 // 32
        # The first step is a hundredth of the others: errors are those of the steps that follow.
        ends.append(error[-1, 0])
        between.append(error[first:].max(axis=0))
    assert np.log2(ends[0] / ends[1]) == pytest.approx(tableau.ORDER, abs=0.4)
    assert np.log2(between[0] / between[1]) == pytest.approx([8.0, 7.0], abs=0.4)


def in_pieces(phase, switch, start, times):
    """A motion (N, 2) by DOP853 at 3e-14, from switch to switch; k counts its pieces."""
    found, t, y, k = np.zeros((len(times), 2)), times[0], start, 0
    while t < times[-1]:
        def event(t, y, k=k):
            return switch(k)(t, y)

        event.terminal, event.direction = True, -1.0 if k % 2 == 0 else 1.0
        piece = solve_ivp(phase(k), (t, times[-1]), y, "DOP853", rtol=3e-14, atol=1e-16,
                          events=event, dense_output=True)
        inside = (times >= t) & (times <= piece.t[-1])
        found[inside] = piece.sol(times[inside]).T
        t, y, k = piece.t[-1], piece.y[:, -1], k + 1
    return found


@pytest.mark.parametrize("rtol", [1e-7, 1e-8, 1e-9, 1e-10, 1e-11])
def test_the_error_follows_the_tolerance(rtol):
    """Smooth slip and stick of a driven mass on a belt, against DOP853 at 1e-13."""
    slope, V, mu, rest, decay = 300.0, 0.7, 0.8, 0.5, 2.0
    system = mass_in_x(4.0, normal=PrescribedForce(1.0), ground=Ground(speed=V),
                       friction=ExponentialFriction(mu, rest, decay, slope),
                       drive=Drive(stiffness_x=5.0, amplitude_x=0.08, frequency_hz=2.0 / TURN))

    def phase(k):
        sign = (-1.0) ** (k + 1)

        def f(t, y):
            v = V - y[1]
            coefficient = (mu - rest) * np.exp(decay * sign * v) + rest
            rub = coefficient * 2.0 / np.pi * np.arctan(slope * v)
            return [y[1], -9.0 * y[0] + 0.4 * np.sin(2.0 * t) + rub]

        return f

    times = np.linspace(0.0, 12.0, 241)
    wanted = in_pieces(phase, lambda k: lambda t, y: V - y[1], [0.1, 0.0], times)
    run = progressed(system, [0.1, 0.0], times, rtol, work=False)
    error = np.abs(run.states - wanted).max()
    assert error < 3.0 * rtol
    assert run.statistics["steps"] < 100 * (1e-7 / rtol) ** (1.0 / 5.0)


# Kinks -------------------------------------------------------------------------------------------

@pytest.mark.parametrize("damping", [0.0, 6.0])
def test_a_ball_that_bounces(damping):
    """Parabolas and damped sines one after the other; a dashpot's force begins with a jump."""
    g, c, m, height = 9.81, 1e4, 1.0, 0.05
    system = mass_in_y(m, normal=LinearContact(c, damping), friction=ConstantFriction(0.0),
                       load=Load(normal=m * g))
    times = np.linspace(0.0, 1.6, 400)
    run = progressed(system, [height, 0.0], times, 1e-10, work=False)

    def phase(k):
        return lambda t, y: [y[1], (-(c * y[0] + damping * y[1]) / m if k % 2 else 0.0) - g]

    def switch(k):
        return (lambda t, y: c * y[0] + damping * y[1]) if k % 2 else (lambda t, y: y[0])

    wanted = in_pieces(phase, switch, [height, 0.0], times)
    scale = np.abs(wanted).max(axis=0)
    assert (np.abs(run.states - wanted) / scale).max() < 5e-9
    assert run.attempts < 400


def test_the_work_of_a_ball_that_bounces():
    """The dashpot takes the energy that motion and spring lose, though its force jumps."""
    g, c, damping, height = 9.81, 1e4, 6.0, 0.05
    system = mass_in_y(normal=LinearContact(c, damping), friction=ConstantFriction(0.0),
                       load=Load(normal=g))
    for rtol in (1e-8, 1e-10):
        run = simulate(system, 1.6, initial=np.array([height, 0.0]), outputs=400, rtol=rtol,
                       solver=LONG)
        y, v = run.states.T
        energy = 0.5 * v**2 + g * y + 0.5 * c * np.minimum(y, 0.0) ** 2
        taken = run.energies.contact_damping
        assert taken[-1] > 0.1 * energy[0]
        assert np.abs(taken - (energy[0] - energy)).max() < 1e-9 * energy[0]
        assert run.energies.growth < 1e-9


def test_work_from_rest_without_loads():
    """A brief touch of a dashpot, in a run that begins with no energy at all."""
    c, damping = 2.7e5, 20.0
    push = PointLoad("C", "y", signal=Harmonics((-5.0, -1.0), (30.0 / TURN, 1000.0 / TURN)))
    system = mass_in_y(normal=LinearContact(c, damping), friction=ConstantFriction(0.0),
                       gap=1e-3, load=Load(forces=(push,)))
    for rtol in (1e-8, 1e-10):
        run = simulate(system, 0.3, initial=np.zeros(2), outputs=301, rtol=rtol, solver=LONG)
        balance = run.energies
        assert balance.contact_damping[-1] > 1e-3 * np.abs(balance.stored).max()
        missing = balance.stored - balance.work + balance.lost
        assert np.abs(missing).max() < 1e-9 * np.abs(balance.stored).max()


def test_work_of_creep():
    """Friction's work at slip velocities of stick: between passages of them, in dense outputs."""
    law, V, begin = ExponentialFriction(0.8, 0.55, 1000.0, 1.8e4), 1e-3, np.array([1e-3, 0.0])
    system = mass_in_x(4.0, normal=PrescribedForce(10.0), ground=Ground(speed=V), friction=law,
                       drive=Drive(stiffness_x=3000.0, damping_x=0.5, amplitude_x=2e-3,
                                   frequency_hz=60.0 / TURN))
    times = np.linspace(0.0, 0.3, 300001)
    tight = simulate(system, 0.3, initial=begin, outputs=times, solver=STEPS, rtol=1e-11)
    work, beyond = tight.node_friction_work[:, 0], np.abs(tight.states[:, 1] - V)
    beyond -= law.stick_velocity(1)[0]
    last = np.flatnonzero(beyond[1:] * beyond[:-1] < 0.0)
    part = beyond[last] / (beyond[last] - beyond[last + 1])
    at = np.concatenate([work[:1], work[last] + part * np.diff(work)[last], work[-1:]])
    creeps = np.append(beyond[last], beyond[-1]) < 0.0
    wanted = np.diff(at)[creeps].sum()
    assert len(last) == 5
    assert wanted < 0.01 * work[-1]
    for rtol in (1e-7, 1e-8, 1e-9, 1e-10):
        run = simulate(system, 0.3, initial=begin, outputs=31, solver=LONG, rtol=rtol)
        assert run.node_creep_work[-1, 0] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("rtol", [1e-3, 1e-4])
def test_stick_on_a_belt_of_varying_speed_at_loose_tolerances(rtol):
    """The belt works c V^2 / 2 a second against the dashpot of a mass that it takes along."""
    V, c = 0.05, 1.0
    system = mass_in_x(100.0, normal=PrescribedForce(10.0), friction=ConstantFriction(0.5),
                       ground=Ground(motion=HarmonicSpeed(V, 1.0)), drive=Drive(damping_x=c))
    run = simulate(system, 10.0, outputs=1001, rtol=rtol, initial=[0.0, 0.0], solver=LONG)
    assert run.status is Status.FINISHED
    assert run.statistics["steps"] < 1500
    assert run.energies.belt_friction_work[-1] == pytest.approx(5.0 * c * V**2, rel=5e-3)


def test_steps_end_where_slip_turns_round():
    """A block that is rocked on still ground: friction without smoothing but for |v|."""
    system = mass_in_x(100.0, normal=PrescribedForce(1.0),
                       friction=ExponentialFriction(0.6, 0.3, 50.0, 30.0))
    times, start = np.linspace(0.0, 3.0, 301), [0.05, 0.0]
    tight = simulate(system, 3.0, initial=np.array(start), outputs=times, solver=STEPS, rtol=1e-13)
    errors = []
    for rtol in (1e-7, 1e-9):
        run = progressed(system, start, times, rtol, work=False)
        errors.append(np.abs(run.states - tight.states).max() / np.abs(tight.states).max())
        assert run.statistics["rejected"] < 0.6 * run.statistics["steps"]
    assert errors[0] < 1e-7
    assert errors[1] < 2e-9


def test_brief_contacts_are_not_missed():
    """A mass flies by the ground, into which it dips for less than a thousandth of a step."""
    w, depth = 2.0, 1e-7
    system = mass_in_y(spring=w**2, normal=LinearContact(1e9), friction=ConstantFriction(0.0),
                       gap=1.0 - depth)
    quiet = mass_in_y(spring=w**2, normal=LinearContact(1e9), friction=ConstantFriction(0.0),
                      gap=1.0 + depth)
    times = np.linspace(0.0, 20.0, 41)
    for one, touched in ((system, True), (quiet, False)):
        run = progressed(one, [1.0, 0.0], times, 1e-9, work=False)
        error = np.abs(run.states[:, 0] - np.cos(w * times)).max()
        assert (error > 1e-6) == touched
        assert error < (1e-2 if touched else 1e-8)


def test_breaks_and_jumps_of_forces():
    """A load that begins at once, between two outputs and on one; and its work."""
    for begin in (0.31, 0.5):
        system = mass_in_x(25.0, load=Load(forces=(PointLoad("C", "x", signal=Step(begin, 2.0)),)))
        run = simulate(system, 2.0, initial=np.zeros(2), outputs=41, rtol=1e-9, solver=LONG)
        rise = np.where(run.time > begin, 0.08 * (1.0 - np.cos(5.0 * (run.time - begin))), 0.0)
        assert run.states[:, 0] == pytest.approx(rise, abs=1e-10)
        assert run.energies.growth < 1e-9


# Other integrators -------------------------------------------------------------------------------

@pytest.mark.parametrize(("modes", "nodes"), SMALL.sizes)
def test_systems_of_all_sizes_move_as_by_rodas5p(modes, nodes):
    system, times = block(modes, nodes), np.linspace(0.0, 0.3, 61)
    start = np.zeros(2 * modes)
    runs = [simulate(system, 0.3, initial=start, outputs=times, solver=solver, rtol=rtol)
            for solver, rtol in ((LONG, 1e-9), (STEPS, 1e-11))]
    scale = np.abs(runs[1].states).max(axis=0)
    assert (np.abs(runs[0].states - runs[1].states) / scale).max() < 1e-6
    work = np.abs(runs[1].work).max()
    assert np.abs(runs[0].work - runs[1].work).max() < 1e-6 * work


def test_energy_balances():
    run = simulate(friction_oscillator(3), 0.6, initial=np.zeros(6), rtol=1e-9, solver=LONG)
    assert run.status is Status.FINISHED
    assert run.energies.growth < 1e-8


def test_stick_slip_over_many_periods():
    """Model (b) of the benchmark: errors of 1e-8 in half the steps that Rodas5P takes for 1e-6."""
    r = 1.0 / np.sqrt(5.632)
    rows = [[[r], [0.0], [0.0]]]
    system = ContactSystem(
        fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows, "B": rows[0]}),
        normal=PrescribedForce(14.0), friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e6),
        ground=Ground(speed=1e-3),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                    frequency_hz=13.8 / TURN))
    times = np.linspace(0.0, 3.0, 1501)
    tight = progressed(system, [0.0, 0.0], times, 1e-12, work=False).states
    assert tight == pytest.approx(simulate(
        system, 3.0, initial=np.zeros(2), outputs=times, solver=STEPS, rtol=1e-11).states,
        rel=1e-7, abs=1e-7 * np.abs(tight).max())
    long = progressed(system, [0.0, 0.0], times, 1e-8, work=False)
    steps = simulate(system, 3.0, initial=np.zeros(2), outputs=times, solver=STEPS, rtol=1e-8)
    scale = np.abs(tight).max(axis=0)
    errors = [(np.abs(states - tight) / scale).max() for states in (long.states, steps.states)]
    assert errors[0] < 2e-8 < errors[1]
    assert long.statistics["steps"] < 0.5 * steps.statistics["steps"]


# Runs --------------------------------------------------------------------------------------------

def test_runs_go_on_bit_for_bit():
    system, times = friction_oscillator(3), np.linspace(0.0, 0.6, 301)
    whole = progressed(system, np.zeros(6), times, 1e-8)
    parts = progressed(system, np.zeros(6), times, 1e-8, pieces=1)
    assert (whole.states == parts.states).all()
    assert (whole.work == parts.work).all()
    assert whole.statistics == parts.statistics


def test_a_checkpoint(tmp_path):
    system, file = friction_oscillator(3), tmp_path / "run.checkpoint"
    options = {"initial": np.zeros(6), "outputs": 2001, "rtol": 1e-8}
    whole = simulate(system, 400.0, **options)

    def stop(time):
        if 0.5 < time < 399.0:
            raise KeyboardInterrupt

    part = simulate(system, 400.0, **options, solver=Radau(file), progress=stop)
    assert part.status is Status.INTERRUPTED
    assert 0.5 < part.time[-1] < 399.0
    with pytest.raises(InputError, match="checkpoint of another run"):
        simulate(system, 400.0, **options, solver=Rodas5P(file))
    rest = simulate(system, 400.0, **options, solver=Auto(file))
    assert (rest.states == whole.states).all()
    assert (rest.work == whole.work).all()


def test_neither_outputs_nor_the_end_change_the_motion():
    system = friction_oscillator(2)
    options = {"initial": np.zeros(4), "rtol": 1e-8}
    many = simulate(system, 1.0, outputs=1001, **options)
    few = simulate(system, 1.0, outputs=[0.0, 0.3, 1.0], **options)
    longer = simulate(system, 3.0, outputs=3001, **options)
    assert (many.states[-1] == few.states[-1]).all()
    assert (many.states[300] == few.states[1]).all()
    assert longer.states[:950] == pytest.approx(many.states[:950], rel=1e-12, abs=1e-16)


def test_runs_that_fail():
    system = mass_in_y(normal=PowerContact(1e10, exponent=6.0), friction=ConstantFriction(0.0))
    run = driver.start(system, np.array([-1e59, 0.0]), np.array([0.0, 1.0]), rtol=1e-8,
                       method="radau")
    assert run.advance(10**4) == step_loop.NOT_FINITE


# Choice ------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("system", "said"), [
    (friction_oscillator(3, **{"ground.amplitude": 1e-6, "ground.wavelength": 0.1}),
     "the ground is wavy"),
    (mass_in_plane(friction=DahlFriction(0.4, 1e-5)), "there is friction with memory"),
    (block(5, 1), "5 modes and 1 nodes are not among them"),
])
def test_what_it_is_not_for(system, said):
    options = {"initial": np.zeros(system.size), "outputs": 11, "rtol": 1e-8}
    with pytest.raises(InputError, match=rf"Radau\(\) is for .* but {said}; take Auto"):
        simulate(system, 0.01, **options, solver=LONG)
    taken, steps = (simulate(system, 0.01, **options, solver=solver)
                    for solver in (Auto(), STEPS))
    assert (taken.states == steps.states).all()


def test_it_locates_no_events():
    system = friction_oscillator(2)
    options = {"initial": np.zeros(4), "outputs": 11, "events": ContactEvents(), "rtol": 1e-8}
    with pytest.raises(InputError, match=r"Radau\(.*\) is not one that locates events"):
        simulate(system, 0.01, **options, solver=LONG)
    taken = simulate(system, 0.01, **options)
    assert (taken.statistics["solver"], taken.statistics["method"]) == ("auto", "rodas5p")


def test_when_it_is_taken():
    def takes(system, rtol, **options):
        run = driver.start(system, np.zeros(system.size), np.array([0.0, 1.0]), rtol=rtol,
                           **options)
        return run.collocation is not None

    assert takes(friction_oscillator(3), 1e-7)
    assert not takes(friction_oscillator(3), 2e-7)
    assert takes(friction_oscillator(3), 1e-9, vary=True)
    assert not takes(friction_oscillator(3), 1e-6, vary=True)
    # Derivatives are not expanded in series.
    assert takes(impact_oscillator(2), 1e-9, vary=True)
    assert not takes(friction_oscillator(3), 1e-9, method="rodas5p")
    assert takes(friction_oscillator(3), 1e-3, method="radau")
    # Series are faster still.
    assert not takes(impact_oscillator(2), 1e-9)
    assert takes(impact_oscillator(2), 1e-9, method="radau")


def test_ensembles():
    systems = [friction_oscillator(2, **{"drive.frequency_hz": w / TURN}) for w in (12.0, 13.8)]
    times = np.linspace(0.0, 0.5, 6)
    found = fc.ensemble(systems, times, initial=np.zeros(4), rtol=1e-8, solver=LONG, chain=2)
    singles = [simulate(systems[0], 0.5, initial=np.zeros(4), rtol=1e-8, outputs=times)]
    singles.append(simulate(systems[1], 0.5, initial=found.states[0, -1], rtol=1e-8,
                            outputs=times))
    for states, single in zip(found.states, singles, strict=True):
        assert states == pytest.approx(single.states, rel=1e-7, abs=1e-12)
    # One after the other from the same system, which takes the workspace of the first.
    twice = fc.ensemble([systems[1]] * 2, times, initial=np.zeros(4), rtol=1e-8, solver=LONG)
    assert (twice.states[0] == twice.states[1]).all()


@pytest.mark.parametrize(("modes", "nodes"), SMALL.sizes)
def test_what_step_loops_take_for_granted(modes, nodes):
    said = SMALL.values(modes, nodes)
    system = block(modes, nodes, normal=RoughSurface(10e6, 10e-6, 40.0))
    run = driver.start(system, np.zeros(2 * modes), np.linspace(0.0, 0.1, 11), rtol=1e-8,
                       method="radau")
    tuples = (run.problem, run.progress, run.workspace, run.output, run.collocation)
    found = sum(assert_as_said(values, said) for values in tuples)
    assert found >= sum(map(len, said.values()))
    assert Variation not in said
