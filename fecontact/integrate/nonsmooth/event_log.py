"""Noting events of runs that go from event to event: contact nodes, and users' functions.

Clusters and stops change at moments at which a step ends anyway. Normal laws that come and go
while a cluster slips, and functions of users, are examined some times a step, and what has
changed is narrowed down by bisection; what `Crossing` watches is a polynomial within the step,
whose changes of sign are found however close.

A step may end where such a function is zero up to rounding, as a velocity is where the slip ends.
The sign is then the one before, until the function leaves zero.
"""

# Compiled functions: their types are those of their signatures for numba.

from collections.abc import Callable

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper, routine
from fecontact.integrate.bernstein import from_nested, sign_changes
from fecontact.integrate.nonsmooth.dop853 import PARTS, interpolate
from fecontact.integrate.nonsmooth.equations import derivative, set_slips
from fecontact.integrate.nonsmooth.event_search import ROUNDING, Data
from fecontact.integrate.nonsmooth.problem import AT_EVENT, FORCE, STICK, Step
from fecontact.integrate.nonsmooth.transitions import hold_velocity
from fecontact.integrate.rodas5p.event_kernels import (
    FIRST_OWN,
    FOUND,
    LIFT_OFF,
    NODES,
    OPEN,
    SLIPPING,
    STICKING,
    TOUCH_DOWN,
    event_at,
    first_stop,
    note,
    note_zone,
)
from fecontact.integrate.step_polynomials import MOST

# Kinds of notes: the state at the start, a step or a part of it, a change of contact.
BEGIN, WITHIN, CHANGED = range(3)
NOTE = Callable[[Step, float, int, Data], float]
note_at = function_at(NOTE)

_LOOKS, _HALVINGS = 16, 44
# Values of users' functions without a sign: relative to the value before, and of those that are
# linear in roundings of their terms, as many as the end of a step is away from its event.
_NO_SIGN, _ROUNDINGS = 1e-12, 64.0


@helper
def _zone(j, data):
    """State of a node at its last evaluation."""
    p, progress = data.problem, data.progress
    status = progress.status[p.cluster[j]]
    # At the very moment of a touch the force may be zero or not; the status of the cluster tells.
    pressed = status != OPEN and data.evaluation.nodes[j, FORCE] != 0.0
    if p.rigid != 0:
        pressed = progress.closed[j] != 0
    if not pressed:
        return OPEN
    return STICKING if status == STICK else SLIPPING


@helper
def _counts(rising, k, watch):
    """Whether a change of sign has the direction that is watched."""
    return watch.own_direction[k] >= 0 if rising else watch.own_direction[k] <= 0


@helper
def _no_sign(k, data):
    """Size up to which a value of a user's function has no sign."""
    watch, Y = data.watch, data.progress.state
    if watch.linear[k] == 0:
        return _NO_SIGN * abs(watch.own_values[k])
    row, size = watch.own_parameters[k], abs(watch.own_parameters[k, 0])
    for i in range(watch.states.shape[1]):
        size += abs(row[1 + i]) * max(abs(Y[i]), data.limits.floor[i])
    return _ROUNDINGS * ROUNDING * size


@routine
def _look(part, step, data):
    """Put the state within a step into the workspace, and what acts there; the time."""
    progress, workspace = data.progress, data.workspace
    t = min(step.t + part * step.h, step.latest)
    interpolate(part, progress.state, workspace.parts, workspace.state)
    derivative(t, workspace.state, data.problem, progress.status, progress.closed, data.evaluation,
               workspace.rate)
    return t


@routine
def _look_at_end(step, data):
    """Put the state at the end of a step into the workspace, without the slip that ends there."""
    p, progress, workspace = data.problem, data.progress, data.workspace
    t = _look(1.0, step, data)
    if progress.counts[AT_EVENT] != 0:
        for c in range(len(p.rows)):
            workspace.held[c] = workspace.past[c] and abs(progress.status[c]) == 1
        set_slips(t, workspace.state, p, data.evaluation)
        hold_velocity(p, workspace.held, data.evaluation, workspace.state)
    return t


@routine
def _note_linear(k, upto, step, data):
    """Note the passages of a linear function of the state."""
    watch, progress, workspace = data.watch, data.progress, data.workspace
    row, c, b = watch.own_parameters[k], workspace.nested, workspace.bound
    size = watch.states.shape[1]
    c[:] = 0.0
    c[0] = -row[0]
    for i in range(size):
        c[0] += row[1 + i] * progress.state[i]
        for q in range(PARTS):
            c[1 + q] += row[1 + i] * workspace.parts[q, i]
    from_nested(c, b)
    t = _look_at_end(step, data)
    b[PARTS] = event_at(watch.own[k])(t, workspace.state[:size], row)
    sign, last, small = watch.own_values[k], watch.own_values[k], _no_sign(k, data)
    for i in range(len(b)):
        if abs(b[i]) <= small:
            b[i] = 0.0
        else:
            sign = b[i] if sign == 0.0 else sign
            last = b[i]
    places = watch.changed[:MOST]
    for i in range(sign_changes(b, places, workspace.halves, sign)):
        sign = -sign
        if places[i] <= upto and _counts(sign > 0.0, k, watch):
            t = _look(places[i], step, data)
            note(watch, t, FIRST_OWN + k, -1, workspace.state)
    watch.own_values[k] = last


