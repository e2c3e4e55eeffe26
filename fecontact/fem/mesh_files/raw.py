"""Contents of a mesh file as read, and their conversion to a mesh with its groups."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import MeshError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.attachments import Attachment
from fecontact.fem.constraints import Constraint
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    CellKind,
    padded,
    row_numbers,
    unordered,
)
from fecontact.fem.elements.quadrature import Integration
from fecontact.fem.material import AnyMaterial
from fecontact.fem.mesh import Bricks, Mesh
from fecontact.fem.mesh_files.raw_constraints import constraints_of_mesh

PLANE = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
SOLID = {"tetra": 4, "tetra10": 4, "hexahedron": 8, "hexahedron20": 8, "hexahedron27": 8,
         "wedge": 6, "wedge15": 6, "wedge18": 6, "pyramid": 5, "pyramid13": 5, "pyramid14": 5}
CORNERS = {**PLANE, **SOLID}
NODES = {"vertex": 1, "line": 2, "line3": 3,
         "triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8, "quad9": 9,
         "tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27,
         "wedge": 6, "wedge15": 15, "wedge18": 18, "pyramid": 5, "pyramid13": 13, "pyramid14": 14}
# Elements without nodes in the middles of faces and cells.
_SERENDIPITY = {"quad8", "hexahedron20", "wedge15", "pyramid13"}

_UNREAD_SOLIDS = ("wedge", "penta", "pyramid", "polyhedron", "voxel", "solid", "tetra", "hexa",
                  "VTK_LAGRANGE_TETRA", "VTK_LAGRANGE_HEXA", "VTK_LAGRANGE_WEDGE",
                  "VTK_LAGRANGE_PYRAMID")
_CURVED = 1e-4  # distance of a middle and its chord per length; text files round coordinates
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
        then mid-side nodes, of plane elements in the order of the sides.
    edges : mapping of name to (k, 2 or more) integer array
        Groups of line elements, end nodes first.
    faces : mapping of name to list of (k, 3) or (k, 4) integer arrays
        Groups of faces of solid elements by their corners, beside the plane elements in ``parts``.
    nodes : mapping of name to (k,) integer array
        Groups of nodes.
    sets_are_boundaries : bool
        Whether a group of nodes connected by edges of the outline is also a boundary.
    parts : mapping of name to list of (kind, (M, k) integer array)
        Groups of elements of two and three dimensions, as ``cells``.
    separate : bool
        Whether the parts are bodies of their own, which cannot be read as one mesh.
    constraints : list of LinearEquation, Tie or Coupling
        In the unit of the file; equations name nodes by their rows in ``points``.
    attachments : list of PointMass or PointSpring
        In units of the file, with forces in N; they name nodes by their rows in ``points``.
    sections : list of (str, str, list of floats or None)
        Surface, control node and direction of sections of bolts; None for the normal.
    apart : bool
        Whether nodes at one place are different ones.
    chosen : str
        Name of the part that was chosen, if any.
    cell_sets : mapping as ``parts``
        Further groups of elements, of which none is a body.
    materials : mapping of name to Material or AnisotropicMaterial
        Materials of groups of elements in the unit of the file, with forces in N.
    bricks : 'full' or 'incompatible'
        Kind of the eight-node bricks; elements of the second order say theirs.
    integration : 'exact', 'full', 'reduced' or mapping of name in ``cell_sets`` to these
        Rules of quadrature.
    temperature : (N,) array, optional
        Changes of temperature at the nodes.
    numbers : (n,) integer array, optional
        Numbers that the first n points, those of cells among them, have in the file.
    axes : mapping of int to (3, 3) array
        Local axes, by rows, of nodes with some, by their rows in ``points``.
    """

    points: Array
    cells: list[tuple[str, Integers]]
    edges: dict[str, Integers] = field(default_factory=dict)
    faces: dict[str, list[Integers]] = field(default_factory=dict)
    nodes: dict[str, Integers] = field(default_factory=dict)
    sets_are_boundaries: bool = False
    parts: dict[str, list[tuple[str, Integers]]] = field(default_factory=dict)
    separate: bool = False
    constraints: list[Constraint] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)
    sections: list[tuple[str, str, list[float] | None]] = field(default_factory=list)
    apart: bool = False
    chosen: str = ""
    cell_sets: dict[str, list[tuple[str, Integers]]] = field(default_factory=dict)
    materials: dict[str, AnyMaterial] = field(default_factory=dict)
    bricks: Bricks = "full"
    integration: Integration | dict[str, Integration] = "exact"
    temperature: Array | None = None
    numbers: Integers | None = None
    axes: dict[int, Array] = field(default_factory=dict)

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
        if self.is_solid:
            solid = [(kind, block) for kind, block in cells if not _is_plane(kind)]
            if not solid:
                raise MeshError(f"The part '{name}' holds surfaces, but the file holds a solid; "
                                f"its groups of solid cells are: "
                                f"{choices(sorted(self._solid_parts))}.")
            cells = solid
        corners = [block.ravel() for _, block in cells]
        points = np.array(self.points, float)
        if all(not len(block) or block.max() < len(points) for block in corners):
            all_cells = np.concatenate([block.ravel() for _, block in self.cells])
            points[np.setdiff1d(all_cells, np.concatenate(corners))] = np.nan
        return replace(self, points=points, cells=cells, chosen=name)

    @property
    def is_solid(self) -> bool:
        """Whether the file holds solid elements, so that plane ones are faces."""
        return any(len(block) and not _is_plane(kind) for kind, block in self.cells)

    @property
    def _solid_parts(self) -> set[str]:
        return {name for name, cells in self.parts.items()
                if any(not _is_plane(kind) for kind, _ in cells)}


