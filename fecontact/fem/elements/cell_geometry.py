"""Geometry of cells: orientation, volume, sides in common, second-order places of curved cells."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import MeshError
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    CellKind,
    blocks_of,
    edges_around,
    numbered_rows,
    padded,
    shape_functions,
    widths,
)
from fecontact.fem.elements.quadrature import rule

_FLAT = 1e-12  # volume of a degenerate cell, relative to that of a cube of its size
_ON_EDGE = 1e-5  # distance of a node on an edge, per length: coordinates in single precision
# Cells whose places are compared at once, and the depth in a cell at which a place lies within it,
# relative to its centre.
_AT_ONCE, _WITHIN = 4000, 0.1
_CELLS = 50_000  # whose corners are looked at together


def oriented(nodes: Array, cells: Integers) -> tuple[Integers, NDArray[np.bool_]]:
    """Cells with positive volume, those of the opposite orientation renumbered.

    A mask (M,) of cells that have none, or are folded at a corner, comes beside them. In the plane
    the volume is the area.
    """
    dimension = nodes.shape[1]
    found, flat = np.array(cells), np.zeros(len(cells), bool)
    for which, rows in blocks_of(cells):
        kind = CELL_KINDS[dimension, rows.shape[1]]
        smallest, largest = _corner_volumes(nodes, rows, kind)
        rows = np.where((largest < 0.0)[:, None], rows[:, list(kind.mirrored)], rows)
        found[which] = padded([rows], cells.shape[1])
        smallest = np.where(largest < 0.0, -largest, smallest)
        size = np.linalg.norm(np.ptp(nodes[rows], axis=1), axis=1)
        flat[which] = smallest <= _FLAT * size**dimension
    return found, flat


def require_volume(nodes: Array, cells: Integers, flat: NDArray[np.bool_]) -> None:
    """Raise :class:`MeshError` for cells without volume or folded ones, of which ``flat`` tells."""
    if not flat.any():
        return
    first, dimension = int(np.flatnonzero(flat)[0]), nodes.shape[1]
    where = ", ".join(f"{x:g}" for x in centres_of(nodes, cells)[first])
    what = f"have no {'area' if dimension == 2 else 'volume'}"
    if widths(cells)[first] > dimension + 1:
        what += ", or are folded or inverted"
    raise MeshError(f"{np.count_nonzero(flat)} mesh cells {what}, the first is cell {first} at "
                    f"({where}).")


def _corner_volumes(nodes: Array, cells: Integers, kind: CellKind) -> tuple[Array, Array]:
    """Least and largest Jacobian determinants (M,) at the corners."""
    local = np.array(kind.places[:kind.corners], float)[:1 if kind.simplex else None]
    _, slopes = shape_functions(kind.dimension, kind.corners, local)
    least, largest = np.empty(len(cells)), np.empty(len(cells))
    for first in range(0, len(cells), _CELLS):
        part = slice(first, first + _CELLS)
        corners = nodes[cells[part][:, list(kind.order)]]
        determinants = np.linalg.det(np.einsum("pkj,mki->mpij", slopes, corners))
        least[part], largest[part] = determinants.min(axis=1), determinants.max(axis=1)
    return least, largest


def straight_volumes(nodes: Array, cells: Integers, kind: CellKind) -> Array:
    """Volumes (M,), in the plane areas, of cells with straight edges [m^d]."""
    corners = nodes[cells[:, list(kind.order)]]
    if kind.simplex:
        return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1])
                          / math.factorial(kind.dimension))
    # Determinants of trilinear cells are quadratic in each direction.
    local, weights = rule(kind.dimension, kind.corners, 2)
    _, slopes = shape_functions(kind.dimension, kind.corners, local)
    return np.asarray(np.linalg.det(np.einsum("pkj,mki->mpij", slopes, corners)) @ weights)


def sides_of(cells: Integers, dimension: int) -> tuple[Integers, Integers]:
    """Sides (F, n) of each cell in turn, so that inner ones occur twice, and their cells (F,).

    Rows of cells, and of triangles beside quadrilaterals, are filled by their last corner.
    """
    blocks = blocks_of(cells)
    size = max(len(side) for _, rows in blocks for side in CELL_KINDS[
        dimension, rows.shape[1]].facets)
    sides, owner = [], []
    for which, rows in blocks:
        table = _filled(CELL_KINDS[dimension, rows.shape[1]].facets, size)
        sides.append(rows[:, table].reshape(-1, size))
        owner.append(np.repeat(np.arange(len(cells))[which], len(table)))
    if len(blocks) == 1:
        return sides[0], owner[0]
    order = np.argsort(np.concatenate(owner), kind="stable")
    return np.concatenate(sides)[order], np.concatenate(owner)[order]


def _filled(facets: Sequence[Sequence[int]], size: int) -> Integers:
    """Facets of a cell (f, size), rows filled by their last corner."""
    return np.array([[*facet, *[facet[-1]] * (size - len(facet))] for facet in facets])


def require_apart(facets: Integers, number: Integers, count: Integers, nodes: Array) -> None:
    """Raise :class:`MeshError` where two cells lie on the same side of the side they share.

    ``facets`` are the outward faces or edges of all cells, ``number`` those without orientation.
    """
    ahead = np.empty(len(facets), np.int64)
    for which, some in blocks_of(facets):
        first = np.argmin(some, axis=1)
        rows, width = np.arange(len(some)), some.shape[1]
        ahead[which] = first if width == 2 else (
            some[rows, (first + 1) % width] < some[rows, first - 1])
    twice = (count == 2) & (np.bincount(number, ahead, minlength=len(count)) != 1)
    if twice.any():
        place = nodes[facets[np.flatnonzero(twice[number])[0]]].mean(axis=0)
        sides = "edges" if facets.shape[1] == 2 else "faces"
        raise MeshError(f"{np.count_nonzero(twice)} {sides} have both "
                        f"of their cells on one side, the first at "
                        f"({', '.join(f'{x:g}' for x in place)}): the mesh has inverted or "
                        f"overlapping elements; mesh the body anew.")


def require_no_overlap(nodes: Array, cells: Integers, at_outline: Integers) -> None:
    """Raise :class:`MeshError` where a cell at the outline lies partly within another cell.

    Overlaps that leave the centre of a cell, and the places half way from there to its corners,
    outside other cells are not found: of curved faces that touch, the chords may overlap.
    ``at_outline`` are the numbers of the cells with a side that belongs to them only.
    """
    from scipy.spatial import KDTree

    dimension = nodes.shape[1]
    centre, radius = centres_of(nodes, cells), np.empty(len(cells))
    for first in range(0, len(cells), _CELLS):
        part = slice(first, first + _CELLS)
        radius[part] = np.linalg.norm(nodes[cells[part]] - centre[part, None], axis=2).max(axis=1)
    tables = {kind.corners: kind.facets for (of, _), kind in CELL_KINDS.items() if of == dimension}
    size, shared = (how(len(side) for width in np.unique(widths(cells)).tolist()
                        for side in tables[width]) for how in (max, min))
    most = max(map(len, tables.values()))
    sides_at = np.zeros((max(tables) + 1, most, size), np.int64)
    for width, facets in tables.items():
        if max(map(len, facets)) <= size:
            sides_at[width] = _filled(facets, size)[np.minimum(np.arange(most), len(facets) - 1)]
    places = np.concatenate([centre[at_outline, None],
                             0.5 * (centre[at_outline, None] + nodes[cells[at_outline]])], axis=1)
    level = np.floor(np.log2(radius))
    for one in np.unique(level):
        large = np.flatnonzero(level == one)
        tree = KDTree(centre[large])
        for first in range(0, len(at_outline), _AT_ONCE):
            some = places[first : first + _AT_ONCE]
            near = tree.query_ball_point(some.reshape(-1, dimension), radius[large].max())
            sizes = np.array([len(found) for found in near])
            place = np.repeat(np.arange(len(near)), sizes)
            cell = large[np.concatenate([np.asarray(found, np.int64) for found in near])]
            own = at_outline[first + place // some.shape[1]]
            at = some.reshape(-1, dimension)[place]
            held, of = np.unique(cell, return_inverse=True)
            sides = nodes[cells[held][np.arange(len(held))[:, None, None],
                                      sides_at[widths(cells[held])]]]
            on_side, normal = sides.mean(axis=2), _side_normals(sides)
            inside = np.einsum("mfd,mfd->mf", on_side - centre[held, None], normal)
            depth = np.einsum("pfd,pfd->pf", on_side[of] - at[:, None], normal[of])
            within = (depth > _WITHIN * inside[of]).all(axis=1) & (own != cell)
            for a, b in zip(own[within], cell[within], strict=True):
                # Two cells with a common side lie apart, see require_apart.
                if len(np.intersect1d(cells[a], cells[b])) < shared:
                    where = ", ".join(f"{x:g}" for x in centre[a])
                    raise MeshError(f"Mesh cells {a} and {b} overlap at ({where}); remove one of "
                                    f"them, or move the parts of the mesh apart.")


def centres_of(nodes: Array, cells: Integers) -> Array:
    """Mean places (M, d) of the corners of cells [m]."""
    found = np.empty((len(cells), nodes.shape[1]))
    for which, rows in blocks_of(cells):
        for part in np.array_split(np.arange(len(cells))[which], 1 + len(rows) // _CELLS):
            found[part] = nodes[cells[part, : rows.shape[1]]].mean(axis=1)
    return found


def _side_normals(sides: Array) -> Array:
    """Outward vectors (M, f, d) normal to sides (M, f, n, d) of cells."""
    if sides.shape[3] == 2:
        along = sides[:, :, 1] - sides[:, :, 0]
        return np.stack([along[..., 1], -along[..., 0]], axis=-1)
    return np.asarray(np.cross(sides[:, :, 2] - sides[:, :, 0],
                               sides[:, :, -1] - sides[:, :, 1]))


def require_conforming(outline: Integers, nodes: Array) -> None:
    """Raise :class:`MeshError` for hanging nodes, at which a cut through the mesh ends.

    Such a node lies inside an edge of one cell, whose ends it shares with edges of other cells.
    ``outline`` are the edges or faces (k, n) that belong to one cell only.
    """
    from scipy.spatial import KDTree

    _require_like_faces(outline, nodes)
    ends, _, _ = numbered_rows(edges_around(outline)[0])
    on_outline = np.unique(ends)
    a, b = nodes[ends[:, 0]], nodes[ends[:, 1]]
    middles, radii = 0.5 * (a + b), 0.5 * (1.0 - _ON_EDGE) * np.linalg.norm(b - a, axis=1)
    tree, known = KDTree(nodes[on_outline]), None
    for edge in np.flatnonzero(tree.query_ball_point(middles, radii, return_length=True)):
        near = on_outline[tree.query_ball_point(middles[edge], radii[edge])]
        along = b[edge] - a[edge]
        part = (nodes[near] - a[edge]) @ along / (along @ along)
        off = nodes[near] - a[edge] - part[:, None] * along
        hanging = np.linalg.norm(off, axis=1) <= _ON_EDGE * np.linalg.norm(along)
        if not hanging.any():
            continue
        known = known or set(map(tuple, ends.tolist()))
        chain = [ends[edge, 0], *near[hanging][np.argsort(part[hanging])], ends[edge, 1]]
        if all((min(pair), max(pair)) in known for pair in pairwise(map(int, chain))):
            raise MeshError(f"Mesh node {chain[1]} lies inside the edge between mesh nodes "
                            f"{chain[0]} and {chain[-1]} of another cell and is not joined to it "
                            f"(a hanging node); mesh the body anew with cells that share whole "
                            f"{'edges' if outline.shape[1] == 2 else 'faces'}.")


def _require_like_faces(outline: Integers, nodes: Array) -> None:
    """Raise :class:`MeshError` for a quadrilateral that meets triangles on its other side."""
    faces = {rows.shape[1]: rows for _, rows in blocks_of(outline)}
    if sorted(faces) != [3, 4]:
        return
    corners = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 0], [3, 0, 1]])
    halves = np.sort(faces[4][:, corners].reshape(-1, 3), axis=1)
    number = numbered_rows(np.concatenate([np.sort(faces[3], axis=1), halves]))[1]
    met = np.isin(number[len(faces[3]):], number[: len(faces[3])]).reshape(-1, 4).any(axis=1)
    if met.any():
        where = ", ".join(f"{x:g}" for x in nodes[faces[4][met][0]].mean(axis=0))
        raise MeshError(f"{np.count_nonzero(met)} four-sided faces of cells meet triangles of "
                        f"others, the first at ({where}); put pyramids between hexahedra or wedges "
                        f"and tetrahedra.")


def second_order_places(
    nodes: Array, cells: Integers, kind: CellKind, middles: Array
) -> Array:
    """Places (M, k, d) of the second-order nodes of cells, in the order of ``kind.places``.

    ``middles`` (M, edges, d) are those of the edges. Middles of faces and of cells follow from
    these, see ``CellKind.inner_weights``.
    """
    corners = nodes[cells[:, list(kind.order)]]
    places = np.concatenate([corners, middles], axis=1)
    inner = np.einsum("si,msd->mid", kind.inner_weights, places)
    return np.concatenate([places, inner], axis=1)


def curved_volumes(places: Array, kind: CellKind) -> Array:
    """Volumes (M,), in the plane areas, of cells with second-order places (M, k, d).

    Raises
    ------
    MeshError
        If a cell is folded: its Jacobian determinant is not positive everywhere.
    """
    count, dimension = len(kind.places), kind.dimension
    corners = np.array(kind.places, float)
    # Exact for determinants of second-order cells but pyramids: degree 5 a direction.
    points, weights = rule(dimension, kind.corners, 5)
    volume = np.zeros(len(places))
    smallest = np.full(len(places), np.inf)
    for local, weight in zip(np.concatenate([points, corners]),
                             np.concatenate([weights, np.zeros(len(corners))]), strict=True):
        _, slopes = shape_functions(dimension, count, local)
        determinant = np.linalg.det(np.einsum("kj,mki->mij", slopes, places))
        volume += weight * determinant
        smallest = np.minimum(smallest, determinant)
    bad = smallest <= 1e-6 * volume
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        where = ", ".join(f"{x:g}" for x in places[first].mean(axis=0))
        raise MeshError(f"{np.count_nonzero(bad)} curved mesh cells are folded, the first is cell "
                        f"{first} at ({where}); mesh with a smaller size or first-order elements.")
    return volume
