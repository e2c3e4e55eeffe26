"""Linear systems of an implicit step, reduced to the size of the modes.

With G = 1 / (h gamma) a stage solves (G - J) u = r for u = [u_q, u_v, u_z]. The parts of J are

    q' = v                  v' = Jq q + Jv v - sum_j Tx_j R_z z_j          z' = Zw w + Zz z

with w the place and velocity of the node. Per node z is eliminated,

    u_z = (G - Zz)^-1 (r_z + Zw w),

which adds e Zw, e = R_z (G - Zz)^-1, to the derivatives of the friction force; and u_q = (r_q +
u_v) / G leaves

    (G^2 - G Jv - Jq) u_v = G (r_v - sum_j Tx_j e_j r_z) + Jq r_q.
"""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import block, integers, matrix
from fecontact.integrate.borrowed import inlined
from fecontact.integrate.motion import project

Array = NDArray[np.float64]


class Reduced(NamedTuple):
    """The reduced system of a step.

    Jq, Jv (m, m); factors (m, m) and pivots (m,) of its matrix; per node the inverse of G - Zz
    (n, s, s) and e (n, s); room to work in: (16, m).
    """

    Jq: Array
    Jv: Array
    factors: Array
    pivots: NDArray[np.int64]
    inverse: Array
    weights: Array
    room: Array


REDUCED = types.NamedTuple([matrix, matrix, matrix, integers, block, matrix, matrix], Reduced)


@inlined
def factorise(a, pivots):  # type: ignore[no-untyped-def]
    """LU factors of a (k, k) in place, with row interchanges; the diagonal is inverted."""
    size = len(pivots)
    for k in range(size):
        row, largest = k, abs(a[k, k])
        for i in range(k + 1, size):
            if abs(a[i, k]) > largest:
                row, largest = i, abs(a[i, k])
        pivots[k] = row
        if row != k:
            for c in range(size):
                a[k, c], a[row, c] = a[row, c], a[k, c]
        a[k, k] = 1.0 / a[k, k]
        for i in range(k + 1, size):
            factor = a[i, k] * a[k, k]
            a[i, k] = factor
            for c in range(k + 1, size):
                a[i, c] -= factor * a[k, c]


@inlined
def back_substitute(a, pivots, x):  # type: ignore[no-untyped-def]
    """Solve in place with the factors of :func:`factorise`."""
    size = len(pivots)
    for k in range(size):
        row = pivots[k]
        x[k], x[row] = x[row], x[k]
    for i in range(1, size):
        total = x[i]
        for k in range(i):
            total -= a[i, k] * x[k]
        x[i] = total
    for i in range(size - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, size):
            total -= a[i, k] * x[k]
        x[i] = total * a[i, i]


@inlined
def eliminate_memory(G, s, g, w):  # type: ignore[no-untyped-def]
    """Fill the inverse and the weights of the nodes, by Gauss-Jordan elimination."""
    n, states = w.weights.shape
    for j in range(n):
        inverse = w.inverse[j]
        for k in range(states):
            for other in range(states):
                inverse[k, other] = -g.rates[j, k, 3 + other]
            inverse[k, k] += G
        # G outweighs the diagonal of Zz, which is negative for all that relaxes.
        for k in range(states):
            pivot = 1.0 / inverse[k, k]
            inverse[k, k] = 1.0
            for c in range(states):
                inverse[k, c] *= pivot
            for i in range(states):
                if i != k:
                    factor = inverse[i, k]
                    inverse[i, k] = 0.0
                    for c in range(states):
                        inverse[i, c] -= factor * inverse[k, c]
        for k in range(states):
            total = 0.0
            for other in range(s.memory[j]):
                total += g.force[j, 3 + other] * inverse[other, k]
            w.weights[j, k] = total


