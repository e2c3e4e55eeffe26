"""Solution of condensed collocation systems with border rows.

Elimination coefficients of a border, and a reduced right-hand side, are vectors with one entry for
each pivot row: (G, (m - 1) d, 8) for the inner nodes, (G - 1, d, 8) for the chains within
segments, (S - 1, d) for the chain along them. Their product is subtracted from the right-hand side
of the border.
"""

import numpy as np

from fecontact.bifurcation.linalg.condensation import CondensedFactors
from fecontact.bifurcation.linalg.simd_lu import (
    back_simd,
    forward_lanes_transposed,
    forward_simd,
    reduce_row_simd,
)
from fecontact.core.compiled import helper, kernel
from fecontact.core.dense_lu import (
    backward,
    factorise,
    forward,
    forward_transposed,
    reduce_row,
)
from fecontact.core.dense_lu import solve as solve_dense
from fecontact.core.records import Matrix, Vector
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import gather, read, spread, write


@helper
def _parts(factors, pivots):
    """Split a vector over the pivot rows into its three parts."""
    groups, size, _, _ = factors.inner.shape
    d = len(factors.end)
    inner = size - d
    first = groups * inner * WIDTH
    second = first + (groups - 1) * d * WIDTH
    return (pivots[:first].reshape((groups, inner, WIDTH)),
            pivots[first:second].reshape((groups - 1, d, WIDTH)),
            pivots[second:].reshape((len(factors.top), d)))


@helper
def _take(given, first, group, factors, count, places, out):
    """Gather given[j size + first ...] of a group of intervals in out (count, 8), zero beyond N."""
    groups, size, _, _ = factors.inner.shape
    N = len(factors.local)
    for lane in range(WIDTH):
        places[lane] = min(lane * groups + group, N - 1) * size + first
    for c in range(count):
        write(out[c], gather(given, places, c))
    for lane in range(WIDTH):
        if lane * groups + group >= N:
            for c in range(count):
                out[c, lane] = 0.0


@kernel
def reduce_border(
    factors: CondensedFactors, given: Vector, weights: Vector, small: Vector,
) -> None:
    """Reduce a border ``given`` (N m d + e,) to x_0, x_N and the common unknowns.

    Fills ``small`` (2 d + e,) and, over the pivot rows, ``weights``: the multiples of the reduced
    right-hand sides to subtract from that of the border.
    """
    inner_weights, chain_weights, top_weights = _parts(factors, weights)
    groups, size, width, _ = factors.inner.shape
    N, d, columns = factors.local.shape
    e = columns - 2 * d
    inner = size - d
    nothing = spread(0.0)
    row, link, left = (np.empty((width, WIDTH)), np.empty((3 * d + e, WIDTH)),
                       np.empty((d, WIDTH)))
    places = np.empty(WIDTH, dtype=np.int64)
    _take(given, 0, 0, factors, d, places, left)
    for c in range(d):
        write(link[d + c], read(left[c]))
        write(link[2 * d + c], nothing)
    for c in range(e):
        write(link[3 * d + c], nothing)
    for group in range(groups):
        _take(given, d, group, factors, inner, places, row)
        for c in range(d):
            # Until its interval is reached, x_j occupies the place of x_(j+1).
            write(row[inner + c], read(link[2 * d + c]))
            write(row[inner + d + c], nothing)
        for c in range(e):
            write(row[inner + 2 * d + c], read(link[3 * d + c]))
        reduce_row_simd(factors.inner[group], inner, row, inner_weights[group])
        for c in range(e):
            write(link[3 * d + c], read(row[inner + 2 * d + c]))
        for c in range(d):
            write(link[2 * d + c], nothing)
        if group == 0:
            for c in range(d):
                write(link[d + c], read(link[d + c]) + read(row[inner + c]))
        else:
            _take(given, 0, group, factors, d, places, left)
            for c in range(d):
                write(link[c], read(row[inner + c]) + read(left[c]))
            reduce_row_simd(factors.chain[group - 1], d, link, chain_weights[group - 1])
        for c in range(d):
            write(link[2 * d + c], read(link[2 * d + c]) + read(row[inner + d + c]))
    whole = np.empty(3 * d + e)
    for c in range(d):
        whole[d + c], whole[2 * d + c] = link[d + c, 0], link[2 * d + c, 0]
    for c in range(e):
        total = given[N * size + c]
        for lane in range(len(factors.top) + 1):
            total += link[3 * d + c, lane]
        whole[3 * d + c] = total
    for lane in range(1, len(factors.top) + 1):
        for c in range(d):
            whole[c] = whole[2 * d + c] + link[d + c, lane]
            whole[2 * d + c] = 0.0
        reduce_row(factors.top[lane - 1], d, whole, top_weights[lane - 1])
        for c in range(d):
            whole[2 * d + c] += link[2 * d + c, lane]
    for c in range(columns):
        small[c] = whole[d + c]


