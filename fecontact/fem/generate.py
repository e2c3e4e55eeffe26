"""Meshing of plane bodies, around holes by Gmsh, with named boundaries and points."""

import ctypes
import math
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from fecontact.core import system_libraries
from fecontact.core.errors import InputError, MissingLibraryError
from fecontact.core.extras import optional
from fecontact.core.resources.memory import available_memory
from fecontact.fem.mesh import Mesh
from fecontact.fem.rectangles import mesh_of_rectangles
from fecontact.fem.shapes import Beam, Block, Grid, Hole, Pendulum, Shape, grid_of, nearest_line
from fecontact.fem.solids.generate import generate_solid
from fecontact.fem.solids.shapes import SolidShape


class Rim:
    """Curves around a hole: arcs of 45 degrees, and lines from their ends to the rectangles.

    Points on the rim are named by their direction from the centre, (1, 0), (1, 1), (0, 1), ...
    """

    def __init__(self, geo: Any, grid: Grid, hole: Hole, element_size: float,
                 corner: Callable[[int, int], int]) -> None:
        self.geo, self.hole, self.corner = geo, hole, corner
        self.column = nearest_line(grid.x, hole.centre[0])
        self.row = nearest_line(grid.y, hole.centre[1])
        reach = math.hypot(grid.x[self.column + 1] - hole.centre[0],
                           grid.y[self.row + 1] - hole.centre[1]) - hole.radius
        self.across = max(1, math.ceil(reach / element_size))
        self.centre = geo.addPoint(*hole.centre, 0.0)
        self.points: dict[tuple[int, int], int] = {}
        self.arcs: dict[tuple[tuple[int, int], tuple[int, int]], int] = {}
        self.spokes: dict[tuple[int, int], int] = {}

    def touches(self, i: int, j: int) -> bool:
        """Whether the hole cuts a corner of the rectangle (i, j)."""
        return i in (self.column - 1, self.column) and j in (self.row - 1, self.row)

    def side(self, i: int, j: int) -> tuple[int, int]:
        """Two indices: 1 for a rectangle right of, and above, the centre, else 0."""
        return i - self.column + 1, j - self.row + 1

    def loops(self, i: int, j: int, upright: int, level: int,
              counts: tuple[int, int]) -> list[list[int]]:
        """Curve loops of the two patches between the rim and a rectangle's outer sides."""
        right, up = self.side(i, j)
        x, y = 2 * right - 1, 2 * up - 1
        spokes = [self._spoke(direction) for direction in ((x, 0), (x, y), (0, y))]
        arcs = [self._arc((x, 0), (x, y), counts[0]), self._arc((x, y), (0, y), counts[1])]
        # Outer sides run up and to the right; the loops run from the rim outwards along (x, 0).
        return [[spokes[0], upright * y, -spokes[1], -arcs[0]],
                [spokes[1], -level * x, -spokes[2], -arcs[1]]]

    def _point(self, direction: tuple[int, int]) -> int:
        if direction not in self.points:
            scale = self.hole.radius / math.hypot(*direction)
            self.points[direction] = self.geo.addPoint(
                self.hole.centre[0] + scale * direction[0],
                self.hole.centre[1] + scale * direction[1], 0.0)
        return self.points[direction]

    def _spoke(self, direction: tuple[int, int]) -> int:
        if direction not in self.spokes:
            end = self.corner(self.column + direction[0], self.row + direction[1])
            self.spokes[direction] = self.geo.addLine(self._point(direction), end)
            self.geo.mesh.setTransfiniteCurve(self.spokes[direction], self.across + 1)
        return self.spokes[direction]

    def _arc(self, start: tuple[int, int], end: tuple[int, int], count: int) -> int:
        if (start, end) not in self.arcs:
            self.arcs[start, end] = self.geo.addCircleArc(
                self._point(start), self.centre, self._point(end))
            self.geo.mesh.setTransfiniteCurve(self.arcs[start, end], count + 1)
        return self.arcs[start, end]


__all__ = ["MAX_CELLS", "Beam", "Block", "Pendulum", "Shape", "generate"]

MAX_CELLS = 2_000_000
_BYTES = 3000.0  # memory per cell during meshing

