"""The section ``[fit]``: parameters that are fitted to measurements, and these."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Annotated, Any, Literal

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.tables import convert_fields
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.integrate.initial_state import PointStart, RigidStart
from fecontact.study.sweep_section import leaves


@dataclass(frozen=True)
class FitParameter:
    """Range in which a parameter is sought: ``{ low = 0.1, high = 1.0, scale = "log" }``.

    Parameters
    ----------
    low, high : float
        Bounds, in the unit of the parameter.
    start : float, optional
        First guess; by default the middle of the range on its scale.
    scale : 'linear' or 'log'
        Whether equal steps are equal differences or equal ratios; 'log' suits parameters of which
        the order of magnitude is sought.

    Raises
    ------
    InputError
        For bounds that are not finite or not in this order, a start outside of them, or bounds that
        are not above zero with scale = 'log'.
    """

    low: float
    high: float
    start: float | None = None
    scale: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        for name in ("low", "high", "start"):
            value = getattr(self, name)
            if value is None and name == "start":
                continue
            if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
                raise InputError(f"FitParameter: {name} = {value!r} must be a finite number.")
            object.__setattr__(self, name, float(value))
        if self.scale not in ("linear", "log"):
            raise InputError(f"FitParameter: scale = {self.scale!r} must be 'linear' or 'log'.")
        if not self.low < self.high:
            raise InputError(f"FitParameter: high = {self.high:g} must lie above low = "
                             f"{self.low:g}.")
        if self.scale == "log" and not self.low > 0.0:
            raise InputError(f"FitParameter: low = {self.low:g} must be above zero for scale = "
                             f"'log'.")
        if self.start is not None and not self.low <= self.start <= self.high:
            raise InputError(f"FitParameter: start = {self.start:g} must lie from low = "
                             f"{self.low:g} to high = {self.high:g}.")

    def value(self, place: float) -> float:
        """Value at a place within the range, from 0 at ``low`` to 1 at ``high``."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** place)
        return float(self.low + place * (self.high - self.low))

    def place(self, value: float) -> float:
        """Place of a value within the range, the inverse of :meth:`value`."""
        if self.scale == "log":
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, value: float) -> float:
        """Derivative of the value over the place, at a value."""
        if self.scale == "log":
            return value * math.log(self.high / self.low)
        return self.high - self.low

    @property
    def first(self) -> float:
        """Place of the first guess."""
        return 0.5 if self.start is None else self.place(self.start)


def values_of(parameters: tuple[FitParameter, ...], places: Array) -> Array:
    """Values (p,) at places (p,)."""
    return np.array([one.value(float(place))
                     for one, place in zip(parameters, places, strict=True)])


Kind = Literal["loop", "history", "ring-down", "backbone", "frequencies", "receptance", "response"]
# Keys that a kind needs.
_NEEDED = {"loop": ("file", "against"), "history": ("file",), "ring-down": ("file", "t_end"),
           "backbone": ("file",), "frequencies": ("frequencies_hz",), "receptance": ("file",),
           "response": ("file",)}


@dataclass(frozen=True)
class FitDataSettings:
    """``[[fit.data]]``: one measurement that the model is compared with.

    Parameters
    ----------
    kind : str
        'loop': a force over a displacement, against quasi-static loading; 'history': a channel over
        time, against a run; 'ring-down': a decay over time, evaluated by windows, against a run;
        'backbone': the same decay, against a nonlinear mode; 'frequencies': natural frequencies;
        'receptance': a complex channel over frequency; 'response': amplitudes over frequency,
        against harmonic balance.
    name : str
        Name in tables and pictures; by default the kind.
    file : str, optional
        File of the measurement, as `fecontact data` reads it; relative to the study.
    channel : str, optional
        Channel that is compared; the only one by default.
    against : str, optional
        Channel of the displacement, for a loop.
    units : mapping of channel to unit
        Units in which the file gives channels, in place of its own.
    deviation : float, optional
        Standard deviation of the values, in SI units; of ring-downs and backbones it follows from
        the record. Without any, all follow from the residuals.
    point : str or int
        Point that was measured.
    component : str
        Direction there, 'x', 'y', of solids also 'z', or a rotation.
    quantity : str
        Quantity measured over time: 'displacement', 'velocity', 'acceleration', ...
    t_start, t_end : float, optional
        Part of the record [s]; of a ring-down t_end is also the end of the run of the model.
    initial : 'rest', 'sliding', 'preload', RigidStart, PointStart or list
        State from which the model runs, as ``initial`` of ``[simulation]``; a list is the state
        [q, q', z].
    along : str
        Kind of displacement of a loop: 'motion_x', 'motion_y', 'motion_z' of the drive, or
        'travel', 'travel_y' of the ground.
    frequencies_hz : list, optional
        Measured natural frequencies [Hz].
    modes : list, optional
        Numbers of the modes of the model that they belong to, from 1.
    about : 'none', 'rest' or 'sliding'
        Equilibrium about which the contact is linearised for natural frequencies and receptances.
    frequency_hz : float, optional
        Frequency of the mode of a decay [Hz]; by default that of the highest peak.
    window : float
        Length of the windows of a decay, in periods.
    resample : bool
        Whether to interpolate a decay with uneven times by splines.
    mode : int
        Number of the linear mode of a backbone, from 1.
    harmonics : int
        Number of harmonics, for backbones and responses.
    excitation : str or int
        Point of the force, for a receptance.
    excitation_component : str
        Direction of this force.
    changes : mapping of dotted name to float
        Keys of the study in this measurement: the level of a response, the preload of an assembly.

    Raises
    ------
    InputError
        For keys that a kind needs and that are missing, and for values out of range.
    """

    kind: Kind
    name: str = ""
    file: str | None = None
    channel: str | None = None
    against: str | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    deviation: float | None = None
    point: str | int = "B"
    component: str = "x"
    quantity: str = "displacement"
    t_start: Annotated[float | None, Unit("s")] = None
    t_end: Annotated[float | None, Unit("s")] = None
    initial: Literal["rest", "sliding", "preload"] | RigidStart | PointStart | tuple[float, ...] = (
        "rest")
    along: Literal["motion_x", "motion_y", "motion_z", "travel", "travel_y"] = "motion_x"
    frequencies_hz: Annotated[tuple[float, ...] | None, Unit("Hz")] = None
    modes: tuple[int, ...] | None = None
    about: Literal["none", "rest", "sliding"] = "none"
    frequency_hz: Annotated[float | None, Unit("Hz")] = None
    window: float = 10.0
    resample: bool = False
    mode: int = 1
    harmonics: int = 5
    excitation: str | int = "B"
    excitation_component: str = "x"
    changes: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for key in _NEEDED.get(self.kind, ()):
            if getattr(self, key) is None:
                raise InputError(f"FitDataSettings: kind = '{self.kind}' needs the key '{key}'.")
        if self.deviation is not None and not 0.0 < self.deviation < math.inf:
            raise InputError(f"FitDataSettings: deviation = {self.deviation!r} must be a finite "
                             f"number above zero.")
        if isinstance(self.initial, PointStart):
            self.initial.require_writable("FitDataSettings: initial")


