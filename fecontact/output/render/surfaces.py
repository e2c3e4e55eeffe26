"""Surfaces of solids for pictures: smooth shading between sharp edges, and these edges."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import edges_around, numbered_rows
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
    _, _, sides, smooth = _bends(nodes, facets)
    a, b = sides[:, smooth]
    corner = np.arange(f * c).reshape(f, c)
    which, k, m = np.nonzero(facets[a][:, :, None] == facets[b][:, None, :])
    pairs = np.column_stack([corner[a[which], k], corner[b[which], m]])
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(f * c, f * c))
    count, point = connected_components(graph, directed=False)
    at = np.zeros(count, dtype=np.int64)
    at[point] = facets.ravel()
    return ShadedSurface(point.reshape(f, c).astype(np.int64), at)


def sharp_edges(nodes: Array, facets: Integers) -> Integers:
    """Edges (e, 2) of a surface in space where it ends or bends by more than 30 degrees."""
    ends, inner, _, smooth = _bends(nodes, facets)
    sharp = ~inner
    sharp[inner] = ~smooth
    return ends[sharp]


def borders(facets: Integers, owner: Integers) -> Integers:
    """Edges (e, 2) between the patches of facets, which have owners, and around them."""
    ends, facet = edges_around(facets)
    rows, _, count = numbered_rows(np.column_stack([ends, owner[facet]]))
    return np.unique(rows[count == 1, :2], axis=0)


def _bends(
    nodes: Array, facets: Integers
) -> tuple[Integers, NDArray[np.bool_], Integers, NDArray[np.bool_]]:
    """Edges (e, 2) of a surface, flags (e,) of those between two facets, and of these the facets
    (2, i) and flags (i,): True where the surface is smooth.
    """
    pairs, facet = edges_around(facets)
    ends, number, count = numbered_rows(pairs)
    inner = count == 2
    start = (np.cumsum(count) - count)[inner]
    sides = facet[np.argsort(number, kind="stable")][np.stack([start, start + 1])]
    normals = facet_vectors(nodes, facets)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    first, second = normals[sides]
    return ends, inner, sides, (first * second).sum(axis=1) >= _SHARP
