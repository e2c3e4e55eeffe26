"""Plane bodies made of rectangles, described by their dimensions.

The contact face is the bottom of the body, at y = 0; the ground lies below it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np

from fecontact.core.errors import InputError, choices, require_not_negative, require_positive
from fecontact.core.types import Array
from fecontact.core.units import Unit

Element = Literal["quadrilateral", "triangle"]

SAME = 1e-9  # relative to the body's size: lengths that differ by less are equal


@dataclass(frozen=True)
class Beam:
    """A rectangle [0, length] x [0, height] whose whole bottom is the contact face.

    Boundaries ``contact`` (bottom), ``left``, ``right``, ``top``; points ``B`` (left end,
    mid-height) and ``C`` (top, mid-span).

    Parameters
    ----------
    length, height : float
        Sides along x and y [m].
    element_size : float
        Longest side of a quadrilateral, and of the legs of a (right-angled) triangle [m].
    element : "quadrilateral" or "triangle"

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, or another element.
    """

    length: Annotated[float, Unit("m")] = 0.2
    height: Annotated[float, Unit("m")] = 0.02
    element_size: Annotated[float, Unit("m")] = 0.005
    element: Element = "quadrilateral"

    def __post_init__(self) -> None:
        require_positive("Beam", length=self.length, height=self.height,
                         element_size=self.element_size)
        _require_element("Beam", self.element)


@dataclass(frozen=True)
class Block:
    """A rectangle [0, width] x [0, height] with part of its bottom as contact face.

    Boundaries ``contact`` (centred part of the bottom), ``bottom`` (the rest of it, if any),
    ``left``, ``right``, ``top``; points ``B`` (left side, at ``drive_height``) and ``C`` (top,
    middle). The default, of steel and 0.1 m thick, has the mass of the friction oscillator, 5.6 kg.
    A dragged block tips over if ``contact_length`` is below twice the friction coefficient times
    ``drive_height``.

    Parameters
    ----------
    width, height : float
        Sides along x and y [m].
    contact_length : float or None
        Length of the contact face [m]; None for the whole bottom.
    drive_height : float or None
        Height of B above the ground [m]; None for mid-height.
    element_size : float
        Longest side of a quadrilateral, and of the legs of a (right-angled) triangle [m].
    element : "quadrilateral" or "triangle"

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, a contact face longer than the
        block, a drive above its top, or another element.
    """

    width: Annotated[float, Unit("m")] = 0.12
    height: Annotated[float, Unit("m")] = 0.06
    contact_length: Annotated[float | None, Unit("m")] = None
    drive_height: Annotated[float | None, Unit("m")] = None
    element_size: Annotated[float, Unit("m")] = 0.005
    element: Element = "quadrilateral"

    def __post_init__(self) -> None:
        require_positive("Block", width=self.width, height=self.height,
                         element_size=self.element_size)
        if self.contact_length is not None:
            require_positive("Block", contact_length=self.contact_length)
            _require_at_most("Block", "contact_length", self.contact_length, "width", self.width)
        if self.drive_height is not None:
            require_not_negative("Block", drive_height=self.drive_height)
            _require_at_most("Block", "drive_height", self.drive_height, "height", self.height)
        _require_element("Block", self.element)


@dataclass(frozen=True)
class Pendulum:
    """A horizontal arm, hinged at its left end, with a rectangular bob at its right end.

    The arm runs along x from the hinge at x = 0; the bob is centred on the arm's end,
    x = ``arm_length``, and extends from y = 0 to ``bob_height``. The mid-line of the arm is at
    y = ``bob_height`` / 2.

    Boundaries ``contact`` (bottom of the bob), ``bob_top``, ``bob_left`` (above and below the
    arm), ``bob_right``, ``arm_top``, ``arm_bottom``, ``arm_left``; points ``pivot`` (the hinge),
    ``B`` (on the mid-line, ``drive_distance`` from the hinge) and ``C`` (top of the bob, middle).
    With a ``hinge_radius`` the arm extends half its height beyond the hinge, and ``pivot`` is the
    boundary of a hole, to be supported as a 'hinge'. With a ``contact_length`` the rest of the
    bob's bottom is ``bob_bottom``.

    The default is the aluminium pendulum of the impact oscillator: an arm of 0.30 m x 7.7 mm, of
    0.122 kg at a thickness of 19.6 mm and 2700 kg/m^3. The square bob adds 0.051 kg to the end of
    the arm (area bob_width bob_height - bob_width arm_height / 2), so that the mass reduced to the
    contact is 0.122 kg / 3 + 0.051 kg = 0.092 kg.

    Parameters
    ----------
    arm_length, arm_height : float
        Distance from the hinge to the middle of the bob, and depth of the arm [m].
    bob_width, bob_height : float
        Sides of the bob along x and y [m].
    drive_distance : float or None
        Distance of B from the hinge [m]; None for ``arm_length``.
    hinge_radius : float
        Radius of the hole at the hinge, below half of ``arm_height``; zero for none [m].
    contact_length : float or None
        Length of the contact face, centred on the bob's bottom [m]; None for the whole bottom.
    element_size : float
        Longest side of a quadrilateral, and of the legs of a (right-angled) triangle [m].
    element : "quadrilateral" or "triangle"

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, a bob that is not higher than the arm or
        reaches the hinge, a drive beyond the bob, a contact longer than it, or another element.
    """

    arm_length: Annotated[float, Unit("m")] = 0.3
    arm_height: Annotated[float, Unit("m")] = 0.0077
    bob_width: Annotated[float, Unit("m")] = 0.033
    bob_height: Annotated[float, Unit("m")] = 0.033
    drive_distance: Annotated[float | None, Unit("m")] = None
    hinge_radius: Annotated[float, Unit("m")] = 0.0
    contact_length: Annotated[float | None, Unit("m")] = None
    element_size: Annotated[float, Unit("m")] = 0.004
    element: Element = "quadrilateral"

    def __post_init__(self) -> None:
        require_positive("Pendulum", arm_length=self.arm_length, arm_height=self.arm_height,
                         bob_width=self.bob_width, bob_height=self.bob_height,
                         element_size=self.element_size)
        require_not_negative("Pendulum", hinge_radius=self.hinge_radius)
        if self.hinge_radius >= 0.5 * self.arm_height * (1 - SAME):
            raise InputError(f"Pendulum: hinge_radius = {self.hinge_radius!r} must be below half "
                             f"of arm_height = {self.arm_height!r}.")
        if self.bob_height <= self.arm_height * (1 + SAME):
            raise InputError(f"Pendulum: bob_height = {self.bob_height!r} must be above arm_height "
                             f"= {self.arm_height!r}.")
        if self.bob_width >= 2 * self.arm_length * (1 - SAME):
            raise InputError(f"Pendulum: bob_width = {self.bob_width!r} must be below twice "
                             f"arm_length = {self.arm_length!r}, or the bob reaches the hinge.")
        if self.contact_length is not None:
            require_positive("Pendulum", contact_length=self.contact_length)
            _require_at_most("Pendulum", "contact_length", self.contact_length, "bob_width",
                             self.bob_width)
        if self.drive_distance is not None:
            require_positive("Pendulum", drive_distance=self.drive_distance)
            _require_at_most("Pendulum", "drive_distance", self.drive_distance,
                             "arm_length + bob_width / 2", self.arm_length + self.bob_width / 2)
        _require_element("Pendulum", self.element)


Shape = Beam | Block | Pendulum


def _require_element(owner: str, element: str) -> None:
    allowed = ("quadrilateral", "triangle")
    if element not in allowed:
        raise InputError(f"{owner}: element = {element!r} must be one of "
                         f"{choices(allowed)}.")


def _require_at_most(owner: str, name: str, value: float, limit_name: str, limit: float) -> None:
    if value > limit * (1 + SAME):
        raise InputError(f"{owner}: {name} = {value!r} must not be above {limit_name} = {limit!r}.")


@dataclass(frozen=True)
class Grid:
    """Grid lines, the rectangles between them that are filled, and their names.

    ``part(x, y)`` is the name of the part of the body at a point, or None outside;
    ``side(part, facing, x)`` names a side, centred at x, of a rectangle of that part.
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

    def divisions(self, element_size: float) -> tuple[Array, Array]:
        """Number of elements in each interval of the grid lines in x and y."""
        x, y = (np.clip(np.ceil(np.diff(lines) / max(element_size, 1e-99) - 1e-6), 1.0, 1e99)
                for lines in (self.x, self.y))
        return x, y


@dataclass(frozen=True)
class Hole:
    """A round hole, named as a boundary, centred at a crossing of grid lines.

    The rest of each of the four rectangles around it is cut into two along its diagonal.
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
    """Sorted grid lines without those that nearly coincide with an earlier argument."""
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
