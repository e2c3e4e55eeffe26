"""Special points of branches of orbits, located on meshes of their own and judged on finer ones.

A branch finds its special points roughly, on the mesh of a neighbour. Each is located once more on
the mesh that suits its own orbit. The coefficient of a normal form holds third derivatives along
the orbit and may need a far finer mesh than the orbit: intervals are doubled until it settles.

Where a mesh is too coarse, its error alone makes the parameter turn, or a test function change its
sign. So each special point must be there on a finer mesh too, and the test functions of folds
and branch points be the same on both sides of it. Those that are not are 'unresolved'.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.crossings import UNRESOLVED
from fecontact.bifurcation.continuation.newton import corrected, finished, norm
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.pseudo_arclength import ContinuationOptions, continuation
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.floquet import FLAT
from fecontact.bifurcation.orbits.mesh import equidistributed
from fecontact.bifurcation.orbits.normal_forms import verdict
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array

# Problem, unknowns and tangent of an orbit.
Place = tuple[CollocationProblem, Array, Array]

SHARPENED = ("fold", "period doubling", "Neimark-Sacker", "branch point")
_JUDGED = ("period doubling", "Neimark-Sacker")

# Parts of a step to which a branch locates special points, and to which they are sharpened.
ROUGHLY, _SHARPLY = 1e-3, 1e-9
# Distances from the rough place at which the search begins, one after the other.
_NEAR = (1e-3, 1e-2, 1e-4, 3e-2)
# Points of a search, whose steps may have to be shorter than the whole way.
_POINTS = 30
# The intervals of a branch are multiplied by this at the most, to judge a coefficient.
_FINEST = 16
# A change of a coefficient from one mesh to the next that settles it at once, in parts of it.
_AT_ONCE = 1e-3
# So many times the intervals are doubled to confirm a fold or a branch point, and the change of its
# test function from mesh to mesh, in parts of it, that still does.
_DOUBLINGS, _ALIKE = 2, 0.5
# Parts of a distance at which test functions are compared: the longest at which there is a branch.
_SHORTER = np.array([1.0, 1e-1, 1e-2, 1e-3, 1e-4])


def sharpened(point: BranchPoint, own: Place, neighbour: Place) -> BranchPoint:
    """A special point located once more, with its criticality where it has one.

    Parameters
    ----------
    point : BranchPoint
        What the branch located roughly.
    own, neighbour : (CollocationProblem, array, array)
        Problem, unknowns and tangent of the point and of a regular one before it. At branch points
        the tangent is not defined; that of the neighbour serves for all kinds.

    Returns
    -------
    BranchPoint
        'parameter_error' in the details is the change of the parameter on finer meshes. A point
        that is not found again stays where it was, and 'located' in its details is False;
        'parameter_error' is what the parameter changes by over the stretch that was searched if
        nothing better is known. A point that finer meshes do not have becomes 'unresolved', and
        'instead_of' in its details says what it looked like.
    """
    kind = str(point.kind)
    problem, u, _ = own
    beside, start, direction = neighbour
    _, start, tangent = beside.on_mesh(problem.mesh, start, direction)
    mesh = equidistributed(problem.mesh, problem.nodes(u), problem.degree, problem.intervals)
    _, start, _ = problem.on_mesh(mesh, start, tangent)
    place = _unit(*problem.on_mesh(mesh, u, tangent))
    found = _found(place, kind) or _found_from(place, start, kind)
    details = {**point.details, "located": False} if found is None else {**found.details}
    if kind in _JUDGED:
        judged = _on_finer_meshes(point, found, place)
    else:
        away = abs(float(problem.weights() * place[2] @ (u - start)))
        judged = _change_on_finer_meshes(point, found, place, max(away, _NEAR[0]))
    if judged is None:
        details = {name: value for name, value in details.items()
                   if name in ("located", "parameter_error")}
        kind, details["instead_of"] = UNRESOLVED, kind
    else:
        details |= judged
    if found is None:
        details.setdefault("parameter_error", _reach(place))
    return replace(found or point, kind=kind, details=details)


def _unit(problem: CollocationProblem, u: Array, tangent: Array) -> Place:
    """The place with a tangent of length one; the scales may have grown along the branch."""
    problem = replace(problem, renewal=0, precision=_SHARPLY)
    return problem, u, tangent / norm(problem, tangent)


def _found(place: Place, kind: str) -> BranchPoint | None:
    """The special point near a place; None if it is not found from any distance."""
    _, u, tangent = place
    for near in _NEAR:
        found = _searched(place, u - near * tangent, 2.0 * near, kind)
        if found is not None:
            return found
    return None


def _found_from(place: Place, start: Array, kind: str) -> BranchPoint | None:
    """The special point on the way from a neighbour to a bit beyond the place."""
    problem, u, tangent = place
    away = float(problem.weights() * tangent @ (u - start))
    return _searched(place, start, 1.2 * away, kind) if away > 0.0 else None


def _searched(place: Place, start: Array, length: float, kind: str) -> BranchPoint | None:
    """The special point nearest to a place, on the branch from a start on over a length."""
    problem, u, tangent = place
    row, weights = problem.weights() * tangent, problem.weights()
    options = ContinuationOptions(step=length, largest_step=length, points=_POINTS,
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


def _reach(place: Place) -> float:
    """Change of the parameter over the stretch that is searched."""
    return max(_NEAR) * abs(float(place[2][-1]))


def _on_finer_meshes(
    rough: BranchPoint, found: BranchPoint | None, place: Place
) -> dict[str, Any] | None:
    """Coefficient and criticality of a special point, and by how much its parameter changes.

    None if no finer mesh has the point.

    The error of the coefficient is its change from the last mesh but one, or half of that before:
    two meshes may agree by accident.
    """
    problem, u, tangent = place
    kind, parameter, most = str(rough.kind), (found or rough).parameter, _FINEST * problem.intervals
    coefficients = [] if found is None else [float(found.details["coefficient"])]
    u, error, before = u if found is None else found.u, float("nan"), float("inf")
    confirmed = False
    while 2 * problem.intervals <= most:
        place = _with_twice_the_intervals(problem, u, tangent)
        problem, u, tangent = place
        finer = _found(place, kind)
        if finer is None:
            error = float("nan")
            continue
        found, u, confirmed = finer, finer.u, True
        coefficients.append(float(found.details["coefficient"]))
        if len(coefficients) == 1:
            continue
        change = abs(coefficients[-1] - coefficients[-2])
        at_once = change <= _AT_ONCE * abs(coefficients[-1])
        error = max(float(found.details["coefficient_error"]), change,
                    0.0 if at_once else 0.5 * before)
        before = change
        if verdict(coefficients[-1], error)["criticality"] != "undecided":
            break
    if found is None or not confirmed:
        return None
    return {**verdict(coefficients[-1], error),
            "parameter_error": abs(found.parameter - parameter)}


def _with_twice_the_intervals(problem: CollocationProblem, u: Array, tangent: Array) -> Place:
    mesh = equidistributed(problem.mesh, problem.nodes(u), problem.degree, 2 * problem.intervals)
    return _unit(*problem.on_mesh(mesh, u, tangent))


def _change_on_finer_meshes(
    rough: BranchPoint, found: BranchPoint | None, place: Place, reach: float
) -> dict[str, Any] | None:
    """By how much the parameter of a fold or branch point changes; None if two meshes in a row do
    not agree on it.

    They do if both have the point, and on both its test function is the same at a distance
    ``reach`` before and behind it.
    """
    kind, parameter = str(rough.kind), (found or rough).parameter
    problem, u, tangent = place
    before = None if found is None else (problem, found.u, tangent)
    u = u if found is None else found.u
    for _ in range(_DOUBLINGS):
        problem, u, tangent = _with_twice_the_intervals(problem, u, tangent)
        finer = _found((problem, u, tangent), kind)
        if finer is None:
            return None
        u = finer.u
        here = problem, u, tangent
        if before is not None and _alike(before, here, kind, reach):
            return {"parameter_error": abs(finer.parameter - parameter)}
        before = here
    return None


def _alike(one: Place, other: Place, kind: str, reach: float) -> bool:
    """Whether a test function is the same about a special point on two meshes, beyond rounding.

    Beside a sharp turn the branch is met at short distances only.
    """
    for distance in reach * _SHORTER:
        found = np.array([[_test_beside(place, kind, side * distance) for place in (one, other)]
                          for side in (-1.0, 1.0)])
        if not np.isnan(found).any():
            break
    size = np.abs(found).max(axis=1)
    if kind == "fold" and size.max() < FLAT * one[0].scales[-1]:
        return False
    return bool((np.abs(found[:, 0] - found[:, 1]) <= _ALIKE * size).all())


def _test_beside(place: Place, kind: str, along: float) -> float:
    """A test function on the branch at a distance from a place; NaN where there is none."""
    problem, u, tangent = place
    options, row = ContinuationOptions(), problem.weights() * tangent
    try:
        reached = corrected(problem, u + along * tangent, row, options.tolerance,
                            2 * options.iterations)
        return (np.nan if reached is None
                else finished(problem, *reached, row, options).tests[kind])
    except FecontactError:
        return np.nan
