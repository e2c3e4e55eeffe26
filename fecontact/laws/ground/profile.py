"""Base class of ground profiles."""

import math
from dataclasses import dataclass, fields
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.compiled import CompiledLaw, kernel
from fecontact.core.docstrings import InheritsDocumentation
from fecontact.core.errors import require_finite, require_not_negative, require_positive
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Unit
from fecontact.laws.signatures import ground_at, ground_profile


@kernel
def _shape(address: int, xi: Vector, p: Vector, out: Matrix) -> None:
    for k in range(len(xi)):
        out[k, 0], out[k, 1], out[k, 2] = ground_at(address)(xi[k], p)


@dataclass(frozen=True)
class Profile(InheritsDocumentation):
    """Base class of profiles y(xi): a frozen dataclass with a compiled ``ground_profile``.

    Height, slope and curvature are continuous. The first parameter of every kernel is a level that
    is added to the height: zero for heights, one for a factor 1 + y of the friction force. A
    user-defined profile sets ``kernel`` and overrides methods as required.

    Raises
    ------
    InputError
        For values outside these ranges, or that do not fit together.
    """

    kernel: ClassVar[CompiledLaw]

    def parameters(self) -> Array:
        """Parameters of the kernel: the level 0, then by default the fields in their order."""
        return np.array([0.0, *(getattr(self, entry.name) for entry in fields(self))])

    @property
    def steepest_slope(self) -> float:
        """Largest magnitude of the slope y'."""
        raise NotImplementedError

    @property
    def height_range(self) -> tuple[float, float]:
        """Smallest and largest height."""
        raise NotImplementedError

    @property
    def shortest_wavelength(self) -> float | None:
        """Shortest wavelength [m]; None when flat."""
        raise NotImplementedError

    @property
    def flat(self) -> bool:
        """Whether the height is the same everywhere."""
        return self.shortest_wavelength is None

    def shape(self, xi: ArrayLike) -> Array:
        """Heights, slopes and curvatures (..., 3) at abscissae (...,) [m]."""
        places = as_floats(xi, "The abscissae of a profile")
        out = np.empty((places.size, 3))
        _shape(self.kernel.address, places.ravel(), self.parameters(), out)
        return out.reshape(*places.shape, 3)

    def height(self, xi: ArrayLike) -> Array:
        """Heights (...,) at abscissae (...,) of the ground's own frame [m]."""
        return self.shape(xi)[..., 0].copy()


@ground_profile
def _flat(xi, p):
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
def _sine(xi, p):
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
        Amplitude y_A, zero or above; a height [m], or a part of the friction force.
    wavelength : float
        Wavelength lambda_w, positive [m].
    phase : float
        Phase phi [rad].
    """

    kernel: ClassVar = _sine

    amplitude: Annotated[float, Unit("m")]
    wavelength: Annotated[float, Unit("m")]
    phase: Annotated[float, Unit("rad")] = 0.0

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
