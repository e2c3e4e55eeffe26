"""The report of a comparison: a page with several runs over each other."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.analysis.comparison import compare_runs, compared_points
from fecontact.analysis.histories import Point, component_of, history
from fecontact.core.errors import InputError
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.report.charts import diagram_table, spectrum_table
from fecontact.output.report.page import page_block, require_page, write_page
from fecontact.output.report.payload import Payload

_OUTPUTS = 4000  # of the common time of all runs


def report_runs(
    runs: Mapping[str, Trajectory], path: str | Path, *, title: str | None = None,
    points: Sequence[str | int] = (), component: str | None = None,
    studies: Sequence[str | None] = (),
) -> Path:
    """Write a comparison of runs as one HTML file that opens in any browser, without a network.

    It shows key numbers side by side with their changes from the first run, the parameters that
    differ, histories over each other in the time that all runs have, and spectra.

    Parameters
    ----------
    runs : mapping of name to Trajectory
        Two runs or more; the first is the reference.
    path : str or Path
        The .html file; it is replaced if it exists.
    title : str, optional
        Heading; the names of the runs by default.
    points : sequence of str or int
        Points of histories and spectra; B by default, or the contact node in the middle.
    component : str, optional
        Direction of motion; that of the drive by default.
    studies : sequence of str or None
        Study of each run, as TOML text.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        As in :func:`fecontact.analysis.compare_runs`, for motions that are not finite, another
        suffix, or a file that cannot be written.
    """
    path = require_page(path)
    found = compare_runs(runs, points, studies=studies)
    for name, run in runs.items():
        bad = np.flatnonzero(~np.isfinite(run.states).all(axis=1))
        if len(bad):
            raise InputError(f"{name} has a motion that is not finite at t = "
                             f"{run.time[bad[0]]:.6g} s; run it again, or compare a part without "
                             f"this time, in Python by its method between.")
    first = next(iter(runs.values()))
    component = component_of(first) if component is None else component
    chosen: Sequence[Point] = compared_points(runs, points)
    payload, colours = Payload(), distinct_colours(len(runs))
    begin = max(float(run.time[0]) for run in runs.values())
    end = min(float(run.time[-1]) for run in runs.values())
    time = np.linspace(begin, end, _OUTPUTS) if end > begin else None
    wanted: list[tuple[str, Point, str]] = [
        (quantity, point, component) for point in chosen
        for quantity in ("displacement", "velocity")]
    if all(run.basis.contact_nodes for run in runs.values()):
        wanted += [("total_normal_force", "B", "x"), ("total_friction_force", "B", "x")]
    charts: list[dict[str, Any]] = []
    spectra: list[dict[str, Any]] = []
    for wish in wanted:
        histories = [history(run, *wish) for run in runs.values()]
        if not any(one.values.any() for one in histories):
            continue
        title_of, unit = histories[0].title, histories[0].unit
        curves = tuple(Curve(name, colour, run.time, one.values) for (name, run), one, colour
                       in zip(runs.items(), histories, colours, strict=True))
        if time is not None:
            charts.append(diagram_table(Diagram("time [s]", f"{title_of} [{unit}]", tuple(
                replace(one, x=time, y=np.interp(time, one.x, one.y)) for one in curves)),
                payload, over_time=True))
        if wish[0] == "velocity":
            spectra += spectrum_table(title_of, unit, curves, payload)
    notes = [f"{name}: {run.status.value}" for name, run in runs.items()
             if run.status not in (Status.FINISHED, Status.EVENT)]
    if time is None:
        notes.append("The runs have no time in common; their histories are left out.")
    title = " and ".join(runs) if title is None else title
    header: dict[str, Any] = {
        "names": list(found.names),
        "status": f"{len(runs)} runs; changes are relative to {found.names[0]}",
        "good": len(notes) == 0, "notes": notes,
        "numbers": [list(row) for row in found.number_rows()],
        "parameters": [list(row) for row in found.parameter_rows()],
        "same": "All parameters that the files hold are equal.",
        "time": None if time is None else payload.add(time, 1e-9 * (end - begin)),
        "charts": charts, "spectra": spectra,
    }
    return write_page(path, title, page_block(title, header, payload), "runs")
