"""Rows of the contact nodes over the modes, and where they and the matrices are not zero.

Modes of several bodies stand one body after the other, contact nodes one interface after the other.
An interface moves with the modes of its two bodies only, so the rows, the matrices and the Jacobian
consist of blocks, and a chain of bodies costs so many times one body. One body is one block.
"""

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fecontact.core.cache_lines import in_lines
from fecontact.core.compiled import helper
from fecontact.core.records import IntegerBlock, IntegerMatrix, IntegerVector, Matrix
from fecontact.core.types import Array, Integers
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.nodes import SystemArrays
from fecontact.system.polynomial_forces import coupled_by_polynomial


class Blocks(NamedTuple):
    """Rows of contact nodes, and blocks of them and of the matrices; ends are exclusive.

    The nodes are all, or those near the other side (:mod:`fecontact.integrate.near_nodes`).

    Attributes
    ----------
    nodes, used : (n,), (1,) integer arrays
        Numbers of the nodes in ascending order, in the first ``used[0]`` places.
    shapes : (m, 2 n) array
        Their rows along the first axis, then from column n on those along the normal, side by
        side, so that sums over nodes vectorise; (m, 3 n) in space.
    parts : (p, 4) integer array
        First and last mode, first and last node of each block of the rows.
    tiles : (t, 4) integer array
        First and last row, first and last column of ``shapes`` of these blocks.
    spans : (n, r, 2) integer array
        First and last modes that move each node of all; empty spans fill the array.
    own : (b, 4) integer array
        Rows and columns of the blocks of stiffness and damping.
    coupled : (c, 6) integer array
        Rows and columns of the Jacobian's blocks, and their starts in the order of elimination.
    pairs : (k, 6) integer array
        Rows of ``shapes``, columns of the Jacobian [Jq, Jv], columns of ``shapes`` of the products
        that the Jacobian is the sum of.
    position : (m,) integer array
        Place of each mode in the order of elimination.
    reach : (2, m) integer array
        In this order, ends of the columns and, with the fill-in of pivoting, of the rows.
    """

    nodes: IntegerVector
    used: IntegerVector
    shapes: Matrix
    parts: IntegerMatrix
    tiles: IntegerMatrix
    spans: IntegerBlock
    own: IntegerMatrix
    coupled: IntegerMatrix
    pairs: IntegerMatrix
    position: IntegerVector
    reach: IntegerMatrix


# So few nodes are always taken as near: to find out costs more.
FEW = 16


@helper
def block_at(table, k):
    """First and last row, first and last column of block k of a table.

    Column numbers are unsigned: loops over indices that might be negative are not vectorised.
    """
    return table[k, 0], table[k, 1], np.uint64(table[k, 2]), np.uint64(table[k, 3])


def blocks_of(basis: ModalBasis, arrays: SystemArrays) -> Blocks:
    """The blocks of a system, by its bodies and interfaces and by what is zero."""
    n, _, m = arrays.rows.shape
    modes = _ranges([part.modes[1] for part in basis.parts], m)
    nodes = _ranges([count for _, count in basis.groups], n)
    moved = np.array([[arrays.rows[slice(*j), :, slice(*i)].any() for i in modes] for j in nodes])
    own = np.array([[any(one[slice(*i), slice(*k)].any()
                         for one in (arrays.stiffness, arrays.damping, arrays.modal_damping))
                     for k in modes] for i in modes])
    own |= np.eye(len(modes), dtype=bool)
    joined = coupled_by_polynomial(arrays)
    coupled = own | own.T | (moved.T.astype(int) @ moved.astype(int) > 0) | np.array(
        [[joined[slice(*i), slice(*k)].any() for k in modes] for i in modes])
    shapes = in_lines(arrays.rows.swapaxes(0, 1).reshape(-1, m).T)
    if coupled.all():
        return one_block(shapes, n)
    return _blocks(shapes, modes, nodes, moved, own, coupled)


def one_block(shapes: Array, nodes: int) -> Blocks:
    """The blocks of a system that is one block, with rows ``shapes`` (m, 2 n) or (m, 3 n)."""
    return _one_block(shapes.shape, nodes)._replace(shapes=shapes)


@lru_cache(maxsize=16)
def _one_block(shape: tuple[int, ...], nodes: int) -> Blocks:
    """Blocks for rows of a shape, of which many systems in turn may be."""
    whole = np.ones((1, 1), dtype=bool)
    return _blocks(np.zeros(shape), [(0, shape[0])], [(0, nodes)], whole, whole, whole)


