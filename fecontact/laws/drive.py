"""Excitation at B and load at C."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import require_finite, require_not_negative
from fecontact.laws.contract import signal


@signal
def _harmonic(t, p):  # type: ignore[no-untyped-def]
    amplitude, w = p[0], p[1]
    return amplitude * math.sin(w * t), amplitude * w * math.cos(w * t)


@dataclass(frozen=True)
class Drive:
    r"""Base excitation of B through springs and absolute dashpots (4.1-8..11).

    .. math:: F_{Bx} = c_x (x_B - x_0 \sin w_E t) + b_x x_B'

    acts on the body in -x, and likewise in y. The dashpots feel the absolute velocity of B.

    Parameters
    ----------
    stiffness_x, stiffness_y : float
        c_x, c_y, zero or above [N/m].
    damping_x, damping_y : float
        b_x, b_y, zero or above [N s/m].
    amplitude_x, amplitude_y : float
        x_0, y_0 [m].
    angular_frequency : float
        w_E, zero or above [rad/s].
    """

    motion_kernel: ClassVar = _harmonic

    stiffness_x: float = 0.0
    stiffness_y: float = 0.0
    damping_x: float = 0.0
    damping_y: float = 0.0
    amplitude_x: float = 0.0
    amplitude_y: float = 0.0
    angular_frequency: float = 0.0

    def __post_init__(self) -> None:
        require_not_negative(
            "Drive", stiffness_x=self.stiffness_x, stiffness_y=self.stiffness_y,
            damping_x=self.damping_x, damping_y=self.damping_y,
            angular_frequency=self.angular_frequency,
        )
        require_finite("Drive", amplitude_x=self.amplitude_x, amplitude_y=self.amplitude_y)

    @property
    def frequency_hz(self) -> float:
        """Frequency of the excitation [Hz]."""
        return self.angular_frequency / (2.0 * math.pi)

    def motion_parameters(self) -> NDArray[np.float64]:
        """Parameters (2, k) of the compiled motions in x and y."""
        w = self.angular_frequency
        return np.array([[self.amplitude_x, w], [self.amplitude_y, w]], dtype=float)


@dataclass(frozen=True)
class Load:
    """Constant load at C: ``[0, -normal, 0]`` acts on the body (4.1-6).

    Parameters
    ----------
    normal : float
        F_N0, positive towards the ground [N].
    """

    normal: float = 0.0

    def __post_init__(self) -> None:
        require_finite("Load", normal=self.normal)
