"""Refinement of special points of orbits: each on a mesh of its own, confirmed on finer ones.

A branch locates its special points coarsely, on the mesh of a neighbour. Each is then located on
the mesh equidistributed for its own orbit, and on twice the intervals: the change of its parameter
is its error on the former. The intervals are doubled until it is below the tolerance. The
coefficient of a normal form contains third derivatives along the orbit and may need a far finer
mesh than the orbit: for it the intervals are doubled until it converges.

On too coarse a mesh the discretisation error alone makes the parameter turn, or a test function
change sign. A special point must therefore exist on a finer mesh too, and the test functions of
folds and branch points must agree on both sides of it; otherwise it becomes 'unresolved'.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.newton import norm, reached
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import (
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    unresolved,
    with_details,
)
from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.continuation.pseudo_arclength import ContinuationOptions, continuation
from fecontact.bifurcation.continuation.rounding import FLAT
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.mesh import equidistributed
from fecontact.bifurcation.orbits.normal_forms import verdict
from fecontact.core.errors import AnalysisError, FecontactError
from fecontact.core.types import Array

# Problem, unknowns and tangent of an orbit.
Place = tuple[CollocationProblem, Array, Array]

SHARPENED = ("fold", "period doubling", "Neimark-Sacker", "branch point")
_WITH_NORMAL_FORM = ("period doubling", "Neimark-Sacker")

# Precision of special points on the branch and after refinement, in parts of a step.
ROUGHLY, _REFINED = 1e-3, 1e-9
# Distances from the coarse location at which a search starts, in this order.
_DISTANCES = (1e-3, 1e-2, 1e-4, 3e-2)
# Largest number of points in one search.
_MOST_POINTS = 30
# Finest mesh for a coefficient, in least intervals of the branch; one doubling is always made.
_FINEST_MESH = 16
# Relative change between the first two meshes at which a coefficient counts as converged, and the
# relative error at which no finer mesh is tried.
_CONVERGED, _KNOWN = 1e-3, 0.02
# Last change of a coefficient from mesh to mesh, in its errors: where rounding is all that changes,
# the last value is as far off as the one before.
_OF_ROUNDING = 2.0
# Factor by which the error of a parameter falls from one mesh to the next: the least one if nothing
# is known of it, and the largest one.
_FALLS = (1.0 / 32.0, 0.5)
# Smallest factor by which the error of a parameter is taken to fall from one mesh to the next.
LEAST_FALL = 1e-3
# Smallest error of a parameter, in widths of the diagram.
_ROUNDING = 1e-13
# The same where multipliers are lost in rounding: the folds of one branch on several meshes spread
# by some parts of it.
_HIDDEN = 1e-11
# Largest number of mesh doublings to confirm a fold or a branch point, and largest relative
# difference of its test function on two meshes that agree.
_DOUBLINGS, _AGREEMENT = 2, 0.5
# Factors of the distance at which test functions are compared; beside a hairpin the corrector
# converges at short distances only.
_SHORTER_DISTANCES = np.array([1.0, 1e-1, 1e-2, 1e-3, 1e-4])


@dataclass(frozen=True)
class Accuracy:
    """Error of the parameter up to which intervals are doubled, in widths of the diagram, and the
    least and the largest number of intervals of the branch.
    """

    tolerance: float
    intervals: int
    most_intervals: int


def sharpened(
    point: BranchPoint, own: Place, neighbour: Place, accuracy: Accuracy
) -> BranchPoint:
    """Refine a special point and, where it has a normal form, determine its criticality.

    Parameters
    ----------
    point : BranchPoint
        As located on the branch.
    own, neighbour : (CollocationProblem, array, array)
        Problem, unknowns and tangent of the point and of a regular one before it. At branch points
        the tangent is not defined; that of the neighbour serves for all kinds.
    accuracy : Accuracy
        How well the parameter is to be known.

    Returns
    -------
    BranchPoint
        On the first mesh on which its ``parameter_error``, the change of the parameter on the next
        finer one, is below the tolerance. A point that is not found again stays where it was, not
        ``located``; its ``parameter_error`` is then the change of the parameter over the stretch
        that was searched, if nothing better is known. A point that finer meshes do not have becomes
        'unresolved', ``instead_of`` its kind.
    """
    kind = str(point.kind)
    problem, u, _ = own
    beside, start, direction = neighbour
    _, start, tangent = beside.on_mesh(problem.mesh, start, direction)
    mesh = equidistributed(problem.mesh, problem.nodes(u), problem.degree, problem.intervals)
    _, start, _ = problem.on_mesh(mesh, start, tangent)
    place = _unit(*problem.on_mesh(mesh, u, tangent))
    found = found_near(place, kind) or _found_from(place, start, kind)
    here = place if found is None else (place[0], found.u, place[2])
    located = _Located(kind, [found or with_details(point, located=False)], here,
                       float(problem.scales[-1]), accuracy)
    if kind in _WITH_NORMAL_FORM:
        judged = _judged(located, found)
    else:
        away = abs(float(problem.weights() * place[2] @ (u - start)))
        judged = _confirmed(located, found, max(away, _DISTANCES[0]))
    if judged is not None:
        located.refine()
    best, error = located.best()
    result = unresolved(best) if judged is None else with_details(best, **judged)
    if not np.isnan(error):
        if problem.rounding.lost(best.values):
            error = max(error, _HIDDEN * float(problem.scales[-1]))
        return with_details(result, parameter_error=error)
    if np.isnan(result.parameter_error) and not result.located:
        return with_details(result, parameter_error=reach(place))
    return result


class _Located:
    """A special point on meshes each of twice the intervals of the one before.

    The first of the points is that on the branch's own number of intervals, or as the branch has it
    where it is not found there. ``place`` is the finest mesh so far.
    """

    def __init__(
        self, kind: str, points: list[BranchPoint], place: Place, width: float,
        accuracy: Accuracy,
    ) -> None:
        self.kind, self.points, self.place = kind, points, place
        self.least, self._most = accuracy.intervals, accuracy.most_intervals
        self._tolerance = accuracy.tolerance * width
        self._rounding = _ROUNDING * width
        # Whether the last mesh has the point.
        self.found = True

    @property
    def intervals(self) -> int:
        """Number of intervals of the finest mesh."""
        return self.place[0].intervals

    def next(self) -> BranchPoint | None:
        """The point on twice the intervals; None if it is not found there."""
        problem, u, tangent = self.place
        self.place = _with_twice_the_intervals(problem, u, tangent)
        finer = found_near(self.place, self.kind)
        self.found = finer is not None
        if finer is not None:
            self.points.append(finer)
            self.place = self.place[0], finer.u, self.place[2]
        return finer

    def refine(self) -> None:
        """Twice the intervals as often as the error is too large."""
        while (self.found and not self.best()[1] <= self._tolerance
               and 2 * self.intervals <= self._most):
            self.next()

    def best(self) -> tuple[BranchPoint, float]:
        """The point on the first mesh that is fine enough, and the error of its parameter.

        The error is the sum of the changes on all finer meshes, as a geometric series. A change
        much smaller than the one before is an accident: an error falls by 256 from mesh to mesh of
        degree four where the motion is smooth.
        """
        places = [point.parameter for point in self.points]
        changes = [abs(after - before) for before, after in pairwise(places)]
        if not self.points[0].located and len(self.points) > 1:
            changes[0] = max(changes[0], self._tolerance * (1.0 + LEAST_FALL))
        if not changes:
            return self.points[0], float("nan")
        falls = [_FALLS[0], *(min(max(after / before, _FALLS[0]), _FALLS[1]) if before > 0.0
                              else _FALLS[1] for before, after in pairwise(changes))]
        errors = [max(change / (1.0 - fall), LEAST_FALL * before, self._rounding)
                  for change, before, fall in zip(changes, [0.0, *changes], falls, strict=False)]
        # A coefficient may have needed finer meshes than are to be kept.
        kept = [k for k in range(len(errors))
                if k == 0 or len(self.points[k].values["mesh"]) <= self._most + 1]
        k = next((k for k in kept if errors[k] <= self._tolerance), kept[-1])
        return self.points[k], errors[k]


def _unit(problem: CollocationProblem, u: Array, tangent: Array) -> Place:
    """The place with a tangent of length one; the scales may have grown along the branch."""
    problem = replace(problem, renewal=0, precision=_REFINED)
    return problem, u, tangent / norm(problem, tangent)


def found_near(place: tuple[Problem, Array, Array], kind: str) -> BranchPoint | None:
    """The special point near a place; None if no search finds it."""
    _, u, tangent = place
    for near in _DISTANCES:
        found = _searched(place, u - near * tangent, 2.0 * near, kind)
        if found is not None:
            return found
    return None


def _found_from(place: Place, start: Array, kind: str) -> BranchPoint | None:
    """The special point between a neighbour and a bit beyond the place."""
    problem, u, tangent = place
    away = float(problem.weights() * tangent @ (u - start))
    return _searched(place, start, 1.2 * away, kind) if away > 0.0 else None


def _searched(
    place: tuple[Problem, Array, Array], start: Array, length: float, kind: str
) -> BranchPoint | None:
    """The special point nearest to a place on a piece of the branch."""
    problem, u, tangent = place
    row, weights = problem.weights() * tangent, problem.weights()
    options = ContinuationOptions(step=length, largest_step=length, points=_MOST_POINTS,
                                  smallest_step=min(1e-7, length))
    points = []
    try:
        for point in continuation(problem, start, options, tangent=tangent):
            if point.kind == kind:
                points.append(replace(point, tangent=tangent))
            if float(row @ (point.u - start)) > 0.999 * length:
                break
    except FecontactError:
        pass
    return min(points, key=lambda point: float(weights @ (point.u - u) ** 2), default=None)


def reach(place: tuple[Problem, Array, Array], unknown: int = -1) -> float:
    """Change of the parameter, or of another unknown, over the longest search."""
    return max(_DISTANCES) * abs(float(place[2][unknown]))


def _judged(located: _Located, found: BranchPoint | None) -> dict[str, Any] | None:
    """Coefficient and criticality of a special point, from finer meshes; None if none has it.

    The error of the coefficient is twice its last change from mesh to mesh, and at least half the
    change before: two meshes may agree by accident.
    """
    most = max(_FINEST_MESH * located.least, 2 * located.intervals)
    coefficients = [] if found is None else [_normal_form(found)[0]]
    error, before, confirmed = float("nan"), float("inf"), False
    while 2 * located.intervals <= most:
        finer = located.next()
        if finer is None:
            error = float("nan")
            continue
        confirmed = True
        coefficient, own_error = _normal_form(finer)
        # Rounding on this mesh is more than the error on the last one, or finer ones may have less.
        finer_ones = 2 * located.intervals <= most
        if own_error > error or (finer_ones and not own_error <= _KNOWN * abs(coefficient)):
            continue
        coefficients.append(coefficient)
        if len(coefficients) == 1:
            continue
        size, change = abs(coefficients[-1]), abs(coefficients[-1] - coefficients[-2])
        if before == np.inf and change <= _CONVERGED * size:
            before = 0.0
        error = max(own_error, _OF_ROUNDING * change, 0.5 * before)
        before = change
        if error <= _KNOWN * size:
            break
    return verdict(coefficients[-1], error) if confirmed else None


def _normal_form(point: BranchPoint) -> tuple[float, float]:
    """Coefficient of the normal form on one mesh, and its error there."""
    assert isinstance(point, PeriodDoublingPoint | NeimarkSackerPoint)
    coefficient, error = point.coefficient, point.coefficient_error
    if coefficient is None or error is None:
        raise AnalysisError(f"{point.place} has no coefficient of its normal form.")
    return coefficient, error


def _with_twice_the_intervals(problem: CollocationProblem, u: Array, tangent: Array) -> Place:
    mesh = equidistributed(problem.mesh, problem.nodes(u), problem.degree, 2 * problem.intervals)
    return _unit(*problem.on_mesh(mesh, u, tangent))


def _confirmed(
    located: _Located, found: BranchPoint | None, reach: float
) -> dict[str, Any] | None:
    """Empty dict for a fold or branch point; None if no two successive meshes agree on it.

    They agree if both have the point, and the same test function a distance ``reach`` before and
    after it.
    """
    problem, _, tangent = located.place
    before = None if found is None else (problem, found.u, tangent)
    for _ in range(_DOUBLINGS):
        finer = located.next()
        if finer is None:
            return None
        if before is not None and _agree(before, located.place, located.kind, reach):
            return {}
        before = located.place
    return None


def _agree(one: Place, other: Place, kind: str, reach: float) -> bool:
    """Whether a test function agrees on two meshes on both sides of a special point.

    Beside a hairpin the corrector converges at short distances only.
    """
    for distance in reach * _SHORTER_DISTANCES:
        found = np.array([[_test_at(place, kind, side * distance) for place in (one, other)]
                          for side in (-1.0, 1.0)])
        if not np.isnan(found).any():
            break
    size = np.abs(found).max(axis=1)
    if kind == "fold" and size.max() < FLAT * one[0].scales[-1]:
        return False
    return bool((np.abs(found[:, 0] - found[:, 1]) <= _AGREEMENT * size).all())


def _test_at(place: Place, kind: str, along: float) -> float:
    """A test function on the branch at a distance from a place; NaN if the corrector fails."""
    problem, u, tangent = place
    found = reached(problem, u + along * tangent, problem.weights() * tangent,
                    ContinuationOptions())
    return np.nan if found is None else found.tests[kind]
