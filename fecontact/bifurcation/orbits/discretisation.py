"""Methods of periodic orbits: how each starts, continues and leaves branches.

All starts of branches are motions: an orbit and a direction on a fine mesh, as collocation has
them. Each method projects these to unknowns of its own. Points know their method by what is stored
of them; :mod:`fecontact.bifurcation.orbits.discretisations` lists the methods.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.attempts import first_that_goes
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.heading import heading
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.orbits import starts
from fecontact.bifurcation.orbits.orbit_points import OrbitPoints
from fecontact.bifurcation.orbits.restored import rescaled, restored_orbit
from fecontact.bifurcation.orbits.same_orbit import HALVING
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField

# Factors of the first step, tried in this order to leave a special point.
_FIRST_STEPS = (1.0, 0.2, 0.04)
# Mesh on which a start is put for methods without a mesh of their own.
_INTERVALS, _DEGREE = 200, 4


@dataclass(frozen=True, eq=False)
class Request:
    """Arguments of a branch of orbits; see :func:`fecontact.bifurcation.orbit_branch`.

    Attributes
    ----------
    field : VectorField
    method : Collocation, Shooting, HarmonicBalance or None
        None for that of the point where the branch starts.
    options : ContinuationOptions
    scales, width : ArrayLike and float, optional
    direction : float
    both : bool
    """

    field: VectorField
    method: Any
    options: ContinuationOptions
    scales: ArrayLike | None = None
    width: float | None = None
    direction: float = 1.0
    both: bool = False

    def restored(self, point: BranchPoint) -> tuple[Any, Array, Array]:
        """Problem, unknowns and tangent of a point, by its own method, to continue its branch.

        Scales of the states that are given no longer grow.
        """
        problem, u, tangent = restored_orbit(self.field, point)
        limits = None if self.scales is not None else point.branch.attributes.get("limits")
        return replace(rescaled(problem, self.scales, self.width), limits=limits), u, tangent

    @property
    def sign(self) -> float:
        """1 forward, -1 back."""
        return float(np.copysign(1.0, self.direction))


class Discretisation(OrbitPoints):
    """One method of periodic orbits and the branches that it follows.

    Attributes
    ----------
    own_starts : frozenset of str
        Special points of its branches at which it finds the other orbits in its own unknowns.
    finds_responses : bool
        Whether it finds forced orbits from rest; others start from an orbit of one that does.
    """

    own_starts: ClassVar[frozenset[str]] = frozenset()
    finds_responses: ClassVar[bool] = False

    @abstractmethod
    def suits(self, point: BranchPoint, method: Any) -> bool:
        """Whether unknowns of a point by this method are those of options, but for their number."""

    @abstractmethod
    def projected(
        self, start: starts.Begun, method: Any, limits: Array | None
    ) -> tuple[Any, Array, Array | None]:
        """Problem, unknowns and direction, if there is one, of a start on a mesh."""

    @abstractmethod
    def followed(
        self, start: starts.Begun, method: Any, options: ContinuationOptions,
        limits: Array | None, **how: Any,
    ) -> Branch:
        """Branch from a start on a mesh; ``limits`` (d,) are those of the growth of the scales."""

    @abstractmethod
    def goes_on(self, point: BranchPoint, request: Request) -> Branch:
        """Branch that continues from one of its own points."""

    def require(self, field: VectorField) -> None:
        """Raise InputError for a field whose orbits the method cannot compute."""
        return

    def require_family(self, method: Any, field: VectorField) -> None:
        """Raise InputError if the method cannot follow families of a conservative field."""
        return

    def mesh(self, method: Any) -> tuple[int, int]:
        """Intervals and degree of the mesh on which starts are put."""
        return _INTERVALS, _DEGREE

    def from_motion(self, start: starts.MotionStart, request: Request, method: Any) -> Branch:
        """Branch through the orbit near a motion."""
        return self.followed((*start.on_mesh(*self.mesh(method)), None), method,
                             request.options, start.limits, direction=request.direction,
                             both=request.both)

    def beyond(self, point: BranchPoint, request: Request) -> Branch:
        """The other orbits at one of its own points, of a kind of :attr:`own_starts`."""
        raise NotImplementedError

    def beyond_on_mesh(
        self, point: BranchPoint, start: starts.Start, request: Request, method: Any
    ) -> Branch:
        """The other orbits at a point whose orbit was put on a mesh."""
        problem, u, tangent = start
        problem, u, tangent = (starts.doubled(problem, u) if point.kind == "period doubling"
                               else starts.crossing(problem, u, tangent))
        return self.left((problem, u, tangent), request, method)

    def left(self, start: starts.Start, request: Request, method: Any) -> Branch:
        """The branch that leaves a special point in the direction of a start."""
        problem = start[0]
        return stepped_off(start, request, lambda u, tangent, options: self.followed(
            (problem, u, tangent), method, options, None))


def follow_orbits(
    problem: Any, u: Array, options: ContinuationOptions,
    attributes: Mapping[str, Any] | None = None, **how: Any,
) -> Branch:
    """Follow orbits by one method; doubled ones end where they become single ones.

    ``attributes`` are those of the branch besides the ones of its problem.
    """
    branch = continue_branch(
        problem, u, replace(options, stop_at=(*options.stop_at, HALVING)),
        name=problem.parameter_name, attributes={**problem.attributes(), **(attributes or {})},
        **how)
    if branch.points[-1].kind == HALVING and HALVING not in options.stop_at:
        return replace(branch, status=BranchStatus.CLOSED)
    return branch


def stepped_off(
    start: tuple[Any, Array, Array], request: Request,
    follow: Callable[[Array, Array, ContinuationOptions], Branch],
) -> Branch:
    """Branch that leaves a point at which two branches meet.

    It may bend strongly there: the first step is shorter if the corrector fails.
    """
    problem, u, tangent = start
    tangent = request.sign * heading(tangent, problem.weights())

    def go(part: float) -> Branch:
        step = max(part * request.options.step, request.options.smallest_step)
        return follow(u + step * tangent, tangent, replace(request.options, step=step))

    return first_that_goes(_FIRST_STEPS, go)
