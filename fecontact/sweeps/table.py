"""Table of a sweep: parameters and summaries of all cases, in memory and as CSV."""

import csv
import json
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import as_path, require_regular_file
from fecontact.core.errors import (
    FecontactError,
    InputError,
    MissingLibraryError,
    choices,
    nearest,
)
from fecontact.core.files.csv_text import csv_text, read_cell
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, html_table, listed, span
from fecontact.laws.own_files import trusting
from fecontact.study.study import Study
from fecontact.sweeps.store import write_whole
from fecontact.system.parameter_labels import parameter_label

if TYPE_CHECKING:
    import pandas
    import xarray

_BEFORE, _AFTER = ("case", "key"), ("status", "reason", "warning")
_SHOWN_CASES = 12  # in a notebook


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class SweepTable(Summarised):
    """Parameters and summaries of the N cases of a sweep.

    Attributes
    ----------
    parameters : mapping of dotted name to (N,) sequence
        Values of the varied parameters.
    values : mapping of name to (N,) array
        Summaries; NaN where a case failed or was not computed.
    keys : (N,) sequence of str
        Keys that identify the cases on disk.
    reasons : (N,) sequence of str or None
        Reason of failure; empty for a case that succeeded, None for one not computed yet.
    shape : tuple of int or None
        Number of values along each axis of a grid; None for other sweeps.
    folder : Path or None
        Folder of the sweep.
    strobed : (N, K) array or None
        Displacements once per period, for stroboscopic sweeps; NaN for failed cases.
    warnings : (N,) sequence of str
        Reasons why runs exceed the limits of the model; empty for runs within them.
    labels : mapping of dotted name to str
        Labels of parameters for axes, where the study says more of them than their names.
    """

    parameters: Mapping[str, Sequence[Any]]
    values: Mapping[str, Array]
    keys: Sequence[str]
    reasons: Sequence[str | None]
    shape: tuple[int, ...] | None = None
    folder: Path | None = field(default=None, compare=False)
    strobed: Array | None = None
    warnings: Sequence[str] = ()
    labels: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.keys)

    def summary(self) -> list[tuple[str, str]]:
        """Short description: number of cases, parameter ranges, names of the summaries."""
        shape = "" if self.shape is None else f", grid {' x '.join(map(str, self.shape))}"
        return [
            ("cases", f"{len(self)}{shape}"), ("failed", f"{len(self.failed)}"),
            ("not computed", f"{len(self.missing)}"),
            ("parameters", listed([f"{name} {_shown_range(values)}"
                                   for name, values in self.parameters.items()])),
            ("summaries", listed(list(self.values), 8)),
        ]

    def _repr_html_(self) -> str:
        cases = range(min(len(self), _SHOWN_CASES))
        rows = [[f"{k}", *(_shown(values[k]) for values in self.parameters.values()),
                 *(_shown(values[k]) for values in self.values.values()),
                 "not computed" if (reason := self.reasons[k]) is None else reason]
                for k in cases]
        title = "; ".join(f"{name}: {text}" for name, text in self.summary()[:3])
        if len(self) > len(cases):
            title += f"; the first {len(cases)} are shown"
        return html_table(f"SweepTable, {title}", rows,
                          ["case", *self.parameters, *self.values, "failed because"])

    @property
    def failed(self) -> dict[int, str]:
        """Indices of failed cases and the reasons."""
        return {k: reason for k, reason in enumerate(self.reasons) if reason}

    @property
    def missing(self) -> list[int]:
        """Indices of the cases not computed yet."""
        return [k for k, reason in enumerate(self.reasons) if reason is None]

    def label(self, parameter: str) -> str:
        """Label of a parameter for axes, with its unit: ``force at B x [N]``."""
        return self.labels.get(parameter) or parameter_label(parameter, Study)

    def changes(self, case: int) -> dict[str, Any]:
        """Changes of a case to the study, for ``study.with_(**table.changes(3)).run()``."""
        return {name: values[case] for name, values in self.parameters.items()}

    def command(self, case: int, study: str | Path, *changes: str) -> str:
        """Command line that runs a case alone, ``fecontact run study.toml --set ground.speed=0.1``.

        ``changes`` are further assignments, such as those that the sweep was started with.
        """
        own = [f"{name}={text_of(value)}" for name, value in self.changes(case).items()]
        return shlex.join(["fecontact", "run", str(study), *(
            word for one in (*changes, *own) for word in ("--set", one))])

    def file(self, case: int) -> Path:
        """Path of the file of a case, for a sweep that keeps files."""
        if self.folder is None:
            raise InputError("The table does not know the folder of its sweep.")
        return self.folder / "cases" / f"{self.keys[case]}.vtkhdf"

    def column(self, name: str) -> Array:
        """Values (N,) of a numeric parameter or summary.

        Raises
        ------
        InputError
            If the column does not exist or is not numeric.
        """
        if name in self.values:
            return self.values[name]
        if name not in self.parameters:
            names = (*self.parameters, *self.values)
            raise InputError(f"The sweep has no column '{name}'{nearest(name, names)}; there are: "
                             f"{choices(names)}.")
        if not is_numeric(self.parameters[name]):
            raise InputError(f"The column '{name}' of the sweep does not hold numbers.")
        return np.array(self.parameters[name], dtype=float)

    def grid(self, name: str) -> Array:
        """Column reshaped to the grid.

        Raises
        ------
        InputError
            If the sweep is not on a grid.
        """
        if self.shape is None:
            raise InputError("The sweep is not a grid; its cases are columns of the table.")
        return self.column(name).reshape(self.shape)

    def to_pandas(self) -> "pandas.DataFrame":
        """The table as a :class:`pandas.DataFrame`, one row per case.

        Columns are those of the CSV file: key, parameters, summaries, status, reason and warning;
        the index is the number of the case.

        Raises
        ------
        MissingLibraryError
            If pandas is not installed.
        """
        try:
            from pandas import DataFrame, RangeIndex
        except ImportError:
            raise MissingLibraryError("pandas is not installed; install it with pip install "
                                      "'fecontact[pandas]'.") from None
        status = [_status(reason) for reason in self.reasons]
        return DataFrame(
            {"key": list(self.keys), **{name: list(column)
                                        for name, column in self.parameters.items()},
             **self.values, "status": status, "reason": [one or "" for one in self.reasons],
             "warning": list(self.warnings) or [""] * len(self)},
            index=RangeIndex(len(self), name="case"))

    def to_xarray(self) -> "xarray.Dataset":
        """The summaries of a grid as an :class:`xarray.Dataset` over the varied parameters.

        ``table.to_xarray().amplitude.sel({"ground.speed": 2e-3}, method="nearest")``. Attributes
        ``units`` are those of the summaries.

        Raises
        ------
        InputError
            If the sweep is not on a grid.
        MissingLibraryError
            If xarray is not installed.
        """
        try:
            from xarray import DataArray, Dataset
        except ImportError:
            raise MissingLibraryError("xarray is not installed; install it with pip install "
                                      "'fecontact[xarray]'.") from None
        from fecontact.sweeps.summaries import unit_of

        labels = {name: list(values) if is_numeric(values) else [text_of(one) for one in values]
                  for name, values in self.parameters.items()}
        axes = {name: list(dict.fromkeys(values)) for name, values in labels.items()}
        shape = tuple(map(len, axes.values()))
        # Tables read from files do not record whether they were grids.
        if list(product(*axes.values())) != list(zip(*labels.values(), strict=True)):
            raise InputError("The sweep is not a grid, so that it has no axes; its cases are rows "
                             "of to_pandas().")
        return Dataset({name: DataArray(values.reshape(shape), dims=tuple(axes),
                                        attrs={"units": unit_of(name)})
                        for name, values in self.values.items()},
                       coords=axes)

    def write(self, path: str | Path) -> Path:
        """Write the table as CSV: case, key, parameters, summaries, status, reason, warning.

        Numbers are written with all digits and read back exactly. Strobed displacements go to
        ``NAME-strobed.csv``, one line per case.
        """
        columns = [*self.parameters.values(), *(column.tolist() for column in self.values.values())]
        rows = ([k, key, *(text_of(column[k]) for column in columns), _status(reason), reason or "",
                 self.warnings[k] if self.warnings else ""]
                for k, (key, reason) in enumerate(zip(self.keys, self.reasons, strict=True)))
        head = [*_BEFORE, *self.parameters, *self.values, *_AFTER]
        write_whole(Path(path), csv_text([head, *rows]))
        if self.strobed is not None:
            lines = "".join(f"{k},{','.join(map(text_of, row))}\n"
                            for k, row in enumerate(self.strobed.tolist()))
            write_whole(_strobed_file(Path(path)), lines)
        return Path(path)


