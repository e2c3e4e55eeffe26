"""Stiffness and mass of elastic bodies, assembled by compiled loops over the cells.

Cells that are images of the reference cell under an affine map share its quadrature:
with the inverse Jacobian J of the map and the integrals over the reference cell

    G_ij,ab = int d_a phi_i d_b phi_j,      H_ij,pq = |det| sum_ab J_ap J_bq G_ij,ab

the stiffness between nodes i and j in directions p and q is, with the Lame constants,

    K_ij,pq = lambda H_ij,pq + mu H_ij,qp + mu delta_pq (H_ij,11 + H_ij,22 + H_ij,33).

and of an anisotropic material with the stiffness c

    K_ij,pq = sum_rs c_pr,qs H_ij,rs.

Other cells, curved or with faces that are not parallel, are integrated point by point. A plane
cell is a solid one without the third derivatives; K has this form in plane stress, too, with the
lateral constant for lambda.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.errors import MeshError
from fecontact.core.records import (
    Array4,
    Block,
    IntegerMatrix,
    IntegerVector,
    Matrix,
    ShortBlock,
    ShortVector,
    Vector,
)
from fecontact.core.types import Array, Integers
from fecontact.fem.element_block import ElementBlock
from fecontact.fem.elements.cell_kinds import CellKind, padded, shape_functions

# Largest difference between the edges of a cell whose map counts as affine, relative to them.
_AFFINE = 1e-13

# Entries that indices of 32 bits can number.
_MOST = np.iinfo(np.int32).max


def assembled(
    blocks: Sequence[ElementBlock], lateral: float | Array, shear: float | Array,
    density: float | Array, anisotropic: tuple[Array, Integers] | None = None,
) -> tuple[Any, Any]:
    """Stiffness and mass of one displacement component, both exactly symmetric.

    Parameters
    ----------
    blocks : sequence of ElementBlock
        Elements of each kind with N nodes in all, straight or curved. Those with mean strain get
        no stiffness, see :mod:`fecontact.fem.mean_strain`.
    lateral, shear : float or (c,) array
        Lame's constants lambda and mu of a solid or in plane strain [Pa]; in plane stress
        ``nu E / (1 - nu^2)`` and mu; of all cells or of each.
    density : float or (c,) array
        rho [kg/m^3].
    anisotropic : (n, 6, 6) array and (c,) integer array, optional
        Stiffnesses in the order xx, yy, zz, xy, yz, xz [Pa], and the number of that of each cell,
        -1 for cells with the constants above.

    Returns
    -------
    K : sparse (d N, d N) array of d x d blocks
        Degree of freedom d k + p is the displacement of node k in direction p [N/m, in the plane
        per thickness].
    M : sparse (N, N) array by rows
        [kg, in the plane per thickness].

    Raises
    ------
    MeshError
        For a mesh whose matrices would have more entries than can be numbered.
    """
    import scipy.sparse as sp

    size, dimension = blocks[0].places.shape
    indptr, indices, slots = pattern([block.nodes for block in blocks], size)
    entries, mass = np.zeros((len(indices), dimension, dimension)), np.zeros(len(indices))
    places = np.zeros((size, 3))
    places[:, :dimension] = blocks[0].places
    constants = np.empty((sum(len(block.nodes) for block in blocks), 3))
    for column, value in enumerate((lateral, shear, density)):
        constants[:, column] = value
    tensors, which_tensor = anisotropic or (np.empty((0, 6, 6)), np.full(len(constants), -1))
    for block, own in zip(blocks, slots, strict=True):
        material = Materials(np.ascontiguousarray(constants[block.numbers]), tensors,
                             np.ascontiguousarray(which_tensor[block.numbers]))
        out = Entries(own, entries, mass)
        corners = np.ascontiguousarray(block.nodes[:, : block.geometry])
        affine = _affine_cells(places, corners, block.kind)
        if affine.any():
            which = np.flatnonzero(affine)
            inverse, scale = _inverse_jacobians(places, corners[which], block.kind)
            _add_affine(which, inverse, scale, *_reference_integrals(block), material, out)
        if not affine.all():
            _add_quadrature(np.flatnonzero(~affine), places, corners, _quadrature(block), material,
                            out)
    return (sp.bsr_array((entries, indices, indptr), shape=(dimension * size,) * 2),
            sp.csr_array((mass, indices, indptr), shape=(size, size)))


def pattern(members: Sequence[Integers], size: int) -> tuple[Any, Any, list[Any]]:
    """Sparsity of a matrix between nodes that share a cell.

    Parameters
    ----------
    members : sequence of (c, k) integer arrays
        Nodes of the cells of each kind.
    size : int
        Number N of nodes.

    Returns
    -------
    indptr (N + 1,), indices : integer arrays
        By rows, sorted.
    slots : list of (c, k, k) integer arrays
        Index of the entry between two of the k nodes of each cell, by kind.
    """
    # Repeated nodes of a row find the same entries.
    dofs = np.array(padded(members), dtype=np.int64, order="C")
    count, width = dofs.shape
    starts = np.zeros(size + 1, dtype=np.int64)
    np.cumsum(np.bincount(dofs.ravel(), minlength=size), out=starts[1:])
    around = np.argsort(dofs.ravel(), kind="stable") // width
    indptr = np.zeros(size + 1, dtype=np.int64)
    seen = np.full(size, -1)
    _row_lengths(dofs, starts, around, seen, indptr)
    entries = int(indptr[-1])
    if entries > _MOST:
        raise MeshError(f"The matrices of {count} cells with {width} nodes each would have "
                        f"{entries:.2g} entries, more than can be numbered; use a coarser mesh.")
    indices = np.empty(entries, dtype=np.int32)
    slots = np.empty((count, width, width), dtype=np.int32)
    seen[:] = -1
    _rows(dofs, starts, around, seen, indptr, indices, slots)
    ends = np.cumsum([len(one) for one in members])[:-1]
    return indptr.astype(np.int32), indices, [
        np.ascontiguousarray(part[:, : one.shape[1], : one.shape[1]])
        for part, one in zip(np.split(slots, ends), members, strict=True)]


def subtract(stiffness: Any, dofs: Integers, matrices: Array) -> None:
    """Subtract matrices (c, d k, d k) of cells with the nodes (c, k) from a matrix of blocks."""
    _subtract(np.ascontiguousarray(dofs, dtype=np.int64), np.ascontiguousarray(matrices),
              stiffness.indptr, stiffness.indices, stiffness.data)


@kernel
def _subtract(
    dofs: IntegerMatrix, matrices: Block, indptr: ShortVector, indices: ShortVector, blocks: Block,
) -> None:
    """Subtract the entries; indices of a row are ascending."""
    dimension = blocks.shape[1]
    for e in range(len(dofs)):
        for i in range(dofs.shape[1]):
            start, end = indptr[dofs[e, i]], indptr[dofs[e, i] + 1]
            for j in range(dofs.shape[1]):
                at = start + np.searchsorted(indices[start:end], dofs[e, j])
                for p in range(dimension):
                    for q in range(dimension):
                        blocks[at, p, q] -= matrices[e, dimension * i + p, dimension * j + q]


@kernel
def _row_lengths(
    dofs: IntegerMatrix, starts: IntegerVector, around: IntegerVector, seen: IntegerVector,
    indptr: IntegerVector,
) -> None:
    """Fill indptr (N + 1,); the cells at node i are around[starts[i]:starts[i + 1]]."""
    total = 0
    for i in range(len(seen)):
        for a in range(starts[i], starts[i + 1]):
            for j in range(dofs.shape[1]):
                node = dofs[around[a], j]
                if seen[node] != i:
                    seen[node] = i
                    total += 1
        indptr[i + 1] = total


@kernel
def _rows(
    dofs: IntegerMatrix, starts: IntegerVector, around: IntegerVector, seen: IntegerVector,
    indptr: IntegerVector, indices: ShortVector, slots: ShortBlock,
) -> None:
    """Fill the column indices, and where each cell finds its entries."""
    width = dofs.shape[1]
    for i in range(len(seen)):
        first, last = indptr[i], indptr[i + 1]
        end = first
        for a in range(starts[i], starts[i + 1]):
            for j in range(width):
                node = dofs[around[a], j]
                # Marks of earlier rows lie below the first entry of this one.
                if seen[node] < first:
                    seen[node] = end
                    indices[end] = node
                    end += 1
        for s in range(first + 1, last):
            node, place = indices[s], s
            while place > first and indices[place - 1] > node:
                indices[place] = indices[place - 1]
                place -= 1
            indices[place] = node
        for s in range(first, last):
            seen[indices[s]] = s
        for a in range(starts[i], starts[i + 1]):
            cell = around[a]
            for own in range(width):
                if dofs[cell, own] == i:
                    for j in range(width):
                        slots[cell, own, j] = seen[dofs[cell, j]]


def _ends(kind: CellKind) -> list[int]:
    """Nodes at the origin of the reference cell and at the ends of its axes."""
    corners = [tuple(place) for place in kind.places[: kind.corners]]
    axes = np.eye(kind.dimension, dtype=int)
    return [corners.index((0,) * kind.dimension), *(corners.index(tuple(axis)) for axis in axes)]


def _affine_cells(nodes: Array, corners: Integers, kind: CellKind) -> Any:
    """Boolean mask (c,) of the cells that are affine images of the reference cell."""
    if kind.simplex and corners.shape[1] == kind.corners:
        return np.ones(len(corners), dtype=bool)
    first, *others = _ends(kind)
    origin = nodes[corners[:, first]]
    edges = nodes[corners[:, others]] - origin[:, None]
    size = np.abs(edges).max(axis=(1, 2))
    affine = np.ones(len(corners), dtype=bool)
    for node, place in zip(corners.T, np.array(kind.places, float), strict=False):
        expected = origin + np.einsum("a,cap->cp", place, edges)
        affine &= np.abs(nodes[node] - expected).max(axis=1) <= _AFFINE * size
    return affine


def _inverse_jacobians(
    nodes: Array, corners: Integers, kind: CellKind
) -> tuple[Array, Array]:
    """Derivatives (c, 3, 3) of the reference coordinates and volumes (c,) of affine cells."""
    (first, *others), dimension = _ends(kind), kind.dimension
    edges = (nodes[corners[:, others]] - nodes[corners[:, [first]]])[:, :, :dimension]
    jacobian = np.moveaxis(edges, 1, 2)
    inverse = np.zeros((len(corners), 3, 3))
    inverse[:, :dimension, :dimension] = np.linalg.inv(jacobian)
    return inverse, np.abs(np.linalg.det(jacobian))


def _shapes(dimension: int, count: int, at: Array) -> tuple[Array, Array]:
    """Values (q, k) and slopes (q, k, 3) of shape functions at reference points (q, d)."""
    values, slopes = shape_functions(dimension, count, at)
    found = np.zeros((*values.shape, 3))
    found[:, :, :dimension] = slopes
    return np.ascontiguousarray(values), found


def _reference_integrals(block: ElementBlock) -> tuple[Array, Array]:
    """Integrals of the products of slopes (k, k, 3, 3) and values (k, k) of shape functions."""
    rule = _quadrature(block)
    return (np.einsum("q,qia,qjb->ijab", rule.weights, rule.slopes, rule.slopes),
            np.einsum("q,qi,qj->ij", rule.masses, rule.values, rule.values))


def _quadrature(block: ElementBlock) -> "Quadrature":
    """Points of stiffness and of mass, each with the weight zero in the other integral."""
    local, masses = block.mass_rule
    weights = np.zeros(len(masses))
    if np.array_equal(local, block.local):
        weights = np.array(block.weights)
    elif not block.has_mean_strain:
        local = np.concatenate([block.local, local])
        weights = np.append(block.weights, weights)
        masses = np.append(np.zeros(len(block.weights)), masses)
    values, slopes = _shapes(block.kind.dimension, block.nodes.shape[1], local)
    stretch = _shapes(block.kind.dimension, block.geometry, local)[1]
    return Quadrature(weights, np.array(masses), stretch, values, slopes)


@helper
def _entry(stiffness: Matrix, H: Matrix, p: int, q: int) -> float:
    """Stiffness between displacements in p and q for a stiffness (6, 6)."""
    entry = 0.0
    for r in range(3):
        pr = p if p == r else (5 if p + r == 2 else (5 + p + r) // 2)
        for s in range(3):
            qs = q if q == s else (5 if q + s == 2 else (5 + q + s) // 2)
            entry += stiffness[pr, qs] * H[r, s]
    return entry


class Materials(NamedTuple):
    """Lame's constants and density (c, 3) of cells, stiffnesses (n, 6, 6), and which a cell has."""

    constants: Matrix
    tensors: Block
    which: IntegerVector


