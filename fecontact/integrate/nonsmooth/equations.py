"""Compiled equations of motion with set-valued friction and rigid stops.

Nodes whose rows along the other side are equal, and whose other sides move alike, have one slip
velocity and form a cluster c. With the friction force ``R_c``, the sum over the nodes, and the
relative acceleration ``a_c = Tx_c q'' - V_c'``, where ``Tx`` is mass-normalised,

    a_c = a0_c - sum_d W_cd R_d,    W = Tx Tx^T

Sticking clusters have ``a_c = 0``, which gives their ``R_c``; each node takes a part of it in
proportion to its limit. Closed rigid stops add u'' = 0 for their normal forces, and friction that
slips is proportional to these. The state of these kernels is Y = [q, q', work, friction work per
node].

A stage of a step needs no more than rates; powers are evaluated where they enter the end of a step
or its interpolation, and limits of stick where forces are compared with them.
"""

import math
from collections.abc import Callable

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import IntegerVector, Vector
from fecontact.integrate.nonsmooth.problem import (
    CURVED,
    FIXED,
    FORCE,
    GRIP,
    LIMIT,
    MOTION,
    PENETRATION,
    PRESSING,
    RATE,
    SLIP,
    SLIP_OF,
    SLOPE,
    SLOPE_OF,
    SPEED,
    STICK,
    TRAVEL,
    WHEN,
    ContactState,
    Evaluation,
    NonsmoothProblem,
)
from fecontact.laws.friction_curve import CREEP
from fecontact.laws.signatures import signal_at
from fecontact.system.kernels import (
    add_drive_force,
    add_loads,
    body_acceleration,
    set_constant_load,
)
from fecontact.system.node_forces import normal_force, plane_friction, pressing_force
from fecontact.system.nodes import (
    GroundMotion,
    ground_motion,
    ground_speed,
    node_contact,
    node_motion,
)
from fecontact.system.powers import (
    BELT_FRICTION,
    BELT_NORMAL,
    CONTACT_DAMPING,
    DASHPOTS,
    DRIVE,
    FRICTION,
    LOAD,
    POWER_COUNT,
    belt_normal_power,
    matrix_powers,
)

# Y' is evaluated in many places; behind an address its code is not copied into each of them.
DERIVATIVE = Callable[[
    float, Vector, NonsmoothProblem, IntegerVector, IntegerVector, Evaluation, Vector,
], None]
_derivative_at = function_at(DERIVATIVE)


@helper
def derivative(t, Y, p, status, closed, w, out):
    """Fill out with Y' for given status of the clusters and stops, and w with what acts."""
    _derivative_at(p.derivative)(t, Y, p, status, closed, w, out)


@helper
def speed_rate(t, p):
    """Acceleration of the ground, from its speed."""
    s, d = p.system, p.tick
    if p.steady != 0:
        return 0.0
    near = (signal_at(s.ground_motion)(t + d, s.ground_motion_parameters)[1]
            - signal_at(s.ground_motion)(t - d, s.ground_motion_parameters)[1])
    far = (signal_at(s.ground_motion)(t + 2.0 * d, s.ground_motion_parameters)[1]
           - signal_at(s.ground_motion)(t - 2.0 * d, s.ground_motion_parameters)[1])
    return (8.0 * near - far) / (12.0 * d)


@helper
def set_implicit_matrix(damped, stiff, s, out):
    """Fill out (m, m) with 1 + C ``damped`` + K ``stiff``, the matrix of an implicit step."""
    for i in range(len(out)):
        for k in range(len(out)):
            out[i, k] = damped * s.damping[i, k] + stiff * s.stiffness[i, k]
        out[i, i] += 1.0


@helper
def set_prescribed(t, s, w):
    """Fill ``w.given``, ``w.loads`` and ``w.applied_forces`` unless they are those of this time."""
    given = w.given
    if given[WHEN] == t:
        return
    moved = ground_motion(t, s)
    given[WHEN], given[TRAVEL], given[SPEED] = t, moved.travel, moved.speed
    set_constant_load(s, w.loads)
    add_loads(t, s, w.loads)
    put(w.loads, w.applied_forces)
    for axis in range(len(s.drive)):
        stiffness, damping = s.drive_stiffness[axis], s.drive_damping[axis]
        if stiffness != 0.0 or damping != 0.0:
            value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
            given[MOTION + 2 * axis], given[MOTION + 2 * axis + 1] = value, rate
            add_drive_force(stiffness * value + damping * rate, axis, s, w.applied_forces)


