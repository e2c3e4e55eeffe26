r"""Columns of derivatives over a part of a step, by collocation along the motion.

A column x of derivatives obeys the linear equation

.. math:: q'' = J_q q + J_v q' + f(t), \qquad x = [q, q']

with the derivatives J of the accelerations along the motion, and f for a column of a parameter.
The Radau IIA method of four stages and order seven has the accelerations at its nodes as unknowns:
one linear system of 4 m equations for all columns.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section IV.5.
"""

import numpy as np

from fecontact.core.compiled import routine
from fecontact.core.copies import put_rows
from fecontact.core.dense_lu import factorise, solve_rows
from fecontact.integrate.collocation.tableau import integrals, radau_points

STAGES = 4
NODES = radau_points(STAGES)
_ONCE = integrals(NODES)
_TWICE = _ONCE @ _ONCE
# 3! 4! / (7! 8!): the error of e^z is this times z^8.
_ERROR = 144.0 / (5040.0 * 40320.0)
# Vibrations beyond z = 10 count less and less in the estimate: they are damped, not followed.
_FILTER = 0.1


@routine
def collocate(h, J, forced, x):
    """Carry the columns x (2 m, k) over the time h.

    ``J`` (4, m, 2 m) are the derivatives of the accelerations at the nodes, ``forced`` (4, m) what
    acts on the last column there, or (0, m).
    """
    m, count = J.shape[1], x.shape[1]
    system, given = np.empty((STAGES * m, STAGES * m + count)), np.empty((STAGES * m, 2 * m))
    right = np.empty((STAGES * m, count))
    for i in range(STAGES):
        ahead = h * NODES[i]
        for row in range(m):
            by_place, by_speed = J[i, row, :m], J[i, row, m:]
            out = given[i * m + row]
            for k in range(m):
                out[k] = by_place[k]
            faster = out[m:]
            for k in range(m):
                faster[k] = by_speed[k] + ahead * by_place[k]
            for stage in range(STAGES):
                once, twice = -h * _ONCE[i, stage], -h * h * _TWICE[i, stage]
                entries = system[i * m + row, stage * m : (stage + 1) * m]
                for k in range(m):
                    entries[k] = once * by_speed[k] + twice * by_place[k]
            system[i * m + row, i * m + row] += 1.0
    np.dot(given, x, right)
    for i in range(len(forced)):
        for row in range(m):
            right[i * m + row, count - 1] += forced[i, row]
    put_rows(right, system[:, STAGES * m :])
    _solve(system, right)
    for row in range(m):
        place, speed = x[row], x[m + row]
        for c in range(count):
            place[c] += h * speed[c]
        for stage in range(STAGES):
            once, twice = h * _ONCE[STAGES - 1, stage], h * h * _TWICE[STAGES - 1, stage]
            acceleration = right[stage * m + row]
            for c in range(count):
                place[c] += twice * acceleration[c]
                speed[c] += once * acceleration[c]


@routine
def _solve(system, out):
    """Fill out (4 m, k) with the solution of the linear system [K, b] (4 m, 4 m + k).

    By blocks of the size of the modes, for products of matrices are several times faster than
    elimination row by row; pivots are sought within the blocks of the diagonal, which are
    near the unit matrix for all but strong dampers.
    """
    m = len(system) // STAGES
    pivots = np.empty(m, dtype=np.int64)
    rest = system
    for stage in range(STAGES):
        own, ahead = rest[:m, :m].copy(), rest[:m, m:].copy()
        factorise(own, m, pivots)
        solve_rows(own, pivots, ahead)
        put_rows(ahead, system[stage * m : (stage + 1) * m, (stage + 1) * m :])
        if stage < STAGES - 1:
            rest = rest[m:, m:] - np.dot(rest[m:, :m].copy(), ahead)
    put_rows(system[:, STAGES * m :], out)
    for stage in range(STAGES - 2, -1, -1):
        first = (stage + 1) * m
        later = np.dot(system[first - m : first, first : STAGES * m].copy(), out[first:])
        for row in range(m):
            for c in range(out.shape[1]):
                out[first - m + row, c] -= later[row, c]


@routine
def expected_error(h, J, x, rate, ahead, out):
    r"""Fill ``out`` (2 m, k) with the error of the columns x over the time h, for a constant J.

    Its first term, a constant times :math:`h (h J)^7 x'` with the rates x', where h J is replaced
    by :math:`h J F^{10/7}`, :math:`F = (I - h J / 10)^{-1}`, which is bounded. ``ahead`` is filled
    with x + h F x': about how large the columns become, as vibration that starts with displacements
    has large velocities later.
    """
    m = J.shape[0]
    F, reduced = np.empty((2 * m, 2 * m)), np.empty((m, m))
    pivots, speeds = np.empty(m, dtype=np.int64), np.empty((m, 2 * m))
    g = _FILTER * h
    for i in range(m):
        for k in range(m):
            reduced[i, k] = -g * J[i, m + k] - g * g * J[i, k]
            speeds[i, k] = g * J[i, k]
            speeds[i, m + k] = 0.0
        reduced[i, i] += 1.0
        speeds[i, m + i] = 1.0
    factorise(reduced, m, pivots)
    solve_rows(reduced, pivots, speeds)
    for i in range(m):
        for k in range(2 * m):
            F[m + i, k] = speeds[i, k]
            F[i, k] = g * speeds[i, k]
        F[i, i] += 1.0
    np.dot(F, rate, ahead)
    for k in range(2 * m):
        for c in range(x.shape[1]):
            ahead[k, c] = x[k, c] + h * ahead[k, c]
    # A tenth of h J F; F commutes with J.
    one, two, other = F.copy(), np.empty((2 * m, 2 * m)), np.empty((2 * m, 2 * m))
    for i in range(2 * m):
        one[i, i] -= 1.0
    np.dot(one, one, other)
    np.dot(other, F, two)
    np.dot(two, two, other)
    np.dot(other, two, F)
    np.dot(F, one, other)
    np.dot(other, rate, out)
    out *= h * _ERROR / _FILTER ** 7
