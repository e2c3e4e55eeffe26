"""The cases of a sweep: values of its parameters on grids, from lists, or sampled."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.resources.memory import require_memory, shown_count
from fecontact.core.types import Array
from fecontact.study.sweep_section import Axis, Distribution, Span, SweepSettings

_MOST = 10_000_000  # cases; more are taken for a mistake
_BYTES = 2000.0  # bytes for the values, the key and the row of a case


@dataclass(frozen=True)
class Plan:
    """All cases of a sweep.

    Attributes
    ----------
    names : tuple of str
        Dotted names of the varied parameters.
    rows : tuple of tuples
        Parameter values, one row per case.
    shape : tuple of int or None
        Number of values along each axis of a grid, the last axis varying fastest; otherwise None.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    shape: tuple[int, ...] | None = None


def plan(settings: SweepSettings) -> Plan:
    """Cases described by the settings.

    Raises
    ------
    InputError
        If there are no axes, an axis is empty, or the axes do not suit the method.
    """
    axes, method = settings.axes, settings.method
    if settings.cases:
        # A list of cases is the list of the values on each axis.
        method = "list"
        axes = {name: tuple(case[name] for case in settings.cases) for name in settings.cases[0]}
    if not axes:
        raise InputError("[sweep] has no axes and no cases; name the parameters that change and "
                         "their values, like ground.speed = [0.1, 0.2] in [sweep.axes].")
    for name, axis in axes.items():
        if isinstance(axis, tuple) and not axis:
            raise InputError(f"[sweep.axes]: {name} has no values; give at least one.")
        if isinstance(axis, Span) and axis.count is not None and axis.count > _MOST:
            raise InputError(f"[sweep.axes]: {name} has count = {shown_count(axis.count)} values; "
                             f"at most {_MOST:,} are possible.")
    names = tuple(axes)
    if method in ("grid", "list"):
        given = [_values(name, axis, method) for name, axis in axes.items()]
        counts = tuple(len(values) for values in given)
        if method == "list":
            if len(set(counts)) > 1:
                lengths = ", ".join(f"{name} has {count}" for name, count in
                                    zip(names, counts, strict=True))
                raise InputError(f"[sweep]: method = 'list' needs as many values on every axis, "
                                 f"but {lengths}.")
            return Plan(names, tuple(zip(*given, strict=True)))
        if math.prod(counts) > _MOST:
            raise InputError(f"[sweep]: the grid has {math.prod(counts):,} cases; at most "
                             f"{_MOST:,} are possible, so take fewer values or draw samples.")
        require_memory("[sweep.axes]: the number of cases", math.prod(counts), _BYTES)
        index = np.indices(counts).reshape(len(counts), -1).T
        return Plan(names, tuple(tuple(values[k] for values, k in zip(given, row, strict=True))
                                 for row in index.tolist()), counts)
    if settings.samples is None:
        raise InputError(f"[sweep]: method = '{settings.method}' needs samples, the number of "
                         f"cases to draw.")
    if settings.samples > _MOST:
        raise InputError(f"[sweep]: samples = {shown_count(settings.samples)} must be at most "
                         f"{_MOST:,}.")
    require_memory("[sweep]: samples", settings.samples, _BYTES)
    parts = _draw(settings, len(names), settings.samples)
    columns = [_at(name, axis, parts[:, k]) for k, (name, axis) in enumerate(axes.items())]
    return Plan(names, tuple(zip(*columns, strict=True)))


def _values(name: str, axis: Axis, method: str) -> Sequence[Any]:
    if isinstance(axis, Distribution):
        raise InputError(f"[sweep.axes]: {name} is a distribution, which method = '{method}' "
                         f"cannot use; take 'latin-hypercube', 'sobol', 'random' or "
                         f"'sensitivity', and samples.")
    if not isinstance(axis, Span):
        return axis
    if axis.count is None:
        raise InputError(f"[sweep.axes]: {name} lacks the key 'count', the number of values from "
                         f"{axis.start!r} to {axis.end!r}, which method = '{method}' needs.")
    space = np.geomspace if axis.spacing == "log" else np.linspace
    # Round to short decimals: 0.84, not 0.8400000000000001.
    return [float(f"{value:.12g}") for value in space(axis.start, axis.end, axis.count)]


def _draw(settings: SweepSettings, d: int, samples: int) -> Array:
    """Sample N points in the d-dimensional unit cube, (N, d)."""
    from scipy.stats import qmc

    rng = np.random.default_rng(settings.seed)
    if settings.method == "random":
        return rng.random((samples, d))
    if settings.method == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(d, rng=rng).random(samples))
    power = max(samples - 1, 0).bit_length()
    if settings.method == "sensitivity":
        if samples < 2 or 2**power != samples:
            raise InputError(f"[sweep]: samples = {samples} must be a power of two, at least 2, "
                             f"for method = 'sensitivity'.")
        both = _inside(qmc.Sobol(2 * d, rng=rng).random_base2(power))
        return np.vstack([both[:, :d], both[:, d:],
                          *(_exchanged(both[:, :d], both[:, d:], k) for k in range(d))])
    return _inside(qmc.Sobol(d, rng=rng).random_base2(power)[:samples])


def _inside(numbers: Array) -> Array:
    # The quantile 0 of an unbounded distribution is infinite.
    return np.clip(numbers, 0.5**33, 1.0 - 0.5**33)


def _exchanged(first: Array, second: Array, k: int) -> Array:
    mixed = first.copy()
    mixed[:, k] = second[:, k]
    return mixed


def _at(name: str, axis: Axis, parts: Array) -> list[Any]:
    """Quantiles of the distribution of a parameter."""
    if isinstance(axis, tuple):
        return [axis[k] for k in np.minimum((parts * len(axis)).astype(int), len(axis) - 1)]
    if isinstance(axis, Span):
        if axis.spacing == "log":
            return list(np.exp(np.log(axis.start) + parts * np.log(axis.end / axis.start))
                        .tolist())
        return list((axis.start + parts * (axis.end - axis.start)).tolist())
    return list(frozen(axis).ppf(parts).tolist())


def frozen(axis: Distribution) -> Any:
    """The frozen scipy distribution."""
    from scipy import stats

    p = axis.parameters
    match axis.distribution:
        case "normal":
            return stats.norm(p["mean"], p["std"])
        case "lognormal":
            spread = math.log1p((p["std"] / p["mean"]) ** 2)
            return stats.lognorm(math.sqrt(spread), scale=p["mean"] * math.exp(-0.5 * spread))
        case "gamma":
            return stats.gamma((p["mean"] / p["std"]) ** 2, scale=p["std"] ** 2 / p["mean"])
        case "truncated-normal":
            ends = [(p[end] - p["mean"]) / p["std"] for end in ("low", "high")]
            return stats.truncnorm(*ends, loc=p["mean"], scale=p["std"])
        case "uniform":
            return stats.uniform(p["low"], p["high"] - p["low"])
        case "loguniform":
            return stats.loguniform(p["low"], p["high"])
        case "triangular":
            width = p["high"] - p["low"]
            return stats.triang((p["mode"] - p["low"]) / width, loc=p["low"], scale=width)
        case "beta":
            return stats.beta(p["a"], p["b"], loc=p["low"], scale=p["high"] - p["low"])
        case _:
            return stats.weibull_min(p["shape"], scale=p["scale"])
