"""Search for the least squares from one start."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.errors import FecontactError
from fecontact.core.types import Array
from fecontact.fitting.evaluations import Evaluator

_TOLERANCE, _EVALUATIONS = 1e-9, 200
# Searches with deviations that depend on the model, and change of places at which they end.
_PASSES, _SETTLED = 10, 1e-4


@dataclass(frozen=True)
class SearchOptions:
    """Loss function, and limit of evaluations.

    Attributes
    ----------
    loss : str
        'linear', or 'soft_l1', 'huber', 'cauchy', which heed outliers less.
    loss_scale : float
        Residual, in standard deviations, beyond which they are outliers.
    evaluations : int
        Largest number of steps of the search.
    """

    loss: str = "linear"
    loss_scale: float = 1.0
    evaluations: int = _EVALUATIONS


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a search: places (p,), cost, and why it ended; a reason if it failed."""

    start: Array
    places: Array
    cost: float
    message: str
    failed: bool
    trials_failed: int
    evaluations: int


def fitted(known: Evaluator, start: Array, options: SearchOptions) -> Found:
    """Search from a start, again while deviations change that depend on the model.

    The evaluator then has the problem with the last deviations.
    """
    found = search(known, start, options)
    for _ in range(_PASSES):
        if found.failed:
            break
        weighted = known.problem.weighted_at(found.places)
        if weighted is known.problem:
            break
        known.problem, before = weighted, found
        found = search(known, before.places, options)
        found = replace(found, start=start,
                        trials_failed=before.trials_failed + found.trials_failed)
        if np.abs(found.places - before.places).max() < _SETTLED:
            break
    return found


def search(
    known: Evaluator, start: Array, options: SearchOptions, free: Array | None = None,
) -> Found:
    """Search from a start; parameters that are not ``free`` keep their places.

    Trial values at which the model fails shorten the step. A start at which it fails is a
    :class:`Found` with the reason.
    """
    from scipy.optimize import least_squares

    moving = np.ones(len(start), dtype=bool) if free is None else free
    failures = 0

    def whole(part: Array) -> Array:
        u = np.array(start, dtype=float)
        u[moving] = part
        return u

    def residual(part: Array) -> Array:
        nonlocal failures
        try:
            return known.residual(whole(part))
        except FecontactError:
            failures += 1
            # The search shortens its step where residuals are not finite.
            return np.full(len(known.problem.measured), np.nan)

    def jacobian(part: Array) -> Array:
        return known.jacobian(whole(part), moving)[:, moving]

    try:
        known.residual(start)
        if not moving.any():
            return Found(start, start, 0.5 * float((known.residual(start) ** 2).sum()), "", False,
                         0, known.evaluations)
        first = np.clip(start[moving], 1e-9, 1.0 - 1e-9)
        done: Any = least_squares(
            residual, first, jacobian, bounds=(0.0, 1.0), loss=options.loss,
            f_scale=options.loss_scale, xtol=_TOLERANCE, ftol=_TOLERANCE, gtol=_TOLERANCE,
            max_nfev=options.evaluations)
    except FecontactError as error:
        return Found(start, start, np.inf, str(error), True, failures, known.evaluations)
    except ValueError as error:
        if "not finite" not in str(error):
            raise
        return Found(start, start, np.inf, "The model fails beside the start, at a bound.", True,
                     failures, known.evaluations)
    message = "" if done.status > 0 else (
        f"The search did not end within {options.evaluations} steps.")
    return Found(start, whole(done.x), float(done.cost), message, False, failures,
                 known.evaluations)
