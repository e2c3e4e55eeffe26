"""Random ground profiles."""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from numbers import Integral
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.errors import InputError, require_not_negative, require_positive
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.ground.fourier_series import FourierSeries, fourier
from fecontact.laws.ground.profile import Profile

_MOST_HARMONICS = 100_000


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
        Root mean square of the height, zero or above [m], or relative to the friction force.
    hurst_exponent : float
        H from 0 to 1: 0.8 for many machined and worn surfaces.
    roll_off_wavelength : float
        2 pi / q_r, from the cut-off wavelength to the length [m].
    cut_off_wavelength : float
        2 pi / q_s, the shortest [m].
    length : float
        Period of the profile [m].
    seed : int
        Zero or above.
    """

    kernel: ClassVar = fourier

    rms_height: Annotated[float, Unit("m")]
    hurst_exponent: float
    roll_off_wavelength: Annotated[float, Unit("m")]
    cut_off_wavelength: Annotated[float, Unit("m")]
    length: Annotated[float, Unit("m")]
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
        # Allow for rounding of integer quotients by 1e-12.
        count = int(self.length / self.cut_off_wavelength * (1.0 + 1e-12))
        q = np.arange(1, count + 1) * (self.roll_off_wavelength / self.length)
        amplitudes = np.maximum(q, 1.0) ** (-0.5 - self.hurst_exponent)
        amplitudes *= self.rms_height / math.sqrt(0.5 * float(amplitudes @ amplitudes))
        phases = np.random.Generator(np.random.PCG64(self.seed)).random(count)
        return FourierSeries(self.length, tuple(amplitudes.tolist()),
                             tuple((2.0 * np.pi * phases).tolist()))

    def parameters(self) -> Array:
        """Parameters of the Fourier series."""
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
        """Length divided by an integer, near the cut-off wavelength [m]; None when flat."""
        return self.series.shortest_wavelength
