"""Profiles of the ground: heights, or variations of friction, along it."""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from numbers import Integral
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError, require_finite, require_not_negative, require_positive
from fecontact.laws.contract import ground_profile
from fecontact.laws.profile_base import Profile
from fecontact.laws.records import numbers
from fecontact.laws.trace import Trace

Array = NDArray[np.float64]

__all__ = ["Flat", "FourierSeries", "Profile", "RandomRoughness", "Sine", "Trace"]

_MOST_HARMONICS = 100_000


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


@ground_profile
def _fourier(xi, p):  # type: ignore[no-untyped-def]
    # Harmonic k is the k-th power of the first one as a complex number.
    wavelength = p[2]
    wave_number = 2.0 * math.pi / wavelength
    angle = wave_number * np.fmod(xi, wavelength)
    c1, s1 = math.cos(angle), math.sin(angle)
    c, s = 1.0, 0.0
    height, slope, curvature = 0.0, 0.0, 0.0
    for k in range(1, int(p[1]) + 1):
        c, s = c * c1 - s * s1, c * s1 + s * c1
        of_sine, of_cosine = p[2 * k + 1], p[2 * k + 2]
        wave = of_sine * s + of_cosine * c
        height += wave
        slope += k * (of_sine * c - of_cosine * s)
        curvature -= k * k * wave
    return p[0] + height, wave_number * slope, wave_number * wave_number * curvature


@dataclass(frozen=True)
class FourierSeries(Profile):
    r"""A sum of waves whose lengths are whole parts of one length.

    .. math:: y = \sum_{k=1}^{n} A_k \sin(2 \pi k \xi / \lambda + \varphi_k)

    The sines are powers of the first, so that a hundred cost less than ten sines.

    Parameters
    ----------
    wavelength : float
        lambda, positive: the length after which the ground repeats [m].
    amplitudes : (n,) sequence
        A_k from the longest wave to the shortest [m], or as parts of the friction force.
    phases : (n,) sequence, optional
        phi_k [rad]; zero by default.

    Raises
    ------
    InputError
        For values outside these ranges, or sequences of different lengths.
    """

    kernel: ClassVar = _fourier

    wavelength: float
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_positive("FourierSeries", wavelength=self.wavelength)
        for name, least in (("amplitudes", 1), ("phases", 0)):
            given = numbers("FourierSeries", name, getattr(self, name), least)
            object.__setattr__(self, name, given)
        if self.phases and len(self.phases) != len(self.amplitudes):
            raise InputError(f"FourierSeries: phases has {len(self.phases)} values for "
                             f"{len(self.amplitudes)} amplitudes; give one for each.")

    @cached_property
    def _waves(self) -> NDArray[np.complex128]:
        """Complex amplitudes (n,) of exp(2 pi i k xi / lambda), whose imaginary part is y."""
        phases = np.array(self.phases) if self.phases else np.zeros(len(self.amplitudes))
        return np.asarray(np.array(self.amplitudes) * np.exp(1j * phases))

    def parameters(self) -> Array:
        """Level, n, lambda, and the factors of sine and cosine of each wave."""
        pairs = np.column_stack([self._waves.real, self._waves.imag])
        return np.concatenate([[0.0, len(pairs), self.wavelength], pairs.ravel()])

    @cached_property
    def steepest_slope(self) -> float:
        """Largest magnitude of the slope."""
        orders = 2.0j * np.pi / self.wavelength * np.arange(1, len(self._waves) + 1)
        return max(abs(value) for value in _extremes(orders * self._waves))

    @cached_property
    def height_range(self) -> tuple[float, float]:
        """Smallest and largest height [m]."""
        return _extremes(self._waves)

    @property
    def shortest_wavelength(self) -> float | None:
        """That of the last wave whose amplitude is not zero [m]; None when flat."""
        orders = np.nonzero(np.array(self.amplitudes))[0]
        return self.wavelength / float(orders[-1] + 1) if len(orders) else None

    @property
    def rms_height(self) -> float:
        """Root of the mean square of the height over a period [m]."""
        return math.sqrt(0.5 * math.fsum(a * a for a in self.amplitudes))


