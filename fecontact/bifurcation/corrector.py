"""Newton's method back to a branch, and what is made at the solution."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.inner_product import weighted_norm
from fecontact.bifurcation.problem import Linearisation, Problem, Settings
from fecontact.errors import AnalysisError

Array = NDArray[np.float64]

# Steps of this relative size that grow again are rounding, as next to branch points.
_ROUNDING = 1e-7


@dataclass(frozen=True, eq=False)
class Solution:
    """A converged point, with all that was made there."""

    u: Array
    linearisation: Linearisation
    tangent: Array
    iterations: int
    values: Mapping[str, Any]
    tests: Mapping[str, float]


def corrected(
    problem: Problem, guess: Array, row: Array, tolerance: float, iterations: int
) -> tuple[Array, Linearisation, int] | None:
    """Newton's method at right angles to a row, from a guess; None where it does not converge."""
    u, before, kept = guess, np.inf, None
    steps: list[Array] = []
    scale = 1.0 + norm(problem, guess)
    for count in range(1, iterations + 1):
        linearisation = problem.linearise(u) if kept is None else problem.evaluate(u)
        rhs = np.append(-linearisation.residual, -(row @ (u - guess)))
        change = (kept or linearisation).solve(row, rhs)
        if kept is not None:
            change = _improved(problem, change, steps)
        size = norm(problem, change)
        if count > 2 and size > before and before <= _ROUNDING * scale:
            return u, linearisation, count
        if not np.isfinite(size) or (count > 2 and size > before):
            return None
        u = u + change
        if kept is None and size <= tolerance * scale:
            return u, linearisation, count
        # With a matrix that is kept the error falls by about the same factor each time.
        if kept is not None and size * size / before <= max(0.1 * tolerance, 1e-13) * scale:
            return u, problem.linearise(u), max(1, count - 2)
        if problem.keeps_matrix:
            keeps = kept is None or size < 0.2 * before
            kept = (kept or linearisation) if keeps else None
            steps = [*steps, change] if keeps else []
        before = size
    return None


def _improved(problem: Problem, change: Array, steps: list[Array]) -> Array:
    """A step with the matrix of the first of ``steps``, corrected by what they taught (Broyden)."""
    weights = problem.weights()
    for step, following in pairwise(steps):
        along = weights * step
        change = change + following * float(along @ change / (along @ step))
    along = weights * steps[-1]
    return np.asarray(change / (1.0 - float(along @ change / (along @ steps[-1]))))


def finished(
    problem: Problem, u: Array, linearisation: Linearisation, iterations: int, row: Array,
    settings: Settings,
) -> Solution:
    """Tangent, stored values and test functions at a converged u.

    Raises
    ------
    AnalysisError
        If there is no finite tangent.
    """
    unit = np.zeros(len(u))
    unit[-1] = 1.0
    tangent = linearisation.solve(row, unit)
    size = norm(problem, tangent)
    if not (np.isfinite(size) and size > 0.0):
        raise AnalysisError("The branch has no direction there: its equations grow beyond all "
                            "numbers.")
    tangent = tangent / size
    values = problem.point(u, linearisation, tangent)
    return Solution(u, linearisation, tangent, iterations, values,
                     _tests(problem, u, linearisation, tangent, values, settings))


def _tests(
    problem: Problem, u: Array, linearisation: Linearisation, tangent: Array,
    values: Mapping[str, Any], settings: Settings,
) -> dict[str, float]:
    found: dict[str, float] = {}
    if settings.locate:
        found |= {"fold": float(tangent[-1]), **problem.tests(u, linearisation, tangent)}
    known = {**values, "parameter": float(u[-1])}
    return found | {name: float(event(known)) for name, event in settings.events.items()}


def norm(problem: Problem, vector: Array) -> float:
    """Length of a vector in the problem's inner product."""
    return float(weighted_norm(problem.weights(), vector))
