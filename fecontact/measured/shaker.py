"""An electrodynamic shaker: a body with armature and coil, a stinger and a drive."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fecontact.core.checks import as_direction
from fecontact.core.errors import (
    InputError,
    require_not_negative,
    require_positive,
)
from fecontact.core.types import Coordinates
from fecontact.core.units import Unit
from fecontact.laws.excitation import PointLoad
from fecontact.laws.signals.base import Signal
from fecontact.reduction.assembly.links import Spring
from fecontact.reduction.from_matrices import basis_from_matrices
from fecontact.reduction.modal_basis import ModalBasis


@dataclass(frozen=True)
class Shaker:
    r"""Electrodynamic shaker whose armature drives a body through a stinger.

    .. math::

        m \ddot x + c \dot x + k x = B\,i - F, \qquad L\,\dot i + R\,i + B\,\dot x = U, \qquad
        F = k_s (x - u) + c_s (\dot x - \dot u)

    with the displacements x of the armature and u of the body along ``direction``. The frame of the
    shaker stands. With the body's receptance H

    .. math:: \frac{F}{B\,i} = \frac{1}{1 + Z (H + 1 / k_s)}, \qquad Z = k + i \omega c -
        \omega^2 m

    so that the force drops at resonances of the body, where H is large; of a voltage the back
    electromotive force adds ``i w B^2 / (R + i w L)`` to Z.

    Parameters
    ----------
    armature_mass : float
        m, above zero [kg].
    suspension_stiffness, suspension_damping : float
        k, c, zero or above [N/m], [N s/m].
    stinger_stiffness, stinger_damping : float
        k_s above zero, c_s zero or above [N/m], [N s/m]. The stinger carries no bending moments.
    direction : (x, y) or (x, y, z)
        Direction of the force.
    force_factor : float
        B, force per current [N/A]; 1 for a drive that is a force in N.
    resistance : float, optional
        R, above zero [Ohm]; the drive is then a voltage [V], without it a current [A].
    inductance : float
        L, zero or above [H].

    Raises
    ------
    InputError
        For values out of range, and an inductance without a resistance.
    """

    armature_mass: Annotated[float, Unit("kg")]
    suspension_stiffness: Annotated[float, Unit("N/m")] = 0.0
    suspension_damping: Annotated[float, Unit("N s/m")] = 0.0
    stinger_stiffness: Annotated[float, Unit("N/m")] = 1e6
    stinger_damping: Annotated[float, Unit("N s/m")] = 0.0
    direction: Coordinates = (0.0, 1.0)
    force_factor: Annotated[float, Unit("N/A")] = 1.0
    resistance: Annotated[float | None, Unit("Ohm")] = None
    inductance: Annotated[float, Unit("H")] = 0.0

    def __post_init__(self) -> None:
        require_positive("Shaker", armature_mass=self.armature_mass,
                         stinger_stiffness=self.stinger_stiffness, force_factor=self.force_factor)
        require_not_negative("Shaker", suspension_stiffness=self.suspension_stiffness,
                             suspension_damping=self.suspension_damping,
                             stinger_damping=self.stinger_damping, inductance=self.inductance)
        if self.resistance is not None:
            require_positive("Shaker", resistance=self.resistance)
        elif self.inductance:
            raise InputError("Shaker: inductance has no effect on a drive by current; give the "
                             "resistance too, for a drive by voltage.")
        object.__setattr__(self, "direction", as_direction(self.direction, "Shaker: direction"))

    def basis(self) -> ModalBasis:
        """Body of the shaker, with the points ``armature`` and ``coil``, for ``bodies=``.

        The coil is no place: a force along its x is the drive. With an inductance its motion is the
        charge that has flown [C], a coordinate without stiffness.
        """
        d = len(self.direction)
        size = 2 if self.inductance else 1
        M, C, K = np.zeros((3, size, size))
        M[0, 0], C[0, 0], K[0, 0] = (self.armature_mass, self.suspension_damping,
                                     self.suspension_stiffness)
        armature, coil = np.zeros((2, 3 * (d - 1), size))
        armature[:d, 0] = self.direction
        B = self.force_factor
        if self.inductance:
            assert self.resistance is not None
            M[1, 1], C[1, 1], C[0, 1], C[1, 0] = self.inductance, self.resistance, -B, B
            coil[0, 1] = 1.0
        elif self.resistance is not None:
            C[0, 0] += B**2 / self.resistance
            coil[0, 0] = B / self.resistance
        else:
            coil[0, 0] = B
        return basis_from_matrices(M, K, {"armature": armature, "coil": coil}, damping=C,
                                   dimension=2 if d == 2 else 3)

    def stinger(self, point: str, name: str = "shaker") -> Spring:
        """Spring from a point of the body, 'BODY.POINT', to the armature, for ``links=``.

        Parameters
        ----------
        point : str
            Point that is driven.
        name : str
            Name of the shaker among the bodies.
        """
        return Spring(point, f"{name}.armature", stiffness=self.stinger_stiffness,
                      damping=self.stinger_damping, direction=self.direction)

    def drive(self, signal: float | Signal, name: str = "shaker") -> PointLoad:
        """Load of the coil, for ``Load(forces=...)``.

        Parameters
        ----------
        signal : float or Signal
            Voltage [V] with a resistance, else current [A].
        name : str
            Name of the shaker among the bodies.
        """
        return PointLoad(f"{name}.coil", "x", signal=signal)
