"""Fit of a model to data from several starts, on several processes, kept in files."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_count, as_path, require_kind
from fecontact.core.errors import (
    AnalysisError,
    FecontactError,
    InputError,
    choices,
    require_positive,
)
from fecontact.core.progress import counting_bar, shown
from fecontact.core.tables import from_table
from fecontact.core.types import Array
from fecontact.fitting.data import FitData
from fecontact.fitting.evaluations import Evaluator, searched
from fecontact.fitting.problem import LOSSES, Problem
from fecontact.fitting.result import Fit, FitStart
from fecontact.fitting.search import Found, SearchOptions, fitted
from fecontact.study.fit_section import FitParameter, values_of
from fecontact.study.study import Study
from fecontact.system.contact_system import ContactSystem

# Ratio of the sum of squares to its expectation from which on units are doubted, and part of it
# that another unit must leave.
_DOUBTFUL, _BETTER = 4.0, 0.5
Progress = Callable[[int, int], None]


def fit(
    model: ContactSystem | Study | str | Path, parameters: Mapping[str, Any],
    data: FitData | Sequence[FitData], *, starts: int = 1, seed: int = 0, loss: str = "linear",
    loss_scale: float = 3.0, exact: bool = True, workers: int | None = 1,
    executor: Executor | None = None, folder: str | Path | None = None, overwrite: bool = False,
    progress: bool | Progress | None = None,
) -> Fit:
    """Fit parameters of a model to measurements by weighted least squares.

    ``fit(system, {"friction.friction_coefficient": (0.1, 1.0)}, LoopData(x, force, 2.0))``

    Parameters
    ----------
    model : ContactSystem, Study or path of a study
        The model.
    parameters : mapping of dotted name to FitParameter, (low, high) or table
        Parameters to find, by the names of :meth:`ContactSystem.with_` or of a study.
    data : FitData or sequence of FitData
        Measurements of any kinds, with their standard deviations.
    starts : int
        Number of starts: the first guess, then places that fill the ranges evenly.
    seed : int
        Seed of these places.
    loss : 'linear', 'soft_l1', 'huber' or 'cauchy'
        The last three heed outliers less.
    loss_scale : float
        Residual in standard deviations from which on it is an outlier.
    exact : bool
        Whether derivatives are exact where the data have some, else differences.
    workers : int or None
        Processes for starts and differences; None for one per core. The result is the same.
    executor : concurrent.futures.Executor, optional
        In place of processes.
    folder : path, optional
        Folder that stores evaluations: a fit that was cancelled goes on there.
    overwrite : bool
        Whether to replace the evaluations in this folder.
    progress : bool or callable, optional
        True for a bar; a function is called with the numbers of finished and of all starts.

    Raises
    ------
    InputError, AnalysisError
        For names, ranges or data that cannot be used, and if every start fails.
    """
    problem = _problem(model, parameters, data, exact)
    as_count(starts, "fit: starts")
    as_count(seed, "fit: seed", 0)
    if loss not in LOSSES:
        raise InputError(f"fit: loss = {loss!r} must be one of {choices(LOSSES)}.")
    require_positive("fit", loss_scale=loss_scale)
    options = SearchOptions(loss, float(loss_scale) if loss != "linear" else 1.0)
    files = _files(folder, starts, overwrite)
    begins = _starts(problem.parameters, starts, seed)
    with shown(progress, lambda: counting_bar("Fitting")) as tell:
        known = [Evaluator(problem, file) for file in files]
        found = searched(known, [partial(fitted, one, start, options) for one, start in zip(
            known, begins, strict=True)], executor, workers, tell)
    return _result(options, found, known)


def _problem(model: Any, parameters: Any, data: Any, exact: bool) -> Problem:
    if isinstance(model, str | Path):
        model = Study.read(model)
    require_kind("fit", (ContactSystem, Study), model=model)
    require_kind("fit", Mapping, parameters=parameters)
    if not parameters:
        raise InputError("fit: parameters is empty; name at least one with its range.")
    ranges = []
    for name, given in parameters.items():
        require_kind("fit", str, parameters=name)
        if isinstance(given, tuple | list) and len(given) == 2:
            given = {"low": given[0], "high": given[1]}
        if not isinstance(given, FitParameter):
            if not isinstance(given, Mapping):
                raise InputError(f"fit: {name} = {given!r} must be a range (low, high) or a "
                                 f"FitParameter.")
            given = from_table(FitParameter, given, f"fit: {name}")
        ranges.append(given)
    several = [data] if isinstance(data, FitData) else data
    require_kind("fit", Sequence, data=several)
    for one in several:
        require_kind("fit", FitData, data=one)
    if not several:
        raise InputError("fit: data is empty; give one measurement at least.")
    for one in several:
        require_kind(f"fit: '{one.title}'", (ContactSystem, Study, type(None)), model=one.model)
        require_kind(f"fit: '{one.title}'", Mapping, changes=one.changes)
        if both := set(one.changes) & set(parameters):
            raise InputError(f"fit: '{one.title}' changes {choices(both)}, which is fitted; leave "
                             f"it out of one of both.")
    titles = [one.title for one in several]
    if twice := {title for title in titles if titles.count(title) > 1}:
        raise InputError(f"fit: several data are called {choices(twice)}; give each a name.")
    known = [one.deviations is not None for one in several]
    if any(known) and not all(known):
        without = [one.title for one, has in zip(several, known, strict=True) if not has]
        raise InputError(f"fit: the data {choices(without)} have no deviation, others have; give "
                         f"it for all, or for none.")
    problem = Problem(model, tuple(parameters), tuple(ranges), tuple(several), bool(exact))
    if len(problem.measured) < len(ranges):
        raise InputError(f"fit: {len(ranges)} parameters cannot be found from "
                         f"{len(problem.measured)} numbers.")
    # Names that do not exist are an error of the call, not of a start.
    _ = problem.systems(np.array([one.first for one in ranges]))
    return problem


def _starts(parameters: tuple[FitParameter, ...], count: int, seed: int) -> list[Array]:
    """Places (p,) of the starts: the first guess, then a low-discrepancy sequence."""
    from scipy.stats import qmc

    first = np.array([one.first for one in parameters])
    if count == 1:
        return [first]
    further = qmc.LatinHypercube(len(parameters), rng=np.random.default_rng(seed)).random(count - 1)
    return [first, *further]


def _files(folder: Any, starts: int, overwrite: bool) -> list[Path | None]:
    if folder is None:
        return [None] * starts
    place = as_path(folder, "a fit")
    if place.exists() and not place.is_dir():
        raise InputError(f"fit: folder = {str(place)!r} is a file; name a folder.")
    files = [place / f"start-{k}.jsonl" for k in range(starts)]
    if overwrite:
        for pattern in ("start-*.jsonl", "profile-*.jsonl"):
            for file in place.glob(pattern):
                file.unlink()
    return list(files)


def _result(options: SearchOptions, found: list[Found], evaluators: list[Evaluator]) -> Fit:
    order = sorted(range(len(found)), key=lambda k: found[k].cost)
    best = found[order[0]]
    if best.failed:
        raise AnalysisError(f"fit: the model fails at all {len(found)} starts: {best.message}"
                            if len(found) > 1 else
                            f"fit: the model fails at the start: {best.message}")
    known = evaluators[order[0]]
    problem = known.problem
    jacobian = known.jacobian(best.places)
    residual = known.residual(best.places)
    starts = tuple(FitStart(
        values_of(problem.parameters, one.start), values_of(problem.parameters, one.places),
        2.0 * one.cost, one.message, one.evaluations) for one in (found[k] for k in order))
    return Fit(problem, options, best.places, jacobian, known.predicted(best.places),
               float((residual**2).sum()), starts,
               {f"{title}: {name}": "exact" if exact else "differences"
                for (title, name), exact in known.exact.items()}, tuple(known.kinked()),
               _motion_questions(problem, (best.start, best.places), residual))


def _motion_questions(problem: Problem, places: tuple[Array, ...], residual: Array
                      ) -> tuple[str, ...]:
    """Questions about given motions that fit better a thousand times as large, or as small.

    The model is compared at the start and at the best values, which a wrong unit leads astray.
    """
    found = []
    for one, part in zip(problem.data, problem.parts, strict=True):
        own = float((residual[part] ** 2).sum())
        if problem.weighted and own < _DOUBTFUL * len(residual[part]):
            continue
        for factor in (1e-3, 1e3):
            other = one.rescaled(factor)
            if other is not None and _least(replace(problem, data=(other,)), places) < (
                    _BETTER * own):
                found.append(f"The motion of '{one.title}' fits better if it is {factor:g} times "
                             f"as large: is it in another unit? Then give units.")
    return tuple(found)


def _least(problem: Problem, places: tuple[Array, ...]) -> float:
    """Least sum of squares of the weighted residuals at some places; infinite if all fail."""
    known, squares = Evaluator(problem), [np.inf]
    for u in places:
        with suppress(FecontactError):
            squares.append(float((known.residual(u) ** 2).sum()))
    return min(squares)
