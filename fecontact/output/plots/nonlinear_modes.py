"""Nonlinear modes and their resonances: frequency and damping over the amplitude."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.output.plots.bifurcation_diagram import SPECIAL, runs_of, stable_pieces
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.parameter_labels import name_axis
from fecontact.output.plots.style import DASHES, distinct_colours

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DARK = "#303030"


def plot_nonlinear_mode(
    modes: NonlinearMode | Sequence[NonlinearMode], *, names: Sequence[str] = (),
    logarithmic: bool = True, path: str | Path | None = None,
) -> "Figure":
    """Plot nonlinear modes: frequency above, damping ratio below, over the amplitude.

    Where all modes are conservative, their energy stands below instead. Unstable motions of these
    are dashed; points where modes meet are marked.

    Parameters
    ----------
    modes : NonlinearMode or sequence of NonlinearMode
        What :func:`fecontact.bifurcation.nonlinear_mode` found, of the same observed displacement.
    names : sequence of str, optional
        For the legend, one for each mode; several modes are numbered by default.
    logarithmic : bool
        Whether the amplitude has a logarithmic axis.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        Without modes, for modes of different displacements, another number of names, another
        suffix, or a file that cannot be written.
    """
    given = [modes] if isinstance(modes, NonlinearMode) else list(modes)
    for mode in given:
        require_kind("plot_nonlinear_mode", NonlinearMode, mode=mode)
    labels = _labels(given, names)
    lossless = all(mode.conservative for mode in given)
    with new_figure(9.0, 6.4, path) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
        marked: dict[str, None] = {}
        dashed = False
        colours = distinct_colours(len(given))
        for mode, colour in zip(given, colours, strict=True):
            stable = stable_pieces(mode.branch)
            dashed |= not stable.all()
            curves = (mode.frequency, _below(mode, lossless))
            for panel, curve in zip((upper, lower), curves, strict=True):
                for first, last in runs_of(stable):
                    panel.plot(mode.amplitude[first : last + 1], curve[first : last + 1],
                               color=colour, linewidth=1.8 if stable[first] else 1.2,
                               linestyle="-" if stable[first] else DASHES)
            for place, point in enumerate(mode.branch.points):
                if point.kind is not None:
                    marked.setdefault(point.kind)
                    upper.plot(mode.amplitude[place], curves[0][place],
                               SPECIAL.get(point.kind, ("", "."))[1], color=_DARK,
                               markerfacecolor="white", markersize=6.0, zorder=4)
        if logarithmic:
            lower.set_xscale("log")
        upper.margins(x=0.02)
        frequencies = np.concatenate([mode.frequency for mode in given])
        name_axis(upper, "y", "frequency [Hz]", frequencies)
        if lossless:
            lower.set_yscale("log")
            lower.set_ylabel("energy [J]")
        else:
            lower.set_ylabel("damping ratio")
            if all((mode.damping_ratio >= 0.0).all() for mode in given):
                lower.set_ylim(bottom=0.0)
        unit = "rad" if given[0].observed.split()[-1].startswith("phi") else "m"
        name_axis(lower, "x", f"amplitude of {given[0].observed} [{unit}]",
                  np.concatenate([mode.amplitude for mode in given]))
        _legend(upper, labels, colours, list(marked), dashed)
    return figure


def _below(mode: NonlinearMode, lossless: bool) -> Any:
    return mode.energy if lossless else mode.damping_ratio


def _labels(modes: list[NonlinearMode], names: Sequence[str]) -> list[str]:
    """Names for the legend; none for a single mode."""
    if not modes:
        raise InputError("plot_nonlinear_mode: there are no modes; give at least one.")
    if len({mode.observed for mode in modes}) > 1:
        raise InputError(f"plot_nonlinear_mode: the amplitudes are those of "
                         f"{', '.join(dict.fromkeys(mode.observed for mode in modes))}; give modes "
                         f"that observe the same displacement.")
    if names and len(names) != len(modes):
        raise InputError(f"plot_nonlinear_mode: {len(names)} names do not go with {len(modes)} "
                         f"modes; give one for each.")
    if names:
        return [str(name) for name in names]
    return [f"mode {mode.number}" for mode in modes] if len(modes) > 1 else []


def _legend(
    axis: Any, labels: list[str], colours: list[str], kinds: list[str], dashed: bool
) -> None:
    from matplotlib.lines import Line2D

    handles: list[Any] = [Line2D([], [], color=colour, linewidth=1.8, label=label)
                          for label, colour in zip(labels, colours, strict=False)]
    if dashed:
        handles += [Line2D([], [], color=_DARK, linewidth=1.8, label="stable"),
                    Line2D([], [], color=_DARK, linewidth=1.2, linestyle=DASHES,
                           label="unstable")]
    handles += [Line2D([], [], color=_DARK, marker=SPECIAL.get(kind, ("", "."))[1],
                       markerfacecolor="white", linestyle="none", markersize=6.0, label=kind)
                for kind in kinds]
    if handles:
        axis.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0))
