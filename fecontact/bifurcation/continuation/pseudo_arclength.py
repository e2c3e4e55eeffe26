"""Pseudo-arclength continuation of G(u) = 0, N equations in N + 1 unknowns.

The predictor goes along the tangent, the corrector is Newton's method at right angles to it.
Lengths and angles are those of the problem's inner product ``<a, b> = sum w a b``. The last unknown
is the parameter.
"""

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from fecontact.bifurcation.continuation.corner import round_corner
from fecontact.bifurcation.continuation.hairpin import round_hairpin
from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import Solution, finished, newton, norm
from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint
from fecontact.bifurcation.continuation.points import UNRESOLVED
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    Linearisation,
    Problem,
)
from fecontact.bifurcation.continuation.special_points import located_on
from fecontact.bifurcation.continuation.step import Step
from fecontact.core.errors import FecontactError, InputError
from fecontact.core.types import Array

# Steps shorter than this part of the first one may turn by any angle: contact laws with kinks give
# branches with corners.
_CORNER_STEP = 1e-3
# Try a hairpin and a corner after every second halving of a step.
_HALVINGS = 2
# Factor between lengths tried beyond close corners.
_FARTHER = 8.0
# Newton steps of one that converges at once.
_AT_ONCE = 2
# Overshoot of a bound by at most this factor: beyond it the motion may not exist.
_OVERSHOOT = 1.2
# Relative distance from a bound at which a start lies on it.
_ON_BOUND = 1e-13
# Distance at which the start of a branch, interpolated to another mesh, counts as met again.
_MET_AGAIN = 1e-5
# Distance of a guess, in tolerances, from which one Newton step leads to the solution.
_NEAR = 0.1
# Solutions closer than this many times the error of Newton's method are the same.
_SAME_SOLUTION = 10.0

__all__ = ["ContinuationOptions", "End", "Linearisation", "Problem", "continuation", "start_of"]


@dataclass(frozen=True)
class End:
    """End of a continuation, and the error of the last failed step."""

    status: BranchStatus
    message: str = ""


def continuation(
    problem: Problem,
    u: Array,
    options: ContinuationOptions,
    *,
    tangent: Array | None = None,
    direction: float = 1.0,
    header: BranchHeader | None = None,
) -> Generator[BranchPoint, None, End]:
    """Yield the points of a branch one by one, from a solution or a guess of it.

    Special points stand in order between the regular ones. The generator returns the
    :class:`End` of the branch.

    Parameters
    ----------
    problem : Problem
        The equations.
    u : (N + 1,) array
        Start; corrected at right angles to ``tangent``, or at the given parameter.
    options : ContinuationOptions
        Steps, bounds, events.
    tangent : (N + 1,) array, optional
        Direction of the first step.
    direction : float
        Sign of the first change of the parameter, where there is no tangent.
    header : BranchHeader, optional
        Of the points of plain steps.

    Raises
    ------
    FecontactError
        If there is no solution near the start.
    """
    u = np.append(u[:-1], inside(float(u[-1]), options))
    problem, start = _resolved(
        problem, start_of(problem, u, options, tangent, direction), options, tangent, direction)
    yield BranchPoint(start.u, start.tangent, start.values)
    if _leaves(start, options):
        return End(BranchStatus.BOUND)
    here, step, count, message, origin = start, options.step, 1, "", problem
    before: Solution | None = None
    halved, whole = 0, step
    # Points passed, with the directions back, and their problems.
    passed = [(problem, BranchPoint(start.u, -start.tangent, {}))]
    fast = problem.fast_steps(options)
    while count < options.points:
        if fast is not None and halved == 0:
            batch = fast.batch(problem, here, step, options.points - count, start, header)
            if batch is not None:
                yield from batch.points
                if batch.status is not None:
                    return End(batch.status)
                count += batch.count
                problem, here, before = batch.problem, batch.here, batch.before
                step = batch.step
                continue
        # Scales that have grown make the same step longer.
        step = min(step, problem.longest_step(here.tangent, 0.0, options),
                   _OVERSHOOT * _to_bounds(here, options))
        rounded = False
        try:
            reached = _step(problem, here, step, options)
        except FecontactError as error:
            reached, message = None, str(error)
        if reached is None:
            whole = step if halved == 0 else whole
            step, halved = 0.5 * step, halved + 1
            last_try = step < options.smallest_step
            if before is not None and (halved % _HALVINGS == 0 or last_try):
                reached = round_hairpin(problem, before, here, step, options)
            if reached is None and (halved % _HALVINGS == 0 or last_try):
                reached = _round_corner(problem, here, 2.0 * step, last_try, options)
                rounded = reached is not None
        if reached is None:
            if step < options.smallest_step:
                return End(BranchStatus.STALLED, message)
            continue
        finer = problem.refined(here.u, here.tangent, [
            at for there, special in reached for at in (*special, there)])
        if finer is not None:
            problem, here = _moved(here, *finer)
            before = None
            continue
        last = here
        for there, special in reached:
            for located in special:
                ended = problem.ends.get(str(located.kind))
                if ended is not None:
                    yield replace(located, kind=None)
                    return End(ended)
                yield located
                if located.kind is None:
                    return End(BranchStatus.BOUND)
                if located.kind in options.stop_at:
                    return End(BranchStatus.STOPPED)
            if count > 2 and _passes(problem, here, there, origin, start, options):
                yield BranchPoint(start.u, start.tangent, start.values)
                return End(BranchStatus.CLOSED)
            if problem.may_turn_back:
                again = next((place for place, known in enumerate(passed[1:-1], 1)
                              if _passes(problem, here, there, *known, options)), None)
                if again is not None:
                    return End(BranchStatus.CLOSED, _turned_back(
                        [float(known.u[-1]) for _, known in passed[again:]], header))
                passed.append((problem, BranchPoint(there.u, -there.tangent, {})))
            yield BranchPoint(there.u, there.tangent, there.values)
            count += 1
            last, here = here, there
        ended = problem.ended(here.u, here.linearisation, here.tangent) if options.locate else None
        if ended is not None:
            return End(ended)
        before = last
        # An unresolved change of stability has halved the step; restore its length afterwards.
        unresolved = any(point.kind == UNRESOLVED for _, special in reached for point in special)
        step = (whole if unresolved else min(whole, 4.0 * step) if rounded
                else _next_step(problem, last, here, step, options))
        halved = 0
        adapted = problem.adapted(here.u, here.tangent)
        if adapted is not None:
            if not np.array_equal(adapted[1], here.u):
                before = None
            problem, here = _moved(here, *adapted)
    return End(BranchStatus.POINTS)


