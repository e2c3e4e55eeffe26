"""Compiled equations of motion with set-valued friction and rigid stops.

Nodes whose rows along the other side are equal, and whose other sides move alike, have one slip
velocity and form a cluster c. With the friction force ``R_c``, the sum over the nodes, and the
relative acceleration ``a_c = Tx_c q'' - V_c'``, where ``Tx`` is mass-normalised,

    a_c = a0_c - sum_d W_cd R_d,    W = Tx Tx^T

Sticking clusters have ``a_c = 0``, which gives their ``R_c``; each node takes a part of it in
proportion to its limit. Closed rigid stops add u'' = 0 for their normal forces, and friction that
slips is proportional to these. The state of these kernels is Y = [q, q', work, friction work per
node].
"""

from collections.abc import Callable

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import IntegerVector, Vector
from fecontact.integrate.nonsmooth.problem import (
    CURVED,
    FIXED,
    FORCE,
    GRIP,
    LIMIT,
    PENETRATION,
    PRESSING,
    RATE,
    SLIP,
    SLIP_OF,
    SLOPE,
    SLOPE_OF,
    STICK,
    Evaluation,
    NonsmoothProblem,
)
from fecontact.laws.friction_curve import CREEP
from fecontact.laws.signatures import signal_at
from fecontact.system.kernels import body_acceleration, prescribed_at
from fecontact.system.node_forces import normal_force, plane_friction, pressing_force
from fecontact.system.nodes import ground_speed, node_contact, node_motion
from fecontact.system.powers import (
    BELT_FRICTION,
    BELT_NORMAL,
    CONTACT_DAMPING,
    FRICTION,
    POWER_COUNT,
    belt_normal_power,
    body_powers,
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
def solve_small(w, size):
    """Replace the first entries of w.right by the solution, with the first rows of w.matrix."""
    matrix = w.matrix[:size, :size]
    factorise(matrix, size, w.pivots)
    solve(matrix, w.pivots[:size], w.right[:size])


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
def free_acceleration(t, Y, s, out):
    """Fill out (m,) with q'' without contact; returns the motion of the ground."""
    moved = prescribed_at(t, s, out)
    body_acceleration(out, Y, s, out)
    return moved


@helper
def contact_powers(moved, s, nodes, friction, elastic, out):
    """Add the powers at the nodes to out (p,) and put those of friction behind them (n,).

    ``elastic`` says whether the normal forces come from the normal laws.
    """
    n = len(nodes)
    for j in range(n):
        force, rubbed = nodes[j, FORCE], 0.0
        for k in range(s.rows.shape[1] - 1):
            R, speed = friction[k * n + j], ground_speed(k, j, moved, s)
            slip, slope = nodes[j, SLIP_OF[k]], nodes[j, SLOPE_OF[k]]
            out[BELT_NORMAL] += belt_normal_power(force, slope, slip, speed, s)
            out[BELT_FRICTION] -= R * speed
            rubbed += R * slip
        if elastic and nodes[j, RATE] != 0.0:
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
def hold_contacts(t, p, status, closed, w, acceleration):
    """Forces of closed rigid stops and of the clusters that stick on them.

    From u'' = 0 and a = 0, put into w and ``acceleration``; friction of stops that slip is
    proportional to their normal forces.
    """
    s = p.system
    n, _, m = s.rows.shape
    count = 0
    for j in range(n):
        c = p.cluster[j]
        slip = w.nodes[j, SLIP]
        w.slip[c] = slip
        if closed[j]:
            w.indices[count] = j
            count += 1
            direction = sense(status[c], slip)
            if direction != 0:
                w.friction[j] = slipping_force(j, slip, float(direction), w.nodes[j, GRIP], s)
    if count == 0:
        return
    for c in range(len(p.rows)):
        if status[c] == STICK:
            w.indices[count] = n + c
            count += 1
    ground = speed_rate(t, p)
    for a in range(count):
        j = w.indices[a]
        w.right[a] = (w.nodes[j, CURVED] - w.nodes[j, SLOPE] * ground if j < n
                      else p.sliding[j - n] * ground)
        for i in range(m):
            w.right[a] -= held_row(j, i, p, w) * acceleration[i]
        for b in range(count):
            total = 0.0
            for i in range(m):
                total += held_row(j, i, p, w) * pushing_row(w.indices[b], i, p, w)
            w.matrix[a, b] = total
    solve_small(w, count)
    for a in range(count):
        for i in range(m):
            acceleration[i] += pushing_row(w.indices[a], i, p, w) * w.right[a]
        if w.indices[a] < n:
            w.nodes[w.indices[a], FORCE] = w.right[a]
        else:
            w.total[w.indices[a] - n] = w.right[a]
    for j in range(n):
        c, force = p.cluster[j], w.nodes[j, FORCE]
        w.nodes[j, PRESSING] = force * w.nodes[j, GRIP]
        w.pressing[c] += w.nodes[j, PRESSING]
        w.friction[j] *= force
        if status[c] != STICK:
            w.total[c] += w.friction[j]


@helper
def share_friction(p, status, w):
    """Put the parts of the nodes in the friction of sticking clusters into ``w.friction``."""
    alone = len(p.rows) == len(p.cluster)
    for j in range(len(p.cluster)):
        c = p.cluster[j]
        if status[c] == STICK:
            if alone:
                w.friction[j] = w.total[c]
            elif w.limit[c] > 0.0:
                w.friction[j] = w.total[c] * w.nodes[j, LIMIT] / w.limit[c]


@helper
def hold_clusters(t, p, status, w, acceleration):
    """Friction forces of sticking clusters, from a = 0, put into w.total and ``acceleration``."""
    clusters, m = p.rows.shape
    count = 0
    for c in range(clusters):
        if status[c] == STICK:
            w.indices[count] = c
            count += 1
    if count == 0:
        return
    ground = speed_rate(t, p)
    if count == 1:
        c = w.indices[0]
        right, total = -p.sliding[c] * ground, 0.0
        for i in range(m):
            right += p.rows[c, i] * acceleration[i]
            total += p.rows[c, i] * p.rows[c, i]
        force = right / total
        w.total[c] = force
        for i in range(m):
            acceleration[i] -= p.rows[c, i] * force
        return
    for a in range(count):
        c = w.indices[a]
        w.right[a] = -p.sliding[c] * ground
        for i in range(m):
            w.right[a] += p.rows[c, i] * acceleration[i]
        for b in range(count):
            total = 0.0
            for i in range(m):
                total += p.rows[c, i] * p.rows[w.indices[b], i]
            w.matrix[a, b] = total
    solve_small(w, count)
    for a in range(count):
        c = w.indices[a]
        w.total[c] = w.right[a]
        for i in range(m):
            acceleration[i] -= p.rows[c, i] * w.right[a]


@helper
def add_contact_forces(t, Y, moved, p, status, closed, w, acceleration):
    """Put the contact forces at Y into w and into ``acceleration``, which is that without them.

    Limits of stick are left out.
    """
    s = p.system
    n, _, m = s.rows.shape
    observe_forces(moved, Y, p, w.nodes)
    w.total[:] = 0.0
    w.pressing[:] = 0.0
    w.friction[:] = 0.0
    if p.rigid != 0:
        hold_contacts(t, p, status, closed, w, acceleration)
        return
    for j in range(n):
        c = p.cluster[j]
        slip, pressing = w.nodes[j, SLIP], w.nodes[j, PRESSING]
        w.slip[c] = slip
        w.pressing[c] += pressing
        direction = sense(status[c], slip)
        if pressing > 0.0 and direction != 0:
            w.friction[j] = slipping_force(j, slip, float(direction), pressing, s)
            w.total[c] += w.friction[j]
        force = w.nodes[j, FORCE]
        for i in range(m):
            acceleration[i] += (lifting_row(j, i, w, s) * force
                                - s.rows[j, 0, i] * w.friction[j])
    hold_clusters(t, p, status, w, acceleration)


def _derivative(t, Y, p, status, closed, w, out):
    """Fill out with Y' for given status of the clusters and stops, and w with what acts."""
    s = p.system
    m = s.rows.shape[2]
    for i in range(m):
        out[i] = Y[m + i]
    acceleration = out[m : 2 * m]
    moved = free_acceleration(t, Y, s, acceleration)
    add_contact_forces(t, Y, moved, p, status, closed, w, acceleration)
    set_limits(p, w)
    share_friction(p, status, w)
    body_powers(t, Y, s, out[2 * m :])
    contact_powers(moved, s, w.nodes, w.friction, p.rigid == 0, out[2 * m :])


compiled_derivative = compile_law(DERIVATIVE, "derivative(t, Y, p, status, closed, w, out)",
                                  _derivative)
