"""Unknowns of the iterative solver: displacements of nodes that nothing determines, in threes.

Supports and constraints make all displacements u (3 N,) of a solid follow from unknowns x (3 n,),

    u = E x,      R x = 0.

Three unknowns are those of one node; fixed and dependent displacements of a node stay as unknowns
that are zero. Rotations and displacements of reference points and angles of hinges follow in
threes. Equations R of many unknowns, such as that of the mean motion of a face, are not substituted
into others, which would couple each of these unknowns with each other.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elimination import selects

# Largest number of equations R, and of angles and motions of points.
_EQUATIONS = 400
_MOTIONS = 2000
# Smallest eigenvalue, relative to the largest, of the motions of points that nodes show.
_SHOWN = 1e-10


@dataclass(frozen=True, eq=False)
class Dependence:
    """Displacements u = E x, of which most are unknowns themselves.

    Attributes
    ----------
    source : (3 N,) integers
        The unknown that each displacement is, -1 for none.
    dependent : (k,) integers
        Displacements that follow from unknowns.
    columns : (c,) integers
        Unknowns from which they follow.
    matrix, transposed : sparse (k, c) and (c, k)
        Their coefficients, by rows.
    size : int
        Number 3 n of unknowns.
    """

    source: Integers
    dependent: Integers
    columns: Integers
    matrix: Any
    transposed: Any
    size: int

    def displacements(self, x: Array) -> Array:
        """E x (3 N, k) of unknowns (3 n, k)."""
        u = x[self.source]
        u[self.source < 0] = 0.0
        u[self.dependent] = self.matrix @ x[self.columns]
        return u

    def forces(self, f: Array) -> Array:
        """E^T f (3 n, k) of forces (3 N, k)."""
        own = np.flatnonzero(self.source >= 0)
        found = np.zeros((self.size, f.shape[1]), f.dtype)
        found[self.source[own]] = f[own]
        found[self.columns] += self.transposed @ f[self.dependent]
        return found

    def single(self) -> "Dependence":
        """Copy in single precision."""
        return replace(self, matrix=self.matrix.astype(np.float32),
                       transposed=self.transposed.astype(np.float32))

    @cached_property
    def blocks(self) -> Any:
        """E, sparse (3 N, 3 n) of 3 x 3 blocks."""
        import scipy.sparse as sp

        own = np.flatnonzero(self.source >= 0)
        follow = self.matrix.tocoo()
        rows = np.concatenate([own, self.dependent[follow.row]])
        columns = np.concatenate([self.source[own], self.columns[follow.col]])
        E = sp.csr_array(sp.coo_array(
            (np.concatenate([np.ones(len(own)), follow.data]), (rows, columns)),
            shape=(len(self.source), self.size)))
        return sp.bsr_array(E, blocksize=(3, 3))


@dataclass(frozen=True, eq=False)
class SolverUnknowns:
    """Unknowns x (3 n,) of the iterative solver of a body with f free degrees of freedom q.

    Attributes
    ----------
    moving : (n, 3) array
        One for unknowns, zero for fixed and dependent displacements.
    spread : sparse (3 n, f) array
        x from q.
    pick : sparse (f, 3 n) array
        q from x, some of its components.
    dependence : Dependence or None
        E; None where x are all displacements.
    equations : sparse (m, 3 n) array or None
        R; None for no equations.
    """

    moving: Array
    spread: Any
    pick: Any
    dependence: Dependence | None = None
    equations: Any = None

    @classmethod
    def of(cls, body: ElasticBody) -> "SolverUnknowns | None":
        """The unknowns of a solid; None if the iterative solver does not know what to do with them.

        It does not where reference points have motions that no node shows, or where there are
        hundreds of equations R or thousands of reference points.
        """
        E = body.expansion
        if not (body.hinges or body.equations) and selects(E):
            moving = np.zeros(E.shape[0])
            moving[E.indices] = 1.0
            return cls(moving.reshape(-1, 3), E, E.T.tocsr())
        return _constrained(body)

    @property
    def expansion(self) -> Any:
        """E, sparse (3 N, 3 n)."""
        import scipy.sparse as sp

        if self.dependence is None:
            return sp.diags_array(self.moving.ravel(), format="csr")
        return self.dependence.blocks.tocsr()

    def coordinates(self, displacements: Array) -> Array:
        """X (3 n, k) of displacements (3 N, k) that meet supports and constraints."""
        return np.asarray(self.inverse @ displacements)

    @cached_property
    def inverse(self) -> Any:
        """Sparse (3 n, 3 N) array that gives x of displacements E x."""
        import scipy.sparse as sp

        if self.dependence is None:
            return self.expansion
        one = self.dependence
        own = np.flatnonzero(one.source >= 0)
        pick = sp.csr_array((np.ones(len(own)), (one.source[own], own)),
                            shape=(one.size, len(one.source)))
        hidden = np.setdiff1d(np.flatnonzero(self.moving.ravel()), one.source[own])
        if not len(hidden):
            return pick
        # Motions of points and angles, from the least squares of the nodes that show them.
        at = np.searchsorted(one.columns, hidden)
        shown = one.matrix[:, at]
        W = _pseudo_inverse(shown)
        known = sp.csr_array(
            (np.ones(len(one.dependent)), (np.arange(len(one.dependent)), one.dependent)),
            shape=(len(one.dependent), len(one.source)))
        others = np.setdiff1d(np.arange(len(one.columns)), at)
        known = known - one.matrix[:, others] @ pick[one.columns[others]]
        place = sp.csr_array((np.ones(len(hidden)), (hidden, np.arange(len(hidden)))),
                             shape=(one.size, len(hidden)))
        return sp.csr_array(pick + place @ (W @ known))


def _constrained(body: ElasticBody) -> SolverUnknowns | None:
    import scipy.sparse as sp

    one = body.elimination
    G = sp.csc_array(one.matrix[:one.displacements])
    used = np.flatnonzero(np.diff(G.indptr))
    R = sp.csr_array(sp.csc_array(one.rest)[:, used])
    if R.nnz < one.rest.nnz or R.shape[0] > _EQUATIONS:
        return None
    numbers = one.numbers[used]
    own = numbers < one.displacements
    nodes, node = np.unique(numbers[own] // 3, return_inverse=True)
    motions = int(np.count_nonzero(~own))
    slot = np.empty(len(used), np.int64)
    slot[own] = 3 * node + numbers[own] % 3
    slot[~own] = 3 * len(nodes) + np.arange(motions)
    size = 3 * (len(nodes) - (-motions // 3))
    moving = np.zeros(size)
    moving[slot] = 1.0
    source = np.full(one.displacements, -1)
    source[numbers[own]] = slot[own]
    rows = sp.csr_array(G[:, used])
    dependent = np.flatnonzero((np.diff(rows.indptr) > 0) & (source < 0))
    matrix = sp.csc_array(rows[dependent])
    columns = np.flatnonzero(np.diff(matrix.indptr))
    matrix = matrix[:, columns]
    place = sp.csr_array((np.ones(len(used)), (slot, np.arange(len(used)))),
                         shape=(size, len(used)))
    spread = one.spread[used]
    pick = _pick(spread)
    if pick is None or motions > _MOTIONS or (
            _pseudo_inverse(G[:, used[~own]]) is None):
        return None
    return SolverUnknowns(
        moving.reshape(-1, 3), sp.csr_array(place @ spread), sp.csr_array(pick @ place.T),
        Dependence(source, dependent, slot[columns], sp.csr_array(matrix),
                   sp.csr_array(matrix.T), size),
        _orthonormal(R) @ place.T if R.shape[0] else None)


def _pick(spread: Any) -> Any:
    """Rows, sparse (f, p), that take the independent unknowns from all; None if there are none."""
    import scipy.sparse as sp

    rows = sp.csr_array(spread)
    alone = np.flatnonzero(np.diff(rows.indptr) == 1)
    alone = alone[rows.data[rows.indptr[alone]] == 1.0]
    columns, first = np.unique(rows.indices[rows.indptr[alone]], return_index=True)
    if len(columns) < rows.shape[1]:
        return None
    return sp.csr_array((np.ones(len(columns)), (columns, alone[first])),
                        shape=(rows.shape[1], rows.shape[0]))


def _orthonormal(R: Any) -> Any:
    """Equations of the same solutions whose rows are orthonormal."""
    import scipy.sparse as sp
    from scipy.linalg import qr

    used = np.unique(R.indices)
    Q, triangle, _ = qr(R[:, used].toarray().T, mode="economic", pivoting=True)
    size = np.abs(np.diag(triangle))
    found = Q[:, size > _SHOWN * size[0]].T
    rows = np.repeat(np.arange(len(found)), len(used))
    return sp.csr_array((found.ravel(), (rows, np.tile(used, len(found)))),
                        shape=(len(found), R.shape[1]))


def _pseudo_inverse(matrix: Any) -> Any:
    """Left inverse (c, k) of a sparse (k, c) matrix of motions; None for dependent columns."""
    import scipy.sparse as sp

    scale = np.sqrt(np.asarray((matrix * matrix).sum(axis=0)).ravel())
    scaled = sp.csc_array(matrix @ sp.diags_array(1.0 / scale))
    gram = (scaled.T @ scaled).toarray()
    if len(gram) and np.linalg.eigvalsh(gram)[0] < _SHOWN:
        return None
    inverse = np.linalg.inv(gram) / scale[:, None]
    inverse[np.abs(inverse) < 1e-14 * np.abs(inverse).max(initial=0.0)] = 0.0
    return sp.csr_array(sp.csr_array(inverse) @ scaled.T)
