"""Maps of contact faces of solids: pressure, state and friction at some times, work, wear."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.periodicity import steadiness
from fecontact.analysis.resolved import resolved
from fecontact.core.errors import InputError, shown
from fecontact.core.types import Array
from fecontact.core.units import quantity, suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.integrate.wear import WearHistory
from fecontact.laws.wear import WearLaw
from fecontact.output.diagrams.colours import COLOURS, PRESSURE_MAP, STATE_COLOURS, WEAR_MAP
from fecontact.output.diagrams.diagram import thinned
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.solids.plans import FacePlan, draw_arrows, draw_plan, face_plans
from fecontact.output.plots.style import add_note, legend_label, state_names
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORK_MAP = "viridis"
OPEN = "#e3e0da"
_TIMES = 4  # shown without being asked for
_MOST_TIMES = 8
_WIDTH, _LARGEST = 12.0, 14.0  # inches
_CURVE = 1.9  # height of the panel with curves over time [inches]


@dataclass(frozen=True, eq=False)
class _Row:
    """A row of maps of one face: a value (k, n) of each node at each time, and its colours."""

    label: str
    plan: FacePlan
    values: NDArray[Any]
    colours: str | Sequence[str]
    largest: float
    unit: str = ""
    arrows: Array | None = None


def contact_maps(
    trajectory: Trajectory, times: Sequence[float] | None, wear: WearLaw | None,
    path: str | Path | None,
) -> "Figure":
    """Maps of contact at times, drawn by :func:`fecontact.plot.plot_contact_map` for solids."""
    which = _chosen(trajectory, times)
    basis, run = trajectory.basis, trajectory
    plans, states = face_plans(basis, "contact map"), state_names(run)
    shades = [{"open": OPEN, **STATE_COLOURS}[name] for name in states]
    friction = -np.einsum("fnk,nkd->fnd", run.friction_forces[which], basis.tangents)
    pressure = run.pressure[which]
    most = quantity(float(np.linalg.norm(friction, axis=2).max()), "N")
    depth = None if wear is None else run.wear_depth(wear)[which]
    code = np.minimum(run.contact_state[which], len(states) - 1)
    rows: list[_Row] = []
    for plan in plans:
        nodes = plan.face.nodes
        arrows = plan.directions(friction[:, nodes])
        has_friction = bool(arrows.any())
        title = f"pressure\nand friction\nup to {most}" if has_friction else "pressure"
        rows.append(_Row(title, plan, pressure[:, nodes], PRESSURE_MAP, float(pressure.max()), "Pa",
                         arrows if has_friction else None))
        rows.append(_Row("state", plan, code[:, nodes], shades, len(states) - 1.0))
        if depth is not None:
            rows.append(_Row("worn depth", plan, depth[:, nodes], WEAR_MAP, float(depth.max()),
                             "m"))
    unit, symbol = suitable_unit(float(np.abs(run.time).max()), "s")
    closest = float(np.diff(run.time[which]).min()) if len(which) > 1 else np.inf
    digits = max(4, int(np.ceil(np.log10(max(float(np.abs(run.time).max()) / closest, 1.0)))) + 2)
    titles = [f"t = {run.time[k] / unit:.{digits}g} {symbol}" for k in which]
    height = _map_height(plans, len(which))
    whole = min(_CURVE + sum(height[id(row.plan)] for row in rows) + 0.5, 1.6 * _LARGEST)
    with new_figure(_WIDTH, whole, path) as figure:
        parts: Any = figure.subfigures(
            2, 1, height_ratios=(_CURVE, max(whole - _CURVE, 1.0)))
        upper, lower = parts
        _shares(upper.subplots(), run, states, shades, run.time[which])
        _draw_rows(lower, rows, titles, states, max(float(np.linalg.norm(
            friction, axis=2).max()), 0.0))
    return figure


def shear_maps(history: LoadHistory, row: int, path: str | Path | None) -> "Figure":
    """Maps of shear at a load step, drawn by :func:`fecontact.plot.plot_shear` for solids."""
    basis, state = history.system.basis, history.state(row)
    plans = face_plans(basis, "contact at a load step")
    friction = -np.einsum("nk,nkd->nd", history.friction_forces[row], basis.tangents)
    size = np.linalg.norm(friction, axis=1)
    shear, pressure = size / basis.contact_areas, history.normal_force[row] / basis.contact_areas
    slip = np.linalg.norm(history.slips[row], axis=1)
    shades = [{"open": OPEN, **STATE_COLOURS}[name] for name in STATES]
    most, rows = quantity(float(size.max()), "N"), []
    for plan in plans:
        nodes = plan.face.nodes
        arrows = plan.directions(friction[None, nodes])
        for label, values, colours, unit in (
                ("pressure", pressure, PRESSURE_MAP, "Pa"),
                (f"friction\non the body\nup to {most}", shear, WORK_MAP, "Pa"),
                ("displacement\nrelative to\nthe other side", slip, WORK_MAP, "m")):
            rows.append(_Row(label, plan, values[None, nodes], colours, float(values.max()), unit,
                             arrows if values is shear and size.any() else None))
        rows.append(_Row("state", plan, state.contact_state[None, nodes], shades,
                         len(STATES) - 1.0))
    width = 0.5 * _WIDTH
    height = sum(float(np.clip((width - 2.5) / one.plan.aspect + 0.4, 1.3, 3.5)) for one in rows)
    with new_figure(width, min(height + 0.5, 1.3 * _LARGEST), path) as figure:
        _draw_rows(figure, rows, [f"point {row} of the path"], STATES, float(size.max()))
    return figure


def _chosen(trajectory: Trajectory, times: Sequence[float] | None) -> NDArray[np.intp]:
    """Output times nearest to those asked for; by default of the last period, or of the run."""
    t = trajectory.time
    if times is None:
        period = steadiness(trajectory).period
        count = min(_TIMES, len(t) - 1)
        if count < 1:
            return np.zeros(1, dtype=np.intp)
        if period is not None:
            # Phases of a motion that repeats differ; quarters of the run may all have the same.
            wanted = t[-1] - period * np.arange(count)[::-1] / count
            return np.unique(np.abs(t[None] - wanted[:, None]).argmin(axis=1))
        return np.unique(np.linspace(0, len(t) - 1, count + 1).round().astype(np.intp)[1:])
    if isinstance(times, Real):
        times = (times,)  # type: ignore[assignment]
    given = np.asarray(times, dtype=float) if all(isinstance(one, Real) for one in times) else (
        np.full(1, np.nan))
    if given.ndim != 1 or not 1 <= len(given) <= _MOST_TIMES or not np.isfinite(given).all():
        raise InputError(f"plot_contact_map: times = {shown(times)} must be one to {_MOST_TIMES} "
                         f"times of the run [s].")
    slack = 1e-9 * max(abs(float(t[0])), abs(float(t[-1])))
    if given.min() < t[0] - slack or given.max() > t[-1] + slack:
        raise InputError(f"plot_contact_map: times = {shown(times)} must lie between {t[0]:g} s "
                         f"and {t[-1]:g} s, the ends of the run.")
    return np.abs(t[None] - given[:, None]).argmin(axis=1)


def _map_height(plans: Sequence[FacePlan], columns: int) -> dict[int, float]:
    """Height of the maps of each face [inches], by identity."""
    width = (_WIDTH - 2.0) / columns
    return {id(plan): float(np.clip(width / plan.aspect + 0.4, 1.5, 4.0)) for plan in plans}


def _shares(axes: "Axes", run: Trajectory, states: Sequence[str], shades: Sequence[str],
            marked: Array) -> None:
    """Shares of the area in each state over time, with the times of the maps."""
    unit, symbol = suitable_unit(float(np.abs(run.time).max()), "s")
    area = run.basis.contact_areas
    code = np.minimum(run.contact_state, len(states) - 1)
    shares = np.stack([100.0 * ((code == k) @ area) / area.sum() for k in range(len(states))])
    axes.stackplot(run.time / unit, shares, colors=shades, labels=states, step="mid",
                   linewidth=0.0)
    axes.vlines(marked / unit, 0.0, 100.0, color="#303030", linewidth=1.0)
    if len(run.time) > 1:
        axes.set_xlim(run.time[0] / unit, run.time[-1] / unit)
    axes.set(ylim=(0.0, 100.0), xlabel=f"time [{symbol}]", ylabel="area [%]")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    axes.grid(False)


def _draw_rows(figure: Any, rows: Sequence[_Row], titles: Sequence[str], states: Sequence[str],
               largest_force: float) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    grid = figure.subplots(len(rows), len(titles), squeeze=False,
                           height_ratios=[1.0 / row.plan.aspect for row in rows])
    for number, (row, axes) in enumerate(zip(rows, grid, strict=True)):
        factor, symbol = suitable_unit(row.largest, row.unit) if row.unit else (1.0, "")
        discrete = not isinstance(row.colours, str)
        drawn: Any = None
        for column, (axis, title) in enumerate(zip(axes, titles, strict=True)):
            drawn = draw_plan(axis, row.plan)
            drawn.set_array(row.values[column] / factor)
            if discrete:
                drawn.set_cmap(ListedColormap(list(row.colours)))
                drawn.set_norm(BoundaryNorm(np.arange(len(states) + 1) - 0.5, len(states)))
            else:
                drawn.set_cmap(row.colours)
                drawn.set_clim(0.0, row.largest / factor or 1.0)
            if row.arrows is not None and largest_force > 0.0:
                draw_arrows(axis, row.plan, row.arrows[column], largest_force)
            if number == 0:
                axis.set_title(title)
            _tidy(axis, last=number == len(rows) - 1, first=column == 0)
        place = f"{row.plan.face.name}\n" if row.plan.face.name else ""
        axes[0].set_ylabel(f"{place}{row.label}\n{axes[0].get_ylabel()}", fontsize=9.0)
        bar = figure.colorbar(drawn, ax=axes.tolist(), pad=0.01, aspect=12,
                              label=f"[{symbol}]" if row.unit else None)
        if discrete:
            bar.set_ticks(range(len(states)), labels=list(states))
            bar.ax.tick_params(length=0)
    figure.align_ylabels(grid[:, 0])


def _tidy(axis: "Axes", *, last: bool, first: bool) -> None:
    """Labels at the left and below only."""
    if not last:
        axis.set_xlabel("")
        axis.tick_params(labelbottom=False)
    if not first:
        axis.set_ylabel("")
        axis.tick_params(labelleft=False)


def _single_maps(
    figure: Any, plans: Sequence[FacePlan], columns: Sequence[tuple[str, Array, str, str]]
) -> None:
    """One row a face, one column a quantity: title, values (n,), unit and colours."""
    grid = figure.subplots(len(plans), len(columns), squeeze=False,
                           height_ratios=[1.0 / plan.aspect for plan in plans])
    for number, (plan, axes) in enumerate(zip(plans, grid, strict=True)):
        for axis, (title, values, unit, colours) in zip(axes, columns, strict=True):
            largest = float(np.abs(values).max())
            factor, symbol = suitable_unit(largest, unit)
            drawn = draw_plan(axis, plan)
            drawn.set_array(values[plan.face.nodes] / factor)
            drawn.set_cmap(colours)
            drawn.set_clim(min(0.0, float(values.min()) / factor), largest / factor or 1.0)
            if number == 0:
                axis.set_title(title)
            if plan.face.title and axis is axes[0]:
                axis.set_ylabel(f"{plan.face.title}\n{axis.get_ylabel()}")
            if number == 0:
                figure.colorbar(drawn, ax=grid[:, list(axes).index(axis)].tolist(),
                                label=f"[{symbol}]", pad=0.01, location="bottom", aspect=30,
                                shrink=0.8)
    figure.align_ylabels(grid[:, 0])


def friction_work_maps(trajectory: Trajectory, path: str | Path | None) -> "Figure":
    """Maps of friction work, drawn by :func:`fecontact.plot.plot_friction_work` for solids."""
    drawn = resolved(trajectory)
    run = drawn.trajectory
    basis = run.basis
    plans = face_plans(basis, "friction work")
    work = run.friction_work[-1] / basis.contact_areas
    speed = np.linalg.norm(run.slip_velocities, axis=2) * (run.normal_force != 0.0)
    slip = np.trapezoid(speed, run.time, axis=0)
    with new_figure(_WIDTH, _sheet_height(plans, 2), path) as figure:
        add_note(figure, drawn)
        _single_maps(figure, plans, [("friction work per area", work, "J/m^2", WORK_MAP),
                                     ("slip in contact", slip, "m", WORK_MAP)])
    return figure


def _sheet_height(plans: Sequence[FacePlan], columns: int) -> float:
    width = (_WIDTH - 1.0) / columns
    return float(np.clip(1.3 + sum(width / plan.aspect + 0.4 for plan in plans), 3.0, _LARGEST))


def wear_maps(history: WearHistory, basis: ModalBasis, title: str, path: str | Path | None
              ) -> "Figure":
    """Maps of worn depth and pressure, drawn by :func:`fecontact.plot.plot_wear` for solids."""
    plans = face_plans(basis, "wear")
    depth, area = history.depth, basis.contact_areas
    pressure = history.normal_force / area
    height = _sheet_height(plans, 3)
    with new_figure(_WIDTH, height + 2.4, path) as figure:
        figure.suptitle(title)
        parts: Any = figure.subfigures(2, 1, height_ratios=(height, 2.4))
        upper, lower = parts
        _single_maps(upper, plans, [
            ("worn depth", depth[-1], "m", WEAR_MAP),
            ("mean pressure, first block", pressure[0], "Pa", PRESSURE_MAP),
            ("mean pressure, last block", pressure[-1], "Pa", PRESSURE_MAP)])
        growth = lower.subplots()
        factor, symbol = suitable_unit(float(depth.max()), "m")
        for values, name, colour in ((depth.max(axis=1), "largest", COLOURS[1]),
                                     (depth @ area / area.sum(), "mean", COLOURS[0])):
            growth.plot(*thinned(history.cycles, values / factor), color=colour,
                        label=legend_label(name))
        growth.set(xlabel="cycles", ylabel=f"worn depth [{symbol}]")
        growth.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure
