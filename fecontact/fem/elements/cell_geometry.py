"""Geometry of cells: orientation, volume, sides in common, second-order places of curved cells."""

from itertools import pairwise

import numpy as np

from fecontact.core.errors import MeshError
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import CellKind, numbered_rows, shape_functions

_FLAT = 1e-12  # volume of a degenerate cell, relative to the cube of its size
_ON_EDGE = 1e-5  # distance of a node on an edge, per length: coordinates in single precision
# Cells whose places are compared at once, and the depth in a cell at which a place lies within it,
# relative to its centre.
_AT_ONCE, _WITHIN = 4000, 0.1
_CELLS = 50_000  # whose corners are looked at together
# Gauss points from 0 to 1, exact for determinants of second-order cells: degree 5 a direction.
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_GAUSS, _WEIGHTS = 0.5 * (1.0 + _GAUSS), 0.5 * _WEIGHTS


def oriented_solids(nodes: Array, cells: Integers, kind: CellKind) -> Integers:
    """Cells of space with positive volume, those of the opposite orientation renumbered.

    Raises
    ------
    MeshError
        For cells without volume, or hexahedra folded at a corner.
    """
    smallest, largest = _corner_volumes(nodes, cells, kind)
    cells = np.where((largest < 0.0)[:, None], cells[:, list(kind.mirrored)], cells)
    smallest = np.where(largest < 0.0, -largest, smallest)
    size = np.linalg.norm(np.ptp(nodes[cells], axis=1), axis=1)
    bad = smallest <= _FLAT * size**3
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        x, y, z = nodes[cells[first]].mean(axis=0)
        what = "have no volume" if kind.simplex else "have no volume, or are folded or inverted"
        raise MeshError(f"{np.count_nonzero(bad)} mesh cells {what}, the first is cell {first} at "
                        f"({x:g}, {y:g}, {z:g}).")
    return cells


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


def solid_volumes(nodes: Array, cells: Integers, kind: CellKind) -> Array:
    """Volumes (M,) of cells with straight edges [m^3]."""
    corners = nodes[cells[:, list(kind.order)]]
    if kind.simplex:
        return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0)
    # Determinants of trilinear cells are quadratic in each direction: two points are exact.
    points = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)
    local = np.stack(np.meshgrid(points, points, points), axis=-1).reshape(-1, 3)
    _, slopes = shape_functions(3, 8, local)
    return np.asarray(np.linalg.det(np.einsum("pkj,mki->mpij", slopes, corners)).mean(axis=1))


def facets_of(cells: Integers, kind: CellKind) -> Integers:
    """Sides (M f, n) of each cell in turn, so that inner ones occur twice."""
    return cells[:, np.array(kind.facets)].reshape(-1, len(kind.facets[0]))


def require_apart(facets: Integers, number: Integers, count: Integers, nodes: Array) -> None:
    """Raise :class:`MeshError` where two cells lie on the same side of the side they share.

    ``facets`` are the outward faces or edges of all cells, ``number`` those without orientation.
    """
    first = np.argmin(facets, axis=1)
    rows, width = np.arange(len(facets)), facets.shape[1]
    ahead = first if width == 2 else (
        facets[rows, (first + 1) % width] < facets[rows, first - 1]).astype(np.int64)
    twice = (count == 2) & (np.bincount(number, ahead, minlength=len(count)) != 1)
    if twice.any():
        place = nodes[facets[np.flatnonzero(twice[number])[0]]].mean(axis=0)
        raise MeshError(f"{np.count_nonzero(twice)} {'edges' if width == 2 else 'faces'} have both "
                        f"of their cells on one side, the first at "
                        f"({', '.join(f'{x:g}' for x in place)}): the mesh has inverted or "
                        f"overlapping elements; mesh the body anew.")


