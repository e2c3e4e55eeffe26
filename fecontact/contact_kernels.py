"""Compiled right-hand side and Jacobian of the reduced contact system.

State y = [q, q'] of m modes. With x = Tx q and y = Ty q at the n contact nodes, per node j

    xi = X_j + x_j - travel(t)      u_j = y_R(xi) - y_j - g_j      v_j = u_j'
    F_j = normal(u_j, v_j)          R_j = friction(x_j' - V, F_j)
    q'' = -K q - C q' + T^T f,      f_j = [-R_j, F_j]

where K and C hold the modes' own stiffness and damping and the springs and dashpots at B.
"""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import block, f8, helper, i8, kernel, matrix, vector
from fecontact.laws.contract import friction_at, ground_at, signal_at, normal_at

Array = NDArray[np.float64]


class SystemArrays(NamedTuple):
    """A contact system as the kernels see it: arrays, and laws by address."""

    stiffness: Array
    damping: Array
    constant_load: Array
    drive_shapes: Array
    drive_stiffness: Array
    Tx: Array
    Ty: Array
    abscissa: Array
    gap: Array
    normal_parameters: Array
    friction_parameters: Array
    profile_parameters: Array
    ground_motion_parameters: Array
    drive_parameters: Array
    normal: int
    friction: int
    profile: int
    ground_motion: int
    drive: int


_ARRAYS = types.NamedTuple(
    [matrix, matrix, vector, matrix, vector, matrix, matrix, vector, vector, matrix, matrix, vector,
     vector, matrix, i8, i8, i8, i8, i8], SystemArrays)

# Columns of the per-node results of `contact_state`.
NORMAL_FORCE, FRICTION_FORCE, PENETRATION, PENETRATION_RATE, SLIP_VELOCITY, GROUND_RATE = range(6)
STATE_COLUMNS = 6


@helper
def _motion_of(j, y, s):  # type: ignore[no-untyped-def]
    """Displacement along and away from the ground of node j, and their rates."""
    m = s.Tx.shape[1]
    x, height, x_rate, height_rate = 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        x += s.Tx[j, i] * y[i]
        height += s.Ty[j, i] * y[i]
        x_rate += s.Tx[j, i] * y[m + i]
        height_rate += s.Ty[j, i] * y[m + i]
    return x, height, x_rate, height_rate


@kernel(types.void(f8, vector, _ARRAYS, matrix))
def contact_state(t, y, s, out):  # type: ignore[no-untyped-def]
    """Fill out (n, 6): F, R, u, v, slip velocity and rate y_R' of the ground under the node."""
    n = len(s.Tx)
    normal, friction = normal_at(s.normal), friction_at(s.friction)
    profile = ground_at(s.profile)
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    for j in range(n):
        x, height, x_rate, height_rate = _motion_of(j, y, s)
        ground, slope, _ = profile(s.abscissa[j] + x - travel, s.profile_parameters)
        slip = x_rate - speed
        u = ground - height - s.gap[j]
        v = slope * slip - height_rate
        force = normal(u, v, s.normal_parameters[j])[0]
        out[j, 0] = force
        out[j, 1] = friction(slip, force, s.friction_parameters[j])[0]
        out[j, 2] = u
        out[j, 3] = v
        out[j, 4] = slip
        out[j, 5] = slope * slip


@kernel(types.void(f8, vector, _ARRAYS, vector))
def right_hand_side(t, y, s, out):  # type: ignore[no-untyped-def]
    """Fill out (2 m,) with y'."""
    n, m = s.Tx.shape
    normal, friction = normal_at(s.normal), friction_at(s.friction)
    profile, drive = ground_at(s.profile), signal_at(s.drive)
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    drive_x = drive(t, s.drive_parameters[0])[0]
    drive_y = drive(t, s.drive_parameters[1])[0]
    for i in range(m):
        out[i] = y[m + i]
        total = (s.constant_load[i] + drive_x * s.drive_shapes[0, i]
                 + drive_y * s.drive_shapes[1, i])
        for k in range(m):
            total -= s.stiffness[i, k] * y[k] + s.damping[i, k] * y[m + k]
        out[m + i] = total
    for j in range(n):
        x, height, x_rate, height_rate = _motion_of(j, y, s)
        ground, slope, _ = profile(s.abscissa[j] + x - travel, s.profile_parameters)
        slip = x_rate - speed
        force = normal(ground - height - s.gap[j], slope * slip - height_rate,
                       s.normal_parameters[j])[0]
        if force > 0.0:
            tangential = friction(slip, force, s.friction_parameters[j])[0]
            for i in range(m):
                out[m + i] += s.Ty[j, i] * force - s.Tx[j, i] * tangential


