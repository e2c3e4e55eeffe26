"""Cells as VTK numbers them, first-order ones and serendipity elements."""

from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import blocks_of, padded, widths
from fecontact.fem.fields import linear_cells
from fecontact.fem.interpolation import element_kind

# Type by dimension and number of nodes: VTK_TRIANGLE, VTK_QUAD, VTK_TETRA, VTK_PYRAMID, VTK_WEDGE,
# VTK_HEXAHEDRON, then VTK_QUADRATIC_TRIANGLE and so on.
_TYPES = {(2, 3): 5, (2, 4): 9, (3, 4): 10, (3, 5): 14, (3, 6): 13, (3, 8): 12,
          (2, 6): 22, (2, 8): 23, (3, 10): 24, (3, 13): 27, (3, 15): 26, (3, 20): 25}
_RING = ((0, 1), (1, 2), (2, 3), (0, 3))
# Edges in the order of the nodes in their middles.
_EDGES = {
    (2, 6): ((0, 1), (1, 2), (0, 2)), (2, 8): _RING,
    (3, 10): ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
    (3, 13): (*_RING, (0, 4), (1, 4), (2, 4), (3, 4)),
    (3, 15): ((0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)),
    (3, 20): (*_RING, (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7))}
_SERENDIPITY = {(2, 8), (3, 13), (3, 15), (3, 20)}


def written_cells(nodes: Array, elements: Integers | None, cells: Integers) -> Integers:
    """Cells (M, n) of files, rows filled by their last node.

    Meshes with serendipity elements keep all their elements with middles of edges; first-order
    ``cells`` stand for other elements.
    """
    if elements is None:
        return cells
    d, blocks = nodes.shape[1], blocks_of(elements)
    if not {(d, rows.shape[1]) for _, rows in blocks} & _SERENDIPITY:
        return cells
    found = []
    for _, rows in blocks:
        kind, edges = element_kind(d, rows.shape[1]), _EDGES.get((d, rows.shape[1]))
        if edges is None:
            found.append(linear_cells(nodes, rows))
            continue
        corners = [kind.order.index(corner) for corner in range(kind.corners)]
        known = [frozenset(edge) for edge in kind.edges]
        middles = [kind.corners + known.index(frozenset(edge)) for edge in edges]
        found.append(rows[:, corners + middles])
    return padded(found)


def cells_of_vtk(cells: Integers, dimension: int) -> tuple[Integers, Integers, Any]:
    """Nodes of all cells in turn, the first (M + 1,) of each and the last one's end, VTK's types.

    Rows of cells may be filled by their last node.
    """
    size = widths(cells)
    types = np.zeros(1 + max(count for _, count in _TYPES), np.uint8)
    for (of, count), code in _TYPES.items():
        types[count] = code if of == dimension else types[count]
    nodes = cells[np.arange(cells.shape[1]) < size[:, None]].astype(np.int64)
    return nodes, np.append(0, np.cumsum(size)), types[size]
