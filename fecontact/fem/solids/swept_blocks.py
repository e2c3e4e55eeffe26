"""Meshes of solids swept from plane patches: hexahedra, or tetrahedra cut out of them.

A solid is a set of patches (u, v) -> (x, y), each swept through the levels w of the solid and
mapped into space. Every block is sampled at its nodes and half-way between them, which gives the
second-order nodes of its cells; blocks that touch have the same nodes where they do.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import HEXAHEDRON
from fecontact.fem.mesh import Mesh

_SAME = 1e-7  # of the solid's size: nodes that are closer are one
_CURVED = 1e-6  # distance of a middle from its straight edge or face, per length


@dataclass(frozen=True, eq=False)
class Patch2D:
    """A plane patch: lines in u and v from 0 to 1, and the places (..., 2) of values (..., 2)."""

    u: Array
    v: Array
    place: Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Sweep:
    """A solid as plane patches swept through levels w from 0 to 1.

    ``lift(xy, w)`` is the place (..., 3) above (..., 2) at a level (...).
    """

    patches: Sequence[Patch2D]
    levels: Array
    lift: Callable[[Array, Array], Array]

    @property
    def count(self) -> int:
        """Number of hexahedra."""
        return (len(self.levels) - 1) * sum((len(one.u) - 1) * (len(one.v) - 1)
                                            for one in self.patches)


def swept_mesh(
    sweep: Sweep, tetrahedra: bool, names: Callable[[Array, Array], Array],
    points: dict[str, tuple[float, float, float]],
    groups: dict[str, Callable[[Array], Array]] | None = None,
) -> Mesh:
    """The mesh of a sweep.

    Parameters
    ----------
    sweep : Sweep
        The patches and levels.
    tetrahedra : bool
        Whether each hexahedron is cut into six tetrahedra.
    names : function
        Names (k,) of the faces of the outline from their corners (k, n, 3) and their outward area
        vectors (k, 3); empty for none.
    points : mapping of name to place
        The nearest node is taken.
    groups : mapping of name to function
        Further named points: which (N,) of the nodes (N, 3) belong to each.
    """
    places, cells = _second_order(sweep)
    corners, pairs, middles = _tetrahedra(cells) if tetrahedra else _hexahedra(cells)
    used = np.unique(corners)
    number = np.full(len(places), -1)
    number[used] = np.arange(len(used))
    ends = np.sort(number[pairs.reshape(-1, 2)], axis=1)
    _, first = np.unique(ends[:, 0] * len(used) + ends[:, 1], return_index=True)
    ends, middle = ends[first], places[middles.ravel()[first]]
    nodes = places[used]
    plain = Mesh(nodes, number[corners])
    faces = plain.outline
    at = plain.nodes[faces]
    across = (at[:, 2] - at[:, 0], at[:, -1] - at[:, 1]) if at.shape[1] == 4 else (
        at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    areas = 0.5 * np.cross(*across)
    owner = names(at, areas)
    bent = _bent(nodes, ends, middle, faces, areas, owner)
    named = {name: np.linalg.norm(nodes - np.array(place), axis=1).argmin(keepdims=True)
             for name, place in points.items()}
    sets = {name: np.flatnonzero(chosen(nodes)) for name, chosen in (groups or {}).items()}
    return Mesh(nodes, plain.cells, {str(name): faces[owner == name]
                                     for name in np.unique(owner) if name},
                {**named, **sets}, ends[bent], middle[bent])


def _bent(nodes: Array, ends: Integers, middles: Array, faces: Integers, areas: Array,
          owner: Array) -> Array:
    """Boolean mask (E,) of the curved edges: on curved faces, or where two names meet.

    All others stay straight, because elements with straight edges represent products of
    coordinates, as in bending and torsion, better.
    """
    off = middles - nodes[ends].mean(axis=1)
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2)
    edge = np.searchsorted(ends[:, 0] * len(nodes) + ends[:, 1],
                           sides[..., 0] * len(nodes) + sides[..., 1])
    normals = areas / np.linalg.norm(areas, axis=1, keepdims=True)
    away = np.zeros(len(ends))
    np.maximum.at(away, edge, np.abs(np.einsum("fex,fx->fe", off[edge], normals)))
    _, name = np.unique(owner, return_inverse=True)
    lowest, highest = np.full(len(ends), len(faces)), np.full(len(ends), -1)
    np.minimum.at(lowest, edge, name[:, None])
    np.maximum.at(highest, edge, name[:, None])
    away = np.where(highest > lowest, np.linalg.norm(off, axis=1), away)
    chord = np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=1)
    return np.asarray(away > _CURVED * chord)


def lines(count: int) -> Array:
    """Equally spaced lines from 0 to 1."""
    return np.linspace(0.0, 1.0, count + 1)


def rectangle(x: Array, y: Array) -> Patch2D:
    """The patch between the first and last of the lines x and y."""
    sides = np.array([x[-1] - x[0], y[-1] - y[0]])
    start = np.array([x[0], y[0]])
    return Patch2D((x - x[0]) / sides[0], (y - y[0]) / sides[1], lambda uv: start + uv * sides)


def between(inner: Callable[[Array], Array], outer: Callable[[Array], Array],
            along: Array, across: Array) -> Patch2D:
    """The patch between two curves: v runs along them, u from the inner to the outer one."""

    def place(uv: Array) -> Array:
        u, v = uv[..., :1], uv[..., 1]
        return (1.0 - u) * inner(v) + u * outer(v)

    return Patch2D(across, along, place)


def arc(radius: float, start: float, end: float,
        centre: tuple[float, float] = (0.0, 0.0)) -> Callable[[Array], Array]:
    """Circular arc between two angles [rad]."""
    def place(v: Array) -> Array:
        angle = start + v * (end - start)
        return np.array(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    return place


def segment(start: Sequence[float], end: Sequence[float]) -> Callable[[Array], Array]:
    """Straight line between two points."""
    a, b = np.array(start), np.array(end)
    return lambda v: a + v[..., None] * (b - a)


def full_disc(
    rim: float, core: float, half_angle: float, counts: tuple[int, int], across: Array
) -> list[Patch2D]:
    """A disc: a four-sided core whose corners lie at ``core``, and four sectors out to the rim.

    ``half_angle`` [rad] is that of the sectors about +-y; ``counts`` are the numbers of elements
    along the sides in x and in y, ``across`` the lines from core to rim.
    """
    a = half_angle
    angles = [-0.5 * np.pi - a, -0.5 * np.pi + a, 0.5 * np.pi - a, 0.5 * np.pi + a,
              1.5 * np.pi - a]
    corner = [core * np.array([np.cos(t), np.sin(t)]) for t in angles]
    # Sides of the core bulge half as much as the arcs, which keeps its corners open.
    sides = [_bulged(corner[i], corner[i + 1], 0.3 * core * (1.0 - np.cos(0.5 * (
        angles[i + 1] - angles[i])))) for i in range(4)]
    patches = [between(sides[i], arc(rim, angles[i], angles[i + 1]), lines(counts[i % 2]), across)
               for i in range(4)]

    def core_place(uv: Array) -> Array:
        u, v = uv[..., 0], uv[..., 1]
        # Transfinite interpolation between the four sides.
        bottom, right, top, left = sides[0](u), sides[1](v), sides[2](1.0 - u), sides[3](1.0 - v)
        u, v = u[..., None], v[..., None]
        corners = ((1 - u) * (1 - v) * corner[0] + u * (1 - v) * corner[1]
                   + u * v * corner[2] + (1 - u) * v * corner[3])
        return (1 - v) * bottom + v * top + (1 - u) * left + u * right - corners

    return [*patches, Patch2D(lines(counts[0]), lines(counts[1]), core_place)]


def _bulged(start: Array, end: Array, height: float) -> Callable[[Array], Array]:
    side = end - start
    out = np.array([side[1], -side[0]]) / np.linalg.norm(side)
    return lambda v: (start + v[..., None] * side + (4.0 * v * (1.0 - v) * height)[..., None] * out)


def _second_order(sweep: Sweep) -> tuple[Array, Integers]:
    """Distinct places (N, 3), and those of each hexahedron (M, 27) as a lattice of 3 x 3 x 3."""
    places, cells, first = [], [], 0
    w = _halved(sweep.levels)
    for patch in sweep.patches:
        u, v = _halved(patch.u), _halved(patch.v)
        uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
        xy = patch.place(uv)
        xyz = sweep.lift(np.repeat(xy[:, :, None], len(w), axis=2),
                         np.broadcast_to(w, (len(u), len(v), len(w))))
        number = first + np.arange(xyz[..., 0].size).reshape(xyz.shape[:3])
        parts = [number[i:len(u) - 2 + i:2, j:len(v) - 2 + j:2, k:len(w) - 2 + k:2].ravel()
                 for i in range(3) for j in range(3) for k in range(3)]
        places.append(xyz.reshape(-1, 3))
        cells.append(np.stack(parts, axis=1))
        first += number.size
    joined = np.concatenate(places)
    return _merged(joined, np.concatenate(cells))


def _halved(values: Array) -> Array:
    both = np.empty(2 * len(values) - 1)
    both[::2], both[1::2] = values, 0.5 * (values[1:] + values[:-1])
    return both


def _merged(places: Array, cells: Integers) -> tuple[Array, Integers]:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    pairs = cKDTree(places).query_pairs(_SAME * size, output_type="ndarray")
    joined = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places),) * 2)
    _, label = connected_components(joined, directed=False)
    _, first, number = np.unique(label, return_index=True, return_inverse=True)
    return places[first], number[cells]


def _lattice(i: Integers, j: Integers) -> Integers:
    """Numbers in the lattice of the middles between two of its corners."""
    at = np.stack(np.unravel_index(i, (3, 3, 3))) + np.stack(np.unravel_index(j, (3, 3, 3)))
    return np.ravel_multi_index(tuple(at // 2), (3, 3, 3))


# Corners of a hexahedron in the lattice.
_CORNERS = np.array([9 * i + 3 * j + k for i, j, k in (
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))])


def _hexahedra(cells: Integers) -> tuple[Integers, Integers, Integers]:
    """Corners (M, 8), ends (M, 12, 2) of the edges and their middles (M, 12)."""
    ends = _CORNERS[np.array(HEXAHEDRON.edges)]
    return cells[:, _CORNERS], cells[:, ends], cells[:, _lattice(ends[:, 0], ends[:, 1])]


def _tetrahedra(cells: Integers) -> tuple[Integers, Integers, Integers]:
    """Corners (6 M, 4), ends (6 M, 6, 2) of the edges and their middles (6 M, 6).

    Every face is cut along the diagonal through its lowest node, and the three faces opposite to
    the lowest node of a cell are joined to that node, so that neighbours fit.
    """
    corners = cells[:, _CORNERS]
    lowest = corners.argmin(axis=1)
    parts, owners = [], []
    for apex in range(8):
        which = np.flatnonzero(lowest == apex)
        for face in HEXAHEDRON.facets:
            if apex in face:
                continue
            start = corners[which][:, list(face)].argmin(axis=1)
            around = np.array(face)[(start[:, None] + np.arange(4)) % 4]
            for triangle in (around[:, [0, 1, 2]], around[:, [0, 2, 3]]):
                parts.append(np.column_stack([np.full(len(which), apex), triangle]))
                owners.append(which)
    local, owner = _CORNERS[np.concatenate(parts)], np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    local, owner = local[order], owner[order]
    pairs = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
    ends = local[:, pairs]
    middles = _lattice(ends[..., 0], ends[..., 1])
    return (cells[owner[:, None], local], cells[owner[:, None, None], ends],
            cells[owner[:, None], middles])
