"""Round a turn of a branch that is too sharp for steps along its tangent.

Two sheets that run side by side and meet in a fold, as slipping and sticking orbits do where they
touch, leave the tangent no length to step along: the turn is some 1e-7 of the diagram wide. Across
it the branch is harmless. With n at right angles to the tangent, in the plane in which the branch
turns, s = <n, u> grows through the whole turn, and u is a smooth function of it, about a parabola.
"""

import numpy as np

from fecontact.bifurcation.continuation.newton import Solution, corrected, finished, norm
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem
from fecontact.bifurcation.continuation.special_points import locate_between
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array

_TOLERANCE = 1e-9  # of Newton's method, where the sheets are close to each other
_STRAIGHT = 1e-5  # turn below which there is no telling where the branch turns to [rad]
# Part of the slope at the beginning by which that of one step may change.
_CHANGE = 0.4
_TRIES = 60


def follow_hairpin(
    problem: Problem, before: Solution, here: Solution, step: float, options: ContinuationOptions
) -> list[tuple[Solution, list[BranchPoint]]] | None:
    """Points round a sharp turn ahead, up to where it is as far behind, or to a bound.

    None if there is no such turn.

    Parameters
    ----------
    problem : Problem
        What is continued.
    before, here : Solution
        The last two points; the plane of the turn is that of their tangents.
    step : float
        Length of the first step, and of the one after which the turn lies behind.
    options : ContinuationOptions
        How.

    Returns
    -------
    list of (Solution, list of BranchPoint)
        Points after ``here``, each with the special points before it.
    """
    weights = problem.weights()
    along = weights * before.tangent
    across = here.tangent - float(along @ here.tangent) * before.tangent
    size = norm(problem, across)
    if size < _STRAIGHT:
        return None
    row = weights * across / size
    first = float(along @ here.tangent) / size
    at, slope, length = here, first, step / first
    found: list[tuple[Solution, list[BranchPoint]]] = []
    for _ in range(_TRIES):
        there = _next(problem, at, row, length, options)
        change = np.inf if there is None else float(along @ there.tangent / (row @ there.tangent))
        change = abs(change - slope) / abs(first)
        reached = None
        if there is not None and change <= _CHANGE:
            reached = locate_between(problem, at, there, options, row)
        if reached is None:
            length *= 0.5
            if length * first < 0.05 * step:
                return None
            continue
        there, special = reached
        found.append(reached)
        if any(point.kind is None for point in special):
            return found
        turn = float(weights * at.tangent @ there.tangent)
        turned = float(weights * here.tangent @ there.tangent) < np.cos(options.largest_turn)
        if (turned and turn > np.cos(options.largest_turn)
            and norm(problem, there.u - at.u) >= step):
            return found
        at, slope = there, float(along @ there.tangent / (row @ there.tangent))
        length *= min(2.0, 0.7 * _CHANGE / max(change, 1e-3))
    return None


def _next(
    problem: Problem, at: Solution, row: Array, length: float, options: ContinuationOptions
) -> Solution | None:
    """The solution at a distance along the row; None where there is none to be found."""
    guess = at.u + length / float(row @ at.tangent) * at.tangent
    try:
        found = corrected(problem, guess, row, _TOLERANCE, 2 * options.iterations)
        return None if found is None else finished(problem, *found, row, options)
    except FecontactError:
        return None
