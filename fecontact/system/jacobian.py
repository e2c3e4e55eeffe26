"""Compiled Jacobian of the reduced contact system; see :mod:`fecontact.system.kernels`."""

import numpy as np
from numba import types

from fecontact.core.compiled import block, borrowed, f8, kernel, matrix, vector
from fecontact.laws.signatures import signal_at
from fecontact.system.kernels import SYSTEM, memory_of, node_gradients, node_motion


@kernel(types.i8(f8, vector, SYSTEM, block, matrix, matrix))
def contact_gradients(t, y, s, gradients, active, out):  # type: ignore[no-untyped-def]
    """Rows of the Jacobian's contact part, for the nodes whose normal force is not zero.

    Fills ``active`` (n, 2 m) with the rows Tx, Ty of these nodes and ``gradients`` (4, n, m) with
    the derivatives of [-R, F] of each to q (first two) and to q' (last two), applied to the
    modes. Returns their number. The parts of friction with memory are put into the Jacobian
    ``out`` at once.
    """
    y, s = borrowed(y), borrowed(s)
    n, m = s.Tx.shape
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    states = s.memory.max()
    force, rates = np.empty(3 + states), np.empty((states, 3 + states))
    partial = np.empty((3, 4))
    count = 0
    for j in range(n):
        x, height, x_rate, height_rate = node_motion(j, y, s)
        F, _ = node_gradients(j, x, height, x_rate, height_rate, memory_of(j, y, s), travel, speed,
                              s, force, rates, partial)
        first = 2 * m + j * states
        for k in range(s.memory[j]):
            row = first + k
            for i in range(m):
                tx, ty = s.Tx[j, i], s.Ty[j, i]
                out[row, i] = rates[k, 2] * (partial[2, 0] * tx + partial[2, 1] * ty)
                out[row, m + i] = rates[k, 1] * tx + rates[k, 2] * (partial[2, 2] * tx
                                                                    + partial[2, 3] * ty)
                out[m + i, row] = -force[3 + k] * tx
            for other in range(s.memory[j]):
                out[row, first + other] = rates[k, 3 + other]
        if F == 0.0:
            continue
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            active[count, i] = tx
            active[count, m + i] = ty
            gradients[0, count, i] = -partial[1, 0] * tx - partial[1, 1] * ty
            gradients[1, count, i] = partial[0, 0] * tx + partial[0, 1] * ty
            gradients[2, count, i] = -partial[1, 2] * tx - partial[1, 3] * ty
            gradients[3, count, i] = partial[0, 2] * tx + partial[0, 3] * ty
        count += 1
    return count


@kernel(types.void(f8, vector, SYSTEM, matrix))
def jacobian(t, y, s, out):  # type: ignore[no-untyped-def]
    """Fill out (2 m + n s, 2 m + n s) with dy'/dy."""
    y, s = borrowed(y), borrowed(s)
    n, m = s.Tx.shape
    gradients, active = np.empty((4, n, m)), np.empty((n, 2 * m))
    out[:] = 0.0
    count = contact_gradients(t, y, s, gradients, active, out)
    for i in range(m):
        out[i, m + i] = 1.0
        for k in range(m):
            out[m + i, k] = -s.stiffness[i, k]
            out[m + i, m + k] = -s.damping[i, k]
    if count:
        Tx = np.ascontiguousarray(active[:count, :m].T)
        Ty = np.ascontiguousarray(active[:count, m:].T)
        end = 2 * m
        out[m:end, :m] += np.dot(Tx, gradients[0, :count]) + np.dot(Ty, gradients[1, :count])
        out[m:end, m:end] += np.dot(Tx, gradients[2, :count]) + np.dot(Ty, gradients[3, :count])
