"""Gap between the undeformed contact face and flat ground."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fecontact.core.checks import as_floats, as_pair, is_numeric
from fecontact.core.errors import (
    FecontactError,
    InputError,
    require_finite,
    require_not_negative,
    require_positive,
    shown,
)
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.ground.height_map import HeightMap


@dataclass(frozen=True)
class Crown:
    """Gap below a face that is an arc of a circle, or a part of a sphere, bulging to the ground.

    ``g = R - sqrt(R^2 - r^2)`` with ``r = |x - centre|``, of solids the distance of (x, y) from the
    centre, exactly: a mesh with edges of length h would deviate by h^2 / (8 R), easily as much as
    the roughness.

    Parameters
    ----------
    radius : float
        Radius R of the arc, positive [m].
    centre : float, of solids (float, float)
        Place of the lowest point [m]: x of a plane body; x and y of a solid, or x alone with y = 0.

    Raises
    ------
    InputError
        For a radius that is not positive or, on use, is exceeded by a contact node; for a centre
        that is not one or two finite numbers, or two for a plane body.
    """

    radius: Annotated[float, Unit("m")]
    centre: Annotated[float | tuple[float, float], Unit("m")] = 0.0

    def __post_init__(self) -> None:
        require_positive("Crown", radius=self.radius)
        if isinstance(self.centre, int | float):
            require_finite("Crown", centre=self.centre)
        else:
            object.__setattr__(self, "centre", as_pair(self.centre, "Crown: centre"))

    def __call__(self, x: Array, y: Array | None = None) -> Array:
        """Gap [m] at abscissae x, of solids at x and y [m]; InputError beyond the circle."""
        if isinstance(self.centre, tuple):
            if y is None:
                raise InputError(f"Crown: centre = {self.centre!r} is that of a solid; give a "
                                 f"plane body one number, the abscissa of its lowest point.")
            centre = self.centre
        else:
            centre = (self.centre, 0.0)
        away = np.asarray(x, dtype=float) - centre[0]
        if y is not None:
            away = np.hypot(away, np.asarray(y, dtype=float) - centre[1])
        if (np.abs(away) > self.radius).any():
            raise InputError(f"Crown: radius = {self.radius!r} must be at least "
                             f"{np.abs(away).max():g}, the distance of the farthest contact node "
                             f"from centre = {self.centre!r}.")
        return np.asarray(away**2 / (self.radius + np.sqrt(self.radius**2 - away**2)))


Gap = float | Sequence[float] | Crown | HeightMap | Callable[..., Array]


# Heights of a face that differ by less than this part of its extent are those of a flat one.
_FLAT = 1e-9


def _of_face(places: Array) -> float | Array:
    """Heights (n,) of the places (n, d) of contact nodes above the lowest one; 0 if it is flat."""
    if not places.size:
        return 0.0
    above = places[:, -1] - places[:, -1].min()
    return above if above.max() > _FLAT * np.ptp(places, axis=0).max() else 0.0


def _below(heights: HeightMap, places: Array) -> Array:
    """Distance (n,) of measured heights at places (n, 3) from the highest of them [m].

    They lie on the bicubic spline through the points, which does not repeat itself here.
    """
    from scipy.interpolate import RectBivariateSpline

    if places.ndim != 2 or places.shape[1] != 3:
        raise InputError("gap: a HeightMap is over x and y of solids; give a plane body one gap "
                         "for each contact node.")
    grid = np.array(heights.heights)
    lines = [origin + step * np.arange(count) for origin, step, count in zip(
        (heights.origin_x, heights.origin_y), (heights.spacing_x, heights.spacing_y), grid.shape,
        strict=True)]
    for axis, line, at in zip("xy", lines, places.T, strict=False):
        beyond = 0.5 * (line[1] - line[0])
        if at.min() < line[0] - beyond or at.max() > line[-1] + beyond:
            raise InputError(f"gap: the HeightMap reaches from {line[0]:g} to {line[-1]:g} m in "
                             f"{axis}, but contact nodes lie from {at.min():g} to {at.max():g} m; "
                             f"measure all of the face, or shift the map by origin_{axis}.")
    z = RectBivariateSpline(*lines, grid)(places[:, 0], places[:, 1], grid=False)
    return np.asarray(z.max() - z)


def gap_values(gap: Gap | None, places: Array) -> float | tuple[float, ...]:
    """One gap for all contact nodes, or one for each.

    ``places`` (n, d) are those of the nodes, or (n,) their abscissae. None stands for the heights
    of places above the lowest one, which touches the ground. Functions take x (n,), of
    solids x and y. A HeightMap holds heights of the surface of a solid out of it, which move with
    the body; the highest contact node has the gap zero. InputError for a wrong number of values, or
    a value that is negative or not finite.
    """
    if gap is None:
        gap = np.asarray(_of_face(places)).tolist()
    if isinstance(gap, HeightMap):
        gap = _below(gap, places).tolist()
    at = (places,) if places.ndim == 1 else tuple(places.T[:-1])
    names = "x and y" if len(at) == 2 else "x"
    try:
        given = gap(*at) if callable(gap) else gap
    except FecontactError:
        raise
    except Exception as error:
        where, taken = (("abscissae", "an array (n,)") if len(at) == 1 else
                        ("places", "two arrays (n,)"))
        raise InputError(f"gap: the function of {names} fails for the {where} of the contact nodes "
                         f"({type(error).__name__}: {error}); it must take {taken} and give "
                         f"as many gaps.") from None
    if not is_numeric(given):
        raise InputError(f"gap = {shown(given)} must be a number, one per contact node, or a "
                         f"function of {names}.")
    values = as_floats(given, "gap")
    if values.shape not in ((), (len(places),)):
        raise InputError(f"gap has {values.size} values for {len(places)} contact nodes; give "
                         f"one number, one per node, or a function of {names}.")
    if not np.isfinite(values).all() or (values < 0.0).any():
        raise InputError(f"gap = {values.min() if values.size else values} must be finite and "
                         f"zero or above.")
    require_not_negative("gap", gap=float(values.max(initial=0.0)))
    return tuple(values.tolist()) if values.ndim else float(values)
