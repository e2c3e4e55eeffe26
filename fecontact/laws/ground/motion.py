"""Time-dependent speeds of the ground."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.compiled import CompiledLaw
from fecontact.core.docstrings import InheritsDocumentation
from fecontact.core.errors import require_finite, require_positive
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.elementary import sine_and_cosine
from fecontact.laws.signals.base import between
from fecontact.laws.signatures import signal

# Samples of a speed without a closed-form maximum.
_SAMPLES = 10_001


@dataclass(frozen=True)
class GroundMotion(InheritsDocumentation):
    """Base class of motions of the ground: a frozen dataclass with a compiled ``signal``.

    The value of the signal is the travel [m], zero at t = 0, its rate the speed [m/s].

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    kernel: ClassVar[CompiledLaw]

    def parameters(self, speed: float) -> Array:
        """Parameters of the kernel, for the ground's constant speed [m/s]."""
        raise NotImplementedError

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Times between t0 and t1 at which the speed has kinks, ascending [s]."""
        return ()

    @property
    def shortest_period(self) -> float | None:
        """Shortest period of the speed between breakpoints [s], which limits the step; or None.

        Steps end at breakpoints.
        """
        return None

    def largest_speed(self, speed: float, t0: float, t1: float) -> float:
        """Largest magnitude of the speed from t0 to t1, or an upper bound [m/s]."""
        raise NotImplementedError

    def largest_acceleration(self, speed: float, t0: float, t1: float) -> float:
        """Largest magnitude of the acceleration from t0 to t1, or an upper bound [m/s2].

        By default 1.5 times the largest change between samples.
        """
        p = self.parameters(speed)
        times = np.linspace(t0, t1, _SAMPLES)
        speeds = np.array([self.kernel.python(t, p)[1] for t in times])
        return 1.5 * float(np.abs(np.diff(speeds)).max()) * (_SAMPLES - 1) / (t1 - t0)


@signal
def constant_speed(t, p):
    """Travel and speed for p = [speed]."""
    return p[0] * t, p[0]


@signal
def _harmonic_speed(t, p):
    speed, amplitude, w, phase = p[0], p[1], p[2], p[3]
    angle = 0.5 * w * t
    # cos(phase) - cos(w t + phase), without cancellation.
    travel = 2.0 * sine_and_cosine(angle + phase)[0] * sine_and_cosine(angle)[0]
    return (speed * t + amplitude / w * travel,
            speed + amplitude * sine_and_cosine(w * t + phase)[0])


@dataclass(frozen=True)
class HarmonicSpeed(GroundMotion):
    r"""Ground whose speed oscillates about the constant one.

    .. math:: V(t) = V + A \sin(2 \pi f t + \varphi)

    The travel is the exact integral.

    Parameters
    ----------
    amplitude : float
        Amplitude A of the speed [m/s].
    frequency_hz : float
        Frequency f, positive [Hz].
    phase : float
        Phase phi [rad].
    """

    kernel: ClassVar = _harmonic_speed

    amplitude: Annotated[float, Unit("m/s")]
    frequency_hz: Annotated[float, Unit("Hz")]
    phase: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        require_finite("HarmonicSpeed", amplitude=self.amplitude, phase=self.phase)
        require_positive("HarmonicSpeed", frequency_hz=self.frequency_hz)

    def parameters(self, speed: float) -> Array:
        """V, A, 2 pi f and phi."""
        return np.array([speed, self.amplitude, self._w, self.phase], dtype=float)

    @property
    def _w(self) -> float:
        return 2.0 * math.pi * self.frequency_hz

    @property
    def shortest_period(self) -> float | None:
        """1 / f [s]."""
        return 1.0 / self.frequency_hz

    def largest_speed(self, speed: float, t0: float, t1: float) -> float:
        """Largest magnitude of the speed from t0 to t1 [m/s]."""
        low, high = (self._w * t + self.phase for t in (t0, t1))
        first = math.ceil(low / math.pi - 0.5)
        last = min(math.floor(high / math.pi - 0.5), first + 1)
        angles = [low, high, *(math.pi * (k + 0.5) for k in range(first, last + 1))]
        return max(abs(speed + self.amplitude * math.sin(angle)) for angle in angles)

    def largest_acceleration(self, speed: float, t0: float, t1: float) -> float:
        """2 pi f A [m/s2]."""
        return abs(self.amplitude) * self._w


@signal
def _ramp(t, p):
    speed, change, start, duration = p[0], p[1], p[2], p[3]
    s = min(max((t - start) / duration, 0.0), 1.0)
    after = max(t - start - duration, 0.0)
    travel = speed * t + change * (0.5 * duration * s * s + after) - p[4]
    return travel, speed + change * s


@dataclass(frozen=True)
class SpeedRamp(GroundMotion):
    r"""Ground whose speed changes linearly from V to another constant value.

    .. math:: V(t) = V + (V_1 - V) \frac{t - t_1}{T}, \qquad t_1 \le t \le t_1 + T

    The speed is continuous, with a kink at both ends; the travel is the exact integral.

    Parameters
    ----------
    end_speed : float
        Speed V_1 at the end of the ramp [m/s].
    start : float
        Time t_1 at which the ramp starts [s].
    duration : float
        Duration T of the ramp, positive [s].
    """

    kernel: ClassVar = _ramp

    end_speed: Annotated[float, Unit("m/s")]
    start: Annotated[float, Unit("s")]
    duration: Annotated[float, Unit("s")]

    def __post_init__(self) -> None:
        require_finite("SpeedRamp", end_speed=self.end_speed, start=self.start)
        require_positive("SpeedRamp", duration=self.duration)

    def parameters(self, speed: float) -> Array:
        """V, V_1 - V, t_1, T and the offset that makes the travel zero at t = 0."""
        p = np.array([speed, self.end_speed - speed, self.start, self.duration, 0.0])
        p[4] = self.kernel.python(0.0, p)[0]
        return p

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Start and end of the ramp if they lie between t0 and t1 [s]."""
        return between((self.start, self.start + self.duration), t0, t1)

    def largest_speed(self, speed: float, t0: float, t1: float) -> float:
        """Largest magnitude of the speed from t0 to t1 [m/s]."""
        p = self.parameters(speed)
        return max(abs(float(self.kernel.python(t, p)[1])) for t in (t0, t1))

    def largest_acceleration(self, speed: float, t0: float, t1: float) -> float:
        """Acceleration during the ramp [m/s2]."""
        return abs(self.end_speed - speed) / self.duration
