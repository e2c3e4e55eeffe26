"""Nonlinear modes and their resonances: frequency and damping over the amplitude."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.bifurcation.nonlinear_modes.resonance_curve import ResonanceCurve
from fecontact.core.checks import as_several
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.output.plots.bifurcation_diagram import SPECIAL, runs_of, stable_pieces
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.parameter_labels import branch_label, name_axis
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
        Result of :func:`fecontact.bifurcation.nonlinear_mode`, of the same observed displacement.
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
    given = as_several(modes, NonlinearMode, "plot_nonlinear_mode", "modes")
    labels = _labels(given, names)
    lossless = all(mode.conservative for mode in given)
    with new_figure(9.0, 6.4, path) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
        colours = distinct_colours(len(given))
        drawn = [_drawn((upper, lower), mode.branch, mode.amplitude,
                        (mode.frequency_hz, _below(mode, lossless)), colour)
                 for mode, colour in zip(given, colours, strict=True)]
        if logarithmic:
            lower.set_xscale("log")
        upper.margins(x=0.02)
        frequencies = np.concatenate([mode.frequency_hz for mode in given])
        name_axis(upper, "y", "frequency [Hz]", frequencies)
        if lossless:
            lower.set_yscale("log")
            lower.set_ylabel("energy [J]")
        else:
            lower.set_ylabel("damping ratio")
            if all((mode.damping_ratio >= 0.0).all() for mode in given):
                lower.set_ylim(bottom=0.0)
        name_axis(lower, "x", f"amplitude of {given[0].observed} [{_unit(given[0].observed)}]",
                  np.concatenate([mode.amplitude for mode in given]))
        _legend(upper, labels, colours, drawn)
    return figure


def plot_resonance_curve(
    curves: ResonanceCurve | Sequence[ResonanceCurve], *, names: Sequence[str] = (),
    path: str | Path | None = None,
) -> "Figure":
    """Plot resonances over a parameter: amplitude above, frequency below.

    Resonances that are unstable are dashed; extrema of the amplitude and folds are marked.

    Parameters
    ----------
    curves : ResonanceCurve or sequence of ResonanceCurve
        Result of :func:`fecontact.bifurcation.resonance_curve`, over the same parameter.
    names : sequence of str, optional
        For the legend, one for each curve.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        Without curves, for curves over different parameters, another number of names, another
        suffix, or a file that cannot be written.
    """
    given = as_several(curves, ResonanceCurve, "plot_resonance_curve", "curves")
    if not given:
        raise InputError("plot_resonance_curve: there are no curves; give at least one.")
    over = dict.fromkeys(curve.parameter_name for curve in given)
    if len(over) > 1:
        raise InputError(f"plot_resonance_curve: the curves run over {', '.join(over)}; give "
                         f"curves over the same parameter.")
    if names and len(names) != len(given):
        raise InputError(f"plot_resonance_curve: {len(names)} names do not go with {len(given)} "
                         f"curves; give one for each.")
    with new_figure(9.0, 6.4, path) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
        colours = distinct_colours(len(given))
        drawn = [_drawn((upper, lower), curve.branch, curve.parameter,
                        (curve.amplitude, curve.frequency_hz), colour)
                 for curve, colour in zip(given, colours, strict=True)]
        upper.set_ylim(bottom=0.0)
        upper.margins(x=0.02)
        name_axis(upper, "y", f"amplitude of {given[0].observed} [{_unit(given[0].observed)}]",
                  np.concatenate([curve.amplitude for curve in given]))
        name_axis(lower, "y", "frequency [Hz]",
                  np.concatenate([curve.frequency_hz for curve in given]))
        name_axis(lower, "x", branch_label(given[0].branch),
                  np.concatenate([curve.parameter for curve in given]))
        _legend(upper, list(names), colours, drawn)
    return figure


def _drawn(
    panels: tuple[Any, Any], branch: Branch, x: Array, curves: tuple[Any, Any], colour: str
) -> tuple[dict[str, None], bool]:
    """Draw a branch into both panels; kinds of its points, and whether a part is unstable."""
    stable = stable_pieces(branch)
    for panel, curve in zip(panels, curves, strict=True):
        for first, last in runs_of(stable):
            panel.plot(x[first : last + 1], curve[first : last + 1], color=colour,
                       linewidth=1.8 if stable[first] else 1.2,
                       linestyle="-" if stable[first] else DASHES)
    special = {place: point.kind for place, point in enumerate(branch.points) if point.kind}
    for place, kind in special.items():
        panels[0].plot(x[place], curves[0][place], _marker(kind), color=_DARK,
                       markerfacecolor="white", markersize=6.0, zorder=4)
    return dict.fromkeys(special.values()), not stable.all()


def _marker(kind: str) -> str:
    return "o" if kind == "extremum" else SPECIAL.get(kind, ("", "."))[1]


def _unit(observed: str) -> str:
    return "rad" if observed.split()[-1].startswith("phi") else "m"


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
    axis: Any, labels: list[str], colours: list[str], drawn: list[tuple[dict[str, None], bool]]
) -> None:
    from matplotlib.lines import Line2D

    handles: list[Any] = [Line2D([], [], color=colour, linewidth=1.8, label=label)
                          for label, colour in zip(labels, colours, strict=False)]
    if any(dashed for _, dashed in drawn):
        handles += [Line2D([], [], color=_DARK, linewidth=1.8, label="stable"),
                    Line2D([], [], color=_DARK, linewidth=1.2, linestyle=DASHES,
                           label="unstable")]
    handles += [Line2D([], [], color=_DARK, marker=_marker(kind), markerfacecolor="white",
                       linestyle="none", markersize=6.0, label=kind)
                for kind in dict.fromkeys(kind for kinds, _ in drawn for kind in kinds)]
    if handles:
        axis.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0))
