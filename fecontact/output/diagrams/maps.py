"""Maps of values over two axes, for diagrams: stability, basins of attraction, spectrograms."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.types import Array
from fecontact.output.diagrams.colours import distinct_colours

if TYPE_CHECKING:
    from fecontact.analysis.spectra import Spectrogram
    from fecontact.bifurcation.attractors.basins import Basins
    from fecontact.bifurcation.equilibria.stability_map import StabilityMap

_BLANK, _FAILED, _UNSETTLED = "#f4f2ee", "#969696", "#ffffff"
_DECADES = 4  # of the amplitudes of a spectrogram


@dataclass(frozen=True)
class Scale:
    """Colours of the values of a map.

    Attributes
    ----------
    label : str
        Of the colour bar, with the SI unit; empty for a map without a bar.
    colours : str or tuple of str
        A colour map of matplotlib, or the colour of each of the names as ``#rrggbb``.
    names : tuple of str
        Names of the values 0, 1, ...; empty for values that are numbers.
    low, high : float or None
        Values at the ends of the colour map; None for those of the map.
    logarithmic : bool
        Whether colours follow the logarithm of the values.
    """

    label: str = ""
    colours: str | tuple[str, ...] = "viridis"
    names: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    logarithmic: bool = False


@dataclass(frozen=True, eq=False)
class Map:
    """Values as colours of cells, in SI units.

    Attributes
    ----------
    x, y : (k + 1,) and (n + 1,) arrays
        Ascending borders of the columns and rows.
    values : (n, k) array
        NaN for cells without a value.
    scale : Scale
    blank : str
        Colour of cells without a value; empty for the background.
    opacity : float
        From 0 to 1.
    """

    x: Array
    y: Array
    values: Array
    scale: Scale = Scale()
    blank: str = ""
    opacity: float = 1.0

    @property
    def ends(self) -> tuple[float, float]:
        """Values at the ends of the colour map."""
        known = self.values[np.isfinite(self.values)]
        low, high = (float(one) for one in (known.min(), known.max())) if len(known) else (0.0, 1.0)
        low = low if self.scale.low is None else self.scale.low
        high = high if self.scale.high is None else self.scale.high
        return low, high if high > low else low + 1e-3 * max(abs(low), 1.0)


def borders(points: Array, logarithmic: bool = False) -> Array:
    """Borders (k + 1,) of cells around ascending points (k,), half way between these."""
    p = np.log(points) if logarithmic else np.asarray(points, dtype=float)
    if len(p) == 1:
        half = 0.5 * max(abs(float(p[0])), 1.0)
        found = p[0] + np.array([-half, half])
    else:
        middle = 0.5 * (p[1:] + p[:-1])
        found = np.concatenate([[2.0 * p[0] - middle[0]], middle, [2.0 * p[-1] - middle[-1]]])
    return np.asarray(np.exp(found) if logarithmic else found)


def stability_maps(found: "StabilityMap") -> tuple[Map, ...]:
    """Frequency of the fastest growing mode where an equilibrium is unstable; cells that failed."""
    x, y, unstable = borders(found.first), borders(found.second), found.unstable.T
    scale = Scale("frequency of the fastest growing mode [Hz]")
    hertz = Map(x, y, np.where(unstable > 0, found.frequency_hz.T, np.nan), scale, _BLANK)
    if not (unstable < 0).any():
        return (hertz,)
    return hertz, Map(x, y, np.where(unstable < 0, 0.0, np.nan), Scale(
        colours=(_FAILED,), names=("failed",)))


def zero_lines(x: Array, y: Array, values: Array) -> Sequence[Array]:
    """Lines (k, 2) along which values (n, m) over x (m,) and y (n,) are zero."""
    from contourpy import contour_generator

    if min(values.shape) < 2 or not values.min() < 0.0 < values.max():
        return []
    found: Any = contour_generator(x, y, np.ma.masked_invalid(values)).lines(0.0)
    return list(found)


def basin_map(found: "Basins") -> Map:
    """Numbers of the attractors over the plane, from 1; 0 for motions without an end."""
    count = len(found.attractors)
    names = ("no end", *(f"{number}" for number in range(1, count + 1)))
    values = np.array(found.label.T + 1.0, dtype=float)
    return Map(borders(found.first), borders(found.second), values, Scale(
        colours=(_UNSETTLED, *distinct_colours(count)), names=names), opacity=0.75)


def spectrogram_map(found: "Spectrogram", unit: str) -> Map:
    """Amplitudes over time and frequency, on a logarithmic scale."""
    top = float(found.values.max()) or 1.0
    values = np.array(np.maximum(found.values, 1e-300), dtype=float)
    return Map(borders(found.time), borders(found.frequency_hz), values, Scale(
        f"amplitude [{unit}]", low=top * 10.0**-_DECADES, high=top, logarithmic=True))
