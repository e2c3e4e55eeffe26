"""Iterative modes and deflections of a solid, without factors of its stiffness.

Frequencies are accurate to 1e-8 or better, shapes to 1e-6 in the energy norm, as far as round-off
allows. Its gauge are the rigid motions: what forces K z they seem to need, measured in the energy
norm, is the smallest residual that can be reached.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_kinds import shape_functions
from fecontact.reduction.solid_motions import rigid_motions
from fecontact.reduction.solvers.block_rows import BlockRows, step_on, turn_to
from fecontact.reduction.solvers.lobpcg import Found, lowest_modes
from fecontact.reduction.solvers.multigrid import Multigrid, multigrid

Eigensolver = Literal["auto", "direct", "iterative"]

# Unknowns below which factors are cheap, the aspect ratio of cells and the ratio of eigenvalues of
# the material's stiffness (that of Poisson's ratio 0.45) above which multigrid converges slowly.
_FEW = 20_000
_STRETCHED = 5.0
_INCOMPRESSIBLE = 14.5 * (1.0 + 1e-12)

# Largest energy norm of the residuals of modes.
_MODES = 1e-6

# Vectors that are solved at once.
WIDTH = 32

# Accuracy of deflections for which single precision suffices.
_SINGLE = 1e-3


def suited(body: ElasticBody) -> bool:
    """True if the iterative solver is expected to be better for a body than factorisation.

    It is not for small and plane bodies, hinges, constraints, nearly incompressible or strongly
    anisotropic material, and where a tenth of the cells are longer than five times their width, as
    in thin plates.
    """
    return (possible(body) and 3 * len(body.nodes) >= _FEW
            and max(one.stiffness_ratio for one in body.materials) <= _INCOMPRESSIBLE
            and float(np.quantile(aspect_ratios(body), 0.9)) <= _STRETCHED)


def possible(body: ElasticBody) -> bool:
    """True if the iterative solver supports a body: solids with plain supports only."""
    return body.dimension == 3 and not (body.hinges or body.equations or body.added)


def aspect_ratios(body: ElasticBody) -> Array:
    """Length over width of cells (c,): of the ellipsoid that a regular cell's sphere becomes."""
    corners = body.mesh.nodes[body.mesh.cells[:, list(body.mesh.kind.order)]]
    if corners.shape[1] == 4:
        regular = np.array([[1.0, 0.5, 0.5], [0.0, np.sqrt(0.75), np.sqrt(1.0 / 12.0)],
                            [0.0, 0.0, np.sqrt(2.0 / 3.0)]])
        jacobian = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2) @ np.linalg.inv(regular)
    else:
        slopes = shape_functions(3, 8, np.full((1, 3), 0.5))[1][0]
        jacobian = np.einsum("kj,eki->eij", slopes, corners)
    values = np.linalg.svd(jacobian, compute_uv=False)
    return np.asarray(values[:, 0] / values[:, -1])


