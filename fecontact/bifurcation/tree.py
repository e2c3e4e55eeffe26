"""Trees of branches: those that begin at the special points of others, to a stated depth."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import require_no_family
from fecontact.bifurcation.continuation.problem import (
    BranchStatus,
    ContinuationOptions,
    options_of,
)
from fecontact.bifurcation.diagram_options import SWITCHES
from fecontact.bifurcation.equilibria.branches import equilibrium_branch
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.core.checks import as_count, as_texts, require_flags, require_kind
from fecontact.core.errors import FecontactError, InputError, choices
from fecontact.core.types import Array
from fecontact.core.units import Summarised, listed, span
from fecontact.system.fields.vector_field import VectorField, require_field

if TYPE_CHECKING:
    from fecontact.bifurcation.orbit_methods import Method
    from fecontact.bifurcation.tori.method import TorusBalance

# Distance within which two points are the same: in widths of the diagram, ranges of the states, and
# parts of a period.
_SAME = 1e-4
# Kinds of special points at which a tree switches by default.
_USUAL = tuple(kind for kind in SWITCHES if kind != "Neimark-Sacker")


@dataclass(repr=False)
class BranchTree(Summarised):
    """Branches by name, in the order in which they were followed.

    Attributes
    ----------
    found : dict of name to Branch
        The branches.
    notes : list of str
        Sentences on branches that could not be followed.
    interrupted : bool
        Whether Ctrl-C ended it; what was computed until then is there.
    """

    found: dict[str, Branch] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    interrupted: bool = False


    def summary(self) -> list[tuple[str, str]]:
        """Of each branch the range, its special points, and how it ended."""
        rows = [(name, f"{span(branch.parameter)}, "
                       f"{listed([str(point.kind) for point in branch.special], 3)}, "
                       f"{branch.status.name.lower()}") for name, branch in self.found.items()]
        return [*rows, *(("note", note) for note in self.notes)]


def _followed(options: ContinuationOptions) -> Branch:
    raise AssertionError("The branch is there already.")


class Task(NamedTuple):
    """A branch to follow: its name, generation, and the point from which it begins."""

    title: str
    generation: int
    follow: Callable[[ContinuationOptions], Branch] = _followed
    start: BranchPoint | None = None


class Methods(NamedTuple):
    """Methods of orbits born at Hopf points and of tori; None for the usual ones."""

    orbits: "Method | None" = None
    tori: "TorusBalance | None" = None


def branch_tree(
    field: VectorField, first: Branch | Sequence[Branch] | Mapping[str, Branch], *,
    depth: int = 1, switch: Iterable[str] = _USUAL, method: "Method | None" = None,
    both: bool = True, options: ContinuationOptions | None = None,
    bounds: tuple[float, float] | None = None,
) -> BranchTree:
    """Follow all branches that bifurcate from given ones, then from these, to a given depth.

    Followed are the orbits that emerge at Hopf points, those of twice the period at period
    doublings, and both halves of the other branch at branch points. A branch that is known already,
    from its other end or from the other side of a crossing, is not followed again.

    Parameters
    ----------
    field : VectorField
        Field of the branches.
    first : Branch, sequence or mapping of name to Branch
        Branches of equilibria or orbits over one parameter, also read from a file.
    depth : int
        Number of generations of branches.
    switch : sequence of str
        Kinds of special points at which to switch: 'Hopf', 'period doubling', 'branch point' by
        default, and 'Neimark-Sacker' to tori.
    method : Collocation, Shooting or HarmonicBalance, optional
        Of the orbits born at Hopf points, by default collocation; others keep theirs.
    both : bool
        Follow both halves at branch points; one is enough if the other is its mirror image.
    options : ContinuationOptions, optional
        Steps, tolerances and stopping conditions of each branch.
    bounds : (float, float), optional
        Range of the parameter, by default that of the first branches.

    Returns
    -------
    BranchTree
        The first branches and those found, by name: 'orbits 2' begins at the second Hopf point,
        'orbits 2, doubled' at a period doubling of these.

    Raises
    ------
    InputError
        If the branches have different parameters, or a kind of point is unknown.
    """
    require_field(field)
    from fecontact.bifurcation.harmonic.method import HarmonicBalance
    from fecontact.bifurcation.orbit_methods import Collocation, Shooting

    require_kind("branch_tree", (Branch, Sequence, Mapping), first=first)
    require_kind("branch_tree", (Collocation, Shooting, HarmonicBalance, type(None)),
                 method=method)
    require_flags("branch_tree", both=both)
    roots = _named(first)
    kinds = as_texts(switch, "branch_tree: switch")
    for kind in kinds:
        if kind not in SWITCHES:
            raise InputError(f"branch_tree: switch = {kind!r} is not known; choose from "
                             f"{choices(SWITCHES)}.")
    as_count(depth, "branch_tree: depth", 0)
    if bounds is None and (options is None or not np.isfinite(options.bounds).any()):
        ends = np.concatenate([branch.parameter for branch in roots.values()])
        bounds = (float(ends.min()), float(ends.max()))
    chosen = options_of(options, bounds)

    def beyond(task: Task, branch: Branch) -> Iterator[Task]:
        return tasks_beyond(field, branch, task, kinds, Methods(method), both,
                            "" if len(roots) == 1 and not task.generation else f"{task.title}, ")

    tasks = [task for name, branch in roots.items() if depth
             for task in beyond(Task(name, 0), branch)]
    return grow(BranchTree(roots), tasks, beyond, depth, lambda _: chosen,
                lambda _, branch: branch)


def _named(first: Branch | Sequence[Branch] | Mapping[str, Branch]) -> dict[str, Branch]:
    """The first branches by name, over one parameter."""
    if isinstance(first, Branch):
        first = [first]
    if not isinstance(first, Mapping):
        first = {f"branch {number + 1}" if len(first) > 1 else "first": branch
                 for number, branch in enumerate(first)}
    for branch in first.values():
        require_kind("branch_tree", Branch, first=branch)
        for point in branch.points[:1]:
            require_no_family(point)
    names = {branch.parameter_names for branch in first.values() if len(branch)}
    if len(names) != 1 or len(next(iter(names))) != 1:
        raise InputError("branch_tree: first must hold branches over the same single parameter, "
                         "each with points.")
    return dict(first)


def grow(
    result: BranchTree, tasks: Iterable[Task], beyond: Callable[[Task, Branch], Iterable[Task]],
    depth: int, options: Callable[[str], ContinuationOptions],
    kept: Callable[[str, Branch], Branch],
) -> BranchTree:
    """Follow the tasks and those beyond them, generation by generation, into the result.

    ``options(title)`` says how a branch is followed, ``kept(title, branch)`` what is kept of it. An
    error of the first branch is raised; those of others become notes.
    """
    waiting = deque(tasks)
    while waiting:
        task = waiting.popleft()
        if task.start is not None and _known(task.start, result.found.values()):
            continue
        try:
            branch = task.follow(options(task.title))
        except KeyboardInterrupt:
            if not result.found:
                raise
            result.interrupted = True
            break
        except FecontactError as error:
            if not result.found:
                raise
            result.notes.append(f"The branch '{task.title}' was not followed: {error}")
            continue
        result.found[task.title] = kept(task.title, branch)
        if branch.status is BranchStatus.INTERRUPTED:
            result.interrupted = True
            break
        if task.generation < depth:
            waiting.extend(beyond(task, branch))
    return result


def tasks_beyond(
    field: VectorField, branch: Branch, task: Task, kinds: Iterable[str], methods: Methods,
    both: bool, before: str,
) -> Iterator[Task]:
    """The branches that begin at the special points of one; ``before`` their orbits' names.

    At branch points ``both`` halves, or one.
    """
    for kind in kinds:
        points = branch.of_kind(kind)
        for number, point in enumerate(points):
            count = f" {number + 1}" if len(points) > 1 else ""
            title = {"Hopf": f"{before}orbits{count}",
                     "period doubling": f"{task.title}, doubled{count}",
                     "branch point": f"{task.title}, crossing{count}",
                     "Neimark-Sacker": f"{task.title}, tori{count}"}[kind]
            halves = partial(_beyond, field, point, methods, 1.0, both)
            yield Task(title, task.generation + 1, halves, point)
            if kind == "branch point" and point.is_orbit and both:
                yield Task(f"{title}, other half", task.generation + 1,
                           partial(_beyond, field, point, methods, -1.0, both), point)


def _beyond(
    field: VectorField, point: BranchPoint, methods: Methods, direction: float, both: bool,
    options: ContinuationOptions,
) -> Branch:
    """The branch that begins at a special point."""
    from fecontact.bifurcation.orbits.branches import orbit_branch
    from fecontact.bifurcation.tori.branches import torus_branch

    if point.kind == "Hopf":
        return orbit_branch(field, point, method=methods.orbits, options=options)
    if point.kind == "Neimark-Sacker":
        return torus_branch(field, point, method=methods.tori, options=options)
    if point.is_orbit:
        return orbit_branch(field, point, options=options, direction=direction)
    return equilibrium_branch(field, point, options=options, both=both)


def _known(start: BranchPoint, found: Iterable[Branch]) -> bool:
    """Whether the branch that begins at a special point has been followed from somewhere else."""
    branches = list(found)
    values = np.concatenate([branch.parameter for branch in branches])
    width = float(np.ptp(values)) or abs(start.parameter) or 1.0
    place, spread, period = _whereabouts(start)
    size = max(float(np.linalg.norm(middle) + np.linalg.norm(extent)) for branch in branches
               for middle, extent, _ in map(_whereabouts, branch))

    def there(point: BranchPoint, periods: float | None) -> bool:
        other, extent, its_period = _whereabouts(point)
        return (abs(point.parameter - start.parameter) <= _SAME * width
                and (start.kind == "Hopf" or float(np.linalg.norm(extent - spread))
                     <= _SAME * size)
                and float(np.linalg.norm(other - place)) <= _SAME * size
                and (periods is None or abs(its_period - periods * period)
                     <= 1e-2 * periods * period))

    if start.kind == "Hopf":
        return any(branch.status is BranchStatus.HOPF and there(branch.points[-1], None)
                   for branch in branches)
    if start.kind == "Neimark-Sacker":
        return any(branch.status is BranchStatus.SINGLE_FREQUENCY
                   and there(branch.points[-1], None) for branch in branches)
    if start.kind == "period doubling":
        return any(point.kind == HALVING and there(point, 2.0)
                   for branch in branches for point in branch.special)
    # Both branches through a branch point mark it.
    return sum(point.kind == start.kind and there(point, 1.0 if start.is_orbit else None)
               for branch in branches for point in branch.special) > 1


def _whereabouts(point: BranchPoint) -> tuple[Array, Array, float]:
    """Middle and range (d,) of the states, and the period; of equilibria the state, 0, 0.

    The period of a torus is zero.
    """
    if "state" in point.values:
        state = np.asarray(point.values["state"])
        return state, np.zeros(len(state)), 0.0
    low, high = (np.asarray(point.values[name]) for name in ("minimum", "maximum"))
    return 0.5 * (low + high), high - low, float(point.values.get("period", 0.0))
