"""Rigid motions that supports and constraints allow, and strain energies of motions of solids."""


import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import (
    Array4,
    Block,
    IntegerMatrix,
    IntegerVector,
    Matrix,
    Vector,
)
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elimination import least_squares
from fecontact.fem.incompatible_modes import reductions
from fecontact.fem.mean_strain import hourglass_energies

# Motions of supports, relative to that of the body, that count as none.
_STILL = 1e-9


def rigid_motions(places: Array, centre: Array) -> Array:
    """Displacements of places by translations and rotations about a centre.

    (3 N, 6) of places (N, 3), (2 N, 3) of places (N, 2).
    """
    found = np.zeros((*places.shape, 3 * (places.shape[1] - 1)))
    if places.shape[1] == 2:
        found[:, :, :2] = np.eye(2)
        x, y = (places - centre).T
        found[:, 0, 2], found[:, 1, 2] = -y, x
        return found.reshape(-1, 3)
    found[:, :, :3] = np.eye(3)
    x, y, z = (places - centre).T
    found[:, 1, 3], found[:, 2, 3] = -z, y
    found[:, 0, 4], found[:, 2, 4] = z, -x
    found[:, 0, 5], found[:, 1, 5] = -y, x
    return found.reshape(-1, 6)


def allowed_motions(body: ElasticBody, centre: Array) -> Array:
    """Rigid motions (d N, r) of the body and of its pieces that nothing resists.

    Supports, constraints and springs at points may resist them.

    Motions of the whole body come first: those along the axes and about the centre that are free,
    in their order, then what is free of the other rotations and translations.
    """
    G, d = body.expansion, body.dimension
    whole = rigid_motions(body.nodes, centre)
    size = np.array([1.0] * d + [1.0 / body.mesh.extent] * (whole.shape[1] - d))
    pieces, piece = body.pieces
    springs, stiffness, _ = body.springs
    if G.shape[0] == G.shape[1] and pieces == 1 and not stiffness.any():
        return whole
    whole = whole * size
    count = whole.shape[1]
    motions = np.zeros((len(whole), count * pieces))
    for one in range(pieces):
        rows = np.repeat(piece == one, d)
        motions[rows, count * one : count * (one + 1)] = whole[rows]
    unknowns = least_squares(G, motions)
    resisted = motions - G @ unknowns
    felt = np.asarray(springs[stiffness > 0.0] @ motions)
    felt /= np.maximum(np.linalg.norm(felt, axis=1), _STILL)[:, None]
    triangle = np.linalg.qr(np.vstack([resisted, felt, np.zeros((motions.shape[1],) * 2)]),
                            mode="r")
    _, values, directions = np.linalg.svd(triangle)
    free = directions[values <= _STILL * max(float(values[0]), 1.0)].T
    found = np.zeros((motions.shape[1], 0))
    together = np.tile(np.eye(count), (pieces, 1)) / np.sqrt(pieces)
    wanted = together if pieces == 1 else np.hstack([together, np.eye(motions.shape[1])])
    parts = free.T @ wanted
    bound = np.linalg.norm(parts, axis=0) < 1.0 - _STILL
    order = np.lexsort((np.where(bound, np.arange(len(bound)) % count < d, False), bound))
    for motion in (free @ parts[:, order]).T:
        rest = motion - found @ (found.T @ motion)
        rest -= found @ (found.T @ rest)
        if found.shape[1] < free.shape[1] and np.linalg.norm(rest) > 1e-6:
            found = np.column_stack([found, rest / np.linalg.norm(rest)])
    return np.asarray(G @ (unknowns @ found))


def solid_strain_energies(
    body: ElasticBody, shapes: Array, cells: Integers | None = None
) -> Array:
    """Strain energies (m,) [J] of displacements (3 N, m), from the strains in all or some cells."""
    constants, (tensors, which_tensor) = body.elasticity, body.anisotropic
    fields = np.ascontiguousarray(shapes, dtype=float).reshape(len(body.nodes), 3, -1)
    energies = np.zeros(shapes.shape[1])
    for part in body.parts(cells):
        _add_strain_energies(*part.gradients(), np.array(part.nodes), fields,
                             constants[part.numbers], tensors, which_tensor[part.numbers],
                             energies)
        if part.incompatible:
            moved = fields[part.nodes]
            # Subtract a node: rigid displacements may be much larger than differences.
            moved = (moved - moved[:, :1]).reshape(len(part.nodes), 24, -1)
            energies -= 0.5 * ((reductions(body, part) @ moved) ** 2).sum(axis=(0, 1))
        elif part.has_mean_strain:
            energies += hourglass_energies(body, part, fields)
    return energies


@kernel
def _add_strain_energies(
    gradients: Array4, volume: Matrix, nodes: IntegerMatrix, fields: Block, elasticity: Matrix,
    tensors: Block, which_tensor: IntegerVector, energies: Vector,
) -> None:
    """Add the energies of some elements; gradients (e, q, k, 3) of their k shape functions."""
    elements, points = volume.shape
    corners, modes = nodes.shape[1], len(energies)
    strains = np.empty((6, modes))
    for e in range(elements):
        direct, lateral, shear = elasticity[e]
        tensor = which_tensor[e]
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
            if tensor >= 0:
                for r in range(6):
                    for s in range(6):
                        for i in range(modes):
                            energies[i] += half * tensors[tensor, r, s] * (
                                strains[r, i] * strains[s, i])
                continue
            for i in range(modes):
                xx, yy, zz = strains[0, i], strains[1, i], strains[2, i]
                slides = strains[3, i] ** 2 + strains[4, i] ** 2 + strains[5, i] ** 2
                energies[i] += half * (direct * (xx * xx + yy * yy + zz * zz)
                                       + 2.0 * lateral * (xx * yy + yy * zz + zz * xx)
                                       + shear * slides)
