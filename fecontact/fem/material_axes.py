"""Axes of materials: constant, or cylindrical about a line; rotation of stiffness and stress."""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np

from fecontact.core.checks import as_direction, as_place
from fecontact.core.errors import InputError, require_finite, shown
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Unit

# Components in the order xx, yy, zz, xy, yz, xz.
_FIRST, _SECOND = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])
_PARALLEL = 1e-9  # sine of the angle between directions that span no plane


@dataclass(frozen=True)
class MaterialAxes:
    """Constant axes of a material.

    Axis 3 is normal to both directions, axis 2 normal to axes 3 and 1. The axes are then turned
    about one of themselves.

    Parameters
    ----------
    first : (x, y, z)
        Direction of axis 1.
    second : (x, y, z)
        A direction in the plane of axes 1 and 2, on the side of axis 2.
    about : 1, 2 or 3
        Axis about which the axes are turned.
    angle : float
        Angle of this turn by the right-hand rule [degrees].

    Raises
    ------
    InputError
        If the directions are parallel or zero, or values are not finite.
    """

    first: Coordinates = (1.0, 0.0, 0.0)
    second: Coordinates = (0.0, 1.0, 0.0)
    about: Literal[1, 2, 3] = 1
    angle: Annotated[float, Unit("degrees")] = 0.0

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            _set_direction(self, name)
        _require_turn(self)
        if not np.linalg.norm(np.cross(self.first, self.second)) > _PARALLEL:
            raise InputError(f"MaterialAxes: first = {shown(self.first)} and second = "
                             f"{shown(self.second)} span no plane; give two directions that are "
                             f"neither zero nor parallel.")

    def at(self, places: Array) -> Array:
        """Axes (1, 3, 3) as rows, the same at all places (n, 3)."""
        a, third = np.array(self.first), np.cross(self.first, self.second)
        third /= np.linalg.norm(third)
        return _turned(np.array([[a, np.cross(third, a), third]]), self.about, self.angle)

    def moved(self, turn: Array, shift: Array) -> tuple["MaterialAxes", Array]:
        """Axes of the turned or mirrored body, and the signs (3,) of its axes against these."""
        rows = self.at(np.zeros((1, 3)))[0] @ turn.T
        return MaterialAxes(_three(rows[0]), _three(rows[1])), np.array(
            [1.0, 1.0, np.sign(np.linalg.det(turn))])

    def scaled(self, scale: float) -> "MaterialAxes":
        """Axes with lengths in another unit."""
        return self


@dataclass(frozen=True)
class CylindricalAxes:
    """Axes of a material around a line: axis 1 is radial, 2 circumferential, 3 along the line.

    The axes are then turned about one of themselves. Each cell has the axes at its centre.

    Parameters
    ----------
    point : (x, y, z)
        A point of the line [m].
    direction : (x, y, z)
        Direction of the line.
    about : 1, 2 or 3
        Axis about which the axes are turned.
    angle : float
        Angle of this turn by the right-hand rule [degrees].

    Raises
    ------
    InputError
        If the direction is zero, or values are not finite.
    """

    point: Annotated[Coordinates, Unit("m")] = (0.0, 0.0, 0.0)
    direction: Coordinates = (0.0, 0.0, 1.0)
    about: Literal[1, 2, 3] = 1
    angle: Annotated[float, Unit("degrees")] = 0.0

    def __post_init__(self) -> None:
        point = as_place(self.point, "CylindricalAxes: point")
        object.__setattr__(self, "point", _three(np.array([*point, 0.0][:3])))
        _set_direction(self, "direction")
        _require_turn(self)

    def at(self, places: Array) -> Array:
        """Axes (n, 3, 3) as rows at places (n, 3).

        Raises
        ------
        InputError
            For a place on the line.
        """
        along = np.array(self.direction)
        arms = places - np.array(self.point)
        radial = arms - np.outer(arms @ along, along)
        size = np.linalg.norm(radial, axis=1, keepdims=True)
        bad = size[:, 0] <= _PARALLEL * np.linalg.norm(arms, axis=1)
        if bad.any():
            where = ", ".join(f"{x:g}" for x in places[np.flatnonzero(bad)[0]])
            raise InputError(f"CylindricalAxes: the centre of a cell, ({where}), lies on the line, "
                             f"where no direction is radial; move the line, or mesh the body "
                             f"around it.")
        radial /= size
        return _turned(np.stack([radial, np.cross(along, radial),
                                 np.broadcast_to(along, radial.shape)], axis=1),
                       self.about, self.angle)

    def moved(self, turn: Array, shift: Array) -> tuple["CylindricalAxes", Array]:
        """Axes of the turned or mirrored body, and the signs (3,) of its axes against these."""
        sign = float(np.sign(np.linalg.det(turn)))
        # A mirrored turn has the opposite sense, but about the circumferential axis.
        angle = self.angle if sign > 0.0 or self.about == 2 else -self.angle
        return replace(self, point=_three(turn @ self.point + shift), angle=angle,
                       direction=_three(turn @ self.direction)), np.array([1.0, sign, 1.0])

    def scaled(self, scale: float) -> "CylindricalAxes":
        """Axes with lengths in another unit."""
        return replace(self, point=_three(scale * np.array(self.point)))


def rotated_stiffness(stiffness: Array, axes: Array) -> Array:
    """Stiffness (n, 6, 6) in global axes of a stiffness (6, 6) in axes (n, 3, 3) given as rows."""
    to_axes = stress_rotation(axes)
    # Engineering strains: twice the tensor's components of shear.
    twice = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    strains = to_axes * twice[:, None] / twice
    turned = np.einsum("nai,ab,nbj->nij", strains, stiffness, strains)
    return np.asarray(0.5 * (turned + np.swapaxes(turned, 1, 2)))


def stress_rotation(axes: Array) -> Array:
    """Matrices (n, 6, 6) from stresses in global axes to those in axes (n, 3, 3) given as rows."""
    a, b = axes[:, _FIRST], axes[:, _SECOND]
    direct = a[:, :, _FIRST] * b[:, :, _SECOND]
    both = direct + a[:, :, _SECOND] * b[:, :, _FIRST]
    return np.asarray(np.where(_FIRST == _SECOND, direct, both))


def _turned(axes: Array, about: int, angle: float) -> Array:
    if not angle:
        return axes
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    second, third = about % 3, (about + 1) % 3
    turned = axes.copy()
    turned[:, second] = c * axes[:, second] + s * axes[:, third]
    turned[:, third] = c * axes[:, third] - s * axes[:, second]
    return turned


def _set_direction(axes: Any, name: str) -> None:
    """Set a field to the direction of unit length that it gives."""
    given = as_direction(getattr(axes, name), f"{type(axes).__name__}: {name}")
    object.__setattr__(axes, name, _three(np.array([*given, 0.0][:3])))


def _three(values: Array) -> Coordinates:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _require_turn(axes: Any) -> None:
    owner = type(axes).__name__
    if axes.about not in (1, 2, 3):
        raise InputError(f"{owner}: about = {shown(axes.about)} must be 1, 2 or 3.")
    require_finite(owner, angle=axes.angle)
