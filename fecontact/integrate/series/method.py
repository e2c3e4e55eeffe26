"""Steps by power series, from one switch of the contacts to the next.

Between two switches forces are polynomials of displacements, velocities and signals, and the motion
is a power series in time, whose coefficients follow from one another. A step is as long as its last
coefficients allow, and ends before that where a node leaves the piece of its law that acts: at the
first zero of its distance from the ends of that piece, none of which is missed, or where its force
falls to zero.
"""

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.integrate.rodas5p import state
from fecontact.integrate.rodas5p.error_control import largest_energy, take_scales
from fecontact.integrate.rodas5p.event_kernels import (
    FOUND,
    NODES,
    OPEN,
    STICKING,
    Watch,
    first_stop,
    note_zone,
)
from fecontact.integrate.rodas5p.state import SPEED_SCALE, SWITCHES, WORST_NODE
from fecontact.integrate.series.branches import (
    ACTS,
    MET,
    MET_LOWER,
    MET_NOTHING,
    MET_RELEASE,
    MET_UPPER,
    PLACE,
    Series,
)
from fecontact.integrate.series.expansion import (
    expand,
    expand_powers,
    integrate_powers,
    set_forcing,
)
from fecontact.integrate.series.polynomials import COEFFICIENTS, DEGREE, first_zero, value_at
from fecontact.integrate.small_systems import FEW, Sized
from fecontact.integrate.step_loop import (
    BEYOND,
    FAILED,
    NOT_A_NUMBER,
    RATES,
    RUNNING,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.laws.pieces import LOWER, RELEASE, UPPER
from fecontact.system.powers import (
    CONTACT_DAMPING,
    DASHPOTS,
    DRIVE,
    LOAD,
    MODAL_DAMPING,
)

# Columns of the work in the order of `Series.powers`.
_WORKS = np.array([DRIVE, LOAD, MODAL_DAMPING, DASHPOTS, CONTACT_DAMPING])
# Steps grow at most so much at a time.
_LARGEST_GROWTH = 50.0
# Switches at one time, per node, beyond which time goes on regardless.
_MOST_SWITCHES = 8


class Data(NamedTuple):
    """A run by power series; ``series`` has the state of its contacts."""

    problem: state.Problem
    progress: state.Progress
    output: state.Output
    kept: state.Output
    watch: Watch
    series: Series


class Step(NamedTuple):
    """A step that is tried.

    Attributes
    ----------
    t, h, target : float
        Its begin, its length, and the time at its end.
    unit : float
        The length over which the motion is expanded.
    part : float
        Its length in these.
    node, meets : int
        Node that leaves its piece of the law at the end, -1 if none does, and what it meets.
    error : float
        0; 2 if the motion cannot be expanded over a step that the time tells from none; infinite
        if it is not finite.
    next : float
        Length of the next step.
    """

    t: float
    h: float
    target: float
    unit: float
    part: float
    node: int
    meets: int
    error: float
    next: float


@helper
def _length(control, progress, series, h):
    """Part of h until the last terms of the series are within the tolerance; inf if not finite."""
    last, before = 0.0, 0.0
    speed = max(progress.numbers[SPEED_SCALE], control.speed_scale)
    for i in range(len(series.q)):
        size = max(progress.extremes[i], control.displacement_scale[i])
        size = min(size, speed / control.largest[i] * h / DEGREE) * series.tolerance
        last = max(last, abs(series.q[i, DEGREE]) / size)
        before = max(before, abs(series.q[i, DEGREE - 1]) / size)
        if not abs(series.q[i, DEGREE]) < np.inf:
            return -1.0
    return _within(last, before)


@helper
def _within(last, before):
    """Part at which the last two terms are within 1."""
    x = _LARGEST_GROWTH
    if last > 1e-40:
        x = min(x, math.exp(math.log(last) * (-1.0 / DEGREE)))
    if before > 1e-38:
        x = min(x, math.exp(math.log(before) * (-1.0 / (DEGREE - 1))))
    return x


@helper
def _work_length(control, progress, series, h):
    """Part of h until the last terms of the work are within the tolerance."""
    energy = largest_energy(progress.state, control, progress)
    last, before = 0.0, 0.0
    for row in range(len(series.powers)):
        last = max(last, abs(series.powers[row, DEGREE]))
        before = max(before, abs(series.powers[row, DEGREE - 1]))
    scale = 1.0 / (series.tolerance * energy)
    return _within(last * scale, before * scale)


@routine
def _first_switch(limit, h, series):
    """Part of h at which a node leaves its piece first, that node, and what it meets."""
    first, node, meets = 2.0 * limit, -1, MET_NOTHING
    line = series.line[0]
    for j in range(len(series.states)):
        piece, met = series.pieces[j, series.states[j, PLACE]], series.states[j, MET]
        u = series.u[j]
        for what in range(1, 4):
            if what == MET_LOWER:
                if not piece[LOWER] > -np.inf:
                    continue
                for k in range(COEFFICIENTS):
                    line[k] = u[k]
                line[0] -= piece[LOWER]
            elif what == MET_UPPER:
                if not piece[UPPER] < np.inf:
                    continue
                for k in range(COEFFICIENTS):
                    line[k] = -u[k]
                line[0] += piece[UPPER]
            else:
                r0, r1, r2 = piece[RELEASE], piece[RELEASE + 1], piece[RELEASE + 2]
                if r2 == 0.0:
                    continue
                sign = 1.0 if series.states[j, ACTS] else -1.0
                for k in range(COEFFICIENTS):
                    line[k] = sign * r1 * u[k]
                    if k < DEGREE:
                        line[k] += sign * r2 * (k + 1) / h * u[k + 1]
                line[0] += sign * r0
            if what == met:
                # Zero within rounding: it has just been passed.
                line[0] = 0.0
            part = first_zero(line, min(first, limit), series.workspace)
            if part <= limit and part < first:
                first, node, meets = part, j, what
    return first, node, meets


@helper
def _switch(j, meets, h, series):
    """Let node j go on to where it is past what it has met, at a time at which u, v are series[0].

    Returns whether its force begins (1), ends (-1) or neither (0).
    """
    acted = series.states[j, ACTS]
    if meets == MET_RELEASE:
        series.states[j, ACTS], series.states[j, MET] = 1 - acted, MET_RELEASE
        return 1 - 2 * acted
    up = meets == MET_UPPER
    here = series.pieces[j, series.states[j, PLACE]]
    u = here[UPPER] if up else here[LOWER]
    series.states[j, PLACE] += 1 if up else -1
    series.states[j, MET] = MET_LOWER if up else MET_UPPER
    piece = series.pieces[j, series.states[j, PLACE]]
    r0, r1, r2 = piece[RELEASE], piece[RELEASE + 1], piece[RELEASE + 2]
    acts = 0
    if r2 == 0.0:
        acts = 1 if r0 != 0.0 or r1 != 0.0 else 0
    elif r0 + r1 * u + r2 * series.line[1, j] > 0.0:
        acts = 1
    series.states[j, ACTS] = acts
    return acts - acted


@helper
def _set_speeds(x, h, series):
    """Rates of the penetrations at the part x of h."""
    for j in range(len(series.u)):
        total = 0.0
        for k in range(DEGREE, 0, -1):
            total = total * x + k * series.u[j, k]
        series.line[1, j] = total / h


@helper
def _set_state(x, series, out):
    """Fill ``out`` (2 m,) with the state at the part x of the expanded length."""
    m = len(series.q)
    for i in range(m):
        out[i] = value_at(series.q[i], x)
        out[m + i] = value_at(series.v[i], x)


@helper
def _add_work(x, series, out):
    """Add to ``out`` (P,) the work up to the part x of the expanded length."""
    for k in range(len(_WORKS)):
        out[_WORKS[k]] += value_at(series.powers[k], x)


@helper
def _note_change(change, step, series, watch):
    """Note that the force of the node begins or ends; whether the run stops there."""
    row = watch.counts[FOUND]
    state = watch.states[row]
    _set_state(step.part, series, state)
    watch.zones[step.node] = OPEN if change > 0 else STICKING
    note_zone(step.node, STICKING if change > 0 else OPEN, step.target, state, watch)
    return first_stop(row, watch) < np.inf


@helper
def _expanded(t, h, problem, progress, series):
    """Expand the motion from t on; the longest step within the tolerance as a part of h."""
    s, control = problem.system, problem.control
    set_forcing(t, h, s, series)
    expand(progress.state, h, s, series)
    part = _length(control, progress, series, h)
    if control.work:
        expand_powers(h, s, series)
        part = min(part, _work_length(control, progress, series, h))
    progress.counts[RATES] += 1
    return part


@helper
def _full(data):
    """Whether a step may have more events than there is room for."""
    watch = data.watch
    most = 4 * _MOST_SWITCHES * len(data.series.states)
    return watch.counts[NODES] != 0 and watch.counts[FOUND] + most > len(watch.found)


@routine
def _next_target(t, h, last, smallest, data):
    """The next step, expanded over the length h: as far as that holds, or to the next switch."""
    problem, progress, series = data.problem, data.progress, data.series
    end, counts = data.output.times[-1], progress.counts
    take_scales(problem.control, progress)
    part = _expanded(t, h, problem, progress, series)
    if part < 0.0:
        return Step(t, h, t, h, 0.0, -1, MET_NOTHING, np.inf, 0.0)
    # A short first step is only the first; NaN fails.
    if not (part * h >= smallest or part >= _LARGEST_GROWTH):
        return Step(t, h, t, h, 0.0, -1, MET_NOTHING, 2.0, part * h)
    part = min(part, series.longest / h)
    whole = part * h
    at_end = t + 1.01 * whole >= end
    if at_end:
        part = (end - t) / h
    first, node, meets = _first_switch(part, h, series)
    counts[SWITCHES] = counts[SWITCHES] + 1 if node >= 0 and first * h <= smallest else 0
    if counts[SWITCHES] > _MOST_SWITCHES * len(series.states):
        # Switches without end at one time: go on a little later, from another place.
        counts[SWITCHES] = 0
        first, node = min(part, 1e3 * smallest / h), -1
    if node < 0:
        first = min(first, part)
    if first * h > smallest:
        for j in range(len(series.states)):
            series.states[j, MET] = MET_NOTHING
    target = end if at_end and first >= part else t + first * h
    return Step(t, target - t, target, h, first, node, meets, 0.0, whole)


@routine
def _attempt(step, last, smallest, data):
    """Whether the step can be taken, and the length of the next one."""
    if step.error > 0.0:
        data.progress.numbers[WORST_NODE] = 0
        return FAILED if step.error < np.inf else NOT_A_NUMBER, step.next
    if data.problem.control.work:
        integrate_powers(step.unit, data.series)
    return TAKEN, step.next


@routine
def _fill(row, output, step, data):
    """Fill a row of the output."""
    x = (output.times[row] - step.t) / step.unit
    _set_state(x, data.series, output.states[row])
    if data.problem.control.work:
        put(data.progress.work, output.work[row])
        _add_work(x, data.series, output.work[row])


@routine
def _find_end(step, data):
    """Let the node that leaves its piece go on to the next; the part after which the run ends."""
    watch, series = data.watch, data.series
    if step.node < 0:
        return BEYOND
    if step.meets != MET_RELEASE:
        _set_speeds(step.part, step.unit, series)
    change = _switch(step.node, step.meets, step.unit, series)
    stops = change != 0 and watch.counts[NODES] != 0 and _note_change(change, step, series, watch)
    return 1.0 if stops else BEYOND


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run."""
    progress, series = data.progress, data.series
    _set_state(step.part, series, progress.state)
    if data.problem.control.work:
        _add_work(step.part, series, progress.work)
    return RUNNING, h


@helper
def _stop_at(part, step, data):
    """Make the end of the step the state of the run: runs end there only."""
    _go_on(step, 0.0, data)


METHOD = Method("series", Data, _next_target, _attempt, _fill, _go_on, full=_full,
                find_end=_find_end, stop_at=_stop_at, places=12)
advance = step_loop(METHOD)
SMALL = Sized(partial(step_loop, METHOD),
              (state.Problem, state.Progress, state.Output, Series), FEW)


def advance_for(problem: state.Problem) -> Any:
    """The loop for a system of this size, or for all."""
    nodes, _, modes = problem.system.rows.shape
    if ((modes, nodes) in FEW and problem.system.second_motion == 0
            and not len(problem.system.polynomial_pairs)):
        return SMALL.of(modes, nodes)
    return advance