@helper
def _moved(given):
    """Motion of the ground in ``given``."""
    return GroundMotion(given[TRAVEL], given[SPEED], 0.0, 0.0)


@helper
def contact_powers(moved, p, nodes, friction, out):
    """Add the powers at the nodes to out (p,) and put those of friction behind them (n,)."""
    s, n = p.system, len(nodes)
    for j in range(n):
        force, rubbed = nodes[j, FORCE], 0.0
        for k in range(s.rows.shape[1] - 1):
            R, speed = friction[k * n + j], ground_speed(k, j, moved, s)
            slip, slope = nodes[j, SLIP_OF[k]], nodes[j, SLOPE_OF[k]]
            out[BELT_NORMAL] += belt_normal_power(force, slope, slip, speed, s)
            out[BELT_FRICTION] -= R * speed
            rubbed += R * slip
        if p.rigid == 0 and nodes[j, RATE] != 0.0:
            # Damping may bring the force to zero while the spring is still compressed.
            stored = normal_force(j, nodes[j, PENETRATION], 0.0, s)[0]
            out[CONTACT_DAMPING] += (force - stored) * nodes[j, RATE]
        out[POWER_COUNT + j] = rubbed
        out[FRICTION] += rubbed


@helper
def stick_limit(j, pressing, p):
    """Largest friction force of node j in stick."""
    s = p.system
    if p.static[j] >= 0.0:
        return p.static[j] * pressing
    return plane_friction(j, CREEP, pressing, s)[0]


@helper
def observe_forces(moved, Y, p, nodes):
    """Fill ``nodes`` except for limits of stick; rigid stops have no force yet."""
    s = p.system
    for j in range(len(nodes)):
        contact = node_contact(j, node_motion(j, Y, s), moved, s)
        force, grip = 0.0, 0.0
        if p.rigid == 0:
            force = normal_force(j, contact.penetration, contact.rate, s)[0]
        else:
            grip = pressing_force(j, contact, 1.0, s)
            if stick_limit(j, grip, p) == 0.0:
                grip = 0.0
        nodes[j, FORCE], nodes[j, PRESSING] = force, pressing_force(j, contact, force, s)
        nodes[j, PENETRATION], nodes[j, RATE] = contact.penetration, contact.rate
        for k in range(s.rows.shape[1] - 1):
            nodes[j, SLIP_OF[k]], nodes[j, SLOPE_OF[k]] = contact.slip[k], contact.slope[k]
        nodes[j, GRIP] = grip
        nodes[j, CURVED] = contact.curvature[0][0] * contact.slip[0] * contact.slip[0]


@helper
def _set_node_limits(p, nodes):
    for j in range(len(nodes)):
        pressing = nodes[j, PRESSING]
        nodes[j, LIMIT] = stick_limit(j, pressing, p) if pressing > 0.0 else 0.0


@helper
def observe(moved, Y, p, nodes):
    """Fill ``nodes`` from the positions and velocities in Y; rigid stops have no force yet."""
    observe_forces(moved, Y, p, nodes)
    _set_node_limits(p, nodes)


@helper
def set_limits(p, w):
    """Put the limits of stick of nodes and clusters into w, whose forces are known."""
    _set_node_limits(p, w.nodes)
    w.limit[:] = 0.0
    for j in range(len(p.cluster)):
        w.limit[p.cluster[j]] += w.nodes[j, LIMIT]


@helper
def sinking_row(j, i, w, s):
    """Change of the height of node j over the ground by mode i."""
    return s.rows[j, 1, i] - w.nodes[j, SLOPE] * s.rows[j, 0, i]


@helper
def lifting_row(j, i, w, s):
    """Modal force i of a unit contact force of node j."""
    return sinking_row(j, i, w, s) if s.follows_surface else s.rows[j, 1, i]


@helper
def place_size(j, Y, p):
    """Size of the terms of the penetration of node j [m], of whose rounding it has 1e-16."""
    s = p.system
    size = abs(s.gap[j]) + max(abs(p.relief[0]), abs(p.relief[1]))
    for i in range(s.rows.shape[2]):
        size += abs(s.rows[j, 1, i] * Y[i])
    return size


@helper
def force_size(i, Y, applied_forces, s):
    """Size of the terms of the force on mode i without contact, with the ``applied_forces``."""
    m = s.rows.shape[2]
    size = abs(applied_forces[i])
    for k in range(m):
        size += abs(s.stiffness[i, k] * Y[k]) + abs(s.damping[i, k] * Y[m + k])
    return size


