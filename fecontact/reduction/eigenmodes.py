"""Vibration modes of the finite-element body: exact rigid modes, elastic ones by Lanczos."""

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.compiled import kernel
from fecontact.core.errors import AnalysisError, InputError, ModelWarning, choices, nearest
from fecontact.core.records import Block, IntegerMatrix, IntegerVector, Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elimination import least_squares, selects
from fecontact.fem.mean_strain import hourglass_energies
from fecontact.reduction.solid_motions import allowed_motions, solid_strain_energies
from fecontact.reduction.solvers.block_rows import BlockRows
from fecontact.reduction.solvers.congruence import Congruence, as_matrix, largest_column_sum
from fecontact.reduction.solvers.factorisation import SINGULAR, Factors, factorised
from fecontact.reduction.solvers.solid_solver import Eigensolver, SolidSolver, suited

_BUCKLED = ("The stress takes the stiffness of the body: its load is beyond the buckling load; see "
            "fecontact.analysis.buckling_loads.")
# Below this size, and for a large share of all modes, the dense solver is faster.
_DENSE = 600
# Size, relative to forces, of what is left of them beside inertia that is rounding.
_BALANCED = 1e-12

# Smallest pivot of a stiffness, relative to the largest, and frequency in shear speeds over the
# extent, of motions that are not free of strain.
_PIVOT, _STANDSTILL = 1e-13, 1e-9
_MECHANISM = ("Reduced integration leaves motions of the body without strain (a mechanism), as "
              "where bricks stand in a row that is one brick wide; give it integration = 'full', "
              "or cells side by side.")


