"""Linear systems of harmonic balance of bodies with more modes than contact displacements.

Without contact each harmonic is for itself: A = D + X Y^T, with one block of D for each harmonic,
the mean stiffness of the contacts included, so that rigid modes do no harm. What couples the
harmonics acts on, and through, the r displacements Q^T q of contact nodes alone. By Woodbury's
formula a system of (2 H + 1) r + 2 unknowns is left, the last two for the parameter and the last
row. The unknowns stay those of the modes: orbits, their continuation and files do not depend on how
they are solved for.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.types import Array, Integers
from fecontact.system.fields.vector_field import VectorField

# Unknowns from which this is faster, and largest part of them that may be left.
_LEAST, _MOST_LEFT = 400, 0.5
# Relative size below which rows of contact displacements depend on others.
_DEPENDENT = 1e-12


def contact_directions(field: VectorField, values: Array, harmonics: int) -> Array | None:
    """Orthonormal columns Q (m, r) of what contact nodes see of q; None if it is not much less."""
    if not isinstance(field, ContactField):
        return None
    arrays = field.arrays(values)
    m, L = arrays.rows.shape[2], 2 * harmonics + 1
    if L * m < _LEAST:
        return None
    _, sizes, found = np.linalg.svd(arrays.rows.reshape(-1, m), full_matrices=False)
    rank = int(np.count_nonzero(sizes > _DEPENDENT * sizes.max(initial=0.0)))
    return np.ascontiguousarray(found[:rank].T) if L * rank + 2 <= _MOST_LEFT * L * m else None


@dataclass(frozen=True, eq=False)
class Factors:
    """Factors of a square matrix (n + 1, n + 1), by LAPACK."""

    square: Array
    factors: tuple[Any, Any]
    rest: Integers | None = None

    @classmethod
    def of(cls, square: Array) -> "Factors | None":
        """None for a singular matrix."""
        factors, pivots, failed = dgetrf(square.T)
        return None if failed else cls(square, (factors, pivots))

    @classmethod
    def without(cls, square: Array, left: Integers) -> "Factors | None":
        """Factors without the unknowns that are left out, which stay zero."""
        rest = np.delete(np.arange(len(square)), left)
        found = cls.of(np.ascontiguousarray(square[np.ix_(rest, rest)]))
        return None if found is None else replace(found, rest=rest)

    @property
    def sign(self) -> float:
        """Sign of the determinant."""
        factors, pivots = self.factors
        swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
        return float(np.prod(np.sign(np.diag(factors))) * (-1.0) ** swaps)

    def solve(self, rhs: Array) -> Array:
        """Solution (n + 1,)."""
        if self.rest is None:
            return np.asarray(dgetrs(*self.factors, rhs, trans=1)[0])
        found = np.zeros(len(rhs))
        found[self.rest] = dgetrs(*self.factors, rhs[self.rest], trans=1)[0]
        return found


@dataclass(frozen=True, eq=False)
class WoodburySolver:
    """Factors by Woodbury's formula, for the columns Q (m, r) of contact displacements.

    ``blocks`` are factors of D but for its last entry, one; ``left`` (n + 1, c) is X, ``right``
    (c, n + 1) is Y^T, ``solved`` D^-1 X, and ``core`` the factors of 1 + Y^T D^-1 X.
    """

    square: Array
    blocks: list[tuple[slice, Any, Any]]
    right: Array
    solved: Array
    core: tuple[Any, Any]

    @classmethod
    def of(cls, square: Array, directions: Array) -> "WoodburySolver | Factors | None":
        """None for a singular matrix; factors of all where a harmonic alone is singular."""
        m, r = directions.shape
        n = len(square) - 1
        L = n // m
        places = [slice(0, m), *(slice((2 * k - 1) * m, (2 * k + 1) * m)
                                 for k in range(1, L // 2 + 1))]
        coupled = square[:n, :n].copy()
        blocks = []
        for place in places:
            factors, pivots, failed = dgetrf(square[place, place])
            if failed:
                return Factors.of(square)
            blocks.append((place, factors, pivots))
            coupled[place, place] = 0.0
        seen = coupled.reshape(n * L, m) @ directions
        seen = np.einsum("kmlr,ms->kslr", seen.reshape(L, m, L, r), directions, optimize=True)
        c = L * r
        left, right = np.zeros((n + 1, c + 2)), np.zeros((c + 2, n + 1))
        left[:n, :c] = np.einsum("ms,kslr->kmlr", directions, seen, optimize=True).reshape(n, c)
        for k in range(L):
            right[k * r : (k + 1) * r, k * m : (k + 1) * m] = directions.T
        left[:n, c], right[c, n] = square[:n, n], 1.0
        left[n, c + 1], right[c + 1] = 1.0, square[n]
        right[c + 1, n] -= 1.0
        solved = _through(blocks, left)
        core, pivots, failed = dgetrf(np.eye(c + 2) + right @ solved)
        return None if failed else cls(square, blocks, right, solved, (core, pivots))

    def solve(self, rhs: Array) -> Array:
        """Solution (n + 1,), improved once."""
        found = self._once(rhs)
        return np.asarray(found + self._once(rhs - self.square @ found))

    def _once(self, rhs: Array) -> Array:
        first = _through(self.blocks, rhs[:, None])[:, 0]
        return np.asarray(first - self.solved @ dgetrs(*self.core, self.right @ first)[0])


class BorderedEquations:
    """Solutions of equations with a last row, whose first factors serve any other one too."""

    _made: tuple[Factors | WoodburySolver, Array] | None = None

    @property
    def condensed(self) -> Array:
        """Derivatives (n, n + 1) of the equations."""
        raise NotImplementedError

    def factorised(self, square: Array) -> Factors | WoodburySolver | None:
        """Factors of a square matrix; None where it is singular."""
        return Factors.of(square)

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        if self._made is None:
            made = self.factorised(np.vstack([self.condensed, row]))
            if made is None:
                return np.full(len(row), np.nan)
            self._made = made, np.array(row)
        factors, first = self._made
        found = factors.solve(rhs)
        if np.array_equal(first, row):
            return found
        # Another last row: add what solves the homogeneous equations.
        return np.asarray(found + (rhs[-1] - row @ found) / (row @ self._along) * self._along)

    @cached_property
    def _along(self) -> Array:
        """Solution of the homogeneous equations with one in the last row that was factorised."""
        assert self._made is not None
        factors, first = self._made
        return factors.solve(np.append(np.zeros(len(first) - 1), 1.0))

    def determinant_sign(self, row: Array) -> float:
        """Sign of det [[G_u], [row]] by the factors of :meth:`solve`; 0 where they are singular."""
        if self._made is None:
            self.solve(row, np.zeros(len(row)))
        factors, first = self._made or (None, row)
        if not isinstance(factors, Factors):
            return 0.0
        if np.array_equal(first, row):
            return factors.sign
        return factors.sign * float(np.sign(row @ self._along))


def _through(blocks: list[tuple[slice, Any, Any]], rhs: Array) -> Array:
    """D^-1 times right sides (n + 1, k)."""
    found = rhs.copy()
    for place, factors, pivots in blocks:
        found[place] = dgetrs(factors, pivots, rhs[place])[0]
    return found
