"""The loop over steps with a method of its own: an explicit one of Runge and Kutta, of order 5(4).

Its whole code stands here: records, a step to try, an attempt, outputs, and how to go on.
"""

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from fecontact.core.compiled import helper
from fecontact.core.records import ANY, Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.integrate.step_loop import (
    BEYOND,
    COUNTS,
    FAILED,
    FINISHED,
    MINIMUM_STEP,
    NOT_A_NUMBER,
    OUTPUTS,
    RATES,
    REJECTIONS,
    RUNNING,
    STEP,
    STEPS,
    STOPPED,
    TAKEN,
    TIME,
    Method,
    step_loop,
)

# Coefficients of Dormand and Prince; the last stage is the first one of the next step.
A = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
    [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
])
OF_ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
OSCILLATOR, BLOW_UP = 0, 1


class Progress(NamedTuple):
    numbers: Annotated[Array, ANY]
    counts: Annotated[Integers, ANY]
    state: Vector


class Output(NamedTuple):
    times: Vector
    states: Matrix


class Data(NamedTuple):
    """``kind`` is what moves; it stops where the first state falls through ``level``."""

    kind: int
    rtol: float
    level: float
    progress: Progress
    output: Output
    slopes: Matrix
    after: Vector


class Step(NamedTuple):
    t: float
    h: float
    target: float


@helper
def _rate(kind, y, out):
    if kind == OSCILLATOR:
        out[0], out[1] = y[1], -y[0]
    else:
        out[0], out[1] = y[0] * y[0], 0.0


@helper
def _begin(t, data):
    _rate(data.kind, data.progress.state, data.slopes[0])
    return RUNNING


@helper
def _next_target(t, h, last, smallest, data):
    end = data.output.times[-1]
    return Step(t, min(h, end - t), min(t + h, end))


@helper
def _attempt(step, last, smallest, data):
    y, slopes, after = data.progress.state, data.slopes, data.after
    for i in range(1, 7):
        for k in range(2):
            after[k] = y[k]
            for j in range(i):
                after[k] += step.h * A[i, j] * slopes[j, k]
        _rate(data.kind, after, slopes[i])
    data.progress.counts[RATES] += 6
    error = 0.0
    for k in range(2):
        of_state = 0.0
        for i in range(7):
            of_state += step.h * OF_ERROR[i] * slopes[i, k]
        error = max(error, abs(of_state) / data.rtol)
    if not error < np.inf or not abs(after[0]) < np.inf:
        return NOT_A_NUMBER, 0.1 * step.h
    h = step.h * min(5.0, max(0.2, 0.9 * max(error, 1e-10) ** -0.2))
    return TAKEN if error <= 1.0 else FAILED, h


@helper
def _value(x, k, step, data):
    """State k at a part of the step, by a cubic through both ends."""
    y, after, slopes = data.progress.state, data.after, data.slopes
    late, early = x * x, (1.0 - x) * (1.0 - x)
    return (early * ((1.0 + 2.0 * x) * y[k] + x * step.h * slopes[0, k])
            + late * ((3.0 - 2.0 * x) * after[k] - (1.0 - x) * step.h * slopes[6, k]))


@helper
def _fill(row, output, step, data):
    for k in range(2):
        data.output.states[row, k] = _value((data.output.times[row] - step.t) / step.h, k, step,
                                            data)


@helper
def _find_end(step, data):
    if not data.progress.state[0] > data.level >= data.after[0]:
        return BEYOND
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if _value(middle, 0, step, data) > data.level:
            low = middle
        else:
            high = middle
    return high


@helper
def _stop_at(part, step, data):
    first, second = _value(part, 0, step, data), _value(part, 1, step, data)
    data.progress.state[0], data.progress.state[1] = first, second


@helper
def _go_on(step, h, data):
    for k in range(2):
        data.progress.state[k], data.slopes[0, k] = data.after[k], data.slopes[6, k]
    return RUNNING, h


