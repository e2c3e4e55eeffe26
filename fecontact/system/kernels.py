"""Compiled right-hand side of the reduced contact system.

State y = [q, q', z] of m modes and, node by node, the internal variables of friction with memory.
With x, y = T q at the n contact nodes, per node j

    xi = X_j + x_j - travel_j(t)    u_j = y_R(xi) - y_j - g_j      v_j = u_j'
    F_j = normal(u_j, v_j)          R_j = friction(x_j' - V_j, s(xi) |F_j|, z_j)
    q'' = -K q - C q' - V'(q) + T^T f,      f_j = [-T_j, F_j]
    T_j = R_j + F_j y_R'(xi)

where K and C hold the modes' own stiffness and damping and the springs and dashpots at B, and s is
the variation of friction along the ground. V is the potential of large deflections, see
:mod:`fecontact.system.polynomial_forces`. T has no second part where contact forces stay vertical.
Rows of nodes between two bodies are those of their relative motion; y_R is zero there. One motion
moves all other sides, by a factor each: travel_j = c_j travel, V_j = c_j V.

In space x is the displacement along the first tangent of a node, y that along its normal, and a
second tangent follows. Friction is a vector, the ground a surface, and two motions move the other
sides, by factors for both tangents. All that has entries for the second tangent has them last, so
that the first ones are the same in the plane.
"""

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.types import Array
from fecontact.laws.signatures import signal_at
from fecontact.system.columns import (
    FRICTION_ACROSS,
    FRICTION_FORCE,
    GROUND_RATE,
    NORMAL_FORCE,
    PENETRATION,
    PENETRATION_RATE,
    SLIP_ACROSS,
    SLIP_VELOCITY,
    SPACE_STATE_COLUMNS,
    STATE_COLUMNS,
)
from fecontact.system.node_forces import axis_force, force_workspace, friction_entry, node_forces
from fecontact.system.nodes import SystemArrays, ground_motion, memory_of, node_motion
from fecontact.system.polynomial_forces import add_polynomial_forces, has_polynomial


def state_columns(arrays: SystemArrays) -> int:
    """Number of columns of the per-node results of a system."""
    return SPACE_STATE_COLUMNS if arrays.rows.shape[1] > 2 else STATE_COLUMNS


@routine
def _contact_state(t, y, s, out):
    """Fill out (n, 6): F, R, u, v, slip velocity and rate y_R' of the ground under the node.

    In space (n, 8): with friction force and slip velocity along the second tangent.
    """
    n, d, _ = s.rows.shape
    moved = ground_motion(t, s)
    force, rates = force_workspace(s)
    for j in range(n):
        node = node_forces(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force, rates)
        contact, row = node.contact, out[j]
        row[NORMAL_FORCE], row[GROUND_RATE] = node.normal, 0.0
        row[PENETRATION], row[PENETRATION_RATE] = contact.penetration, contact.rate
        for tangent in range(d - 1):
            R, slip = force[friction_entry(tangent, len(rates))], contact.slip[tangent]
            row[FRICTION_ACROSS if tangent else FRICTION_FORCE] = R
            row[SLIP_ACROSS if tangent else SLIP_VELOCITY] = slip
            row[GROUND_RATE] += contact.slope[tangent] * slip


@helper
def set_constant_load(s, load):
    """Fill load (m,) with the modal forces of the constant loads."""
    for i in range(len(load)):
        load[i] = s.constant_load[i]


@helper
def add_drive_force(drive_force, axis, s, load):
    """Add the modal forces of a pull of the drive along an axis."""
    for i in range(len(load)):
        load[i] += drive_force * s.drive_shapes[axis, i]


@helper
def add_loads(t, s, load):
    """Add the modal forces of the loads in time."""
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        for i in range(len(load)):
            load[i] += value * s.load_shapes[k, i]


@helper
def drive_pull(axis, t, s):
    """Force on B at rest at time t, by spring and dashpot to an end that moves."""
    value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
    return s.drive_stiffness[axis] * value + s.drive_damping[axis] * rate


@helper
def prescribed_at(t, s, load):
    """Fill load (m,) with modal forces given in time; returns the motion of the ground."""
    set_constant_load(s, load)
    for axis in range(len(s.drive)):
        add_drive_force(drive_pull(axis, t, s), axis, s, load)
    add_loads(t, s, load)
    return ground_motion(t, s)


@helper
def linear_acceleration(load, y, s, out):
    """Fill out (m,) with q'' by matrices and modal forces ``load``, which may be out."""
    m = len(load)
    for i in range(m):
        total = load[i]
        for k in range(m):
            total -= s.stiffness[i, k] * y[k] + s.damping[i, k] * y[m + k]
        out[i] = total


@helper
def body_acceleration(load, y, s, out):
    """Fill out (m,) with q'' without contact, under modal forces ``load``, which may be out."""
    linear_acceleration(load, y, s, out)
    if has_polynomial(s):
        add_polynomial_forces(y, s, out)


@helper
def linear_rates(load, y, s, out):
    """Fill out (2 m + n s,) with y' by matrices and modal forces ``load``."""
    m = len(load)
    for i in range(m):
        out[i] = y[m + i]
    linear_acceleration(load, y, s, out[m : 2 * m])
    for i in range(2 * m, len(out)):
        out[i] = 0.0


@helper
def rates_under(load, moved, y, s, force, rates, out):
    """Fill out (2 m + n s,) with y'; ``force`` and ``rates`` are work arrays of friction."""
    n, d, m = s.rows.shape
    states = len(rates)
    linear_rates(load, y, s, out)
    if has_polynomial(s):
        add_polynomial_forces(y, s, out[m : 2 * m])
    for j in range(n):
        node = node_forces(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force, rates)
        if node.normal != 0.0:
            for axis in range(d):
                push = axis_force(axis, node, force, rates, s)
                for i in range(m):
                    out[m + i] += s.rows[j, axis, i] * push
        for k in range(s.memory[j]):
            out[2 * m + j * states + k] = rates[k, 0]


@kernel(nogil=True)
def right_hand_side(t: float, y: Vector, s: SystemArrays, out: Vector) -> None:
    """Fill out (2 m + n s,) with y'."""
    load = np.empty(s.rows.shape[2])
    moved = prescribed_at(t, s, load)
    force, rates = force_workspace(s)
    rates_under(load, moved, y, s, force, rates, out)


@kernel(nogil=True)
def contact_history(times: Vector, states: Matrix, s: SystemArrays, out: Block) -> None:
    """Fill out (N, n, 6) with F, R, u, v, slip velocity and y_R' under the nodes at N times.

    In space (N, n, 8): with friction force and slip velocity along the second tangent.
    """
    for k in range(len(times)):
        _contact_state(times[k], states[k], s, out[k])


def contact_at(time: float, state: Array, arrays: SystemArrays) -> Array:
    """The row of :func:`contact_history` (n, 6), in space (n, 8), of one state."""
    out = np.empty((1, len(arrays.gap), state_columns(arrays)))
    contact_history(np.array([float(time)]), state[None], arrays, out)
    return out[0]
