"""Continuation problem of equilibria over one parameter."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.heading import heading
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem, enlarged
from fecontact.bifurcation.continuation.rounding import Rounding
from fecontact.bifurcation.equilibria.equilibrium import (
    DenseEquations,
    Equilibrium,
    default_scales,
    require_autonomous,
)
from fecontact.bifurcation.equilibria.normal_forms import (
    branching_tangents,
    critical_pair,
    crossing_form,
    fold_coefficient,
    hopf,
    null_vectors,
)
from fecontact.bifurcation.fields.multilinear_forms import bend
from fecontact.bifurcation.orbits.unknowns import FreeParameters
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ComplexArray
from fecontact.system.complex_modes import unstable_count
from fecontact.system.fields.vector_field import VectorField

# Cosine between df/dp and the range of the Jacobian below which a fold is a branch point.
_TRANSVERSALITY = 1e-5
_OVERFLOW = 1e100
# Crossing speed along the branch, relative to the largest eigenvalue, below which a pair stays on
# the imaginary axis, as those of undamped modes do.
_CROSSING = 1e-11
# Turn on a step [rad] that counts as straight, and rate of the parameter, in widths of the diagram,
# below which it rests.
_STRAIGHT, _RESTS = 0.02, 1e-8


class _EigenvalueRounding(Rounding):
    def unstable(self, linearisation: Any, values: Mapping[str, Any]) -> tuple[int, int]:
        """Eigenvalues on the imaginary axis, to rounding, may lie on either side."""
        eigenvalues = linearisation.eigenvalues
        return int(values["unstable"]), len(eigenvalues) - int(unstable_count(-eigenvalues))


class EquilibriumProblem(FreeParameters, Problem):
    """f(x, p) = 0 with one parameter of the field free; unknowns u = [x, p]."""

    rounding = _EigenvalueRounding()

    def __init__(
        self, field: VectorField, values: Array, free: int, sizes: Array,
        limits: Array | None = None,
    ) -> None:
        self.field, self.values, self.free = field, values.copy(), free
        self.scales, self._sizes, self._limits = sizes[:-1], sizes, limits
        self._weights = sizes**-2.0

    def linearise(self, u: Array) -> DenseEquations:
        """The rates and their derivatives at u."""
        f, J, P = self.field.derivatives(np.zeros(1), np.ascontiguousarray(u[None, :-1]),
                                         self.parameters(u), self.active)
        matrix = np.concatenate([J[0], P[0]], axis=1)
        if not max(np.abs(f).max(), np.abs(matrix).max()) < _OVERFLOW:
            raise AnalysisError("The rates are not finite there.")
        return DenseEquations(f[0], matrix, len(u) - 1)

    def weights(self) -> Array:
        """From the scales of the states and the width of the diagram."""
        return self._weights

    def longest_step(self, tangent: Array, turn: float, options: ContinuationOptions) -> float:
        """Largest change of the parameter, in widths of the diagram, on straight parts."""
        rate = abs(float(tangent[-1])) * float(np.sqrt(self._weights[-1]))
        if turn >= _STRAIGHT or not _RESTS < rate < 1.0:
            return options.largest_step
        return options.largest_step / rate

    def adapted(self, u: Array, tangent: Array) -> tuple[Problem, Array, Array] | None:
        """Problem with scales that grow with the states; None if scales were given, or suffice."""
        larger = enlarged(self._sizes, np.abs(u[:-1]), self._limits)
        return None if larger is self._sizes else (EquilibriumProblem(
            self.field, self.values, self.free, larger, self._limits), u, tangent)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, Any]:
        """State, stability and eigenvalues."""
        eigenvalues = linearisation.eigenvalues
        unstable = int(unstable_count(eigenvalues))
        return {"state": u[:-1].copy(), "unstable": unstable, "stable": unstable == 0,
                "eigenvalues": eigenvalues}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, float]:
        """Branch points and Hopf points; see :func:`pair_test`."""
        scaled = np.vstack([linearisation.matrix, tangent * self._weights])
        scaled = scaled / np.sqrt(self._weights)
        scaled = scaled / np.abs(scaled).max()
        sign = np.linalg.slogdet(scaled)[0]
        smallest = np.linalg.svd(scaled, compute_uv=False)[-1]
        return {"branch point": float(sign * smallest),
                "Hopf": pair_test(linearisation.eigenvalues)}

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> Mapping[str, Any] | None:
        """Data of a fold, Hopf or branch point; None if it is none."""
        if kind == "Hopf":
            return self._hopf(u, linearisation, tangent)
        x, values = np.ascontiguousarray(u[:-1]), self.parameters(u)
        v, w = null_vectors(linearisation.jacobian)
        if kind == "fold":
            P = linearisation.matrix[:, -1]
            if abs(w @ P) <= _TRANSVERSALITY * np.linalg.norm(P):
                return None
            return {"null_vector": v,
                    "coefficient": fold_coefficient(self.field, x, values, self.scales)}
        if kind == "branch point":
            other = branching_tangents(self.field, x, values, self.free, self.scales, tangent)
            return {"null_vector": v, **crossing_form(self.field, x, values, self.scales)} | (
                {} if other is None else {"other_tangent": heading(other, self._weights)})
        return {}

    def _hopf(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, Any] | None:
        """Data of a Hopf point; None for real eigenvalues, or a pair that does not cross."""
        if not crossing_is_complex(linearisation.eigenvalues):
            return None
        x = np.ascontiguousarray(u[:-1])
        speed = self._crossing_speed(u, linearisation, tangent)
        if abs(speed) <= _CROSSING * np.abs(linearisation.eigenvalues).max():
            return None
        found = hopf(self.field, x, self.parameters(u), self.scales)
        return found.details | {
            "crossing_speed": speed / float(tangent[-1]) if tangent[-1] else np.inf}

    def _crossing_speed(self, u: Array, linearisation: Any, tangent: Array) -> float:
        """Rate of the critical pair's real part along the branch: Re p^H (dJ/ds) q."""
        _, q, p = critical_pair(linearisation.jacobian)
        values = self.parameters(u)
        shift = np.zeros(len(values))
        shift[self.free] = tangent[-1]
        bent, _ = bend(self.field, np.ascontiguousarray(u[:-1]), values,
                       np.ascontiguousarray(tangent[:-1]), self.scales, (), shift, every=4)
        return float(np.vdot(p, bent.first @ q).real)


