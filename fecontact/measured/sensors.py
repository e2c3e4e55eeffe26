"""Virtual sensors, accelerometers and force gauges: their masses, resonances and noise."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from fecontact.core.checks import as_direction, as_place, require_kind
from fecontact.core.docstrings import InheritsDocumentation
from fecontact.core.errors import (
    InputError,
    choices,
    nearest,
    require_finite,
    require_not_negative,
    require_positive,
)
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.measured.measurement import Channel
from fecontact.reduction.assembly.changed_modes import with_masses
from fecontact.reduction.assembly.links import Spring, relative_row
from fecontact.reduction.modal_basis import ModalBasis

Way = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
_AXES = "xyz"


@dataclass(frozen=True, kw_only=True)
class Sensor(InheritsDocumentation):
    """Base class of virtual sensors: name, sensitivity, mass, noise and resonance.

    The reading is ``sensitivity`` times the true value, filtered by the sensor's own resonance
    (:meth:`filtered`), plus white noise.

    Parameters
    ----------
    name : str
        Name of the channel; by default that of the place.
    node : int, optional
        Number of the node in exported files.
    sensitivity : float
        Reading over true value [-]: 1.02 for a calibration by 2 % too low.
    mass : float
        Mass that the sensor adds to the body at its point [kg]; see :func:`with_sensors`.
    resonance_hz : float, optional
        Undamped frequency of the mounted sensor [Hz]; flat without it.
    resonance_damping : float
        Its damping ratio.
    noise_rms, noise_density : float
        Standard deviation of the noise in the unit of the channel; or its amplitude density, in
        this unit per Hz^(1/2), up to half the sampling rate. Their squares add.

    Raises
    ------
    InputError
        For values out of range.
    """

    name: str = ""
    node: int | None = None
    sensitivity: float = 1.0
    mass: Annotated[float, Unit("kg")] = 0.0
    resonance_hz: Annotated[float | None, Unit("Hz")] = None
    resonance_damping: float = 0.02
    noise_rms: float = 0.0
    noise_density: float = 0.0

    def __post_init__(self) -> None:
        owner = type(self).__name__
        require_kind(owner, str, name=self.name)
        require_finite(owner, sensitivity=self.sensitivity)
        if self.resonance_hz is not None:
            require_positive(owner, resonance_hz=self.resonance_hz)
        require_not_negative(owner, mass=self.mass, noise_rms=self.noise_rms,
                             noise_density=self.noise_density,
                             resonance_damping=self.resonance_damping)

    def true_values(self, run: Trajectory, links: Mapping[str, object]) -> Array:
        """True values (N,) at the output times of a run."""
        raise NotImplementedError

    def channel(self, links: Mapping[str, object]) -> Channel:
        """Name, unit and place."""
        raise NotImplementedError

    def loaded_point(self, links: Mapping[str, object]) -> str | int | Coordinates | None:
        """Point to which the mass belongs."""
        raise NotImplementedError

    def noise(self, rate_hz: float) -> float:
        """Standard deviation of the noise at a sampling rate [Hz]."""
        return math.hypot(self.noise_rms, self.noise_density * math.sqrt(0.5 * rate_hz))

    def filtered(self, values: Array, rate_hz: float) -> Array:
        r"""Values (N,) at a rate [Hz] as the sensor with its resonance gives them.

        .. math:: \frac{w_0^2}{s^2 + 2 D w_0 s + w_0^2}

        by the bilinear transform, exact at w_0.

        Raises
        ------
        InputError
            For a resonance above 0.4 times the rate.
        """
        if self.resonance_hz is None:
            return values
        if self.resonance_hz > 0.4 * rate_hz:
            raise InputError(f"{type(self).__name__}: resonance_hz = {self.resonance_hz:g} is not "
                             f"resolved by outputs at {rate_hz:g} Hz; run with "
                             f"{math.ceil(self.resonance_hz / (0.4 * rate_hz))} times as many, or "
                             f"leave it out for a flat sensor.")
        from scipy.signal import lfilter, lfilter_zi

        # s = (1 - 1/z) / (1 + 1/z) / k, where 1/k = w_0 / tan(w_0 T / 2).
        k = math.tan(math.pi * self.resonance_hz / rate_hz)
        b = np.array([1.0, 2.0, 1.0]) * k**2
        a = np.array([k**2 + 2.0 * self.resonance_damping * k + 1.0, 2.0 * (k**2 - 1.0),
                      k**2 - 2.0 * self.resonance_damping * k + 1.0])
        return np.asarray(lfilter(b / a[0], a / a[0], values,
                                  zi=lfilter_zi(b / a[0], a / a[0]) * values[0])[0])


@dataclass(frozen=True)
class Accelerometer(Sensor):
    """Accelerometer at a point of the body, along a direction that does not turn with it.

    It gives the absolute acceleration [m/s^2], that of a base that accelerates included, without
    gravity.

    Parameters
    ----------
    point : str, int or place
        Named point, number of a contact node on the ground, or place in the body, in m. A sensor
        with a mass needs a named point.
    direction : '+x', '-x', '+y', ..., (x, y) or (x, y, z)
        Direction in which it measures.

    Raises
    ------
    InputError
        For an unknown direction, one of length zero, and values out of range.
    """

    point: str | int | Coordinates = "B"
    direction: Way | Coordinates = "+y"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.point, str | int):
            object.__setattr__(self, "point", as_place(self.point, "Accelerometer: point"))
        if not isinstance(self.direction, str):
            object.__setattr__(self, "direction", as_direction(
                self.direction, "Accelerometer: direction"))
        elif (known := [sign + axis for axis in _AXES for sign in "+-"]) and (
                self.direction not in known):
            raise InputError(f"Accelerometer: direction = {self.direction!r} must be one of "
                             f"{choices(known)}{nearest(self.direction, known)}, or a vector.")

    def true_values(self, run: Trajectory, links: Mapping[str, object]) -> Array:
        """Acceleration (N,) [m/s^2] at the output times of a run."""
        basis = run.system.basis
        d = basis.dimension
        if isinstance(self.point, int) and not basis.ground_nodes[self.point]:
            raise InputError(f"Accelerometer: contact node {self.point} moves relative to another "
                             f"body; give a named point of one body.")
        along = np.zeros(d)
        if isinstance(self.direction, str):
            if (axis := _AXES.index(self.direction[1])) >= d:
                raise InputError(f"Accelerometer: direction = '{self.direction}' does not exist in "
                                 f"the plane; give x or y.")
            along[axis] = 1.0 if self.direction[0] == "+" else -1.0
        elif len(self.direction) != d:
            raise InputError(f"Accelerometer: direction = {self.direction} must have {d} "
                             f"components.")
        else:
            along[:] = self.direction
        found = run.acceleration(self.point)[:, :d] @ along
        for part, signal in zip(along, run.system.load.base_accelerations, strict=False):
            if signal is not None and part:
                found = found + part * signal.history(run.time)[:, 0]
        return np.asarray(found)

    def channel(self, links: Mapping[str, object]) -> Channel:
        """Name, unit and place."""
        way = self.direction if isinstance(self.direction, str) else (
            f"({', '.join(f'{part:.3g}' for part in self.direction)})")
        return Channel(self.name or f"{self.point} {way}", "m/s^2", self.node,
                       self.direction if isinstance(self.direction, str) else "")

    def loaded_point(self, links: Mapping[str, object]) -> str | int | Coordinates | None:
        """Its point."""
        return self.point


@dataclass(frozen=True)
class ForceGauge(Sensor):
    """Force gauge in a spring between two points, such as the stinger of a shaker, or of a load.

    In a spring it gives the force on the first point along the direction of the spring: minus the
    tension, so that pressing is positive. Its mass lies between the gauge and the first point;
    the force on the body itself is then smaller by mass times acceleration. Of a load it gives the
    history of the force, as a hammer does. In N.

    Parameters
    ----------
    link : str, optional
        Name of a :class:`~fecontact.reduction.Spring` between bodies.
    load : int, optional
        Number of a force of the load, from 0, in place of a link.

    Raises
    ------
    InputError
        Unless one of link and load is given, for a mass without a link, and values out of range.
    """

    link: str | None = None
    load: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.link is None) == (self.load is None):
            raise InputError("ForceGauge: give link, the name of a spring, or load, the number of "
                             "a force, and not both.")
        if self.mass and self.link is None:
            raise InputError("ForceGauge: the mass of the gauge of a load is not known to the "
                             "body; leave out mass, or measure in a spring.")

    def _spring(self, links: Mapping[str, object]) -> Spring:
        found = links.get(str(self.link))
        if not isinstance(found, Spring):
            known = [name for name, one in links.items() if isinstance(one, Spring)]
            raise InputError(f"ForceGauge: link = '{self.link}' is no linear spring among the links"
                             f"{nearest(str(self.link), known)}; there are: "
                             f"{choices(known) or 'none'}.")
        return found

    def true_values(self, run: Trajectory, links: Mapping[str, object]) -> Array:
        """Force (N,) [N] at the output times of a run."""
        if self.link is None:
            forces = run.system.load.forces
            assert self.load is not None
            if not 0 <= self.load < len(forces):
                raise InputError(f"ForceGauge: load = {self.load} must be the number of one of the "
                                 f"{len(forces)} forces of the load, from 0.")
            return np.asarray(forces[self.load].signal.history(run.time)[:, 0])  # type: ignore[union-attr]
        spring = self._spring(links)
        row = relative_row(run.system.basis, spring)
        return np.asarray(-(spring.stiffness * (run.modal_coordinates @ row + spring.shortening)
                            + spring.damping * (run.modal_velocities @ row) + spring.preload))

    def channel(self, links: Mapping[str, object]) -> Channel:
        """Name and unit."""
        return Channel(self.name or (f"force in {self.link}" if self.link is not None else
                                     f"force {self.load}"), "N", self.node)

    def loaded_point(self, links: Mapping[str, object]) -> str | int | Coordinates | None:
        """First point of the spring."""
        return None if self.link is None else self._spring(links).first


AnySensor = Accelerometer | ForceGauge


def with_sensors(
    basis: ModalBasis, sensors: Sequence[Sensor], links: Mapping[str, object] | None = None
) -> ModalBasis:
    """The basis with the masses of sensors at their points.

    Parameters
    ----------
    basis : ModalBasis
        Basis of the body, or of several bodies with their links.
    sensors : sequence of Accelerometer and ForceGauge
        Those without mass change nothing.
    links : mapping of name to link, optional
        Links between the bodies, by which force gauges find their point.

    Raises
    ------
    InputError
        For a sensor with a mass whose point has no name, or that does not exist.
    """
    masses: dict[str, float] = {}
    for one in sensors:
        require_kind("with_sensors", Sensor, sensor=one)
        if not one.mass:
            continue
        point = one.loaded_point(links or {})
        if not isinstance(point, str):
            raise InputError(f"with_sensors: a sensor with a mass needs a named point, not "
                             f"{point!r}; name the place in the points of the basis.")
        masses[point] = masses.get(point, 0.0) + one.mass
    return with_masses(basis, masses)
