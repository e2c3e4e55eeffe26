"""Compiled right-hand side of the reduced contact system.

State y = [q, q', z] of m modes and, node by node, the internal variables of friction with memory.
With x = Tx q and y = Ty q at the n contact nodes, per node j

    xi = X_j + x_j - travel_j(t)    u_j = y_R(xi) - y_j - g_j      v_j = u_j'
    F_j = normal(u_j, v_j)          R_j = friction(x_j' - V_j, s(xi) |F_j|, z_j)
    q'' = -K q - C q' + T^T f,      f_j = [-T_j, F_j]
    T_j = R_j + F_j y_R'(xi)

where K and C hold the modes' own stiffness and damping and the springs and dashpots at B, and s is
the variation of friction along the ground. T has no second part where contact forces stay vertical.
Rows of nodes between two bodies are those of their relative motion; y_R is zero there. One motion
moves all other sides, by a factor each: travel_j = c_j travel, V_j = c_j V.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import (
    block,
    borrowed,
    f8,
    helper,
    i8,
    integers,
    kernel,
    matrix,
    vector,
)
from fecontact.core.types import Array, Integers
from fecontact.laws.signatures import friction_at, ground_at, memory_at, normal_at, signal_at


class SystemArrays(NamedTuple):
    """A contact system as the kernels see it: arrays, and laws by address.

    ``drive_damping`` (2,) is that of relative dashpots; ``sliding`` (n,) are the factors c_j;
    ``bristle_stiffness`` (2, n, s) are a and b of the stored ``(a + b |F|) z^2 / 2``; ``on_ground``
    is 0 for nodes between bodies, ``leans`` where contact forces stay vertical, else 1.
    """

    stiffness: Array
    damping: Array
    modal_damping: Array
    constant_load: Array
    drive_shapes: Array
    drive_stiffness: Array
    drive_damping: Array
    load_shapes: Array
    Tx: Array
    Ty: Array
    abscissa: Array
    gap: Array
    sliding: Array
    bristle_stiffness: Array
    normal_parameters: Array
    friction_parameters: Array
    profile_parameters: Array
    friction_scale_parameters: Array
    ground_motion_parameters: Array
    drive_parameters: Array
    load_parameters: Array
    normal: Integers
    friction: Integers
    memory: Integers
    on_ground: Integers
    drive: Integers
    load: Integers
    profile: int
    friction_scale: int
    ground_motion: int
    leans: int


SYSTEM = types.NamedTuple(
    [matrix, matrix, matrix, vector, matrix, vector, vector, matrix, matrix, matrix, vector, vector,
     vector, block, matrix, matrix, vector, vector, vector, matrix, matrix,
     integers, integers, integers, integers, integers, integers, i8, i8, i8, i8], SystemArrays)

# Columns of the per-node results of `contact_state`.
STATE_COLUMNS = 6
NORMAL_FORCE, FRICTION_FORCE, PENETRATION, PENETRATION_RATE, SLIP_VELOCITY, GROUND_RATE = range(
    STATE_COLUMNS)


class GroundMotion(NamedTuple):
    """How far the ground has travelled, and its speed; or what slides in its place."""

    travel: float
    speed: float


class NodeMotion(NamedTuple):
    """Displacements of a node along and away from the ground, and their rates."""

    along: float
    height: float
    along_rate: float
    height_rate: float


class NodeContact(NamedTuple):
    """A node against the ground: xi, u, u', slip velocity, and y_R' and y_R'' of the profile."""

    place: float
    penetration: float
    rate: float
    slip: float
    slope: float
    curvature: float


@helper
def ground_motion(t, s):
    """Motion of the ground at time t."""
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    return GroundMotion(travel, speed)


@helper
def node_motion(j, y, s):
    """Motion of node j in the state y."""
    m = s.Tx.shape[1]
    x, height, x_rate, height_rate = 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        x += s.Tx[j, i] * y[i]
        height += s.Ty[j, i] * y[i]
        x_rate += s.Tx[j, i] * y[m + i]
        height_rate += s.Ty[j, i] * y[m + i]
    return NodeMotion(x, height, x_rate, height_rate)


@helper
def node_contact(j, motion, moved, s):
    """Where node j is above the other side, under the prescribed motion ``moved``."""
    place = s.abscissa[j] + motion.along - s.sliding[j] * moved.travel
    ground, slope, curvature = 0.0, 0.0, 0.0
    if s.on_ground[j]:
        ground, slope, curvature = ground_at(s.profile)(place, s.profile_parameters)
    slip = motion.along_rate - s.sliding[j] * moved.speed
    return NodeContact(place, ground - motion.height - s.gap[j],
                       slope * slip - motion.height_rate, slip, slope, curvature)


@helper
def memory_of(j, y, s):
    """Internal variables of node j: a view of the state y."""
    n, m = s.Tx.shape
    first = 2 * m + j * ((len(y) - 2 * m) // n)
    return y[first : first + s.memory[j]]


@helper
def pressing_force(j, place, F, s):
    """The force that friction sees under a normal force: |F| times the ground's variation."""
    pressing = abs(F)
    if s.friction_scale != 0 and s.on_ground[j] and F != 0.0:
        pressing *= ground_at(s.friction_scale)(place, s.friction_scale_parameters)[0]
    return pressing


