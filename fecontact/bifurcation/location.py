"""Locating special points between two points of a branch."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.branch import BranchPoint
from fecontact.bifurcation.corrector import Solution, corrected, finished, norm
from fecontact.bifurcation.problem import Problem, Settings
from fecontact.errors import FecontactError

Array = NDArray[np.float64]

# Newton's method for special points goes on to steps of this relative size.
_EXACT = 1e-10
# A branch leaves the cubic through two of its points by less than this part of what it bends.
_OFF, _ROUGH = 0.2, 1e-7
# Distance of a fold from a branch point below which both are one, in the precision of either.
_BESIDE = 30.0


def changed(here: Solution, there: Solution) -> list[str]:
    """Names of the test functions that change sign from one point to the next."""
    return [name for name, after in there.tests.items()
            if (before := here.tests.get(name, 0.0)) * after < 0.0
            or (after == 0.0 and before != 0.0)]


def between(here: Solution, there: Solution, along: float, row: Array) -> Array:
    """Cubic between two points of a branch, at a length along a row that grows between them."""
    length = float(row @ (there.u - here.u))
    x = along / length
    first = here.tangent / float(row @ here.tangent)
    last = there.tangent / float(row @ there.tangent)
    chord = there.u - here.u
    return np.asarray(
        here.u + length * x * (1.0 - x) ** 2 * first + x * x * (3.0 - 2.0 * x) * chord
        + length * x * x * (x - 1.0) * last)


def located_between(
    problem: Problem, here: Solution, there: Solution, settings: Settings, row: Array,
    strict: bool = True,
) -> list[BranchPoint] | None:
    """Special points between two regular ones, in order; one without a kind is on a bound.

    ``row`` (N + 1,) is the direction along which the branch is parametrised between the two. With
    ``strict`` the result is None where the second point lies on another sheet of solutions: the
    equations change their orientation, but no branch point lies in between. So it is where a bound
    of the parameter is passed that no solution between the two meets.
    """
    found = []
    rounding = set(problem.unresolved((here.tangent, there.tangent), (here.values, there.values),
                                      (here.tests, there.tests)))
    for name in changed(here, there):
        if name in rounding:
            continue
        located = _zero(problem, here, there, settings, _test_value(name),
                        here.tests[name], there.tests[name], problem.precision, row)
        if name == "branch point" and strict and _jumped(problem, here, there, located, row):
            return None
        if located is None:
            continue
        details = problem.examine(name, located.u, located.linearisation, located.tangent)
        if details is not None:
            kind = str(details.get("kind", name))
            rest = {key: value for key, value in details.items() if key != "kind"}
            found.append(BranchPoint(located.u, located.tangent, located.values, kind, rest))
    for bound in settings.bounds:
        before, after = here.u[-1] - bound, there.u[-1] - bound
        if before * after < 0.0 or (after == 0.0 and before != 0.0):
            located = _zero(problem, here, there, settings, _distance_to(bound), before, after,
                            1e-12, row)
            if located is None:
                return None
            found.append(BranchPoint(located.u, located.tangent, located.values))
    near = max(1e-4, _BESIDE * problem.precision)
    found = _without_turns(found, row, near * float(row @ (there.u - here.u)))
    return sorted(found, key=lambda point: float(row @ (point.u - here.u)))


def _jumped(
    problem: Problem, here: Solution, there: Solution, located: Solution | None, row: Array
) -> bool:
    """Whether two points lie on different sheets: what was found between is not on the cubic."""
    if located is None:
        return True
    along = float(row @ (located.u - here.u))
    off = norm(problem, located.u - between(here, there, along, row))
    aside = norm(problem, there.u - here.u - float(row @ (there.u - here.u))
                 / float(row @ here.tangent) * here.tangent)
    return off > _OFF * aside + _ROUGH * (1.0 + norm(problem, here.u))


def _without_turns(found: list[BranchPoint], row: Array, near: float) -> list[BranchPoint]:
    """Without folds that lie on a branch point, where a bent branch turns but does not end."""
    forks = [point for point in found if point.kind == "branch point"]
    return [point for point in found if point.kind != "fold"
            or all(abs(float(row @ (point.u - fork.u))) > near for fork in forks)]


def _test_value(name: str) -> Callable[[Solution], float]:
    return lambda at: at.tests[name]


def _distance_to(bound: float) -> Callable[[Solution], float]:
    return lambda at: float(at.u[-1]) - bound


def _zero(
    problem: Problem, here: Solution, there: Solution, settings: Settings,
    test: Callable[[Solution], float], before: float, after: float, precision: float,
    row: Array,
) -> Solution | None:
    """The solution between two others at which a test function is zero; None at a pole or jump."""
    from scipy.optimize import brentq

    if after == 0.0:
        return there
    length = float(row @ (there.u - here.u))
    best: list[tuple[float, Solution]] = []
    exact = max(_EXACT, 1e-2 * precision)

    def value(along: float) -> float:
        if along <= 0.0 or along >= length:
            return before if along <= 0.0 else after
        # The test functions are those of this very point, not of the last Newton step.
        found = corrected(problem, between(here, there, along, row), row, exact,
                          2 * settings.iterations, exact=True,
                          known=(best[-1][1] if best else there).linearisation)
        if found is None:
            raise _LostError
        at = finished(problem, *found, row, settings)
        result = test(at)
        best.append((abs(result), at))
        return result

    try:
        brentq(value, 0.0, length, xtol=precision * length, rtol=1e-14, maxiter=60,
               disp=False)
    except (_LostError, FecontactError):
        if not best:
            return None
    size, at = min(best, key=lambda pair: pair[0])
    # At a pole or a jump the values do not get small; how small they get else, the precision says.
    return at if size <= max(1e-3, 50.0 * precision) * max(abs(before), abs(after)) else None


class _LostError(Exception):
    pass
