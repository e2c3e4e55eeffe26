"""Gradients of the shape functions of cells and their volumes at points of quadrature."""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.fem.elements.cell_kinds import shape_functions

# Directions of the components of a strain, by dimension.
PAIRS = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))}


def cell_gradients(body: Any, cells: Any = slice(None)) -> tuple[Array, Array]:
    """Gradients (e, q, k, d) of the k shape functions and volumes (e, q) of cells of a body.

    ``body`` is an :class:`~fecontact.ElasticBody`, whose rule of quadrature has the points q. The
    volumes of a plane body are areas [m^d].
    """
    members, d = body.basis.element_dofs.T[cells], body.dimension
    local, weights = np.ascontiguousarray(body.basis.X.T), body.basis.W
    _, slopes = shape_functions(d, members.shape[1], local)
    corners = body.mesh.kind.corners
    geometry = slopes if body.curved else shape_functions(d, corners, local)[1]
    places = body.nodes[members[:, : geometry.shape[1]]]
    jacobian = np.einsum("qkj,eki->eqij", geometry, places)
    # scikit-fem may mirror cells; rules of tetrahedra have negative weights.
    volumes = np.abs(np.linalg.det(jacobian)) * weights
    gradients = np.einsum("qkj,eqji->eqki", slopes, np.linalg.inv(jacobian))
    return np.ascontiguousarray(gradients), volumes
