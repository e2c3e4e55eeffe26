"""Branches of orbits by collocation, with special points on meshes of their own."""

from dataclasses import replace
from typing import Any

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.fields.jumps import require_smooth_friction
from fecontact.bifurcation.orbit_methods import Collocation
from fecontact.bifurcation.orbits import starts
from fecontact.bifurcation.orbits.collocation import Intervals
from fecontact.bifurcation.orbits.discretisation import Discretisation, Request, follow_orbits
from fecontact.bifurcation.orbits.orbit_points import CollocatedPoints
from fecontact.bifurcation.orbits.restored import restored
from fecontact.bifurcation.orbits.sharpening import ROUGHLY, SHARPENED, Accuracy, sharpened
from fecontact.bifurcation.orbits.state_error import state_error
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField


class ByCollocation(CollocatedPoints, Discretisation):
    """Orthogonal collocation."""

    def suits(self, point: BranchPoint, method: Collocation) -> bool:
        """Whether unknowns of a point are those of the options, but for their number."""
        return method.degree == point.branch.method.degree

    def require(self, field: VectorField) -> None:
        """Raise InputError for friction whose switches are not located."""
        require_smooth_friction(field)

    def mesh(self, method: Collocation) -> tuple[int, int]:
        """The mesh of the method itself."""
        return method.intervals, method.degree

    def projected(
        self, start: starts.Begun, method: Collocation, limits: Array | None
    ) -> starts.Begun:
        """Problem, unknowns and direction of a start on a mesh."""
        problem, u, tangent = start
        return replace(problem, limits=limits), u, tangent

    def from_motion(
        self, start: starts.MotionStart, request: Request, method: Collocation
    ) -> Branch:
        """Branch through the orbit near a motion."""
        self.require(request.field)
        problem, u = starts.corrected_samples(
            lambda intervals: start.on_mesh(intervals, method.degree), method.intervals)
        return self.followed((problem, u, None), method, request.options, start.limits,
                             direction=request.direction, both=request.both)

    def beyond_on_mesh(
        self, point: BranchPoint, start: starts.Start, request: Request, method: Collocation
    ) -> Branch:
        """The other orbits at a point whose orbit was put on a mesh."""
        if request.method is None and point.kind == "period doubling":
            method = replace(method, intervals=2 * method.intervals)
        return super().beyond_on_mesh(point, start, request, method)

    def left(self, start: starts.Start, request: Request, method: Collocation) -> Branch:
        """The branch that leaves a special point, on as many intervals as it needs."""
        return super().left(_on_own_intervals(start, method), request, method)

    def goes_on(self, point: BranchPoint, request: Request) -> Branch:
        """Branch that continues from one of its own points."""
        method = request.method or point.branch.method
        problem, u, tangent = _on_own_intervals(request.restored(point), method)
        start = problem.adapted(u, request.sign * tangent)
        return self.followed(start, method, request.options, problem.limits, both=request.both)

    def followed(
        self, start: starts.Begun, method: Collocation, options: ContinuationOptions,
        limits: Array | None, **how: Any,
    ) -> Branch:
        """Follow a branch and refine its special points."""
        problem, u, tangent = self.projected(start, method, limits)
        sizes = Intervals.of(method)
        if sizes is not None:
            options = replace(options, tolerance=sizes.newton(options.tolerance))
        # Locate special points coarsely here; they are refined below on meshes of their own.
        problem = replace(problem, precision=ROUGHLY, sizes=sizes)
        branch = follow_orbits(problem, u, options, tangent=tangent, attributes={
            "method": replace(method, degree=problem.degree)}, **how)
        points = list(branch.points)
        accuracy = Accuracy(method.tolerance, int(method.intervals), int(method.most_intervals))
        try:
            for index, point in enumerate(branch.points):
                if point.kind in SHARPENED:
                    points[index] = _sharpened(problem.field, branch, index, accuracy)
        except KeyboardInterrupt:
            branch = replace(branch, status=BranchStatus.INTERRUPTED)
        said = "" if sizes is None else sizes.note(points)
        return replace(branch, points=tuple(points),
                       message=" ".join(filter(None, (branch.message, said))))


def _on_own_intervals(start: starts.Start, method: Collocation) -> starts.Start:
    """The start on the intervals of the method, or on more where its orbit needs them."""
    problem, u, _ = start
    count, sizes = method.intervals, Intervals.of(method)
    if sizes is not None:
        error = state_error(problem, u)
        count = sizes.at_start(problem.intervals, error, problem.degree)
    return starts.on_intervals(start, count)


def _sharpened(
    field: VectorField, branch: Branch, index: int, accuracy: Accuracy
) -> BranchPoint:
    """A special point, refined on the mesh of its own orbit."""
    point = branch.points[index]
    before = next((one for one in branch.points[index::-1] if one.kind is None), branch.points[-1])
    return sharpened(point, restored(field, point), restored(field, before), accuracy)
