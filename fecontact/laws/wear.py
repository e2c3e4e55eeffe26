"""Wear laws: how much of the body friction takes off."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fecontact.core.docstrings import InheritsDocumentation
from fecontact.core.errors import require_not_negative
from fecontact.core.types import Array
from fecontact.core.units import Unit


@dataclass(frozen=True)
class WearLaw(InheritsDocumentation):
    """Wear of the body in slip, at each contact node by itself.

    Neither what bristles store nor what smoothed friction loses in stick wears anything.

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    def volume(self, slip_work: Array, lost: Array, rubbed: Array) -> Array:
        """Volume (N, n) worn off since the first time [m3].

        Parameters
        ----------
        slip_work : (N, n) array
            Energy lost by friction in slip since the first time [J], from the integrator.
        lost, rubbed : (N, n) arrays
            Integrals since the first time of the power that friction loses in slip [J], and of
            normal force times slip speed [N m], by the trapezoidal rule over all known times. Their
            ratio tells the coefficient of friction between two times.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class EnergyWear(WearLaw):
    """Energy wear: the volume is proportional to the energy that friction loses in slip.

    ``depth' = k_w x power of slip / area``.

    Parameters
    ----------
    coefficient : float
        k_w, zero or above [m3/J].

    References
    ----------
    S. Fouvry, P. Kapsa, L. Vincent, Quantification of fretting damage, Wear 200 (1996).
    """

    coefficient: Annotated[float, Unit("m^3/J")]

    def __post_init__(self) -> None:
        require_not_negative("EnergyWear", coefficient=self.coefficient)

    def volume(self, slip_work: Array, lost: Array, rubbed: Array) -> Array:
        """k_w times the energy lost in slip; see :class:`WearLaw`."""
        return self.coefficient * slip_work


@dataclass(frozen=True)
class ArchardWear(WearLaw):
    """Archard's law: the volume is proportional to normal force times slip distance.

    ``depth' = k |v| p`` in slip, p the pressure; with a constant coefficient of friction mu this is
    :class:`EnergyWear` with ``k_w = k / mu``. The energy lost between two output times is
    the integrator's; the mean coefficient of friction between them is taken at them and where the
    run has kept its motion (``keep_steps``), by default often enough.

    Parameters
    ----------
    coefficient : float
        k, zero or above: Archard's dimensionless coefficient over the hardness [m2/N].

    References
    ----------
    J. F. Archard, Contact and rubbing of flat surfaces, Journal of Applied Physics 24 (1953).
    """

    coefficient: Annotated[float, Unit("m^2/N")]

    def __post_init__(self) -> None:
        require_not_negative("ArchardWear", coefficient=self.coefficient)

    def volume(self, slip_work: Array, lost: Array, rubbed: Array) -> Array:
        """K times the integral of normal force and slip speed; see :class:`WearLaw`."""
        energy, pressed = np.diff(lost, axis=0), np.diff(rubbed, axis=0)
        # Slips too short to show at a known time have the mean coefficient of the others.
        mean = pressed.sum(axis=0) / np.maximum(energy.sum(axis=0), 1e-300)
        per_energy = np.where(energy > 0.0, pressed / np.maximum(energy, 1e-300), mean)
        distance = np.cumsum(np.diff(slip_work, axis=0) * per_energy, axis=0)
        return self.coefficient * np.vstack([np.zeros(lost.shape[1]), distance])
