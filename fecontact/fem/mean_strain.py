r"""Quadrilaterals of four and hexahedra of eight nodes with one strain and hourglass stiffness.

The strain is the mean over the element of that of its bilinear or trilinear displacements, so that
bending does not lock and patch tests hold. Displacements along the hourglass vectors

.. math:: \gamma_m = h_m - (h_m \cdot x_i)\, b_i

of each component have none: h_1, ..., h_4 are +1 or -1 at the nodes (in the plane one vector), x
their coordinates and b the mean gradients. They get the stiffness

.. math:: K_{hg} = \kappa G V\, (b_i \cdot b_i) \sum_m \gamma_m \gamma_m^T

(Flanagan and Belytschko, Int. J. Numer. Meth. Eng. 17, 1981, p. 679) with the volume V, the shear
modulus G, of anisotropic materials the least stiffness against shear, and kappa, the ``hourglass``
of the body: 0.005 in Abaqus, 0.0005 E / G = 0.001 (1 + nu) in CalculiX. CalculiX 2.20 leaves x and
y out of the vectors gamma, which matters in bricks whose sides are not parallel.
"""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.fem.element_block import PAIRS, ElementBlock


def stiffness(body: Any, part: ElementBlock) -> Array:
    """Stiffness (e, d k, d k) of mean strain and hourglasses, by node, then component [N/m].

    Of plane bodies per thickness [N/m^2].
    """
    d = body.dimension
    gradients, volumes = part.gradients()
    e, _, k, _ = gradients.shape
    strains = np.zeros((e, len(PAIRS[d]), k, d))
    for row, (i, j) in enumerate(PAIRS[d]):
        strains[:, row, :, i] += gradients[:, 0, :, j]
        if i != j:
            strains[:, row, :, j] += gradients[:, 0, :, i]
    flat = strains.reshape(e, -1, d * k)
    used = [0, 1, 3] if d == 2 else list(range(6))
    C = body.cell_stiffness(part.numbers)[:, used][:, :, used]
    found = np.swapaxes(flat, 1, 2) @ (volumes[:, :, None] * C) @ flat
    rows = hourglass_rows(body, part)
    scalar = np.swapaxes(rows, 1, 2) @ rows
    blocks = found.reshape(e, k, d, k, d)
    for axis in range(d):
        blocks[:, :, axis, :, axis] += scalar
    return 0.5 * (found + np.swapaxes(found, 1, 2))


def hourglass_rows(body: Any, part: ElementBlock) -> Array:
    """Rows R (e, m, k) of one component of displacement with the stiffness R^T R."""
    d = body.dimension
    gradients, volumes = part.gradients()
    b, places = gradients[:, 0], part.places[part.nodes]
    signs = 1.0 - 2.0 * part.at_nodes
    products = [(0, 1)] if d == 2 else [(1, 2), (0, 2), (0, 1), (0, 1, 2)]
    h = np.stack([signs[:, list(axes)].prod(axis=1) for axes in products])
    gamma = h - np.einsum("mk,eki,eni->emn", h, places, b)
    modulus = body.hourglass * body.shear_moduli[part.numbers]
    size = modulus * volumes[:, 0] * (b**2).sum(axis=(1, 2))
    return np.asarray(np.sqrt(size)[:, None, None] * gamma)


def hourglass_energies(body: Any, part: ElementBlock, fields: Array) -> Array:
    """Energies (n,) of hourglasses of elements under displacements (N, d, n) [J]."""
    moved = fields[part.nodes]
    # Subtract a node: rigid displacements may be much larger than differences.
    felt = np.einsum("emk,ekin->emin", hourglass_rows(body, part), moved - moved[:, :1])
    return np.asarray(0.5 * (felt**2).sum(axis=(0, 1, 2)))
