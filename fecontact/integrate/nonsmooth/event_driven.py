"""Compiled run from event to event, of order 8, for contact with few independent slip velocities.

Between events the sticking clusters and the closed stops are constraints. A step in which a
cluster or a stop goes past its margin is cut at the moment where that begins, found in the
step's interpolation to the last digits, and repeated with the shorter length.
"""

import math

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.integrate.nonsmooth.dop853 import STAGES, error, interpolate, prepare_dense, take
from fecontact.integrate.nonsmooth.equations import derivative, place_size
from fecontact.integrate.nonsmooth.event_log import BEGIN, CHANGED, WITHIN, full, note_at
from fecontact.integrate.nonsmooth.event_search import ROUNDING, Room, first_changes, least_depth
from fecontact.integrate.nonsmooth.problem import (
    DEPTH_SIZE,
    DIVERGED,
    EVENTS,
    FINISHED,
    FORCE,
    GOING_ON,
    HELD,
    LAST_ERROR,
    LENGTH,
    OPEN,
    OUTPUTS,
    PARADOX,
    PENETRATION,
    RATE,
    RATE_SIZE,
    REJECTED,
    REPEATED,
    SLIP_SIZE,
    STARTED,
    STEPS,
    STICK,
    STOPPED,
    STUCK,
    TIME,
    UNSOLVED,
    Limits,
    NonsmoothProblem,
    Output,
    Progress,
    Step,
    Workspace,
    aimed,
)
from fecontact.integrate.nonsmooth.rigid_stops import (
    NO_ACCELERATION,
    NO_IMPULSES,
    RATE_ROUNDING,
    change_contacts_at,
    settle,
)
from fecontact.integrate.nonsmooth.steps.flights import YOUNG, advance
from fecontact.integrate.nonsmooth.steps.rates import set_rates, set_slips, share
from fecontact.integrate.nonsmooth.steps.releases import holding, set_left
from fecontact.integrate.nonsmooth.transitions import decide_clusters, hold_velocity
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.system.powers import DRIVE, drive_jump

# What has just begun to move and turns back in this part of a step is looked at more closely.
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
        UNSOLVED if flight == NO_IMPULSES else GOING_ON)


@helper
def _place_size(j, p, limits, progress):
    """Size of the places of node j [m], of whose rounding its penetration has 1e-16."""
    return place_size(j, progress.state, p) + least_depth(j, p, limits)


@helper
def _height(p, limits, progress):
    """Largest distance of a stop from its ground so far, or size of its places now [m]."""
    height = progress.largest[DEPTH_SIZE]
    for j in range(len(p.cluster)):
        height = max(height, _place_size(j, p, limits, progress))
    return height


@helper
def _slow(part, largest):
    """Penetration rate of stops at rest: a part of the largest one, or rounding [m/s]."""
    fast = largest[RATE_SIZE]
    return max(part * fast, RATE_ROUNDING * max(largest[SLIP_SIZE], fast))


@helper
def _start(t, p, limits, progress, w, room):
    """Decide at the start of a run which clusters stick and which stops are closed."""
    largest = progress.largest
    derivative(t, progress.state, p, progress.status, progress.closed, w, room.rate)
    for c in range(len(p.rows)):
        room.released[c] = room.arrived[c] = False
        largest[SLIP_SIZE] = max(largest[SLIP_SIZE], abs(w.slip[c]))
    if p.rigid != 0:
        for j in range(len(p.cluster)):
            depth = w.nodes[j, PENETRATION]
            room.touched[j] = depth >= -ROUNDING * _place_size(j, p, limits, progress)
            room.parting[j] = False
            largest[RATE_SIZE] = max(largest[RATE_SIZE], abs(w.nodes[j, RATE]))
            largest[DEPTH_SIZE] = max(largest[DEPTH_SIZE], abs(depth))
        flight = change_contacts_at(p.change)(
            t, p, progress, room, w, _slow(_SLOW, largest), _height(p, limits, progress),
            1e-9 * limits.longest, room.rate)
        progress.counts[EVENTS] += 1 if room.touched.any() else 0
        return _outcome(flight)
    decide_clusters(t, p, progress, room, 1e-12 * largest[SLIP_SIZE], w, room.rate)
    return GOING_ON


