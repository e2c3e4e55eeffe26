"""Meshes of rectangles, in rows and columns of cells."""

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.mesh import Mesh
from fecontact.fem.shapes import Grid, nearest_line


def mesh_of_rectangles(grid: Grid, element_size: float, element: str) -> Mesh:
    """Mesh of a grid without a hole: each rectangle has equal cells of about the element size.

    Triangles halve the cells of quadrilaterals by diagonals that alternate like a chessboard.
    """
    counts_x, counts_y = (counts.astype(np.int64) for counts in grid.divisions(element_size))
    x, y = _divided(grid.x, counts_x), _divided(grid.y, counts_y)
    first_x, first_y = (np.concatenate([[0], np.cumsum(counts)]) for counts in (counts_x, counts_y))

    def numbers(i: Integers, j: Integers) -> Integers:
        """Node at each crossing of columns and rows of cells."""
        return np.asarray(i * len(y) + j)

    def edges(direction: str, i: int, j: int) -> Integers:
        """Nodes (k, 2) of the edges along a side of a rectangle, in the direction of its axis."""
        if direction == "x":
            line = numbers(np.arange(first_x[i], first_x[i + 1] + 1), first_y[j])
        else:
            line = numbers(first_x[i], np.arange(first_y[j], first_y[j + 1] + 1))
        return np.stack([line[:-1], line[1:]], axis=1)

    cells: list[Integers] = []
    sides: dict[tuple[str, int, int], list[str]] = {}
    for i, j, part in grid.cells():
        columns, rows = (one.ravel() for one in np.meshgrid(
            np.arange(counts_x[i]), np.arange(counts_y[j]), indexing="ij"))
        at, up = first_x[i] + columns, first_y[j] + rows
        corners = np.stack([numbers(at, up), numbers(at + 1, up), numbers(at + 1, up + 1),
                            numbers(at, up + 1)], axis=1)
        cells.append(corners if element == "quadrilateral" else _halved(
            corners, (columns + rows) % 2 == 0))
        middle = (grid.x[i] + grid.x[i + 1]) / 2
        for key, facing in ((("x", i, j), "bottom"), (("y", i + 1, j), "right"),
                            (("x", i, j + 1), "top"), (("y", i, j), "left")):
            sides.setdefault(key, []).append(grid.side(part, facing, middle))
    # Crossings outside the body are no nodes.
    used, of_cells = np.unique(np.concatenate(cells), return_inverse=True)
    boundaries: dict[str, list[Integers]] = {}
    for key, owners in sides.items():
        if len(owners) == 1:
            boundaries.setdefault(owners[0], []).append(edges(*key))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return Mesh(
        places[used], of_cells.reshape(-1, cells[0].shape[1]),
        {name: np.searchsorted(used, np.concatenate(parts)) for name, parts in boundaries.items()},
        {name: np.searchsorted(used, numbers(first_x[nearest_line(grid.x, place[0])],
                                             first_y[nearest_line(grid.y, place[1])])[None])
         for name, place in grid.points.items()})


def _divided(lines: list[float], counts: Integers) -> Array:
    """Places of the lines of cells between grid lines."""
    parts = [np.linspace(low, high, count, endpoint=False)
             for low, high, count in zip(lines, lines[1:], counts.tolist(), strict=False)]
    return np.append(np.concatenate(parts), lines[-1])


def _halved(corners: Integers, rising: Array) -> Integers:
    """Triangles of cells (k, 4), cut from the lower left corner up where ``rising``."""
    a, b, c, d = corners.T
    first = np.where(rising[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(rising[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.stack([first, second], axis=1).reshape(-1, 3)
