"""Hairpins: folds too sharp for steps along the tangent.

Two sheets run side by side and meet in a fold some 1e-7 of the diagram wide, as slipping and
sticking orbits do. No step along the tangent is short enough there, but the branch is smooth over
``s = <n, u>``, with n normal to the tangent in the plane in which the branch turns: s grows through
the whole hairpin, and the branch is nearly a parabola over it.
"""

import numpy as np

from fecontact.bifurcation.continuation.newton import Solution, norm, reached
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem
from fecontact.bifurcation.continuation.special_points import located_on
from fecontact.bifurcation.continuation.step import Step

_TOLERANCE = 1e-9  # of Newton's method: both sheets are close to each other
_LEAST_TURN = 1e-5  # between the last two tangents, to define the plane of the hairpin [rad]
# Largest change of the slope d<t, u>/ds over one step, relative to the first slope.
_SLOPE_CHANGE = 0.4
_STEPS = 60


def round_hairpin(
    problem: Problem, before: Solution, here: Solution, step: float, options: ContinuationOptions
) -> list[tuple[Solution, list[BranchPoint]]] | None:
    """Points round a hairpin ahead, until it lies ``step`` behind or a bound is met.

    None if there is no hairpin.

    Parameters
    ----------
    problem : Problem
        Problem that is continued.
    before, here : Solution
        The last two points; their tangents span the plane of the hairpin.
    step : float
        Length of the first step along the tangent, and of the last one.
    options : ContinuationOptions
        Of the branch.

    Returns
    -------
    list of (Solution, list of BranchPoint)
        Points after ``here``, each with the special points before it.
    """
    weights = problem.weights()
    along = weights * before.tangent
    across = here.tangent - float(along @ here.tangent) * before.tangent
    size = norm(problem, across)
    if size < _LEAST_TURN:
        return None
    row = weights * across / size
    first = float(along @ here.tangent) / size
    at, slope, length = here, first, step / first
    found: list[tuple[Solution, list[BranchPoint]]] = []
    for _ in range(_STEPS):
        guess = at.u + length / float(row @ at.tangent) * at.tangent
        there = reached(problem, guess, row, options, tolerance=_TOLERANCE)
        change = np.inf if there is None else float(along @ there.tangent / (row @ there.tangent))
        change = abs(change - slope) / abs(first)
        piece = None
        if there is not None and change <= _SLOPE_CHANGE:
            piece = located_on(Step(problem, at, there, options, row))
        if piece is None:
            length *= 0.5
            if length * first < 0.05 * step:
                return None
            continue
        there, special = piece
        found.append(piece)
        if any(point.kind is None for point in special):
            return found
        turn = float(weights * at.tangent @ there.tangent)
        turned = float(weights * here.tangent @ there.tangent) < np.cos(options.largest_turn)
        if (turned and turn > np.cos(options.largest_turn)
            and norm(problem, there.u - at.u) >= step):
            return found
        at, slope = there, float(along @ there.tangent / (row @ there.tangent))
        length *= min(2.0, 0.7 * _SLOPE_CHANGE / max(change, 1e-3))
    return None
