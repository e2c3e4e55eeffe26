"""One channel of a run, a measurement, or two arrays, as times and values."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from fecontact.analysis.histories import history
from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.trajectory import Trajectory

Source = Any  # Trajectory, Measurement, or the times of an array of values


class Series(NamedTuple):
    """Times and values of one channel.

    time : (N,) [s]
    values : (N,) in ``unit``
    unit : str, empty if it is not known
    title : text for display
    """

    time: Array
    values: Array
    unit: str
    title: str

    @property
    def derivative(self) -> int:
        """Order of the time derivative of a displacement that the values are, by the unit."""
        return 2 if self.unit.endswith("/s^2") else 1 if self.unit.endswith("/s") else 0


def series_of(
    source: Source, values: ArrayLike | None, owner: str, chosen: Mapping[str, Any]
) -> Series:
    """A channel of a source as times and values.

    Parameters
    ----------
    source, values
        Times and values; or a run, or a measurement over time, without values.
    owner : str
        Function that asks, for messages.
    chosen : mapping
        ``quantity``, ``point``, ``component`` of a run; ``channel`` of a measurement.

    Raises
    ------
    InputError
        For values beside a run or measurement, a missing or unknown channel, or unknown keys.
    """
    names = (("quantity", "point", "component") if isinstance(source, Trajectory) else
             ("channel",) if hasattr(source, "channels") else ())
    for name in chosen:
        if name not in names:
            raise InputError(f"{owner}: {name} is not known here{nearest(name, names)}; known are: "
                             f"{choices(names)}.")
    if names and values is not None:
        raise InputError(f"{owner}: values are given beside a {type(source).__name__}, which has "
                         f"its own; leave them out.")
    if isinstance(source, Trajectory):
        found = history(source, **chosen)
        return Series(source.time, found.values, found.unit, found.title)
    if names:
        return Series(*source.series(**chosen))
    if values is None:
        raise InputError(f"{owner}: values are missing; give times and values, a Trajectory, or a "
                         f"Measurement.")
    return Series(as_floats(source, f"{owner}: time"), as_floats(values, f"{owner}: values"), "",
                  "")
