"""Continuation of a whole branch, to one side or to both."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, Problem
from fecontact.bifurcation.continuation.pseudo_arclength import End, continuation, start_of
from fecontact.core.errors import require_finite
from fecontact.core.progress import progress_bar, shown
from fecontact.core.types import Array


def continue_branch(
    problem: Problem,
    u: Array,
    options: ContinuationOptions,
    *,
    name: str = "parameter",
    tangent: Array | None = None,
    direction: float = 1.0,
    both: bool = False,
    attributes: dict[str, Any] | None = None,
) -> Branch:
    """Follow the branch through a solution; Ctrl-C keeps the points computed so far.

    Parameters
    ----------
    problem, u, options, tangent, direction
        See :func:`fecontact.bifurcation.continuation.pseudo_arclength.continuation`.
    name : str
        Name of the parameter.
    both : bool
        Follow it to both sides; the points then go from one end to the other, and the options
        limit their number on both sides together. From a start on a bound only inwards.
    attributes : dict, optional
        Kept with the branch.

    Raises
    ------
    FecontactError
        If there is no solution near the start.
    """
    require_finite("A branch", direction=direction)
    points, end = _collected(problem, u, options, tangent, direction, name)
    if both and end.status not in (BranchStatus.CLOSED, BranchStatus.INTERRUPTED):
        start = start_of(problem, u, options, tangent, direction)
        points, left = shared(points, end.status, options.points)
        others, _ = _collected(problem, u, replace(options, points=left), -start.tangent, direction,
                               name)
        turned = [replace(point, tangent=-point.tangent) for point in others[:0:-1]]
        points = [*turned, *points]
    return Branch(name, tuple(points), end.status, end.message, attributes or {})


def shared(
    first: Sequence[BranchPoint], status: BranchStatus, most: int
) -> tuple[list[BranchPoint], int]:
    """What the first of two sides keeps of its points, and how many the other one may have.

    Both contain the start. A side that did not reach its end keeps half of them: it had all first,
    so as to close where it can.
    """
    regular = [place for place, point in enumerate(first) if point.kind is None]
    if status is not BranchStatus.POINTS:
        return list(first), max(most + 1 - len(regular), 1)
    kept = most // 2 + 1
    return list(first[: regular[kept - 1] + 1]), most + 1 - kept


def _collected(
    problem: Problem, u: Array, options: ContinuationOptions, tangent: Array | None,
    direction: float, name: str,
) -> tuple[list[BranchPoint], End]:
    points: list[BranchPoint] = []
    steps = continuation(problem, u, options, tangent=tangent, direction=direction)
    with shown(options.progress,
               lambda: progress_bar(f"Following {name}", options.points)) as tell:
        try:
            while True:
                points.append(next(steps))
                if tell is not None:
                    tell(len(points))
        except StopIteration as stop:
            return points, stop.value
        except KeyboardInterrupt:
            if not points:
                raise
            return points, End(BranchStatus.INTERRUPTED)
