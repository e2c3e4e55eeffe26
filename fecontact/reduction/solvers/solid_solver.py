"""Iterative modes and deflections of a solid, without factors of its stiffness.

Frequencies are accurate to 1e-8 or better, shapes to 1e-6 in the energy norm, as far as round-off
allows. Its gauge are the rigid motions: what forces K z they seem to need, measured in the energy
norm, is the smallest residual that can be reached.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fecontact.core.errors import FecontactError, ModelWarning
from fecontact.core.types import Array, Integers
from fecontact.fem.attachments import PointMass, added_mass
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_kinds import shape_functions
from fecontact.reduction.solid_motions import rigid_motions
from fecontact.reduction.solvers.block_rows import BlockRows, step_on, turn_to
from fecontact.reduction.solvers.links import Links
from fecontact.reduction.solvers.lobpcg import Found, lowest_modes
from fecontact.reduction.solvers.multigrid import Multigrid, multigrid
from fecontact.reduction.solvers.solver_unknowns import Dependence, SolverUnknowns

Eigensolver = Literal["auto", "direct", "iterative"]

# Unknowns below which factors are cheap, the aspect ratio of cells and the ratio of eigenvalues of
# the material's stiffness (that of Poisson's ratio 0.45) above which multigrid converges slowly.
_FEW = 20_000
_STRETCHED = 5.0
_INCOMPRESSIBLE = 14.5 * (1.0 + 1e-12)

# Largest energy norm of the residuals of modes.
_MODES = 1e-6

# Edges along the axes of the reference cell, in columns, of regular cells by their corners.
_TRIANGLE = np.array([[1.0, 0.5, 0.0], [0.0, np.sqrt(0.75), 0.0], [0.0, 0.0, 1.0]])
_REGULAR = {
    4: np.array([[1.0, 0.5, 0.5], [0.0, np.sqrt(0.75), np.sqrt(1.0 / 12.0)],
                 [0.0, 0.0, np.sqrt(2.0 / 3.0)]]),
    5: np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, np.sqrt(0.5)]]),
    6: _TRIANGLE, 8: np.eye(3)}

# Vectors that are solved at once.
WIDTH = 32

# Accuracy of deflections for which single precision suffices.
_SINGLE = 1e-3


def suited(body: ElasticBody) -> bool:
    """True if the iterative solver is expected to be better for a body than factorisation.

    It is not for small and plane bodies, nearly incompressible or strongly anisotropic material,
    and where a tenth of the cells are longer than five times their width, as in thin plates.
    """
    return (body.dimension == 3 and 3 * len(body.nodes) >= _FEW
            and max(one.stiffness_ratio for one in body.materials) <= _INCOMPRESSIBLE
            and float(np.quantile(aspect_ratios(body), 0.9)) <= _STRETCHED)


def aspect_ratios(body: ElasticBody) -> Array:
    """Length over width of cells (c,): of the ellipsoid that a regular cell's sphere becomes."""
    found = np.empty(len(body.mesh.cells))
    for block in body.mesh.blocks:
        count = block.kind.corners
        corners = body.mesh.nodes[block.ordered]
        slopes = shape_functions(3, count, block.kind.middle)[1]
        jacobian = np.einsum("kj,eki->eij", slopes, corners) @ np.linalg.inv(_REGULAR[count])
        values = np.linalg.svd(jacobian, compute_uv=False)
        found[block.numbers] = values[:, 0] / values[:, -1]
    return found


