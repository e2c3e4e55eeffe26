"""Continuation problem of periodic orbits by orthogonal collocation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.newton import Solution
from fecontact.bifurcation.continuation.point import BranchPoint, attributes_of
from fecontact.bifurcation.continuation.predictor import BENT, Predictor
from fecontact.bifurcation.continuation.problem import BranchStatus, Problem, enlarged
from fecontact.bifurcation.fields.fast_modes import unresolved_modes
from fecontact.bifurcation.fields.jumps import missed_jumps
from fecontact.bifurcation.orbit_methods import Collocation
from fecontact.bifurcation.orbits.collocation_equations import (
    CollocationEquations,
    CollocationLinearisation,
)
from fecontact.bifurcation.orbits.floquet import FloquetTests
from fecontact.bifurcation.orbits.mesh import carry_over, equidistributed, extremes, rule
from fecontact.bifurcation.orbits.normal_forms import examined
from fecontact.bifurcation.orbits.same_orbit import (
    HALVING,
    VANISHING,
    halves_meet,
    in_phase,
    is_homoclinic,
    same_place,
    vanishing,
)
from fecontact.bifurcation.orbits.state_error import state_error
from fecontact.core.types import Array

# Largest distance of a guess from the tangent, in steps.
_MOST_BENT = 0.2
# Largest relative difference in amplitude of the same orbit on two meshes.
_AMPLITUDE_CHANGE = 0.1
# Error aimed at with other intervals, in the tolerance, and the part of them below which fewer do.
_AIM, _FEWER = 0.1, 0.65
# Largest factor between the intervals of one mesh and the next.
_MOST_CHANGE = 2.0
# Largest tolerance of Newton's method, in that of the states.
_NEWTON = 1e-2
# Steps in a row that have to allow fewer intervals: where a motion begins to stick, errors vary.
_CALM = 10
# Numbers of intervals are multiples of this: so many are eliminated at once.
_AT_ONCE = 8
# Part to which another distribution of as many intervals has to reduce the error to be made again.
_WORTH = 0.5
# In place of an error without bound: no other mesh is tried where that is met once more.
_WITHOUT_BOUND = np.finfo(float).max


@dataclass(frozen=True)
class Intervals:
    """Rule for the number of intervals of orbits along a branch.

    Attributes
    ----------
    least, most : int
        Limits of their number.
    tolerance : float
        Largest error of the states, see
        :func:`fecontact.bifurcation.orbits.state_error.state_error`.
    """

    least: int
    most: int
    tolerance: float

    @classmethod
    def of(cls, method: Collocation, least: int = 0) -> "Intervals | None":
        """The rule of a method, with no fewer than ``least``; None where their number is kept."""
        if method.state_tolerance is None:
            return None
        fewest = least or int(method.intervals)
        return cls(fewest, max(fewest, int(method.most_intervals)), method.state_tolerance)

    def after(self, given: int, error: float, degree: int) -> int:
        """Number of intervals for orbits like one that has this error on so many.

        More where it is above the tolerance, fewer where two thirds of them would leave it a
        tenth of that, else as many.
        """
        wanted = self._wanted(given, error, degree)
        if error > self.tolerance:
            wanted = min(wanted, _MOST_CHANGE * given)
        elif wanted < _FEWER * given:
            wanted = max(wanted, given / _MOST_CHANGE)
        else:
            return given
        return min(max(_whole(wanted), self.least), max(self.most, given))

    def at_start(self, given: int, error: float, degree: int) -> int:
        """The least number for an orbit that has this error on so many, if it is accurate enough.

        Else as many as a tenth of the tolerance needs, but none more than given.
        """
        on_least = error * (given / self.least) ** (degree + 1)
        if given <= self.least or not on_least > self.tolerance:
            return self.least
        return min(_whole(min(self._wanted(given, error, degree), given)), given)

    def note(self, points: Sequence[BranchPoint]) -> str:
        """Note on orbits of a branch that are less accurate than the tolerance, with the reason."""
        poor = [point for point in points if _error_of(point) > self.tolerance]
        if not poor:
            return ""
        if any(len(point.values["mesh"]) - 1 >= self.most for point in poor):
            reason = f"allow more than most_intervals = {self.most}"
        elif any(point.kind is None for point in poor):
            reason = "Newton's method failed on finer meshes there; start with more intervals"
        else:
            reason = f"take more than intervals = {self.least}"
        worst = max(poor, key=_error_of)
        much = (f"off by up to {_error_of(worst):.1e} at the parameter {worst.parameter:.6g}"
                if np.isfinite(_error_of(worst)) else
                f"and at the parameter {worst.parameter:.6g} without bound, as the field is not "
                f"finite between the Gauss points or the equations about the orbit are singular")
        return (f"The states of {len(poor)} of {len(points)} orbits are less accurate than "
                f"state_tolerance = {self.tolerance:g}, {much}: {reason}.")

    def newton(self, given: float) -> float:
        """Tolerance of Newton's method: the given one, or a hundredth of that of the states."""
        return min(given, _NEWTON * self.tolerance)

    def _wanted(self, given: int, error: float, degree: int) -> float:
        return float(given * (error / (_AIM * self.tolerance)) ** (1.0 / (degree + 1)))


