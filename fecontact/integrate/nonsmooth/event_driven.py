"""Compiled run from event to event, of order 8, for contact with few independent slip velocities.

Between events the sticking clusters and the closed stops are constraints. A step in which a
cluster or a stop goes past its margin is cut at the moment where that begins, found in the
step's interpolation to the last digits, and repeated with the shorter length.
"""

import math
from functools import partial
from typing import Any

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.integrate.nonsmooth.dop853 import (
    STAGES,
    error,
    interpolate,
    prepare_dense,
    shortened,
    take,
)
from fecontact.integrate.nonsmooth.equations import (
    derivative,
    place_size,
    set_rates,
    set_slips,
    share_friction,
)
from fecontact.integrate.nonsmooth.event_log import BEGIN, CHANGED, WITHIN, note_at
from fecontact.integrate.nonsmooth.event_search import (
    ROUNDING,
    Data,
    Workspace,
    first_changes,
    least_depth,
)
from fecontact.integrate.nonsmooth.problem import (
    AT_EVENT,
    CLUSTERS,
    DEPTH_SIZE,
    EVENTS,
    FORCE,
    HELD,
    IDLE,
    KNOWN,
    LAST_ERROR,
    NODE_COLUMNS,
    NODE_ENTRIES,
    OPEN,
    PENETRATION,
    RATE,
    RATE_SIZE,
    REPEATED,
    SLIP_SIZE,
    STICK,
    UNCUT,
    Evaluation,
    Limits,
    NonsmoothProblem,
    Output,
    Progress,
    next_target,
    pace,
    pass_break,
)
from fecontact.integrate.nonsmooth.rigid_stops import (
    NO_ACCELERATION,
    NO_IMPULSES,
    RATE_ROUNDING,
    Rebound,
    change_contacts_at,
    settle,
)
from fecontact.integrate.nonsmooth.steps.flights import advance
from fecontact.integrate.nonsmooth.steps.releases import holding, set_left
from fecontact.integrate.nonsmooth.transitions import decide_clusters, hold_velocity
from fecontact.integrate.rodas5p.event_kernels import full
from fecontact.integrate.small_systems import FEW, Sized
from fecontact.integrate.step_loop import (
    BEYOND,
    CUT,
    FAILED,
    IMPACT_UNSOLVED,
    MINIMUM_STEP,
    NOT_A_NUMBER,
    OUTPUTS,
    PARADOX,
    RUNNING,
    STOPPED,
    TAKEN,
    Method,
    step_loop,
)

# Contacts that have just begun to move and change in this part of a step are searched again.
EARLY = 0.25
# Weight of the error before in the control of the steps, and the least one that counts.
_DAMPED, _SMALLEST_ERROR = 0.03, 1e-4
# Events in a row without any time between them after which a run is stuck.
_MOST_IDLE = 200
# Penetration rates at the start below this part of the largest are those of stops at rest.
_SLOW = 1e-9
# Repeated steps in a row, without any time between them, in which what lets go may still hold;
# after these rounding alone holds it.
_MOST_HELD = 3


@helper
def _outcome(flight):
    """Whether a run goes on after a change of contact."""
    return PARADOX if flight == NO_ACCELERATION else (
        IMPACT_UNSOLVED if flight == NO_IMPULSES else RUNNING)


@helper
def _place_size(j, p, limits, progress):
    """Size of the places of node j [m], of whose rounding its penetration has 1e-16."""
    return place_size(j, progress.state, p) + least_depth(j, p, limits)


@helper
def _rebound(slow, p, limits, progress):
    """Rebounds after which stops close.

    Their height is the largest distance of a stop from its ground so far, or size of its places.
    """
    height = progress.largest[DEPTH_SIZE]
    for j in range(len(p.cluster)):
        height = max(height, _place_size(j, p, limits, progress))
    return Rebound(slow, height, 1e-9 * limits.longest)


