"""Factors of a sparse symmetric positive definite matrix: CHOLMOD where installed, else SuperLU."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.errors import AnalysisError
from fecontact.core.extras import installed
from fecontact.core.records import FlagVector, Matrix, ShortVector, Vector
from fecontact.core.types import Array, Integers


class Factors(Protocol):
    """``A = P^T L D L^T P``."""

    def solve(self, right: Array) -> Array:
        """``A^-1 right`` of one (n,) or several (n, k) right-hand sides."""

    def triangle(self) -> tuple[Any, Array, Integers]:
        """L, sparse unit lower triangular by columns; the diagonal of D (n,); and the place
        (n,) of each row of A in them.
        """


@dataclass(frozen=True)
class SuperLUFactors:
    """Scipy's SuperLU, kept symmetric: no pivoting, and an ordering by minimum degree or given.

    ``order`` are the rows of A in the order of a matrix that was reordered before.
    """

    factors: Any
    order: Integers | None = None

    def solve(self, right: Array) -> Array:
        """``A^-1 right``."""
        if self.order is None:
            return np.asarray(self.factors.solve(right))
        solution = np.empty_like(right)
        solution[self.order] = self.factors.solve(right[self.order])
        return solution

    def triangle(self) -> tuple[Any, Array, Integers]:
        """L, D and the order; AnalysisError if pivoting has made the factors unsymmetric."""
        if (self.factors.perm_r != self.factors.perm_c).any():
            raise AnalysisError("The stiffness of the supported body is not positive definite; "
                                "look for nearly degenerate cells.")
        places = self.factors.perm_r
        if self.order is not None:
            places = np.empty_like(places)
            places[self.order] = self.factors.perm_r
        return self.factors.L, self.factors.U.diagonal(), places


@dataclass(frozen=True)
class CholmodFactors:
    """SuiteSparse's CHOLMOD through scikit-sparse: supernodal, ordered by nested dissection."""

    factors: Any

    def solve(self, right: Array) -> Array:
        """``A^-1 right``."""
        return np.asarray(self.factors.solve_A(right))

    def triangle(self) -> tuple[Any, Array, Integers]:
        """L, D and the order."""
        L, D = self.factors.L_D()
        return L.tocsc(), D.diagonal(), np.argsort(self.factors.P())


SINGULAR = "The stiffness of the supported body is singular; look for parts connected by one node."


def factorised(
    matrix: Any, nodes: Integers | None = None, *, trouble: str = SINGULAR
) -> Factors:
    """Factors of a sparse symmetric positive definite matrix (n, n).

    ``nodes`` (n,) are the nodes of the rows of a solid, for which nested dissection of the graph of
    its nodes needs several times less memory than minimum degree does, which serves where METIS is
    not installed: there are no wheels of it for some systems. ``trouble`` is the message of the
    error; other than the default one it makes SuperLU refuse indefinite matrices too.

    Raises
    ------
    AnalysisError
        If it is singular or not positive definite, or its factors are too large.
    """
    import scipy.sparse as sp

    try:
        from sksparse.cholmod import CholmodNotPositiveDefiniteError, analyze
    except ImportError:
        from scipy.sparse.linalg import splu

        # Positive definite matrices need no pivoting, which keeps the fill of the ordering.
        try:
            if nodes is not None and installed("pymetis"):
                order = nested_dissection(matrix, nodes)
                found = SuperLUFactors(
                    splu(matrix.tocsr()[order][:, order].tocsc(), permc_spec="NATURAL",
                         diag_pivot_thresh=0.0, options={"SymmetricMode": True}), order)
            else:
                found = SuperLUFactors(
                    splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                         options={"SymmetricMode": True}))
        except RuntimeError:
            raise AnalysisError(trouble) from None
        except MemoryError:
            raise AnalysisError(
                f"The factors of the stiffness of {matrix.shape[0]} unknowns are larger than "
                f"memory, or than SuperLU can count; take eigensolver = 'iterative', a coarser "
                f"mesh or degree = 1, or install fecontact[cholmod].") from None
        if trouble != SINGULAR and (found.factors.U.diagonal() <= 0.0).any():
            raise AnalysisError(trouble) from None
        return found
    plain = sp.csc_matrix(matrix)
    factors = analyze(plain, mode="supernodal", ordering_method="nesdis")
    try:
        factors.cholesky_inplace(plain)
    except CholmodNotPositiveDefiniteError:
        raise AnalysisError(trouble) from None
    return CholmodFactors(factors)