class Entries(NamedTuple):
    """Blocks (e, d, d) of the stiffness, entries (e,) of the mass, and those of each cell's nodes.

    The latter are ``slots`` (c, k, k).
    """

    slots: ShortBlock
    blocks: Block
    mass: Vector


class Quadrature(NamedTuple):
    """Rule of q points in a reference cell.

    ``weights`` and ``masses`` (q,) for stiffness and mass, slopes ``stretch`` (q, g, 3) of the map
    of the cell, and ``values`` (q, k) and ``slopes`` (q, k, 3) of the shape functions.
    """

    weights: Vector
    masses: Vector
    stretch: Block
    values: Matrix
    slopes: Block


@kernel
def _add_affine(
    which: IntegerVector, inverse: Block, scale: Vector, gradients: Array4, masses: Matrix,
    material: Materials, out: Entries,
) -> None:
    """Add the affine cells ``which`` to the blocks of the stiffness and the entries of the mass."""
    constants, tensors, which_tensor = material.constants, material.tensors, material.which
    slots, blocks, mass = out.slots, out.blocks, out.mass
    width, dimension = slots.shape[1], blocks.shape[1]
    half, H = np.empty((3, 3)), np.empty((3, 3))
    for cell in range(len(which)):
        e, J, volume = which[cell], inverse[cell], scale[cell]
        lateral, shear, density = constants[e]
        tensor = which_tensor[e]
        for i in range(width):
            for j in range(i, width):
                G = gradients[i, j]
                for a in range(3):
                    for q in range(3):
                        half[a, q] = G[a, 0] * J[0, q] + G[a, 1] * J[1, q] + G[a, 2] * J[2, q]
                for p in range(3):
                    for q in range(3):
                        H[p, q] = volume * (J[0, p] * half[0, q] + J[1, p] * half[1, q]
                                            + J[2, p] * half[2, q])
                spread = shear * (H[0, 0] + H[1, 1] + H[2, 2])
                there, back = slots[e, i, j], slots[e, j, i]
                weight = density * (volume * masses[i, j])
                mass[there] += weight
                if there != back:
                    mass[back] += weight
                for p in range(dimension):
                    for q in range(p if i == j else 0, dimension):
                        if tensor >= 0:
                            entry = _entry(tensors[tensor], H, p, q)
                        else:
                            entry = lateral * H[p, q] + shear * H[q, p]
                            if p == q:
                                entry += spread
                        blocks[there, p, q] += entry
                        if i != j or p != q:
                            blocks[back, q, p] += entry


