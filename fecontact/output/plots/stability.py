"""Plots of eigenvalues over a parameter, and of stability maps."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.output.diagrams.branches import eigenvalue_diagrams
from fecontact.output.plots.drawing import draw, name_axis
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.bifurcation.equilibria.stability_map import StabilityMap


def plot_eigenvalues(
    branch: "Branch", *, x_label: str | None = None,
    range_hz: tuple[float, float] = (0.0, np.inf), path: str | Path | None = None,
) -> "Figure":
    """Plot frequencies [Hz] and growth rates [1/s] of all modes over the parameter of a branch.

    As in the analysis of brake squeal: where two frequencies merge and a growth rate becomes
    positive, modes couple to flutter.

    Parameters
    ----------
    branch : Branch
        Branch of equilibria.
    x_label : str, optional
        Label of the parameter, with its SI unit; ticks are in a unit that suits the values.
    range_hz : (float, float)
        Modes that are never in this range, and Hopf points outside it, are left out.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        If the branch stores no eigenvalues, for another suffix, or a file that cannot be written.
    """
    from fecontact.bifurcation.continuation.branch import Branch

    require_kind("plot_eigenvalues", Branch, branch=branch)
    with new_figure(8.0, 6.4, path) as figure:
        upper, lower = panels = figure.subplots(2, 1, sharex=True)
        for panel, diagram in zip(panels, eigenvalue_diagrams(branch, range_hz, x_label),
                                  strict=True):
            draw(panel, diagram)
        upper.set_xlabel("")
        for point in branch.of_kind("Hopf"):
            if range_hz[0] <= point.frequency_hz <= range_hz[1]:
                upper.annotate(f"{point.frequency_hz:.4g} Hz",
                               (point.parameter, point.frequency_hz), xytext=(6, 6),
                               textcoords="offset points", fontsize=9.0)
        figure.align_ylabels([upper, lower])
    return figure


def plot_stability_map(
    found: "StabilityMap", *, borders: "Sequence[Branch]" = (), x_label: str | None = None,
    y_label: str | None = None, path: str | Path | None = None,
) -> "Figure":
    """Plot where an equilibrium is unstable, coloured by the frequency of its fastest growing mode.

    Parameters
    ----------
    found : StabilityMap
        The first parameter goes along x.
    borders : sequence of Branch
        Curves of :func:`fecontact.bifurcation.codim2_curve` over the same parameters, drawn
        instead of the border interpolated from the map.
    x_label, y_label : str, optional
        Labels of the parameters, with their SI units; ticks are in units that suit the values.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from fecontact.bifurcation.equilibria.stability_map import StabilityMap

    require_kind("plot_stability_map", StabilityMap, found=found)
    with new_figure(7.4, 5.2, path) as figure:
        axis = figure.subplots()
        unstable = (found.unstable > 0).T
        hertz = np.ma.masked_where(~unstable, found.frequency_hz.T)
        axis.set_facecolor("#f4f2ee")
        low, high = (float(hertz.min()), float(hertz.max())) if hertz.count() else (0.0, 1.0)
        image = axis.pcolormesh(found.first, found.second, hertz, cmap="viridis", shading="nearest",
                                vmin=low, vmax=high if high > low else low + 1e-3 * max(low, 1.0))
        figure.colorbar(image, ax=axis, pad=0.02,
                        label="frequency of the fastest growing mode [Hz]")
        growth = found.growth_rate.T
        for border in borders:
            axis.plot(*(border.column(name) for name in found.names), color="#303030",
                      linewidth=1.4)
        if not borders and 0 < unstable.sum() < unstable.size and min(growth.shape) > 1:
            axis.contour(found.first, found.second, growth, levels=[0.0], colors="#303030",
                         linewidths=1.4)
        if (found.unstable < 0).any():
            axis.pcolormesh(found.first, found.second,
                            np.ma.masked_where((found.unstable >= 0).T, np.ones(unstable.shape)),
                            cmap="Greys", vmin=0.0, vmax=2.0, shading="nearest")
        inside = np.argwhere(~unstable & (found.unstable >= 0).T)
        if len(inside):
            centre = inside[np.argmin(((inside - inside.mean(axis=0)) ** 2).sum(axis=1))]
            axis.text(found.first[centre[1]], found.second[centre[0]], "stable", ha="center",
                      va="center")
        name_axis(axis, "x", x_label or found.labels[0], found.first)
        name_axis(axis, "y", y_label or found.labels[1], found.second)
        axis.grid(False)
    return figure