def _status(reason: str | None) -> str:
    return "missing" if reason is None else "failed" if reason else "finished"


def _strobed_file(path: Path) -> Path:
    return path.with_name(f"{path.stem}-strobed.csv")


def is_numeric(values: Sequence[Any]) -> bool:
    """Whether all values are numbers."""
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)


def text_of(value: Any) -> str:
    """Text of a number or text of a study, in cells and on command lines; empty for nan."""
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value)
    return json.dumps(value)


def read_table(path: str | Path) -> SweepTable:
    """Read a table written by :meth:`SweepTable.write`.

    Labels of its parameters come from ``sweep.toml`` in the same folder, if a sweep left it there.

    Raises
    ------
    InputError
        If the file does not exist or is not such a table.
    """
    path = as_path(path, "a table")
    require_regular_file(path, "a table")
    try:
        with path.open(encoding="utf-8", newline="") as file:
            head, *rows = ([read_cell(cell) for cell in row] for row in csv.reader(file))
        first = head.index("status")
        # Parameter names contain dots, except 'gap'; summaries have none before an '@'.
        parameters = [name for name in head[2:first] if _is_parameter(name)]
        columns = dict(zip(head, zip(*rows, strict=True), strict=True))
        return SweepTable(
            {name: tuple(json.loads(text) for text in columns[name]) for name in parameters},
            {name: np.array([float(text or "nan") for text in columns[name]])
             for name in head[2:first] if name not in parameters},
            columns["key"],
            [None if status == "missing" else reason
             for status, reason in zip(columns["status"], columns["reason"], strict=True)],
            folder=path.parent, strobed=_read_strobed(_strobed_file(path), len(rows)),
            warnings=columns["warning"],
            labels=_stored_labels(path.with_name("sweep.toml"), parameters))
    except FileNotFoundError:
        raise InputError(f"{path} does not exist; run the sweep first.") from None
    except InputError:
        raise
    except (OSError, ValueError, KeyError, IndexError, csv.Error, RecursionError):
        raise InputError(f"{path} is not the table of a sweep.") from None


def _stored_labels(path: Path, parameters: Sequence[str]) -> dict[str, str]:
    """Labels of parameters by the study that a sweep keeps; none without that file.

    Laws in files of their own are not run for labels.
    """
    if not path.is_file():
        return {}
    try:
        with trusting(False):
            study = Study.read(path)
    except FecontactError:  # a label is no reason to refuse the numbers of a table
        return {}
    return {name: parameter_label(name, Study, study) for name in parameters}


def _read_strobed(path: Path, count: int) -> Array | None:
    if not path.is_file():
        return None
    with path.open(encoding="utf-8", newline="") as file:
        rows = [[float(text or "nan") for text in row[1:]] for row in csv.reader(file)]
    if len(rows) != count:
        raise InputError(f"{path} has {len(rows)} lines, not one for each of the {count} cases.")
    return np.array(rows)


def _is_parameter(name: str) -> bool:
    return name == "gap" or ("." in name.partition("@")[0] and ".py:" not in name)


def _shown(value: Any) -> str:
    """Display text of a table cell."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _shown_range(values: Sequence[Any]) -> str:
    return span(values) if is_numeric(values) else f"of {len(set(values))} values"
