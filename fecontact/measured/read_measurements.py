"""Readers of measurements: CSV, MATLAB, HDF5, TDMS and universal files."""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path, require_kind, require_regular_file
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.files.hdf5_check import open_hdf5
from fecontact.core.files.stored import reading
from fecontact.core.types import Array
from fecontact.laws.data_columns import cells, number, text_of
from fecontact.measured.columns import AXES, of_columns
from fecontact.measured.measured_units import parted
from fecontact.measured.measurement import Axis, Measurement
from fecontact.measured.time_series import read_tdms
from fecontact.measured.uff_functions import read_functions

_SUFFIXES = (".csv", ".txt", ".dat", ".mat", ".h5", ".hdf5", ".tdms", ".uff", ".unv")
_MOST = 10_000  # columns of a two-dimensional array of channels
_MISSING = ("", "na", "n/a", "null", "none", "-", "--")  # texts for a number that is missing


def read_measurements(
    path: str | Path, *, units: Mapping[str, str] | None = None
) -> tuple[Measurement, ...]:
    """Read all measurements of a file, one for each axis of times or frequencies.

    - Text (.csv, .txt, .dat): a line of titles such as ``time [s], x [mm]``, columns below; the
      first column is the axis. ``H re`` and ``H im`` are one complex channel, ``H coherence`` is
      the coherence of H. Empty cells and ``n/a`` are NaN.
    - MATLAB (.mat) and HDF5 (.h5): vectors, or columns of matrices, of the length of a vector
      called ``time``, ``t``, ``frequency`` or ``f``, at the top or in one structure or group; units
      from titles, from HDF5 attributes ``unit``, or from a structure ``units``.
    - TDMS of LabVIEW (.tdms): channels with their increment of time, or beside a channel called
      ``time``, those of each group together; units of their property ``unit_string``.
    - Universal files (.uff, .unv): data sets 58 with their nodes and directions, coherences beside
      frequency responses, units of their labels or of data set 164.

    Values become SI units where the unit is known. Values are as in the file, with a note, where it
    is not.

    Parameters
    ----------
    path : str or Path
        The file.
    units : mapping of channel to unit, optional
        Units in which the file gives channels, in place of its own: ``{"x": "mm"}``.

    Raises
    ------
    InputError
        If the file does not exist, is damaged, of another kind, or holds no measurement.
    MissingLibraryError
        For universal files without pyuff, and TDMS without npTDMS.
    """
    path = as_path(path, "a measurement")
    require_kind("read_measurements", (Mapping, type(None)), units=units)
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path}: measurements are not read from files of this kind; the suffixes "
                         f"that are: {', '.join(_SUFFIXES)}.")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    require_regular_file(path, "a measurement")
    reader: Callable[[Path, Mapping[str, str]], Iterable[Measurement]] = {
        ".mat": _read_mat, ".h5": _read_hdf5, ".hdf5": _read_hdf5, ".tdms": read_tdms,
        ".uff": read_functions, ".unv": read_functions}.get(path.suffix.lower(), _read_text)
    with reading(path, "not readable as a measurement"):
        found = tuple(reader(path, units or {}))
    known = {name for one in found for name in one.names}
    for name in units or ():
        if name not in known:
            raise InputError(f"{path}: units names the channel {name!r}{nearest(name, known)}; "
                             f"there are: {choices(known)}.")
    return found


def read_measurement(
    path: str | Path, *, axis: Axis | None = None, units: Mapping[str, str] | None = None
) -> Measurement:
    """Read the measurement of a file, as :func:`read_measurements`.

    Parameters
    ----------
    path : str or Path
        The file.
    axis : 'time' or 'frequency', optional
        Abscissa of the measurement, for a file with both.
    units : mapping of channel to unit, optional
        Units in which the file gives channels, in place of its own.

    Raises
    ------
    InputError
        As in :func:`read_measurements`, and if the file holds none or several over this axis.
    """
    if axis not in (None, "time", "frequency"):
        raise InputError(f"read_measurement: axis = {axis!r} must be 'time' or 'frequency'.")
    found = [one for one in read_measurements(path, units=units) if axis in (None, one.axis)]
    if len(found) != 1:
        what = f" over {axis}" if axis else ""
        raise InputError(f"{path} holds {len(found)} measurements{what}; "
                         + ("give axis, or take one of those of read_measurements." if found
                            else "take the other axis."))
    return found[0]


