"""Kinds of cells: their sides and edges, and the order in which scikit-fem takes their corners.

Corners are numbered as Gmsh, VTK and Abaqus do: along the outline of plane cells; tetrahedra with
the fourth corner above the first three, which run counter-clockwise seen from it; hexahedra by
their bottom, then their top.
"""

from dataclasses import dataclass

import numpy as np

from fecontact.core.types import Array, Integers


@dataclass(frozen=True)
class CellKind:
    """One kind of cell.

    Attributes
    ----------
    name : str
        Plural, for people.
    dimension, corners : int
    facets : tuple of tuples
        Corners of each side: edges with the cell on their left; faces counter-clockwise, seen from
        outside.
    edges : tuple of pairs
        In the order of scikit-fem's degrees of freedom.
    order : tuple of int
        The corner at each of scikit-fem's corners.
    mirrored : tuple of int
        Corners of the same cell with the opposite orientation.
    places : tuple of tuples
        Local coordinates of scikit-fem's quadratic degrees of freedom, from 0 to 1.
    """

    name: str
    dimension: int
    corners: int
    facets: tuple[tuple[int, ...], ...]
    edges: tuple[tuple[int, int], ...]
    order: tuple[int, ...]
    mirrored: tuple[int, ...]
    places: tuple[tuple[float, ...], ...]

    def unknowns(self, degree: int) -> int:
        """About how many displacement components a cell of a large mesh adds."""
        return _UNKNOWNS[self.dimension, self.corners, degree]

    @property
    def simplex(self) -> bool:
        """True for triangles and tetrahedra."""
        return self.corners == self.dimension + 1


_UNKNOWNS = {(2, 3, 1): 1, (2, 3, 2): 4, (2, 4, 1): 2, (2, 4, 2): 8,
             (3, 4, 1): 1, (3, 4, 2): 5, (3, 8, 1): 3, (3, 8, 2): 24}

_H = 0.5
# Corners of the hexahedron at those of scikit-fem, and its edges between these.
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

CELL_KINDS = {(kind.dimension, kind.corners): kind
              for kind in (TRIANGLE, QUADRILATERAL, TETRAHEDRON, HEXAHEDRON)}


def numbered_rows(rows: Integers) -> tuple[Integers, Integers, Integers]:
    """Distinct rows in lexicographic order, the number of each row, and how often each occurs."""
    number = rows[:, 0].astype(np.int64)
    for column in rows.T[1:]:
        _, number = np.unique(number * (int(rows.max(initial=0)) + 1) + column,
                              return_inverse=True)
    _, first, number, count = np.unique(number, return_index=True, return_inverse=True,
                                        return_counts=True)
    return rows[first], number, count


def shape_functions(dimension: int, count: int, local: Array) -> tuple[Array, Array]:
    """Shape functions (..., k) and their derivatives (..., k, d) at local coordinates (..., d).

    ``count`` is k: 2 or 3 on a line, 3, 6, 4 or 9 in the plane, 4, 10, 8 or 27 in space. The
    functions are in scikit-fem's order, that of ``CellKind.places``, on a line start, end, middle;
    coordinates run from 0 to 1.
    """
    if dimension == 1:
        value, slope = _line(count == 2, local[..., 0])
        return value, slope[..., None]
    if count in _SIMPLEX[dimension]:
        return _simplex(dimension, count, local)
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


def _line(linear: bool, s: Array) -> tuple[Array, Array]:
    """Functions of one direction and their derivatives: start, end, middle."""
    if linear:
        return (np.stack([1.0 - s, s], axis=-1),
                np.stack([np.full(s.shape, -1.0), np.ones(s.shape)], axis=-1))
    return (np.stack([(1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)], -1),
            np.stack([4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s], axis=-1))