def _extremes(waves: NDArray[np.complex128]) -> tuple[float, float]:
    """Smallest and largest value of the imaginary part of the sum of waves_k exp(i k x)."""
    orders = np.arange(1, len(waves) + 1)
    count = 1 << int(16 * len(waves) - 1).bit_length()

    def sampled(power: int) -> Array:
        spectrum = np.zeros(count // 2 + 1, dtype=complex)
        spectrum[1 : len(waves) + 1] = -0.5j * count * waves * (1j * orders) ** power
        return np.asarray(np.fft.irfft(spectrum, count))

    value, slope, curvature = (sampled(power) for power in range(3))
    found = []
    for sign in (-1.0, 1.0):
        # From each sample that its neighbours do not exceed to the top of its parabola.
        here = sign * value
        tops = np.nonzero((here >= np.roll(here, 1)) & (here >= np.roll(here, -1)))[0]
        bend = np.minimum(sign * curvature[tops], -1e-300)
        best = tops[np.argsort(here[tops] - 0.5 * slope[tops] ** 2 / bend)[-4:]]
        x = 2.0 * np.pi / count * best
        for _ in range(4):
            motion = waves * np.exp(1j * np.outer(x, orders))
            first, second = (motion @ (1j * orders)).imag, (motion @ -(orders**2.0)).imag
            x = x - np.where(second != 0.0, first / np.where(second != 0.0, second, 1.0), 0.0)
        refined = (waves * np.exp(1j * np.outer(x, orders))).imag.sum(axis=1)
        found.append(sign * max(float((sign * refined).max()), float(here.max())))
    return found[0], found[1]


@dataclass(frozen=True)
class RandomRoughness(Profile):
    r"""Random profile of a self-affine surface, as a Fourier series with random phases.

    .. math:: C(q) \propto \begin{cases} q_r^{-1-2H} & q \le q_r \\ q^{-1-2H} & q_r < q \le q_s
        \end{cases}, \qquad q = 2 \pi / \lambda

    is the power spectral density of the profile. Amplitudes follow it exactly, so that the rms
    height over a period is exact; phases are uniformly distributed, so that heights are normally
    distributed. The same seed gives the same profile.

    Parameters
    ----------
    rms_height : float
        Root of the mean square of the height, zero or above [m], or as a part of the friction
        force.
    hurst_exponent : float
        H from 0 to 1: 0.8 for many machined and worn surfaces.
    roll_off_wavelength : float
        2 pi / q_r, from the cut-off wavelength to the length [m].
    cut_off_wavelength : float
        2 pi / q_s, the shortest [m].
    length : float
        After which the profile repeats [m].
    seed : int
        Zero or above.

    Raises
    ------
    InputError
        For values outside these ranges, or more than 100 000 waves.
    """

    kernel: ClassVar = _fourier

    rms_height: float
    hurst_exponent: float
    roll_off_wavelength: float
    cut_off_wavelength: float
    length: float
    seed: int = 0

    def __post_init__(self) -> None:
        owner = "RandomRoughness"
        require_not_negative(owner, rms_height=self.rms_height)
        lengths = {entry.name: getattr(self, entry.name) for entry in fields(self)
                   if entry.name in ("roll_off_wavelength", "cut_off_wavelength", "length")}
        require_positive(owner, **lengths)
        require_not_negative(owner, hurst_exponent=self.hurst_exponent)
        if self.hurst_exponent > 1.0:
            raise InputError(f"{owner}: hurst_exponent = {self.hurst_exponent!r} must be from 0 "
                             f"to 1.")
        if not self.cut_off_wavelength <= self.roll_off_wavelength <= self.length:
            raise InputError(f"{owner}: roll_off_wavelength = {self.roll_off_wavelength!r} must "
                             f"be from cut_off_wavelength = {self.cut_off_wavelength!r} to "
                             f"length = {self.length!r}.")
        if self.length > _MOST_HARMONICS * self.cut_off_wavelength:
            raise InputError(f"{owner}: cut_off_wavelength = {self.cut_off_wavelength!r} must be "
                             f"at least length / {_MOST_HARMONICS}.")
        if isinstance(self.seed, bool) or not isinstance(self.seed, Integral) or self.seed < 0:
            raise InputError(f"{owner}: seed = {self.seed!r} must be a whole number, zero or "
                             f"above.")
        object.__setattr__(self, "seed", int(self.seed))

    @cached_property
    def series(self) -> FourierSeries:
        """The waves of this profile."""
        # A part of 1e-12 for quotients that are whole but for rounding.
        count = int(self.length / self.cut_off_wavelength * (1.0 + 1e-12))
        q = np.arange(1, count + 1) * (self.roll_off_wavelength / self.length)
        amplitudes = np.maximum(q, 1.0) ** (-0.5 - self.hurst_exponent)
        amplitudes *= self.rms_height / math.sqrt(0.5 * float(amplitudes @ amplitudes))
        phases = np.random.Generator(np.random.PCG64(self.seed)).random(count)
        return FourierSeries(self.length, tuple(amplitudes.tolist()),
                             tuple((2.0 * np.pi * phases).tolist()))

    def parameters(self) -> Array:
        """Those of the series."""
        return self.series.parameters()

    @property
    def steepest_slope(self) -> float:
        """Largest magnitude of the slope."""
        return self.series.steepest_slope

    @property
    def height_range(self) -> tuple[float, float]:
        """Smallest and largest height [m]."""
        return self.series.height_range

    @property
    def shortest_wavelength(self) -> float | None:
        """The length over a whole number, near the cut-off wavelength [m]; None when flat."""
        return self.series.shortest_wavelength
