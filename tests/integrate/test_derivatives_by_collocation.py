"""Derivatives that go over steps by collocation: of what is computed, and of the motion."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from systems import TURN, friction_oscillator, mass_in_plane, mass_in_y
from test_derivatives_of_steps import BEGIN, SMOOTH, oscillator, scales_of, states_of
from test_small_systems import system as block

import fecontact as fc
from fecontact import ContactSystem, Drive, Ground, Load, PointLoad, sensitivity
from fecontact.integrate import Radau, Rodas5P, step_loop
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.sensitivities import _moved
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    HarmonicSpeed,
    LinearContact,
    PrescribedForce,
    RoughSurface,
    Step,
    Tabulated,
)

sys.path.insert(0, str(Path(__file__).parents[1] / "laws"))

from test_friction_laws import every_law
from test_normal_laws import LAWS as NORMAL_LAWS

LONG, STEPS = Radau(), Rodas5P()
GRAVITY = 9.81


def run_over(system, state, times, rtol, vary=False, pieces=10**9, **options):
    """A run by collocation, in pieces of so many steps."""
    run = driver.start(system, np.asarray(state, dtype=float), np.asarray(times, dtype=float),
                       rtol=rtol, work=False, vary=vary, method="radau", **options)
    while (status := run.advance(pieces)) == step_loop.RUNNING:
        pass
    assert status == step_loop.FINISHED
    return run


# One step ----------------------------------------------------------------------------------------

def one_step(system, state, h, vary=False):
    """End of a step of exactly this length, and its derivatives; None where it is cut short."""
    run = driver.start(system, state, np.array([BEGIN, BEGIN + h]), rtol=1e-10, work=False,
                       vary=vary, vary_rtol=1e8, method="radau")
    run.progress.numbers[step_loop.STEP] = h
    run.advance(1)
    if run.outputs < 2 or run.attempts != 1:
        return None
    return run.states[-1], run.transitions[-1] if vary else None


def difference(ends, width):
    """Derivative by ends of steps at -2, -1, 1 and 2 widths, and how sure it is."""
    below, low, high, above = ends
    better = (8.0 * (high - low) - (above - below)) / (12.0 * width)
    return better, np.abs(better - (high - low) / (2.0 * width))


def compared(system, states, tolerance):
    """Compare derivatives of steps with differences of steps; how many states had no kink."""
    scale, count = scales_of(system), 0
    for state in states:
        h = min(0.1 / np.abs(np.linalg.eigvals(system.jacobian(BEGIN, state))).max(), 1e-3)
        found = one_step(system, state, h, vary=True)
        ends = [[one_step(system, state + part * 2e-3 * scale[k] * np.eye(len(state))[k], h)
                 for part in (-2.0, -1.0, 1.0, 2.0)] for k in range(len(state))]
        if found is None or any(end is None for column in ends for end in column):
            continue
        wanted, doubt = (np.stack(values, axis=1) for values in zip(*(
            difference([end[0] for end in column], 2e-3 * scale[k])
            for k, column in enumerate(ends)), strict=True))
        weights = scale / scale[:, None]
        largest = np.abs(wanted * weights).max()
        if np.abs(doubt * weights).max() > 1e-3 * largest:
            continue
        assert np.abs((found[1] - wanted) * weights).max() < tolerance * largest, state
        count += 1
    return count


@pytest.mark.parametrize("law", list(every_law())[:-1], ids=lambda law: type(law).__name__)
def test_a_step_with_friction(law):
    system = oscillator(friction=law, ground=Ground(speed=0.02),
                        normal=RoughSurface(1e6, 1e-5, 40.0))
    slips = [sign * v for sign in (1.0, -1.0) for v in (0.3 * law.velocity_scale,
                                                        3.0 * law.velocity_scale, 0.05)]
    assert compared(system, states_of(system, slips, (4e-6, 4e-5)), 2e-6) >= 4


@pytest.mark.parametrize("name", [name for name in NORMAL_LAWS
                                  if name not in ("user", "friction contact")])
def test_a_step_with_normal_law(name):
    law, (lowest, highest) = NORMAL_LAWS[name]
    system = oscillator(friction=SMOOTH, ground=Ground(speed=0.02), normal=law)
    scale = law.penetration_scale
    depths = [u for u in (-0.7 * scale, 0.4 * scale, 2.5 * scale, 0.6 * lowest, 0.3 * highest,
                          0.7 * highest)
              if lowest <= u <= highest]
    assert compared(system, states_of(system, (0.03, -0.001), depths), 5e-6) >= 3


def test_a_step_on_ground_that_accelerates():
    system = oscillator(friction=SMOOTH, normal=RoughSurface(1e6, 1e-5, 40.0),
                        ground=Ground(motion=HarmonicSpeed(0.05, 300.0 / TURN)))
    level = oscillator(friction=SMOOTH, ground=Ground(speed=0.0))
    states = [state + speed * np.append([0.0, 0.0], system.arrays.rows[0, 0])
              for speed in (0.02, -0.03)
              for state in states_of(level, (0.0, 0.01), (4e-6, 4e-5))]
    assert compared(system, states, 2e-6) >= 6


@pytest.mark.parametrize("name", [
    "ground.speed", "normal.stiffness", "normal.damping", "normal.roughness_height",
    "friction.static_coefficient", "friction.smoothing_slope", "drive.amplitude_x",
    "drive.stiffness_x", "drive.damping_x", "drive.frequency_hz", "load.normal"])
@pytest.mark.parametrize("nodes", [1, 2])
def test_parameters_over_some_steps(name, nodes):
    """Against differences of runs at tight tolerance, in slip at a depth that does not end."""
    system = block(3, nodes, friction=SMOOTH, ground=Ground(speed=0.05),
                   normal=RoughSurface(1e6, 1e-5, 40.0), load=Load(60.0))
    state = fc.simulate(system, 0.05, rtol=1e-9).states[-1]
    times, value = [BEGIN, BEGIN + 0.02], system.parameter(name)
    beside = _moved(system, name, np.array(times), state)
    found = run_over(system, state, times, 1e-10, beside).transitions[-1][:, -1]
    width = 1e-3 * value
    ends = [run_over(system.with_(**{name: value + part * width}), state, times, 1e-13).states[-1]
            for part in (-2.0, -1.0, 1.0, 2.0)]
    wanted, _ = difference(ends, width)
    m = len(state) // 2
    for part in (slice(0, m), slice(m, None)):
        assert np.abs(found - wanted)[part].max() < 2e-6 * np.abs(wanted[part]).max()


# Tolerance ---------------------------------------------------------------------------------------

@pytest.mark.parametrize("modes", [2, 3])
def test_errors_fall_with_the_tolerance(modes):
    """Stick and slip of an oscillator, against differentiated steps of Rodas5P at 1e-12."""
    system = friction_oscillator(modes, **{"friction.smoothing_slope": 1e4})
    options = {"outputs": 5, "initial": np.zeros(2 * modes), "parameter": "drive.stiffness_x"}
    tight = sensitivity(system, 0.6, rtol=1e-12, solver=STEPS, **options)
    errors = []
    for rtol in (1e-7, 1e-8, 1e-9, 1e-10):
        run = sensitivity(system, 0.6, rtol=rtol, solver=LONG, **options)
        errors.append(max(np.abs(one - other).max() / np.abs(other).max() for one, other in (
            *zip(run.transitions, tight.transitions, strict=True),
            *zip(run.forced, tight.forced, strict=True))))
        assert errors[-1] < 100.0 * rtol
    assert errors[3] < 0.03 * errors[0]


def test_breaks_of_drives():
    """A load that begins at once and a table, between output times and on one of them."""
    for begin in (0.07, 0.05):
        system = mass_in_plane(
            spring=1e3, friction=SMOOTH, ground=Ground(speed=0.02),
            normal=RoughSurface(1e6, 1e-5, 40.0),
            drive=Drive(stiffness_x=5e3, damping_x=3.0,
                        motion_x=Tabulated((0.0, 0.02, 0.06, 0.3), (0.0, 1e-4, -1e-4, 0.0))),
            load=Load(14.0, forces=(PointLoad("C", "x", signal=Step(begin, 2.0)),)))
        options = {"outputs": 3, "parameter": "drive.stiffness_x"}
        tight = sensitivity(system, 0.1, rtol=1e-11, solver=STEPS, **options)
        run = sensitivity(system, 0.1, rtol=1e-9, solver=LONG, **options)
        for one, other in ((run.transitions, tight.transitions), (run.forced, tight.forced)):
            assert one == pytest.approx(other, rel=1e-6, abs=1e-7 * np.abs(other).max())


# Jumps of forces ---------------------------------------------------------------------------------

def fall(height, speed, end, damping=30.0, stiffness=1e4):
    """A mass that falls on a dashpot stop: end (2,) and its derivatives to (y, y', gap)."""
    def flight(state, t):
        y, v = state
        return np.array([y + v * t - 0.5 * GRAVITY * t**2, v - GRAVITY * t])

    touch = (speed + np.sqrt(speed**2 + 2.0 * GRAVITY * height)) / GRAVITY
    matrix = np.array([[0.0, 1.0], [-stiffness, -damping]])
    rest = np.array([-GRAVITY / stiffness, 0.0])
    later = expm(matrix * (end - touch))
    struck = np.array([0.0, flight((height, speed), touch)[1]])
    before, after = np.array([struck[1], -GRAVITY]), matrix @ (struck - rest)
    to_touch = np.array([[1.0, touch], [0.0, 1.0]])
    # The time of touch changes by -dy / y'.
    jump = np.eye(2) + np.outer(after - before, [1.0, 0.0]) / struck[1]
    transition = later @ jump @ to_touch
    # A gap moves the stop: in its frame the mass begins so much higher.
    by_gap = transition[:, 0] - np.array([1.0, 0.0])
    return rest + later @ (struck - rest), np.column_stack([transition, by_gap])


def dashpot_stop(**parts):
    return mass_in_y(**{"normal": LinearContact(1e4, 30.0), "friction": ConstantFriction(0.0),
                        "load": Load(GRAVITY), **parts})


@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_a_fall_on_a_dashpot(gap):
    system, height, speed, end = dashpot_stop(gap=gap), 0.05, -0.1, 0.1
    begin = np.array([height - gap, speed])
    beside = _moved(system, (lambda one, to: one.with_(gap=to), gap), np.array([0.0, end]), begin)
    run = run_over(system, begin, [0.0, end], 1e-10, beside)
    state, wanted = fall(height, speed, end)
    assert run.states[-1] == pytest.approx(state - [gap, 0.0], abs=1e-9)
    assert run.transitions[-1] == pytest.approx(wanted, rel=2e-8, abs=1e-7)


def test_two_nodes_that_touch_at_once():
    """Each with half of the stop: lift and tilt are two masses on the whole of it."""
    rows = np.zeros((2, 3, 2))
    rows[:, 1, 0], rows[:, 1, 1] = 1.0, (1.0, -1.0)
    C = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows, "C": C})
    system = ContactSystem(basis, normal=LinearContact(np.full(2, 5e3), np.full(2, 15.0)),
                           friction=ConstantFriction(0.0), load=Load(GRAVITY))
    height, speed, end = 0.05, -0.1, 0.1
    run = run_over(system, [height, 0.0, speed, 0.0], [0.0, end], 1e-10, True)
    state, wanted = fall(height, speed, end)
    assert run.states[-1] == pytest.approx([state[0], 0.0, state[1], 0.0], abs=1e-9)
    for mode in range(2):
        own = np.ix_([mode, 2 + mode], [mode, 2 + mode])
        other = np.ix_([mode, 2 + mode], [1 - mode, 3 - mode])
        assert run.transitions[-1][own] == pytest.approx(wanted[:, :2], rel=2e-8, abs=1e-7)
        assert np.abs(run.transitions[-1][other]).max() < 1e-6


