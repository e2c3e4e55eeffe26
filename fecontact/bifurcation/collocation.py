"""Periodic orbits by orthogonal collocation: the equations, and their linearisation."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation import elimination
from fecontact.bifurcation.interpolation import (
    Rule,
    at_points,
    equidistributed,
    fill_residual,
    interpolate,
    node_times,
    rule,
    to_nodes,
)
from fecontact.bifurcation.vector_field import VectorField
from fecontact.errors import InputError

Array = NDArray[np.float64]

_DIFFERENCE = 1e-5  # relative step in a parameter that moves the period of the forcing


@dataclass(frozen=True, eq=False)
class Collocation:
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
    periods : int
        Periods of the forcing in one of the orbit.
    age : int
        Steps since the mesh was made.
    renewal : int
        Steps from one mesh to the next, 0 for never.
    """

    field: VectorField
    values: Array
    free: int
    mesh: Array
    degree: int
    reference: Array
    periods: int = 1
    age: int = 0
    renewal: int = 3

    @property
    def autonomous(self) -> bool:
        """Whether the period is an unknown."""
        return self._forcing_period is None

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return len(self.mesh) - 1

    @property
    def size(self) -> int:
        """Number N m d of nodal unknowns."""
        return self.reference.size

    @property
    def common(self) -> int:
        """Number of unknowns that all intervals share."""
        return 2 if self.autonomous else 1

    @cached_property
    def _forcing_period(self) -> float | None:
        return self.field.forcing_period(self.values)

    @cached_property
    def rule(self) -> Rule:
        """Basis polynomials and Gauss points."""
        return rule(self.degree)

    @cached_property
    def widths(self) -> Array:
        """Widths (N,) of the intervals."""
        return np.diff(self.mesh)

    @cached_property
    def times(self) -> Array:
        """Times (N m,) of the Gauss points in [0, 1]."""
        return (self.mesh[:-1, None] + self.widths[:, None] * self.rule.points).reshape(-1)

    @cached_property
    def phase_row(self) -> Array:
        """Row (N m d,) of the phase condition."""
        _, slopes = self.at_gauss_points(self.reference)
        row = np.empty_like(self.reference)
        to_nodes(slopes, self.rule.weights[:, None] * self.rule.values, np.ones(self.intervals),
                 row)
        return row.reshape(-1)

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
        return values

    def linearise(self, u: Array) -> "Linearised":
        """Residual and linearisation at u; what is not asked for is not computed."""
        return Linearised(self, u)

    def weights(self) -> Array:
        """Weights of the arclength: mean square of the states, and T and the parameter."""
        scale = self.field.state_scales(self.values)
        nodal = np.repeat(self.widths / self.degree, self.degree)[:, None] / scale**2
        return np.concatenate([nodal.reshape(-1), np.full(self.common, 1.0)])

    def adapted(self, u: Array, tangent: Array) -> tuple["Collocation", Array, Array]:
        """The problem for the next step: the phase fixed by u, from time to time a new mesh."""
        age = self.age + 1
        if not self.renewal or age < self.renewal:
            return replace(self, reference=self.nodes(u).copy(), age=age), u, tangent
        mesh = equidistributed(self.mesh, self.nodes(u), self.degree, self.intervals)
        return self.on_mesh(mesh, u, tangent)

    def on_mesh(self, mesh: Array, u: Array, tangent: Array) -> tuple["Collocation", Array, Array]:
        """Problem, u and tangent on another mesh."""
        times = node_times(mesh, self.degree)
        moved = [np.concatenate([
            interpolate(self.mesh, self.nodes(given), self.degree, times).reshape(-1),
            given[self.size:]]) for given in (u, tangent)]
        problem = replace(self, mesh=mesh, age=0,
                          reference=moved[0][: len(times) * self.field.dimension].reshape(
                              len(times), -1).copy())
        return problem, moved[0], moved[1]


