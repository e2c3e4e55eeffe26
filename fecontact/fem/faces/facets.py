"""Facets on the outline of a body in the plane or in space: closest places, motion of places."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import shape_functions
from fecontact.fem.faces.surface import Surface, functions_at, triangular

_NEAREST = 24  # facets among which the closest place is looked for
_STEPS = 12
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True, eq=False)
class Facets:
    """Edges of a plane body or faces of a solid.

    Attributes
    ----------
    places : (N, d) array
        Places of the displacement nodes of the body [m].
    nodes : (k, n) integer array
        Nodes of each facet: ends and middle of edges, of faces as in
        :class:`~fecontact.fem.faces.surface.Surface`.
    """

    places: Array
    nodes: Integers

    @cached_property
    def shape_integrals(self) -> Array:
        """Integrals (k, n) of the shape functions over the facets, m or m^2."""
        if self.places.shape[1] == 3:
            return Surface(self.places, self.nodes).shape_integrals
        values, slopes = shape_functions(1, self.nodes.shape[1], 0.5 + 0.5 * _GAUSS[:, None])
        along = np.einsum("gn,knx->kgx", slopes[..., 0], self.places[self.nodes])
        return np.asarray(0.5 * np.linalg.norm(along, axis=2) * _WEIGHTS @ values)

    def closest(self, places: Array) -> tuple[Integers, Array, Array]:
        """Closest facet (s,) to each place, local coordinates (s, d - 1) there, distances (s,)."""
        from scipy.spatial import cKDTree

        corners = self.places[self.nodes]
        near = min(_NEAREST, len(self.nodes))
        order = cKDTree(corners.mean(axis=1)).query(places, near)[1].reshape(-1, near)
        facet = order[:, 0]
        local = np.zeros((len(places), places.shape[1] - 1))
        distance = np.full(len(places), np.inf)
        for other in order.T:
            at = closest_local(self.nodes[other], corners[other], places)
            values, _ = functions_at(self.nodes[other], at)
            away = np.linalg.norm(places - np.einsum("sn,snx->sx", values, corners[other]), axis=1)
            closer = away < distance * (1.0 - 1e-9)
            facet, distance = np.where(closer, other, facet), np.where(closer, away, distance)
            local = np.where(closer[:, None], at, local)
        return facet, local, distance

    def following(self, places: Array, facet: Integers, local: Array) -> Array:
        """Displacements (s, n, d, d) of places (s, d) that follow facets at local coordinates.

        Those of each place from those of the n nodes of its facet, as in
        :class:`~fecontact.fem.Tie`.
        """
        corners = self.places[self.nodes[facet]]
        d = places.shape[1]
        values, slopes = functions_at(self.nodes[facet], local)
        along = np.einsum("sna,snx->sax", slopes, corners)
        # Rows are the reciprocal vectors.
        reciprocal = np.linalg.solve(along @ np.swapaxes(along, 1, 2), along)
        gradient = np.einsum("sna,sax->snx", slopes, reciprocal)
        away = places - np.einsum("sn,snx->sx", values, corners)
        values = values + np.einsum("snx,sx->sn", gradient, away)
        normal = (np.cross(along[:, 0], along[:, 1]) if d == 3
                  else np.stack([along[:, 0, 1], -along[:, 0, 0]], axis=1))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        gap = (away * normal).sum(axis=1)
        tilt = gap[:, None, None, None] * gradient[..., :, None] * normal[:, None, None, :]
        return np.asarray(values[..., None, None] * np.eye(d) - tilt)


def closest_local(nodes: Integers, corners: Array, places: Array) -> Array:
    """Local coordinates (s, d - 1) of the closest place of each facet to a place.

    ``nodes`` (s, n) are those of the facets, ``corners`` (s, n, d) their places.
    """
    d = corners.shape[2]
    triangle = (triangular(nodes) if d == 3 else np.zeros(len(nodes), bool))[:, None]
    local = np.where(triangle, 1.0 / 3.0, 0.5) + np.zeros((len(places), d - 1))
    for _ in range(_STEPS):
        values, slopes = functions_at(nodes, local)
        away = places - np.einsum("sn,snx->sx", values, corners)
        along = np.einsum("snd,snx->sdx", slopes, corners)
        metric = along @ np.swapaxes(along, 1, 2)
        step = np.linalg.solve(metric, (along @ away[..., None]))[..., 0]
        before, local = local, _inside(local + step, triangle)
        if np.abs(local - before).max(initial=0.0) < 1e-13:
            break
    return local


def _inside(local: Array, triangle: Any) -> Array:
    """The closest local coordinates within the reference facet; ``triangle`` (s, 1) is a mask."""
    beyond = 0.5 * np.maximum(local.sum(axis=1, keepdims=True) - 1.0, 0.0)
    within = np.clip(local - beyond, 0.0, 1.0)
    within = within / np.maximum(within.sum(axis=1, keepdims=True), 1.0)
    return np.where(triangle, within, np.clip(local, 0.0, 1.0))
