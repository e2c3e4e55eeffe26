"""Kinds of cells: their sides, edges and second-order nodes; shape functions; rows of cells.

Corners are numbered as Gmsh, VTK and Abaqus do: along the outline of plane cells; tetrahedra with
the fourth corner above the first three, which run counter-clockwise seen from it; hexahedra by
their bottom, then their top.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers


@read_only_arrays
@dataclass(frozen=True)
class CellKind:
    """One kind of cell.

    Attributes
    ----------
    name : str
        Plural name of the cells, for messages.
    dimension, corners : int
    facets : tuple of tuples
        Corners of each side: edges with the cell on their left; faces counter-clockwise, seen from
        outside.
    edges : tuple of pairs
        In the order of the nodes in their middles.
    order : tuple of int
        The corner at each of the leading nodes of an element.
    mirrored : tuple of int
        Corners of the same cell with the opposite orientation.
    places : tuple of tuples
        Local coordinates of the nodes of quadratic elements, from 0 to 1: corners, middles of
        edges, of four-sided faces, of the cell.
    """

    name: str
    dimension: int
    corners: int
    facets: tuple[tuple[int, ...], ...]
    edges: tuple[tuple[int, int], ...]
    order: tuple[int, ...]
    mirrored: tuple[int, ...]
    places: tuple[tuple[float, ...], ...]

    def unknowns(self, degree: int, serendipity: bool = False) -> int:
        """About how many displacement components a cell of a large mesh adds."""
        return _UNKNOWNS[self.dimension, self.corners][self.counts.index(
            self.count(degree, serendipity))]

    def count(self, degree: int, serendipity: bool = False) -> int:
        """Number of nodes of an element of degree 1 or 2."""
        return self.counts[0 if degree == 1 else 1 if serendipity else 2]

    @property
    def counts(self) -> tuple[int, int, int]:
        """Numbers of nodes of linear, serendipity and quadratic elements.

        Serendipity elements have nodes at corners and in the middles of edges.
        """
        return self.corners, self.corners + len(self.edges), len(self.places)

    @cached_property
    def inner_weights(self) -> Array:
        """Weights (s, i) of values at the s nodes of serendipity elements for the i other places.

        These are middles of four-sided faces, then of the cell: half the sum over the edges less a
        quarter of that over the corners of a face; a quarter of each for a hexahedron.
        """
        edges = [{*edge} for edge in self.edges]
        groups = self.four_sided + [tuple(range(self.corners))] * self.has_centre
        assert len(self.places) == self.counts[1] + len(groups)
        weights = np.zeros((self.counts[1], len(groups)))
        for column, group in enumerate(groups):
            weights[[self.order.index(corner) for corner in group], column] = -0.25
            inside = [self.corners + k for k, edge in enumerate(edges) if edge <= {*group}]
            weights[inside, column] = 0.5 if len(group) == 4 else 0.25
        return weights

    @property
    def simplex(self) -> bool:
        """True for triangles and tetrahedra."""
        return self.corners == self.dimension + 1

    @property
    def four_sided(self) -> list[tuple[int, ...]]:
        """Corners of the four-sided faces of a solid cell, in the order of their middles."""
        local = np.array(self.places, float)
        found: list[tuple[int, ...]] = []
        for middle in local[self.corners + len(self.edges):]:
            found += [face for face in self.facets if len(face) == 4 and (
                np.abs(local[[self.order.index(corner) for corner in face]].mean(axis=0)
                       - middle) < 1e-12).all()]
        return found

    @property
    def has_centre(self) -> bool:
        """True if a second-order element has a node in its middle."""
        return self.corners == 2**self.dimension

    def holds(self, local: Array, tolerance: float) -> bool:
        """True if local coordinates (d,) lie within the reference cell."""
        beyond = local.max()
        if self.simplex:
            beyond = local.sum()
        elif self.corners == 6:
            beyond = max(local[0] + local[1], local[2])
        elif self.corners == 5:
            beyond = max(local[0], local[1]) + local[2]
        return bool(-tolerance <= local.min() <= beyond <= 1.0 + tolerance)

    @property
    def middle(self) -> Array:
        """Local coordinates (d,) of a place well inside a cell, the mean of its corners."""
        return np.array(self.places[: self.corners], float).mean(axis=0)


# Of linear, serendipity and quadratic elements.
_UNKNOWNS = {(2, 3): (1, 4, 4), (2, 4): (2, 6, 8), (3, 4): (1, 5, 5), (3, 5): (2, 6, 7),
             (3, 6): (2, 8, 12), (3, 8): (3, 12, 24)}

_H = 0.5
# Corners of the hexahedron in the order of its nodes, and its edges between these.
_HEX_ORDER = (6, 2, 5, 7, 1, 3, 4, 0)
_HEX_EDGES = ((0, 1), (0, 2), (0, 3), (1, 4), (1, 5), (2, 4), (2, 6), (3, 5), (3, 6), (4, 7),
              (5, 7), (6, 7))

TRIANGLE = CellKind(
    "triangles", 2, 3, ((0, 1), (1, 2), (2, 0)), ((0, 1), (1, 2), (0, 2)), (0, 1, 2), (2, 1, 0),
    ((0, 0), (1, 0), (0, 1), (_H, 0), (_H, _H), (0, _H)))
QUADRILATERAL = CellKind(
    "quadrilaterals", 2, 4, ((0, 1), (1, 2), (2, 3), (3, 0)), ((0, 1), (1, 2), (2, 3), (0, 3)),
    (0, 1, 2, 3), (3, 2, 1, 0),
    ((0, 0), (1, 0), (1, 1), (0, 1), (_H, 0), (1, _H), (_H, 1), (0, _H), (_H, _H)))
TETRAHEDRON = CellKind(
    "tetrahedra", 3, 4, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)), (0, 1, 2, 3), (0, 2, 1, 3),
    ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (_H, 0, 0), (_H, _H, 0), (0, _H, 0), (0, 0, _H),
     (_H, 0, _H), (0, _H, _H)))
HEXAHEDRON = CellKind(
    "hexahedra", 3, 8,
    ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    tuple((_HEX_ORDER[a], _HEX_ORDER[b]) for a, b in _HEX_EDGES), _HEX_ORDER,
    (4, 5, 6, 7, 0, 1, 2, 3),
    ((1, 1, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0),
     (1, 1, _H), (1, _H, 1), (_H, 1, 1), (1, _H, 0), (_H, 1, 0), (1, 0, _H), (_H, 0, 1),
     (0, 1, _H), (0, _H, 1), (_H, 0, 0), (0, _H, 0), (0, 0, _H),
     (1, _H, _H), (_H, _H, 1), (_H, 1, _H), (_H, 0, _H), (_H, _H, 0), (0, _H, _H), (_H, _H, _H)))

WEDGE = CellKind(
    "wedges", 3, 6, ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    ((0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)),
    tuple(range(6)), (3, 4, 5, 0, 1, 2),
    ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1),
     (_H, 0, 0), (_H, _H, 0), (0, _H, 0), (_H, 0, 1), (_H, _H, 1), (0, _H, 1),
     (0, 0, _H), (1, 0, _H), (0, 1, _H), (_H, 0, _H), (_H, _H, _H), (0, _H, _H)))
PYRAMID = CellKind(
    "pyramids", 3, 5, ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    ((0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4)),
    tuple(range(5)), (0, 3, 2, 1, 4),
    ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1),
     (_H, 0, 0), (1, _H, 0), (_H, 1, 0), (0, _H, 0),
     (0, 0, _H), (_H, 0, _H), (_H, _H, _H), (0, _H, _H), (_H, _H, 0)))

CELL_KINDS = {(kind.dimension, kind.corners): kind
              for kind in (TRIANGLE, QUADRILATERAL, TETRAHEDRON, PYRAMID, WEDGE, HEXAHEDRON)}


def widths(rows: Integers) -> Integers:
    """Numbers (k,) of entries of rows (k, n) whose last one is repeated to fill them."""
    trailing = np.ones(len(rows), np.int64)
    same = np.ones(len(rows), bool)
    for column in rows.T[-2::-1]:
        same = same & (column == rows[:, -1])
        if not same.any():
            break
        trailing += same
    return rows.shape[1] + 1 - trailing


def blocks_of(rows: Integers) -> list[tuple[Any, Integers]]:
    """Rows without what fills them, those of each width together.

    Returns
    -------
    list of (which, (k, w) array)
        Numbers of the rows of one width, a slice of all if there is only one, and these rows.
    """
    size = widths(rows)
    found = np.unique(size)
    if len(found) == 1:
        return [(slice(None), rows[:, : found[0]])]
    return [(which := np.flatnonzero(size == one), rows[which, :one]) for one in found]


def padded(blocks: Sequence[Integers], width: int = 0) -> Integers:
    """Rows of several widths, one block after the other, each filled by its last entry.

    To the largest width, or to ``width``.
    """
    width = width or max(block.shape[1] for block in blocks)
    return np.concatenate([block[:, np.minimum(np.arange(width), block.shape[1] - 1)]
                           for block in blocks])


def unordered(rows: Integers) -> Integers:
    """Rows sorted, those that a repeated entry fills in one way for all orders of their entries."""
    found = np.sort(rows, axis=1)
    twice = found[:, 1:] == found[:, :-1]
    if not twice.any():
        return found
    found[:, 1:] = np.where(twice, found[:, -1:], found[:, 1:])
    return np.sort(found, axis=1)


def edges_around(facets: Integers) -> tuple[Integers, Integers]:
    """Edges (e, 2) around facets (k, n) of solids, ends ascending, and the facet of each."""
    ends = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2)
    real = ends[:, 0] != ends[:, 1]
    owner = np.repeat(np.arange(len(facets)), facets.shape[1])
    return np.sort(ends[real], axis=1), owner[real]


def numbered_rows(rows: Integers) -> tuple[Integers, Integers, Integers]:
    """Distinct rows in lexicographic order, the number of each row, and how often each occurs."""
    number = rows[:, 0].astype(np.int64)
    for column in rows.T[1:]:
        _, number = np.unique(number * (int(rows.max(initial=0)) + 1) + column,
                              return_inverse=True)
    _, first, number, count = np.unique(number, return_index=True, return_inverse=True,
                                        return_counts=True)
    return rows[first], number, count


def row_numbers(known: Integers, rows: Integers) -> Integers:
    """Numbers (m,) of rows (m, n) among distinct known ones (k, n), -1 for others."""
    number = numbered_rows(np.concatenate([known, rows]))[1]
    place = np.full(int(number.max(initial=-1)) + 1, -1)
    place[number[: len(known)]] = np.arange(len(known))
    return np.asarray(place[number[len(known):]])


@read_only_arrays
@dataclass(frozen=True, eq=False)
class CellBlock:
    """Cells of one kind of a mesh: their numbers (m,) and their corners (m, k)."""

    kind: CellKind
    numbers: Integers
    nodes: Integers

    @property
    def ordered(self) -> Integers:
        """Corners (m, k) in the order of ``kind.places``."""
        return self.nodes[:, list(self.kind.order)]

    def only(self, chosen: Any) -> "CellBlock":
        """Some of the cells, by their rows."""
        return CellBlock(self.kind, self.numbers[chosen], self.nodes[chosen])


def shape_functions(dimension: int, count: int, local: Array) -> tuple[Array, Array]:
    """Shape functions (..., k) and their derivatives (..., k, d) at local coordinates (..., d).

    ``count`` is k: 2 or 3 on a line; 3, 6, 4, 8 or 9 in the plane; 4, 10, 5, 13, 14, 6, 15, 18, 8,
    20 or 27 in space. The functions are in the order of ``CellKind.places``, on a line start, end,
    middle; coordinates run from 0 to 1. Derivatives at the top of a pyramid are those along its
    axis.

    Serendipity elements of 8, 13, 15 or 20 nodes have the functions of quadratic ones whose values
    in the middles of faces and cells follow from the others by ``CellKind.inner_weights``.
    """
    if dimension == 1:
        value, slope = _line(count == 2, local[..., 0])
        return value, slope[..., None]
    if count in _SERENDIPITY[dimension]:
        kind = _SERENDIPITY[dimension][count]
        values, slopes = shape_functions(dimension, len(kind.places), local)
        weights = kind.inner_weights
        return (values[..., :count] + values[..., count:] @ weights.T,
                slopes[..., :count, :] + np.einsum("si,...id->...sd", weights,
                                                   slopes[..., count:, :]))
    if count in _SIMPLEX[dimension]:
        return _simplex(dimension, count, local)
    if dimension == 3 and count in (6, 18):
        return _wedge(count, local)
    if dimension == 3 and count in (5, 14):
        return _pyramid(count, local)
    kind = CELL_KINDS[dimension, 2**dimension]
    which = np.array([[_LINE[at] for at in place] for place in kind.places[:count]])
    value, slope = _line(count == 2**dimension, local)
    axes = range(dimension)
    values = np.prod([value[..., axis, which[:, axis]] for axis in axes], axis=0)
    slopes = np.stack([
        np.prod([(slope if axis == along else value)[..., axis, which[:, axis]] for axis in axes],
                axis=0) for along in axes], axis=-1)
    return values, slopes


_SIMPLEX = {2: (3, 6), 3: (4, 10)}
_SERENDIPITY = {dimension: {kind.counts[1]: kind for kind in CELL_KINDS.values()
                            if kind.dimension == dimension and not kind.simplex}
                for dimension in (2, 3)}
_LINE = {0: 0, 1: 1, _H: 2}


def _simplex(dimension: int, count: int, local: Array) -> tuple[Array, Array]:
    first = 1.0 - local[..., 0]
    for axis in range(1, dimension):
        first = first - local[..., axis]
    L = np.concatenate([first[..., None], local], axis=-1)
    D = np.vstack([-np.ones(dimension), np.eye(dimension)])
    if count == dimension + 1:
        return L, np.broadcast_to(D, (*L.shape, dimension))
    edges = CELL_KINDS[dimension, dimension + 1].edges
    values = [L * (2.0 * L - 1.0), *(4.0 * L[..., i] * L[..., j] for i, j in edges)]
    slopes = [(4.0 * L - 1.0)[..., None] * D,
              *(4.0 * (L[..., i, None] * D[j] + L[..., j, None] * D[i]) for i, j in edges)]
    return (np.concatenate([values[0], np.stack(values[1:], axis=-1)], axis=-1),
            np.concatenate([slopes[0], np.stack(slopes[1:], axis=-2)], axis=-2))


def _wedge(count: int, local: Array) -> tuple[Array, Array]:
    """Products of functions of a triangle and of a line."""
    places = WEDGE.places[:count]
    triangle = np.array([TRIANGLE.places.index(place[:2]) for place in places])
    line = np.array([_LINE[place[2]] for place in places])
    flat, along = _simplex(2, 3 if count == 6 else 6, local[..., :2])
    value, slope = _line(count == 6, local[..., 2])
    flat, value, slope = flat[..., triangle], value[..., line], slope[..., line]
    return flat * value, np.concatenate(
        [along[..., triangle, :] * value[..., None], (flat * slope)[..., None]], axis=-1)


# Distance from the top of a pyramid, over its height, within which x / w has no one value.
_TOP = 1e-9


def _pyramid(count: int, local: Array) -> tuple[Array, Array]:
    """Rational functions x^i y^j w^(m - i - j) z^k with w = 1 - z, m = max(i, j), m + k <= degree.

    They are polynomials on each face: M. Bergot, G. Cohen and M. Durufle, Higher-order finite
    elements for hybrid meshes using new nodal pyramidal elements, J. Sci. Comput. 42 (2010) 345.
    """
    if count not in _PYRAMIDS:
        values, _ = _pyramid_terms(count, np.array(PYRAMID.places[:count], float))
        _PYRAMIDS[count] = np.asarray(np.linalg.inv(values), float)
    values, slopes = _pyramid_terms(count, local)
    nodal = _PYRAMIDS[count]
    return values @ nodal, np.einsum("...ti,tk->...ki", slopes, nodal)


_PYRAMIDS: dict[int, Array] = {}


def _pyramid_terms(count: int, local: Array) -> tuple[Array, Array]:
    degree = 1 if count == 5 else 2
    z = local[..., 2]
    w = 1.0 - z
    # On the axis at the top.
    top = w < _TOP
    s, t = (np.where(top, 0.5, local[..., axis] / np.where(top, 1.0, w)) for axis in (0, 1))
    values, slopes = [], []
    for i, j in np.ndindex(degree + 1, degree + 1):
        m = max(i, j)
        for k in range(degree - m + 1):
            # x^i y^j w^(m - i - j) = s^i t^j w^m; ds/dx = 1 / w, ds/dz = s / w.
            values.append(s**i * t**j * w**m * z**k)
            lower = w ** (m - 1) if m else 0.0 * w
            slopes.append(np.stack([
                i * s ** max(i - 1, 0) * t**j * lower * z**k,
                j * s**i * t ** max(j - 1, 0) * lower * z**k,
                (i + j - m) * s**i * t**j * lower * z**k
                + k * s**i * t**j * w**m * z ** max(k - 1, 0)], axis=-1))
    return np.stack(values, axis=-1), np.stack(slopes, axis=-2)


def _line(linear: bool, s: Array) -> tuple[Array, Array]:
    """Functions of one direction and their derivatives: start, end, middle."""
    if linear:
        return (np.stack([1.0 - s, s], axis=-1),
                np.stack([np.full(s.shape, -1.0), np.ones(s.shape)], axis=-1))
    return (np.stack([(1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)], -1),
            np.stack([4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s], axis=-1))