@kernel
def reduce_side(factors: CondensedFactors, rhs: Vector, reduced: Vector, side: Vector) -> None:
    """Reduce the right-hand side of the collocation rows, the first N m d entries of ``rhs``.

    Fills ``reduced`` over the pivot rows and ``side`` (d,) for the rows of ``factors.end``.
    """
    of_inner, of_chain, of_top = _parts(factors, reduced)
    groups, size, _, _ = factors.inner.shape
    N, d, _ = factors.local.shape
    inner = size - d
    r, pair, mixed = (np.empty((size, WIDTH)), np.empty((2 * d, WIDTH)),
                      np.empty((2 * d, WIDTH)))
    places = np.empty(WIDTH, dtype=np.int64)
    for group in range(groups):
        order = factors.inner_order[group]
        for i in range(size):
            for lane in range(WIDTH):
                j = lane * groups + group
                r[i, lane] = rhs[j * size + (order[i, lane] if inner else i)] if j < N else 0.0
        forward_simd(factors.inner[group], inner, r)
        for i in range(inner):
            write(of_inner[group, i], read(r[i]))
        if group == 0:
            for i in range(d):
                write(pair[d + i], read(r[inner + i]))
            continue
        for i in range(d):
            write(mixed[i], read(pair[d + i]))
            write(mixed[d + i], read(r[inner + i]))
        numbers = mixed.reshape(-1)
        for i in range(2 * d):
            for lane in range(WIDTH):
                places[lane] = factors.chain_order[group - 1, i, lane] * WIDTH + lane
            write(pair[i], gather(numbers, places, 0))
        forward_simd(factors.chain[group - 1], d, pair)
        for i in range(d):
            write(of_chain[group - 1, i], read(pair[i]))
    both = np.empty(2 * d)
    for i in range(d):
        side[i] = pair[d + i, 0]
    for lane in range(1, len(factors.top) + 1):
        for i in range(d):
            both[i] = side[i]
            both[d + i] = pair[d + i, lane]
        forward(factors.top[lane - 1], d, factors.top_pivots[lane - 1], both)
        for i in range(d):
            of_top[lane - 1, i] = both[i]
            side[i] = both[d + i]


@kernel
def original_rows(factors: CondensedFactors, reduced: Vector, end: Vector, out: Vector) -> None:
    """Fill ``out`` (N m d,) with multiples of the collocation rows.

    Their sum is that of the pivot rows times ``reduced`` and of the rows of ``factors.end`` times
    ``end`` (d,): the transpose of :func:`reduce_side`.
    """
    of_inner, of_chain, of_top = _parts(factors, reduced)
    groups, size, _, _ = factors.inner.shape
    N, d, _ = factors.local.shape
    inner = size - d
    r, pair, mixed = (np.empty((size, WIDTH)), np.zeros((2 * d, WIDTH)),
                      np.empty((2 * d, WIDTH)))
    both = np.empty(2 * d)
    for i in range(d):
        both[i] = end[i]
    for lane in range(len(factors.top), 0, -1):
        for i in range(d):
            both[d + i] = both[i]
            both[i] = of_top[lane - 1, i]
        forward_transposed(factors.top[lane - 1], d, factors.top_pivots[lane - 1], both)
        for i in range(d):
            pair[d + i, lane] = both[d + i]
    for i in range(d):
        pair[d + i, 0] = both[i]
    for group in range(groups - 1, -1, -1):
        if group == 0:
            for i in range(d):
                write(r[inner + i], read(pair[d + i]))
        else:
            for i in range(d):
                write(pair[i], read(of_chain[group - 1, i]))
            forward_lanes_transposed(factors.chain[group - 1], d, pair)
            for i in range(2 * d):
                for lane in range(WIDTH):
                    mixed[factors.chain_order[group - 1, i, lane], lane] = pair[i, lane]
            for i in range(d):
                write(pair[d + i], read(mixed[i]))
                write(r[inner + i], read(mixed[d + i]))
        for i in range(inner):
            write(r[i], read(of_inner[group, i]))
        forward_lanes_transposed(factors.inner[group], inner, r)
        order = factors.inner_order[group]
        for i in range(size):
            for lane in range(WIDTH):
                j = lane * groups + group
                if j < N:
                    out[j * size + (order[i, lane] if inner else i)] = r[i, lane]


