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

from fecontact.core.compiled import block, helper, integers, matrix, vector
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p.dynamics import project


class Reduced(NamedTuple):
    """The reduced system of a step.

    J = [Jq, Jv] (m, 2 m); factors (m, m) and pivots (m,) of its matrix; per node the inverse of
    G - Zz (n, s, s) and e (n, s); room to work in: (m,), (4, 2 n) and (2 m, 2 n).
    """

    J: Array
    factors: Array
    pivots: Integers
    inverse: Array
    weights: Array
    room: Array
    coefficients: Array
    answers: Array


REDUCED = types.NamedTuple(
    [matrix, matrix, integers, block, matrix, vector, matrix, matrix], Reduced)


def reduced_for(modes: int, nodes: int, states: int) -> Reduced:
    """Zeros for a system of so many modes, contact nodes and internal variables per node."""
    return Reduced(
        np.zeros((modes, 2 * modes)), np.zeros((modes, modes)), np.zeros(modes, dtype=np.int64),
        np.zeros((nodes, states, states)), np.zeros((nodes, states)), np.zeros(modes),
        np.zeros((4, 2 * nodes)), np.zeros((2 * modes, 2 * nodes)))


@helper
def eliminate_memory(G, s, g, w):
    """Fill the inverse and the weights of the nodes, by Gauss-Jordan elimination.

    The inverse itself is wanted, of a few rows that need no pivoting: G outweighs the diagonal of
    Zz, which is negative for all that relaxes.
    """
    n, states = w.weights.shape
    for j in range(n):
        inverse = w.inverse[j]
        for k in range(states):
            for other in range(states):
                inverse[k, other] = -g.rates[j, k, 3 + other]
            inverse[k, k] += G
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


@helper
def products(a, b, out):
    """Fill out[i, k] with the products of the rows a_i and b_k, two by two at a time."""
    rows, length = a.shape
    columns = len(b)
    for i in range(0, rows - 1, 2):
        for k in range(0, columns - 1, 2):
            a00, a01, a10, a11 = 0.0, 0.0, 0.0, 0.0
            for j in range(length):
                x, y = a[i, j], a[i + 1, j]
                u, v = b[k, j], b[k + 1, j]
                a00 += x * u
                a01 += x * v
                a10 += y * u
                a11 += y * v
            out[i, k], out[i, k + 1], out[i + 1, k], out[i + 1, k + 1] = a00, a01, a10, a11
        if columns % 2:
            a00, a10 = 0.0, 0.0
            for j in range(length):
                a00 += a[i, j] * b[columns - 1, j]
                a10 += a[i + 1, j] * b[columns - 1, j]
            out[i, columns - 1], out[i + 1, columns - 1] = a00, a10
    if rows % 2:
        for k in range(columns):
            total = 0.0
            for j in range(length):
                total += a[rows - 1, j] * b[k, j]
            out[rows - 1, k] = total


@helper
def set_answers(shapes, g, w):
    """Fill the answers of the node forces to the motion of each mode, (2 m, 2 n)."""
    m, rows = shapes.shape
    n = rows // 2
    states = w.weights.shape[1]
    c = w.coefficients
    for j in range(n):
        p = g.partial[j]
        pressing, slip = 0.0, 0.0
        for k in range(states):
            slip += w.weights[j, k] * g.rates[j, k, 1]
            pressing += w.weights[j, k] * g.rates[j, k, 2]
        for k in range(4):
            c[k, j] = -p[1, k] - pressing * p[2, k]
            c[k, n + j] = p[0, k]
        c[2, j] -= slip
    for k in range(m):
        for half in range(2):
            first = half * n
            for j in range(n):
                w.answers[k, first + j] = (c[0, first + j] * shapes[k, j]
                                           + c[1, first + j] * shapes[k, n + j])
            for j in range(n):
                w.answers[m + k, first + j] = (c[2, first + j] * shapes[k, j]
                                               + c[3, first + j] * shapes[k, n + j])


@helper
def assemble(s, shapes, g, w):
    """Fill J = [Jq, Jv] as shapes applied to what the modes' motion does to the node forces."""
    m = len(shapes)
    set_answers(shapes, g, w)
    products(shapes, w.answers, w.J)
    for i in range(m):
        for k in range(m):
            w.J[i, k] -= s.stiffness[i, k]
            w.J[i, m + k] -= s.damping[i, k]


@helper
def factorise_step(G, w):
    """Factorise G^2 - G Jv - Jq."""
    m = len(w.pivots)
    for i in range(m):
        for k in range(m):
            w.factors[i, k] = -G * w.J[i, m + k] - w.J[i, k]
        w.factors[i, i] += G * G
    factorise(w.factors, m, w.pivots)


@helper
def solve_stage(G, s, shapes, g, w, r, motion, out):
    """Fill ``out`` (size,) with u for the right side r; ``motion`` (3, 2 n) is room to work in."""
    m, rows = shapes.shape
    n = rows // 2
    states = w.weights.shape[1]
    x = w.room
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
            total += w.J[i, k] * r[k]
        x[i] = total
    solve(w.factors, w.pivots, x)
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