@dataclass(frozen=True, eq=False)
class SolidSolver:
    """K, M and multigrid of a solid over all degrees of freedom; fixed ones are zero.

    Attributes
    ----------
    stiffness, component_mass : BlockRows
    mesh_cycle : Multigrid
        Approximate inverse of K, for free bodies of K and a small part of M.
    moving : (N, 3, 1) array
        One for degrees of freedom that are not fixed, zero for the others.
    gauge : (3 N, 6) array
        Forces K z that mass-normalised rigid motions z seem to need.
    shift : float
        The part of M.
    """

    stiffness: BlockRows
    component_mass: BlockRows
    mesh_cycle: Multigrid
    moving: Array
    gauge: Array
    shift: float

    @classmethod
    def of(cls, body: ElasticBody, rigid: int) -> "SolidSolver":
        """The solver for a body with a number of rigid modes."""
        K, M = body.stiffness_blocks, body.component_mass
        motions = rigid_motions(body.nodes, body.nodes.mean(axis=0))
        moved = (M @ motions.reshape(len(body.nodes), -1)).reshape(motions.shape)
        triangle = np.linalg.cholesky(motions.T @ moved)
        gauge = np.linalg.solve(triangle, np.asarray(K @ motions).T).T
        # A part of the mass makes K positive definite, too small to matter beside elastic modes.
        speeds = body.shear_moduli / body.densities
        waves = float(speeds.min()) * (np.pi / body.mesh.extent) ** 2
        shift = 0.02 * waves if rigid else 0.0
        moving = moving_components(body)
        held = held_matrix(K, moving)
        coarse = replace(body, degree=1, bricks="full") if body.degree == 2 else body
        coarse_moving = moving_components(coarse)
        coarse_matrix = shifted(held_matrix(coarse.stiffness_blocks, coarse_moving),
                                coarse.component_mass, shift)
        scaled = (coarse.nodes - coarse.nodes.mean(axis=0)) / body.mesh.extent
        coarse_motions = rigid_motions(scaled, np.zeros(3)) * coarse_moving.reshape(-1, 1)
        cycle = multigrid(shifted(held, M, shift), coarse_matrix,
                          interpolation(body) if body.degree == 2 else None, coarse_motions)
        return cls(BlockRows.of(held), BlockRows.of(M), cycle, moving[:, :, None],
                   gauge * moving.reshape(-1, 1), shift)

    def modes(self, count: int, rigid: Array) -> Found:
        """The lowest elastic modes; ``rigid`` (3 N, r) are the rigid ones."""
        # Whole registers, and guard vectors for the last modes.
        width = -(-(count + max(8, count // 4)) // 16) * 16
        width = min(width, int(self.moving.sum()) - rigid.shape[1])
        start = np.random.default_rng(0).standard_normal((3 * len(self.moving), width))
        noise = np.einsum("ij,ij->j", self.gauge, self._cycle(self.gauge))
        return lowest_modes(
            self.stiffness_product, self.mass_product, self._cycle,
            self._cycle(self.mass_product(start)), count, rigid, _MODES, np.abs(noise))

    def deflections(
        self, forces: Array, tolerance: float, most: int = 100
    ) -> tuple[Array, bool]:
        """Displacements (3 N, k) under balanced forces (3 N, k), and whether they converged.

        Conjugate gradients, until the energy norm of the residual is below the tolerance, relative
        to that of the displacements, which may hold any rigid motion: balanced forces do no work
        on it. Above a tolerance of 1e-3 they are of single precision.
        """
        solver, dtype = (self._single, np.float32) if tolerance >= _SINGLE else (self, np.float64)
        found, converged = np.empty(forces.shape, dtype), True
        for first in range(0, forces.shape[1], WIDTH):
            part = slice(first, first + WIDTH)
            found[:, part], reached = solver._conjugate_gradients(
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
            step = np.where(reached, 0.0, energy / np.where(curvature > 0.0, curvature, 1.0))
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
            reached |= following <= tolerance**2 * work
            if reached.all():
                break
            turn_to(np.where(reached, 0.0, following / np.where(energy > 0.0, energy, 1.0)), z,
                    direction)
            energy = following
        return x, bool(reached.all())

    def stiffness_product(self, x: Array) -> Array:
        """K x of displacements (3 N, k) that vanish where they are fixed."""
        return self._by_nodes(self.stiffness.product, x)

    def mass_product(self, x: Array) -> Array:
        """M x, zero where displacements are fixed."""
        return self._held(self._by_nodes(self.component_mass.product, x))

    def _cycle(self, x: Array) -> Array:
        return self._held(self.mesh_cycle.cycle(x))

    def _held(self, x: Array) -> Array:
        if not self._free:
            x *= self.moving.reshape(-1, 1)
        return x

    @cached_property
    def _single(self) -> "SolidSolver":
        """Copy with a stiffness of single precision, the precision of the multigrid."""
        return replace(self, stiffness=self.stiffness.single())

    @cached_property
    def _free(self) -> bool:
        return bool(self.moving.all())

    def _by_nodes(self, product: Callable[[Array], Array], x: Array) -> Array:
        return np.asarray(product(np.ascontiguousarray(x).reshape(len(self.moving), 3, -1))
                          ).reshape(x.shape)


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

    members = body.basis.element_dofs.T
    corners = body.mesh.kind.corners
    values = shape_functions(3, corners, body.basis.elem.doflocs)[0]
    # Each node takes its weights from one of its elements; all give the same.
    nodes, first = np.unique(members, return_index=True)
    element, local = np.divmod(first, members.shape[1])
    weights = values[local]
    columns = members[element, :corners]
    used = np.abs(weights) > 1e-12
    rows = np.broadcast_to(nodes[:, None], weights.shape)
    return sp.csr_array(sp.coo_array((weights[used], (rows[used], columns[used])),
                                     shape=(len(body.nodes), len(body.mesh.nodes))))
