"""Charts of a page: histories, spectra, phase portraits and energies."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.analysis.histories import History, Point, is_relative, point_name
from fecontact.analysis.spectra import amplitude_spectrum
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots.analysis import LOWEST_DECADES, end_of_content
from fecontact.output.plots.run import ENERGY_TERMS, usual_points
from fecontact.output.plots.style import ENERGY_COLOURS, distinct_colours
from fecontact.output.report.payload import SMALLEST, Payload
from fecontact.reduction.assembly.contact_faces import contact_faces, several_bodies

_STEP = 1e-4  # of curves, of their largest value
_FREQUENCIES = 800  # points of a spectrum
_FEWEST = 16  # output times of a spectrum
_FLAT = 1e-9  # of the largest motion, below which a curve is round-off


def chart_tables(
    run: Trajectory, points: Sequence[Point], payload: Payload
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Charts over time, and phase portraits as pairs of their curves.

    Curves that stay zero are left out, and so are charts without curves.
    """
    d = run.system.basis.dimension
    points = tuple(points) or usual_points(run)
    names = [_name(point, run) for point in points]
    colours = distinct_colours(len(points))
    charts: list[dict[str, Any]] = []
    moved: dict[tuple[str, int, int], tuple[int, int]] = {}
    for what, unit in (("displacement", "m"), ("velocity", "m/s")):
        values = [getattr(run, what)(point) for point in points]
        largest = max((float(np.abs(one[:, :d]).max()) for one in values), default=0.0)
        for axis, letter in enumerate("xyz"[:d]):
            curves = {k: one[:, axis] for k, one in enumerate(values)
                      if np.abs(one[:, axis]).max() > _FLAT * largest}
            if not curves:
                continue
            moved |= {(what, axis, k): (len(charts), row) for row, k in enumerate(curves)}
            charts.append(table_of_curves(f"{what} {letter}", unit, [
                (names[k], colours[k], curve) for k, curve in curves.items()], payload))
    phases = [{"title": names[k] + f", {'xyz'[axis]}", "x": moved["displacement", axis, k],
               "y": place} for (what, axis, k), place in moved.items()
              if what == "velocity" and ("displacement", axis, k) in moved]
    faces = contact_faces(run.system.basis)
    shades = distinct_colours(len(faces))
    for title, sums in _total_forces(run, [face.nodes for face in faces]):
        totals = [(face.name, shade, total)
                  for face, shade, total in zip(faces, shades, sums, strict=True)]
        if any(total.any() for _, _, total in totals):
            charts.append(table_of_curves(title, "N", totals, payload))
    return charts, phases


def _total_forces(run: Trajectory, faces: Sequence[slice]) -> list[tuple[str, list[Array]]]:
    """Titles and total forces (N,) of each face; of solids friction along both tangents."""
    found = [("total normal force", [run.normal_force[:, nodes].sum(axis=1) for nodes in faces])]
    totals = [run.friction_forces[:, nodes].sum(axis=1) for nodes in faces]
    if run.system.basis.dimension == 2:
        return [*found, ("total friction force", [total[:, 0] for total in totals])]
    ways = ("t", "t2") if several_bodies(run.system.basis) else ("-x", "-y")
    found += [(f"total friction force along {way}", [total[:, k] for total in totals])
              for k, way in enumerate(ways)]
    return [*found, ("magnitude of the total friction force",
                     [np.linalg.norm(total, axis=1) for total in totals])]


def energy_charts(run: Trajectory, payload: Payload) -> list[dict[str, Any]]:
    """Charts of stored energy, work put in and energy lost, each with its total."""
    energies, charts = run.energies, []
    for title, total, names in ENERGY_TERMS:
        terms = {name: getattr(energies, name) for name in names}
        shown = [(name.removesuffix("_work").replace("_", " "), ENERGY_COLOURS[name], term)
                 for name, term in terms.items() if term.any()]
        if shown:
            charts.append(table_of_curves(
                title, "J", [*shown, ("total", "", getattr(energies, total))], payload))
    return charts


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
        lines = [(_name(point, run), colour, run.time, History(one[:, axis], "m/s", ""))
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


def _name(point: Point, run: Trajectory) -> str:
    basis = run.system.basis
    own = " (t, n)" if basis.dimension == 2 else " (t, t2, n)"
    return point_name(point, basis) + own * is_relative(point, basis)


def table_of_curves(
    title: str, unit: str, lines: Sequence[tuple[str, str, Array]], payload: Payload
) -> dict[str, Any]:
    """A chart of curves (N,), stored in the unit in which they are shown."""
    values = np.column_stack([line for _, _, line in lines])
    largest = float(np.abs(values).max())
    factor, symbol = suitable_unit(largest, unit)
    shown = values / factor
    return {"title": title, "unit": symbol, "factor": factor,
            "lines": [{"name": name, "colour": colour} for name, colour, _ in lines],
            "values": payload.add(shown, max(_STEP * largest / factor, SMALLEST))}
