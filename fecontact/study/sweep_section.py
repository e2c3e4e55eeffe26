"""``[sweep]`` of a study file: parameters, their values, and the results stored for each case."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from types import NoneType
from typing import Annotated, Any, Literal

from fecontact.core.checks import require_kind
from fecontact.core.dotted_parameters import flattened
from fecontact.core.errors import InputError, choices, require_positive
from fecontact.core.tables import convert_fields
from fecontact.core.units import Unit

_SUMMARIES = ("largest_displacement", "stick_fraction", "mean_normal_force", "peak_normal_force",
              "friction_power")

_MOST_PERIODS = 100_000  # kept for each case

_PARAMETERS: Mapping[str, tuple[str, ...]] = {
    "normal": ("mean", "std"),
    "lognormal": ("mean", "std"),
    "gamma": ("mean", "std"),
    "truncated-normal": ("mean", "std", "low", "high"),
    "uniform": ("low", "high"),
    "loguniform": ("low", "high"),
    "triangular": ("low", "mode", "high"),
    "beta": ("a", "b", "low", "high"),
    "weibull": ("shape", "scale"),
}


@dataclass(frozen=True)
class Span:
    """Values from ``start`` to ``end``, both included: ``{ start = 0.1, end = 1.0, count = 10 }``.

    Parameters
    ----------
    start, end : float
        In the unit of the parameter.
    count : int, optional
        Number of values, for grids and lists; random samples are uniform over the range.
    spacing : 'linear' or 'log'
        Equal differences or equal ratios.
    """

    start: float
    end: float
    count: int | None = None
    spacing: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        require_kind("Span", Real, start=self.start, end=self.end)
        require_kind("Span", (int, NoneType), count=self.count)
        if self.spacing not in ("linear", "log"):
            raise InputError(f"Span: spacing = {self.spacing!r} must be 'linear' or 'log'.")
        if not (math.isfinite(self.start) and math.isfinite(self.end)):
            raise InputError(f"Span: start = {self.start!r} and end = {self.end!r} must be "
                             f"finite.")
        if self.spacing == "log" and not (self.start > 0.0 and self.end > 0.0):
            raise InputError(f"Span: start = {self.start!r} and end = {self.end!r} must be above "
                             f"zero for spacing = 'log'.")
        if self.count is not None and self.count < 1:
            raise InputError(f"Span: count = {self.count} must be at least 1.")


@dataclass(frozen=True)
class Distribution:
    """An uncertain parameter: ``{ distribution = "normal", mean = 0.5, std = 0.05 }``.

    Parameters
    ----------
    distribution : str
        'normal', 'gamma', 'lognormal' with mean, std; 'truncated-normal' with mean, std, low,
        high; 'uniform', 'loguniform' with low, high; 'triangular' with low, mode, high; 'beta'
        with a, b, low, high; 'weibull' with shape, scale.
    mean, std : float, optional
        Mean and standard deviation of the parameter, not of its logarithm, before truncation.
    low, high : float, optional
        Bounds.
    mode : float, optional
        Most probable value.
    a, b, shape : float, optional
        Dimensionless shape parameters.
    scale : float, optional
        In the unit of the parameter, as are all but the shape parameters.
    """

    distribution: str
    mean: float | None = None
    std: float | None = None
    low: float | None = None
    high: float | None = None
    mode: float | None = None
    a: float | None = None
    b: float | None = None
    shape: float | None = None
    scale: float | None = None

    def __post_init__(self) -> None:
        needed = _PARAMETERS.get(self.distribution)
        if needed is None:
            raise InputError(f"Distribution: distribution = '{self.distribution}' must be one of "
                             f"{choices(_PARAMETERS)}.")
        given = self.parameters
        if set(given) != set(needed):
            raise InputError(f"Distribution: '{self.distribution}' takes the keys "
                             f"{choices(needed)}, not {choices(given)}.")
        for name, value in given.items():
            require_kind("Distribution", Real, **{name: value})
            if not math.isfinite(value):
                raise InputError(f"Distribution: {name} = {value!r} must be finite.")
        require_positive("Distribution", **{name: value for name, value in given.items()
                                            if name in ("std", "a", "b", "shape", "scale")})
        if self.low is not None and self.high is not None:
            if not self.low < self.high:
                raise InputError(f"Distribution: high = {self.high!r} must lie above low = "
                                 f"{self.low!r}.")
            if self.mode is not None and not self.low <= self.mode <= self.high:
                raise InputError(f"Distribution: mode = {self.mode!r} must lie between low = "
                                 f"{self.low!r} and high = {self.high!r}.")
        if self.distribution in ("lognormal", "gamma"):
            require_positive("Distribution", mean=given["mean"])
        if self.distribution == "loguniform":
            require_positive("Distribution", low=given["low"])

    @property
    def parameters(self) -> dict[str, float]:
        """Given parameters by name."""
        names = dict.fromkeys(name for needed in _PARAMETERS.values() for name in needed)
        return {name: value for name in names if (value := getattr(self, name)) is not None}


@dataclass(frozen=True)
class Strobing:
    """Stroboscopic runs: only the states once per period of the excitation are kept.

    Parameters
    ----------
    transient_periods : int
        Periods discarded as transient.
    keep : int
        Periods kept after the transient.
    point : str or int
        Point whose displacement is kept once per period: 'B', 'C', a named point, or the number of
        a contact node.
    component : 'x' or 'y', of solids also 'z'
    """

    transient_periods: int = 100
    keep: int = 64
    point: str | int = "B"
    component: Literal["x", "y", "z"] = "x"

    def __post_init__(self) -> None:
        require_kind("Strobing", int, transient_periods=self.transient_periods, keep=self.keep)
        if self.transient_periods < 0:
            raise InputError(f"Strobing: transient_periods = {self.transient_periods} must be "
                             f"zero or above.")
        if not 1 <= self.keep <= _MOST_PERIODS:
            raise InputError(f"Strobing: keep = {self.keep} must be from 1 to {_MOST_PERIODS}.")


Value = bool | int | float | str | tuple[float, ...]
Axis = Span | Distribution | tuple[Value, ...]


@dataclass(frozen=True)
class SweepSettings:
    """``[sweep]``: many cases of the study.

    Parameters
    ----------
    axes : mapping of dotted name to Span, Distribution or list of values
        ``[sweep.axes]``: the varied parameters, by their dotted keys in the study file, such as
        ``ground.speed = [0.1, 0.2]``.
    cases : list of tables, optional
        ``[[sweep.cases]]``: the cases themselves, each with the same dotted keys and one value for
        each; in place of axes.
    method : str
        'grid': all combinations; 'list': the first values of all axes, then the second ones, ...;
        sampling: 'random', 'latin-hypercube', 'sobol' (a low-discrepancy sequence);
        'sensitivity': samples for Sobol indices.
    samples : int, optional
        Number of samples. For 'sensitivity' a power of two; d parameters take (d + 2) times as
        many cases.
    seed : int
        Seed of the random samples; equal seeds give equal samples.
    summaries : list
        Names of the numbers stored for each case; 'FILE.py:FUNCTION' for a function of your own.
    t_start : float, optional
        Start of the interval that summaries evaluate [s]; the whole run by default.
    keep : 'none', 'histories' or 'fields'
        Whether to write a file for each case, with its motion alone or with fields for ParaView.
    batch : int, optional
        Number of cases in a batch; by default up to 64, fewer in small sweeps.
    strobe : Strobing, optional
        ``strobe = { transient_periods = 100, keep = 64 }``: faster runs without histories, over
        this number of excitation periods instead of up to ``t_end``; 'periods' is then the only
        summary.
    """

    axes: Mapping[str, Axis] = field(default_factory=dict)
    cases: tuple[Mapping[str, Value], ...] = ()
    method: Literal["grid", "list", "random", "latin-hypercube", "sobol", "sensitivity"] = "grid"
    samples: int | None = None
    seed: int = 0
    summaries: tuple[str, ...] = _SUMMARIES
    t_start: Annotated[float | None, Unit("s")] = None
    keep: Literal["none", "histories", "fields"] = "none"
    batch: int | None = None
    strobe: Strobing | None = None

    def __post_init__(self) -> None:
        convert_fields(self)
        self._require_alike()
        for name, count in (("samples", self.samples), ("batch", self.batch)):
            if count is not None and count < 1:
                raise InputError(f"SweepSettings: {name} = {count} must be at least 1.")
        if self.seed < 0:
            raise InputError(f"SweepSettings: seed = {self.seed} must be zero or above.")
        if not self.summaries:
            raise InputError("SweepSettings: summaries is empty; name at least one.")
        if self.strobe is not None and (self.keep != "none" or self.t_start is not None
                                        or self.summaries not in (_SUMMARIES, ("periods",))):
            raise InputError("SweepSettings: strobe keeps no histories, so that keep, t_start and "
                             "summaries other than 'periods' cannot be combined with it.")
        if self.t_start is not None and not math.isfinite(self.t_start):
            raise InputError(f"SweepSettings: t_start = {self.t_start!r} must be finite.")

    def _require_alike(self) -> None:
        """Raise InputError unless all cases have the same keys, and there are no axes besides."""
        if not self.cases:
            return
        if self.axes:
            raise InputError("SweepSettings: cases are listed and axes span them; give one of "
                             "both.")
        if self.method not in ("grid", "list"):
            raise InputError(f"SweepSettings: method = '{self.method}' draws cases from axes; "
                             f"leave it out where cases are listed.")
        for number, case in enumerate(self.cases):
            if not case:
                raise InputError(f"SweepSettings: case {number} has no key; give all cases the "
                                 f"same keys, at least one.")
            if different := set(case) ^ set(self.cases[0]):
                raise InputError(f"SweepSettings: cases 0 and {number} differ in the keys "
                                 f"{choices(sorted(different))}; give all cases the same "
                                 f"keys.")


def flat_axes(table: Any) -> Any:
    """``[sweep]`` with dotted names in axes and cases, which TOML may read as nested tables."""
    if not isinstance(table, Mapping):
        return table
    found = dict(table)
    if isinstance(table.get("axes"), Mapping):
        found["axes"] = dict(leaves(table["axes"], ""))
    if isinstance(table.get("cases"), list | tuple):
        found["cases"] = [flattened(case) if isinstance(case, Mapping) else case
                          for case in table["cases"]]
    return found


def leaves(table: Mapping[str, Any], prefix: str) -> list[tuple[str, Any]]:
    """Values of nested tables by dotted names; tables of numbers and texts alone are values."""
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        # A table that describes an axis holds only numbers and strings.
        if isinstance(value, Mapping) and any(isinstance(item, Mapping | list)
                                              for item in value.values()):
            found += leaves(value, f"{prefix}{key}.")
        else:
            found.append((f"{prefix}{key}", value))
    return found