@helper
def _slow(part, largest):
    """Penetration rate of stops at rest: a part of the largest one, or rounding [m/s]."""
    fast = largest[RATE_SIZE]
    return max(part * fast, RATE_ROUNDING * max(largest[SLIP_SIZE], fast))


@helper
def _start(t, p, limits, progress, w, workspace):
    """Decide at the start of a run which clusters stick and which stops are closed."""
    largest = progress.largest
    derivative(t, progress.state, p, progress.status, progress.closed, w, workspace.rate)
    for c in range(len(p.rows)):
        workspace.released[c] = workspace.arrived[c] = False
        largest[SLIP_SIZE] = max(largest[SLIP_SIZE], abs(w.slip[c]))
    if p.rigid != 0:
        for j in range(len(p.cluster)):
            depth = w.nodes[j, PENETRATION]
            workspace.touched[j] = depth >= -ROUNDING * _place_size(j, p, limits, progress)
            workspace.parting[j] = False
            largest[RATE_SIZE] = max(largest[RATE_SIZE], abs(w.nodes[j, RATE]))
            largest[DEPTH_SIZE] = max(largest[DEPTH_SIZE], abs(depth))
        flight = change_contacts_at(p.change)(
            t, p, progress, workspace, w, _rebound(_slow(_SLOW, largest), p, limits, progress),
            workspace.rate)
        progress.counts[EVENTS] += 1 if workspace.touched.any() else 0
        return _outcome(flight)
    decide_clusters(t, p, progress, workspace, 1e-12 * largest[SLIP_SIZE], w, workspace.rate)
    return RUNNING


@helper
def _show(t, progress, output, w):
    """Let the outputs at the time t that are filled show what comes after, of which w knows."""
    row = progress.counts[OUTPUTS] - 1
    while row >= 0 and output.times[row] >= t:
        put(progress.state, output.states[row])
        put(w.friction, output.friction[row])
        put(w.nodes[:, FORCE], output.normal[row])
        row -= 1


@routine
def _fill(row, output, step, data):
    """Fill a row of the output."""
    p, progress, w, workspace = data.problem, data.progress, data.evaluation, data.workspace
    time, state = output.times[row], output.states[row]
    interpolate((time - step.t) / step.h, progress.state, workspace.parts, state)
    set_rates(time, state, p, progress, w, workspace.rate)
    share_friction(p, progress.status, w)
    for j in range(len(w.friction)):
        output.friction[row, j], output.normal[row, j] = w.friction[j], w.nodes[j, FORCE]


@helper
def _sizes(progress, w):
    """Largest slip velocity, penetration rate and penetration so far, those of w included."""
    largest = progress.largest
    quick, fast, deep = largest[SLIP_SIZE], largest[RATE_SIZE], largest[DEPTH_SIZE]
    for c in range(len(w.slip)):
        quick = max(quick, abs(w.slip[c]))
    for j in range(len(w.friction)):
        fast, deep = max(fast, abs(w.nodes[j, RATE])), max(deep, abs(w.nodes[j, PENETRATION]))
    return quick, fast, deep


@helper
def _lengthened(length, size_of_error, numbers):
    """Length of the step after an accepted one.

    By its error and a little of the one before (PI control), so that steps at the limit of
    stability do not fail by turns; after a step that failed not longer.
    """
    size = max(size_of_error, _SMALLEST_ERROR)
    last = numbers[LAST_ERROR] if numbers[LAST_ERROR] > 0.0 else size
    factor = min(5.0, max(0.5, 0.9 * size ** (0.75 * _DAMPED - 0.125) * last**_DAMPED))
    if numbers[REPEATED] != 0.0:
        factor = min(factor, 1.0)
    numbers[LAST_ERROR], numbers[REPEATED] = size, 0.0
    return length if 1.0 < factor < 1.1 else length * factor


@helper
def _first_place(place):
    """Fraction of the step at which the first contact changes (1.0 if none), and a flag."""
    high, found = 1.0, False
    for k in range(len(place)):
        found = found or place[k] <= 1.0
        high = min(high, place[k])
    return high, found


