"""Diagrams as data: curves, maps, marks, bands and levels over two axes, for pictures and pages."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.output.diagrams.labels import in_unit
from fecontact.output.diagrams.maps import Map

WIDTH = 1.2  # of lines [points]
_FLAT = 1e-9  # range of values, as a part of their largest, below which it is round-off
_BINS = 2000  # columns of a long line, each drawn by its minimum and maximum


@dataclass(frozen=True, eq=False)
class Curve:
    """Values y (N,) over x (N,), in SI units.

    Attributes
    ----------
    name : str
        Entry of the legend; empty for none. Curves of one name have one entry.
    colour : str
        As ``#rrggbb``; empty for the colour of text.
    x, y : (N,) arrays
    width : float
        Of the line [points]; zero for markers alone.
    marker : float
        Diameter of a marker at each point [points]; zero for none.
    stable : (N - 1,) bool array or None
        False for pieces between neighbours that are unstable: drawn dashed and thin.
    dashed : bool
        Whether the whole line is dashed and thin, whatever its stability.
    bars : (N,) array or None
        Half the length of a bar of uncertainty at each point.
    limits : ((N,), (N,)) arrays or None
        Lower and upper limits of a shaded range about the values.
    limits_name : str
        Entry of the shaded range in the legend; empty for none.
    """

    name: str
    colour: str
    x: Array
    y: Array
    width: float = WIDTH
    marker: float = 0.0
    stable: NDArray[np.bool_] | None = None
    dashed: bool = False
    bars: Array | None = None
    limits: tuple[Array, Array] | None = None
    limits_name: str = ""

    @property
    def solid(self) -> NDArray[np.bool_] | None:
        """Flags (N - 1,) of pieces between neighbours that are solid lines; None if all are."""
        return np.zeros(len(self.x) - 1, dtype=np.bool_) if self.dashed else self.stable

    @property
    def partly_unstable(self) -> bool:
        """True if any piece is unstable."""
        return self.stable is not None and not self.stable.all()


@dataclass(frozen=True)
class Mark:
    """A special point at (x, y): its kind, a key of ``SPECIAL``, and letters beside it."""

    kind: str
    x: float
    y: float
    letters: str = ""


@dataclass(frozen=True)
class Band:
    """A range of x that is shaded over the whole height."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Level:
    """A straight line over the whole diagram, at a value of x or y."""

    value: float
    axis: Literal["x", "y"] = "y"
    name: str = ""
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Diagram:
    """Curves and maps over common axes, with all values in SI units.

    Attributes
    ----------
    x_label, y_label : str
        With the SI unit, such as ``velocity x [m/s]``; pictures and pages show a unit that suits
        the values.
    curves : tuple of Curve
    marks, bands, levels, maps : tuples of Mark, Band, Level, Map
        Maps lie behind curves, the first behind the others.
    title : str
    heading : str
        What the names of the curves are values of.
    logarithmic : str
        Names of the logarithmic axes: "", "x", "y" or "xy".
    x_limits, y_limits : (float or None, float or None)
        Ends of the axes; None for an end that suits the curves.
    """

    x_label: str
    y_label: str
    curves: tuple[Curve, ...] = ()
    marks: tuple[Mark, ...] = ()
    bands: tuple[Band, ...] = ()
    levels: tuple[Level, ...] = ()
    maps: tuple[Map, ...] = ()
    title: str = ""
    heading: str = ""
    logarithmic: str = ""
    x_limits: tuple[float | None, float | None] = (None, None)
    y_limits: tuple[float | None, float | None] = (None, None)

    def values(self, axis: Literal["x", "y"]) -> Array:
        """All finite values of the curves and borders of the maps along an axis."""
        found = [getattr(one, axis) for one in (*self.curves, *self.maps)]
        joined = np.concatenate([np.ravel(one) for one in found]) if found else np.zeros(0)
        return joined[np.isfinite(joined)]

    @cached_property
    def x_unit(self) -> tuple[float, str]:
        """Factor of the unit that suits the abscissae, and the label with its symbol."""
        return in_unit(self.x_label, self.values("x"))

    @cached_property
    def y_unit(self) -> tuple[float, str]:
        """Factor of the unit that suits the ordinates, and the label with its symbol."""
        return in_unit(self.y_label, self.values("y"))

    @cached_property
    def largest(self) -> float:
        """Largest size of all ordinates."""
        return float(np.abs(self.values("y")).max(initial=0.0))

    @cached_property
    def flat_range(self) -> tuple[float, float] | None:
        """Range of y about curves that differ by round-off alone; None if they differ by more."""
        values = self.values("y")
        leveled = any(level.axis == "y" for level in self.levels)
        if leveled or self.maps or not len(values) or np.ptp(values) >= _FLAT * self.largest:
            return None
        return float(values.min()) - 0.05 * self.largest, float(values.max()) + 0.05 * self.largest


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """Points of a long line over ascending x that show all of its peaks; other lines as they are.

    In each of many narrow columns they are the first, the last, the lowest and the highest point.
    """
    if len(x) < 4 * _BINS or (np.diff(x) < 0.0).any():
        return x, y
    columns = np.linspace(x[0], x[-1], _BINS + 1)[:-1]
    starts = np.unique(np.searchsorted(x, columns))
    low, high = (_places(extreme.reduceat(y, starts), y, starts)
                 for extreme in (np.minimum, np.maximum))
    ends = np.append(starts[1:], len(x)) - 1
    chosen = np.unique(np.concatenate([starts, low, high, ends]))
    return x[chosen], y[chosen]


def _places(extremes: Array, y: Array, starts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the extreme in each column of points."""
    counts = np.diff(np.append(starts, len(y)))
    met = np.flatnonzero(y == np.repeat(extremes, counts))
    columns = np.searchsorted(starts, met, side="right")
    return np.asarray(met[np.unique(columns, return_index=True)[1]])
