"""Charts of a page: histories, spectra, phase portraits and energies."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.analysis.histories import History, Point
from fecontact.analysis.spectra import amplitude_spectrum
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots.analysis import LOWEST_DECADES, end_of_content
from fecontact.output.plots.run import usual_points
from fecontact.output.plots.run_diagrams import (
    AXES,
    Diagram,
    energy_diagrams,
    force_diagrams,
    labelled,
    motion_diagrams,
)
from fecontact.output.plots.style import distinct_colours
from fecontact.output.report.payload import SMALLEST, Payload

_STEP = 1e-4  # of curves, of their largest value
_FREQUENCIES = 800  # points of a spectrum
_FEWEST = 16  # output times of a spectrum
_FLAT = 1e-9  # of the largest motion, below which a spectrum is round-off


def chart_tables(
    run: Trajectory, points: Sequence[Point], payload: Payload
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Charts over time, and phase portraits as pairs of their curves.

    Curves that stay zero are left out, and so are charts without curves.
    """
    shown = [(key, one) for key, one in motion_diagrams(
        run, tuple(points) or usual_points(run)).items() if one.curves]
    charts = [chart_table(one, payload) for _, one in shown]
    place = {(*key, curve.name): (chart, row) for chart, (key, one) in enumerate(shown)
             for row, curve in enumerate(one.curves)}
    phases = [{"title": f"{name}, {AXES[axis]}", "x": place["displacement", axis, name], "y": at}
              for (what, axis, name), at in place.items()
              if what == "velocity" and ("displacement", axis, name) in place]
    charts += [chart_table(one, payload) for one in force_diagrams(run) if one.largest > 0.0]
    return charts, phases


def energy_charts(run: Trajectory, payload: Payload) -> list[dict[str, Any]]:
    """Charts of stored energy, work put in and energy lost, each with its total."""
    return [chart_table(one, payload) for one in energy_diagrams(run) if len(one.curves) > 1]


def spectrum_tables(
    run: Trajectory, points: Sequence[Point], payload: Payload
) -> list[dict[str, Any]]:
    """Charts of the velocity spectra of points, one for each direction in which they move."""
    d = run.system.basis.dimension
    points = tuple(points) or usual_points(run)
    colours, charts = distinct_colours(len(points)), []
    motions = [run.velocity(point)[:, :d] for point in points]
    largest = max((float(np.abs(one).max()) for one in motions), default=0.0)
    for axis, letter in enumerate("xyz"[:d]):
        lines = [(labelled(point, run), colour, run.time, History(one[:, axis], "m/s", ""))
                 for point, colour, one in zip(points, colours, motions, strict=True)
                 if np.ptp(one[:, axis]) > _FLAT * largest]
        chart = spectrum_table(f"velocity {letter}", lines, payload) if lines else None
        if chart is not None:
            charts.append(chart)
    return charts


def spectrum_table(
    title: str, lines: Sequence[tuple[str, str, Array, History]], payload: Payload
) -> dict[str, Any] | None:
    """A chart of amplitude spectra on a common axis of frequencies; None without motion.

    Values are common logarithms of amplitudes in the unit of the chart.
    """
    if any(len(time) < _FEWEST for _, _, time, _ in lines):
        return None
    found = [amplitude_spectrum(time, one.values, resample=True) for _, _, time, one in lines]
    largest = max(float(one.values.max()) for one in found)
    if not 0.0 < largest < np.inf:
        return None
    factor, symbol = suitable_unit(largest, lines[0][3].unit)
    end = max(end_of_content(one.frequency_hz, one.values) for one in found)
    edges = np.linspace(0.0, end, _FREQUENCIES + 1)
    floor = largest * 10.0**-(LOWEST_DECADES + 1.0)
    columns = []
    for one in found:
        # The largest amplitude between two frequencies, so that no peak is lost.
        middles = 0.5 * (edges[:-1] + edges[1:])
        values = np.interp(middles, one.frequency_hz, one.values, right=0.0)
        inside = one.frequency_hz < end
        np.maximum.at(values, np.searchsorted(edges, one.frequency_hz[inside], side="right") - 1,
                      one.values[inside])
        columns.append(np.log10(np.maximum(values, floor) / factor))
    return {"title": title, "unit": symbol, "decades": LOWEST_DECADES,
            "lines": [{"name": name, "colour": colour} for name, colour, _, _ in lines],
            "frequency": payload.add(0.5 * (edges[:-1] + edges[1:]), 1e-6 * end),
            "values": payload.add(np.column_stack(columns), 1e-3)}


def chart_table(diagram: Diagram, payload: Payload) -> dict[str, Any]:
    """A chart of a diagram, stored in the unit in which it is shown."""
    factor, symbol = diagram.scale
    values = np.column_stack([one.values for one in diagram.curves]) / factor
    return {"title": diagram.title, "unit": symbol, "factor": factor,
            "lines": [{"name": one.name, "colour": one.colour} for one in diagram.curves],
            "values": payload.add(values, max(_STEP * diagram.largest / factor, SMALLEST))}
