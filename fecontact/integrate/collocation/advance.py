"""The step loop by collocation: few long steps, each of which ends where forces switch."""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.integrate.collocation.columns import propagate_at
from fecontact.integrate.collocation.courses import (
    first_switch,
    keep_rates,
    powers_at,
    set_courses,
    step_error,
    value_at,
    work_error,
)
from fecontact.integrate.collocation.room import BEGINS, ITERATIONS, Collocation
from fecontact.integrate.collocation.stages import foretell, solve_stages
from fecontact.integrate.collocation.tableau import (
    ERROR_POWER,
    POINTS,
    SPEED_TERMS,
    STAGES,
)
from fecontact.integrate.rodas5p import dynamics, state
from fecontact.integrate.rodas5p.error_control import take_scales
from fecontact.integrate.rodas5p.state import (
    OUTPUTS,
    RATES,
    REJECTIONS,
    STARTED,
    STEPS,
)
from fecontact.integrate.rodas5p.step_length import (
    LAST_ROOT,
    LAST_STEP,
    REJECTED_LAST,
    STEP,
    TIME,
    next_stop,
)
from fecontact.integrate.rodas5p.step_loop import (
    FINISHED,
    MINIMUM_STEP,
    NOT_FINITE,
    RUNNING,
    add_jump,
)
from fecontact.integrate.rodas5p.variational import Vary, begin_anew, keep, write_columns
from fecontact.system.nodes import ground_motion

_SAFETY, _SMALLEST_FACTOR, _LARGEST_FACTOR = 0.85, 0.1, 2.0
_POWER = -1.0 / ERROR_POWER
# Growth of a step by the iterations that the one before took: a longer one takes more.
_EASY, _HARD = (3, 5), 1.5
# Length of a step after one whose stages could not be solved.
_UNSOLVED = 0.3
# Parts of a step after a switch that are left in it, if its error allows.
_AT_END = 1e-3
# Accuracy of the place of a switch in a step, and how far beyond it the step ends.
_LOCATED, _PAST = 1e-9, 1e-11
# Parts of the time that rounding does not blur.
_TIME = 1e-12
# Where a switch is foretold steps end by this part before it, unless it is so near, in parts of the
# step before, that it is known exactly.
_SHORT, _NEXT = 1e-4, 1e-2
# Attempts at a step that end at a switch.
_MOST_AGAIN = 6


class _Span(NamedTuple):
    """A step that is tried: as :class:`fecontact.integrate.rodas5p.state.Step`."""

    t: float
    h: float
    target: float
    latest: float
    at_break: bool


@helper
def _span(t, h, exactly, breaks, end):
    """The next step to try, of about the length h, or ``exactly`` that, but not past a break."""
    stop, latest, is_break = next_stop(t, breaks, end)
    target = t + h
    if exactly:
        target = min(target, stop)
    elif target + 0.01 * h >= stop:
        target = stop
    elif target + h > stop:
        target = t + 0.5 * (stop - t)
    return _Span(t, target - t, target, latest, is_break and target == stop)


