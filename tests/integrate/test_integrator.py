"""The compiled integrator against closed forms, scipy, and itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems import TURN, mass_in_plane, mass_in_y
from test_simulate import oscillator

from fecontact import (
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    ModalBasis,
    PointLoad,
    Trajectory,
)
from fecontact.integrate import step_loop
from fecontact.integrate.rodas5p import driver as control
from fecontact.integrate.step_runs import finish
from fecontact.laws import (
    ExponentialFriction,
    Harmonic,
    HarmonicSpeed,
    LinearContact,
    LuGreFriction,
    PowerContact,
    Pulse,
    RoughSurface,
)
from fecontact.system.columns import POWERS
from fecontact.system.powers import FRICTION


def run_of(system, state, times, rtol=1e-7, work=True):
    run = control.start(system, np.array(state), np.array(times), rtol=rtol, work=work)
    assert finish(run) == step_loop.FINISHED
    return run


def body(nodes=3, modes=4, **parts):
    """A body of some modes whose nodes feel all kinds of loads."""
    rng = np.random.default_rng(5)
    T = rng.normal(size=(nodes + 2, 3, modes))
    basis = ModalBasis(np.linspace(0.0, 400.0, modes), 0.02 * np.eye(modes), T,
                       np.column_stack([np.linspace(0.0, 0.02, nodes + 2), np.zeros(nodes + 2)]),
                       np.ones(nodes))
    given = {
        "normal": PowerContact(1e6, 1.5, 0.0), "ground": Ground(
            0.02, 2e-6, 0.01, motion=HarmonicSpeed(0.01, 90.0 / TURN)),
        "friction": ExponentialFriction(0.6, 0.4, 20.0, 50.0),
        "drive": Drive(2e3, 3e3, 1.0, 2.0, 1e-4, 2e-4, 70.0 / TURN),
        "load": Load(40.0, (PointLoad("B", "x", signal=Harmonic(2.0, 110.0 / TURN, 0.3)),))}
    return ContactSystem(basis,
                         **{"friction": ExponentialFriction(0.8, 0.55, 1e3), **given, **parts})


def reference(system, state, times, rtol=1e-12):
    return solve_ivp(system.rhs, (times[0], times[-1]), state, method="DOP853", t_eval=times,
                     rtol=rtol, atol=1e-16).y.T


def test_order_on_a_smooth_problem():
    """Closed contact on wavy ground that accelerates, drive and load: all terms in time."""
    system = body(ground=Ground(0.02, 2e-6, 0.01, motion=HarmonicSpeed(0.01, 90.0 / TURN)),
                  normal=LinearContact(1e5, 30.0),
                  # Without fall: that has a kink where the slip velocity changes sign.
                  friction=ExponentialFriction(0.6, 0.6, 0.0, 50.0))
    state = np.zeros(system.size)
    state[: system.basis.modes] = np.linalg.lstsq(system.basis.contact_T[:, 1],
                                                  np.full(3, -2e-3), rcond=None)[0]
    times = np.array([0.0, 0.002])
    wanted = reference(system, state, times)[-1]
    assert system.contact_history(times, np.array([state, wanted]))[..., 0].min() > 0.0
    errors = []
    for steps in (80, 160, 320):
        run = control.start(system, state, times, rtol=1e9, work=False)
        longest = times[-1] / steps
        limited = run.problem.control._replace(longest=longest, slip_part=1e9)
        run = replace(run, problem=run.problem._replace(control=limited))
        run.progress.numbers[step_loop.STEP] = longest
        assert run.advance(10 * steps) == step_loop.FINISHED
        assert run.statistics["steps"] == steps
        errors.append(np.abs(run.states[-1] - wanted).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(5.0, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [
    ExponentialFriction(0.6, 0.4, 20.0, 1e4), LuGreFriction(0.6, 0.4, 0.01, 2.0, 1e5, 100.0)])
def test_agrees_with_scipy(friction):
    """Contact that opens and closes; friction with and without memory."""
    system = body(friction=friction, normal=RoughSurface(1e5, 2e-5, 30.0))
    state = np.zeros(system.size)
    times = np.linspace(0.0, 0.03, 61)
    wanted = solve_ivp(system.rhs, (0.0, 0.03), state, method="Radau", t_eval=times, rtol=1e-10,
                       atol=1e-15, jac=system.jacobian).y.T
    m = system.basis.modes
    errors = []
    for rtol in (1e-5, 1e-7):
        run = run_of(system, state, times, rtol)
        errors.append(max(np.abs(run.states[:, part] - wanted[:, part]).max()
                          / np.abs(wanted[:, part]).max()
                          for part in (slice(0, m), slice(m, 2 * m))))
    assert errors[0] < 1e-3
    assert errors[1] < 3e-5
    assert 0.0 < (system.contact_history(times, run.states)[:, :, 0] > 0.0).mean() < 1.0


def test_drop_on_a_spring():
    """SDND108: z = 0 and z' = -1 at first, a spring with its top at z = -2."""
    system = mass_in_y(normal=LinearContact(100.0, 0.0), load=Load(10.0), gap=2.0)
    times = np.array([0.0, 0.54031242374328, 0.88545615307643, 1.0, 1.1])
    run = run_of(system, [0.0, -1.0], times, 1e-9)
    assert run.states[1:3, 0] == pytest.approx(-2.0, abs=1e-8)
    assert run.states[3:, 0] == pytest.approx([-1.332162981855, -0.856394405035], abs=1e-8)


