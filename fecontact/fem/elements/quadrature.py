"""Rules of quadrature over reference cells."""

from functools import cache

import numpy as np

from fecontact.core.types import Array
from fecontact.fem.elements.cell_kinds import CellKind

# Order of quadrature by dimension, number of corners and degree: exact for the mass of straight
# triangles and tetrahedra, parallelograms, parallelepipeds, prisms and pyramids above
# parallelograms; for trilinear cells of degree 1 too.
_ORDER = {(2, 3, 1): 4, (2, 3, 2): 4, (2, 4, 1): 4, (2, 4, 2): 4, (3, 4, 1): 2, (3, 4, 2): 4}
_OTHERS = 5
# With curved cells the products of shape functions meet determinants of higher order.
_CURVED_ORDER = 6


def rule_of(kind: CellKind, degree: int, curved: bool) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) for elements of degree 1 or 2, straight or curved."""
    return rule(kind.dimension, kind.corners, _CURVED_ORDER if curved else _ORDER.get(
        (kind.dimension, kind.corners, degree), _OTHERS))


@cache
def rule(dimension: int, corners: int, order: int) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,), exact for polynomials of an order over the reference cell.

    In quadrilaterals and hexahedra, and along the height of wedges, the order is that of each
    direction. In pyramids it is that of each direction of the cube which they are with their top
    blown up.
    """
    import skfem.refdom as refdom
    from skfem.quadrature import get_quadrature

    if corners == dimension + 1:
        at, weights = get_quadrature(refdom.RefTri if dimension == 2 else refdom.RefTet, order)
        return np.ascontiguousarray(at.T), np.array(weights)
    if (dimension, corners) == (3, 6):
        (flat, first), (along, second) = rule(2, 3, order), _line(order)
        at = np.concatenate([np.repeat(flat, len(along), axis=0),
                             np.tile(along, len(flat))[:, None]], axis=1)
        return at, np.outer(first, second).ravel()
    lines = [_line(order)] * dimension
    if (dimension, corners) == (3, 5):
        lines[2] = _line(order + 2)
    at, weights = (np.stack([grid.ravel() for grid in np.meshgrid(*one, indexing="ij")], axis=1)
                   for one in zip(*lines, strict=True))
    weights = weights.prod(axis=1)
    if (dimension, corners) == (3, 5):
        left = 1.0 - at[:, 2]
        at[:, :2] *= left[:, None]
        weights = weights * left**2
    return at, weights


def _line(order: int) -> tuple[Array, Array]:
    """Gauss points and weights from 0 to 1."""
    points, weights = np.polynomial.legendre.leggauss(order // 2 + 1)
    return 0.5 * (1.0 + points), 0.5 * weights
