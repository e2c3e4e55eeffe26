"""Steps of Rodas5P for vector fields.

The Jacobian J = df/dx of each step is the field's own; df/dt is a one-sided difference of second
order over a ten thousandth of the step.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put, put_rows
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.integrate.bernstein import DEPTH
from fecontact.integrate.field_runs.variational import STATES, Varied, propagate, steepest
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
    growth,
    next_length,
    root_of,
    target_of,
)
from fecontact.integrate.step_loop import (
    BEYOND,
    COUNTS,
    CUT,
    FAILED,
    NOT_A_NUMBER,
    OUTPUTS,
    RATES,
    RUNNING,
    STEP,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.integrate.step_polynomials import COEFFICIENTS
from fecontact.system.fields.one_place import FieldKernel, derive_at, evaluate_at

_LOOKS = 16
# Entries of `Progress.numbers`.
NUMBERS = 5


class Step(NamedTuple):
    """A step that is tried: its begin, its length, and the time at its end, twice."""

    t: float
    h: float
    target: float
    latest: float


class Progress(NamedTuple):
    """State of a run, from which it continues.

    Attributes
    ----------
    numbers, counts
        Time, length of the next step and so on; numbers of steps and so on.
    state, rate, sizes
        The state, its rate, and the largest size of each state so far, or its floor.
    J
        Jacobian at the state.
    """

    numbers: Annotated[Array, NUMBERS]
    counts: Annotated[Integers, COUNTS]
    state: Annotated[Array, STATES]
    rate: Annotated[Array, STATES]
    sizes: Annotated[Array, STATES]
    J: Annotated[Array, STATES, STATES]


class Workspace(NamedTuple):
    """Workspace for a step: its end, stages, factors, and what events are sought with."""

    after: Annotated[Array, STATES]
    rate_after: Annotated[Array, STATES]
    J_after: Annotated[Array, STATES, STATES]
    stages: Annotated[Array, tableau.STAGES, STATES]
    stage: Annotated[Array, STATES]
    right: Annotated[Array, STATES]
    base: Annotated[Array, STATES]
    time_rate: Annotated[Array, STATES]
    factors: Annotated[Array, STATES, STATES]
    pivots: Annotated[Integers, STATES]
    dense: Annotated[Array, 3, STATES]
    inner: Annotated[Array, 3, STATES]
    bound: Annotated[Array, 3, COEFFICIENTS]
    halves: Annotated[Array, DEPTH, COEFFICIENTS + 1]


class Output(NamedTuple):
    """Output times (N,), states (N, d), error allowed in a step, longest step."""

    times: Vector
    states: Matrix
    rtol: float
    longest: float


class _View(NamedTuple):
    """A step that is looked into, with its interpolant; y (d,) is the state that is examined."""

    step: Step
    before: Array
    after: Array
    dense: Array
    y: Array


class Data(NamedTuple):
    """A run of a vector field.

    If there are columns in ``varied``, steps end at output times, where the columns are stored and
    restarted. Events are noted in ``watch``.
    """

    field: FieldKernel
    progress: Progress
    workspace: Workspace
    output: Output
    varied: Varied
    watch: Watch


@routine
def _begin(t, data):
    """Prepare the first step of a run."""
    field, progress, watch = data.field, data.progress, data.watch
    numbers, size = progress.numbers, 0.0
    derive_at(field.derive)(t, progress.state, field, progress.rate, progress.J)
    for k in range(len(progress.state)):
        progress.sizes[k] = max(progress.sizes[k], abs(progress.state[k]))
        size = max(size, abs(progress.rate[k]) / progress.sizes[k])
    if size > 0.0:
        numbers[STEP] = min(numbers[STEP], 0.01 / size)
    # A state at rest may not stay there: the first step does not depend on the end of the run.
    steep = steepest(progress.J, progress.sizes)
    if steep > 0.0:
        numbers[STEP] = min(numbers[STEP], 0.1 / steep)
    for k in range(len(watch.own)):
        watch.own_values[k] = event_at(watch.own[k])(t, progress.state, watch.own_parameters[k])
    return RUNNING


@helper
def _full(data):
    """Whether a step may have more events than there is room for."""
    return len(data.watch.own) > 0 and full(data.watch)


@routine
def _next_target(t, h, last, smallest, data):
    """The next step to try, of about the length h."""
    times = data.output.times
    stop = times[data.progress.counts[OUTPUTS]] if len(data.varied.columns) else times[-1]
    target = target_of(t, h, last == CUT, stop)
    return Step(t, target - t, target, target)


@routine
def _set_time_rate(step, field, progress, workspace):
    """Fill ``workspace.time_rate`` with df/dt at the start of a step."""
    part, evaluate = 1e-4 * step.h, evaluate_at(field.evaluate)
    near, far = step.t + part, step.t + 2.0 * part
    evaluate(near, progress.state, field, workspace.right)
    evaluate(far, progress.state, field, workspace.base)
    for k in range(len(progress.state)):
        workspace.time_rate[k] = 0.0
        if far > near > step.t:
            workspace.time_rate[k] = (4.0 * (workspace.right[k] - progress.rate[k])
                                      - (workspace.base[k] - progress.rate[k])) / (far - step.t)


@routine
def _take(step, field, progress, workspace):
    """All stages of a step, and its end in ``workspace.after``."""
    d, evaluate = len(progress.state), evaluate_at(field.evaluate)
    G = 1.0 / (step.h * tableau.GAMMA)
    for i in range(d):
        for k in range(d):
            workspace.factors[i, k] = -progress.J[i, k]
        workspace.factors[i, i] += G
    factorise(workspace.factors, d, workspace.pivots)
    for i in range(tableau.STAGES):
        u = workspace.stages[i]
        if i == 0:
            put(progress.rate, u)
        else:
            tableau.combined(tableau.A[i], 1.0, progress.state, workspace.stages, workspace.stage)
            now = min(step.t + tableau.NODES[i] * step.h, step.target)
            evaluate(now, workspace.stage, field, workspace.base)
            tableau.combined(tableau.C[i], 1.0 / step.h, workspace.base, workspace.stages,
                             workspace.right)
            put(workspace.right, u)
        for k in range(d):
            u[k] += tableau.TIME[i] * step.h * workspace.time_rate[k]
        solve(workspace.factors, workspace.pivots, u)
    for k in range(d):
        workspace.after[k] = workspace.stage[k] + workspace.stages[tableau.STAGES - 1, k]
    progress.counts[RATES] += tableau.STAGES


@routine
def _error(step, field, progress, workspace, rtol):
    """Error of a step as a multiple of what is allowed; rates and Jacobian where it is allowed."""
    error = 0.0
    for k in range(len(progress.state)):
        size = max(progress.sizes[k], abs(workspace.after[k]))
        error = max(error, abs(workspace.stages[tableau.STAGES - 1, k]) / size)
        # Comparisons with NaN are false: make sure that it is not lost.
        if not abs(workspace.after[k]) < np.inf:
            error = np.inf
    if error <= rtol:
        derive_at(field.derive)(step.target, workspace.after, field, workspace.rate_after,
                                workspace.J_after)
        for k in range(len(progress.state)):
            if not abs(workspace.rate_after[k]) < np.inf:
                error = np.inf
    return error / rtol


@routine
def _attempt(step, last, smallest, data):
    """Try a step; its outcome, and the length of the next one."""
    field, progress, workspace, output = data.field, data.progress, data.workspace, data.output
    if last == TAKEN:
        _set_time_rate(step, field, progress, workspace)
    _take(step, field, progress, workspace)
    error = _error(step, field, progress, workspace, output.rtol)
    if not error <= 1.0:
        progress.numbers[REJECTED_LAST] = 1.0
        if not error < np.inf:
            workspace.stages[:] = 0.0
        return FAILED if error < np.inf else NOT_A_NUMBER, step.h * growth(root_of(error))
    tableau.dense_coefficients(workspace.stages, workspace.dense)
    return TAKEN, next_length(step.h, root_of(error), output.longest, progress.numbers)


@routine
def _find_end(step, data):
    """Note the events of a step; the part of it after which the run ends."""
    progress, workspace, watch = data.progress, data.workspace, data.watch
    if len(watch.own) == 0:
        return BEYOND
    tableau.inner_coefficients(progress.state, workspace.after, workspace.dense, workspace.inner)
    set_own_places(progress.state, workspace, watch)
    view = _View(step, progress.state, workspace.after, workspace.dense, workspace.right)
    begun = watch.counts[FOUND]
    for look in range(_LOOKS):
        for k in range(len(watch.own)):
            note_own(k, look / _LOOKS, (look + 1) / _LOOKS, view, watch)
    return (first_stop(begun, watch) - step.t) / step.h


@routine
def _close(step, writes, data):
    """Carry the columns over a step."""
    if len(data.varied.columns):
        propagate(step, data.field, data.progress, data.workspace, data.varied)


@routine
def _fill(row, output, step, data):
    """Fill a row of the output; the columns are stored and restarted there."""
    progress, workspace, varied = data.progress, data.workspace, data.varied
    if output.times[row] == step.target:
        put(workspace.after, output.states[row])
    else:
        part = (output.times[row] - step.t) / step.h
        tableau.interpolated(part, progress.state, workspace.after, workspace.dense,
                             output.states[row])
    put_rows(varied.columns, varied.transitions[row])
    for i in range(len(varied.columns)):
        varied.columns[i] = 0.0
        varied.columns[i, i] = 1.0


@routine
def _stop_at(part, step, data):
    """End the run at a part of the step."""
    progress, workspace = data.progress, data.workspace
    tableau.interpolated(part, progress.state, workspace.after, workspace.dense, workspace.right)
    put(workspace.right, progress.state)


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run."""
    progress, workspace = data.progress, data.workspace
    put(workspace.after, progress.state)
    put(workspace.rate_after, progress.rate)
    put_rows(workspace.J_after, progress.J)
    for i in range(len(progress.state)):
        progress.sizes[i] = max(progress.sizes[i], abs(progress.state[i]))
    return RUNNING, h


METHOD = Method("field", Data, _next_target, _attempt, _fill, _go_on, _begin, close=_close,
                full=_full, find_end=_find_end, stop_at=_stop_at)
advance = step_loop(METHOD)
