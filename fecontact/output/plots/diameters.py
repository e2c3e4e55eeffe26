"""Plot of the frequencies of a wheel over its nodal diameters."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_finite
from fecontact.output.diagrams.colours import COLOURS, distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.plots.drawing import draw
from fecontact.output.plots.figure import new_figure
from fecontact.reduction.sector_modes import SectorModes

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_diameters(
    found: SectorModes, *, speed: float | None = None, path: str | Path | None = None
) -> "Figure":
    """Plot the frequencies of a wheel over its nodal diameters: the SAFE diagram.

    With a speed, a zigzag line shows excitation by forces at rest in space: engine order m has the
    frequency m times the speed, and acts on the diameter to which m folds, m or N - m up to N, and
    so on. Modes near its corners resonate. Of modes with rotation the frequencies are those at this
    speed, of waves that travel forwards and backwards in the rotating frame.

    Parameters
    ----------
    found : SectorModes
        Result of :func:`fecontact.reduction.sector_modes`.
    speed : float, optional
        Speed of rotation other than zero [rad/s]; positive from sector s to s + 1.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a speed that is zero or not finite, another suffix, or a file that cannot be written.
    """
    require_kind("plot_diameters", SectorModes, found=found)
    if speed is not None:
        require_finite("plot_diameters", speed=speed)
        if speed == 0.0:
            raise InputError("plot_diameters: speed = 0 has no engine orders; leave it out for the "
                             "frequencies at rest.")
    ways = {"": found.frequencies_hz}
    if speed is not None and found.rotation is not None:
        ways = dict(zip(("forwards", "backwards"), found.rotation.frequencies_hz(speed),
                        strict=True))
    top = 1.05 * max(float(np.nanmax(hertz, initial=0.0)) for hertz in ways.values()) or 1.0
    curves = [Curve(way * (column == 0), colour, np.array(found.diameters), hertz[:, column], 0.9,
                    6.0, dashed=way == "backwards")
              for way, hertz in ways.items()
              for column, colour in enumerate(distinct_colours(hertz.shape[1]))]
    if speed is not None:
        N = found.symmetry.sectors
        orders = np.arange(int(2.0 * np.pi * top / abs(speed)) + 2)
        folded = np.abs((orders + N // 2) % N - N // 2)
        curves.append(Curve(f"engine orders at {speed:g} rad/s", COLOURS[6], folded,
                            np.asarray(orders * abs(speed) / (2.0 * np.pi)), 0.9, 2.0,
                            dashed=True))
    diagram = Diagram("nodal diameter", "frequency [Hz]", tuple(curves), y_limits=(0.0, top))
    with new_figure(7.0, 5.0, path) as figure:
        axis = figure.subplots()
        draw(axis, diagram)
        if speed is not None:
            axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
        axis.set_xticks(found.diameters if len(found.diameters) <= 20 else found.diameters[::2])
    return figure
