"""Time series in the form of SDyPy's SEP005, and TDMS files by way of it."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError
from fecontact.core.extras import optional
from fecontact.measured.columns import AXES, of_columns
from fecontact.measured.measurement import Measurement

# Properties of TDMS channels that hold a unit.
_UNITS = ("unit_string", "NI_UnitDescription")


def from_sep005(
    series: Mapping[str, Any] | Iterable[Mapping[str, Any]], *,
    units: Mapping[str, str] | None = None, source: str = "",
) -> tuple[Measurement, ...]:
    """Measurements of time series in the form of SEP005 of SDyPy, one for each axis of times.

    Each is a mapping with ``data``, ``name``, ``unit_str``, and ``fs`` [Hz] or ``time`` [s]; other
    entries but ``group`` are not used. Readers of this form are on the package index as
    ``sep005-io-...``, such as for the files of Dewesoft.

    Parameters
    ----------
    series : mapping or sequence of mappings
        The channels. Those of one ``group`` over equal times become one measurement.
    units : mapping of channel to unit, optional
        Units in place of those of the channels.
    source : str
        File or device, for messages.

    Raises
    ------
    InputError
        For a channel without one of these entries, with times of another length, with values that
        are no numbers, or a name that occurs twice.

    Notes
    -----
    https://github.com/sdypy/sdypy/blob/main/docs/seps/sep-0005.rst
    """
    channels = [series] if isinstance(series, Mapping) else list(series)
    if not channels:
        raise InputError("from_sep005: there is no channel; give one at least.")
    groups: dict[Any, dict[str, Any]] = {}
    for number, one in enumerate(channels):
        require_kind("from_sep005", Mapping, series=one)
        name, unit, time, data = _checked(number, one)
        columns = groups.setdefault((one.get("group"), time.tobytes()), {"time [s]": time})
        title = f"{name} [{unit}]" if unit else name
        if title in columns:
            raise InputError(f"from_sep005: two channels over equal times are called '{name}'; "
                             f"give each its own name.")
        columns[title] = data
    return tuple(of_columns(source, columns, units or {}) for columns in groups.values())


def _checked(number: int, one: Mapping[str, Any]) -> tuple[str, str, Any, Any]:
    """Name, unit, times and values of a channel."""
    if lacking := [key for key in ("data", "name", "unit_str") if key not in one]:
        raise InputError(f"from_sep005: channel {number} has no '{lacking[0]}'; SEP005 asks for "
                         f"data, name, unit_str, and fs or time.")
    owner = f"from_sep005: '{one['name']}'"
    data = as_floats(one["data"], f"{owner}: data")
    if data.ndim != 1 or len(data) < 2:
        raise InputError(f"{owner}: data has the shape {data.shape}; give two values or more.")
    if one.get("time") is not None:
        time = as_floats(one["time"], f"{owner}: time")
        if time.shape != data.shape:
            raise InputError(f"{owner}: there are {time.size} times for {len(data)} values; give "
                             f"one for each.")
    elif one.get("fs") is not None:
        rate = as_floats(one["fs"], f"{owner}: fs")
        if rate.ndim or not 0.0 < rate < np.inf:
            raise InputError(f"{owner}: fs = {one['fs']!r} must be a rate above zero [Hz].")
        time = np.arange(len(data)) / rate
    else:
        raise InputError(f"{owner} has neither 'fs' nor 'time'; give the rate [Hz] or the times.")
    return str(one["name"]), str(one["unit_str"]), np.array(time), data


def read_tdms(path: Path, units: Mapping[str, str]) -> list[Measurement]:
    """Measurements of a TDMS file, those of each group over equal times together."""
    nptdms = optional("nptdms", "Reading TDMS files")
    series, found, untimed = [], [], []
    for group in nptdms.TdmsFile.read(path).groups():
        channels = [one for one in group.channels() if len(one) > 1 and one.dtype.kind in "fiu"]
        axis = next((one for one in channels if one.name.lower() in AXES), None)
        if axis is not None:
            found.append(of_columns(str(path), {
                _title(one): one[:] for one in [axis, *(other for other in channels if other is not
                                                       axis and len(other) == len(axis))]}, units))
            continue
        for one in channels:
            if "wf_increment" not in one.properties:
                untimed.append(one.name)
                continue
            times = one.properties["wf_increment"] * np.arange(len(one))
            series.append({"data": one[:], "name": one.name, "unit_str": _unit(one),
                           "time": times + one.properties.get("wf_start_offset", 0.0),
                           "group": group.name})
    if series:
        found += from_sep005(series, units=units, source=str(path))
    if not found:
        raise InputError("its channels have no times: neither the property wf_increment nor a "
                         "channel called time beside them" if untimed else
                         "it has no channels of two numbers or more")
    return found


def _unit(channel: Any) -> str:
    return next((str(channel.properties[name]) for name in _UNITS if name in channel.properties),
                "")


def _title(channel: Any) -> str:
    unit = _unit(channel)
    return f"{channel.name} [{unit}]" if unit else str(channel.name)