def _error_of(point: Solution | BranchPoint) -> float:
    return float(point.values["state_error"])


def _whole(wanted: float) -> int:
    return _AT_ONCE * int(np.ceil(wanted / _AT_ONCE))


@dataclass(frozen=True, eq=False)
class CollocationProblem(FloquetTests, CollocationEquations, Problem):
    """The problem of following orbits by collocation; see :class:`CollocationEquations`.

    Attributes
    ----------
    age : int
        Steps since the mesh was made.
    renewal : int
        Steps from one mesh to the next, 0 for never.
    limits : (d,) array, optional
        Upper limits up to which the scales of the states grow with the orbit; None keeps the
        scales constant.
    precision : float
        Tolerance of the location of special points, relative to the step. Above 1e-6 normal forms
        are omitted.
    predictor : Predictor
        Of the next orbit, from those before it.
    sizes : Intervals, optional
        Of orbits along the branch; None keeps their number.
    calm : int
        Steps in a row after which fewer of them would have done.
    misfit : float
        Error of the orbit ahead for which this mesh was made, on the mesh before; infinite where
        the mesh is that of the last orbit.
    noted : list of (u, error)
        The last orbit whose error was estimated.
    """

    age: int = 0
    renewal: int = 1
    limits: Array | None = None
    precision: float = 1e-12
    predictor: Predictor = BENT
    sizes: Intervals | None = None
    calm: int = 0
    misfit: float = np.inf
    noted: list[tuple[Array, float]] = field(default_factory=list)

    keeps_matrix: ClassVar[bool] = True
    confirms: ClassVar[frozenset[str]] = frozenset({"period doubling", "torus"})
    ends: ClassVar[Mapping[str, BranchStatus]] = {VANISHING: BranchStatus.HOPF}

    def linearise(self, u: Array) -> CollocationLinearisation:
        """Residual and linearisation at u, each computed on demand."""
        return CollocationLinearisation(self, u)

    def evaluate(self, u: Array) -> CollocationLinearisation:
        """Residual at u, without derivatives."""
        return CollocationLinearisation(self, u, "nothing")

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, stability, mesh, the extremes of the states and their error."""
        return self.point_of(u, linearisation, lambda at, side: at.orbit_change(side, tangent))

    def point_of(
        self, u: Array, linearisation: Any,
        beside: Callable[[CollocationLinearisation, Array], Array],
    ) -> dict[str, Any]:
        """Values of :meth:`point`; ``beside`` gives the change of the orbit by right-hand sides."""
        low, high = extremes(self.nodes(u), self.degree)
        error = state_error(self, u, linearisation, beside)
        self.noted[:] = [(u, error)]
        return {"period": self.period(u), **linearisation.floquet.stored, "mesh": self.mesh,
                "minimum": low, "maximum": high, "state_error": error}

    def attributes(self) -> dict[str, Any]:
        """Attributes of a branch from which its points are restored."""
        kept: dict[str, Any] = {
            **attributes_of(self.field, self.values), "scales": self.scales,
            "periods": self.periods,
            "method": Collocation(self.intervals, self.degree, state_tolerance=None)}
        return kept if self.limits is None else kept | {"limits": self.limits}

    def note(self, points: Sequence[BranchPoint]) -> str:
        """Note on multipliers that are lost, miss jumps of forces, or are of modes too fast."""
        if self.second is not None:
            return super().note(points)
        gauss = rule(self.degree).points
        fast = unresolved_modes(
            self.field, points, lambda point: (np.diff(np.asarray(point.values["mesh"])), gauss),
            "take more intervals")
        missed = missed_jumps(self.field, points)
        return " ".join(filter(None, (self.rounding.note(points), missed, fast)))

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Test functions of the multipliers, and of orbits that shrink to an equilibrium."""
        found = super().tests(u, linearisation, tangent)
        return found | {VANISHING: vanishing(self, u)} if self.autonomous else found

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """At orbits that are homoclinic to a saddle, as far as numbers tell."""
        if self.autonomous and is_homoclinic(self, u, linearisation, tangent):
            return BranchStatus.HOMOCLINIC
        return None

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """Details of a special point; None for a neutral saddle.

        A branch point at which a doubled orbit becomes a single one is a period halving.
        """
        if kind == "branch point" and halves_meet(self, u, tangent):
            return {"kind": HALVING}
        return examined(kind, self, u, linearisation, self.precision < 1e-6)

    def met_again(
        self, origin: Any, u: Array, tangent: Array, like: Array, heading: Array, within: float
    ) -> Array | None:
        """See :meth:`Problem.met_again`: on this mesh, in the phase of ``like``."""
        if not same_place(self, (u, tangent), (like, heading), within):
            return None
        # The amplitude does not depend on the phase either.
        one, other = origin._amplitude(u, self.scales), self._amplitude(like, self.scales)
        if abs(one - other) > within + _AMPLITUDE_CHANGE * max(one, other):
            return None
        return in_phase(self, origin._on_other_mesh(self.mesh, [u])[0], like)

    def _amplitude(self, u: Array, scales: Array) -> float:
        """Root mean square of the states about their mean."""
        nodes = self.nodes(u) / scales[: self.field.dimension]
        weights = np.repeat(self.widths / self.degree, self.degree)
        return float(np.sqrt((weights @ (nodes - weights @ nodes) ** 2).sum()))

    def adapted(self, u: Array, tangent: Array) -> tuple["CollocationProblem", Array, Array]:
        """The problem for the next step: phase condition at u, periodically a new mesh."""
        predictor = self.predictor.after(self.weights(), u, tangent)
        mesh, age, count, calm = self.mesh, self.age + 1, self.intervals, 0
        if self.sizes is not None:
            error = next((error for known, error in self.noted if known is u), None)
            if error is None:
                error = state_error(self, u)
            fewer = min(count, self.sizes.after(count, error, self.degree))
            calm = self.calm + 1 if fewer < count else 0
            if calm >= _CALM:
                count, calm = fewer, 0
        if (self.renewal and age >= self.renewal) or count < self.intervals:
            mesh, age = equidistributed(mesh, self.nodes(u), self.degree, count), 0
            predictor = predictor.moved(self._carried(mesh, predictor.rows))
        u_on, turned = predictor.rows[:2]
        problem = replace(self, mesh=mesh, age=age, reference=self._nodes_on(mesh, u_on),
                          scales=self._grown(u), predictor=predictor, calm=calm, misfit=np.inf)
        return problem, u_on, turned

    def refined(
        self, u: Array, tangent: Array, ahead: Sequence[Solution | BranchPoint]
    ) -> tuple["CollocationProblem", Array, Array] | None:
        """See :meth:`Problem.refined`: more intervals, distributed for the least accurate orbit.

        Where there can be no more, as many: the mesh is that of the orbit before, whose impact may
        be elsewhere. This is repeated as long as it halves the error.
        """
        if self.sizes is None:
            return None
        worst = max(ahead, key=_error_of)
        error = _error_of(worst)
        count = max(self.sizes.after(self.intervals, error, self.degree), self.intervals)
        if count == self.intervals and not self.sizes.tolerance < error <= _WORTH * self.misfit:
            return None
        mesh = equidistributed(self.mesh, self.nodes(worst.u), self.degree, count)
        known = self.predictor.rows
        moved = self._carried(mesh, np.concatenate([[u, tangent], known[2:]]) if len(known)
                              else np.array([u, tangent]))
        problem = replace(self, mesh=mesh, age=0, reference=self._nodes_on(mesh, moved[0]),
                          predictor=self.predictor.moved(moved[: len(known)]), calm=0,
                          misfit=min(error, _WITHOUT_BOUND))
        return problem, moved[0], moved[1]

    def _grown(self, u: Array) -> Array:
        """Scales of states, period and parameter, enlarged with the orbit."""
        if self.limits is None:
            return self.scales
        return enlarged(self.scales, np.ptp(self.nodes(u), axis=0) / 2.0, self.limits)

    def on_mesh(
        self, mesh: Array, u: Array, tangent: Array
    ) -> tuple["CollocationProblem", Array, Array]:
        """Problem, u and tangent on another mesh."""
        moved, turned = self._on_other_mesh(mesh, [u, tangent])
        known = self.predictor.rows
        return replace(self, mesh=mesh, age=0, reference=self._nodes_on(mesh, moved),
                       predictor=self.predictor.moved(known[:0])), moved, turned

    def _nodes_on(self, mesh: Array, u: Array) -> Array:
        """Copy of the nodes (N m, d) of an orbit on another mesh."""
        d = self.field.dimension
        return u[: (len(mesh) - 1) * self.degree * d].reshape(-1, d).copy()

    def _on_other_mesh(self, mesh: Array, vectors: list[Array]) -> list[Array]:
        """Vectors like u on another mesh."""
        return [*self._carried(mesh, np.array(vectors))]

    def _carried(self, mesh: Array, vectors: Array) -> Array:
        """Rows like u on another mesh."""
        nodal = (len(mesh) - 1) * self.degree * self.field.dimension
        out = np.empty((len(vectors), nodal + vectors.shape[1] - self.size))
        carry_over(self.mesh, mesh, self.degree, vectors, out)
        return out
