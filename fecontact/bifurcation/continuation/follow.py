"""Whole branches, to one side or to both."""

from dataclasses import replace
from typing import Any

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, Problem
from fecontact.bifurcation.continuation.pseudo_arclength import End, continuation, start_of
from fecontact.core.errors import require_finite
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
    """The branch through a solution, as far as the options allow; Ctrl-C keeps what is there.

    Parameters
    ----------
    problem, u, options, tangent, direction
        See :func:`fecontact.bifurcation.continuation.pseudo_arclength.continuation`.
    name : str
        Name of the parameter.
    both : bool
        Follow it to both sides; the points then go from the one end to the other. From a start on
        a bound it goes inwards alone.
    attributes : dict, optional
        Kept with the branch.

    Raises
    ------
    FecontactError
        If there is no solution near the start.
    """
    require_finite("A branch", direction=direction)
    points, end = _collected(problem, u, options, tangent, direction)
    if both and end.status not in (BranchStatus.CLOSED, BranchStatus.INTERRUPTED):
        start = start_of(problem, u, options, tangent, direction)
        others, _ = _collected(problem, u, options, -start.tangent, direction)
        turned = [replace(point, tangent=-point.tangent) for point in others[:0:-1]]
        points = [*turned, *points]
    return Branch(name, tuple(points), end.status, end.message, attributes or {})


def _collected(
    problem: Problem, u: Array, options: ContinuationOptions, tangent: Array | None,
    direction: float
) -> tuple[list[BranchPoint], End]:
    points: list[BranchPoint] = []
    steps = continuation(problem, u, options, tangent=tangent, direction=direction)
    try:
        while True:
            points.append(next(steps))
            if options.progress is not None:
                options.progress(len(points))
    except StopIteration as stop:
        return points, stop.value
    except KeyboardInterrupt:
        if not points:
            raise
        return points, End(BranchStatus.INTERRUPTED)
