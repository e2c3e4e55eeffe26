"""Measured channels over time or frequency, and what is wrong with them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import as_floats, as_numbers
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, count, listed, quantity
from fecontact.measured.measured_units import si_unit

# Largest deviation of a time step from the median, and steps from which on there is a gap.
_UNEVEN, _GAP = 1e-3, 1.5
# Samples in a row at the largest value, and how often they occur, from which on an amplifier may
# have been overloaded.
_CLIPPED, _OFTEN = 3, 3
# Values above which a displacement [m] or a rotation [rad] was hardly measured in this unit.
_LARGE = {"m": 1.0, "rad": 10.0}
_DIRECTION = re.compile(r"[+-](x|y|z|phi_x|phi_y|phi_z)|")
Axis = Literal["time", "frequency"]


@dataclass(frozen=True)
class Channel:
    """One channel of a measurement.

    Parameters
    ----------
    name : str
        Name by which it is chosen.
    unit : str
        Unit of its values: SI, unless the unit is not known; empty if it is not given.
    node : int, optional
        Number of the node at which it was measured.
    direction : str
        Direction at the node: '+x', '-y', 'phi_z' with a sign; empty if it is not known.
    reference_node : int, optional
        Number of the node at which a frequency response was excited.
    reference_direction : str
        Direction of the excitation.

    Raises
    ------
    InputError
        For a direction that does not exist.
    """

    name: str
    unit: str = ""
    node: int | None = None
    direction: str = ""
    reference_node: int | None = None
    reference_direction: str = ""

    def __post_init__(self) -> None:
        for what in ("name", "unit", "direction", "reference_direction"):
            if not isinstance(getattr(self, what), str):
                raise InputError(f"Channel: {what} = {getattr(self, what)!r} must be a text.")
        for what in ("direction", "reference_direction"):
            if not _DIRECTION.fullmatch(getattr(self, what)):
                raise InputError(f"Channel: {what} = {getattr(self, what)!r} must be a sign and "
                                 f"one of x, y, z, phi_x, phi_y, phi_z, such as '+x'.")


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Measurement(Summarised):
    """Channels that were measured over one axis of times or frequencies, in SI units.

    Attributes
    ----------
    abscissa : (N,) array
        Times [s] or frequencies [Hz].
    values : (N, C) array
        Values of C channels, complex for frequency responses.
    channels : tuple of Channel
        Name, unit and place of each.
    axis : 'time' or 'frequency'
        Meaning of the abscissa.
    coherence : (N, C) array or None
        Coherence of the channels, from 0 to 1; None if it was not measured.
    source : str
        File and data set, for messages.
    notes : tuple of str
        Decisions of the reader, such as units that were assumed.

    Raises
    ------
    InputError
        For arrays whose sizes do not agree, and for names that occur twice.
    """

    abscissa: Array
    values: Array
    channels: tuple[Channel, ...]
    axis: Axis = "time"
    coherence: Array | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        places = as_floats(self.abscissa, "Measurement: abscissa")
        values = as_numbers(self.values, "Measurement: values")
        if values.ndim == 1:
            values = values[:, None]
        channels = ((self.channels,) if isinstance(self.channels, Channel | str)
                    else tuple(self.channels))
        channels = tuple(Channel(one) if isinstance(one, str) else one for one in channels)
        if places.ndim != 1 or len(places) < 2 or values.shape != (len(places), len(channels)):
            raise InputError(f"Measurement: abscissa and values have the shapes {places.shape} and "
                             f"{values.shape}; give at least two rows, and a column for each of "
                             f"the {len(channels)} channels.")
        if self.axis not in ("time", "frequency"):
            raise InputError(f"Measurement: axis = {self.axis!r} must be 'time' or 'frequency'.")
        names = [one.name for one in channels]
        if twice := {name for name in names if names.count(name) > 1}:
            raise InputError(f"Measurement: several channels are called {choices(twice)}; give "
                             f"each a name of its own.")
        coherence = self.coherence
        if coherence is not None:
            coherence = as_floats(coherence, "Measurement: coherence")
            coherence = coherence[:, None] if coherence.ndim == 1 else coherence
            if coherence.shape != values.shape:
                raise InputError(f"Measurement: coherence has the shape {coherence.shape}, values "
                                 f"{values.shape}; give one for each value.")
        for name, value in (("abscissa", places), ("values", values), ("channels", channels),
                            ("coherence", coherence), ("notes", tuple(self.notes))):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.abscissa)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(one.name for one in self.channels)

    def index(self, channel: str | int | None = None) -> int:
        """Number of a channel by its name or number; None for the only one.

        Raises
        ------
        InputError
            If there is no such channel, or several and none is named.
        """
        if channel is None:
            if len(self.channels) > 1:
                raise InputError(f"{self._title} has {len(self.channels)} channels; name one of "
                                 f"{choices(self.names)}.")
            return 0
        if isinstance(channel, int | np.integer) and not isinstance(channel, bool):
            if not 0 <= channel < len(self.channels):
                raise InputError(f"{self._title}: channel = {channel} must be from 0 to "
                                 f"{len(self.channels) - 1}.")
            return int(channel)
        if channel not in self.names:
            raise InputError(f"{self._title} has no channel {channel!r}"
                             f"{nearest(str(channel), self.names)}; there are: "
                             f"{choices(self.names)}.")
        return self.names.index(channel)

    def series(self, channel: str | int | None = None) -> tuple[Array, Array, str, str]:
        """Times [s], values, unit and name of a channel over time.

        Raises
        ------
        InputError
            For a measurement over frequency, an unknown channel, or values that are no numbers.
        """
        k = self.index(channel)
        if self.axis != "time":
            raise InputError(f"{self._title} holds channels over frequency; give one over time.")
        for problem in self._missing(k):
            raise InputError(f"{self._title}: {problem}.")
        return self.abscissa, self.values[:, k], self.channels[k].unit, self.channels[k].name

    def between(self, low: float | None = None, high: float | None = None) -> "Measurement":
        """Part of the measurement between two times [s] or frequencies [Hz], both included.

        Raises
        ------
        InputError
            If fewer than two rows remain.
        """
        ends = [np.inf * sign if end is None else float(as_floats(end, "between: ends"))
                for end, sign in ((low, -1.0), (high, 1.0))]
        kept = (self.abscissa >= ends[0]) & (self.abscissa <= ends[1])
        if np.count_nonzero(kept) < 2:
            raise InputError(f"{self._title}: fewer than two rows lie between {ends[0]:g} and "
                             f"{ends[1]:g}; it goes from {self.abscissa.min():g} to "
                             f"{self.abscissa.max():g}.")
        return self._rows(kept)

    def known(self, *channels: str | int | None) -> "Measurement":
        """Rows in which some channels hold finite numbers.

        Raises
        ------
        InputError
            If fewer than two rows remain.
        """
        columns = [self.index(one) for one in channels]
        kept = np.isfinite(self.values[:, columns]).all(axis=1)
        if np.count_nonzero(kept) < 2:
            raise InputError(f"{self._title}: fewer than two rows hold numbers in "
                             f"{choices(self.names[k] for k in columns)}.")
        return self if kept.all() else self._rows(kept)

    def _rows(self, kept: Any) -> "Measurement":
        return replace(self, abscissa=self.abscissa[kept], values=self.values[kept],
                       coherence=None if self.coherence is None else self.coherence[kept])

    def with_units(self, units: Mapping[str, str]) -> "Measurement":
        """Copy whose channels are read in other units, by name: ``{"x": "mm"}``.

        A value v that the file gives in mm becomes 1e-3 v m, regardless of its previous unit.

        Raises
        ------
        InputError
            For unknown channels or units.
        """
        values, channels = self.values.copy(), list(self.channels)
        for name, symbol in units.items():
            k = self.index(name)
            found = si_unit(symbol) if isinstance(symbol, str) else None
            if found is None:
                raise InputError(f"{self._title}: the unit {symbol!r} of channel {name!r} is not "
                                 f"known; give one like 'mm', 'm/s^2', 'g' or 'kN'.")
            values[:, k] *= found[1]
            channels[k] = replace(channels[k], unit=found[0])
        return replace(self, values=values, channels=tuple(channels))

    @property
    def problems(self) -> tuple[str, ...]:
        """One sentence for each thing that looks wrong; empty if nothing does."""
        found = self._of_abscissa()
        for k, one in enumerate(self.channels):
            found += self._missing(k)
            values = np.abs(self.values[:, k])
            known = values[np.isfinite(values)]
            top = float(known.max(initial=0.0))
            if self.axis == "time" and top > _LARGE.get(one.unit, np.inf):
                found.append(f"Channel '{one.name}' reaches {top:.4g} {one.unit}: is it in "
                             f"m{one.unit}, a thousandth? Then give units = {{'{one.name}': "
                             f"'m{one.unit}'}}")
            runs = _runs(values == top)
            if self.axis == "time" and top and np.count_nonzero(runs >= _CLIPPED) >= _OFTEN:
                found.append(f"Channel '{one.name}' stays at its largest value, {top:.4g} "
                             f"{one.unit}, for {runs.max()} samples: an amplifier may have been "
                             f"overloaded")
        return tuple(found)

    def _missing(self, k: int) -> list[str]:
        wrong = ~np.isfinite(self.values[:, k])
        if not wrong.any():
            return []
        unit = "s" if self.axis == "time" else "Hz"
        return [f"Channel '{self.channels[k].name}' has {count(int(wrong.sum()), 'value')} that "
                f"{'is' if wrong.sum() == 1 else 'are'} no number, the first at "
                f"{self.abscissa[int(np.argmax(wrong))]:.6g} {unit}; leave that part out "
                f"(between, or t_start and t_end), or repair the file"]

    def _of_abscissa(self) -> list[str]:
        what, unit = ("times", "s") if self.axis == "time" else ("frequencies", "Hz")
        x = self.abscissa
        if not np.isfinite(x).all():
            return [f"The {what} hold values that are no numbers, the first in row "
                    f"{int(np.argmin(np.isfinite(x)))}; repair the file"]
        step = np.diff(x)
        if (step <= 0.0).any():
            k = int(np.argmax(step <= 0.0))
            return [f"The {what} do not ascend after {x[k]:.6g} {unit}, in row {k + 1}; sort the "
                    f"rows, and remove those that are repeated"]
        if self.axis == "frequency":
            return []
        usual = float(np.median(step))
        gaps = np.flatnonzero(step > _GAP * usual)
        if len(gaps):
            first = int(gaps[0])
            return [f"The times have {count(len(gaps), 'gap')}, the first of {step[first]:.4g} s "
                    f"after {x[first]:.6g} s, where samples are {usual:.4g} s apart; take a part "
                    f"without gaps (between, or t_start and t_end)"]
        if (off := float(np.abs(step - usual).max())) > _UNEVEN * usual:
            return [f"The times are not even: steps are {usual:.4g} s, up to {off:.2g} s off; "
                    f"functions that need even times take resample = True"]
        return []

    @property
    def _title(self) -> str:
        return self.source or "The measurement"

    def summary(self) -> list[tuple[str, str]]:
        """Source, rows, range, channels with their units, notes and problems."""
        x, unit = self.abscissa, "s" if self.axis == "time" else "Hz"
        step = float(np.median(np.diff(x)))
        shown = [f"{one.name} [{one.unit or 'no unit'}]" for one in self.channels]
        rate = f", {quantity(1.0 / step, 'Hz', 5)} sampling" if self.axis == "time" and (
            step > 0.0) else ""
        return [("source", self.source or "none"),
                (self.axis, f"{x[0]:.6g} ... {x[-1]:.6g} {unit}, {len(x)} rows{rate}"),
                ("channels", listed(shown, 6)),
                *([("coherence", f"{np.nanmin(self.coherence):.3g} ... "
                                 f"{np.nanmax(self.coherence):.3g}")]
                  if self.coherence is not None else []),
                *(("note", one) for one in self.notes),
                *(("problem", one) for one in self.problems)]


def _runs(flags: Any) -> Integers:
    """Lengths of the runs of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(flags, dtype=int), [0]])))
    return np.asarray(edges[1::2] - edges[::2])
