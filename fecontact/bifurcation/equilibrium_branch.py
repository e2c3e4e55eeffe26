"""Branches of equilibria over one parameter, their folds, Hopf and branch points."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation.branch import Branch, BranchPoint
from fecontact.bifurcation.contact_field import ContactField
from fecontact.bifurcation.continuation import Problem, Settings
from fecontact.bifurcation.equilibria import (
    Equilibrium,
    find_equilibrium,
    require_autonomous,
    sorted_eigenvalues,
)
from fecontact.bifurcation.follow import follow
from fecontact.bifurcation.normal_forms import (
    branching_tangents,
    fold_coefficient,
    hopf,
    null_vectors,
)
from fecontact.bifurcation.vector_field import VectorField
from fecontact.errors import AnalysisError, InputError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Cosine between df/dp and the range of the Jacobian below which a fold is a branch point.
_TRANSVERSAL = 1e-5
_HUGE = 1e100


@dataclass(frozen=True, eq=False)
class _Bordered:
    """df/dx, df/dp and f at one place."""

    residual: Array
    matrix: Array

    def solve(self, row: Array, rhs: Array) -> Array:
        whole = np.vstack([self.matrix, row])
        try:
            return np.asarray(np.linalg.solve(whole, rhs))
        except np.linalg.LinAlgError:  # exactly on a branch point
            return np.asarray(np.linalg.lstsq(whole, rhs, rcond=None)[0])

    @property
    def jacobian(self) -> Array:
        return self.matrix[:, :-1]

    @cached_property
    def eigenvalues(self) -> ComplexArray:
        return sorted_eigenvalues(self.jacobian)


class EquilibriumProblem(Problem):
    """f(x, p) = 0 with one parameter of the field free; unknowns u = [x, p]."""

    def __init__(
        self, field: VectorField, values: Array, index: int, scales: Array, width: float,
        limits: Array | None = None,
    ) -> None:
        self.field, self.index, self.scales = field, index, scales
        self._values, self._width, self._limits = values.copy(), width, limits
        self._weights = np.append(scales, width) ** -2.0

    def values(self, u: Array) -> Array:
        """Parameter values (k,) at u."""
        values = self._values.copy()
        values[self.index] = u[-1]
        return values

    def linearise(self, u: Array) -> _Bordered:
        f, J, P = self.field.derivatives(np.zeros(1), np.ascontiguousarray(u[None, :-1]),
                                         self.values(u), (self.index,))
        matrix = np.concatenate([J[0], P[0]], axis=1)
        if not max(np.abs(f).max(), np.abs(matrix).max()) < _HUGE:
            raise AnalysisError("The rates grow beyond all numbers there.")
        return _Bordered(f[0], matrix)

    def weights(self) -> Array:
        return self._weights

    def adapted(self, u: Array, tangent: Array) -> tuple[Problem, Array, Array] | None:
        """Where the scales were not given, they grow with the states."""
        if self._limits is None:
            return None
        larger = np.clip(np.abs(u[:-1]), self.scales, self._limits)
        if (larger <= 1.5 * self.scales).all():
            return None
        return EquilibriumProblem(self.field, self._values, self.index, larger, self._width,
                                  self._limits), u, tangent

    def point(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, Any]:
        eigenvalues = linearisation.eigenvalues
        unstable = int((eigenvalues.real > 0.0).sum())
        return {"state": u[:-1].copy(), "unstable": unstable, "stable": unstable == 0,
                "eigenvalues": eigenvalues}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> Mapping[str, float]:
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
        if kind == "Hopf":
            return self._hopf(u, linearisation)
        x, values = np.ascontiguousarray(u[:-1]), self.values(u)
        v, w = null_vectors(linearisation.jacobian)
        if kind == "fold":
            P = linearisation.matrix[:, -1]
            if abs(w @ P) <= _TRANSVERSAL * np.linalg.norm(P):
                return None
            return {"null_vector": v,
                    "coefficient": fold_coefficient(self.field, x, values, self.scales)}
        if kind == "branch point":
            other = branching_tangents(self.field, x, values, self.index, self.scales, tangent)
            return {"null_vector": v} | ({} if other is None else {"other_tangent": other})
        return {}

    def _hopf(self, u: Array, linearisation: Any) -> Mapping[str, Any] | None:
        """Details of a Hopf point; None for a pair of real eigenvalues of opposite sign."""
        if not crossing_is_complex(linearisation.eigenvalues):
            return None
        x = np.ascontiguousarray(u[:-1])
        found = hopf(self.field, x, self.values(u), self.scales)
        return {
            "angular_frequency": found.angular_frequency,
            "frequency_hz": found.angular_frequency / (2.0 * np.pi),
            "period": 2.0 * np.pi / found.angular_frequency,
            "eigenvector": found.eigenvector,
            "first_lyapunov": found.first_lyapunov,
            "first_lyapunov_error": found.error,
            "criticality": found.criticality,
        }


def pair_test(eigenvalues: ComplexArray) -> float:
    """Zero where two eigenvalues add up to zero: a Hopf point, or real ones of opposite sign.

    The sign is that of the product of all sums of two; it changes at each of them. The size is
    that of the smallest real sum.
    """
    real = eigenvalues[eigenvalues.imag == 0.0].real
    first, second = np.triu_indices(len(real), 1)
    sums = np.concatenate([2.0 * eigenvalues[eigenvalues.imag > 0.0].real,
                           real[first] + real[second]])
    if not len(sums):
        return 1.0
    sign = -1.0 if (sums < 0.0).sum() % 2 else 1.0
    return float(sign * np.abs(sums).min())


def crossing_is_complex(eigenvalues: ComplexArray) -> bool:
    """Whether the sum nearest to zero in :func:`pair_test` is that of a complex pair."""
    real = eigenvalues[eigenvalues.imag == 0.0].real
    pairs = eigenvalues[eigenvalues.imag > 0.0]
    if not len(pairs):
        return False
    first, second = np.triu_indices(len(real), 1)
    of_reals = np.abs(real[first] + real[second]).min(initial=np.inf)
    return bool(2.0 * np.abs(pairs.real).min() < of_reals)


def equilibrium_branch(
    field: VectorField,
    parameter: str,
    start: Equilibrium | ArrayLike | None = None,
    *,
    settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
    direction: float = 1.0,
    both: bool = False,
    scales: ArrayLike | None = None,
    width: float | None = None,
) -> Branch:
    """Follow an equilibrium over a parameter.

    Each point stores 'state' (d,), 'eigenvalues' (d,), 'unstable' (number of eigenvalues with
    positive real part) and 'stable'. Special points are

    - 'fold': with its null_vector and quadratic coefficient,
    - 'Hopf': angular_frequency, frequency_hz, period, eigenvector, first_lyapunov and criticality
      ('supercritical', 'subcritical' or 'undecided', see
      :func:`fecontact.bifurcation.normal_forms.hopf`),
    - 'branch point': null_vector, and other_tangent for :func:`switched_branch`.

    Parameters
    ----------
    field : VectorField
        Its rates must not depend on time.
    parameter : str
        The one that is varied.
    start : Equilibrium or (d,) sequence, optional
        Where to begin; see :func:`fecontact.bifurcation.equilibria.find_equilibrium`.
    settings : Settings, optional
        How the branch is followed.
    bounds : (float, float), optional
        Range of the parameter, as in the settings.
    direction : float
        Sign of the first change of the parameter.
    both : bool
        Go to both sides.
    scales : sequence, optional
        Sizes (d,) of the states in the diagram, for arclengths; by default those of the field or
        the largest state at the start, growing with the
        states up to a hundred times that.
    width : float, optional
        Width of the diagram in the parameter; by default that of the bounds, or the size of the
        parameter at the start.

    Raises
    ------
    InputError
        If the parameter is unknown.
    AnalysisError
        If no equilibrium is found at the start.
    """
    index = field.index(parameter)
    begin = _start(field, start)
    problem, chosen = _problem(field, begin, index, settings, bounds, scales, width)
    u = np.append(begin.state, begin.values[index])
    return follow(problem, u, chosen, name=parameter, direction=direction, both=both,
                  attributes=_attributes(field, begin))


def switched_branch(
    field: VectorField,
    parameter: str,
    point: BranchPoint,
    start: Equilibrium | None = None,
    *,
    settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
    both: bool = True,
    scales: ArrayLike | None = None,
    width: float | None = None,
    values: ArrayLike | None = None,
) -> Branch:
    """The other branch through a branch point of :func:`equilibrium_branch`.

    ``values`` (k,) are the parameter values of the branch, the field's base values by default;
    the other arguments as there.

    Raises
    ------
    InputError
        If the point is no branch point, or no second branch crosses there.
    """
    index = field.index(parameter)
    if "other_tangent" not in point.details:
        raise InputError(f"The point at {parameter} = {point.parameter:.6g} "
                         f"({point.kind or 'a regular point'}) has no second branch; give a "
                         f"special point of the kind 'branch point' with other_tangent.")
    given = field.values if values is None else np.array(values, dtype=float)
    given[index] = point.parameter
    begin = start or Equilibrium(field, given, np.ascontiguousarray(point.u[:-1]))
    problem, chosen = _problem(field, begin, index, settings, bounds, scales, width)
    tangent = np.asarray(point.details["other_tangent"], dtype=float)
    weights = problem.weights()
    tangent = tangent / np.sqrt(weights * tangent @ tangent)
    points: list[BranchPoint] = []
    ends = []
    for side in (-1.0, 1.0) if both else (1.0,):
        # The first step leaves the branch point, where the two directions cannot be told apart.
        first = point.u + side * chosen.step * tangent
        branch = follow(problem, first, chosen, name=parameter, tangent=side * tangent,
                        attributes=_attributes(field, begin))
        ends.append(branch)
        if side < 0.0:
            points = [replace(each, tangent=-each.tangent) for each in branch.points[::-1]]
            points.append(replace(point, tangent=tangent))
        else:
            points = [*(points or [replace(point, tangent=tangent)]), *branch.points]
    return replace(ends[-1], points=tuple(points))


def _start(field: VectorField, start: Equilibrium | ArrayLike | None) -> Equilibrium:
    if isinstance(start, Equilibrium):
        require_autonomous(field, start.values)
        return start
    return find_equilibrium(field, start=start)


def _problem(
    field: VectorField, begin: Equilibrium, index: int, settings: Settings | None,
    bounds: tuple[float, float] | None, scales: ArrayLike | None, width: float | None,
) -> tuple[EquilibriumProblem, Settings]:
    chosen = settings or Settings()
    if bounds is not None:
        chosen = replace(chosen, bounds=bounds)
    if width is None:
        span = chosen.bounds[1] - chosen.bounds[0]
        width = span if np.isfinite(span) else abs(float(begin.values[index])) or 1.0
    sizes = default_scales(begin) if scales is None else np.array(scales, dtype=float)
    limits = 100.0 * sizes if scales is None else None
    return EquilibriumProblem(field, begin.values, index, sizes, width, limits), chosen


def default_scales(begin: Equilibrium) -> Array:
    """Sizes (d,) of the states: those of the field, for contact systems the largest state."""
    if not isinstance(begin.field, ContactField):
        return begin.field.state_scales(begin.values)
    largest = float(np.abs(begin.state).max())
    return np.full(begin.field.dimension, largest or 1.0)


def _attributes(field: VectorField, begin: Equilibrium) -> dict[str, Any]:
    return {"state_names": list(field.state_names), "parameter_names": list(field.parameters),
            "parameter_values": begin.values}
