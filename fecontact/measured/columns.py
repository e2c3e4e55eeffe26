"""Measurements of titled columns: axis, units, complex channels, coherence."""

from collections.abc import Mapping

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.measured.measured_units import parted, si_unit
from fecontact.measured.measurement import Axis, Channel, Measurement

# Names of the abscissa, in small letters.
AXES: Mapping[str, Axis] = {
    **dict.fromkeys(("time", "t", "times"), "time"),
    **dict.fromkeys(("frequency", "freq", "f", "frequencies", "hz", "frequency_hz"), "frequency")}


def of_columns(source: str, columns: Mapping[str, Array], units: Mapping[str, str]
               ) -> Measurement:
    """A measurement of columns by titles, the first of which is the axis."""
    (first, abscissa), *others = columns.items()
    name, unit = parted(first)
    axis = AXES.get(name.lower())
    found = si_unit(unit) if unit else None
    if axis is None and found is not None:
        axis = {"s": "time", "Hz": "frequency"}.get(found[0])  # type: ignore[assignment]
    if axis is None:
        raise InputError(f"its first column is called '{first}'; call it time [s] or "
                         f"frequency [Hz]")
    notes: list[str] = []
    wanted = "s" if axis == "time" else "Hz"
    if found is None or found[0] != wanted:
        if unit:
            raise InputError(f"'{first}' must be in {wanted}, not in '{unit}'")
        notes.append(f"'{name}' has no unit; it is taken in {wanted}")
        found = (wanted, 1.0)
    values, channels, coherence = joined(
        [(*parted(title), data) for title, data in others], units, notes)
    return Measurement(np.asarray(abscissa, dtype=float) * found[1], values, channels, axis,
                       coherence, source, tuple(notes))


def joined(
    columns: list[tuple[str, str | None, Array]], units: Mapping[str, str], notes: list[str]
) -> tuple[Array, tuple[Channel, ...], Array | None]:
    """Values (N, C), channels and coherence of columns by name and unit; adds to the notes."""
    parts = {name: (unit, data) for name, unit, data in columns}
    values: list[Array] = []
    channels: list[Channel] = []
    coherent: dict[str, Array] = {}
    for name, (unit, data) in parts.items():
        stem, _, part = name.rpartition(" ")
        if part.lower() in ("im", "imag") and any(f"{stem} {real}" in parts
                                                  for real in ("re", "real", "Re", "Real")):
            continue
        if part.lower() == "coherence" and stem:
            coherent[stem] = np.asarray(data, dtype=float)
            continue
        other = next((f"{stem} {imag}" for imag in ("im", "imag", "Im", "Imag")
                      if part.lower() in ("re", "real") and f"{stem} {imag}" in parts), None)
        if other is not None:
            name, data = stem, data + 1j * parts[other][1]
        symbol = units.get(name, unit)
        known = si_unit(symbol) if symbol is not None else None
        if symbol is None:
            notes.append(f"channel '{name}' has no unit; its values are as in the file")
        elif known is None:
            if name in units:
                raise InputError(f"the unit '{symbol}' given for '{name}' is not known; give one "
                                 f"like 'mm', 'm/s^2', 'g' or 'kN'")
            notes.append(f"the unit '{symbol}' of channel '{name}' is not known; its values are as "
                         f"in the file")
        si, factor = known or (symbol or "", 1.0)
        values.append(np.asarray(data) * factor)
        channels.append(Channel(name, si))
    if not channels:
        raise InputError("it has no channels beside its axis")
    table = np.stack(values, axis=1)
    if not coherent:
        return table, tuple(channels), None
    nothing = np.full(len(table), np.nan)
    return table, tuple(channels), np.stack(
        [coherent.get(one.name, nothing) for one in channels], axis=1)