def _is_plane(kind: str) -> bool:
    return kind in PLANE or not kind.startswith(_UNREAD_SOLIDS)


@dataclass(frozen=True)
class Groups:
    """Named groups of a mesh.

    ``empty`` are the names of groups without nodes, edges or faces of the body, ``cells`` those of
    groups of cells. ``constraints`` and ``attachments`` are in SI units, with nodes of the mesh;
    ``materials`` are those of groups of cells. ``inner`` are groups of sides between cells.
    """

    boundaries: dict[str, Integers]
    points: dict[str, Integers]
    empty: tuple[str, ...]
    cells: tuple[str, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    attachments: tuple[Attachment, ...] = ()
    materials: dict[str, AnyMaterial] = field(default_factory=dict)
    inner: dict[str, Integers] = field(default_factory=dict)


def body_mesh(raw: RawMesh, scale: float) -> tuple[Mesh, Groups]:
    """The mesh without groups, and the groups of the file in its numbering.

    Raises
    ------
    MeshError
        If the elements are neither a plane mesh of triangles and quadrilaterals, nor a solid of
        tetrahedra, pyramids, wedges and hexahedra.
    """
    blocks = _cells_of_body(raw.cells)
    bricks = "serendipity" if {kind for kind, _ in blocks} & _SERENDIPITY else raw.bricks
    of_corners = [block[:, :CORNERS[kind]] for kind, block in blocks]
    corners = np.concatenate([block.ravel() for block in of_corners])
    points = np.asarray(raw.points, float) * scale
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise MeshError(f"The nodes have coordinates of shape {points.shape}, not (N, 2) or "
                        f"(N, 3).")
    if corners.min() < 0 or corners.max() >= len(points):
        raise MeshError("The elements name nodes that the file does not hold.")
    named = [*(block for _, block in blocks), *raw.nodes.values(),
             *(group[:, :2] for group in raw.edges.values()),
             *(block for groups in raw.faces.values() for block in groups)]
    if any(group.size and (group.min() < 0 or group.max() >= len(points)) for group in named):
        raise MeshError("A group, or the middle of a side, names nodes that the file does not "
                        "hold.")
    used = np.flatnonzero(np.bincount(corners))
    if not np.isfinite(points[used]).all():
        raise MeshError("The nodes hold values that are not finite.")
    size = float(np.linalg.norm(np.ptp(points[used], axis=0)))
    if blocks[0][0] in PLANE:
        _require_plane(points[used], size)
        points = points[:, :2]
    elif points.shape[1] == 2:
        raise MeshError("The file holds solid elements, but its nodes have two coordinates; save "
                        "all three.")
    dimension = points.shape[1]
    kinds = [CELL_KINDS[dimension, block.shape[1]] for block in of_corners]
    second_order = [(kind, block) for kind, (_, block) in zip(kinds, blocks, strict=True)
                    if block.shape[1] > kind.corners]
    orders = [kind.corners + _edge_order(points, cells, kind) for kind, cells in second_order]

    first = (np.arange(len(points)) if raw.apart
             else _first_of_coincident(points, _COINCIDENT * size))
    used = np.flatnonzero(np.bincount(first[corners]))
    number = np.full(len(points), -1, np.int64)
    number[used] = np.arange(len(used))
    number = number[first]
    _require_one_body(raw, number)
    curves = [_curved_edges(points, cells, kind, order, size)
              for (kind, cells), order in zip(second_order, orders, strict=True)]
    cells = number[padded(of_corners)]
    _, distinct = np.unique(unordered(cells), axis=0, return_index=True)
    ends = number[np.concatenate([np.empty((0, 2), np.int64), *(ends for ends, _ in curves)])]
    middles = np.concatenate([np.empty((0, dimension)), *(places for _, places in curves)])
    _, once = np.unique(np.sort(ends, axis=1), axis=0, return_index=True)
    kept = np.sort(distinct)
    regions = _cell_groups(raw, dimension, number, cells[kept])
    mesh = Mesh(points[used], cells[kept], {}, {}, ends[once], middles[once],
                cell_groups=regions, bricks=bricks, integration=_integration(raw, regions),
                node_numbers=None if raw.numbers is None else raw.numbers[used])
    if raw.temperature is not None:
        mesh = replace(mesh, temperature=_temperature(raw.temperature, mesh, used, number,
                                                      second_order, orders))
    groups = replace(_groups(raw, mesh, number), materials={
        name: one.scaled(scale) for name in regions for of, one in raw.materials.items()
        if name == of or name.endswith(f".{of}")})
    if not raw.constraints and not raw.attachments:
        return mesh, groups
    middles_of: dict[int, tuple[int, int]] = {}
    for (kind, cells), order in zip(second_order, orders, strict=True):
        pairs = number[cells[:, np.array(kind.edges)]].reshape(-1, 2)
        middles_of |= dict(zip(cells[:, order].ravel().tolist(),
                               ((a, b) for a, b in pairs.tolist()), strict=True))
    constraints, attachments = constraints_of_mesh(
        raw, groups.boundaries, groups.points, number, middles_of, points, scale)
    return mesh, replace(groups, constraints=constraints, attachments=attachments)


def _integration(
    raw: RawMesh, regions: dict[str, Integers]
) -> Integration | dict[str, Integration]:
    """Rules of quadrature of the groups of cells that a mesh has."""
    if isinstance(raw.integration, str):
        return raw.integration
    return {name: rule for name, rule in raw.integration.items() if name in regions} or "full"


def _cell_groups(
    raw: RawMesh, dimension: int, number: Integers, cells: Integers
) -> dict[str, Integers]:
    """Numbers of the cells (M, n) of each group of elements of the file that holds some."""
    rows, names = [unordered(cells)], []
    for name, blocks in {**raw.cell_sets, **raw.parts}.items():
        found = [np.empty((0, cells.shape[1]), np.int64)]
        for kind, block in blocks:
            corners = block[:, :CORNERS.get(kind, 0)]
            if (kind in SOLID) != (dimension == 3) or not (
                    corners.size > 0 and corners.shape[1] <= cells.shape[1]):
                continue
            inside = corners[(number[corners] >= 0).all(axis=1)]
            found.append(unordered(padded([number[inside]], cells.shape[1])))
        rows.append(np.concatenate(found))
        names.append(name)
    place = row_numbers(rows[0], np.concatenate(rows))
    ends = np.cumsum([len(one) for one in rows])
    groups = {name: np.unique(place[start:end])
              for name, start, end in zip(names, ends, ends[1:], strict=False)}
    groups = {name: held[held >= 0] for name, held in groups.items()}
    return {name: held for name, held in groups.items() if len(held)}


def on_outline(mesh: Mesh, chosen: NDArray[np.bool_]) -> Integers:
    """Outline edges or faces whose nodes are all chosen, ``chosen`` being a mask of the nodes."""
    facets: Integers = mesh.outline[chosen[mesh.outline].all(axis=1)]
    return facets


def _groups(raw: RawMesh, mesh: Mesh, number: Integers) -> Groups:
    boundaries: dict[str, Integers] = {}
    points: dict[str, Integers] = {}
    inner: dict[str, Integers] = {}
    row = {frozenset(facet): k for k, facet in enumerate(mesh.outline.tolist())}
    for name, group in raw.nodes.items():
        nodes = np.unique(number[group])
        nodes = nodes[nodes >= 0]
        if not len(nodes):
            continue
        points[name] = nodes
        if raw.sets_are_boundaries:
            chosen = np.zeros(len(mesh.nodes), bool)
            chosen[nodes] = True
            facets = on_outline(mesh, chosen)
            if len(np.unique(facets)) == len(nodes):
                boundaries[name] = facets
    # Lines bound plane bodies, faces solids; lines of solids are their nodes.
    sides = _faces(raw) if mesh.dimension == 3 else {
        name: [group[:, :2]] for name, group in raw.edges.items()}
    for name, blocks in sides.items():
        rows: list[int | None] = []
        met: list[Integers] = []
        for block in blocks:
            facets = number[block]
            facets = facets[(facets >= 0).all(axis=1)]
            facets = facets[(np.diff(np.sort(facets, axis=1), axis=1) > 0).all(axis=1)]
            rows += [row.get(frozenset(facet)) for facet in facets.tolist()]
            met.append(facets)
        outer = sorted({k for k in rows if k is not None})
        if None not in rows and rows:
            boundaries[name] = mesh.outline[outer]
        elif rows:
            points.setdefault(name, np.unique(np.concatenate([one.ravel() for one in met])))
            width = mesh.outline.shape[1]
            inner[name] = np.concatenate([np.empty((0, width), np.int64), *(
                padded([one], width) for one in met if one.shape[1] <= width)])
    if mesh.dimension == 3:
        for name, group in raw.edges.items():
            nodes = np.unique(number[group[:, :2]])
            if len(nodes[nodes >= 0]):
                points.setdefault(name, nodes[nodes >= 0])
    kept = {*boundaries, *points}
    empty = tuple(name for name in (*raw.nodes, *raw.edges, *sides) if name not in kept)
    return Groups(boundaries, points, empty,
                  tuple(name for name in raw.parts if name not in kept), inner=inner)


def _faces(raw: RawMesh) -> dict[str, list[Integers]]:
    """Groups of faces of a solid by their corners."""
    found = {name: list(blocks) for name, blocks in raw.faces.items()}
    for name, cells in raw.parts.items():
        plane = [block[:, :CORNERS[kind]] for kind, block in cells if kind in PLANE]
        if plane:
            found.setdefault(name, []).extend(plane)
    return found


def _cells_of_body(cells: list[tuple[str, Integers]]) -> list[tuple[str, Integers]]:
    """The solid elements of a file, or the plane ones if there are no others."""
    present = [(kind, block) for kind, block in cells if len(block)]
    solid = [(kind, block) for kind, block in present if kind in SOLID]
    other = sorted({kind for kind, _ in present if kind not in CORNERS})
    if other and (solid or any(kind.startswith(_UNREAD_SOLIDS) for kind in other)):
        raise MeshError(f"The mesh holds solid elements that are not read ({', '.join(other)}); "
                        f"mesh with tetrahedra, hexahedra, wedges or pyramids of 4 to 27 nodes.")
    if other:
        raise MeshError(f"The mesh holds elements that are not read ({', '.join(other)}); mesh "
                        f"with first-order triangles or quadrilaterals.")
    if not present:
        raise MeshError("The mesh holds no triangles or quadrilaterals, and no tetrahedra or "
                        "hexahedra; save these elements too.")
    return solid or present


def _require_one_body(raw: RawMesh, number: Integers) -> None:
    """Refuse surface elements beside a solid: those on it are its faces."""
    if not raw.is_solid:
        return
    faces = [block[:, :CORNERS[kind]] for kind, block in raw.cells if kind in PLANE and len(block)]
    apart = sum(int((number[block] < 0).any(axis=1).sum()) for block in faces)
    if apart:
        raise MeshError(f"The mesh mixes dimensions: {apart} of its surface elements have nodes "
                        f"that belong to no solid element; mesh all of the body with solid "
                        f"elements, or save without the surfaces beside it.")


def _require_plane(points: Array, size: float) -> None:
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > _ROUNDED * size:
        low, high = points[:, 2].min(), points[:, 2].max()
        raise MeshError(f"The mesh holds surfaces only, in space (z runs from {low:g} to {high:g} "
                        f"m); a solid needs tetrahedra or hexahedra inside its surfaces, and a "
                        f"plane body lies in the x-y plane.")


def _temperature(
    values: Array, mesh: Mesh, used: Integers, number: Integers,
    second_order: list[tuple[CellKind, Integers]], orders: list[Integers],
) -> Array:
    """Temperatures at the nodes of a mesh and at the middles of its edges."""
    at_nodes = values[used]
    found = np.append(at_nodes, at_nodes[mesh.edges[0]].mean(axis=1))
    for (kind, cells), order in zip(second_order, orders, strict=True):
        pairs = number[cells[:, np.array(kind.edges)]].reshape(-1, 2)
        pairs, once = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True)
        edges = mesh.edge_numbers(pairs, "temperature")
        found[len(at_nodes) + edges] = values[cells[:, order].ravel()[once]]
    return found


