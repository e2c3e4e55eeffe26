"""Compiled right-hand side and Jacobian of a contact system at many states.

The equations of :mod:`fecontact.contact_kernels`; both from one pass over the nodes, and nothing
is allocated per state.
"""

import numpy as np
from numba import types

from fecontact.compiled import block, borrowed, kernel, matrix, vector
from fecontact.contact_kernels import (
    SYSTEM,
    body_rates,
    given_at,
    memory_of,
    node_gradients,
    node_motion,
    rates_under,
)


@kernel(types.void(vector, matrix, SYSTEM, matrix))
def batch_rates(t, x, s, f):  # type: ignore[no-untyped-def]
    """Fill f (N, 2 m + n s) with y' at times t (N,) and states x (N, 2 m + n s)."""
    t, x, s, f = borrowed(t), borrowed(x), borrowed(s), borrowed(f)
    states = s.memory.max()
    force, rates = np.empty(3 + states), np.empty((states, 3 + states))
    load, travel, speed = np.empty(s.Tx.shape[1]), 0.0, 0.0
    for c in range(len(t)):
        if c == 0 or t[c] != t[c - 1]:
            travel, speed = given_at(t[c], s, load)
        rates_under(load, travel, speed, x[c], s, force, rates, f[c])


@kernel(types.void(vector, matrix, SYSTEM, matrix, block))
def batch_derivatives(t, x, s, f, J):  # type: ignore[no-untyped-def]
    """As :func:`batch_rates`, and fill J (N, d, d), d = 2 m + n s, with dy'/dy."""
    t, x, s, f, J = borrowed(t), borrowed(x), borrowed(s), borrowed(f), borrowed(J)
    n, m = s.Tx.shape
    states = s.memory.max()
    force, rates = np.empty(3 + states), np.empty((states, 3 + states))
    partial, gradient = np.empty((3, 4)), np.empty((2, 2 * m))
    load, travel, speed = np.empty(m), 0.0, 0.0
    for c in range(len(t)):
        y, out, A = x[c], f[c], J[c]
        if c == 0 or t[c] != t[c - 1]:
            travel, speed = given_at(t[c], s, load)
        A[:, :] = 0.0
        body_rates(load, y, s, out)
        for i in range(m):
            A[i, m + i] = 1.0
            for k in range(m):
                A[m + i, k] = -s.stiffness[i, k]
                A[m + i, m + k] = -s.damping[i, k]
        for j in range(n):
            along, height, along_rate, height_rate = node_motion(j, y, s)
            F, R = node_gradients(j, along, height, along_rate, height_rate, memory_of(j, y, s),
                                  travel, speed, s, force, rates, partial)
            first = 2 * m + j * states
            for k in range(s.memory[j]):
                row = first + k
                out[row] = rates[k, 0]
                for i in range(m):
                    tx, ty = s.Tx[j, i], s.Ty[j, i]
                    A[row, i] = rates[k, 2] * (partial[2, 0] * tx + partial[2, 1] * ty)
                    A[row, m + i] = rates[k, 1] * tx + rates[k, 2] * (partial[2, 2] * tx
                                                                      + partial[2, 3] * ty)
                    A[m + i, row] = -force[3 + k] * tx
                for other in range(s.memory[j]):
                    A[row, first + other] = rates[k, 3 + other]
            if F == 0.0:
                continue
            for k in range(m):
                tx, ty = s.Tx[j, k], s.Ty[j, k]
                for part in range(2):
                    gradient[0, part * m + k] = (-partial[1, 2 * part] * tx
                                                 - partial[1, 2 * part + 1] * ty)
                    gradient[1, part * m + k] = (partial[0, 2 * part] * tx
                                                 + partial[0, 2 * part + 1] * ty)
            for i in range(m):
                tx, ty = s.Tx[j, i], s.Ty[j, i]
                out[m + i] += ty * F - tx * R
                for k in range(2 * m):
                    A[m + i, k] += tx * gradient[0, k] + ty * gradient[1, k]
