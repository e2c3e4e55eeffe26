"""The moving ground."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np

from fecontact.core.checks import as_direction, as_floats, as_pair
from fecontact.core.compiled import CompiledLaw
from fecontact.core.errors import (
    InputError,
    require_choice,
    require_finite,
    require_not_negative,
    require_positive,
)
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Brief, Unit
from fecontact.laws.ground.height_map import HeightMap
from fecontact.laws.ground.motion import (
    GroundMotion,
    HarmonicSpeed,
    SpeedRamp,
    constant_speed,
)
from fecontact.laws.ground.profile import Flat, Profile, Sine

__all__ = ["Ground", "GroundMotion", "HarmonicSpeed", "SpeedRamp"]


@dataclass(frozen=True, repr=False)
class Ground(Brief):
    r"""Ground that moves in +x, by default at constant speed V and with a sine waviness (4.3-1).

    .. math:: y_R(\xi) = y_A \sin(2 \pi \xi / \lambda_w), \qquad \xi = X + x - \int_0^t V\,dt

    is its height [m] below a node of reference abscissa X displaced by x. Other profiles and a
    time-dependent speed are possible. The contact force that belongs to the penetration
    ``u = y_R - y - g`` pushes the body off the slopes:

    .. math:: f_y = F, \qquad f_x = -F\, y_R'(\xi)

    so that ground at rest does no work. Friction stays along x: keep the slope ``2 pi amplitude /
    wavelength`` well below one.

    Parameters
    ----------
    speed : float
        Speed V of the ground in +x [m/s].
    amplitude : float
        Amplitude y_A of the waves, zero or above; zero is flat ground [m].
    wavelength : float
        Wavelength lambda_w, positive [m].
    profile : Profile, optional
        Heights of the ground [m], instead of the sine wave.
    motion : GroundMotion, optional
        Time-dependent speed; by default the constant V.
    friction_variation : Profile, optional
        s(xi): the friction force is multiplied by 1 + s, which must not be negative.
    speed_y : float
        Speed along y, below solids only [m/s].
    motion_y : GroundMotion, optional
        Time-dependent speed along y; by default the constant ``speed_y``.
    rotation_speed : float
        Rotation about the normal, below solids only, positive counter-clockwise from above
        [rad/s]; of flat and even ground. A node meets the velocity of the ground at its own place
        of reference: displacements must be small beside the distance to the axis.
    centre : (float, float)
        Place of the axis of rotation of the ground [m].
    wave_direction : (float, float)
        Direction in x and y along which waves and friction vary below solids; of any length above
        zero, stored with length one.
    height_map : HeightMap, optional
        Heights over x and y below solids, instead of sine and profile.
    normal : 'surface' or 'vertical'
        Direction of the contact force: normal to the surface as above, or always vertical,
        f_x = 0, as in the source. Waves put energy into the body then, even at rest.

    Raises
    ------
    InputError
        For values outside these ranges, both amplitude and profile, a variation that makes
        friction negative, or an unknown normal.
    """

    speed: Annotated[float, Unit("m/s")] = 0.0
    amplitude: Annotated[float, Unit("m")] = 0.0
    wavelength: Annotated[float, Unit("m")] = 2.5e-3
    profile: Annotated[Profile | None, Unit("m")] = None
    motion: GroundMotion | None = None
    friction_variation: Profile | None = None
    normal: Literal["surface", "vertical"] = "surface"
    speed_y: Annotated[float, Unit("m/s")] = 0.0
    motion_y: GroundMotion | None = None
    rotation_speed: Annotated[float, Unit("rad/s")] = 0.0
    centre: Annotated[tuple[float, float], Unit("m")] = (0.0, 0.0)
    wave_direction: tuple[float, float] = (1.0, 0.0)
    height_map: HeightMap | None = None

    def __post_init__(self) -> None:
        require_finite("Ground", speed=self.speed, speed_y=self.speed_y,
                       rotation_speed=self.rotation_speed)
        require_not_negative("Ground", amplitude=self.amplitude)
        require_positive("Ground", wavelength=self.wavelength)
        object.__setattr__(self, "centre", as_pair(self.centre, "Ground: centre"))
        along = as_direction(self.wave_direction, "Ground: wave_direction")
        object.__setattr__(self, "wave_direction",
                           as_pair(along, "Ground: wave_direction"))
        for name, kind in (("profile", Profile), ("motion", GroundMotion),
                           ("friction_variation", Profile), ("motion_y", GroundMotion),
                           ("height_map", HeightMap)):
            given = getattr(self, name)
            if given is not None and not isinstance(given, kind):
                raise InputError(f"Ground: {name} = {given!r} must be a {kind.__name__}.")
        if self.profile is not None and self.amplitude != 0.0:
            raise InputError(f"Ground: amplitude = {self.amplitude!r} cannot be combined with "
                             f"profile; give one of them.")
        if self.height_map is not None and (self.profile is not None or self.amplitude != 0.0):
            raise InputError("Ground: height_map cannot be combined with amplitude or profile; "
                             "give one of them.")
        require_choice("Ground", "normal", self.normal, ("surface", "vertical"))
        if self.rotation_speed and (self.wavy or self.friction_variation is not None):
            raise InputError(f"Ground: rotation_speed = {self.rotation_speed!r} needs flat and "
                             f"even ground; leave out the waves and friction_variation, or let an "
                             f"interface slide.")
        self._require_friction()

    def _require_friction(self) -> None:
        variation = self.friction_variation
        if variation is None:
            return
        low = variation.height_range[0]
        if low < -1.0:
            raise InputError(f"Ground: friction_variation falls to {low:.4g} and would make "
                             f"friction negative; its lowest value must be -1 or above.")
        plain, raised = (variation.kernel.python(0.0, p)[0]
                         for p in (variation.parameters(), self.friction_scale_parameters()))
        if not math.isclose(raised - plain, 1.0, abs_tol=1e-9):
            raise InputError(f"Ground: friction_variation = {variation!r} is not usable: the "
                             f"kernel of a profile must add its first parameter to the height.")

    @cached_property
    def _shape(self) -> Profile | HeightMap:
        if self.height_map is not None:
            return self.height_map
        if self.profile is not None:
            return self.profile
        return Sine(self.amplitude, self.wavelength) if self.amplitude > 0.0 else Flat()

    @property
    def wavy(self) -> bool:
        """Whether the height varies."""
        return not self._shape.flat

    @property
    def in_space(self) -> bool:
        """True if the ground moves or varies along the second tangent, which only solids use."""
        return bool(self.speed_y or self.motion_y is not None or self.rotation_speed
                    or self.wave_direction != (1.0, 0.0) or self.height_map is not None)

    @property
    def steepest_slope(self) -> float:
        """Largest magnitude of the slope of the profile, dimensionless."""
        return self._shape.steepest_slope

    @property
    def height_range(self) -> tuple[float, float]:
        """Smallest and largest height of the profile [m]."""
        return self._shape.height_range

    @property
    def shortest_wavelength(self) -> float | None:
        """Shortest wavelength of profile and variation of friction [m]; None if both are flat."""
        parts = [self._shape, *([self.friction_variation] if self.friction_variation else [])]
        waves = [part.shortest_wavelength for part in parts]
        return min((wave for wave in waves if wave is not None), default=None)

    def height(self, abscissa: ArrayLike, time: float = 0.0) -> Array:
        """Height [m] at abscissae of the inertial frame [m] at a time [s]."""
        require_finite("Ground", time=time)
        return self._profile("height").height(
            as_floats(abscissa, "Ground: abscissa") - self.travel(time))

    def slope(self, abscissa: ArrayLike, time: float = 0.0) -> Array:
        """Slope at abscissae of the inertial frame [m] at a time [s]."""
        require_finite("Ground", time=time)
        places = as_floats(abscissa, "Ground: abscissa") - self.travel(time)
        return self._profile("slope").shape(places)[..., 1].copy()

    def _profile(self, what: str) -> Profile:
        """The profile; InputError for ground whose height depends on x and y."""
        if isinstance(self._shape, HeightMap):
            raise InputError(f"Ground: {what} at abscissae needs a profile, but this ground has a "
                             f"map of heights over x and y; use height_map.shape(x, y).")
        return self._shape

    def travel(self, time: float) -> float:
        """Travel [m] since t = 0 at a time [s]."""
        return float(self.motion_kernel.python(float(time), self.motion_parameters())[0])

    def velocity(self, time: float) -> float:
        """Speed V, positive in +x, at a time [m/s]."""
        return float(self.motion_kernel.python(float(time), self.motion_parameters())[1])

    def largest_speed(self, t0: float, t1: float) -> float:
        """Largest magnitude of the speed from t0 to t1 [m/s]."""
        if self.motion is None:
            return abs(float(self.speed))
        return self.motion.largest_speed(self.speed, t0, t1)

    def largest_acceleration(self, t0: float, t1: float) -> float:
        """Largest magnitude of the acceleration from t0 to t1 [m/s2]."""
        if self.motion is None:
            return 0.0
        return self.motion.largest_acceleration(self.speed, t0, t1)

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Times between t0 and t1 at which the speed has kinks, ascending [s]."""
        return () if self.motion is None else self.motion.breakpoints(t0, t1)

    @property
    def profile_kernel(self) -> CompiledLaw:
        """Compiled profile; flat beside a map of heights."""
        return Flat.kernel if self.height_map is not None else self._shape.kernel

    @property
    def surface_kernel(self) -> CompiledLaw | None:
        """Compiled map of heights; None where a profile gives the height."""
        return None if self.height_map is None else self.height_map.kernel

    def profile_parameters(self) -> Array:
        """Parameters of the compiled profile."""
        return self._shape.parameters()

    @property
    def motion_kernel(self) -> CompiledLaw:
        """Compiled motion: travel and speed."""
        return constant_speed if self.motion is None else self.motion.kernel

    def motion_parameters(self) -> Array:
        """Parameters of the compiled motion."""
        if self.motion is None:
            return np.array([self.speed], dtype=float)
        return self.motion.parameters(self.speed)

    @property
    def friction_scale_kernel(self) -> CompiledLaw | None:
        """Compiled factor 1 + s of friction along the ground; None if it is one."""
        return None if self.friction_variation is None else self.friction_variation.kernel

    def friction_scale_parameters(self) -> Array:
        """Parameters of the compiled factor."""
        if self.friction_variation is None:
            return np.zeros(1)
        parameters = self.friction_variation.parameters()
        parameters[0] += 1.0
        return parameters