@dataclass(frozen=True, eq=False)
class SolidSolver:
    """K, M and multigrid of a solid over the unknowns x (3 n,); fixed ones are zero.

    Attributes
    ----------
    stiffness, component_mass : BlockRows
        Of all displacements; E^T K E is not formed.
    mesh_cycle : Multigrid
        Approximate inverse of E^T K E, for free bodies of K and a small part of M.
    moving : (n, 3, 1) array
        One for unknowns, zero for those that are fixed.
    gauge : (3 n, 6) array
        Forces K z that mass-normalised rigid motions z seem to need.
    shift : float
        The part of M.
    unknowns : SolverUnknowns, optional
        Unknowns of the whole body.
    links : Links, optional
        Springs at points and equations between many unknowns.
    added_mass : sparse (3 n, 3 n) array, optional
        Mass at points.
    """

    stiffness: BlockRows
    component_mass: BlockRows
    mesh_cycle: Multigrid
    moving: Array
    gauge: Array
    shift: float
    unknowns: SolverUnknowns | None = None
    links: Links | None = None
    added_mass: Any = None

    @classmethod
    def of(cls, body: ElasticBody, rigid: int) -> "SolidSolver | None":
        """The solver for a body with a number of rigid modes; None where it has none for a body."""
        import scipy.sparse as sp

        unknowns = SolverUnknowns.of(body)
        coarse = body if body.degree == 1 else replace(
            body, degree=1, bricks="full", integration="exact")
        coarse_unknowns = unknowns if coarse is body else _unknowns_of_coarse(coarse)
        if unknowns is None or coarse_unknowns is None:
            return None
        K, M = body.stiffness_blocks, body.component_mass
        motions = rigid_motions(body.nodes, body.nodes.mean(axis=0))
        moved = (M @ motions.reshape(len(body.nodes), -1)).reshape(motions.shape)
        triangle = np.linalg.cholesky(motions.T @ moved)
        gauge = np.linalg.solve(triangle, np.asarray(K @ motions).T).T
        one = unknowns.dependence
        gauge = gauge if one is None else one.forces(gauge)
        rows, compliance = _linking_rows(body, unknowns)
        # A part of the mass makes K positive definite, too small to matter beside elastic modes.
        speeds = body.shear_moduli / body.densities
        waves = float(speeds.min()) * (np.pi / body.mesh.extent) ** 2
        shift = 0.02 * waves if rigid or len(compliance) else 0.0
        held = held_matrix(K, unknowns.moving) if one is None else K
        fine = shifted(held, M, shift) if one is None else congruent(shifted(K, M, shift), one)
        scaled = (coarse.nodes - coarse.nodes.mean(axis=0)) / body.mesh.extent
        coarse_motions = coarse_unknowns.coordinates(rigid_motions(scaled, np.zeros(3)))
        if coarse is body:
            coarse_matrix, between = fine, None
        else:
            coarse_matrix = _coarse_matrix(coarse, coarse_unknowns, shift)
            between = interpolation(body)
            if one is not None:
                between = _between(unknowns, between, coarse_unknowns)
        cycle = multigrid(fine, coarse_matrix, between, coarse_motions)
        solver = cls(BlockRows.of(held), BlockRows.of(M), cycle, unknowns.moving[:, :, None],
                     gauge * unknowns.moving.reshape(-1, 1), shift, unknowns)
        if len(compliance):
            solver = replace(solver, links=Links.of(rows, compliance, solver._cycle))
        if any(isinstance(added, PointMass) for added in body.added):
            mass = added_mass(body)
            E = unknowns.expansion
            solver = replace(solver, added_mass=sp.csr_array(E.T @ mass @ E))
        return solver

    @property
    def plain(self) -> bool:
        """True if the unknowns are all displacements, without springs and masses at points."""
        one = None if self.unknowns is None else self.unknowns.dependence
        return one is None and self.links is None and self.added_mass is None

    def modes(self, count: int, rigid: Array) -> Found:
        """The lowest elastic modes; ``rigid`` (3 N, r) are the rigid ones."""
        # Whole registers, and guard vectors for the last modes.
        width = -(-(count + max(8, count // 4)) // 16) * 16
        width = min(width, int(self.moving.sum()) - rigid.shape[1])
        start = np.random.default_rng(0).standard_normal((3 * len(self.moving), width))
        noise = np.einsum("ij,ij->j", self.gauge, self._cycle(self.gauge))
        return lowest_modes(
            self.stiffness_product, self.mass_product, self._cycle,
            self._cycle(self.mass_product(start)), count, rigid, tolerance=_MODES,
            noise=np.abs(noise))

    def deflections(
        self, forces: Array, tolerance: float, most: int = 100
    ) -> tuple[Array, bool]:
        """Displacements (3 N, k) under balanced forces (3 N, k), and whether they converged.

        Conjugate gradients, until the energy norm of the residual is below the tolerance, relative
        to that of the displacements, which may hold any rigid motion: balanced forces do no work
        on it. Above a tolerance of 1e-3 they are of single precision, unless that does not do.
        """
        solver, dtype = (self._single, np.float32) if tolerance >= _SINGLE else (self, np.float64)
        found, converged = np.empty(forces.shape, dtype), True
        for first in range(0, forces.shape[1], WIDTH):
            part = slice(first, first + WIDTH)
            found[:, part], reached = solver._conjugate_gradients(
                forces[:, part].astype(dtype), tolerance, most)
            if not reached and solver is not self:
                solver, dtype = self, np.float64
                found[:, part], reached = self._conjugate_gradients(
                    forces[:, part].astype(dtype), tolerance, most)
            converged &= reached
        return found, converged

    def _conjugate_gradients(
        self, forces: Array, tolerance: float, most: int
    ) -> tuple[Array, bool]:
        x = np.zeros(forces.shape, forces.dtype)
        residual = self._held(np.ascontiguousarray(forces))
        direction = self._cycle(residual)
        energy = np.einsum("ij,ij->j", residual, direction)
        work = np.zeros(forces.shape[1])
        reached = energy <= 0.0
        before = np.zeros(forces.shape[1])
        for _ in range(most):
            pushed = self.stiffness_product(direction)
            curvature = np.einsum("ij,ij->j", direction, pushed)
            # Where rounding exceeds what is left, as rigid motions in it may do.
            if not (curvature[~reached] > 0.0).all():
                return x, False
            step = np.where(reached, 0.0, energy / np.where(reached, 1.0, curvature))
            step_on(step, direction, pushed, x, residual)
            gain = step * energy
            work += gain
            # Estimated gain of later steps, if each gains less by the root of the last factor: the
            # first steps gain more than their share.
            factor = np.sqrt(gain / np.maximum(np.maximum(before, gain), np.finfo(float).tiny))
            reached |= gain * factor <= tolerance**2 * work * (1.0 - factor)
            if reached.all():
                break
            before = gain
            z = self._cycle(residual)
            following = np.einsum("ij,ij->j", residual, z)
            if not (following[~reached] > -(tolerance**2) * work[~reached]).all():
                return x, False
            reached |= following <= tolerance**2 * work
            if reached.all():
                break
            turn_to(np.where(reached, 0.0, following / np.where(energy > 0.0, energy, 1.0)), z,
                    direction)
            energy = following
        return x, bool(reached.all())

    def stiffness_product(self, x: Array) -> Array:
        """E^T K E x of unknowns (3 n, k) that vanish where they are fixed."""
        found = self._by_nodes(self.stiffness.product, x)
        if self.links is not None:
            found += self.links.spring_forces(x)
        return found

    def mass_product(self, x: Array) -> Array:
        """E^T M E x, zero where displacements are fixed."""
        found = self._held(self._by_nodes(self.component_mass.product, x))
        if self.added_mass is not None:
            found += self.added_mass @ x
        return found

    def _cycle(self, x: Array) -> Array:
        if self.links is None:
            return self._held(self.mesh_cycle.cycle(x))
        return self.links.linked(self._held(self.mesh_cycle.cycle(self.links.without_reactions(x))))

    def _held(self, x: Array) -> Array:
        if not self._free:
            x *= self.moving.reshape(-1, 1)
        return x

    @cached_property
    def _single(self) -> "SolidSolver":
        """Copy with a stiffness of single precision, the precision of the multigrid."""
        given = self.unknowns
        if given is not None and given.dependence is not None:
            given = replace(given, dependence=given.dependence.single())
        return replace(self, stiffness=self.stiffness.single(), unknowns=given)

    @cached_property
    def _free(self) -> bool:
        return bool(self.moving.all())

    def _by_nodes(self, product: Callable[[Array], Array], x: Array) -> Array:
        one = None if self.unknowns is None else self.unknowns.dependence
        u = np.ascontiguousarray(x) if one is None else one.displacements(x)
        found = np.asarray(product(u.reshape(len(u) // 3, 3, -1))).reshape(u.shape)
        return found if one is None else one.forces(found)


def _unknowns_of_coarse(coarse: ElasticBody) -> SolverUnknowns | None:
    """Unknowns of the linear elements, whose constraints have warned with the quadratic ones."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        try:
            return SolverUnknowns.of(coarse)
        except FecontactError:
            return None


def _linking_rows(body: ElasticBody, unknowns: SolverUnknowns) -> tuple[Any, Array]:
    """Rows (m, 3 n) of equations and of springs at points, and compliances (m,), 0 of equations."""
    import scipy.sparse as sp

    springs, stiffness, _ = body.springs
    springs = sp.csr_array(springs[stiffness > 0.0] @ unknowns.expansion)
    # Motions of reference points are means of nodes, which leave rounding at other unknowns.
    least = 1e-12 * abs(springs).max(axis=1).toarray().ravel() if springs.nnz else np.zeros(0)
    springs.data[np.abs(springs.data) < np.repeat(least, np.diff(springs.indptr))] = 0.0
    springs.eliminate_zeros()
    compliance = 1.0 / stiffness[stiffness > 0.0]
    if unknowns.equations is None:
        return springs, compliance
    return (sp.csr_array(sp.vstack([unknowns.equations, springs])),
            np.concatenate([np.zeros(unknowns.equations.shape[0]), compliance]))


def congruent(matrix: Any, dependence: Dependence) -> Any:
    """E^T A E of blocks, with a positive diagonal where unknowns are fixed."""
    import scipy.sparse as sp

    E = dependence.blocks
    found = sp.bsr_array(sp.bsr_array(E.T) @ (matrix @ E))
    found.sort_indices()
    own = np.flatnonzero(_rows(found) == found.indices)
    diagonal = np.einsum("kii->ki", found.data[own])
    fixed, axis = np.nonzero(diagonal == 0.0)
    found.data[own[fixed], axis, axis] = diagonal.max(axis=1)[fixed]
    return found


def _coarse_matrix(coarse: ElasticBody, unknowns: SolverUnknowns, shift: float) -> Any:
    """E^T (K + shift M) E of the linear elements."""
    K, one = coarse.stiffness_blocks, unknowns.dependence
    K = held_matrix(K, unknowns.moving) if one is None else K
    whole = shifted(K, coarse.component_mass, shift)
    return whole if one is None else congruent(whole, one)


def _between(unknowns: SolverUnknowns, between: Any, coarse: SolverUnknowns) -> Any:
    """Unknowns of quadratic elements from those of linear ones, sparse (3 n, 3 m)."""
    import scipy.sparse as sp

    spread = sp.kron(between, sp.eye_array(3), format="csr")
    return sp.csr_array(unknowns.inverse @ (spread @ coarse.expansion))


def moving_components(body: ElasticBody) -> Array:
    """Mask (N, 3) of the displacements: one where free, zero where fixed."""
    moving = np.ones(3 * len(body.nodes))
    moving[body.fixed_dofs] = 0.0
    return moving.reshape(-1, 3)


def _rows(matrix: Any) -> Integers:
    return np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))


def held_matrix(matrix: Any, moving: Array) -> Any:
    """A matrix of blocks with nothing but its diagonal in the rows and columns of fixed dofs."""
    import scipy.sparse as sp

    if moving.all():
        return matrix
    rows = _rows(matrix)
    blocks = matrix.data * moving[rows][:, :, None]
    blocks *= moving[matrix.indices][:, None, :]
    own = np.flatnonzero(rows == matrix.indices)
    node, axis = np.nonzero(moving == 0.0)
    blocks[own[node], axis, axis] = matrix.data[own[node], axis, axis]
    return sp.bsr_array((blocks, matrix.indices, matrix.indptr), shape=matrix.shape)


def shifted(matrix: Any, component_mass: Any, shift: float) -> Any:
    """K + shift M, which have the same pattern."""
    import scipy.sparse as sp

    if not shift:
        return matrix
    blocks = matrix.data.copy()
    for axis in range(3):
        blocks[:, axis, axis] += shift * component_mass.data
    return sp.bsr_array((blocks, matrix.indices, matrix.indptr), shape=matrix.shape)


def interpolation(body: ElasticBody) -> Any:
    """Nodal displacements of quadratic elements from those of linear ones, sparse (N, n)."""
    import scipy.sparse as sp

    shape, found = (len(body.nodes), len(body.mesh.nodes)), []
    left = np.ones(len(body.nodes), bool)
    for block in body.blocks:
        members, corners = block.nodes, block.kind.corners
        values = shape_functions(3, corners, block.at_nodes)[0]
        # Each node takes its weights from one of its elements; all give the same.
        nodes, first = np.unique(members, return_index=True)
        nodes, first, left[nodes] = nodes[left[nodes]], first[left[nodes]], False
        element, local = np.divmod(first, members.shape[1])
        weights = values[local]
        columns = members[element, :corners]
        used = np.abs(weights) > 1e-12
        rows = np.broadcast_to(nodes[:, None], weights.shape)
        found.append(sp.coo_array((weights[used], (rows[used], columns[used])), shape=shape))
    return sp.csr_array(sum(found[1:], start=found[0]))
