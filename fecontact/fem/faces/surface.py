"""The surface of a solid as facets of its elements: areas, normals, mean motions of patches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import blocks_of, padded, shape_functions, widths
from fecontact.fem.elements.serendipity_parts import lowest_first

# Points a direction: exact for moments of quadratic displacements over plane facets, and to about
# 1e-8 over facets that span a tenth of a radius.
_POINTS = 4


# Local coordinates (g, 2) and weights (g,) of facets with so many nodes, of all equally many.
Rule = Callable[[int], tuple[Array, Array]]


def functions_by(rule: Rule, facets: Integers) -> tuple[Array, Array, Array]:
    """Shape functions (k, g, n), their slopes (k, g, n, 2) and weights (k, g) of a rule.

    The functions of nodes that fill a row are zero.
    """
    k, n = facets.shape
    found: list[Array] = []
    for which, rows in blocks_of(facets):
        count = rows.shape[1]
        local, weights = rule(count)
        values, slopes = _filled(n, *shape_functions(2, count, local))
        parts = [np.broadcast_to(part, (len(rows), *part.shape))
                 for part in (values, slopes, weights)]
        if len(rows) == k:
            return parts[0], parts[1], parts[2]
        found = found or [np.empty((k, *part.shape[1:])) for part in parts]
        for whole, part in zip(found, parts, strict=True):
            whole[which] = part
    return found[0], found[1], found[2]


def functions_at(facets: Integers, local: Array) -> tuple[Array, Array]:
    """Shape functions (s, n) and slopes (s, n, d - 1) of facets (s, n) at places (s, d - 1)."""
    n, axes = facets.shape[1], local.shape[1]
    values, slopes = np.empty((len(facets), n)), np.empty((len(facets), n, axes))
    if axes == 1:
        return shape_functions(1, n, local)
    for which, rows in blocks_of(facets) if len(facets) else []:
        values[which], slopes[which] = _filled(n, *shape_functions(
            2, rows.shape[1], local[which]))
    return values, slopes


def _filled(n: int, values: Array, slopes: Array) -> tuple[Array, Array]:
    """Functions (..., n) and slopes (..., n, 2) with zeros for the nodes that fill a row."""
    more = n - values.shape[-1]
    if not more:
        return values, slopes
    zeros = np.zeros((*values.shape[:-1], more))
    return (np.concatenate([values, zeros], axis=-1),
            np.concatenate([slopes, np.stack([zeros, zeros], axis=-1)], axis=-2))


def corners_of(facets: Integers) -> Integers:
    """Corners (k, 3) or (k, 4) of facets (k, n) of solids."""
    found = np.empty((len(facets), 3 if facets.shape[1] in (3, 6) else 4), np.int64)
    for which, rows in blocks_of(facets):
        count = 3 if rows.shape[1] in (3, 6) else 4
        found[which] = padded([rows[:, :count]], found.shape[1])
    return found


def triangular(facets: Integers) -> NDArray[np.bool_]:
    """Mask (k,) of the triangles among facets (k, n) of solids."""
    return np.isin(widths(facets), (3, 6))


@dataclass(frozen=True, eq=False)
class Surface:
    """Facets of elements on the surface of a solid.

    Attributes
    ----------
    places : (N, 3) array
        Reference places of the displacement nodes of the body [m].
    facets : (k, n) integer array
        Nodes of each facet: 3 or 4 corners, counter-clockwise seen from outside the body, of
        quadratic elements then the middles between successive corners and, but for serendipity
        elements, the centre of four-sided facets. Triangles beside four-sided ones are filled by
        their last node.
    covered : (k, g) bool array, optional
        Quadrature points that count, as of a face of which a part has no partner; all by default.
    """

    places: Array
    facets: Integers
    covered: NDArray[np.bool_] | None = None

    @cached_property
    def sampled(self) -> tuple[Array, Array, Array, Array]:
        """Shape functions (k, g, n), places (k, g, 3), outward unit normals, weights (k, g) [m^2].

        The weights are those of quadrature over the facets as they are curved.
        """
        values, places, normals, weights = self.at(quadrature)
        return values, places, normals, (weights if self.covered is None
                                         else weights * self.covered)

    def at(self, rule: Rule) -> tuple[Array, Array, Array, Array]:
        """Shape functions, places, unit normals and weights at the points of a rule."""
        values, slopes, shares = functions_by(rule, self.facets)
        corners = self.places[self.facets]
        places = np.einsum("kgn,knx->kgx", values, corners)
        along = np.einsum("kgnd,knx->dkgx", slopes, corners)
        normals = np.cross(along[0], along[1])
        areas = np.linalg.norm(normals, axis=2)
        return values, places, normals / areas[..., None], areas * shares

    @cached_property
    def areas(self) -> Array:
        """Area (k,) of each facet [m^2]."""
        return self.sampled[3].sum(axis=1)

    @cached_property
    def centres(self) -> Array:
        """Centroid (k, 3) of each facet [m]."""
        _, places, _, weights = self.sampled
        return np.einsum("kg,kgx->kx", weights, places) / self.areas[:, None]

    @cached_property
    def area_vectors(self) -> Array:
        """Integral (k, 3) of the outward normal over each facet [m^2]."""
        _, _, normals, weights = self.sampled
        return np.einsum("kg,kgx->kx", weights, normals)

    @cached_property
    def shape_integrals(self) -> Array:
        """Integrals (k, n) of the shape functions over the facets [m^2]."""
        return np.einsum("kg,kgn->kn", self.sampled[3], self.sampled[0])

    def pressure_forces(self) -> Array:
        """Nodal forces (3 N,) of a pressure of 1 Pa, along the inward normal [m^2]."""
        values, _, normals, weights = self.sampled
        forces = np.zeros_like(self.places)
        np.add.at(forces, self.facets, -np.einsum("kg,kgn,kgx->knx", weights, values, normals))
        return forces.ravel()

    def only(self, which: Any) -> "Surface":
        """Some of the facets."""
        return Surface(self.places, self.facets[which],
                       None if self.covered is None else self.covered[which])

    def patches(self, owner: Integers) -> "Patches":
        """Mean motions of patches of facets: ``owner`` (k,) numbers the patch of each, from 0."""
        return Patches(self, np.asarray(owner), int(np.max(owner, initial=-1)) + 1)


@dataclass(frozen=True, eq=False)
class Patches:
    """Facets put together to patches, each with its mean motion.

    The displacement of a patch is the area-weighted mean over it, its rotation the best-fitting
    rigid one: with arms r from the centroid,

        phi = J^-1 int r x u dA,     J = int (|r|^2 1 - r r^T) dA.

    By duality a force on a patch is a uniform traction, and a moment the traction J^-1 M x r.
    """

    surface: Surface
    owner: Integers
    count: int

    def _summed(self, values: Array) -> Array:
        """Sums (count, ...) over the facets of each patch."""
        found = np.zeros((self.count, *values.shape[1:]))
        np.add.at(found, self.owner, values)
        return found

    @cached_property
    def areas(self) -> Array:
        """Area (p,) [m^2]."""
        return self._summed(self.surface.areas)

    @cached_property
    def centres(self) -> Array:
        """Centroid (p, 3) [m]; that of a curved patch lies beside it."""
        weighted = self.surface.areas[:, None] * self.surface.centres
        return self._summed(weighted) / self.areas[:, None]

    @cached_property
    def normals(self) -> Array:
        """Outward unit normal (p, 3): the area-weighted mean over the patch, of length one."""
        total = self._summed(self.surface.area_vectors)
        return total / np.linalg.norm(total, axis=1, keepdims=True)

    @cached_property
    def second_moments(self) -> Array:
        """``int r r^T dA`` (p, 3, 3) about the centroids [m^4]."""
        _, places, _, weights = self.surface.sampled
        arm = places - self.centres[self.owner, None]
        return self._summed(np.einsum("kg,kgx,kgy->kxy", weights, arm, arm))

    def rows(self) -> Any:
        """Sparse rows (6 p, 3 N): displacements along x, y, z and rotations about them."""
        import scipy.sparse as sp

        surface, owner = self.surface, self.owner
        values, places, _, weights = surface.sampled
        arm = places - self.centres[owner, None]
        moments = np.einsum("kg,kgn,kgx->knx", weights, values, arm)
        spread = self.second_moments
        trace = np.trace(spread, axis1=1, axis2=2)[:, None, None]
        inverse = np.linalg.inv(trace * np.eye(3) - spread)
        turning = np.einsum("kab,knbc->knac", inverse[owner], _cross_matrices(moments))
        mean = surface.shape_integrals / self.areas[owner, None]
        data = np.concatenate([mean[..., None, None] * np.eye(3), turning], axis=2)
        row = np.broadcast_to(6 * owner[:, None, None, None] + np.arange(6)[:, None], data.shape)
        column = np.broadcast_to(3 * surface.facets[..., None, None] + np.arange(3), data.shape)
        matrix = sp.csr_array(sp.coo_array(
            (data.ravel(), (row.ravel(), column.ravel())),
            shape=(6 * self.count, 3 * len(surface.places))))
        matrix.eliminate_zeros()
        return matrix


def linear_facets(facets: Integers) -> tuple[Integers, Integers]:
    """First-order facets (p, 3) or (p, 4) between all nodes of facets, and the facet of each part.

    Parts have the orientation of their facet. The first part of each comes first, then the second
    part of each, and so on. Four-sided ones beside triangles are cut into triangles, in facets of 8
    nodes as the cells behind them are, see ``serendipity_parts``.
    """
    found, owner = [], []
    for which, rows in blocks_of(facets):
        for part in _PARTS[rows.shape[1]]:
            own = rows[:, list(part)]
            found.append(lowest_first(own) if rows.shape[1] == 8 and len(part) == 4 else own)
            owner.append(np.arange(len(facets))[which])
    parts, of = drawn_facets(padded(found))
    of = np.concatenate(owner)[of]
    order = np.argsort(of, kind="stable")
    rank = np.empty(len(of), np.int64)
    rank[order] = np.arange(len(of)) - np.searchsorted(of[order], of[order])
    order = np.lexsort((of, rank))
    return parts[order], of[order]


def as_triangles(facets: Integers) -> Integers:
    """Triangles (t, 3) of rows (k, 3) or (k, 4) of triangles and quadrilaterals, in their order."""
    if facets.shape[1] == 3:
        return facets
    found = facets[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return found[found[:, 1] != found[:, 2]]


def triangles_if_mixed(facets: Sequence[Integers]) -> list[Integers]:
    """Edges or facets of several bodies in rows of one length; mixed facets as triangles."""
    same = len({rows.shape[1] for rows in facets}) == 1
    return [rows if same else as_triangles(rows) for rows in facets]


def drawn_facets(facets: Integers) -> tuple[Integers, Integers]:
    """First-order facets without filled rows, and the facet of each part.

    Where triangles and quadrilaterals are mixed, all are triangles.
    """
    whole = np.arange(len(facets))
    if facets.shape[1] < 4:
        return facets, whole
    triangles = triangular(facets)
    if not triangles.any():
        return facets, whole
    four = np.flatnonzero(~triangles)
    return (np.concatenate([facets[:, :3], facets[four][:, [0, 2, 3]]]),
            np.concatenate([whole, four]))


_PARTS = {
    3: ((0, 1, 2),),
    4: ((0, 1, 2, 3),),
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    8: ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6, 7)),
    9: ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)),
}


def _cross_matrices(vectors: Array) -> Array:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3) from the left."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1),
                     np.stack([-y, x, zero], -1)], -2)


def quadrature(count: int) -> tuple[Array, Array]:
    """Local coordinates (g, 2) and weights (g,) of facets of 3, 6, 4, 8 or 9 nodes.

    Exact for polynomials of degree 6 over triangles, 7 in each direction over squares.
    """
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    s, w = 0.5 * (1.0 + points), 0.5 * weights
    u, v = (grid.ravel() for grid in np.meshgrid(s, s, indexing="ij"))
    both = np.outer(w, w).ravel()
    if count in (4, 8, 9):
        return np.stack([u, v], axis=1), both
    # A square collapsed to a triangle.
    return np.stack([u, v * (1.0 - u)], axis=1), both * (1.0 - u)
