"""Bodies of rectangles as grids of lines with names, for the mesh generator."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.fem.shapes import SAME, Beam, Block, Pendulum, Shape


@dataclass(frozen=True)
class Grid:
    """Lines that cut the plane into rectangles, which of these are filled, and the names.

    ``part(x, y)`` is the name of the part of the body around a point, or None outside;
    ``side(part, facing, x)`` names the outline of a rectangle of that part with its middle at x.
    """

    x: list[float]
    y: list[float]
    part: Callable[[float, float], str | None]
    side: Callable[[str, str, float], str]
    points: dict[str, tuple[float, float]]
    hole: "Hole | None" = None

    def cells(self) -> Iterator[tuple[int, int, str]]:
        """Column, row and part of each filled rectangle."""
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


@dataclass(frozen=True)
class Hole:
    """A round hole, named as a boundary, about a crossing of grid lines.

    Of each of the four rectangles around it, what is left is cut into two along its diagonal.
    """

    name: str
    centre: tuple[float, float]
    radius: float


def grid_of(shape: Shape) -> Grid:
    """Grid of a shape."""
    match shape:
        case Beam():
            return Grid(
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

            return Grid(
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

            start = -half_arm if shape.hinge_radius else 0.0
            points = {"B": (drive, middle), "C": (length, shape.bob_height)}
            hole = None
            if shape.hinge_radius:
                hole = Hole("pivot", (0.0, middle), shape.hinge_radius)
            else:
                points["pivot"] = (0.0, middle)
            reach = half_width if shape.contact_length is None else shape.contact_length / 2

            def part_of_pendulum(x: float, y: float) -> str | None:
                if x > length - half_width:
                    return "bob"
                return "arm" if abs(y - middle) < half_arm else None

            def side_of_pendulum(part: str, facing: str, x: float) -> str:
                touches = (part, facing) == ("bob", "bottom") and abs(x - length) < reach
                return "contact" if touches else f"{part}_{facing}"

            return Grid(
                _lines(start, length + half_width, length - half_width, length, drive,
                       length - reach, length + reach, *((0.0, half_arm) if hole else ())),
                _lines(0.0, shape.bob_height, middle, middle - half_arm, middle + half_arm),
                part_of_pendulum,
                side_of_pendulum,
                points,
                hole,
            )


def _lines(first: float, last: float, *between: float) -> list[float]:
    """Sorted grid lines; those that all but coincide with an earlier argument are left out."""
    kept = [first, last]
    for value in between:
        if all(abs(value - line) > SAME * (last - first) for line in kept):
            kept.append(value)
    return sorted(kept)


def nearest_line(lines: Sequence[float], value: float) -> int:
    """Index of the line nearest to a value."""
    return int(np.argmin(np.abs(np.subtract(lines, value))))


def _middles(lines: Sequence[float]) -> list[float]:
    return [(a + b) / 2 for a, b in pairwise(lines)]