class Linearised:
    """Residual of the collocation equations at u, and solutions of systems with their derivative.

    Residual: the collocation rows (N m d), interval by interval, Gauss point by Gauss point, and
    the phase condition where the period is unknown.
    """

    def __init__(self, problem: Collocation, u: Array) -> None:
        self.problem, self.u = problem, u
        self._last: tuple[Array, float, Bordered] | None = None

    @cached_property
    def _points(self) -> tuple[Array, Array]:
        return self.problem.at_gauss_points(self.problem.nodes(self.u))

    @cached_property
    def period(self) -> float:
        """Period T [s]."""
        return self.problem.period(self.u)

    @cached_property
    def residual(self) -> Array:
        """Residual (N m d + 1,), without the last entry for forced systems."""
        problem = self.problem
        x, slopes = self._points
        if "derivatives" in self.__dict__:
            f = self.derivatives[0]
        else:
            f = problem.field.rates(problem.times * self.period, x, problem.parameters(self.u))
        out = np.empty(problem.size + problem.common - 1)
        fill_residual(slopes, f, problem.widths, self.period, out)
        if problem.autonomous:
            out[-1] = problem.phase_row @ self.u[: problem.size]
        return out

    @cached_property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Rates and their derivatives to state and parameter at the Gauss points."""
        problem, T = self.problem, self.period
        x, _ = self._points
        values = problem.parameters(self.u)
        f, J, P = problem.field.derivatives(problem.times * T, x, values, (problem.free,))
        if not problem.autonomous:
            self._add_forcing(x, values, P)
        return f, J, P

    def _add_forcing(self, x: Array, values: Array, P: Array) -> None:
        """Let P be the derivative of T f(T tau, x, p) / T where the parameter moves T."""
        problem, T = self.problem, self.period
        h = _DIFFERENCE * max(abs(values[problem.free]), 1e-3)
        sides = []
        for sign in (1.0, -1.0):
            beside = values.copy()
            beside[problem.free] += sign * h
            period = problem.field.forcing_period(beside)
            assert period is not None
            sides.append((beside, problem.periods * period))
        if sides[0][1] == T == sides[1][1]:
            return
        up, down = (period * problem.field.rates(problem.times * period, x, beside)
                    for beside, period in sides)
        P[:, :, 0] = (up - down) / (2.0 * h * T)

    @cached_property
    def _factorised(self) -> tuple[elimination.Factors, float]:
        problem = self.problem
        f, J, P = self.derivatives
        factors = elimination.factors_for(problem.intervals, problem.degree, f.shape[1],
                                          problem.common)
        sign = elimination.condense(J, f, P, problem.widths, self.period, problem.rule.values,
                                    problem.rule.slopes, int(problem.autonomous), factors)
        return factors, sign

    @property
    def factors(self) -> elimination.Factors:
        """The condensed equations."""
        return self._factorised[0]

    @cached_property
    def _phase(self) -> "Border":
        row = np.concatenate([self.problem.phase_row, np.zeros(self.problem.common)])
        return Border(self.factors, row)

    def bordered(self, row: Array, closing: float = 1.0) -> "Bordered":
        """The matrix [[G_u], [row]]; ``closing`` = -1 is for x(1) = -x(0)."""
        if self._last is not None and self._last[0] is row and self._last[1] == closing:
            return self._last[2]
        borders = [self._phase] if self.problem.autonomous else []
        bordered = Bordered(self.factors, [*borders, Border(self.factors, row)], closing)
        self._last = row, closing, bordered
        return bordered

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the matrix is singular.
        """
        return self.bordered(row).solve(rhs)

    def determinant(self, row: Array) -> float:
        """A number with the sign of the determinant of [[G_u], [row]], zero with it."""
        matrix = self.bordered(row).matrix
        scale = np.abs(matrix).max(axis=1)
        return self._factorised[1] * float(np.linalg.det(matrix / scale[:, None]))


class Border:
    """A further row, reduced to x_0, x_N and the common unknowns."""

    def __init__(self, factors: elimination.Factors, row: Array) -> None:
        N, _, _ = factors.local.shape
        d = factors.end.shape[0]
        self.local = np.empty((N, factors.local_pivots.shape[1]))
        self.chain = np.empty((N - 1, d))
        self.small = np.empty(factors.end.shape[1])
        elimination.reduce_border(factors, row, self.local, self.chain, self.small)


class Bordered:
    """A bordered system, reduced to ``matrix`` [x_0, common] = side."""

    def __init__(
        self, factors: elimination.Factors, borders: list[Border], closing: float
    ) -> None:
        d = factors.end.shape[0]
        small = np.vstack([factors.end, *(border.small for border in borders)])
        self.matrix = np.hstack([small[:, :d] + closing * small[:, d : 2 * d], small[:, 2 * d :]])
        self._factors, self._closing = factors, closing
        self._local = np.array([border.local for border in borders])
        self._chain = np.array([border.chain for border in borders])

    def solve(self, rhs: Array) -> Array:
        """All unknowns for a right side of all rows."""
        N, size, _ = self._factors.local.shape
        d = self._factors.end.shape[0]
        parts = np.empty((N, size)), np.empty((N - 1, 2 * d))
        side = np.empty(len(self.matrix))
        elimination.reduce_side(self._factors, rhs, self._local, self._chain, *parts, side)
        return self._expand(parts, np.linalg.solve(self.matrix, side))

    def expand(self, solution: Array) -> Array:
        """All unknowns from x_0 and the common ones where the right side is zero."""
        N, size, _ = self._factors.local.shape
        d = self._factors.end.shape[0]
        return self._expand((np.zeros((N, size)), np.zeros((N - 1, 2 * d))), solution)

    def _expand(self, parts: tuple[Array, Array], solution: Array) -> Array:
        N, size, _ = self._factors.local.shape
        d = self._factors.end.shape[0]
        out = np.empty(N * size + len(solution) - d)
        out[N * size :] = solution[d:]
        elimination.expand(self._factors, *parts, solution[:d], self._closing * solution[:d],
                           solution[d:], out[: N * size])
        return out


def require_mesh(intervals: int, degree: int) -> None:
    """Raise :class:`InputError` unless this many intervals of this degree can be used."""
    if not (isinstance(intervals, int | np.integer) and intervals >= 2):
        raise InputError(f"intervals = {intervals!r} must be a whole number of at least 2.")
    if not (isinstance(degree, int | np.integer) and 2 <= degree <= 7):
        raise InputError(f"degree = {degree!r} must be a whole number from 2 to 7.")
