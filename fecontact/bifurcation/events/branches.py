"""Branches of set-valued orbits from event to event, through the borders that they meet."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import (
    by_sides,
    continue_branch,
    labelled,
    regular,
    shortened,
)
from fecontact.bifurcation.continuation.heading import heading
from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import newton, norm
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import special_point
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.continuation.pseudo_arclength import End
from fecontact.bifurcation.events.borders import beyond, border_of, nodes_of
from fecontact.bifurcation.events.conditions import DURATION, STRIKE, Condition
from fecontact.bifurcation.events.orbit import EventOrbit
from fecontact.bifurcation.events.starts import as_shot
from fecontact.core.errors import AnalysisError, FecontactError
from fecontact.core.types import Array

# First steps beyond a border, in those of the branch, and the largest residual there; more by the
# margin that is left at the border, in which the speed at an event may change so much.
_BEYOND, FITS, _PER_MARGIN = (0.1, 0.01, 1e-3), 1e-5, 100.0
# Margin of a condition that counts as zero at a border, margin that is rounding, and largest number
# of borders that are met at once.
_NOTHING, _EQUAL, _DEPTH = 1e-5, 1e-8, 4
# Singular values below this part of the largest are zero.
_RANK = 1e-9
# Most borders on one branch.
_MOST = 40
# Distance from a border within which turns of the branch belong to it.
_BESIDE = 1e-3


def followed(
    problem: EventOrbit, u: Array, options: ContinuationOptions, *, name: str,
    attributes: dict[str, Any], tangent: Array | None = None, direction: float = 1.0,
    both: bool = False,
) -> Branch:
    """Follow orbits from event to event through the borders that they meet.

    Points hold their orbit as by shooting with one segment.

    Raises
    ------
    FecontactError
        If there is no orbit near the start.
    """
    notes: list[str] = []

    def side(wanted: ContinuationOptions, *, turned: bool) -> tuple[list[BranchPoint], End]:
        if not turned:
            return _side(problem, u, wanted, name, tangent, direction)
        try:
            return _side(problem, u, wanted, name, None if tangent is None else -tangent,
                         -direction)
        except FecontactError as error:
            notes.append(f"Nothing was found to the other side: {error}")
            return [], End(BranchStatus.STALLED)

    points, end = by_sides(side, options, both=both)
    message = " ".join(filter(None, (end.message, *notes)))
    return Branch(name, tuple(points), end.status, message, labelled(problem, name, attributes))


def _side(
    problem: EventOrbit, u: Array, options: ContinuationOptions, name: str,
    tangent: Array | None, direction: float,
) -> tuple[list[BranchPoint], End]:
    """Points of one side of a branch, and how it ended."""
    points: list[BranchPoint] = []
    stops = {options.stop_at} if isinstance(options.stop_at, str) else set(options.stop_at)
    for _ in range(_MOST):
        left = options.points - regular(points)
        if left <= 0:
            return points, End(BranchStatus.POINTS)
        try:
            piece = continue_branch(problem, u, _of_piece(options, regular(points)), name=name,
                                    tangent=tangent, direction=direction)
        except FecontactError as error:
            if not points:
                raise
            return points, End(BranchStatus.STALLED, str(error))
        if not points and problem.linearise(piece.points[0].u).least.left < -_NOTHING:
            raise AnalysisError("The orbit at the start breaks the conditions of its phases; run "
                                "the motion longer until it has settled.")
        found, whole = shortened(piece.points, left)
        last = found[-1]
        ended = whole and piece.status is BranchStatus.DISCONTINUITY
        ends = ([found[0].u] if points else []) + ([last.u] if ended else [])
        found = [point for point in found if point is last or not _is_turn(problem, point, ends)]
        if not options.locate:
            found = [point for point in found if point.kind is None]
        stored = [as_shot(problem, point) for point in found]
        if not ended:
            return [*points, *stored], End(piece.status if whole else BranchStatus.POINTS,
                                           piece.message)
        condition = nothing_left(problem, last.u)[0]
        kind = border_of(problem, last.u, condition)
        following = None if kind in stops else _following(problem, last, options)
        stored[-1] = _border(problem, last, stored[-1], condition, kind, following is not None)
        points += stored
        if kind in stops:
            return points, End(BranchStatus.STOPPED)
        if following is None:
            return points, End(BranchStatus.DISCONTINUITY)
        problem, u, tangent = following
        low, high = options.bounds
        if not low <= u[-1] <= high:
            return points, End(BranchStatus.BOUND)
    return points, End(BranchStatus.STALLED, f"The orbit meets more than {_MOST} borders.")


def _of_piece(options: ContinuationOptions, before: int) -> ContinuationOptions:
    """Options of a piece of a branch that has so many regular points before it."""
    tell = options.progress
    found = replace(options, points=max(options.points - before, 2), locate=True)
    if not before or not callable(tell):
        return found
    return replace(found, progress=lambda points: tell(before + points))


def _is_turn(problem: EventOrbit, point: BranchPoint, ends: list[Array]) -> bool:
    """Whether a special point is only the turn of the equations at a border."""
    return point.kind in ("fold", "branch point", "unresolved") and any(
        norm(problem, point.u - end) < _BESIDE for end in ends)


def _border(
    problem: EventOrbit, last: BranchPoint, stored: BranchPoint, condition: Condition, kind: str,
    persists: bool,
) -> BranchPoint:
    """The point at a border, with what curves over two parameters need."""
    motion = problem.motion(last.u)
    begins = problem.begins(last.u)
    time = float(begins[condition.phase] - begins[0] + condition.after)
    phases = np.array([[*phase.status, *phase.closed, phase.event, phase.order]
                       for phase in problem.phases], dtype=np.int64)
    strikes = np.array([[0] * (1 + motion.nodes + motion.clusters) if phase.strike is None else
                        [1, *(int(j in phase.strike.nodes) for j in range(motion.nodes)),
                         *phase.strike.modes] for phase in problem.phases], dtype=np.int64)
    return special_point(stored.u, stored.tangent, stored.values, kind, {
        "time": time, "nodes": np.array(nodes_of(problem, motion, condition, kind)),
        "persists": persists, "unknowns": last.u, "phases": phases, "strikes": strikes,
        "margins": problem.margins,
        "condition": np.array([condition.what, condition.phase, condition.event])})


def _following(
    problem: EventOrbit, last: BranchPoint, options: ContinuationOptions
) -> tuple[EventOrbit, Array, Array] | None:
    """Problem, unknowns and tangent of the orbits beyond a border; None if there are none.

    On symmetric orbits several margins are zero at once: all are examined, one after
    the other.
    """
    ahead, known = [(problem, last.u, 0)], {problem.phases}
    fits = max(FITS, _PER_MARGIN * min(abs(problem.linearise(last.u).least.left), _NOTHING))
    while ahead:
        here, at, depth = ahead.pop(0)
        try:
            made = [successor.made() for condition in nothing_left(here, at)
                    for successor in beyond(here, at, condition)]
        except FecontactError:
            continue
        for candidate, u in [each for each in made if each is not None]:
            if candidate.phases in known:
                continue
            known.add(candidate.phases)
            try:
                linearised = candidate.linearise(u)
                if np.abs(linearised.residual).max() > fits:
                    continue
                tangents = _null_vectors(candidate, linearised.matrix, u)
            except FecontactError:
                continue
            for tangent in tangents:
                for start in _starts(candidate, u, tangent, options):
                    return start
            if depth + 1 < _DEPTH:
                ahead.append((candidate, u, depth + 1))
    return None


def nothing_left(problem: EventOrbit, u: Array) -> list[Condition]:
    """Conditions whose margins are zero at a border, those of impacts and durations first."""
    found = problem.linearise(u).conditions
    least = min(abs(condition.left) for condition in found)
    return sorted((condition for condition in found
                   if abs(condition.left) < max(_NOTHING, 10.0 * least)),
                  key=lambda condition: (condition.what != STRIKE, condition.what != DURATION,
                                         max(abs(condition.left), _EQUAL, 10.0 * least)))


def _null_vectors(problem: EventOrbit, matrix: Array, u: Array) -> list[Array]:
    """Tangents of branches; on symmetric orbits also that along which all new phases grow."""
    sizes = 1.0 / np.sqrt(problem.weights())
    values, rows = np.linalg.svd(matrix * sizes)[1:]
    null = rows[np.count_nonzero(values > _RANK * values[0]):]
    directions = [null[-1]]
    short = np.flatnonzero(problem.durations(u) <= _NOTHING * problem.period(u))
    together = null.T @ null[:, problem.count * problem.dimension + short].sum(axis=1)
    if len(null) > 1 and together.any():
        directions.append(together)
    return [heading(each * sizes, problem.weights()) for each in directions]


def _starts(
    problem: EventOrbit, u: Array, tangent: Array, options: ContinuationOptions
) -> Iterator[tuple[EventOrbit, Array, Array]]:
    """The orbit a small step to the side where all conditions hold."""
    for part in _BEYOND:
        step = part * options.step
        for sign in (1.0, -1.0):
            row = problem.weights() * sign * tangent
            try:
                found = newton(problem, u + sign * step * tangent, row, options.tolerance,
                                  options.iterations)
                if found is None or not problem.linearise(found[0]).least.left > 0.0:
                    continue
                ahead = found[1].solve(row, unit(len(u)))
            except FecontactError:
                continue
            if np.isfinite(ahead).all():
                yield problem, found[0], ahead / norm(problem, ahead)
                return
