"""Bifurcation diagrams."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import as_texts, require_kind
from fecontact.core.errors import InputError, shown
from fecontact.output.diagrams.branches import Quantity, branch_diagram, value_at
from fecontact.output.diagrams.colours import DOTS, distinct_colours
from fecontact.output.plots.diagram_insets import (
    draw_insets,
    main_axis,
    place_labels,
    scan_curves,
)
from fecontact.output.plots.drawing import draw, legend_entries
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.output.plots.diagram_insets import Inset


def plot_branches(
    branches: "Branch | Sequence[Branch]", y: Quantity = 0, *,
    x: Quantity = "parameter", x_label: str | None = None, y_label: str | None = None,
    names: Sequence[str] = (), beneath: "PoincareScan | None" = None,
    observe: tuple[str | int, str] | str = ("B", "x"), insets: "Sequence[Inset]" = (),
    path: str | Path | None = None,
) -> "Figure":
    """Plot branches: stable parts solid, unstable ones dashed, special points marked and labelled.

    Parameters
    ----------
    branches : Branch or sequence of Branch
        Each gets its own colour, those of one name the same.
    y, x : str, int or callable
        Quantities of the axes: 'parameter', the name of a stored number, the number of a state from
        0 (of orbits its largest value), or a function of a
        :class:`fecontact.bifurcation.BranchPoint`. For y also 'observed_section' of
        :func:`fecontact.bifurcation.observe`, one curve for each period of the excitation.
    x_label, y_label : str, optional
        Labels of the axes, with SI units, such as ``amplitude [m]``; ticks are in a unit that
        suits the values.
    names : sequence of str
        Names of the branches for the legend, in which each name stands once; several branches
        without names are numbered there.
    beneath : PoincareScan, optional
        Runs over the same parameter, drawn as dots beneath the branches, up and down apart; y
        should be 'observed_section'.
    observe : (point, component) or str
        The displacement of the runs that is drawn, of a vector field a state; see
        :meth:`fecontact.bifurcation.PoincareScan.observed`.
    insets : sequence of Inset
        Phase planes of chosen points, drawn above the diagram; see
        :func:`fecontact.plot.phase_inset`. A letter names each and its point.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a quantity that is not stored, another suffix, or a file that cannot be written.
    """
    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.output.plots.diagram_insets import Inset

    require_kind("plot_branches", (Branch, Sequence), branches=branches)
    branches = [branches] if isinstance(branches, Branch) else list(branches)
    for branch in branches:
        require_kind("plot_branches", Branch, branch=branch)
    require_kind("plot_branches", (PoincareScan, type(None)), beneath=beneath)
    require_kind("plot_branches", Sequence, insets=insets)
    for inset in insets:
        require_kind("plot_branches", Inset, inset=inset)
    require_kind("plot_branches", (str, type(None)), x_label=x_label, y_label=y_label)
    names = as_texts(names, "plot_branches: names")
    for name, quantity in (("x", x), ("y", y)):
        if not (isinstance(quantity, str | int | np.integer) or callable(quantity)):
            raise InputError(f"plot_branches: {name} = {shown(quantity)} must be the name of a "
                             f"stored number, the number of a state, or a function of a point.")
    if not branches:
        raise InputError("branches = [] holds nothing to draw; give at least one Branch.")
    if len(branches) > 1:
        names = [*names, *(f"branch {k + 1}" for k in range(len(names), len(branches)))]
    named = list(names)[: len(branches)] or [""]
    # The colours of the runs are left out.
    apart = [colour for colour in distinct_colours(len(set(named)) + 1)
             if colour not in DOTS.values()]
    diagram = branch_diagram(branches, named, y, x, colours=apart, x_label=x_label,
                             y_label=y_label)
    diagram = replace(diagram, curves=(*scan_curves(beneath, observe), *diagram.curves))
    with new_figure(8.0, 7.2 if insets else 5.2, path) as figure:
        axis = main_axis(figure, insets)
        draw(axis, diagram)
        axis.margins(x=0.02, y=0.06)
        axis.autoscale_view()
        letters = draw_insets(figure, axis, insets, lambda at: (value_at(at, x), value_at(at, y)))
        if handles := legend_entries([diagram]):
            axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5))
        place_labels(figure, axis, [*letters, *((mark.letters, mark.x, mark.y)
                                                for mark in diagram.marks)])
    return figure
