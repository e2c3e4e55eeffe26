"""Functions at nodes of universal files (data set 58): time histories and frequency responses."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError
from fecontact.core.extras import optional
from fecontact.core.files.atomic_write import replaced
from fecontact.core.types import Array
from fecontact.measured.measured_units import si_unit
from fecontact.measured.measurement import Axis, Channel, Measurement
from fecontact.reduction.matrix_files.uff import data_sets, units

_DIRECTIONS = {1: "x", 2: "y", 3: "z", 4: "phi_x", 5: "phi_y", 6: "phi_z"}
# Second line of the description of functions whose first line is the name of a channel.
_NAMED = "name of the channel above"
_CODES = {name: code for code, name in _DIRECTIONS.items()}
# Kinds of functions.
_TIME, _SPECTRUM, _RESPONSE, _COHERENCE, _GENERAL = 1, 12, 4, 6, 0
# SI unit and exponents of length and force by the kind of data of an ordinate.
_KINDS = {8: ("m", 1, 0), 11: ("m/s", 1, 0), 12: ("m/s^2", 1, 0), 9: ("N", 0, 1),
          13: ("N", 0, 1), 15: ("Pa", -2, 1)}
_KIND_OF = {"m": 8, "m/s": 11, "m/s^2": 12, "N": 13, "Pa": 15}
_ABSCISSAE: Mapping[int, Axis] = {17: "time", 18: "frequency"}


def read_functions(path: Path, given: Mapping[str, str]) -> list[Measurement]:
    """Measurements of the data sets 58 of a universal file, those over equal axes together.

    Raises
    ------
    InputError
        If there are none, or a data set has an axis that is neither time nor frequency.
    MissingLibraryError
        If pyuff is not installed.
    """
    sets = data_sets(path, (58, 151, 164))
    functions = [one for one in sets if one["type"] == 58]
    if not functions:
        raise InputError("it has no data sets 58, functions at nodes; modes are read by read_uff")
    scales = units(sets)
    groups: list[tuple[Axis, Array, list[dict[str, Any]]]] = []
    for one in functions:
        axis, x = _axis(one)
        for known, places, members in groups:
            if known == axis and len(places) == len(x) and np.allclose(
                    places, x, rtol=1e-6, atol=1e-9 * float(np.abs(x).max(initial=0.0))):
                members.append(one)
                break
        else:
            groups.append((axis, x, [one]))
    return [_group(str(path), axis, x, members, scales, given) for axis, x, members in groups]


def _axis(one: Mapping[str, Any]) -> tuple[Axis, Array]:
    axis = _ABSCISSAE.get(int(one["abscissa_spec_data_type"]))
    if axis is None:
        axis = "time" if one["func_type"] == _TIME else "frequency"
    x = np.asarray(one["x"], dtype=float)
    symbol = str(one["abscissa_axis_units_lab"]).strip()
    found = si_unit(symbol) if symbol not in ("", "NONE") else None
    return axis, x if found is None else x * found[1]


def _group(
    source: str, axis: Axis, x: Array, members: list[dict[str, Any]],
    scales: tuple[float, float], given: Mapping[str, str],
) -> Measurement:
    notes: list[str] = []
    columns: dict[str, tuple[Channel, Array]] = {}
    coherent: dict[tuple[Any, ...], Array] = {}
    for one in members:
        data = np.asarray(one["data"])
        if data.shape != x.shape:
            raise InputError(f"a function has {len(data)} values for {len(x)} places")
        channel = _channel(one)
        if one["func_type"] == _COHERENCE:
            coherent[_place(channel)] = np.real(data)
            continue
        name = channel.name
        while channel.name in columns:
            channel = Channel(f"{name} ({sum(key.startswith(name) for key in columns) + 1})",
                              "", *_place(channel))
        unit, factor = _unit(one, channel.name, scales, given, notes)
        columns[channel.name] = (Channel(channel.name, unit, *_place(channel)), data * factor)
    if not columns:
        raise InputError("it has coherences alone, without the functions they belong to")
    values = np.stack([data for _, data in columns.values()], axis=1)
    channels = tuple(channel for channel, _ in columns.values())
    nothing = np.full(len(x), np.nan)
    coherence = np.stack([coherent.get(_place(one), nothing) for one in channels],
                         axis=1) if coherent else None
    return Measurement(x, values, channels, axis, coherence, source, tuple(notes))


def _place(channel: Channel) -> tuple[int | None, str, int | None, str]:
    return (channel.node, channel.direction, channel.reference_node, channel.reference_direction)


def _channel(one: Mapping[str, Any]) -> Channel:
    node, way = int(one["rsp_node"]), _direction(int(one["rsp_dir"]))
    place = f"{node}{way}"
    name = str(one["id1"]).strip() if str(one["id2"]).strip() == _NAMED else ""
    response = one["func_type"] in (_RESPONSE, _COHERENCE)
    other, along = int(one["ref_node"]), _direction(int(one["ref_dir"]))
    if response:
        return Channel(name or f"{place} / {other}{along}", "", node, way, other, along)
    return Channel(name or place, "", node, way)


def _direction(code: int) -> str:
    return "" if abs(code) not in _DIRECTIONS else ("-" if code < 0 else "+") + _DIRECTIONS[
        abs(code)]


def _unit(
    one: Mapping[str, Any], name: str, scales: tuple[float, float], given: Mapping[str, str],
    notes: list[str],
) -> tuple[str, float]:
    """SI unit and factor of a function: as given, by its label, or by its kind and set 164."""
    if name in given:
        found = si_unit(given[name])
        if found is None:
            raise InputError(f"the unit '{given[name]}' given for '{name}' is not known")
        return found
    by_kind = _by_kind(one, scales)
    label = str(one["ordinate_axis_units_lab"]).strip()
    below = str(one["orddenom_axis_units_lab"]).strip()
    if label in ("", "NONE"):
        if by_kind is None:
            notes.append(f"'{name}' has no unit; its values are as in the file")
            return "", 1.0
        return by_kind
    symbol = f"{label}/{below}" if below not in ("", "NONE") and "/" + below not in label else label
    found = si_unit(symbol)
    if found is None:
        notes.append(f"the unit '{symbol}' of '{name}' is not known; its values are as in the file")
        return symbol, 1.0
    if by_kind is not None and by_kind[0] == found[0]:
        ratio = by_kind[1] / found[1]
        if not 0.999 < ratio < 1.001:
            notes.append(f"the label of '{name}' says '{symbol}', the units of the file (data set "
                         f"164) differ from it by a factor of {ratio:.6g}: the label was taken; if "
                         f"it is wrong, give units")
    return found


def _by_kind(one: Mapping[str, Any], scales: tuple[float, float]) -> tuple[str, float] | None:
    length, force = scales
    upper = _KINDS.get(int(one["ordinate_spec_data_type"]))
    if upper is None:
        return None
    unit, factor = upper[0], length ** -upper[1] * force ** -upper[2]
    if one["func_type"] == _RESPONSE:
        lower = _KINDS.get(int(one["orddenom_spec_data_type"]))
        if lower is None:
            return None
        unit = f"{unit}/{lower[0]}"
        factor /= length ** -lower[1] * force ** -lower[2]
    return unit, factor


def write_uff(measurement: Measurement, path: str | Path) -> Path:
    """Write a measurement as a universal file: data sets 58 in SI units, and 164.

    Axes carry six digits, as the format wants them, and values thirteen.

    Parameters
    ----------
    measurement : Measurement
        Channels; those without a node get numbers from 1.
    path : str or Path
        A .uff or .unv file; it is replaced if it exists.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    MissingLibraryError
        If pyuff is not installed.
    """
    require_kind("write_uff", Measurement, measurement=measurement)
    path = as_path(path, "a universal file")
    if path.suffix.lower() not in (".uff", ".unv"):
        raise InputError(f"{path} must end in .uff or .unv.")
    pyuff = optional("pyuff", "Writing universal files")
    sets = [{"type": 164, "units_code": 1, "units_description": "SI", "temp_mode": 1,
             "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}]
    for k, one in enumerate(measurement.channels):
        sets.append(_function(measurement, k, one, measurement.values[:, k], False))
        if measurement.coherence is not None and np.isfinite(measurement.coherence[:, k]).any():
            sets.append(_function(measurement, k, one, measurement.coherence[:, k], True))
    with replaced(path) as part:
        pyuff.UFF(str(part)).write_sets(sets, mode="add")
    return path


def _function(
    measurement: Measurement, k: int, one: Channel, values: Array, coherence: bool
) -> dict[str, Any]:
    x = measurement.abscissa
    step = np.diff(x)
    upper, _, lower = one.unit.rpartition("/N") if one.unit.endswith("/N") else (one.unit, "", "")
    response = measurement.axis == "frequency" and one.unit.endswith("/N")
    if response:
        lower = "N"
    kind = (_COHERENCE if coherence else _RESPONSE if response
            else _TIME if measurement.axis == "time" else _GENERAL)
    return {
        "type": 58, "binary": 0, "func_type": kind, "id1": one.name, "id2": _NAMED,
        "rsp_node": one.node if one.node is not None else k + 1,
        "rsp_dir": _code(one.direction), "ref_node": one.reference_node or 0,
        "ref_dir": _code(one.reference_direction), "data": np.array(values), "x": np.array(x),
        "abscissa_spacing": int(np.ptp(step) <= 1e-6 * abs(float(step.mean()))),
        "abscissa_spec_data_type": 17 if measurement.axis == "time" else 18,
        "abscissa_axis_units_lab": "s" if measurement.axis == "time" else "Hz",
        "ordinate_spec_data_type": 0 if coherence else _KIND_OF.get(upper, 0),
        "ordinate_axis_units_lab": "NONE" if coherence else upper or "NONE",
        "orddenom_spec_data_type": _KIND_OF.get(lower, 0) if not coherence else 0,
        "orddenom_axis_units_lab": (lower if not coherence else "") or "NONE"}


def _code(direction: str) -> int:
    if not direction:
        return 0
    return (-1 if direction[0] == "-" else 1) * _CODES[direction[1:]]
