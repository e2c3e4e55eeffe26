"""Diagrams as parts of a page, and those of a run: histories, spectra, phase planes, energies."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.analysis.histories import Point, observes_motion
from fecontact.analysis.spectra import amplitude_spectrum, spectrogram
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.diagrams.labels import in_unit, name_and_unit
from fecontact.output.diagrams.maps import Map, spectrogram_map
from fecontact.output.diagrams.runs import (
    AXES,
    energy_diagrams,
    force_diagrams,
    labelled,
    motion_diagrams,
    usual_points,
)
from fecontact.output.diagrams.spectra import end_of_content, spectrum_diagram
from fecontact.output.report.payload import SMALLEST, Payload

_OVER_TIME = 1e-4  # error of curves over time, as a part of their largest value
_STEP = 1e-5  # error of other ordinates
_ACROSS = 1e-6  # error of abscissae, as a part of their range
_SHADES = 64  # of a map of numbers
_ROWS = 160  # frequencies of a spectrogram, at most
_FEWEST = 16  # output times of a spectrum
_FLAT = 1e-9  # of the largest motion, below which a spectrum is round-off


def diagram_table(
    diagram: Diagram, payload: Payload, *, over_time: bool = False
) -> dict[str, Any]:
    """A diagram as a part of a page, in the units in which it is shown.

    Logarithmic axes hold common logarithms. Curves ``over_time`` have the times of the page as
    their abscissae.
    """
    (x_factor, x_label), (factor, y_label) = diagram.x_unit, diagram.y_unit
    name, unit = name_and_unit(y_label)

    def shown(axis: str, values: Array) -> Array:
        values = np.asarray(values, dtype=float) / (x_factor if axis == "x" else factor)
        return np.log10(values) if axis in diagram.logarithmic else values

    limits = {axis: [None if end is None else float(shown(axis, np.array(end))) for end in ends]
              for axis, ends in (("x", diagram.x_limits),
                                 ("y", diagram.flat_range or diagram.y_limits))
              if ends != (None, None) and not (over_time and axis == "x")}
    lines = []
    for curve in diagram.curves:
        y = shown("y", curve.y)
        step = max(_OVER_TIME * diagram.largest / factor if over_time
                   else _STEP * float(np.abs(y).max(initial=0.0)), SMALLEST)
        line: dict[str, Any] = {"name": f"{diagram.heading} {curve.name}".strip(),
                                "colour": curve.colour, "width": curve.width,
                                "y": payload.add(y, step)}
        if curve.marker:
            line["marker"] = curve.marker
        bars = None if curve.bars is None else (curve.y - curve.bars, curve.y + curve.bars)
        line |= {name: [payload.add(shown("y", end), step) for end in ends]
                 for name, ends in (("bars", bars), ("limits", curve.limits)) if ends is not None}
        if not over_time:
            x = shown("x", curve.x)
            size = max(float(np.ptp(x)), _ACROSS * float(np.abs(x).max()))
            line["x"] = payload.add(x, max(_ACROSS * size, SMALLEST))
        solid = curve.solid
        if solid is not None and not solid.all():
            line["solid"] = payload.add(solid)
        lines.append(line)
    maps = [_map_table(one, shown, payload) for one in diagram.maps]
    return {"title": diagram.title or name, "unit": unit, "factor": factor, "xLabel": x_label,
            "log": diagram.logarithmic, "limits": limits, "lines": lines,
            "maps": maps,
            "levels": [[level.axis, float(shown(level.axis, np.array(level.value)))]
                       for level in diagram.levels],
            "marks": [[float(shown("x", np.array(mark.x))), float(shown("y", np.array(mark.y))),
                       mark.letters or mark.kind] for mark in diagram.marks]}


def _map_table(
    one: Map, shown: Callable[[str, Array], Array], payload: Payload
) -> dict[str, Any]:
    """A map as a part of a page: borders, the number of each cell's colour, and the colours."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    scale, (low, high) = one.scale, one.ends
    values = one.values
    if isinstance(scale.colours, str):
        colours = colormaps[scale.colours](np.linspace(0.0, 1.0, _SHADES))[:, :3]
        if scale.logarithmic:
            low, high, values = np.log(low), np.log(high), np.log(values)
        values = np.clip(np.rint((_SHADES - 1) * (values - low) / (high - low)), 0, _SHADES - 1)
    else:
        colours = np.array([to_rgb(name) for name in scale.colours])
    factor, label = in_unit(scale.label, np.array(one.ends))
    edges = {axis: shown(axis, getattr(one, axis)) for axis in ("x", "y")}
    return {**{axis: payload.add(at, max(_ACROSS * float(np.ptp(at)), SMALLEST))
               for axis, at in edges.items()},
            "cells": payload.add(np.where(np.isfinite(values), values + 1.0, 0.0).ravel()),
            "shades": np.rint(255.0 * colours).astype(int).tolist(), "names": list(scale.names),
            "label": label, "ends": [*scale.names[:1], *scale.names[-1:]]
            or [f"{end / factor:.4g}" for end in one.ends]}