_SIGACTION_BYTES = 512  # more than struct sigaction has on any system
_GMSH_LOCK = threading.Lock()  # Gmsh has one global state
_GMSH_OPTIONS: dict[str, float] = {
    "General.Terminal": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.MeshOnlyEmpty": 0,
    "Mesh.MeshOnlyVisible": 0,
    "Mesh.RecombineAll": 0,
    "Mesh.SubdivisionAlgorithm": 0,
}


def generate(shape: Shape | SolidShape) -> Mesh:
    """Mesh a plane body, in rows and columns of rectangles or triangles, or a solid.

    Parameters
    ----------
    shape : Beam, Block, Pendulum, or a solid
        The body, with size and kind of its elements. Solids are those of ``fecontact.fem``:
        SolidBlock, Plate, Ring, Cylinder, SphereSegment, LapStrip.

    Returns
    -------
    Mesh
        Mesh with the named boundaries and points of the shape; its points are nodes.

    Raises
    ------
    InputError
        For another shape, or an element size that makes more than two million elements.
    MissingLibraryError
        If there is no Gmsh, which meshes around the hinge of a pendulum; others need none.

    Notes
    -----
    May be called from any thread, and while Gmsh is in use: models, options and signal handlers of
    the caller are restored.
    """
    if isinstance(shape, SolidShape):
        return generate_solid(shape)
    if not isinstance(shape, Shape):
        raise InputError(f"generate: {shape!r} is not a shape; give a Beam, a Block or a Pendulum, "
                         f"or a solid of fecontact.fem, such as a SolidBlock.")
    grid = grid_of(shape)
    _require_few_cells(shape, grid)
    if grid.hole is None:
        return mesh_of_rectangles(grid, shape.element_size, shape.element)
    gmsh = _import_gmsh()
    with _GMSH_LOCK, _gmsh_session(gmsh):
        return _mesh(gmsh, grid, shape)


def _mesh(gmsh: Any, grid: Grid, shape: Shape) -> Mesh:
    """Build the model, mesh it and collect nodes, cells and groups."""
    geo = gmsh.model.geo
    along_x, along_y = grid.divisions(shape.element_size)
    corners: dict[tuple[int, int], int] = {}
    curves: dict[tuple[str, int, int], int] = {}
    names: dict[int, list[str]] = {}
    surfaces = []

    def corner(i: int, j: int) -> int:
        if (i, j) not in corners:
            corners[i, j] = geo.addPoint(grid.x[i], grid.y[j], 0.0)
        return corners[i, j]

    def curve(direction: str, i: int, j: int, name: str) -> int:
        key = direction, i, j
        if key not in curves:
            end, count = ((i + 1, j), along_x[i]) if direction == "x" else ((i, j + 1), along_y[j])
            curves[key] = geo.addLine(corner(i, j), corner(*end))
            geo.mesh.setTransfiniteCurve(curves[key], int(count) + 1)
        names.setdefault(curves[key], []).append(name)
        return curves[key]

    rim = None if grid.hole is None else Rim(geo, grid, grid.hole, shape.element_size, corner)
    for i, j, part in grid.cells():
        x = (grid.x[i] + grid.x[i + 1]) / 2
        if rim is not None and rim.touches(i, j):
            right, up = rim.side(i, j)
            loops = rim.loops(
                i, j,
                curve("y", i + right, j, grid.side(part, "right" if right else "left", x)),
                curve("x", i, j + up, grid.side(part, "top" if up else "bottom", x)),
                (int(along_y[j]), int(along_x[i])),
            )
        else:
            loops = [[
                curve("x", i, j, grid.side(part, "bottom", x)),
                curve("y", i + 1, j, grid.side(part, "right", x)),
                -curve("x", i, j + 1, grid.side(part, "top", x)),
                -curve("y", i, j, grid.side(part, "left", x)),
            ]]
        for curves_of_loop in loops:
            surface = geo.addPlaneSurface([geo.addCurveLoop(curves_of_loop)])
            geo.mesh.setTransfiniteSurface(surface, "AlternateLeft")
            if shape.element == "quadrilateral":
                geo.mesh.setRecombine(2, surface)
            surfaces.append(surface)
    geo.synchronize()
    gmsh.model.mesh.generate(2)

    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    cell_type, size = (3, 4) if shape.element == "quadrilateral" else (2, 3)
    cells = np.concatenate([
        gmsh.model.mesh.getElementsByType(cell_type, surface)[1] for surface in surfaces
    ])
    # Gmsh makes the centre of a hole a node, which no cell uses.
    order = np.argsort(tags)
    order = order[np.isin(tags[order], cells)]
    tags = tags[order]
    nodes = coordinates.reshape(-1, 3)[order, :2]
    boundaries: dict[str, list[NDArray[Any]]] = {}
    if rim is not None:
        names |= {tag: [rim.hole.name] for tag in rim.arcs.values()}
    for tag, owners in names.items():
        if len(owners) == 1:
            boundaries.setdefault(owners[0], []).append(
                gmsh.model.mesh.getElementsByType(1, tag)[1])
    points = {}
    for name, place in grid.points.items():
        key = nearest_line(grid.x, place[0]), nearest_line(grid.y, place[1])
        points[name] = np.searchsorted(tags, gmsh.model.mesh.getNodes(0, corners[key])[0])
    return Mesh(
        nodes,
        np.searchsorted(tags, cells).reshape(-1, size),
        {name: np.searchsorted(tags, np.concatenate(parts)).reshape(-1, 2)
         for name, parts in boundaries.items()},
        points,
    )