def _curved_edges(
    points: Array, cells: Integers, kind: CellKind, order: Integers, size: float
) -> tuple[Integers, Array]:
    """Ends (k, 2) of the curved edges of second-order cells, and their middles (k, d).

    ``order`` are the columns of the middles of the edges.
    """
    return _curved(points, cells[:, np.array(kind.edges)], points[cells[:, order]], size)


def _curved(points: Array, ends: Integers, middle: Array, size: float) -> tuple[Integers, Array]:
    """Nodes (c, 2) and middles (c, d) of the curved ones of edges (M, e, 2)."""
    at = points[ends]
    chord = at[:, :, 1] - at[:, :, 0]
    length = np.linalg.norm(chord, axis=2)
    along = chord / np.maximum(length, np.finfo(float).tiny)[..., None]
    arm = middle - at[:, :, 0]
    off = np.linalg.norm(arm - (arm * along).sum(axis=2, keepdims=True) * along, axis=2)
    curved = off > np.maximum(_CURVED * length, _ROUNDED * size)
    return ends[curved], middle[curved]


def _edge_order(points: Array, cells: Integers, kind: CellKind) -> Integers:
    """Column of the middle of each edge, behind the corners.

    Formats differ in the order of the middles of solids; each belongs to the edge in whose middle
    it lies most closely, which all cells of a block together decide.
    """
    if kind.dimension == 2:
        return np.arange(len(kind.edges))
    count = len(kind.edges)
    chords = points[cells[:, np.array(kind.edges)]].mean(axis=2)
    middles = points[cells[:, kind.corners:kind.corners + count]]
    extent = np.ptp(points[cells[:, :kind.corners]], axis=1).max(axis=1)
    distance = (np.linalg.norm(chords[:, :, None] - middles[:, None], axis=3)
                / np.maximum(extent, np.finfo(float).tiny)[:, None, None]).mean(axis=0)
    order = distance.argmin(axis=1)
    if len(np.unique(order)) < count:
        raise MeshError("The middles of the edges of second-order elements do not lie on these "
                        "edges; the file is damaged, or its elements are too strongly curved.")
    return order


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


