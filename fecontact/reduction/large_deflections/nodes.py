"""Springs of large deflections as contact nodes of a modal basis."""

from dataclasses import replace

import numpy as np

from fecontact.core.types import Array
from fecontact.reduction.large_deflections.fit import CondensedBody
from fecontact.reduction.large_deflections.forces import (
    LargeDeflectionForces,
    large_deflection_forces,
    nonlinear_stress,
    static_response,
)
from fecontact.reduction.large_deflections.options import LargeDeflections
from fecontact.reduction.modal_basis import ModalBasis


def with_large_deflections(
    basis: ModalBasis, fitted: CondensedBody, projected: Array, given: LargeDeflections, own: int
) -> ModalBasis:
    """A copy of the basis of a body with its forces of large deflections, and their stress.

    Parameters
    ----------
    basis : ModalBasis
        Linear basis with m coordinates, of which the first ``own`` are modes of the body.
    fitted : CondensedBody
        Potential, displacements and stress of some modes.
    projected : (m, d, d) array
        ``psi_k^T M theta_ij`` of the fields of displacement.
    given : LargeDeflections
        Options.
    own : int
        Number of modes of the body.
    """
    shapes, w = basis.mode_shapes, basis.angular_frequencies
    assert shapes is not None
    largest = np.linalg.norm(shapes.shapes[..., fitted.modes], axis=1).max(axis=0)
    response = static_response(fitted, projected, w)
    forces, rows = large_deflection_forces(fitted, response, w, largest,
                                           given.largest_displacement)
    least = 2.0 * given.stretching_damping * w * (np.arange(len(w)) >= own)
    added = np.diag(np.maximum(least - np.diag(basis.damping), 0.0))
    stress = nonlinear_stress(fitted, response, shapes.stress)
    return with_springs(replace(basis, damping=basis.damping + added,
                                mode_shapes=replace(shapes, nonlinear_stress=stress)),
                        forces, rows)


def with_springs(basis: ModalBasis, forces: LargeDeflectionForces, rows: Array) -> ModalBasis:
    """A copy with one more group of contact nodes, whose normal motions are ``rows @ q``.

    Parameters
    ----------
    basis : ModalBasis
        Basis with m coordinates.
    forces : LargeDeflectionForces
        Stiffness of the n springs, and the name of the group.
    rows : (n, m) array
        Elongations of the springs.
    """
    import scipy.sparse as sp

    d, n, end = basis.dimension, len(rows), 2 + basis.contact_nodes
    each = 3 * (d - 1)
    T = np.zeros((n, each, basis.modes))
    T[:, d - 1] = rows
    shapes = basis.mode_shapes
    if shapes is not None:
        known = shapes.restriction.tocsr()
        none = sp.csr_array((n * each, known.shape[1]))
        shapes = replace(shapes, restriction=sp.csr_array(sp.vstack(
            [known[: each * end], none, known[each * end :]])))
    quality = basis.quality
    if quality is not None:
        quality = replace(quality, compliance=np.insert(
            quality.compliance, [end] * n, np.zeros(d), axis=0))
    return replace(
        basis, T=np.concatenate([basis.T[:end], T, basis.T[end:]]),
        positions=np.insert(basis.positions, [end] * n, basis.positions[:2].mean(axis=0), axis=0),
        tributary=np.append(basis.tributary, np.ones(n)),
        groups=(*basis.groups, (forces.group, n)), springs=(*basis.springs, forces.group),
        contact_normals=None if basis.contact_normals is None else np.concatenate(
            [basis.contact_normals, np.eye(d)[[-1] * n]]),
        on_ground=np.append(basis.ground_nodes, np.zeros(n, bool)), mode_shapes=shapes,
        quality=quality, large_deflections=(*basis.large_deflections, forces))
