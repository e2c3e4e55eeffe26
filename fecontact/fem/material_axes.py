"""Axes of materials: constant, about a line, along a curve, by a field; rotation of stiffness."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np

from fecontact.core.checks import as_direction, as_floats, as_place
from fecontact.core.errors import InputError, require_finite, shown
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Unit

# Components in the order xx, yy, zz, xy, yz, xz.
_FIRST, _SECOND = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])
_PARALLEL = 1e-9  # sine of the angle between directions that span no plane
_SAMPLES = 32  # of a curve between two of its points, where the search of the closest place starts
_STEPS = 20
_FLAT = 1e-2  # distance to a centre of curvature, relative to the radius, that counts as none


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
        return _turned(_spanned(np.array([self.first]), np.array([self.second])), self.about,
                       self.angle)

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


@dataclass(frozen=True)
class CurveAxes:
    """Axes of a material along a curve, such as fibres that follow the edge of a part.

    Axis 1 is the tangent t of the curve at its place closest to the centre of each cell, axis 2 is
    ``third x t`` over its length, axis 3 completes them by the right-hand rule. The curve is the
    cubic spline through the points over the length of its chords, a line through two points, and
    closed if the last point is the first one. The axes are then turned about one of themselves.

    Parameters
    ----------
    points : two or more (x, y, z)
        Points of the curve in their order [m]; axis 1 leads from the first one to the last.
    third : (x, y, z)
        A direction in the plane of axes 1 and 3, on the side of axis 3.
    about : 1, 2 or 3
        Axis about which the axes are turned.
    angle : float
        Angle of this turn by the right-hand rule [degrees].

    Raises
    ------
    InputError
        For fewer than two points, successive ones at one place, or values that are not finite.
    """

    points: Annotated[tuple[Coordinates, ...], Unit("m")] = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    third: Coordinates = (0.0, 0.0, 1.0)
    about: Literal[1, 2, 3] = 1
    angle: Annotated[float, Unit("degrees")] = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.points, Sequence | np.ndarray) or len(self.points) < 2:
            raise InputError(f"CurveAxes: points = {shown(self.points)} must be two or more places "
                             f"along the curve.")
        places = [[*as_place(one, "CurveAxes: points"), 0.0][:3] for one in self.points]
        chords = np.linalg.norm(np.diff(places, axis=0), axis=1)
        if not (chords > 0.0).all():
            raise InputError(f"CurveAxes: points {int(np.argmin(chords)) + 1} and "
                             f"{int(np.argmin(chords)) + 2} lie at one place, "
                             f"{shown(places[int(np.argmin(chords))])}; leave one of them out.")
        object.__setattr__(self, "points", tuple(_three(np.array(one)) for one in places))
        _set_direction(self, "third")
        _require_turn(self)

    @cached_property
    def _curve(self) -> Any:
        """Spline of the place over the sum of the chords."""
        from scipy.interpolate import CubicSpline

        places = np.array(self.points)
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
        closed = len(places) > 3 and self.points[0] == self.points[-1]
        return CubicSpline(along, places, bc_type="periodic" if closed else "not-a-knot")

    def at(self, places: Array) -> Array:
        """Axes (n, 3, 3) as rows at places (n, 3).

        Raises
        ------
        InputError
            For a place at a centre of curvature, from which all places of an arc are equally far,
            and where the curve is parallel to ``third``.
        """
        tangent = self._curve(self._closest(places), 1)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        second = np.cross(np.array(self.third), tangent)
        size = np.linalg.norm(second, axis=1, keepdims=True)
        self._require(size[:, 0] > _PARALLEL, places, f"the curve is parallel to third = "
                      f"{shown(self.third)}; give another direction")
        second /= size
        return _turned(np.stack([tangent, second, np.cross(tangent, second)], axis=1),
                       self.about, self.angle)

    def _closest(self, places: Array) -> Array:
        """Parameters (n,) of the places of the curve that are closest to given ones (n, 3)."""
        from scipy.spatial import KDTree

        curve, knots = self._curve, self._curve.x
        samples = np.append(np.linspace(knots[:-1], knots[1:], _SAMPLES, endpoint=False).T.ravel(),
                            knots[-1])
        at = np.asarray(KDTree(curve(samples)).query(places)[1])
        found = samples[at]
        if curve.extrapolate == "periodic":
            step = np.diff(samples).max()
            low, high = found - step, found + step
        else:
            low, high = samples[np.maximum(at - 1, 0)], samples[np.minimum(at + 1,
                                                                           len(samples) - 1)]
        for _ in range(_STEPS):
            slope, off = curve(found, 1), curve(found) - places
            size = (slope**2).sum(axis=1)
            # Half the second derivative of the squared distance, positive at a minimum.
            bend = size + (off * curve(found, 2)).sum(axis=1)
            step = (off * slope).sum(axis=1) / np.maximum(bend, _FLAT * size)
            before, found = found, np.clip(found - step, low, high)
            if np.abs(found - before).max(initial=0.0) <= 1e-14 * knots[-1]:
                break
        at_end = (curve.extrapolate != "periodic") & np.isin(found, knots[[0, -1]])
        self._require(at_end | (bend > _FLAT * size), places, "a whole arc of the curve is equally "
                      "close; mesh the body so that no centre of a cell lies at a centre of "
                      "curvature")
        return np.asarray(found)

    def _require(self, good: Any, places: Array, what: str) -> None:
        if not good.all():
            where = ", ".join(f"{x:g}" for x in places[np.flatnonzero(~good)[0]])
            raise InputError(f"CurveAxes: for the centre of a cell, ({where}), {what}.")

    def moved(self, turn: Array, shift: Array) -> tuple["CurveAxes", Array]:
        """Axes of the turned or mirrored body, and the signs (3,) of its axes against these."""
        sign = float(np.sign(np.linalg.det(turn)))
        # ``third`` keeps its side; axis 2 is then the image of axis 2 for the opposite sign.
        angle = self.angle if sign > 0.0 or self.about == 2 else -self.angle
        return replace(self, points=tuple(_three(turn @ one + shift) for one in np.array(
            self.points)), third=_three(turn @ self.third), angle=angle), np.array(
                [1.0, sign, 1.0])

    def scaled(self, scale: float) -> "CurveAxes":
        """Axes with lengths in another unit."""
        return replace(self, points=tuple(_three(scale * np.array(one)) for one in self.points))


@dataclass(frozen=True)
class FieldAxes:
    """Axes of a material by a field, such as fibres of a draping or moulding simulation.

    Each cell has the axes given at the place closest to its centre: axis 3 is normal to both of its
    directions, axis 2 normal to axes 3 and 1. The axes are then turned about one of themselves.

    Parameters
    ----------
    places : n (x, y, z)
        Distinct places [m].
    along : n (x, y, z)
        Direction of axis 1 at each of them.
    across : n (x, y, z)
        A direction in the plane of axes 1 and 2 there, on the side of axis 2.
    about : 1, 2 or 3
        Axis about which the axes are turned.
    angle : float
        Angle of this turn by the right-hand rule [degrees].

    Raises
    ------
    InputError
        For other numbers of directions than of places, a place that is given twice, directions that
        are parallel or zero, and values that are not finite.
    """

    places: Annotated[tuple[Coordinates, ...], Unit("m")] = ((0.0, 0.0, 0.0),)
    along: tuple[Coordinates, ...] = ((1.0, 0.0, 0.0),)
    across: tuple[Coordinates, ...] = ((0.0, 1.0, 0.0),)
    about: Literal[1, 2, 3] = 1
    angle: Annotated[float, Unit("degrees")] = 0.0

    def __post_init__(self) -> None:
        count = len(as_floats(self.places, "FieldAxes: places"))
        for name in ("places", "along", "across"):
            given = as_floats(getattr(self, name), f"FieldAxes: {name}")
            if given.ndim != 2 or given.shape[1] not in (2, 3) or len(given) != count or not (
                    count and np.isfinite(given).all()):
                raise InputError(f"FieldAxes: {name} must be {max(count, 1)} finite places or "
                                 f"directions of three numbers, as many as places, not an array of "
                                 f"shape {given.shape}.")
            flat = np.pad(given, ((0, 0), (0, 3 - given.shape[1])))
            object.__setattr__(self, name, tuple(map(tuple, flat.tolist())))
        places, along, across = (np.array(one) for one in (self.places, self.along, self.across))
        if len(np.unique(places, axis=0)) < count:
            raise InputError("FieldAxes: places holds one place twice; give each place once.")
        sizes = np.linalg.norm(along, axis=1) * np.linalg.norm(across, axis=1)
        flat = np.linalg.norm(np.cross(along, across), axis=1) <= _PARALLEL * sizes
        if flat.any():
            first = int(np.flatnonzero(flat)[0])
            raise InputError(f"FieldAxes: along = {shown(self.along[first])} and across = "
                             f"{shown(self.across[first])} of place {first + 1} span no plane; "
                             f"give two directions that are neither zero nor parallel.")
        _require_turn(self)

    @cached_property
    def _given(self) -> tuple[Any, Array]:
        """Search tree of the places, and axes (m, 3, 3) there."""
        from scipy.spatial import KDTree

        return KDTree(np.array(self.places)), _turned(
            _spanned(np.array(self.along), np.array(self.across)), self.about, self.angle)

    def at(self, places: Array) -> Array:
        """Axes (n, 3, 3) as rows at places (n, 3)."""
        tree, axes = self._given
        return np.asarray(axes[tree.query(places)[1]])

    def moved(self, turn: Array, shift: Array) -> tuple["FieldAxes", Array]:
        """Axes of the turned or mirrored body, and the signs (3,) of its axes against these."""
        rows = self._given[1] @ turn.T
        return FieldAxes(
            _places(np.array(self.places) @ turn.T + shift), _places(rows[:, 0]),
            _places(rows[:, 1])), np.array([1.0, 1.0, np.sign(np.linalg.det(turn))])

    def scaled(self, scale: float) -> "FieldAxes":
        """Axes with lengths in another unit."""
        return replace(self, places=_places(scale * np.array(self.places)))


AnyAxes = MaterialAxes | CylindricalAxes | CurveAxes | FieldAxes


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


def _spanned(first: Array, second: Array) -> Array:
    """Axes (n, 3, 3) by rows: along the first directions (n, 3), in the plane with the second."""
    first = first / np.linalg.norm(first, axis=1, keepdims=True)
    third = np.cross(first, second)
    third /= np.linalg.norm(third, axis=1, keepdims=True)
    return np.stack([first, np.cross(third, first), third], axis=1)


def _places(values: Array) -> tuple[Coordinates, ...]:
    return tuple(_three(one) for one in values)


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
