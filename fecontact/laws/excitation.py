"""Excitation at B and loads."""

import math
from dataclasses import dataclass, field
from numbers import Integral
from typing import Annotated, Literal

from fecontact.core.errors import (
    InputError,
    choices,
    nearest,
    require_choice,
    require_finite,
    require_not_negative,
)
from fecontact.core.units import Unit
from fecontact.laws.signals.harmonic import Harmonic, Signal

_COMPONENTS = ("x", "y", "phi")


@dataclass(frozen=True)
class Drive:
    r"""Base excitation of B through springs and dashpots (4.1-8..11).

    .. math:: F_{Bx} = c_x (x_B - u_x(t)) + b_x x_B', \qquad u_x(t) = x_0 \sin w_E t

    acts on the body in -x, and likewise in y; u_x may be another motion. By default the dashpots
    act on the absolute velocity of B, as here; relative ones on ``x_B' - u_x'``, as where spring
    and dashpot share their driven end.

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
    motion_x, motion_y : Signal, optional
        u_x(t), u_y(t) [m], instead of the harmonic motion.
    dashpots : 'absolute' or 'relative'
        Whether the dashpots act on the velocity of B, or on that relative to the driven end.

    Raises
    ------
    InputError
        For values outside these ranges, an amplitude and a motion in the same direction, or
        unknown dashpots.
    """

    stiffness_x: Annotated[float, Unit("N/m")] = 0.0
    stiffness_y: Annotated[float, Unit("N/m")] = 0.0
    damping_x: Annotated[float, Unit("N s/m")] = 0.0
    damping_y: Annotated[float, Unit("N s/m")] = 0.0
    amplitude_x: Annotated[float, Unit("m")] = 0.0
    amplitude_y: Annotated[float, Unit("m")] = 0.0
    angular_frequency: Annotated[float, Unit("rad/s")] = 0.0
    motion_x: Annotated[Signal | None, Unit("m")] = None
    motion_y: Annotated[Signal | None, Unit("m")] = None
    dashpots: Literal["absolute", "relative"] = "absolute"

    def __post_init__(self) -> None:
        require_not_negative(
            "Drive", stiffness_x=self.stiffness_x, stiffness_y=self.stiffness_y,
            damping_x=self.damping_x, damping_y=self.damping_y,
            angular_frequency=self.angular_frequency,
        )
        require_choice("Drive", "dashpots", self.dashpots, ("absolute", "relative"))
        require_finite("Drive", amplitude_x=self.amplitude_x, amplitude_y=self.amplitude_y)
        for component, motion, amplitude in (
                ("x", self.motion_x, self.amplitude_x), ("y", self.motion_y, self.amplitude_y)):
            if motion is None:
                continue
            _require_signal("Drive", f"motion_{component}", motion)
            if amplitude != 0.0:
                raise InputError(f"Drive: amplitude_{component} = {amplitude!r} cannot be "
                                 f"combined with motion_{component}; give one of them.")
        if self.motion_x is not None and self.motion_y is not None and self.angular_frequency:
            raise InputError(f"Drive: angular_frequency = {self.angular_frequency!r} has no "
                             f"effect beside motion_x and motion_y; leave it out.")

    @property
    def motions(self) -> tuple[Signal, Signal]:
        """Motions of the driven ends of the springs in x and y [m]."""
        w = self.angular_frequency
        return (self.motion_x or Harmonic(self.amplitude_x, w),
                self.motion_y or Harmonic(self.amplitude_y, w))

    @property
    def moves(self) -> tuple[bool, bool]:
        """Whether the driven ends in x and y act on B, by a spring or a relative dashpot."""
        relative = self.dashpots == "relative"
        return (bool(self.stiffness_x or (relative and self.damping_x)),
                bool(self.stiffness_y or (relative and self.damping_y)))

    @property
    def frequency_hz(self) -> float:
        """Frequency of the excitation [Hz]; zero without one.

        That of the harmonic motion if it has an amplitude, else the lower one of motion_x and
        motion_y, else w_E / (2 pi).
        """
        given = [motion for motion in (self.motion_x, self.motion_y) if motion is not None]
        harmonic = self.angular_frequency > 0.0 and (self.amplitude_x or self.amplitude_y)
        if harmonic or not given:
            return self.angular_frequency / (2.0 * math.pi)
        return min((motion.frequency_hz for motion in given if motion.frequency_hz is not None),
                   default=0.0)


@dataclass(frozen=True)
class PointLoad:
    """Time-dependent force or moment on the body at a point.

    Parameters
    ----------
    point : str or int
        'B', 'C' or a further named point; a contact node by its number from 0.
    component : 'x', 'y' or 'phi'
        A force along +x, along +y (away from the ground), or a moment counter-clockwise.
    signal : Signal
        Its history [N], [N m].

    Raises
    ------
    InputError
        For an unknown component, or an invalid point or signal.
    """

    point: str | int = "C"
    component: Literal["x", "y", "phi"] = "y"
    signal: Signal = field(kw_only=True)

    def __post_init__(self) -> None:
        if isinstance(self.point, Integral) and not isinstance(self.point, bool):
            object.__setattr__(self, "point", int(self.point))
        elif not isinstance(self.point, str):
            raise InputError(f"PointLoad: point = {self.point!r} must be the name of a point or "
                             f"the number of a contact node.")
        if self.component not in _COMPONENTS:
            raise InputError(f"PointLoad: component = {self.component!r} must be one of "
                             f"{choices(_COMPONENTS)}"
                             f"{nearest(str(self.component), _COMPONENTS)}.")
        _require_signal("PointLoad", "signal", self.signal)


@dataclass(frozen=True)
class Load:
    """Constant load ``[0, -normal, 0]`` on the body at C (4.1-6), and time-dependent loads.

    Parameters
    ----------
    normal : float
        F_N0, positive towards the ground [N].
    forces : sequence of PointLoad
        Further forces and moments.

    Raises
    ------
    InputError
        For values that are not finite, or forces that are not PointLoad.
    """

    normal: Annotated[float, Unit("N")] = 0.0
    forces: tuple[PointLoad, ...] = ()

    def __post_init__(self) -> None:
        require_finite("Load", normal=self.normal)
        given = self.forces
        if not isinstance(given, tuple | list) or not all(
                isinstance(force, PointLoad) for force in given):
            raise InputError(f"Load: forces = {given!r} must be a list of PointLoad.")
        object.__setattr__(self, "forces", tuple(given))


def _require_signal(owner: str, name: str, given: object) -> None:
    if not isinstance(given, Signal):
        raise InputError(f"{owner}: {name} = {given!r} must be a Signal, such as "
                         f"Harmonic(amplitude, angular_frequency).")
