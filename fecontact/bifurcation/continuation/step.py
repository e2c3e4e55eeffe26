"""One step along a branch: the piece between two regular points, and zeros on it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit, weighted_norm, weighted_product
from fecontact.bifurcation.continuation.newton import (
    Solution,
    finished,
    newton,
    reached,
    with_values,
)
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array

# Relative size of the last Newton step at special points.
_EXACT = 1e-10
# Precision from which test functions are smooth enough for the search to end without a bracket, and
# the factor by which the last value must have fallen.
_SMOOTH, _FALLS = 1e-6, 0.1
# Cosine between a tangent and the cubic above which both are directions of the same branch.
_SAME = 0.98
# Neighbours from whose tangents Newton's method starts if it fails from the cubic.
_NEIGHBOURS = 3
# Part of a step next to its start, and part of the value at the end of the step that such a value
# must have to tell of a jump at the start.
_BESIDE_START, _JUMP = 0.02, 0.1
# Brent's method takes at most so many steps.
_STEPS = 60
# Halvings of a step in search of where its cubic has a value, and the largest distance from there,
# in steps, of the solution that has this value.
_HALVINGS, _BESIDE_CUBIC = 40, 0.02


@dataclass(frozen=True, eq=False)
class Step:
    """The piece of a branch between two regular points.

    Attributes
    ----------
    problem, options : Problem, ContinuationOptions
        Of the branch.
    here, there : Solution
        Both ends.
    row : (N + 1,) array
        The branch is parametrised by ``row @ (u - here.u)``, which grows from here to there.
    """

    problem: Problem
    here: Solution
    there: Solution
    options: ContinuationOptions
    row: Array

    @property
    def length(self) -> float:
        """Length of the step along the row."""
        return self.along(self.there.u)

    def along(self, u: Array) -> float:
        """Length along the row from here to u."""
        return float(self.row @ (u - self.here.u))

    def cubic(self, along: float) -> Array:
        """Hermite cubic through both ends and their tangents, at a length along the row."""
        length = self.length
        x = along / length
        first = self.here.tangent / float(self.row @ self.here.tangent)
        last = self.there.tangent / float(self.row @ self.there.tangent)
        return np.asarray(
            self.here.u + length * x * (1.0 - x) ** 2 * first
            + x * x * (3.0 - 2.0 * x) * (self.there.u - self.here.u)
            + length * x * x * (x - 1.0) * last)

    def with_own_direction(self, at: Solution) -> Solution:
        """A solution on the step, with the tangent of the cubic where its own is another one's.

        Where two branches cross, the equations have two directions, and rounding decides between
        them.
        """
        weights, x = self.problem.weights(), self.along(at.u) / self.length
        near = 1e-3 if x < 0.5 else -1e-3
        ahead = self.cubic((x + near) * self.length) - self.cubic(x * self.length)
        ahead *= np.sign(near) / weighted_norm(weights, ahead)
        if weighted_product(weights, ahead, at.tangent) > _SAME:
            return at
        return replace(at, tangent=ahead)

    def parameter_rate(self) -> float:
        """Largest change of the parameter per length along the row."""
        return max(abs(float(end.tangent[-1]) / float(self.row @ end.tangent))
                   for end in (self.here, self.there))

    def solution(self, along: float) -> Solution | None:
        """The solution at a length along the row; None if Newton's method fails."""
        return reached(self.problem, self.cubic(along), self.row, self.options)

    def meeting(self, place: int, value: float) -> Solution | None:
        """The solution on the step at which an unknown has a value, by Newton's method.

        None where that leads elsewhere or nowhere, as next to a turn of this unknown.
        """
        low, high, off = 0.0, self.length, self.there.u[place] - value
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if (self.cubic(middle)[place] - value) * off > 0.0:
                high = middle
            else:
                low = middle
        guess = self.cubic(low)
        guess[place] = value
        try:
            found = newton(self.problem, guess, unit(len(guess), place), _EXACT,
                           2 * self.options.iterations, known=self.there.linearisation, exact=True)
            if found is None or not self._holds(found[0], guess):
                return None
            found[0][place] = value
            return finished(self.problem, *found, self.row, self.options)
        except FecontactError:
            return None

    def _holds(self, u: Array, near: Array) -> bool:
        """Whether a solution lies on the step, where the cubic says so."""
        weights, away = self.problem.weights(), u - near
        return (0.0 < self.along(u) <= self.length
                and weighted_norm(weights, away) <= _BESIDE_CUBIC * self.length)

    def zero(
        self, test: Callable[[Solution], float], precision: float, *, remeshed: bool = False
    ) -> tuple[Solution, float] | None:
        """The solution at which a test function is zero; None at a pole or a jump.

        Parameters
        ----------
        test : callable
            Of opposite signs at both ends, or zero there.
        precision : float
            Part of the step to which the zero is located.
        remeshed : bool
            The test function jumps a little at the start of the step, where the mesh is renewed; a
            jump there counts as a zero.

        Returns
        -------
        (Solution, float)
            With the length of the bracket that is left, zero where the search converged.
        """
        from scipy.optimize import brentq

        before, after = test(self.here), test(self.there)
        if after == 0.0:
            return self.there, 0.0
        length, search = self.length, _Search(self, test, precision, remeshed)
        try:
            converged = brentq(search, 0.0, length, xtol=precision * length, rtol=1e-14,
                               maxiter=_STEPS, full_output=True, disp=False)[1].converged
        except _LostError:
            converged = False
        known = search.known
        if not known:
            return None
        first = min(known, key=lambda each: each[0])
        if remeshed and first[1] * after > 0.0 and first[0] <= 3.0 * precision * length:
            return self._completed(first[2], first[0])
        along, size, at = min(known, key=lambda each: abs(each[1]))
        # At a zero the values become small, as far as the precision allows; not so at a pole or a
        # jump.
        if abs(size) > max(1e-3, 50.0 * precision) * max(abs(before), abs(after)):
            return None
        if converged or size == 0.0:
            return self._completed(at, 0.0)
        ends = [(0.0, before, self.here), (length, after, self.there), *known]
        return self._completed(at, min(
            abs(place - along) for place, other, _ in ends if other * size < 0.0))

    def _completed(self, at: Solution, bracket: float) -> tuple[Solution, float] | None:
        """A zero with what is stored of it; None where that cannot be found."""
        try:
            return with_values(self.problem, at), bracket
        except FecontactError:
            return None


