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
from fecontact.core.types import Array
from fecontact.fem.assembly import pattern
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.element_block import PAIRS, ElementBlock
from fecontact.fem.incompatible_modes import mode_gradients
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

    indptr, indices, slots = pattern([block.nodes for block in body.blocks], len(body.nodes))
    entries = np.zeros(len(indices))
    for block, own in zip(body.blocks, slots, strict=True):
        first = 0
        for part in block.parts():
            gradients, volumes = part.gradients()
            stress = cell_stress(body, displacement, part, gradients)
            if temperatures is not None:
                held = thermal_stress(body, temperatures, part)
                stress = stress - held[..., None, None] * np.eye(body.dimension)
            _add(gradients, volumes * body.thickness, stress,
                 own[first : first + len(part.nodes)], entries)
            first += len(part.nodes)
    one = sp.csr_array((entries, indices, indptr), shape=(len(body.nodes),) * 2)
    return sp.csc_array(sp.kron(one, sp.eye_array(body.dimension)))


def cell_stress(
    body: ElasticBody, displacement: Array, part: ElementBlock, gradients: Array
) -> Array:
    """Stress tensors (e, q, d, d) in elements [Pa] with the ``gradients`` of their functions."""
    d = body.dimension
    moved = displacement.reshape(-1, d)[part.nodes]
    # Subtract a node: rigid displacements may be much larger than differences.
    slopes = np.einsum("eki,eqkj->eqij", moved - moved[:, :1], gradients)
    if part.incompatible:
        slopes += mode_gradients(body, part, displacement, part.local)[..., 0]
    strain = np.stack([slopes[..., i, j] if i == j else slopes[..., i, j] + slopes[..., j, i]
                       for i, j in PAIRS[d]], axis=-1)
    of_strain = body.cell_stiffness(part.numbers)[:, USED[d]][:, :, USED[d]]
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
