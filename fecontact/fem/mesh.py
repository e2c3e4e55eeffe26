"""Plane meshes of triangles or quadrilaterals with named boundaries and points."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from fecontact.core.checks import as_floats, as_integers, require_kind
from fecontact.core.errors import InputError, MeshError, choices, nearest
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.core.units import Summarised, count, span

_FLAT = 1e-12  # area of a degenerate cell, relative to its squared sides


@dataclass(frozen=True, eq=False, repr=False)
class Mesh(Summarised):
    """A plane mesh of first-order triangles or quadrilaterals with named boundaries and points.

    Parameters
    ----------
    nodes : (N, 2) array
        Coordinates x (tangential to the ground) and y (normal to it, into the body) [m].
    cells : (M, 3) or (M, 4) integer array
        Corner nodes of each cell, counter-clockwise; clockwise cells are reversed.
    boundaries : mapping of name to (k, 2) integer array
        Edges, as pairs of nodes; each must be an edge of exactly one cell.
    points : mapping of name to integer or (k,) integer array
        Nodes.

    Raises
    ------
    MeshError
        For arrays of wrong shape, unknown nodes, degenerate or overlapping cells, nodes without a
        cell, an empty group, or a boundary edge that is not on the outline or is named twice.
    """

    nodes: Array
    cells: Integers
    boundaries: Mapping[str, Integers] = field(default_factory=dict)
    points: Mapping[str, Integers] = field(default_factory=dict)

    def __post_init__(self) -> None:
        nodes = np.array(as_floats(self.nodes, "Mesh nodes"))
        cells = np.array(as_integers(self.cells, "Mesh cells"))
        if nodes.ndim != 2 or nodes.shape[1] != 2:
            raise MeshError(f"Mesh nodes must have shape (N, 2), not {nodes.shape}.")
        if cells.ndim != 2 or cells.shape[1] not in (3, 4) or not len(cells):
            raise MeshError(
                f"Mesh cells must have shape (M, 3) for triangles or (M, 4) for quadrilaterals "
                f"with M > 0, not {cells.shape}."
            )
        if not np.isfinite(nodes).all():
            raise MeshError("Mesh nodes hold values that are not finite.")
        if cells.min() < 0 or cells.max() >= len(nodes):
            raise MeshError(f"Mesh cells name nodes outside 0 ... {len(nodes) - 1}.")
        if len(np.unique(cells)) != len(nodes):
            raise MeshError(
                f"{len(nodes) - len(np.unique(cells))} mesh nodes belong to no cell; remove them."
            )
        area = _signed_area(nodes, cells)
        cells = np.where(area[:, None] < 0, cells[:, ::-1], cells)
        area = _smallest_corner_jacobian(nodes, cells) if cells.shape[1] == 4 else np.abs(area)
        side = nodes[cells] - np.roll(nodes[cells], 1, axis=1)
        bad = area <= _FLAT * (side**2).sum(axis=(1, 2))
        if bad.any():
            raise MeshError(
                f"{np.count_nonzero(bad)} mesh cells have no area or are folded, the first is cell "
                f"{np.flatnonzero(bad)[0]}."
            )
        require_kind("Mesh", Mapping, boundaries=self.boundaries, points=self.points)
        for name in (*self.boundaries, *self.points):
            require_kind("Mesh: boundaries and points", str, name=name)
        boundaries = {name: _edges(name, edges) for name, edges in self.boundaries.items()}
        points = {name: np.unique(as_integers(which, f"The nodes of mesh point '{name}'"))
                  for name, which in self.points.items()}
        for name, group in (*boundaries.items(), *points.items()):
            if not group.size:
                raise MeshError(f"Mesh group '{name}' is empty.")
            if group.min() < 0 or group.max() >= len(nodes):
                raise MeshError(f"Mesh group '{name}' names nodes outside 0 ... {len(nodes) - 1}.")
        for array in (nodes, cells, *boundaries.values(), *points.values()):
            array.setflags(write=False)
        for name, value in (("nodes", nodes), ("cells", cells), ("boundaries", boundaries),
                            ("points", points)):
            object.__setattr__(self, name, value)
        crowded = self._sides[self._cells_at_edges > 2]
        if len(crowded):
            raise MeshError(
                f"The edge between mesh nodes {crowded[0][0]} and {crowded[0][1]} belongs to more "
                f"than two cells; remove overlapping cells."
            )
        outline = {tuple(edge) for edge in np.sort(self.outline, axis=1).tolist()}
        for name, edges in boundaries.items():
            inner = [edge for edge in np.sort(edges, axis=1).tolist() if tuple(edge) not in outline]
            if inner:
                raise MeshError(
                    f"Boundary '{name}' has {len(inner)} edges that are not on the outline of the "
                    f"mesh, the first joins nodes {inner[0][0]} and {inner[0][1]}."
                )
            if len(np.unique(np.sort(edges, axis=1), axis=0)) < len(edges):
                raise MeshError(f"Boundary '{name}' names an edge twice.")

    @cached_property
    def outline(self) -> Integers:
        """Edges (k, 2) that belong to one cell only, the body on their left-hand side."""
        return self._sides[self._cells_at_edges == 1]

    @cached_property
    def _sides(self) -> Integers:
        """Edges of each cell in turn, so that inner ones occur twice."""
        return np.stack([self.cells, np.roll(self.cells, -1, axis=1)], axis=2).reshape(-1, 2)

    @cached_property
    def _cells_at_edges(self) -> Integers:
        """Number of cells at the edge of each row of ``_sides``."""
        _, edge, count = np.unique(
            np.sort(self._sides, axis=1), axis=0, return_inverse=True, return_counts=True
        )
        cells: Integers = count[edge.ravel()]
        return cells

    def refined(self) -> "Mesh":
        """The mesh with every cell cut into four, and the same named boundaries and points.

        Nodes keep their numbers; the mid-points of the edges follow, then the centres of
        quadrilaterals.
        """
        count, corners = len(self.nodes), self.cells.shape[1]
        edges = np.stack([self.cells, np.roll(self.cells, -1, axis=1)], axis=2)
        ends, number = np.unique(np.sort(edges.reshape(-1, 2), axis=1), axis=0,
                                 return_inverse=True)
        middles = count + number.reshape(-1, corners)
        nodes = [self.nodes, self.nodes[ends].mean(axis=1)]
        parts = [np.column_stack([self.cells[:, i], middles[:, i], middles[:, i - 1]])
                 for i in range(corners)]
        if corners == 3:
            cells = np.concatenate([*parts, middles])
        else:
            centres = count + len(ends) + np.arange(len(self.cells))
            nodes.append(self.nodes[self.cells].mean(axis=1))
            cells = np.concatenate([np.column_stack([part[:, :2], centres, part[:, 2]])
                                    for part in parts])
        keys = ends[:, 0] * count + ends[:, 1]

        def halves(boundary: Integers) -> Integers:
            ordered = np.sort(boundary, axis=1)
            middle = count + np.searchsorted(keys, ordered[:, 0] * count + ordered[:, 1])
            return np.stack([boundary[:, 0], middle, middle, boundary[:, 1]],
                            axis=1).reshape(-1, 2)

        return Mesh(np.concatenate(nodes), cells,
                    {name: halves(group) for name, group in self.boundaries.items()}, self.points)

    def placed(
        self,
        shift: tuple[float, float] = (0.0, 0.0),
        rotation: float = 0.0,
        mirror: Literal["x", "y"] | None = None,
    ) -> "Mesh":
        """The mesh mirrored, then turned about the origin, then shifted, with all named groups.

        Parameters
        ----------
        shift : (float, float)
            Displacement along x and y [m].
        rotation : float
            Angle [degrees], counter-clockwise; multiples of 90 are exact.
        mirror : 'x' or 'y', optional
            The coordinate that changes its sign; cells stay counter-clockwise.

        Raises
        ------
        InputError
            For an unknown mirror, or a shift or rotation that is not finite.
        """
        if mirror not in (None, "x", "y"):
            raise InputError(f"Mesh: mirror = {mirror!r} must be 'x' or 'y', the coordinate that "
                             f"changes its sign.")
        by, angle = as_floats(shift, "Mesh: shift"), as_floats(rotation, "Mesh: rotation")
        if by.shape != (2,) or not np.isfinite(by).all():
            raise InputError(f"Mesh: shift = {shift!r} must be two finite numbers in m.")
        if angle.shape or not np.isfinite(angle):
            raise InputError(f"Mesh: rotation = {rotation!r} must be a finite angle in degrees.")
        signs = [-1.0 if mirror == axis else 1.0 for axis in ("x", "y")]
        turned = self.nodes * signs @ _turn(float(angle)).T + by
        return Mesh(turned, self.cells, self.boundaries, self.points)

    def summary(self) -> list[tuple[str, str]]:
        """Counts, size and named groups."""
        x, y = self.nodes.T
        return [
            ("nodes", f"{len(self.nodes)}"),
            ("triangles" if self.cells.shape[1] == 3 else "quadrilaterals", f"{len(self.cells)}"),
            ("x", span(x, "m")), ("y", span(y, "m")), ("area", f"{self.area:.4g} m²"),
            *((f"boundary {name}", count(len(edges), "edge"))
              for name, edges in self.boundaries.items()),
            *((f"point {name}", count(len(nodes), "node")) for name, nodes in self.points.items()),
        ]

    @property
    def area(self) -> float:
        """Area of the meshed region [m^2]."""
        return float(_signed_area(self.nodes, self.cells).sum())

    @property
    def extent(self) -> float:
        """Length of the diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def boundary(self, name: str) -> Integers:
        """Edges (k, 2) of a named boundary; MeshError for an unknown name."""
        if name not in self.boundaries:
            raise MeshError(
                f"The mesh has no boundary named '{name}'{nearest(name, self.boundaries)}; "
                f"its boundaries are: {choices(self.boundaries)}."
            )
        return self.boundaries[name]


