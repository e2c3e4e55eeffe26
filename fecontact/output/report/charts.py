"""Charts of a page: histories, phase portraits and energies."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.analysis.histories import Point, is_relative, point_name
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots.run import ENERGY_TERMS, usual_points
from fecontact.output.plots.style import ENERGY_COLOURS, distinct_colours
from fecontact.output.report.payload import SMALLEST, Payload
from fecontact.reduction.assembly.contact_faces import contact_faces, several_bodies

_STEP = 1e-4  # of curves, of their largest value
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
            charts.append(_chart(f"{what} {letter}", unit, [
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
            charts.append(_chart(title, "N", totals, payload))
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
            charts.append(_chart(title, "J", [*shown, ("total", "", getattr(energies, total))],
                                 payload))
    return charts


def _name(point: Point, run: Trajectory) -> str:
    basis = run.system.basis
    own = " (t, n)" if basis.dimension == 2 else " (t, t2, n)"
    return point_name(point, basis) + own * is_relative(point, basis)


def _chart(
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
