"""Excitation at B and loads."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Integral, Real
from typing import Annotated, Any, Literal

import numpy as np

from fecontact.core.checks import as_direction, as_floats, as_place, require_kind
from fecontact.core.errors import (
    InputError,
    require_choice,
    require_finite,
    require_not_negative,
)
from fecontact.core.tables import Unset
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Brief, Unit
from fecontact.laws.signals.harmonic import Constant, Harmonic, Signal

AXES = ("x", "y", "z")
BOUNDARY_STRESSES = ("pressure", "shear", "shear_across")
_BASE = tuple(f"base_acceleration_{axis}" for axis in AXES)
_SUPPORTS = tuple(f"{part}_{axis}" for part in ("stiffness", "damping") for axis in AXES)
_MOTIONS = tuple((f"motion_{axis}", f"amplitude_{axis}") for axis in AXES)
_COMPONENTS = ("x", "y", "z", "phi", "phi_x", "phi_y", "phi_z")
_NO_STRESS = Unset()


@dataclass(frozen=True, repr=False)
class Drive(Brief):
    r"""Base excitation of B through springs and dashpots (4.1-8..11).

    .. math:: F_{Bx} = c_x (x_B - u_x(t)) + b_x x_B', \qquad u_x(t) = x_0 \sin 2 \pi f_E t

    acts on the body in -x, and likewise in y and, of solids, in z; u_x may be another motion. By
    default the dashpots act on the absolute velocity of B, as here; relative ones on ``x_B' -
    u_x'``, as where spring and dashpot share their driven end.

    Parameters
    ----------
    stiffness_x, stiffness_y, stiffness_z : float
        Stiffnesses c_x, c_y, c_z of the springs at B, zero or above [N/m].
    damping_x, damping_y, damping_z : float
        Damping b_x, b_y, b_z of the dashpots at B, zero or above [N s/m].
    amplitude_x, amplitude_y, amplitude_z : float
        Amplitudes x_0, y_0, z_0 of the driven ends [m].
    frequency_hz : float
        Excitation frequency f_E, zero or above [Hz].
    motion_x, motion_y, motion_z : Signal, optional
        Motions u_x(t), u_y(t), u_z(t) of the driven ends [m], instead of the harmonic motion.
    dashpots : 'absolute' or 'relative'
        Velocity on which the dashpots act: that of B, or that of B relative to the driven end.

    Raises
    ------
    InputError
        For values outside these ranges, an amplitude and a motion in the same direction, or
        unknown dashpots.
    """

    stiffness_x: Annotated[float, Unit("N/m")] = 0.0
    stiffness_y: Annotated[float, Unit("N/m")] = 0.0
    stiffness_z: Annotated[float, Unit("N/m")] = field(default=0.0, kw_only=True)
    damping_x: Annotated[float, Unit("N s/m")] = 0.0
    damping_y: Annotated[float, Unit("N s/m")] = 0.0
    damping_z: Annotated[float, Unit("N s/m")] = field(default=0.0, kw_only=True)
    amplitude_x: Annotated[float, Unit("m")] = 0.0
    amplitude_y: Annotated[float, Unit("m")] = 0.0
    amplitude_z: Annotated[float, Unit("m")] = field(default=0.0, kw_only=True)
    frequency_hz: Annotated[float, Unit("Hz")] = 0.0
    motion_x: Annotated[Signal | None, Unit("m")] = None
    motion_y: Annotated[Signal | None, Unit("m")] = None
    motion_z: Annotated[Signal | None, Unit("m")] = field(default=None, kw_only=True)
    dashpots: Literal["absolute", "relative"] = "absolute"

    def __post_init__(self) -> None:
        given = vars(self)
        require_not_negative("Drive", frequency_hz=self.frequency_hz,
                             **{name: given[name] for name in _SUPPORTS})
        require_choice("Drive", "dashpots", self.dashpots, ("absolute", "relative"))
        require_finite("Drive", **{name: given[name] for _, name in _MOTIONS})
        for name, amplitude in _MOTIONS:
            motion = given[name]
            if motion is None:
                continue
            _require_signal("Drive", name, motion)
            if given[amplitude] != 0.0:
                raise InputError(f"Drive: {amplitude} = {given[amplitude]!r} cannot be combined "
                                 f"with {name}; give one of them.")
        if self.motion_x is not None and self.motion_y is not None and self.frequency_hz and (
                self.motion_z is not None or not self.amplitude_z):
            raise InputError(f"Drive: frequency_hz = {self.frequency_hz!r} has no effect "
                             f"beside motion_x and motion_y; leave it out.")

    @property
    def stiffness(self) -> tuple[float, float, float]:
        """c_x, c_y and c_z [N/m]."""
        return self.stiffness_x, self.stiffness_y, self.stiffness_z

    @property
    def damping(self) -> tuple[float, float, float]:
        """b_x, b_y and b_z [N s/m]."""
        return self.damping_x, self.damping_y, self.damping_z

    @cached_property
    def motions(self) -> tuple[Signal, Signal, Signal]:
        """Motions of the driven ends of the springs in x, y and z [m]."""
        f = self.frequency_hz
        return (self.motion_x or Harmonic(self.amplitude_x, f),
                self.motion_y or Harmonic(self.amplitude_y, f),
                self.motion_z or Harmonic(self.amplitude_z, f))

    @property
    def moves(self) -> tuple[bool, bool, bool]:
        """Whether the driven ends in x, y and z act on B, by a spring or a relative dashpot."""
        relative = self.dashpots == "relative"
        x, y, z = (bool(c or (relative and b))
                   for c, b in zip(self.stiffness, self.damping, strict=True))
        return x, y, z

    @property
    def in_space(self) -> bool:
        """True if the drive acts along z."""
        return bool(self.stiffness_z or self.damping_z or self.amplitude_z
                    or self.motion_z is not None)

    @property
    def fundamental_hz(self) -> float:
        """Frequency of the excitation [Hz]; zero without one.

        That of the harmonic motion if it has an amplitude, else the lowest one of motion_x,
        motion_y and motion_z, else f_E.
        """
        given = [motion for motion in (self.motion_x, self.motion_y, self.motion_z)
                 if motion is not None]
        harmonic = self.frequency_hz > 0.0 and (
            self.amplitude_x or self.amplitude_y or self.amplitude_z)
        if harmonic or not given:
            return self.frequency_hz
        return min((motion.fundamental_hz for motion in given if motion.fundamental_hz is not None),
                   default=0.0)


@dataclass(frozen=True, repr=False)
class PointLoad(Brief):
    """Force or moment on the body at a point, constant or in time.

    Parameters
    ----------
    point : str, int, (x, y) or (x, y, z)
        'B', 'C' or a further named point; a contact node by its number from 0; or a place in the
        body [m].
    component : 'x', 'y', 'phi', or a direction (x, y) or (x, y, z)
        A force along +x, along +y (away from the ground), or along a direction, whose length does
        not change it; or a moment counter-clockwise. On solids
        'x', 'y', 'z' (away from the ground), or moments 'phi_x', 'phi_y', 'phi_z'; at contact nodes
        along their first and second tangent and their normal.
    signal : float or Signal
        Its history, or its constant value [N], [N m].

    Raises
    ------
    InputError
        For an unknown component, a direction of length zero, or an invalid point or signal.
    """

    point: Annotated[str | int | Coordinates, Unit("m")] = "C"
    component: Literal["x", "y", "z", "phi", "phi_x", "phi_y", "phi_z"] | Coordinates = "y"
    signal: float | Signal = field(kw_only=True)

    def __post_init__(self) -> None:
        if isinstance(self.point, Integral) and not isinstance(self.point, bool):
            object.__setattr__(self, "point", int(self.point))
        elif isinstance(self.point, tuple | list):
            object.__setattr__(self, "point", as_place(self.point, "PointLoad: point"))
        elif not isinstance(self.point, str):
            raise InputError(f"PointLoad: point = {self.point!r} must be the name of a point, the "
                             f"number of a contact node, or a place (x, y), in space (x, y, z).")
        if isinstance(self.component, tuple | list | np.ndarray):
            object.__setattr__(self, "component",
                               as_direction(self.component, "PointLoad: component"))
        else:
            require_choice("PointLoad", "component", self.component, _COMPONENTS)
        if isinstance(self.signal, Real) and not isinstance(self.signal, bool):
            object.__setattr__(self, "signal", Constant(float(self.signal)))
        _require_signal("PointLoad", "signal", self.signal, ", or a number")

    @property
    def moment(self) -> bool:
        """True for a moment, False for a force."""
        return isinstance(self.component, str) and self.component.startswith("phi")

    @property
    def along(self) -> str:
        """The component or direction, in words."""
        if isinstance(self.component, str):
            return self.component
        return f"({', '.join(f'{part:.4g}' for part in self.component)})"

    def suits(self, components: Sequence[str]) -> bool:
        """True if points with these components of displacement can carry this force."""
        if isinstance(self.component, str):
            return self.component in components
        return len(self.component) == sum(len(name) == 1 for name in components)

    def row(self, rows: Array, components: Sequence[str]) -> Array:
        """Row (m,) of the displacement along the force, from rows (k, m) of the components."""
        if isinstance(self.component, str):
            return np.asarray(rows[components.index(self.component)])
        return np.asarray(np.array(self.component) @ rows[: len(self.component)])


@dataclass(frozen=True, repr=False)
class BoundaryLoad(Brief):
    """Uniform pressure and shear on a named boundary of the body, constant or in time.

    They follow neither the motion nor the rotation of the body. The force is the stress times the
    length of the boundary times the thickness of the body.

    Parameters
    ----------
    boundary : str
        Name of a boundary of the mesh.
    pressure : float or Signal
        Along the inward normal: positive presses on the body [Pa].
    shear : float or Signal
        Along the boundary with the body on the left, counter-clockwise around it: to +x on a
        bottom, +y on a right side, -x on a top [Pa]. On a solid along the first tangent of the
        face.
    shear_across : float or Signal
        Along the second tangent of a solid's face [Pa].

    Raises
    ------
    InputError
        For values that are neither finite numbers nor signals, or if none is given; zero may be.
    """

    boundary: str
    pressure: Annotated[float | Signal, Unit("Pa")] = _NO_STRESS
    shear: Annotated[float | Signal, Unit("Pa")] = _NO_STRESS
    shear_across: Annotated[float | Signal, Unit("Pa")] = field(default=_NO_STRESS, kw_only=True)

    def __post_init__(self) -> None:
        require_kind("BoundaryLoad", str, boundary=self.boundary)
        given = {name: getattr(self, name) for name in BOUNDARY_STRESSES}
        for name, value in given.items():
            if not isinstance(value, Signal):
                require_finite("BoundaryLoad", **{name: value})
        if all(isinstance(value, Unset) for value in given.values()):
            raise InputError(f"BoundaryLoad: pressure and shear on '{self.boundary}' are zero; "
                             f"give one of them, or leave the load out.")


@dataclass(frozen=True, repr=False)
class Load(Brief):
    r"""Loads on the body: at C (4.1-6), at points, along boundaries, and on its mass.

    Gravity acts on all mass with the force rho g per volume. Base acceleration is for a body whose
    supports, ground and driven ends are carried by an accelerated base: all displacements are
    relative to the base, in whose frame the inertial force -rho a acts on all mass.

    Parameters
    ----------
    normal : float
        F_N0, positive towards the ground [N]: the constant load ``[0, -normal, 0]`` at C; along -z
        on solids.
    forces : sequence of PointLoad
        Further forces and moments at points.
    gravity : (float, float) or (float, float, float), optional
        Acceleration g in x and y, (0, -9.81) towards ground below the body [m/s^2]; of solids in x,
        y and z.
    base_acceleration_x, base_acceleration_y, base_acceleration_z : Signal, optional
        Acceleration a of the base in the inertial frame [m/s^2].
    boundaries : sequence of BoundaryLoad
        Pressure and shear along boundaries.

    Raises
    ------
    InputError
        For values that are not finite, forces that are not PointLoad, and the like.
    """

    normal: Annotated[float, Unit("N")] = 0.0
    forces: tuple[PointLoad, ...] = ()
    gravity: Annotated[tuple[float, ...] | None, Unit("m/s^2")] = None
    base_acceleration_x: Annotated[Signal | None, Unit("m/s^2")] = None
    base_acceleration_y: Annotated[Signal | None, Unit("m/s^2")] = None
    base_acceleration_z: Annotated[Signal | None, Unit("m/s^2")] = field(
        default=None, kw_only=True)
    boundaries: tuple[BoundaryLoad, ...] = ()

    def __post_init__(self) -> None:
        require_finite("Load", normal=self.normal)
        if self.gravity is not None:
            gravity = as_floats(self.gravity, "Load: gravity")
            if gravity.shape not in ((2,), (3,)) or not np.isfinite(gravity).all():
                raise InputError(f"Load: gravity = {self.gravity!r} must be two finite numbers, "
                                 f"the accelerations in x and y, or of a solid three [m/s^2].")
            require_finite("Load", gravity=float(gravity[np.argmax(np.abs(gravity))]))
            object.__setattr__(self, "gravity", tuple(gravity.tolist()))
        for name, kind in (("forces", PointLoad), ("boundaries", BoundaryLoad)):
            given = getattr(self, name)
            if not isinstance(given, tuple | list) or not all(
                    isinstance(item, kind) for item in given):
                raise InputError(f"Load: {name} = {given!r} must be a list of {kind.__name__}.")
            object.__setattr__(self, name, tuple(given))
        for name in _BASE:
            if getattr(self, name) is not None:
                _require_signal("Load", name, getattr(self, name))

    @property
    def base_accelerations(self) -> tuple[Signal | None, Signal | None, Signal | None]:
        """Accelerations of the base in x, y and z."""
        return self.base_acceleration_x, self.base_acceleration_y, self.base_acceleration_z

    @property
    def signals(self) -> dict[str, Signal]:
        """Signals by dotted name: forces, base acceleration, boundary loads."""
        given: list[tuple[str, Any]] = [
            (f"forces.{k}", force.signal) for k, force in enumerate(self.forces)]
        given += [(name, getattr(self, name))
                  for name in _BASE]
        given += [(f"boundaries.{k}.{name}", getattr(load, name))
                  for k, load in enumerate(self.boundaries) for name in BOUNDARY_STRESSES]
        return {name: value for name, value in given if isinstance(value, Signal)}


def _require_signal(owner: str, name: str, given: object, or_number: str = "") -> None:
    if not isinstance(given, Signal):
        raise InputError(f"{owner}: {name} = {given!r} must be a Signal, such as "
                         f"Harmonic(amplitude, frequency_hz){or_number}.")
