"""Locating special points between two points of a branch."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.crossings import UNRESOLVED, counted, with_count
from fecontact.bifurcation.continuation.newton import Solution, corrected, finished, norm
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array

# Newton's method for special points goes on to steps of this relative size.
_EXACT = 1e-10
# A branch leaves the cubic through two of its points by less than this part of what it bends.
_OFF, _ROUGH = 0.2, 1e-7
# Part of a step to which a place is located at which the stability changes by a jump.
_JUMP = 1e-3
# Precision from which on a search may end without a bracket, and by what the values fall then; on a
# coarse one test functions are not yet seen to be smooth.
_SHARP, _FALLS = 1e-6, 0.1
# Solutions from which Newton's method begins where it fails from the cubic between two points.
_GUESSES = 3
# Distance of a fold from a branch point below which both are one, in the precision of either.
_BESIDE = 30.0


def sign_changes(here: Solution, there: Solution) -> list[str]:
    """Names of the test functions that change sign from one point to the next."""
    return [name for name, after in there.tests.items()
            if (before := here.tests.get(name, 0.0)) * after < 0.0
            or (after == 0.0 and before != 0.0)]


def hermite(here: Solution, there: Solution, along: float, row: Array) -> Array:
    """Cubic between two points of a branch, at a length along a row that grows between them."""
    length = float(row @ (there.u - here.u))
    x = along / length
    first = here.tangent / float(row @ here.tangent)
    last = there.tangent / float(row @ there.tangent)
    chord = there.u - here.u
    return np.asarray(
        here.u + length * x * (1.0 - x) ** 2 * first + x * x * (3.0 - 2.0 * x) * chord
        + length * x * x * (x - 1.0) * last)


def locate_between(
    problem: Problem, here: Solution, there: Solution, options: ContinuationOptions, row: Array,
    strict: bool = True,
) -> tuple[Solution, list[BranchPoint]] | None:
    """The second of two regular points, and the special ones before it, in order.

    A special point without a kind is on a bound. ``row`` (N + 1,) is the direction along which the
    branch is parametrised between the two.

    With ``strict`` the result is None where the second point lies on another sheet of solutions:
    the equations change their orientation, but no branch point lies in between; and where the
    special points do not explain by how many the unstable directions change. Without, a point
    'unresolved' stands where they change. The result is None too where a bound of the parameter
    is passed that no solution between the two meets.
    """
    found = []
    rounding = set(problem.unresolved((here.tangent, there.tangent), (here.values, there.values),
                                      (here.tests, there.tests)))
    for name in sign_changes(here, there):
        if name in rounding:
            continue
        event = name in options.events
        zero = _zero(problem, here, there, options, _test_value(name), here.tests[name],
                     there.tests[name], problem.event_precision if event else problem.precision,
                     row, remeshed=name in problem.confirms)
        located = None if zero is None else zero[0]
        if name == "branch point" and strict and _jumped(problem, here, there, located, row):
            return None
        if zero is None:
            continue
        at, off = zero
        details = {} if event else problem.examine(name, at.u, at.linearisation, at.tangent)
        if details is not None:
            kind = str(details.get("kind", name))
            rest = {key: value for key, value in details.items() if key != "kind"}
            if off > 0.0:
                rest |= {"located": False, "parameter_error": off * _rate(here, there, row)}
            found.append(BranchPoint(at.u, at.tangent, at.values, kind, rest))
    met: Solution | None = None
    for sign, bound in zip((-1.0, 1.0), options.bounds, strict=True):
        before, after = sign * (here.u[-1] - bound), sign * (there.u[-1] - bound)
        if after < 0.0 or before > 0.0 or before == after:
            continue
        zero = None if before == 0.0 else _zero(problem, here, there, options, _distance_to(bound),
                                                sign * before, sign * after, 1e-12, row)
        if zero is None:
            return None
        met = replace(zero[0], u=np.append(zero[0].u[:-1], bound))
    end = met or there
    length = float(row @ (end.u - here.u))
    near = max(1e-4, _BESIDE * problem.precision)
    found = _without_turns([point for point in found if float(row @ (point.u - here.u)) <= length],
                           row, near * float(row @ (there.u - here.u)))
    if options.locate:
        count = counted(problem, here, end, found, options.events)
        if count is None and strict:
            return None
        if count is None:
            found.append(_change(problem, here, end, options, row))
        else:
            end = with_count(end, count)
    found.sort(key=lambda point: float(row @ (point.u - here.u)))
    if met is not None:
        found.append(BranchPoint(end.u, end.tangent, end.values))
    return end, found


def _rate(here: Solution, there: Solution, row: Array) -> float:
    """Change of the parameter over a length along the row, at the most."""
    return max(abs(float(at.tangent[-1]) / float(row @ at.tangent)) for at in (here, there))


def _change(
    problem: Problem, here: Solution, there: Solution, options: ContinuationOptions, row: Array
) -> BranchPoint:
    """Where the number of unstable directions jumps, though no test function has a zero there."""
    low, high = 0.0, float(row @ (there.u - here.u))
    counts = [int(each.values["unstable"]) for each in (here, there)]
    at, precision = there, _JUMP * high
    while high - low > precision:
        middle = 0.5 * (low + high)
        try:
            found = corrected(problem, hermite(here, there, middle, row), row, options.tolerance,
                              2 * options.iterations)
            reached = None if found is None else finished(problem, *found, row, options)
        except FecontactError:
            reached = None
        if reached is None:
            break
        count = int(reached.values["unstable"])
        if abs(count - counts[0]) < abs(count - counts[1]):
            low = middle
        else:
            high, at = middle, reached
    return BranchPoint(at.u, at.tangent, at.values, UNRESOLVED, {
        "unstable_before": counts[0], "unstable_after": counts[1],
        "parameter_error": (high - low) * _rate(here, there, row)})


def _jumped(
    problem: Problem, here: Solution, there: Solution, located: Solution | None, row: Array
) -> bool:
    """Whether two points lie on different sheets: what was found between is not on the cubic."""
    if located is None:
        return True
    along = float(row @ (located.u - here.u))
    off = norm(problem, located.u - hermite(here, there, along, row))
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
    problem: Problem, here: Solution, there: Solution, options: ContinuationOptions,
    test: Callable[[Solution], float], before: float, after: float, precision: float,
    row: Array, *, remeshed: bool = False,
) -> tuple[Solution, float] | None:
    """The solution between two others at which a test function is zero; None at a pole or jump.

    With it comes the length within which it was searched for in vain, zero where it was found.
    With ``remeshed`` a jump at the first solution is a zero as well: on the mesh of the second one
    the function had changed its sign there already.
    """
    from scipy.optimize import brentq

    if after == 0.0:
        return there, 0.0
    length = float(row @ (there.u - here.u))
    known: list[tuple[float, float, Solution]] = []
    exact = max(_EXACT, 1e-2 * precision)

    def value(along: float) -> float:
        if along <= 0.0 or along >= length:
            return before if along <= 0.0 else after
        # The test functions are those of this very point, not of the last Newton step.
        for guess, beside in _guesses(here, there, along, row, known):
            try:
                found = corrected(problem, guess, row, exact, 2 * options.iterations, exact=True,
                                  known=beside.linearisation)
                if found is not None:
                    at = finished(problem, *found, row, options)
                    break
            except FecontactError:
                continue
        else:
            raise _LostError
        result = test(at)
        known.append((along, result, at))
        # Where it converges quickly, no bracket has to show how little is left.
        settled = precision < _SHARP and _settled(known, 0.5 * precision * length)
        return 0.0 if settled else result

    done = False
    try:
        done = brentq(value, 0.0, length, xtol=precision * length, rtol=1e-14, maxiter=60,
                      full_output=True, disp=False)[1].converged
    except _LostError:
        if not known:
            return None
    first = min(known, key=lambda each: each[0])
    if remeshed and first[1] * after > 0.0 and first[0] <= 3.0 * precision * length:
        return first[2], first[0]
    along, size, at = min(known, key=lambda each: abs(each[1]))
    # At a pole or a jump the values do not get small; how small they get else, the precision says.
    if abs(size) > max(1e-3, 50.0 * precision) * max(abs(before), abs(after)):
        return None
    if done or size == 0.0:
        return at, 0.0
    ends = [(0.0, before, here), (length, after, there), *known]
    return at, min(abs(place - along) for place, other, _ in ends if other * size < 0.0)


def _settled(known: list[tuple[float, float, Solution]], precision: float) -> bool:
    """Whether the last two values fall quickly, and the zero of the line through them is near."""
    if len(known) < 2:
        return False
    (x, a, _), (y, b, _) = known[-2:]
    return abs(b) <= _FALLS * abs(a) and abs(b * (y - x)) <= precision * abs(b - a)


def _guesses(
    here: Solution, there: Solution, along: float, row: Array,
    known: list[tuple[float, float, Solution]],
) -> Iterator[tuple[Array, Solution]]:
    """Where Newton's method begins at a length along the branch, each with a solution nearby.

    On the cubic through both ends, then along the tangents of solutions, the nearest first.
    """
    yield hermite(here, there, along, row), known[-1][2] if known else there
    solutions = sorted([here, there, *(at for *_, at in known)],
                       key=lambda at: abs(float(row @ (at.u - here.u)) - along))
    for at in solutions[:_GUESSES]:
        ahead = along - float(row @ (at.u - here.u))
        yield at.u + ahead / float(row @ at.tangent) * at.tangent, at


class _LostError(Exception):
    pass
