"""Profiles of the ground, or of its friction, in closed form: level and a single wave."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fecontact.core.errors import require_finite, require_not_negative, require_positive
from fecontact.laws.ground.profile import Profile
from fecontact.laws.signatures import ground_profile


@ground_profile
def _flat(xi, p):  # type: ignore[no-untyped-def]
    return p[0], 0.0, 0.0


@dataclass(frozen=True)
class Flat(Profile):
    """Level ground: y = 0."""

    kernel: ClassVar = _flat

    @property
    def steepest_slope(self) -> float:
        """Zero."""
        return 0.0

    @property
    def height_range(self) -> tuple[float, float]:
        """Zero and zero [m]."""
        return 0.0, 0.0

    @property
    def shortest_wavelength(self) -> float | None:
        """None."""
        return None


@ground_profile
def _sine(xi, p):  # type: ignore[no-untyped-def]
    amplitude, wavelength = p[1], p[2]
    wave_number = 2.0 * math.pi / wavelength
    angle = wave_number * np.fmod(xi, wavelength) + p[3]
    sine = amplitude * math.sin(angle)
    cosine = amplitude * math.cos(angle)
    return p[0] + sine, wave_number * cosine, -wave_number * wave_number * sine


@dataclass(frozen=True)
class Sine(Profile):
    r"""A single wave (4.3-1).

    .. math:: y = y_A \sin(2 \pi \xi / \lambda_w + \varphi)

    Parameters
    ----------
    amplitude : float
        y_A, zero or above [m], or as a part of the friction force.
    wavelength : float
        lambda_w, positive [m].
    phase : float
        phi [rad].

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    kernel: ClassVar = _sine

    amplitude: float
    wavelength: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        require_not_negative("Sine", amplitude=self.amplitude)
        require_positive("Sine", wavelength=self.wavelength)
        require_finite("Sine", phase=self.phase)

    @property
    def steepest_slope(self) -> float:
        """``2 pi y_A / lambda_w``."""
        return 2.0 * math.pi * self.amplitude / self.wavelength

    @property
    def height_range(self) -> tuple[float, float]:
        """-y_A and y_A."""
        return -float(self.amplitude), float(self.amplitude)

    @property
    def shortest_wavelength(self) -> float | None:
        """Wavelength [m]; None when flat."""
        return float(self.wavelength) if self.amplitude > 0.0 else None
