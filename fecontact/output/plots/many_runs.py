"""Pictures of many runs: runs over each other, basins of attraction, diagrams of brute force."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from fecontact.analysis.comparison import compared_points, require_runs
from fecontact.analysis.histories import Point, component_of, history
from fecontact.analysis.spectra import amplitude_spectrum
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError
from fecontact.core.types import ArrayLike
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.diagrams.maps import Map, Scale, basin_map, borders
from fecontact.output.diagrams.spectra import spectrum_diagram
from fecontact.output.plots.drawing import draw
from fecontact.output.plots.figure import new_figure
from fecontact.reduction.modal_basis import Component
from fecontact.system.contact_system import ContactSystem
from fecontact.system.parameter_labels import parameter_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fecontact.bifurcation.attractors.basins import Basins
    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan

_COLUMNS, _ROWS = 1600, 800  # cells of the picture, at most
_DARKEST = 0.98  # part of the cells that are met which are not the darkest


def plot_runs(
    runs: Mapping[str, Trajectory], quantity: str = "velocity", point: Point | None = None,
    component: str | None = None, *, highest_hz: float | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """Plot histories of runs over each other, and their amplitude spectra.

    Parameters
    ----------
    runs : mapping of name to Trajectory
        Two runs or more.
    quantity, point, component
        See :func:`fecontact.analysis.history`; by default B, or the contact node in the middle,
        and the direction of the drive.
    highest_hz : float, optional
        End of the axis of the spectra [Hz].
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For fewer than two runs, a quantity or a point that a run does not have, another suffix, or
        a file that cannot be written.
    """
    require_runs("plot_runs", runs)
    first = next(iter(runs.values()))
    point = compared_points(runs)[0] if point is None else point
    component = component_of(first) if component is None else component
    found = [history(run, quantity, point, component) for run in runs.values()]
    spectra = [amplitude_spectrum(run.time, one.values, resample=True)
               for run, one in zip(runs.values(), found, strict=True)]
    colours = distinct_colours(len(runs))
    histories = Diagram("time [s]", f"{found[0].title} [{found[0].unit}]", tuple(
        Curve(name, colour, run.time, one.values, 1.0)
        for (name, run), one, colour in zip(runs.items(), found, colours, strict=True)))
    with new_figure(10.0, 6.6, path) as figure:
        upper, lower = figure.subplots(2, 1)
        draw(upper, histories)
        draw(lower, spectrum_diagram(spectra, f"amplitude [{found[0].unit}]", [""] * len(runs),
                                     colours, highest_hz=highest_hz))
        figure.legend(loc="outside upper center", ncols=min(len(runs), 4))
    return figure


def plot_basins(
    found: "Basins", *, x_label: str | None = None, y_label: str | None = None,
    rows: ArrayLike | None = None, path: str | Path | None = None,
) -> "Figure":
    """Plot the basins of attraction, each with its share of the plane.

    Parameters
    ----------
    found : Basins
        Result of :func:`fecontact.bifurcation.basins`; the first axis goes along x.
    x_label, y_label : str, optional
        Labels of the axes, with SI units, such as ``y [m]``; ticks are in a unit that suits the
        values.
    rows : (2, size) array, optional
        Rows that give the two quantities of the plane from a state
        (:meth:`fecontact.bifurcation.Axis.row`); with them the sections of the
        motions are marked.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    from fecontact.bifurcation.attractors.basins import Basins

    require_kind("plot_basins", Basins, found=found)
    with new_figure(8.0, 5.2, path) as figure:
        axis = figure.subplots()
        diagram = Diagram(x_label or "", y_label or "", maps=(basin_map(found),))
        shown = diagram.maps[0]
        colours, opacity = shown.scale.colours, shown.opacity
        draw(axis, diagram)
        box = axis.get_xlim(), axis.get_ylim()
        handles: list[Line2D | Patch] = [
            Patch(color=colours[k + 1], alpha=opacity, label=f"{_described(one.kind, one.points)}, "
                                                          f"{100.0 * one.share:.3g} %")
            for k, one in enumerate(found.attractors)]
        lost = float((found.label < 0).mean())
        if lost:
            handles.append(Patch(facecolor=colours[0], edgecolor="#8a8a8a",
                                 label=f"no end, {100.0 * lost:.3g} %"))
        if rows is not None:
            chosen = np.asarray(rows, dtype=float)
            for k, one in enumerate(found.attractors):
                places = one.points @ chosen.T
                axis.plot(places[:, 0], places[:, 1], "o", color=colours[k + 1], markersize=6.0,
                          markeredgecolor="#202020", linestyle="none")
            handles.append(Line2D([], [], color="#ffffff", marker="o", markeredgecolor="#202020",
                                  linestyle="none", label="its section"))
        axis.set(xlim=box[0], ylim=box[1])
        axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _described(kind: str, points: np.ndarray) -> str:
    return f"{kind}, {len(points)} points" if kind == "periodic" and len(points) > 1 else kind


