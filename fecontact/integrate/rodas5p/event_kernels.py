"""Finding events within a step: contact nodes that change their state, and users' functions.

The dense output of a step is examined a few times, and what has changed since the time before is
narrowed down by bisection. Gaps, slip velocities and what `Crossing` watches are polynomials
whose changes of sign are known (:mod:`fecontact.integrate.step_polynomials`); between two they are
looked at too, so that none escapes. Functions of users and the stick of friction with memory are
known at the looks only.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper, routine
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.core.types import Array
from fecontact.integrate import bernstein
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.step_polynomials import (
    COEFFICIENTS,
    GAP,
    MOST,
    SLIP,
    StepPolynomial,
    changes,
)
from fecontact.system import nodes
from fecontact.system.node_forces import friction_entry, node_forces

EVENT = Callable[[float, Vector, Vector], float]
event_at = function_at(EVENT)

# Kinds of events; a user's event k is FIRST_OWN + k.
TOUCH_DOWN, LIFT_OFF, STICK, SLIP_BEGINS, FIRST_OWN = range(5)
# States of a node, as in `ContactState`; past the depth of the normal law 3 more.
OPEN, STICKING, SLIPPING, DEEP = range(4)
# Entries of Watch.counts.
FOUND, NODES, KINKS = range(3)

# Looks at a step, and more where functions of users are watched.
_LOOKS, _MORE_LOOKS = 4, 16
# Places besides for each node and function.
PLACES = 12
_HALVINGS = 44
_MOST_A_NODE = 3


class Watch(NamedTuple):
    """Events that are watched for during a run, and those that were found.

    Attributes
    ----------
    stick_speed : (n,) array
        Slip velocity below which a node sticks, for laws without memory [m/s].
    curve_speed, curve : (k,), (n, k) arrays
        Slip velocities and R/F of steady sliding there, for laws with memory; zeros for others.
    zones : (n,) array
        State of the nodes at the start of the step.
    own, own_parameters, own_values, own_direction : (l,), (l, p), (l,), (l,)
        Users' functions, their values at the start of the step, and the direction of the change
        of sign that counts.
    linear : (l,) array
        Whether the function is ``y @ p[1:] - p[0]``.
    places, known : (n + l, PLACES), (n + l,) arrays
        Parts of the step between changes of sign, and how many there are.
    changed : (64,) array
        Work array of these changes.
    note : int
        Address of :data:`note_events`.
    stops : (4 + l,) array
        Whether the run ends at an event of this kind.
    found, states : (K, 3), (K, size)
        Time, kind and node (-1 for a user's event), and the state.
    counts : (3,) array
        Events found; whether contact nodes are watched; whether steps must end at the kinks of
        the normal forces.
    after : float
        Events up to this time are dropped: those at which the run before has ended.
    """

    stick_speed: Vector
    curve_speed: Vector
    curve: Matrix
    zones: IntegerVector
    own: IntegerVector
    own_parameters: Matrix
    own_values: Vector
    own_direction: IntegerVector
    linear: IntegerVector
    places: Matrix
    known: IntegerVector
    changed: Vector
    note: int
    stops: IntegerVector
    found: Matrix
    states: Matrix
    counts: IntegerVector
    after: float


NOTE = Callable[[
    run_arrays.Step, run_arrays.Problem, run_arrays.Progress, run_arrays.Workspace, Watch,
], float]
note_events_at = function_at(NOTE)


class _View(NamedTuple):
    """A step that is looked into: the nodes' depths, its interpolant, and workspace.

    ``before``, ``after`` (size,) and ``dense`` (3, size) are the interpolant; y (size,) is the
    state that is examined, ``force`` and ``rates`` are work arrays for laws with memory.
    """

    step: Any
    system: Any
    depth: Array
    before: Array
    after: Array
    dense: Array
    y: Array
    force: Array
    rates: Array


@helper
def _view(step, problem, progress, workspace):
    return _View(step, problem.system, problem.control.depth, progress.state, workspace.after,
                 workspace.dense, workspace.right, workspace.scratch.force[0],
                 workspace.scratch.rates[0])


@helper
def _time(part, step):
    """Time at a part of a step."""
    return min(step.t + part * step.h, step.latest)


@helper
def _between(x, places, values):
    """Linear interpolation, constant outside."""
    right = 0
    while right < len(places) and places[right] < x:
        right += 1
    if right == 0 or right == len(places):
        return values[min(right, len(places) - 1)]
    part = (x - places[right - 1]) / (places[right] - places[right - 1])
    return (1.0 - part) * values[right - 1] + part * values[right]


@helper
def _zone_of(j, t, y, s, depth, force, rates, watch):
    """State of node j, and whether it is past the depth of its normal law."""
    node = node_forces(j, nodes.node_motion(j, y, s), nodes.ground_motion(t, s),
                       nodes.memory_of(j, y, s), s, force, rates)
    R, slip, zone = 0.0, node.contact.slip[0], OPEN
    for tangent in range(s.rows.shape[1] - 1):
        R = math.hypot(R, force[friction_entry(tangent, len(rates))])
        if tangent:
            slip = math.hypot(slip, node.contact.slip[tangent])
    if node.normal != 0.0:
        if s.memory[j] > 0 and len(watch.curve_speed) > 0 and watch.curve[j, 0] != 0.0:
            sticks = abs(R) < 0.95 * abs(_between(slip, watch.curve_speed, watch.curve[j])
                                         * node.normal)
        else:
            sticks = abs(slip) < watch.stick_speed[j]
        zone = STICKING if sticks else SLIPPING
    return zone + DEEP if node.contact.penetration > depth[j] else zone


@helper
def _zone(j, part, y, view, watch):
    """Zone of node j by :func:`_zone_of`, for a state y at a part of the step."""
    return _zone_of(j, _time(part, view.step), y, view.system, view.depth, view.force, view.rates,
                    watch)


@helper
def note(watch, t, kind, node, y):
    """Note an event of a state, whose first entries are y."""
    row = watch.counts[FOUND]
    watch.found[row, 0], watch.found[row, 1], watch.found[row, 2] = t, kind, node
    for k in range(watch.states.shape[1]):
        watch.states[row, k] = y[k]
    watch.counts[FOUND] = row + 1


@routine
def note_zone(j, zone, t, y, watch):
    """Note what node j does that is in a zone from now on."""
    old, new = watch.zones[j] % DEEP, zone % DEEP
    watch.zones[j] = zone
    if old == new:
        return
    if old == OPEN:
        note(watch, t, TOUCH_DOWN, j, y)
    if new == OPEN:
        note(watch, t, LIFT_OFF, j, y)
    elif new == STICKING:
        note(watch, t, STICK, j, y)
    elif old == STICKING:
        note(watch, t, SLIP_BEGINS, j, y)


@helper
def full(watch):
    """Whether the events of one more step may find no place."""
    most = (_MORE_LOOKS + PLACES) * (_MOST_A_NODE * len(watch.zones) + len(watch.own))
    return watch.counts[FOUND] + most > len(watch.found)


@helper
def _normal_zone(zone):
    """Part of a zone that depends on the normal force alone: 1 if closed, plus 2 if deep."""
    return (0 if zone % DEEP == OPEN else 1) + (2 if zone >= DEEP else 0)


@helper
def _look(part, view):
    """Put the state at a part of the step into view.y."""
    if part == 1.0:
        for k in range(len(view.y)):
            view.y[k] = view.after[k]
    else:
        tableau.interpolated(part, view.before, view.after, view.dense, view.y)


@helper
def _changed(j, low, high, view, watch):
    """Part of the step, between two, at which node j changes its zone; the new one; sets y."""
    old = watch.zones[j] % DEEP
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        tableau.interpolated(middle, view.before, view.after, view.dense, view.y)
        if _zone(j, middle, view.y, view, watch) % DEEP == old:
            low = middle
        else:
            high = middle
    _look(high, view)
    return high, _zone(j, high, view.y, view, watch)


@helper
def _own(k, left, right, view, watch):
    """Value of a user's function at the right end, after its change of sign has been noted."""
    g, p = event_at(watch.own[k]), watch.own_parameters[k]
    old = watch.own_values[k]
    new = g(_time(right, view.step), view.y, p)
    rising = old < 0.0 <= new
    falling = old > 0.0 >= new
    if not ((rising and watch.own_direction[k] >= 0) or (
            falling and watch.own_direction[k] <= 0)):
        return new
    low, high = left, right
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        tableau.interpolated(middle, view.before, view.after, view.dense, view.y)
        value = g(_time(middle, view.step), view.y, p)
        if (value >= 0.0) if rising else (value <= 0.0):
            high = middle
        else:
            low = middle
    _look(high, view)
    note(watch, _time(high, view.step), FIRST_OWN + k, -1, view.y)
    return new


@helper
def first_stop(begun, watch):
    """Drop the events that do not count, as those after the first at which the run stops.

    The time of that, inf if the run does not stop.
    """
    stop = np.inf
    for row in range(begun, watch.counts[FOUND]):
        if watch.stops[int(watch.found[row, 1])] != 0 and watch.found[row, 0] > watch.after:
            stop = min(stop, watch.found[row, 0])
    kept = begun
    for row in range(begun, watch.counts[FOUND]):
        if watch.after < watch.found[row, 0] <= stop:
            for table in (watch.found, watch.states):
                for k in range(table.shape[1]):
                    table[kept, k] = table[row, k]
            kept += 1
    watch.counts[FOUND] = kept
    return stop


@routine
def begin(t, y, s, depth, watch, scratch):
    """Take the state at the start of a run for that from which things change."""
    for j in range(len(watch.zones)):
        watch.zones[j] = _zone_of(j, t, y, s, depth, scratch.force[0], scratch.rates[0], watch)
    for k in range(len(watch.own)):
        watch.own_values[k] = event_at(watch.own[k])(t, y, watch.own_parameters[k])


@routine
def next_switch(step, problem, progress, workspace, watch):
    """Part of the step until a normal force begins, ends or passes its depth; 1 if none does."""
    view = _view(step, problem, progress, workspace)
    first = 1.0
    for j in range(len(watch.zones)):
        old = _normal_zone(watch.zones[j])
        if _normal_zone(_zone(j, 1.0, view.after, view, watch)) == old:
            continue
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            tableau.interpolated(middle, view.before, view.after, view.dense, view.y)
            if _normal_zone(_zone(j, middle, view.y, view, watch)) == old:
                low = middle
            else:
                high = middle
        first = min(first, high)
    return first


@helper
def _keep_between(count, row, watch):
    """Put the middles between changes of sign, of which there are so many, into a row of places."""
    found = watch.changed
    for i in range(1, count):
        k = i
        while k > 0 and found[k] < found[k - 1]:
            found[k], found[k - 1] = found[k - 1], found[k]
            k -= 1
    watch.known[row] = 0
    for i in range(min(count - 1, PLACES)):
        watch.places[row, i] = 0.5 * (found[i] + found[i + 1])
        watch.known[row] = i + 1


@helper
def set_own_places(before, workspace, watch):
    """Fill the rows of ``watch.places`` of users' functions for a step."""
    b = workspace.bound[0]
    for k in range(len(watch.own)):
        count = 0
        if watch.linear[k] != 0:
            p = watch.own_parameters[k]
            for i in range(COEFFICIENTS):
                b[i] = -p[0]
            for i in range(len(before)):
                b[0] += p[1 + i] * before[i]
                b[1] += p[1 + i] * workspace.inner[0, i]
                b[2] += p[1 + i] * workspace.inner[1, i]
                b[3] += p[1 + i] * workspace.inner[2, i]
                b[4] += p[1 + i] * workspace.after[i]
            count = bernstein.sign_changes(b, watch.changed[:MOST], workspace.halves)
        _keep_between(count, len(watch.zones) + k, watch)


@helper
def _set_places(step, problem, before, workspace, watch):
    """Fill ``watch.places`` for a step."""
    s, control = problem.system, problem.control
    b, row = workspace.bound[0], workspace.bound[2]
    levels = control.levels.shape[0]
    for place in range(workspace.near.used[0]):
        j, count = workspace.near.nodes[place], 0
        # Gaps over the levels of the normal law, and slip velocities either way where stick ends.
        for k in range(levels + 2):
            what, shift = GAP, 0.0
            if k < levels:
                shift = control.levels[k, j]
            else:
                what, shift = SLIP, watch.stick_speed[j] * (2.0 * (k - levels) - 1.0)
            # In space a slip velocity turns instead of changing its sign: more looks find it.
            if watch.counts[NODES] == 0 or (
                    what == SLIP and (s.memory[j] > 0 or s.rows.shape[1] > 2)) or (
                    count + MOST > len(watch.changed)):
                continue
            polynomial = StepPolynomial(what, j, shift, step, s, control.ground,
                                        workspace.polynomials, row)
            count += changes(b, polynomial, workspace.halves, watch.changed[count : count + MOST])
        _keep_between(count, j, watch)
    set_own_places(before, workspace, watch)


@helper
def _note_changes(j, zone, left, right, view, watch):
    """Note what node j does between two parts of a step, at whose right end it is in a zone."""
    low = left
    for _ in range(_MOST_A_NODE):
        if watch.zones[j] % DEEP == zone % DEEP:
            break
        low, new = _changed(j, low, right, view, watch)
        note_zone(j, new, _time(low, view.step), view.y, watch)
    watch.zones[j] = zone


@helper
def note_own(k, left, right, view, watch):
    """Note the events of a user's function between two looks; view.y is the state at the right."""
    row = len(watch.zones) + k
    first = left
    for i in range(watch.known[row]):
        place = watch.places[row, i]
        if first < place < right:
            _look(place, view)
            watch.own_values[k] = _own(k, first, place, view, watch)
            first = place
    _look(right, view)
    watch.own_values[k] = _own(k, first, right, view, watch)
    _look(right, view)


@helper
def _note_node(j, left, right, view, watch):
    """Note the events of a node between two looks; view.y is the state at the right."""
    first = left
    for i in range(watch.known[j]):
        place = watch.places[j, i]
        if first < place < right:
            _look(place, view)
            zone = _zone(j, place, view.y, view, watch)
            _note_changes(j, zone, first, place, view, watch)
            first = place
    if first != left:
        _look(right, view)
    zone = _zone(j, right, view.y, view, watch)
    if watch.counts[NODES] == 0 or zone % DEEP == watch.zones[j] % DEEP:
        watch.zones[j] = zone
        return
    _note_changes(j, zone, first, right, view, watch)
    _look(right, view)


def _note_events(step, problem, progress, workspace, watch):
    """Note the events of an accepted step; the part of it after which the run ends, or inf."""
    view = _view(step, problem, progress, workspace)
    begun = watch.counts[FOUND]
    looks = _MORE_LOOKS if view.system.rows.shape[1] > 2 else _LOOKS
    for k in range(len(watch.own)):
        if watch.linear[k] == 0:
            looks = _MORE_LOOKS
    _set_places(step, problem, progress.state, workspace, watch)
    for look in range(looks):
        left, right = look / looks, (look + 1) / looks
        _look(right, view)
        for k in range(len(watch.own)):
            note_own(k, left, right, view, watch)
        # The others stay open.
        for place in range(workspace.near.used[0]):
            _note_node(workspace.near.nodes[place], left, right, view, watch)
    return (first_stop(begun, watch) - step.t) / step.h


# By its address, so that it is not compiled into every step of runs that watch for nothing.
note_events = compile_law(NOTE, "note_events(step, problem, progress, workspace, watch)",
                          _note_events)