@helper
def force_against_x(F, R, contact, s):
    """Force of a node in -x: friction, and the part of the contact force that leans."""
    return R + F * contact.slope if s.leans else R


@helper
def node_forces(j, motion, moved, z, s, force, rates):
    """F and R of node j, and its :class:`NodeContact`.

    ``force`` (3 + s,) and ``rates`` (s, 3 + s) are filled by laws with memory; see the contract.
    """
    contact = node_contact(j, motion, moved, s)
    F = normal_at(s.normal[j])(contact.penetration, contact.rate, s.normal_parameters[j])[0]
    pressing = pressing_force(j, contact.place, F, s)
    R = 0.0
    if s.memory[j] > 0:
        memory_at(s.friction[j])(contact.slip, pressing, z, s.friction_parameters[j], force, rates)
        R = force[0]
    elif F != 0.0:
        R = friction_at(s.friction[j])(contact.slip, pressing, s.friction_parameters[j])[0]
    return F, R, contact


@helper
def normal_gradients(j, contact, s, out):
    """F of node j and the force that friction sees under it.

    Fills out[0] and out[2] with their derivatives to x, y, x', y' of the node.
    """
    slope = contact.slope
    F, F_u, F_v = normal_at(s.normal[j])(contact.penetration, contact.rate,
                                         s.normal_parameters[j])
    out[0, 0] = F_u * slope + F_v * contact.curvature * contact.slip
    out[0, 1] = -F_u
    out[0, 2] = F_v * slope
    out[0, 3] = -F_v
    sign = 1.0 if F >= 0.0 else -1.0
    pressing = abs(F)
    for k in range(4):
        out[2, k] = sign * out[0, k]
    if s.friction_scale != 0 and s.on_ground[j] and F != 0.0:
        scale, scale_x, _ = ground_at(s.friction_scale)(contact.place, s.friction_scale_parameters)
        for k in range(4):
            out[2, k] *= scale
        out[2, 0] += scale_x * pressing
        pressing *= scale
    return F, pressing


@helper
def node_gradients(j, motion, moved, z, s, force, rates, out):
    """F of node j, its force T in -x, and its :class:`NodeContact`, with derivatives.

    Fills out (3, 4) with those of F, T and the force that friction sees to x, y, x', y'; ``force``
    begins with R and its derivatives to slip velocity and pressing force for all laws.
    """
    contact = node_contact(j, motion, moved, s)
    F, pressing = normal_gradients(j, contact, s, out)
    R, R_v, R_F = 0.0, 0.0, 0.0
    if s.memory[j] > 0:
        memory_at(s.friction[j])(contact.slip, pressing, z, s.friction_parameters[j], force, rates)
        R, R_v, R_F = force[0], force[1], force[2]
    elif F != 0.0:
        R, R_v, R_F = friction_at(s.friction[j])(contact.slip, pressing, s.friction_parameters[j])
    force[0], force[1], force[2] = R, R_v, R_F
    for k in range(4):
        out[1, k] = R_F * out[2, k]
    out[1, 2] += R_v
    if s.leans:
        for k in range(4):
            out[1, k] += contact.slope * out[0, k]
        out[1, 0] += F * contact.curvature
    return F, force_against_x(F, R, contact, s), contact


