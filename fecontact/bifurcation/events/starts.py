"""Set-valued orbits from event to event, from states of a motion and from orbits by shooting."""

from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.events.orbit import EventOrbit, anchor
from fecontact.bifurcation.events.phases import Motion
from fecontact.bifurcation.events.tracing import sizes_without_contact, traced
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.orbits.shooting import ShootingProblem
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.driver import by_events
from fecontact.integrate.solvers import SetValued

# Ranges of the states below this part of the largest one are those of a system at rest.
_STILL, _NONE = 1e-10, 1e-200


def orbit_from(
    field: ContactField, values: Array, free: int, begin: float, start: Array, period: float,
    periods: int, *, widths: Array, rtol: float, solver: SetValued,
) -> tuple[EventOrbit, Array]:
    """Problem and first guess from a state of a motion of this period.

    ``widths`` (d + 1,) are the scales of states and parameter.

    Raises
    ------
    AnalysisError
        If the motion cannot be taken apart into phases; see
        :func:`fecontact.bifurcation.events.tracing.traced`.
    """
    tolerance = max(1e-13, 1e-2 * rtol)

    def moving(sizes: Array) -> Motion:
        return Motion(field, values, free, solver, sizes, float(widths[-1]), period, tolerance)

    sizes = widths[:-1]
    if not sizes.max() > max(_STILL * np.abs(start).max(), _NONE):
        sizes = sizes_without_contact(moving(np.ones(len(start))), begin, start, period)
    scales, motion = np.concatenate([sizes, [period, widths[-1]]]), moving(sizes)
    forced = field.forcing_period(values) is not None
    found = traced(motion, begin, start, period, forced)
    problem = EventOrbit(field, values.copy(), free, found.phases, solver, scales,
                         found.margins, periods, rtol)
    return problem, np.concatenate([found.starts.reshape(-1), found.durations,
                                    found.begins[:1] if forced else [], [values[free]]])


def orbit_of(
    problem: ShootingProblem, u: Array
) -> tuple[tuple[EventOrbit, Array] | None, str]:
    """Problem and first guess of a set-valued orbit by shooting; None for others, and why.

    The others are orbits of time-stepping and of Poisson's impacts, without events though nothing
    excites them, with chatter, or with compliant contacts that open.
    """
    values, d, solver = problem.parameters(u), problem.field.dimension, problem.solver
    if not isinstance(solver, SetValued) or not by_events(
            problem.field.system(values), solver.method, solver.restitution, solver.impact_law,
            solver.static_coefficient):
        return None, ""
    try:
        return orbit_from(problem.field, values, problem.free, 0.0, problem.starts(u)[0].copy(),
                          problem.period(u), problem.periods,
                          widths=np.append(problem.scales[:d], problem.scales[-1]),
                          rtol=problem.rtol, solver=solver), ""
    except AnalysisError as error:
        return None, f"The runs of the orbit were differenced: {error}"


def as_shot(problem: EventOrbit, point: BranchPoint) -> BranchPoint:
    """A point of a branch with unknowns and tangent as by shooting with one segment."""
    u, along, d, K = point.u, point.tangent, problem.dimension, problem.count
    i, after = anchor(problem, u)
    begin, start, phase = float(problem.begins(u)[i]), problem.starts(u)[i], problem.phases[i]
    states, moved = problem.motion(u).run(begin, np.array([after]), start, phase, True)
    rates = problem.motion(u).observed_at(begin + after, states[-1], phase)[1]
    taus = along[K * d : K * d + K]
    if problem.forced:
        begun = float(along[K * d + K] + taus[:i].sum())
        whole = np.ceil(problem.begins(u)[0] / problem.period(u))
        later = whole * taus.sum() - begun if after > 0.0 else 0.0
    else:
        begun, later = 0.0, 0.5 * taus[i]
    ahead = (moved[:, :d] @ along[i * d : (i + 1) * d] + moved[:, d] * begun
             + moved[:, d + 1] * along[-1] + rates * later)
    period = [] if problem.forced else [problem.period(u)]
    change = [] if problem.forced else [taus.sum()]
    return replace(point, u=np.concatenate([states[-1], period, u[-1:]]),
                   tangent=np.concatenate([ahead, change, along[-1:]]))
