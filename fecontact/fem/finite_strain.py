r"""Strain energy, internal forces and tangent stiffness of bodies under large deflections.

With the displacement gradient :math:`H_{pa} = \partial u_p / \partial X_a`, Green and Lagrange's
strain and the energy of St. Venant and Kirchhoff,

.. math::

    E = \tfrac12 (H + H^T + H^T H), \qquad S = C : E, \qquad U = \tfrac12 \int S : E\,dV,

the force at node i in direction p and the tangent between nodes i and j are, with F = 1 + H and the
gradients g of the shape functions in the undeformed body,

.. math::

    f_{ip} = \int F_{pa} S_{ab}\,g_{ib}\,dV, \qquad
    K_{ip,jq} = \int B_{ip} : C : B_{jq}\,dV + \delta_{pq} \int g_i \cdot S\,g_j\,dV, \qquad
    B_{ip} = \mathrm{sym}(F_p \otimes g_i).

Both are exact derivatives of the energy, for which the rule of quadrature of the body stands. A
plane body has no gradients along z; in plane stress C holds for S_zz = 0. The nine factors of
incompatible modes of a brick are three further nodes of their own in each cell. Kinematic couplings
and hinges turn by finite angles, see :mod:`fecontact.fem.finite_rotations`.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.errors import InputError
from fecontact.core.records import Array4, Block, IntegerMatrix, Matrix, ShortBlock
from fecontact.core.types import Array
from fecontact.fem.assembly import pattern
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elimination import selects
from fecontact.fem.fields import stress_of
from fecontact.fem.finite_rotations import FiniteRotations
from fecontact.fem.incompatible_modes import bubble_gradients
from fecontact.fem.stress_stiffness import USED

# Strain up to which St. Venant and Kirchhoff's material stands for metals.
LARGE_STRAIN = 0.01


class Cells(NamedTuple):
    """Cells of one kind.

    ``gradients`` (e, q, k, d) of the shape functions and ``volumes`` (e, q) at the points of
    quadrature, nodes ``members`` (e, k), and ``stiffness`` (e, s, s).
    """

    gradients: Array4
    volumes: Matrix
    members: IntegerMatrix
    stiffness: Block


@dataclass(frozen=True, eq=False)
class StrainState:
    """A body in one deflected state.

    Attributes
    ----------
    energy : float
        Strain energy U, of springs at points too [J].
    force : (f,) array
        Internal forces on the free unknowns, ``dU/dq`` [N].
    tangent : sparse (f, f) array or None
        ``d^2U/dq^2`` [N/m], if it was asked for.
    strain : float
        Largest component of E at a point of quadrature, without sign.
    contacts : bytes
        Set of closed and of sliding contacts, as bytes; empty without contacts.
    rounding : float
        Error of the forces of contacts by rounding of places [N].
    """

    energy: float
    force: Array
    tangent: Any
    strain: float
    contacts: bytes = b""
    rounding: float = 0.0


@dataclass(frozen=True, eq=False)
class FiniteStrainModel:
    """Cells of a body prepared for large deflections; the unknowns q are free ones.

    These are the free degrees of freedom of the body, see ``ElasticBody.expansion``, then the
    factors of incompatible modes, if it has such.

    Attributes
    ----------
    body : ElasticBody
        The body.
    geometric : sparse (d N, d N) array, optional
        Geometric stiffness of a stress in the undeformed body that constant loads balance, see
        :func:`fecontact.fem.stress_stiffness.stress_stiffness`. With Green and Lagrange's strain
        its energy is exactly ``u^T K_sigma u / 2``.
    """

    body: ElasticBody
    geometric: Any = None

    def __post_init__(self) -> None:
        if self.body.has_mean_strain:
            raise InputError("Large deflections are for elements without hourglass stiffness; give "
                             "the body integration = 'full', with bricks = 'incompatible' where "
                             "cells of degree 1 lock.")

    @cached_property
    def _blocks(self) -> list[Cells]:
        """Cells by kind."""
        body = self.body
        used, found = USED[body.dimension], []
        for block in body.blocks:
            (gradients, volumes), members = block.gradients(), block.nodes
            if block.incompatible:
                count = len(members)
                gradients = np.ascontiguousarray(np.concatenate(
                    [gradients, bubble_gradients(block)], axis=2))
                own = len(body.nodes) + np.arange(3 * count).reshape(count, 3)
                members = np.ascontiguousarray(np.concatenate([members, own], axis=1))
            stiffness = body.cell_stiffness(block.numbers)[:, used][:, :, used]
            found.append(Cells(gradients, volumes * body.thickness, members,
                               np.ascontiguousarray(stiffness)))
        return found

    @property
    def nodes(self) -> int:
        """Number of nodes, those of incompatible modes included."""
        return len(self.body.nodes) + sum(3 * len(block.nodes) for block in self.body.blocks
                                          if block.incompatible)

    @cached_property
    def expansion(self) -> Any:
        """All displacements from the free unknowns, sparse (d n, f)."""
        import scipy.sparse as sp

        E, extra = self.body.expansion, self.nodes - len(self.body.nodes)
        if not extra:
            return sp.csc_array(E)
        return sp.csc_array(sp.block_diag([E, sp.eye_array(self.body.dimension * extra)]))

    @cached_property
    def _pattern(self) -> tuple[Any, Any, Any]:
        return pattern([cells.members for cells in self._blocks], self.nodes)

    @cached_property
    def _springs(self) -> Any:
        """Stiffness of springs at points and of the stress over all displacements, or None."""
        import scipy.sparse as sp

        rows, k, _ = self.body.springs
        if not k.any() and self.geometric is None:
            return None
        own = sp.csr_array(rows.T @ sp.diags_array(k) @ rows)
        if self.geometric is not None:
            own = own + self.geometric
        more = self.body.dimension * self.nodes - own.shape[0]
        return sp.csr_array(sp.block_diag([own, sp.csr_array((more, more))])) if more else own

    @cached_property
    def _rotations(self) -> FiniteRotations | None:
        return FiniteRotations.of(self.body, self.expansion)

    def _moved(self, q: Array) -> Array:
        """Displacements (d n,), with factors of incompatible modes, from free unknowns (f,)."""
        linear = np.asarray(self.expansion @ q)
        return linear if self._rotations is None else linear + self._rotations.displacement(q)

    def displacement(self, q: Array) -> Array:
        """Displacements (N, d) of the nodes of the body from the free unknowns (f,)."""
        return self._moved(q).reshape(-1, self.body.dimension)[: len(self.body.nodes)]

    def stress(self, q: Array) -> Array:
        """Second stress of Piola and Kirchhoff (N, 4, k), of solids (N, 6, k), at the nodes [Pa].

        For free unknowns (f, k), in the order of :func:`fecontact.fem.stress_of`.
        """
        u, own = np.stack([self._moved(one) for one in q.T], axis=1), self.body.nodes.size
        return stress_of(self.body, u[:own], finite=True,
                         factors=u[own:] if self.body.has_incompatible_modes else None)

    def free(self, forces: Array) -> Array:
        """Forces (f,) or (f, k) on the free unknowns of nodal forces (d N,) or (d N, k).

        Nodes that turn as a rigid body pass on their resultant and the moment in the undeformed
        body.
        """
        found = np.zeros((self.expansion.shape[1], *forces.shape[1:]))
        own = self.body.expansion.T @ forces
        found[: len(own)] = own
        return found

    def state(self, q: Array, tangent: bool = True) -> StrainState:
        """Energy, internal forces and tangent at free unknowns (f,)."""
        import scipy.sparse as sp

        d = self.body.dimension
        u = self._moved(q)
        force = np.zeros((self.nodes, d))
        indptr, indices, slots = self._pattern
        blocks = np.zeros((len(indices) if tangent else 0, d, d))
        found = np.zeros((2, 1))
        moved = np.ascontiguousarray(u.reshape(-1, d))
        for cells, own in zip(self._blocks, slots, strict=True):
            _add_cells(cells, moved, own, blocks, force, found)
        energy, total, K = float(found[0, 0]), force.ravel(), None
        if tangent:
            K = sp.bsr_array((blocks, indices, indptr), shape=(u.size, u.size)).tocsc()
        if self._springs is not None:
            pull = self._springs @ u
            energy, total = energy + 0.5 * float(u @ pull), total + pull
            K = None if K is None else K + self._springs
        return StrainState(energy, *self._on_free(q, total, K), float(found[1, 0]))

    def acting(self, q: Array, force: Array, matrix: Any) -> tuple[Array, Any]:
        """Forces (f,) and their sparse derivative (f, f) at free unknowns.

        Of forces (d N,) on the deflected nodes and their derivative, sparse (d N, d N).
        """
        import scipy.sparse as sp

        more = self.body.dimension * self.nodes - len(force)
        if more:
            matrix = sp.csc_array(sp.block_diag([matrix, sp.csc_array((more, more))]))
        return self._on_free(q, np.append(force, np.zeros(more)), matrix)

    def slopes(self, q: Array) -> Any:
        """Displacements (d N, f) of the nodes from changes of the free unknowns (f,), sparse."""
        J, turning = self.expansion, self._rotations
        own = self.body.nodes.size
        return (J if turning is None else J + turning.slopes(q)).tocsr()[:own]

    def curvature(self, q: Array, force: Array) -> Any:
        """Second derivative (f, f), sparse, of the work of fixed forces (d N,) on the nodes."""
        import scipy.sparse as sp

        size = self.expansion.shape[1]
        if self._rotations is None:
            return sp.csc_array((size, size))
        more = self.body.dimension * self.nodes - len(force)
        return self._rotations.curvature(q, np.append(force, np.zeros(more)))

    def _on_free(self, q: Array, force: Array, K: Any) -> tuple[Array, Any]:
        """Forces and tangent over the free unknowns; K may be None."""
        turning = self._rotations
        if turning is None:
            return np.asarray(self.expansion.T @ force), None if K is None else self.reduced(K)
        J = (self.expansion + turning.slopes(q)).tocsc()
        if K is not None:
            K = (J.T @ K @ J + turning.curvature(q, force)).tocsc()
        return np.asarray(J.T @ force), K

    def reduced(self, matrix: Any) -> Any:
        """Sparse (f, f) matrix over the free unknowns of one over all displacements."""
        E = self.expansion
        if selects(E):
            return matrix.tocsc()[:, E.indices].tocsr()[E.indices].tocsc()
        return (E.T @ matrix @ E).tocsc()


@kernel
def _add_cells(
    block: Cells, displacement: Matrix, slots: ShortBlock, blocks: Block, force: Matrix,
    found: Matrix,
) -> None:
    """Add forces, tangent blocks and energy of all cells; ``found`` holds energy and strain."""
    gradients, volumes = block.gradients, block.volumes
    members, stiffness = block.members, block.stiffness
    cells, points, width, d = gradients.shape
    strains = 3 if d == 2 else 6
    first, second = np.empty(strains, np.int64), np.empty(strains, np.int64)
    for s in range(strains):
        if s < d:
            first[s], second[s] = s, s
        elif d == 2:
            first[s], second[s] = 0, 1
        else:
            # xy, yz, xz
            first[s], second[s] = (0, 1) if s == 3 else ((1, 2) if s == 4 else (0, 2))
    F, S = np.empty((d, d)), np.empty((d, d))
    E, stress = np.empty(strains), np.empty(strains)
    B, CB = np.empty((width * d, strains)), np.empty(strains)
    own = np.empty((width * d, width * d))
    wanted = len(blocks) > 0
    for e in range(cells):
        C = stiffness[e]
        own[:] = 0.0
        for q in range(points):
            g, weight = gradients[e, q], volumes[e, q]
            for p in range(d):
                for a in range(d):
                    F[p, a] = 0.0
                    for i in range(width):
                        F[p, a] += displacement[members[e, i], p] * g[i, a]
            for s in range(strains):
                a, b = first[s], second[s]
                E[s] = 0.5 * (F[a, b] + F[b, a])
                for p in range(d):
                    E[s] += 0.5 * F[p, a] * F[p, b]
                found[1, 0] = max(found[1, 0], abs(E[s]))
                if s >= d:
                    E[s] *= 2.0
            for p in range(d):
                F[p, p] += 1.0
            for s in range(strains):
                stress[s] = 0.0
                for r in range(strains):
                    stress[s] += C[s, r] * E[r]
                found[0, 0] += 0.5 * weight * stress[s] * E[s]
                S[first[s], second[s]] = S[second[s], first[s]] = stress[s]
            for i in range(width):
                for p in range(d):
                    total = 0.0
                    for s in range(strains):
                        a, b = first[s], second[s]
                        along = F[p, a] * g[i, b]
                        if s >= d:
                            along += F[p, b] * g[i, a]
                        B[i * d + p, s] = along
                        total += along * stress[s]
                    force[members[e, i], p] += weight * total
            if not wanted:
                continue
            for i in range(width):
                for p in range(d):
                    row = i * d + p
                    for s in range(strains):
                        CB[s] = 0.0
                        for r in range(strains):
                            CB[s] += weight * B[row, r] * C[r, s]
                    for column in range(row, width * d):
                        for s in range(strains):
                            own[row, column] += CB[s] * B[column, s]
                for j in range(i, width):
                    total = 0.0
                    for a in range(d):
                        for b in range(d):
                            total += g[i, a] * S[a, b] * g[j, b]
                    for p in range(d):
                        own[i * d + p, j * d + p] += weight * total
        if not wanted:
            continue
        for i in range(width):
            for j in range(i, width):
                for p in range(d):
                    for r in range(p if i == j else 0, d):
                        entry = own[i * d + p, j * d + r]
                        blocks[slots[e, i, j], p, r] += entry
                        if i != j or p != r:
                            blocks[slots[e, j, i], r, p] += entry
