"""Meshing of plane bodies by Gmsh, with named boundaries and points."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError, MissingLibraryError
from fecontact.mesh import Mesh
from fecontact.shapes import SAME, Beam, Block, Pendulum, Shape

__all__ = ["MAX_CELLS", "Beam", "Block", "Pendulum", "Shape", "generate"]

MAX_CELLS = 2_000_000

_GMSH_LOCK = threading.Lock()  # Gmsh has one global state
_GMSH_OPTIONS: dict[str, float] = {
    "General.Terminal": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.MeshOnlyEmpty": 0,
    "Mesh.MeshOnlyVisible": 0,
    "Mesh.RecombineAll": 0,
    "Mesh.SubdivisionAlgorithm": 0,
}


def generate(shape: Shape) -> Mesh:
    """Mesh a body with Gmsh: rows and columns of rectangles, or of right-angled triangles.

    Parameters
    ----------
    shape : Beam, Block or Pendulum
        The body, with the size and kind of its elements.

    Returns
    -------
    Mesh
        With the boundaries and points that the shape names; its points are nodes exactly there.

    Raises
    ------
    InputError
        For another shape, or an element size that makes more than two million elements.
    MissingLibraryError
        If a library that Gmsh needs is not installed.

    Notes
    -----
    May be called from any thread, and while Gmsh is in use: the caller's models, options and
    signal handlers are left as they are.
    """
    if not isinstance(shape, Shape):
        raise InputError(f"generate: {shape!r} is not a shape; give a Beam, a Block or a Pendulum.")
    grid = _grid(shape)
    _require_few_cells(shape, grid)
    gmsh = _import_gmsh()
    with _GMSH_LOCK, _gmsh_session(gmsh):
        return _mesh(gmsh, grid, shape)


@dataclass(frozen=True)
class _Grid:
    """Lines that cut the plane into rectangles, which of these are filled, and the names.

    ``part(x, y)`` is the name of the part of the body around a point, or None outside;
    ``side(part, facing, x)`` names the outline of a rectangle of that part with its middle at x.
    """

    x: list[float]
    y: list[float]
    part: Callable[[float, float], str | None]
    side: Callable[[str, str, float], str]
    points: dict[str, tuple[float, float]]

    def cells(self) -> Iterator[tuple[int, int, str]]:
        for i, x in enumerate(_middles(self.x)):
            for j, y in enumerate(_middles(self.y)):
                part = self.part(x, y)
                if part is not None:
                    yield i, j, part

    def divisions(self, element_size: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Elements along each interval of the lines x and y."""
        x, y = (np.clip(np.ceil(np.diff(lines) / max(element_size, 1e-99) - 1e-6), 1.0, 1e99)
                for lines in (self.x, self.y))
        return x, y


def _grid(shape: Shape) -> _Grid:
    match shape:
        case Beam():
            return _Grid(
                _lines(0.0, shape.length, shape.length / 2),
                _lines(0.0, shape.height, shape.height / 2),
                lambda x, y: "body",
                lambda part, facing, x: "contact" if facing == "bottom" else facing,
                {"B": (0.0, shape.height / 2), "C": (shape.length / 2, shape.height)},
            )
        case Block():
            width, height = shape.width, shape.height
            contact = width if shape.contact_length is None else shape.contact_length
            drive = height / 2 if shape.drive_height is None else shape.drive_height

            def side_of_block(part: str, facing: str, x: float) -> str:
                touches = facing == "bottom" and abs(x - width / 2) < contact / 2
                return "contact" if touches else facing

            return _Grid(
                _lines(0.0, width, width / 2, (width - contact) / 2, (width + contact) / 2),
                _lines(0.0, height, drive),
                lambda x, y: "body",
                side_of_block,
                {"B": (0.0, drive), "C": (width / 2, height)},
            )
        case Pendulum():
            length, half_width = shape.arm_length, shape.bob_width / 2
            middle, half_arm = shape.bob_height / 2, shape.arm_height / 2
            drive = length if shape.drive_distance is None else shape.drive_distance

            def part_of_pendulum(x: float, y: float) -> str | None:
                if x > length - half_width:
                    return "bob"
                return "arm" if abs(y - middle) < half_arm else None

            def side_of_pendulum(part: str, facing: str, x: float) -> str:
                return "contact" if (part, facing) == ("bob", "bottom") else f"{part}_{facing}"

            return _Grid(
                _lines(0.0, length + half_width, length - half_width, length, drive),
                _lines(0.0, shape.bob_height, middle, middle - half_arm, middle + half_arm),
                part_of_pendulum,
                side_of_pendulum,
                {"pivot": (0.0, middle), "B": (drive, middle), "C": (length, shape.bob_height)},
            )


