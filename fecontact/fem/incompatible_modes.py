"""Incompatible modes of eight-node bricks, condensed in each cell.

Besides its trilinear displacements u a cell has the displacements ``sum_i b_i(s) a_i`` with the
bubbles ``b_i = 4 s_i (1 - s_i)`` of the local coordinates s from 0 to 1. Their nine factors a
belong to the cell alone (Wilson et al., Numerical and Computer Methods in Structural Mechanics,
1973). Their gradients are ``j_0 / j J_0^-T db_i/ds`` with the Jacobian J and its determinant j, at
the centre J_0 and j_0, so that constant stress does no work on them in distorted cells either
(Taylor, Beresford and Wilson, Int. J. Numer. Meth. Eng. 10, 1976). Without forces on a,

    K_aa a = -K_au u,      K = K_uu - K_au^T K_aa^-1 K_au.

Bending is exact in rectangular cells, in which trilinear displacements alone lock in shear. Each
``body`` is an :class:`~fecontact.ElasticBody` with ``degree = 1``, ``part`` some of its bricks.
"""

from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.fem.element_block import ElementBlock
from fecontact.fem.elements.cell_kinds import shape_functions

# Rows of the strains xx, yy, zz, xy, yz, xz to which a derivative (first) of a component (second)
# belongs.
_ROWS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])


def reductions(body: Any, part: ElementBlock) -> Array:
    """Matrices (e, 9, 24) R of bricks, so that the modes lower their stiffness by R^T R."""
    own, coupling = _matrices(body, part)
    return np.linalg.solve(np.linalg.cholesky(own), coupling)


def mode_gradients(
    body: Any, part: ElementBlock, shapes: Array, local: Array, factors: Array | None = None
) -> Array:
    """Gradients (e, q, 3, 3, m), d_j of component i, of the modes under displacements (3 N, m).

    They are those at local coordinates (q, 3) of some bricks. ``factors`` (9 b, m) of all b bricks
    stand for those without force under the displacements.
    """
    if factors is None:
        own, coupling = _matrices(body, part)
        fields = shapes.reshape(len(body.nodes), 3, -1)[part.nodes]
        # Subtract a node: rigid displacements may be much larger than differences.
        fields = (fields - fields[:, :1]).reshape(len(part.nodes), 24, -1)
        given = -np.linalg.solve(own, coupling @ fields).reshape(len(part.nodes), 3, 3, -1)
    else:
        bricks = next(block for block in body.blocks if block.incompatible)
        rows = np.searchsorted(bricks.numbers, part.numbers)
        given = factors.reshape(-1, 3, 3, factors.shape[1])[rows]
    _, bubbles, _ = _slopes(part, local)
    return np.asarray(np.einsum("eqbj,ebim->eqijm", bubbles, given))


def bubble_gradients(part: ElementBlock) -> Array:
    """Gradients (e, q, 3, 3), by bubble, then axis, at the points of quadrature of bricks."""
    return _slopes(part, part.local)[1]


def _matrices(body: Any, part: ElementBlock) -> tuple[Array, Array]:
    """K_aa (e, 9, 9) and K_au (e, 9, 24); a and u by bubble or node, then component."""
    gradients, bubbles, volume = _slopes(part, part.local)
    volume = volume * part.weights
    C = body.cell_stiffness(part.numbers)
    strains, of_bubbles = _strains(gradients), _strains(bubbles)
    weighted = np.einsum("eqra,ers,eq->eqas", of_bubbles, C, volume, optimize=True)
    own = np.einsum("eqas,eqsb->eab", weighted, of_bubbles, optimize=True)
    coupling = np.einsum("eqas,eqsb->eab", weighted, strains, optimize=True)
    return 0.5 * (own + np.swapaxes(own, 1, 2)), coupling


def _slopes(part: ElementBlock, local: Array) -> tuple[Array, Array, Array]:
    """Gradients (e, q, 8, 3) of shape functions, (e, q, 3, 3) of bubbles, and determinants."""
    places = part.places[part.nodes]
    _, slopes = shape_functions(3, 8, local)
    _, middle = shape_functions(3, 8, np.full((1, 3), 0.5))
    jacobian = np.einsum("qkj,eki->eqij", slopes, places)
    at_centre = np.einsum("kj,eki->eij", middle[0], places)
    volume, inverse = np.linalg.det(jacobian), np.linalg.inv(jacobian)
    gradients = np.einsum("qkj,eqji->eqki", slopes, inverse)
    ratio = np.linalg.det(at_centre)[:, None] / volume
    bubbles = np.einsum("eq,qb,ebi->eqbi", ratio, 4.0 - 8.0 * local, np.linalg.inv(at_centre))
    return gradients, bubbles, np.abs(volume)


def _strains(gradients: Array) -> Array:
    """Strains (e, q, 6, 3 k) of displacements by function, then component, from (e, q, k, 3)."""
    e, q, k, _ = gradients.shape
    found = np.zeros((e, q, 6, k, 3))
    for component in range(3):
        for axis in range(3):
            found[:, :, _ROWS[axis, component], :, component] += gradients[:, :, :, axis]
    return found.reshape(e, q, 6, 3 * k)
