"""Linear systems of collocation on intervals, solved in a time linear in their number.

On each of N intervals m d equations link the m + 1 nodes of the interval, d unknowns each, and e
unknowns common to all (period, parameters). Further rows, the borders, link everything:

    local_j [x_j0 ... x_jm, p] = r_j,  x_jm = x_(j+1)0,  x_Nm = x_00         border [x, p] = s

:func:`condense` eliminates the inner nodes of each interval; d equations A_j x_j + B_j x_(j+1) +
E_j p = .. are left of it. These are chained by eliminating x_1, x_2, ... one after the other, with
row interchanges between the neighbours, so that nothing grows however unstable the orbit is in
time. What is left links x_0, x_N and p (Doedel's scheme).
"""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import block, borrowed, f8, helper, i8, kernel, matrix, vector

Array = NDArray[np.float64]

_pivots = types.Array(i8, 2, "C")


class Factors(NamedTuple):
    """Factors of a collocation system of N intervals, m points each, d states, e common unknowns.

    local (N, m d, (m + 1) d + e), columns: inner nodes, left end, right end, common unknowns;
    chain (N - 1, 2 d, 3 d + e), columns: x_j, x_0, x_(j+1), common; end (d, 2 d + e), columns: x_0,
    x_N, common; inverse pivots stand on the diagonals.
    """

    local: Array
    local_pivots: NDArray[np.int64]
    chain: Array
    chain_pivots: NDArray[np.int64]
    end: Array


FACTORS = types.NamedTuple([block, _pivots, block, _pivots, matrix], Factors)


def factors_for(intervals: int, points: int, states: int, common: int) -> Factors:
    """Room for the factors of a system of this size."""
    N, m, d, e = intervals, points, states, common
    return Factors(
        np.empty((N, m * d, (m + 1) * d + e)), np.empty((N, (m - 1) * d), dtype=np.int64),
        np.empty((N - 1, 2 * d, 3 * d + e)), np.empty((N - 1, d), dtype=np.int64),
        np.empty((d, 2 * d + e)))


@helper
def eliminate(a, count, pivots):  # type: ignore[no-untyped-def]
    """Eliminate the first columns of a (rows, columns) in place, with row interchanges."""
    rows, columns = a.shape
    for k in range(count):
        row, largest = k, abs(a[k, k])
        for i in range(k + 1, rows):
            if abs(a[i, k]) > largest:
                row, largest = i, abs(a[i, k])
        pivots[k] = row
        if row != k:
            for c in range(columns):
                a[k, c], a[row, c] = a[row, c], a[k, c]
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        i = k + 1
        while i + 3 < rows:
            f0, f1 = a[i, k] * inverse, a[i + 1, k] * inverse
            f2, f3 = a[i + 2, k] * inverse, a[i + 3, k] * inverse
            a[i, k], a[i + 1, k], a[i + 2, k], a[i + 3, k] = f0, f1, f2, f3
            for c in range(k + 1, columns):
                pivot = a[k, c]
                a[i, c] -= f0 * pivot
                a[i + 1, c] -= f1 * pivot
                a[i + 2, c] -= f2 * pivot
                a[i + 3, c] -= f3 * pivot
            i += 4
        while i < rows:
            factor = a[i, k] * inverse
            a[i, k] = factor
            for c in range(k + 1, columns):
                a[i, c] -= factor * a[k, c]
            i += 1


@helper
def forward(a, count, pivots, r):  # type: ignore[no-untyped-def]
    """Apply to a right side r (rows,) what :func:`eliminate` did to the rows."""
    for k in range(count):
        row = pivots[k]
        r[k], r[row] = r[row], r[k]
    for i in range(1, len(r)):
        total = r[i]
        for k in range(min(i, count)):
            total -= a[i, k] * r[k]
        r[i] = total


@kernel(types.void(FACTORS))
def chain_intervals(factors):  # type: ignore[no-untyped-def]
    """Eliminate x_1, x_2, ... from the last d rows of each interval."""
    factors = borrowed(factors)
    local, chain, end = factors.local, factors.chain, factors.end
    N, size, width = local.shape
    inner = factors.local_pivots.shape[1]
    d = size - inner
    e = width - inner - 2 * d
    for i in range(d):
        for c in range(2 * d + e):
            end[i, c] = local[0, inner + i, inner + c]
    for j in range(1, N):
        a = chain[j - 1]
        for i in range(d):
            for c in range(d):
                a[i, c] = end[i, d + c]
                a[i, d + c] = end[i, c]
                a[i, 2 * d + c] = 0.0
                a[d + i, c] = local[j, inner + i, inner + c]
                a[d + i, d + c] = 0.0
                a[d + i, 2 * d + c] = local[j, inner + i, inner + d + c]
            for c in range(e):
                a[i, 3 * d + c] = end[i, 2 * d + c]
                a[d + i, 3 * d + c] = local[j, inner + i, inner + 2 * d + c]
        eliminate(a, d, factors.chain_pivots[j - 1])
        for i in range(d):
            for c in range(2 * d + e):
                end[i, c] = a[d + i, d + c]


@kernel(types.void(block, matrix, block, vector, f8, matrix, matrix, i8, FACTORS))
def condense(J, f, P, widths, T, values, slopes, with_period, factors):  # type: ignore[no-untyped-def]
    """Factorise the system of x' = T f on intervals.

    J (N m, d, d), f (N m, d) and P (N m, d, q) at the collocation points; values and slopes
    (m, m + 1) of the basis there. Rows: sum_k slopes x_k - h T f. The common unknowns are T (if
    ``with_period``) and q parameters.
    """
    J, f, P, factors = borrowed(J), borrowed(f), borrowed(P), borrowed(factors)
    local = factors.local
    N = len(widths)
    m = len(values)
    d = f.shape[1]
    q = P.shape[2]
    inner = (m - 1) * d
    for j in range(N):
        a = local[j]
        step = widths[j] * T
        for point in range(m):
            here = j * m + point
            for k in range(m + 1):
                first = inner if k == 0 else (inner + d if k == m else (k - 1) * d)
                weight = -step * values[point, k]
                slope = slopes[point, k]
                for i in range(d):
                    row = point * d + i
                    for l in range(d):
                        a[row, first + l] = weight * J[here, i, l]
                    a[row, first + i] += slope
            for i in range(d):
                row = point * d + i
                first = inner + 2 * d
                if with_period:
                    a[row, first] = -widths[j] * f[here, i]
                    first += 1
                for l in range(q):
                    a[row, first + l] = -step * P[here, i, l]
        eliminate(a, inner, factors.local_pivots[j])
    chain_intervals(factors)