@helper
def _write_at(t, progress, output, w):
    """Write the outputs up to the moment t, at which w tells what acts."""
    counts = progress.counts
    while counts[OUTPUTS] < len(output.times) and output.times[counts[OUTPUTS]] <= t:
        row = counts[OUTPUTS]
        output.states[row], output.friction[row] = progress.state, w.friction
        output.normal[row] = w.nodes[:, FORCE]
        counts[OUTPUTS] += 1


@helper
def _write_within(step, reached, with_end, p, progress, output, w, room):
    """Write the outputs of a step up to the time ``reached``, at that too if ``with_end``."""
    counts, times = progress.counts, output.times
    while counts[OUTPUTS] < len(times) and (
            times[counts[OUTPUTS]] < reached
            or (with_end and times[counts[OUTPUTS]] == reached)):
        row = counts[OUTPUTS]
        state = output.states[row]
        interpolate((times[row] - step.t) / step.h, progress.state, room.parts, state)
        set_rates(times[row], state, p, progress, w, room, room.rate)
        share(p, progress.status, w)
        for j in range(len(w.friction)):
            output.friction[row, j], output.normal[row, j] = w.friction[j], w.nodes[j, FORCE]
        counts[OUTPUTS] += 1


@helper
def _sizes(progress, w):
    """Largest slip velocity, penetration rate and penetration so far, those of w included."""
    largest = progress.largest
    quick, fast, deep = largest[SLIP_SIZE], largest[RATE_SIZE], largest[DEPTH_SIZE]
    for c in range(len(w.slip)):
        quick = max(quick, abs(w.slip[c]))
    for j in range(len(w.nodes)):
        fast, deep = max(fast, abs(w.nodes[j, RATE])), max(deep, abs(w.nodes[j, PENETRATION]))
    return quick, fast, deep


@helper
def _shortened(length, size_of_error):
    """Length of the next attempt at a step with too large an error."""
    if math.isfinite(size_of_error):
        return length * max(0.2, 0.9 * size_of_error**-0.125)
    return length * 0.1


@helper
def _lengthened(length, size_of_error, clock):
    """Length of the step after an accepted one.

    By its error and a little of the one before (PI control), so that steps at the limit of
    stability do not fail by turns; after a step that failed not longer.
    """
    size = max(size_of_error, _SMALLEST_ERROR)
    last = clock[LAST_ERROR] if clock[LAST_ERROR] > 0.0 else size
    factor = min(5.0, max(0.5, 0.9 * size ** (0.75 * _DAMPED - 0.125) * last**_DAMPED))
    if clock[REPEATED] != 0.0:
        factor = min(factor, 1.0)
    clock[LAST_ERROR], clock[REPEATED] = size, 0.0
    return length if 1.0 < factor < 1.1 else length * factor


@helper
def _first_place(place):
    """Where the first change is, 1 for none, and whether there is one."""
    high, found = 1.0, False
    for k in range(len(place)):
        found = found or place[k] <= 1.0
        high = min(high, place[k])
    return high, found


@helper
def _mark_past(high, found, room):
    """Mark what changes up to a part of the step; whether anything has just begun to move."""
    again = False
    for k in range(len(room.past)):
        room.past[k] = found and room.place[k] <= high
        again = again or (room.past[k] and room.fresh[k] and high < EARLY)
    return again


@helper
def _accept(step, t, passing, p, progress, output, w, room):
    """Go on to the end t of a step without events; ``passing`` a break of what is given."""
    Y, status, closed, counts = progress.state, progress.status, progress.closed, progress.counts
    m = p.rows.shape[1]
    for i in range(len(Y)):
        Y[i] = room.new[i]
        room.slopes[0, i] = room.slopes[STAGES, i]
    if passing:
        work = drive_jump(step.latest, t, Y, p.system)
        Y[2 * m + DRIVE] += work
        last = counts[OUTPUTS] - 1
        if last >= 0 and output.times[last] == t:
            output.states[last, 2 * m + DRIVE] += work
    for c in range(len(status)):
        room.fresh[c] = False
    for j in range(len(closed)):
        room.fresh[len(status) + j] = room.flights[j, YOUNG] != 0.0
    any_held = False
    for c in range(len(p.rows)):
        room.held[c] = status[c] == STICK
        any_held = any_held or room.held[c]
    if p.rigid != 0:
        settle(t, p, status, closed, w, room.rate, Y)
    elif any_held:
        set_slips(t, Y, p, w)
        hold_velocity(p, room.held, w, Y)
    if passing:
        derivative(t, Y, p, status, closed, w, room.slopes[0])