@kernel
def _add_quadrature(
    which: IntegerVector, nodes: Matrix, corners: IntegerMatrix, rule: Quadrature,
    material: Materials, out: Entries,
) -> None:
    """Add the cells ``which`` by quadrature."""
    weights, stretch, values, slopes = rule.weights, rule.stretch, rule.values, rule.slopes
    constants, tensors, which_tensor = material.constants, material.tensors, material.which
    slots, blocks, mass = out.slots, out.blocks, out.mass
    width, dimension, points = slots.shape[1], blocks.shape[1], len(weights)
    J, I = np.empty((3, 3)), np.empty((3, 3))
    slope, H = np.empty((width, 3)), np.empty((width, width, 3, 3))
    own = np.empty((width, width))
    for e in which:
        lateral, shear, density = constants[e]
        tensor = which_tensor[e]
        H[:] = 0.0
        own[:] = 0.0
        for point in range(points):
            # A plane cell has unit thickness.
            J[:] = 0.0
            if dimension == 2:
                J[2, 2] = 1.0
            for g in range(corners.shape[1]):
                for p in range(3):
                    for a in range(3):
                        J[p, a] += nodes[corners[e, g], p] * stretch[point, g, a]
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                for p in range(3):
                    q, r = (p + 1) % 3, (p + 2) % 3
                    I[a, p] = J[q, b] * J[r, c] - J[q, c] * J[r, b]
            volume = J[0, 0] * I[0, 0] + J[1, 0] * I[0, 1] + J[2, 0] * I[0, 2]
            for i in range(width):
                for p in range(3):
                    slope[i, p] = (slopes[point, i, 0] * I[0, p] + slopes[point, i, 1] * I[1, p]
                                   + slopes[point, i, 2] * I[2, p]) / volume
            size = abs(volume) * rule.masses[point]
            volume = abs(volume) * weights[point]
            for i in range(width):
                for j in range(i, width):
                    own[i, j] += size * values[point, i] * values[point, j]
                    for p in range(3):
                        along = volume * slope[i, p]
                        for q in range(3):
                            H[i, j, p, q] += along * slope[j, q]
        for i in range(width):
            for j in range(i, width):
                there, back = slots[e, i, j], slots[e, j, i]
                weight = density * own[i, j]
                mass[there] += weight
                if there != back:
                    mass[back] += weight
                spread = shear * (H[i, j, 0, 0] + H[i, j, 1, 1] + H[i, j, 2, 2])
                for p in range(dimension):
                    for q in range(p if i == j else 0, dimension):
                        if tensor >= 0:
                            entry = _entry(tensors[tensor], H[i, j], p, q)
                        else:
                            entry = lateral * H[i, j, p, q] + shear * H[i, j, q, p]
                            if p == q:
                                entry += spread
                        blocks[there, p, q] += entry
                        if i != j or p != q:
                            blocks[back, q, p] += entry
