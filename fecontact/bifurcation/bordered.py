"""Collocation systems with further rows: the phase condition, the one that fixes a step."""

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation import bordered_kernels
from fecontact.bifurcation.elimination import Factors

Array = NDArray[np.float64]


class Border:
    """A further row, reduced to x_0, x_N and the common unknowns."""

    def __init__(self, factors: Factors, row: Array) -> None:
        N, _, _ = factors.local.shape
        d = factors.end.shape[0]
        self.local = np.empty((N, factors.local_pivots.shape[1]))
        self.chain = np.empty((N - 1, d))
        self.small = np.empty(factors.end.shape[1])
        bordered_kernels.reduce_border(factors, row, self.local, self.chain, self.small)


class Bordered:
    """A bordered system, with x(1) = closing x(0)."""

    def __init__(
        self, factors: Factors, borders: list[Border], closing: float
    ) -> None:
        self._factors, self._closing = factors, closing
        count, N, d = len(borders), len(factors.local), len(factors.end)
        self._local = np.empty((count, N, factors.local_pivots.shape[1]))
        self._chain = np.empty((count, N - 1, d))
        self._small = np.empty((d + count, factors.end.shape[1]))
        self._small[:d] = factors.end
        for index, border in enumerate(borders):
            self._local[index], self._chain[index] = border.local, border.chain
            self._small[d + index] = border.small

    @property
    def matrix(self) -> Array:
        """The system reduced to x_0 and the common unknowns (d + b, d + e)."""
        d, small = len(self._factors.end), self._small
        return np.hstack([small[:, :d] + self._closing * small[:, d : 2 * d], small[:, 2 * d :]])

    def solve(self, rhs: Array) -> Array:
        """All unknowns for a right side of all rows; not finite where the system is singular."""
        N, size, _ = self._factors.local.shape
        d = len(self._factors.end)
        out = np.empty(N * size + self._small.shape[1] - 2 * d)
        bordered_kernels.solve(self._factors, rhs, self._local, self._chain, self._small,
                          self._closing, out)
        return out

    def expand(self, solution: Array) -> Array:
        """All unknowns from x_0 and the common ones where the right side is zero."""
        N, size, _ = self._factors.local.shape
        d = len(self._factors.end)
        out = np.empty(N * size + len(solution) - d)
        out[N * size :] = solution[d:]
        bordered_kernels.expand(self._factors, np.zeros((N, size)), np.zeros((N - 1, 2 * d)),
                           solution[:d], self._closing * solution[:d], solution[d:],
                           out[: N * size])
        return out
