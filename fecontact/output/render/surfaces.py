"""Surfaces of solids for pictures: smooth shading between sharp edges, and these edges."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.output.files.contact_facets import facet_vectors

_SHARP = 0.85  # cosine of the angle of two facets whose common edge is drawn, about 30 degrees


@dataclass(frozen=True, eq=False)
class ShadedSurface:
    """Facets whose nodes are doubled along sharp edges, so that each side has its own normal.

    Attributes
    ----------
    facets : (f, c) integer array
        In points of the surface.
    nodes : (p,) integer array
        Mesh node of each point.
    """

    facets: Integers
    nodes: Integers

    @cached_property
    def _sum(self) -> Any:
        import scipy.sparse as sp

        f, c = self.facets.shape
        return sp.csr_array((np.ones(f * c), (self.facets.ravel(), np.repeat(np.arange(f), c))),
                            shape=(len(self.nodes), f))

    def normals(self, places: Array) -> Array:
        """Unit normals (p, 3) at the points, which lie at places (p, 3)."""
        normals = self._sum @ facet_vectors(places, self.facets)
        size = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.asarray(normals / np.maximum(size, np.finfo(float).tiny))


def shaded_surface(nodes: Array, facets: Integers) -> ShadedSurface:
    """A surface of facets (f, c) between mesh nodes (N, 3), divided along its sharp edges."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    f, c = facets.shape
    # Corners of facets on both sides of a smooth edge are one point.
    first, second, smooth = _neighbours(nodes, facets)
    corner = np.arange(f * c).reshape(f, c)
    a, b = first[smooth], second[smooth]
    which, k, m = np.nonzero(facets[a][:, :, None] == facets[b][:, None, :])
    pairs = np.column_stack([corner[a[which], k], corner[b[which], m]])
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(f * c, f * c))
    count, point = connected_components(graph, directed=False)
    at = np.zeros(count, dtype=np.int64)
    at[point] = facets.ravel()
    return ShadedSurface(point.reshape(f, c).astype(np.int64), at)


def sharp_edges(nodes: Array, facets: Integers) -> Integers:
    """Edges (e, 2) of a surface in space where it ends or bends by more than 30 degrees."""
    ends, which, counts = _edges(facets)
    smooth = _neighbours(nodes, facets, (ends, which, counts))[2]
    sharp = counts != 2
    sharp[counts == 2] = ~smooth
    return ends[sharp]


def _edges(facets: Integers) -> tuple[Integers, Integers, Integers]:
    """Edges (e, 2), the edge of each side of the facets, and how many facets each has."""
    pairs = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    ends, which, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    return ends, which.ravel(), counts


def _neighbours(nodes: Array, facets: Integers, edges: Any = None) -> tuple[Any, Any, Any]:
    """Facets on both sides of each inner edge, and True where the surface is smooth there."""
    _, which, counts = _edges(facets) if edges is None else edges
    normals = facet_vectors(nodes, facets)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    of_side = np.argsort(which, kind="stable") // facets.shape[1]
    start = np.concatenate([[0], np.cumsum(counts)[:-1]])[counts == 2]
    first, second = of_side[start], of_side[start + 1]
    return first, second, (normals[first] * normals[second]).sum(axis=1) >= _SHARP
