"""Compiled right-hand side of the reduced contact system.

State y = [q, q', z] of m modes and, node by node, the internal variables of friction with memory.
With x = Tx q and y = Ty q at the n contact nodes, per node j

    xi = X_j + x_j - travel(t)      u_j = y_R(xi) - y_j - g_j      v_j = u_j'
    F_j = normal(u_j, v_j)          R_j = friction(x_j' - V, s(xi) |F_j|, z_j)
    q'' = -K q - C q' + T^T f,      f_j = [-R_j, F_j]

where K and C hold the modes' own stiffness and damping and the springs and dashpots at B, and s
is the variation of friction along the ground.
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
    """A contact system as the kernels see it: arrays, and laws by address."""

    stiffness: Array
    damping: Array
    modal_damping: Array
    constant_load: Array
    drive_shapes: Array
    drive_stiffness: Array
    load_shapes: Array
    Tx: Array
    Ty: Array
    abscissa: Array
    gap: Array
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
    drive: Integers
    load: Integers
    profile: int
    friction_scale: int
    ground_motion: int


SYSTEM = types.NamedTuple(
    [matrix, matrix, matrix, vector, matrix, vector, matrix, matrix, matrix, vector, vector,
     matrix, matrix, vector, vector, vector, matrix, matrix,
     integers, integers, integers, integers, integers, i8, i8, i8], SystemArrays)

# Columns of the per-node results of `contact_state`.
NORMAL_FORCE, FRICTION_FORCE, PENETRATION, PENETRATION_RATE, SLIP_VELOCITY, GROUND_RATE = range(6)
STATE_COLUMNS = 6


@helper
def node_motion(j, y, s):
    """Displacement along and away from the ground of node j, and their rates."""
    m = s.Tx.shape[1]
    x, height, x_rate, height_rate = 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        x += s.Tx[j, i] * y[i]
        height += s.Ty[j, i] * y[i]
        x_rate += s.Tx[j, i] * y[m + i]
        height_rate += s.Ty[j, i] * y[m + i]
    return x, height, x_rate, height_rate


@helper
def memory_of(j, y, s):
    """Internal variables of node j: a view of the state y."""
    n, m = s.Tx.shape
    first = 2 * m + j * ((len(y) - 2 * m) // n)
    return y[first : first + s.memory[j]]


@helper
def node_forces(j, x, height, x_rate, height_rate, z, travel, speed, s, force, rates):
    """F, R, u, v, slip velocity and rate y_R' of the ground at node j.

    ``force`` (3 + s,) and ``rates`` (s, 3 + s) are filled by laws with memory; see the contract.
    """
    xi = s.abscissa[j] + x - travel
    ground, slope, _ = ground_at(s.profile)(xi, s.profile_parameters)
    slip = x_rate - speed
    u = ground - height - s.gap[j]
    v = slope * slip - height_rate
    F = normal_at(s.normal[j])(u, v, s.normal_parameters[j])[0]
    pressing = abs(F)
    if s.friction_scale != 0 and F != 0.0:
        pressing *= ground_at(s.friction_scale)(xi, s.friction_scale_parameters)[0]
    R = 0.0
    if s.memory[j] > 0:
        memory_at(s.friction[j])(slip, pressing, z, s.friction_parameters[j], force, rates)
        R = force[0]
    elif F != 0.0:
        R = friction_at(s.friction[j])(slip, pressing, s.friction_parameters[j])[0]
    return F, R, u, v, slip, slope * slip


@helper
def node_gradients(j, x, height, x_rate, height_rate, z, travel, speed, s, force, rates, out):
    """F and R of node j; fills out (3, 4) with derivatives to x, y, x', y' of F, R and pressing.

    The pressing force is the one the friction law sees; ``force`` and ``rates`` as above, but
    ``force`` begins with R and its derivatives to slip velocity and pressing for all laws.
    """
    xi = s.abscissa[j] + x - travel
    ground, slope, curvature = ground_at(s.profile)(xi, s.profile_parameters)
    slip = x_rate - speed
    F, F_u, F_v = normal_at(s.normal[j])(ground - height - s.gap[j], slope * slip - height_rate,
                                         s.normal_parameters[j])
    out[0, 0] = F_u * slope + F_v * curvature * slip
    out[0, 1] = -F_u
    out[0, 2] = F_v * slope
    out[0, 3] = -F_v
    sign = 1.0 if F >= 0.0 else -1.0
    pressing = abs(F)
    for k in range(4):
        out[2, k] = sign * out[0, k]
    if s.friction_scale != 0 and F != 0.0:
        scale, scale_x, _ = ground_at(s.friction_scale)(xi, s.friction_scale_parameters)
        for k in range(4):
            out[2, k] *= scale
        out[2, 0] += scale_x * pressing
        pressing *= scale
    R, R_v, R_F = 0.0, 0.0, 0.0
    if s.memory[j] > 0:
        memory_at(s.friction[j])(slip, pressing, z, s.friction_parameters[j], force, rates)
        R, R_v, R_F = force[0], force[1], force[2]
    elif F != 0.0:
        R, R_v, R_F = friction_at(s.friction[j])(slip, pressing, s.friction_parameters[j])
    force[0], force[1], force[2] = R, R_v, R_F
    for k in range(4):
        out[1, k] = R_F * out[2, k]
    out[1, 2] += R_v
    return F, R


@kernel(types.void(f8, vector, SYSTEM, matrix))
def contact_state(t, y, s, out):
    """Fill out (n, 6): F, R, u, v, slip velocity and rate y_R' of the ground under the node."""
    y, s = borrowed(y), borrowed(s)
    n = len(s.Tx)
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    states = s.memory.max()
    force, rates = np.empty(3 + states), np.empty((states, 3 + states))
    for j in range(n):
        x, height, x_rate, height_rate = node_motion(j, y, s)
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4], out[j, 5] = node_forces(
            j, x, height, x_rate, height_rate, memory_of(j, y, s), travel, speed, s, force, rates)