@inlined
def assemble(s, g, w):  # type: ignore[no-untyped-def]
    """Fill Jq and Jv, four nodes at a time."""
    n, m = s.Tx.shape
    states = w.weights.shape[1]
    Jq, Jv, room = w.Jq, w.Jv, w.room
    for i in range(m):
        for k in range(m):
            Jq[i, k] = -s.stiffness[i, k]
            Jv[i, k] = -s.damping[i, k]
    for first in range(0, n, 4):
        count = min(4, n - first)
        for node in range(count):
            j = first + node
            p = g.partial[j]
            through_pressing, through_slip = 0.0, 0.0
            for k in range(states):
                through_slip += w.weights[j, k] * g.rates[j, k, 1]
                through_pressing += w.weights[j, k] * g.rates[j, k, 2]
            R_x = p[1, 0] + through_pressing * p[2, 0]
            R_y = p[1, 1] + through_pressing * p[2, 1]
            R_vx = p[1, 2] + through_pressing * p[2, 2] + through_slip
            R_vy = p[1, 3] + through_pressing * p[2, 3]
            for k in range(m):
                tx, ty = s.Tx[j, k], s.Ty[j, k]
                room[4 * node, k] = -R_x * tx - R_y * ty
                room[4 * node + 1, k] = p[0, 0] * tx + p[0, 1] * ty
                room[4 * node + 2, k] = -R_vx * tx - R_vy * ty
                room[4 * node + 3, k] = p[0, 2] * tx + p[0, 3] * ty
        if count == 4:
            for i in range(m):
                x0, x1 = s.Tx[first, i], s.Tx[first + 1, i]
                x2, x3 = s.Tx[first + 2, i], s.Tx[first + 3, i]
                y0, y1 = s.Ty[first, i], s.Ty[first + 1, i]
                y2, y3 = s.Ty[first + 2, i], s.Ty[first + 3, i]
                for k in range(m):
                    Jq[i, k] += (x0 * room[0, k] + y0 * room[1, k] + x1 * room[4, k]
                                 + y1 * room[5, k] + x2 * room[8, k] + y2 * room[9, k]
                                 + x3 * room[12, k] + y3 * room[13, k])
                    Jv[i, k] += (x0 * room[2, k] + y0 * room[3, k] + x1 * room[6, k]
                                 + y1 * room[7, k] + x2 * room[10, k] + y2 * room[11, k]
                                 + x3 * room[14, k] + y3 * room[15, k])
        else:
            for node in range(count):
                for i in range(m):
                    tx, ty = s.Tx[first + node, i], s.Ty[first + node, i]
                    for k in range(m):
                        Jq[i, k] += tx * room[4 * node, k] + ty * room[4 * node + 1, k]
                        Jv[i, k] += tx * room[4 * node + 2, k] + ty * room[4 * node + 3, k]


@inlined
def factorise_step(G, w):  # type: ignore[no-untyped-def]
    """Factorise G^2 - G Jv - Jq."""
    m = len(w.pivots)
    for i in range(m):
        for k in range(m):
            w.factors[i, k] = -G * w.Jv[i, k] - w.Jq[i, k]
        w.factors[i, i] += G * G
    factorise(w.factors, w.pivots)


@inlined
def solve_stage(G, s, shapes, g, w, r, motion, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` (size,) with u for the right side r; ``motion`` (3, 2 n) is room to work in."""
    m, rows = shapes.shape
    n = rows // 2
    states = w.weights.shape[1]
    x = w.room[0]
    if states > 0:
        for j in range(n):
            total = 0.0
            for k in range(states):
                total += w.weights[j, k] * r[2 * m + j * states + k]
            motion[2, j] = -total
    for i in range(m):
        total = r[m + i]
        if states > 0:
            for j in range(n):
                total += shapes[i, j] * motion[2, j]
        total *= G
        for k in range(m):
            total += w.Jq[i, k] * r[k]
        x[i] = total
    back_substitute(w.factors, w.pivots, x)
    for i in range(m):
        out[m + i] = x[i]
        out[i] = (r[i] + x[i]) / G
    if states == 0:
        return
    project(shapes, out, motion[0], motion[1])
    for j in range(n):
        p = g.partial[j, 2]
        pressing = (p[0] * motion[0, j] + p[1] * motion[0, n + j] + p[2] * motion[1, j]
                    + p[3] * motion[1, n + j])
        first = 2 * m + j * states
        for k in range(states):
            total = 0.0
            for other in range(states):
                total += w.inverse[j, k, other] * (
                    r[first + other] + g.rates[j, other, 1] * motion[1, j]
                    + g.rates[j, other, 2] * pressing)
            out[first + k] = total
