"""Diagrams of spectra, and bands of frequencies."""

from collections.abc import Sequence

import numpy as np

from fecontact.analysis.spectra import Spectrum
from fecontact.core.types import Array
from fecontact.output.diagrams.colours import BEYOND
from fecontact.output.diagrams.diagram import Band, Curve, Diagram

DECADES = 5.0  # range of the logarithmic axis below the highest value
_COLUMNS = 1000  # most points of a line
_SMALLEST = 1e-300  # value that stands for zero


def spectrum_diagram(
    spectra: Sequence[Spectrum], y_label: str, names: Sequence[str], colours: Sequence[str], *,
    title: str = "", highest_hz: float | None = None,
) -> Diagram:
    """Spectra over a common range of frequencies; the ordinates are logarithmic.

    The range ends at ``highest_hz``, or by default where all values have become small. Spectra of
    zeros alone have a linear ordinate.
    """
    end = highest_hz or max(end_of_content(one.frequency_hz, one.values) for one in spectra)
    top = max(float(one.values.max()) for one in spectra)
    floor = max(top * 10.0 ** -(DECADES + 1.0), _SMALLEST) if top > 0.0 else 0.0
    curves = []
    for one, name, colour in zip(spectra, names, colours, strict=True):
        frequency, values = _spectrum_line(one.frequency_hz, one.values, end)
        curves.append(Curve(name, colour, frequency, np.maximum(values, floor), 1.0))
    return Diagram("frequency [Hz]", y_label, tuple(curves), title=title,
                   logarithmic="y" if top > 0.0 else "", x_limits=(0.0, end),
                   y_limits=(top * 10.0**-DECADES, 4.0 * top) if top > 0.0 else (None, None))


def end_of_content(frequency: Array, values: Array) -> float:
    """Highest frequency with more than 0.002 of the highest value."""
    heard = np.flatnonzero(values > 2e-3 * values.max(initial=0.0))
    end = 1.1 * frequency[heard[-1]] if len(heard) else frequency[-1]
    return float(min(max(end, 10.0 * frequency[1]), frequency[-1]))


def beyond_band(x: Array, usable_hz: float) -> tuple[Band, ...]:
    """The band of frequencies x [Hz] beyond a usable basis; none where all are usable."""
    low, high = float(np.min(x)), float(np.max(x))
    return (Band(BEYOND, max(usable_hz, low), high),) if usable_hz < high else ()


def _spectrum_line(frequency: Array, values: Array, end: float) -> tuple[Array, Array]:
    """A long spectrum up to ``end``, thinned to the maxima of its bins."""
    shown = int(np.searchsorted(frequency, end, side="right"))
    few = shown // _COLUMNS
    if few < 2:
        return frequency[:shown], values[:shown]
    blocks = values[: shown - shown % few].reshape(-1, few)
    tops = np.arange(len(blocks)) * few + blocks.argmax(axis=1)
    return frequency[tops], values[tops]