def _moved(
    here: Solution, problem: Problem, u: Array, tangent: Array
) -> tuple[Problem, Solution]:
    """A solution on the mesh of a problem; with as many unknowns its equations still serve."""
    known = here.linearisation if len(u) == len(here.u) else problem.linearise(u)
    return problem, Solution(u, known, tangent / norm(problem, tangent), 0, here.values,
                             here.tests, here.turns)


def _resolved(
    problem: Problem, start: Solution, options: ContinuationOptions, tangent: Array | None,
    direction: float,
) -> tuple[Problem, Solution]:
    """The start on a mesh that is fine enough for it, as far as Newton's method leads there."""
    while (finer := problem.refined(start.u, start.tangent, [start])) is not None:
        try:
            start = start_of(finer[0], finer[1], options,
                             None if tangent is None else finer[2], direction)
        except FecontactError:
            break
        problem = finer[0]
    return problem, start


def inside(value: float, options: ContinuationOptions) -> float:
    """A value of the parameter; one beyond a bound by rounding is moved onto it.

    Raises
    ------
    InputError
        If the value lies outside the bounds.
    """
    low, high = options.bounds
    rounding = _ON_BOUND * abs(value)
    if not low - rounding <= value <= high + rounding:
        raise InputError(f"The start lies at {value:.6g}, outside the bounds of the parameter, "
                         f"{low:g} to {high:g}.")
    return min(max(value, low), high)


def _leaves(start: Solution, options: ContinuationOptions) -> bool:
    """Whether the branch starts on a bound of a parameter and heads outwards."""
    for place, low, high in options.box:
        slope, value = float(start.tangent[place]), float(start.u[place])
        ahead = high - value if slope > 0.0 else value - low
        if slope != 0.0 and ahead <= _ON_BOUND * max(abs(value), abs(slope)):
            return True
    return False


def start_of(
    problem: Problem, u: Array, options: ContinuationOptions, tangent: Array | None,
    direction: float
) -> Solution:
    """The solution near u, with its tangent."""
    if tangent is None:
        row = unit(len(u)) if direction >= 0.0 else -unit(len(u))
    else:
        row = problem.weights() * tangent / norm(problem, tangent)
    fast = problem.fast_steps(options)
    start: Solution | None = None if fast is None else fast.start(problem, u, row)
    if start is not None:
        return start
    found = newton(problem, np.array(u, dtype=float), row, options.tolerance,
                      3 * options.iterations)
    if found is None:
        raise InputError(f"There is no solution near the start at the parameter {u[-1]:.6g}; give "
                         f"a 'start' that is closer to one, for orbits also more harmonics, a "
                         f"smaller smoothing_slope, or the method 'shooting'.")
    return finished(problem, *found, row, options)


