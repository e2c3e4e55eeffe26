"""Maps of basins of attraction."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.types import ArrayLike
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.parameter_labels import name_axis
from fecontact.output.plots.style import distinct_colours

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fecontact.bifurcation.attractors.basins import Basins

_UNSETTLED = "#ffffff"


def plot_basins(
    found: "Basins", *, x_label: str | None = None, y_label: str | None = None,
    rows: ArrayLike | None = None, path: str | Path | None = None,
) -> "Figure":
    """Plot the basins of attraction, each with its share of the plane.

    Parameters
    ----------
    found : Basins
        Of :func:`fecontact.bifurcation.basins`; the first axis goes along x.
    x_label, y_label : str, optional
        Labels of the axes, with SI units, such as ``y [m]``; ticks are in a unit that suits the
        values.
    rows : (2, size) array, optional
        Rows that give the two quantities of the plane from a state
        (:meth:`fecontact.bifurcation.Axis.row`); with them the sections of the
        motions are marked.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    from fecontact.bifurcation.attractors.basins import Basins

    require_kind("plot_basins", Basins, found=found)
    with new_figure(8.0, 5.2, path) as figure:
        axis = figure.subplots()
        count = len(found.attractors)
        colours = [_UNSETTLED, *distinct_colours(count)]
        axis.pcolormesh(found.first, found.second, found.label.T, shading="nearest", alpha=0.75,
                        cmap=ListedColormap(colours), rasterized=True,
                        norm=BoundaryNorm(np.arange(-1.5, count + 0.5), count + 1))
        box = axis.get_xlim(), axis.get_ylim()
        handles: list[Line2D | Patch] = [
            Patch(color=colours[k + 1], alpha=0.75, label=f"{_described(one.kind, one.points)}, "
                                                          f"{100.0 * one.share:.3g} %")
            for k, one in enumerate(found.attractors)]
        lost = float((found.label < 0).mean())
        if lost:
            handles.append(Patch(facecolor=_UNSETTLED, edgecolor="#8a8a8a",
                                 label=f"no end, {100.0 * lost:.3g} %"))
        if rows is not None:
            chosen = np.asarray(rows, dtype=float)
            for k, one in enumerate(found.attractors):
                places = one.points @ chosen.T
                axis.plot(places[:, 0], places[:, 1], "o", color=colours[k + 1], markersize=6.0,
                          markeredgecolor="#202020", linestyle="none")
            handles.append(Line2D([], [], color="#ffffff", marker="o", markeredgecolor="#202020",
                                  linestyle="none", label="its section"))
        axis.set(xlim=box[0], ylim=box[1])
        name_axis(axis, "x", x_label or "", found.first)
        name_axis(axis, "y", y_label or "", found.second)
        axis.grid(False)
        axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _described(kind: str, points: np.ndarray) -> str:
    return f"{kind}, {len(points)} points" if kind == "periodic" and len(points) > 1 else kind
