"""Continuation problem of forced orbits under one condition, such as the peak of their response.

The unknowns are u = [coefficients, p, parameter], with the frequency or the level of the force as
p. To the equations G(y) = 0 of a forced orbit, y = [coefficients, p], comes one of three
conditions.

Amplitude: along the response, whose direction v is ``[[G_y], [border]] v = [0, 1]``, the observed
amplitude a does not change, g = a_y v = 0. With ``[[G_y], [border]]^T z = [a_y]`` its derivative is
``dg = da_y v - z dG_y v``, by differences along v alone.

With memory, elements begin and end to slide from sample to sample, and g jumps a little each time.
The orbits y+ and y- a window away on both sides along the response then have the same amplitude,
a(y+) = a(y-): G(y+) = G(y-) = 0, [border] (y+ - y) = [border] (y - y-) = window. The peak lies
between them but for the square of the window, and its amplitude but for the fourth power.

Phase: the displacements lag behind the given force by an angle, Im(P^H X_1 exp(i angle)) = 0. At
pi / 2 the force does no work in phase with them.

Held: the observed amplitude has a given value, a(y) = a_0.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.inner_product import unit, weighted_norm
from fecontact.bifurcation.continuation.newton import newton
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.predictor import BENT
from fecontact.bifurcation.continuation.problem import ContinuationOptions, Problem, width_of
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic import starts
from fecontact.bifurcation.harmonic.estimates import observed_values
from fecontact.bifurcation.harmonic.forced_starts import Forced, given_force, rest_state
from fecontact.bifurcation.harmonic.problem import (
    HarmonicLinearisation,
    HarmonicProblem,
    orientation,
)
from fecontact.bifurcation.harmonic.series import basis_at, differentiated, uniform_basis
from fecontact.bifurcation.harmonic.woodbury import BorderedEquations
from fecontact.bifurcation.orbits.unknowns import by_differences
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Step of differences along the response in its inner product.
_ALONG_STEP = 1e-4
_SAMPLES, _REFINED = 512, 4
# Of orbits beside the resonance: relative size of the last Newton step, and Newton steps.
_TOLERANCE, _ITERATIONS = 1e-9, 12
HELD = "held"


@dataclass(frozen=True, eq=False)
class PeakProblem(Problem):
    """Forced orbits under a condition over a parameter.

    Attributes
    ----------
    orbit : HarmonicProblem
        Orbits over the frequency, or another parameter p, with the row of what is observed.
    second : int
        Index of the parameter.
    width : float
        Its scale in the step length.
    condition : str
        'amplitude', 'phase' or 'held'.
    border : (n + 1,) array
        Row that normalises the direction of the response.
    rest : (d,) array
        State at which the given force is evaluated.
    size : float
        Scale of the condition: an amplitude, or that times a force; the amplitude that is held.
    window : float
        Distance of the orbits that are compared, in the inner product of the orbit; 0 for none.
    lag : float
        Angle [rad] by which displacements are behind the force.
    """

    orbit: HarmonicProblem
    second: int
    width: float
    condition: str
    border: Array
    rest: Array
    size: float = 1.0
    window: float = 0.0
    lag: float = 0.5 * np.pi

    keeps_matrix: ClassVar[bool] = True
    polishes: ClassVar[bool] = True

    @property
    def field(self) -> VectorField:
        """The field of the orbits."""
        return self.orbit.field

    def linearise(self, u: Array) -> "PeakLinearised":
        """Residual and derivative at u, on demand."""
        return PeakLinearised(self, u)

    def at(self, u: Array) -> HarmonicProblem:
        """The problem of orbits over p at the parameter in u."""
        values, fixed = self.orbit.values.copy(), self.orbit.fixed
        values[self.second] = u[-1]
        if fixed is not None:
            fixed = self.orbit.field.forcing_period(values)
        # Compiled equations hold all values but that of p.
        found = replace(self.orbit, values=values, compiled=None, fixed=fixed)
        # The orbit is known to be forced: no system is made to find that out.
        vars(found)["autonomous"] = False
        return found

    def weights(self) -> Array:
        """Weights of the orbit, and of the parameter."""
        return np.append(self.orbit.weights(), self.width**-2.0)

    def orientation(self, linearisation: Any, tangent: Array) -> float:
        """Sign of the determinant of the equations with the tangent below."""
        return orientation(linearisation.condensed, self.weights(), tangent)

    def adapted(self, u: Array, tangent: Array) -> "tuple[PeakProblem, Array, Array]":
        """The problem for the next step: border along the response at u, scales of its orbit."""
        orbit, _, _ = self.at(u).adapted(u[:-1], tangent[:-1])
        orbit = replace(orbit, predictor=BENT)
        along = self.linearise(u).along
        weights = orbit.weights()
        return replace(self, orbit=orbit,
                       border=weights * along / weighted_norm(weights, along)), u, tangent

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, stability, truncation error, what is observed, and its change along the curve."""
        orbit, inner = linearisation.orbit, linearisation.inner
        found = {**orbit.point(u[:-1], inner, tangent[:-1])}
        # Steps need not explain its changes: multipliers that pass one are no folds of the curve.
        found.pop("unstable", None)
        if self.condition == HELD:
            return found | {list(orbit.field.parameters)[orbit.free]: float(u[-2])}
        return found | {"frequency_hz": orbit.periods / inner.period,
                        "amplitude_rate": linearisation.amplitude_rate(tangent)}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """The change of the amplitude along the curve, zero at extrema, unless it is held."""
        if self.condition == HELD:
            return {}
        return {"extremum": linearisation.amplitude_rate(tangent)}