@helper
def _mark_past(high, found, workspace):
    """Mark what changes up to a part of the step; whether anything has just begun to move."""
    again = False
    for k in range(len(workspace.past)):
        workspace.past[k] = found and workspace.place[k] <= high
        again = again or (workspace.past[k] and workspace.fresh[k] and high < EARLY)
    return again


@helper
def _accept(step, p, progress, output, w, workspace):
    """Go on to the end of a step without events."""
    Y, status, closed, t = progress.state, progress.status, progress.closed, step.target
    for i in range(len(Y)):
        Y[i] = workspace.new[i]
        workspace.slopes[0, i] = workspace.slopes[STAGES, i]
    if step.at_break:
        pass_break(step, p, progress, output)
    for c in range(len(status)):
        workspace.fresh[c] = False
    for j in range(len(closed)):
        workspace.fresh[len(status) + j] = workspace.flights.young[j]
    any_held = False
    for c in range(len(p.rows)):
        workspace.held[c] = status[c] == STICK
        any_held = any_held or workspace.held[c]
    if p.rigid != 0:
        settle(t, p, status, closed, w, workspace.rate, Y)
    elif any_held:
        set_slips(t, Y, p, w)
        hold_velocity(p, workspace.held, w, Y)
    if step.at_break:
        derivative(t, Y, p, status, closed, w, workspace.slopes[0])


@helper
def _holds_on(p, progress, w, workspace):
    """True if the repeated step ends just before its event.

    Then all that was to let go still holds, and what was to touch down is still open.
    """
    clusters, holds = len(p.rows), True
    for k in range(len(workspace.past)):
        if workspace.past[k]:
            holds = holds and (
                progress.closed[k - clusters] == 1 and w.nodes[k - clusters, FORCE] > 0.0
                if k >= clusters else not w.pressing[k] > 0.0 if progress.status[k] == OPEN
                else progress.status[k] == STICK and w.pressing[k] > 0.0
                and abs(w.total[k]) < (1.0 - 1e-12) * w.limit[k])
    return holds


@helper
def _mark_clusters(again, p, progress, w, workspace):
    """Tell the marked clusters that begin to slip from those that come to rest.

    None is released if the moment is the begin of the step, looked at ``again``.
    """
    status = progress.status
    for c in range(len(p.rows)):
        past = workspace.past[c]
        workspace.released[c] = past and status[c] == STICK and w.pressing[c] > 0.0 and not again
        workspace.arrived[c] = past and (status[c] == 1 or status[c] == -1)
        if workspace.released[c]:
            status[c] = 1 if w.total[c] > 0.0 else -1


@helper
def _change_stops(t, again, p, limits, progress, w, workspace):
    """Impacts, partings and changes of friction at rigid stops.

    Returns the longest flight of a rebound [s], or why there is none.
    """
    clusters, closed, largest = len(p.rows), progress.closed, progress.largest
    slow = _slow(0.01 * limits.rtol, largest)
    _mark_clusters(again, p, progress, w, workspace)
    for j in range(len(p.cluster)):
        event = workspace.past[clusters + j]
        # A flight that has begun without speed and ends at once is none: the stop stays closed.
        if (again and event and closed[j] == 0 and workspace.fresh[clusters + j]
                and abs(w.nodes[j, RATE]) <= slow):
            closed[j] = HELD
        workspace.touched[j] = event and closed[j] == 0
        workspace.parting[j] = event and closed[j] == 1
    return change_contacts_at(p.change)(
        t, p, progress, workspace, w, _rebound(slow, p, limits, progress), workspace.slopes[0])


