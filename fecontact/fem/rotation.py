"""Rotation of a body about an axis: Coriolis matrix, centrifugal force and its softening."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from fecontact.core.checks import as_direction, as_place, is_numeric
from fecontact.core.errors import InputError, require_choice, require_finite, shown
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.standing_frame import convective_matrices


@dataclass(frozen=True)
class Rotation:
    r"""Rotation of a body at constant speed about an axis, of a plane body about a point.

    Displacements u are those in the frame that rotates with the body; supports, ground, drive and
    loads rotate with it. With places X, the speed Omega, the axis e through c, S u = e x u and
    P = -S S, which takes the part across the axis,

    .. math:: M u'' + 2 \Omega M S u' + (K + K_\sigma - \Omega^2 M P) u = \Omega^2 M P (X - c)

    Bodies of revolution may be described in the frame at rest instead, as under a pad that stands:
    M S and M P on the left become the convective terms of
    :mod:`fecontact.fem.standing_frame`. Supports, contact, ground and loads stand then, and modal
    damping is that of the surroundings.

    Parameters
    ----------
    speed : float
        Omega, positive about the axis by the right-hand rule; in the plane counter-clockwise
        [rad/s].
    centre : (x, y) or (x, y, z)
        c, a point that does not move; two numbers in a solid have z = 0 [m].
    coriolis : bool
        Coriolis forces, the skew damping ``2 Omega M S``.
    centrifugal_load : bool
        The centrifugal force on the undeformed body, which stretches it.
    spin_softening : bool
        Change of the centrifugal force with the displacement, ``-Omega^2 M P u``.
    stress_stiffening : bool
        The geometric stiffness K_sigma of the stress under the centrifugal force.
    axis : (x, y, z)
        e, of any length above zero, of solids; in the plane z.
    frame : 'rotating' or 'standing'
        Frame of displacements, supports, contact and loads.

    Raises
    ------
    InputError
        For values that are not finite, or switches that are not true or false.
    """

    speed: Annotated[float, Unit("rad/s")]
    centre: Annotated[Coordinates, Unit("m")] = (0.0, 0.0)
    coriolis: bool = True
    centrifugal_load: bool = True
    spin_softening: bool = True
    stress_stiffening: bool = True
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    frame: Literal["rotating", "standing"] = "rotating"

    def __post_init__(self) -> None:
        require_finite("Rotation", speed=self.speed)
        require_choice("Rotation", "frame", self.frame, ("rotating", "standing"))
        object.__setattr__(self, "centre", as_place(
            self.centre if is_numeric(self.centre) else (), "Rotation: centre"))
        for name in ("coriolis", "centrifugal_load", "spin_softening", "stress_stiffening"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"Rotation: {name} = {getattr(self, name)!r} must be true or "
                                 f"false.")
        object.__setattr__(self, "axis", as_direction(
            self.axis if is_numeric(self.axis) else (), "Rotation: axis"))
        if len(self.axis) != 3:
            raise InputError(f"Rotation: axis = {shown(self.axis)} must have three components, x, "
                             f"y and z.")

    def at(self, body: ElasticBody) -> tuple[Array, Array]:
        """Matrix S (d, d) and centre c (d,) in the space of a body.

        InputError for an axis or centre that a plane body cannot have.
        """
        d = body.dimension
        if d == 2 and (len(self.centre) != 2 or self.axis != (0.0, 0.0, 1.0)):
            raise InputError("Rotation: a plane body turns about z and a centre (x, y); leave axis "
                             "and the third number out.")
        return cross_matrix(self.axis)[:d, :d], np.array([*self.centre, 0.0][:d])


def cross_matrix(axis: Sequence[float]) -> Array:
    """S (3, 3) of the vector product ``S u = e x u`` with an axis e."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def coriolis_matrix(body: ElasticBody, rotation: Rotation) -> Any:
    """``2 M S``, skew, sparse (d N, d N): the Coriolis matrix per speed, without supports [kg].

    In the frame at rest twice the first of the convective matrices.
    """
    import scipy.sparse as sp

    if rotation.frame == "standing":
        return sp.csc_array(sp.kron(convective_matrices(body, *rotation.at(body))[0],
                                    2.0 * np.eye(body.dimension)))
    return sp.csc_array(sp.kron(body.component_mass, 2.0 * rotation.at(body)[0]))


def softening_matrix(body: ElasticBody, rotation: Rotation) -> Any:
    """``M P``, sparse (d N, d N): what softens the stiffness per squared speed [kg].

    In the frame at rest the second of the convective matrices.
    """
    import scipy.sparse as sp

    S, centre = rotation.at(body)
    if rotation.frame == "standing":
        return sp.csc_array(sp.kron(convective_matrices(body, S, centre)[1], np.eye(len(S))))
    return sp.csc_array(sp.kron(body.component_mass, -S @ S))


def centrifugal_force(body: ElasticBody, rotation: Rotation) -> Array:
    """``M P (X - c)`` (d N,): the centrifugal force per squared speed, without supports [kg m]."""
    S, centre = rotation.at(body)
    across = (centre - body.nodes) @ (S @ S)
    return np.asarray(body.component_mass @ across).ravel()
