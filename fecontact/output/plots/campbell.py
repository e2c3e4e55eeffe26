"""Plot of a Campbell diagram."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.analysis.campbell import CampbellDiagram
from fecontact.core.checks import require_kind
from fecontact.output.diagrams.colours import COLOURS, INK, distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.plots.drawing import draw
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_campbell(
    diagram: CampbellDiagram, *, orders: Sequence[float] = (), path: str | Path | None = None
) -> "Figure":
    """Plot frequencies over the speed of rotation, with lines of excitation by engine orders.

    Dots mark where an order meets a frequency, thick parts of a line that its mode grows.

    Parameters
    ----------
    diagram : CampbellDiagram
        Result of :func:`fecontact.analysis.campbell`.
    orders : sequence of float
        Engine orders: a force at rest with so many waves around the circumference.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, a negative order, or a file that cannot be written.
    """
    require_kind("plot_campbell", CampbellDiagram, diagram=diagram)
    require_kind("plot_campbell", (Sequence, np.ndarray), orders=orders)
    speeds, hertz = diagram.speeds, diagram.frequencies_hz
    growing = diagram.damping_ratios < -1e-6
    top = 1.05 * float(hertz.max(initial=0.0)) or 1.0
    curves = []
    for column, colour in enumerate(distinct_colours(hertz.shape[1])):
        curves.append(Curve("", colour, speeds, hertz[:, column]))
        if growing[:, column].any():
            curves.append(Curve("", colour, speeds, np.where(
                growing[:, column], hertz[:, column], np.nan), 4.0))
    for order in orders:
        critical = diagram.critical_speeds(order)
        curves += [Curve("", COLOURS[6], speeds, order * speeds / (2.0 * np.pi), 0.9,
                         dashed=True),
                   Curve("", INK, critical, order * critical / (2.0 * np.pi), 0.0, 4.0)]
    shown = Diagram("speed [rad/s]", "frequency [Hz]", tuple(curves),
                    x_limits=(speeds[0], speeds[-1]), y_limits=(0.0, top))
    with new_figure(8.0, 5.2, path) as figure:
        axis = figure.subplots()
        draw(axis, shown)
        for order in orders:
            end = min(float(speeds[-1]), 2.0 * np.pi * top / order) if order > 0.0 else speeds[-1]
            axis.annotate(f"{order:g}", (end, order * end / (2.0 * np.pi)), xytext=(3, 3),
                          textcoords="offset points", fontsize=9.0, color=COLOURS[6])
        minute = axis.secondary_xaxis("top", functions=(
            lambda x: np.multiply(x, 30.0 / np.pi), lambda x: np.multiply(x, np.pi / 30.0)))
        minute.set_xlabel("speed [1/min]")
    return figure
