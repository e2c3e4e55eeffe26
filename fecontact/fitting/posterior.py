"""Posterior distribution of fitted parameters by Markov chains of emcee."""

import pickle
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_count, as_path, require_kind
from fecontact.core.errors import AnalysisError, FecontactError, InputError, ModelWarning
from fecontact.core.extras import optional
from fecontact.core.progress import counting_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.fitting.evaluations import require_picklable, unpacked
from fecontact.fitting.problem import Problem
from fecontact.fitting.result import Fit
from fecontact.study.fit_section import values_of
from fecontact.sweeps.executors import opened

# Autocorrelation times that a chain should last (Foreman-Mackey et al., 2013), and that are left
# out at its beginning; draws of a first position; largest deviation of first positions in parts of
# the ranges.
_LONG, _WARM, _DRAWS, _SPREAD = 50.0, 5.0, 20, 0.25


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Posterior(Summarised):
    """Samples of the posterior distribution of the parameters of a fit.

    Attributes
    ----------
    fit : Fit
        Fit at which the chains begin.
    chain : (k, w, p) array
        Values of p parameters over k steps of w walkers, in the units of the parameters.
    log_density : (k, w) array
        Logarithm of the posterior density, without its constant.
    autocorrelation_time : (p,) array
        Integrated autocorrelation time of each parameter, in steps.
    discarded : int
        Number of steps left out before the chain.
    acceptance : float
        Fraction of proposed steps that were accepted.
    """

    fit: Fit
    chain: Array
    log_density: Array
    autocorrelation_time: Array
    discarded: int
    acceptance: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.fit.names

    @property
    def samples(self) -> Array:
        """Values (k w, p) of the parameters, all walkers together."""
        return self.chain.reshape(-1, self.chain.shape[2])

    @property
    def places(self) -> Array:
        """Places (k w, p) of the samples in the ranges of the parameters."""
        return np.column_stack([[one.place(value) for value in column] for one, column in zip(
            self.fit.problem.parameters, self.samples.T.tolist(), strict=True)])

    @property
    def effective(self) -> float:
        """Number of independent samples, k w over the longest autocorrelation time."""
        return len(self.samples) / float(np.max(self.autocorrelation_time))

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the samples."""
        return np.atleast_2d(np.cov(self.samples, rowvar=False))

    @property
    def correlation(self) -> Array:
        """Correlation (p, p) of the parameters, on the scale of each."""
        return np.atleast_2d(np.corrcoef(self.places, rowvar=False))

    def quantile(self, part: float) -> dict[str, float]:
        """Values by name below which a part of the samples lies.

        Parameters
        ----------
        part : float
            Probability; 0.5 gives medians.

        Raises
        ------
        InputError
            If it is not above 0 and below 1.
        """
        _require_part("quantile: part", part)
        return dict(zip(self.names, np.quantile(self.samples, part, axis=0).tolist(), strict=True))

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Credible intervals by name, with equal probabilities below and above.

        Parameters
        ----------
        level : float
            Probability with which they contain the parameter.

        Raises
        ------
        InputError
            If it is not above 0 and below 1.
        """
        _require_part("intervals: level", level)
        low, high = self.quantile(0.5 - 0.5 * level), self.quantile(0.5 + 0.5 * level)
        return {name: (low[name], high[name]) for name in self.names}

    def bands(self, level: float = 0.95, draws: int = 200) -> list[tuple[Array, Array]]:
        """Lower and upper limits of the predicted numbers of each data set.

        They hold the uncertainty of the parameters, not the noise of the data.

        Parameters
        ----------
        level : float
            Probability.
        draws : int
            Number of samples, evenly spaced along the chain, at which the model is evaluated.
        """
        _require_part("bands: level", level)
        as_count(draws, "bands: draws", 2)
        problem, places = self.fit.problem, self.places
        chosen = np.unique(np.linspace(0, len(places) - 1, draws).astype(int))
        low, high = np.quantile([problem.predicted(places[k]) for k in chosen],
                                [0.5 - 0.5 * level, 0.5 + 0.5 * level], axis=0)
        return [(low[part], high[part]) for part in problem.parts]

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence if the chain is shorter than 50 autocorrelation times."""
        steps, longest = self.discarded + len(self.chain), float(np.max(self.autocorrelation_time))
        if steps >= _LONG * longest:
            return ()
        needed = f"; take steps = {int(np.ceil(_LONG * longest))} or more" if np.isfinite(
            longest) else ""
        return (f"The chain of {steps} steps is shorter than {_LONG:g} autocorrelation times of "
                f"{longest:.3g} steps: quantiles are rough{needed}.",)

    def rows(self, level: float = 0.95) -> list[tuple[str, str, str, str]]:
        """Rows of a table: name, median, limits of the interval."""
        median = self.quantile(0.5)
        return [(name, f"{median[name]:.5g}", f"{low:.5g}", f"{high:.5g}")
                for name, (low, high) in self.intervals(level).items()]

    def summary(self) -> list[tuple[str, str]]:
        """Medians with intervals, length of the chain, acceptance and notes."""
        steps, walkers, _ = self.chain.shape
        return [*((name, f"{median}, 95 % from {low} to {high}")
                  for name, median, low, high in self.rows()),
                ("samples", f"{walkers} walkers, {steps} steps after {self.discarded}, "
                            f"{self.effective:.0f} independent ones"),
                ("acceptance", f"{self.acceptance:.2f}"), *(("note", one) for one in self.notes)]

    def table(self) -> dict[str, Any]:
        """Quantiles, correlation and lengths as plain numbers and texts, for files."""
        median, deviations = self.quantile(0.5), np.sqrt(np.diag(self.covariance)).tolist()
        return {
            "parameters": {name: {"median": median[name], "deviation": deviation,
                                  "low": low, "high": high}
                           for (name, (low, high)), deviation in zip(
                               self.intervals().items(), deviations, strict=True)},
            "correlation": self.correlation.tolist(), "discarded": self.discarded,
            "steps": len(self.chain), "walkers": self.chain.shape[1],
            "autocorrelation_time": self.autocorrelation_time.tolist(),
            "acceptance": self.acceptance, "notes": list(self.notes)}


def posterior(
    fit: Fit, *, steps: int = 2000, walkers: int | None = None, seed: int = 0,
    workers: int | None = 1, executor: Executor | None = None,
    folder: str | Path | None = None, overwrite: bool = False,
    progress: bool | Callable[[int, int], None] | None = None,
) -> Posterior:
    r"""Sample the posterior distribution of the parameters of a fit.

    The density over the p places u in the ranges is :math:`\exp(-\chi^2(u) / 2)` for independent
    normal errors with the stated deviations. Deviations that were estimated with nu degrees of
    freedom, from noise or as :math:`s^2 = \chi_0^2 / \nu` from the n residuals (nu = n - p), have
    an unknown factor that is integrated out, of the distribution of their estimate: :math:`(1 +
    (\chi^2 - \chi_0^2) / (\nu s^2))^{-(\nu + p)/2}`. Of linear models this is the distribution of
    Student, as of the intervals of the fit. The prior density is constant
    over u, thus over the logarithm of parameters with ``scale="log"``, and zero outside of the
    ranges and where the model fails. Walkers begin about the best values with the covariance of
    the fit; five autocorrelation times are discarded.

    Parameters
    ----------
    fit : Fit
        Result of :func:`fecontact.fit` with ``loss="linear"``.
    steps : int
        Steps of each walker; each evaluates the model once.
    walkers : int, optional
        Number of walkers, at least 2 p; by default 4 p, at least 16.
    seed : int
        Seed of the random numbers.
    workers, executor
        Processes for the walkers; see :func:`fecontact.fit`.
    folder, overwrite
        Folder of ``posterior.h5``: chains that were cancelled, or too short, go on there.
    progress : bool or callable, optional
        True for a bar; a function is called with the numbers of finished and of all steps.

    Raises
    ------
    InputError, AnalysisError, MissingLibraryError
        For a robust loss, a file of other chains, a model that fails all about the best values,
        and without emcee (``pip install 'fecontact[posterior]'``).

    Notes
    -----
    emcee: Foreman-Mackey, Hogg, Lang and Goodman (2013), PASP 125, 306.
    """
    require_kind("posterior", Fit, fit=fit)
    size = len(fit.names)
    as_count(steps, "posterior: steps", 2)
    walkers = as_count(max(4 * size, 16) if walkers is None else walkers, "posterior: walkers",
                       2 * size)
    as_count(seed, "posterior: seed", 0)
    if fit.options.loss != "linear":
        raise InputError(f"posterior: the fit has loss = {fit.options.loss!r}, which is no "
                         f"likelihood; fit with loss = 'linear'.")
    emcee = optional("emcee", "A posterior distribution")
    density: Callable[[Array], float] = _Density(
        fit.problem, fit.chi_square, fit.deviation_scale, fit.deviation_freedom)
    several = executor is not None or workers != 1
    if several:
        require_picklable(fit.problem)
        density = _Sent(pickle.dumps(density))
    with (opened(executor, workers) if several else nullcontext() as pool,
          shown(progress, lambda: counting_bar("Sampling")) as tell):
        sampler = emcee.EnsembleSampler(
            walkers, size, density, pool=None if pool is None else pool.executor,
            backend=_backend(emcee, fit, walkers, seed, folder, overwrite))
        done = sampler.iteration
        state = sampler.get_last_sample() if done else _first(emcee, fit, sampler, seed)
        for k, _ in enumerate(sampler.sample(state, iterations=max(steps - done, 0),
                                             skip_initial_state_check=True)):
            if tell is not None:
                tell(done + k + 1, steps)
    found = _result(emcee, fit, sampler, steps)
    for note in found.notes:
        warnings.warn(f"posterior: {note}", ModelWarning, stacklevel=2)
    return found


@dataclass(frozen=True, eq=False)
class _Density:
    """Logarithm of the posterior density over the places u (p,).

    Attributes
    ----------
    problem : Problem
    least : float
        Sum of squares of the weighted residuals at the best values.
    scale, freedom : float
        Factor of the deviations, and degrees of freedom with which they were estimated.
    """

    problem: Problem
    least: float
    scale: float
    freedom: float

    def __call__(self, u: Array) -> float:
        if (u < 0.0).any() or (u > 1.0).any():
            return -np.inf
        try:
            off = self.problem.whitened(self.problem.predicted(u) - self.problem.measured)
        except FecontactError:
            return -np.inf
        rise = (float(off @ off) - self.least) / self.scale / self.scale
        if not np.isfinite(self.freedom) or rise < 0.0:
            return -0.5 * rise * (1.0 + len(u) / self.freedom)
        return -0.5 * (self.freedom + len(u)) * float(np.log1p(rise / self.freedom))


@dataclass(frozen=True)
class _Sent:
    """Density in processes, which unpack it once."""

    body: bytes

    def __call__(self, u: Array) -> float:
        return float(unpacked(self.body)(u))


def _first(emcee: Any, fit: Fit, sampler: Any, seed: int) -> Any:
    """First positions of the walkers at which the model can be evaluated."""
    rng = np.random.default_rng(seed)
    with np.errstate(divide="ignore"):
        spread = np.minimum(1.0 / fit.singular_values, _SPREAD)[:, None] * fit.directions
    places = np.empty((sampler.nwalkers, sampler.ndim))
    density = np.full(sampler.nwalkers, -np.inf)
    for draw in range(_DRAWS):
        failed = ~np.isfinite(density)
        if not failed.any():
            break
        # Each draw lies nearer to the best values; what leaves the ranges is reflected.
        u = fit.places + 0.8**draw * rng.standard_normal((failed.sum(), sampler.ndim)) @ spread
        places[failed] = np.clip(1.0 - np.abs(1.0 - np.abs(u)), 0.0, 1.0)
        density[failed] = sampler.compute_log_prob(places[failed])[0]
    else:
        raise AnalysisError("posterior: the model fails at places about the best values of the "
                            "fit; narrow the ranges of the parameters.")
    return emcee.State(places, log_prob=density,
                       random_state=np.random.RandomState(seed).get_state())


def _backend(emcee: Any, fit: Fit, walkers: int, seed: int, folder: Any, overwrite: bool) -> Any:
    """Chains in memory, or in a file whose chains must be of the same fit."""
    if folder is None:
        return emcee.backends.Backend()
    file = as_path(folder, "a posterior") / "posterior.h5"
    file.parent.mkdir(parents=True, exist_ok=True)
    if overwrite:
        file.unlink(missing_ok=True)
    backend = emcee.backends.HDFBackend(str(file))
    key = f"{fit.problem.key()} {walkers} {seed} {fit.places.tobytes().hex()}"
    if not file.exists():
        backend.reset(walkers, len(fit.names))
        with backend.open("a") as stream:
            stream.attrs["key"] = key
        return backend
    stored = None
    if backend.initialized:
        with backend.open() as stream:
            stored = stream.attrs.get("key")
    if stored != key:
        raise InputError(f"{file} holds chains of another fit, seed or number of walkers, or was "
                         f"not written whole; give another folder, or replace it with overwrite = "
                         f"True.")
    return backend


def _result(emcee: Any, fit: Fit, sampler: Any, steps: int) -> Posterior:
    places = sampler.get_chain()[:steps]
    with np.errstate(divide="ignore", invalid="ignore"):
        times = emcee.autocorr.integrated_time(places, tol=0)
    times = np.where(np.isfinite(times), np.maximum(times, 1.0), np.inf)
    discarded = int(min(np.ceil(_WARM * times.max()), steps // 2))
    moved = (np.diff(places, axis=0) != 0.0).any(axis=2)
    flat = places[discarded:].reshape(-1, places.shape[2])
    chain = np.array([values_of(fit.problem.parameters, u) for u in flat])
    return Posterior(fit, chain.reshape(-1, *places.shape[1:]),
                     np.array(sampler.get_log_prob()[discarded:steps]), times, discarded,
                     float(moved.mean()))


def _require_part(what: str, part: Any) -> None:
    if not (isinstance(part, int | float) and 0.0 < part < 1.0):
        raise InputError(f"{what} = {part!r} must be above 0 and below 1.")
