"""First-order cells between the nodes of serendipity elements, which have none in their middles."""

import numpy as np

from fecontact.core.types import Integers
from fecontact.fem.elements.cell_kinds import CellKind


def serendipity_parts(kind: CellKind, rows: Integers) -> list[Integers]:
    """First-order cells (m, k) between the nodes of serendipity elements (M, n).

    The corners are cut off. What is left of a plane element stays whole; of a solid one it becomes
    tetrahedra from its node with the lowest number to its faces. Four-sided faces are cut from the
    lowest number, too, so that those of neighbours fit together.
    """
    middle = {frozenset(edge): kind.corners + k for k, edge in enumerate(kind.edges)}
    at_corner = [(kind.order.index(corner),
                  [node for edge, node in middle.items() if corner in edge])
                 for corner in range(kind.corners)]
    if kind.dimension == 2:
        return [*(rows[:, [corner, *around]] for corner, around in at_corner),
                rows[:, [middle[frozenset(side)] for side in kind.facets]]]
    found, left = [], []
    for corner, around in at_corner:
        for triangles in _triangles(rows[:, around]):
            found.append(np.column_stack([rows[:, corner], triangles]))
            left.append(triangles)
    for facet in kind.facets:
        left += _triangles(rows[:, [middle[frozenset(pair)] for pair in zip(
            facet, (*facet[1:], facet[0]), strict=True)]])
    lowest = rows[:, kind.corners:].min(axis=1)
    for triangles in left:
        away = (triangles != lowest[:, None]).all(axis=1)
        found.append(np.column_stack([lowest[away], triangles[away]]))
    return [cells for cells in found if len(cells)]


def lowest_first(polygons: Integers) -> Integers:
    """Polygons (k, n) turned such that each begins with its lowest number."""
    count = polygons.shape[1]
    turn = (polygons.argmin(axis=1)[:, None] + np.arange(count)) % count
    return np.take_along_axis(polygons, turn, axis=1)


def _triangles(polygons: Integers) -> list[Integers]:
    """Triangles (k, 3) of polygons (k, n), cut from the lowest number of each."""
    fan = lowest_first(polygons)
    return [fan[:, [0, k, k + 1]] for k in range(1, polygons.shape[1] - 1)]
