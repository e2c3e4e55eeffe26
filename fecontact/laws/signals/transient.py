"""Signals that are not harmonic: steps, pulses and tables."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from fecontact.core.errors import InputError, require_choice, require_finite, require_positive
from fecontact.core.simd.vectors import select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.data_columns import read_or_given, require_closed, require_resolved
from fecontact.laws.piecewise_polynomial import (
    curve_range,
    linear_curve,
    piecewise,
    piecewise_parameters,
    steep_pieces,
)
from fecontact.laws.signals.base import Signal, between
from fecontact.laws.signatures import signal

_PULSES = ("half-sine", "rectangle", "triangle", "haversine")
_RISE = 0.01


@signal
def _step(t, p):
    return select(t >= p[0], p[1], 0.0), 0.0


@dataclass(frozen=True)
class Step(Signal):
    """A step from zero to a value.

    Integrators end a step at its time. As motion of the drive it makes the force of the springs
    jump; the work of the jump is included in the drive work.

    Parameters
    ----------
    time : float
        Time of the step [s].
    value : float
        Value after the step, in the unit of the quantity.
    """

    kernel: ClassVar = _step

    time: Annotated[float, Unit("s")]
    value: float

    def __post_init__(self) -> None:
        require_finite("Step", time=self.time, value=self.value)

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """The time, if it lies between t0 and t1 [s]."""
        return between(self.time, t0, t1)

    @property
    def largest(self) -> float:
        """Magnitude of the value."""
        return abs(float(self.value))


@signal
def _pulse(t, p):
    amplitude, duration, rise = p[0], p[2], p[3]
    s = t - p[1]
    if s <= 0.0 or s >= duration:
        return 0.0, 0.0
    if p[4] == 0.0:
        w = math.pi / duration
        return amplitude * math.sin(w * s), amplitude * w * math.cos(w * s)
    if p[4] == 3.0:
        w = math.pi / duration
        return amplitude * math.sin(w * s) ** 2, amplitude * w * math.sin(2.0 * w * s)
    falling = s > 0.5 * duration
    sign = -1.0 if falling else 1.0
    x = min((duration - s if falling else s) / rise, 1.0)
    if p[4] == 1.0:
        return amplitude * x * x * (3.0 - 2.0 * x), sign * amplitude * 6.0 * x * (1.0 - x) / rise
    return amplitude * x, sign * amplitude / rise


@dataclass(frozen=True)
class Pulse(Signal):
    r"""A single pulse, zero before and after; with s = (t - t_0) / T from 0 to 1:

    - ``half-sine``: A sin(pi s);
    - ``haversine``: A sin^2(pi s), whose rate is continuous;
    - ``triangle``: A (1 - abs(1 - 2 s));
    - ``rectangle``: A, with flanks A x^2 (3 - 2 x), x from 0 to 1 within the time ``rise``, which
      is part of T; its integral is A (T - rise).

    Parameters
    ----------
    kind : 'half-sine', 'rectangle', 'triangle' or 'haversine'
    duration : float
        Duration T, positive [s].
    start : float
        Start t_0 [s].
    rise : float, optional
        Rise time of a rectangle, above zero and at most T / 2 [s]; by default T / 100.
    """

    kernel: ClassVar = _pulse

    kind: Literal["half-sine", "rectangle", "triangle", "haversine"]
    amplitude: float
    duration: Annotated[float, Unit("s")]
    start: Annotated[float, Unit("s")] = 0.0
    rise: Annotated[float | None, Unit("s")] = None

    def __post_init__(self) -> None:
        require_choice("Pulse", "kind", self.kind, _PULSES)
        require_finite("Pulse", amplitude=self.amplitude, start=self.start)
        require_positive("Pulse", duration=self.duration)
        if self.rise is None:
            return
        if self.kind != "rectangle":
            raise InputError(f"Pulse: rise = {self.rise!r} is for a rectangle; leave it out for "
                             f"kind = '{self.kind}'.")
        require_positive("Pulse", rise=self.rise)
        if self.rise > 0.5 * self.duration:
            raise InputError(f"Pulse: rise = {self.rise!r} must be at most half of duration = "
                             f"{self.duration!r}.")

    @property
    def _rise(self) -> float:
        if self.kind != "rectangle":
            return 0.5 * self.duration
        return _RISE * self.duration if self.rise is None else self.rise

    def parameters(self) -> Array:
        """A, t_0, T, the time of rise, and the index of the kind."""
        return np.array([self.amplitude, self.start, self.duration, self._rise,
                         _PULSES.index(self.kind)], dtype=float)

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Start, end and kinks of the pulse that lie between t0 and t1 [s]."""
        places = [0.0, self.duration]
        if self.kind in ("triangle", "rectangle"):
            places += [self._rise, self.duration - self._rise]
        return between(self.start + np.array(places), t0, t1)