@helper
def _change_clusters(t, again, p, progress, w, workspace):
    """Release the marked clusters that stick, bring those that slip to rest, press open ones."""
    for j in range(len(p.cluster)):
        c = p.cluster[j]
        workspace.touched[j] = workspace.past[c] and progress.status[c] == OPEN
    _mark_clusters(again, p, progress, w, workspace)
    decide_clusters(t, p, progress, workspace, 1e-9 * progress.largest[SLIP_SIZE], w,
                    workspace.slopes[0])


@routine
def _begin(t, data):
    """Decide which clusters stick and which stops are closed at the start of a run."""
    p, progress, w, workspace, watch = (data.problem, data.progress, data.evaluation,
                                        data.workspace, data.watch)
    workspace.fresh[:] = False
    outcome = _start(t, p, data.limits, progress, w, workspace)
    if outcome == RUNNING:
        derivative(t, progress.state, p, progress.status, progress.closed, w, workspace.slopes[0])
        if watch.note != 0:
            note_at(watch.note)(next_target(t, 0.0, CUT, 0.0, data), 0.0, BEGIN, data)
            derivative(t, progress.state, p, progress.status, progress.closed, w,
                       workspace.slopes[0])
    _show(t, progress, data.output, w)
    return outcome


@helper
def _full(data):
    """Whether a step may have more events than there is room for."""
    return data.watch.note != 0 and full(data.watch)


@helper
def _take_to_event(step, data):
    """Take a step that ends where a contact changes, if it has any length."""
    p, progress, w, workspace = data.problem, data.progress, data.evaluation, data.workspace
    if step.h > 0.0:
        take(step, p, progress, w, workspace)
        row = progress.counts[OUTPUTS]
        looked_into = data.output.times[row] <= step.target or len(data.kept.times) > 0
        if p.rigid != 0 or data.watch.note != 0 or looked_into:
            prepare_dense(step, p, progress, w, workspace)


@routine
def _attempt(step, last, smallest, data):
    """Try a step; its outcome, and the length of the next one.

    Where a contact changes within it, it is cut there.
    """
    p, limits, progress, w, workspace = (data.problem, data.limits, data.progress, data.evaluation,
                                         data.workspace)
    numbers, counts, largest = progress.numbers, progress.counts, progress.largest
    length = step.h
    if counts[AT_EVENT] != 0:
        _take_to_event(step, data)
        return TAKEN, length
    holds = holding(progress)
    if holds and counts[KNOWN] == 0:
        set_rates(step.t, progress.state, p, progress, w, workspace.rate)
        set_left(p, progress, w, workspace.ends[0])
        counts[KNOWN] = 1
    take(step, p, progress, w, workspace)
    size_of_error = error(length, progress.state, limits, workspace)
    if not size_of_error <= 1.0:
        numbers[REPEATED] = 1.0
        h = shortened(length, size_of_error)
        if math.isfinite(size_of_error):
            return FAILED, h
        workspace.slopes[1:, :] = 0.0
        return NOT_A_NUMBER, h if length >= 1e-6 * limits.longest else 0.0
    quick, fast, deep = _sizes(progress, w)
    if holds:
        set_left(p, progress, w, workspace.ends[1])
    prepare_dense(step, p, progress, w, workspace)
    shorter = first_changes(step, p, limits, progress, w, workspace)
    high, found = _first_place(workspace.place)
    if shorter < high and shorter * length > smallest:
        return CUT, shorter * length
    again = _mark_past(high, found, workspace)
    if again and length > smallest:
        # A contact that has just begun to move is too close to where it started: a shorter step.
        return CUT, 0.2 * length
    if found:
        counts[AT_EVENT], numbers[UNCUT] = 2 if again else 1, length
        return CUT, 0.0 if again else high * length
    largest[SLIP_SIZE], largest[RATE_SIZE], largest[DEPTH_SIZE] = quick, fast, deep
    return TAKEN, _lengthened(length, size_of_error, numbers)


@routine
def _find_end(step, data):
    """Note the events of a step; the part of it after which the run ends."""
    watch = data.watch
    if watch.note == 0 or not step.h > 0.0:
        return BEYOND
    return note_at(watch.note)(step, 1.0, WITHIN, data)


