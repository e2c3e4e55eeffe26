"""Bifurcation diagrams of a study: the branches of its section ``[branch]``."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.points import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.equilibria.branches import equilibrium_branch
from fecontact.bifurcation.fields.contact_field import ContactField, contact_field
from fecontact.bifurcation.orbits.samples import observe
from fecontact.core.errors import FecontactError
from fecontact.system.model_limits import limits_exceeded, warn_of_limits

if TYPE_CHECKING:
    from fecontact.bifurcation.diagram_options import BranchSettings
    from fecontact.bifurcation.orbits.branches import Collocation, Shooting
    from fecontact.system.contact_system import ContactSystem


_EQUILIBRIA = "steady sliding"
# Longest step along equilibria, in widths of the diagram.
_LONGEST_STEP = 0.02
# Scale of the states, in amplitudes of the first orbit.
_SCALE = 10.0
# Number of points of a branch at which the limits of the model are checked.
_CHECKED_POINTS = 12


@dataclass
class Branches:
    """Branches by name, in the order in which they were followed.

    Attributes
    ----------
    contact_field : ContactField
        The system as a function of the parameter.
    observe : (point, component)
        The displacement that is observed.
    found : dict of name to Branch
        With the range of the observed displacement; see
        :func:`fecontact.bifurcation.observe`.
    notes : list of str
        Sentences on branches that could not be followed.
    interrupted : bool
        Whether Ctrl-C ended it; what was computed until then is there.
    """

    contact_field: ContactField
    observe: tuple[str | int, Literal["x", "y", "z"]]
    found: dict[str, Branch] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    interrupted: bool = False


def follow_branches(
    system: "ContactSystem", wanted: "BranchSettings", initial: Any = "rest",
    progress: Callable[[str, float], None] | None = None,
) -> Branches:
    """Follow steady sliding or an orbit over a parameter, and the branches from special points.

    Parameters
    ----------
    system : ContactSystem
        What moves.
    wanted : BranchSettings
        What to follow.
    initial : any
        Start of the run to the first orbit; see :func:`fecontact.simulate`.
    progress : callable, optional
        Told the name of the branch that is being followed, and which part of its points there is.

    Raises
    ------
    FecontactError
        If the first branch cannot be begun; others that cannot leave a note.
    """
    basis, shown = system.basis, wanted.point
    if shown is None:
        shown = "B" if basis.T[0].any() else basis.contact_nodes // 2
    # Check the names before the long computation.
    basis.point_row(shown, wanted.component)
    result = Branches(contact_field(system, {wanted.checked_parameter: wanted.first}),
                      (shown, wanted.component))
    tasks = deque(_first_tasks(result.contact_field, wanted, initial))
    while tasks:
        task = tasks.popleft()
        try:
            branch = task.follow(_settings(wanted, task.title, progress))
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
        result.found[task.title] = observe(result.contact_field, branch, *result.observe)
        warn_of_limits(_limits_exceeded(result.contact_field, branch), f"On '{task.title}'")
        if branch.status is BranchStatus.INTERRUPTED:
            result.interrupted = True
            break
        if task.generation < wanted.generations:
            tasks.extend(_tasks_beyond(result.contact_field, branch, task, wanted))
    return result


def _limits_exceeded(field: ContactField, branch: Branch) -> Iterator[str]:
    """Where a branch first exceeds the limits of the model, checked at some of its points."""
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    for place in np.unique(np.linspace(0, len(branch) - 1, _CHECKED_POINTS).astype(int)):
        point = branch.points[place]
        values[field.index(branch.parameter_name)] = point.parameter
        if "period" in point.values:
            motion = point.orbit(field)
            times, states = motion.times, motion.states
        else:
            times, states = np.zeros(1), np.atleast_2d(point.values["state"])
        found = limits_exceeded(field.system(values), times, states)
        if found:
            yield from (f"at {branch.parameter_name} = {point.parameter:.6g} {one}"
                        for one in found)
            return


class _Task(NamedTuple):
    """A branch to follow."""

    title: str
    generation: int
    follow: Callable[[ContinuationOptions], Branch]


def _settings(
    wanted: "BranchSettings", title: str, progress: Callable[[str, float], None] | None
) -> ContinuationOptions:
    options = wanted.options()
    if progress is None:
        return options
    progress(title, 0.0)
    return replace(options, progress=lambda points: progress(title, points / options.points))


def _first_tasks(field: ContactField, wanted: "BranchSettings", initial: Any) -> Iterator[_Task]:
    low, high = wanted.checked_bounds
    if wanted.kind != "orbits":
        yield _Task(_EQUILIBRIA, 0, lambda options: equilibrium_branch(
            field, parameter=wanted.checked_parameter, options=_fine(options),
            direction=1.0 if wanted.first < high else -1.0, both=low < wanted.first < high))
    if wanted.kind != "equilibria":
        yield _Task("orbits of the run", 0, partial(_orbits, field, wanted, initial))


def _fine(options: ContinuationOptions) -> ContinuationOptions:
    """Options with shorter steps for equilibria, which are cheap and drawn as curves."""
    return replace(options, step=min(options.step, _LONGEST_STEP),
                   largest_step=min(options.largest_step, _LONGEST_STEP))


def _tasks_beyond(
    field: ContactField, branch: Branch, task: _Task, wanted: "BranchSettings"
) -> Iterator[_Task]:
    for kind in wanted.switch:
        points = branch.of_kind(kind)
        for number, point in enumerate(points):
            title = _title(task.title, kind, f" {number + 1}" if len(points) > 1 else "")
            yield _Task(title, task.generation + 1,
                        partial(_beyond, field, point, wanted))


def _orbits(
    field: ContactField, wanted: "BranchSettings", initial: Any, options: ContinuationOptions
) -> Branch:
    """The orbit on which a run settles, over the parameter."""
    from fecontact.bifurcation.orbits.branches import orbit_branch
    from fecontact.bifurcation.orbits.from_run import periodic_motion

    low, high = wanted.checked_bounds
    motion = periodic_motion(field.system(), initial=initial, transient=wanted.transient,
                             longest_period=wanted.longest_period)
    return orbit_branch(
        field, motion, wanted.checked_parameter, method=_method(wanted), options=options,
        # Large scales make a step one of the parameter rather than of the orbit, which may grow.
        scales=_SCALE * motion.amplitudes,
        direction=1.0 if wanted.first < high else -1.0, both=low < wanted.first < high)


def _method(wanted: "BranchSettings") -> "Collocation | Shooting":
    """Collocation or shooting."""
    from fecontact.bifurcation.orbits.branches import Collocation, Shooting

    if wanted.method == "shooting":
        return Shooting(segments=wanted.segments)
    return Collocation(intervals=wanted.intervals)


def _beyond(
    field: ContactField, point: BranchPoint, wanted: "BranchSettings", options: ContinuationOptions
) -> Branch:
    """The branch that begins at a special point."""
    from fecontact.bifurcation.orbits.branches import orbit_branch

    if point.kind == "Hopf":
        return orbit_branch(field, point, method=_method(wanted), options=options)
    if point.is_orbit:
        return orbit_branch(field, point, options=options)
    return equilibrium_branch(field, point, options=options)


def _title(name: str, kind: str, number: str) -> str:
    if kind == "Hopf":
        return f"orbits{number}"
    if kind == "period doubling":
        return f"{name}, doubled{number}"
    return f"{name}, crossing{number}"
