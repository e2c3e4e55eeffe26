"""Plot of frequency and damping over amplitude."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.types import Array
from fecontact.measured.amplitude_curve import AmplitudeCurve
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.diagrams.diagram import WIDTH, Curve, Diagram
from fecontact.output.plots.drawing import draw_stacked
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.responses import named_curves

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
    given, labels = named_curves("plot_amplitude_curve", AmplitudeCurve, {"curves": curves}, names,
                                 "unit", "have amplitudes in {}; give curves in one unit")
    title = given[0].observed
    label = f"amplitude{f' of {title}' if title else ''} [{given[0].unit}]"
    named, colours = labels or [""] * len(given), distinct_colours(len(given))
    frequency, damping = (
        Diagram(label, y_label, tuple(
            _curve(curve, values, deviation, name, colour)
            for (curve, values, deviation), name, colour in zip(each, named, colours, strict=True)),
            logarithmic="x" * logarithmic)
        for y_label, each in (
            ("frequency [Hz]", [(one, one.frequency_hz, one.frequency_deviation_hz)
                                for one in given]),
            ("damping ratio", [(one, one.damping_ratio, one.damping_deviation)
                               for one in given])))
    with new_figure(8.0, 6.0, path) as figure:
        draw_stacked(figure, (frequency, damping), (1.0, 1.0))
    return figure


def _curve(
    curve: AmplitudeCurve, values: Array, deviation: Array | None, name: str, colour: str
) -> Curve:
    """A line, or dots with their bars where deviations are known or points are few."""
    known = curve.frequency_deviation_hz is not None or len(curve) < _LEAST
    bars = None if deviation is None else _DEVIATIONS * np.asarray(deviation)
    return Curve(name, colour, curve.amplitude, values, 0.0 if known else WIDTH,
                 3.5 if known else 0.0, bars=bars)
