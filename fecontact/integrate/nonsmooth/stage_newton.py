"""Compiled stages of implicit steps with set-valued friction at many nodes.

A stage asks for the velocities V of the modes at its time,

    V = V_e + g q''(t, Q_e + g V, V, R),    R_j in mu F_j Sign(v_j),

with friction as a set: R_j is the projection of ``lambda_j + r v_j`` on the limits of stick, or
the force of slip beyond them. Newton's method follows the set of sticking nodes; lambda becomes R
until nothing creeps (augmented Lagrangian). Nodes whose stick the others bring about already are
no trouble: the equations for V stay regular, and only the way in which such nodes share a force
remains open; each keeps what it carried when it came to rest, as far as its limit allows.

In space R_j and v_j are vectors, see :mod:`fecontact.integrate.nonsmooth.space_contact`.

References
----------
P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like
solution methods, Computer Methods in Applied Mechanics and Engineering 92 (1991).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper
from fecontact.core.records import Block, Matrix, Vector
from fecontact.integrate.nonsmooth.equations import free_acceleration, stick_limit
from fecontact.integrate.nonsmooth.problem import CREEP, NonsmoothProblem
from fecontact.system.node_forces import normal_gradients, plane_friction, tangent_force
from fecontact.system.nodes import GroundMotion, node_contact, node_motion
from fecontact.system.polynomial_forces import (
    add_polynomial_stiffness,
    has_polynomial,
    set_polynomial_gradient,
)

# Stiffness that holds a sticking node during Newton's iteration, relative to its inertia.
GRIP = 1e6
ROUNDING = 2e-8
_ITERATIONS = 60
# Newton steps without shortening.
_HASTY = 8

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
    of all second components, the latter of length one in slip, and ``linearise`` is the address of
    :data:`fecontact.integrate.nonsmooth.space_contact.linearise_in_space`.
    """

    grip: Vector
    multiplier: Vector
    side: Vector
    linearise: int


class NewtonRoom(NamedTuple):
    """Workspace of Newton's method.

    Rows ``active`` (n, d, m) of the nodes under force, and their ``gradients`` (n, d, m), minus
    the derivatives of the forces along the axes to V;
    ``partial`` (d + 1, 2 d) of one node; ``linear`` (m, m) is 1 + g C + g^2 K, ``matrix`` the whole
    matrix; ``balance`` and ``residual`` (m,); ``polynomial`` (D, m) is G of
    :mod:`fecontact.system.polynomial_forces` where the matrix was made last.
    """

    gradients: Block
    active: Block
    partial: Matrix
    linear: Matrix
    matrix: Matrix
    balance: Vector
    residual: Vector
    polynomial: Matrix


# Evaluates the contact of a stage in space: number of nodes under force, and creep velocity.
LINEARISE = Callable[[
    Stage, GroundMotion, NonsmoothProblem, Hold, int, NewtonRoom, Vector,
], tuple[float, float]]
_linearise_at = function_at(LINEARISE)


def newton_room_for(
    nodes: int, modes: int, tangents: int = 1, combinations: int = 0
) -> NewtonRoom:
    """Workspace for so many nodes and modes, and combinations D of polynomial forces."""
    linear, whole = np.zeros((2, modes, modes))
    balance, residual = np.zeros((2, modes))
    gradients, active = np.zeros((2, nodes, 1 + tangents, modes))
    partial = np.zeros((2 + tangents, 2 * (1 + tangents)))
    return NewtonRoom(gradients, active, partial, linear, whole, balance, residual,
                      np.zeros((combinations, modes)))