@pytest.mark.parametrize("slope", [None, 1e4])
def test_several_impacts_with_a_dashpot(slope):
    """Against differences of runs at 1e-12, with friction that jumps with the normal force."""
    friction = ConstantFriction(0.0) if slope is None else ConstantFriction(0.3, slope)
    gap = 1e-4
    system = mass_in_plane(spring=1e3, normal=LinearContact(3e4, 30.0), friction=friction,
                           ground=Ground(speed=0.02), load=Load(GRAVITY), gap=gap)
    along, away = system.arrays.rows[0, 0], system.arrays.rows[0, 1]
    begin = np.concatenate([1e-5 * along + 5e-3 * away, 0.01 * along])
    times = np.linspace(0.0, 0.2, 3)
    beside = _moved(system, (lambda one, to: one.with_(gap=to), gap), times, begin)
    run = run_over(system, begin, times, 1e-10, beside)
    height = run_over(system, begin, np.linspace(0.0, 0.2, 2001), 1e-9).states[:, :2] @ away
    assert (np.diff(np.sign(height + gap)) < 0.0).sum() >= 2

    def end(piece, state, at):
        return run_over(system.with_(gap=at), state, times[piece : piece + 2], 1e-13).states[-1]

    for piece in range(2):
        state, width = run.states[piece], 1e-7
        for k in range(5):
            aside = width * np.eye(5)[k]
            wanted, _ = difference([end(piece, state + part * aside[:4], gap + part * aside[4])
                                    for part in (-2.0, -1.0, 1.0, 2.0)], width)
            assert np.abs(run.transitions[piece + 1][:, k] - wanted).max() < (
                2e-5 * np.abs(wanted).max())


