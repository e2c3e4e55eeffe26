r"""Compiled run of solids at rigid stops with friction, by steps of impulses (Moreau and Jean).

Over a step of length h the modal velocities v change by the forces at its middle and by normal
impulses L_j and tangential ones P_j of the nodes that touch there,

.. math::

    v^+ - v = h\,(f - K (q + \tfrac{h}{4} (v + v^+) ) - \tfrac12 C (v + v^+)) + G L - T^T P,
    \qquad q^+ = q + \tfrac{h}{2} (v + v^+)

with, for penetration rates u' and slip velocities s,

.. math::

    0 \le L_j \perp -(u_j'^+ + e \max(u_j'^-, 0)) \ge 0, \qquad
    P_j \in \mu_j L_j\, e(s_j^+ + \kappa s_j^-)

where e(.) is the unit direction, and the whole disc at zero. In a step with an impact kappa is
e_T; else it is 1 at nodes that slip on in about their direction, which makes the path of second
order, and 0 at others. Closed contacts beside the one that is struck take part.

The impulses of all nodes are found by projected Gauss-Seidel sweeps, which stop where nothing
changes; at unilateral contact without friction these minimise the kinetic energy. A tangential
impulse takes more energy than any other in its disc. Nodes need not be independent: then the
velocities are found, and one of the ways in which the nodes share the impulses.

A step is compared with two of half its length, which are kept: to the tolerance in its places, and
without impact in its velocities too; nor may a node come deeper into the ground. Across impacts and
transitions the scheme is of first order. Nodes that touch are put back on the ground after each
step.

References
----------
P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like
solution methods, Computer Methods in Applied Mechanics and Engineering 92 (1991). J. J. Moreau,
Unilateral contact and dry friction in finite freedom dynamics, CISM Courses and
Lectures 302 (1988). M. Jean, The non-smooth contact dynamics method, Computer Methods in Applied
Mechanics and Engineering 177 (1999).
"""