LOOP = step_loop(Method("runge_kutta", Data, _next_target, _attempt, _fill, _go_on, _begin,
                        find_end=_find_end, stop_at=_stop_at))


def start(kind, end, *, rtol=1e-8, level=-np.inf, outputs=21, step=1e-3):
    numbers = np.zeros(2)
    numbers[STEP] = step
    times = np.linspace(0.0, end, outputs)
    return Data(kind, rtol, level, Progress(numbers, np.zeros(COUNTS, dtype=np.int64),
                                            np.array([1.0, 0.0])),
                Output(times, np.zeros((outputs, 2))), np.zeros((7, 2)), np.zeros(2))


def test_a_method_is_a_list_of_functions():
    errors, steps = [], []
    for rtol in (1e-6, 1e-8, 1e-10):
        run = start(OSCILLATOR, 20.0, rtol=rtol)
        assert LOOP(run, 10**6) == FINISHED
        assert run.progress.numbers[TIME] == 20.0
        errors.append(np.abs(run.progress.state - [np.cos(20.0), -np.sin(20.0)]).max())
        steps.append(run.progress.counts[STEPS])
    assert errors[2] < 1e-8
    # The error falls with the fifth power of the step, or a little faster.
    order = np.log(errors[0] / errors[2]) / np.log(steps[2] / steps[0])
    assert 4.5 < order < 6.0
    assert np.abs(run.output.states - np.column_stack(
        [np.cos(run.output.times), -np.sin(run.output.times)])).max() < 1e-5


@pytest.mark.parametrize("piece", [1, 3])
def test_a_run_in_pieces_is_the_same_to_the_last_bit(piece):
    # The first steps are refused.
    whole, parts = (start(OSCILLATOR, 20.0, step=20.0) for _ in range(2))
    LOOP(whole, 10**6)
    assert whole.progress.counts[REJECTIONS] > 1
    ended, calls = RUNNING, 0
    while ended == RUNNING:
        before = parts.progress.counts[STEPS]
        ended, calls = LOOP(parts, piece), calls + 1
        # A call that ends amid refused steps would have taken none.
        assert parts.progress.counts[STEPS] > before
    assert ended == FINISHED
    assert calls >= whole.progress.counts[STEPS] // piece
    for name in ("numbers", "counts", "state"):
        np.testing.assert_array_equal(getattr(parts.progress, name), getattr(whole.progress, name))
    np.testing.assert_array_equal(parts.output.states, whole.output.states)


def test_the_next_step_has_the_length_that_the_method_gives():
    run = start(OSCILLATOR, 20.0)
    assert LOOP(run, 1) == RUNNING
    assert run.progress.numbers.tolist() == [1e-3, 5e-3]


def test_outputs_have_no_part_in_the_steps():
    few, many = start(OSCILLATOR, 20.0, outputs=2), start(OSCILLATOR, 20.0, outputs=5001)
    for run in (few, many):
        assert LOOP(run, 10**6) == FINISHED
    np.testing.assert_array_equal(few.progress.state, many.progress.state)
    np.testing.assert_array_equal(few.progress.counts[STEPS:], many.progress.counts[STEPS:])


def test_a_run_ends_at_an_event_with_the_outputs_before_it():
    run = start(OSCILLATOR, 20.0, level=0.5)
    assert LOOP(run, 10**6) == STOPPED
    assert run.progress.numbers[TIME] == pytest.approx(np.pi / 3.0, abs=1e-5)
    assert run.progress.state == pytest.approx([0.5, -np.sqrt(0.75)], abs=1e-5)
    assert run.progress.counts[OUTPUTS] == 2
    assert not run.output.states[2:].any()


def test_a_run_that_grows_beyond_all_bounds_ends():
    run = start(BLOW_UP, 2.0)
    assert LOOP(run, 10**6) == MINIMUM_STEP
    # x = 1 / (1 - t)
    assert run.progress.numbers[TIME] == pytest.approx(1.0, abs=1e-3)
    assert run.progress.counts[REJECTIONS] > 0