def test_period_of_stick_slip():
    """model.md section 4 without excitation: T = 1.264348 s with k_s = 1e6 s/m."""
    system = oscillator()
    run = run_of(system, np.zeros(4), np.linspace(0.0, 12.0, 120001), 1e-7)
    late = run.times > 6.0
    x, t = run.states[late, 0], run.times[late]
    level = 0.5 * (x.max() + x.min())
    down = np.flatnonzero((x[:-1] > level) & (x[1:] <= level))
    passed = t[down] + (x[down] - level) / (x[down] - x[down + 1]) * np.diff(t)[down]
    assert np.diff(passed) == pytest.approx(1.264348, rel=2e-6)
    place = x * system.basis.T[2, 0, 0]
    assert place.min() == pytest.approx(0.796592e-3, rel=1e-5)
    assert place.max() == pytest.approx(1.953714e-3, rel=1e-5)


def test_energy_balance():
    for system in (body(), body(friction=ExponentialFriction(0.6, 0.4, 20.0, 1e4))):
        m = system.basis.modes
        run = run_of(system, np.zeros(system.size), np.linspace(0.0, 0.03, 301))
        trajectory = Trajectory(system, run.times, run.states[:, :m], run.states[:, m:],
                                run.work[:, : len(POWERS)])
        assert trajectory.energies.imbalance < 1e-6
        lost, creep = np.split(run.work[:, len(POWERS) :], 2, axis=1)
        assert lost.sum(axis=1) == pytest.approx(run.work[:, FRICTION], rel=1e-9)
        assert (np.diff(creep, axis=0) > -1e-9 * creep.max()).all()
        assert (creep[-1] <= (1.0 + 1e-12) * lost[-1]).all()
    coarse = run_of(system, np.zeros(system.size), np.array([0.0, 0.03]))
    assert coarse.work[-1] == pytest.approx(run.work[-1], rel=1e-12)


def test_continued_runs_are_the_same_bit_for_bit():
    system = body(friction=LuGreFriction(0.6, 0.4, 0.01, 2.0, 1e5, 100.0),
                  load=Load(40.0, (PointLoad("B", signal=Pulse("triangle", -50.0, 0.003, 0.01)),)))
    state, times = np.zeros(system.size), np.linspace(0.0, 0.02, 101)
    whole = run_of(system, state, times)
    pieces = control.start(system, state, times, rtol=1e-7)
    while pieces.advance(7) == step_loop.RUNNING:
        taken_up = control.start(system, state, times, rtol=1e-7)
        copy_into(taken_up.progress, pieces.progress)
        taken_up.states[:], taken_up.work[:] = pieces.states, pieces.work
        pieces = taken_up
    assert (pieces.states == whole.states).all()
    assert (pieces.work == whole.work).all()
    assert pieces.statistics == whole.statistics


def copy_into(target, source):
    for mine, theirs in zip(target, source, strict=True):
        if isinstance(mine, tuple):
            copy_into(mine, theirs)
        else:
            mine[:] = theirs


@pytest.mark.parametrize("shape", ["half-sine", "rectangle", "triangle"])
def test_pulses_are_not_missed(shape):
    """A free mass gets the pulse's integral as momentum."""
    pulse = Pulse(shape, 3.0, 1e-5, 0.7)
    system = mass_in_plane(load=Load(0.0, (PointLoad("B", "x", signal=pulse),)), gap=1.0)
    run = run_of(system, np.zeros(4), np.array([0.0, 1.0]), 1e-6)
    times = np.linspace(0.7, 0.7 + 1e-5, 100001)
    momentum = np.trapezoid([pulse.kernel.python(t, pulse.parameters())[0] for t in times], times)
    assert run.states[-1, 2] == pytest.approx(momentum, rel=1e-5)


def test_dense_output_is_as_accurate_as_the_steps():
    system = body()
    state, end = np.zeros(system.size), 0.02
    errors = []
    for count in (3, 4001):
        times = np.linspace(0.0, end, count)
        wanted = reference(system, state, times)
        run = run_of(system, state, times, 1e-6)
        errors.append(np.abs(run.states - wanted).max(axis=0) / np.abs(wanted).max(axis=0))
    assert (errors[1] < 4.0 * errors[0].max()).all()


def test_motion_that_grows_beyond_all_numbers_ends_the_run():
    system = body()
    state = np.zeros(system.size)
    state[0] = 1e305
    run = control.start(system, state, np.array([0.0, 0.1]), rtol=1e-6)
    assert finish(run) == step_loop.NOT_FINITE
    assert run.time == 0.0


def test_states_that_are_no_numbers_are_refused():
    system = body()
    with pytest.raises(InputError, match="must be finite"):
        control.start(system, np.full(system.size, np.nan), np.array([0.0, 0.1]), rtol=1e-6)
