"""Linear systems of collocation, solved in time proportional to the number of intervals.

On each of N intervals, m d equations link the m + 1 nodes of the interval, d unknowns each, and e
unknowns common to all (period, parameters). Further rows, the borders, involve all unknowns:

    local_j [x_j0 ... x_jm, p] = r_j,  x_jm = x_(j+1)0,  x_Nm = x_00         border [x, p] = s

:func:`condense` eliminates the inner nodes of each interval, which leaves d equations
A_j x_j + B_j x_(j+1) + E_j p = ... These are chained by eliminating x_1, x_2, ... in turn, with
row interchanges between neighbours, so that round-off does not grow with the instability of the
orbit. The result links x_0, x_N and p (Doedel's scheme).

The intervals are distributed over eight segments of G = ceil(N / 8) neighbours each, processed in
parallel, one in each SIMD lane: interval l G + g is lane l of group g. Empty lanes are filled with
intervals of zero width. The chain is eliminated first within each segment, then along the
segments.
"""

from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.linalg.simd_lu import eliminate_simd
from fecontact.core.compiled import helper, kernel
from fecontact.core.dense_lu import factorise
from fecontact.core.records import Array4, Block, IntegerBlock, IntegerMatrix, Matrix, Vector
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import gather, read, spread, write
from fecontact.core.types import Array


class CondensedFactors(NamedTuple):
    """Factors of a collocation system of N intervals, m points each, d states, e common unknowns.

    inner (G, m d, (m + 1) d + e, 8), columns: inner nodes, left end, right end, common unknowns;
    chain (G - 1, 2 d, 3 d + e, 8) within segments, columns: x_j, the segment's first, x_(j+1),
    common; top (S - 1, 2 d, 3 d + e), the same along the S segments that are not empty; end (d,
    2 d + e), columns: x_0, x_N, common. Diagonals hold inverse pivots. The orders are the row
    permutations. local (N, d, 2 d + e), columns: left end, right end, common, are the equations
    to be chained.
    """

    inner: Array4
    inner_order: IntegerBlock
    local: Block
    chain: Array4
    chain_order: IntegerBlock
    top: Block
    top_pivots: IntegerMatrix
    end: Matrix


