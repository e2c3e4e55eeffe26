"""Nodal forces of loads that act on the whole body or along a boundary."""

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.frames import tangents_of
from fecontact.fem.faces.surface import Surface
from fecontact.fem.mesh import Mesh
from fecontact.fem.points import edge_weights, sampled_edges


def inertia_forces(body: ElasticBody) -> Array:
    """Nodal forces (d N, d) of unit accelerations in x, y (, z), ``M 1`` [kg]."""
    d = body.dimension
    translations = np.eye(d)[np.arange(d * len(body.nodes)) % d]
    return np.asarray(body.mass @ translations)


def boundary_forces(body: ElasticBody, boundary: str) -> Array:
    """Nodal forces of unit pressure and of unit shear on a boundary [m^2].

    Pressure acts along the inward normal n. In the plane (2 N, 2) shear acts along the boundary
    with the body on the left, so that it points to +x where the body lies above. On a solid
    (3 N, 3) there are two shears: along t, the projection of global x on the tangent plane (of y
    where n is within 10 degrees of x), and along t2 = n x t.

    Raises
    ------
    MeshError
        If the mesh has no such boundary.
    """
    if body.dimension == 3:
        return _face_forces(body, body.mesh.boundary(boundary))
    edges = along_outline(body.mesh, body.mesh.boundary(boundary))
    nodes = body.edge_nodes(edges)
    forces = np.zeros((len(body.nodes), 2, 2))
    if body.curved:
        values, tangents, lengths = sampled_edges(body.nodes[nodes])
        normals = np.stack([-tangents[..., 1], tangents[..., 0]], axis=-1)
        for load, direction in enumerate((normals, tangents)):
            each = np.einsum("kg,gn,kgx->knx", body.thickness * lengths, values, direction)
            np.add.at(forces[:, :, load], nodes, each)
        return forces.reshape(-1, 2)
    tangent = np.diff(body.mesh.nodes[edges], axis=1)[:, 0]
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    weights = body.thickness * edge_weights(body, nodes)
    for load, direction in enumerate((normal, tangent)):
        np.add.at(forces[:, :, load], nodes, weights[:, :, None] * direction[:, None, :])
    return forces.reshape(-1, 2)


def _face_forces(body: ElasticBody, facets: Integers) -> Array:
    surface = Surface(body.nodes, body.facet_nodes(facets))
    values, _, outward, weights = surface.sampled
    normals = -outward
    tangents = tangents_of(normals.reshape(-1, 3)).reshape(*normals.shape[:2], 2, 3)
    forces = np.zeros((len(body.nodes), 3, 3))
    for load, direction in enumerate((normals, tangents[:, :, 0], tangents[:, :, 1])):
        np.add.at(forces[:, :, load], surface.facets,
                  np.einsum("kg,kgn,kgx->knx", weights, values, direction))
    return forces.reshape(-1, 3)


def boundary_facets(body: ElasticBody, name: str) -> Integers:
    """Nodes of the facets of a boundary; of edges start, end, (middle), the body on their left."""
    facets = body.mesh.boundary(name)
    if body.dimension == 3:
        return body.facet_nodes(facets)
    nodes = body.edge_nodes(along_outline(body.mesh, facets))
    return nodes if nodes.shape[1] == 2 else nodes[:, [0, 2, 1]]


def along_outline(mesh: Mesh, edges: Integers) -> Integers:
    """Edges (k, 2) of the outline, turned such that the body lies on their left."""
    forward = {tuple(edge) for edge in mesh.outline.tolist()}
    turned = [edge if tuple(edge) in forward else edge[::-1] for edge in edges.tolist()]
    return np.array(turned, dtype=edges.dtype).reshape(-1, 2)