@helper
def _holds_on(p, progress, w, room):
    """True if the repeated step ends just before its event.

    Then all that was to let go still holds, and what was to touch down is still open.
    """
    clusters, holds = len(p.rows), True
    for k in range(len(room.past)):
        if room.past[k]:
            holds = holds and (
                progress.closed[k - clusters] == 1 and w.nodes[k - clusters, FORCE] > 0.0
                if k >= clusters else not w.pressing[k] > 0.0 if progress.status[k] == OPEN
                else progress.status[k] == STICK and w.pressing[k] > 0.0
                and abs(w.total[k]) < (1.0 - 1e-12) * w.limit[k])
    return holds


@helper
def _mark_clusters(again, p, progress, w, room):
    """Tell the marked clusters that begin to slip from those that come to rest.

    None is released if the moment is the begin of the step, looked at ``again``.
    """
    status = progress.status
    for c in range(len(p.rows)):
        past = room.past[c]
        room.released[c] = past and status[c] == STICK and w.pressing[c] > 0.0 and not again
        room.arrived[c] = past and (status[c] == 1 or status[c] == -1)
        if room.released[c]:
            status[c] = 1 if w.total[c] > 0.0 else -1


@helper
def _change_stops(t, again, p, limits, progress, w, room):
    """Impacts, partings and changes of friction at rigid stops.

    Returns the longest flight of a rebound [s], or why there is none.
    """
    clusters, closed, largest = len(p.rows), progress.closed, progress.largest
    slow = _slow(0.01 * limits.rtol, largest)
    _mark_clusters(again, p, progress, w, room)
    for j in range(len(p.cluster)):
        event = room.past[clusters + j]
        # A flight that has begun without speed and ends at once is none: the stop stays closed.
        if (again and event and closed[j] == 0 and room.fresh[clusters + j]
                and abs(w.nodes[j, RATE]) <= slow):
            closed[j] = HELD
        room.touched[j] = event and closed[j] == 0
        room.parting[j] = event and closed[j] == 1
    return change_contacts_at(p.change)(
        t, p, progress, room, w, slow, _height(p, limits, progress), 1e-9 * limits.longest,
        room.slopes[0])


@helper
def _change_clusters(t, again, p, progress, w, room):
    """Release the marked clusters that stick, bring those that slip to rest, press open ones."""
    for j in range(len(p.cluster)):
        c = p.cluster[j]
        room.touched[j] = room.past[c] and progress.status[c] == OPEN
    _mark_clusters(again, p, progress, w, room)
    decide_clusters(t, p, progress, room, 1e-9 * progress.largest[SLIP_SIZE], w, room.slopes[0])


@helper
def _stop_within(step, part, p, progress, output, w, room):
    """End the run at a part of a step."""
    reached = step.t + part * step.h
    _write_within(step, reached, True, p, progress, output, w, room)
    interpolate(part, progress.state, room.parts, room.state)
    progress.state[:] = room.state
    progress.clock[TIME] = reached