def _read_text(path: Path, units: Mapping[str, str]) -> list[Measurement]:
    lines = [line.partition("#")[0].strip() for line in text_of("A measurement", path).splitlines()]
    titles: list[str] = []
    rows: list[list[float]] = []
    for place, line in enumerate(lines, start=1):
        words = _cells(line)
        values = [_value(word) for word in words]
        if not words or (not rows and None in values):
            titles = _titles(line) if words else titles
            continue
        if None in values or (rows and len(values) != len(rows[0])):
            raise InputError(f"line {place} has {len(values)} columns, or a text among its "
                             f"numbers; each must have the {len(rows[0]) if rows else 0} numbers "
                             f"of the first")
        rows.append([float(value) for value in values if value is not None])
    if len(rows) < 2 or len(rows[0]) < 2:
        raise InputError("it has no two lines of two numbers or more")
    table = np.array(rows)
    if len(titles) != table.shape[1]:
        raise InputError(f"its line of titles has {len(titles)} entries for {table.shape[1]} "
                         f"columns; write one for each, such as: time [s], x [mm]")
    if len({parted(title)[0] for title in titles}) < len(titles):
        raise InputError("its line of titles has a name twice; give each column its own")
    return [of_columns(str(path), dict(zip(titles, table.T, strict=True)), units)]


def _titles(line: str) -> list[str]:
    """Titles of a header; they may hold blanks, so that only commas and the like part them."""
    for separator in (";", "\t", ","):
        if separator in line:
            return [word.strip().strip('"') for word in line.split(separator)]
    return re.findall(r"[^\s\[(]+(?:\s*[\[(][^\[\]()]*[\])])?", line)


def _cells(line: str) -> list[str]:
    """Cells of a line; those between commas may be empty."""
    if re.search(r",\s*(,|$)", line) and not re.search(r'[;\t"]', line):
        return [word.strip() for word in line.split(",")]
    return cells(line) if line else []


def _value(word: str) -> float | None:
    """Number of a cell; NaN for an empty one, and for one that says that it has none."""
    return float("nan") if word.lower() in _MISSING else number(word)


def _read_mat(path: Path, units: Mapping[str, str]) -> list[Measurement]:
    with path.open("rb") as stream:
        if stream.read(10) == b"MATLAB 7.3":
            return _read_hdf5(path, units)
    from scipy.io import loadmat

    content = loadmat(path, squeeze_me=True, struct_as_record=False, spmatrix=False)
    return _from_tree({name: _plain(value) for name, value in content.items()
                       if not name.startswith("__")}, str(path), units)


def _plain(value: Any) -> Any:
    """Structures of MATLAB as mappings."""
    if hasattr(value, "_fieldnames"):
        return {name: _plain(getattr(value, name)) for name in value._fieldnames}
    return value


def _read_hdf5(path: Path, units: Mapping[str, str]) -> list[Measurement]:
    import h5py

    def tree(group: Any) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, item in group.items():
            if isinstance(item, h5py.Group):
                if not name.startswith("#"):
                    found[name] = tree(item)
            elif item.dtype.kind in "fiuc" and item.ndim <= 2:
                unit = item.attrs.get("unit", item.attrs.get("units", None))
                title = name if unit is None else f"{name} [{_decoded(unit)}]"
                found[title] = np.asarray(item[()])
            elif item.dtype.kind == "V" and set(item.dtype.names or ()) == {"real", "imag"}:
                both = item[()]
                found[name] = both["real"] + 1j * both["imag"]
        return found

    with open_hdf5(path) as file:
        return _from_tree(tree(file), str(path), units)


def _decoded(text: Any) -> str:
    return text.decode("utf-8", errors="replace") if isinstance(text, bytes) else str(text)


def _from_tree(tree: Mapping[str, Any], source: str, units: Mapping[str, str]
               ) -> list[Measurement]:
    """Measurements at the top of a tree of arrays, and in each of its branches."""
    found = []
    arrays = {name: np.squeeze(value) for name, value in tree.items()
              if isinstance(value, np.ndarray) and value.dtype.kind in "fiuc"}
    own = tree.get("units")
    named = {name: str(unit) for name, unit in own.items()} if isinstance(own, Mapping) else {}
    for title, axis in arrays.items():
        if axis.ndim != 1 or len(axis) < 2 or parted(title)[0].lower() not in AXES:
            continue
        columns: dict[str, Array] = {_with_unit(title, named): axis}
        for name, values in arrays.items():
            if name == title or not values.ndim or len(axis) not in values.shape:
                continue
            name = _with_unit(name, named)
            matrix = values.reshape(len(axis), -1) if values.shape[0] == len(axis) else values.T
            if matrix.shape[1] > _MOST:
                raise InputError(f"{name} has {matrix.shape[1]} columns; at most {_MOST} are "
                                 f"possible")
            text, unit = parted(name)
            for k in range(matrix.shape[1]):
                label = text if matrix.shape[1] == 1 else f"{text} {k + 1}"
                columns[label if unit is None else f"{label} [{unit}]"] = matrix[:, k]
        if len(columns) > 1:
            found.append(of_columns(source, columns, units))
    for name, branch in tree.items():
        if isinstance(branch, Mapping):
            try:
                found += _from_tree(branch, f"{source}: {name}", units)
            except InputError as error:
                if "no vector called" not in str(error):
                    raise
    if not found:
        raise InputError(f"it has no vector called {choices(('time', 't', 'frequency', 'f'))} "
                         f"beside others of its length")
    return found


def _with_unit(title: str, named: Mapping[str, str]) -> str:
    name, unit = parted(title)
    return f"{name} [{named[name]}]" if unit is None and name in named else title