def require_no_overlap(nodes: Array, cells: Integers, kind: CellKind, outline: Integers) -> None:
    """Raise :class:`MeshError` where a cell at the outline lies partly within another cell.

    Overlaps that leave the centre of a cell, and the places half way from there to its corners,
    outside other cells are not found: of curved faces that touch, the chords may overlap.
    ``outline`` are the numbers of the sides that belong to one cell only, in the order of
    :func:`facets_of`.
    """
    from scipy.spatial import KDTree

    centre, radius = np.empty((len(cells), kind.dimension)), np.empty(len(cells))
    for first in range(0, len(cells), _CELLS):
        part = slice(first, first + _CELLS)
        corners = nodes[cells[part]]
        centre[part] = corners.mean(axis=1)
        radius[part] = np.linalg.norm(corners - centre[part, None], axis=2).max(axis=1)
    at_outline = np.unique(outline // len(kind.facets))
    places = np.concatenate([centre[at_outline, None],
                             0.5 * (centre[at_outline, None] + nodes[cells[at_outline]])], axis=1)
    level = np.floor(np.log2(radius))
    for one in np.unique(level):
        large = np.flatnonzero(level == one)
        tree = KDTree(centre[large])
        for first in range(0, len(at_outline), _AT_ONCE):
            some = places[first : first + _AT_ONCE]
            near = tree.query_ball_point(some.reshape(-1, kind.dimension), radius[large].max())
            sizes = np.array([len(found) for found in near])
            place = np.repeat(np.arange(len(near)), sizes)
            cell = large[np.concatenate([np.asarray(found, np.int64) for found in near])]
            own = at_outline[first + place // some.shape[1]]
            at = some.reshape(-1, kind.dimension)[place]
            held, of = np.unique(cell, return_inverse=True)
            sides = nodes[cells[held][:, np.array(kind.facets)]]
            on_side, normal = sides.mean(axis=2), _side_normals(sides)
            inside = np.einsum("mfd,mfd->mf", on_side - centre[held, None], normal)
            depth = np.einsum("pfd,pfd->pf", on_side[of] - at[:, None], normal[of])
            within = (depth > _WITHIN * inside[of]).all(axis=1) & (own != cell)
            for a, b in zip(own[within], cell[within], strict=True):
                # Two cells with a common side lie apart, see require_apart.
                if len(np.intersect1d(cells[a], cells[b])) < len(kind.facets[0]):
                    where = ", ".join(f"{x:g}" for x in centre[a])
                    raise MeshError(f"Mesh cells {a} and {b} overlap at ({where}); remove one of "
                                    f"them, or move the parts of the mesh apart.")


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

    ends = np.sort(np.stack([outline, np.roll(outline, 1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    ends, _, _ = numbered_rows(ends)
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


def second_order_places(
    nodes: Array, cells: Integers, kind: CellKind, middles: Array
) -> Array:
    """Places (M, k, d) of the second-order nodes of cells, in the order of ``kind.places``.

    ``middles`` (M, edges, d) are those of the edges. Middles of faces and of cells follow from
    these: x = sum over edges / 2 - sum over corners / 4 for a face, half of both for a cell.
    """
    corners = nodes[cells[:, list(kind.order)]]
    places = [corners, middles]
    local = np.array(kind.places, float)
    if not kind.simplex:
        count, edges = kind.corners, len(kind.edges)
        for middle in local[count + edges:]:
            held = middle != 0.5
            near = [(np.flatnonzero((local[a:b][:, held] == middle[held]).all(axis=1)))
                    for a, b in ((0, count), (count, count + edges))]
            share = 0.5 if len(near[1]) == 4 else 0.25
            places.append((share * middles[:, near[1]].sum(axis=1)
                           - 0.25 * corners[:, near[0]].sum(axis=1))[:, None])
    return np.concatenate(places, axis=1)


def curved_volumes(places: Array, kind: CellKind) -> Array:
    """Volumes (M,), in the plane areas, of cells with second-order places (M, k, d).

    Raises
    ------
    MeshError
        If a cell is folded: its Jacobian determinant is not positive everywhere.
    """
    count, dimension = len(kind.places), kind.dimension
    corners = np.array(kind.places, float)
    points = np.stack(np.meshgrid(*[_GAUSS] * dimension, indexing="ij"), -1).reshape(-1, dimension)
    weights = np.prod(np.meshgrid(*[_WEIGHTS] * dimension, indexing="ij"), axis=0).ravel()
    if kind.simplex:  # collapse the square or cube: x1 = s1, x2 = s2 (1 - s1), ...
        left = np.ones(len(points))
        for axis in range(dimension):
            points[:, axis], left, weights = (points[:, axis] * left,
                                              left * (1.0 - points[:, axis]), weights * left)
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
