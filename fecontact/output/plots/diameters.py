"""Plot of the frequencies of a wheel over its nodal diameters."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import require_positive
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import DASHES, distinct_colours
from fecontact.reduction.sector_modes import SectorModes

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_diameters(
    found: SectorModes, *, speed: float | None = None, path: str | Path | None = None
) -> "Figure":
    """Plot the frequencies of a wheel over its nodal diameters: the SAFE diagram.

    With a speed, a zigzag line shows excitation by forces at rest in space: engine order m has the
    frequency m times the speed, and acts on the diameter to which m folds, m or N - m up to N, and
    so on. Modes near its corners resonate.

    Parameters
    ----------
    found : SectorModes
        Result of :func:`fecontact.reduction.sector_modes`.
    speed : float, optional
        Speed of rotation, positive [rad/s].
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a speed that is not positive, another suffix, or a file that cannot be written.
    """
    require_kind("plot_diameters", SectorModes, found=found)
    if speed is not None:
        require_positive("plot_diameters", speed=speed)
    hertz = found.frequencies_hz
    with new_figure(7.0, 5.0, path) as figure:
        axis = figure.subplots()
        for column, colour in enumerate(distinct_colours(hertz.shape[1])):
            axis.plot(found.diameters, hertz[:, column], "o-", color=colour, linewidth=0.9)
        top = 1.05 * float(hertz.max(initial=0.0)) or 1.0
        if speed is not None:
            N = found.symmetry.sectors
            orders = np.arange(int(2.0 * np.pi * top / speed) + 2)
            folded = np.abs((orders + N // 2) % N - N // 2)
            axis.plot(folded, orders * speed / (2.0 * np.pi), color="#6a6a6a", marker=".",
                      linestyle=DASHES, linewidth=0.9, markersize=4.0,
                      label=f"engine orders at {speed:g} rad/s")
            axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
        axis.set(xlabel="nodal diameter", ylabel="frequency [Hz]", ylim=(0.0, top))
        axis.set_xticks(found.diameters if len(found.diameters) <= 20 else found.diameters[::2])
    return figure