@dataclass(frozen=True)
class PosteriorSettings:
    """``[fit.posterior]``: the posterior distribution of the parameters is sampled too.

    Parameters
    ----------
    steps : int
        Steps of each walker.
    walkers : int, optional
        Number of walkers, at least two for each parameter; by default four for each, at least 16.
    seed : int
        Seed of the random numbers.

    Raises
    ------
    InputError
        For values out of range.
    """

    steps: int = 2000
    walkers: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.steps < 2 or self.seed < 0 or (self.walkers is not None and self.walkers < 2):
            raise InputError(f"PosteriorSettings: steps = {self.steps} must be at least 2, walkers "
                             f"= {self.walkers} at least two for each parameter, seed = "
                             f"{self.seed} zero or above.")


@dataclass(frozen=True)
class FitSettings:
    """``[fit]``: parameters of the study that are fitted to measurements.

    Parameters
    ----------
    parameters : mapping of dotted name to FitParameter
        ``[fit.parameters]``: ranges by the dotted keys of the study,
        ``normal.stiffness = { low = 1e6, high = 1e9, scale = "log" }``.
    data : list of FitDataSettings
        ``[[fit.data]]``: the measurements.
    starts : int
        Number of starts: the first guess, and places that fill the ranges.
    seed : int
        Seed of these places.
    loss : 'linear', 'soft_l1', 'huber' or 'cauchy'
        The last three heed outliers less.
    loss_scale : float
        Residual in standard deviations from which on it is an outlier.
    exact : bool
        Whether derivatives are exact where the data have some, else differences.
    profile : int
        Number of points of the profile likelihood of each parameter; 0 for none, else at least 5.
    posterior : PosteriorSettings, optional
        ``[fit.posterior]``: the posterior distribution is sampled too.

    Raises
    ------
    InputError
        Without parameters or data, and for values out of range.
    """

    parameters: Mapping[str, FitParameter] = field(default_factory=dict)
    data: tuple[FitDataSettings, ...] = ()
    starts: int = 1
    seed: int = 0
    loss: Literal["linear", "soft_l1", "huber", "cauchy"] = "linear"
    loss_scale: float = 3.0
    exact: bool = True
    profile: int = 0
    posterior: PosteriorSettings | None = None

    def __post_init__(self) -> None:
        convert_fields(self)
        if not self.parameters:
            raise InputError("FitSettings: parameters is empty; name at least one with its range, "
                             "like drive.stiffness_x = { low = 1e4, high = 1e6 }.")
        if not self.data:
            raise InputError("FitSettings: data is empty; give one measurement at least.")
        if self.starts < 1 or self.seed < 0 or not self.loss_scale > 0.0:
            raise InputError(f"FitSettings: starts = {self.starts} must be at least 1, seed = "
                             f"{self.seed} zero or above, loss_scale = {self.loss_scale!r} above "
                             f"zero.")
        if self.profile != 0 and self.profile < 5:
            raise InputError(f"FitSettings: profile = {self.profile} must be 0, for none, or at "
                             f"least 5 points.")
        walkers = None if self.posterior is None else self.posterior.walkers
        if walkers is not None and walkers < 2 * len(self.parameters):
            raise InputError(f"FitSettings: posterior.walkers = {walkers} must be at least "
                             f"{2 * len(self.parameters)}, two for each parameter.")
        if self.posterior is not None and self.loss != "linear":
            raise InputError(f"FitSettings: loss = '{self.loss}' is no likelihood; a posterior "
                             f"distribution needs loss = 'linear'.")


def flat_parameters(table: Any) -> Any:
    """``[fit]`` with dotted names in parameters, which TOML may read as nested tables."""
    if not isinstance(table, Mapping) or not isinstance(table.get("parameters"), Mapping):
        return table
    return {**table, "parameters": dict(leaves(table["parameters"], ""))}
