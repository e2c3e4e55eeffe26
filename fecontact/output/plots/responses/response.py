"""Nonlinear frequency responses: amplitude and phase at several levels."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.harmonic.response import FrequencyResponse, amplitude_label
from fecontact.core.checks import require_kind
from fecontact.core.types import Array
from fecontact.core.units import has_prefixes, suitable_unit
from fecontact.output.plots.bifurcation_diagram import SPECIAL, runs_of, stable_pieces
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.parameter_labels import branch_label, name_axis
from fecontact.output.plots.style import (
    BEYOND,
    BEYOND_COLOUR,
    DASHES,
    distinct_colours,
    shaded_beyond,
)
from fecontact.system.parameter_labels import parameter_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_response(
    response: FrequencyResponse, *, logarithmic: bool = False, y_label: str | None = None,
    usable_hz: float = np.inf,
    path: str | Path | None = None,
) -> "Figure":
    """Plot a frequency response: amplitude and phase, a colour for each level.

    Above half the range of the observed quantity, or the force that holds it, below the phase of
    its first harmonic against a sine drive. Stable parts are solid, unstable ones dashed, special
    points marked.

    Parameters
    ----------
    response : FrequencyResponse
        Result of :func:`fecontact.bifurcation.frequency_response`.
    logarithmic : bool
        Whether the amplitude has a logarithmic axis.
    y_label : str, optional
        Label of the amplitude with its unit, such as ``amplitude [m]``; ticks are in a unit that
        suits the values.
    usable_hz : float
        Frequency up to which the basis is usable [Hz]; over frequency, what lies beyond is shaded.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_response", FrequencyResponse, response=response)
    label = branch_label(response.branches[0])
    with new_figure(9.0, 6.4, path) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        marked: dict[str, None] = {}
        dashed = False
        colours = distinct_colours(len(response.branches))
        for level, (branch, colour) in enumerate(zip(response.branches, colours, strict=True)):
            x, stable = branch.parameter, stable_pieces(branch)
            dashed |= not stable.all()
            curves = (drawn(response, level), np.degrees(response.phase(level)))
            for panel, curve in zip((upper, lower), curves, strict=True):
                for first, last in runs_of(stable):
                    panel.plot(x[first : last + 1], curve[first : last + 1], color=colour,
                               linewidth=1.8 if stable[first] else 1.2,
                               linestyle="-" if stable[first] else DASHES)
            for place, point in enumerate(branch.points):
                if point.kind is not None:
                    marked.setdefault(point.kind)
                    upper.plot(x[place], curves[0][place], SPECIAL.get(point.kind, ("", "."))[1],
                               color="#303030", markerfacecolor="white", markersize=6.0, zorder=4)
        if logarithmic:
            upper.set_yscale("log")
        else:
            upper.set_ylim(bottom=0.0)
        name_axis(upper, "y", y_label or drawn_label(response), _range(response))
        lower.set_ylabel("phase [°]")
        lower.set_yticks(_degrees(lower.get_ylim()))
        name_axis(lower, "x", label, np.array(lower.dataLim.intervalx))
        upper.margins(x=0.02)
        beyond = label.endswith("[Hz]") and shaded_beyond((upper, lower), usable_hz)
        _legend(upper, response, colours, list(marked), dashed, beyond)
    return figure


def level_texts(response: FrequencyResponse) -> tuple[str, list[str]]:
    """Name of the parameter of the levels, and their values in a unit that suits them."""
    levels, known = response.levels, response.branches[0].attributes
    label = str(known.get("level_label") or parameter_label(response.level_name or ""))
    words, _, unit = label.rpartition(" [")
    unit = unit.removesuffix("]") if words else ""
    factor, symbol = 1.0, unit
    if has_prefixes(unit):
        factor, symbol = suitable_unit(float(np.median(np.abs(levels))), unit)
    return words or label, [f"{level / factor:.4g} {symbol}".strip() for level in levels]


def drawn(response: FrequencyResponse, level: int) -> Array:
    """Amplitude (N,) over the parameter, or the force where the amplitude is held."""
    return response.amplitude(level) if response.force_name is None else response.force(level)


def drawn_label(response: FrequencyResponse) -> str:
    """Label of what is drawn over the parameter, with its unit."""
    if response.force_name is None:
        return amplitude_label(response.observed)
    return branch_label(response.branches[0], response.force_name)


def _range(response: FrequencyResponse) -> Array:
    return np.concatenate([drawn(response, level) for level in range(len(response.branches))])


def _degrees(limits: tuple[float, float]) -> Array:
    step = 45.0 if limits[1] - limits[0] < 300.0 else 90.0
    return np.arange(np.ceil(limits[0] / step), np.floor(limits[1] / step) + 1.0) * step


def _legend(
    axis: Any, response: FrequencyResponse, colours: list[str], kinds: list[str], dashed: bool,
    beyond: bool,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    if response.level_name:
        name, texts = level_texts(response)
        handles.append(Line2D([], [], linestyle="none", label=name))
        handles += [Line2D([], [], color=colour, linewidth=1.8, label=text)
                    for text, colour in zip(texts, colours, strict=True)]
    if dashed:
        handles += [Line2D([], [], color="#303030", linewidth=1.8, label="stable"),
                    Line2D([], [], color="#303030", linewidth=1.2, linestyle=DASHES,
                           label="unstable")]
    handles += [Line2D([], [], color="#303030", marker=SPECIAL.get(kind, ("", "."))[1],
                       markerfacecolor="white", linestyle="none", markersize=6.0, label=kind)
                for kind in kinds]
    if beyond:
        handles.append(Patch(color=BEYOND_COLOUR, label=BEYOND))
    if handles:
        axis.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0))