@contextmanager
def _signals_as_before() -> Iterator[None]:
    """Restore the signal handlers that Gmsh resets to their defaults when it starts.

    Otherwise a closed pipe or SIGTERM would end the process silently. Calls the C library, since
    Python sets signal handlers in the main thread only.
    """
    action = None if os.name == "nt" else getattr(ctypes.CDLL(None), "sigaction", None)
    if action is None:
        yield
        return
    kept = {}
    for number in signal.valid_signals():
        kept[number] = ctypes.create_string_buffer(_SIGACTION_BYTES)
        if action(int(number), None, kept[number]) != 0:
            del kept[number]
    try:
        yield
    finally:
        for number, before in kept.items():
            action(int(number), before, None)


@contextmanager
def _gmsh_session(gmsh: Any) -> Iterator[None]:
    """A separate, quiet Gmsh model that is removed at the end."""
    mine = not gmsh.isInitialized()
    if mine:
        # Keep SIGINT with Python; only the main thread may set a handler.
        with _signals_as_before():
            gmsh.initialize(readConfigFiles=False, interruptible=False)
    options: dict[str, float] = {}
    model = f"fecontact-{uuid4().hex}"
    previous = gmsh.model.getCurrent()
    try:
        for name, value in _GMSH_OPTIONS.items():
            options[name] = gmsh.option.getNumber(name)
            gmsh.option.setNumber(name, value)
        gmsh.model.add(model)
        yield
    finally:
        if mine:
            gmsh.finalize()
        else:
            if model in gmsh.model.list():
                gmsh.model.setCurrent(model)
                gmsh.model.remove()
            gmsh.model.setCurrent(previous)
            for name, value in options.items():
                gmsh.option.setNumber(name, value)


def _import_gmsh() -> Any:
    try:
        return optional("gmsh", "A mesh around a hole")
    except OSError as error:
        raise MissingLibraryError(
            f"Gmsh, which makes the mesh, lacks a library of the system ({error}); on Debian or "
            f"Ubuntu install it with: "
            f"apt-get install -y {' '.join(system_libraries.PACKAGES.values())}"
        ) from None


def _require_few_cells(shape: Shape, grid: Grid) -> None:
    count = _count_cells(shape, grid, shape.element_size)
    most = int(min(MAX_CELLS, available_memory() / _BYTES))
    if count > most:
        enough = shape.element_size * math.sqrt(count / most)
        while _count_cells(shape, grid, enough) > most:
            enough *= 1.1
        raise InputError(
            f"{type(shape).__name__}: element_size = {shape.element_size!r} makes {count:.3g} "
            f"elements, more than {most}; take one of at least {1.1 * enough:.2g} m."
        )


def _count_cells(shape: Shape, grid: Grid, element_size: float) -> float:
    along_x, along_y = grid.divisions(element_size)
    per_rectangle = 2 if shape.element == "triangle" else 1
    return per_rectangle * math.fsum(along_x[i] * along_y[j] for i, j, _ in grid.cells())
