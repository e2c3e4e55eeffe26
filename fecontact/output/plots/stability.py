"""Plots of eigenvalues over a parameter, and of stability maps."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.output.diagrams.branches import eigenvalue_diagrams
from fecontact.output.diagrams.colours import INK
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.diagrams.maps import stability_maps, zero_lines
from fecontact.output.plots.drawing import colour_bar, draw
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
        unstable, growth = (found.unstable > 0).T, found.growth_rate.T
        lines = [np.column_stack([border.column(name) for name in found.names])
                 for border in borders] or (
            zero_lines(found.first, found.second, growth)
            if 0 < unstable.sum() < unstable.size else [])
        diagram = Diagram(
            x_label or found.labels[0], y_label or found.labels[1],
            tuple(Curve("", INK, line[:, 0], line[:, 1], 1.4) for line in lines),
            maps=stability_maps(found))
        image = draw(axis, diagram)[0]
        colour_bar(image, diagram.maps[0], axis)
        inside = np.argwhere(~unstable & (found.unstable >= 0).T)
        if len(inside):
            centre = inside[np.argmin(((inside - inside.mean(axis=0)) ** 2).sum(axis=1))]
            axis.text(found.first[centre[1]], found.second[centre[0]], "stable", ha="center",
                      va="center")
    return figure
