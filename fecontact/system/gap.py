"""Gap between the undeformed contact face and flat ground."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fecontact.core.checks import as_floats, is_numeric
from fecontact.core.errors import (
    FecontactError,
    InputError,
    require_finite,
    require_positive,
    shown,
)
from fecontact.core.types import Array
from fecontact.core.units import Unit


@dataclass(frozen=True)
class Crown:
    """Gap below a face that is an arc of a circle, bulging towards the ground.

    ``g(x) = R - sqrt(R^2 - (x - centre)^2)``, exactly: a mesh with edges of length h would deviate
    by h^2 / (8 R), easily as much as the roughness.

    Parameters
    ----------
    radius : float
        R, positive [m].
    centre : float
        Abscissa of the lowest point [m].

    Raises
    ------
    InputError
        For a radius that is not positive or, on use, is exceeded by a contact node.
    """

    radius: Annotated[float, Unit("m")]
    centre: Annotated[float, Unit("m")] = 0.0

    def __post_init__(self) -> None:
        require_positive("Crown", radius=self.radius)
        require_finite("Crown", centre=self.centre)

    def __call__(self, x: Array) -> Array:
        """Gap [m] at abscissae x [m]; InputError beyond the circle."""
        away = np.asarray(x, dtype=float) - self.centre
        if (np.abs(away) > self.radius).any():
            raise InputError(f"Crown: radius = {self.radius!r} must be at least "
                             f"{np.abs(away).max():g}, the distance of the farthest contact node "
                             f"from centre = {self.centre!r}.")
        return np.asarray(away**2 / (self.radius + np.sqrt(self.radius**2 - away**2)))


Gap = float | Sequence[float] | Crown | Callable[[Array], Array]


def gap_values(gap: Gap, abscissae: Array) -> float | tuple[float, ...]:
    """One gap for all contact nodes, or one for each.

    Raises
    ------
    InputError
        For a wrong number of values, or a value that is negative or not finite.
    """
    try:
        given = gap(abscissae) if callable(gap) else gap
    except FecontactError:
        raise
    except Exception as error:
        raise InputError(f"gap: the function of x fails for the abscissae of the contact nodes "
                         f"({type(error).__name__}: {error}); it must take an array (n,) and give "
                         f"as many gaps.") from None
    if not is_numeric(given):
        raise InputError(f"gap = {shown(given)} must be a number, one per contact node, or a "
                         f"function of x.")
    values = as_floats(given, "gap")
    if values.shape not in ((), abscissae.shape):
        raise InputError(f"gap has {values.size} values for {abscissae.size} contact nodes; give "
                         f"one number, one per node, or a function of x.")
    if not np.isfinite(values).all() or (values < 0.0).any():
        raise InputError(f"gap = {values.min() if values.size else values} must be finite and "
                         f"zero or above.")
    return tuple(values.tolist()) if values.ndim else float(values)