# Volumes -----------------------------------------------------------------------------------------

@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_volumes_shrink_with_the_damping(damping):
    """Liouville: the determinant follows from the trace of the damping alone, impacts or not."""
    system = mass_in_plane(
        spring=1e3, normal=RoughSurface(1e5, 1e-4), friction=ConstantFriction(0.0),
        drive=Drive(stiffness_x=5e3, stiffness_y=3e3, damping_x=damping, damping_y=2.0 * damping),
        load=Load(3.0))
    run = sensitivity(system, 0.3, initial=np.array([1e-4, 1e-3, 0.0, 0.0]), rtol=1e-9, outputs=4,
                      solver=LONG)
    wanted = np.exp(-3.0 * damping * np.diff(run.times))
    assert np.linalg.det(run.transitions) == pytest.approx(wanted, rel=1e-6)
    unit = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    if damping == 0.0:
        for transition in run.transitions:
            error = transition.T @ unit @ transition - unit
            assert np.abs(error).max() < 1e-7 * np.abs(transition).max() ** 2


# Runs --------------------------------------------------------------------------------------------

def test_runs_go_on_bit_for_bit():
    system, times = friction_oscillator(3), np.linspace(0.0, 0.3, 7)
    beside = _moved(system, "drive.stiffness_x", times, np.zeros(6))
    whole = run_over(system, np.zeros(6), times, 1e-8, beside)
    parts = run_over(system, np.zeros(6), times, 1e-8, beside, pieces=1)
    assert (whole.states == parts.states).all()
    assert (whole.transitions == parts.transitions).all()
    assert whole.attempts == parts.attempts


