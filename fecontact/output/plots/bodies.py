"""Deformed bodies in figures, plane ones and the surfaces of solids, coloured by a quantity."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from fecontact.core.types import Array
from fecontact.fem.faces.surface import as_triangles
from fecontact.output.plots.solids.surface import draw_surface, view_axes
from fecontact.reduction.mode_shapes import BodyPart

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRAWN_DISPLACEMENT = 0.07  # largest one by default, relative to the extent of the bodies


def in_picture(places: Array) -> Array:
    """Places (..., 2) in the picture [m] of places (..., d); solids are seen from one side."""
    return places if places.shape[-1] == 2 else places @ view_axes()[:2].T


def draw_body(
    axes: "Axes", body: Any, places: Array, values: Array, *, cmap: str, low: float, high: float,
    parts: Sequence[BodyPart] = (),
) -> Any:
    """Draw bodies at places (N, d) of their nodes, coloured by values (N,), and their outlines.

    ``body`` has nodes (N, d), first-order cells and an outline at rest, which is drawn in grey. Of
    several plane bodies, ``parts``, those of zeros lie below the others. Returns what a colour bar
    takes.
    """
    if body.nodes.shape[1] == 3:
        return draw_surface(axes, places, body.outline, values, rest=body.nodes, cmap=cmap, low=low,
                            high=high)
    from matplotlib.collections import LineCollection
    from matplotlib.tri import Triangulation

    ranges = [(part.nodes[0], sum(part.nodes)) for part in parts] or [(0, len(places))]
    for first, end in sorted(ranges, key=lambda one: bool(values[slice(*one)].any())):
        cells = body.cells[(first <= body.cells[:, 0]) & (body.cells[:, 0] < end)]
        if len(cells):
            drawn = axes.tripcolor(
                Triangulation(places[:, 0], places[:, 1], as_triangles(cells)), values,
                shading="gouraud", cmap=cmap, vmin=low, vmax=high, rasterized=True)
    for nodes, colour in ((body.nodes, "#8c8c8c"), (places, "#303030")):
        axes.add_collection(LineCollection(list(nodes[body.outline]), colors=colour, clip_on=False,
                                           linewidths=0.8))
    return drawn
