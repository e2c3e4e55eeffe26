"""The compiled integrator of vector fields: Rodas5P steps of variable size over output times.

The Jacobian J = df/dx of each step is the field's own; df/dt is a one-sided difference of second
order over a ten thousandth of the step.
"""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import kernel, routine
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.core.types import Array
from fecontact.integrate.field_runs.variational import Varied, propagate, steepest
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.rodas5p.event_kernels import (
    FOUND,
    Watch,
    event_at,
    first_stop,
    full,
    note_own,
    set_own_places,
)
from fecontact.integrate.rodas5p.step_length import (
    REJECTED_LAST,
    SMALLEST_FACTOR,
    STEP,
    TIME,
    growth,
    next_length,
    root_of,
)
from fecontact.integrate.rodas5p.step_loop import (
    FINISHED,
    MINIMUM_STEP,
    NOT_FINITE,
    RUNNING,
    STOPPED,
)
from fecontact.system.fields.one_place import FieldKernel, derive_at, evaluate_at

# Entries of Progress.counts; those of Progress.numbers are those of `step_length`.
OUTPUTS, STEPS, REJECTIONS, RATES, STARTED = range(5)

_LOOKS = 16


class Step(NamedTuple):
    """A step that is tried: its begin, its length, and the time at its end, twice."""

    t: float
    h: float
    target: float
    latest: float


class Progress(NamedTuple):
    """What a run goes on from.

    Attributes
    ----------
    numbers, counts : (5,), (5,) arrays
        Time, length of the next step and so on; numbers of steps and so on.
    state, rate, sizes : (d,) arrays
        The state, its rate, and the largest size of each state so far, or its floor.
    J : (d, d) array
        Jacobian at the state.
    """

    numbers: Vector
    counts: IntegerVector
    state: Vector
    rate: Vector
    sizes: Vector
    J: Matrix


class Room(NamedTuple):
    """Room for a step: its end, stages, factors, and what events are sought with."""

    after: Vector
    rate_after: Vector
    J_after: Matrix
    stages: Matrix
    stage: Vector
    right: Vector
    base: Vector
    time_rate: Vector
    factors: Matrix
    pivots: IntegerVector
    dense: Matrix
    inner: Matrix
    bound: Matrix
    halves: Matrix


class Output(NamedTuple):
    """Output times (N,), states (N, d), error allowed in a step, longest step."""

    times: Vector
    states: Matrix
    rtol: float
    longest: float


class _View(NamedTuple):
    """A step that is looked into, with its interpolant; y (d,) is the state that is looked at."""

    step: Step
    before: Array
    after: Array
    dense: Array
    y: Array


@routine
def _start(t, field, progress, room, output, watch):
    """Prepare the first step of a run, and write its first output."""
    numbers, size = progress.numbers, 0.0
    derive_at(field.derive)(t, progress.state, field, progress.rate, progress.J)
    for k in range(len(progress.state)):
        progress.sizes[k] = max(progress.sizes[k], abs(progress.state[k]))
        size = max(size, abs(progress.rate[k]) / progress.sizes[k])
        output.states[0, k] = progress.state[k]
    if size > 0.0:
        numbers[STEP] = min(numbers[STEP], 0.01 / size)
    # What is at rest may not stay there: the first step does not depend on the end of the run.
    steep = steepest(progress.J, progress.sizes)
    if steep > 0.0:
        numbers[STEP] = min(numbers[STEP], 0.1 / steep)
    for k in range(len(watch.own)):
        watch.own_values[k] = event_at(watch.own[k])(t, progress.state, watch.own_parameters[k])
    progress.counts[STARTED], progress.counts[OUTPUTS] = 1, 1


@routine
def _set_time_rate(step, field, progress, room):
    """Fill ``room.time_rate`` with df/dt at the start of a step."""
    part, evaluate = 1e-4 * step.h, evaluate_at(field.evaluate)
    near, far = step.t + part, step.t + 2.0 * part
    evaluate(near, progress.state, field, room.right)
    evaluate(far, progress.state, field, room.base)
    for k in range(len(progress.state)):
        room.time_rate[k] = 0.0
        if far > near > step.t:
            room.time_rate[k] = (4.0 * (room.right[k] - progress.rate[k])
                                 - (room.base[k] - progress.rate[k])) / (far - step.t)


@routine
def _take(step, field, progress, room):
    """All stages of a step, and its end in ``room.after``."""
    d, evaluate = len(progress.state), evaluate_at(field.evaluate)
    G = 1.0 / (step.h * tableau.GAMMA)
    for i in range(d):
        for k in range(d):
            room.factors[i, k] = -progress.J[i, k]
        room.factors[i, i] += G
    factorise(room.factors, d, room.pivots)
    for i in range(tableau.STAGES):
        u = room.stages[i]
        if i == 0:
            for k in range(d):
                u[k] = progress.rate[k]
        else:
            tableau.combined(tableau.A[i], 1.0, progress.state, room.stages, room.stage)
            now = min(step.t + tableau.NODES[i] * step.h, step.target)
            evaluate(now, room.stage, field, room.base)
            tableau.combined(tableau.C[i], 1.0 / step.h, room.base, room.stages, room.right)
            for k in range(d):
                u[k] = room.right[k]
        for k in range(d):
            u[k] += tableau.TIME[i] * step.h * room.time_rate[k]
        solve(room.factors, room.pivots, u)
    for k in range(d):
        room.after[k] = room.stage[k] + room.stages[tableau.STAGES - 1, k]
    progress.counts[RATES] += tableau.STAGES


