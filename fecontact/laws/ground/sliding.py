"""Prescribed sliding of the other side of an interface, beside its small vibrations."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fecontact.core.checks import as_pair, as_unit_pair, require_kind
from fecontact.core.errors import require_finite
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.ground.motion import GroundMotion


@dataclass(frozen=True)
class SlidingTranslation:
    r"""The other side of an interface slides steadily along a direction.

    .. math:: V_{tj} = V(t)\, t_j \cdot e

    with the tangent t_j of each contact node; the slip velocity is measured against it.

    Parameters
    ----------
    speed : float
        V [m/s].
    direction : (x, y)
        e, of any length above zero; stored with length one.
    motion : GroundMotion, optional
        Time-dependent speed; by default the constant V.

    Raises
    ------
    InputError
        For values that are not finite, or a direction of length zero.
    """

    speed: Annotated[float, Unit("m/s")]
    direction: tuple[float, float] = (1.0, 0.0)
    motion: GroundMotion | None = None

    def __post_init__(self) -> None:
        _check("SlidingTranslation", self.speed, self.motion)
        object.__setattr__(self, "direction", as_unit_pair(
            self.direction, "SlidingTranslation: direction"))

    def along(self, places: Array, tangents: Array) -> Array:
        """V_tj / V (n,) at places (n, 2) with tangents (n, 2)."""
        return np.asarray(tangents @ np.array(self.direction))


@dataclass(frozen=True)
class SlidingRotation:
    r"""The other side of an interface turns steadily about a point, as a shaft in a bush does.

    .. math:: V_{tj} = \Omega(t)\, t_j \cdot (e_z \times (r_j - c))

    at the places r_j of the contact nodes. Gyroscopic and convective terms of the turning body are
    left out: valid far below its critical speeds.

    Parameters
    ----------
    speed : float
        Omega, positive counter-clockwise [rad/s].
    centre : (x, y)
        c [m].
    motion : GroundMotion, optional
        Time-dependent speed, with its speeds in rad/s; by default the constant Omega.

    Raises
    ------
    InputError
        For values that are not finite.
    """

    speed: Annotated[float, Unit("rad/s")]
    centre: Annotated[tuple[float, float], Unit("m")] = (0.0, 0.0)
    motion: GroundMotion | None = None

    def __post_init__(self) -> None:
        _check("SlidingRotation", self.speed, self.motion)
        object.__setattr__(self, "centre", as_pair(self.centre, "SlidingRotation: centre"))

    def along(self, places: Array, tangents: Array) -> Array:
        """V_tj / Omega (n,) [m] at places (n, 2) with tangents (n, 2)."""
        x, y = (places - np.array(self.centre)).T
        return np.asarray(tangents[:, 1] * x - tangents[:, 0] * y)


Sliding = SlidingTranslation | SlidingRotation


def _check(owner: str, speed: float, motion: GroundMotion | None) -> None:
    require_finite(owner, speed=speed)
    require_kind(owner, (GroundMotion, type(None)), motion=motion)
