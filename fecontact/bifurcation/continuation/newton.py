"""Newton's method back to a branch, and what is made at the solution."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit, weighted_norm, weighted_product
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Linearisation, Problem
from fecontact.core.compiled import kernel
from fecontact.core.errors import AnalysisError, FecontactError, InputError, choices
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array


@kernel
def right_side(residual: Vector, row: Vector, u: Vector, guess: Vector, rhs: Vector) -> None:
    """Fill rhs (N + 1,) with the negative residual (N,) and the negative row (u - guess)."""
    total = 0.0
    for k in range(len(u)):
        total += row[k] * (u[k] - guess[k])
    for k in range(len(residual)):
        rhs[k] = -residual[k]
    rhs[len(residual)] = -total


@kernel
def improve(weights: Vector, steps: Matrix, count: int) -> float:
    """Correct steps[count], made with the matrix of steps[0], by what those before it taught.

    Broyden's update of the matrix, applied as sums over the steps. Returns the step's length.
    """
    change = steps[count]
    for index in range(count):
        step = steps[index]
        part = weighted_product(weights, step, change) / weighted_product(weights, step, step)
        if index + 1 < count:
            following = steps[index + 1]
            for k in range(len(change)):
                change[k] += part * following[k]
        else:
            for k in range(len(change)):
                change[k] /= 1.0 - part
    return weighted_norm(weights, change)


# Step of rounding, in the size of the solution, after which its equations serve as they are.
_AT_REST = 1e-13
# Smallest factor by which a step of the damped method is shortened.
_SMALLEST_FACTOR = 1e-4
# A matrix is kept as long as each step is shorter than this part of the one before.
_SERVES = 0.2
# By this factor an error is likely to fall with a matrix that is kept along a curve.
_LIKELY = 0.05


@dataclass(frozen=True, eq=False)
class Solution:
    """A converged point, with all that was made there.

    ``turns`` is the number of folds passed since the stability was last known.
    """

    u: Array
    linearisation: Linearisation
    tangent: Array
    iterations: int
    values: Mapping[str, Any]
    tests: Mapping[str, float]
    turns: int = 0


class Tests(Mapping[str, float]):
    """Test functions by name; those given as functions are called where they are asked for."""

    def __init__(self, given: Mapping[str, float | Callable[[], float]]) -> None:
        self._found = dict(given)

    def __getitem__(self, name: str) -> float:
        found = self._found[name]
        if callable(found):
            found = self._found[name] = found()
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)


def newton(
    problem: Problem, guess: Array, row: Array, tolerance: float, iterations: int, *,
    known: Linearisation | None = None, exact: bool = False,
) -> tuple[Array, Linearisation, int] | None:
    """Newton's method at right angles to a row, from a guess; None where it does not converge.

    Problems that keep their matrix begin with that of ``known``, the equations at a neighbour, and
    take the matrix at the guess only where the former does not serve. The linearisation returned
    is that of the last step or, where that is much larger than rounding or ``exact`` is asked
    for, of the solution itself. The number of steps is that which a new matrix would have taken.
    """
    if known is not None and problem.keeps_matrix:
        try:
            found = _iterated(problem, guess, row, tolerance, iterations, known, exact)
        except FecontactError:
            found = None
        if found is not None:
            return found
    return _iterated(problem, guess, row, tolerance, iterations, None, exact)


def _iterated(
    problem: Problem, guess: Array, row: Array, tolerance: float, iterations: int,
    known: Linearisation | None, exact: bool,
) -> tuple[Array, Linearisation, int] | None:
    """One attempt of :func:`newton`, beginning with the matrix of ``known`` if there is one."""
    u, before, kept = guess, np.inf, known
    weights, scale = problem.weights(), 1.0 + norm(problem, guess)
    more = 0 if known is None else 1
    steps, count_kept = np.empty((iterations + more, len(guess))), 0
    rhs = np.empty(len(guess))
    for count in range(1, iterations + more + 1):
        linearisation = problem.linearise(u) if kept is None else problem.evaluate(u)
        right_side(linearisation.residual, row, u, guess, rhs)
        steps[count_kept] = (kept or linearisation).solve(row, rhs)
        size = improve(weights, steps, count_kept)
        change = steps[count_kept]
        if count > 2 and size > before and before <= problem.rounding.steps * scale:
            if kept is not None:
                u, linearisation, _ = _polished(problem, u, guess, row, exact)
            return u, linearisation, count
        if not math.isfinite(size) or (count > 2 - more and size > before):
            return None
        u = u + change
        if kept is None and size <= tolerance * scale:
            return u, problem.linearise(u) if exact else linearisation, count
        early = problem.polishes and not (exact or problem.kinked)
        # With a matrix that is kept the error falls by about the same factor each time.
        falls = size / before if count > 1 else _SERVES
        # Behind a kink the next step may be no shorter.
        known_next = size <= tolerance * scale or not problem.kinked
        if kept is not None and (
                (early and size * _LIKELY <= tolerance * scale)
                or (known_next and size * falls <= max(0.1 * tolerance, 1e-13) * scale)):
            # A step with its own matrix tells whether the last one has led near enough.
            u, kept, before = _polished(problem, u, guess, row, exact)
            if before <= tolerance * scale:
                return u, kept, max(1, count - 2 - more)
            count_kept = 0
            continue
        if problem.keeps_matrix:
            keeps = kept is None or falls <= _SERVES
            kept = (kept or linearisation) if keeps else None
            count_kept = count_kept + 1 if keeps else 0
        before = size
    return None


def _polished(
    problem: Problem, u: Array, guess: Array, row: Array, exact: bool
) -> tuple[Array, Linearisation, float]:
    """The solution that a kept matrix has led to, the equations there or just beside it, and the
    length of the step between.
    """
    linearisation = problem.linearise(u)
    if not problem.polishes:
        return u, linearisation, 0.0
    rhs = np.empty(len(u))
    right_side(linearisation.residual, row, u, guess, rhs)
    change = linearisation.solve(row, rhs)
    u, size = u + change, norm(problem, change)
    moved = exact and size > _AT_REST * (1.0 + norm(problem, u))
    return u, problem.linearise(u) if moved else linearisation, size


def damped_newton(
    problem: Problem, u: Array, row: Array, tolerance: float, iterations: int
) -> tuple[Array, float, bool]:
    """Newton's method at a fixed value of ``row @ u``, with steps shortened until residuals fall.

    It ends with a step shorter than ``tolerance`` times 1 + |u|. Returns u, the norm of the
    residual, and whether it has converged.
    """
    linearised = problem.linearise(u)
    left = float(np.linalg.norm(linearised.residual))
    for _ in range(iterations):
        step = linearised.solve(row, -np.append(linearised.residual, 0.0))
        # Rounding must not move a parameter that is fixed beyond its bounds.
        step -= (row @ step) / (row @ row) * row
        factor, size = 1.0, norm(problem, step)
        small = size < tolerance * (1.0 + norm(problem, u))
        if not math.isfinite(size):
            break
        while True:
            try:
                trial = problem.linearise(u + factor * step)
                found = float(np.linalg.norm(trial.residual))
            except AnalysisError:
                found = math.inf
            if found < (1.0 - 0.1 * factor) * left or (small and math.isfinite(found)):
                break
            factor *= 0.5
            if factor < _SMALLEST_FACTOR:
                return u, left, False
        u, linearised, left = u + factor * step, trial, found
        if small:
            return u, left, True
    return u, left, False


def reached(
    problem: Problem, guess: Array, row: Array, options: ContinuationOptions, *,
    tolerance: float | None = None, known: Linearisation | None = None, exact: bool = False,
    stored: bool = True,
) -> Solution | None:
    """The solution by :func:`newton`, in twice the usual steps, and :func:`finished`.

    None if either fails. The tolerance is by default that of the options.
    """
    try:
        found = newton(problem, guess, row, tolerance or options.tolerance,
                       2 * options.iterations, known=known, exact=exact)
        return None if found is None else finished(problem, *found, row, options, stored=stored)
    except FecontactError:
        return None


def finished(
    problem: Problem, u: Array, linearisation: Linearisation, iterations: int, row: Array,
    options: ContinuationOptions, *, stored: bool = True,
) -> Solution:
    """Tangent, stored values and test functions at a converged u.

    Without ``stored`` values only where events need them; see :func:`with_values`.

    Raises
    ------
    AnalysisError
        If there is no finite tangent.
    """
    tangent = linearisation.solve(row, unit(len(u)))
    size = norm(problem, tangent)
    if not (np.isfinite(size) and size > 0.0):
        raise AnalysisError("The branch has no direction there: its equations grow beyond all "
                            "numbers.")
    return completed(problem, u, linearisation, tangent / size, iterations, options,
                     stored=stored)


def completed(
    problem: Problem, u: Array, linearisation: Linearisation, tangent: Array, iterations: int,
    options: ContinuationOptions, values: Mapping[str, Any] | None = None, *, stored: bool = True,
) -> Solution:
    """Solution as by :func:`finished`, with a known tangent and perhaps known values."""
    if values is None:
        values = (problem.point(u, linearisation, tangent) if stored or options.events else {})
    return Solution(u, linearisation, tangent, iterations, values,
                    _tests(problem, u, linearisation, tangent, values, options))


def with_values(problem: Problem, at: Solution) -> Solution:
    """The solution with what is stored of it."""
    return at if at.values else replace(
        at, values=problem.point(at.u, at.linearisation, at.tangent))


def _tests(
    problem: Problem, u: Array, linearisation: Linearisation, tangent: Array,
    values: Mapping[str, Any], options: ContinuationOptions,
) -> Tests:
    found: dict[str, float | Callable[[], float]] = {}
    if options.locate:
        found |= {"fold": float(tangent[-1]), **problem.tests(u, linearisation, tangent)}
    if options.events:
        known = {**values, "parameter": float(u[-1])}
        found |= {name: value_of_event(name, event, known)
                  for name, event in options.events.items()}
    return Tests(found)


def value_of_event(
    name: str, event: Callable[[Mapping[str, Any]], float], known: Mapping[str, Any]
) -> float:
    """The value of a user's event."""
    try:
        return float(event(known))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"The event {name!r} gives no number ({type(error).__name__}: {error}); "
                         f"its function is called with {choices(known)}.") from error


def norm(problem: Problem, vector: Array) -> float:
    """Length of a vector in the problem's inner product."""
    return float(weighted_norm(problem.weights(), vector))