@dataclass(frozen=True, eq=False)
class FreeSystem:
    """Stiffness and mass over the free degrees of freedom, and the rigid modes among them.

    Attributes
    ----------
    stiffness, mass : sparse (f, f) arrays or Congruence
        K, symmetric and positive semi-definite, and M, positive definite.
    rigid : (f, r) array
        Mass-normalised rigid modes: ``K rigid = 0``.
    component_mass : sparse (f / d, f / d) array, optional
        Mass of one component, if the d components alternate and have equal mass.
    body : ElasticBody, optional
        The solid whose free degrees of freedom these are.
    eigensolver : 'auto', 'direct' or 'iterative'
        See :func:`eigenmodes`.
    stressed : bool
        Whether the stiffness includes that of a stress; then it must be positive definite but for
        the rigid modes.
    """

    stiffness: Any
    mass: Any
    rigid: Array
    component_mass: Any = None
    body: ElasticBody | None = None
    eigensolver: Eigensolver = "auto"
    stressed: bool = False

    @classmethod
    def of(
        cls, body: ElasticBody, eigensolver: Eigensolver = "auto", stress: Any = None
    ) -> "FreeSystem":
        """The free degrees of freedom of a body.

        ``stress``, sparse (d N, d N), is a geometric stiffness that is added to that of the body;
        it must not resist the rigid modes. Then the direct solver is taken.

        Raises
        ------
        InputError
            For an unknown eigensolver, or the iterative one for a plane body.
        """
        if eigensolver not in get_args(Eigensolver):
            raise InputError(f"eigensolver = {eigensolver!r} must be one of "
                             f"{choices(get_args(Eigensolver))}"
                             f"{nearest(str(eigensolver), get_args(Eigensolver))}.")
        if eigensolver == "iterative" and body.dimension == 2:
            raise InputError("eigensolver = 'iterative' is for solids; leave it out, or take "
                             "'direct'.")
        E, rigid = body.expansion, rigid_modes(body)
        eigensolver = "direct" if stress is not None else eigensolver
        if not selects(E) and _iterable(body, eigensolver):
            return cls(*_congruences(body), least_squares(E, rigid), None, body, eigensolver)
        stiffness = body.stiffness
        if stress is not None:
            stiffness = (stiffness + stress).tocsc()
        solid = (body if body.dimension == 3 else None, eigensolver, stress is not None)
        if E.shape[0] == E.shape[1]:
            return cls(stiffness, body.mass, rigid, None if body.added else body.component_mass,
                       *solid)
        if selects(E):
            free = E.indices
            K, M = (a[free][:, free].tocsc() for a in (stiffness, body.mass))
            return cls(K, M, rigid[free], None, *solid)
        return cls((E.T @ stiffness @ E).tocsc(), (E.T @ body.mass @ E).tocsc(),
                   least_squares(E, rigid), None, *solid)

    @cached_property
    def held(self) -> Integers:
        """Degrees of freedom (f - r,) left when r others support the body isostatically."""
        from scipy.linalg import qr

        size, rigid = self.rigid.shape
        if not rigid:
            return np.arange(size)
        pivots = qr(self.rigid.T, mode="r", pivoting=True)[1]
        return np.setdiff1d(np.arange(size), pivots[:rigid])

    @cached_property
    def factors(self) -> Factors:
        """Factors of the positive definite stiffness of the isostatically supported body."""
        K = as_matrix(self.stiffness)
        if len(self.held) < K.shape[0]:
            K = K[self.held][:, self.held]
        trouble = _BUCKLED if self.stressed else SINGULAR
        if self.body is None:
            return factorised(K, trouble=trouble)
        E = self.body.expansion
        found = factorised(K, E.indices[E.indptr[:-1]][self.held] // 3, trouble=trouble)
        if self.body.has_reduced_integration:
            try:
                pivots = np.abs(found.triangle()[1])
            except AnalysisError:
                raise AnalysisError(_MECHANISM) from None
            if (pivots <= _PIVOT * pivots.max()).any():
                raise AnalysisError(_MECHANISM)
        return found

    @cached_property
    def iterative(self) -> SolidSolver | None:
        """The iterative solver of a solid that is large and compact, or where it is asked for.

        None for others, and for bodies whose unknowns it does not support.

        Warns
        -----
        ModelWarning
            If it is asked for and does not support the body.
        """
        if self.body is None or not _iterable(self.body, self.eigensolver):
            return None
        found = SolidSolver.of(self.body, self.rigid.shape[1])
        if found is None:
            self.falls_back("does not know the motions of some of the body's reference points, or "
                            "the body has hundreds of equations between many displacements")
        return found

    def falls_back(self, reason: str) -> None:
        """Warn, where the iterative solver was asked for, that the direct one takes over."""
        if self.eigensolver == "iterative":
            warnings.warn(f"eigensolver = 'iterative' {reason}; the direct solver takes over.",
                          ModelWarning, stacklevel=2)

    @cached_property
    def inertia(self) -> Array:
        """M rigid (f, r)."""
        return np.asarray(self.mass @ self.rigid)

    @cached_property
    def mass_product(self) -> Any:
        """Fast product ``M x`` with displacements x (f,)."""
        from scipy.sparse.linalg import LinearOperator

        if self.component_mass is None:
            # The product is faster by rows.
            return as_matrix(self.mass).T
        if 2 * self.component_mass.shape[0] < self.mass.shape[0]:
            return LinearOperator(
                self.mass.shape, lambda x: (self.component_mass @ x.reshape(-1, 3)).ravel(),
                dtype=float)
        # Both components at once, as real and imaginary part.
        both = self.component_mass.astype(complex)
        return LinearOperator(
            self.mass.shape, lambda x: (both @ x.reshape(-1).view(complex)).view(float),
            dtype=float)

    def without_rigid(self, shapes: Array) -> Array:
        """The part of displacements (f,) or (f, k) that is mass-orthogonal to the rigid modes."""
        return np.asarray(shapes - self.rigid @ (self.inertia.T @ shapes))

    @property
    def iterates(self) -> bool:
        """True if deflections are iterated: there is a solver, and no factors were needed."""
        return "factors" not in self.__dict__ and self.iterative is not None

    def deflection(self, forces: Array, accuracy: float = 1e-9) -> Array:
        """Elastic static response (f,) or (f, k) to forces.

        Forces that are not in equilibrium are balanced by the inertia of the rigid motion that they
        cause; the response is mass-orthogonal to the rigid modes. ``accuracy`` is the relative
        energy norm of the residual where the response is iterated.
        """
        balanced = forces - self.inertia @ (self.rigid.T @ forces)
        if self.iterates:
            # Rounding alone, of forces that only move the body, is in balance with nothing.
            still = np.linalg.norm(balanced, axis=0) <= _BALANCED * np.linalg.norm(forces, axis=0)
            found = self._iterated_deflection(
                np.where(still, 0.0, balanced).reshape(len(balanced), -1), accuracy)
            if found is not None:
                return found.reshape(balanced.shape)
        deflection = np.zeros_like(balanced)
        deflection[self.held] = self.factors.solve(np.ascontiguousarray(balanced[self.held]))
        return self.without_rigid(deflection)

    def _iterated_deflection(self, balanced: Array, accuracy: float) -> Array | None:
        """Response (f, k) to balanced forces by conjugate gradients; None if they fail."""
        assert self.body is not None
        assert self.iterative is not None
        unknowns = self.iterative.unknowns
        assert unknowns is not None
        found, converged = self.iterative.deflections(unknowns.pick.T @ balanced, accuracy)
        if converged:
            return self.without_rigid(unknowns.pick @ found)
        self.falls_back("does not converge to deflections under forces")
        return None


def _iterable(body: ElasticBody, eigensolver: Eigensolver) -> bool:
    """True if the iterative solver is asked for, or suits a body."""
    return eigensolver == "iterative" or (eigensolver == "auto" and suited(body))


def _congruences(body: ElasticBody) -> tuple[Congruence, Congruence]:
    """Stiffness and mass of a constrained solid, not formed."""
    E, (rows, k, _) = body.expansion, body.springs
    blocks = body.stiffness_blocks
    by_rows = [BlockRows.of(one) for one in (blocks, body.component_mass)]

    def product(which: int, u: Array) -> Array:
        whole = np.ascontiguousarray(u).reshape(len(body.nodes), 3, -1)
        return np.asarray(by_rows[which].product(whole)).reshape(u.shape)

    def stiffness(u: Array) -> Array:
        pushed = product(0, u)
        return pushed + rows.T @ (k[:, None] * (rows @ u)) if len(k) else pushed

    def mass(u: Array) -> Array:
        return np.asarray(body.mass @ u) if body.added else product(1, u)

    return (Congruence(E, stiffness, lambda: body.stiffness if len(k) else blocks),
            Congruence(E, mass, lambda: body.mass))


def eigenfrequencies_hz(
    body: ElasticBody, count: int = 20, *, eigensolver: Eigensolver = "auto"
) -> Array:
    """The lowest eigenfrequencies (m,) of a body [Hz], exactly zero for rigid modes.

    ``eigensolver`` is that of :func:`~fecontact.modal_basis`. Raises the errors of
    :func:`eigenmodes`.
    """
    require_kind("eigenfrequencies_hz", ElasticBody, body=body)
    return eigenmodes(body, count, eigensolver)[0] / (2.0 * np.pi)


def eigenmodes(
    body: ElasticBody, count: int, eigensolver: Eigensolver = "auto"
) -> tuple[Array, Array]:
    """The lowest angular frequencies (m,) [rad/s] and mass-normalised shapes (d N, m).

    Rigid modes follow from the geometry: frequency exactly zero, translation in x, in y, rotation
    (counter-clockwise); of solids translations in x, y, z, rotations about these. Elastic modes
    follow in order of frequency; the first of the largest components of each is positive.

    The direct solver is inverse Lanczos iteration with the factors of K. The iterative one, LOBPCG
    with multigrid, is several times faster and smaller for large, compact solids; 'auto' takes it
    for solids of 20,000 unknowns and more whose cells are mostly less than five times as long as
    wide and whose Poisson's ratio is at most 0.45. Where it does
    not converge, the direct one takes over. Frequencies agree to 1e-8, as far as round-off allows.

    Raises
    ------
    InputError
        For less than one mode, or more modes than unknowns, or an unknown or unsuited eigensolver.
    AnalysisError
        If a mode of the direct solver violates ``|K s - w^2 M s| < 1e-10 |K| |s|``, or elements of
        reduced integration leave motions without strain.

    Warns
    -----
    ModelWarning
        If the iterative solver is asked for and does not support the body or does not converge.
    """
    w, free_shapes = free_modes(FreeSystem.of(body, eigensolver), count)
    shapes = body.expansion @ free_shapes
    elastic = w > 0.0
    w[elastic] = frequencies_of(body, shapes[:, elastic])
    if body.has_reduced_integration:
        speed = float(np.sqrt((body.shear_moduli / body.densities).max()))
        if (w[elastic] < _STANDSTILL * speed / body.mesh.extent).any():
            raise AnalysisError(_MECHANISM)
    return w, shapes


def rigid_modes(body: ElasticBody) -> Array:
    """Mass-normalised rigid modes (d N, r) that supports and constraints allow.

    Translations along the axes, then rotations about them (in the plane counter-clockwise), about
    the centre of mass for a free body; where supports allow only some, what is left of these, each
    without the ones before it. Pieces of a body that constraints join may also move against each
    other, if the constraints allow it; such modes follow.
    """
    weights = np.asarray(body.component_mass.sum(axis=1)).ravel()
    centre = weights @ body.nodes / weights.sum()
    shapes = allowed_motions(body, centre)
    for column in range(shapes.shape[1]):
        for _ in range(2):
            earlier = shapes[:, :column]
            shapes[:, column] -= earlier @ (earlier.T @ (body.mass @ shapes[:, column]))
        shapes[:, column] /= np.sqrt(shapes[:, column] @ (body.mass @ shapes[:, column]))
    return shapes


def free_modes(system: FreeSystem, count: int) -> tuple[Array, Array]:
    """Lowest modes over the free degrees of freedom: frequencies (m,) and shapes (f, m).

    Frequencies are angular [rad/s], zero for rigid modes; shapes are mass-normalised.
    """
    unknowns = system.stiffness.shape[0]
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= unknowns:
        raise InputError(f"modes = {count!r} must be a whole number from 1 to the number of "
                         f"unknowns of the body, {unknowns}.")
    rigid = system.rigid[:, :count]
    elastic = count - rigid.shape[1]
    if not elastic:
        return np.zeros(count), rigid
    squares, shapes = elastic_modes(system, elastic)
    return (np.concatenate([np.zeros(rigid.shape[1]), np.sqrt(squares)]),
            np.hstack([rigid, shapes * fixed_signs(shapes)]))


def frequencies_of(body: ElasticBody, shapes: Array, stress: Any = None) -> Array:
    """Angular frequencies (m,) of mass-normalised modes (d N, m) from their strains [rad/s].

    ``stress``, sparse (d N, d N), is the geometric stiffness of a body under stress.
    """
    squares = 2.0 * strain_energies(body, shapes)
    if stress is not None:
        squares += (shapes * (stress @ shapes)).sum(axis=0)
    return np.sqrt(squares)


def strain_energies(body: ElasticBody, shapes: Array, cells: Integers | None = None) -> Array:
    """Strain energies (m,) [J] of displacement fields (d N, m), from the strains in the elements.

    ``cells`` are the cells whose energy counts; by default all, and the springs of the body.

    The product with K would lose as many digits as the stiffest cells exceed the body as a whole,
    which may be all for a slender body with strongly graded cells.
    """
    if cells is None and body.added:
        rows, stiffness, _ = body.springs
        return 0.5 * stiffness @ (rows @ shapes) ** 2 + strain_energies(
            body, shapes, np.arange(len(body.mesh.cells)))
    if body.dimension == 3:
        return solid_strain_energies(body, shapes, cells)
    energies = np.zeros(shapes.shape[1])
    tensors, which_tensor = body.anisotropic
    elasticity, fields = body.elasticity, np.ascontiguousarray(shapes)
    for part in body.parts(cells):
        gradients, areas = part.gradients()
        slopes = np.ascontiguousarray(np.moveaxis(gradients, (2, 3), (0, 1)))
        _strain_energies(slopes.reshape(-1, *areas.shape), areas, np.array(part.nodes), fields,
                         elasticity[part.numbers], tensors, which_tensor[part.numbers], energies)
        if part.has_mean_strain:
            energies += hourglass_energies(body, part, shapes.reshape(len(body.nodes), 2, -1))
    return energies * body.thickness


@kernel
def _strain_energies(
    slopes: Block, dx: Matrix, nodes: IntegerMatrix, shapes: Matrix, elasticity: Matrix,
    tensors: Block, which_tensor: IntegerVector, energies: Vector,
) -> None:
    """Add energies (m,) per thickness; slopes (2 k, e, q) of k shape functions in x and y."""
    elements, points = dx.shape
    corners, modes = nodes.shape[1], len(energies)
    strains = np.empty((3, modes))
    for e in range(elements):
        direct, lateral, shear = elasticity[e]
        tensor = which_tensor[e]
        for p in range(points):
            strains[:] = 0.0
            for k in range(1, corners):
                # Subtract a node: rigid displacements may be much larger than differences.
                x, y = slopes[2 * k, e, p], slopes[2 * k + 1, e, p]
                node, first = 2 * nodes[e, k], 2 * nodes[e, 0]
                for i in range(modes):
                    along = shapes[node, i] - shapes[first, i]
                    across = shapes[node + 1, i] - shapes[first + 1, i]
                    strains[0, i] += x * along
                    strains[1, i] += y * across
                    strains[2, i] += y * along + x * across
            if tensor >= 0:
                for r in range(3):
                    for s in range(3):
                        # Component 2 of a stiffness is zz.
                        stiffness = tensors[tensor, r + r // 2, s + s // 2]
                        for i in range(modes):
                            energies[i] += 0.5 * dx[e, p] * stiffness * (
                                strains[r, i] * strains[s, i])
                continue
            for i in range(modes):
                xx, yy, xy = strains[0, i], strains[1, i], strains[2, i]
                energies[i] += 0.5 * dx[e, p] * (
                    direct * (xx * xx + yy * yy) + 2.0 * lateral * xx * yy + shear * xy * xy)


def elastic_modes(system: FreeSystem, count: int) -> tuple[Array, Array]:
    """Squares of the lowest non-zero angular frequencies and their mass-normalised shapes.

    Inverse Lanczos iteration with the elastic static response, which excludes rigid modes exactly;
    the dense solver for few unknowns, the iterative one where it suits the body and converges.
    """
    K, M = system.stiffness, system.mass
    size = K.shape[0]
    if size > max(_DENSE, 6 * count) and system.iterative is not None:
        unknowns = system.iterative.unknowns
        assert unknowns is not None
        found = system.iterative.modes(count, unknowns.spread @ system.rigid)
        if found.converged:
            return found.squares, np.asarray(unknowns.pick @ found.shapes)
        system.falls_back(f"does not converge in {found.steps} steps to the lowest modes")
        _ = system.factors
    K, M = as_matrix(K), as_matrix(M)
    if system.stressed:
        _ = system.factors
    if size <= _DENSE or 3 * count > size:
        from scipy.linalg import eigh

        inertia = M @ system.rigid
        # Shift the rigid modes above all others instead of removing them.
        lifted = K.toarray() + (inertia @ inertia.T) * _largest(K, M)
        squares, shapes = eigh(lifted, M.toarray(), subset_by_index=[0, count - 1])
    else:
        from scipy.sparse.linalg import LinearOperator, eigsh

        start = np.random.default_rng(0).standard_normal(size)
        squares, shapes = eigsh(
            K, k=count, M=system.mass_product, sigma=0.0, v0=system.without_rigid(start),
            ncv=min(size, max(20, 2 * count + 8)),
            OPinv=LinearOperator(K.shape, system.deflection, dtype=float))
    shapes = system.without_rigid(shapes)
    shapes /= np.sqrt((shapes * (M @ shapes)).sum(axis=0))
    # Rayleigh quotients do not carry the shift's round-off.
    squares = (shapes * (K @ shapes)).sum(axis=0)
    order = np.argsort(squares)
    squares, shapes = squares[order], shapes[:, order]
    error = backward_error(K, M, squares, shapes).max()
    if not error < 1e-10 or squares[0] <= 0.0:
        if error < 1e-10 and system.body is not None and system.body.has_reduced_integration:
            raise AnalysisError(_MECHANISM)
        raise AnalysisError(
            f"The eigenmodes are not accurate: the residual is {error:.1e} of |K| |mode|, and the "
            f"lowest squared frequency {squares[0]:.3g}; look for nearly degenerate cells or parts "
            f"connected by a single node."
        )
    return squares, shapes


def backward_error(K: Any, M: Any, squares: Array, shapes: Array) -> Array:
    """``|K s - w^2 M s| / (|K| |s|)`` (m,) of each mode, with the 1-norm of K."""
    residual = np.linalg.norm(K @ shapes - (M @ shapes) * squares, axis=0)
    return np.asarray(residual / (largest_column_sum(K) * np.linalg.norm(shapes, axis=0)))


def _largest(K: Any, M: Any) -> float:
    """Upper bound of the largest squared frequency, from ratios of diagonals."""
    return float(10.0 * (K.diagonal() / M.diagonal()).max())


def fixed_signs(shapes: Array) -> Array:
    """Signs (m,) that make the first of the largest components of each column positive.

    Components within one per cent of the largest count as equal to it, so that the sign of a
    symmetric mode does not depend on round-off.
    """
    size = np.abs(shapes)
    first = np.argmax(size >= 0.99 * size.max(axis=0), axis=0)
    return np.where(shapes[first, np.arange(shapes.shape[1])].real < 0.0, -1.0, 1.0)
