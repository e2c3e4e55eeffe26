"""Profile likelihood of one parameter: the others are fitted anew at each of its values."""

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_count, as_path, require_kind
from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.fitting.evaluations import Evaluator, searched
from fecontact.fitting.result import Fit
from fecontact.fitting.search import search

_WIDE = 1.5  # reach of the profile, in half widths of the linear interval


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ProfileLikelihood(Summarised):
    """Least sum of squares over one parameter, the others fitted at each value.

    Attributes
    ----------
    name : str
        Name of the parameter.
    values : (k,) array
        Values of the parameter, ascending.
    chi_square : (k,) array
        Least weighted sums of squares, divided by chi^2 / (n - p) of the fit where the data have no
        deviations; NaN where the model fails.
    best : float
        Sum of squares at the best value, scaled alike.
    limit : float
        Rise of chi_square at the ends of the interval.
    level : float
        Probability of the interval.
    """

    name: str
    values: Array
    chi_square: Array
    best: float
    limit: float
    level: float

    @property
    def interval(self) -> tuple[float, float]:
        """Values between which chi_square rises by less than the limit.

        Infinite where the profile does not reach it, which then does not bound the parameter.
        """
        rise = self.chi_square - self.best - self.limit
        known = np.isfinite(rise)
        x, y = self.values[known], rise[known]
        low = int(np.argmin(y)) if len(y) else 0
        ends = [-np.inf, np.inf]
        for side, (a, b) in enumerate(((low, -1), (low, len(y)))):
            step = -1 if side == 0 else 1
            for k in range(a, b - step, step):
                if y[k] <= 0.0 < y[k + step]:
                    part = y[k] / (y[k] - y[k + step])
                    ends[side] = float(x[k] + part * (x[k + step] - x[k]))
                    break
        return ends[0], ends[1]

    def table(self) -> dict[str, Any]:
        """Values, rise of chi square and interval as plain numbers, for files."""
        rise = self.chi_square - self.best
        return {"name": self.name, "values": self.values.tolist(),
                "rise": [float(one) if np.isfinite(one) else None for one in rise],
                "level": self.level,
                "interval": [float(end) if np.isfinite(end) else None for end in self.interval]}

    def summary(self) -> list[tuple[str, str]]:
        """Parameter, its values, and the interval."""
        low, high = self.interval
        return [("parameter", self.name), ("values", f"{self.values[0]:.4g} ... "
                                                     f"{self.values[-1]:.4g}"),
                (f"interval of {100.0 * self.level:g} %", f"{low:.5g} ... {high:.5g}")]


def profile_likelihood(
    fit: Fit, name: str, *, points: int = 11, level: float = 0.95,
    workers: int | None = 1, executor: Executor | None = None,
    folder: str | Path | None = None,
) -> ProfileLikelihood:
    """Profile likelihood of a parameter: an interval that needs no linear model.

    Parameters
    ----------
    fit : Fit
        Result of :func:`fecontact.fit`.
    name : str
        The parameter.
    points : int
        Number of its values, over 1.5 times the linear interval within the range.
    level : float
        Probability of the interval.
    workers, executor
        Processes for both directions and for differences; see :func:`fecontact.fit`.
    folder : path, optional
        Folder that stores evaluations, that of the fit: a profile that was cancelled goes on there.

    Raises
    ------
    InputError
        For another parameter, fewer than five points, or a level out of range.
    """
    require_kind("profile_likelihood", Fit, fit=fit)
    as_count(points, "profile_likelihood: points", 5)
    _ = fit[name]
    if not (isinstance(level, int | float) and 0.0 < level < 1.0):
        raise InputError(f"profile_likelihood: level = {level!r} must be above 0 and below 1.")
    k = fit.names.index(name)
    deviation = float(np.sqrt(fit.place_covariance[k, k]))
    reach = _WIDE * fit.reach(level) * deviation if np.isfinite(deviation) else 1.0
    here = float(fit.places[k])
    places = np.unique(np.append(np.linspace(max(here - reach, 0.0), min(here + reach, 1.0),
                                             points), here))
    free = np.ones(len(fit.names), dtype=bool)
    free[k] = False
    evaluator = Evaluator(fit.problem, None if folder is None else
                          as_path(folder, "a profile") / f"profile-{name}.jsonl")
    scale = fit.deviation_scale
    found = np.full(len(places), np.nan)
    middle = int(np.argmin(np.abs(places - here)))

    def outwards(order: range) -> None:
        """Search from the best value outwards, each time from the end of the search before."""
        u = np.array(fit.places)
        for j in order:
            u[k] = places[j]
            done = search(evaluator, u, fit.options, free)
            if done.failed:
                continue
            u = np.array(done.places)
            found[j] = 2.0 * done.cost / scale / scale

    searched([evaluator], [partial(outwards, order) for order in (
        range(middle, len(places)), range(middle, -1, -1))], executor, workers)
    one = fit.problem.parameters[k]
    return ProfileLikelihood(name, np.array([one.value(float(u)) for u in places]), found,
                   float(np.nanmin(found)), fit.reach(level) ** 2, float(level))
