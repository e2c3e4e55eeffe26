"""Solutions of condensed collocation systems with further rows, the borders."""

import numpy as np
from numba import types

from fecontact.bifurcation.elimination import FACTORS, eliminate, forward
from fecontact.compiled import block, borrowed, f8, helper, kernel, matrix, vector


@helper
def _reduce_row(a, count, row, weights):  # type: ignore[no-untyped-def]
    """Eliminate the first entries of a further row (columns,); ``weights`` (count,) says how."""
    columns = len(row)
    for k in range(count):
        factor = row[k] * a[k, k]
        weights[k] = factor
        for c in range(k + 1, columns):
            row[c] -= factor * a[k, c]


@kernel(types.void(FACTORS, vector, matrix, matrix, vector))
def reduce_border(factors, given, local_weights, chain_weights, small):  # type: ignore[no-untyped-def]
    """Reduce a border ``given`` (N m d + e,) to x_0, x_N and the common unknowns.

    Fills ``small`` (2 d + e,), and with ``local_weights`` (N, (m - 1) d) and ``chain_weights``
    (N - 1, d) what its right side loses by it, as multiples of the reduced right sides.
    """
    factors, given, small = borrowed(factors), borrowed(given), borrowed(small)
    local_weights, chain_weights = borrowed(local_weights), borrowed(chain_weights)
    local, chain = factors.local, factors.chain
    N, size, width = local.shape
    inner = factors.local_pivots.shape[1]
    d = size - inner
    e = width - inner - 2 * d
    row, link = np.empty(width), np.zeros(3 * d + e)
    for c in range(d):
        link[d + c] = given[c]
    for c in range(e):
        link[3 * d + c] = given[N * size + c]
    for j in range(N):
        first = j * size + d
        for c in range(inner):
            row[c] = given[first + c]
        for c in range(d):
            # Until its interval is reached, x_j stands in the place of x_(j+1).
            row[inner + c] = link[2 * d + c]
            row[inner + d + c] = 0.0
        for c in range(e):
            row[inner + 2 * d + c] = link[3 * d + c]
        _reduce_row(local[j], inner, row, local_weights[j])
        for c in range(e):
            link[3 * d + c] = row[inner + 2 * d + c]
        for c in range(d):
            link[2 * d + c] = 0.0
        if j == 0:
            for c in range(d):
                link[d + c] += row[inner + c]
        else:
            for c in range(d):
                link[c] = row[inner + c] + given[j * size + c]
            _reduce_row(chain[j - 1], d, link, chain_weights[j - 1])
        for c in range(d):
            link[2 * d + c] += row[inner + d + c]
    for c in range(2 * d + e):
        small[c] = link[d + c]


@kernel(types.void(FACTORS, vector, block, block, matrix, matrix, vector))
def reduce_side(factors, rhs, local_weights, chain_weights, reduced, chained, side):  # type: ignore[no-untyped-def]
    """Reduce the right side ``rhs`` (N m d + b,) of the collocation rows and b borders.

    Fills ``side`` (d + b,), that of the d rows of ``factors.end`` and of the reduced borders, and
    what :func:`expand` needs: ``reduced`` (N, m d), ``chained`` (N - 1, 2 d). The weights (b, ..)
    are those of :func:`reduce_border`.
    """
    factors, rhs, side = borrowed(factors), borrowed(rhs), borrowed(side)
    reduced, chained = borrowed(reduced), borrowed(chained)
    local_weights, chain_weights = borrowed(local_weights), borrowed(chain_weights)
    local, chain = factors.local, factors.chain
    N, size, _ = local.shape
    inner = factors.local_pivots.shape[1]
    d = size - inner
    for j in range(N):
        r = reduced[j]
        for i in range(size):
            r[i] = rhs[j * size + i]
        forward(local[j], inner, factors.local_pivots[j], r)
    for i in range(d):
        side[i] = reduced[0, inner + i]
    for j in range(1, N):
        r = chained[j - 1]
        for i in range(d):
            r[i] = side[i]
            r[d + i] = reduced[j, inner + i]
        forward(chain[j - 1], d, factors.chain_pivots[j - 1], r)
        for i in range(d):
            side[i] = r[d + i]
    for index in range(len(side) - d):
        total = rhs[N * size + index]
        for j in range(N):
            for k in range(inner):
                total -= local_weights[index, j, k] * reduced[j, k]
        for j in range(N - 1):
            for k in range(d):
                total -= chain_weights[index, j, k] * chained[j, k]
        side[d + index] = total


@kernel(types.void(FACTORS, matrix, matrix, vector, vector, vector, vector))
def expand(factors, reduced, chained, start, end, common, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` (N m d,) with all nodes from x_0, x_N and the common unknowns."""
    factors, out = borrowed(factors), borrowed(out)
    reduced, chained = borrowed(reduced), borrowed(chained)
    local, chain = factors.local, factors.chain
    N, size, width = local.shape
    inner = factors.local_pivots.shape[1]
    d = size - inner
    e = width - inner - 2 * d
    known, link = np.empty(width), np.empty(3 * d + e)
    for c in range(d):
        out[c] = start[c]
        link[d + c] = start[c]
        link[2 * d + c] = end[c]
    for c in range(e):
        link[3 * d + c] = common[c]
        known[inner + 2 * d + c] = common[c]
    for j in range(N - 1, 0, -1):
        a, r = chain[j - 1], chained[j - 1]
        for k in range(d - 1, -1, -1):
            total = r[k]
            for c in range(k + 1, 3 * d + e):
                total -= a[k, c] * link[c]
            link[k] = total * a[k, k]
        for c in range(d):
            out[j * size + c] = link[c]
            link[2 * d + c] = link[c]
    for j in range(N):
        a, r = local[j], reduced[j]
        for c in range(d):
            known[inner + c] = out[j * size + c]
            known[inner + d + c] = out[(j + 1) * size + c] if j + 1 < N else end[c]
        for k in range(inner - 1, -1, -1):
            total = r[k]
            for c in range(k + 1, width):
                total -= a[k, c] * known[c]
            known[k] = total * a[k, k]
        for c in range(inner):
            out[j * size + d + c] = known[c]


@kernel(types.void(FACTORS, vector, block, block, matrix, f8, vector))
def solve(factors, rhs, local_weights, chain_weights, small, closing, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` (N m d + e,) with the solution for a right side of all rows.

    ``small`` (d + b, 2 d + e) are the reduced rows, those of ``factors.end`` first, and x_N is
    ``closing`` times x_0. The solution of a singular system is not finite.
    """
    N, size, _ = factors.local.shape
    d = len(factors.end)
    rows, columns = small.shape[0], small.shape[1] - d
    reduced, chained = np.empty((N, size)), np.empty((N - 1, 2 * d))
    side, end = np.empty(rows), np.empty(d)
    reduce_side(factors, rhs, local_weights, chain_weights, reduced, chained, side)
    a, pivots = np.empty((rows, columns)), np.empty(rows, dtype=np.int64)
    for i in range(rows):
        for c in range(d):
            a[i, c] = small[i, c] + closing * small[i, d + c]
        for c in range(d, columns):
            a[i, c] = small[i, d + c]
    eliminate(a, rows, pivots)
    forward(a, rows, pivots, side)
    for k in range(rows - 1, -1, -1):
        total = side[k]
        for c in range(k + 1, rows):
            total -= a[k, c] * side[c]
        side[k] = total * a[k, k]
    for c in range(d):
        end[c] = closing * side[c]
    for c in range(d, columns):
        out[N * size + c - d] = side[c]
    expand(factors, reduced, chained, side[:d], end, side[d:], out[: N * size])