@kernel(nogil=True)
def run_events(
    p: NonsmoothProblem, limits: Limits, progress: Progress, output: Output,
    w: Workspace, room: Room, watch: Watch, most: int,
) -> int:
    """Go on for at most ``most`` steps, up to the last of the output times; how it ended.

    The rows of ``output`` are filled as ``progress.counts`` says. Ends early where the table of
    events is full.
    """
    Y, status, closed, counts = progress.state, progress.status, progress.closed, progress.counts
    clock, largest, longest = progress.clock, progress.largest, limits.longest
    t, h, end = clock[TIME], clock[LENGTH], output.times[-1]
    tiny = 1e-14 * max(abs(output.times[0]), abs(end), longest)
    stop, idle, ends_known = 0, 0, False
    while stop < len(limits.stops) and limits.stops[stop] <= t:
        stop += 1
    room.fresh[:] = False
    if counts[STARTED] == 0:
        counts[STARTED] = 1
        outcome = _start(t, p, limits, progress, w, room)
        if outcome != GOING_ON:
            # The state at the start is the only output.
            _write_at(t, progress, output, w)
            return outcome
        if watch.note != 0:
            derivative(t, Y, p, status, closed, w, room.slopes[0])
            note_at(watch.note)(Step(t, 0.0, t), 0.0, BEGIN, p, progress, w, room, watch)
    derivative(t, Y, p, status, closed, w, room.slopes[0])
    _write_at(t, progress, output, w)
    for _ in range(most):
        if t >= end or (watch.note != 0 and full(watch)):
            break
        goal, length, reaching = aimed(t, h, end, stop, limits)
        # At the end of a step that ends at a break, signals are as before the break.
        step = Step(t, length, np.nextafter(goal, t))
        holds = holding(progress)
        if holds and not ends_known:
            set_rates(t, Y, p, progress, w, room, room.rate)
            set_left(p, progress, w, room.ends[0])
            ends_known = True
        take(step, p, progress, w, room)
        size_of_error = error(length, Y, limits, room)
        counts[STEPS] += 1
        if not size_of_error <= 1.0:
            counts[REJECTED] += 1
            clock[REPEATED] = 1.0
            h = _shortened(length, size_of_error)
            if not math.isfinite(size_of_error):
                room.slopes[1:, :] = 0.0
            if not math.isfinite(size_of_error) and length < 1e-6 * longest:
                clock[TIME], clock[LENGTH] = t, length
                return DIVERGED
            if h < tiny:
                clock[TIME], clock[LENGTH] = t, h
                return STUCK
            continue
        quick, fast, deep = _sizes(progress, w)
        if holds:
            set_left(p, progress, w, room.ends[1])
        prepare_dense(step, p, progress, w, room)
        shorter = first_changes(step, p, limits, progress, w, room)
        high, found = _first_place(room.place)
        if shorter < high and shorter * length > tiny:
            h = shorter * length
            counts[REJECTED] += 1
            continue
        again = _mark_past(high, found, room)
        if again and length > tiny:
            # What has just begun to move cannot be told from its start: look at a shorter step.
            h = 0.2 * length
            counts[REJECTED] += 1
            continue
        if again:
            high = 0.0
        if watch.note != 0:
            part = note_at(watch.note)(step, high, WITHIN, p, progress, w, room, watch)
            if part <= 1.0:
                _stop_within(step, part, p, progress, output, w, room)
                return STOPPED
        if p.rigid != 0:
            advance(high, step, p, progress, room)
        reached = goal if reaching and not found else t + high * length
        _write_within(step, reached, not found, p, progress, output, w, room)
        if not found:
            t, idle = reached, 0
            passing = reaching and stop < len(limits.stops) and goal == limits.stops[stop]
            if passing:
                stop += 1
            largest[SLIP_SIZE], largest[RATE_SIZE], largest[DEPTH_SIZE] = quick, fast, deep
            _accept(step, t, passing, p, progress, output, w, room)
            room.ends[0] = room.ends[1]
            ends_known = ends_known and not passing
            h = _lengthened(length, size_of_error, clock)
            continue

        ends_known = False
        idle = idle + 1 if high * length <= tiny else 0
        if idle > _MOST_IDLE:
            clock[TIME], clock[LENGTH] = t, length
            return STUCK
        if high > 0.0:
            take(Step(t, high * length, step.latest), p, progress, w, room)
            for i in range(len(Y)):
                Y[i] = room.new[i]
            t = reached
        derivative(t, Y, p, status, closed, w, room.rate)
        h = min(max(0.1 * length, 1e3 * tiny), longest)
        if not again and idle < _MOST_HELD and _holds_on(p, progress, w, room):
            for i in range(len(Y)):
                room.slopes[0, i] = room.rate[i]
        else:
            counts[EVENTS] += 1
            if p.rigid != 0:
                flight = _change_stops(t, again, p, limits, progress, w, room)
                if _outcome(flight) != GOING_ON:
                    clock[TIME], clock[LENGTH] = t, length
                    return _outcome(flight)
                h = min(h, max(0.5 * flight, tiny))
            else:
                _change_clusters(t, again, p, progress, w, room)
        # Wherever the motion goes on from, an output at this moment shows what comes after.
        _write_at(t, progress, output, w)
        if watch.note != 0 and note_at(watch.note)(
                Step(t, length, step.latest), 0.0, CHANGED, p, progress, w, room, watch) <= 1.0:
            clock[TIME], clock[LENGTH] = t, h
            return STOPPED
    clock[TIME], clock[LENGTH] = t, h
    return FINISHED if t >= end else GOING_ON
