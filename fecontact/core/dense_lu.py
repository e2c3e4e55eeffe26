"""LU factors with partial pivoting of small dense matrices, for kernels.

The systems of a time step, of sticking clusters and of the ends of an orbit have a few to some
twenty unknowns and are solved inside compiled loops. Eight matrices side by side are eliminated
faster by :mod:`fecontact.bifurcation.linalg.simd_lu`.

A matrix a (rows, columns) may be wider than high, and only its first ``count`` columns may be
eliminated. The factors of the rows take the place of these, and the inverse pivots stand on the
diagonal.
"""

import numpy as np

from fecontact.core.compiled import helper


@helper
def factorise(a, count, pivots):
    """Eliminate the first columns of a (rows, columns) in place; ``pivots`` (count,) is filled."""
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
        # Four rows at a time: the pivot row is read a quarter as often.
        i = k + 1
        while i + 3 < rows:
            f0, f1 = a[i, k] * inverse, a[i + 1, k] * inverse
            f2, f3 = a[i + 2, k] * inverse, a[i + 3, k] * inverse
            a[i, k], a[i + 1, k], a[i + 2, k], a[i + 3, k] = f0, f1, f2, f3
            # Unsigned: loops over indices that might be negative are not vectorised.
            for c in range(np.uint64(k + 1), np.uint64(columns)):
                pivot = a[k, c]
                a[i, c] -= f0 * pivot
                a[i + 1, c] -= f1 * pivot
                a[i + 2, c] -= f2 * pivot
                a[i + 3, c] -= f3 * pivot
            i += 4
        while i < rows:
            factor = a[i, k] * inverse
            a[i, k] = factor
            for c in range(np.uint64(k + 1), np.uint64(columns)):
                a[i, c] -= factor * a[k, c]
            i += 1


@helper
def forward(a, count, pivots, r):
    """Apply to a right side r (rows,) what :func:`factorise` did to the rows."""
    for k in range(count):
        row = pivots[k]
        r[k], r[row] = r[row], r[k]
    for i in range(1, len(r)):
        total = r[i]
        for k in range(min(i, count)):
            total -= a[i, k] * r[k]
        r[i] = total


@helper
def forward_transposed(a, count, pivots, r):
    """The transpose of :func:`forward`."""
    for i in range(len(r) - 1, 0, -1):
        for k in range(min(i, count)):
            r[k] -= a[i, k] * r[i]
    for k in range(count - 1, -1, -1):
        row = pivots[k]
        r[k], r[row] = r[row], r[k]


@helper
def backward(a, count, r, x):
    """Fill x[:count], the other unknowns given, from the reduced right side r; x may be r."""
    for k in range(count - 1, -1, -1):
        total = r[k]
        for c in range(k + 1, len(x)):
            total -= a[k, c] * x[c]
        x[k] = total * a[k, k]


@helper
def solve(a, pivots, x):
    """Replace the right side x (k,) by the solution; a (k, k) as :func:`factorise` leaves it."""
    count = len(pivots)
    forward(a, count, pivots, x)
    backward(a, count, x, x)


@helper
def solve_rows(a, pivots, b):
    """Solve like :func:`solve` for a matrix b (k, columns) of right sides, row by row."""
    count, columns = b.shape
    for k in range(count):
        row = pivots[k]
        if row != k:
            for c in range(columns):
                b[k, c], b[row, c] = b[row, c], b[k, c]
    for k in range(count):
        for i in range(k + 1, count):
            for c in range(columns):
                b[i, c] -= a[i, k] * b[k, c]
    for k in range(count - 1, -1, -1):
        for i in range(k + 1, count):
            for c in range(columns):
                b[k, c] -= a[k, i] * b[i, c]
        for c in range(columns):
            b[k, c] *= a[k, k]


@helper
def reduce_row(a, count, row, weights):
    """Eliminate the first entries of a further row (columns,); ``weights`` (count,) says how."""
    columns = len(row)
    for k in range(count):
        factor = row[k] * a[k, k]
        weights[k] = factor
        for c in range(k + 1, columns):
            row[c] -= factor * a[k, c]


@helper
def factorise_within(a, reach, starts, pivots):
    """Factorise a matrix a (k, k) whose columns and rows end early, like :func:`factorise`.

    ``reach`` (2, k) holds the ends of the columns, which must not descend, and of the rows with
    fill-in: a row ends where the rows that may be its pivot row end. ``starts`` (k,) is filled with
    the first column of the factors of each row, for :func:`solve_within`.
    """
    count = len(pivots)
    known = 0
    for k in range(count):
        end, until = reach[0, k], reach[1, k]
        for i in range(known, end):
            starts[i] = k
        known = end
        row, largest = k, abs(a[k, k])
        for i in range(k + 1, end):
            if abs(a[i, k]) > largest:
                row, largest = i, abs(a[i, k])
        pivots[k] = row
        if row != k:
            for c in range(min(starts[k], starts[row]), until):
                a[k, c], a[row, c] = a[row, c], a[k, c]
            starts[k], starts[row] = starts[row], starts[k]
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        # Four rows at a time: the pivot row is read a quarter as often.
        i = k + 1
        while i + 3 < end:
            f0, f1 = a[i, k] * inverse, a[i + 1, k] * inverse
            f2, f3 = a[i + 2, k] * inverse, a[i + 3, k] * inverse
            a[i, k], a[i + 1, k], a[i + 2, k], a[i + 3, k] = f0, f1, f2, f3
            for c in range(np.uint64(k + 1), np.uint64(until)):
                pivot = a[k, c]
                a[i, c] -= f0 * pivot
                a[i + 1, c] -= f1 * pivot
                a[i + 2, c] -= f2 * pivot
                a[i + 3, c] -= f3 * pivot
            i += 4
        while i < end:
            factor = a[i, k] * inverse
            a[i, k] = factor
            for c in range(np.uint64(k + 1), np.uint64(until)):
                a[i, c] -= factor * a[k, c]
            i += 1


@helper
def solve_within(a, reach, starts, pivots, x):
    """Replace the right side x (k,) by the solution; see :func:`factorise_within`."""
    count = len(pivots)
    for k in range(count):
        row = pivots[k]
        x[k], x[row] = x[row], x[k]
    for i in range(1, count):
        total = x[i]
        # Unsigned: loops over indices that might be negative are not vectorised.
        for k in range(np.uint64(starts[i]), np.uint64(i)):
            total -= a[i, k] * x[k]
        x[i] = total
    for k in range(count - 1, -1, -1):
        total = x[k]
        for c in range(k + 1, reach[1, k]):
            total -= a[k, c] * x[c]
        x[k] = total * a[k, k]
