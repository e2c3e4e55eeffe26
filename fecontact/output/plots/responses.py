"""Nonlinear frequency responses, nonlinear modes and their resonances."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.harmonic.response import FrequencyResponse
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.bifurcation.nonlinear_modes.resonance_curve import ResonanceCurve
from fecontact.core.checks import as_several, require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.output.diagrams.branches import (
    mode_diagrams,
    resonance_diagrams,
    response_diagrams,
)
from fecontact.output.plots.drawing import draw_stacked
from fecontact.output.plots.figure import new_figure

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
    with new_figure(9.0, 6.4, path) as figure:
        _, lower = draw_stacked(figure, response_diagrams(
            response, logarithmic=logarithmic, y_label=y_label, usable_hz=usable_hz), (2.2, 1.0))
        if len(ticks := _degrees(lower.get_ylim())) > 1:
            lower.set_yticks(ticks)
    return figure


def _degrees(limits: tuple[float, float]) -> Array:
    """Multiples of 45 or 90 degrees within the limits of an axis."""
    step = 45.0 if limits[1] - limits[0] < 300.0 else 90.0
    return np.arange(np.ceil(limits[0] / step), np.floor(limits[1] / step) + 1.0) * step


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
    given, labels = named_curves(
        "plot_nonlinear_mode", NonlinearMode, {"modes": modes}, names, "observed",
        "observe {}; give modes of the same displacement")
    if not names and len(given) > 1:
        labels = [f"mode {mode.number}" for mode in given]
    diagrams = mode_diagrams(given, labels, logarithmic=logarithmic)
    with new_figure(9.0, 6.4, path) as figure:
        draw_stacked(figure, diagrams, (1.4, 1.0))
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
    given, labels = named_curves(
        "plot_resonance_curve", ResonanceCurve, {"curves": curves}, names, "parameter_name",
        "run over {}; give curves over the same parameter")
    with new_figure(9.0, 6.4, path) as figure:
        draw_stacked(figure, resonance_diagrams(given, labels), (1.4, 1.0))
    return figure


def named_curves(
    owner: str, kind: type, values: Mapping[str, Any], names: Sequence[str], alike: str, differ: str
) -> tuple[list[Any], list[str]]:
    """One or several curves of a plot, and the name of each; no names if none are given.

    Parameters
    ----------
    owner : str
        Function that is given them, for messages.
    kind : type
        Class of the curves.
    values : mapping
        The argument by its name.
    names : sequence of str
        Names for the legend.
    alike : str
        Attribute in which all must agree.
    differ : str
        Message on curves that do not, with ``{}`` for the values of this attribute.

    Raises
    ------
    InputError
        Without curves, for curves that do not agree, or another number of names.
    """
    (what, found), = values.items()
    given = as_several(found, kind, owner, what)
    if not given:
        raise InputError(f"{owner}: there are no {what}; give at least one.")
    if len(several := dict.fromkeys(str(getattr(one, alike)) for one in given)) > 1:
        raise InputError(f"{owner}: the {what} {differ.format(', '.join(several))}.")
    if names and len(names) != len(given):
        raise InputError(f"{owner}: {len(names)} names do not go with {len(given)} {what}; give "
                         f"one for each.")
    return given, list(map(str, names))
