"""Continuation of a whole branch, to one side or to both."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.newton import value_of_event
from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    Problem,
    require_direction,
)
from fecontact.bifurcation.continuation.pseudo_arclength import End, continuation, start_of
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
    require_direction("A branch", direction)
    header = BranchHeader(name, labelled(problem, name, attributes or {}))

    def side(wanted: ContinuationOptions, *, turned: bool) -> tuple[list[BranchPoint], End]:
        heading = tangent
        if turned:
            heading = -start_of(problem, u, options, tangent, direction).tangent
        return _collected(problem, u, wanted, heading, direction, header)

    points, end = by_sides(side, options, both=both)
    branch = Branch(name, tuple(points), end.status, end.message, header.attributes)
    message = " ".join(filter(None, (end.message, problem.note(branch.points),
                                     _note_of_events(branch.points, options))))
    return replace(branch, message=message)


def _note_of_events(points: Sequence[BranchPoint], options: ContinuationOptions) -> str:
    """Sentences on the user's events that are NaN at all regular points; empty without any."""
    if not options.events:
        return ""
    found = [{**point.values, "parameter": point.parameter} for point in points
             if point.kind is None]
    return " ".join(
        f"The event {name!r} is nan at every point, so that it has no zeros; let its function "
        f"return a finite number." for name, event in options.events.items()
        if found and all(np.isnan(value_of_event(name, event, known)) for known in found))


def by_sides(
    side: Callable[..., tuple[list[BranchPoint], End]], options: ContinuationOptions, *, both: bool
) -> tuple[list[BranchPoint], End]:
    """Points of a branch, and how it ended.

    ``side(options, turned=...)`` gives those to one side of the start or, turned, to the other one,
    each with the start. With ``both`` they go from the end of the other side to that of the first,
    and the options limit the number of regular ones on both sides together.
    """
    points, end = side(options, turned=False)
    # Branches that would repeat the same orbits count as closed too, but are no loops.
    loop = end.status is BranchStatus.CLOSED and any(
        np.array_equal(point.u, points[-1].u) for point in points[:-1])
    if not both or loop or end.status is BranchStatus.INTERRUPTED:
        return points, end
    # The start counts once.
    most = options.points + regular(points[:1])
    left = most - min(regular(points), options.points // 2 + regular(points[:1]))
    others, other = side(replace(options, points=left), turned=True)
    points, whole = shortened(points, most - regular(others))
    turned = [replace(point, tangent=-point.tangent) for point in others[:0:-1]]
    end = end if whole else End(BranchStatus.POINTS)
    # Both sides say so where they went back along themselves.
    said = other.message if other.status is BranchStatus.CLOSED else ""
    return [*turned, *points], replace(end, message=" ".join(filter(None, (end.message, said))))


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
