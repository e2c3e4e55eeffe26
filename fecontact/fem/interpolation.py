"""Interpolation of nodal values at any place of a body, by the shape functions of its elements."""

from collections.abc import Sequence

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    CellKind,
    blocks_of,
    shape_functions,
)
from fecontact.fem.elements.quadrature import rule

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
        triangles, 4, 8 or 9 of quadrilaterals, 4 or 10 of tetrahedra, 5, 13 or 14 of pyramids, 6,
        15 or 18 of wedges, 8, 20 or 27 of hexahedra. Shorter rows are filled by their last node.
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
    dimension = nodes.shape[1]
    found, total = [], 0.0
    for _, members in blocks_of(elements):
        kind = element_kind(dimension, members.shape[1])
        corners = nodes[members[:, :kind.corners]]
        near = 1e-6 * np.ptp(corners, axis=1)
        low, high = corners.min(axis=1), corners.max(axis=1)
        curved = _curved(nodes, members, kind)
        if curved.any():
            reach = nodes[members[curved]]
            near[curved] = _BULGE * np.ptp(reach, axis=1).max(axis=1, keepdims=True)
            low[curved], high[curved] = reach.min(axis=1), reach.max(axis=1)
        around = np.flatnonzero(((low - near <= at) & (at <= high + near)).all(axis=1))
        for element in around:
            places = nodes[members[element]] if curved[element] else corners[element]
            local = _local(places, at, kind)
            if local is None:
                continue
            values, slopes = shape_functions(dimension, members.shape[1], local)
            jacobian = places.T @ shape_functions(dimension, len(places), local)[1]
            size = _size(corners[element], kind)
            weights = np.vstack([values, np.linalg.solve(jacobian.T, slopes.T)])
            found.append((members[element], size * weights))
            total += size
    if not found:
        where = ", ".join(f"{x:g}" for x in at)
        spans = ", ".join(f"{axis} = {a:g} ... {b:g}" for axis, a, b in zip(
            "xyz", nodes.min(axis=0), nodes.max(axis=0), strict=False))
        raise InputError(f"{name}: ({where}) lies outside the body, which spans {spans}.")
    which, index = np.unique(np.concatenate([one for one, _ in found]), return_inverse=True)
    weights = np.zeros((1 + dimension, len(which)))
    np.add.at(weights.T, index, np.hstack([one for _, one in found]).T / total)
    return which, weights


def element_kind(dimension: int, count: int) -> CellKind:
    """Kind of elements with that many nodes, linear, serendipity or quadratic."""
    return next(kind for (of, corners), kind in CELL_KINDS.items()
                if of == dimension and count in kind.counts)


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
    local = kind.middle
    for _ in range(30):  # one step for parallelograms, straight triangles and tetrahedra
        values, slopes = shape_functions(dimension, len(places), local)
        step = np.linalg.solve(places.T @ slopes, place - values @ places)
        local = local + step
        if not 1e-14 <= np.abs(step).max() <= 10.0:  # done, or far outside
            break
    return local if kind.holds(local, _INSIDE) else None


def _size(corners: Array, kind: CellKind) -> float:
    """Area or about the volume of an element."""
    if kind.dimension == 2:
        x, y = corners.T
        return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    jacobian = corners.T @ shape_functions(3, len(corners), kind.middle)[1]
    return abs(float(np.linalg.det(jacobian))) * float(rule(3, kind.corners, 1)[1].sum())
