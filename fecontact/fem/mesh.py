"""Meshes of plane bodies and of solids, with named boundaries and points."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, get_args
from weakref import WeakValueDictionary

import numpy as np

from fecontact.core.checks import as_floats, as_integers, require_kind
from fecontact.core.errors import InputError, MeshError, choices, nearest, require_choice
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.core.units import Summarised, count, span
from fecontact.fem.attachments import Attachment, check_attachments, counted_attachments
from fecontact.fem.constraints import Constraint, check_constraints, counted
from fecontact.fem.elements.cell_geometry import (
    curved_volumes,
    oriented,
    require_apart,
    require_conforming,
    require_no_overlap,
    require_volume,
    second_order_places,
    sides_of,
    straight_volumes,
)
from fecontact.fem.elements.cell_kinds import (
    CELL_KINDS,
    CellBlock,
    blocks_of,
    numbered_rows,
    padded,
    row_numbers,
    unordered,
    widths,
)
from fecontact.fem.elements.quadrature import Integration
from fecontact.fem.elements.refinement import (
    SecondOrder,
    at_second_order,
    refined,
    second_order_nodes,
)
from fecontact.fem.elements.structured import structured
from fecontact.fem.material import AnyMaterial

# Elements that are no triangles and tetrahedra: with all their nodes; with incompatible modes, of
# degree 1; without nodes in the middles of faces and cells, of degree 2.
Bricks = Literal["full", "incompatible", "serendipity"]


def check_integration(owner: str, given: Any, groups: Mapping[str, Integers]) -> None:
    """InputError unless ``given`` is a rule of quadrature, or such of groups of cells."""
    require_kind(owner, (str, Mapping), integration=given)
    for name, rule in given.items() if isinstance(given, Mapping) else [("", given)]:
        if name and name not in groups:
            raise InputError(f"{owner}: integration names '{name}', which is no group of cells of "
                             f"the mesh{nearest(name, groups)}; its groups of cells are: "
                             f"{choices(groups)}.")
        require_choice(owner, "integration", rule, get_args(Integration))


class _Checked:
    """Nodes and cells that make a mesh, with the sides of the cells; MeshError if they do not.

    Attributes
    ----------
    nodes, cells : arrays
        Nodes and cells of the mesh; read-only.
    blocks : tuple of CellBlock
        Cells of each kind.
    facets, owner : arrays
        Sides (F, n) of each cell in turn, so that inner ones occur twice, and their cells (F,).
    number, count : arrays
        Number of each of them without its orientation, and number of cells at each.
    """

    def __init__(self, given: Array, corners: Integers) -> None:
        nodes = np.array(as_floats(given, "Mesh nodes"))
        cells = np.array(as_integers(corners, "Mesh cells"))
        if nodes.ndim != 2 or nodes.shape[1] not in (2, 3):
            raise MeshError(f"Mesh nodes must have shape (N, 2), or (N, 3) for a solid, not "
                            f"{nodes.shape}.")
        dimension = nodes.shape[1]
        known = [corners for of, corners in CELL_KINDS if of == dimension]
        if cells.ndim != 2 or cells.shape[1] not in known or not len(cells):
            raise MeshError(
                f"Mesh cells must have shape (M, 3) for triangles or (M, 4) for quadrilaterals, "
                f"rows of triangles among these filled by their last corner, with M > 0, not "
                f"{cells.shape}." if dimension == 2 else
                f"Mesh cells of a solid must have shape (M, 4) for tetrahedra, (M, 5) for "
                f"pyramids, (M, 6) for wedges or (M, 8) for hexahedra with M > 0, or rows of "
                f"several kinds filled by their last corner, not {cells.shape}."
            )
        size = widths(cells)
        poor = ~np.isin(size, known)
        if poor.any():
            raise MeshError(
                f"{np.count_nonzero(poor)} mesh cells have no "
                f"{'area' if dimension == 2 else 'volume'}: they repeat corners, the first is cell "
                f"{np.flatnonzero(poor)[0]}.")
        if not np.isfinite(nodes).all():
            raise MeshError("Mesh nodes hold values that are not finite.")
        if cells.min() < 0 or cells.max() >= len(nodes):
            raise MeshError(f"Mesh cells name nodes outside 0 ... {len(nodes) - 1}.")
        unused = np.count_nonzero(np.bincount(cells.ravel(), minlength=len(nodes)) == 0)
        if unused:
            raise MeshError(f"{unused} mesh nodes belong to no cell; remove them.")
        cells = cells[:, : size.max()]
        self.nodes = nodes
        self.cells, flat = oriented(nodes, cells)
        require_volume(nodes, cells, flat)
        self.blocks = tuple(
            CellBlock(CELL_KINDS[dimension, rows.shape[1]], np.arange(len(cells))[which], rows)
            for which, rows in blocks_of(self.cells))
        self.facets, self.owner = sides_of(self.cells, dimension)
        _, self.number, self.count = numbered_rows(unordered(self.facets))
        self._require_sound()
        for array in (self.nodes, self.cells):
            array.setflags(write=False)
        _CHECKED[id(self.nodes), id(self.cells)] = self

    def _require_sound(self) -> None:
        """MeshError for cells that overlap or do not fit together."""
        count, number, facets = self.count, self.number, self.facets
        crowded = facets[count[number] > 2]
        if len(crowded):
            what = "edge between mesh nodes" if self.nodes.shape[1] == 2 else "face of mesh nodes"
            raise MeshError(
                f"The {what} {' and '.join(map(str, crowded[0]))} belongs to more than two cells; "
                f"remove overlapping cells."
            )
        require_apart(facets, number, count, self.nodes)
        require_conforming(facets[count[number] == 1], self.nodes)
        require_no_overlap(self.nodes, self.cells, np.unique(self.owner[count[number] == 1]))


# Of existing meshes: a further mesh of the same nodes and cells is not checked again.
_CHECKED: "WeakValueDictionary[tuple[int, int], _Checked]" = WeakValueDictionary()


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Mesh(Summarised):
    """A mesh of a plane body or of a solid, with named boundaries and points.

    Plane cells are triangles or quadrilaterals, counter-clockwise; cells of solids are tetrahedra,
    pyramids, wedges or hexahedra, their corners as Gmsh, VTK and Abaqus number them. Cells of the
    opposite orientation are turned. A mesh may have cells of several kinds: rows of ``cells`` are
    then as long as the longest, filled by the last corner of the cell, and so are rows of faces.

    Parameters
    ----------
    nodes : (N, 2) or (N, 3) array
        Corners of the cells [m]. In the plane x is tangential to the ground and y normal to it,
        into the body; in space z is normal to it.
    cells : (M, 3) or (M, 4), of solids (M, 4), (M, 5), (M, 6) or (M, 8) integer array
        Corner nodes of each cell.
    boundaries : mapping of name to (k, 2), of solids (k, 3) or (k, 4) integer array
        Edges or faces by their nodes; each must be that of exactly one cell. Faces of solids are
        turned such that their nodes run counter-clockwise seen from outside.
    points : mapping of name to integer or (k,) integer array
        Nodes.
    curved_edges : (k, 2) integer array
        Nodes of the edges of cells that are curved, each edge once; none by default.
    curved_middles : (k, 2) or (k, 3) array
        Places at the middles of these edges [m]: an edge is the parabola through ends and middle.
    constraints : sequence of LinearEquation, Tie or Coupling
        Constraints between displacements that a file holds, for bodies of this mesh; none by
        default.
    cell_groups : mapping of name to (k,) integer array
        Numbers of cells, such as those of one material.
    materials : mapping of name to Material or AnisotropicMaterial
        Materials of groups of cells that a file holds, for bodies of this mesh; none by default.
    bricks : 'full', 'incompatible' or 'serendipity'
        Kind of the elements of a file, for bodies of this mesh, see :class:`fecontact.ElasticBody`.
    integration : 'exact', 'full', 'reduced', or mapping of name to these
        Points of quadrature of the elements of a file, for bodies of this mesh, see
        :class:`fecontact.ElasticBody`; a mapping names groups of cells.
    attachments : sequence of PointMass or PointSpring
        Masses and springs at points that a file holds, for bodies of this mesh; none by default.
    temperature : (N,) or (N + E,) array
        Changes of temperature that a file holds [K], for ``temperature="mesh"`` of bodies of this
        mesh: at the nodes, and at the middles of the E edges, by default means; none by default.
    node_numbers : (N,) integer array
        Numbers of the nodes in a file of one part, for messages; none by default.

    Raises
    ------
    MeshError, InputError
        For arrays of wrong shape, unknown nodes, degenerate, folded or overlapping cells, nodes
        without a cell, an empty group, or a boundary edge or face that is not on the outline or is
        named twice.
    """

    nodes: Array
    cells: Integers
    boundaries: Mapping[str, Integers] = field(default_factory=dict)
    points: Mapping[str, Integers] = field(default_factory=dict)
    curved_edges: Integers = field(default_factory=lambda: np.empty((0, 2), np.int64))
    curved_middles: Array | None = None
    constraints: Sequence[Constraint] = ()
    cell_groups: Mapping[str, Integers] = field(default_factory=dict)
    materials: Mapping[str, AnyMaterial] = field(default_factory=dict)
    bricks: Bricks = "full"
    integration: Integration | Mapping[str, Integration] = "exact"
    attachments: Sequence[Attachment] = ()
    temperature: Array | None = None
    node_numbers: Integers | None = None
    _checked: "_Checked" = field(init=False, repr=False, compare=False)

    @classmethod
    def grid(cls, x: ArrayLike, y: ArrayLike, z: ArrayLike | None = None) -> "Mesh":
        """A rectangle of quadrilaterals, or a box of hexahedra, between lines of nodes.

        Parameters
        ----------
        x, y, z : ascending sequences of float
            Coordinates of the lines [m]; without z the body is plane.

        Returns
        -------
        Mesh
            Mesh with the boundaries ``left`` (first x), ``right``, ``bottom`` and ``top``; in space
            bottom and top are those of z, ``front`` (first y) and ``back`` those of y. Points are
            the corners, such as ``"bottom left"`` or ``"top back right"``.

        Raises
        ------
        InputError
            Unless they are two or more finite, ascending numbers.

        Examples
        --------
        >>> import numpy as np
        >>> from fecontact import Mesh
        >>> plate = Mesh.grid(np.linspace(0.0, 0.2, 41), np.linspace(0.0, 0.01, 5))
        >>> len(plate.cells), sorted(plate.boundaries)
        (160, ['bottom', 'left', 'right', 'top'])
        """
        return cls(*structured((x, y) if z is None else (x, y, z)))

    def __post_init__(self) -> None:
        # Arrays of known meshes are alive, so that no other array has their numbers.
        checked = _CHECKED.get((id(self.nodes), id(self.cells))) or _Checked(
            self.nodes, self.cells)
        object.__setattr__(self, "_checked", checked)
        nodes, cells = checked.nodes, checked.cells
        dimension = nodes.shape[1]
        require_kind("Mesh", Mapping, boundaries=self.boundaries, points=self.points)
        for name in (*self.boundaries, *self.points):
            require_kind("Mesh: boundaries and points", str, name=name)
        boundaries = {name: _facets(name, facets, checked)
                      for name, facets in self.boundaries.items()}
        points = {name: np.unique(as_integers(which, f"The nodes of mesh point '{name}'"))
                  for name, which in self.points.items()}
        curved = np.array(as_integers(self.curved_edges, "Mesh curved_edges")).reshape(-1, 2)
        middles = np.array(np.zeros((0, dimension)) if self.curved_middles is None
                           else as_floats(self.curved_middles, "Mesh curved_middles"))
        if middles.shape != (len(curved), dimension) or not np.isfinite(middles).all():
            raise MeshError(f"Mesh curved_middles must be finite and of shape ({len(curved)}, "
                            f"{dimension}), a place for each curved edge, not {middles.shape}.")
        for name, group in (*boundaries.items(), *points.items()):
            if not group.size:
                raise MeshError(f"Mesh group '{name}' is empty.")
            if group.min() < 0 or group.max() >= len(nodes):
                raise MeshError(f"Mesh group '{name}' names nodes outside 0 ... {len(nodes) - 1}.")
        for name, value in (("nodes", nodes), ("cells", cells), ("points", points),
                            ("curved_edges", curved), ("curved_middles", middles)):
            object.__setattr__(self, name, value)
        boundaries = {name: self._on_outline(name, facets) for name, facets in boundaries.items()}
        object.__setattr__(self, "boundaries", boundaries)
        for array in (curved, middles, *boundaries.values(), *points.values()):
            array.setflags(write=False)
        if len(curved):
            self.edge_numbers(curved, "curved_edges")
            self._curved_volumes()
        require_kind("Mesh", Sequence, constraints=self.constraints)
        check_constraints(self.constraints, boundaries, points, dimension, len(nodes))
        object.__setattr__(self, "constraints", tuple(self.constraints))
        require_kind("Mesh", Sequence, attachments=self.attachments)
        check_attachments(self.attachments, self.constraints, points, dimension, len(nodes))
        object.__setattr__(self, "attachments", tuple(self.attachments))
        require_choice("Mesh", "bricks", self.bricks, get_args(Bricks))
        if self.temperature is not None:
            given = as_floats(self.temperature, "Mesh: temperature")
            if given.shape == (len(nodes),):
                given = np.append(given, given[self.edges[0]].mean(axis=1))
            if given.shape != (len(nodes) + len(self.edges[0]),) or not np.isfinite(given).all():
                raise MeshError(f"Mesh temperature must be {len(nodes)} finite numbers, one for "
                                f"each node, not an array of shape {given.shape}.")
            object.__setattr__(self, "temperature", given)
        if self.node_numbers is not None:
            numbers = as_integers(self.node_numbers, "Mesh: node_numbers")
            if numbers.shape != (len(nodes),):
                raise MeshError(f"Mesh node_numbers must be {len(nodes)} whole numbers, one for "
                                f"each node, not an array of shape {numbers.shape}.")
            object.__setattr__(self, "node_numbers", numbers)
        require_kind("Mesh", Mapping, cell_groups=self.cell_groups, materials=self.materials)
        groups = {name: np.unique(as_integers(which, f"The cells of mesh group '{name}'"))
                  for name, which in self.cell_groups.items()}
        for name, group in groups.items():
            require_kind("Mesh: cell_groups", str, name=name)
            if not group.size or group.min() < 0 or group.max() >= len(cells):
                raise MeshError(f"Mesh group of cells '{name}' must hold numbers from 0 to "
                                f"{len(cells) - 1}, at least one.")
            group.setflags(write=False)
        object.__setattr__(self, "cell_groups", groups)
        check_integration("Mesh", self.integration, groups)

    @property
    def dimension(self) -> int:
        """2 for a plane body, 3 for a solid."""
        return int(self.nodes.shape[1])

    @property
    def blocks(self) -> tuple[CellBlock, ...]:
        """Cells of each kind, with the numbering of their sides and edges."""
        return self._checked.blocks

    @cached_property
    def elements(self) -> Integers:
        """Corners (M, k) of each cell in the order of ``CellKind.places``."""
        found = np.array(self.cells)
        for block in self.blocks:
            found[block.numbers] = padded([block.ordered], found.shape[1])
        return found

    @property
    def cell_counts(self) -> dict[str, int]:
        """Number of cells of each kind, such as ``{"hexahedra": 160}``."""
        return {block.kind.name: len(block.nodes) for block in self.blocks}

    @property
    def cells_in_words(self) -> str:
        """Number of cells of each kind in words, such as '12 wedges and 3 hexahedra'."""
        return " and ".join(f"{number} {name}" for name, number in self.cell_counts.items())

    @cached_property
    def outline(self) -> Integers:
        """Sides (k, n) that belong to one cell only.

        Edges of a plane body have the body on their left-hand side; faces of a solid run
        counter-clockwise seen from outside.
        """
        return self._facets[self._cells_at_facets[self._facet_number] == 1]

    @property
    def _facets(self) -> Integers:
        """Sides of each cell in turn, so that inner ones occur twice."""
        return self._checked.facets

    @property
    def _facet_cells(self) -> Integers:
        """Cell of each of ``_facets``."""
        return self._checked.owner

    @property
    def _facet_number(self) -> Integers:
        """Number of each of ``_facets`` without its orientation."""
        return self._checked.number

    @property
    def _cells_at_facets(self) -> Integers:
        """Number of cells at each distinct side."""
        return self._checked.count

    def _on_outline(self, name: str, facets: Integers) -> Integers:
        """The sides of a boundary, those of a solid as in the outline."""
        rows = row_numbers(unordered(self.outline), unordered(facets))
        what = "edges" if self.dimension == 2 else "faces"
        if (rows < 0).any():
            inner = facets[rows < 0]
            ends = [str(node) for node in np.unique(inner[0])]
            first = (f"joins nodes {' and '.join(ends)}" if self.dimension == 2
                     else f"has the nodes {', '.join(ends)}")
            raise MeshError(
                f"Boundary '{name}' has {len(inner)} {what} that are not on the outline of the "
                f"mesh, the first {first}."
            )
        if len(np.unique(rows)) < len(rows):
            one = "an edge" if self.dimension == 2 else "a face"
            raise MeshError(f"Boundary '{name}' names {one} twice.")
        return facets if self.dimension == 2 else self.outline[rows]

    @cached_property
    def pieces(self) -> tuple[int, Integers]:
        """Number of pieces that share no node, and the piece (N,) of each node."""
        import scipy.sparse as sp
        from scipy.sparse.csgraph import connected_components

        first = np.repeat(self.cells[:, :1], self.cells.shape[1] - 1, axis=1).ravel()
        graph = sp.coo_array((np.ones(first.size), (first, self.cells[:, 1:].ravel())),
                             shape=(len(self.nodes),) * 2)
        count, label = connected_components(graph, directed=False)
        return int(count), label

    @cached_property
    def edges(self) -> tuple[Integers, Integers]:
        """Distinct edges (E, 2), and the edges (M, e) of each cell in the order of its kind.

        Rows of cells with fewer edges than others are filled by their last one.
        """
        each = [block.nodes[:, np.array(block.kind.edges)] for block in self.blocks]
        ends = np.concatenate([one.reshape(-1, 2) for one in each])
        distinct, number, _ = numbered_rows(np.sort(ends, axis=1))
        found = np.empty((len(self.cells), max(one.shape[1] for one in each)), np.int64)
        first = 0
        for block, one in zip(self.blocks, each, strict=True):
            rows = number[first : first + one.shape[0] * one.shape[1]].reshape(one.shape[:2])
            found[block.numbers] = padded([rows], found.shape[1])
            first += rows.size
        return distinct, found

    def edge_numbers(self, ends: Integers, name: str) -> Integers:
        """Numbers in ``edges`` of pairs of nodes; MeshError, with ``name``, for other pairs."""
        known, pairs = self.edges[0], np.sort(ends, axis=1)
        keys, wanted = (rows[:, 0] * len(self.nodes) + rows[:, 1] for rows in (known, pairs))
        found = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        bad = keys[found] != wanted
        if bad.any() or len(np.unique(found)) < len(found):
            raise MeshError(f"Mesh {name} must be edges of cells, each once; these are not: "
                            f"{pairs[bad][0].tolist() if bad.any() else 'the repeated ones'}.")
        return found

    @cached_property
    def edge_middles(self) -> Array:
        """Places (E, d) of the middles of ``edges`` [m]."""
        middles = self.nodes[self.edges[0]].mean(axis=1)
        if len(self.curved_edges):
            middles[self.edge_numbers(self.curved_edges, "curved_edges")] = self.curved_middles
        return middles

    @cached_property
    def curved_cells(self) -> Integers:
        """Numbers (k,) of the cells that have a curved edge."""
        if not len(self.curved_edges):
            return np.empty(0, np.int64)
        curved = np.zeros(len(self.edges[0]), bool)
        curved[self.edge_numbers(self.curved_edges, "curved_edges")] = True
        return np.flatnonzero(curved[self.edges[1]].any(axis=1))

    def second_order_places(self, block: CellBlock) -> Array:
        """Second-order nodes (m, k, d) of cells of one kind [m], in the order of the kind."""
        edges = self.edges[1][block.numbers][:, : len(block.kind.edges)]
        return second_order_places(self.nodes, block.nodes, block.kind, self.edge_middles[edges])

    @cached_property
    def _second_order(self) -> SecondOrder:
        """Second-order nodes, which elements of degree 2 and the refined mesh have."""
        return second_order_nodes(self)

    def _curved_volumes(self) -> tuple[Integers, Array]:
        """Numbers of the curved cells, and their volumes or areas; MeshError for folded ones."""
        numbers, volumes = [np.empty(0, np.int64)], [np.empty(0)]
        for block in self.blocks:
            chosen = block.only(np.isin(block.numbers, self.curved_cells))
            if len(chosen.numbers):
                numbers.append(chosen.numbers)
                volumes.append(curved_volumes(self.second_order_places(chosen), block.kind))
        return np.concatenate(numbers), np.concatenate(volumes)

    def refined(self) -> "Mesh":
        """The mesh with every plane cell cut into four, or every solid cell into eight.

        Pyramids are cut into six pyramids and four tetrahedra.

        Named boundaries and points are kept. Nodes keep their numbers; the middles of the edges
        follow, then those of four-sided faces and the centres of quadrilaterals and hexahedra.
        Curved edges stay on their parabolas.
        """
        (nodes, cells, boundaries, curved, middles), owner = refined(self)
        groups = {name: np.flatnonzero(np.isin(owner, group))
                  for name, group in self.cell_groups.items()}
        constraints = [one.refined(self.middle_node) for one in self.constraints]
        return Mesh(nodes, cells, boundaries, self.points, curved, middles, constraints, groups,
                    self.materials, self.bricks, self.integration,
                    [one.refined(self.middle_node) for one in self.attachments],
                    None if self.temperature is None else at_second_order(self, self.temperature))

    def node_name(self, node: int) -> str:
        """A node by its number in its file, or in the mesh, for messages."""
        if self.node_numbers is None:
            return f"node {node} of the mesh"
        return f"node {self.node_numbers[node]} of the file"

    def middle_node(self, ends: tuple[int, int]) -> int:
        """Node in the middle of an edge in the refined mesh."""
        pair = np.array([ends])
        return len(self.nodes) + int(self.edge_numbers(pair, "constraints")[0])

    def placed(
        self,
        shift: Sequence[float] | None = None,
        rotation: float | Sequence[float] = 0.0,
        mirror: Literal["x", "y", "z"] | None = None,
    ) -> "Mesh":
        """The mesh mirrored, then turned about the origin, then shifted, with all named groups.

        Parameters
        ----------
        shift : (float, float), of solids three floats
            Displacement along the axes [m]; zero by default.
        rotation : float, of solids also three floats
            Angle [degrees], counter-clockwise (of solids about z); or angles about x, then the
            fixed y, then the fixed z. Multiples of 90 are exact.
        mirror : 'x', 'y' or 'z', optional
            The coordinate that changes its sign; cells keep their orientation.

        Raises
        ------
        InputError
            For an unknown mirror, or a shift or rotation that is not finite.
        """
        axes = "xyz"[:self.dimension]
        if mirror is not None and mirror not in tuple(axes):
            allowed = "'x' or 'y'" if self.dimension == 2 else "'x', 'y' or 'z'"
            raise InputError(f"Mesh: mirror = {mirror!r} must be {allowed}, the coordinate that "
                             f"changes its sign.")
        by = as_floats((0.0,) * self.dimension if shift is None else shift, "Mesh: shift")
        angles = as_floats(rotation, "Mesh: rotation")
        if by.shape != (self.dimension,) or not np.isfinite(by).all():
            raise InputError(f"Mesh: shift = {shift!r} must be "
                             f"{'two' if self.dimension == 2 else 'three'} finite numbers in m.")
        if self.dimension == 3 and angles.shape == ():
            angles = np.array([0.0, 0.0, float(angles)])
        if angles.shape != ((), (3,))[self.dimension - 2] or not np.isfinite(angles).all():
            raise InputError(f"Mesh: rotation = {rotation!r} must be a finite angle in degrees"
                             f"{'' if self.dimension == 2 else ', or three about x, y, z'}.")
        signs = [-1.0 if mirror == axis else 1.0 for axis in axes]
        turn = _turn(float(angles)) if self.dimension == 2 else _turn_in_space(angles)
        nodes, middles = (places * signs @ turn.T + by
                          for places in (self.nodes, np.asarray(self.curved_middles)))
        whole, arm = np.eye(3), np.zeros(3)
        whole[:self.dimension, :self.dimension], arm[:self.dimension] = turn * signs, by
        return Mesh(nodes, self.cells, self.boundaries, self.points, self.curved_edges, middles,
                    [one.turned(turn * signs, by) for one in self.constraints], self.cell_groups,
                    {name: one.moved(whole, arm) for name, one in self.materials.items()},
                    self.bricks, self.integration,
                    [one.turned(turn * signs, by) for one in self.attachments],
                    self.temperature, self.node_numbers)

    def part(self, cells: Any) -> "Mesh":
        """Mesh of some of the cells, with what is left of boundaries, points and groups of cells.

        Parameters
        ----------
        cells : (M,) array of bool, or (k,) integer array
            Whether each cell is taken, or numbers of cells.

        Raises
        ------
        InputError
            For no cells, for numbers that do not exist, and for meshes with curved edges,
            constraints, attachments or temperatures.

        Examples
        --------
        >>> import numpy as np
        >>> from fecontact import Mesh
        >>> plate = Mesh.grid(np.linspace(0.0, 0.2, 5), np.linspace(0.0, 0.1, 3))
        >>> corner = plate.part([0, 1])
        >>> len(corner.cells), sorted(corner.boundaries)
        (2, ['bottom', 'left'])
        """
        if len(self.curved_edges) or self.constraints or self.attachments or (
                self.temperature is not None):
            raise InputError("Mesh.part: a mesh with curved edges, constraints, attachments or "
                             "temperatures cannot be cut; leave out cells before these are added.")
        count, chosen = len(self.cells), np.asarray(cells)
        try:
            kept = np.arange(count)[chosen.astype(int) if not chosen.size else chosen]
        except IndexError:
            raise InputError(f"Mesh.part: cells must be numbers from 0 to {count - 1}, or {count} "
                             f"flags.") from None
        if not kept.size:
            raise InputError("Mesh.part: give at least one cell.")
        used, corners = np.unique(self.cells[kept], return_inverse=True)
        number = np.full(len(self.nodes), -1)
        number[used] = np.arange(len(used))
        made = Mesh(self.nodes[used], corners.reshape(len(kept), -1))
        on_outline = {name: number[sides] for name, sides in self.boundaries.items()}
        place = np.full(len(self.cells), -1)
        place[kept] = np.arange(len(kept))
        groups = {name: place[members] for name, members in self.cell_groups.items()}
        points = {name: number[np.atleast_1d(nodes)] for name, nodes in self.points.items()}
        groups = _left(groups, lambda members: members >= 0)
        rules = self.integration if isinstance(self.integration, str) else {
            name: rule for name, rule in self.integration.items() if name in groups}
        return replace(
            made, bricks=self.bricks, integration=rules, materials=self.materials,
            boundaries=_left(on_outline, lambda sides: (sides >= 0).all(axis=1) & (
                row_numbers(unordered(made.outline), unordered(sides)) >= 0)),
            points=_left(points, lambda nodes: nodes >= 0),
            cell_groups=groups,
            node_numbers=None if self.node_numbers is None else self.node_numbers[used])

    def mapped(self, place: Callable[[Array], ArrayLike]) -> "Mesh":
        """The mesh with its nodes at other places, such as a grid bent to a ring.

        Parameters
        ----------
        place : function
            Gives the new places of nodes (N, 2) or (N, 3) from their places [m]. Where it turns
            the orientation over, cells are turned too.

        Raises
        ------
        InputError
            For places of another shape, and for meshes with constraints or attachments.
        MeshError
            For cells that are folded or overlap there.

        Examples
        --------
        >>> import numpy as np
        >>> from fecontact import Mesh
        >>> strip = Mesh.grid(np.linspace(0.0, np.pi / 2.0, 9), np.linspace(1.0, 2.0, 3))
        >>> ring = strip.mapped(lambda x: x[:, 1:] * np.column_stack([np.cos(x[:, 0]),
        ...                                                           np.sin(x[:, 0])]))
        >>> round(ring.area, 2)  # 3/4 pi without the chords
        2.34
        """
        if self.constraints or self.attachments:
            raise InputError("Mesh.mapped: a mesh with constraints or attachments, whose places "
                             "are given too, cannot be mapped; add these afterwards.")
        nodes, middles = (as_floats(place(one), "Mesh.mapped: places") if len(one) else one
                          for one in (self.nodes, np.asarray(self.curved_middles)))
        if nodes.shape != self.nodes.shape:
            raise InputError(f"Mesh.mapped: the places must have the shape {self.nodes.shape}, not "
                             f"{nodes.shape}.")
        return replace(self, nodes=nodes, curved_middles=middles)

    def summary(self) -> list[tuple[str, str]]:
        """Counts, size and named groups."""
        solid = self.dimension == 3
        return [
            ("nodes", f"{len(self.nodes)}"),
            *((name, f"{number}") for name, number in self.cell_counts.items()),
            *((axis, span(values, "m")) for axis, values in zip("xyz", self.nodes.T,
                                                                strict=False)),
            ("volume", f"{self.volume:.4g} m³") if solid else ("area", f"{self.area:.4g} m²"),
            *([("curved edges", f"{len(self.curved_edges)}")] if len(self.curved_edges) else []),
            *((f"boundary {name}", count(len(group), "face" if solid else "edge"))
              for name, group in self.boundaries.items()),
            *((f"point {name}", count(len(nodes), "node")) for name, nodes in self.points.items()),
            *([("constraints", counted(self.constraints))] if self.constraints else []),
            *([("attachments", counted_attachments(self.attachments))] if self.attachments else []),
        ]

    @property
    def area(self) -> float:
        """Area of the meshed region of a plane body [m^2]; MeshError for a solid."""
        if self.dimension == 3:
            raise MeshError("A solid has a volume; area is that of a plane body.")
        return self._size()

    @property
    def volume(self) -> float:
        """Volume of a solid [m^3]; MeshError for a plane body."""
        if self.dimension == 2:
            raise MeshError("A plane body has an area; volume is that of a solid.")
        return self._size()

    def _size(self) -> float:
        """Sum of the volumes of the cells, in the plane of their areas [m^d]."""
        volume = np.empty(len(self.cells))
        for block in self.blocks:
            volume[block.numbers] = straight_volumes(self.nodes, block.nodes, block.kind)
        curved, volumes = self._curved_volumes()
        volume[curved] = volumes
        return float(volume.sum())

    @property
    def extent(self) -> float:
        """Length of the diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def boundary(self, name: str) -> Integers:
        """Edges (k, 2) or faces (k, n) of a named boundary; MeshError for an unknown name."""
        if name not in self.boundaries:
            raise MeshError(
                f"The mesh has no boundary named '{name}'{nearest(name, self.boundaries)}; "
                f"its boundaries are: {choices(self.boundaries)}."
            )
        return self.boundaries[name]


