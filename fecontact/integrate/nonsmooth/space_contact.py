r"""Compiled contact of solids for implicit steps, with friction as a set: a disc in two directions.

Per node, with slip velocity v and friction force R against it, both vectors along the tangents,

    |R| <= mu(0+) F  where v = 0,    R = mu(|v|) F v / |v|  else.

In a stage R is the projection of ``lambda + r v`` on the disc of stick, or beyond it the force of
slip in its direction e. Once lambda has become R, e is the direction of v. Along a straight path
all this is what :mod:`fecontact.integrate.nonsmooth.stage_newton` does in the plane.

Plane bodies need none of it; it is called by its address.
"""

import math

from fecontact.core.compiled import compile_law, helper
from fecontact.integrate.bernstein import NOWHERE, first_below
from fecontact.integrate.nonsmooth.equations import stick_limit
from fecontact.integrate.nonsmooth.problem import (
    CREEP,
    CURVED,
    FORCE,
    GRIP,
    LIMIT,
    PENETRATION,
    PRESSING,
    RATE,
    SLIP,
    SLIP_ACROSS,
    SLOPE,
    SLOPE_ACROSS,
)
from fecontact.integrate.nonsmooth.stage_newton import GRIP as STIFFEST
from fecontact.integrate.nonsmooth.stage_newton import HESITANT, KEPT, LINEARISE
from fecontact.integrate.nonsmooth.stepping_room import (
    OBSERVE,
    POWERS,
    SLIPS_BACK,
    STAGES,
    THIRDS,
    InSpace,
)
from fecontact.system.node_forces import (
    normal_force,
    normal_gradients,
    plane_friction,
    pressing_force,
    tangent_force,
)
from fecontact.system.nodes import ground_motion, ground_speed, node_contact, node_motion
from fecontact.system.powers import (
    BELT_FRICTION,
    BELT_NORMAL,
    CONTACT_DAMPING,
    FRICTION,
    POWER_COUNT,
    belt_normal_power,
)

# Part of the softness against rounding that is enough for a node in space.
_FINER = 1e-4


@helper
def contact_of(j, Y, moved, s):
    """Contact kinematics of node j in the state Y."""
    return node_contact(j, node_motion(j, Y, s), moved, s)


def _observe(moved, Y, p, nodes):
    """Fill ``nodes`` from the positions and velocities in Y."""
    s = p.system
    for j in range(len(nodes)):
        contact = contact_of(j, Y, moved, s)
        force = normal_force(j, contact.penetration, contact.rate, s)[0]
        pressing = pressing_force(j, contact, force, s)
        nodes[j, FORCE], nodes[j, PRESSING] = force, pressing
        nodes[j, LIMIT] = stick_limit(j, pressing, p) if pressing > 0.0 else 0.0
        nodes[j, PENETRATION], nodes[j, RATE] = contact.penetration, contact.rate
        nodes[j, SLIP], nodes[j, SLIP_ACROSS] = contact.slip[0], contact.slip[1]
        nodes[j, SLOPE], nodes[j, SLOPE_ACROSS] = contact.slope[0], contact.slope[1]
        nodes[j, CURVED], nodes[j, GRIP] = 0.0, 0.0


def _contact_powers(moved, p, nodes, friction, out):
    """Add the powers at the nodes to out (p,) and put those of friction behind them (n,)."""
    s, n = p.system, len(nodes)
    for j in range(n):
        force, rubbed = nodes[j, FORCE], 0.0
        for tangent in range(2):
            speed, R = ground_speed(tangent, j, moved, s), friction[tangent * n + j]
            slope, slip = (nodes[j, SLOPE_ACROSS if tangent else SLOPE],
                           nodes[j, SLIP_ACROSS if tangent else SLIP])
            out[BELT_NORMAL] += belt_normal_power(force, slope, slip, speed, s)
            out[BELT_FRICTION] -= R * speed
            rubbed += R * slip
        # Damping may bring the force to zero while the spring is still compressed.
        stored = normal_force(j, nodes[j, PENETRATION], 0.0, s)[0]
        out[CONTACT_DAMPING] += (force - stored) * nodes[j, RATE]
        out[POWER_COUNT + j] = rubbed
        out[FRICTION] += rubbed


