"""Modal bases with forces of large deflections."""

from dataclasses import replace

import numpy as np

from fecontact.core.types import Array
from fecontact.reduction.large_deflections.fit import CondensedBody
from fecontact.reduction.large_deflections.modal_forces import (
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
    response = static_response(fitted, projected, w)
    forces = large_deflection_forces(fitted, response, w, given.largest_displacement)
    least = 2.0 * given.stretching_damping * w * (np.arange(len(w)) >= own)
    added = np.diag(np.maximum(least - np.diag(basis.damping), 0.0))
    stress = nonlinear_stress(fitted, response, shapes.stress)
    return replace(basis, damping=basis.damping + added, large_deflections=(forces,),
                   mode_shapes=replace(shapes, nonlinear_stress=stress))
