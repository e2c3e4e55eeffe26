"""Plot of frequency and damping over amplitude."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import as_several
from fecontact.core.errors import InputError
from fecontact.measured.amplitude_curve import AmplitudeCurve
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.parameter_labels import name_axis
from fecontact.output.plots.style import distinct_colours

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LEAST = 24  # points from which a curve without deviations is drawn as a line
_DEVIATIONS = 1.96  # standard deviations on both sides, 95 %


def plot_amplitude_curve(
    curves: AmplitudeCurve | Sequence[AmplitudeCurve], *, names: Sequence[str] = (),
    logarithmic: bool = True, path: str | Path | None = None,
) -> "Figure":
    """Plot frequency above and damping ratio below over the amplitude, with bars of 95 %.

    Parameters
    ----------
    curves : AmplitudeCurve or sequence of AmplitudeCurve
        Measured and computed curves of one mode, in one unit of amplitude.
    names : sequence of str, optional
        For the legend, one for each curve.
    logarithmic : bool
        Whether the amplitude has a logarithmic axis.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        Without curves, for amplitudes in different units, another number of names, another suffix,
        or a file that cannot be written.
    """
    given = as_several(curves, AmplitudeCurve, "plot_amplitude_curve", "curves")
    if not given:
        raise InputError("plot_amplitude_curve: there are no curves; give at least one.")
    if len(units := {curve.unit for curve in given}) > 1:
        raise InputError(f"plot_amplitude_curve: the amplitudes are in {', '.join(sorted(units))}; "
                         f"give curves in one unit.")
    if names and len(names) != len(given):
        raise InputError(f"plot_amplitude_curve: {len(names)} names do not go with {len(given)} "
                         f"curves; give one for each.")
    with new_figure(8.0, 6.0, path) as figure:
        panels = figure.subplots(2, 1, sharex=True)
        for curve, name, colour in zip(given, names or [""] * len(given),
                                       distinct_colours(len(given)), strict=True):
            known = curve.frequency_deviation_hz is not None or len(curve) < _LEAST
            for axis, values, deviation in (
                    (panels[0], curve.frequency_hz, curve.frequency_deviation_hz),
                    (panels[1], curve.damping_ratio, curve.damping_deviation)):
                bars = None if deviation is None else _DEVIATIONS * np.asarray(deviation)
                axis.errorbar(curve.amplitude, values, bars, color=colour, label=name or None,
                              marker="o" if known else "", linestyle="" if known else "-",
                              markersize=3.5, elinewidth=0.9)
        if logarithmic:
            panels[1].set_xscale("log")
        panels[0].set_ylabel("frequency [Hz]")
        panels[1].set_ylabel("damping ratio")
        title = given[0].observed
        name_axis(panels[1], "x", f"amplitude{f' of {title}' if title else ''} [{given[0].unit}]",
                  np.concatenate([curve.amplitude for curve in given]))
        if names:
            panels[0].legend(loc="best")
        figure.align_ylabels()
    return figure