def _step(
    problem: Problem, here: Solution, step: float, options: ContinuationOptions
) -> list[tuple[Solution, list[BranchPoint]]] | None:
    """The solution a step ahead, with the special points before it; None if the step fails."""
    row = problem.weights() * here.tangent
    guess = problem.predicted(here.u, here.tangent, step)
    # One step with the matrix at the guess does where that is no farther than others leave it.
    near = problem.polishes and problem.predictor.off(step) <= _NEAR * options.tolerance * (
        1.0 + norm(problem, guess))
    found = newton(problem, guess, row, options.tolerance, options.iterations,
                      known=None if near else here.linearisation)
    if found is None:
        return None
    # A solution that is one within rounding may lie at the start of the step.
    if float(row @ (found[0] - here.u)) <= 0.5 * step:
        return None
    there = finished(problem, *found, row, options)
    short = step < _CORNER_STEP * options.step
    if not _believable(problem, here, there, options):
        if not short:
            return None
        # A corner; past one that is sharper than a right angle the tangent leads back.
        sides = [problem.orientation(at.linearisation, at.tangent) for at in (here, there)]
        if sides[0] * sides[1] < 0.0:
            return None
    reached = located_on(Step(problem, here, there, options, row), strict=not short)
    return None if reached is None else [reached]


def _round_corner(
    problem: Problem, here: Solution, step: float, farther: bool, options: ContinuationOptions
) -> list[tuple[Solution, list[BranchPoint]]] | None:
    """The point behind a corner at most a step ahead or, past several close ones, ``farther``."""
    while True:
        reached = round_corner(problem, here, step, options,
                               strict=step >= _CORNER_STEP * options.step)
        if reached is not None or not farther or step >= options.step:
            return reached
        step *= _FARTHER


def _to_bounds(here: Solution, options: ContinuationOptions) -> float:
    """Length along the tangent to the nearest bound of a parameter ahead."""
    nearest = np.inf
    for place, low, high in options.box:
        slope = float(here.tangent[place])
        if slope != 0.0:
            ahead = (high if slope > 0.0 else low) - float(here.u[place])
            nearest = min(nearest, ahead / slope)
    return nearest


def _believable(
    problem: Problem, here: Solution, there: Solution, options: ContinuationOptions
) -> bool:
    """Whether tangent and chord turn by no more than the largest turn."""
    row = problem.weights() * here.tangent
    chord = there.u - here.u
    return min(float(row @ there.tangent), float(row @ chord) / norm(problem, chord)) >= np.cos(
        options.largest_turn)


def _next_step(
    problem: Problem, here: Solution, there: Solution, step: float, options: ContinuationOptions
) -> float:
    """Step length from the Newton steps that the last one took, and from the turn on it.

    Where Newton's method converges at once, the problem may allow steps above the largest one.
    """
    factor = {1: 2.0, 2: 2.0, 3: 1.5, 4: 1.1}.get(there.iterations, 0.7)
    turn = float(np.arccos(min(1.0, float(problem.weights() * here.tangent @ there.tangent))))
    if turn > 0.0:
        factor = min(factor, max(0.5, 0.5 * options.largest_turn / turn))
    longest = options.largest_step
    if there.iterations <= _AT_ONCE:
        longest = problem.longest_step(there.tangent, turn, options)
    return min(factor * step, longest)


def _passes(
    problem: Problem, here: Solution, there: Solution, origin: Problem,
    start: Solution | BranchPoint, options: ContinuationOptions,
) -> bool:
    """Whether the start of the branch, or another point, lies on the step from here to there."""
    weights = problem.weights()
    row = weights * here.tangent
    step = Step(problem, here, there, options, row)
    length = step.length
    away = min(abs(float(start.u[-1] - end.u[-1])) for end in (here, there))
    if away * np.sqrt(weights[-1]) > length:
        return False
    again = problem.met_again(origin, start.u, start.tangent, here.u, here.tangent,
                              2.0 * length + _MET_AGAIN)
    if again is None or not 0.0 < (along := step.along(again)) <= length:
        return False
    near = step.cubic(along)
    return (norm(problem, again - near) < 1e-2 * length + _MET_AGAIN
            and _lead_to_one(problem, again, near, row, options))


def _turned_back(values: list[float], header: BranchHeader | None) -> str:
    """Sentence on a branch that repeats points, passed at these values of the parameter."""
    name = "the parameter" if header is None else header.parameter_name
    turn = max(values, key=lambda value: abs(value - values[0]))
    return (f"At {name} = {turn:.6g} it turned back along itself: the points from there on repeat "
            f"those before, and what lies beyond was not reached; take more intervals, or start "
            f"from a point beyond.")


def _lead_to_one(
    problem: Problem, one: Array, other: Array, row: Array, options: ContinuationOptions
) -> bool:
    """Whether Newton's method goes from two guesses to the same solution.

    A branch may pass itself closer than the cubic between two of its points is accurate.
    """
    try:
        found = [newton(problem, guess, row, options.tolerance, 2 * options.iterations)
                 for guess in (one, other)]
    except FecontactError:
        return False
    if found[0] is None or found[1] is None:
        return False
    tolerance = max(options.tolerance, problem.rounding.steps)
    near = _SAME_SOLUTION * tolerance * (1.0 + norm(problem, one))
    return norm(problem, found[0][0] - found[1][0]) < near