def _slips_back(j, step, p, w, tolerance, room):
    """Part of a step at which node j slips back between ends with slip of one sense; or 1.

    Along the direction of the slip at the begin.
    """
    s, b, old, h = p.system, room.cubic, room.old, step.h
    first = math.hypot(old[j, SLIP], old[j, SLIP_ACROSS])
    if old[j, FORCE] == 0.0 or w.nodes[j, FORCE] == 0.0 or first <= tolerance:
        return 1.0
    e1, e2 = old[j, SLIP] / first, old[j, SLIP_ACROSS] / first
    last = e1 * w.nodes[j, SLIP] + e2 * w.nodes[j, SLIP_ACROSS]
    if last <= tolerance:
        return 1.0
    speed = room.speed
    speed[:] = 0.0
    for k in range(4):
        moved = ground_motion(step.t + h * k / 3.0, s)
        side = e1 * ground_speed(0, j, moved, s) + e2 * ground_speed(1, j, moved, s)
        for i in range(4):
            speed[i] += THIRDS[i, k] * side
    rise, fall = 0.0, 0.0
    for i in range(s.rows.shape[2]):
        row = e1 * s.rows[j, 0, i] + e2 * s.rows[j, 2, i]
        rise += row * room.before[i]
        fall += row * room.accelerations[STAGES - 1, i]
    b[0], b[3] = first + speed[0], last + speed[3]
    b[1], b[2] = b[0] + h * rise / 3.0, b[3] - h * fall / 3.0
    for i in range(4):
        b[i] += tolerance - speed[i]
    back = first_below(b, room.halves)
    if back == NOWHERE:
        return 1.0
    b[0], b[1], b[2], b[3] = b[3], b[2], b[1], b[0]
    return 0.5 * (back + 1.0 - first_below(b, room.halves))


@helper
def _grip(j, g, hold, s):
    """Parameter r of node j in stick, larger than in the plane where rounding limits it.

    Across a fast belt slip velocities are small, and nodes must come to rest in shorter steps.
    """
    along, across = 0.0, 0.0
    for i in range(s.rows.shape[2]):
        along += s.rows[j, 0, i] * s.rows[j, 0, i]
        across += s.rows[j, 2, i] * s.rows[j, 2, i]
    if hold.grip[j] == 0.0:
        return 0.0
    softest = max(along, across) * g / STIFFEST
    return 1.0 / (softest + _FINER * max(1.0 / hold.grip[j] - softest, 0.0))