def near_blocks(blocks: Blocks) -> Blocks:
    """Blocks of the near nodes, which are all to begin with."""
    if len(blocks.nodes) <= FEW:
        return blocks
    return blocks._replace(**{
        name: in_lines(getattr(blocks, name))
        for name in ("nodes", "used", "shapes", "parts", "tiles", "pairs")})


def _blocks(
    shapes: Array, modes: list[tuple[int, int]], nodes: list[tuple[int, int]], moved: Array,
    own: Array, coupled: Array,
) -> Blocks:
    """The blocks of ranges of modes and nodes, by which of them are not zero."""
    m, n = len(shapes), nodes[-1][1]
    tangents = shapes.shape[1] // max(n, 1)
    # Without contact nodes no mode moves any; kernels step by the length of ``nodes``.
    moves = np.logical_and(moved, n > 0)
    parts = [(*modes[a], *nodes[b]) for b, a in np.argwhere(moves)]
    position, starts, reach = _elimination(modes, coupled)
    most = int(moves.sum(axis=1).max())
    spans = np.zeros((n, most, 2), dtype=np.int64)
    for b, (first, last) in enumerate(nodes):
        for place, a in enumerate(np.flatnonzero(moves[b])):
            spans[first:last, place] = modes[a]
    return Blocks(
        nodes=np.arange(max(n, 1)), used=np.array([n]), shapes=shapes,
        parts=_table(parts, 4),
        tiles=_table([(*part[:2], *columns) for part in parts
                      for columns in _each(part[2:], n, tangents, n <= FEW)], 4),
        spans=spans,
        own=_table([(*modes[a], *modes[c]) for a, c in np.argwhere(own)], 4),
        coupled=_table([(*modes[a], *modes[c], starts[a], starts[c])
                        for a, c in np.argwhere(coupled)], 6),
        pairs=_table([(*modes[a], *answered, *columns) for b in range(len(nodes))
                      for a in np.flatnonzero(moves[b]) for c in np.flatnonzero(moves[b])
                      for answered in _each(modes[c], m, 2)
                      for columns in _each(nodes[b], n, tangents, n <= FEW)], 6),
        position=position, reach=reach)


def _ranges(counts: list[int], total: int) -> list[tuple[int, int]]:
    """Ranges with these numbers of entries; one range of all if they are not distinguished."""
    ends = np.concatenate([[0], np.cumsum(counts, dtype=int)]).tolist()
    if ends[-1] != total or min(counts, default=0) == 0:
        ends = [0, total]
    return list(pairwise(ends))


def _each(
    span: tuple[int, int], size: int, count: int, joined: bool = True,
) -> list[tuple[int, int]]:
    """A range within each of some parts of one size; in one, if ``joined``, where it is all."""
    if joined and span == (0, size):
        return [(0, count * size)]
    return [(part * size + span[0], part * size + span[1]) for part in range(count)]


def _table(rows: list[tuple[int, ...]], width: int) -> Integers:
    return np.array(rows, dtype=np.int64).reshape(-1, width)


def _elimination(
    modes: list[tuple[int, int]], coupled: Array,
) -> tuple[Integers, Integers, Integers]:
    """Places of the modes, first place of each block, and reach, in an order of narrow band."""
    if len(modes) == 1:
        count = modes[0][1]
        return (np.arange(count, dtype=np.int64), np.zeros(1, dtype=np.int64),
                np.full((2, count), count, dtype=np.int64))
    order = reverse_cuthill_mckee(csr_array(coupled), symmetric_mode=True)
    sizes = np.array([last - first for first, last in modes])
    ends = np.cumsum(sizes[order])
    starts = np.empty(len(modes), dtype=np.int64)
    starts[order] = ends - sizes[order]
    position = np.concatenate([starts[a] + np.arange(size) for a, size in enumerate(sizes)])
    # Ends of the rows of each block of columns; the rows' own ends before pivoting are the same.
    last = np.maximum.accumulate([
        max(starts[c] + sizes[c] for c in np.flatnonzero(coupled[a])) for a in order])
    column_end = np.repeat(last, sizes[order])
    # A pivot row may be any row of the column, and brings its own end along.
    return position, starts, np.array([column_end, column_end[column_end - 1]], dtype=np.int64)
