"""Springs at points and equations between many unknowns, beside a preconditioner without them.

Rows L (m, n) of elongations ``e = L x`` with compliances c (m,), zero for equations ``L x = 0``,
make the approximate inverse T of a stiffness that of the linked one by Woodbury's formula,

    T' = T - T L^T (diag(c) + L T L^T)^-1 L T,

so that ``L T' r = 0`` for equations: iterations that begin with such vectors keep to them. The
forces ``r = L^T f`` of equations move nothing, and are left out before T rounds what they move.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from fecontact.core.types import Array


@dataclass(frozen=True, eq=False)
class Links:
    """Rows of links, and their images by the preconditioner.

    Attributes
    ----------
    rows : sparse (m, n) array
        L.
    equations : sparse (q, n) array
        Rows of those without a compliance; they are orthonormal.
    springs : sparse (k, n) array
        Rows of those with a compliance, times the root of their stiffness.
    images : (n, m) array
        T L^T.
    factors : tuple
        LU factors of ``diag(c) + L T L^T``, scaled.
    scale : (m,) array
        Factor on its rows and columns.
    """

    rows: Any
    equations: Any
    springs: Any
    images: Array
    factors: Any
    scale: Array

    @classmethod
    def of(cls, rows: Any, compliance: Array, precondition: Callable[[Array], Array]) -> "Links":
        """Links with compliances (m,), zero for equations, beside a preconditioner T."""
        import scipy.sparse as sp

        images = np.asarray(precondition(rows.T.toarray()))
        inner = rows @ images + np.diag(compliance)
        scale = 1.0 / np.sqrt(np.diag(inner))
        elastic = compliance > 0.0
        springs = sp.csr_array(
            sp.diags_array(1.0 / np.sqrt(compliance[elastic])) @ rows[elastic])
        factors = lu_factor(inner * np.outer(scale, scale))
        return cls(rows, rows[~elastic], springs, images, factors, scale)

    def without_reactions(self, forces: Array) -> Array:
        """Forces (n, k) without what equations take."""
        return np.asarray(forces - self.equations.T @ (self.equations @ forces),
                          dtype=forces.dtype)

    def linked(self, x: Array) -> Array:
        """T' r in place of x = T r (n, k)."""
        forces = self.rows @ x
        x -= self.images @ (self.scale[:, None] * lu_solve(
            self.factors, self.scale[:, None] * forces))
        return x

    def spring_forces(self, x: Array) -> Array:
        """Forces (n, k) of the springs on displacements (n, k)."""
        return np.asarray(self.springs.T @ (self.springs @ x), dtype=x.dtype)
