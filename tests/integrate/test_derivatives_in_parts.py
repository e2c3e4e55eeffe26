"""Derivatives in parts of steps, which are left to the motion: exponentials, a stuck beam."""

import beam_stick_slip as example
import numpy as np
import pytest
import scipy.linalg

from fecontact import sensitivity
from fecontact.integrate import step_loop
from fecontact.integrate.rodas5p import driver

LOAD = "load.normal"


def floating():
    """A beam of eight modes that touches nothing: a linear system."""
    return example.beam(nodes=5, modes=8).with_(gap=1.0)


def exact(system, t):
    """dy/dy_0 and dy/d(load) by the exponential of one matrix."""
    m = system.basis.modes
    A = np.zeros((2 * m + 1, 2 * m + 1))
    A[:m, m : 2 * m] = np.eye(m)
    A[m : 2 * m, : 2 * m] = -np.hstack([system.arrays.stiffness, system.arrays.damping])
    above, below = (system.with_(**{LOAD: load}).arrays.constant_load for load in (15.0, 13.0))
    A[m : 2 * m, -1] = (above - below) / 2.0
    # Rates of the modes make displacements and velocities alike.
    rates = np.maximum(system.basis.angular_frequencies, 1e3)
    size = np.concatenate([1.0 / rates, np.ones(m), [1.0]])
    return scipy.linalg.expm(A * t)[:-1], size


def one_step(system, h, rtol):
    """Derivatives over one step of this length, with a tolerance of their own."""
    wide = 1e-3
    vary = (system.with_(**{LOAD: 14.0 + wide}), system.with_(**{LOAD: 14.0 - wide}), 2.0 * wide)
    run = driver.start(system, np.zeros(system.size), np.array([0.0, h]), rtol=1e8, work=False,
                       vary=vary, vary_rtol=rtol)
    run.progress.numbers[step_loop.STEP] = h
    run.advance(1)
    assert run.outputs == 2
    assert run.attempts == 1
    return run.transitions[-1]


def error(found, wanted, size):
    """Largest error of a column in units of its own size."""
    off, whole = (np.abs(each / size[:-1, None]).max(axis=0) for each in (found - wanted, wanted))
    return (off / whole).max()


def test_one_part_is_of_order_seven():
    system = floating()
    fastest = system.basis.angular_frequencies.max()
    errors = [error(one_step(system, z / fastest, 1e8), *exact(system, z / fastest))
              for z in (0.2, 0.4)]
    assert np.log2(errors[1] / errors[0]) == pytest.approx(8.0, abs=0.1)
    # The error of e^z is 7.1e-7 z^8.
    assert errors[1] == pytest.approx(7.1e-7 * 0.4**8, rel=0.1)


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7])
def test_parts_of_a_step_keep_the_tolerance(rtol):
    system = floating()
    h = 6.0 / system.basis.angular_frequencies.max()
    assert 0.1 * rtol < error(one_step(system, h, rtol), *exact(system, h)) < rtol


def test_vibration_in_free_flight():
    system = floating()
    wanted, size = exact(system, 2e-3)
    found = sensitivity(system, 2e-3, initial=np.zeros(system.size), parameter=LOAD, rtol=1e-9)
    columns = np.column_stack([found.monodromy, found.parameter_derivative])
    assert error(columns, wanted, size) < 1e-6


def distance(found, wanted, modes):
    """Largest difference in units of the largest entry, displacements in 0.1 mm, speeds in 0.1 m/s.
    """
    size = np.repeat([1e-4, 0.1], modes).reshape(-1, *[1] * (wanted.ndim - 1))
    return np.abs((found - wanted) / size).max() / np.abs(wanted / size).max()


@pytest.mark.slow
@pytest.mark.parametrize(("rtol", "within"), [(1e-7, 1e-4), (1e-8, 1e-5)])
def test_a_beam_that_sticks_and_lets_go(rtol, within):
    system = example.beam()
    start, modes, t_end = example.stuck(system), system.basis.modes, 0.05
    fine = sensitivity(system, t_end, initial=start, parameter="ground.speed", rtol=1e-10,
                       derivative_rtol=1e-7)
    found = sensitivity(system, t_end, initial=start, parameter="ground.speed", rtol=rtol)
    assert distance(found.monodromy, fine.monodromy, modes) < within
    assert distance(found.parameter_derivative, fine.parameter_derivative, modes) < within
    largest, others = (np.sort(np.abs(np.linalg.eigvals(each.monodromy)))[::-1][:5]
                       for each in (fine, found))
    assert others == pytest.approx(largest, rel=within)


def test_derivatives_take_few_steps_of_their_own():
    system = example.beam()
    start, times = example.stuck(system), np.array([0.0, 0.05])
    alone, varied = (driver.start(system, start, times, rtol=1e-7, work=False, vary=vary)
                     for vary in (False, True))
    alone.advance(10**9)
    varied.advance(10**9)
    assert varied.attempts < 1.1 * alone.attempts
