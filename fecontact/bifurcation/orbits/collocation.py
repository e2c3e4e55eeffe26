"""Periodic orbits by orthogonal collocation: the equations, and their linearisation."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.corrector_kernels import weighted_norm, weighted_product
from fecontact.bifurcation.continuation.problem import Problem
from fecontact.bifurcation.fields.vector_field import VectorField
from fecontact.bifurcation.orbits.collocation_kernels import at_points, fill_mesh, fill_phase_row
from fecontact.bifurcation.orbits.linearised import Linearised
from fecontact.bifurcation.orbits.mesh import (
    Rule,
    carry_over,
    equidistributed,
    extremes,
    rule,
)
from fecontact.bifurcation.orbits.multiplier_tests import unresolved
from fecontact.bifurcation.orbits.same_orbit import HALVING, halves_meet, in_phase, same_heading
from fecontact.core.errors import InputError

Array = NDArray[np.float64]

# The most by which a guess is bent away from the tangent, in steps.
_MOST_BENT = 0.2
# Part of its amplitude by which that of an orbit differs from one mesh and phase to others, at the
# most.
_UNLIKE = 0.1


@dataclass(frozen=True, eq=False)
class Collocation(Problem):
    """Equations of a periodic orbit of x' = f(t, x, p), one parameter free.

    With time scaled to [0, 1], x is a polynomial of degree m on each of N intervals, continuous
    and periodic, and meets x' = T f at the m Gauss points of each. The error falls as h^(m + 1),
    at the ends of the intervals as h^(2 m). If f does not depend on t, the period T is an unknown
    and the phase is fixed by int <x, y'> = 0 with the orbit y before; else T is ``periods`` times
    the period of the forcing.

    The unknowns are ``u = [nodes (N m d), T if it is unknown, parameter]``.

    Attributes
    ----------
    field : VectorField
    values : (k,) array
        Parameters; the free one is taken from u.
    free : int
        Index of the free parameter.
    mesh : (N + 1,) array
        Ends of the intervals, from 0 to 1.
    degree : int
        m.
    reference : (N m, d) array
        Nodes of the orbit that fixes the phase.
    scales : (d + 2,) array
        What counts as one in the length of a step: of each state (root mean square over the
        orbit), of the period, of the parameter.
    periods : int
        Periods of the forcing in one of the orbit.
    age : int
        Steps since the mesh was made.
    renewal : int
        Steps from one mesh to the next, 0 for never.
    limits : (d,) array, optional
        Up to these the scales of the states grow with the orbit; without limits they stay.
    precision : float
        Part of a step to which special points are located. Above 1e-6 their normal forms are
        left out.
    second : int, optional
        Index of another free parameter, which stands before the first one in u; two equations
        are missing then.
    before : tuple of (n,) arrays
        u, the tangent and, after the first step, its derivative along the branch, from which the
        last step went; empty before the first one.
    """

    field: VectorField
    values: Array
    free: int
    mesh: Array
    degree: int
    reference: Array
    scales: Array
    periods: int = 1
    age: int = 0
    renewal: int = 1
    limits: Array | None = None
    precision: float = 1e-12
    second: int | None = None
    before: tuple[Array, ...] = ()

    keeps_matrix: ClassVar[bool] = True
    confirms: ClassVar[frozenset[str]] = frozenset({"period doubling", "torus"})

    @cached_property
    def autonomous(self) -> bool:
        """Whether the period is an unknown."""
        return self.field.forcing_period(self.values) is None

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return len(self.mesh) - 1

    @cached_property
    def size(self) -> int:
        """Number N m d of nodal unknowns."""
        return self.reference.size

    @cached_property
    def common(self) -> int:
        """Number of unknowns that all intervals share."""
        return len(self.active) + self.autonomous

    @cached_property
    def active(self) -> tuple[int, ...]:
        """Indices of the parameters that are unknowns, in their order in u."""
        return (self.free,) if self.second is None else (self.second, self.free)

    @cached_property
    def rule(self) -> Rule:
        """Basis polynomials and Gauss points."""
        return rule(self.degree)

    @cached_property
    def _on_mesh(self) -> tuple[Array, Array, Array]:
        """Widths of the intervals, times of the Gauss points, weights of the inner product."""
        points = self.intervals * self.degree
        found = (np.empty(self.intervals), np.empty(points), np.empty(self.size + self.common))
        fill_mesh(self.mesh, self.rule.points, self.scales, *found)
        return found

    @property
    def widths(self) -> Array:
        """Widths (N,) of the intervals."""
        return self._on_mesh[0]

    @property
    def times(self) -> Array:
        """Times (N m,) of the Gauss points in [0, 1]."""
        return self._on_mesh[1]

    @property
    def phase_row(self) -> Array:
        """Row (N m d,) of the phase condition."""
        return self.phase_border[: self.size]

    @cached_property
    def phase_border(self) -> Array:
        """The same over all unknowns."""
        row = np.empty(self.size + self.common)
        fill_phase_row(self.reference, self.rule.weights, self.rule.values, self.rule.slopes, row)
        return row

    def at_gauss_points(self, nodes: Array) -> tuple[Array, Array]:
        """States (N m, d) and their slopes over one interval, h x', at the Gauss points."""
        x, slopes = np.empty_like(nodes), np.empty_like(nodes)
        at_points(nodes, self.rule.values, self.rule.slopes, x, slopes)
        return x, slopes

    def nodes(self, u: Array) -> Array:
        """Nodes (N m, d) of the orbit."""
        return u[: self.size].reshape(self.reference.shape)

    def period(self, u: Array) -> float:
        """Period T [s] of the orbit."""
        if self.autonomous:
            return float(u[self.size])
        given = self.field.forcing_period(self.parameters(u))
        assert given is not None
        return self.periods * given

    def parameters(self, u: Array) -> Array:
        """Parameter values (k,)."""
        values = self.values.copy()
        values[self.free] = u[-1]
        if self.second is not None:
            values[self.second] = u[-2]
        return values

    def linearise(self, u: Array) -> Linearised:
        """Residual and linearisation at u; what is not asked for is not computed."""
        return Linearised(self, u)

    def evaluate(self, u: Array) -> Linearised:
        """As :meth:`linearise`, for the residual alone."""
        return Linearised(self, u, whole=False)

    def weights(self) -> Array:
        """Weights of the inner product: mean over the orbit of the scaled states, T, parameter."""
        return self._on_mesh[2]

    def tests(
        self, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, float]:
        """Zero at 'period doubling', 'torus' and 'branch point'; folds are found without."""
        found: dict[str, float] = linearisation.floquet.tests(float(tangent[-1] / self.scales[-1]))
        return found

    def unresolved(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """See :func:`fecontact.bifurcation.orbits.multiplier_tests.unresolved`."""
        first, last = (float(tangent[-1] / self.scales[-1]) for tangent in tangents)
        return unresolved((first, last), values, tests)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, stability, mesh and the extremes of the states."""
        stability = linearisation.floquet
        low, high = extremes(self.nodes(u), self.degree)
        return {"period": self.period(u), "multipliers": stability.multipliers,
                "unstable": stability.unstable, "stable": stability.stable,
                "trivial_error": stability.trivial_error, "mesh": self.mesh, "minimum": low,
                "maximum": high}

    def unstable_range(self, linearisation: Any, values: Any) -> tuple[int, int]:
        """Multipliers as close to the unit circle as their error may lie on either side."""
        found: tuple[int, int] = linearisation.floquet.unstable_range
        return found

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """Details of a special point; None for a neutral saddle.

        A branch point at which a doubled orbit becomes a single one is a period halving.
        """
        from fecontact.bifurcation.orbits.normal_forms import examined

        if kind == "branch point" and halves_meet(self, u, tangent):
            return {"kind": HALVING}
        return examined(kind, self, u, linearisation, self.precision < 1e-6)

    def met_again(
        self, origin: "Problem", u: Array, tangent: Array, like: Array, heading: Array,
        within: float,
    ) -> Array | None:
        """See :meth:`Problem.met_again`: on this mesh, in the phase of ``like``."""
        if not (isinstance(origin, Collocation)
                and same_heading(self.weights(), tangent, heading, self.common)):
            return None
        # No shift in time changes period, parameter and amplitude.
        common = slice(-self.common, None)
        if weighted_norm(self.weights()[common], u[common] - like[common]) > within:
            return None
        one, other = origin._amplitude(u, self.scales), self._amplitude(like, self.scales)
        if abs(one - other) > within + _UNLIKE * max(one, other):
            return None
        return in_phase(self, origin._on_other_mesh(self.mesh, [u])[0], like)

    def _amplitude(self, u: Array, scales: Array) -> float:
        """Distance of the orbit's states from their mean, the root of its mean square."""
        nodes = self.nodes(u) / scales[: self.field.dimension]
        weights = np.repeat(self.widths / self.degree, self.degree)
        return float(np.sqrt((weights @ (nodes - weights @ nodes) ** 2).sum()))

    def predicted(self, u: Array, tangent: Array, step: float) -> Array:
        """Along the tangent, and bent like the step before."""
        guess = u + step * tangent
        if len(self.before) < 3:
            return guess
        # The tangent of old has another length in the mesh and scales of today.
        length = step / weighted_norm(self.weights(), self.before[1])
        aside = 0.5 * length * length * self.before[2]
        straight = weighted_norm(self.weights(), aside) > _MOST_BENT * step
        return guess if straight else guess + aside

    def adapted(self, u: Array, tangent: Array) -> tuple["Collocation", Array, Array]:
        """The problem for the next step: the phase fixed by u, from time to time a new mesh."""
        bend = self._bend(u, tangent)
        vectors = [u, tangent] if bend is None else [u, tangent, bend]
        mesh, age = self.mesh, self.age + 1
        if self.renewal and age >= self.renewal:
            mesh, age = equidistributed(mesh, self.nodes(u), self.degree, self.intervals), 0
            vectors = self._on_other_mesh(mesh, vectors)
        problem = replace(self, mesh=mesh, age=age, reference=self.nodes(vectors[0]).copy(),
                          scales=self._grown(u), before=tuple(vectors))
        return problem, vectors[0], vectors[1]

    def _bend(self, u: Array, tangent: Array) -> Array | None:
        """Derivative of the tangent along the branch, from the last step."""
        if not self.before:
            return None
        direction = self.before[1] / weighted_norm(self.weights(), self.before[1])
        length = weighted_product(self.weights(), direction, u - self.before[0])
        return (tangent - direction) / length if length > 0.0 else None

    def _grown(self, u: Array) -> Array:
        """Scales of states, period and parameter, larger where the orbit has outgrown them."""
        d = self.field.dimension
        if self.limits is None:
            return self.scales
        larger = np.clip(np.ptp(self.nodes(u), axis=0) / 2.0, self.scales[:d], self.limits)
        if (larger <= 1.5 * self.scales[:d]).all():
            return self.scales
        return np.concatenate([larger, self.scales[d:]])

    def on_mesh(self, mesh: Array, u: Array, tangent: Array) -> tuple["Collocation", Array, Array]:
        """Problem, u and tangent on another mesh."""
        moved, turned = self._on_other_mesh(mesh, [u, tangent])
        nodal = (len(mesh) - 1) * self.degree * self.field.dimension
        reference = moved[:nodal].reshape(-1, self.field.dimension).copy()
        return replace(self, mesh=mesh, age=0, reference=reference, before=()), moved, turned

    def _on_other_mesh(self, mesh: Array, vectors: list[Array]) -> list[Array]:
        """Vectors like u on another mesh."""
        nodal = (len(mesh) - 1) * self.degree * self.field.dimension
        out = np.empty((len(vectors), nodal + len(vectors[0]) - self.size))
        carry_over(self.mesh, mesh, self.degree, np.array(vectors), out)
        return [*out]


def require_mesh(intervals: int, degree: int) -> None:
    """Raise :class:`InputError` unless this many intervals of this degree can be used."""
    if not (isinstance(intervals, int | np.integer) and intervals >= 2):
        raise InputError(f"intervals = {intervals!r} must be a whole number of at least 2.")
    if not (isinstance(degree, int | np.integer) and 2 <= degree <= 7):
        raise InputError(f"degree = {degree!r} must be a whole number from 2 to 7.")
