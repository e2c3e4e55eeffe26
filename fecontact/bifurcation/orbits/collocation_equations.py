"""Periodic orbits by orthogonal collocation: unknowns, mesh, equations and their linearisation."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from fecontact.bifurcation.linalg import condensation
from fecontact.bifurcation.linalg.bordered import Border, Bordered
from fecontact.bifurcation.orbits.collocation_kernels import (
    at_points,
    fill_mesh,
    fill_phase_row,
    fill_residual,
)
from fecontact.bifurcation.orbits.floquet import Floquet, floquet_of
from fecontact.bifurcation.orbits.mesh import Rule, rule
from fecontact.bifurcation.orbits.unknowns import OrbitUnknowns, beside, by_differences
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField


@dataclass(frozen=True, eq=False)
class CollocationEquations(OrbitUnknowns):
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
        Scales in the step length: of each state (root mean square over the orbit), of the period
        and of the parameter.
    periods : int
        Number of forcing periods in one period of the orbit.
    second : int, optional
        Index of a second free parameter, placed before the first one in u; two equations are then
        missing.
    """

    field: VectorField
    values: Array
    free: int
    mesh: Array
    degree: int
    reference: Array
    scales: Array
    periods: int = 1
    second: int | None = None

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return len(self.mesh) - 1

    @cached_property
    def size(self) -> int:
        """Number N m d of nodal unknowns."""
        return self.reference.size

    @cached_property
    def ranges(self) -> Array:
        """Range (d,) of each state over the orbit that fixes the phase, for steps."""
        low, high = self.reference.min(axis=0), self.reference.max(axis=0)
        least = np.maximum(_LEAST_OF_VALUES * np.maximum(np.abs(low), np.abs(high)),
                           _LEAST_OF_SCALE * self.field.state_scales(self.values))
        return np.maximum(high - low, least)

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
        """Row of the phase condition over all unknowns."""
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

    def weights(self) -> Array:
        """Weights of the inner product: mean over the orbit of the scaled states, T, parameter."""
        return self._on_mesh[2]


# Part of the parameter in the tangent of a branch below which orbits are compared with the nearest
# one instead of that at the same parameter.
_LEAST_SHARE = 0.05
# Singular value of the scaled equations below which, as at branch points, orbits are compared with
# the nearest one across the branch, one from which on that makes no difference, and least change of
# a state, in its scale, for which it counts.
_LEAST_SINGULAR, _REGULAR, _LEAST_CHANGE = 1e-4, 1e-2, 1e-7
# Step of rough Jacobians that are differenced again, in ranges of the states.
_FAR = 3e-4
# Smallest range of a state, in its values and in the scale that its field has.
_LEAST_OF_VALUES, _LEAST_OF_SCALE = 1e-3, 1e-4