def _turn(degrees: float) -> Array:
    """Matrix (2, 2) of a rotation, without rounding at multiples of 90 degrees."""
    quarters, rest = divmod(degrees, 90.0)
    c, s = np.cos(np.radians(rest)), np.sin(np.radians(rest))
    for _ in range(int(quarters % 4.0)):
        c, s = -s, c
    return np.array([[c, -s], [s, c]])


def _edges(name: str, edges: ArrayLike) -> Integers:
    array = np.array(as_integers(edges, f"The edges of mesh boundary '{name}'"))
    if array.size and (array.ndim != 2 or array.shape[1] != 2):
        raise MeshError(f"Boundary '{name}' must have shape (k, 2), pairs of nodes, not "
                        f"{array.shape}.")
    return array.reshape(-1, 2)


def _signed_area(nodes: Array, cells: Integers) -> Array:
    x, y = nodes[cells, 0], nodes[cells, 1]
    area: Array = 0.5 * (
        x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
    return area


def _smallest_corner_jacobian(
    nodes: Array, cells: Integers
) -> Array:
    corner = nodes[cells]
    ahead = np.roll(corner, -1, axis=1) - corner
    back = np.roll(corner, 1, axis=1) - corner
    smallest: Array = (
        ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]).min(axis=1)
    return smallest
