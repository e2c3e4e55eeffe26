"""The collocation equations of a periodic orbit about some u."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.linalg import condensation
from fecontact.bifurcation.linalg.bordered import Border, Bordered
from fecontact.bifurcation.orbits.collocation_kernels import fill_residual
from fecontact.bifurcation.orbits.floquet import Floquet, floquet_of

if TYPE_CHECKING:
    from fecontact.bifurcation.orbits.collocation import Collocation

Array = NDArray[np.float64]

_DIFFERENCE = 1e-5  # relative step in a parameter that moves the period of the forcing


class Linearised:
    """Residual of the collocation equations at u, and solutions of systems with their derivative.

    Attributes
    ----------
    period : float
        Period T [s].

    Residual: the collocation rows (N m d), interval by interval, Gauss point by Gauss point, and
    the phase condition where the period is unknown.
    """

    def __init__(self, problem: "Collocation", u: Array, whole: bool = True) -> None:
        self.problem, self.u, self._whole = problem, u, whole
        self.period = problem.period(u)
        self._x, self._slopes = problem.at_gauss_points(problem.nodes(u))
        self._last: tuple[Array, float, Bordered] | None = None

    @cached_property
    def residual(self) -> Array:
        """Residual (N m d + 1,), without the last entry for forced systems."""
        problem = self.problem
        if self._whole:
            f = self.derivatives[0]
        else:
            f = problem.field.rates(self._times, self._x, problem.parameters(self.u))
        out = np.empty(problem.size + problem.autonomous)
        fill_residual(self._slopes, f, problem.widths, self.period,
                      problem.phase_border if problem.autonomous else self.u, self.u, out)
        return out

    @property
    def _times(self) -> Array:
        """Times (N m,) [s] of the Gauss points; all zero where nothing depends on them."""
        if self.problem.autonomous:
            return np.zeros(len(self._x))
        return self.problem.times * self.period

    @cached_property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Rates and their derivatives to state and parameter at the Gauss points."""
        problem, values = self.problem, self.problem.parameters(self.u)
        f, J, P = problem.field.derivatives(self._times, self._x, values, problem.active)
        if not problem.autonomous:
            self._add_forcing(self._x, values, P)
        return f, J, P

    def _add_forcing(self, x: Array, values: Array, P: Array) -> None:
        """Let P be the derivative of T f(T tau, x, p) / T where the parameter moves T."""
        problem, T = self.problem, self.period
        for place, index in enumerate(problem.active):
            h = _DIFFERENCE * max(abs(values[index]), 1e-3)
            sides = []
            for sign in (1.0, -1.0):
                beside = values.copy()
                beside[index] += sign * h
                period = problem.field.forcing_period(beside)
                assert period is not None
                sides.append((beside, problem.periods * period))
            if sides[0][1] == T == sides[1][1]:
                continue
            up, down = (period * problem.field.rates(problem.times * period, x, beside)
                        for beside, period in sides)
            P[:, :, place] = (up - down) / (2.0 * h * T)

    @cached_property
    def factors(self) -> condensation.Factors:
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

    def with_rows(self, rows: list[Array]) -> Bordered:
        """The matrix [[G_u], [row], [row], ...]."""
        borders = [self._phase] if self.problem.autonomous else []
        return Bordered(self.factors, [*borders, *(Border(self.factors, row) for row in rows)], 1.0)

    def bordered(self, row: Array, closing: float = 1.0) -> "Bordered":
        """The matrix [[G_u], [row]]; ``closing`` = -1 is for x(1) = -x(0)."""
        if self._last is not None and self._last[0] is row and self._last[1] == closing:
            return self._last[2]
        borders = [self._phase] if self.problem.autonomous else []
        bordered = Bordered(self.factors, [*borders, Border(self.factors, row)], closing)
        self._last = row, closing, bordered
        return bordered

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        return self.bordered(row).solve(rhs)

    @cached_property
    def floquet(self) -> Floquet:
        """Multipliers and stability."""
        return floquet_of(self.factors, self.problem.autonomous)