@kernel(types.i8(f8, vector, _ARRAYS, block, matrix))
def contact_gradients(t, y, s, gradients, active):  # type: ignore[no-untyped-def]
    """Rows of the Jacobian's contact part, for the nodes whose normal force is not zero.

    Fills ``active`` (n, 2 m) with the rows Tx, Ty of these nodes and ``gradients`` (4, n, m) with
    the derivatives of [-R, F] of each to q (first two) and to q' (last two), applied to the
    modes. Returns their number.
    """
    n, m = s.Tx.shape
    normal, friction = normal_at(s.normal), friction_at(s.friction)
    profile = ground_at(s.profile)
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    count = 0
    for j in range(n):
        x, height, x_rate, height_rate = _motion_of(j, y, s)
        ground, slope, curvature = profile(s.abscissa[j] + x - travel, s.profile_parameters)
        slip = x_rate - speed
        force, force_u, force_v = normal(ground - height - s.gap[j], slope * slip - height_rate,
                                         s.normal_parameters[j])
        if force <= 0.0:
            continue
        _, R_v, R_F = friction(slip, force, s.friction_parameters[j])
        F_x = force_u * slope + force_v * curvature * slip
        F_xrate = force_v * slope
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            F_q = F_x * tx - force_u * ty
            F_rate = F_xrate * tx - force_v * ty
            active[count, i] = tx
            active[count, m + i] = ty
            gradients[0, count, i] = -R_F * F_q
            gradients[1, count, i] = F_q
            gradients[2, count, i] = -R_v * tx - R_F * F_rate
            gradients[3, count, i] = F_rate
        count += 1
    return count


@kernel(types.void(f8, vector, _ARRAYS, matrix))
def jacobian(t, y, s, out):  # type: ignore[no-untyped-def]
    """Fill out (2 m, 2 m) with dy'/dy."""
    n, m = s.Tx.shape
    gradients, active = np.empty((4, n, m)), np.empty((n, 2 * m))
    count = contact_gradients(t, y, s, gradients, active)
    out[:m] = 0.0
    for i in range(m):
        out[i, m + i] = 1.0
        for k in range(m):
            out[m + i, k] = -s.stiffness[i, k]
            out[m + i, m + k] = -s.damping[i, k]
    if count:
        Tx = np.ascontiguousarray(active[:count, :m].T)
        Ty = np.ascontiguousarray(active[:count, m:].T)
        out[m:, :m] += np.dot(Tx, gradients[0, :count]) + np.dot(Ty, gradients[1, :count])
        out[m:, m:] += np.dot(Tx, gradients[2, :count]) + np.dot(Ty, gradients[3, :count])


@kernel(types.void(vector, matrix, _ARRAYS, block))
def contact_history(times, states, s, out):  # type: ignore[no-untyped-def]
    """Fill out (N, n, 6) with `contact_state` at N times."""
    for k in range(len(times)):
        contact_state(times[k], states[k], s, out[k])


# Columns of `powers`.
POWERS = ("drive", "ground", "belt", "modal_damping", "dashpots", "contact_damping", "friction")


@kernel(types.void(f8, vector, _ARRAYS, matrix, matrix, vector))
def powers(t, y, s, modal_damping, dashpots, out):  # type: ignore[no-untyped-def]
    """Fill out (7,) with the powers put in by drive, ground lifting and belt, and those lost.

    ``modal_damping`` (m, m) and ``dashpots`` (m, m) are the two parts of the damping matrix.
    """
    n, m = s.Tx.shape
    normal = normal_at(s.normal)
    drive = signal_at(s.drive)
    speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)[1]
    state = np.empty((n, 6))
    contact_state(t, y, s, state)
    out[:] = 0.0
    for axis in range(2):
        value, rate = drive(t, s.drive_parameters[axis])
        pull = s.drive_stiffness[axis] * value
        for i in range(m):
            pull -= s.drive_shapes[axis, i] * y[i]
        out[0] += pull * rate
    for i in range(m):
        for k in range(m):
            product = y[m + i] * y[m + k]
            out[3] += modal_damping[i, k] * product
            out[4] += dashpots[i, k] * product
    for j in range(n):
        force, tangential, v, slip = state[j, 0], state[j, 1], state[j, 3], state[j, 4]
        if force > 0.0 or state[j, 2] > 0.0:
            elastic = normal(state[j, 2], 0.0, s.normal_parameters[j])[0]
            out[1] += force * state[j, 5]
            out[2] -= tangential * speed
            out[5] += (force - elastic) * v
            out[6] += tangential * slip


@kernel(types.void(i8, vector, vector, matrix, vector, vector))
def normal_values(address, u, v, p, force, slope):  # type: ignore[no-untyped-def]
    """Fill force and dF/du (k,) of a normal law at k penetrations and rates."""
    law = normal_at(address)
    for j in range(len(u)):
        force[j], slope[j], _ = law(u[j], v[j], p[j])
