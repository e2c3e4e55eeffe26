"""Compiled stages of implicit steps with set-valued friction at many nodes.

A stage asks for the velocities V of the modes at its time,

    V = V_e + g q''(t, Q_e + g V, V, R),    R_j in mu F_j Sign(v_j),

with friction as a set: R_j is the projection of ``lambda_j + r v_j`` on the limits of stick, or
the force of slip beyond them. Newton's method follows the set of sticking nodes; lambda becomes R
until nothing creeps (augmented Lagrangian). Nodes whose stick the others bring about already are
no trouble: the equations for V stay regular, and only the way in which such nodes share a force
remains open; each keeps what it carried when it came to rest, as far as its limit allows.

References
----------
P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like
solution methods, Computer Methods in Applied Mechanics and Engineering 92 (1991).
"""

import math

import numpy as np

from fecontact.core.compiled import helper
from fecontact.integrate.nonsmooth.equations import free_acceleration
from fecontact.integrate.nonsmooth.problem import (
    CREEP,
)
from fecontact.laws.signatures import friction_at, ground_at, normal_at, signal_at
from fecontact.system.kernels import node_motion

# Stiffness of what holds a sticking node during Newton's iteration, relative to its inertia.
GRIP = 1e6
ROUNDING = 2e-8
_ITERATIONS = 60
# Newton steps without shortening.
_HASTY = 8

KEPT, HESITANT, FREE = range(3)


@helper
def _linearise(
        t, Y, g, p, grip, multiplier, side, turning, force, gradients, active, balance):
    """Contact of one stage: accelerations, friction forces and rows of the Jacobian.

    Adds ``Ty F - Tx R`` to ``balance`` (m,), fills ``force`` (n,) with R, ``active`` (2, n, m)
    with rows Tx, Ty and ``gradients`` (2, n, m) with dR/dV and -dF/dV of the nodes under force.
    ``side`` (n,) is the sign of the slip of each node at the last call, zero for stick. KEPT
    nodes stay as they are; HESITANT ones that would turn their slip around are first tried as
    sticking, or the iteration would jump across stick for ever. Returns the number of nodes under
    force and the largest creep velocity of a sticking node, infinite when a node has
    changed between stick and slip.
    """
    s = p.system
    n, m = s.Tx.shape
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    count, creep = 0, 0.0
    for j in range(n):
        force[j] = 0.0
        x, height, x_rate, height_rate = node_motion(j, Y, s)
        xi = s.abscissa[j] + x - travel
        ground, slope, curvature = ground_at(s.profile)(xi, s.profile_parameters)
        slip = x_rate - speed
        F, F_u, F_v = normal_at(s.normal[j])(ground - height - s.gap[j],
                                             slope * slip - height_rate, s.normal_parameters[j])
        if F == 0.0:
            continue
        along = g * (F_u * slope + F_v * curvature * slip) + F_v * slope
        away = -g * F_u - F_v
        pressing = abs(F)
        sign = 1.0 if F >= 0.0 else -1.0
        pressing_along, pressing_away = sign * along, sign * away
        if s.friction_scale != 0:
            scale, scale_x, _ = ground_at(s.friction_scale)(xi, s.friction_scale_parameters)
            pressing_along = scale * pressing_along + g * scale_x * pressing
            pressing_away *= scale
            pressing *= scale
        limit = p.static[j] * pressing
        if p.static[j] < 0.0:
            limit = friction_at(s.friction[j])(CREEP, pressing, s.friction_parameters[j])[0]
        trial = multiplier[j] + grip[j] * slip
        turned = trial if abs(trial) > limit else 0.0
        if turning == KEPT:
            turned = side[j]
        if turned == 0.0 or (turning == HESITANT and turned * side[j] < 0.0):
            R, R_along, R_away = trial, grip[j], 0.0
            creep = max(creep, abs(slip)) if turned == side[j] == 0.0 else math.inf
            side[j] = 0.0
        else:
            sense = 1.0 if turned > 0.0 else -1.0
            if side[j] != sense:
                creep = math.inf
            side[j] = sense
            R, R_v, R_F = friction_at(s.friction[j])(sense * max(sense * slip, CREEP), pressing,
                                                     s.friction_parameters[j])
            if sense * slip < 0.0:
                creep = max(creep, abs(slip))
                R_v = 0.0
            R_along, R_away = R_v + R_F * pressing_along, R_F * pressing_away
        force[j] = R
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            balance[i] += ty * F - tx * R
            active[0, count, i], active[1, count, i] = tx, ty
            gradients[0, count, i] = R_along * tx + R_away * ty
            gradients[1, count, i] = -along * tx - away * ty
        count += 1
    return count, creep


@helper
def _residual(
        t, g, start, known, Y, p, grip, multiplier, side, turning, force, room, balance,
        residual):
    """What is left of the equations of a stage, with places and contact at the velocities in Y."""
    m = len(start)
    for i in range(m):
        Y[i] = start[i] + g * Y[m + i]
    free_acceleration(t, Y, p.system, balance)
    count, creep = _linearise(t, Y, g, p, grip, multiplier, side, turning, force, room[:2],
                              room[2:], balance)
    for i in range(m):
        residual[i] = known[i] + g * balance[i] - Y[m + i]
    return count, creep


@helper
def solve_stage(
        t, g, start, known, Y, p, grip, multiplier, side, force, room, linear,
        system_matrix, floor, rtol, finest):
    """Solve one stage for the velocities, Y[m : 2 m]; returns whether that succeeded.

    ``start`` and ``known`` (m,) are Q_e and V_e, ``linear`` is 1 + g C + g^2 K. With given normal
    forces the equations are those of a convex minimum: when the sticking set is not found at
    once, each Newton step is shortened to where the minimum along it lies.
    """
    m = len(start)
    balance, residual = np.empty(m), np.empty(m)
    turning = KEPT
    for iteration in range(_ITERATIONS):
        count, _ = _residual(t, g, start, known, Y, p, grip, multiplier, side, turning, force,
                             room, balance, residual)
        turning = HESITANT if iteration < _HASTY else FREE
        system_matrix[:] = linear
        if count:
            Tx, Ty = room[2, :count].T, room[3, :count].T
            system_matrix += g * (np.dot(Tx, room[0, :count]) + np.dot(Ty, room[1, :count]))
        for i in range(m):
            if not math.isfinite(residual[i]):
                return False
        change = np.linalg.solve(system_matrix, residual)
        moved, downhill = 0.0, 0.0
        for i in range(m):
            downhill += residual[i] * change[i]
            Y[m + i] += change[i]
            moved = max(moved, abs(change[i]) / (rtol * (floor[m + i] + abs(Y[m + i]))))
        if moved <= 1e-2:
            _, creep = _residual(t, g, start, known, Y, p, grip, multiplier, side, turning, force,
                                 room, balance, residual)
            if creep <= finest:
                return True
            if creep < math.inf:
                # The creep belongs to the old multiplier and must not count again with the new.
                multiplier[:] = force
                turning = KEPT
        elif turning == FREE:
            low, high, part = 0.0, 1.0, 1.0
            for _ in range(40):
                _residual(t, g, start, known, Y, p, grip, multiplier, side, FREE, force, room,
                          balance, residual)
                uphill = 0.0
                for i in range(m):
                    uphill -= residual[i] * change[i]
                if abs(uphill) <= 0.1 * abs(downhill) or (part == 1.0 and uphill < 0.0):
                    break
                if uphill > 0.0:
                    high = part
                else:
                    low = part
                middle = 0.5 * (low + high)
                for i in range(m):
                    Y[m + i] += (middle - part) * change[i]
                part = middle
    return False