def nested_dissection(matrix: Any, nodes: Integers) -> Integers:
    """Order (n,) of the rows of a symmetric matrix that keeps the fill of its factors low."""
    import pymetis
    import scipy.sparse as sp

    numbers = np.unique(nodes, return_inverse=True)[1].ravel()
    size = int(numbers.max()) + 1
    gather = sp.csr_array((np.ones(len(numbers), dtype=bool),
                           (numbers, np.arange(len(numbers)))), shape=(size, len(numbers)))
    pattern = sp.csr_array((np.ones(matrix.nnz, dtype=bool), matrix.indices, matrix.indptr),
                           shape=matrix.shape)
    graph = sp.csr_array(gather @ pattern @ gather.T)
    graph.setdiag(False)
    graph.eliminate_zeros()
    adjacency = pymetis.CSRAdjacency(graph.indptr, graph.indices)
    place = np.asarray(pymetis.nested_dissection(adjacency)[1])
    return np.argsort(place[numbers], kind="stable")


# Columns per block: enough to vectorise, few enough for the cache.
_BLOCK = 32


@kernel(nogil=True)
def _forward(
    indptr: ShortVector, indices: ShortVector, data: Vector, x: Matrix, active: FlagVector,
) -> None:
    """Solve L x = b in place, L unit lower triangular by columns; zero rows are skipped."""
    n, width = x.shape
    for j in range(n):
        if active[j]:
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                if i != j:
                    active[i] = True
                    entry = data[p]
                    for c in range(width):
                        x[i, c] -= entry * x[j, c]


@kernel(nogil=True)
def _backward(indptr: ShortVector, indices: ShortVector, data: Vector, x: Matrix) -> None:
    """Solve L^T x = b in place."""
    n, width = x.shape
    for j in range(n - 1, -1, -1):
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            if i != j:
                entry = data[p]
                for c in range(width):
                    x[j, c] -= entry * x[i, c]


class SymmetricFactors:
    """Substitutions with the factors ``A = P^T L D L^T P`` of a positive definite matrix.

    Forward substitution of sparse right-hand sides touches only the rows that they reach, a small
    fraction for loads on a boundary. It suffices for ``W A^-1 W^T``; backward substitution is done
    only for the few combinations that are needed in full.
    """

    def __init__(self, factors: Factors) -> None:
        L, diagonal, order = factors.triangle()
        self.L = (L.indptr.astype(np.int32), L.indices.astype(np.int32),
                  np.ascontiguousarray(L.data))
        self.diagonal, self.order = np.asarray(diagonal), order

    def forward_substitute(self, rows: Any) -> tuple[Integers, Array]:
        """``D^-1/2 L^-1 P W^T`` of sparse rows W (k, n): the indices of its non-zero rows (r,)
        and these rows (r, k).
        """
        size, count = len(self.order), rows.shape[0]
        columns = rows.tocsr()

        def solved(first: int) -> tuple[Integers, Array]:
            part = columns[first : first + _BLOCK].tocoo()
            x = np.zeros((size, part.shape[0]))
            x[self.order[part.coords[1]], part.coords[0]] = part.data
            active = np.zeros(size, dtype=bool)
            active[self.order[part.coords[1]]] = True
            _forward(*self.L, x, active)
            reached = np.flatnonzero(active)
            return reached, x[reached]

        blocks = _in_threads(solved, range(0, count, _BLOCK))
        places = np.zeros(size, dtype=bool)
        for reached, _ in blocks:
            places[reached] = True
        kept = np.flatnonzero(places)
        result = np.zeros((len(kept), count))
        column = 0
        for reached, block in blocks:
            result[np.searchsorted(kept, reached), column : column + block.shape[1]] = block
            column += block.shape[1]
        return kept, result / np.sqrt(self.diagonal[kept, None])

    def back_substitute(self, places: Integers, half: Array) -> Array:
        """``A^-1 W^T C`` (n, p) from combinations ``half @ C`` (r, p) of half-solved columns."""
        scaled = half / np.sqrt(self.diagonal[places, None])
        result = np.empty((len(self.order), half.shape[1]))

        def solve(first: int) -> None:
            part = scaled[:, first : first + _BLOCK]
            x = np.zeros((len(self.order), part.shape[1]))
            x[places] = part
            _backward(*self.L, x)
            result[:, first : first + _BLOCK] = x[self.order]

        _in_threads(solve, range(0, half.shape[1], _BLOCK))
        return result


def _in_threads(work: Callable[[int], Any], items: Iterable[int]) -> list[Any]:
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, items))
