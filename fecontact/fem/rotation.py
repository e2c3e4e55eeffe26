"""Rotation of a plane body: Coriolis matrix, centrifugal force and stiffness of its stress."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from fecontact.core.checks import as_floats, is_numeric
from fecontact.core.errors import InputError, require_finite, shown
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody


@dataclass(frozen=True)
class Rotation:
    r"""Rotation of a plane body at constant speed about a point of its plane.

    Displacements u are those in the frame that rotates with the body; supports, ground, drive and
    loads rotate with it. With places X, the speed Omega and the centre c

    .. math:: M u'' + 2 \Omega M J u' + (K + K_\sigma - \Omega^2 M) u = \Omega^2 M (X - c),
        \quad J = \begin{bmatrix} 0 & -1 \\ 1 & 0 \end{bmatrix}

    Parameters
    ----------
    speed : float
        Omega, positive counter-clockwise [rad/s].
    centre : (x, y)
        The point that does not move [m].
    coriolis : bool
        Coriolis forces, the skew damping ``2 Omega M J``.
    centrifugal_load : bool
        The centrifugal force on the undeformed body, which stretches it.
    spin_softening : bool
        What the centrifugal force adds with the displacement, ``-Omega^2 M u``.
    stress_stiffening : bool
        The geometric stiffness K_sigma of the stress under the centrifugal force.

    Raises
    ------
    InputError
        For values that are not finite, or switches that are not true or false.
    """

    speed: Annotated[float, Unit("rad/s")]
    centre: Annotated[tuple[float, float], Unit("m")] = (0.0, 0.0)
    coriolis: bool = True
    centrifugal_load: bool = True
    spin_softening: bool = True
    stress_stiffening: bool = True

    def __post_init__(self) -> None:
        require_finite("Rotation", speed=self.speed)
        centre = as_floats(self.centre, "centre") if is_numeric(self.centre) else np.zeros(0)
        if centre.shape != (2,) or not np.isfinite(centre).all():
            raise InputError(f"Rotation: centre = {shown(self.centre)} must be two finite numbers, "
                             f"x and y [m].")
        object.__setattr__(self, "centre", tuple(centre.tolist()))
        for name in ("coriolis", "centrifugal_load", "spin_softening", "stress_stiffening"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"Rotation: {name} = {getattr(self, name)!r} must be true or "
                                 f"false.")


def coriolis_matrix(body: ElasticBody) -> Any:
    """``2 M J``, skew, sparse (2 N, 2 N): the Coriolis matrix per speed, without supports [kg]."""
    import scipy.sparse as sp

    return sp.csc_array(sp.kron(body.component_mass, np.array([[0.0, -2.0], [2.0, 0.0]])))


def centrifugal_force(body: ElasticBody, centre: tuple[float, float]) -> Array:
    """``M (X - c)`` (2 N,): the centrifugal force per squared speed, without supports [kg m]."""
    return np.asarray(body.mass @ (body.nodes - np.array(centre)).ravel())