@helper
def _linearise(stage, moved, p, hold, turning, room, force):
    """Contact of one stage: accelerations, friction forces and rows of the Jacobian.

    Adds modal contact forces to ``room.balance``, fills ``force`` (n,) with R, and ``active`` and
    ``gradients`` of the room. KEPT nodes stay on their side; HESITANT ones that would turn their
    slip around are first tried as sticking, or the iteration would jump across stick for ever.
    Returns the number of nodes under force and the largest creep velocity of a sticking node,
    infinite when a node has changed between stick and slip.
    """
    s, g, side, partial = p.system, stage.g, hold.side, room.partial
    n, _, m = s.rows.shape
    count, creep = 0, 0.0
    for j in range(n):
        force[j] = 0.0
        contact = node_contact(j, node_motion(j, stage.Y, s), moved, s)
        F, pressing = normal_gradients(j, contact, s, partial)
        if F == 0.0:
            continue
        slip = contact.slip[0]
        along, away = g * partial[1, 0] + partial[1, 2], g * partial[1, 1] + partial[1, 3]
        limit = stick_limit(j, pressing, p)
        trial = hold.multiplier[j] + hold.grip[j] * slip
        turned = trial if abs(trial) > limit else 0.0
        if turning == KEPT:
            turned = side[j]
        if turned == 0.0 or (turning == HESITANT and turned * side[j] < 0.0):
            R, R_along, R_away = trial, hold.grip[j], 0.0
            creep = max(creep, abs(slip)) if turned == side[j] == 0.0 else math.inf
            side[j] = 0.0
        else:
            sense = 1.0 if turned > 0.0 else -1.0
            if side[j] != sense:
                creep = math.inf
            side[j] = sense
            R, R_v, R_F = plane_friction(j, sense * max(sense * slip, CREEP), pressing, s)
            if sense * slip < 0.0:
                creep = max(creep, abs(slip))
                R_v = 0.0
            R_along = R_v + R_F * (g * partial[2, 0] + partial[2, 2])
            R_away = R_F * (g * partial[2, 1] + partial[2, 3])
        force[j] = R
        slope = contact.slope[0]
        T = tangent_force(F, R, slope, s)
        if s.follows_surface:
            R_along += slope * along + g * F * contact.curvature[0][0]
            R_away += slope * away
        for i in range(m):
            tx, ty = s.rows[j, 0, i], s.rows[j, 1, i]
            room.balance[i] += ty * F - tx * T
            room.active[count, 0, i], room.active[count, 1, i] = tx, ty
            room.gradients[count, 0, i] = R_along * tx + R_away * ty
            room.gradients[count, 1, i] = -along * tx - away * ty
        count += 1
    return count, creep


@helper
def _evaluate(stage, p, hold, turning, room, force):
    """Fill ``room.residual`` and ``room.balance`` for the velocities in Y, and the places there."""
    Y, m = stage.Y, len(stage.start)
    for i in range(m):
        Y[i] = stage.start[i] + stage.g * Y[m + i]
    moved = free_acceleration(stage.t, Y, p.system, room.balance)
    if p.system.rows.shape[1] > 2:
        found, creep = _linearise_at(hold.linearise)(stage, moved, p, hold, turning, room, force)
        count = int(found)
    else:
        count, creep = _linearise(stage, moved, p, hold, turning, room, force)
    for i in range(m):
        room.residual[i] = stage.known[i] + stage.g * room.balance[i] - Y[m + i]
    return count, creep


@helper
def _shorten(stage, p, hold, change, downhill, room, force):
    """Shorten a Newton step to where the minimum along it lies; ``downhill`` is its slope."""
    m = len(stage.start)
    low, high, part = 0.0, 1.0, 1.0
    for _ in range(40):
        _evaluate(stage, p, hold, FREE, room, force)
        uphill = 0.0
        for i in range(m):
            uphill -= room.residual[i] * change[i]
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


@helper
def solve_stage(stage, p, hold, limits, finest, room, force):
    """Solve one stage for the velocities, Y[m : 2 m]; returns whether that succeeded.

    A sticking node may creep at ``finest``. With given normal forces the equations are those of a
    convex minimum: when the sticking set is not found at once, each Newton step is shortened to
    where the minimum along it lies.
    """
    Y, m, floor, whole = stage.Y, len(stage.start), limits.floor, room.matrix
    turning = KEPT
    for iteration in range(_ITERATIONS):
        count, _ = _evaluate(stage, p, hold, turning, room, force)
        turning = HESITANT if iteration < _HASTY else FREE
        whole[:] = room.linear
        if has_polynomial(p.system):
            set_polynomial_gradient(Y, p.system, room.polynomial)
            add_polynomial_stiffness(stage.g * stage.g, room.polynomial, p.system, whole)
        if count:
            size = count * room.active.shape[1]
            whole += stage.g * np.dot(room.active[:count].reshape((size, m)).T,
                                      room.gradients[:count].reshape((size, m)))
        for i in range(m):
            if not math.isfinite(room.residual[i]):
                return False
        change = np.linalg.solve(whole, room.residual)
        moved, downhill = 0.0, 0.0
        for i in range(m):
            downhill += room.residual[i] * change[i]
            Y[m + i] += change[i]
            moved = max(moved, abs(change[i]) / (limits.rtol * (floor[m + i] + abs(Y[m + i]))))
        if moved <= 1e-2:
            _, creep = _evaluate(stage, p, hold, turning, room, force)
            if creep <= finest:
                return True
            if creep < math.inf:
                # The creep belongs to the old multiplier and must not count again with the new.
                hold.multiplier[:] = force
                turning = KEPT
        elif turning == FREE:
            _shorten(stage, p, hold, change, downhill, room, force)
    return False