def factors_for(intervals: int, points: int, states: int, common: int) -> CondensedFactors:
    """Allocate the factors of a system of this size."""
    N, m, d, e = intervals, points, states, common
    G = -(-N // WIDTH)
    S = -(-N // G)
    return CondensedFactors(
        _aligned(G, m * d, (m + 1) * d + e), np.empty((G, m * d, WIDTH), dtype=np.int64),
        np.empty((N, d, 2 * d + e)),
        _aligned(G - 1, 2 * d, 3 * d + e), np.empty((G - 1, 2 * d, WIDTH), dtype=np.int64),
        np.empty((S - 1, 2 * d, 3 * d + e)), np.empty((S - 1, d), dtype=np.int64),
        np.empty((d, 2 * d + e)))


def pivot_rows(factors: CondensedFactors) -> int:
    """Number of pivot rows, including those of empty lanes."""
    groups, size, _, lanes = factors.inner.shape
    d = len(factors.end)
    return int((groups * (size - d) + (groups - 1) * d) * lanes + len(factors.top) * d)


def with_left_ends(factors: CondensedFactors, left: Array) -> CondensedFactors:
    """Factors of the same intervals with other coefficients (N, d, d) of their left ends.

    They share the inner nodes, which keep their equations: only ends of intervals are solved for.
    """
    local = factors.local.copy()
    local[:, :, : left.shape[1]] = left
    made = factors._replace(
        local=local, chain=_aligned(*factors.chain.shape[:3]),
        chain_order=np.empty_like(factors.chain_order), top=np.empty_like(factors.top),
        top_pivots=np.empty_like(factors.top_pivots), end=np.empty_like(factors.end))
    chain_intervals(made)
    return made


def _aligned(groups: int, rows: int, columns: int) -> Array:
    """Allocate (groups, rows, columns, 8), each group of eight numbers in one cache line."""
    size = groups * rows * columns * WIDTH
    workspace = np.empty(size + WIDTH)
    first = -(workspace.__array_interface__["data"][0] // workspace.itemsize) % WIDTH
    return workspace[first : first + size].reshape(groups, rows, columns, WIDTH)


@helper
def _take_links(local, group, groups, places, links):
    """Fill links (d, 2 d + e, 8) with the equations of a group; x_j = x_(j+1) beyond the last."""
    N, d, columns = local.shape
    for lane in range(WIDTH):
        places[lane] = min(lane * groups + group, N - 1) * d * columns
    values = local.reshape(-1)
    for i in range(d):
        for c in range(columns):
            write(links[i, c], gather(values, places, i * columns + c))
    for lane in range(WIDTH):
        if lane * groups + group >= N:
            for i in range(d):
                for c in range(columns):
                    links[i, c, lane] = 1.0 if c == i else (-1.0 if c == d + i else 0.0)


@helper
def _chain_segments(local, chain, order, end):
    """Eliminate all but the ends of each segment; ``end`` (d, 2 d + e, 8) links the ends."""
    d, columns, _ = end.shape
    e = columns - 2 * d
    groups = len(chain) + 1
    workspace, links, nothing = np.empty(WIDTH), np.empty((d, columns, WIDTH)), spread(0.0)
    places = np.empty(WIDTH, dtype=np.int64)
    _take_links(local, 0, groups, places, end)
    for group in range(1, groups):
        a = chain[group - 1]
        _take_links(local, group, groups, places, links)
        for i in range(d):
            for c in range(d):
                write(a[i, c], read(end[i, d + c]))
                write(a[i, d + c], read(end[i, c]))
                write(a[i, 2 * d + c], nothing)
                write(a[d + i, c], read(links[i, c]))
                write(a[d + i, d + c], nothing)
                write(a[d + i, 2 * d + c], read(links[i, d + c]))
            for c in range(e):
                write(a[i, 3 * d + c], read(end[i, 2 * d + c]))
                write(a[d + i, 3 * d + c], read(links[i, 2 * d + c]))
        eliminate_simd(a, d, order[group - 1], workspace)
        for i in range(d):
            for c in range(columns):
                write(end[i, c], read(a[d + i, d + c]))


@kernel
def chain_intervals(factors: CondensedFactors) -> None:
    """Eliminate x_1, x_2, ... from the equations ``local`` of the intervals."""
    top, end = factors.top, factors.end
    d, columns = end.shape
    e = columns - 2 * d
    segments = np.empty((d, columns, WIDTH))
    _chain_segments(factors.local, factors.chain, factors.chain_order, segments)
    for i in range(d):
        for c in range(columns):
            end[i, c] = segments[i, c, 0]
    for lane in range(1, len(top) + 1):
        a = top[lane - 1]
        for i in range(d):
            for c in range(d):
                a[i, c] = end[i, d + c]
                a[i, d + c] = end[i, c]
                a[i, 2 * d + c] = 0.0
                a[d + i, c] = segments[i, c, lane]
                a[d + i, d + c] = 0.0
                a[d + i, 2 * d + c] = segments[i, d + c, lane]
            for c in range(e):
                a[i, 3 * d + c] = end[i, 2 * d + c]
                a[d + i, 3 * d + c] = segments[i, 2 * d + c, lane]
        factorise(a, d, factors.top_pivots[lane - 1])
        for i in range(d):
            for c in range(columns):
                end[i, c] = a[d + i, d + c]


@kernel
def condense(
    J: Block, f: Matrix, P: Block, widths: Vector, T: float, values: Matrix, slopes: Matrix,
    with_period: int, factors: CondensedFactors,
) -> None:
    """Factorise the system of x' = T f on intervals.

    J (N m, d, d), f (N m, d) and P (N m, d, q) at the collocation points; values and slopes
    (m, m + 1) of the basis there. Rows: sum_k slopes x_k - h T f. The common unknowns are T (if
    ``with_period``) and q parameters.
    """
    local = factors.local
    groups = len(factors.inner)
    N = len(widths)
    m = len(values)
    d = f.shape[1]
    q = P.shape[2]
    e = q + with_period
    inner = (m - 1) * d
    of_states, of_common, rates = J.reshape(-1), P.reshape(-1), f.reshape(-1)
    workspace, step, width = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    # Start of the interval of each lane, counted in collocation points.
    first_point, places = np.empty(WIDTH, dtype=np.int64), np.empty(WIDTH, dtype=np.int64)
    for group in range(groups):
        a = factors.inner[group]
        for lane in range(WIDTH):
            j = lane * groups + group
            first_point[lane] = min(j, N - 1) * m
            width[lane] = -widths[j] if j < N else 0.0
            step[lane] = width[lane] * T
        for point in range(m):
            for i in range(d):
                row = point * d + i
                for lane in range(WIDTH):
                    places[lane] = ((first_point[lane] + point) * d + i) * d
                for c in range(d):
                    entry = read(step) * gather(of_states, places, c)
                    own = 1.0 if c == i else 0.0
                    for k in range(1, m):
                        write(a[row, (k - 1) * d + c], spread(values[point, k]) * entry
                              + spread(own * slopes[point, k]))
                    write(a[row, inner + c], spread(values[point, 0]) * entry
                          + spread(own * slopes[point, 0]))
                    write(a[row, inner + d + c], spread(values[point, m]) * entry
                          + spread(own * slopes[point, m]))
                for lane in range(WIDTH):
                    places[lane] = (first_point[lane] + point) * d + i
                if with_period:
                    write(a[row, inner + 2 * d], read(width) * gather(rates, places, 0))
                for lane in range(WIDTH):
                    places[lane] *= q
                for c in range(q):
                    write(a[row, inner + 2 * d + with_period + c],
                          read(step) * gather(of_common, places, c))
        eliminate_simd(a, inner, factors.inner_order[group], workspace)
        for lane in range(WIDTH):
            j = lane * groups + group
            if j < N:
                for i in range(d):
                    for c in range(2 * d + e):
                        local[j, i, c] = a[inner + i, inner + c, lane]
    chain_intervals(factors)
