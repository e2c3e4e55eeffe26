"""Rigid modes of solids from their geometry and supports, and strain energies of their motions."""

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import Array4, Block, IntegerMatrix, Matrix, Vector
from fecontact.core.types import Array
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_kinds import shape_functions

# Elements whose strains are in memory at once.
_AT_ONCE = 2000
# Motions of supports, relative to that of the body, that count as none.
_STILL = 1e-9


def rigid_motions(places: Array, centre: Array) -> Array:
    """Displacements (3 N, 6) of places (N, 3) by translations and rotations about a centre."""
    found = np.zeros((len(places), 3, 6))
    found[:, :, :3] = np.eye(3)
    x, y, z = (places - centre).T
    found[:, 1, 3], found[:, 2, 3] = -z, y
    found[:, 0, 4], found[:, 2, 4] = z, -x
    found[:, 0, 5], found[:, 1, 5] = -y, x
    return found.reshape(-1, 6)


def solid_rigid_modes(body: ElasticBody) -> Array:
    """Mass-normalised rigid modes (3 N, r) that the supports allow, r = 0 ... 6.

    Translations in x, y, z and rotations about them, about the centre of mass for a free body;
    where supports allow only some, what is left of these, each without the ones before it.
    """
    weights = np.asarray(body.component_mass.sum(axis=1)).ravel()
    centre = weights @ body.nodes / weights.sum()
    whole = rigid_motions(body.nodes, centre)
    shapes = whole @ _allowed(body, whole, centre)
    shapes[body.fixed_dofs] = 0.0
    for column in range(shapes.shape[1]):
        for _ in range(2):
            earlier = shapes[:, :column]
            shapes[:, column] -= earlier @ (earlier.T @ (body.mass @ shapes[:, column]))
        shapes[:, column] /= np.sqrt(shapes[:, column] @ (body.mass @ shapes[:, column]))
    return shapes


def _allowed(body: ElasticBody, whole: Array, centre: Array) -> Array:
    """Coefficients (6, r) of the rigid motions that move no support."""
    size = body.mesh.extent
    scale = np.array([1.0] * 3 + [1.0 / size] * 3)
    held = [whole[body.fixed_dofs] * scale]
    for _, pivot, axis in body.hinges:
        # The axis does not move, and turns about itself alone.
        turning = np.hstack([np.zeros((3, 3)), (np.eye(3) - np.outer(axis, axis)) * size])
        held += [rigid_motions(pivot[None], centre) * scale, turning * scale]
    triangle = np.linalg.qr(np.vstack([*held, np.zeros((6, 6))]), mode="r")
    _, values, directions = np.linalg.svd(triangle)
    free = directions[values <= _STILL * max(float(values[0]), 1.0)].T
    found = np.zeros((6, 0))
    # Motions along the axes as far as they are free, in their order.
    for motion in free @ free.T:
        rest = motion - found @ (found.T @ motion)
        rest -= found @ (found.T @ rest)
        if found.shape[1] < free.shape[1] and np.linalg.norm(rest) > 1e-6:
            found = np.column_stack([found, rest / np.linalg.norm(rest)])
    return scale[:, None] * found


def solid_strain_energies(body: ElasticBody, shapes: Array) -> Array:
    """Strain energies (m,) [J] of displacements (3 N, m), from the strains in the elements."""
    members = body.basis.element_dofs.T
    local, weights = np.ascontiguousarray(body.basis.X.T), body.basis.W
    _, slopes = shape_functions(3, members.shape[1], local)
    straight = body.mesh.kind.corners
    geometry = slopes if body.curved else shape_functions(3, straight, local)[1]
    constants = np.array(body.elasticity)
    fields = np.ascontiguousarray(shapes, dtype=float).reshape(len(body.nodes), 3, -1)
    energies = np.zeros(shapes.shape[1])
    for first in range(0, len(members), _AT_ONCE):
        nodes = members[first : first + _AT_ONCE]
        places = body.nodes[nodes[:, : geometry.shape[1]]]
        jacobian = np.einsum("qkj,eki->eqij", geometry, places)
        # scikit-fem may mirror cells; rules of tetrahedra have negative weights.
        volume = np.abs(np.linalg.det(jacobian)) * weights
        gradients = np.einsum("qkj,eqji->eqki", slopes, np.linalg.inv(jacobian))
        _add_strain_energies(np.ascontiguousarray(gradients), volume,
                             np.ascontiguousarray(nodes, dtype=np.int64), fields, constants,
                             energies)
    return energies


@kernel
def _add_strain_energies(
    gradients: Array4, volume: Matrix, nodes: IntegerMatrix, fields: Block, elasticity: Vector,
    energies: Vector,
) -> None:
    """Add the energies of some elements; gradients (e, q, k, 3) of their k shape functions."""
    elements, points = volume.shape
    corners, modes = nodes.shape[1], len(energies)
    direct, lateral, shear = elasticity
    strains = np.empty((6, modes))
    for e in range(elements):
        first = nodes[e, 0]
        for q in range(points):
            strains[:] = 0.0
            for k in range(1, corners):
                x, y, z = gradients[e, q, k, 0], gradients[e, q, k, 1], gradients[e, q, k, 2]
                node = nodes[e, k]
                for i in range(modes):
                    # Subtract a node: rigid displacements may be much larger than differences.
                    u = fields[node, 0, i] - fields[first, 0, i]
                    v = fields[node, 1, i] - fields[first, 1, i]
                    w = fields[node, 2, i] - fields[first, 2, i]
                    strains[0, i] += x * u
                    strains[1, i] += y * v
                    strains[2, i] += z * w
                    strains[3, i] += y * u + x * v
                    strains[4, i] += z * v + y * w
                    strains[5, i] += z * u + x * w
            half = 0.5 * volume[e, q]
            for i in range(modes):
                xx, yy, zz = strains[0, i], strains[1, i], strains[2, i]
                slides = strains[3, i] ** 2 + strains[4, i] ** 2 + strains[5, i] ** 2
                energies[i] += half * (direct * (xx * xx + yy * yy + zz * zz)
                                       + 2.0 * lateral * (xx * yy + yy * zz + zz * xx)
                                       + shear * slides)
