"""Multigrid for solids: quadratic elements, linear ones, and aggregates of their nodes.

One V-cycle approximates the inverse of K + shift M in single precision. The displacements of
second-order elements are smoothed by Chebyshev polynomials of the stiffness over its 3 x 3
diagonal blocks, then taken to the linear elements on the same cells, whose shape functions they
contain. These are solved by factors while they are few, else by smoothed aggregation, which
represents the six rigid motions of each aggregate exactly.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.core.extras import installed
from fecontact.core.types import Array
from fecontact.reduction.solvers.block_rows import BlockRows, diagonal_product
from fecontact.reduction.solvers.factorisation import factorised

# Unknowns of linear elements that are factorised, and of the coarsest aggregates.
_FACTORISED = 3000
_COARSEST = 600

# Products with the matrix of one smoothing, and the part of its spectrum that is damped.
_STEPS = 2
_DAMPED = 0.12


@dataclass(frozen=True, eq=False)
class Level:
    """One level: its matrix, the inverse of its block diagonal, and the way to the next one.

    Attributes
    ----------
    product, precondition : callables
        A x and D^-1 x of vectors (n, k).
    smooth : callable
        (step, own, new, residual, x) -> following, see :meth:`BlockRows.smooth`.
    largest : float
        The largest eigenvalue of D^-1 A, as found from below.
    prolongation, restriction : sparse
        Transfer from the next level and to it.
    """

    product: Any
    precondition: Any
    smooth: Any
    largest: float
    prolongation: Any
    restriction: Any

    def improve(self, x: Any, residual: Any) -> Any:
        """Chebyshev iteration for A x = b in place of x and of b - A x.

        The residual lacks the last step, which is returned.
        """
        upper, lower = 1.1 * self.largest, _DAMPED * self.largest
        centre, radius = 0.5 * (upper + lower), 0.5 * (upper - lower)
        ratio = radius / centre
        step = self.precondition(residual)
        step *= np.float32(1.0 / centre)
        x += step
        for _ in range(_STEPS - 1):
            following = 1.0 / (2.0 * centre / radius - ratio)
            step = self.smooth(step, following * ratio, 2.0 * following / radius, residual, x)
            ratio = following
        return step


@dataclass(frozen=True, eq=False)
class Multigrid:
    """Levels, finest first, and the solver of the coarsest one."""

    levels: list[Level]
    coarsest: Any

    def cycle(self, right: Array) -> Array:
        """One V-cycle for right-hand sides (n, k): a symmetric positive definite operator."""
        # Single precision has a smaller range than the forces on small and large bodies.
        scale = np.sqrt(np.einsum("ij,ij->j", right, right))
        scale[scale == 0.0] = 1.0
        scaled = np.divide(right, scale, dtype=np.float32, casting="unsafe", order="C")
        return np.asarray(self._cycle(0, scaled) * scale)

    def _cycle(self, number: int, residual: Any) -> Any:
        """Solution of A x = residual, which is overwritten."""
        if number == len(self.levels):
            return self.coarsest(residual)
        level = self.levels[number]
        x = np.zeros_like(residual)
        last = level.improve(x, residual)
        residual -= level.product(last)
        change = level.prolongation @ self._cycle(number + 1, level.restriction @ residual)
        x += change
        residual -= level.product(change)
        level.improve(x, residual)
        return x


def multigrid(fine: Any, coarse: Any, interpolation: Any, rigid: Array) -> Multigrid:
    """Multigrid for a matrix of second-order elements.

    Parameters
    ----------
    fine, coarse : sparse arrays of 3 x 3 blocks
        The positive definite matrices of the quadratic and of the linear elements; those of linear
        elements alone for both.
    interpolation : sparse (N, n) or (3 N, 3 n) array or None
        Nodal displacements of quadratic elements from those of linear ones, for each of the three
        components or for all; None for none.
    rigid : (3 n, r) array
        The rigid motions of the linear elements, without those of fixed nodes.
    """
    levels = []
    if interpolation is not None:
        levels.append(_nodal_level(fine, interpolation))
    # There are no wheels of PyAMG for some systems: factors of more memory serve there.
    if coarse.shape[0] <= _FACTORISED or not installed("pyamg"):
        factors = factorised(coarse.tocsc(), np.arange(coarse.shape[0]) // 3)
        return Multigrid(levels, lambda right: factors.solve(
            right.astype(np.float64)).astype(np.float32))
    further, last = _aggregated(coarse, rigid)
    return Multigrid(levels + further, last)


def with_finest(cycle: Multigrid, matrix: Any, interpolation: Any) -> Multigrid:
    """Multigrid with another finest matrix of 3 x 3 blocks, interpolated (n, m) from the next."""
    return Multigrid([_nodal_level(matrix, interpolation), *cycle.levels[1:]], cycle.coarsest)


def _nodal_level(matrix: Any, interpolation: Any) -> Level:
    """The level of nodes with three displacements each, and nodal interpolation to it."""
    rows = BlockRows.of(matrix, np.float32)
    inverse = np.linalg.inv(_diagonal_blocks(matrix)).astype(np.float32)
    P = interpolation.astype(np.float32)
    R = P.T.tocsr()
    if P.shape[0] < matrix.shape[0]:
        P, R = ByNodes(P), ByNodes(R)

    def product(x: Any) -> Any:
        return rows.product(x.reshape(len(inverse), 3, -1)).reshape(x.shape)

    def precondition(x: Any) -> Any:
        return diagonal_product(inverse, x.reshape(len(inverse), 3, -1)).reshape(x.shape)

    def smooth(step: Any, own: float, new: float, residual: Any, x: Any) -> Any:
        shape = (len(inverse), 3, -1)
        return rows.smooth(inverse, step.reshape(shape), own, new, residual.reshape(shape),
                           x.reshape(shape)).reshape(x.shape)

    return Level(product, precondition, smooth,
                 _largest(product, precondition, matrix.shape[0]), P, R)


@dataclass(frozen=True, eq=False)
class ByNodes:
    """A matrix between nodes (N, n) that acts on each of the three components."""

    matrix: Any

    def __matmul__(self, x: Any) -> Any:
        rows, columns = self.matrix.shape
        return (self.matrix @ x.reshape(columns, -1)).reshape(3 * rows, -1)


def _aggregated(matrix: Any, rigid: Array) -> tuple[list[Level], Any]:
    """Levels of smoothed aggregation of linear elements, and the solver of the last."""
    import scipy.sparse as sp
    from pyamg.aggregation import smoothed_aggregation_solver
    from scipy.linalg import cho_factor, cho_solve

    hierarchy = smoothed_aggregation_solver(
        sp.bsr_matrix(matrix), B=rigid, strength=("symmetric", {"theta": 0.0}),
        improve_candidates=None, max_coarse=_COARSEST, presmoother=None, postsmoother=None)
    levels = []
    for number, level in enumerate(hierarchy.levels[:-1]):
        P = level.P.astype(np.float32)
        R = P.T.tobsr()
        if number == 0:
            levels.append(replace(_nodal_level(sp.bsr_array(level.A), sp.csr_array((1, 1))),
                                  prolongation=P, restriction=R))
            continue
        A = sp.bsr_array(level.A).astype(np.float32)
        blocks = _diagonal_blocks(level.A)
        for block in blocks:
            _fill_missing(block)
        inverse = np.linalg.inv(blocks).astype(np.float32)

        def product(x: Any, A: Any = A) -> Any:
            return A @ x

        def precondition(x: Any, inverse: Any = inverse) -> Any:
            return (inverse @ x.reshape(len(inverse), inverse.shape[1], -1)).reshape(x.shape)

        def smooth(
            step: Any, own: float, new: float, residual: Any, x: Any, A: Any = A,
            precondition: Any = precondition,
        ) -> Any:
            residual -= A @ step
            following = np.float32(own) * step + np.float32(new) * precondition(residual)
            x += following
            return following

        levels.append(Level(product, precondition, smooth,
                            _largest(product, precondition, A.shape[0]), P, R))
    last = hierarchy.levels[-1].A.toarray()
    _fill_missing(last)
    factors = cho_factor(last)
    return levels, lambda right: cho_solve(factors, right.astype(np.float64)).astype(np.float32)


def _diagonal_blocks(matrix: Any) -> Array:
    """Diagonal blocks (N, d, d) of a BSR array."""
    rows = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
    return np.asarray(matrix.data[rows == matrix.indices], dtype=float)


def _fill_missing(matrix: Array) -> None:
    """Ones on the diagonal where all else is zero.

    Where nodes slide along walls, an aggregate of few of them has less than six motions; those it
    lacks are rows of zeros, on which no force ever acts.
    """
    diagonal = np.einsum("ii->i", matrix)
    diagonal[diagonal == 0.0] = 1.0


def _largest(product: Any, precondition: Any, size: int) -> float:
    """The largest eigenvalue of D^-1 A from a few steps of the power method, from below."""
    x = np.random.default_rng(0).standard_normal((size, 4)).astype(np.float32)
    value = 1.0
    for _ in range(15):
        x /= np.linalg.norm(x, axis=0)
        x = precondition(product(x))
        value = float(np.linalg.norm(x, axis=0).max())
    return value