@helper
def given_at(t, s, load):
    """Fill load (m,) with modal forces given in time; returns the ground's travel and speed."""
    m = len(load)
    drive_x = signal_at(s.drive[0])(t, s.drive_parameters[0])[0]
    drive_y = signal_at(s.drive[1])(t, s.drive_parameters[1])[0]
    for i in range(m):
        load[i] = (s.constant_load[i] + drive_x * s.drive_shapes[0, i]
                   + drive_y * s.drive_shapes[1, i])
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        for i in range(m):
            load[i] += value * s.load_shapes[k, i]
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    return travel, speed


@helper
def body_rates(load, y, s, out):
    """Fill out (2 m + n s,) with y' as it is without contact, under modal forces ``load``."""
    m = len(load)
    for i in range(m):
        out[i] = y[m + i]
        total = load[i]
        for k in range(m):
            total -= s.stiffness[i, k] * y[k] + s.damping[i, k] * y[m + k]
        out[m + i] = total
    for i in range(2 * m, len(out)):
        out[i] = 0.0


@helper
def rates_under(load, travel, speed, y, s, force, rates, out):
    """Fill out (2 m + n s,) with y'; ``force`` (3 + s,) and ``rates`` (s, 3 + s) are room."""
    n, m = s.Tx.shape
    states = len(rates)
    body_rates(load, y, s, out)
    for j in range(n):
        x, height, x_rate, height_rate = node_motion(j, y, s)
        F, R, _, _, _, _ = node_forces(j, x, height, x_rate, height_rate, memory_of(j, y, s),
                                       travel, speed, s, force, rates)
        if F != 0.0:
            for i in range(m):
                out[m + i] += s.Ty[j, i] * F - s.Tx[j, i] * R
        for k in range(s.memory[j]):
            out[2 * m + j * states + k] = rates[k, 0]


@kernel(types.void(f8, vector, SYSTEM, vector))
def right_hand_side(t, y, s, out):
    """Fill out (2 m + n s,) with y'."""
    y, s = borrowed(y), borrowed(s)
    states = s.memory.max()
    load = np.empty(s.Tx.shape[1])
    travel, speed = given_at(t, s, load)
    rates_under(load, travel, speed, y, s, np.empty(3 + states), np.empty((states, 3 + states)),
                out)


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


# Columns of `powers`: put in by the drive's springs, the ground's lifting, the belt and the loads;
# lost in the modes, in the dashpots at B, in the contact's damping, by friction.
POWERS = ("drive", "ground", "belt", "load", "modal_damping", "dashpots", "contact_damping",
          "friction")


@helper
def body_powers(t, y, s, out):
    """Fill out (8,) with the powers outside the contact, the others with zero."""
    m = s.Tx.shape[1]
    out[:8] = 0.0
    for axis in range(2):
        value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
        pull = s.drive_stiffness[axis] * value
        for i in range(m):
            pull -= s.drive_shapes[axis, i] * y[i]
        out[0] += pull * rate
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        for i in range(m):
            out[3] += value * s.load_shapes[k, i] * y[m + i]
    for i in range(m):
        out[3] += s.constant_load[i] * y[m + i]
        for k in range(m):
            product = y[m + i] * y[m + k]
            out[4] += s.modal_damping[i, k] * product
            out[5] += (s.damping[i, k] - s.modal_damping[i, k]) * product


@helper
def drive_jump(before, after, y, s):
    """Work that the drive puts in where its motions jump, between two times on both sides [J]."""
    work = 0.0
    for axis in range(2):
        old = signal_at(s.drive[axis])(before, s.drive_parameters[axis])[0]
        new = signal_at(s.drive[axis])(after, s.drive_parameters[axis])[0]
        pull = 0.5 * s.drive_stiffness[axis] * (old + new)
        for i in range(s.Tx.shape[1]):
            pull -= s.drive_shapes[axis, i] * y[i]
        work += pull * (new - old)
    return work


@kernel(types.void(f8, vector, SYSTEM, vector, vector))
def powers(t, y, s, out, friction):
    """Fill out (8,) with the powers and ``friction`` (n,) with that of each node's friction."""
    n = len(s.Tx)
    speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)[1]
    state = np.empty((n, 6))
    contact_state(t, y, s, state)
    body_powers(t, y, s, out)
    for j in range(n):
        force, tangential, v, slip = state[j, 0], state[j, 1], state[j, 3], state[j, 4]
        elastic = normal_at(s.normal[j])(state[j, 2], 0.0, s.normal_parameters[j])[0]
        out[1] += force * state[j, 5]
        out[2] -= tangential * speed
        out[6] += (force - elastic) * v
        friction[j] = tangential * slip
        out[7] += friction[j]
