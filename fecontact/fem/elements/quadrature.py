"""Rules of quadrature over reference cells, exact or those of the elements of other programs.

Abaqus, CalculiX and Ansys give their elements these points, with a full and a reduced rule:

| element | full | reduced |
|---|---|---|
| hexahedron of 20 nodes | 3 x 3 x 3 | 2 x 2 x 2 |
| quadrilateral of 8 nodes | 3 x 3 | 2 x 2 |
| hexahedron of 8, quadrilateral of 4 nodes | 2 x 2 (x 2) | mean strain, hourglass stiffness |
| wedge of 15 nodes | 3 in the triangle x 3 | as full |
| wedge of 6 nodes | 1 in the triangle x 2 | as full |

Other elements have the exact rule. Mass has it always, as in Abaqus and Ansys; CalculiX takes
the points of the stiffness for it.
"""

import math
from functools import cache
from typing import Literal

import numpy as np

from fecontact.core.types import Array
from fecontact.fem.elements.cell_kinds import CellKind

# Order of quadrature by dimension, number of corners and degree: exact for the mass of straight
# triangles and tetrahedra, parallelograms, parallelepipeds, prisms and pyramids above
# parallelograms; for trilinear cells of degree 1 too.
_ORDER = {(2, 3, 1): 4, (2, 3, 2): 4, (2, 4, 1): 4, (2, 4, 2): 4, (3, 4, 1): 2, (3, 4, 2): 4}
_OTHERS = 5
Integration = Literal["exact", "full", "reduced"]
# Orders of the full and the reduced rule by dimension, corners and nodes; of wedges those in the
# triangle and along the height.
_PROGRAMS = {(2, 4, 4): (3, 1), (2, 4, 8): (5, 3), (3, 8, 8): (3, 1), (3, 8, 20): (5, 3),
             (3, 6, 6): ((1, 3),) * 2, (3, 6, 15): ((2, 5),) * 2}
# With curved cells the products of shape functions meet determinants of higher order.
_CURVED_ORDER = 6


def rule_of(kind: CellKind, degree: int, curved: bool) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) for elements of degree 1 or 2, straight or curved."""
    return rule(kind.dimension, kind.corners, _CURVED_ORDER if curved else _ORDER.get(
        (kind.dimension, kind.corners, degree), _OTHERS))


def stiffness_rule(
    kind: CellKind, count: int, curved: bool, integration: Integration
) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,) for the stiffness of elements of ``count`` nodes."""
    orders = _PROGRAMS.get((kind.dimension, kind.corners, count))
    if integration == "exact" or orders is None:
        return rule_of(kind, 1 if count == kind.corners else 2, curved)
    order = orders[integration == "reduced"]
    flat, along = order if isinstance(order, tuple) else (order, None)
    return rule(kind.dimension, kind.corners, flat, along)


def extrapolation(kind: CellKind, count: int, local: Array) -> Array:
    """Values (count, q) at the nodes of a cell of polynomials through points of quadrature (q, d).

    They are polynomials of each direction, of wedges of the triangle and of the height.
    """
    nodes = np.array(kind.places[:count], float)
    return _monomials(kind, len(local), nodes) @ np.linalg.inv(
        _monomials(kind, len(local), local))


def _monomials(kind: CellKind, count: int, at: Array) -> Array:
    """Monomials (n, count) at places (n, d), one for each point of a rule of a program."""
    if (kind.dimension, kind.corners) == (3, 6):
        flat = [np.ones(len(at))] if count == 2 else [np.ones(len(at)), at[:, 0], at[:, 1]]
        return np.stack([one * at[:, 2] ** power for one in flat
                         for power in range(count // len(flat))], axis=1)
    powers = np.ndindex(*(round(count ** (1.0 / kind.dimension)),) * kind.dimension)
    return np.stack([(at ** np.array(one)).prod(axis=1) for one in powers], axis=1)


@cache
def rule(
    dimension: int, corners: int, order: int, along: int | None = None
) -> tuple[Array, Array]:
    """Points (q, d) and weights (q,), exact for polynomials of an order over the reference cell.

    In quadrilaterals and hexahedra the order is that of each direction. Along the height of wedges
    it is ``along``, by default that in their triangles. In pyramids it is that of each direction of
    the cube which they are with their top blown up.
    """
    import skfem.refdom as refdom
    from skfem.quadrature import get_quadrature

    if corners == dimension + 1 and order == 1:
        return np.full((1, dimension), 1.0 / corners), np.array([1.0 / math.factorial(dimension)])
    if corners == dimension + 1:
        at, weights = get_quadrature(refdom.RefTri if dimension == 2 else refdom.RefTet, order)
        return np.ascontiguousarray(at.T), np.array(weights)
    if (dimension, corners) == (3, 6):
        (flat, first), (height, second) = rule(2, 3, order), _line(along or order)
        at = np.concatenate([np.repeat(flat, len(height), axis=0),
                             np.tile(height, len(flat))[:, None]], axis=1)
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