class CollocationLinearisation:
    """Residual of the collocation equations at u, and solutions of systems with their derivative.

    Attributes
    ----------
    period : float
        Period T [s].

    ``to`` says which derivatives are formed: those to the parameters are zero for 'states', and
    those to the states as rough as a field likes them, see :meth:`VectorField.rough_derivatives`.
    Residual: the collocation rows (N m d), interval by interval, Gauss point by Gauss point, and
    the phase condition where the period is unknown.
    """

    def __init__(
        self, problem: CollocationEquations, u: Array,
        to: Literal["all", "states", "nothing"] = "all",
    ) -> None:
        self.problem, self.u, self._to = problem, u, to
        self.period = problem.period(u)
        self._x, self._slopes = problem.at_gauss_points(problem.nodes(u))
        self._last: tuple[Array, float, Bordered] | None = None

    @cached_property
    def residual(self) -> Array:
        """Residual (N m d + 1,), without the last entry for forced systems."""
        problem = self.problem
        if self._to != "nothing":
            f = self.derivatives[0]
        else:
            f = problem.field.rates(self.times, self._x, problem.parameters(self.u))
        out = np.empty(problem.size + problem.autonomous)
        fill_residual(self._slopes, f, problem.widths, self.period,
                      problem.phase_border if problem.autonomous else self.u, self.u, out)
        return out

    @property
    def times(self) -> Array:
        """Times (N m,) [s] of the Gauss points; all zero for autonomous systems."""
        if self.problem.autonomous:
            return np.zeros(len(self._x))
        return self.problem.times * self.period

    @cached_property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Rates and their derivatives to state and parameter at the Gauss points.

        Of forced systems that to a parameter includes the change of T: it is that of
        T f(T tau, x, p), divided by T.
        """
        if self._to == "states":
            values = self.problem.parameters(self.u)
            # Plain differences would have other solutions than the equations with derivatives.
            found = self.problem.field.rough_derivatives(
                self.times, self._x, values, (), self.problem.ranges, None)
            f, J, _ = found or self.problem.field.derivatives(self.times, self._x, values, ())
            return f, J, np.zeros((*f.shape, len(self.problem.active)))
        return self._derivatives_at(self.times, self._x)

    def perturbed_derivatives(
        self, shifts: list[Array], *, states_alone: bool = False
    ) -> tuple[Array, Array, Array]:
        """Derivatives (k, N m, ...) as :attr:`derivatives`, at the orbit plus k shifts (N m, d)."""
        x, times = self._perturbed(shifts)
        found = (self.problem.field.derivatives(times, x, self.problem.parameters(self.u), ())
                 if states_alone else self._derivatives_at(times, x))
        return self._apart(found, len(shifts))

    def bent(self, shifts: list[Array]) -> tuple[Array, Array, Array]:
        """Jacobians (k, N m, d, d) and (k, N m, d, q) beside the orbit, and (N m, d, d) on it.

        All are of the same kind, that which takes the least time, so that errors of their
        differences cancel.
        """
        problem, values = self.problem, self.problem.parameters(self.u)
        x, times = self._perturbed(shifts)
        given, known = (problem.active, problem.ranges), self.derivatives[1]
        rough = problem.field.rough_derivatives(times, x, values, *given, None)
        if rough is None:
            # Those that are known are no plain differences.
            rough = problem.field.rough_derivatives(times, x, values, *given, _FAR)
            here = problem.field.rough_derivatives(self.times, self._x, values, (),
                                                   problem.ranges, _FAR)
            if rough is None or here is None:
                _, J, P = self.perturbed_derivatives(shifts)
                return J, P, known
            known = here[1]
        if not problem.autonomous:
            self._add_forcing(times / self.period, x, rough[2])
        _, J, P = self._apart(rough, len(shifts))
        return J, P, known

    def _perturbed(self, shifts: list[Array]) -> tuple[Array, Array]:
        return (np.concatenate([self._x + shift for shift in shifts]),
                np.tile(self.times, len(shifts)))

    def _apart(
        self, found: tuple[Array, Array, Array], count: int
    ) -> tuple[Array, Array, Array]:
        f, J, P = (part.reshape(count, len(self._x), *part.shape[1:]) for part in found)
        return f, J, P

    def _derivatives_at(self, times: Array, x: Array) -> tuple[Array, Array, Array]:
        problem, values = self.problem, self.problem.parameters(self.u)
        f, J, P = problem.field.derivatives(times, x, values, problem.active)
        if not problem.autonomous:
            self._add_forcing(times / self.period, x, P)
        return f, J, P

    def _add_forcing(self, phases: Array, x: Array, P: Array) -> None:
        """Add the dependence of T on the parameter to P, the derivative of T f(T tau, x, p) / T."""
        problem, T = self.problem, self.period

        def rates(u: Array) -> Array:
            period = problem.period(u)
            return period * problem.field.rates(period * phases, x, problem.parameters(u))

        for place in range(-len(problem.active), 0):
            if any(problem.period(u) != T for u in beside(self.u, place)):
                P[:, :, place] = by_differences(rates, self.u, place) / T

    @cached_property
    def factors(self) -> condensation.CondensedFactors:
        """The condensed equations."""
        problem = self.problem
        f, J, P = self.derivatives
        factors = condensation.factors_for(problem.intervals, problem.degree, f.shape[1],
                                           problem.common)
        condensation.condense(J, f, P, problem.widths, self.period, problem.rule.values,
                              problem.rule.slopes, int(problem.autonomous), factors)
        return factors

    @cached_property
    def _phase(self) -> "Border":
        return Border(self.factors, self.problem.phase_border)

    def forget_borders(self) -> None:
        """Reduce borders again, after other factors were given."""
        self._last = None
        self.__dict__.pop("_phase", None)

    def _with_borders(self, *borders: Border, closing: float = 1.0) -> Bordered:
        """The equations with the phase condition, where there is one, and borders."""
        phase = [self._phase] if self.problem.autonomous else []
        return Bordered(self.factors, [*phase, *borders], closing)

    def with_rows(self, rows: list[Array]) -> Bordered:
        """The matrix [[G_u], [row], [row], ...]."""
        return self._with_borders(*(Border(self.factors, row) for row in rows))

    def at_fixed_parameters(self) -> Bordered:
        """The matrix [[G_u], [rows of all parameters]]."""
        return self._with_borders(*(Border.of_unknown(self.factors, place)
                                    for place in range(-len(self.problem.active), 0)))

    def bordered(self, row: Array, closing: float = 1.0) -> "Bordered":
        """The matrix [[G_u], [row]]; ``closing`` = -1 is for x(1) = -x(0)."""
        if self._last is not None and self._last[0] is row and self._last[1] == closing:
            return self._last[2]
        bordered = self._with_borders(Border(self.factors, row), closing=closing)
        self._last = row, closing, bordered
        return bordered

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        return self.bordered(row).solve(rhs)

    def orbit_change(self, side: Array, tangent: Array) -> Array:
        """Change (n,) of the orbit by a right-hand side (n,), zero in the last rows.

        The parameter stays as it is. Near folds of the branch, which has this tangent, and at
        branch points the nearest orbit is taken instead.
        """
        weights, last = self.problem.weights(), self._last
        known = last is not None and last[1] == 1.0
        row = last[0] if last is not None and known else weights * tangent
        change = self._off_crossing(row, self.solve(row, side))
        row = weights * tangent / (weights @ tangent**2)
        change -= (row @ change) * tangent
        share = float(row[-1] * tangent[-1])
        change -= change[-1] * row[-1] / (share + _LEAST_SHARE**2) * tangent
        return change

    def _off_crossing(self, row: Array, change: Array) -> Array:
        """A change of the orbit without that along a branch which crosses there."""
        problem, d = self.problem, self.problem.field.dimension
        largest = np.abs(change[: problem.size].reshape(-1, d) / problem.scales[:d]).max()
        if not _LEAST_CHANGE < largest < np.inf:
            return change
        soft = self.bordered(row).softest(
            np.concatenate([problem.scales[:d], problem.scales[-problem.common :]]), _REGULAR)
        if soft is None:
            return change
        size, across = soft
        rows = problem.weights() * across
        part = float(rows @ change) / float(rows @ across)
        found: Array = change - part * _LEAST_SINGULAR**2 / (size**2 + _LEAST_SINGULAR**2) * across
        return found

    @cached_property
    def floquet(self) -> Floquet:
        """Multipliers and stability."""
        return floquet_of(self.factors, self.problem.autonomous)
