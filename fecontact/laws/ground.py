"""The moving ground."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import require_finite, require_not_negative, require_positive
from fecontact.laws.contract import ground_profile, signal


@ground_profile
def _sine(xi, p):  # type: ignore[no-untyped-def]
    amplitude, wave_number = p[0], p[1]
    sine = amplitude * math.sin(wave_number * xi)
    cosine = amplitude * math.cos(wave_number * xi)
    return sine, wave_number * cosine, -wave_number * wave_number * sine


@signal
def _constant_speed(t, p):  # type: ignore[no-untyped-def]
    return p[0] * t, p[0]


@dataclass(frozen=True)
class Ground:
    r"""Ground that moves in +x at constant speed V, with a sine waviness (4.3-1).

    .. math:: y_R(\xi) = y_A \sin(2 \pi \xi / \lambda_w), \qquad \xi = X + x - V t

    is its height [m] below a node of reference abscissa X displaced by x. The normal force
    stays vertical; keep the slope ``2 pi amplitude / wavelength`` well below one.

    Parameters
    ----------
    speed : float
        V, positive in +x [m/s].
    amplitude : float
        y_A, zero or above; zero is flat ground [m].
    wavelength : float
        lambda_w, positive [m].
    """

    profile_kernel: ClassVar = _sine
    motion_kernel: ClassVar = _constant_speed

    speed: float = 0.0
    amplitude: float = 0.0
    wavelength: float = 2.5e-3

    def __post_init__(self) -> None:
        require_finite("Ground", speed=self.speed)
        require_not_negative("Ground", amplitude=self.amplitude)
        require_positive("Ground", wavelength=self.wavelength)

    @property
    def steepest_slope(self) -> float:
        """Largest slope of the profile, dimensionless."""
        return 2.0 * math.pi * self.amplitude / self.wavelength

    def height(self, abscissa: NDArray[np.float64], time: float = 0.0) -> NDArray[np.float64]:
        """Height [m] at abscissae of the inertial frame [m] at a time [s]."""
        phase = 2.0 * np.pi * (np.asarray(abscissa) - self.speed * time) / self.wavelength
        return np.asarray(self.amplitude * np.sin(phase))

    friction_scale_kernel: ClassVar[None] = None

    def friction_scale_parameters(self) -> NDArray[np.float64]:
        """None."""
        return np.zeros(1)

    @property
    def wavy(self) -> bool:
        """Whether its height varies."""
        return self.amplitude > 0.0

    @property
    def shortest_wavelength(self) -> float | None:
        """None when flat [m]."""
        return self.wavelength if self.wavy else None

    def travel(self, time: float) -> float:
        """Travel [m]."""
        return self.speed * time

    def largest_speed(self, start: float, end: float) -> float:
        """[m/s]."""
        return abs(self.speed)

    def profile_parameters(self) -> NDArray[np.float64]:
        """Parameters of the compiled profile."""
        return np.array([self.amplitude, 2.0 * np.pi / self.wavelength], dtype=float)

    def motion_parameters(self) -> NDArray[np.float64]:
        """Parameters of the compiled motion."""
        return np.array([self.speed], dtype=float)
