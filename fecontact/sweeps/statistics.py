"""Statistics of samples: moments, quantiles and Sobol indices, with confidence intervals."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.sweeps.table import SweepTable

QUANTILES = (0.05, 0.5, 0.95)
_RESAMPLES = 2000


@dataclass(frozen=True)
class Estimate:
    """A value and the bounds of its confidence interval, infinite if it has none."""

    value: float
    low: float
    high: float


@read_only_arrays
@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Sobol indices of d parameters.

    Attributes
    ----------
    first : mapping of parameter to Estimate
        Fraction of the variance due to the parameter alone.
    total : mapping of parameter to Estimate
        Fraction due to the parameter alone or in interaction with others.
    samples : int
        Number of base samples used.
    labels : mapping of parameter to str
        Labels of the parameters for axes; those of :meth:`SweepTable.label`.
    """

    first: Mapping[str, Estimate]
    total: Mapping[str, Estimate]
    samples: int
    labels: Mapping[str, str] = field(default_factory=dict)


def statistics(
    values: ArrayLike, *, confidence: float = 0.95, seed: int = 0
) -> dict[str, Estimate]:
    """Mean, standard deviation and the quantiles 5 %, 50 % and 95 % of N samples.

    Confidence intervals: Student's t for the mean, the bias-corrected and accelerated bootstrap
    for the standard deviation, order statistics (distribution-free) for the quantiles. They hold
    for independent samples and are conservative for means over a Latin hypercube or a Sobol
    sequence.

    Parameters
    ----------
    values : (N,) array
        NaN, the value of failed cases, is ignored.
    confidence : float
        Probability with which an interval holds the true value.
    seed : int
        Seed of the bootstrap.

    Raises
    ------
    InputError
        For fewer than three samples, or a confidence that is not between 0 and 1.
    """
    from scipy import stats

    x = as_floats(values, "The values of statistics").ravel()
    x = x[np.isfinite(x)]
    if len(x) < 3:
        raise InputError(f"Statistics need at least 3 successful cases, not {len(x)}.")
    _require_confidence(confidence)
    mean, std = float(x.mean()), float(x.std(ddof=1))
    half = std / np.sqrt(len(x)) * float(stats.t.ppf(0.5 + 0.5 * confidence, len(x) - 1))
    found = {"mean": Estimate(mean, mean - half, mean + half),
             "std": Estimate(std, std, std)}
    if std > 1e-12 * abs(mean):
        interval = stats.bootstrap((x,), _spread, confidence_level=confidence, method="BCa",
                                   n_resamples=_RESAMPLES, vectorized=True, batch=100,
                                   rng=np.random.default_rng(seed)).confidence_interval
        found["std"] = Estimate(std, float(interval.low), float(interval.high))
    for part in QUANTILES:
        interval = stats.quantile_test(x, p=part).confidence_interval(confidence)
        ends = [end if np.isfinite(end) else sign * np.inf for end, sign in
                ((float(interval.low), -1.0), (float(interval.high), 1.0))]
        found[f"{100 * part:g} %"] = Estimate(float(np.quantile(x, part)), ends[0], ends[1])
    return found


def _spread(x: Array, axis: int = -1) -> Array:
    return np.asarray(np.std(x, ddof=1, axis=axis))


def sobol_indices(
    table: SweepTable, name: str, *, confidence: float = 0.95, seed: int = 0
) -> SobolIndices:
    """Sobol indices of a summary of a sweep with ``method = "sensitivity"``.

    Parameters
    ----------
    table : SweepTable
        Table of the sweep; base samples with a failed case are ignored.
    name : str
        Name of a summary or any other column.
    confidence : float
        Probability with which a (bootstrap percentile) interval contains the true value.
    seed : int
        Seed of the bootstrap.

    Raises
    ------
    InputError
        If the sweep is of another method, or too few cases succeeded.
    """
    require_kind("sobol_indices", SweepTable, table=table)
    names = tuple(table.parameters)
    first, total, samples = indices_of(table.column(name), len(names), confidence=confidence,
                                       seed=seed)
    return SobolIndices(dict(zip(names, first, strict=True)), dict(zip(names, total, strict=True)),
                        samples, {parameter: table.label(parameter) for parameter in names})


def indices_of(
    values: ArrayLike, parameters: int, *, confidence: float = 0.95, seed: int = 0
) -> tuple[list[Estimate], list[Estimate], int]:
    """First-order and total indices of d parameters, and the number of base samples used.

    ``values`` (N (d + 2),) belong to the samples A, B and AB_i, which is A with parameter i from
    B. With f reduced by its mean, ``S_i = <f_B (f_ABi - f_A)> / Var`` and
    ``T_i = <(f_A - f_ABi)^2> / (2 Var)`` (Saltelli et al., Computer Physics Communications 181
    (2010) 259).
    """
    f = np.array(values, dtype=float)
    _require_confidence(confidence)
    if parameters < 1 or f.ndim != 1 or f.size % (parameters + 2):
        raise InputError(f"Sobol indices of {parameters} parameters need samples in blocks of "
                         f"{parameters + 2}, from method = 'sensitivity', not {f.size} cases.")
    f = f.reshape(parameters + 2, -1)
    f = f[:, np.isfinite(f).all(axis=0)]
    samples = f.shape[1]
    if samples < 8:
        raise InputError(f"Sobol indices need at least 8 successful base samples, not "
                         f"{samples}.")
    found = _indices(f)
    rng = np.random.default_rng(seed)
    again = np.array([_indices(f[:, rng.integers(samples, size=samples)])
                      for _ in range(_RESAMPLES // 2)])
    ends = np.quantile(again, [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence], axis=0)
    return (*([Estimate(float(found[kind, i]), float(ends[0, kind, i]), float(ends[1, kind, i]))
               for i in range(parameters)] for kind in range(2)), samples)


def _indices(f: Array) -> Array:
    A, B, mixed = f[0], f[1], f[2:]
    mean, variance = f[:2].mean(), f[:2].var()
    if not variance > 0.0:
        return np.zeros((2, len(mixed)))
    return np.array([((B - mean) * (mixed - A)).mean(axis=1),
                     0.5 * ((A - mixed) ** 2).mean(axis=1)]) / variance


def _require_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise InputError(f"confidence = {confidence!r} must lie between 0 and 1.")
