"""Plots of a run: histories, phase planes, contact along the face, energies."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.histories import Point, point_name
from fecontact.analysis.resolved import resolved
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import (
    COLOURS,
    ENERGY_COLOURS,
    STATE_COLOURS,
    add_note,
    distinct_colours,
    state_names,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_MAP_COLOURS = {"open": "#e3e0da", **STATE_COLOURS}
_AXES = ("x", "y")

_LINE_BINS = 2000  # a long line is drawn by minimum and maximum of each
_MAP_COLUMNS = 1500


def plot_history(
    trajectory: Trajectory, points: Sequence[Point] = (), *, path: str | Path | None = None
) -> "Figure":
    """Plot displacements and velocities of points, and the total contact forces, over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    points : sequence of str, int or (x, y)
        As for :meth:`Trajectory.displacement`; B and the contact node in the middle by default.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a point that does not exist, another suffix, or a file that cannot be written.
    """
    require_kind("plot_history", Trajectory, trajectory=trajectory)
    require_kind("plot_history", Sequence, points=points)
    if isinstance(points, str):
        raise InputError(f"plot_history: points = {points!r} must be several points, such as "
                         f"['B', 0]; a file to write is given by path={points!r}.")
    points = tuple(points) or _usual_points(trajectory)
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    colours = distinct_colours(len(points))
    with new_figure(10.0, 7.5, path) as figure:
        add_note(figure, drawn)
        axes = figure.subplots(3, 2, sharex=True)
        time = _time(axes[2], trajectory)
        for column, (quantity, unit, values) in enumerate((
            ("displacement", "m", [trajectory.displacement(point) for point in points]),
            ("velocity", "m/s", [trajectory.velocity(point) for point in points]),
        )):
            values = _without_round_off(values)
            for row, name in enumerate(_AXES):
                factor = _labelled(axes[row, column], f"{quantity} {name}", unit,
                                   *(value[:, row] for value in values))
                for number, (point, value) in enumerate(zip(points, values, strict=True)):
                    axes[row, column].plot(
                        *thinned(time, value[:, row] / factor), color=colours[number],
                        linewidth=1.2 if number else 2.0, label=point_name(point))
        for axis, name, forces in ((axes[2, 0], "normal force", trajectory.normal_force),
                                   (axes[2, 1], "friction force in -x",
                                    trajectory.friction_force)):
            total = forces.sum(axis=1)
            factor = _labelled(axis, f"total {name}", "N", total)
            axis.plot(*thinned(time, total / factor), color="#303030")
        figure.align_ylabels(axes)
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center",
                      ncols=max(1, min(len(points), 6)))
    return figure


def _without_round_off(values: list[Array]) -> list[Array]:
    """Histories (N, k) with components below a billionth of the largest set to zero."""
    largest = max(float(np.abs(value[:, :2]).max()) for value in values)
    return [np.where(np.abs(value).max(axis=0) > 1e-9 * largest, value, 0.0) for value in values]


def plot_phase(
    trajectory: Trajectory, point: Point = "B", component: str = "x", *,
    path: str | Path | None = None,
) -> "Figure":
    """Plot the velocity of a point over its displacement, and the speed of the ground.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    point : str, int or (x, y)
        As for :meth:`Trajectory.displacement`.
    component : "x" or "y"
        Direction of the motion.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a point or a component that does not exist, another suffix, or a file that cannot be
        written.
    """
    require_kind("plot_phase", Trajectory, trajectory=trajectory)
    if component not in _AXES:
        raise InputError(f"component = {component!r} is not known; choose from {choices(_AXES)}.")
    row = _AXES.index(component)
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    with new_figure(6.4, 5.2, path) as figure:
        add_note(figure, drawn)
        plane = figure.subplots()
        x, v = trajectory.displacement(point)[:, row], trajectory.velocity(point)[:, row]
        unit, symbol = suitable_unit(float(np.abs(x).max()), "m")
        plane.set_xlabel(f"displacement {component} [{symbol}]")
        factor = _labelled(plane, f"velocity {component}", "m/s", v)
        plane.plot(x / unit, v / factor, color=COLOURS[0], linewidth=1.0)
        plane.plot(x[-1] / unit, v[-1] / factor, "o", color=COLOURS[1], label="end of the run")
        ground = trajectory.system.ground
        speed = ground.speed if ground.motion is None else 0.0
        # The speed of a much faster ground would flatten the curve.
        if row == 0 and 0.0 < abs(speed) <= 5.0 * float(np.abs(v).max()):
            plane.axhline(speed / factor, color="#303030", linestyle=(0, (4, 3)), linewidth=1.0,
                          label="ground")
        plane.legend(loc="best")
        plane.set_title(point_name(point))
    return figure


def plot_contact_map(trajectory: Trajectory, *, path: str | Path | None = None) -> "Figure":
    """Plot pressure [Pa] and state of the contact nodes over time and position.

    For a basis without thickness, the line load [N/m] takes the place of the pressure. In runs with
    more output times than columns of the picture, a column shows the largest pressure and the most
    frequent state of its times. The band of a node is as wide as its tributary length; places
    without contact face stay blank. States are open, stick and slip, or open and contact if all
    friction forces of the run are zero.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    require_kind("plot_contact_map", Trajectory, trajectory=trajectory)
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    with new_figure(10.0, 6.2, path) as figure:
        add_note(figure, drawn)
        upper, lower = figure.subplots(2, 1, sharex=True)
        columns = np.linspace(trajectory.time[0], trajectory.time[-1], _MAP_COLUMNS + 1)[:-1]
        starts = np.unique(np.searchsorted(trajectory.time, columns))
        edges = _time_edges(trajectory.time, starts)
        time_unit, symbol = suitable_unit(float(np.abs(edges).max()), "s")
        places, nodes, place_label = _place_edges(trajectory)

        name, unit, load = (
            ("line load", "N/m", trajectory.line_load) if trajectory.system.basis.thickness is None
            else ("contact pressure", "Pa", trajectory.pressure))
        highest = np.maximum.reduceat(load, starts, axis=0)
        factor, load_symbol = suitable_unit(float(highest.max()), unit)
        image = upper.pcolormesh(
            edges / time_unit, places, _rows(highest / factor, nodes), cmap="viridis", vmin=0.0,
            vmax=float(highest.max()) / factor or 1.0)
        figure.colorbar(image, ax=upper, label=f"{name} [{load_symbol}]", pad=0.01)

        states = state_names(trajectory)
        state = np.minimum(trajectory.contact_state, len(states) - 1)
        spans = _spans(trajectory.time)[:, None]
        counts = np.stack([np.add.reduceat((state == k) * spans, starts, axis=0)
                           for k in range(len(states))])
        # A column of several times shows contact if any of them has it, as the pressure above does.
        counts[0] *= counts[1:].sum(axis=0) == 0
        image = lower.pcolormesh(edges / time_unit, places, _rows(counts.argmax(axis=0), nodes),
                                 cmap=ListedColormap([_MAP_COLOURS[name] for name in states]),
                                 norm=BoundaryNorm(np.arange(len(states) + 1) - 0.5, len(states)))
        bar = figure.colorbar(image, ax=lower, label="state", pad=0.01, ticks=range(len(states)))
        bar.ax.set_yticklabels(states)
        bar.ax.tick_params(length=0)
        figure.align_ylabels([upper, lower])
        lower.set_xlabel(f"time [{symbol}]")
        for axis in (upper, lower):
            axis.set_ylabel(place_label)
            axis.grid(False)
            if len(places) == 2:
                axis.set_yticks([0.5 * (places[0] + places[1])], ["0"])
    return figure


