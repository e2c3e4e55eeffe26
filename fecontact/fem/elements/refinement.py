"""Refinement of meshes: every plane cell is cut into four, every solid cell into eight."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_geometry import second_order_places
from fecontact.fem.elements.cell_kinds import CellKind, numbered_rows, shape_functions


class _Cells(Protocol):
    """Parts of a mesh that refinement needs."""

    @property
    def nodes(self) -> Array: ...
    @property
    def cells(self) -> Integers: ...
    @property
    def boundaries(self) -> Mapping[str, Integers]: ...
    @property
    def dimension(self) -> int: ...
    @property
    def kind(self) -> CellKind: ...
    @property
    def edges(self) -> tuple[Integers, Integers]: ...
    @property
    def edge_middles(self) -> Array: ...
    @property
    def curved_cells(self) -> Integers: ...
    def second_order_places(self, cells: Integers | None = None) -> Array: ...


# Corners of the parts among the second-order nodes of a cell, in the order of its kind. The
# octahedron inside a tetrahedron is cut along one of its diagonals.
PARTS: dict[tuple[int, int], tuple[tuple[int, ...], ...]] = {
    (2, 3): ((0, 3, 5), (1, 4, 3), (2, 5, 4), (3, 4, 5)),
    (2, 4): ((0, 4, 8, 7), (1, 5, 8, 4), (2, 6, 8, 5), (3, 7, 8, 6)),
    (3, 4): ((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3),
             (4, 6, 7, 8), (4, 5, 6, 8), (6, 7, 8, 9), (5, 6, 9, 8)),
    (3, 8): ((7, 17, 24, 18, 19, 23, 26, 25), (17, 4, 11, 24, 23, 13, 20, 26),
             (24, 11, 1, 12, 26, 20, 8, 22), (18, 24, 12, 5, 25, 26, 22, 15),
             (19, 23, 26, 25, 6, 14, 21, 16), (23, 13, 20, 26, 14, 2, 9, 21),
             (26, 20, 8, 22, 21, 9, 0, 10), (25, 26, 22, 15, 16, 21, 10, 3)),
}


def second_order_nodes(mesh: _Cells) -> tuple[Array, Integers, Integers]:
    """Places of all second-order nodes, those of each cell (M, k), and the faces' corners.

    Nodes keep their numbers; middles of edges follow, then those of the four-sided faces of solids
    and of four-sided plane cells.
    """
    kind, count = mesh.kind, len(mesh.nodes)
    ends, number = mesh.edges
    nodes = [mesh.nodes, mesh.edge_middles]
    members = [mesh.cells[:, list(kind.order)], count + number]
    faces = np.empty((0, 4), np.int64)
    count += len(ends)
    if kind.corners == 8:
        local = np.array(kind.places[:8])
        sides = [np.flatnonzero((local[:, middle != 0.5] == middle[middle != 0.5]).all(axis=1))
                 for middle in np.array(kind.places[20:26])]
        rows = np.sort(members[0][:, np.array(sides)].reshape(-1, 4), axis=1)
        faces, which, _ = numbered_rows(rows)
        members.append(count + which.reshape(-1, 6))
        nodes.append(mesh.nodes[faces].mean(axis=1))
        count += len(faces)
    if not kind.simplex:
        members.append(count + np.arange(len(mesh.cells))[:, None])
        nodes.append(mesh.nodes[mesh.cells].mean(axis=1))
    places, cells = np.concatenate(nodes), np.concatenate(members, axis=1)
    if len(mesh.curved_cells):
        places[cells[mesh.curved_cells]] = mesh.second_order_places(mesh.curved_cells)
    return places, cells, faces


def at_second_order(mesh: _Cells, values: Array) -> Array:
    """Values (n,) at all second-order nodes from those (N + E,) at corners and middles of edges."""
    places, members, _ = second_order_nodes(mesh)
    found = np.zeros(len(places))
    found[members] = in_cells(mesh, values)
    return found


def in_cells(mesh: _Cells, values: Array) -> Array:
    """Values (M, k) at the second-order nodes of cells, in the order of the kind; see above."""
    corners, middles = values[: len(mesh.nodes), None], values[len(mesh.nodes) :, None]
    return np.asarray(second_order_places(corners, mesh.cells, mesh.kind,
                                          middles[mesh.edges[1]])[:, :, 0])


def refined(mesh: _Cells) -> tuple[Array, Integers, dict[str, Integers], Integers, Array]:
    """Nodes, cells, boundaries, curved edges and their middles of the refined mesh."""
    places, members, faces = second_order_nodes(mesh)
    parts = PARTS[mesh.dimension, mesh.kind.corners]
    cells = np.concatenate([members[:, list(part)] for part in parts])
    boundaries = {name: _facet_parts(mesh, group, faces)
                  for name, group in mesh.boundaries.items()}
    return places, cells, boundaries, *_curves(mesh, places, members)


def _facet_parts(mesh: _Cells, facets: Integers, faces: Integers) -> Integers:
    """Parts of sides, one side after the other."""
    count, known = len(mesh.nodes), mesh.edges[0]
    pairs = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2)
    if facets.shape[1] == 2:
        pairs = pairs[:, :1]
    ordered = np.sort(pairs, axis=2)
    keys = known[:, 0] * count + known[:, 1]
    middles = count + np.searchsorted(keys, ordered[..., 0] * count + ordered[..., 1])
    if facets.shape[1] == 2:
        a, b, m = *facets.T, middles[:, 0]
        return np.stack([a, m, m, b], axis=1).reshape(-1, 2)
    corner, after, before = facets, middles, np.roll(middles, 1, axis=1)
    if facets.shape[1] == 3:
        around = np.stack([corner, after, before], axis=2)
        return np.concatenate([around, middles[:, None]], axis=1).reshape(-1, 3)
    _, number, _ = numbered_rows(np.concatenate([faces, np.sort(facets, axis=1)]))
    place = np.empty(number.max() + 1, np.int64)
    place[number[:len(faces)]] = np.arange(len(faces))
    centre = count + len(known) + place[number[len(faces):]]
    return np.stack([corner, after, np.repeat(centre[:, None], 4, axis=1), before],
                    axis=2).reshape(-1, 4)


def _curves(mesh: _Cells, places: Array, members: Integers) -> tuple[Integers, Array]:
    """Curved edges of the parts of curved cells, and their middles."""
    kind, curved = mesh.kind, mesh.curved_cells
    if not len(curved):
        return np.empty((0, 2), np.int64), np.empty((0, mesh.dimension))
    local = np.array(kind.places, float)
    pairs = np.unique(np.sort([[part[i], part[j]] for part in PARTS[mesh.dimension, kind.corners]
                               for i, j in kind.edges], axis=1), axis=0)
    values, _ = shape_functions(mesh.dimension, len(local), local[pairs].mean(axis=1))
    middles = np.einsum("ek,mki->mei", values, places[members[curved]]).reshape(
        -1, mesh.dimension)
    ends = np.sort(members[curved][:, pairs].reshape(-1, 2), axis=1)
    _, first = np.unique(numbered_rows(ends)[1], return_index=True)
    ends, middles = ends[first], middles[first]
    chord = places[ends[:, 1]] - places[ends[:, 0]]
    off = np.linalg.norm(middles - places[ends].mean(axis=1), axis=1)
    bent = off > 1e-12 * np.linalg.norm(chord, axis=1)
    return ends[bent], middles[bent]
