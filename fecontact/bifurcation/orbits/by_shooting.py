"""Branches of orbits by shooting, from motions, Hopf points and period doublings."""

from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.predictor import BENT
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.orbit_methods import Shooting
from fecontact.bifurcation.orbits.discretisation import (
    Discretisation,
    Request,
    follow_orbits,
    stepped_off,
)
from fecontact.bifurcation.orbits.mesh import interpolate
from fecontact.bifurcation.orbits.orbit_points import ShotPoints
from fecontact.bifurcation.orbits.restored import rescaled, restored_shooting
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.bifurcation.orbits.shooting import (
    ShootingLinearisation,
    ShootingProblem,
    shooting_from,
)
from fecontact.bifurcation.orbits.starts import Begun, MotionStart, Start
from fecontact.bifurcation.orbits.unknowns import by_differences
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.ties import first_largest
from fecontact.core.types import Array
from fecontact.integrate.solvers import SetValued
from fecontact.system.fields.vector_field import VectorField


class ByShooting(ShotPoints, Discretisation):
    """Multiple shooting; set-valued orbits from event to event, where that is possible."""

    own_starts = frozenset({"period doubling"})

    def suits(self, point: BranchPoint, method: Shooting) -> bool:
        """Whether unknowns of a point are those of the options, but for their number."""
        return method.segments == point.branch.method.segments

    def require_family(self, method: Shooting, field: VectorField) -> None:
        """Raise InputError for a field or options without families."""
        if not isinstance(field, ContactField):
            raise InputError("orbit_family: shooting is for contact systems; take Collocation() or "
                             "HarmonicBalance().")

    def projected(
        self, start: Begun, method: Shooting, limits: Array | None
    ) -> tuple[ShootingProblem, Array, Array | None]:
        """Problem, unknowns and direction of a start on a mesh."""
        found, u, leaving = start
        problem, first = shooting_from(found, u, method.segments, method.rtol,
                                       method.derivative_rtol, method.solver)
        problem = replace(problem, limits=limits)
        if leaving is None:
            return problem, first, None
        shape = interpolate(found.mesh, found.nodes(leaving), problem.mesh[:-1])
        tangent = np.concatenate([shape.reshape(-1), leaving[found.size :]])
        return problem, first, tangent / np.sqrt(problem.weights() @ tangent**2)

    def followed(
        self, start: Begun, method: Shooting, options: ContinuationOptions, limits: Array | None,
        **how: Any,
    ) -> Branch:
        """Branch from a start on a mesh."""
        problem, first, tangent = self.projected(start, method, limits)
        return follow_orbits(problem, first, options, tangent=tangent, **how)

    def from_motion(self, start: MotionStart, request: Request, method: Shooting) -> Branch:
        """Branch through the orbit to which a motion of a contact system has settled.

        Orbits of unknown period start where the motion is fastest, if it covers at least two
        periods.

        Raises
        ------
        AnalysisError
            If Newton's method finds no orbit near the motion, or the excitation has no period at
            values of the parameter beside it.
        """
        start = _to_fastest(start)
        found, u = start.on_mesh(*self.mesh(method))
        problem, u, _ = self.projected((found, u, None), method, start.limits)
        how: dict[str, Any] = {"direction": request.direction, "both": request.both}
        branch, why = _from_event_to_event(problem, u, request.options, **how)
        if branch is not None:
            return branch
        stepping = _of_stepping(problem, start.values)
        if not problem.autonomous:
            # An excitation without a period beside this value is no matter of Newton's method.
            by_differences(problem.period, u)
        try:
            branch = follow_orbits(problem, u, request.options, **how)
        except (AnalysisError, InputError) as error:
            remedy = stepping or (f"run it longer until it has settled, or take more than "
                                  f"{method.segments} segments.")
            raise AnalysisError(f"No periodic orbit was found at {problem.parameter_name} = "
                                f"{start.values[start.free]:.6g} near the motion: Newton's method "
                                f"does not converge; {remedy}") from error
        if stepping and branch.status is BranchStatus.STALLED:
            why = f"{stepping[0].upper()}{stepping[1:]}"
        return _noted(why, branch)

    def goes_on(self, point: BranchPoint, request: Request) -> Branch:
        """Branch that continues from one of its own points."""
        problem, u, tangent = request.restored(point)
        if request.method is not None:
            problem = replace(problem, rtol=request.method.rtol)
        ahead = float(np.copysign(1.0, request.sign * tangent[-1]))
        branch, why = _from_event_to_event(problem, u, request.options, direction=ahead,
                                           both=request.both)
        if branch is not None:
            return branch
        return _noted(why, follow_orbits(problem, u, request.options, both=request.both,
                                         tangent=request.sign * tangent))

    def beyond(self, point: BranchPoint, request: Request) -> Branch:
        """The orbits of twice the period that begin at a period doubling found by shooting.

        The method is by default that of the branch with twice the segments.

        Raises
        ------
        InputError
            If the number of segments differs.
        """
        problem, u, _ = restored_shooting(request.field, point)
        problem, method = rescaled(problem, request.scales, request.width), request.method
        if method is not None:
            segments = 2 * (len(problem.mesh) - 1)
            if method.segments != segments:
                raise InputError(f"segments = {method.segments} must be {segments}, twice those of "
                                 f"the branch, for the orbits of twice the period; or leave the "
                                 f"method out.")
            problem = replace(problem, rtol=method.rtol, derivative_rtol=method.derivative_rtol)
        return doubled(problem, u, request)

    def beyond_on_mesh(
        self, point: BranchPoint, start: Start, request: Request, method: Shooting
    ) -> Branch:
        """The other orbits at a point whose orbit was put on a mesh."""
        if point.kind != "period doubling":
            return super().beyond_on_mesh(point, start, request, method)
        half = replace(method, segments=max(method.segments // 2, 1))
        return doubled(*self.projected(start, half, None)[:2], request)


def _of_stepping(problem: ShootingProblem, values: Array) -> str:
    """Why Newton's method may fail on runs by time stepping, and what to take; else empty."""
    solver = problem.solver
    if not isinstance(solver, SetValued):
        return ""
    from fecontact.integrate.nonsmooth.driver import by_events

    def goes(method: str) -> bool:
        try:
            return by_events(problem.field.system(values), method, solver.restitution, "newton",
                             solver.static_coefficient)
        except InputError:
            return False

    if goes(solver.method):
        return ""
    instead = ("EventDriven(), whose orbits go from event to event"
               if goes("event-driven") else "a law with a finite smoothing_slope and Auto()")
    return ("runs by time stepping are exact to first order only where contacts begin to stick and "
            f"slip, and have no derivatives there; take {instead}.")


def _from_event_to_event(
    problem: ShootingProblem, u: Array, options: ContinuationOptions, **how: Any
) -> tuple[Branch | None, str]:
    """The branch of a set-valued orbit whose events are known; None for others, and why.

    Raises
    ------
    AnalysisError
        If Newton's method finds no orbit near the start.
    """
    if not isinstance(problem.solver, SetValued):
        return None, ""
    from fecontact.bifurcation.events.branches import followed
    from fecontact.bifurcation.events.starts import orbit_of

    found, why = orbit_of(problem, u)
    if found is None:
        return None, why
    whole = replace(problem, limits=None).attributes()
    whole |= {"scales": found[0].scales, "method": replace(whole["method"], segments=1)}
    try:
        return followed(*found, options, name=problem.parameter_name, attributes=whole, **how), ""
    except InputError as error:
        raise AnalysisError(f"No periodic orbit was found at {problem.parameter_name} = "
                            f"{u[-1]:.6g} near the motion: Newton's method does not converge; run "
                            f"it longer until it has settled.") from error


def _noted(why: str, branch: Branch) -> Branch:
    """The branch with why it was not followed from event to event in its message."""
    return replace(branch, message=" ".join(filter(None, (why, branch.message))))


def _to_fastest(start: MotionStart) -> MotionStart:
    """The start with its motion truncated at its fastest point within the last period.

    The phase is best defined there. Next to a transition between stick and slip the first guess
    would be far from the orbit. Forced motions and those of unknown period stay as they are.
    """
    motion, field = start.motion, start.field
    if (motion.period is None or not isinstance(field, ContactField)
        or motion.states.shape != (motion.times.size, field.dimension)
        or field.forcing_period(start.values) is not None):
        return start
    modes, times = field.system().basis.modes, motion.times
    last = np.flatnonzero(times > times[-1] - motion.period)
    if len(last) == 0 or times[last[0]] - times[0] < motion.period:
        return start
    speeds = np.linalg.norm(motion.states[last, modes : 2 * modes] / start.widths[:modes], axis=1)
    end = last[first_largest(speeds)] + 1
    return replace(start, motion=replace(motion, times=times[:end], states=motion.states[:end]))


def doubled(problem: ShootingProblem, u: Array, request: Request) -> Branch:
    """The branch of orbits of twice the period that begins at a period doubling u.

    They leave along the eigenvector of the multiplier -1, transported along the orbit, with
    opposite sign in the second round. Where both rounds coincide again, at another doubling of the
    single orbit, the branch ends with a point 'period halving': beyond it lie the same orbits with
    their halves exchanged.
    """
    twice, start, tangent = _doubled(problem, u)
    branch = stepped_off((twice, start, tangent), request, lambda u, tangent, options: (
        follow_orbits(twice, u, options, tangent=tangent)))
    *before, end = branch.points
    if end.kind != HALVING:
        return branch
    half = twice.starts(end.u).reshape(2, -1).mean(axis=0)
    whole = np.concatenate([half, half, end.u[-twice.common :]])
    return replace(branch, points=(*before, replace(end, u=whole)))


def _doubled(problem: ShootingProblem, u: Array) -> tuple[ShootingProblem, Array, Array]:
    """The orbit traversed twice, and the direction in which its halves separate."""
    starts = problem.starts(u)
    rounds = [run.monodromy for run in ShootingLinearisation(problem, u).runs]
    around = np.eye(starts.shape[1])
    for matrix in rounds:
        around = matrix @ around
    values, vectors = np.linalg.eig(around)
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    carried = [vector]
    for matrix in rounds[:-1]:
        carried.append(matrix @ carried[-1])
    mesh = np.concatenate([problem.mesh[:-1], 1.0 + problem.mesh]) / 2.0
    scales = problem.scales.copy()
    scales[-2] *= 2.0
    tail = u[-problem.common:].copy()
    if problem.autonomous:
        tail[0] *= 2.0
    start = np.concatenate([starts.reshape(-1), starts.reshape(-1), tail])
    shape = np.concatenate(carried)
    twice = replace(problem, mesh=mesh, scales=scales, periods=2 * problem.periods, limits=None,
                    predictor=BENT)
    tangent = np.concatenate([shape, -shape, np.zeros(problem.common)])
    return twice, start, tangent