def _linearise(stage, moved, p, hold, turning, room, force):
    """Contact of one stage: accelerations, friction forces and rows of the Jacobian.

    As in the plane: adds modal forces to ``room.balance``, fills ``force`` (2 n,) with R, and
    ``active`` and ``gradients`` of the room. Returns the number of nodes
    under force and the largest velocity that there must not be: of a sticking node, or of slip
    athwart its friction; infinite when a node has changed between stick and slip.
    """
    s, g, side, partial = p.system, stage.g, hold.side, room.partial
    n, _, m = s.rows.shape
    count, creep = 0, 0.0
    for j in range(n):
        force[j], force[n + j] = 0.0, 0.0
        grip = _grip(j, g, hold, s)
        contact = contact_of(j, stage.Y, moved, s)
        F, pressing = normal_gradients(j, contact, s, partial)
        if F == 0.0:
            continue
        v1, v2, s1, s2 = contact.slip[0], contact.slip[1], contact.slope[0], contact.slope[1]
        # Derivatives of F and of the pressing force to the velocities along, away and across.
        F_1, F_y, F_2 = (g * partial[1, 0] + partial[1, 3], g * partial[1, 1] + partial[1, 4],
                         g * partial[1, 2] + partial[1, 5])
        P_1, P_y, P_2 = (g * partial[3, 0] + partial[3, 3], g * partial[3, 1] + partial[3, 4],
                         g * partial[3, 2] + partial[3, 5])
        limit = stick_limit(j, pressing, p)
        trial1 = hold.multiplier[j] + grip * v1
        trial2 = hold.multiplier[n + j] + grip * v2
        size = math.hypot(trial1, trial2)
        before1, before2 = side[j], side[n + j]
        stuck = before1 == 0.0 and before2 == 0.0
        sticks = size <= limit
        if turning == KEPT:
            sticks = stuck
        elif turning == HESITANT and trial1 * before1 + trial2 * before2 < 0.0:
            sticks = True
        if sticks:
            R1, R2 = trial1, trial2
            R11, R12, R22, R1y, R2y, R21 = grip, 0.0, grip, 0.0, 0.0, 0.0
            slip = math.hypot(v1, v2)
            creep = max(creep, slip) if stuck else math.inf
            side[j], side[n + j] = 0.0, 0.0
        else:
            e1, e2, turn = before1, before2, 0.0
            if size > 0.0 and (turning != KEPT or trial1 * before1 + trial2 * before2 > 0.0):
                e1, e2 = trial1 / size, trial2 / size
                turn = grip / size
            if before1 * e1 + before2 * e2 <= 0.0:
                creep = math.inf
            side[j], side[n + j] = e1, e2
            slip = e1 * v1 + e2 * v2
            R, R_v, R_F = plane_friction(j, max(slip, CREEP), pressing, s)
            if slip < 0.0:
                creep = max(creep, math.hypot(v1, v2))
                R_v = 0.0
            # Slip too slow to turn the trial force ends before its direction matters.
            if grip * slip > limit:
                creep = max(creep, abs(e1 * v2 - e2 * v1))
            R1, R2 = R * e1, R * e2
            # The force of slip turns with the trial force.
            around = R * turn
            P_1, P_y, P_2 = R_F * P_1, R_F * P_y, R_F * P_2
            R11 = R_v * e1 * e1 + around * e2 * e2 + e1 * P_1
            R12 = (R_v - around) * e1 * e2 + e1 * P_2
            R21 = (R_v - around) * e1 * e2 + e2 * P_1
            R22 = R_v * e2 * e2 + around * e1 * e1 + e2 * P_2
            R1y, R2y = e1 * P_y, e2 * P_y
        force[j], force[n + j] = R1, R2
        T1, T2 = tangent_force(F, R1, s1, s), tangent_force(F, R2, s2, s)
        if s.follows_surface:
            bend = contact.curvature
            R11 += s1 * F_1 + g * F * bend[0][0]
            R12 += s1 * F_2 + g * F * bend[0][1]
            R21 += s2 * F_1 + g * F * bend[1][0]
            R22 += s2 * F_2 + g * F * bend[1][1]
            R1y += s1 * F_y
            R2y += s2 * F_y
        for i in range(m):
            tx, ty, t2 = s.rows[j, 0, i], s.rows[j, 1, i], s.rows[j, 2, i]
            room.balance[i] += ty * F - tx * T1 - t2 * T2
            room.active[count, 0, i], room.active[count, 1, i] = tx, ty
            room.active[count, 2, i] = t2
            room.gradients[count, 0, i] = R11 * tx + R1y * ty + R12 * t2
            room.gradients[count, 1, i] = -F_1 * tx - F_y * ty - F_2 * t2
            room.gradients[count, 2, i] = R21 * tx + R2y * ty + R22 * t2
        count += 1
    return float(count), creep


observe_in_space = compile_law(OBSERVE, "observe(moved, Y, p, nodes)", _observe)
powers_in_space = compile_law(POWERS, "powers(moved, p, nodes, friction, out)", _contact_powers)
slips_back_in_space = compile_law(SLIPS_BACK, "slips_back(j, step, p, w, tolerance, room)",
                                  _slips_back)
linearise_in_space = compile_law(
    LINEARISE, "linearise(stage, moved, p, hold, turning, room, force)", _linearise)


def in_space() -> InSpace:
    """Addresses of these functions."""
    return InSpace(observe_in_space.address, powers_in_space.address, slips_back_in_space.address,
                   linearise_in_space.address)
