"""The report of a sweep: a page with a map whose cells show their case."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.units import UNITS, quantity, suitable_unit
from fecontact.output.report.page import page_block, require_page, write_page
from fecontact.output.report.payload import Payload
from fecontact.output.report.run_report import colour_maps
from fecontact.sweeps.summaries import unit_of
from fecontact.sweeps.table import SweepTable, is_numeric


def report_sweep(
    table: SweepTable, path: str | Path, *, title: str | None = None, study: str | None = None,
    command: Callable[[int], str] | None = None,
) -> Path:
    """Write a sweep as one HTML file with a map of its cases; a click on a cell shows its case.

    Axes and colour are chosen on the page among all parameters and summaries. A case is shown by
    its parameters and summaries, with the reason of its failure or its warning.

    Parameters
    ----------
    table : SweepTable
        The sweep.
    path : str or Path
        The .html file; it is replaced if it exists.
    title : str, optional
        Heading; the name of the file by default.
    study : str, optional
        The study, as TOML text.
    command : callable, optional
        Command line that runs the case of a number alone; see :meth:`SweepTable.command`.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        For a sweep without cases, another suffix, or a file that cannot be written.
    """
    require_kind("report_sweep", SweepTable, table=table)
    path = require_page(path)
    if not len(table):
        raise InputError("The sweep has no cases to report.")
    title, payload = path.stem if title is None else title, Payload()
    columns = [_parameter(table.label(name), values)
               for name, values in table.parameters.items()]
    varied = [k for k, column in enumerate(columns) if len(set(column["values"])) > 1] or [0]
    columns += [_summary(name, values) for name, values in table.values.items()]
    first = min(len(table.parameters), len(columns) - 1)
    failed, missing = len(table.failed), len(table.missing)
    names = [column.get("labels") for column in columns]
    header: dict[str, Any] = {
        "cases": len(table),
        "status": f"{len(table)} cases, {failed} failed, {missing} not computed",
        "good": not failed and not missing,
        "notes": [],
        "facts": [list(row) for row in table.summary()],
        "columns": columns,
        "start": [varied[0], varied[1] if len(varied) > 1 else first, first],
        "remarks": "; ".join(
            f"{column['title']}: {', '.join(f'{k} {one}' for k, one in marked)}"
            for column, labels in zip(columns, names, strict=True)
            if labels and (marked := list(enumerate(labels)))),
        "headings": ["case", *table.parameters, *table.values, "failed because", "warning",
                     "run it alone"],
        "rows": [[*_row(table, case), "" if command is None else command(case)]
                 for case in range(len(table))],
        "shades": colour_maps()["displacement"],
    }
    return write_page(path, title, page_block(title, header, payload, study, ["sweep"]), "sweep")


def _parameter(label: str, values: Sequence[Any]) -> dict[str, Any]:
    """A column of a parameter; texts and tables are numbered, geometric series by their powers."""
    if not is_numeric(values):
        texts = [str(value) for value in values]
        labels = list(dict.fromkeys(texts))
        return {"title": label, "values": [labels.index(text) for text in texts], "labels": labels}
    found = sorted({float(value) for value in values})
    if len(found) > 2 and found[0] > 0.0 and np.ptp(np.diff(np.log(found))) < 1e-6:
        return {"title": f"log10 of {label}",
                "values": [math.log10(value) for value in values]}
    return {"title": label, "values": [float(value) for value in values]}


def _summary(name: str, values: Any) -> dict[str, Any]:
    """A column of a summary in a suitable unit; null where it is missing."""
    known, unit = values[np.isfinite(values)], unit_of(name)
    factor, symbol = 1.0, unit
    if unit in UNITS and len(known):
        factor, symbol = suitable_unit(float(np.abs(known).max()), unit)
    shown = name.replace("_", " ")
    return {"title": f"{shown} [{symbol}]" if symbol else shown,
            "values": [float(value) / factor if math.isfinite(value) else None
                       for value in values]}


def _row(table: SweepTable, case: int) -> list[str]:
    """Texts of the cells of a case, in the order of the headings."""
    def text(value: Any) -> str:
        return f"{value:.7g}" if isinstance(value, float) else str(value)

    summaries = []
    for name, values in table.values.items():
        value, unit = float(values[case]), unit_of(name)
        shown = quantity(value, unit, 7) if unit in UNITS else f"{text(value)} {unit}".strip()
        summaries.append(shown if math.isfinite(value) else "")
    reason = table.reasons[case]
    return [f"{case}", *(text(values[case]) for values in table.parameters.values()), *summaries,
            "not computed" if reason is None else reason,
            table.warnings[case] if table.warnings else ""]
