r"""Compiled impulses of all touching nodes of solids in one step, and where they are put.

With normal impulses L and tangential ones P, which act against slip, heights above the ground g and
slip velocities s, primed after the step,

.. math::

    0 \le L_j \perp g_j'^+ - e \max(-g_j'^-, 0) \ge 0, \qquad
    P_j \in \mu_j L_j\, e(s_j^+ + \kappa_j s_j^-)

The tangential impulse lies in a disc and acts against what it has left of the slip: no other in
the disc takes more energy. Projected Gauss-Seidel sweeps over the nodes find the impulses; they
stop where nothing changes. Nodes need not be independent: then the velocities are found, and one
of the ways in which the nodes share the impulses.

References
----------
P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like
solution methods, Computer Methods in Applied Mechanics and Engineering 92 (1991). M. Jean, The
non-smooth contact dynamics method, Computer Methods in Applied Mechanics and Engineering 177
(1999).
"""

import math
from typing import Annotated, NamedTuple

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.types import Array, Integers
from fecontact.integrate.nonsmooth.problem import WITH_WORK
from fecontact.system.nodes import MODES, NODES, ground_motion, node_contact, node_motion
from fecontact.system.powers import POWER_COUNT

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
def set_matrix(h, p, workspace):
    """Factorise the matrix of a step."""
    s, linear = p.system, workspace.matrix
    for i in range(len(linear)):
        for k in range(len(linear)):
            linear[i, k] = 0.5 * h * s.damping[i, k] + 0.25 * h * h * s.stiffness[i, k]
        linear[i, i] += 1.0
    factorise(linear, len(linear), workspace.pivots)


@helper
def set_rows(j, contact, p, workspace):
    """Fill the rows of node j: how modes change its height over the ground and its place."""
    s, rows = p.system, workspace.rows
    n, _, m = s.rows.shape
    for i in range(m):
        rows[j, i] = (s.rows[j, 1, i] - contact.slope[0] * s.rows[j, 0, i]
                      - contact.slope[1] * s.rows[j, 2, i])
        rows[n + j, i], rows[2 * n + j, i] = s.rows[j, 0, i], s.rows[j, 2, i]


@routine
def set_impulse_responses(p, workspace):
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
def find_impulses(restitution, n, workspace):
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
def put_on_ground(t, Y, closed, p, workspace):
    """Move closed nodes, and nodes in the ground, to where they just touch it."""
    s, middle, x = p.system, workspace.middle, workspace.impulses
    n, _, m = s.rows.shape
    moved = ground_motion(t, s)
    margin = 0.0
    for i in range(m):
        for j in range(n):
            margin = max(margin, _MARGIN * abs(s.rows[j, 1, i]) * workspace.largest[i])
    put(Y[: 2 * m], middle)
    workspace.matrix[:] = 0.0
    for i in range(m):
        workspace.matrix[i, i] = 1.0
    factorise(workspace.matrix, m, workspace.pivots)
    deepest = 0.0
    for j in range(n):
        contact = node_contact(j, node_motion(j, middle, s), moved, s)
        workspace.touching[j] = 1 if closed[j] or contact.penetration > margin else 0
        set_rows(j, contact, p, workspace)
        workspace.rest[j] = margin - contact.penetration
        if workspace.touching[j]:
            deepest = max(deepest, abs(workspace.rest[j]))
    x[:] = 0.0
    if deepest <= margin:
        return
    set_impulse_responses(p, workspace)
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
