"""Deflections of a solid by elements that are quadratic near loaded nodes and linear elsewhere.

Forces on few nodes bend a body sharply near them and smoothly far away. There the displacements of
the middles of edges follow those of their ends, u = B v, and v solves the equations of the
conforming, smaller model

    B^T K B v = B^T f.

The work f^T u falls short of that of all elements by about the work of the forces left over at the
nodes m that follow, if each gave way alone: the hierarchical estimate of Bank and Smith (SIAM J.
Numer. Anal. 30, 1993),

    sum_m r_m^T K_mm^-1 r_m,    r = f - K B v.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.reduction.solvers.block_rows import BlockRows, diagonal_product
from fecontact.reduction.solvers.multigrid import with_finest
from fecontact.reduction.solvers.solid_solver import (
    SolidSolver,
    held_matrix,
    interpolation,
    moving_components,
    shifted,
)


@dataclass(frozen=True, eq=False)
class NearSolver:
    """The smaller model of a solid of N nodes.

    Attributes
    ----------
    spread : sparse (N, n) array
        B for each component: displacements of all nodes from those of the n that do not follow.
    solver : SolidSolver
        Solver of the smaller model.
    followers : (m,) integers
        The nodes that follow.
    coupling : BlockRows
        Rows of K B at the nodes that follow, in single precision.
    inverse : (m, 3, 3) array
        The inverse of their blocks K_mm, too.
    """

    spread: Any
    solver: SolidSolver
    followers: Integers
    coupling: BlockRows
    inverse: Array

    @classmethod
    def of(
        cls, body: ElasticBody, solver: SolidSolver, loaded: Integers, layers: int
    ) -> "NearSolver":
        """Quadratic elements in so many layers around loaded nodes of a body."""
        import scipy.sparse as sp

        moving = moving_components(body)
        K, M = held_matrix(body.stiffness_blocks, moving), body.component_mass
        between = interpolation(body)
        follows = _following(body, between, loaded, layers)
        own, followers = np.flatnonzero(~follows), np.flatnonzero(follows)
        spread = _spread(between, own, followers)
        B = sp.bsr_array((spread.data[:, None, None] * np.eye(3), spread.indices, spread.indptr),
                         shape=(3 * spread.shape[0], 3 * spread.shape[1]))
        KB = sp.bsr_array(K @ B)
        # Nodes that follow couple fixed displacements with others.
        gather, free = sp.bsr_array(B.T), moving[own]
        near = held_matrix(_sorted(sp.bsr_array(gather @ KB)), free)
        mass = _sorted(sp.csr_array(spread.T @ (M @ spread)))
        regular = near
        if solver.shift:
            regular = held_matrix(
                _sorted(sp.bsr_array(gather @ (shifted(K, M, solver.shift) @ B))), free)
        rows = KB.indptr[followers]
        counts = KB.indptr[followers + 1] - rows
        indptr = np.concatenate([[0], np.cumsum(counts)])
        picked = np.repeat(rows - indptr[:-1], counts) + np.arange(indptr[-1])
        coupling = BlockRows(indptr.astype(np.int32), KB.indices[picked].astype(np.int32),
                             np.ascontiguousarray(KB.data[picked], np.float32))
        everywhere = np.repeat(np.arange(len(moving)), np.diff(K.indptr))
        blocks = K.data[everywhere == K.indices][followers]
        smaller = SolidSolver(
            BlockRows.of(near), BlockRows.of(mass),
            with_finest(solver.mesh_cycle, regular, between[own]), free[:, :, None],
            solver.gauge.reshape(len(moving), -1)[own].reshape(3 * len(own), -1), solver.shift)
        return cls(spread, smaller, followers, coupling,
                   np.linalg.inv(blocks).astype(np.float32))

    def missing(self, forces: Array, found: Array) -> Array:
        """Estimated error of the works (k,) of forces on displacements (3 n, k).

        ``forces`` (3 m, k) act at the m nodes that follow.
        """
        left = self.coupling.product(
            np.ascontiguousarray(found, np.float32).reshape(-1, 3, found.shape[1]))
        left -= forces.reshape(left.shape)
        return np.asarray(np.einsum("mik,mik->k", left, diagonal_product(self.inverse, left)))


def _following(body: ElasticBody, between: Any, loaded: Integers, layers: int) -> Any:
    """Boolean mask (N,) of the nodes that follow: middles of edges far from loaded nodes."""
    import scipy.sparse as sp

    matrix = body.component_mass
    pattern = sp.csr_array((np.ones(len(matrix.indices), dtype=np.float32), matrix.indices,
                            matrix.indptr), shape=matrix.shape)
    near = np.zeros(len(body.nodes), dtype=bool)
    near[loaded] = True
    for _ in range(layers):
        near |= pattern @ near.astype(np.float32) > 0.0
    return ~near & (np.diff(between.indptr) > 1)


def _corner_nodes(between: Any) -> Integers:
    """Node of each corner of the mesh."""
    nodes = np.flatnonzero(np.diff(between.indptr) == 1)
    found = np.empty(between.shape[1], dtype=np.int64)
    found[between.indices[between.indptr[nodes]]] = nodes
    return found


def _spread(between: Any, own: Integers, followers: Integers) -> Any:
    """Displacements of all nodes from those of their own, sparse (N, n)."""
    import scipy.sparse as sp

    place = np.full(between.shape[0], -1)
    place[own] = np.arange(len(own))
    follow = between[followers]
    columns = place[_corner_nodes(between)[follow.indices]]
    rows = followers[np.repeat(np.arange(len(followers)), np.diff(follow.indptr))]
    return sp.csr_array(sp.coo_array(
        (np.concatenate([np.ones(len(own)), follow.data]),
         (np.concatenate([own, rows]), np.concatenate([place[own], columns]))),
        shape=(between.shape[0], len(own))))


def _sorted(matrix: Any) -> Any:
    matrix.sort_indices()
    return matrix