def plot_energies(trajectory: Trajectory, *, path: str | Path | None = None) -> "Figure":
    """Plot stored energy, external work and dissipated energy [J] over time.

    Terms that stay zero are left out.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_energies", Trajectory, trajectory=trajectory)
    imbalance = trajectory.energies.imbalance
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    energies = trajectory.energies
    with new_figure(10.0, 8.0, path) as figure:
        add_note(figure, drawn)
        axes = figure.subplots(3, 1, sharex=True)
        time = _time(axes[2:], trajectory)
        panels = (
            ("stored energy", energies.stored, ("kinetic", "elastic", "drive_spring", "contact",
                                                "bristles")),
            ("work put in", energies.work,
             ("drive_work", "belt_normal_work", "belt_friction_work", "load_work",
              "circulatory_work", "bristle_work")),
            ("energy lost", energies.lost,
             ("modal_damping", "dashpots", "contact_damping", "friction")),
        )
        for axis, (title, total, names) in zip(axes, panels, strict=True):
            terms = {name: getattr(energies, name) for name in names}
            shown = {name: term for name, term in terms.items() if term.any()}
            factor = _labelled(axis, title, "J", total, *shown.values())
            for name, term in shown.items():
                axis.plot(*thinned(time, term / factor), color=ENERGY_COLOURS[name],
                          label=name.removesuffix("_work").replace("_", " "))
            if not shown:
                axis.set(ylim=(-1.0, 1.0), yticks=[0.0])
            axis.plot(*thinned(time, total / factor), color="#303030", linewidth=1.8, label="total",
                      zorder=1.5)
            axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        figure.align_ylabels(axes)
        axes[0].set_title(f"error of the energy balance: {imbalance:.1e} of the largest term")
    return figure


def _usual_points(trajectory: Trajectory) -> tuple[Point, ...]:
    """Point B, unless it is fixed, and the middle contact node."""
    basis = trajectory.system.basis
    middle = basis.contact_nodes // 2
    return ("B", middle) if basis.T[0].any() else (middle,)


def _time(bottom: Sequence["Axes"], trajectory: Trajectory) -> Array:
    """Times in a suitable unit, which the given axes name."""
    factor, symbol = suitable_unit(float(np.abs(trajectory.time).max()), "s")
    for axis in bottom:
        axis.set_xlabel(f"time [{symbol}]")
        if len(trajectory.time) > 1:
            axis.set_xlim(trajectory.time[0] / factor, trajectory.time[-1] / factor)
    return trajectory.time / factor


def _labelled(axis: "Axes", name: str, unit: str, *values: Array) -> float:
    """Label the y axis with a suitable unit, and return its factor."""
    largest = max((float(np.abs(value).max()) for value in values), default=0.0)
    factor, symbol = suitable_unit(largest, unit)
    axis.set_ylabel(f"{name} [{symbol}]")
    low = min((float(value.min()) for value in values), default=0.0)
    high = max((float(value.max()) for value in values), default=0.0)
    if 0.0 <= high - low < 1e-9 * largest:
        # Do not magnify round-off about a constant.
        axis.set_ylim((low - 0.05 * largest) / factor, (high + 0.05 * largest) / factor)
    return factor


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """A long line by what it is where it enters and leaves each of many narrow columns, and by its
    lowest and highest points there, so that no peak is lost.
    """
    if len(x) < 4 * _LINE_BINS:
        return x, y
    columns = np.linspace(x[0], x[-1], _LINE_BINS + 1)[:-1]
    starts = np.unique(np.searchsorted(x, columns))
    low, high = (_places(extreme.reduceat(y, starts), y, starts)
                 for extreme in (np.minimum, np.maximum))
    ends = np.append(starts[1:], len(x)) - 1
    chosen = np.unique(np.concatenate([starts, low, high, ends]))
    return x[chosen], y[chosen]


def _places(extremes: Array, y: Array, starts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the extreme in each column of points."""
    counts = np.diff(np.append(starts, len(y)))
    met = np.flatnonzero(y == np.repeat(extremes, counts))
    columns = np.searchsorted(starts, met, side="right")
    return np.asarray(met[np.unique(columns, return_index=True)[1]])


