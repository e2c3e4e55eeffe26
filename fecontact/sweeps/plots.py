"""Plots of sweeps: curves, maps, scatter plots, strobed displacements, Sobol indices."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, require_choice
from fecontact.core.types import Array
from fecontact.output.diagrams.colours import COLOURS, distinct_colours
from fecontact.output.diagrams.diagram import Curve, Diagram
from fecontact.output.diagrams.maps import Map, Scale, borders
from fecontact.output.plots.drawing import colour_bar, draw, name_axis
from fecontact.output.plots.figure import new_figure
from fecontact.study.study import Study
from fecontact.sweeps.statistics import SobolIndices
from fecontact.sweeps.summaries import unit_of
from fecontact.sweeps.table import SweepTable, is_numeric
from fecontact.system.parameter_labels import parameter_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_FAILED = "#c8c4bc"
_LEAST_OF_MAP = 3  # values of each parameter
_LEAST_OF_DOTS = 200  # cases up to which ascending ones are joined by a line
_AXES: tuple[Literal["x", "y"], ...] = ("x", "y")
_LETTERS = 9.0  # of names along an axis, per inch
_MOST_TICKS, _SHORT = 8, 4  # named cells along an axis of a map, and digits of their values


def plot_sweep(
    table: SweepTable, name: str, over: Sequence[str] | None = None, *,
    kind: Literal["map", "curves", "scatter"] | None = None, path: str | Path | None = None,
) -> "Figure":
    """Plot a summary of a sweep over the varied parameters.

    A grid of two parameters with three or more values each gives a map. A grid of one parameter
    gives a curve, as does one of two if the second has two or non-numeric values (a curve for
    each). All other sweeps give a scatter plot for each parameter and a histogram.

    Parameters
    ----------
    table : SweepTable
        Result of :func:`fecontact.sweep`.
    name : str
        The summary.
    over : one or two parameters, optional
        One for curves, two for a map at the first value of all other parameters.
    kind : 'map', 'curves' or 'scatter', optional
        The plot, where another than the one above is wanted; curves and maps are those of grids of
        one or two parameters.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a summary or parameter that does not exist, a kind that the sweep does not allow, a
        sweep of one case, another suffix, or a file that cannot be written.
    """
    require_kind("plot_sweep", SweepTable, table=table)
    if kind is not None:
        require_choice("plot_sweep", "kind", kind, ("map", "curves", "scatter"))
    for column in (name, *(over or ())):
        table.column(column)
    if name not in table.values:
        raise InputError(f"'{name}' is a parameter of the sweep; plot one of its summaries "
                         f"{choices(table.values)}.")
    if over is not None:
        return (_curves(table, name, over[0], path=path) if len(over) == 1
                else _map(table, name, over[0], over[1], path))
    names = [key for key, values in table.parameters.items() if len(set(values)) > 1]
    if not names:
        raise InputError("The sweep has only one case; there is nothing to plot.")
    numeric = all(is_numeric(table.parameters[key]) for key in names)
    fits = {"map": table.shape is not None and len(names) == 2 and numeric,
            "curves": table.shape is not None and len(names) <= 2, "scatter": True}
    if kind is not None and not fits[kind]:
        raise InputError(f"kind = '{kind}' needs a grid of {'two numeric' * (kind == 'map')}"
                         f"{'one or two' * (kind == 'curves')} parameters; plot this sweep as "
                         f"{choices(name for name, fit in fits.items() if fit)}, or give over.")
    many = min(len(set(table.parameters[key])) for key in names) >= _LEAST_OF_MAP
    if kind == "map" or (kind is None and fits["map"] and many):
        return _map(table, name, names[0], names[1], path)
    if kind == "curves" or (kind is None and fits["curves"]):
        few = sorted(names, key=lambda key: (is_numeric(table.parameters[key]),
                                             len(set(table.parameters[key]))))
        return _curves(table, name, few[-1], few[0] if len(names) == 2 else None, path)
    return _scatter(table, name, names, path)


def _curves(
    table: SweepTable, name: str, parameter: str, by: str | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """A summary over one parameter, a curve for each value of another."""
    x, labels = _places(table.parameters[parameter])
    groups: dict[Any, list[int]] = {None: list(range(len(table)))}
    if by is not None:
        groups = {}
        for k, value in enumerate(table.parameters[by]):
            groups.setdefault(value, []).append(k)
    curves = []
    for (value, cases), colour in zip(groups.items(), distinct_colours(len(groups)), strict=True):
        order = sorted(cases, key=lambda k: x[k])
        places, values = x[order], table.values[name][order]
        if not np.isfinite(values).any():
            continue
        # Cases that also differ in other parameters do not form a curve.
        curve = len(places) <= _LEAST_OF_DOTS and (np.diff(places) > 0.0).all()
        curves.append(Curve("" if by is None else _shown(value), colour, places, values,
                            0.9 if curve else 0.0, 3.5 if len(places) <= _LEAST_OF_DOTS else 1.5))
    with new_figure(7.0, 4.6, path) as figure:
        axes = figure.subplots()
        _draw_over(axes, table, parameter, x, labels, _label(name), curves)
        if by is not None:
            figure.legend(title=table.label(by), loc="outside right upper")
    return figure


def plot_strobed(
    table: SweepTable, parameter: str, *, path: str | Path | None = None
) -> "Figure":
    """Plot displacements once per period over a parameter: a brute-force bifurcation diagram.

    Parameters
    ----------
    table : SweepTable
        Table of a sweep that strobes.
    parameter : str
        A varied parameter.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a sweep that does not strobe, a parameter that does not exist, another suffix, or a
        file that cannot be written.
    """
    require_kind("plot_strobed", SweepTable, table=table)
    if parameter not in table.parameters:
        raise InputError(f"The sweep has no parameter '{parameter}'; there are: "
                         f"{choices(table.parameters)}.")
    if table.strobed is None:
        raise InputError("The sweep has no displacements once per period; give it a key strobe.")
    x, labels = _places(table.parameters[parameter])
    dots = Curve("", "#1a1a1a", np.repeat(x, table.strobed.shape[1]), table.strobed.ravel(), 0.0,
                 0.5 * float(np.clip(60.0 / np.sqrt(len(table)), 0.8, 4.0)))
    with new_figure(7.5, 4.8, path) as figure:
        axes = figure.subplots()
        _draw_over(axes, table, parameter, x, labels, "displacement once per period [m]", [dots])
    return figure


def _map(
    table: SweepTable, name: str, first: str, second: str, path: str | Path | None
) -> "Figure":
    """Map of a summary over two parameters of a grid; failed cases are grey."""
    if table.shape is None:
        raise InputError("A map needs a sweep over a grid.")
    keys = list(table.parameters)
    held = tuple(slice(None) if key in (first, second) else 0 for key in keys)
    x, y = (np.unique(table.column(key)) for key in (first, second))
    values = table.grid(name)[held]
    if keys.index(first) < keys.index(second):
        values = values.T
    order = [np.argsort(np.array(list(dict.fromkeys(table.column(key).tolist()))))
             for key in (second, first)]
    values = values[np.ix_(*order)]
    with new_figure(7.0, 5.2, path) as figure:
        axes = figure.subplots()
        known = values[np.isfinite(values)]
        logs = [_is_geometric(points) for points in (x, y)]
        shown = Map(borders(x, logs[0]), borders(y, logs[1]),
                    np.where(np.isfinite(values), values, np.nan), Scale(_label(name)), _FAILED)
        image = draw(axes, Diagram(table.label(first), table.label(second), maps=(shown,)))[0]
        for which, label, points, log in zip(_AXES, (first, second), (x, y), logs, strict=True):
            if log:
                _logarithmic(axes, which)
                name_axis(axes, which, table.label(label), points)
        colour_bar(image, shown, axes)
        for axis, points, log in zip((axes.xaxis, axes.yaxis), (x, y), logs, strict=True):
            # Of few cells each is named, if the numbers are short.
            if not log and len(points) <= _MOST_TICKS and all(
                    len(f"{value:g}".strip("-0.")) <= _SHORT for value in points):
                axis.set_ticks(points)
        if len(known) < values.size:
            axes.set_title("grey: failed or not computed", loc="right", fontsize=9, color="#606060")
    return figure


def _scatter(
    table: SweepTable, name: str, parameters: Sequence[str], path: str | Path | None
) -> "Figure":
    """Scatter plots of a summary over each parameter, and its histogram."""
    rows = -(-(len(parameters) + 1) // 4)
    columns = -(-(len(parameters) + 1) // rows)
    with new_figure(3.1 * columns, 3.1 * rows, path) as figure:
        grid = np.atleast_1d(figure.subplots(rows, columns, sharey=True)).ravel()
        size = 0.5 * float(np.clip(80.0 / np.sqrt(len(table)), 2.0, 8.0))
        for axes, parameter in zip(grid, parameters, strict=False):
            x, labels = _places(table.parameters[parameter])
            dots = Curve("", COLOURS[0], x, table.values[name], 0.0, size)
            _draw_over(axes, table, parameter, x, labels, _label(name), [dots])
        last = grid[len(parameters)]
        known = table.values[name][np.isfinite(table.values[name])]
        if len(known):
            last.hist(known, bins=int(np.clip(np.sqrt(len(known)), 5, 60)),
                      range=None if np.ptp(known) else last.get_ylim(),
                      orientation="horizontal", color=COLOURS[0], alpha=0.7)
        last.set_xlabel("cases")
        for k, axes in enumerate(grid):
            if k % columns:
                axes.set_ylabel("")
            axes.set_visible(k <= len(parameters))
    return figure


def plot_sobol(
    found: Mapping[str, SobolIndices], *, path: str | Path | None = None
) -> "Figure":
    """Plot first-order and total Sobol indices of summaries, with their confidence intervals.

    Parameters
    ----------
    found : mapping of summary to SobolIndices
        Results of :func:`fecontact.sweeps.sobol_indices`.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        If ``found`` is empty, for another suffix, or a file that cannot be written.
    """
    require_kind("plot_sobol", Mapping, found=found)
    if not found:
        raise InputError("found = {} holds nothing to draw; give the indices of a summary.")
    names = list(found)
    parameters = list(next(iter(found.values())).first)
    with new_figure(7.5, 0.9 + len(names) * (0.5 + 0.36 * len(parameters)), path) as figure:
        grid = np.atleast_1d(figure.subplots(len(names), 1, sharex=True))
        places = np.arange(len(parameters))[::-1]
        for axes, name in zip(grid, names, strict=True):
            for shift, indices, colour, label in (
                    (0.18, found[name].first, COLOURS[0], "alone"),
                    (-0.18, found[name].total, COLOURS[5], "with others")):
                value = np.array([indices[key].value for key in parameters])
                low = np.array([indices[key].low for key in parameters])
                high = np.array([indices[key].high for key in parameters])
                axes.barh(places + shift, value, height=0.34, color=colour, label=label)
                axes.errorbar(value, places + shift,
                              xerr=[np.maximum(value - low, 0.0), np.maximum(high - value, 0.0)],
                              fmt="none", ecolor="#303030", elinewidth=0.9, capsize=2)
            axes.set_yticks(places, [found[name].labels.get(key) or parameter_label(key, Study)
                                     for key in parameters])
            axes.grid(False, axis="y")
            axes.set_title(name.replace("_", " "), loc="left")
        grid[-1].set_xlabel("part of the variance")
        grid[-1].set_xlim(left=min(0.0, grid[-1].get_xlim()[0]))
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def _label(name: str) -> str:
    """Label of a summary with its SI unit."""
    words, unit = name.replace("_", " "), unit_of(name)
    return f"{words} [{unit}]" if unit else words


def _draw_over(
    axes: "Axes", table: SweepTable, parameter: str, x: Array, labels: list[str] | None,
    y_label: str, curves: Sequence[Curve],
) -> None:
    """Draw curves over a parameter, logarithmic for values of equal ratios; mark failed cases.

    ``labels`` name the values of a parameter that are no numbers.
    """
    logarithmic = labels is None and _is_geometric(np.unique(x))
    diagram = Diagram(table.label(parameter), y_label, tuple(curves), logarithmic="x" * logarithmic)
    draw(axes, diagram)
    _mark_failed(axes, table, x)
    if labels is not None:
        _name_places(axes, labels)
    elif logarithmic:
        _logarithmic(axes, "x")
        name_axis(axes, "x", diagram.x_label, x)
    elif all(isinstance(value, int) for value in table.parameters[parameter]):
        axes.locator_params(axis="x", integer=True)


def _name_places(axes: "Axes", labels: list[str]) -> None:
    """Name the places 0, 1, ... along x, each with equal space; long names are turned."""
    axes.set_xticks(range(len(labels)), labels)
    axes.set_xlim(-0.5, len(labels) - 0.5)
    inches = axes.get_window_extent().width / axes.figure.dpi
    if max(map(len, labels)) * len(labels) > _LETTERS * inches:
        axes.set_xticks(range(len(labels)), labels, rotation=30, ha="right", rotation_mode="anchor")


def _places(values: Sequence[Any]) -> tuple[Array, list[str] | None]:
    """Coordinates along an axis; for non-numeric values their indices and labels."""
    if is_numeric(values):
        return np.array(values, dtype=float), None
    names = list(dict.fromkeys(_shown(value) for value in values))
    return np.array([names.index(_shown(value)) for value in values], dtype=float), names


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else f"{value}"


def _logarithmic(axes: "Axes", which: str) -> None:
    from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(NullLocator())


def _mark_failed(axes: "Axes", table: SweepTable, x: Array) -> None:
    cases = list(table.failed)
    if cases:
        axes.plot(x[cases], np.full(len(cases), 0.02), "x", color="#303030", markersize=5,
                  transform=axes.get_xaxis_transform(), clip_on=False, label="failed")


def _is_geometric(points: Array) -> bool:
    """Whether ascending points are spaced by equal ratios rather than equal differences."""
    if len(points) < 3 or points[0] <= 0.0:
        return False
    steps, ratios = np.diff(points), points[1:] / points[:-1]
    return bool(np.ptp(steps) > 1e-6 * steps.max() and np.ptp(ratios) < 1e-6 * ratios.max())