def problem_at(
    wanted: Forced, point: BranchPoint, second: int, row: Array, condition: str,
    amplitude: float, lag: float = 0.5 * np.pi,
) -> tuple[PeakProblem, Array]:
    """Problem and unknowns at a point of a response; see :class:`PeakProblem`."""
    orbit, u, tangent = starts.restored(wanted.field, point)
    orbit = replace(orbit, stability=wanted.method.stability, row=row)
    value = float(wanted.values[second])
    problem = PeakProblem(orbit, second, width_of(None, wanted.options, value), condition,
                          orbit.weights() * tangent, rest_state(wanted.field, wanted.values),
                          amplitude, lag=lag)
    return problem, np.append(u, value)


def followed(
    problem: PeakProblem, u: Array, options: ContinuationOptions, name: str,
    further: Mapping[str, Any],
) -> Branch:
    """The branch through u over the second parameter, to both sides within its range."""
    low, high = options.bounds
    return continue_branch(
        problem, u, options, name=name, direction=1.0 if u[-1] < high else -1.0,
        both=low < u[-1] < high, attributes={
            **problem.orbit.attributes(), "condition": problem.condition, **further})


class PeakLinearised(BorderedEquations):
    """Residual of orbit and condition, and solutions of systems with their derivative."""

    def __init__(self, problem: PeakProblem, u: Array) -> None:
        self.problem, self.u = problem, u
        self.orbit = problem.at(u)
        self.inner: HarmonicLinearisation = self.orbit.linearise(u[:-1])

    @cached_property
    def residual(self) -> Array:
        """Residual (n + 1,)."""
        return np.append(self.inner.residual, self._condition)

    @cached_property
    def gradient(self) -> Array:
        """Derivative (n + 1,) of the observed amplitude to [coefficients, frequency]."""
        return self._gradient(self.u[:-1])

    def _gradient(self, y: Array) -> Array:
        orbit = self.orbit
        X, by_column = orbit.coefficients(y), self._row[orbit.layout.columns]
        x = X @ by_column
        ends = np.array([_extreme(-x), _extreme(x)])
        low, high = basis_at(ends, orbit.harmonics)
        return np.append(np.outer(0.5 * (high - low), by_column).reshape(-1), 0.0)

    @cached_property
    def along(self) -> Array:
        """Direction (n + 1,) of the response."""
        return self.inner.solve(self.problem.border, unit(len(self.u) - 1))

    @cached_property
    def force_row(self) -> Array:
        """Row (n,) of Im(P^H X_1 exp(i lag)) over the coefficients."""
        return self._force_row_at(self.u)

    def _force_row_at(self, u: Array) -> Array:
        problem, orbit = self.problem, self.orbit
        assert isinstance(orbit.field, ContactField)
        values = orbit.values.copy()
        values[[orbit.free, problem.second]] = u[-2:]
        P = given_force(orbit.field, values, problem.rest, orbit.period(u[:-1]))
        P = P * np.exp(1j * (0.5 * np.pi - problem.lag))
        row = np.zeros(orbit.reference.shape)
        row[1, : len(P)], row[2, : len(P)] = P.real, -P.imag
        return np.asarray(row.reshape(-1))

    @cached_property
    def _condition(self) -> float:
        if self.problem.condition == "phase":
            return float(self.force_row @ self.u[:-2]) / self.problem.size
        if self.problem.condition == HELD:
            return float(self.gradient @ self.u[:-1]) / self.problem.size - 1.0
        if self.problem.window:
            below, above = (self._amplitude(y) for y in self._sides)
            return (above - below) / (2.0 * self.problem.window * self.problem.size)
        return float(self.gradient @ self.along) / self.problem.size

    def _amplitude(self, y: Array) -> float:
        orbit = self.orbit
        found = observed_values(orbit.layout, orbit.coefficients(y), orbit.period(y), self._row)
        return float(found["observed_amplitude"])

    def amplitude_rate(self, tangent: Array) -> float:
        """Relative change of the observed amplitude along a direction (n + 2,)."""
        return float(self.gradient @ tangent[:-1]) / self._amplitude(self.u[:-1])

    @property
    def _row(self) -> Array:
        """Row (d,) of the observed displacement."""
        assert self.orbit.row is not None
        return self.orbit.row

    @cached_property
    def _sides(self) -> list[Array]:
        """The orbits a window below and above along the response."""
        found = []
        for way in (-self.problem.window, self.problem.window):
            side = newton(self.orbit, self.u[:-1] + way * self.along, self.problem.border,
                             _TOLERANCE, _ITERATIONS)
            if side is None:
                raise AnalysisError("The response beside the resonance was not found; take smaller "
                                    "steps or more samples.")
            found.append(side[0])
        return found

    def _compared(self) -> Array:
        """Derivative (n + 2,) of the condition by both sides, whose orbits follow the border."""
        slopes = []
        for y in self._sides:
            gradient, at = self._gradient(y), self.orbit.linearise(y)
            right = np.eye(len(y))[-1], np.append(-self._by_parameter(y), 0.0)
            slopes.append([gradient @ at.solve(self.problem.border, one) for one in right])
        along, by_parameter = np.diff(slopes, axis=0)[0] / (2.0 * self.problem.window)
        return np.append(along * self.problem.border, by_parameter) / self.problem.size

    def _by_parameter(self, y: Array) -> Array:
        """Derivative (n,) of the equations of the orbit to the parameter, at y."""
        return by_differences(lambda u: self.problem.at(u).linearise(y).residual,
                              np.append(y, self.u[-1]), least=1e-3 * self.problem.width)

    @cached_property
    def _last_row(self) -> Array:
        """Derivative (n + 2,) of the condition."""
        if self.problem.condition == "phase":
            changes = [by_differences(self._force_row_at, self.u, place, least) @ self.u[:-2]
                       for place, least in ((-2, 0.0), (-1, 1e-3 * self.problem.width))]
            return np.concatenate([self.force_row, changes]) / self.problem.size
        if self.problem.condition == HELD:
            return np.append(self.gradient, 0.0) / self.problem.size
        if self.problem.window:
            return self._compared()
        y, v = self.u[:-1], self.along
        bordered = np.vstack([self.inner.condensed, self.problem.border])
        z = np.linalg.solve(bordered.T, self.gradient)[:-1]
        h = _ALONG_STEP / weighted_norm(self.orbit.weights(), v)
        sides = [(self._gradient(end), self.orbit.linearise(end).condensed,
                  self._by_parameter(end)) for end in (y + h * v, y - h * v)]
        bent = [(one - other) / (2.0 * h) for one, other in zip(*sides, strict=True)]
        return np.append(bent[0] - z @ bent[1], -z @ bent[2]) / self.problem.size

    @cached_property
    def condensed(self) -> Array:
        """Derivative (n + 1, n + 2) of the residual."""
        n = self.orbit.size
        found = np.empty((n + 1, n + 2))
        found[:n, :-1] = self.inner.condensed
        found[:n, -1] = self._by_parameter(self.u[:-1])
        found[n] = self._last_row
        return found


def _extreme(x: Array) -> float:
    """Time tau of the largest value of a series (2 H + 1,)."""
    H = len(x) // 2
    tau = float(np.argmax(uniform_basis(_SAMPLES, H) @ x)) / _SAMPLES
    slope = differentiated(x[:, None])
    bend = differentiated(slope)
    for _ in range(_REFINED):
        row = basis_at(np.array([tau]), H)[0]
        curvature = float(row @ bend[:, 0])
        if curvature >= 0.0:
            break
        tau -= float(np.clip(row @ slope[:, 0] / curvature, -1.0 / _SAMPLES, 1.0 / _SAMPLES))
    return tau
