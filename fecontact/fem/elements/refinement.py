"""Refinement of meshes: every plane cell is cut into four, every solid cell into eight."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_geometry import second_order_places
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    CellBlock,
    blocks_of,
    numbered_rows,
    padded,
    row_numbers,
    shape_functions,
)


class _Cells(Protocol):
    """Parts of a mesh that refinement needs."""

    @property
    def nodes(self) -> Array: ...
    @property
    def blocks(self) -> Sequence[CellBlock]: ...
    @property
    def boundaries(self) -> Mapping[str, Integers]: ...
    @property
    def dimension(self) -> int: ...
    @property
    def edges(self) -> tuple[Integers, Integers]: ...
    @property
    def edge_middles(self) -> Array: ...
    @property
    def curved_cells(self) -> Integers: ...
    @property
    def _second_order(self) -> "SecondOrder": ...
    def second_order_places(self, block: CellBlock) -> Array: ...


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """Second-order nodes of a mesh.

    Nodes keep their numbers; middles of edges follow, then those of the four-sided faces of solids
    and the centres of hexahedra and of four-sided plane cells.

    Attributes
    ----------
    places : (N, d) array
        Places [m].
    members : list of (m, k) integer arrays
        Nodes of the cells of each block, in the order of their kind.
    faces : (f, 4) integer array
        Corners of the four-sided faces, ascending.
    """

    places: Array
    members: list[Integers]
    faces: Integers


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
    (3, 6): ((0, 6, 8, 12, 15, 17), (6, 1, 7, 15, 13, 16), (8, 7, 2, 17, 16, 14),
             (6, 7, 8, 15, 16, 17), (12, 15, 17, 3, 9, 11), (15, 13, 16, 9, 4, 10),
             (17, 16, 14, 11, 10, 5), (15, 16, 17, 9, 10, 11)),
    # Six pyramids and four tetrahedra.
    (3, 5): ((0, 5, 13, 8, 9), (5, 1, 6, 13, 10), (13, 6, 2, 7, 11), (8, 13, 7, 3, 12),
             (9, 10, 11, 12, 4), (9, 12, 11, 10, 13), (5, 10, 9, 13), (6, 11, 10, 13),
             (7, 12, 11, 13), (8, 9, 12, 13)),
}


def second_order_nodes(mesh: _Cells) -> SecondOrder:
    """Second-order nodes of the cells of a mesh."""
    count = len(mesh.nodes)
    ends, number = mesh.edges
    nodes = [mesh.nodes, mesh.edge_middles]
    members = [[block.ordered,
                count + number[block.numbers][:, : len(block.kind.edges)]]
               for block in mesh.blocks]
    count += len(ends)
    sides = [block.nodes[:, np.array(block.kind.four_sided, np.int64).reshape(-1, 4)]
             for block in mesh.blocks]
    rows = np.concatenate([side.reshape(-1, 4) for side in sides])
    faces, which, _ = numbered_rows(np.sort(rows, axis=1))
    first = 0
    for side, own in zip(sides, members, strict=True):
        size = side.shape[0] * side.shape[1]
        own.append(count + which[first : first + size].reshape(side.shape[:2]))
        first += size
    nodes.append(mesh.nodes[faces].mean(axis=1))
    count += len(faces)
    for block, own in zip(mesh.blocks, members, strict=True):
        if block.kind.has_centre:
            own.append(count + np.arange(len(block.nodes))[:, None])
            nodes.append(mesh.nodes[block.nodes].mean(axis=1))
            count += len(block.nodes)
    places, found = np.concatenate(nodes), [np.concatenate(own, axis=1) for own in members]
    if len(mesh.curved_cells):
        for block, rows in zip(mesh.blocks, found, strict=True):
            curved = np.isin(block.numbers, mesh.curved_cells)
            places[rows[curved]] = mesh.second_order_places(block.only(curved))
    return SecondOrder(places, found, faces)


def at_second_order(mesh: _Cells, values: Array) -> Array:
    """Values (n,) at all second-order nodes from those (N + E,) at corners and middles of edges."""
    found = np.zeros(len(mesh._second_order.places))
    corners, middles = values[: len(mesh.nodes), None], values[len(mesh.nodes) :, None]
    for block, members in zip(mesh.blocks, mesh._second_order.members, strict=True):
        edges = mesh.edges[1][block.numbers][:, : len(block.kind.edges)]
        found[members] = second_order_places(corners, block.nodes, block.kind,
                                             middles[edges])[:, :, 0]
    return found


def refined(
    mesh: _Cells
) -> tuple[tuple[Array, Integers, dict[str, Integers], Integers, Array], Integers]:
    """Nodes, cells, boundaries, curved edges and their middles of the refined mesh.

    The cell (M,) of which each is a part comes beside them.
    """
    second = mesh._second_order
    cells, owner = [], []
    for block, members in zip(mesh.blocks, second.members, strict=True):
        for part in PARTS[mesh.dimension, block.kind.corners]:
            cells.append(members[:, list(part)])
            owner.append(block.numbers)
    boundaries = {name: _facet_parts(mesh, group, second.faces)
                  for name, group in mesh.boundaries.items()}
    return (second.places, padded(cells), boundaries, *_curves(mesh)), np.concatenate(owner)


def _facet_parts(mesh: _Cells, facets: Integers, faces: Integers) -> Integers:
    """Parts of sides, one side after the other."""
    count, known = len(mesh.nodes), mesh.edges[0]
    keys = known[:, 0] * count + known[:, 1]
    parts, owner = [], []
    for which, some in blocks_of(facets):
        pairs = np.stack([some, np.roll(some, -1, axis=1)], axis=2)
        if some.shape[1] == 2:
            pairs = pairs[:, :1]
        ordered = np.sort(pairs, axis=2)
        middles = count + np.searchsorted(keys, ordered[..., 0] * count + ordered[..., 1])
        corner, after, before = some, middles, np.roll(middles, 1, axis=1)
        if some.shape[1] == 2:
            a, b, m = *some.T, middles[:, 0]
            found = np.stack([a, m, m, b], axis=1).reshape(-1, 2, 2)
        elif some.shape[1] == 3:
            around = np.stack([corner, after, before], axis=2)
            found = np.concatenate([around, middles[:, None]], axis=1)
        else:
            centre = count + len(known) + row_numbers(faces, np.sort(some, axis=1))
            found = np.stack([corner, after, np.repeat(centre[:, None], 4, axis=1), before],
                             axis=2)
        parts.append(found.reshape(-1, found.shape[2]))
        owner.append(np.repeat(np.arange(len(facets))[which], found.shape[1]))
    return padded(parts, facets.shape[1])[np.argsort(np.concatenate(owner), kind="stable")]


def _curves(mesh: _Cells) -> tuple[Integers, Array]:
    """Curved edges of the parts of curved cells, and their middles."""
    second = mesh._second_order
    found = [np.empty((0, 2), np.int64)]
    places = [np.empty((0, mesh.dimension))]
    for block, rows in zip(mesh.blocks, second.members, strict=True):
        curved = rows[np.isin(block.numbers, mesh.curved_cells)]
        local = np.array(block.kind.places, float)
        pairs = np.unique(np.sort([
            [part[i], part[j]] for part in PARTS[mesh.dimension, block.kind.corners]
            for i, j in CELL_KINDS[mesh.dimension, len(part)].edges], axis=1), axis=0)
        values, _ = shape_functions(mesh.dimension, len(local), local[pairs].mean(axis=1))
        places.append(np.einsum("ek,mki->mei", values, second.places[curved]).reshape(
            -1, mesh.dimension))
        found.append(np.sort(curved[:, pairs].reshape(-1, 2), axis=1))
    ends, middles = np.concatenate(found), np.concatenate(places)
    _, first = np.unique(numbered_rows(ends)[1], return_index=True)
    ends, middles = ends[first], middles[first]
    chord = second.places[ends[:, 1]] - second.places[ends[:, 0]]
    off = np.linalg.norm(middles - second.places[ends].mean(axis=1), axis=1)
    bent = off > 1e-12 * np.linalg.norm(chord, axis=1)
    return ends[bent], middles[bent]
