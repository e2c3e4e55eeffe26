"""Meshing around a round hole with structured patches."""

import math
from collections.abc import Callable
from typing import Any

from fecontact.fem.grids import Grid, Hole, nearest_line


class Rim:
    """Curves around a hole: arcs of an eighth, and lines from their ends to the rectangles'.

    Places on the rim go by their direction from the centre, (1, 0), (1, 1), (0, 1), ...
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
        """Whether the hole takes a corner of the rectangle (i, j)."""
        return i in (self.column - 1, self.column) and j in (self.row - 1, self.row)

    def side(self, i: int, j: int) -> tuple[int, int]:
        """1 for a rectangle right of the centre, and above it; else 0."""
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
