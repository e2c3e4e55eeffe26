"""Search for the least squares from one start."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import FecontactError
from fecontact.core.types import Array
from fecontact.fitting.problem import Evaluator, Problem

_TOLERANCE, _EVALUATIONS = 1e-9, 200


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


def search(
    problem: Problem, start: Array, options: SearchOptions, file: Path | None = None,
    free: Array | None = None, evaluator: Evaluator | None = None,
) -> Found:
    """Search from a start; parameters that are not ``free`` keep their places.

    Trial values at which the model fails shorten the step. A start at which it fails is a
    :class:`Found` with the reason.
    """
    from scipy.optimize import least_squares

    known = evaluator or Evaluator(problem, file)
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
            return np.full(len(problem.measured), np.nan)

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
