"""Nodal forces of loads that act on the whole body or along a boundary."""

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.mesh import Mesh
from fecontact.fem.points import edge_weights


def inertia_forces(body: ElasticBody) -> Array:
    """Nodal forces (2 N, 2) of unit accelerations in x and y, ``M 1`` [kg]."""
    translations = np.eye(2)[np.arange(2 * len(body.nodes)) % 2]
    return np.asarray(body.mass @ translations)


def boundary_forces(body: ElasticBody, boundary: str) -> Array:
    """Nodal forces (2 N, 2) of unit pressure and of unit shear on a boundary [m^2].

    Pressure acts along the inward normal. Shear acts along the boundary with the body on the left,
    so that it points to +x where the body lies above.

    Raises
    ------
    MeshError
        If the mesh has no such boundary.
    """
    edges = along_outline(body.mesh, body.mesh.boundary(boundary))
    nodes = body.edge_nodes(edges)
    tangent = np.diff(body.mesh.nodes[edges], axis=1)[:, 0]
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    weights = body.thickness * edge_weights(body, nodes)
    forces = np.zeros((len(body.nodes), 2, 2))
    for load, direction in enumerate((normal, tangent)):
        np.add.at(forces[:, :, load], nodes, weights[:, :, None] * direction[:, None, :])
    return forces.reshape(-1, 2)


def along_outline(mesh: Mesh, edges: Integers) -> Integers:
    """Edges (k, 2) of the outline, turned such that the body lies on their left."""
    forward = {tuple(edge) for edge in mesh.outline.tolist()}
    turned = [edge if tuple(edge) in forward else edge[::-1] for edge in edges.tolist()]
    return np.array(turned, dtype=edges.dtype).reshape(-1, 2)