def _left(
    named: Mapping[str, Integers], stays: Callable[[Integers], Any]
) -> dict[str, Integers]:
    """Named groups without the rows that are gone; none that would be empty."""
    found = {name: rows[stays(rows)] for name, rows in named.items()}
    return {name: rows for name, rows in found.items() if len(rows)}


def _turn(degrees: float) -> Array:
    """Matrix (2, 2) of a rotation, without rounding at multiples of 90 degrees."""
    quarters, rest = divmod(degrees, 90.0)
    c, s = np.cos(np.radians(rest)), np.sin(np.radians(rest))
    for _ in range(int(quarters % 4.0)):
        c, s = -s, c
    return np.array([[c, -s], [s, c]])


def _turn_in_space(degrees: Array) -> Array:
    """Matrix (3, 3) of rotations about x, then y, then z."""
    turn = np.eye(3)
    for axis, angle in enumerate(degrees.tolist()):
        one, plane = np.eye(3), [(axis + 1) % 3, (axis + 2) % 3]
        one[np.ix_(plane, plane)] = _turn(angle)
        turn = one @ turn
    return turn


def _facets(name: str, facets: ArrayLike, checked: _Checked) -> Integers:
    width = checked.facets.shape[1]
    what = ("edges", "pairs") if width == 2 else ("faces", "rows")
    array = np.array(as_integers(facets, f"The {what[0]} of mesh boundary '{name}'"))
    if array.ndim == 2 and array.shape[1] < width and any(
            len(side) == array.shape[1] for block in checked.blocks for side in block.kind.facets):
        array = padded([array], width)
    if array.size and (array.ndim != 2 or array.shape[1] != width):
        raise MeshError(f"Boundary '{name}' must have shape (k, {width}), {what[1]} of nodes, "
                        f"not {array.shape}.")
    return array.reshape(-1, width)
