"""Collocation systems with border rows, such as phase condition and arclength condition."""

import numpy as np

from fecontact.bifurcation.linalg import bordered_kernels
from fecontact.bifurcation.linalg.condensation import CondensedFactors, pivot_rows
from fecontact.core.types import Array


class Border:
    """A border row, reduced to x_0, x_N and the common unknowns."""

    def __init__(self, factors: CondensedFactors, row: Array) -> None:
        self.weights = np.empty(pivot_rows(factors))
        self.small = np.empty(factors.end.shape[1])
        bordered_kernels.reduce_border(factors, row, self.weights, self.small)


class Bordered:
    """A bordered system, with x(1) = closing x(0)."""

    def __init__(
        self, factors: CondensedFactors, borders: list[Border], closing: float
    ) -> None:
        self._factors, self._closing = factors, closing
        d = len(factors.end)
        self._weights = np.empty((len(borders), pivot_rows(factors)))
        self._small = np.empty((d + len(borders), factors.end.shape[1]))
        self._small[:d] = factors.end
        for index, border in enumerate(borders):
            self._weights[index], self._small[d + index] = border.weights, border.small

    @property
    def matrix(self) -> Array:
        """The system reduced to x_0 and the common unknowns (d + b, d + e)."""
        d, small = len(self._factors.end), self._small
        return np.hstack([small[:, :d] + self._closing * small[:, d : 2 * d], small[:, 2 * d :]])

    def solve(self, rhs: Array) -> Array:
        """Solution for a right-hand side of all rows; not finite if the system is singular."""
        d = len(self._factors.end)
        out = np.empty(self._nodal + self._small.shape[1] - 2 * d)
        bordered_kernels.solve(self._factors, rhs, self._weights, self._small, self._closing, out)
        return out

    def expand(self, solution: Array) -> Array:
        """All unknowns from x_0 and the common unknowns for a zero right-hand side."""
        d, nodal = len(self._factors.end), self._nodal
        out = np.empty(nodal + len(solution) - d)
        out[nodal:] = solution[d:]
        bordered_kernels.expand(self._factors, np.zeros(pivot_rows(self._factors)), solution[:d],
                                self._closing * solution[:d], solution[d:], out[:nodal])
        return out

    @property
    def _nodal(self) -> int:
        return len(self._factors.local) * self._factors.inner.shape[1]
