"""Ground profiles as Fourier series."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError, require_positive
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.data_columns import numbers
from fecontact.laws.ground.profile import Profile
from fecontact.laws.signatures import ground_profile


@ground_profile
def fourier(xi, p):
    """Height from level, n, lambda, then the factors of sine and cosine of each wave."""
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
    r"""A sum of waves whose lengths are integer fractions of one length.

    .. math:: y = \sum_{k=1}^{n} A_k \sin(2 \pi k \xi / \lambda + \varphi_k)

    Harmonics are computed as powers of the first, so that many waves are cheap.

    Parameters
    ----------
    wavelength : float
        Period lambda of the ground, positive [m].
    amplitudes : (n,) sequence
        Amplitudes A_k from the longest wave to the shortest; heights [m], or parts of the friction
        force.
    phases : (n,) sequence, optional
        Phases phi_k [rad]; zero by default.
    """

    kernel: ClassVar = fourier

    wavelength: Annotated[float, Unit("m")]
    amplitudes: Annotated[tuple[float, ...], Unit("m")]
    phases: Annotated[tuple[float, ...], Unit("rad")] = ()

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
        """Wavelength of the last wave whose amplitude is not zero [m]; None when flat."""
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
        # Refine each local maximum of the samples by its parabola.
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