@routine
def _close(step, writes, data):
    """Take young flights to the end of a step."""
    if data.problem.rigid != 0 and step.h > 0.0:
        advance(1.0, step, data.problem, data.progress, data.evaluation, data.workspace)


@routine
def _stop_at(part, step, data):
    """End the run at a part of the step."""
    interpolate(part, data.progress.state, data.workspace.parts, data.workspace.state)
    put(data.workspace.state, data.progress.state)


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run, and change contacts if it ends there."""
    progress, workspace = data.progress, data.workspace
    if progress.counts[AT_EVENT] != 0:
        return _change(step, h, data)
    _accept(step, data.problem, progress, data.output, data.evaluation, workspace)
    put(workspace.ends[1], workspace.ends[0])
    progress.counts[IDLE] = 0
    if step.at_break:
        progress.counts[KNOWN] = 0
    return pace(step, progress, data.output.times), h


@routine
def _change(step, h, data):
    """Change contacts at the end of a step; how the run stands, and the length of the next."""
    p, limits, progress, w, workspace, watch = (data.problem, data.limits, data.progress,
                                                data.evaluation, data.workspace, data.watch)
    Y, status, closed, counts = progress.state, progress.status, progress.closed, progress.counts
    times, t = data.output.times, step.target
    tiny = 1e-14 * max(abs(times[0]), abs(times[-1]))
    again = counts[AT_EVENT] == 2
    counts[AT_EVENT], counts[KNOWN] = 0, 0
    counts[IDLE] = counts[IDLE] + 1 if step.h <= tiny else 0
    if counts[IDLE] > _MOST_IDLE:
        return MINIMUM_STEP, h
    if step.h > 0.0:
        for i in range(len(Y)):
            Y[i] = workspace.new[i]
    if step.at_break:
        pass_break(step, p, progress, data.output)
    derivative(t, Y, p, status, closed, w, workspace.rate)
    h = min(max(0.1 * progress.numbers[UNCUT], 1e3 * tiny), limits.longest)
    if not again and counts[IDLE] < _MOST_HELD and _holds_on(p, progress, w, workspace):
        for i in range(len(Y)):
            workspace.slopes[0, i] = workspace.rate[i]
    else:
        counts[EVENTS] += 1
        if p.rigid != 0:
            flight = _change_stops(t, again, p, limits, progress, w, workspace)
            if _outcome(flight) != RUNNING:
                return _outcome(flight), h
            h = min(h, max(0.5 * flight, tiny))
        else:
            _change_clusters(t, again, p, progress, w, workspace)
    # Wherever the motion goes on from, an output at this moment shows what comes after.
    _show(t, progress, data.output, w)
    if watch.note != 0 and note_at(watch.note)(
            next_target(t, 0.0, CUT, 0.0, data), 0.0, CHANGED, data) <= 1.0:
        return STOPPED, h
    return pace(step, progress, times), h


METHOD = Method("events", Data, next_target, _attempt, _fill, _go_on, _begin, close=_close,
                full=_full, find_end=_find_end, stop_at=_stop_at, places=6)
run_events = step_loop(METHOD)
# For nodes of which each has a slip velocity of its own.
SMALL = Sized(
    partial(step_loop, METHOD), (NonsmoothProblem, Limits, Progress, Output, Evaluation, Workspace),
    FEW, lambda modes, nodes: {NonsmoothProblem: {"cluster": np.arange(nodes)}},
    lambda nodes: {CLUSTERS: nodes, NODE_ENTRIES: NODE_COLUMNS})


def run_for(problem: NonsmoothProblem) -> Any:
    """The loop for a system of this size, or for all."""
    nodes, _, modes = problem.system.rows.shape
    if (modes, nodes) in FEW and len(problem.rows) == nodes and problem.system.second_motion == 0:
        return SMALL.of(modes, nodes)
    return run_events
