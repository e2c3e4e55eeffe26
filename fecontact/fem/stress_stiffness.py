"""Geometric stiffness: what the stress of a body adds to its stiffness.

``v^T K_sigma u = int sigma_ij u_k,i v_k,j dV``: the stress acts on the gradient of each component
of the displacement alike.
"""

from typing import Any

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import (
    Array4,
    Matrix,
    ShortBlock,
    Vector,
)
from fecontact.core.types import Array, Integers
from fecontact.fem.assembly import pattern
from fecontact.fem.cell_gradients import PAIRS, cell_gradients
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.incompatible_modes import in_parts, mode_gradients
from fecontact.fem.thermal import thermal_stress

# Numbers of the components of a strain among xx, yy, zz, xy, yz, xz, by dimension.
USED = {2: [0, 1, 3], 3: [0, 1, 2, 3, 4, 5]}


def stress_stiffness(
    body: ElasticBody, displacement: Array, temperatures: Array | None = None
) -> Any:
    """Geometric stiffness, sparse (d N, d N), of the stress under displacements (d N,) [N/m].

    Symmetric, without supports. The stress is that of the linear strain at the points of
    quadrature, of bricks with incompatible modes with these; they themselves get none. The strain
    of free expansion under changes of temperature (N,) makes no stress.
    """
    import scipy.sparse as sp

    members = np.ascontiguousarray(body.basis.element_dofs.T, dtype=np.int64)
    indptr, indices, slots = pattern(members, len(body.nodes))
    entries = np.zeros(len(indices))
    for cells in in_parts(np.arange(len(members))):
        gradients, volumes = cell_gradients(body, cells)
        stress = cell_stress(body, displacement, cells, gradients)
        if temperatures is not None:
            held = thermal_stress(body, temperatures, cells)
            stress = stress - held[..., None, None] * np.eye(body.dimension)
        _add(gradients, volumes * body.thickness, stress, slots[cells], entries)
    one = sp.csr_array((entries, indices, indptr), shape=(len(body.nodes),) * 2)
    return sp.csc_array(sp.kron(one, sp.eye_array(body.dimension)))


def cell_stress(
    body: ElasticBody, displacement: Array, cells: Integers, gradients: Array
) -> Array:
    """Stress tensors (e, q, d, d) in cells [Pa], where their functions have the gradients given."""
    d = body.dimension
    moved = displacement.reshape(-1, d)[body.basis.element_dofs.T[cells]]
    # Subtract a node: rigid displacements may be much larger than differences.
    slopes = np.einsum("eki,eqkj->eqij", moved - moved[:, :1], gradients)
    if body.has_incompatible_modes:
        local = np.ascontiguousarray(body.basis.X.T)
        slopes += mode_gradients(body, cells, displacement, local)[..., 0]
    strain = np.stack([slopes[..., i, j] if i == j else slopes[..., i, j] + slopes[..., j, i]
                       for i, j in PAIRS[d]], axis=-1)
    of_strain = body.cell_stiffness(cells)[:, USED[d]][:, :, USED[d]]
    values = np.einsum("ers,eqs->eqr", of_strain, strain)
    stress = np.empty(slopes.shape)
    for component, (i, j) in enumerate(PAIRS[d]):
        stress[..., i, j] = stress[..., j, i] = values[..., component]
    return stress


@kernel
def _add(
    gradients: Array4, volumes: Matrix, stress: Array4, slots: ShortBlock, entries: Vector,
) -> None:
    """Add ``g_i^T sigma g_j dV`` of the nodes i, j of each cell to the entries of a matrix."""
    cells, points, width, d = gradients.shape
    along = np.empty(d)
    own = np.empty((width, width))
    for e in range(cells):
        own[:] = 0.0
        for q in range(points):
            for i in range(width):
                for a in range(d):
                    along[a] = 0.0
                    for b in range(d):
                        along[a] += volumes[e, q] * stress[e, q, a, b] * gradients[e, q, i, b]
                for j in range(i, width):
                    for a in range(d):
                        own[i, j] += along[a] * gradients[e, q, j, a]
        for i in range(width):
            entries[slots[e, i, i]] += own[i, i]
            for j in range(i + 1, width):
                entries[slots[e, i, j]] += own[i, j]
                entries[slots[e, j, i]] += own[i, j]
