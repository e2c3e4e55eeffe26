"""Derivatives of a motion: matrix exponentials, differences of runs, Liouville's formula."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from systems import TURN, friction_oscillator, impact_oscillator, mass_in_y

from fecontact import AnalysisError, Drive, Ground, InputError, sensitivity, simulate
from fecontact.integrate import Rodas5P
from fecontact.laws import IwanFriction, LuGreFriction, PowerContact, Sine

SMOOTH = {"friction.smoothing_slope": 3e3}


def differences(system, t_end, state, scale, rtol=1e-12):
    """dy(t_end)/dy(0) by central differences of runs."""
    columns = []
    for k, step in enumerate(1e-5 * scale):
        ends = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[k] += sign * step
            ends.append(simulate(system, t_end, initial=moved, outputs=2, rtol=rtol).states[-1])
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.column_stack(columns)


def assert_close(found, wanted, scale, relative):
    """Compare in units of the scales of the state."""
    found, wanted = (item / scale[:, None] * scale for item in (found, wanted))
    assert np.abs(found - wanted).max() < relative * np.abs(wanted).max()


def test_free_flight_is_a_matrix_exponential():
    system = impact_oscillator(modes=2)
    state = np.array([1e-3, 1e-4, 0.0, 0.0])
    t_end = 0.02
    found = sensitivity(system, t_end, initial=state, rtol=1e-11)
    assert (simulate(system, t_end, initial=state).normal_force == 0.0).all()
    A = np.block([[np.zeros((2, 2)), np.eye(2)],
                  [-system.arrays.stiffness, -system.arrays.damping]])
    wanted = scipy.linalg.expm(A * t_end)
    assert found.monodromy == pytest.approx(wanted, rel=1e-8, abs=1e-8 * np.abs(wanted).max())


@pytest.mark.parametrize(("system", "t_end"), [
    (friction_oscillator(3, **SMOOTH), 0.05),
    (friction_oscillator(2, **SMOOTH, ground=Ground(speed=2e-3, profile=Sine(2e-5, 2.5e-3))),
     0.005),
    (friction_oscillator(2, friction=LuGreFriction(
        0.8, 0.55, stribeck_velocity=1e-3, bristle_stiffness=1e5, bristle_damping=100.0,
        stribeck_exponent=2.0)), 0.05),
    (friction_oscillator(2, friction=IwanFriction(2e4, 0.6, elements=3)), 0.01),
], ids=["three modes", "waves", "LuGre", "Iwan"])
def test_differences_of_runs(system, t_end):
    start = simulate(system, 0.3, outputs=2).states[-1]
    m = system.basis.modes
    scale = np.concatenate([np.full(m, 1e-4), np.full(m, 1e-3), system.memory_scales])
    found = sensitivity(system, t_end, initial=start, rtol=1e-11)
    wanted = differences(system, t_end, start, scale)
    # Elements of Iwan's chain yield one by one, each a kink that no step ends at.
    relative = 2e-5 if system.memory != 3 else 1e-3
    assert_close(found.monodromy, wanted, scale, relative)


def test_transitions_are_the_pieces_of_the_whole():
    system = friction_oscillator(3, **SMOOTH)
    pieces = sensitivity(system, 0.3, outputs=7, parameter="ground.speed", rtol=1e-10)
    whole = sensitivity(system, 0.3, parameter="ground.speed", rtol=1e-10)
    assert pieces.transitions.shape == (6, 6, 6)
    assert pieces.forced.shape == (6, 6)
    scale = np.array([1e-4] * 3 + [1e-3] * 3)
    assert_close(pieces.monodromy, whole.monodromy, scale, 1e-6)
    wanted = whole.parameter_derivative / scale
    assert np.abs(pieces.parameter_derivative / scale - wanted).max() < 1e-6 * abs(wanted).max()
    run = simulate(system, 0.3, outputs=7, rtol=1e-10)
    assert pieces.states == pytest.approx(run.states, rel=1e-6, abs=1e-9)


def test_volume_shrinks_with_the_trace():
    """det dy/dy_0 = exp of the integral of the trace of the Jacobian (Liouville)."""
    system = friction_oscillator(3, **{"friction.smoothing_slope": 300.0, "ground.speed": 0.02})
    start = simulate(system, 0.3, outputs=2).states[-1]
    times = np.linspace(0.0, 0.05, 20001)
    run = simulate(system, times[-1], initial=start, outputs=times, rtol=1e-11)
    found = sensitivity(system, times[-1], initial=start, outputs=3, rtol=1e-11)
    traces = [np.trace(system.jacobian(t, y)) for t, y in zip(times, run.states, strict=True)]
    integral = np.trapezoid(traces, times)
    assert integral < -0.1
    logarithms = [np.linalg.slogdet(one)[1] for one in found.transitions]
    assert sum(logarithms) == pytest.approx(integral, rel=1e-5)


@pytest.mark.parametrize("name", [
    "ground.speed", "friction.static_coefficient", "friction.smoothing_slope", "load.normal",
    "normal.stiffness", "normal.roughness_height", "drive.amplitude_x", "drive.stiffness_x",
    "drive.frequency_hz",
])
def test_derivatives_to_parameters(name):
    system = friction_oscillator(3, **SMOOTH)
    start = simulate(system, 0.3, outputs=2).states[-1]
    found = sensitivity(system, 0.05, initial=start, parameter=name, rtol=1e-11)
    value = system.parameters()[name]
    step = 1e-4 * value
    ends = [simulate(system.with_(**{name: value + sign * step}), 0.05, initial=start, outputs=2,
                     rtol=1e-12).states[-1] for sign in (1.0, -1.0)]
    wanted = (ends[0] - ends[1]) / (2.0 * step)
    scale = np.array([1e-4] * 3 + [1e-3] * 3)
    assert np.abs((found.parameter_derivative - wanted) / scale).max() < (
        1e-4 * np.abs(wanted / scale).max())


@pytest.mark.parametrize(("name", "value"), [
    ("drive.frequency_hz", 64.32 / TURN), ("drive.amplitude_y", 0.47e-3), ("drive.damping_y", 0.0),
])
def test_derivatives_that_begin_slowly(name, value):
    """The push of the parameter is zero at the start and grows with time."""
    system = impact_oscillator(modes=2).with_(**{"drive.frequency_hz": 64.32 / TURN, name: value})
    start = np.array([-6.95891022e-06, 7.11400198e-07, -7.91871183e-03, 3.15884285e-03])
    t_end = 2.0 * np.pi / 64.32
    found = sensitivity(system, t_end, initial=start, parameter=name)
    step = 1e-4 * (value or 0.02)
    ends = [simulate(system.with_(**{name: value + move}), t_end, initial=start, outputs=2,
                     rtol=1e-12).states[-1] for move in (0.0, step, 2.0 * step)]
    wanted = (-1.5 * ends[0] + 2.0 * ends[1] - 0.5 * ends[2]) / step
    scale = np.array([1e-6, 1e-6, 1e-3, 1e-3])
    assert np.abs((found.parameter_derivative - wanted) / scale).max() < (
        1e-3 * np.abs(wanted / scale).max())


@pytest.mark.parametrize("parameter", [3, (0.5,), ("ground.speed", 0.5), (Drive, "a")])
def test_a_parameter_that_is_none_is_named(parameter):
    with pytest.raises(InputError, match=r"parameter = .* must be the dotted name"):
        sensitivity(friction_oscillator(2, **SMOOTH), 0.1, parameter=parameter)


def test_a_parameter_may_be_a_function():
    system = friction_oscillator(2, **SMOOTH)

    def pull(system, value):
        return system.with_(drive=replace(system.drive, amplitude_x=value))

    one = sensitivity(system, 0.1, parameter=(pull, 0.5e-3))
    other = sensitivity(system, 0.1, parameter="drive.amplitude_x")
    assert one.parameter_derivative == pytest.approx(other.parameter_derivative, rel=1e-9)


def test_impacts():
    system = impact_oscillator(modes=2)
    state = np.array([2e-5, 0.0, -0.02, 0.0])
    found = sensitivity(system, 0.02, initial=state, rtol=1e-10)
    run = simulate(system, 0.02, initial=state, rtol=1e-10)
    assert 0.05 < (run.normal_force > 0.0).mean() < 0.5
    wanted = differences(system, 0.02, state, np.array([1e-6, 1e-6, 1e-3, 1e-3]))
    assert_close(found.monodromy, wanted, np.array([1e-6, 1e-6, 1e-3, 1e-3]), 1e-4)


def test_bad_input():
    system = friction_oscillator(2)
    with pytest.raises(InputError, match=r"friction\.static_coefficient"):
        sensitivity(system, 0.1, parameter="friction.static_coeficient")
    with pytest.raises(InputError, match=r"'drive' is Drive\(.*not one number; give the dotted"):
        sensitivity(system, 0.1, parameter="drive")
    for function in (lambda system: system, lambda system, value: None):
        with pytest.raises(InputError, match="The function <lambda>"):
            sensitivity(system, 0.1, parameter=(function, 1.0))
    with pytest.raises(InputError, match="rtol = 1"):
        sensitivity(system, 0.1, rtol=1.0)
    with pytest.raises(InputError, match="No parameter was named"):
        _ = sensitivity(system, 0.01).parameter_derivative
    with pytest.raises(AnalysisError, match="before t_end"):
        sensitivity(mass_in_y(normal=PowerContact(1e6, exponent=6.0)), 0.1, initial=[0.0, -9e59],
                    solver=Rodas5P())
