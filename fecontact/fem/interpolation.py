"""Interpolation of nodal values at any place of a body, by the shape functions of its elements."""

from collections.abc import Sequence

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import CELL_KINDS, CellKind, shape_functions

_INSIDE = 1e-9  # of local coordinates, which run from 0 to 1
_CURVED = 1e-9  # distance of a middle from that of its corners, relative to the element's size
_BULGE = 0.25  # how far curved sides may reach beyond their nodes, relative to the size


def interpolation(
    nodes: Array, elements: Integers, place: Sequence[float] | Array, name: str
) -> tuple[Integers, Array]:
    """Nodes (k,) and their weights (1 + d, k) for the value and its derivatives at a place.

    Where elements meet, the derivatives are the means over them, weighted by their volumes.

    Parameters
    ----------
    nodes : (N, d) array
        Places of the displacement nodes [m].
    elements : (E, k) integer array
        Nodes of the elements in the order of ``CellKind.places``, straight or curved: 3 or 6 of
        triangles, 4 or 9 of quadrilaterals, 4 or 10 of tetrahedra, 8 or 27 of hexahedra.
    place : d floats
        [m].
    name : str
        Name of the object at the place, for messages.

    Raises
    ------
    InputError
        If the place lies outside the body.
    """
    at = np.asarray(place, dtype=float)
    kind = element_kind(nodes.shape[1], elements.shape[1])
    corners = nodes[elements[:, :kind.corners]]
    near = 1e-6 * np.ptp(corners, axis=1)
    low, high = corners.min(axis=1), corners.max(axis=1)
    curved = _curved(nodes, elements, kind)
    if curved.any():
        reach = nodes[elements[curved]]
        near[curved] = _BULGE * np.ptp(reach, axis=1).max(axis=1, keepdims=True)
        low[curved], high[curved] = reach.min(axis=1), reach.max(axis=1)
    around = np.flatnonzero(((low - near <= at) & (at <= high + near)).all(axis=1))
    found, total = [], 0.0
    for element in around:
        places = nodes[elements[element]] if curved[element] else corners[element]
        local = _local(places, at, kind)
        if local is None:
            continue
        values, slopes = shape_functions(kind.dimension, elements.shape[1], local)
        jacobian = places.T @ shape_functions(kind.dimension, len(places), local)[1]
        size = _size(corners[element], kind)
        weights = np.vstack([values, np.linalg.solve(jacobian.T, slopes.T)])
        found.append((elements[element], size * weights))
        total += size
    if not found:
        where = ", ".join(f"{x:g}" for x in at)
        spans = ", ".join(f"{axis} = {a:g} ... {b:g}" for axis, a, b in zip(
            "xyz", nodes.min(axis=0), nodes.max(axis=0), strict=False))
        raise InputError(f"{name}: ({where}) lies outside the body, which spans {spans}.")
    which, index = np.unique(np.concatenate([one for one, _ in found]), return_inverse=True)
    weights = np.zeros((1 + kind.dimension, len(which)))
    np.add.at(weights.T, index, np.hstack([one for _, one in found]).T / total)
    return which, weights


def element_kind(dimension: int, count: int) -> CellKind:
    """Kind of elements with that many nodes, linear or quadratic."""
    simplex = count in ((3, 6), (4, 10))[dimension - 2]
    return CELL_KINDS[dimension, dimension + 1 if simplex else 2**dimension]


def _curved(nodes: Array, elements: Integers, kind: CellKind) -> Array:
    """Boolean mask (E,) of the curved elements."""
    if elements.shape[1] == kind.corners:
        return np.zeros(len(elements), bool)
    rank = {corner: k for k, corner in enumerate(kind.order)}
    ends = np.array([[rank[a], rank[b]] for a, b in kind.edges])
    middles = nodes[elements[:, kind.corners:kind.corners + len(ends)]]
    off = np.linalg.norm(middles - nodes[elements[:, ends]].mean(axis=2), axis=2).max(axis=1)
    size = np.linalg.norm(np.ptp(nodes[elements[:, :kind.corners]], axis=1), axis=1)
    return np.asarray(off > _CURVED * size)


def _local(places: Array, place: Array, kind: CellKind) -> Array | None:
    """Local coordinates (d,) of a place in an element (k, d); None outside."""
    dimension = kind.dimension
    local = np.full(dimension, 1.0 / (dimension + 1) if kind.simplex else 0.5)
    for _ in range(30):  # one step for parallelograms, straight triangles and tetrahedra
        values, slopes = shape_functions(dimension, len(places), local)
        step = np.linalg.solve(places.T @ slopes, place - values @ places)
        local = local + step
        if not 1e-14 <= np.abs(step).max() <= 10.0:  # done, or far outside
            break
    beyond = local.sum() if kind.simplex else local.max()
    if not -_INSIDE <= local.min() <= beyond <= 1.0 + _INSIDE:
        return None
    return local


def _size(corners: Array, kind: CellKind) -> float:
    """Area or about the volume of an element."""
    if kind.dimension == 2:
        x, y = corners.T
        return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    middle = np.full(3, 0.25 if kind.simplex else 0.5)
    jacobian = corners.T @ shape_functions(3, len(corners), middle)[1]
    return abs(float(np.linalg.det(jacobian))) / (6.0 if kind.simplex else 1.0)
