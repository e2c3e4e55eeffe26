r"""Bodies of revolution that rotate, in the frame at rest: convective terms.

Material passes through the places of the mesh with the velocity v = Omega e x (x - c). With
displacements u along axes at rest, at places at rest, the acceleration of the material is
:math:`(\partial_t + v \cdot \nabla)^2 u`, apart from the centrifugal one, and by parts

.. math:: M u'' + 2 \Omega \int \rho N^T N_\phi\, u' - \Omega^2 \int \rho N_\phi^T N_\phi\, u,
    \qquad N_\phi = (e \times (x - c)) \cdot \nabla N

for surfaces that material does not cross.
"""

from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_geometry import centres_of

# Part of the angle over which a facet reaches that its normal may lean along the circumference.
_LEAN, _ROUNDING = 0.6, 0.02


def convective_matrices(body: ElasticBody, S: Array, centre: Array) -> tuple[Any, Any]:
    """``int rho N^T N_phi``, skew, and ``int rho N_phi^T N_phi``, sparse (N, N) [kg].

    They are those of one displacement component; S (d, d) takes the vector product with the axis.

    Raises
    ------
    InputError
        For a body that is none of revolution.
    """
    import scipy.sparse as sp

    require_revolution(body, S, centre)
    size = len(body.nodes)
    found = [sp.csr_array((size, size)), sp.csr_array((size, size))]
    for part in body.parts():
        part = part.exact
        (gradients, volumes), values, nodes = part.gradients(), part.values, part.nodes
        flow = (np.einsum("qk,ekd->eqd", values, body.nodes[nodes]) - centre) @ S.T
        along = np.einsum("eqkd,eqd->eqk", gradients, flow)
        weights = volumes * (body.densities[part.numbers] * body.thickness)[:, None]
        rows = np.repeat(nodes, nodes.shape[1], axis=1)
        columns = np.tile(nodes, (1, nodes.shape[1]))
        for number, left in enumerate((np.broadcast_to(values, along.shape), along)):
            block = np.einsum("eqi,eqj,eq->eij", left, along, weights)
            found[number] = found[number] + sp.csr_array(sp.coo_array(
                (block.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)))
    first, second = found
    return sp.csr_array(0.5 * (first - first.T)), sp.csr_array(0.5 * (second + second.T))


def require_revolution(body: ElasticBody, S: Array, centre: Array) -> None:
    """Raise InputError for a body whose surface its material would cross as it rotates."""
    corners = body.mesh.nodes[body.mesh.outline]
    sides = np.diff(corners, axis=1)
    if body.dimension == 2:
        normals = np.stack([sides[:, 0, 1], -sides[:, 0, 0]], axis=1)
    else:
        normals = np.cross(sides[:, 0], sides[:, 1])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    around = (corners - centre) @ S.T
    centres = centres_of(body.mesh.nodes, body.mesh.outline)
    middle = (centres - centre) @ S.T
    speed = np.linalg.norm(middle, axis=1)
    lean = np.abs((normals * middle).sum(axis=1))
    units = around / np.maximum(np.linalg.norm(around, axis=2), 1e-300)[:, :, None]
    cosine = np.clip((units[:, :, None] * units[:, None]).sum(axis=3), -1.0, 1.0)
    reach = np.arccos(cosine).max(axis=(1, 2))
    wrong = lean > (_LEAN * reach + _ROUNDING) * speed
    if wrong.any():
        place = ", ".join(f"{x:g}" for x in centres[np.argmax(wrong)])
        raise InputError(f"Rotation: frame = 'standing' is for bodies of revolution about the "
                         f"axis, but the surface at ({place}) crosses circles around it; take "
                         f"frame = 'rotating'.")