@routine
def _note_own(k, left, right, new, step, data):
    """Note the change of sign of a user's function between two looks."""
    watch, workspace = data.watch, data.workspace
    g, row, size = event_at(watch.own[k]), watch.own_parameters[k], watch.states.shape[1]
    old = watch.own_values[k]
    rising = old < 0.0 <= new
    if not (rising or old > 0.0 >= new) or not _counts(rising, k, watch):
        return
    low, high = left, right
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        t = _look(middle, step, data)
        value = g(t, workspace.state[:size], row)
        if (value >= 0.0) if rising else (value <= 0.0):
            high = middle
        else:
            low = middle
    t = _look(high, step, data)
    note(watch, t, FIRST_OWN + k, -1, workspace.state)


@routine
def _note_touch(j, left, right, step, data):
    """Note that the normal law of a node begins or ends between two looks."""
    low, high, old = left, right, data.watch.zones[j]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        _look(middle, step, data)
        if _zone(j, data) == old:
            low = middle
        else:
            high = middle
    t = _look(high, step, data)
    note_zone(j, _zone(j, data), t, data.workspace.state, data.watch)


@routine
def _note_step(upto, step, data):
    """Note the events of a step up to a part of it."""
    watch = data.watch
    size, state = watch.states.shape[1], data.workspace.state
    nodes = watch.counts[NODES] != 0 and data.problem.rigid == 0
    looks = nodes
    for k in range(len(watch.own)):
        if watch.linear[k]:
            _note_linear(k, upto, step, data)
        else:
            looks = True
    for look in range(_LOOKS if looks else 1):
        left, right = (upto * look / _LOOKS, upto * (look + 1) / _LOOKS) if looks else (0.0, upto)
        _look(right, step, data)
        for j in range(len(watch.zones)):
            if nodes and _zone(j, data) != watch.zones[j]:
                _note_touch(j, left, right, step, data)
                _look(right, step, data)
        for k in range(len(watch.own)):
            if watch.linear[k]:
                continue
            t = _look_at_end(step, data) if right == 1.0 else _look(right, step, data)
            new = event_at(watch.own[k])(t, state[:size], watch.own_parameters[k])
            if not abs(new) <= _no_sign(k, data):
                _note_own(k, left, right, new, step, data)
                watch.own_values[k] = new


@routine
def _note_change(begin, t, data):
    """Note what has changed at the begin of a step; at that of a run, what is struck."""
    watch, workspace = data.watch, data.workspace
    Y, size = data.progress.state, watch.states.shape[1]
    for j in range(len(watch.zones)):
        zone = _zone(j, data)
        if begin:
            # A stop that is struck at the start was open before.
            watch.zones[j] = OPEN if workspace.touched[j] else zone
        if watch.counts[NODES] != 0:
            if workspace.touched[j] and watch.zones[j] == OPEN and zone == OPEN:
                note(watch, t, TOUCH_DOWN, j, Y)
                note(watch, t, LIFT_OFF, j, Y)
            workspace.touched[j] = False
            note_zone(j, zone, t, Y, watch)
    for k in range(len(watch.own)):
        old = watch.own_values[k]
        new = event_at(watch.own[k])(t, Y[:size], watch.own_parameters[k])
        if abs(new) <= _no_sign(k, data):
            continue
        rising = old < 0.0 < new
        if not begin and (rising or old > 0.0 > new) and _counts(rising, k, watch):
            note(watch, t, FIRST_OWN + k, -1, Y)
        watch.own_values[k] = new


def _note_events(step, upto, what, data):
    """Note events; the part of the step after which the run ends, or inf.

    Events after the first at which the run ends are dropped.
    """
    begun = data.watch.counts[FOUND]
    if what == WITHIN:
        _note_step(upto, step, data)
    else:
        _note_change(what == BEGIN, step.t, data)
    stop = first_stop(begun, data.watch)
    return max((stop - step.t) / step.h, 0.0) if what == WITHIN else max(stop - step.t, 0.0)


# By its address, so that it is not compiled into the loop over the steps.
note_events = compile_law(NOTE, "note_events(step, upto, what, data)", _note_events)
