"""Corners: points where a branch turns by a finite angle, as contact opens or an element slides.

The equations have other derivatives on both sides of such a point, and the branch leaves it along
the null vector of those behind. These are taken a little ahead on the old tangent; Newton's method
then looks for the branch along the new one. A corner is believed where both tangents, drawn through
their points, meet.
"""

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import Solution, norm, reached
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem
from fecontact.bifurcation.continuation.special_points import located_on
from fecontact.bifurcation.continuation.step import Step
from fecontact.core.errors import FecontactError
from fecontact.core.types import Array

# Lengths of the search behind a corner, in steps.
_AHEAD = (1.0, 2.0)
# Largest distance between both tangents, and from the last point to where they meet, relative to
# the way from point to point and to the step.
_APART, _FAR = 0.05, 1.5
# Cosine of tangents that are those of the same piece of the branch, there and back.
_BACK = -0.999


def round_corner(
    problem: Problem, here: Solution, step: float, options: ContinuationOptions, strict: bool
) -> list[tuple[Solution, list[BranchPoint]]] | None:
    """The first point behind a corner that lies at most a step ahead; None if there is none.

    For problems that know the orientation of their branches, which tells the way on from the way
    back.

    Parameters
    ----------
    problem : Problem
        Problem that is continued.
    here : Solution
        The last point.
    step : float
        Length along its tangent at which the derivatives behind the corner are taken.
    options : ContinuationOptions
        Of the branch.
    strict : bool
        See :func:`fecontact.bifurcation.continuation.special_points.located_on`.

    Returns
    -------
    list of (Solution, list of BranchPoint)
        The point, with the special points before it.
    """
    weights, side = problem.weights(), problem.orientation(here.linearisation, here.tangent)
    if side == 0.0:
        return None
    ahead = here.u + step * here.tangent
    try:
        beyond = problem.linearise(ahead)
        leaving = beyond.solve(weights * here.tangent, unit(len(here.u)))
    except FecontactError:
        return None
    size = norm(problem, leaving)
    if not (np.isfinite(size) and size > 0.0):
        return None
    leaving = leaving / size
    # Past a corner that is sharper than a right angle the branch comes back.
    for sign in (1.0, -1.0):
        for length in _AHEAD:
            there = _found(problem, ahead, sign * length * step, leaving, options)
            if there is None or not _meet(problem, here, there, step):
                continue
            # Where the branch came from, the orientation is that of the way back.
            if float(weights * here.tangent @ there.tangent) < _BACK:
                continue
            if side * problem.orientation(there.linearisation, there.tangent) <= 0.0:
                continue
            row = weights * (here.tangent + there.tangent)
            if float(row @ (there.u - here.u)) <= 0.0:
                continue
            found = located_on(Step(problem, here, there, options, row), strict=strict)
            if found is not None:
                return [found]
    return None


def _found(
    problem: Problem, u: Array, length: float, leaving: Array, options: ContinuationOptions
) -> Solution | None:
    """The solution at a distance from u along a direction, which its tangent must have."""
    row = np.sign(length) * problem.weights() * leaving
    there = reached(problem, u + length * leaving, row, options)
    if there is None or float(row @ there.tangent) < np.cos(options.largest_turn):
        return None
    return there


def _meet(problem: Problem, here: Solution, there: Solution, step: float) -> bool:
    """Whether the tangent ahead of one point and that behind the other meet nearby."""
    weights, chord = problem.weights(), there.u - here.u
    both = np.stack([here.tangent, there.tangent], axis=1)
    lengths = np.linalg.lstsq(np.sqrt(weights)[:, None] * both, np.sqrt(weights) * chord)[0]
    off = norm(problem, chord - both @ lengths)
    return bool(off <= _APART * norm(problem, chord) and -_APART * step <= lengths[0]
                <= _FAR * step and lengths[1] > 0.0)
