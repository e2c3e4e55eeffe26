"""Plot of the modal assurance of two sets of modes."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.measured.assurance import ModePairs
from fecontact.output.diagrams.diagram import Diagram
from fecontact.output.diagrams.maps import Map, Scale
from fecontact.output.plots.drawing import colour_bar, draw
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WRITTEN = 24  # modes of both sets up to which values are written into the fields


def plot_modal_assurance(pairs: ModePairs, *, path: str | Path | None = None) -> "Figure":
    """Plot the modal assurance of modes of a test and of a model, with frames around the pairs.

    Parameters
    ----------
    pairs : ModePairs
        Result of :func:`fecontact.measured.pair_modes`.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_modal_assurance", ModePairs, pairs=pairs)
    rows, columns = pairs.assurance.shape
    with new_figure(2.6 + 0.55 * min(columns, 20), 2.0 + 0.45 * min(rows, 20), path) as figure:
        axis = figure.subplots()
        shown = Map(np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5, pairs.assurance,
                    Scale("modal assurance", "Blues", low=0.0, high=1.0))
        (image,) = draw(axis, Diagram("model [Hz]", "test [Hz]", maps=(shown,)))
        for row, column in zip(pairs.tested, pairs.computed, strict=True):
            axis.plot(column + np.array([-0.5, 0.5, 0.5, -0.5, -0.5]),
                      row + np.array([-0.5, -0.5, 0.5, 0.5, -0.5]), color="#d55e00", linewidth=1.6)
        if max(rows, columns) <= _WRITTEN:
            for (row, column), value in np.ndenumerate(pairs.assurance):
                if value >= 0.05:
                    axis.text(column, row, f"{value:.2f}", ha="center", va="center", fontsize=8.0,
                              color="white" if value > 0.6 else "#303030")
        axis.set_xticks(range(columns), [f"{f:.4g}" for f in pairs.computed_frequencies],
                        rotation=60.0 if columns > 8 else 0.0)
        axis.set_yticks(range(rows), [f"{f:.4g}" for f in pairs.tested_frequencies])
        colour_bar(image, shown, axis)
    return figure
