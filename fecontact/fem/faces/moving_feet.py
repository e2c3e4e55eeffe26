r"""Feet of places on faces that deform: local coordinates, normals and their derivatives.

The foot :math:`y(\xi) = \sum_i N_i(\xi) X_i` of a place x on a facet with the nodes X lies where
:math:`a_\alpha \cdot (x - y) = 0`, with the tangents :math:`a_\alpha = y_{,\alpha}`. It follows
displacements by

.. math::

    (a_\alpha \cdot a_\beta - g\,b_{\alpha\beta})\,\delta\xi_\beta = a_\alpha \cdot \delta w
        + g\,n \cdot \delta w_\alpha, \qquad b_{\alpha\beta} = n \cdot y_{,\alpha\beta},

.. math::

    \delta w = \delta x - \sum_i N_i\,\delta X_i, \qquad
    \delta w_\alpha = \sum_i N_{i,\alpha}\,\delta X_i, \qquad
    \delta n = -a^\alpha\,(n \cdot \delta w_\alpha + b_{\alpha\beta}\,\delta\xi_\beta),

and the distance g = n . (x - y) by :math:`\delta g = n \cdot \delta w`. (Wriggers, Computational
Contact Mechanics, chapter 4.) The flat ground is a face without nodes.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.faces.facets import Facets
from fecontact.fem.faces.surface import functions_at, triangular

# Part of a facet by which a foot may lie beside it, so that it does not change to and fro.
_STAYS = 0.05
# Steps of Newton's method, and the change of local coordinates in the last one.
_STEPS, _EXACT = 25, 1e-12


@dataclass(frozen=True, eq=False)
class Feet:
    """Feet of n places on facets with k nodes each, in space of d dimensions.

    Attributes
    ----------
    facet : (n,) integer array
        Facets.
    nodes : (n, k) integer array
        Nodes of the facets.
    values, slopes, second_derivatives : (n, k), (n, k, d - 1), (n, k, d - 1, d - 1) arrays
        Shape functions at the feet, and their first and second derivatives.
    places : (n, d) array
        Feet [m].
    along, curved : (n, d - 1, d), (n, d - 1, d - 1, d) arrays
        Tangents of the facets and their derivatives [m].
    normals : (n, d) array
        Unit normals out of the facets.
    gaps : (n,) array
        Distances of the places along the normals, below zero behind the face [m].
    valid : (n,) bool array
        False for places beyond the ends of the face.
    """

    facet: Integers
    nodes: Integers
    values: Array
    slopes: Array
    second_derivatives: Array
    places: Array
    along: Array
    curved: Array
    normals: Array
    gaps: Array
    valid: NDArray[np.bool_]

    def motions(self, anchors: int) -> tuple[Array, Array]:
        """Rows of ``w`` (n, d, l) and ``w_alpha`` (n, d - 1, d, l) over local displacements.

        These are those of the place, of the k nodes of the facet and of some ``anchors``, which do
        not move the foot: l = d (1 + k + anchors).
        """
        n, d = self.places.shape
        k = self.nodes.shape[1]
        eye, end = np.eye(d), d * (1 + k)
        w = np.zeros((n, d, end + d * anchors))
        w[:, :, :d] = eye
        w[:, :, d:end] = -np.einsum("nk,xy->nxky", self.values, eye).reshape(n, d, -1)
        w_along = np.zeros((n, d - 1, *w.shape[1:]))
        w_along[..., d:end] = np.einsum("nka,xy->naxky", self.slopes, eye).reshape(n, d - 1, d, -1)
        return w, w_along

    def followed(self, w: Array, w_along: Array) -> tuple[Array, Array]:
        """Derivatives of the local coordinates (n, d - 1, l) and of the normals (n, d, l)."""
        metric = self.along @ np.swapaxes(self.along, 1, 2)
        b = np.einsum("nabx,nx->nab", self.curved, self.normals)
        tilt = np.einsum("nx,naxl->nal", self.normals, w_along)
        moved = np.linalg.solve(metric - self.gaps[:, None, None] * b,
                                self.along @ w + self.gaps[:, None, None] * tilt)
        turned = np.linalg.solve(metric, tilt + b @ moved)
        return moved, -np.einsum("nax,nal->nxl", self.along, turned)


class Opposite(Protocol):
    """The side opposite to contact points: a face that deforms, or flat ground."""

    def feet(self, places: Array, displaced: Array, before: Integers | None = None) -> Feet:
        """Feet of places (n, d), where the nodes of the body are ``displaced`` (N, d)."""


@dataclass(frozen=True)
class FlatGround:
    """Ground at the height zero of the last coordinate, without end."""

    dimension: int

    def feet(self, places: Array, displaced: Array, before: Integers | None = None) -> Feet:
        """Feet right below the places."""
        n, d = places.shape
        axes = np.broadcast_to(np.eye(d)[:-1], (n, d - 1, d))
        foot = np.array(places)
        foot[:, -1] = 0.0
        return Feet(
            np.zeros(n, np.int64), np.zeros((n, 0), np.int64), np.zeros((n, 0)),
            np.zeros((n, 0, d - 1)), np.zeros((n, 0, d - 1, d - 1)), foot, axes,
            np.zeros((n, d - 1, d - 1, d)), np.tile(np.eye(d)[-1], (n, 1)), places[:, -1].copy(),
            np.ones(n, bool))


@dataclass(frozen=True, eq=False)
class DeformedFace:
    """A face of a body that deforms.

    Attributes
    ----------
    facets : (f, k) integer array
        Nodes of its facets, see :func:`~fecontact.fem.body_forces.boundary_facets`.
    """

    facets: Integers

    def feet(self, places: Array, displaced: Array, before: Integers | None = None) -> Feet:
        """Closest feet; a place stays on its facet ``before`` (n,) up to a little beside it.

        A place beyond the ends of the face is not valid; its gap is the distance from the face.
        """
        d, distance = places.shape[1], np.zeros(len(places))
        facet = np.zeros(len(places), np.int64) if before is None else before.copy()
        local = np.where(self._triangles(facet)[:, None], 1.0 / 3.0, 0.5) + np.zeros(
            (len(places), d - 1))
        lost = np.ones(len(places), bool)
        if before is not None:
            local = self._perpendicular(places, displaced, facet, local)
            lost = self._offset(facet, local) > _STAYS
        if lost.any():
            facet[lost], near, distance[lost] = Facets(displaced, self.facets).closest(places[lost])
            local[lost] = self._perpendicular(places[lost], displaced, facet[lost], near)
        feet = self._at(places, displaced, facet, local)
        valid = self._offset(facet, local) <= _STAYS
        return replace(feet, valid=valid, gaps=np.where(valid, feet.gaps, distance))

    def _triangles(self, facet: Integers) -> NDArray[np.bool_]:
        """Mask (n,) of the facets that are triangles."""
        if self.facets.shape[1] < 3 or not len(facet):
            return np.zeros(len(facet), bool)
        return triangular(self.facets[facet])

    def _offset(self, facet: Integers, local: Array) -> Array:
        """Distance of local coordinates outside their facets, relative to the facets' size."""
        far = np.maximum(-local, local - 1.0).max(axis=1)
        triangles = self._triangles(facet)
        far[triangles] = np.maximum(far, local.sum(axis=1) - 1.0)[triangles]
        return np.asarray(np.nan_to_num(far, nan=np.inf))

    def _perpendicular(
        self, places: Array, displaced: Array, facet: Integers, local: Array
    ) -> Array:
        """Local coordinates of feet on given facets, which may lie beside these."""
        for _ in range(_STEPS):
            feet = self._at(places, displaced, facet, local)
            away = places - feet.places
            metric = (feet.along @ np.swapaxes(feet.along, 1, 2)
                      - np.einsum("nabx,nx->nab", feet.curved, away))
            step = np.linalg.solve(metric, feet.along @ away[..., None])[..., 0]
            step = np.clip(step, -0.5, 0.5)
            local = np.clip(local + step, -1.0, 2.0)
            if np.abs(step).max(initial=0.0) < _EXACT:
                break
        return local

    def _at(self, places: Array, displaced: Array, facet: Integers, local: Array) -> Feet:
        nodes = self.facets[facet]
        d = displaced.shape[1]
        corners = displaced[nodes]
        values, slopes = functions_at(nodes, local)
        second_derivatives = np.empty((*slopes.shape, d - 1))
        for axis, half in enumerate(0.5 * np.eye(d - 1)):
            # Exact: functions are at most quadratic in each coordinate.
            second_derivatives[..., axis] = (functions_at(nodes, local + half)[1]
                                             - functions_at(nodes, local - half)[1])
        along = np.einsum("nka,nkx->nax", slopes, corners)
        normals = (np.cross(along[:, 0], along[:, 1]) if d == 3
                   else np.stack([along[:, 0, 1], -along[:, 0, 0]], axis=1))
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        foot = np.einsum("nk,nkx->nx", values, corners)
        return Feet(facet, nodes, values, slopes, second_derivatives, foot, along,
                    np.einsum("nkab,nkx->nabx", second_derivatives, corners), normals,
                    ((places - foot) * normals).sum(axis=1), np.ones(len(places), bool))

