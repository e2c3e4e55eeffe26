r"""Pressure that stays normal to the deformed outline of a body, and its load stiffness.

With the deformed places x over the coordinates of a facet, the force of a pressure p at node i is

.. math::

    f_i = -p \int N_i\, x_{,1} \times x_{,2}\; d\xi_1 d\xi_2, \qquad
    f_i = p\,b \int N_i\, (-y_{,1},\ x_{,1})\; d\xi

of a solid, and along an edge of a plane body of thickness b that lies on its left. The derivative
is symmetric only where the pressure has a potential, as on closed outlines.
"""

from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.body_forces import boundary_facets
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.elements.cell_kinds import shape_functions
from fecontact.fem.faces.surface import functions_by, quadrature

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def follower_pressure(
    body: ElasticBody, pressures: dict[str, float], displacement: Array
) -> tuple[Array, Any]:
    """Nodal forces (d N,) of pressures on named boundaries, and their derivative, sparse.

    Parameters
    ----------
    body : ElasticBody
        The body.
    pressures : dict of name to float
        Pressure on each boundary, above zero into the body [Pa].
    displacement : (N, d) array
        Displacements of the nodes [m].
    """
    import scipy.sparse as sp

    d, size = body.dimension, body.nodes.size
    force, places = np.zeros(body.nodes.shape), body.nodes + displacement
    rows, columns, entries = [], [], []
    for name, pressure in pressures.items():
        if not pressure:
            continue
        facets = boundary_facets(body, name)
        own, slopes = _edges(places[facets]) if d == 2 else _faces(facets, places[facets])
        scale = pressure * (body.thickness if d == 2 else 1.0)
        np.add.at(force, facets, scale * own)
        at = d * facets[:, :, None] + np.arange(d)
        shape = slopes.shape
        rows.append(np.broadcast_to(at[:, :, :, None, None], shape).ravel())
        columns.append(np.broadcast_to(at[:, None, None], shape).ravel())
        entries.append(scale * slopes.ravel())
    data = np.concatenate([np.zeros(0), *entries])
    where = tuple(np.concatenate([np.zeros(0, np.int64), *one]) for one in (rows, columns))
    return force.ravel(), sp.csc_array(sp.coo_array((data, where), shape=(size, size)))


def _edges(places: Array) -> tuple[Array, Array]:
    """Forces (k, n, 2) of a unit pressure on edges (k, n, 2), and derivatives (k, n, 2, n, 2)."""
    count = places.shape[1]
    values, slopes = shape_functions(1, count, 0.5 * (1.0 + _GAUSS)[:, None])
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    pair = np.einsum("g,gi,gj->ij", 0.5 * _WEIGHTS, values, slopes[..., 0])
    each = np.einsum("ij,pq->ipjq", pair, turn)
    return (np.einsum("ij,pq,kjq->kip", pair, turn, places),
            np.broadcast_to(each, (len(places), *each.shape)))


def _faces(facets: Integers, places: Array) -> tuple[Array, Array]:
    """Forces (k, n, 3) of a unit pressure on faces (k, n, 3), and derivatives (k, n, 3, n, 3)."""
    values, slopes, weights = functions_by(quadrature, facets)
    along = np.einsum("kgna,knx->akgx", slopes, places)
    forces = -np.einsum("kg,kgi,kgx->kix", weights, values, np.cross(along[0], along[1]))
    # cross[x, y, z]: component x of e_y times e_z.
    cross = np.zeros((3, 3, 3))
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[x, y, z], cross[x, z, y] = 1.0, -1.0
    moved = (np.einsum("kgj,xyz,kgz->kgxjy", slopes[..., 0], cross, along[1])
             + np.einsum("kgj,xzy,kgz->kgxjy", slopes[..., 1], cross, along[0]))
    return forces, -np.einsum("kg,kgi,kgxjy->kixjy", weights, values, moved)
