"""Elastic Coulomb elements in a step: where slip ends, and what follows from it.

The deflections of the elements follow the slip velocity all the time; see
:mod:`fecontact.system.elastic_sliders`. Slip of an element ends where its excess over the limit is
largest. A step with such a place inside is shortened to end there. The next step finds that the
excess falls from its start: the deflection is returned to the limit, and the step is repeated.
A step ends just past the touch of a contact that closes, or whose normal force passes through zero,
and the next one begins with the deflections since then, ``z = v (t - t_touch)``.
Forces are continuous at both ends of slip, and the derivatives of a deflection that is returned to
the limit become those of the limit.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper, routine
from fecontact.core.copies import put
from fecontact.core.records import Matrix, Vector
from fecontact.core.simd.vectors import opposite, select
from fecontact.integrate.brackets import Bracket, between, narrowed
from fecontact.integrate.rodas5p import dynamics, state, tableau
from fecontact.integrate.rodas5p.step_length import LAST_STEP
from fecontact.integrate.rodas5p.variational import Vary
from fecontact.system.elastic_sliders import (
    SHORT,
    deflection_of,
    limit_of,
    pressing_at,
    return_deflection,
    return_to_limits,
)
from fecontact.system.node_forces import force_workspace, normal_force
from fecontact.system.nodes import (
    change_by,
    ground_motion,
    ground_moved,
    memory_of,
    most_memory,
    node_motion,
    size_of,
)

_ATTEND = Callable[[
    int, state.Step, state.Problem, state.Progress, state.Workspace, Vary, float, Vector,
], float]
attend_at = function_at(_ATTEND)

# Requests: the part of the step until slip ends or begins; a state at a time within its
# limits; the end of a step, with its derivatives, within its limits; the start of a step after a
# touch.
SWITCH, OUTPUT, END, BEGIN = range(4)

# Parts of a step at which excesses are examined, and a part by which their slopes are taken.
_LOOKS, _ASIDE = 8, 1e-5
# Steps end where slip begins too if there are at most so many elements, or with derivatives.
_FEW = 32
# Excesses fall if they do by this part of their scale.
_FALL = 1e-12
# Rise of an excess, in its deflection, that may be rounding.
_ROUNDING = 1e-14
# Parts of a step within which a switch counts as lying on its end, without and with derivatives.
_NEAR, _NEAR_VARIED = 1e-3, 1e-6
_PRECISION, _TRIALS = 1e-7, 50
# Switches count as at an end of a step if they are nearer to it than this part of the time, and at
# most so much of the step.
_BRIEFEST, _NEAREST = 1e-12, 0.1
# Steps that end at a touch go past it by at most this many times what counts as the end.
_PAST = 4.0
# Least deflection of elements that slide since a touch, in parts of its scale: the shorter it is,
# the faster they turn in space.
_LEAST = 1e-4


class View(NamedTuple):
    """A step that is examined, and work arrays: a state y within it, and what friction fills."""

    step: state.Step
    problem: state.Problem
    progress: state.Progress
    workspace: state.Workspace
    y: Vector
    force: Vector
    rates: Matrix


class Moment(NamedTuple):
    """A state y (size,) in which deflections change, with its rates and gradients of the forces.

    ``force`` and ``node_rates`` are filled by friction.
    """

    t: float
    y: Vector
    rate: Vector
    gradients: dynamics.Gradients
    problem: state.Problem
    vary: Vary
    force: Vector
    node_rates: Matrix


@routine
def _look(part, view):
    """Put the state at a part of the step into ``view.y``; returns the motion of the ground."""
    step, workspace, y = view.step, view.workspace, view.y
    tableau.interpolated(part, view.progress.state, workspace.after, workspace.dense, y)
    for k in range(len(y)):
        y[k] = select(part == 1.0, workspace.after[k], y[k])
    return ground_motion(min(step.t + part * step.h, step.latest), view.problem.system)


@routine
def _excess(part, j, i, view):
    """Excess of element i of node j at a part of the step."""
    s, y = view.problem.system, view.y
    moved = _look(part, view)
    _, pressing, _ = pressing_at(j, y, moved, s, view.force, view.rates)
    count = view.problem.control.slider_counts[j]
    return deflection_of(memory_of(j, y, s), i, s) - limit_of(j, i, count, pressing, s)


@helper
def _begins(before, now):
    """Whether a normal force ``now`` begins, or passes through zero, since it was ``before``."""
    return (now != 0.0) & opposite(before * now > 0.0)


@routine
def _touch(low, high, now, j, view):
    """Part of the step at which the normal force of node j begins, which is ``now`` at ``high``."""
    while high - low > _PRECISION:
        part = 0.5 * (low + high)
        moved = _look(part, view)
        found, _, _ = pressing_at(j, view.y, moved, view.problem.system, view.force, view.rates)
        if _begins(found, now):
            low = part
        else:
            high = part
    return high


@helper
def _penetration_acceleration(j, contact, rate, acceleration, s):
    """Second rate of the penetration of node j [m/s^2], of the rates of state and ground."""
    rates, slip = node_motion(j, rate, s).speeds, contact.slip
    found = -rates[1]
    for tangent in range(s.rows.shape[1] - 1):
        along = rates[2 * tangent] - ground_moved(tangent, j, acceleration[0], acceleration[1], s)
        bend = contact.curvature[tangent]
        found += contact.slope[tangent] * along + slip[tangent] * (bend[0] * slip[0]
                                                                   + bend[1] * slip[1])
    return found


@helper
def _around_touch(j, contact, deepening, earlier, s):
    """Normal force of node j so much ``earlier`` and now; ``deepening`` is u''."""
    u, v = contact.penetration, contact.rate
    return (normal_force(j, u - v * earlier, v - deepening * earlier, s)[0],
            normal_force(j, u, v, s)[0])


@routine
def _since_touch(j, contact, deepening, earlier, s):
    """Time since the normal force of node j began [s], and whether it came through zero.

    The time is -1 if it is longer than ``earlier``; ``deepening`` is u''.
    """
    u, v = contact.penetration, contact.rate
    before, now = _around_touch(j, contact, deepening, earlier, s)
    if not _begins(before, now):
        return -1.0, False
    low, high = 0.0, earlier
    for _ in range(_TRIALS):
        middle = 0.5 * (low + high)
        found = normal_force(j, u - v * middle, v - deepening * middle, s)[0]
        if _begins(found, now):
            high = middle
        else:
            low = middle
    return low, before != 0.0


@routine
def _begin_columns(j, i, through, deepening, moment):
    """Let the derivatives of a deflection be those of z = v (t - t_b), of which t_b varies.

    Contact begins at t_b: the penetration passes a level, or the normal force comes ``through``
    zero with the rate F_u u' + F_v u''; ``deepening`` is u''.
    """
    t, y, vary, force, rates = (moment.t, moment.y, moment.vary, moment.force,
                                moment.node_rates)
    s, v, tangents = moment.problem.system, vary.variation, moment.problem.system.rows.shape[1] - 1
    first = 2 * len(moment.problem.control.largest) + j * most_memory(s) + tangents * i
    F, pressing, contact = pressing_at(j, y, ground_motion(t, s), s, force, rates)
    _, by_depth, by_rate = normal_force(j, contact.penetration, contact.rate, s)
    rate = by_depth * contact.rate + by_rate * deepening if through else contact.rate
    for c in range(len(v.columns)):
        places = node_motion(j, v.columns[c], s).places
        change = contact.slope[0] * places[0] - places[1] + contact.slope[1] * places[2]
        if through:
            change = F / pressing * change_by(moment.gradients.partial[j, tangents + 1], j,
                                              v.columns[c], s)
        if vary.width != 0.0 and c == len(v.columns) - 1:
            over, under = ground_motion(t, vary.above), ground_motion(t, vary.below)
            up, _, above = pressing_at(j, y, over, vary.above, force, rates)
            down, _, below = pressing_at(j, y, under, vary.below, force, rates)
            change += (up - down if through else above.penetration - below.penetration) / vary.width
        for k in range(tangents):
            v.columns[c, first + k] = contact.slip[k] * change / rate


@routine
def _begin_contact(j, since, through, acceleration, moment):
    """Set the deflections of node j a time after its touch; True if any changes.

    They are ``z = v since``, of which the part beyond the limit is the distance of slip. It may be
    longer by any amount. ``acceleration`` is that of the ground.
    """
    problem, y, changed = moment.problem, moment.y, False
    s, count = problem.system, problem.control.slider_counts[j]
    _, pressing, contact = pressing_at(j, y, ground_motion(moment.t, s), s, moment.force,
                                       moment.node_rates)
    slip, tangents = contact.slip, s.rows.shape[1] - 1
    speed = size_of(slip)
    deepening = _penetration_acceleration(j, contact, moment.rate, acceleration, s)
    z, scales = memory_of(j, y, s), problem.control.memory_scale
    for i in range(count):
        limit = limit_of(j, i, count, pressing, s)
        first, time, moves = tangents * i, since, False
        if speed * since > limit:
            time = max(since, _LEAST * scales[j * most_memory(s) + first] / speed)
        for k in range(tangents):
            moves |= z[first + k] != slip[k] * time
        if not moves:
            continue
        if len(moment.vary.variation.columns):
            _begin_columns(j, i, through, deepening, moment)
        for k in range(tangents):
            z[first + k] = slip[k] * time
        changed = True
    return changed


@routine
def _set_rates(after_t, problem, progress, workspace):
    """Set the rates and gradients of the state after its deflections have changed."""
    s = problem.system
    dynamics.set_given(after_t, s, workspace.given, workspace.load)
    dynamics.set_rate_and_gradients(progress.state, s, problem.blocks, workspace.given,
                                    workspace.load, workspace.nodes, progress.gradients,
                                    progress.rate)


@routine
def _after_touch(step, t, problem, progress, workspace, vary):
    """Set the deflections of contacts that closed at the end of the last step, at the time t.

    Returns True if any changes.
    """
    s, control, changed = problem.system, problem.control, False
    near = _NEAR_VARIED if len(vary.variation.columns) > 0 else _NEAR
    earlier = _PAST * max(near * progress.numbers[LAST_STEP], _BRIEFEST * abs(t))
    force, rates = force_workspace(s)
    moved = ground_motion(t, s)
    acceleration = dynamics.ground_acceleration(step.t, dynamics.t_plus(step), moved, s)
    moment = Moment(t, progress.state, progress.rate, progress.gradients, problem, vary, force,
                    rates)
    for j in range(len(control.slider_counts)):
        if control.slider_counts[j] == 0:
            continue
        _, _, contact = pressing_at(j, progress.state, moved, s, force, rates)
        deepening = _penetration_acceleration(j, contact, progress.rate, acceleration, s)
        since, through = _since_touch(j, contact, deepening, earlier, s)
        if since >= 0.0:
            changed |= _begin_contact(j, since, through, acceleration, moment)
    if changed:
        _set_rates(t, problem, progress, workspace)
    return changed


@routine
def _slope(part, j, i, view):
    """Rise of the excess over a small part of the step about another part."""
    low, high = max(part - _ASIDE, 0.0), min(part + _ASIDE, 1.0)
    return (_excess(high, j, i, view) - _excess(low, j, i, view)) / (high - low)


@routine
def _root(slopes, low, high, at_low, at_high, j, i, view):
    """Part of the step at which the excess, or with ``slopes`` its slope, vanishes."""
    bracket, part = Bracket(low, high, at_low, at_high, 0), high
    for _ in range(_TRIALS):
        part = between(bracket)
        found = _slope(part, j, i, view) if slopes else _excess(part, j, i, view)
        bracket = narrowed(bracket, part, found)
        if found == 0.0 or bracket.high - bracket.low < _PRECISION:
            break
    return part


@routine
def _largest(low, high, j, i, view):
    """Part of the step, between two, at which an excess is largest."""
    at_low = _slope(low, j, i, view)
    if not at_low > 0.0:
        return low
    at_high = _slope(high, j, i, view)
    if not at_high < 0.0:
        return high
    place = _root(True, low, high, at_low, at_high, j, i, view)
    largest = _excess(place, j, i, view)
    size = deflection_of(memory_of(j, view.y, view.problem.system), i, view.problem.system)
    # In very short steps slopes are rounding: what falls all along may seem to rise first.
    return place if largest - _excess(low, j, i, view) > _ROUNDING * size else low


@routine
def _columns(j, i, limit, size, moment):
    """Make the derivatives of a deflection those of its limit; the state is that before it."""
    t, y, vary, force, rates = (moment.t, moment.y, moment.vary, moment.force,
                                moment.node_rates)
    s, v, control = moment.problem.system, vary.variation, moment.problem.control
    tangents, count = s.rows.shape[1] - 1, control.slider_counts[j]
    first = 2 * len(control.largest) + j * most_memory(s) + tangents * i
    z, p = memory_of(j, y, s), s.friction_parameters[j]
    slope = p[1 + count + i] / p[1 + i]
    for c in range(len(v.columns)):
        change = slope * change_by(moment.gradients.partial[j, tangents + 1], j, v.columns[c], s)
        if vary.width != 0.0 and c == len(v.columns) - 1:
            _, above, _ = pressing_at(j, y, ground_motion(t, vary.above), vary.above, force, rates)
            _, below, _ = pressing_at(j, y, ground_motion(t, vary.below), vary.below, force, rates)
            change += (limit_of(j, i, count, above, vary.above)
                       - limit_of(j, i, count, below, vary.below)) / vary.width
        if tangents == 1:
            v.columns[c, first] = change if z[i] > 0.0 else -change
        else:
            a, b = z[2 * i] / size, z[2 * i + 1] / size
            dz1, dz2 = v.columns[c, first], v.columns[c, first + 1]
            along = a * dz1 + b * dz2
            v.columns[c, first] = a * change + limit * (dz1 - a * along) / size
            v.columns[c, first + 1] = b * change + limit * (dz2 - b * along) / size


@routine
def _return_one(j, i, within, moment):
    """Return element i of node j to its limit, or a little below it, if it is beyond it."""
    s, count, y = moment.problem.system, moment.problem.control.slider_counts[j], moment.y
    _, pressing, _ = pressing_at(j, y, ground_motion(moment.t, s), s, moment.force,
                                 moment.node_rates)
    limit, size = limit_of(j, i, count, pressing, s), deflection_of(memory_of(j, y, s), i, s)
    if size <= limit:
        return
    if len(moment.vary.variation.columns):
        _columns(j, i, limit, size, moment)
    part = 1.0 - SHORT if within else 1.0 + SHORT
    return_deflection(memory_of(j, y, s), i, size, limit * part, s)


@helper
def _nearest(step):
    """Part of the step within which a switch counts as lying on its end, at least."""
    return max(min(_BRIEFEST * abs(step.t) / step.h, _NEAREST), _NEAR_VARIED)


@helper
def _part_at(look, near):
    """Part of the step at which excesses are examined for the ``look``-th time.

    The last two are close together, so that what begins to fall at the end is seen.
    """
    return 1.0 if look > _LOOKS else (1.0 - near if look == _LOOKS else look / _LOOKS)


@routine
def _examine(look, near, view, out):
    """Fill ``out`` (n + n s,) with the normal forces and the excesses of all elements."""
    s, y, counts = view.problem.system, view.y, view.problem.control.slider_counts
    n, states = len(counts), most_memory(s)
    moved = _look(_part_at(look, near), view)
    for j in range(n):
        if counts[j] == 0:
            continue
        F, pressing, _ = pressing_at(j, y, moved, s, view.force, view.rates)
        out[j] = F
        z = memory_of(j, y, s)
        for i in range(counts[j]):
            out[n + j * states + i] = (deflection_of(z, i, s)
                                       - limit_of(j, i, counts[j], pressing, s))


@helper
def _may_end(rise, excess, fall, size, scale):
    """Whether slip may end about a look at an element, of that deflection and scale of its node.

    ``rise`` and ``fall`` of the excess are those to this look and to the next one.
    """
    least = max(_FALL * max(abs(excess), scale), _ROUNDING * size)
    # The top may be above the looks by the fall on both sides.
    return (fall > least) & (rise > -least) & (excess + max(rise, fall) > 0.0)


@routine
def touched(step, problem, progress, workspace):
    """Whether contacts with elements closed at the end of the last step, of eight: in which.

    Where not, ``attend`` with ``BEGIN`` does nothing.
    """
    s, counts, some = problem.system, problem.control.slider_counts, False
    earlier = _PAST * max(_NEAR * progress.numbers[LAST_STEP], _BRIEFEST * abs(step.t))
    moved = ground_motion(step.t, s)
    acceleration = dynamics.ground_acceleration(step.t, dynamics.t_plus(step), moved, s)
    for j in range(len(counts)):
        if counts[j] > 0:
            _, _, contact = pressing_at(j, progress.state, moved, s, workspace.scratch.force[0],
                                        workspace.scratch.rates[0])
            deepening = _penetration_acceleration(j, contact, progress.rate, acceleration, s)
            before, now = _around_touch(j, contact, deepening, earlier, s)
            some = some | _begins(before, now)
    return some


@routine
def may_switch(step, problem, progress, workspace):
    """Whether anything is to be done about elements in a step, of eight: in which.

    Where not, ``attend`` with ``SWITCH`` returns 1.
    """
    s, control, found, doubt = problem.system, problem.control, workspace.inner, False
    n, states = len(control.slider_counts), most_memory(s)
    view = View(step, problem, progress, workspace, workspace.right, workspace.scratch.force[0],
                workspace.scratch.rates[0])
    near = max(_nearest(step), _NEAR)
    for look in range(_LOOKS + 2):
        now, last, older = found[look % 3], found[(look + 2) % 3], found[(look + 1) % 3]
        _examine(look, near, view, now)
        if look == 0:
            continue
        for j in range(n):
            if control.slider_counts[j] > 0:
                doubt = doubt | _begins(last[j], now[j])
            for i in range(control.slider_counts[j]):
                k = n + j * states + i
                size = deflection_of(memory_of(j, progress.state, s), i, s)
                rise = last[k] - older[k] if look > 1 else 0.0
                doubt = doubt | ((last[k] <= 0.0) & (now[k] > 0.0)) | _may_end(
                    rise, last[k], last[k] - now[k], size, control.memory_scale[j * states])
    return doubt


@routine
def _switch(step, problem, progress, workspace, vary):
    s, control = problem.system, problem.control
    n, varies = len(control.slider_counts), len(vary.variation.columns) > 0
    states = most_memory(s)
    force, rates = force_workspace(s)
    y = np.empty(len(progress.state))
    view = View(step, problem, progress, workspace, y, force, rates)
    found, places = np.zeros((3, n * (1 + states))), np.full((n, states), 2.0)
    starts, at_once = np.empty(n * (1 + states)), np.zeros((n, states), dtype=np.bool_)
    begins = varies or control.slider_counts.sum() <= _FEW
    first, t, again = 2.0, step.t, False
    nearest = _nearest(step)
    near = nearest if varies else max(_NEAR, nearest)
    least, past = near, 0.0
    after_t = np.nextafter(t, np.inf)
    start = Moment(after_t, progress.state, progress.rate, progress.gradients, problem, vary, force,
                   rates)
    for look in range(_LOOKS + 2):
        if again:
            break
        part, before = _part_at(look, near), max(0.0, (look - 2) / _LOOKS)
        begun = _part_at(max(look - 1, 0), near)
        now, last, older = found[look % 3], found[(look + 2) % 3], found[(look + 1) % 3]
        _examine(look, near, view, now)
        if look == 0:
            put(now, starts)
            continue
        for j in range(n):
            if control.slider_counts[j] > 0 and _begins(last[j], now[j]):
                place = _touch(begun, part, now[j], j, view)
                if place > nearest:
                    first, least, past = min(first, place), nearest, nearest
                else:
                    again |= _begin_contact(j, 0.0, last[j] != 0.0, dynamics.ground_acceleration(
                        t, dynamics.t_plus(step), step.moved, s), start)
        for j in range(n):
            # Elements of a contact that stays open have nothing to hold.
            if now[j] == 0.0 and last[j] == 0.0 and older[j] == 0.0:
                continue
            for i in range(control.slider_counts[j]):
                k = n + j * states + i
                middle, high = last[k], now[k]
                size = deflection_of(memory_of(j, progress.state, s), i, s)
                rise = middle - older[k] if look > 1 else 0.0
                if _may_end(rise, middle, middle - high, size, control.memory_scale[j * states]):
                    place = _largest(before, part, j, i, view)
                    if (place > near or starts[k] > 0.0) and _excess(place, j, i, view) > 0.0:
                        places[j, i] = min(places[j, i], place)
                        first = min(first, place)
                if begins and middle <= 0.0 < high:
                    place = _root(False, begun, part, min(middle, -1e-300), high, j, i, view)
                    if look == 1 and middle >= -0.5 * SHORT * size:
                        # The last step ended just short of where slip begins. Without deflection
                        # and limit, at a touch, the element slides by itself.
                        if size > 0.0:
                            at_once[j, i], first = True, 0.0
                    elif place > near:
                        first = min(first, place)
        if first <= part:
            break
    # Steps end a little past a switch, so that it lies well within what counts as the end.
    if not again and first >= 1.0 - 3.0 * near - past:
        return 1.0
    if not again and first > least:
        return min(first + near * first + past, 1.0)
    for j in range(n):
        for i in range(control.slider_counts[j]):
            if places[j, i] <= near:
                _return_one(j, i, True, start)
                again = True
            elif at_once[j, i]:
                z = memory_of(j, progress.state, s)
                return_deflection(z, i, 1.0, 1.0 + SHORT, s)
                again = True
    if not again:
        return 1.0
    _set_rates(after_t, problem, progress, workspace)
    return 0.0


@routine
def _at_end(step, problem, progress, workspace, vary):
    """Return the state at the end of the step to its limits, with its derivatives."""
    s, control = problem.system, problem.control
    force, rates = force_workspace(s)
    y = np.empty(len(progress.state))
    earlier = _look(1.0 - _NEAR_VARIED, View(step, problem, progress, workspace, y, force, rates))
    now = ground_motion(step.latest, s)
    end = Moment(step.latest, workspace.after, workspace.rate_after, workspace.gradients_after,
                 problem, vary, force, rates)
    for j in range(len(control.slider_counts)):
        if control.slider_counts[j] == 0:
            continue
        _, before, _ = pressing_at(j, y, earlier, s, force, rates)
        _, after, _ = pressing_at(j, workspace.after, now, s, force, rates)
        # Where the force jumps, slip ends at the begin of the next step.
        if before < 0.5 * after:
            continue
        for i in range(control.slider_counts[j]):
            _return_one(j, i, False, end)
    dynamics.set_rate_and_gradients(workspace.after, s, problem.blocks, workspace.given,
                                    workspace.load, workspace.nodes, workspace.gradients_after,
                                    workspace.rate_after)


def _attend(kind, step, problem, progress, workspace, vary, t, y):
    """Part of the step until slip ends, 0 if it was to end at its start, 1 if it does not.

    Or fill in what ``kind`` asks for: ``y`` at the time t, or the end of the step, within limits,
    or its start after a touch; 0 if that has changed.
    """
    if kind == SWITCH:
        return _switch(step, problem, progress, workspace, vary)
    if kind == END:
        _at_end(step, problem, progress, workspace, vary)
        return 1.0
    if kind == BEGIN:
        changed = _after_touch(step, np.nextafter(t, np.inf), problem, progress, workspace, vary)
        return 0.0 if changed else 1.0
    s = problem.system
    return_to_limits(t, y, s, problem.control.slider_counts, *force_workspace(s))
    return 1.0


# By its address: only systems with such elements need it.
attend = compile_law(_ATTEND, "attend(kind, step, problem, progress, workspace, vary, t, y)",
                     _attend)