@signal
def _tabulated(t, p):
    value, rate, _ = piecewise(t, p, 0)
    return value, rate


@dataclass(frozen=True)
class Tabulated(Signal):
    """Values at given times, with linear or cubic interpolation.

    Outside the times the end values are held, or the table is repeated. Cubic interpolation is the
    spline with continuous second derivative; its rate at the ends is zero if they are held, and
    periodic if the table is repeated.

    Parameters
    ----------
    times : (N,) sequence
        Ascending [s].
    values : (N,) sequence
        Values at these times; the last of a repeated table must equal the first.
    file : str, optional
        Text or CSV file with columns of times and values, instead of both; lines before the first
        line of numbers are a header. It is read once; then ``file`` is None.
    interpolation : 'linear' or 'cubic'
    outside : 'hold' or 'repeat'
    scale : float
        Factor from the values of the table to the unit of the quantity.

    Raises
    ------
    InputError
        For an invalid table or file, with the position.
    """

    kernel: ClassVar = _tabulated

    times: Annotated[tuple[float, ...], Unit("s")] = ()
    values: tuple[float, ...] = ()
    file: str | None = None
    interpolation: Literal["linear", "cubic"] = "linear"
    outside: Literal["hold", "repeat"] = "hold"
    scale: float = 1.0

    def __post_init__(self) -> None:
        owner = "Tabulated"
        require_choice(owner, "interpolation", self.interpolation, ("linear", "cubic"))
        require_choice(owner, "outside", self.outside, ("hold", "repeat"))
        require_finite(owner, scale=self.scale)
        times, values = read_or_given(owner, self.file, times=self.times, values=self.values,
                                      least=3 if self.interpolation == "cubic" else 2)
        if self.outside == "repeat":
            values = require_closed(owner, "values", values)
        with np.errstate(over="ignore"):
            require_resolved(owner, "times", np.array(times), f"values times scale = "
                             f"{self.scale:g}", self.scale * np.array(values))
        for name, value in (("times", times), ("values", values), ("file", None)):
            object.__setattr__(self, name, value)

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import CubicSpline

        values = tuple(self.scale * value for value in self.values)
        if self.interpolation == "linear":
            return linear_curve(self.times, values)
        return CubicSpline(self.times, values,
                           bc_type="clamped" if self.outside == "hold" else "periodic")

    def parameters(self) -> Array:
        """Number of pieces, whether they repeat, the times and the coefficients."""
        return piecewise_parameters(self._curve, self.outside == "repeat")

    @cached_property
    def _steps(self) -> tuple[float | None, Array]:
        """Period of the smooth pieces, and the times at which steps must end."""
        times = np.array(self.times)
        if self.interpolation == "linear":
            return None, times
        period, steep = steep_pieces(self._curve)
        ends = times[[0, -1]] if self.outside == "hold" else times[:0]
        return period, np.union1d(ends, steep)

    def breakpoints(self, t0: float, t1: float) -> tuple[float, ...]:
        """Times between t0 and t1 at which a linear or a steep cubic piece ends [s].

        Also the ends of a table that are held.
        """
        times, places = np.array(self.times), self._steps[1]
        if self.outside == "hold" or not len(places) or t1 <= t0:
            return between(places, t0, t1)
        period = times[-1] - times[0]
        if places[-1] == times[-1]:
            places = np.union1d(times[:1], places[:-1])
        turns = np.arange(math.floor((t0 - times[-1]) / period),
                          math.ceil((t1 - times[0]) / period) + 1)
        return between(np.add.outer(turns * period, places).ravel(), t0, t1)

    @property
    def shortest_period(self) -> float | None:
        """Period of the harmonic with the range and the steepest rate of the table [s], or None.

        Pieces between breakpoints do not count: all linear ones, and steep cubic ones.
        """
        return self._steps[0]

    @property
    def fundamental_hz(self) -> float | None:
        """Frequency of a repeated table [Hz]; None if the ends are held."""
        return 1.0 / (self.times[-1] - self.times[0]) if self.outside == "repeat" else None

    @property
    def largest(self) -> float:
        """Largest magnitude, also between the times."""
        return max(abs(value) for value in curve_range(self._curve))