def test_outputs_do_not_change_the_product():
    """A system whose force jumps too, with outputs at any times."""
    for system, begin, end in (
            (friction_oscillator(2, **{"friction.smoothing_slope": 1e4}), np.zeros(4), 0.5),
            (dashpot_stop(), np.array([0.05, -0.1]), 0.3)):
        times = np.sort(np.append(np.random.default_rng(3).uniform(0.0, end, 30), [0.0, end]))
        one, many = (sensitivity(system, end, initial=begin, outputs=outputs, rtol=1e-10,
                                 solver=LONG, parameter="load.normal")
                     for outputs in (2, times))
        for name in ("monodromy", "parameter_derivative"):
            wanted = getattr(one, name)
            assert np.abs(getattr(many, name) - wanted).max() < 2e-7 * np.abs(wanted).max()


def test_still_derivatives():
    """A mass with neither ground nor drive: straight lines, and a parabola by a load."""
    rows = np.array([[1.0], [0.0], [0.0]])
    system = ContactSystem(
        fc.basis_from_matrices([[2.0]], [[0.0]], {"contact": rows[None], "C": rows}),
        normal=PrescribedForce(3.0), friction=ExponentialFriction(0.0, 0.0, 1.0, 1.0),
        ground=Ground(speed=1.0))
    begin, times = np.array([0.0, 0.1]), np.array([0.0, 2.0])
    run = run_over(system, begin, times, 1e-9, _moved(system, "ground.speed", times, begin))
    assert run.transitions[-1] == pytest.approx(np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 0.0]]),
                                                abs=1e-12)