def plot_poincare_scan(
    found: "PoincareScan", point: str | int = "B", component: Component | None = None,
    of: Literal["displacement", "velocity"] = "displacement", *,
    x_label: str | None = None, y_label: str | None = None, path: str | Path | None = None,
) -> "Figure":
    """Plot how often states on a section meet each value of a quantity, over the parameter.

    The darker a cell, the more of the states at its parameter values lie in it, up and down taken
    together; the scale is logarithmic. Periodic motions are lines, chaos shades.

    Parameters
    ----------
    found : PoincareScan
        Result of :func:`fecontact.bifurcation.poincare_scan`.
    point, component, of
        The quantity; see :meth:`fecontact.bifurcation.PoincareScan.observed`.
    x_label, y_label : str, optional
        Labels of the axes, with SI units, such as ``y [m]``; ticks are in a unit that suits the
        values.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For an unknown quantity, another suffix, or a file that cannot be written.
    AnalysisError
        If no run could go on.
    """
    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan

    require_kind("plot_poincare_scan", PoincareScan, found=found)
    seen = np.hstack([each for each in found.observed(point, component, of) if each.size])
    values = np.repeat(found.values, seen.shape[1])[np.isfinite(seen).ravel()]
    heights = seen[np.isfinite(seen)]
    if not len(heights):
        raise AnalysisError("plot_poincare_scan: no run of the diagram could go on.")
    edges = _edges(found.values)
    low, high = float(heights.min()), float(heights.max())
    margin = 0.03 * (high - low) or 0.5 * abs(high) or 0.5
    counts, _, rows = np.histogram2d(
        values, heights, [edges, np.linspace(low - margin, high + margin, _ROWS + 1)])
    # Columns may hold different numbers of values.
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    met = share[share > 0.0]
    with new_figure(9.0, 5.2, path) as figure:
        axis = figure.subplots()
        draw(axis, Diagram(
            x_label or _parameter(found), y_label or _named(found, point, component, of), maps=(
                Map(edges, rows, np.where(share > 0.0, share, np.nan).T, Scale(
                    colours="Blues", low=0.2 * float(met.min()),
                    high=float(np.quantile(met, _DARKEST)), logarithmic=True)),)))
    return figure


def _edges(values: np.ndarray) -> np.ndarray:
    """Edges of columns with one value or more each."""
    step = max(len(values) / _COLUMNS, 1.0)
    first = np.unique(np.arange(0.0, len(values), step).astype(int))
    return borders(values)[[*first, len(values)]]


def _parameter(found: "PoincareScan") -> str:
    system = found.system if isinstance(found.system, ContactSystem) else None
    return parameter_label(found.parameter, system=system)


def _named(
    found: "PoincareScan", point: str | int, component: Component | None, of: str,
) -> str:
    """The quantity, with its unit if it has one."""
    if not isinstance(found.system, ContactSystem):
        return str(point)
    along = component or "y"
    unit = "rad" if along.startswith("phi") else "m"
    return f"{of} {along} of {point} [{unit}{'/s' if of == 'velocity' else ''}]"
