"""Constant and harmonic signals, for motions of the drive and loads."""

import math
from dataclasses import dataclass, fields
from typing import Annotated, ClassVar, Literal

import numpy as np

from fecontact.core.errors import (
    InputError,
    require_choice,
    require_finite,
    require_not_negative,
    require_positive,
)
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Unit
from fecontact.laws.data_columns import numbers
from fecontact.laws.elementary import sine_and_cosine
from fecontact.laws.signals.base import Signal, between
from fecontact.laws.signals.transient import Pulse, Step, Tabulated
from fecontact.laws.signatures import signal

__all__ = ["Constant", "Harmonic", "Harmonics", "Pulse", "Signal", "Step", "SweptSine", "Tabulated"]


@signal
def _constant(t, p):
    return p[0], 0.0


@dataclass(frozen=True)
class Constant(Signal):
    """A constant value.

    Parameters
    ----------
    value : float
        Value, in the unit of the quantity.
    """

    kernel: ClassVar = _constant

    value: float = 0.0

    def __post_init__(self) -> None:
        require_finite("Constant", value=self.value)

    @property
    def largest(self) -> float:
        """Magnitude of the value."""
        return abs(float(self.value))


@signal
def _harmonic(t, p):
    amplitude, w, phase = p[0], p[1], p[2]
    sine, cosine = sine_and_cosine(w * t + phase)
    return amplitude * sine, amplitude * w * cosine


@dataclass(frozen=True)
class Harmonic(Signal):
    r"""A sine.

    .. math:: A \sin(2 \pi f t + \varphi)

    Parameters
    ----------
    frequency_hz : float
        Frequency f, zero or above [Hz]; w / (2 pi) of an angular frequency w [rad/s].
    phase : float
        Phase phi [rad]; pi / 2 for a cosine.
    """

    kernel: ClassVar = _harmonic

    amplitude: float
    frequency_hz: Annotated[float, Unit("Hz")]
    phase: Annotated[float, Unit("rad")] = 0.0

    def __post_init__(self) -> None:
        require_finite("Harmonic", amplitude=self.amplitude, phase=self.phase)
        require_not_negative("Harmonic", frequency_hz=self.frequency_hz)

    def parameters(self) -> Array:
        """A, 2 pi f and phi."""
        return np.array([self.amplitude, 2.0 * math.pi * self.frequency_hz, self.phase])

    @property
    def shortest_period(self) -> float | None:
        """1 / f [s]; None for a constant."""
        f = self.frequency_hz
        return 1.0 / f if f > 0.0 and self.amplitude != 0.0 else None

    @property
    def fundamental_hz(self) -> float | None:
        """Frequency of the signal [Hz]; None for a constant."""
        return None if self.shortest_period is None else self.frequency_hz


@signal
def _harmonics(t, p):
    value, rate = 0.0, 0.0
    for k in range(int(p[0])):
        amplitude, w = p[3 * k + 1], p[3 * k + 2]
        angle = w * t + p[3 * k + 3]
        value += amplitude * math.sin(angle)
        rate += amplitude * w * math.cos(angle)
    return value, rate


@dataclass(frozen=True)
class Harmonics(Signal):
    r"""A sum of sines of arbitrary frequencies.

    .. math:: \sum_k A_k \sin(2 \pi f_k t + \varphi_k)

    Parameters
    ----------
    amplitudes : sequence
        A_k, in the unit of the quantity.
    frequencies_hz : sequence
        f_k, zero or above [Hz].
    phases : sequence, optional
        Phases phi_k [rad]; zero by default.
    """

    kernel: ClassVar = _harmonics

    amplitudes: tuple[float, ...]
    frequencies_hz: Annotated[tuple[float, ...], Unit("Hz")]
    phases: Annotated[tuple[float, ...], Unit("rad")] = ()

    def __post_init__(self) -> None:
        for entry in fields(self):
            given = numbers("Harmonics", entry.name, getattr(self, entry.name),
                            0 if entry.name == "phases" else 1)
            object.__setattr__(self, entry.name, given)
            if len(given) not in (len(self.amplitudes), 0):
                raise InputError(f"Harmonics: {entry.name} has {len(given)} values for "
                                 f"{len(self.amplitudes)} amplitudes; give one for each.")
        for k, f in enumerate(self.frequencies_hz):
            require_not_negative("Harmonics", **{f"frequencies_hz[{k}]": f})

    def parameters(self) -> Array:
        """Number of sines, then A, 2 pi f and phi of each."""
        phases = self.phases or np.zeros(len(self.amplitudes))
        rows = np.column_stack([
            self.amplitudes, 2.0 * math.pi * np.array(self.frequencies_hz), phases])
        return np.concatenate([[len(rows)], rows.ravel()])

    @property
    def _heard(self) -> list[float]:
        """Frequencies above zero whose amplitude is not zero."""
        return sorted(f for a, f in zip(self.amplitudes, self.frequencies_hz, strict=True)
                      if a != 0.0 and f > 0.0)

    @property
    def shortest_period(self) -> float | None:
        """Period of the highest frequency [s]."""
        return 1.0 / self._heard[-1] if self._heard else None

    @property
    def fundamental_hz(self) -> float | None:
        """The lowest frequency [Hz] if all others are integer multiples of it, else None."""
        if not self._heard:
            return None
        ratios = np.array(self._heard) / self._heard[0]
        whole = np.abs(ratios - np.round(ratios)) <= 1e-9 * ratios
        return self._heard[0] if whole.all() else None

    @property
    def largest(self) -> float:
        """Sum of the magnitudes of the amplitudes."""
        return math.fsum(abs(a) for a in self.amplitudes)