class _LostError(Exception):
    """Newton's method fails from every guess, or there is no zero but a jump."""


class _Search:
    """A test function over the length along a step, and the solutions at which it was taken."""

    def __init__(
        self, step: Step, test: Callable[[Solution], float], precision: float, remeshed: bool
    ) -> None:
        self.step, self.test, self.precision = step, test, precision
        self.remeshed = remeshed
        self.known: list[tuple[float, float, Solution]] = []

    def __call__(self, along: float) -> float:
        if along <= 0.0:
            return self.test(self.step.here)
        if along >= self.step.length:
            return self.test(self.step.there)
        at = self._solution(along)
        value = self.test(at)
        self.known.append((along, value, at))
        if not self.remeshed and self._jumps():
            raise _LostError
        # Report a zero at once where the secant shows that the remaining error is small enough.
        return 0.0 if self._converging() else value

    def _solution(self, along: float) -> Solution:
        """The solution at a length, linearised there and not at the last Newton step."""
        step = self.step
        for guess, beside in self._guesses(along):
            found = reached(step.problem, guess, step.row, step.options, exact=True, stored=False,
                            tolerance=max(_EXACT, 1e-2 * self.precision),
                            known=beside.linearisation)
            if found is not None:
                return found
        raise _LostError

    def _guesses(self, along: float) -> Iterator[tuple[Array, Solution]]:
        """Starts of Newton's method, each with a known solution nearby.

        First the cubic, then the tangents of the nearest solutions.
        """
        step = self.step
        yield step.cubic(along), self.known[-1][2] if self.known else step.there
        solutions = sorted([step.here, step.there, *(at for *_, at in self.known)],
                           key=lambda at: abs(step.along(at.u) - along))
        for at in solutions[:_NEIGHBOURS]:
            ahead = along - step.along(at.u)
            yield at.u + ahead / float(step.row @ at.tangent) * at.tangent, at

    def _jumps(self) -> bool:
        """Whether the values next to the start do not lead to the one there, of another mesh."""
        if len(self.known) < 2:
            return False
        (x, a, _), (y, b, _) = sorted(self.known, key=lambda each: each[0])[:2]
        if x > _BESIDE_START * self.step.length:
            return False
        start = a - x * (b - a) / (y - x)
        sizes = self.test(self.step.here), self.test(self.step.there)
        return start * sizes[0] < 0.0 and abs(start) > _JUMP * abs(sizes[1])

    def _converging(self) -> bool:
        """Whether the last two values fall quickly towards a zero of their secant nearby."""
        if self.precision >= _SMOOTH or len(self.known) < 2:
            return False
        (x, a, _), (y, b, _) = self.known[-2:]
        near = 0.5 * self.precision * self.step.length
        return abs(b) <= _FALLS * abs(a) and abs(b * (y - x)) <= near * abs(b - a)