def _mesh(gmsh: Any, grid: _Grid, shape: Shape) -> Mesh:
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

    for i, j, part in grid.cells():
        x = (grid.x[i] + grid.x[i + 1]) / 2
        loop = geo.addCurveLoop([
            curve("x", i, j, grid.side(part, "bottom", x)),
            curve("y", i + 1, j, grid.side(part, "right", x)),
            -curve("x", i, j + 1, grid.side(part, "top", x)),
            -curve("y", i, j, grid.side(part, "left", x)),
        ])
        surface = geo.addPlaneSurface([loop])
        geo.mesh.setTransfiniteSurface(surface, "AlternateLeft")
        if shape.element == "quadrilateral":
            geo.mesh.setRecombine(2, surface)
        surfaces.append(surface)
    geo.synchronize()
    gmsh.model.mesh.generate(2)

    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    tags = tags[order]
    nodes = coordinates.reshape(-1, 3)[order, :2]
    cell_type, size = (3, 4) if shape.element == "quadrilateral" else (2, 3)
    cells = np.concatenate([
        gmsh.model.mesh.getElementsByType(cell_type, surface)[1] for surface in surfaces
    ])
    boundaries: dict[str, list[NDArray[Any]]] = {}
    for tag, owners in names.items():
        if len(owners) == 1:
            boundaries.setdefault(owners[0], []).append(
                gmsh.model.mesh.getElementsByType(1, tag)[1])
    points = {}
    for name, place in grid.points.items():
        key = _nearest_line(grid.x, place[0]), _nearest_line(grid.y, place[1])
        points[name] = np.searchsorted(tags, gmsh.model.mesh.getNodes(0, corners[key])[0])
    return Mesh(
        nodes,
        np.searchsorted(tags, cells).reshape(-1, size),
        {name: np.searchsorted(tags, np.concatenate(parts)).reshape(-1, 2)
         for name, parts in boundaries.items()},
        points,
    )


@contextmanager
def _gmsh_session(gmsh: Any) -> Iterator[None]:
    """An own, quiet Gmsh model that leaves nothing behind."""
    mine = not gmsh.isInitialized()
    if mine:
        # Gmsh would take SIGINT away from Python, and only the main thread may set a handler.
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
        import gmsh
    except ImportError:
        raise MissingLibraryError(
            "Gmsh, which makes the mesh, is not installed; install it with: pip install gmsh"
        ) from None
    except OSError as error:
        raise MissingLibraryError(
            f"Gmsh, which makes the mesh, lacks a library of the system ({error}); on Debian or "
            f"Ubuntu install it with: apt-get install libegl1 libgl1 libglu1-mesa libxcursor1 "
            f"libxft2 libxinerama1 libgomp1"
        ) from None
    return gmsh


def _require_few_cells(shape: Shape, grid: _Grid) -> None:
    count = _count_cells(shape, grid, shape.element_size)
    if count > MAX_CELLS:
        enough = shape.element_size * math.sqrt(count / MAX_CELLS)
        while _count_cells(shape, grid, enough) > MAX_CELLS:
            enough *= 1.1
        raise InputError(
            f"{type(shape).__name__}: element_size = {shape.element_size!r} makes {count:.3g} "
            f"elements, more than {MAX_CELLS}; take one of at least {1.1 * enough:.2g} m."
        )


def _count_cells(shape: Shape, grid: _Grid, element_size: float) -> float:
    along_x, along_y = grid.divisions(element_size)
    per_rectangle = 2 if shape.element == "triangle" else 1
    return per_rectangle * math.fsum(along_x[i] * along_y[j] for i, j, _ in grid.cells())


def _lines(first: float, last: float, *between: float) -> list[float]:
    """Sorted grid lines; those that all but coincide with an earlier argument are left out."""
    kept = [first, last]
    for value in between:
        if all(abs(value - line) > SAME * (last - first) for line in kept):
            kept.append(value)
    return sorted(kept)


def _nearest_line(lines: Sequence[float], value: float) -> int:
    return int(np.argmin(np.abs(np.subtract(lines, value))))


def _middles(lines: Sequence[float]) -> list[float]:
    return [(a + b) / 2 for a, b in pairwise(lines)]