@helper
def slipping_force(j, slip, sign, pressing, s):
    """R of node j that slips with the given sign, also where its slip velocity is still zero."""
    v = sign * max(sign * slip, CREEP)
    return plane_friction(j, v, pressing, s)[0]


@helper
def sense(state, slip):
    """Sense in which a cluster slips, 0 if it does not, from its status."""
    if state == FIXED:
        return 1 if slip > 0.0 else (-1 if slip < 0.0 else 0)
    return 0 if state == STICK else state


@helper
def held_row(a, i, p, w):
    """Change by mode i of the height over the ground of node a, or of the place of a cluster.

    Clusters are counted behind the nodes.
    """
    n = len(p.cluster)
    return sinking_row(a, i, w, p.system) if a < n else p.rows[a - n, i]


@helper
def pushing_row(a, i, p, w):
    """Modal force i of a unit normal force of node a, or of a unit friction force of a cluster.

    With the normal force goes the friction that ``w.friction`` names.
    """
    s = p.system
    n = len(p.cluster)
    if a < n:
        return lifting_row(a, i, w, s) - s.rows[a, 0, i] * w.friction[a]
    return -p.rows[a - n, i]


@helper
def coupling(a, b, p, w):
    """Change of what one constraint holds by a unit force of another; see :func:`held_row`."""
    total = 0.0
    for i in range(p.rows.shape[1]):
        total += held_row(a, i, p, w) * pushing_row(b, i, p, w)
    return total


@helper
def residual(a, ground, acceleration, p, w):
    """Acceleration at which the height of node a falls, by those of modes and ground.

    Of a cluster, which is counted behind the nodes, what it lacks to move with the ground.
    """
    n = len(p.cluster)
    total = (w.nodes[a, CURVED] - w.nodes[a, SLOPE] * ground if a < n
             else p.sliding[a - n] * ground)
    for i in range(p.rows.shape[1]):
        total -= held_row(a, i, p, w) * acceleration[i]
    return total


@helper
def hold(count, p, w, out):
    """Change out (m,) by contact forces so that the residuals ``w.right`` of constraints vanish.

    The constraints are the first of ``w.indices``, clusters behind the nodes. Their forces take
    the place of the residuals.
    """
    matrix = w.matrix[:count, :count]
    for a in range(count):
        for b in range(count):
            matrix[a, b] = coupling(w.indices[a], w.indices[b], p, w)
    factorise(matrix, count, w.pivots)
    solve(matrix, w.pivots[:count], w.right[:count])
    for a in range(count):
        for i in range(p.rows.shape[1]):
            out[i] += pushing_row(w.indices[a], i, p, w) * w.right[a]


@helper
def share_friction(p, status, w):
    """Put the parts of the nodes in the friction of sticking clusters into ``w.friction``."""
    alone = len(p.rows) == len(p.cluster)
    if not alone:
        set_limits(p, w)
    for j in range(len(p.cluster)):
        c = p.cluster[j]
        if status[c] == STICK:
            if alone:
                w.friction[j] = w.total[c]
            elif w.limit[c] > 0.0:
                w.friction[j] = w.total[c] * w.nodes[j, LIMIT] / w.limit[c]


