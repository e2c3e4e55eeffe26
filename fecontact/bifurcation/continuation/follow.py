"""Continuation of a whole branch, to one side or to both."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint
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
    header = BranchHeader(name, labelled(problem, name, attributes or {}))
    points, end = _collected(problem, u, options, tangent, direction, header)
    if both and end.status not in (BranchStatus.CLOSED, BranchStatus.INTERRUPTED):
        start = start_of(problem, u, options, tangent, direction)
        # The start counts once.
        left = options.points + 1 - min(regular(points), options.points // 2 + 1)
        others, _ = _collected(problem, u, replace(options, points=left), -start.tangent, direction,
                               header)
        points, whole = shortened(points, options.points + 1 - regular(others))
        end = end if whole else End(BranchStatus.POINTS)
        turned = [replace(point, tangent=-point.tangent) for point in others[:0:-1]]
        points = [*turned, *points]
    branch = Branch(name, tuple(points), end.status, end.message, header.attributes)
    message = " ".join(filter(None, (end.message, problem.note(branch.points))))
    return replace(branch, message=message)


def labelled(problem: Problem, name: str, attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of a branch with labels of its parameters for axes, as the field gives them.

    Of equations without a field they are the names.
    """
    names, field = map(str, attributes.get("parameters", (name,))), getattr(problem, "field", None)
    return {**attributes, "labels": tuple(
        one if field is None else field.parameter_label(one) for one in names)}


def regular(points: Iterable[BranchPoint]) -> int:
    """Number of points that are not special."""
    return sum(point.kind is None for point in points)


def shortened(points: Sequence[BranchPoint], most: int) -> tuple[list[BranchPoint], bool]:
    """The first points of a side, so many regular ones, and whether these are all."""
    places = [place for place, point in enumerate(points) if point.kind is None]
    if len(places) <= most:
        return list(points), True
    return list(points[: places[most - 1] + 1]), False


def _collected(
    problem: Problem, u: Array, options: ContinuationOptions, tangent: Array | None,
    direction: float, header: BranchHeader,
) -> tuple[list[BranchPoint], End]:
    points: list[BranchPoint] = []
    steps = continuation(problem, u, options, tangent=tangent, direction=direction, header=header)
    with shown(options.progress,
               lambda: progress_bar(f"Following {header.parameter_name}", options.points)) as tell:
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