@routine
def _begin(t, end, problem, progress, room, c):
    """Accelerations, and powers, just after t, where the equations may have changed."""
    s, control = problem.system, problem.control
    after = np.nextafter(t, end)
    dynamics.set_given(after, s, room.given, room.load)
    dynamics.set_rate_and_gradients(progress.state, s, problem.blocks, room.given, room.load,
                                    room.nodes, room.scratch, c.rate)
    for k in range(c.accelerations.shape[1]):
        c.accelerations[0, k] = c.rate[len(c.rate) // 2 + k]
    if control.work:
        powers_at(after, progress.state, problem, room, progress.power)
    progress.counts[RATES] += 1


@routine
def _set_given(step, after, s, c):
    """What is given in time at the stages, and the speed of the ground just ``after`` the begin."""
    for i in range(STAGES):
        dynamics.set_given(min(step.t + POINTS[i] * step.h, step.latest), s, c.given[i], c.load[i])
        c.speeds[i + 1] = c.given[i, dynamics.SPEED]
    c.speeds[0] = ground_motion(after, s).speed


@helper
def _set_work(x, c, out):
    """Fill ``out`` (P,) with the works at x = 2 s - 1."""
    for k in range(len(out)):
        out[k] = 0.0
    for power in range(SPEED_TERMS - 1, -1, -1):
        for k in range(len(out)):
            out[k] = out[k] * x + c.work[power, k]


@routine
def _write(step, problem, progress, output, c):
    """Write the outputs up to the end of the step."""
    row, m = progress.counts[OUTPUTS], c.accelerations.shape[1]
    while row < len(output.times) and output.times[row] <= step.target:
        x = 2.0 * (output.times[row] - step.t) / step.h - 1.0
        for k in range(m):
            output.states[row, k] = value_at(c.places, k, x)
            output.states[row, m + k] = value_at(c.rates, k, x)
        if problem.control.work:
            _set_work(x, c, output.work[row])
        row += 1
    progress.counts[OUTPUTS] = row


@routine
def _go_on(step, exactly, problem, progress, output, c):
    """Make the end of the step the state of the run."""
    for k in range(len(progress.state)):
        progress.state[k] = c.after[k]
    if problem.control.work:
        for k in range(len(progress.work)):
            progress.power[k] = c.powers[STAGES, k]
        _set_work(1.0, c, progress.work)
        if step.at_break:
            add_jump(step, c.after, problem, progress, output)
    keep_rates(c)
    c.flags[BEGINS] = 1 if exactly or step.at_break else 0
    progress.counts[STEPS] += 1


@helper
def _growth(error):
    """Factor of the length of the next step, by the error of this one."""
    return min(_LARGEST_FACTOR, max(_SMALLEST_FACTOR, _SAFETY * max(error, 1e-12)**_POWER))


@helper
def _next_length(h, error, numbers, iterations):
    """Length of the step after an accepted one."""
    factor = _growth(error)
    if iterations >= _EASY[0]:
        factor = min(factor, _HARD if iterations < _EASY[1] else 1.0)
    if numbers[LAST_STEP] > 0.0:
        # Steps that had to shrink will have to shrink on (predictive control, Gustafsson).
        factor = max(_SMALLEST_FACTOR, min(factor, factor * (h / numbers[LAST_STEP]) * (
            max(error, 1e-6) ** _POWER / numbers[LAST_ROOT])))
    if numbers[REJECTED_LAST] != 0.0:
        factor = min(factor, 1.0)
    numbers[LAST_STEP], numbers[LAST_ROOT] = h, max(error, 1e-2) ** _POWER
    numbers[REJECTED_LAST] = 0.0
    return h * factor


@helper
def _switch(h, near, solved, error, problem, progress, c):
    """First part of a step at which forces switch, as far as it is known, 2 if none.

    If the step has failed, that may have been why: its course is wrong then, and the switch is
    where the motion before would meet it. Unless that is not known either. Also whether it is
    known only about, as it is too far ahead.
    """
    foretold = error > 1.0 and c.flags[BEGINS] == 0
    if foretold:
        foretell(h, progress, c)
        set_courses(h, progress, c)
    elif not solved:
        return 2.0, False
    part = first_switch(near, problem, c)
    return part, foretold and part * h > _NEXT * progress.numbers[LAST_STEP]


@helper
def _fail(progress):
    progress.counts[REJECTIONS] += 1
    progress.numbers[REJECTED_LAST] = 1.0


def advance(
    problem: state.Problem, progress: state.Progress, room: state.Room, output: state.Output,
    c: Collocation, vary: Vary, most: int,
) -> int:
    """Go on by up to ``most`` attempts at steps, and to an accepted one; returns how it ended.

    Columns of ``vary`` go with the steps as in
    :func:`fecontact.integrate.rodas5p.step_loop.advance`.
    """
    control, numbers, counts = problem.control, progress.numbers, progress.counts
    t, h, end = numbers[TIME], numbers[STEP], output.times[-1]
    smallest = 1e-14 * max(abs(output.times[0]), abs(end))
    # The derivatives of forces jump where these switch: steps with columns end there exactly.
    varies = len(vary.variation.columns) > 0
    at_end = 0.0 if varies else _AT_END
    if counts[STARTED] == 0:
        for k in range(len(progress.state)):
            output.states[0, k] = progress.state[k]
        counts[STARTED], counts[OUTPUTS] = 1, 1
    new, attempts, exactly, again, whole, past = True, 0, False, 0, 0.0, 0.0
    while counts[OUTPUTS] < len(output.times):
        if new:
            if attempts >= most:
                break
            # What is predicted may be too short to move the time.
            if not t + h > t:
                h = smallest
            if c.flags[BEGINS] != 0:
                _begin(t, end, problem, progress, room, c)
            take_scales(control, progress)
            new, again, whole = False, 0, 0.0
        attempts += 1
        wanted, step = h, _span(t, h, exactly, control.breaks, end)
        _set_given(step, np.nextafter(t, end), problem.system, c)
        foretell(step.h, progress, c)
        before = 2.0 * past if exactly else 0.0
        solved = solve_stages(step.h, before, problem, progress, room, c)
        error = moved = np.inf
        if solved:
            set_courses(step.h, progress, c)
            error = moved = step_error(step, problem, progress, room, c)
            if error <= 1.0 and control.work:
                error = max(error, work_error(step, before, problem, progress, room, c))
        # A switch nearer to an end is there, as far as the time can tell; that at which the step
        # before ended is passed.
        near, part = max(_TIME * abs(t), smallest), 2.0
        if c.flags[BEGINS] != 0:
            near = max(near, _LOCATED * numbers[LAST_STEP])
        near = max(_LOCATED, near / step.h)
        roughly = False
        if again < _MOST_AGAIN:
            part, roughly = _switch(step.h, near, solved, moved, problem, progress, c)
        if part < 1.0 - max(near, at_end if error <= 1.0 else 0.0):
            counts[REJECTIONS] += 1
            whole = max(whole, step.h)
            if roughly:
                # From just before it the switch is found exactly.
                h, exactly = step.h * part * (1.0 - _SHORT), False
                again += 1
                continue
            h, exactly = step.h * part, True
            past = max(_PAST, 1e-3 * _TIME * abs(t) / h)
            h *= 1.0 + past
            again += 1
            continue
        if error <= 1.0 and varies:
            error = max(error, propagate_at(vary.propagate)(
                step.t, step.h, step.latest, before, near, problem, progress, room, c, vary)
                / vary.variation.tolerance)
        if not error <= 1.0:
            _fail(progress)
            h = step.h * (_growth(error) if error < np.inf else _UNSOLVED)
            exactly = False
            if not h >= smallest:
                numbers[TIME], numbers[STEP] = t, h
                return MINIMUM_STEP if error < np.inf else NOT_FINITE
            continue
        if varies:
            keep(vary.variation)
            if output.times[counts[OUTPUTS]] <= step.target:
                write_columns(vary.variation, vary.transitions[counts[OUTPUTS]])
                begin_anew(vary.variation)
        _write(step, problem, progress, output, c)
        _go_on(step, exactly, problem, progress, output, c)
        t, new, ends, exactly = step.target, True, exactly, False
        h = _next_length(step.h, error, numbers, c.flags[ITERATIONS])
        # A step cut short, at a switch or a break, says little of the length of the next one.
        if step.at_break:
            whole = max(whole, wanted)
        if ends or step.at_break:
            h = max(h, min(whole, whole * _growth(error)))
        h = min(h, control.longest)
    numbers[TIME], numbers[STEP] = t, h
    return FINISHED if counts[OUTPUTS] == len(output.times) else RUNNING