@kernel(types.void(f8, vector, SYSTEM, matrix))
def contact_state(t, y, s, out):
    """Fill out (n, 6): F, R, u, v, slip velocity and rate y_R' of the ground under the node."""
    y, s = borrowed(y), borrowed(s)
    n = len(s.Tx)
    moved = ground_motion(t, s)
    states = s.memory.max()
    force, rates = np.empty(3 + states), np.empty((states, 3 + states))
    for j in range(n):
        F, R, contact = node_forces(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force,
                                    rates)
        out[j, NORMAL_FORCE], out[j, FRICTION_FORCE] = F, R
        out[j, PENETRATION], out[j, PENETRATION_RATE] = contact.penetration, contact.rate
        out[j, SLIP_VELOCITY] = contact.slip
        out[j, GROUND_RATE] = contact.slope * contact.slip


@helper
def set_load(t, pull_x, pull_y, s, load):
    """Fill load (m,) with the modal forces of the loads at time t and of the drive's pulls."""
    m = len(load)
    for i in range(m):
        load[i] = (s.constant_load[i] + pull_x * s.drive_shapes[0, i]
                   + pull_y * s.drive_shapes[1, i])
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        for i in range(m):
            load[i] += value * s.load_shapes[k, i]


@helper
def drive_pull(axis, t, s):
    """Force on B at rest at time t, by spring and dashpot to an end that moves."""
    value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
    return s.drive_stiffness[axis] * value + s.drive_damping[axis] * rate


@helper
def given_at(t, s, load):
    """Fill load (m,) with modal forces given in time; returns the motion of the ground."""
    set_load(t, drive_pull(0, t, s), drive_pull(1, t, s), s, load)
    return ground_motion(t, s)


@helper
def body_acceleration(load, y, s, out):
    """Fill out (m,) with q'' without contact, under modal forces ``load``, which may be out."""
    m = len(load)
    for i in range(m):
        total = load[i]
        for k in range(m):
            total -= s.stiffness[i, k] * y[k] + s.damping[i, k] * y[m + k]
        out[i] = total


@helper
def body_rates(load, y, s, out):
    """Fill out (2 m + n s,) with y' as it is without contact, under modal forces ``load``."""
    m = len(load)
    for i in range(m):
        out[i] = y[m + i]
    body_acceleration(load, y, s, out[m : 2 * m])
    for i in range(2 * m, len(out)):
        out[i] = 0.0


@helper
def rates_under(load, moved, y, s, force, rates, out):
    """Fill out (2 m + n s,) with y'; ``force`` (3 + s,) and ``rates`` (s, 3 + s) are room."""
    n, m = s.Tx.shape
    states = len(rates)
    body_rates(load, y, s, out)
    for j in range(n):
        F, R, contact = node_forces(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force,
                                    rates)
        if F != 0.0:
            T = force_against_x(F, R, contact, s)
            for i in range(m):
                out[m + i] += s.Ty[j, i] * F - s.Tx[j, i] * T
        for k in range(s.memory[j]):
            out[2 * m + j * states + k] = rates[k, 0]


@kernel(types.void(f8, vector, SYSTEM, vector))
def right_hand_side(t, y, s, out):
    """Fill out (2 m + n s,) with y'."""
    y, s = borrowed(y), borrowed(s)
    states = s.memory.max()
    load = np.empty(s.Tx.shape[1])
    moved = given_at(t, s, load)
    rates_under(load, moved, y, s, np.empty(3 + states), np.empty((states, 3 + states)), out)


@kernel(types.void(vector, matrix, SYSTEM, block))
def contact_history(times, states, s, out):
    """Fill out (N, n, 6) with `contact_state` at N times."""
    for k in range(len(times)):
        contact_state(times[k], states[k], s, out[k])


@kernel(types.void(integers, vector, vector, matrix, vector, vector))
def normal_values(addresses, u, v, p, force, slope):
    """Fill force and dF/du (k,) of the normal laws of k nodes at their penetrations and rates."""
    for j in range(len(u)):
        force[j], slope[j], _ = normal_at(addresses[j])(u[j], v[j], p[j])
