"""Wedges, pyramids and hexahedra cut into tetrahedra, consistently from cell to cell.

Each four-sided face is cut into triangles from its node of lowest number, and each cell into the
tetrahedra between its node of lowest number and the triangles that do not hold it. A wedge makes
three tetrahedra, a pyramid two, a hexahedron six. The middle of a diagonal follows from the
second-order nodes of the cell.

J. Dompierre, P. Labbe, M.-G. Vallet and R. Camarero, *How to subdivide pyramids, prisms and
hexahedra into tetrahedra*, 8th International Meshing Roundtable, 1999.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import HEXAHEDRON, TETRAHEDRON, CellKind

_FLAT = 1e-12  # volume of a part, relative to the cube of the size of its cell

WEDGE = CellKind(
    "wedges", 3, 6, ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    ((0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)),
    tuple(range(6)), (3, 4, 5, 0, 1, 2), ())
PYRAMID = CellKind(
    "pyramids", 3, 5, ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    ((0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4)),
    tuple(range(5)), (0, 3, 2, 1, 4), ())
SHAPES = {kind.corners: kind for kind in (TETRAHEDRON, PYRAMID, WEDGE, HEXAHEDRON)}


def cut_faces(facets: Integers) -> Integers:
    """Triangles (2 k, 3) of four-sided faces (k, 4), cut from the node of lowest number."""
    from_lowest = (np.argmin(facets, axis=1)[:, None] + np.arange(4)) % 4
    turned = np.take_along_axis(facets, from_lowest, axis=1)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def cut_into_tetrahedra(
    points: Array, number: Integers, cells: Integers, kind: CellKind
) -> Integers:
    """Corners (t, 4) of the tetrahedra of cells (M, n), which ``number`` puts in order.

    Raises
    ------
    MeshError
        For cells without volume, or folded or inverted ones.
    """
    if kind.simplex:
        return cells
    found, owner = [], []
    for which, tetrahedra in _parts(number, cells, kind):
        rows = cells[which][:, tetrahedra]
        found.append(rows.reshape(-1, 4))
        owner.append(np.repeat(which, len(tetrahedra)))
    parts, of = np.concatenate(found), np.concatenate(owner)
    corners = points[parts]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    size = np.linalg.norm(np.ptp(points[cells], axis=1), axis=1)[of] ** 3
    sides = [np.bincount(of, sign * volume > _FLAT * size, len(cells)) for sign in (1.0, -1.0)]
    whole = np.bincount(of, minlength=len(cells))
    bad = (sides[0] != whole) & (sides[1] != whole)
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        where = ", ".join(f"{x:g}" for x in points[cells[first]].mean(axis=0))
        raise MeshError(f"{np.count_nonzero(bad)} {kind.name} have no volume, or are folded or "
                        f"inverted, the first at ({where}); mesh the body anew.")
    return parts


def _parts(
    number: Integers, cells: Integers, kind: CellKind
) -> Iterator[tuple[Integers, list[list[int]]]]:
    """Cells (k,) that are cut alike, and the corners of their tetrahedra."""
    ranks = np.argsort(np.argsort(number[cells], axis=1), axis=1)
    patterns, which = np.unique(ranks, axis=0, return_inverse=True)
    for row, rank in enumerate(patterns):
        lowest = int(np.argmin(rank))
        tetrahedra = []
        for facet in kind.facets:
            if lowest in facet:
                continue
            start = int(np.argmin(rank[list(facet)]))
            turned = [*facet[start:], *facet[:start]]
            tetrahedra += [[lowest, turned[0], *turned[i : i + 2]]
                           for i in range(1, len(turned) - 1)]
        yield np.flatnonzero(which.ravel() == row), tetrahedra


def diagonals(
    points: Array, number: Integers, cells: Integers, kind: CellKind, order: Integers
) -> tuple[Integers, Array]:
    """Ends (1, k, 2) of the edges inside second-order cells and on their faces, and their middles.

    ``order`` are the columns of the middles of the edges. Middles are those of the serendipity
    shape functions: half the sum of the middles of a face less a quarter of that of its corners;
    in a hexahedron a quarter of both.
    """
    ends = [np.empty((0, 2), np.int64)]
    middles = [np.empty((0, 3))]
    for which, tetrahedra in _parts(number, cells[:, :kind.corners], kind) if not (
            kind.simplex) else ():
        pairs = {tuple(sorted(pair)) for part in tetrahedra for pair in combinations(part, 2)}
        for pair in sorted(pairs - {tuple(sorted(edge)) for edge in kind.edges}):
            face = next((facet for facet in kind.facets if {*pair} <= {*facet}),
                        tuple(range(kind.corners)))
            along = [column for edge, column in zip(kind.edges, order, strict=True)
                     if {*edge} <= {*face}]
            share = 0.5 if len(face) == 4 else 0.25
            rows = cells[which]
            ends.append(rows[:, list(pair)])
            middles.append(share * points[rows[:, along]].sum(axis=1)
                           - 0.25 * points[rows[:, list(face)]].sum(axis=1))
    return np.concatenate(ends)[None], np.concatenate(middles)[None]
