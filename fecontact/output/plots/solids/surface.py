"""Surfaces of solids in figures: a parallel projection of their facets, the nearest drawn last."""

from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.output.files.contact_facets import facet_vectors
from fecontact.output.render.surfaces import sharp_edges

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# From where solids are seen, and where the light comes from, along x, y, z.
LOOK, _LIGHT = np.array([0.46, -0.80, 0.42]), np.array([-0.2, -0.55, 0.85])
_DARKEST = 0.62  # of a colour where no light falls
_TINY = np.finfo(float).tiny


def view_axes() -> Array:
    """Unit vectors (3, 3) of the picture: to the right, up, and towards the eye."""
    back = LOOK / np.linalg.norm(LOOK)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def draw_surface(
    axes: "Axes", places: Array, facets: Integers, values: Array, *, rest: Array,
    cmap: str, low: float, high: float,
) -> Any:
    """Draw facets (f, c) at places (N, 3), coloured by values (N,), with their sharp edges.

    ``rest`` (N, 3) are the places of the undeformed bodies, whose sharp edges are drawn in grey.
    Returns what a colour bar takes.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import Normalize

    right, up, back = view_axes()
    normals = facet_vectors(places, facets)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), _TINY)
    front = np.flatnonzero(normals @ back > 0.0)
    depth = places[facets[front]].mean(axis=1) @ back
    front = front[np.argsort(depth, kind="stable")]
    norm = Normalize(low, high)
    colours = colormaps[cmap](norm(values[facets[front]].mean(axis=1)))
    light = _LIGHT / np.linalg.norm(_LIGHT)
    shade = _DARKEST + (1.0 - _DARKEST) * np.clip(normals[front] @ light, 0.0, 1.0)
    colours[:, :3] *= shade[:, None]
    plane = np.stack([right, up], axis=1)
    flat = places @ plane
    axes.add_collection(PolyCollection(flat[facets[front]], facecolors=colours, edgecolors=colours,
                                       linewidths=0.35, rasterized=True))
    edges = sharp_edges(rest, facets)
    # Edges of facets that are seen; those behind the body stay hidden.
    shown = np.isin(_numbers(edges, len(rest)), _numbers(np.stack(
        [facets[front], np.roll(facets[front], -1, axis=1)], axis=2).reshape(-1, 2), len(rest)))
    axes.add_collection(LineCollection(list((rest @ plane)[edges[shown]]), colors="#b5b5b5",
                                       linewidths=0.6))
    axes.add_collection(LineCollection(list(flat[edges[shown]]), colors="#303030",
                                       linewidths=0.7))
    return ScalarMappable(norm, colormaps[cmap])


def _numbers(edges: Integers, count: int) -> Any:
    """One number for each edge, whichever way it goes."""
    ends = np.sort(edges, axis=1)
    return ends[:, 0] * count + ends[:, 1]


def draw_triad(axes: "Axes", size: float, corner: Array) -> None:
    """The axes x, y, z from a corner of the picture, ``size`` long [m]."""
    plane = view_axes()[:2]
    for axis, (name, colour) in enumerate(zip("xyz", ("#a03030", "#2f7d32", "#2b5ea8"),
                                              strict=True)):
        end = corner + size * plane[:, axis]
        axes.plot(*zip(corner, end, strict=True), color=colour, linewidth=1.4)
        x, y = (corner + 1.35 * (end - corner)).tolist()
        axes.text(x, y, name, ha="center", va="center", fontsize=8.5, color="#303030")