@helper
def _add_contact_forces(t, Y, p, status, closed, w, acceleration):
    """Put the contact forces at Y into w and into ``acceleration``, which is that without them.

    Closed rigid stops have u'' = 0, and clusters that stick on them a = 0; friction of stops that
    slip is proportional to their normal forces. Limits of stick are left out.
    """
    s = p.system
    n, _, m = s.rows.shape
    observe_forces(_moved(w.given), Y, p, w.nodes)
    w.total[:] = 0.0
    w.pressing[:] = 0.0
    w.friction[:] = 0.0
    count, rigid = 0, p.rigid != 0
    for j in range(n):
        c, slip = p.cluster[j], w.nodes[j, SLIP]
        w.slip[c] = slip
        direction = sense(status[c], slip)
        if rigid:
            if closed[j]:
                w.indices[count] = j
                count += 1
                if direction != 0:
                    w.friction[j] = slipping_force(j, slip, float(direction), w.nodes[j, GRIP], s)
            continue
        force, pressing, friction = w.nodes[j, FORCE], w.nodes[j, PRESSING], 0.0
        if pressing > 0.0 and direction != 0:
            friction = slipping_force(j, slip, float(direction), pressing, s)
            w.friction[j] = friction
            w.total[c] += friction
        w.pressing[c] += pressing
        for i in range(m):
            acceleration[i] += lifting_row(j, i, w, s) * force - s.rows[j, 0, i] * friction
    for c in range(len(p.rows)):
        if status[c] == STICK and (count > 0 or not rigid):
            w.indices[count] = n + c
            count += 1
    if count == 0:
        return
    ground = speed_rate(t, p)
    if count == 1 and not rigid:
        # The most frequent case needs no system of equations.
        c, inertia = w.indices[0] - n, 0.0
        force = -p.sliding[c] * ground
        for i in range(m):
            force += p.rows[c, i] * acceleration[i]
            inertia += p.rows[c, i] * p.rows[c, i]
        w.total[c] = force / inertia
        for i in range(m):
            acceleration[i] -= p.rows[c, i] * w.total[c]
        return
    for a in range(count):
        w.right[a] = residual(w.indices[a], ground, acceleration, p, w)
    hold(count, p, w, acceleration)
    for a in range(count):
        if w.indices[a] < n:
            w.nodes[w.indices[a], FORCE] = w.right[a]
        else:
            w.total[w.indices[a] - n] = w.right[a]
    for j in range(n if rigid else 0):
        c, force = p.cluster[j], w.nodes[j, FORCE]
        w.nodes[j, PRESSING] = force * w.nodes[j, GRIP]
        w.pressing[c] += w.nodes[j, PRESSING]
        w.friction[j] *= force
        if status[c] != STICK:
            w.total[c] += w.friction[j]


@routine
def set_rates(t, Y, p, contact, w, out):
    """Fill out (2 m,) with q' and q'' at Y, and w with what acts, except for limits of stick.

    ``contact`` is a record with ``status`` and ``closed``, such as the progress of a run.
    """
    s = p.system
    m = s.rows.shape[2]
    set_prescribed(t, s, w)
    acceleration = out[m : 2 * m]
    for i in range(m):
        out[i] = Y[m + i]
    body_acceleration(w.applied_forces, Y, s, acceleration)
    _add_contact_forces(t, Y, p, contact.status, contact.closed, w, acceleration)


@helper
def set_slips(t, Y, p, w):
    """Put the slip velocities of the clusters at Y into ``w.slip``."""
    clusters, m = p.rows.shape
    speed = ground_motion(t, p.system).speed
    for c in range(clusters):
        w.slip[c] = -p.sliding[c] * speed
        for i in range(m):
            w.slip[c] += p.rows[c, i] * Y[m + i]


@helper
def _add_drive_powers(given, Y, s, out):
    """Add the powers of the drive to out."""
    m = s.rows.shape[2]
    for axis in range(len(s.drive)):
        stiffness, damping = s.drive_stiffness[axis], s.drive_damping[axis]
        if stiffness == 0.0 and damping == 0.0:
            continue
        value, rate = given[MOTION + 2 * axis], given[MOTION + 2 * axis + 1]
        place, speed = 0.0, 0.0
        for i in range(m):
            place += s.drive_shapes[axis, i] * Y[i]
            speed += s.drive_shapes[axis, i] * Y[m + i]
        out[DRIVE] += (stiffness * (value - place) + damping * (rate - speed)) * rate
        out[DASHPOTS] += damping * rate * (rate - 2.0 * speed)


@routine
def set_powers(Y, p, contact, w, out):
    """Fill out (p + n,) with the powers at Y, where :func:`set_rates` has been last."""
    s = p.system
    m = s.rows.shape[2]
    share_friction(p, contact.status, w)
    for k in range(POWER_COUNT):
        out[k] = 0.0
    _add_drive_powers(w.given, Y, s, out)
    for i in range(m):
        out[LOAD] += w.loads[i] * Y[m + i]
    matrix_powers((0, m, 0, m), Y, s, out)
    contact_powers(_moved(w.given), p, w.nodes, w.friction, out)


def _derivative(t, Y, p, status, closed, w, out):
    """Fill out with Y' for given status of the clusters and stops, and w with what acts."""
    # Another problem may have been the last.
    w.given[WHEN] = math.nan
    contact = ContactState(status, closed)
    set_rates(t, Y, p, contact, w, out)
    set_powers(Y, p, contact, w, out[2 * p.rows.shape[1] :])
    set_limits(p, w)


compiled_derivative = compile_law(DERIVATIVE, "derivative(t, Y, p, status, closed, w, out)",
                                  _derivative)
