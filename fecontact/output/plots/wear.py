"""Plots of the worn profile of a contact face."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.units import suitable_unit
from fecontact.integrate.wear import WearHistory
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PROFILES = 6  # drawn, the first and the last among them


def plot_wear(history: WearHistory, *, path: str | Path | None = None) -> "Figure":
    """Plot the worn profile and the line load along the face, and the depth over the cycles.

    Parameters
    ----------
    history : WearHistory
        Of :func:`fecontact.integrate.wear_history`.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from matplotlib import colormaps

    require_kind("plot_wear", WearHistory, history=history)
    x, length, blocks = history.x, history.tributary, len(history.cycles) - 1
    order = np.argsort(x)
    edges = np.append(x[order] - 0.5 * length[order], x[order][-1] + 0.5 * length[order][-1])
    unit, symbol = suitable_unit(float(np.abs(edges).max()), "m")
    depth_unit, depth_symbol = suitable_unit(float(history.depth.max()), "m")
    load_unit, load_symbol = suitable_unit(float(np.abs(history.line_load).max()), "N/m")
    shown = np.unique(np.linspace(1, blocks, _PROFILES).round().astype(int))
    with new_figure(9.0, 8.0, path) as figure:
        profile, load, growth = figure.subplots(3, 1)
        for k in shown:
            colour = colormaps["viridis"](0.9 * (1.0 - k / blocks))
            label = f"{history.cycles[k]:.6g} cycles"
            profile.stairs(-history.depth[k][order] / depth_unit, edges / unit, baseline=None,
                           color=colour, label=label, linewidth=1.5)
            load.stairs(history.line_load[k - 1][order] / load_unit, edges / unit, baseline=None,
                        color=colour, linewidth=1.5)
        profile.axhline(0.0, color="#303030", linewidth=0.8)
        profile.set_ylabel(f"worn profile [{depth_symbol}]")
        profile.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        load.set_ylabel(f"line load [{load_symbol}]")
        load.set_ylim(bottom=0.0)
        load.set_xlabel(f"contact position x [{symbol}]")
        area = length / length.sum()
        for values, name, colour in ((history.depth.max(axis=1), "largest", COLOURS[1]),
                                     (history.depth @ area, "mean", COLOURS[0])):
            growth.plot(history.cycles, values / depth_unit, color=colour, label=name)
        growth.set_xlabel("cycles")
        growth.set_ylabel(f"worn depth [{depth_symbol}]")
        growth.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        profile.set_title(f"{type(history.law).__name__}, {history.acceleration:.4g} cycles per "
                          f"computed period")
        figure.align_ylabels([profile, load, growth])
    return figure