@signal
def _sweep(t, p):
    amplitude, w0, w1, duration = p[0], p[1], p[2], p[3]
    inside = min(max(t, 0.0), duration)
    if p[4] == 0.0:
        w = w0 + (w1 - w0) * inside / duration
        angle = 0.5 * (w0 + w) * inside
    else:
        growth = math.log(w1 / w0) / duration
        x = growth * inside
        w = w0 * math.exp(x)
        angle = w0 * inside * (math.expm1(x) / x if x != 0.0 else 1.0)
    angle += w * (t - inside)
    return amplitude * math.sin(angle), amplitude * w * math.cos(angle)


@dataclass(frozen=True)
class SweptSine(Signal):
    r"""A sine whose frequency is swept from one value to another, and then constant.

    .. math:: A \sin\Big(2 \pi \int_0^t f\,dt\Big), \qquad
        f = f_0 + (f_1 - f_0) \frac{t}{T} \quad\text{or}\quad
        f = f_0 \Big(\frac{f_1}{f_0}\Big)^{t/T}, \qquad 0 \le t \le T

    f is f_0 before t = 0 and f_1 after t = T; the phase is the exact integral.

    Parameters
    ----------
    start_frequency_hz, end_frequency_hz : float
        Frequencies f_0 and f_1 [Hz], zero or above; above zero for a logarithmic sweep.
    duration : float
        Duration T of the sweep, positive [s].
    kind : 'linear' or 'logarithmic'
    """

    kernel: ClassVar = _sweep

    amplitude: float
    start_frequency_hz: Annotated[float, Unit("Hz")]
    end_frequency_hz: Annotated[float, Unit("Hz")]
    duration: Annotated[float, Unit("s")]
    kind: Literal["linear", "logarithmic"] = "linear"

    def __post_init__(self) -> None:
        require_finite("SweptSine", amplitude=self.amplitude)
        require_choice("SweptSine", "kind", self.kind, ("linear", "logarithmic"))
        require = require_not_negative if self.kind == "linear" else require_positive
        require("SweptSine", start_frequency_hz=self.start_frequency_hz,
                end_frequency_hz=self.end_frequency_hz)
        require_positive("SweptSine", duration=self.duration)

    def parameters(self) -> Array:
        """A, the angular frequencies, T, and 1 for a logarithmic sweep."""
        return np.array([self.amplitude, 2.0 * math.pi * self.start_frequency_hz,
                         2.0 * math.pi * self.end_frequency_hz, self.duration,
                         self.kind == "logarithmic"], dtype=float)

    def instantaneous_frequency_hz(self, times: ArrayLike) -> Array:
        """Frequencies f [Hz] at times [s]."""
        part = np.clip(np.asarray(times, dtype=float) / self.duration, 0.0, 1.0)
        f0, f1 = self.start_frequency_hz, self.end_frequency_hz
        if self.kind == "linear":
            return np.asarray(f0 + (f1 - f0) * part)
        return np.asarray(f0 * (f1 / f0) ** part)

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Start and end of the sweep if they lie between t0 and t1 [s]."""
        return between((0.0, self.duration), t0, t1)

    @property
    def shortest_period(self) -> float | None:
        """Period of the highest frequency [s]."""
        highest = max(self.start_frequency_hz, self.end_frequency_hz)
        return 1.0 / highest if highest > 0.0 and self.amplitude != 0.0 else None