def chart_tables(
    run: Trajectory, points: Sequence[Point], payload: Payload
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Charts over time, and phase planes as pairs of their curves.

    Curves that stay zero are left out, and so are charts without curves.
    """
    shown = [(key, one) for key, one in motion_diagrams(
        run, tuple(points) or _usual_points(run)).items() if one.curves]
    charts = [diagram_table(one, payload, over_time=True) for _, one in shown]
    place = {(*key, curve.name): (chart, row) for chart, (key, one) in enumerate(shown)
             for row, curve in enumerate(one.curves)}
    phases = [{"title": f"{name}, {AXES[axis]}", "x": place["displacement", axis, name], "y": at}
              for (what, axis, name), at in place.items()
              if what == "velocity" and ("displacement", axis, name) in place]
    charts += [diagram_table(one, payload, over_time=True)
               for one in force_diagrams(run) if one.largest > 0.0]
    return charts, phases


def _usual_points(run: Trajectory) -> tuple[Point, ...]:
    """Default points of a page; none where the run observes no motion."""
    return usual_points(run) if observes_motion(run.basis) else ()


def energy_charts(run: Trajectory, payload: Payload) -> list[dict[str, Any]]:
    """Charts of stored energy, work put in and energy lost, each with its total."""
    return [diagram_table(one, payload, over_time=True)
            for one in energy_diagrams(run) if len(one.curves) > 1]


def spectrum_tables(
    run: Trajectory, points: Sequence[Point], payload: Payload
) -> list[dict[str, Any]]:
    """Charts of the velocity spectra of points, one for each direction in which they move."""
    d = run.basis.dimension
    points = tuple(points) or _usual_points(run)
    motions = [run.velocity(point)[:, :d] for point in points]
    largest = max((float(np.abs(one).max()) for one in motions), default=0.0)
    charts = []
    for axis, letter in enumerate(AXES[:d]):
        lines = [Curve(labelled(point, run), colour, run.time, one[:, axis])
                 for point, colour, one in zip(points, distinct_colours(len(points)), motions,
                                               strict=True)
                 if np.ptp(one[:, axis]) > _FLAT * largest]
        if found := spectrum_table(f"velocity {letter}", "m/s", lines, payload) if lines else []:
            charts += [*found, *spectrogram_charts(f"velocity {letter}", "m/s", lines[0], payload)]
    return charts


def spectrogram_charts(
    title: str, unit: str, line: Curve, payload: Payload
) -> list[dict[str, Any]]:
    """A chart of the amplitudes of a history over time and frequency; none for a short history."""
    try:
        found = spectrogram(line.x, line.y, resample=True)
    except InputError:  # too few periods
        return []
    if len(found.time) < _FEWEST:
        return []
    end = end_of_content(found.frequency_hz, found.values.max(axis=1))
    kept = max(int(np.searchsorted(found.frequency_hz, end)) + 1, 2)
    step = -(-kept // _ROWS)
    thin = replace(found, frequency_hz=found.frequency_hz[:kept:step], values=np.maximum.reduceat(
        found.values[:kept], np.arange(0, kept, step), axis=0))
    return [diagram_table(Diagram(
        "time [s]", "frequency [Hz]", maps=(spectrogram_map(thin, unit),),
        title=f"{' of '.join(filter(None, (title, line.name)))}: frequency over time"), payload)]


def spectrum_table(
    title: str, unit: str, histories: Sequence[Curve], payload: Payload
) -> list[dict[str, Any]]:
    """A chart of the amplitude spectra of histories; empty without motion or for a short one."""
    if any(len(one.x) < _FEWEST for one in histories):
        return []
    found = [amplitude_spectrum(one.x, one.y, resample=True) for one in histories]
    if not 0.0 < max(float(one.values.max()) for one in found) < np.inf:
        return []
    return [diagram_table(spectrum_diagram(
        found, f"amplitude [{unit}]", [one.name for one in histories],
        [one.colour for one in histories], title=title), payload)]
