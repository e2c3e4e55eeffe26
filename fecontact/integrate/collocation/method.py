"""Steps by collocation: few long ones, each of which ends where forces switch."""

from functools import partial
from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.integrate.collocation.columns import propagate_at
from fecontact.integrate.collocation.stages import extrapolate, solve_stages
from fecontact.integrate.collocation.step_polynomials import (
    first_switch,
    keep_rates,
    powers_at,
    set_polynomials,
    set_state,
    step_error,
    value_at,
    work_error,
)
from fecontact.integrate.collocation.tableau import (
    ERROR_POWER,
    POINTS,
    STAGES,
)
from fecontact.integrate.collocation.workspace import (
    AGAIN,
    BEGINS,
    ITERATIONS,
    PAST,
    WHOLE,
    Collocation,
    Step,
)
from fecontact.integrate.rodas5p import dynamics, state
from fecontact.integrate.rodas5p.error_control import take_scales
from fecontact.integrate.rodas5p.method import add_jump
from fecontact.integrate.rodas5p.step_length import (
    LAST_STEP,
    REJECTED_LAST,
    SMALLEST_FACTOR,
    next_stop,
    predicted,
    target_of,
)
from fecontact.integrate.rodas5p.variational import Vary, keep, write_columns
from fecontact.integrate.small_systems import Sized
from fecontact.integrate.step_loop import (
    CUT,
    FAILED,
    NOT_A_NUMBER,
    OUTPUTS,
    RATES,
    RUNNING,
    SHORTER,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.system.nodes import ground_motion

_SAFETY, _LARGEST_FACTOR = 0.85, 2.0
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
# Where a switch is found by extrapolation steps end by this part before it, unless it is so near,
# in parts of the step before, that it is known exactly.
_SHORT, _NEXT = 1e-4, 1e-2
# Attempts at a step that end at a switch.
_MOST_AGAIN = 6


class Data(NamedTuple):
    """A run by collocation; ``vary`` as in :class:`fecontact.integrate.rodas5p.method.Data`."""

    problem: state.Problem
    progress: state.Progress
    workspace: state.Workspace
    output: state.Output
    kept: state.Output
    collocation: Collocation
    vary: Vary


@routine
def _set_begin(t, end, problem, progress, workspace, c):
    """Accelerations, and powers, just after t, where the equations may have changed."""
    s, control = problem.system, problem.control
    after = np.nextafter(t, end)
    dynamics.set_given(after, s, workspace.given, workspace.load)
    dynamics.set_rate_and_gradients(progress.state, s, problem.blocks, workspace.given,
                                    workspace.load, workspace.nodes, workspace.scratch, c.rate)
    put(c.rate[len(c.rate) // 2 :], c.accelerations[0])
    if control.work:
        powers_at(after, progress.state, problem, workspace, progress.power)
    progress.counts[RATES] += 1


@routine
def _set_given(step, after, s, c):
    """Signals at the stages, and the speed of the ground just ``after`` the start of the step."""
    for i in range(STAGES):
        dynamics.set_given(min(step.t + POINTS[i] * step.h, step.latest), s, c.given[i], c.load[i])
        c.speeds[i + 1] = c.given[i, dynamics.SPEED]
    c.speeds[0] = ground_motion(after, s).speed


@helper
def _set_work(x, c, out):
    """Fill ``out`` (P,) with the works at x = 2 s - 1."""
    for k in range(len(out)):
        out[k] = value_at(c.work, k, x)


@routine
def _next_target(t, h, last, smallest, data):
    """The next step to try, of about the length h, or exactly that if the last one was cut."""
    problem, progress, workspace, output, c = (data.problem, data.progress, data.workspace,
                                               data.output, data.collocation)
    end = output.times[-1]
    if last == TAKEN:
        # The predicted length may be too short to change the time.
        if not t + h > t:
            h = smallest
        if c.flags[BEGINS] != 0:
            _set_begin(t, end, problem, progress, workspace, c)
        take_scales(problem.control, progress)
        c.cuts[:] = 0.0
    stop, latest, is_break = next_stop(t, problem.control.breaks, end)
    target = target_of(t, h, last == CUT, stop)
    return Step(t, target - t, target, latest, is_break and target == stop, h)


@routine
def _close(step, writes, data):
    """Keep the columns of a step, and write them if an output is in it."""
    variation = data.vary.variation
    if len(variation.columns) > 0:
        keep(variation)
        if writes:
            write_columns(variation, data.vary.transitions[data.progress.counts[OUTPUTS]])


@routine
def _fill(row, output, step, data):
    """Fill a row of the output."""
    c = data.collocation
    x = 2.0 * (output.times[row] - step.t) / step.h - 1.0
    set_state(x, c, output.states[row])
    if data.problem.control.work:
        _set_work(x, c, output.work[row])


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run."""
    problem, progress, output, c = data.problem, data.progress, data.output, data.collocation
    put(c.after, progress.state)
    if problem.control.work:
        put(c.powers[STAGES], progress.power)
        _set_work(1.0, c, progress.work)
        if step.at_break:
            add_jump(step, c.after, problem, progress, output)
    keep_rates(c)
    return RUNNING, h


@helper
def _growth(error):
    """Factor of the length of the next step, by the error of this one."""
    return min(_LARGEST_FACTOR, max(SMALLEST_FACTOR, _SAFETY * max(error, 1e-12)**_POWER))


@helper
def _next_length(h, error, numbers, iterations):
    """Length of the step after an accepted one."""
    factor = _growth(error)
    if iterations >= _EASY[0]:
        factor = min(factor, _HARD if iterations < _EASY[1] else 1.0)
    return h * predicted(factor, h, max(error, 1e-6) ** _POWER, 1e-2**_POWER, numbers)


@helper
def _switch(h, near, solved, error, problem, progress, c):
    """First part of a step at which forces switch, as far as it is known, 2 if none.

    If the step has failed, that may have been why: its polynomials are wrong then, the switch is
    where the motion before would meet it. Unless that is not known either. Also whether it is
    known only about, as it is too far ahead.
    """
    extrapolated = error > 1.0 and c.flags[BEGINS] == 0
    if extrapolated:
        extrapolate(h, progress, c)
        set_polynomials(h, progress, c)
    elif not solved:
        return 2.0, False
    part = first_switch(near, problem, c)
    return part, extrapolated and part * h > _NEXT * progress.numbers[LAST_STEP]


@routine
def _attempt(step, last, smallest, data):
    """Try a step; its outcome, and the length of the next one."""
    problem, progress, workspace, output, c, vary = (data.problem, data.progress, data.workspace,
                                                     data.output, data.collocation, data.vary)
    control, numbers, t = problem.control, progress.numbers, step.t
    # The derivatives of forces jump where these switch: steps with columns end there exactly.
    varies = len(vary.variation.columns) > 0
    at_end = 0.0 if varies else _AT_END
    exactly = last == CUT
    _set_given(step, np.nextafter(t, output.times[-1]), problem.system, c)
    extrapolate(step.h, progress, c)
    before = 2.0 * c.cuts[PAST] if exactly else 0.0
    solved = solve_stages(step.h, before, problem, progress, workspace, c)
    error = moved = np.inf
    if solved:
        set_polynomials(step.h, progress, c)
        error = moved = step_error(step, problem, progress, workspace, c)
        if error <= 1.0 and control.work:
            error = max(error, work_error(step, before, problem, progress, workspace, c))
    # A switch this near to an end counts as being there; the one at which the step before ended
    # has been passed.
    near, part, roughly = max(_TIME * abs(t), smallest), 2.0, False
    if c.flags[BEGINS] != 0:
        near = max(near, _LOCATED * numbers[LAST_STEP])
    near = max(_LOCATED, near / step.h)
    if c.cuts[AGAIN] < _MOST_AGAIN:
        part, roughly = _switch(step.h, near, solved, moved, problem, progress, c)
    if part < 1.0 - max(near, at_end if error <= 1.0 else 0.0):
        c.cuts[WHOLE] = max(c.cuts[WHOLE], step.h)
        c.cuts[AGAIN] += 1.0
        h = step.h * part
        if roughly:
            # From just before it the switch is found exactly.
            return SHORTER, h * (1.0 - _SHORT)
        c.cuts[PAST] = max(_PAST, 1e-3 * _TIME * abs(t) / h)
        return CUT, h * (1.0 + c.cuts[PAST])
    if error <= 1.0 and varies:
        error = max(error, propagate_at(vary.propagate)(
            step, before, near, problem, progress, workspace, c, vary) / vary.variation.tolerance)
    if not error <= 1.0:
        numbers[REJECTED_LAST] = 1.0
        if error < np.inf:
            return FAILED, step.h * _growth(error)
        return NOT_A_NUMBER, step.h * _UNSOLVED
    h = _next_length(step.h, error, numbers, c.flags[ITERATIONS])
    # A step cut short, at a switch or a break, says little of the length of the next one.
    whole = max(c.cuts[WHOLE], step.wanted) if step.at_break else c.cuts[WHOLE]
    c.flags[BEGINS] = 1 if exactly or step.at_break else 0
    if c.flags[BEGINS] != 0:
        h = max(h, min(whole, whole * _growth(error)))
    return TAKEN, min(h, control.longest)


METHOD = Method("collocation", Data, _next_target, _attempt, _fill, _go_on, close=_close, places=4)
# Runs by collocation are of these systems, with any number of columns, or none.
SMALL = Sized(partial(step_loop, METHOD), (state.Problem, state.Progress, state.Workspace,
                                          state.Output, Collocation))