def _spans(time: Array) -> Array:
    """Duration (N,) that each of the times represents."""
    if len(time) == 1:
        return np.ones(1)
    edges = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    return np.asarray(np.diff(edges))


def _time_edges(time: Array, starts: NDArray[np.intp]) -> Array:
    """Borders (k + 1,) of the columns that begin at the given output times."""
    if len(time) == 1:
        return np.array([time[0] - 0.5, time[0] + 0.5])
    between = 0.5 * (time[starts[1:] - 1] + time[starts[1:]])
    return np.concatenate([time[:1], between, time[-1:]])


def _place_edges(trajectory: Trajectory) -> tuple[Array, NDArray[np.intp], str]:
    """Borders (k + 1,) of the rows of the map, their nodes (k,), and the label of their axis.

    The node of a row without contact face is -1.
    """
    basis = trajectory.system.basis
    x, n = basis.contact_x, basis.contact_nodes
    low, high = _bands(trajectory)
    order = np.argsort(low + high, kind="stable")
    low, high, x = low[order], high[order], x[order]
    tiny = 1e-6 * float(high.max() - low.min())
    overlap = high[:-1] > low[1:] + tiny
    middle = 0.5 * (x[:-1] + x[1:])
    high[:-1] = np.where(overlap, middle, high[:-1])
    low[1:] = np.where(overlap, middle, low[1:])
    # Nodes one above the other share a band.
    if n == 1 or (overlap & (np.diff(x) <= tiny)).any():
        return np.arange(n + 1, dtype=np.float64) - 0.5, np.arange(n), "contact node"
    apart = np.flatnonzero(low[1:] > high[:-1] + tiny) + 1
    edges = np.insert(np.append(low, high[-1]), apart, high[apart - 1])
    factor, symbol = suitable_unit(float(np.ptp(edges)), "m")
    return edges / factor, np.insert(order, apart, -1), f"contact position x [{symbol}]"


def _bands(trajectory: Trajectory) -> tuple[Array, Array]:
    """Lower and upper ends (n,) of the tributary lengths along the face [m].

    They lie centred about the nodes, but follow one another from end to end of a part whose
    outer nodes lie on its ends, as they do where the displacement nodes are the contact nodes.
    """
    basis = trajectory.system.basis
    x, length = basis.contact_x, basis.tributary
    low, high = x - 0.5 * length, x + 0.5 * length
    first = 0
    for _, count in basis.groups:
        group = first + np.argsort(x[first : first + count], kind="stable")
        first += count
        reach = length[group]
        apart = np.diff(x[group]) > (1.0 + 1e-6) * (reach[1:] + reach[:-1])
        for part in np.split(group, np.flatnonzero(apart) + 1):
            ends = x[part[0]] + np.append(0.0, np.cumsum(length[part]))
            beyond = abs(ends[-1] - x[part[-1]])
            inside = np.minimum(x[part] - ends[:-1], ends[1:] - x[part])[1:-1]
            if beyond < 0.05 * length[part].min() and (inside > 0.05 * length[part][1:-1]).all():
                low[part], high[part] = ends[:-1], ends[1:]
    return low, high


def _rows(values: NDArray[Any], nodes: NDArray[np.intp]) -> "np.ma.MaskedArray[Any, Any]":
    """Values (k, T) of the rows of the map from those of the nodes (T, n)."""
    return np.ma.masked_where(np.repeat(nodes[:, None] < 0, len(values), axis=1),
                              values.T[nodes])

