"""Compiled stages of implicit steps with set-valued friction at many nodes.

A stage asks for the velocities V of the modes at its time,

    V = V_e + g q''(t, Q_e + g V, V, R),    R_j in mu F_j Sign(v_j),

with friction as a set: R_j is the projection of ``lambda_j + r v_j`` on the limits of stick, or
the force of slip beyond them. Newton's method follows the set of sticking nodes; lambda becomes R
until nothing creeps (augmented Lagrangian). Nodes whose stick the others bring about already are
no trouble: the equations for V stay regular, and only the way in which such nodes share a force
remains open; each keeps what it carried when it came to rest, as far as its limit allows.

In space R_j and v_j are vectors along both tangents,

    |R| <= mu(0+) F  where v = 0,    R = mu(|v|) F v / |v|  else,

and R is the projection of ``lambda + r v`` on the disc of stick, or beyond it the force of slip in
its direction e. Once lambda has become R, e is the direction of v.

References
----------
P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like
solution methods, Computer Methods in Applied Mechanics and Engineering 92 (1991).
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put, put_rows
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import Vector
from fecontact.core.types import Array, Integers
from fecontact.integrate.nonsmooth.equations import stick_limit
from fecontact.laws.friction_curve import CREEP
from fecontact.system.kernels import body_acceleration, prescribed_at
from fecontact.system.node_forces import (
    NodeForces,
    friction_along,
    normal_gradients,
    tangent_force,
)
from fecontact.system.nodes import (
    AXES,
    COMBINATIONS,
    MODES,
    NODES,
    node_contact,
    node_motion,
    size_of,
)
from fecontact.system.polynomial_forces import (
    add_polynomial_stiffness,
    has_polynomial,
    set_polynomial_gradient,
)

_ITERATIONS = 60
# Newton steps without shortening.
_HASTY = 8

# So few modes are multiplied without BLAS.
_FEW = 6

KEPT, HESITANT, FREE = range(3)


class Stage(NamedTuple):
    """The equations of a stage, ``V = known + g q''(t, start + g V, V, R)``.

    ``start`` and ``known`` (m,) are Q_e and V_e; Y (2 m,) is the state at the stage.
    """

    t: float
    g: float
    start: Vector
    known: Vector
    Y: Vector


class Hold(NamedTuple):
    """Variables of the augmented Lagrangian that hold the nodes (n,) in stick.

    ``grip`` is r, ``multiplier`` is lambda, and ``side`` the sign of the slip of each node at the
    last evaluation, zero for stick. In space the last two are vectors (2 n,), of all first and then
    of all second components, the latter of length one in slip.
    """

    grip: Annotated[Array, NODES]
    multiplier: Annotated[Array, (AXES - 1) * NODES]
    side: Annotated[Array, (AXES - 1) * NODES]


class NewtonWorkspace(NamedTuple):
    """Workspace of Newton's method.

    The ``nodes`` (n,) under force come first. Their ``jacobians`` (n, d, d) are -g times the
    derivatives of the forces along the axes to the velocities there, ``active`` (n, d, m) are their
    rows, and ``gradients`` (n, d, m) the products of both;
    ``partial`` (d + 1, 2 d) is of one node; ``linear`` (m, m) is
    1 + g C + g^2 K, ``matrix`` the factors of the whole matrix with their ``pivots`` (m,);
    ``prescribed`` (m,) are the modal forces given in time, ``balance`` all of them; ``residual``
    and ``change`` (m,) are of the velocities; ``polynomial`` (D, m) is G of
    :mod:`fecontact.system.polynomial_forces` where the matrix was made last.
    """

    nodes: Annotated[Integers, NODES]
    jacobians: Annotated[Array, NODES, AXES, AXES]
    partial: Annotated[Array, AXES + 1, 2 * AXES]
    active: Annotated[Array, NODES, AXES, MODES]
    gradients: Annotated[Array, NODES, AXES, MODES]
    linear: Annotated[Array, MODES, MODES]
    matrix: Annotated[Array, MODES, MODES]
    pivots: Annotated[Integers, MODES]
    prescribed: Annotated[Array, MODES]
    balance: Annotated[Array, MODES]
    residual: Annotated[Array, MODES]
    change: Annotated[Array, MODES]
    polynomial: Annotated[Array, COMBINATIONS, MODES]


@helper
def along_tangents(values, j, n):
    """Entries of node j in an array (n,), in space (2 n,), along the tangents."""
    return values[j], values[n + j] if len(values) > n else 0.0


@helper
def _set_friction(j, node, p, hold, turning, partial, force):
    """Fill ``force`` and ``hold.side`` of node j; returns its creep velocity.

    Fills rows 0 and 2 of ``partial`` (d + 1, 2 d) with the derivatives of the friction force to V
    along the axes, by those of the pressing force in its row d. The creep velocity is one that
    there must not be: of a sticking node, or of slip athwart its friction; infinite when the node
    has changed between stick and slip.
    """
    s, side, slip, pressing = p.system, hold.side, node.contact.slip, node.pressing
    n, d, _ = s.rows.shape
    grip, limit = hold.grip[j], stick_limit(j, pressing, p)
    for k in range(d - 1):
        force[k * n + j] = hold.multiplier[k * n + j] + grip * slip[k]
    trial, before = along_tangents(force, j, n), along_tangents(side, j, n)
    size, on = size_of(trial), trial[0] * before[0] + trial[1] * before[1]
    stuck = before[0] == 0.0 and before[1] == 0.0
    sticks = size <= limit
    if turning == KEPT:
        sticks = stuck
    elif turning == HESITANT and on < 0.0:
        sticks = True
    if sticks:
        for k in range(d - 1):
            side[k * n + j] = 0.0
            for axis in range(d):
                partial[2 * k, axis] = grip if axis == 2 * k else 0.0
        return size_of(slip) if stuck else math.inf
    e, turns = before, size > 0.0 and (turning != KEPT or on > 0.0)
    if turns:
        e = (trial[0] / size, trial[1] / size)
    creep = math.inf if before[0] * e[0] + before[1] * e[1] <= 0.0 else 0.0
    speed = e[0] * slip[0] + e[1] * slip[1]
    R, R_v, R_F = friction_along(j, e, max(speed, CREEP), pressing, s)
    if speed < 0.0:
        creep = max(creep, size_of(slip))
        R_v = 0.0
    # Slip too slow to turn the trial force ends before its direction matters.
    if grip * speed > limit:
        creep = max(creep, abs(e[0] * slip[1] - e[1] * slip[0]))
    # The force of slip turns with the trial force.
    around = R * grip / size if turns and d > 2 else 0.0
    for k in range(d - 1):
        side[k * n + j], force[k * n + j] = e[k], R * e[k]
        for axis in range(d):
            partial[2 * k, axis] = R_F * e[k] * partial[d, axis]
        for other in range(d - 1):
            partial[2 * k, 2 * other] += (R_v - around) * e[k] * e[other]
        partial[2 * k, 2 * k] += around
    return creep


@routine
def _linearise(stage, moved, p, hold, turning, workspace, force):
    """Contact of one stage: accelerations, friction forces and their derivatives.

    Adds modal contact forces to ``workspace.balance``, fills ``force`` (n,), in space (2 n,), with
    R, and ``nodes`` and ``jacobians`` of the workspace. KEPT nodes stay on their side; HESITANT
    ones that would turn their slip around are first tried as sticking, or the iteration would jump
    across stick for ever. Returns the number of nodes under force and the largest creep velocity.
    """
    s, g, partial = p.system, stage.g, workspace.partial
    n, d, m = s.rows.shape
    count, creep = 0, 0.0
    for j in range(n):
        for k in range(d - 1):
            force[k * n + j] = 0.0
        contact = node_contact(j, node_motion(j, stage.Y, s), moved, s)
        F, pressing = normal_gradients(j, contact, s, partial)
        if F == 0.0:
            continue
        for row in (1, d):
            for axis in range(d):
                partial[row, axis] = g * partial[row, axis] + partial[row, d + axis]
        node = NodeForces(F, pressing, contact)
        creep = max(creep, _set_friction(j, node, p, hold, turning, partial, force))
        for k in range(d - 1):
            if s.follows_surface:
                for axis in range(d):
                    partial[2 * k, axis] += contact.slope[k] * partial[1, axis]
                for other in range(d - 1):
                    partial[2 * k, 2 * other] += g * F * contact.curvature[k][other]
        for axis in range(d):
            push, factor = F, -g
            if axis != 1:
                k, factor = axis // 2, g
                push = -tangent_force(F, force[k * n + j], contact.slope[k], s)
            for other in range(d):
                workspace.jacobians[count, axis, other] = factor * partial[axis, other]
            for i in range(m):
                workspace.balance[i] += s.rows[j, axis, i] * push
        workspace.nodes[count] = j
        count += 1
    return count, creep


@helper
def _set_gradients(count, s, workspace):
    """Fill ``active`` and ``gradients`` of the first of ``workspace.nodes``."""
    _, d, m = s.rows.shape
    for at in range(count):
        j, jacobian = workspace.nodes[at], workspace.jacobians[at]
        for axis in range(d):
            for i in range(m):
                total = 0.0
                for other in range(d):
                    total += jacobian[axis, other] * s.rows[j, other, i]
                workspace.active[at, axis, i] = s.rows[j, axis, i]
                workspace.gradients[at, axis, i] = total


@routine
def _set_matrix(count, s, workspace):
    """Fill ``workspace.matrix`` by the ``linear`` one and the ``jacobians`` of so many nodes."""
    _, d, m = s.rows.shape
    active, gradients, whole = workspace.active, workspace.gradients, workspace.matrix
    # Twice, because loops over axes are written out where their number is known.
    if d == 2 or d == 3:
        _set_gradients(count, s, workspace)
    put_rows(workspace.linear, whole)
    if m > _FEW and count > 0:
        size = count * d
        whole += np.dot(active[:count].reshape((size, m)).T,
                        gradients[:count].reshape((size, m)))
        return
    for at in range(count):
        for axis in range(d):
            for i in range(m):
                for k in range(m):
                    whole[i, k] += active[at, axis, i] * gradients[at, axis, k]


@routine
def _evaluate(stage, moved, p, hold, turning, workspace, force):
    """Fill ``residual`` and ``balance`` of the workspace for the velocities Y, and the places.

    ``moved`` is the motion of the ground at the stage.
    """
    Y, m = stage.Y, len(stage.start)
    for i in range(m):
        Y[i] = stage.start[i] + stage.g * Y[m + i]
    body_acceleration(workspace.prescribed, Y, p.system, workspace.balance)
    count, creep = 0, 0.0
    # Twice, because loops over axes are written out where their number is known.
    if p.system.rows.shape[1] == 2 or p.system.rows.shape[1] == 3:
        count, creep = _linearise(stage, moved, p, hold, turning, workspace, force)
    for i in range(m):
        workspace.residual[i] = stage.known[i] + stage.g * workspace.balance[i] - Y[m + i]
    return count, creep


@routine
def _shorten(stage, moved, p, hold, downhill, workspace, force):
    """Shorten a Newton step to where the minimum along it lies; ``downhill`` is its slope."""
    m, change = len(stage.start), workspace.change
    low, high, part = 0.0, 1.0, 1.0
    for _ in range(40):
        _evaluate(stage, moved, p, hold, FREE, workspace, force)
        uphill = 0.0
        for i in range(m):
            uphill -= workspace.residual[i] * change[i]
        if abs(uphill) <= 0.1 * abs(downhill) or (part == 1.0 and uphill < 0.0):
            break
        if uphill > 0.0:
            high = part
        else:
            low = part
        middle = 0.5 * (low + high)
        for i in range(m):
            stage.Y[m + i] += (middle - part) * change[i]
        part = middle


@routine
def solve_stage(stage, p, hold, limits, finest, workspace, force):
    """Solve one stage for the velocities, Y[m : 2 m]; returns whether that succeeded.

    A sticking node may creep at ``finest``. With given normal forces the equations are those of a
    convex minimum: when the sticking set is not found at once, each Newton step is shortened to
    where the minimum along it lies.
    """
    Y, m, floor = stage.Y, len(stage.start), limits.floor
    whole, change = workspace.matrix, workspace.change
    moved = prescribed_at(stage.t, p.system, workspace.prescribed)
    turning = KEPT
    for iteration in range(_ITERATIONS):
        count, _ = _evaluate(stage, moved, p, hold, turning, workspace, force)
        turning = HESITANT if iteration < _HASTY else FREE
        _set_matrix(count, p.system, workspace)
        if has_polynomial(p.system):
            set_polynomial_gradient(Y, p.system, workspace.polynomial)
            add_polynomial_stiffness(stage.g * stage.g, workspace.polynomial, p.system, whole)
        for i in range(m):
            if not math.isfinite(workspace.residual[i]):
                return False
            change[i] = workspace.residual[i]
        factorise(whole, m, workspace.pivots)
        solve(whole, workspace.pivots, change)
        largest, downhill = 0.0, 0.0
        for i in range(m):
            downhill += workspace.residual[i] * change[i]
            Y[m + i] += change[i]
            largest = max(largest, abs(change[i]) / (limits.rtol * (floor[m + i] + abs(Y[m + i]))))
        if largest <= 1e-2:
            _, creep = _evaluate(stage, moved, p, hold, turning, workspace, force)
            if creep <= finest:
                return True
            if creep < math.inf:
                # The creep belongs to the old multiplier and must not count again with the new.
                put(force, hold.multiplier)
                turning = KEPT
        elif turning == FREE:
            _shorten(stage, moved, p, hold, downhill, workspace, force)
    return False