@kernel
def expand(
    factors: CondensedFactors, reduced: Vector, start: Vector, end: Vector, common: Vector,
    out: Vector,
) -> None:
    """Fill ``out`` (N m d,) with all nodes from x_0, x_N and the common unknowns."""
    of_inner, of_chain, of_top = _parts(factors, reduced)
    groups, size, width, _ = factors.inner.shape
    N, d, columns = factors.local.shape
    e = columns - 2 * d
    inner = size - d
    segments = len(factors.top) + 1
    # Left ends of the intervals of all groups, followed by those of the next segments.
    ends = np.zeros((groups + 1, d, WIDTH))
    whole = np.empty(3 * d + e)
    for c in range(d):
        ends[0, c, 0] = start[c]
        ends[groups, c, segments - 1] = end[c]
        whole[d + c] = start[c]
        whole[2 * d + c] = end[c]
    for c in range(e):
        whole[3 * d + c] = common[c]
    for lane in range(segments - 1, 0, -1):
        backward(factors.top[lane - 1], d, of_top[lane - 1], whole)
        for c in range(d):
            ends[0, c, lane] = ends[groups, c, lane - 1] = whole[2 * d + c] = whole[c]
    link, known = np.empty((3 * d + e, WIDTH)), np.empty((width, WIDTH))
    for c in range(d):
        write(link[d + c], read(ends[0, c]))
    for c in range(e):
        write(link[3 * d + c], spread(common[c]))
        write(known[inner + 2 * d + c], spread(common[c]))
    for group in range(groups - 1, -1, -1):
        if group:
            for c in range(d):
                write(link[2 * d + c], read(ends[group + 1, c]))
            back_simd(factors.chain[group - 1], d, of_chain[group - 1], link)
            for c in range(d):
                write(ends[group, c], read(link[c]))
        for c in range(d):
            write(known[inner + c], read(ends[group, c]))
            write(known[inner + d + c], read(ends[group + 1, c]))
        back_simd(factors.inner[group], inner, of_inner[group], known)
        for lane in range(WIDTH):
            first = (lane * groups + group) * size
            if lane * groups + group < N:
                for c in range(d):
                    out[first + c] = known[inner + c, lane]
                for c in range(inner):
                    out[first + d + c] = known[c, lane]


@kernel
def solve(
    factors: CondensedFactors, rhs: Vector, weights: Matrix, small: Matrix, closing: float,
    out: Vector,
) -> None:
    """Fill ``out`` (N m d + e,) with the solution for a right-hand side of all rows.

    ``small`` (d + b, 2 d + e) are the reduced rows, those of ``factors.end`` first; ``weights``
    (b, ...) are the elimination coefficients of the borders; x_N is ``closing`` times x_0. The
    solution of a singular system is not finite.
    """
    N, d, _ = factors.local.shape
    size = factors.inner.shape[1]
    rows, columns = small.shape[0], small.shape[1] - d
    reduced, side, end = np.empty(weights.shape[1]), np.empty(rows), np.empty(d)
    reduce_side(factors, rhs, reduced, side[:d])
    for index in range(len(weights)):
        total = rhs[N * size + index]
        for k in range(len(reduced)):
            total -= weights[index, k] * reduced[k]
        side[d + index] = total
    a, pivots = np.empty((rows, columns)), np.empty(rows, dtype=np.int64)
    for i in range(rows):
        for c in range(d):
            a[i, c] = small[i, c] + closing * small[i, d + c]
        for c in range(d, columns):
            a[i, c] = small[i, d + c]
    factorise(a, rows, pivots)
    solve_dense(a, pivots, side)
    for c in range(d):
        end[c] = closing * side[c]
    for c in range(d, columns):
        out[N * size + c - d] = side[c]
    expand(factors, reduced, side[:d], end, side[d:], out[: N * size])