@routine
def _error(step, field, progress, room, rtol):
    """Error of a step as a multiple of what is allowed; rates and Jacobian where it is allowed."""
    error = 0.0
    for k in range(len(progress.state)):
        size = max(progress.sizes[k], abs(room.after[k]))
        error = max(error, abs(room.stages[tableau.STAGES - 1, k]) / size)
        # Comparisons with NaN are false: make sure that it is not lost.
        if not abs(room.after[k]) < np.inf:
            error = np.inf
    if error <= rtol:
        derive_at(field.derive)(step.target, room.after, field, room.rate_after, room.J_after)
        for k in range(len(progress.state)):
            if not abs(room.rate_after[k]) < np.inf:
                error = np.inf
    return error / rtol


@routine
def _find_events(step, progress, room, watch):
    """Note the events of an accepted step; the part of it after which the run ends, or 2."""
    if len(watch.own) == 0:
        return 2.0
    tableau.inner_coefficients(progress.state, room.after, room.dense, room.inner)
    set_own_places(progress.state, room, watch)
    view = _View(step, progress.state, room.after, room.dense, room.right)
    begun = watch.counts[FOUND]
    for look in range(_LOOKS):
        for k in range(len(watch.own)):
            note_own(k, look / _LOOKS, (look + 1) / _LOOKS, view, watch)
    return first_stop(step, begun, watch)


@routine
def _write(step, reached, progress, room, output, varied):
    """Write the outputs up to the time ``reached`` within the step."""
    row = progress.counts[OUTPUTS]
    while row < len(output.times) and output.times[row] <= reached:
        if output.times[row] == step.target:
            for k in range(len(room.after)):
                output.states[row, k] = room.after[k]
        else:
            part = (output.times[row] - step.t) / step.h
            tableau.interpolated(part, progress.state, room.after, room.dense, output.states[row])
        if len(varied.columns):
            for i in range(len(varied.columns)):
                for k in range(len(varied.columns)):
                    varied.transitions[row, i, k] = varied.columns[i, k]
                    varied.columns[i, k] = 1.0 if i == k else 0.0
        row += 1
    progress.counts[OUTPUTS] = row


@routine
def _go_on(step, progress, room):
    """Make the end of the step the state of the run."""
    d = len(progress.state)
    for i in range(d):
        progress.state[i], progress.rate[i] = room.after[i], room.rate_after[i]
        progress.sizes[i] = max(progress.sizes[i], abs(room.after[i]))
        for k in range(d):
            progress.J[i, k] = room.J_after[i, k]
    progress.counts[STEPS] += 1


@kernel(nogil=True)
def advance(
    field: FieldKernel, progress: Progress, room: Room, output: Output, varied: Varied,
    watch: Watch, most: int,
) -> int:
    """Go on until ``most`` steps have been tried and one accepted; returns how it ended.

    Fills the states of the output times passed, and notes events in ``watch``; when that is full
    the call returns. If there are columns in ``varied``, steps end at output times, where the
    columns are stored and begin anew.
    """
    numbers, counts, times = progress.numbers, progress.counts, output.times
    t, h, end = numbers[TIME], numbers[STEP], times[-1]
    smallest = 1e-14 * max(abs(times[0]), abs(end))
    if counts[STARTED] == 0:
        _start(t, field, progress, room, output, watch)
        h = numbers[STEP]
    new, attempts = True, 0
    while counts[OUTPUTS] < len(times):
        # A step that failed is repeated before the call returns.
        if new and (attempts >= most or (len(watch.own) > 0 and full(watch))):
            break
        attempts += 1
        stop = times[counts[OUTPUTS]] if len(varied.columns) else end
        target = t + h
        if target + 0.01 * h >= stop:
            target = stop
        elif target + h > stop:
            target = t + 0.5 * (stop - t)
        step = Step(t, target - t, target, target)
        if new:
            _set_time_rate(step, field, progress, room)
        _take(step, field, progress, room)
        error = _error(step, field, progress, room, output.rtol)
        new = error <= 1.0
        if not new:
            counts[REJECTIONS] += 1
            numbers[REJECTED_LAST] = 1.0
            h = step.h * (growth(root_of(error)) if error < np.inf else SMALLEST_FACTOR)
            if not error < np.inf:
                room.stages[:] = 0.0
            if not h >= smallest:
                numbers[TIME], numbers[STEP] = t, h
                return MINIMUM_STEP if error < np.inf else NOT_FINITE
            continue
        tableau.dense_coefficients(room.stages, room.dense)
        ends = _find_events(step, progress, room, watch)
        reached = step.target if ends > 1.0 else t + ends * step.h
        if len(varied.columns):
            propagate(step, field, progress, room, varied)
        _write(step, reached, progress, room, output, varied)
        if ends <= 1.0:
            tableau.interpolated(ends, progress.state, room.after, room.dense, room.right)
            for k in range(len(progress.state)):
                progress.state[k] = room.right[k]
            counts[STEPS] += 1
            numbers[TIME], numbers[STEP] = reached, step.h
            return STOPPED
        _go_on(step, progress, room)
        t, h = step.target, next_length(step.h, root_of(error), output.longest, numbers)
    numbers[TIME], numbers[STEP] = t, h
    return FINISHED if counts[OUTPUTS] == len(times) else RUNNING