import math
from typing import Annotated, NamedTuple

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.types import Array, Integers
from fecontact.integrate.nonsmooth.equations import (
    set_implicit_matrix,
    slipping_force,
    stick_limit,
)
from fecontact.integrate.nonsmooth.problem import (
    GAINED,
    IMPACTS,
    WITH_WORK,
    Limits,
    NonsmoothProblem,
    Output,
    Progress,
    Step,
    next_target,
    pace,
    pass_break,
)
from fecontact.integrate.step_loop import (
    FAILED,
    NOT_A_NUMBER,
    NOT_SOLVED,
    OUTPUTS,
    RUNNING,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.system.kernels import body_acceleration, prescribed_at
from fecontact.system.node_forces import friction_scale
from fecontact.system.nodes import (
    MODES,
    NODES,
    ground_motion,
    ground_speed,
    node_contact,
    node_motion,
)
from fecontact.system.powers import (
    BELT_FRICTION,
    BELT_NORMAL,
    CONTACT_DAMPING,
    FRICTION,
    POWER_COUNT,
    belt_normal_power,
    body_powers,
)

# Velocities below this part of the largest are no approach, and no slip.
_STILL = 1e-9
# Energy gained by impacts that is rounding.
_GAIN = 1e-10
# How often the impulses of a step are computed again with coefficients of its middle.
_PASSES = 4
_SWEEPS = 20000
# Change of the impulses in a sweep at which they count as found, relative to the largest.
_SETTLED = 1e-13
# How deep nodes that touch are left in the ground, relative to the largest displacements.
_MARGIN = 1e-12


class ImpactWorkspace(NamedTuple):
    """Workspace for steps of impulses.

    Entries of the nodes are normal ones (n,), then those along the first and the second tangents.

    Attributes
    ----------
    rows, impulse_responses
        Changes of [-u', s] by the modes, and of the velocities by unit impulses.
    coupling
        Changes of [-u', s] by unit impulses [L, P].
    given, before, after, impulses, rest
        [-u', s] without contact, and at both ends of a step; [L, P]; what is left of the
        conditions.
    slopes, sides
        Of the ground, and velocities of the other side.
    weights, grip
        kappa, and what friction sees of a unit normal force.
    sticking, slipping
        Coefficients of friction.
    matrix
        1 + h C / 2 + h^2 K / 4, factorised.
    middle, change, rates, largest
        State in the middle, change of the velocities, powers, largest coordinates so far.
    whole, half, end
        Y after a whole step, and after one and two halves.
    forces, closed
        Forces and contacts in the whole step, and in the halves.
    """

    rows: Annotated[Array, 3 * NODES, MODES]
    impulse_responses: Annotated[Array, 3 * NODES, MODES]
    coupling: Annotated[Array, 3 * NODES, 3 * NODES]
    given: Annotated[Array, 3 * NODES]
    before: Annotated[Array, 3 * NODES]
    after: Annotated[Array, 3 * NODES]
    impulses: Annotated[Array, 3 * NODES]
    rest: Annotated[Array, 3 * NODES]
    slopes: Annotated[Array, 2 * NODES]
    sides: Annotated[Array, 2 * NODES]
    weights: Annotated[Array, NODES]
    grip: Annotated[Array, NODES]
    sticking: Annotated[Array, NODES]
    slipping: Annotated[Array, NODES]
    matrix: Annotated[Array, MODES, MODES]
    middle: Annotated[Array, 2 * MODES]
    change: Annotated[Array, MODES]
    rates: Annotated[Array, NODES + POWER_COUNT]
    largest: Annotated[Array, 2 * MODES]
    whole: Annotated[Array, WITH_WORK]
    half: Annotated[Array, WITH_WORK]
    end: Annotated[Array, WITH_WORK]
    forces: Annotated[Array, 3, 3 * NODES]
    closed: Annotated[Integers, 3, NODES]
    touching: Annotated[Integers, NODES]
    pivots: Annotated[Integers, MODES]


@helper
def _set_matrix(h, p, workspace):
    """Factorise the matrix of a step."""
    set_implicit_matrix(0.5 * h, 0.25 * h * h, p.system, workspace.matrix)
    factorise(workspace.matrix, len(workspace.pivots), workspace.pivots)


@helper
def _set_rows(j, contact, p, workspace):
    """Fill the rows of node j: how modes change its height over the ground and its place."""
    s, rows = p.system, workspace.rows
    n, _, m = s.rows.shape
    for i in range(m):
        rows[j, i] = (s.rows[j, 1, i] - contact.slope[0] * s.rows[j, 0, i]
                      - contact.slope[1] * s.rows[j, 2, i])
        rows[n + j, i], rows[2 * n + j, i] = s.rows[j, 0, i], s.rows[j, 2, i]


@routine
def _set_impulse_responses(p, workspace):
    """Fill ``impulse_responses`` and ``coupling`` of touching nodes, with the factorised matrix."""
    s, rows, responses, touching = (p.system, workspace.rows, workspace.impulse_responses,
                                    workspace.touching)
    n, _, m = s.rows.shape
    for b in range(3 * n):
        j = b % n
        if not touching[j]:
            continue
        for i in range(m):
            if b >= n:
                responses[b, i] = -rows[b, i]
            else:
                responses[b, i] = rows[b, i] if s.follows_surface else s.rows[j, 1, i]
        solve(workspace.matrix, workspace.pivots, responses[b])
        for a in range(3 * n):
            if touching[a % n]:
                total = 0.0
                for i in range(m):
                    total += rows[a, i] * responses[b, i]
                workspace.coupling[a, b] = total


@helper
def _stiffest(j, n, workspace):
    """Largest change of the slip velocity of node j by a unit impulse along the ground."""
    c = workspace.coupling
    a, b = -c[n + j, n + j], -c[2 * n + j, 2 * n + j]
    mixed = -0.5 * (c[n + j, 2 * n + j] + c[2 * n + j, n + j])
    return 0.5 * (a + b) + math.hypot(0.5 * (a - b), mixed)


@routine
def _add_impulse(a, change, n, workspace):
    """Change an impulse, and with it the residual of the conditions."""
    workspace.impulses[a] += change
    for b in range(3 * n):
        if workspace.touching[b % n]:
            workspace.rest[b] += workspace.coupling[b, a] * change


@routine
def _find_impulses(restitution, n, workspace):
    """Fill ``impulses`` of the touching nodes, and ``after``; whether they were found."""
    x, y, c = workspace.impulses, workspace.rest, workspace.coupling
    x[:] = 0.0
    for j in range(n):
        y[j] = workspace.given[j] - restitution[j] * max(-workspace.before[j], 0.0)
        for a in (n + j, 2 * n + j):
            y[a] = workspace.given[a] + workspace.weights[j] * workspace.before[a]
    found = False
    for _ in range(_SWEEPS):
        moved, scale = 0.0, 0.0
        for j in range(n):
            if not workspace.touching[j]:
                continue
            pressed = max(0.0, x[j] - y[j] / c[j, j]) if c[j, j] > 0.0 else 0.0
            moved = max(moved, abs(pressed - x[j]))
            scale = max(scale, pressed)
            _add_impulse(j, pressed - x[j], n, workspace)
            stiffest = _stiffest(j, n, workspace)
            if stiffest <= 0.0:
                continue
            one, two = x[n + j] + y[n + j] / stiffest, x[2 * n + j] + y[2 * n + j] / stiffest
            size = math.hypot(one, two)
            if size > workspace.sticking[j] * pressed:
                part = workspace.slipping[j] * pressed / size
                one, two = part * one, part * two
            moved = max(moved, abs(one - x[n + j]), abs(two - x[2 * n + j]))
            scale = max(scale, abs(one), abs(two))
            _add_impulse(n + j, one - x[n + j], n, workspace)
            _add_impulse(2 * n + j, two - x[2 * n + j], n, workspace)
        if moved <= _SETTLED * scale:
            found = True
            break
    for j in range(n):
        workspace.after[j] = y[j] + restitution[j] * max(-workspace.before[j], 0.0)
        for a in (n + j, 2 * n + j):
            workspace.after[a] = y[a] - workspace.weights[j] * workspace.before[a]
    return found


@routine
def _put_on_ground(t, Y, closed, p, workspace):
    """Move closed nodes, and nodes in the ground, to where they just touch it."""
    s, middle, x = p.system, workspace.middle, workspace.impulses
    n, _, m = s.rows.shape
    moved = ground_motion(t, s)
    margin = 0.0
    for i in range(m):
        for j in range(n):
            margin = max(margin, _MARGIN * abs(s.rows[j, 1, i]) * workspace.largest[i])
    put(Y[: 2 * m], middle)
    _set_matrix(0.0, p, workspace)
    deepest = 0.0
    for j in range(n):
        contact = node_contact(j, node_motion(j, middle, s), moved, s)
        workspace.touching[j] = 1 if closed[j] or contact.penetration > margin else 0
        _set_rows(j, contact, p, workspace)
        workspace.rest[j] = margin - contact.penetration
        if workspace.touching[j]:
            deepest = max(deepest, abs(workspace.rest[j]))
    x[:] = 0.0
    if deepest <= margin:
        return
    _set_impulse_responses(p, workspace)
    for _ in range(_SWEEPS):
        furthest = 0.0
        for j in range(n):
            if not workspace.touching[j] or workspace.coupling[j, j] <= 0.0:
                continue
            change = -workspace.rest[j] / workspace.coupling[j, j]
            if not closed[j]:
                change = max(change, -x[j])
            furthest = max(furthest, abs(change * workspace.coupling[j, j]))
            x[j] += change
            for b in range(n):
                if workspace.touching[b]:
                    workspace.rest[b] += workspace.coupling[b, j] * change
        if furthest <= 0.1 * margin:
            break
    for j in range(n):
        if workspace.touching[j]:
            for i in range(m):
                Y[i] += x[j] * workspace.impulse_responses[j, i]


class Data(NamedTuple):
    """A run of a solid at rigid stops."""

    problem: NonsmoothProblem
    limits: Limits
    progress: Progress
    output: Output
    kept: Output
    workspace: ImpactWorkspace


@helper
def _look_again(n, p, workspace):
    """Set weights and coefficients of a step without impact anew; whether they have changed."""
    changed = False
    for j in range(n):
        if not workspace.touching[j]:
            continue
        a, b = n + j, 2 * n + j
        before, after = workspace.before, workspace.after
        went = before[a] * before[a] + before[b] * before[b]
        on = before[a] * after[a] + before[b] * after[b] > 0.25 * went
        if workspace.weights[j] != 0.0 and not on:
            workspace.weights[j] = 0.0
            changed = True
        slip = 0.5 * math.hypot(workspace.before[a] + workspace.after[a],
                                workspace.before[b] + workspace.after[b])
        fresh = slipping_force(j, slip, 1.0, workspace.grip[j], p.system)
        changed = changed or abs(fresh - workspace.slipping[j]) > 1e-12 * fresh
        workspace.slipping[j] = fresh
        workspace.sticking[j] = max(workspace.sticking[j], fresh)
    return changed


@routine
def _observe_nodes(t, Y, closed, quick, p, workspace):
    """Fill rows, coefficients and [-u', s] of the nodes that touch in the middle of a step.

    For the places in ``workspace.middle`` and the velocities of Y; whether a node is struck.
    """
    s, middle, sides = p.system, workspace.middle, workspace.sides
    n, _, m = s.rows.shape
    moved = ground_motion(t, s)
    struck = False
    for j in range(n):
        contact = node_contact(j, node_motion(j, middle, s), moved, s)
        workspace.touching[j] = 1 if closed[j] or contact.penetration >= 0.0 else 0
        if not workspace.touching[j]:
            continue
        _set_rows(j, contact, p, workspace)
        workspace.slopes[j], workspace.slopes[n + j] = contact.slope[0], contact.slope[1]
        sides[j], sides[n + j] = ground_speed(0, j, moved, s), ground_speed(1, j, moved, s)
        lifted = contact.slope[0] * sides[j] + contact.slope[1] * sides[n + j]
        for place, own in ((j, lifted), (n + j, -sides[j]), (2 * n + j, -sides[n + j])):
            free, now = own, own
            for i in range(m):
                free += workspace.rows[place, i] * workspace.change[i]
                now += workspace.rows[place, i] * Y[m + i]
            workspace.given[place], workspace.before[place] = free, now
        struck = struck or (not closed[j] and -workspace.before[j] > _STILL * quick)
        slip = math.hypot(workspace.before[n + j], workspace.before[2 * n + j])
        workspace.grip[j] = friction_scale(j, contact, s)[0]
        workspace.slipping[j] = slipping_force(j, slip, 1.0, workspace.grip[j], p.system)
        workspace.sticking[j] = max(stick_limit(j, workspace.grip[j], p), workspace.slipping[j])
        workspace.weights[j] = 1.0 if slip > _STILL * quick else 0.0
    if struck:
        put(p.tangential, workspace.weights)
    return struck


@routine
def _add_powers(t, h, Y, out, p, workspace):
    """Put the work of a step into ``out``; returns what the impulses took."""
    s, rates, middle = p.system, workspace.rates, workspace.middle
    n, _, m = s.rows.shape
    for i in range(2 * m):
        middle[i] = 0.5 * (Y[i] + out[i])
    rates[:] = 0.0
    body_powers(t, middle, s, rates)
    taken = 0.0
    for j in range(n):
        if not workspace.touching[j]:
            continue
        L, rubbed = workspace.impulses[j] / h, 0.0
        for k in range(2):
            a = (1 + k) * n + j
            slip = 0.5 * (workspace.before[a] + workspace.after[a])
            speed = workspace.sides[k * n + j]
            rates[BELT_NORMAL] += belt_normal_power(L, workspace.slopes[k * n + j], slip, speed, s)
            rates[BELT_FRICTION] -= workspace.impulses[a] / h * speed
            rubbed += workspace.impulses[a] / h * slip
        lost = -0.5 * L * (workspace.before[j] + workspace.after[j])
        rates[CONTACT_DAMPING] += lost
        rates[FRICTION] += rubbed
        rates[POWER_COUNT + j] += rubbed
        taken += h * (lost + rubbed)
    for i in range(len(rates)):
        out[2 * m + i] = Y[2 * m + i] + h * rates[i]
    return taken


@routine
def _go(step, Y, closed, which, quick, p, workspace, out):
    """One step of impulses from Y to ``out``; 0, 1 with an impact, 2 if that gained energy, or -1.

    ``which`` is the row of forces and closed contacts that it fills; -1 where no impulses were
    found.
    """
    s, middle, change, h = p.system, workspace.middle, workspace.change, step.h
    n, _, m = s.rows.shape
    at = min(step.t + 0.5 * h, step.latest)
    for i in range(m):
        middle[i] = Y[i] + 0.5 * h * Y[m + i]
        middle[m + i] = Y[m + i]
    prescribed_at(at, s, change)
    body_acceleration(change, middle, s, change)
    _set_matrix(h, p, workspace)
    solve(workspace.matrix, workspace.pivots, change)
    for i in range(m):
        change[i] = Y[m + i] + h * change[i]
    struck = _observe_nodes(at, Y, closed, quick, p, workspace)
    workspace.impulses[:] = 0.0
    if workspace.touching.any():
        _set_impulse_responses(p, workspace)
        if not _find_impulses(p.restitution, n, workspace):
            return -1
        for _ in range(_PASSES):
            if struck or not _look_again(n, p, workspace):
                break
            if not _find_impulses(p.restitution, n, workspace):
                return -1
    for a in range(3 * n):
        if workspace.touching[a % n]:
            for i in range(m):
                change[i] += workspace.impulses[a] * workspace.impulse_responses[a, i]
        # Impulses of impacts are no forces.
        workspace.forces[which, a] = 0.0 if struck else workspace.impulses[a] / h
    for j in range(n):
        closed = workspace.touching[j] and workspace.impulses[j] > 0.0
        workspace.closed[which, j] = 1 if closed else 0
    energy = 0.0
    for i in range(m):
        out[i], out[m + i] = Y[i] + 0.5 * h * (Y[m + i] + change[i]), change[i]
        energy += 0.5 * change[i] * change[i]
    taken = _add_powers(at, h, Y, out, p, workspace)
    return (2 if taken < -_GAIN * energy else 1) if struck else 0


@helper
def _error(struck, limits, workspace):
    """Difference of a whole step and two halves in units of what is allowed."""
    m, worst = len(workspace.change), 0.0
    for i in range(m if struck else 2 * m):
        workspace.largest[i] = max(workspace.largest[i], abs(workspace.end[i]))
        allowed = limits.rtol * (limits.floor[i] + workspace.largest[i])
        worst = max(worst, abs(workspace.whole[i] - workspace.end[i]) / allowed)
    return worst


@routine
def _too_deep(t, Y, closed, limits, p, workspace):
    """Largest penetration of open nodes, in units of the penetration that is allowed."""
    s, worst = p.system, 0.0
    moved = ground_motion(t, s)
    for j in range(len(closed)):
        if closed[j]:
            continue
        depth = node_contact(j, node_motion(j, Y, s), moved, s).penetration
        if depth > 0.0:
            allowed = 0.0
            for i in range(s.rows.shape[2]):
                size = limits.floor[i] + workspace.largest[i]
                allowed += abs(s.rows[j, 1, i]) * limits.rtol * size
            worst = max(worst, depth / allowed)
    return worst


@helper
def _fill_within(row, t, h, Y, out, which, output, workspace):
    """Fill a row in a step of length h from Y to ``out``; forces are constant in it."""
    m, n, states = len(workspace.change), len(workspace.grip), output.states
    part = (output.times[row] - t) / h
    for i in range(m):
        gained = out[m + i] - Y[m + i]
        states[row, i] = Y[i] + h * part * (Y[m + i] + 0.5 * part * gained)
        states[row, m + i] = Y[m + i] + part * gained
    for i in range(2 * m, len(Y)):
        states[row, i] = Y[i] + part * (out[i] - Y[i])
    for j in range(n):
        output.normal[row, j] = workspace.forces[which, j]
    for a in range(2 * n):
        output.friction[row, a] = workspace.forces[which, n + a]


@routine
def _fill(row, output, step, data):
    """Fill a row of the output, by the first half of the step or the second."""
    workspace = data.workspace
    half = 0.5 * step.h
    middle = step.t + half
    if output.times[row] <= middle:
        _fill_within(row, step.t, half, data.progress.state, workspace.half, 1, output, workspace)
    else:
        _fill_within(row, middle, step.target - middle, workspace.half, workspace.end, 2, output,
                     workspace)


@helper
def _fastest(p, workspace):
    """Largest velocity of a node so far."""
    s = p.system
    n, _, m = s.rows.shape
    fastest = 0.0
    for j in range(n):
        for i in range(m):
            row = max(abs(s.rows[j, 0, i]), abs(s.rows[j, 1, i]), abs(s.rows[j, 2, i]))
            fastest = max(fastest, row * workspace.largest[m + i])
    return fastest


@routine
def _begin(t, data):
    """Put the nodes on the ground; the first step fills the first row."""
    progress, workspace = data.progress, data.workspace
    for i in range(len(workspace.largest)):
        workspace.largest[i] = abs(progress.state[i])
    _put_on_ground(t, progress.state, progress.closed, data.problem, workspace)
    progress.counts[OUTPUTS] = 0
    return RUNNING


@routine
def _attempt(step, last, smallest, data):
    """Try a step and its halves; its outcome, and the length of the next one."""
    p, limits, progress, workspace = data.problem, data.limits, data.progress, data.workspace
    Y, closed, counts = progress.state, progress.closed, progress.counts
    t, length, latest, m = step.t, step.h, step.latest, p.system.rows.shape[2]
    middle = t + 0.5 * length
    quick = _fastest(p, workspace)
    whole = _go(step, Y, closed, 0, quick, p, workspace, workspace.whole)
    first = _go(Step(t, 0.5 * length, latest, middle, False), Y, closed, 1, quick, p, workspace,
                workspace.half)
    second = -1
    if first >= 0:
        second = _go(Step(middle, 0.5 * length, latest, step.target, step.at_break),
                     workspace.half, workspace.closed[1], 2, quick, p, workspace, workspace.end)
    if whole < 0 or first < 0 or second < 0:
        return NOT_SOLVED, 0.25 * length
    struck = whole > 0 or first > 0 or second > 0
    worst = max(_error(struck, limits, workspace), _too_deep(
        min(t + length, latest), workspace.end[: 2 * m], workspace.closed[2], limits, p, workspace))
    if not worst <= 1.0:
        finite = math.isfinite(workspace.end[m])
        h = length * max(0.1, 0.8 / math.sqrt(worst)) if worst < math.inf else 0.1 * length
        return FAILED if finite else NOT_A_NUMBER, h
    counts[IMPACTS] += (first > 0) + (second > 0)
    counts[GAINED] += (first == 2) + (second == 2)
    return TAKEN, length * min(4.0, max(0.3, 0.8 / math.sqrt(max(worst, 1e-3))))


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run."""
    p, progress, workspace = data.problem, data.progress, data.workspace
    put(workspace.end, progress.state)
    put(workspace.closed[2], progress.closed)
    _put_on_ground(step.target, progress.state, progress.closed, p, workspace)
    if step.at_break:
        pass_break(step, p, progress, data.output)
    return pace(step, progress, data.output.times), h


METHOD = Method("impacts", Data, next_target, _attempt, _fill, _go_on, _begin, places=2)
run_impact_steps = step_loop(METHOD)
