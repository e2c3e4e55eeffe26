"""Contents of a mesh file as read, and their conversion to a plane first-order mesh."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import MeshError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.mesh import Mesh

CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
NODES = {"vertex": 1, "line": 2, "line3": 3,
         "triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8, "quad9": 9}

_SOLID = ("tetra", "hexa", "wedge", "penta", "pyramid", "polyhedron", "voxel", "solid",
          "VTK_LAGRANGE_TETRA", "VTK_LAGRANGE_HEXA", "VTK_LAGRANGE_WEDGE", "VTK_LAGRANGE_PYRAMID")
_CURVED = 1e-4  # distance of mid-side node and chord per length; text files round coordinates
_ROUNDED = 1e-6  # of the body's size: resolution of files with six digits
_COINCIDENT = 1e-9  # of the body's size


@dataclass
class RawMesh:
    """Nodes, elements and named groups as read from a file.

    Attributes
    ----------
    points : (N, 2) or (N, 3) array
        Coordinates, in the unit of the file.
    cells : list of (kind, (M, k) integer array)
        Elements of two and three dimensions by the names of meshio; corner nodes come first,
        then mid-side nodes in the order of the sides.
    edges : mapping of name to (k, 2 or more) integer array
        Groups of line elements, end nodes first.
    nodes : mapping of name to (k,) integer array
        Groups of nodes.
    sets_are_boundaries : bool
        Whether a group of nodes connected by edges of the outline is also a boundary.
    parts : mapping of name to list of (kind, (M, k) integer array)
        Groups of elements of two and three dimensions, as ``cells``.
    separate : bool
        Whether the parts are bodies of their own, which cannot be read as one mesh.
    """

    points: Array
    cells: list[tuple[str, Integers]]
    edges: dict[str, Integers] = field(default_factory=dict)
    nodes: dict[str, Integers] = field(default_factory=dict)
    sets_are_boundaries: bool = False
    parts: dict[str, list[tuple[str, Integers]]] = field(default_factory=dict)
    separate: bool = False

    def part(self, name: str | None) -> "RawMesh":
        """The elements of one part, with the groups of the file; all elements for None.

        Nodes of other parts get no place, so that those of two parts that touch are not merged.

        Raises
        ------
        MeshError
            If there is no such part, or several bodies and no name.
        """
        if name is None:
            if self.separate:
                raise MeshError(f"The file holds {len(self.parts)} parts; choose one by part: "
                                f"{choices(self.parts)}.")
            return self
        if name not in self.parts:
            raise MeshError(f"The file has no part '{name}'{nearest(name, self.parts)}; its groups "
                            f"of cells are: {choices(self.parts)}.")
        cells = self.parts[name]
        corners = [block.ravel() for _, block in cells]
        points = np.full(np.shape(self.points), np.nan)
        if all(not len(block) or block.max() < len(points) for block in corners):
            used = np.unique(np.concatenate(corners))
            points[used] = np.asarray(self.points, float)[used]
        return replace(self, points=points, cells=cells)


@dataclass(frozen=True)
class Groups:
    """Named groups of a mesh, and the names of groups without nodes or edges of the body."""

    boundaries: dict[str, Integers]
    points: dict[str, Integers]
    empty: tuple[str, ...]


def plane_mesh(raw: RawMesh, scale: float) -> tuple[Mesh, Groups]:
    """The first-order mesh without groups, and the groups of the file in its numbering.

    Raises
    ------
    MeshError
        If the elements are not a plane mesh of triangles or of quadrilaterals with straight sides.
    """
    second_order, corners = _plane_cells(raw.cells)
    points = np.asarray(raw.points, float) * scale
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise MeshError(f"The nodes have coordinates of shape {points.shape}, not (N, 2) or "
                        f"(N, 3).")
    if corners.min() < 0 or corners.max() >= len(points):
        raise MeshError("The elements name nodes that the file does not hold.")
    named = [*second_order, *raw.nodes.values(), *(group[:, :2] for group in raw.edges.values())]
    if any(group.size and (group.min() < 0 or group.max() >= len(points)) for group in named):
        raise MeshError("A group, or the middle of a side, names nodes that the file does not "
                        "hold.")
    used = np.unique(corners)
    if not np.isfinite(points[used]).all():
        raise MeshError("The nodes hold values that are not finite.")
    size = float(np.linalg.norm(np.ptp(points[used], axis=0)))
    _require_plane(points[used], size)
    points = points[:, :2]
    for cells in second_order:
        _require_straight(points, cells, size)

    first = _first_of_coincident(points, _COINCIDENT * size)
    used = np.unique(first[corners])
    number = np.full(len(points), -1, np.int64)
    number[used] = np.arange(len(used))
    number = number[first]
    cells = number[corners]
    _, distinct = np.unique(np.sort(cells, axis=1), axis=0, return_index=True)
    mesh = Mesh(points[used], cells[np.sort(distinct)])
    return mesh, _groups(raw, mesh, number)


def edges_on_outline(mesh: Mesh, chosen: NDArray[np.bool_]) -> Integers:
    """Outline edges whose two nodes are both chosen, ``chosen`` being a mask of the nodes."""
    edges: Integers = mesh.outline[chosen[mesh.outline].all(axis=1)]
    return edges


def _groups(raw: RawMesh, mesh: Mesh, number: Integers) -> Groups:
    boundaries: dict[str, Integers] = {}
    points: dict[str, Integers] = {}
    row = {frozenset(edge): k for k, edge in enumerate(mesh.outline.tolist())}
    for name, group in raw.nodes.items():
        nodes = np.unique(number[group])
        nodes = nodes[nodes >= 0]
        if not len(nodes):
            continue
        points[name] = nodes
        if raw.sets_are_boundaries:
            chosen = np.zeros(len(mesh.nodes), bool)
            chosen[nodes] = True
            edges = edges_on_outline(mesh, chosen)
            if len(np.unique(edges)) == len(nodes):
                boundaries[name] = edges
    for name, group in raw.edges.items():
        edges = number[group[:, :2]]
        edges = edges[(edges >= 0).all(axis=1) & (edges[:, 0] != edges[:, 1])]
        rows = [row.get(frozenset(edge)) for edge in edges.tolist()]
        on_outline = sorted({k for k in rows if k is not None})
        if None not in rows and rows:
            boundaries[name] = mesh.outline[on_outline]
        elif rows:
            points.setdefault(name, np.unique(edges))
    kept = {*boundaries, *points}
    empty = tuple(name for name in (*raw.nodes, *raw.edges) if name not in kept)
    return Groups(boundaries, points, empty)


def _plane_cells(cells: list[tuple[str, Integers]]) -> tuple[list[Integers], Integers]:
    """Second-order cells with all their nodes, and the corners of all cells."""
    plane = [(kind, block) for kind, block in cells if len(block)]
    other = sorted({kind for kind, _ in plane if kind not in CORNERS})
    if any(kind.startswith(_SOLID) for kind in other):
        raise MeshError(f"The mesh is a 3-D mesh (it holds {', '.join(other)} elements), but "
                        f"fecontact's bodies are plane; give a mesh of triangles or "
                        f"quadrilaterals.")
    if other:
        raise MeshError(f"The mesh holds elements that are not read ({', '.join(other)}); mesh "
                        f"with first-order triangles or quadrilaterals.")
    if not plane:
        raise MeshError("The mesh holds no triangles or quadrilaterals; save these elements too.")
    counts = {3: 0, 4: 0}
    for kind, block in plane:
        counts[CORNERS[kind]] += len(block)
    if all(counts.values()):
        raise MeshError(
            f"The mesh mixes {counts[3]} triangles and {counts[4]} quadrilaterals; mesh with one "
            f"kind only (in Gmsh, recombine all surfaces or none)."
        )
    second_order = [block for kind, block in plane if block.shape[1] > CORNERS[kind]]
    return second_order, np.concatenate([block[:, :CORNERS[kind]] for kind, block in plane])


def _require_plane(points: Array, size: float) -> None:
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > _ROUNDED * size:
        low, high = points[:, 2].min(), points[:, 2].max()
        raise MeshError(f"The mesh is a 3-D mesh (z runs from {low:g} to {high:g} m), but "
                        f"fecontact's bodies are plane; turn it into the x-y plane.")


def _require_straight(points: Array, cells: Integers, size: float) -> None:
    corners = 3 if cells.shape[1] == 6 else 4
    start = points[cells[:, :corners]]
    chord = np.roll(start, -1, axis=1) - start
    middle = points[cells[:, corners:2 * corners]] - start
    length = np.linalg.norm(chord, axis=2)
    distance = np.abs(chord[..., 0] * middle[..., 1] - chord[..., 1] * middle[..., 0])
    distance /= np.maximum(length, np.finfo(float).tiny)
    curved = distance > np.maximum(_CURVED * length, _ROUNDED * size)
    if curved.any():
        raise MeshError(
            f"The mesh has {np.count_nonzero(curved)} second-order element sides that are curved, "
            f"by up to {distance.max():.2g} m; mesh with first-order elements and a smaller size."
        )


def _first_of_coincident(points: Array, tolerance: float) -> Integers:
    """For each point, the lowest-numbered of those that coincide with it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    pairs = finite[cKDTree(points[finite]).query_pairs(tolerance, output_type="ndarray")]
    joined = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    _, label = connected_components(joined, directed=False)
    _, first = np.unique(label, return_index=True)
    result: Integers = first[label]
    return result


