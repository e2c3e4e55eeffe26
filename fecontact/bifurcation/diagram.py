"""Bifurcation diagrams of a study: the branches of its section ``[branch]``."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fecontact.analysis.histories import usual_point
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.problem import ContinuationOptions, titled
from fecontact.bifurcation.equilibria.branches import equilibrium_branch
from fecontact.bifurcation.fields.contact_field import ContactField, contact_field
from fecontact.bifurcation.orbits.samples import observe
from fecontact.bifurcation.tori.method import TorusBalance
from fecontact.bifurcation.tori.motion import torus_motion
from fecontact.bifurcation.tree import BranchTree, Methods, Task, grow, tasks_beyond
from fecontact.system.model_limits import limits_exceeded, warn_of_limits

if TYPE_CHECKING:
    from fecontact.bifurcation.diagram_options import BranchSettings
    from fecontact.bifurcation.orbit_methods import Method
    from fecontact.system.contact_system import ContactSystem


_EQUILIBRIA = "steady sliding"
# Longest step along equilibria, in widths of the diagram.
_LONGEST_STEP = 0.02
# Scale of the states, in amplitudes of the first orbit.
_SCALE = 10.0
# Number of points of a branch at which the limits of the model are checked.
_CHECKED_POINTS = 12
# Periods of the lower frequency of a torus in which they are checked, and samples.
_PERIODS, _SAMPLES = 10.0, 2000


@dataclass(kw_only=True)
class Branches(BranchTree):
    """Branches by name, with the range of the observed displacement.

    Attributes
    ----------
    contact_field : ContactField
        The system as a function of the parameter.
    observe : (point, component)
        The displacement that is observed; see :func:`fecontact.bifurcation.observe`.
    """

    contact_field: ContactField
    observe: tuple[str | int, Literal["x", "y", "z"]]


def follow_branches(
    system: "ContactSystem", wanted: "BranchSettings", initial: Any = "rest",
    progress: Callable[[str, float], None] | None = None,
) -> Branches:
    """Follow steady sliding or an orbit over a parameter, and the branches from special points.

    Parameters
    ----------
    system : ContactSystem
        System of the diagram.
    wanted : BranchSettings
        Branches to follow.
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
        shown = usual_point(basis)
    # Check the names before the long computation.
    basis.point_row(shown, wanted.component)
    field = contact_field(system, {wanted.checked_parameter: wanted.first})

    def kept(title: str, branch: Branch) -> Branch:
        warn_of_limits(_limits_exceeded(field, branch), f"On '{title}'")
        return observe(field, branch, shown, wanted.component)

    methods = Methods(_method(wanted), TorusBalance(wanted.torus_harmonics))

    def beyond(task: Task, branch: Branch) -> Iterator[Task]:
        return tasks_beyond(field, branch, task, wanted.switch, methods, True,
                            f"{task.title}, " if task.generation else "")

    result = Branches(contact_field=field, observe=(shown, wanted.component))
    grow(result, _first_tasks(field, wanted, initial), beyond, wanted.depth,
         lambda title: titled(wanted.options(), title, progress), kept)
    return result


def _limits_exceeded(field: ContactField, branch: Branch) -> Iterator[str]:
    """Messages for the first of some checked points of a branch beyond the model's limits."""
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    for place in np.unique(np.linspace(0, len(branch) - 1, _CHECKED_POINTS).astype(int)):
        point = branch.points[place]
        values[field.index(branch.parameter_name)] = point.parameter
        if "period" in point.values:
            motion = point.orbit(field)
            times, states = motion.times, motion.states
        elif point.is_torus:
            torus = torus_motion(point)
            times = np.linspace(0.0, _PERIODS / torus.frequencies.min(), _SAMPLES)
            states = torus.states(times)
        else:
            times, states = np.zeros(1), np.atleast_2d(point.values["state"])
        found = limits_exceeded(field.system(values), times, states)
        if found:
            yield from (f"at {branch.parameter_name} = {point.parameter:.6g} {one}"
                        for one in found)
            return


def _first_tasks(field: ContactField, wanted: "BranchSettings", initial: Any) -> Iterator[Task]:
    low, high = wanted.checked_bounds
    if wanted.kind != "orbits":
        yield Task(_EQUILIBRIA, 0, lambda options: equilibrium_branch(
            field, parameter=wanted.checked_parameter, options=_fine(options),
            direction=1.0 if wanted.first < high else -1.0, both=low < wanted.first < high))
    if wanted.kind != "equilibria":
        yield Task("orbits of the run", 0, partial(_orbits, field, wanted, initial))


def _fine(options: ContinuationOptions) -> ContinuationOptions:
    """Options with shorter steps for equilibria, which are cheap and drawn as curves."""
    return replace(options, step=min(options.step, _LONGEST_STEP),
                   largest_step=min(options.largest_step, _LONGEST_STEP))


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


def _method(wanted: "BranchSettings") -> "Method":
    """Method of the orbits."""
    from fecontact.bifurcation.harmonic.method import HarmonicBalance
    from fecontact.bifurcation.orbit_methods import Collocation, Shooting

    if wanted.method == "shooting":
        return Shooting(segments=wanted.segments)
    if wanted.method == "harmonic balance":
        return HarmonicBalance(wanted.harmonics)
    return Collocation(intervals=wanted.intervals, tolerance=wanted.tolerance,
                       state_tolerance=wanted.state_tolerance)
