"""Prescribed sliding of the other side of an interface, beside its small vibrations."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fecontact.core.checks import as_direction, as_place, require_kind
from fecontact.core.errors import InputError, require_finite, shown
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.ground.motion import GroundMotion


@dataclass(frozen=True)
class SlidingTranslation:
    r"""The other side of an interface slides steadily along a direction.

    .. math:: V_{tj} = V(t)\, t_j \cdot e

    with the tangent t_j of each contact node, in space both of its tangents; the slip velocity is
    measured against it.

    Parameters
    ----------
    speed : float
        Speed V [m/s].
    direction : (x, y) or (x, y, z)
        e, of any length above zero; stored with length one. Of solids +x by default too.
    motion : GroundMotion, optional
        Time-dependent speed; by default the constant V.

    Raises
    ------
    InputError
        For values that are not finite, or a direction of length zero.
    """

    speed: Annotated[float, Unit("m/s")]
    direction: tuple[float, ...] = (1.0, 0.0)
    motion: GroundMotion | None = None

    def __post_init__(self) -> None:
        _check("SlidingTranslation", self.speed, self.motion)
        object.__setattr__(self, "direction", as_direction(
            self.direction, "SlidingTranslation: direction"))

    def along(self, places: Array, tangents: Array) -> Array:
        """V_tj / V (n,) at places (n, 2) with tangents (n, 2); (n, 2) in space, (n, 2, 3)."""
        direction = self.direction
        if len(direction) < tangents.shape[-1]:
            direction = (*direction, 0.0)
        _require_dimension("SlidingTranslation: direction", direction, tangents)
        return np.asarray(tangents @ np.array(direction))


@dataclass(frozen=True)
class SlidingRotation:
    r"""The other side of an interface turns steadily about a point, as a shaft in a bush does.

    .. math:: V_{tj} = \Omega(t)\, t_j \cdot (e \times (r_j - c))

    at the places r_j of the contact nodes, about the axis e. Gyroscopic and convective terms of the
    turning body are left out, valid far below its critical speeds, unless its basis has them,
    ``Rotation(speed, frame="standing")``.

    Parameters
    ----------
    speed : float
        Omega, positive counter-clockwise [rad/s].
    centre : (x, y) or (x, y, z)
        c, of solids a point of the axis [m].
    motion : GroundMotion, optional
        Time-dependent speed, with its speeds in rad/s; by default the constant Omega.
    axis : (x, y, z)
        e, of any length above zero; stored with length one. In the plane always z.

    Raises
    ------
    InputError
        For values that are not finite.
    """

    speed: Annotated[float, Unit("rad/s")]
    centre: Annotated[tuple[float, ...], Unit("m")] = (0.0, 0.0)
    motion: GroundMotion | None = None
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        _check("SlidingRotation", self.speed, self.motion)
        object.__setattr__(self, "centre", as_place(self.centre, "SlidingRotation: centre"))
        object.__setattr__(self, "axis", as_direction(self.axis, "SlidingRotation: axis"))
        if len(self.axis) != 3:
            raise InputError(f"SlidingRotation: axis = {shown(self.axis)} must have three "
                             f"components, x, y and z.")

    def along(self, places: Array, tangents: Array) -> Array:
        """V_tj / Omega (n,) [m] at places (n, 2) with tangents (n, 2); (n, 2) in space."""
        centre = self.centre
        if tangents.ndim == 3:
            centre = (*centre, 0.0)[:3]
            _require_dimension("SlidingRotation: centre", centre, tangents)
            speeds = np.cross(np.array(self.axis), places - np.array(centre))
            return np.asarray(np.einsum("nkd,nd->nk", tangents, speeds))
        _require_dimension("SlidingRotation: centre", centre, tangents)
        if self.axis != (0.0, 0.0, 1.0):
            raise InputError(f"SlidingRotation: axis = {shown(self.axis)} of plane bodies must be "
                             f"(0, 0, 1).")
        x, y = (places - np.array(centre)).T
        return np.asarray(tangents[:, 1] * x - tangents[:, 0] * y)


Sliding = SlidingTranslation | SlidingRotation


def _require_dimension(what: str, given: tuple[float, ...], tangents: Array) -> None:
    if len(given) != tangents.shape[-1]:
        raise InputError(f"{what} = {shown(given)} must have {tangents.shape[-1]} components here, "
                         f"as the contact nodes' places have.")


def _check(owner: str, speed: float, motion: GroundMotion | None) -> None:
    require_finite(owner, speed=speed)
    require_kind(owner, (GroundMotion, type(None)), motion=motion)
