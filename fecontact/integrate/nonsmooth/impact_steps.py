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
order, and 0 at others. Closed contacts beside the one that is struck take part, and nodes need not
be independent: what counts are the velocities. The impulses of all nodes are found by projected
Gauss-Seidel sweeps; at unilateral contact without friction these minimise the kinetic energy.

A step is compared with two of half its length, which are kept: to the tolerance in its places, and
without impact in its velocities too; nor may a node come deeper into the ground. Across impacts and
transitions the scheme is of first order. Nodes that touch are put back on the ground after each
step.

References
----------
J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM Courses and
Lectures 302 (1988). M. Jean, The non-smooth contact dynamics method, Computer Methods in Applied
Mechanics and Engineering 177 (1999).
"""

import math
from typing import NamedTuple

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import solve
from fecontact.integrate.nonsmooth.equations import stick_limit
from fecontact.integrate.nonsmooth.problem import (
    GAINED,
    IMPACTS,
    Limits,
    NonsmoothProblem,
    Output,
    Progress,
    Step,
    next_target,
    pace,
    pass_break,
)
from fecontact.integrate.nonsmooth.space_impulses import (
    ImpactWorkspace,
    find_impulses,
    put_on_ground,
    set_impulse_responses,
    set_matrix,
    set_rows,
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
from fecontact.laws.friction_curve import CREEP
from fecontact.system.kernels import body_acceleration, prescribed_at
from fecontact.system.node_forces import friction_scale, plane_friction
from fecontact.system.nodes import ground_motion, ground_speed, node_contact, node_motion
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


class Data(NamedTuple):
    """A run of a solid at rigid stops."""

    problem: NonsmoothProblem
    limits: Limits
    progress: Progress
    output: Output
    kept: Output
    workspace: ImpactWorkspace


@helper
def _coefficient(j, slip, grip, p):
    """Coefficient of friction of node j at a slip velocity."""
    s = p.system
    return plane_friction(j, max(slip, CREEP), grip, s)[0]


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
        fresh = _coefficient(j, slip, workspace.grip[j], p)
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
        set_rows(j, contact, p, workspace)
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
        workspace.slipping[j] = _coefficient(j, slip, workspace.grip[j], p)
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
    set_matrix(h, p, workspace)
    solve(workspace.matrix, workspace.pivots, change)
    for i in range(m):
        change[i] = Y[m + i] + h * change[i]
    struck = _observe_nodes(at, Y, closed, quick, p, workspace)
    workspace.impulses[:] = 0.0
    if workspace.touching.any():
        set_impulse_responses(p, workspace)
        if not find_impulses(p.restitution, n, workspace):
            return -1
        for _ in range(_PASSES):
            if struck or not _look_again(n, p, workspace):
                break
            if not find_impulses(p.restitution, n, workspace):
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
    put_on_ground(t, progress.state, progress.closed, data.problem, workspace)
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
    put_on_ground(step.target, progress.state, progress.closed, p, workspace)
    if step.at_break:
        pass_break(step, p, progress, data.output)
    return pace(step, progress, data.output.times), h


METHOD = Method("impacts", Data, next_target, _attempt, _fill, _go_on, _begin, places=2)
run_impact_steps = step_loop(METHOD)
