"""Plots of a run: histories, phase planes, energies."""

from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.histories import Point, is_relative, point_name
from fecontact.analysis.resolved import resolved
from fecontact.analysis.summaries import usual_point
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array
from fecontact.core.units import suitable_unit
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import (
    COLOURS,
    ENERGY_COLOURS,
    add_note,
    distinct_colours,
    legend_label,
)
from fecontact.reduction.assembly.contact_faces import ContactFace, contact_faces

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Panels of energies: title, attribute of their sum, attributes of the terms.
ENERGY_TERMS = (
    ("stored energy", "stored", ("kinetic", "elastic", "drive_spring", "contact", "bristles")),
    ("work put in", "work", ("drive_work", "belt_normal_work", "belt_friction_work", "load_work",
                             "circulatory_work", "bristle_work")),
    ("energy lost", "lost", ("modal_damping", "dashpots", "contact_damping", "friction")),
)

_AXES = ("x", "y", "z")

_MOST_MIDDLES = 5  # of contact nodes shown without being asked for
_LINE_BINS = 2000  # a long line is drawn by minimum and maximum of each


def plot_history(
    trajectory: Trajectory, points: Sequence[Point] = (), *, path: str | Path | None = None
) -> "Figure":
    """Plot displacements and velocities of points, and the total contact forces, over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    points : sequence of str, int or (x, y)
        As for :meth:`Trajectory.displacement`; B and the contact node in the middle by default,
        of several bodies that of each interface. Contact nodes between bodies show their relative
        motion along tangent and normal, those of solids along both tangents and the normal.
        Friction of solids is shown by its size and direction, or by x and y on the ground.
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
    points = tuple(points) or usual_points(trajectory)
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    colours, faces = distinct_colours(len(points)), contact_faces(trajectory.system.basis)
    single = not faces or not faces[0].name
    motions = [("displacement", "m", [trajectory.displacement(point) for point in points]),
               ("velocity", "m/s", [trajectory.velocity(point) for point in points])]
    motions = [(name, unit, _without_round_off(values)) for name, unit, values in motions]
    d = trajectory.system.basis.dimension
    moving = [row for row in range(d) if any(
        value[:, row].any() for _, _, values in motions for value in values)] or [0]
    rubs = bool(trajectory.friction_forces.any())
    panels: list[Any] = [[f"{name} {_AXES[row]}" for name, _, _ in motions] for row in moving]
    touches = bool(trajectory.system.basis.contact_nodes)
    if touches:
        panels.append(["normal force", "friction force" if rubs else "normal force"])
    with new_figure(10.0, 2.5 * len(panels), path) as figure:
        add_note(figure, drawn)
        axes = figure.subplot_mosaic(panels, sharex=True)
        for panel in chain.from_iterable(panels[:-1]):
            axes[panel].tick_params(labelbottom=False)
        time = _time([axes[panel] for panel in dict.fromkeys(panels[-1])], trajectory)
        for quantity, unit, values in motions:
            for row in moving:
                axis = axes[f"{quantity} {_AXES[row]}"]
                factor = _labelled(axis, f"{quantity} {_AXES[row]}", unit,
                                   *(value[:, row] for value in values))
                for number, (point, value) in enumerate(zip(points, values, strict=True)):
                    axis.plot(*thinned(time, value[:, row] / factor), color=colours[number],
                              linewidth=1.2 if number else 2.0,
                              label=legend_label(_label(point, trajectory)))
        normal = "normal force", "normal force", trajectory.normal_force
        friction = ("friction force", f"friction force in -{'x' if single else 't'}",
                    trajectory.friction_force)
        if d == 3 and rubs:
            _friction_in_space(axes["friction force"], trajectory, time, faces)
        for panel, name, forces in (normal, friction)[: touches + (rubs and d == 2)]:
            totals = [forces[:, face.nodes].sum(axis=1) for face in faces]
            factor = _labelled(axes[panel], f"total {name}", "N", *totals)
            for face, total, colour in zip(faces, totals, ["#303030"] if single else
                                           distinct_colours(len(faces)), strict=True):
                axes[panel].plot(*thinned(time, total / factor), color=colour,
                                 label=legend_label(face.name))
        for side in zip(*panels, strict=True):
            figure.align_ylabels([axes[panel] for panel in side])
        figure.legend(*axes[panels[0][0]].get_legend_handles_labels(), loc="outside upper center",
                      ncols=max(1, min(len(points), 6)))
        if not single and touches:
            # Above the forces: within the panel it would hide curves.
            axes["normal force"].legend(loc="lower left", bbox_to_anchor=(-0.02, 0.98),
                                        ncols=max(1, min(len(faces), 6)))
    return figure


def _without_round_off(values: list[Array]) -> list[Array]:
    """Histories (N, k) with components below a billionth of the largest set to zero."""
    d = 2 if values[0].shape[1] <= 3 else 3
    largest = max(float(np.abs(value[:, :d]).max()) for value in values)
    return [np.where(np.abs(value).max(axis=0) > 1e-9 * largest, value, 0.0) for value in values]


def _friction_in_space(
    axis: "Axes", trajectory: Trajectory, time: Array, faces: Sequence[ContactFace]
) -> None:
    """Total friction on the body of a solid along x and y, or the size of that of interfaces."""
    forces = -np.einsum("fnk,nkd->fnd", trajectory.friction_forces,
                        trajectory.system.basis.tangents)
    totals = [forces[:, face.nodes].sum(axis=1) for face in faces]
    sizes = [np.linalg.norm(total, axis=1) for total in totals]
    if faces[0].name:
        factor = _labelled(axis, "size of total friction", "N", *sizes)
        for face, size, colour in zip(faces, sizes, distinct_colours(len(faces)), strict=True):
            axis.plot(*thinned(time, size / factor), color=colour, label=legend_label(face.name))
        return
    factor = _labelled(axis, "total friction on the body", "N", totals[0], sizes[0])
    axis.plot(*thinned(time, sizes[0] / factor), color="#b8b4ad", linewidth=2.4, label="size")
    for row, colour in ((0, "#303030"), (1, COLOURS[1])):
        axis.plot(*thinned(time, totals[0][:, row] / factor), color=colour, label=_AXES[row])
    axis.legend(loc="lower left", bbox_to_anchor=(-0.02, 0.98), ncols=3)


def direction_row(trajectory: Trajectory, component: str) -> int:
    """Row of a direction of motion; InputError for one that the bodies do not have."""
    axes = _AXES[: trajectory.system.basis.dimension]
    if component not in axes:
        raise InputError(f"component = {component!r} is not known; choose from {choices(axes)}.")
    return axes.index(component)


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
    component : "x" or "y", of solids "z" too
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
    row = direction_row(trajectory, component)
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
        speed = _ground_speed(trajectory, row)
        # The speed of a much faster ground would flatten the curve.
        if 0.0 < abs(speed) <= 5.0 * float(np.abs(v).max()):
            plane.axhline(speed / factor, color="#303030", linestyle=(0, (4, 3)), linewidth=1.0,
                          label="ground")
        plane.legend(loc="best")
        plane.set_title(_label(point, trajectory))
    return figure


def _ground_speed(trajectory: Trajectory, row: int) -> float:
    """Steady speed of the ground along an axis [m/s]; zero where it has none everywhere."""
    ground, d = trajectory.system.ground, trajectory.system.basis.dimension
    if ground.rotation_speed or row == d - 1:
        return 0.0
    if row == 0:
        return ground.speed if ground.motion is None else 0.0
    return ground.speed_y if ground.motion_y is None else 0.0


def plot_energies(trajectory: Trajectory, *, path: str | Path | None = None) -> "Figure":
    """Plot stored energy, external work and dissipated energy [J] over time.

    Terms that stay zero are left out, and panels without any others.

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
    # Without drive, friction and damping nothing is put in or lost.
    panels = [panel for panel in ENERGY_TERMS
              if any(getattr(energies, name).any() for name in panel[2])] or ENERGY_TERMS[:1]
    with new_figure(10.0, 0.5 + 2.5 * len(panels), path) as figure:
        add_note(figure, drawn)
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        time = _time([axes[-1]], trajectory)
        for axis, (title, sum_of, names) in zip(axes, panels, strict=True):
            total = getattr(energies, sum_of)
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


def usual_points(trajectory: Trajectory) -> tuple[Point, ...]:
    """Point B, unless it is fixed, and the middle contact node of each face; C without any."""
    basis = trajectory.system.basis
    middles = [(face.nodes.start + face.nodes.stop) // 2 for face in contact_faces(basis)
               if face.nodes.stop > face.nodes.start]
    found = (*(("B",) if basis.T[0].any() else ()), *middles[:_MOST_MIDDLES])
    return found or (usual_point(basis),)


def _label(point: Point, trajectory: Trajectory) -> str:
    """Name of a point, and whether its motion is relative to another body."""
    basis = trajectory.system.basis
    way = ", relative (t, n)" if basis.dimension == 2 else ", relative (t, t2, n)"
    return point_name(point, basis) + way * is_relative(point, basis)


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
