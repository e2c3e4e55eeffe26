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

    def volume(self, slip_work: Array, power: Array, pressed_speed: Array) -> Array:
        """Volume (N, n) worn off since the first time [m3].

        Parameters
        ----------
        slip_work : (N, n) array
            Energy lost by friction in slip since the first time [J].
        power, pressed_speed : (N, n) arrays
            Power that friction loses [W], and normal force times slip speed [W], zero but in slip.
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

    def volume(self, slip_work: Array, power: Array, pressed_speed: Array) -> Array:
        """k_w times the energy lost in slip; see :class:`WearLaw`."""
        return self.coefficient * slip_work


@dataclass(frozen=True)
class ArchardWear(WearLaw):
    """Archard's law: the volume is proportional to normal force times slip distance.

    ``depth' = k |v| p`` in slip, p the pressure; with a constant coefficient of friction mu this is
    :class:`EnergyWear` with ``k_w = k / mu``. The coefficient of friction is taken at the output
    times, the energy lost between them from the integrator.

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

    def volume(self, slip_work: Array, power: Array, pressed_speed: Array) -> Array:
        """K times the integral of normal force and slip speed; see :class:`WearLaw`."""
        lost = power[1:] + power[:-1]
        pressed = pressed_speed[1:] + pressed_speed[:-1]
        # Slips too short to show at an output time have the mean coefficient of the others.
        mean = pressed.sum(axis=0) / np.maximum(lost.sum(axis=0), 1e-300)
        per_energy = np.where(lost > 0.0, pressed / np.maximum(lost, 1e-300), mean)
        distance = np.cumsum(np.diff(slip_work, axis=0) * per_energy, axis=0)
        return self.coefficient * np.vstack([np.zeros(power.shape[1]), distance])
