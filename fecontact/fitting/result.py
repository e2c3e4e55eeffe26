"""Result of a fit: values, covariance, what cannot be found, bands of prediction."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, listed
from fecontact.fitting.data import FitData
from fecontact.fitting.problem import Problem
from fecontact.fitting.search import SearchOptions
from fecontact.measured.assurance import scale_question
from fecontact.study.fit_section import values_of
from fecontact.system.contact_system import ContactSystem

# Standard deviation of a combination of parameters, in parts of their ranges, from which on it
# cannot be found; least component that is named, and least ratio of singular values.
_LOST, _NAMED, _RANK = 0.5, 0.2, 1e-9
_AT_BOUND = 1e-6
_TOGETHER = 0.995  # correlation from which on two parameters are named


@read_only_arrays
@dataclass(frozen=True, eq=False)
class FitStart:
    """One start of a fit.

    Attributes
    ----------
    start, values : (p,) arrays
        Parameters at which the search began and ended.
    chi_square : float
        Sum of squares of the weighted residuals; of a robust loss twice the cost. Infinite if it
        failed.
    message : str
        Reason why the start failed, or did not end; else empty.
    evaluations : int
        Number of evaluations of the model.
    """

    start: Array
    values: Array
    chi_square: float
    message: str
    evaluations: int

    @property
    def failed(self) -> bool:
        """True if the model could not be evaluated at the start."""
        return not np.isfinite(self.chi_square)


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Fit(Summarised):
    r"""Parameters that were fitted to data, with their uncertainties.

    With the weighted Jacobian J of the residuals over the places u of the parameters in their
    ranges (0 at the lower, 1 at the upper bound, on the scale of each), the covariance of u is
    :math:`(J^T J)^{-1}`. Without standard deviations of the data it is multiplied by chi^2 / (n -
    p).

    Attributes
    ----------
    problem : Problem
        Model, names, ranges and data.
    options : SearchOptions
        Loss function.
    places : (p,) array
        Places of the best parameters in their ranges.
    jacobian : (n, p) array
        J at the best parameters, unweighted by the loss.
    predicted : (n,) array
        Numbers of the model at the best parameters.
    chi_square : float
        Sum of squares of the weighted residuals.
    starts : tuple of FitStart
        All starts, the best one first.
    derivatives : mapping
        'exact' or 'differences' for each data set and parameter, ``"history: friction.decay"``.
    kinks : tuple of str
        Parameters whose derivatives to both sides disagree at the best values.
    questions : tuple of str
        Questions about the unit of motions that were given.
    """

    problem: Problem
    options: SearchOptions
    places: Array
    jacobian: Array
    predicted: Array
    chi_square: float
    starts: tuple[FitStart, ...]
    derivatives: Mapping[str, str] = field(default_factory=dict)
    kinks: tuple[str, ...] = ()
    questions: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.problem.names

    @property
    def data(self) -> tuple[FitData, ...]:
        """Data that were fitted."""
        return self.problem.data

    @property
    def estimates(self) -> Array:
        """Best values (p,) in the units of the parameters."""
        return values_of(self.problem.parameters, self.places)

    @property
    def values(self) -> dict[str, float]:
        """Best values by name, as ``with_`` of systems and studies takes them."""
        return dict(zip(self.names, self.estimates.tolist(), strict=True))

    def __getitem__(self, name: str) -> float:
        return float(self.estimates[self._index(name)])

    @property
    def system(self) -> ContactSystem:
        """Model with the best values."""
        return self.problem.system(self.places)

    @property
    def freedom(self) -> int:
        """Degrees of freedom n - p."""
        return len(self.predicted) - len(self.names)

    @property
    def residuals(self) -> Array:
        """Residuals (n,) in standard deviations, of correlated numbers in independent ones."""
        return self.problem.whitened(self.predicted - self.problem.measured)

    @property
    def singular_values(self) -> Array:
        """Singular values (p,) of J, descending: inverse deviations of combinations of u."""
        return self._decomposed()[0]

    @property
    def directions(self) -> Array:
        """Combinations (p, p) of u in rows that belong to the singular values."""
        return self._decomposed()[1]

    def _decomposed(self) -> tuple[Array, Array]:
        from fecontact.fitting.problem import LOSSES

        z = (self.residuals / self.options.loss_scale) ** 2
        weight = np.sqrt(LOSSES[self.options.loss](z))
        J = self.jacobian * weight[:, None]
        _, s, directions = np.linalg.svd(J, full_matrices=len(J) < J.shape[1])
        s = np.concatenate([s, np.zeros(len(directions) - len(s))])
        return s / self.deviation_scale, directions

    @property
    def deviation_scale(self) -> float:
        """Factor of the standard deviations: one where those of the data are known."""
        if self.problem.weighted or self.freedom < 1:
            return 1.0
        return float(np.sqrt(self.chi_square / self.freedom)) or 1e-300

    @property
    def place_covariance(self) -> Array:
        """Covariance (p, p) of the places u; infinite where the data say nothing."""
        s, directions = self._decomposed()
        kept = s > _RANK * max(float(s[0]), 1e-300)
        scaled = directions[kept] / s[kept, None]
        found = scaled.T @ scaled
        lost = np.abs(directions[~kept]).max(axis=0, initial=0.0) > np.sqrt(_RANK)
        found[lost, lost] = np.inf
        return found

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) in the units of the parameters, to first order."""
        slopes = np.array([one.slope(float(value)) for one, value in zip(
            self.problem.parameters, self.estimates, strict=True)])
        return np.asarray(slopes[:, None] * self.place_covariance * slopes)

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations by name, to first order."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> Array:
        """Correlation (p, p) of the parameters; NaN where the data say nothing of one."""
        found = self.place_covariance
        size = np.sqrt(np.diag(found))
        size[~np.isfinite(size)] = np.nan
        with np.errstate(invalid="ignore"):
            return np.asarray(found / np.outer(size, size))

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals by name, symmetric on the scale of each parameter.

        Parameters
        ----------
        level : float
            Probability with which they contain the true value.

        Raises
        ------
        InputError
            If it is not above 0 and below 1.
        """
        reach = self.reach(level) * np.sqrt(np.diag(self.place_covariance))
        with np.errstate(over="ignore", invalid="ignore"):
            return {name: _between(one, float(u), float(off)) for name, one, u, off in zip(
                self.names, self.problem.parameters, self.places, reach, strict=True)}

    def reach(self, level: float, size: int = 1) -> float:
        """Size, in deviations, of the region that contains ``size`` parameters together.

        The root of the quantile of chi square for known deviations, and of ``size F`` for those
        that were estimated, from residuals or from noise: for one parameter Student's quantile.

        Parameters
        ----------
        level : float
            Probability.
        size : int
            Number of parameters.

        Raises
        ------
        InputError
            If the level is not above 0 and below 1.
        """
        from scipy.stats import chi2, f

        if not (isinstance(level, int | float) and 0.0 < level < 1.0):
            raise InputError(f"intervals: level = {level!r} must be above 0 and below 1.")
        known = self.deviation_freedom
        return float(np.sqrt(size * f.ppf(level, size, known) if np.isfinite(known)
                             else chi2.ppf(level, size)))

    @property
    def deviation_freedom(self) -> float:
        """Degrees of freedom of the deviations of the data; infinite if they are known."""
        if self.problem.weighted:
            return self.problem.deviation_freedom
        return float(self.freedom) if self.freedom > 0 else np.inf

    def bands(self, level: float = 0.95) -> list[tuple[Array, Array]]:
        """Lower and upper limits of the predicted numbers of each data set.

        They hold the uncertainty of the parameters, not the noise of the data.

        Parameters
        ----------
        level : float
            Probability.
        """
        s, directions = self._decomposed()
        kept = s > _RANK * max(float(s[0]), 1e-300)
        moved = self.problem.coloured(self.jacobian) @ (
            directions[kept].T / s[kept])
        reach = self.reach(level) * np.linalg.norm(moved, axis=1)
        return [(self.predicted[part] - reach[part], self.predicted[part] + reach[part])
                for part in self.problem.parts]

    @property
    def not_found(self) -> tuple[str, ...]:
        """Combinations of parameters that the data do not determine, in words.

        Their standard deviation is more than half of the ranges. Parameters with logarithmic scale
        combine as products.
        """
        s, directions = self._decomposed()
        found = []
        for value, direction in zip(s, directions, strict=True):
            if value * _LOST > 1.0 and value > _RANK * float(s[0]):
                continue
            parts = {name: float(part) for name, part in zip(self.names, direction, strict=True)
                     if abs(part) > _NAMED * np.abs(direction).max()}
            sign = 1.0 if max(parts.values(), key=abs) > 0.0 else -1.0
            up = [name for name, part in parts.items() if sign * part > 0.0]
            down = [name for name, part in parts.items() if sign * part < 0.0]
            found.append(" and ".join(up) + (
                f" growing while {' and '.join(down)} falls" if down else
                " growing together" if len(up) > 1 else ""))
        return tuple(found)

    @property
    def on_bounds(self) -> tuple[str, ...]:
        """Parameters whose best value is a bound of the range."""
        return tuple(name for name, u in zip(self.names, self.places, strict=True)
                     if min(u, 1.0 - u) < _AT_BOUND)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what to heed: bounds, kinks, failed starts, residuals."""
        found = [f"The data do not determine {one}." for one in self.not_found]
        found += [f"{name} lies on its bound, {self[name]:.4g}; its interval is not valid."
                  for name in self.on_bounds]
        found += [f"The derivatives over {name} to both sides differ: a contact changes its state "
                  f"there, and its interval is a rough one." for name in self.kinks]
        found += self._pairs() + self._unit_questions() + list(self.questions)
        failed = [one for one in self.starts if one.failed]
        if failed:
            found.append(f"{len(failed)} of {len(self.starts)} starts failed: {failed[0].message}")
        if self.starts[0].message:
            found.append(self.starts[0].message)
        if self.problem.weighted and self.freedom > 0:
            from scipy.stats import chi2, f

            ratio, known = self.chi_square / self.freedom, self.deviation_freedom
            if (f.sf(ratio, self.freedom, known) if np.isfinite(known)
                    else chi2.sf(self.chi_square, self.freedom)) < 1e-3:
                found.append(f"The residuals are {np.sqrt(ratio):.2g} times the stated deviations: "
                             f"the model does not reproduce the data, the deviations are too "
                             f"small, or the search ended in a local minimum; intervals are too "
                             f"narrow. Look at the curves; against local minima give narrower "
                             f"ranges, more starts or a shorter record.")
        return tuple(found)

    def _pairs(self) -> list[str]:
        """Sentences on parameters that hardly differ in what they change."""
        found, correlation = [], self.correlation
        for (i, one), (j, other) in combinations(enumerate(self.names), 2):
            value = float(correlation[i, j])
            named = any(one in text and other in text for text in self.not_found)
            if abs(value) > _TOGETHER and not named:
                found.append(f"{one} and {other} can hardly be separated: their correlation is "
                             f"{value:.5f}.")
        return found

    def _unit_questions(self) -> list[str]:
        """Questions about data that are about 1000 times what the model gives."""
        found = []
        for one, part in zip(self.data, self.problem.parts, strict=True):
            for curve in one.curves():
                both = one.measured[curve.part], self.predicted[part][curve.part]
                if all(values.any() for values in both):
                    found.append(scale_question(*both, names=(one.title,)))
        return [question for question in found if question]

    def rows(self, level: float = 0.95) -> list[tuple[str, str, str, str]]:
        """Rows of a table: name, value, limits of the interval."""
        return [(name, f"{self[name]:.5g}", f"{low:.5g}", f"{high:.5g}")
                for name, (low, high) in self.intervals(level).items()]

    def summary(self) -> list[tuple[str, str]]:
        """Values with deviations, chi square, starts and notes."""
        shown = [f"{name} = {value:.4g} +- {self.deviations[name]:.2g}"
                 for name, value in self.values.items()]
        return [("parameters", listed(shown, 6)),
                ("chi square", f"{self.chi_square:.4g} for {self.freedom} degrees of freedom"),
                ("starts", f"{sum(not one.failed for one in self.starts)} of {len(self.starts)}"),
                *(("note", one) for one in self.notes)]

    def table(self) -> dict[str, Any]:
        """All results as plain numbers and texts, for files."""
        return {
            "parameters": {name: {"value": value, "deviation": self.deviations[name],
                                  "low": self.intervals()[name][0],
                                  "high": self.intervals()[name][1]}
                           for name, value in self.values.items()},
            "covariance": self.covariance.tolist(), "correlation": self.correlation.tolist(),
            "singular_values": self.singular_values.tolist(),
            "chi_square": self.chi_square, "freedom": self.freedom,
            "not_found": list(self.not_found), "on_bounds": list(self.on_bounds),
            "derivatives": dict(self.derivatives), "notes": list(self.notes),
            "starts": [{"start": one.start.tolist(), "values": one.values.tolist(),
                        "chi_square": one.chi_square, "message": one.message}
                       for one in self.starts]}

    def _index(self, name: str) -> int:
        if name not in self.names:
            raise InputError(f"The fit has no parameter {name!r}{nearest(str(name), self.names)}; "
                             f"its parameters are: {choices(self.names)}.")
        return self.names.index(name)


def _between(one: Any, u: float, off: float) -> tuple[float, float]:
    """Values at u - off and u + off, beyond the range too."""
    if not np.isfinite(off):
        return (0.0 if one.scale == "log" else -np.inf), np.inf
    try:
        return one.value(u - off), one.value(u + off)
    except OverflowError:
        return 0.0, np.inf