def pair_test(eigenvalues: ComplexArray) -> float:
    """Zero where two eigenvalues add up to zero: a Hopf point, or real ones of opposite sign.

    The sign is that of the product of all sums of two; it changes at each of them. The size is
    that of the smallest real sum.
    """
    sums = np.concatenate(_real_sums(eigenvalues))
    if not len(sums):
        return 1.0
    sign = -1.0 if (sums < 0.0).sum() % 2 else 1.0
    return float(sign * np.abs(sums).min())


def crossing_is_complex(eigenvalues: ComplexArray) -> bool:
    """Whether the sum nearest to zero in :func:`pair_test` is that of a complex pair."""
    of_pairs, of_reals = (np.abs(sums).min(initial=np.inf) for sums in _real_sums(eigenvalues))
    return bool(of_pairs < of_reals)


def _real_sums(eigenvalues: ComplexArray) -> tuple[Array, Array]:
    """Sums of two eigenvalues that are real: of complex pairs, and of two real ones."""
    real = eigenvalues[eigenvalues.imag == 0.0].real
    first, second = np.triu_indices(len(real), 1)
    return 2.0 * eigenvalues[eigenvalues.imag > 0.0].real, real[first] + real[second]


def equilibrium_at(field: VectorField, point: BranchPoint) -> Equilibrium:
    """The equilibrium at a point of a branch.

    Raises
    ------
    InputError
        If the point is none of a branch of equilibria, or of one of another field.
    AnalysisError
        If the rates depend on time there.
    """
    values = point.parameter_values(field)
    if point.is_orbit or len(point.u) != field.dimension + 1:
        raise InputError(f"{point.place} is no equilibrium; take a point of a branch of "
                         f"equilibria.")
    require_autonomous(field, values)
    return Equilibrium(field, values, np.ascontiguousarray(point.u[:-1]))


def restored_equilibrium(
    field: VectorField, point: BranchPoint, width: float
) -> tuple[EquilibriumProblem, Array, Array]:
    """Problem, unknowns and tangent of a point of a branch, in a diagram of some width."""
    begin = equilibrium_at(field, point)
    index = field.index(point.branch.parameter_name)
    problem = EquilibriumProblem(field, begin.values, index,
                                 np.append(default_scales(begin), width))
    return problem, point.u, point.tangent
