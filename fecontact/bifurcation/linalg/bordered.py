"""Collocation systems with border rows, such as phase condition and arclength condition."""

from contextlib import suppress

import numpy as np

from fecontact.bifurcation.linalg import bordered_kernels
from fecontact.bifurcation.linalg.condensation import CondensedFactors, pivot_rows
from fecontact.core.types import Array, ComplexArray


class Border:
    """A border row, reduced to x_0, x_N and the common unknowns."""

    def __init__(self, factors: CondensedFactors, row: Array) -> None:
        self.weights = np.empty(pivot_rows(factors))
        self.small = np.empty(factors.end.shape[1])
        bordered_kernels.reduce_border(factors, row, self.weights, self.small)

    @classmethod
    def of_unknown(cls, factors: CondensedFactors, place: int) -> "Border":
        """The row of one common unknown, counted from the last one as -1."""
        made = cls.__new__(cls)
        made.weights, made.small = np.zeros(pivot_rows(factors)), np.zeros(factors.end.shape[1])
        made.small[place] = 1.0
        return made


def original_rows(factors: CondensedFactors, end: Array, reduced: Array | None = None) -> Array:
    """Multiples (N m d,) of the collocation rows for those (d,) of the rows of ``factors.end``.

    ``reduced``, if given, are multiples of the pivot rows to be added.
    """
    pivots = pivot_rows(factors)
    out = np.empty(len(factors.local) * factors.inner.shape[1])
    bordered_kernels.original_rows(factors, np.zeros(pivots) if reduced is None else reduced,
                                   np.ascontiguousarray(end), out)
    return out


def expand_open(factors: CondensedFactors, start: Array, end: Array) -> Array:
    """All nodes (N m d,) from both ends (d,), the common unknowns and right-hand sides zero."""
    d, columns = factors.end.shape
    out = np.empty(len(factors.local) * factors.inner.shape[1])
    bordered_kernels.expand(factors, np.zeros(pivot_rows(factors)), np.ascontiguousarray(start),
                            np.ascontiguousarray(end), np.zeros(columns - 2 * d), out)
    return out


def open_side(factors: CondensedFactors, rhs: Array) -> tuple[ComplexArray, ComplexArray]:
    """Complex right-hand sides (N m d,) over the pivot rows, and for the rows of both ends (d,)."""
    parts = [np.array(part, dtype=float) for part in (np.real(rhs), np.imag(rhs))]
    reduced, side = np.empty((2, pivot_rows(factors))), np.empty((2, len(factors.end)))
    for place, part in enumerate(parts):
        bordered_kernels.reduce_side(factors, part, reduced[place], side[place])
    return np.asarray(reduced[0] + 1j * reduced[1]), np.asarray(side[0] + 1j * side[1])


def open_solution(
    factors: CondensedFactors, reduced: ComplexArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """All nodes (N m d,), complex, from both ends (d,) and the :func:`open_side` over the pivots.

    The common unknowns are zero.
    """
    d, columns = factors.end.shape
    out = np.empty((2, len(factors.local) * factors.inner.shape[1]))
    for of, nodes in zip((np.real, np.imag), out, strict=True):
        pivots, *ends = (np.array(of(one)) for one in (reduced, start, end))
        bordered_kernels.expand(factors, pivots, *ends, np.zeros(columns - 2 * d), nodes)
    return np.asarray(out[0] + 1j * out[1])


def solve_turned(factors: CondensedFactors, rhs: Array, closing: complex) -> ComplexArray:
    """All nodes (N m d,) with x(1) = closing x(0), the common unknowns zero.

    ``rhs`` (N m d,) are the right-hand sides of the collocation rows; both are complex. The
    solution of a singular system is not finite.
    """
    d = len(factors.end)
    reduced, side = open_side(factors, rhs)
    start: ComplexArray = np.full(d, np.nan, dtype=complex)
    with suppress(np.linalg.LinAlgError):
        start[:] = np.linalg.solve(factors.end[:, :d] + closing * factors.end[:, d : 2 * d], side)
    return open_solution(factors, reduced, start, closing * start)


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

    def weakest(self) -> tuple[float, Array, Array]:
        """Smallest singular value of the reduced matrix, of even rows, and both its vectors.

        The left one is given as multiples (N m d,) of the collocation rows, the right one with all
        unknowns.
        """
        d, matrix = len(self._factors.end), self.matrix
        size = np.abs(matrix).max(axis=1)
        # Both ends may cancel in a whole row, in which nothing but rounding is left.
        size[:d] = np.abs(self._factors.end[:, : 2 * d]).max(axis=1)
        balance = 1.0 / size
        lefts, sizes, rights = np.linalg.svd(matrix * balance[:, None])
        left = lefts[:, -1] * balance
        rows = original_rows(self._factors, left[:d], -left[d:] @ self._weights)
        return float(sizes[-1]), rows, self.expand(rights[-1])

    def softest(self, scales: Array, below: float) -> tuple[float, Array] | None:
        """Smallest singular value of the reduced matrix, of even rows and with unknowns in units
        of ``scales`` (d + e,), and the right vector with all unknowns; None unless it is ``below``.
        """
        d, matrix = len(self._factors.end), self.matrix * scales
        size = np.abs(matrix).max(axis=1)
        ends = np.abs(self._factors.end[:, : 2 * d]) * np.tile(scales[:d], 2)
        size[:d] = np.maximum(size[:d], ends.max(axis=1))
        _, sizes, rights = np.linalg.svd(matrix / size[:, None])
        return (float(sizes[-1]), self.expand(scales * rights[-1])) if sizes[-1] < below else None

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
