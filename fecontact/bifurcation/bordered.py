"""Collocation systems with further rows: the phase condition, the one that fixes a step."""

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation import elimination
from fecontact.errors import AnalysisError

Array = NDArray[np.float64]


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
        count, N = len(borders), len(factors.local)
        self._local = np.empty((count, N, factors.local_pivots.shape[1]))
        self._chain = np.empty((count, N - 1, d))
        for index, border in enumerate(borders):
            self._local[index], self._chain[index] = border.local, border.chain

    def solve(self, rhs: Array) -> Array:
        """All unknowns for a right side of all rows.

        Raises
        ------
        AnalysisError
            If the matrix is singular.
        """
        N, size, _ = self._factors.local.shape
        d = self._factors.end.shape[0]
        parts = np.empty((N, size)), np.empty((N - 1, 2 * d))
        side = np.empty(len(self.matrix))
        elimination.reduce_side(self._factors, rhs, self._local, self._chain, *parts, side)
        try:
            return self._expand(parts, np.linalg.solve(self.matrix, side))
        except np.linalg.LinAlgError:
            raise AnalysisError("The equations of the orbit are singular there.") from None

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
