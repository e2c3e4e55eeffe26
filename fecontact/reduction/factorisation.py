"""Factors of a sparse symmetric positive definite matrix: CHOLMOD where installed, else SuperLU."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import AnalysisError

Array = NDArray[np.float64]


class Factors(Protocol):
    """``A = P^T L D L^T P``."""

    def solve(self, right: Array) -> Array:
        """``A^-1 right`` of one (n,) or several (n, k) right-hand sides."""

    def triangle(self) -> tuple[Any, Array, NDArray[np.int64]]:
        """L, sparse unit lower triangular by columns; the diagonal of D (n,); and the place
        (n,) of each row of A in them.
        """


@dataclass(frozen=True)
class SuperLUFactors:
    """Scipy's SuperLU, kept symmetric: no pivoting, and a minimum-degree ordering."""

    factors: Any

    def solve(self, right: Array) -> Array:
        """``A^-1 right``."""
        return np.asarray(self.factors.solve(right))

    def triangle(self) -> tuple[Any, Array, NDArray[np.int64]]:
        """L, D and the order; AnalysisError if pivoting has made the factors unsymmetric."""
        if (self.factors.perm_r != self.factors.perm_c).any():
            raise AnalysisError("The stiffness of the held body is not positive definite; look "
                                "for nearly degenerate cells.")
        return self.factors.L, self.factors.U.diagonal(), self.factors.perm_r


@dataclass(frozen=True)
class CholmodFactors:
    """SuiteSparse's CHOLMOD through scikit-sparse: supernodal, ordered by nested dissection."""

    factors: Any

    def solve(self, right: Array) -> Array:
        """``A^-1 right``."""
        return np.asarray(self.factors.solve_A(right))

    def triangle(self) -> tuple[Any, Array, NDArray[np.int64]]:
        """L, D and the order."""
        L, D = self.factors.L_D()
        return L.tocsc(), D.diagonal(), np.argsort(self.factors.P())


def factorised(matrix: Any) -> Factors:
    """Factors of a sparse symmetric positive definite matrix (n, n).

    Raises
    ------
    AnalysisError
        If it is singular or not positive definite.
    """
    import scipy.sparse as sp

    trouble = "The stiffness of the held body is singular; look for parts that hang on one node."
    try:
        from sksparse.cholmod import CholmodNotPositiveDefiniteError, analyze
    except ImportError:
        from scipy.sparse.linalg import splu

        # Positive definite: no pivoting is needed, and the fill of an ordering for symmetric
        # matrices is kept.
        try:
            return SuperLUFactors(splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A",
                                       diag_pivot_thresh=0.0, options={"SymmetricMode": True}))
        except RuntimeError:
            raise AnalysisError(trouble) from None
    plain = sp.csc_matrix(matrix)
    factors = analyze(plain, mode="supernodal", ordering_method="nesdis")
    try:
        factors.cholesky_inplace(plain)
    except CholmodNotPositiveDefiniteError:
        raise AnalysisError(trouble) from None
    return CholmodFactors(factors)
