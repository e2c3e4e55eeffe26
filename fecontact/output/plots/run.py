"""Plots of a run: histories, phase planes, energies."""

from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.analysis.histories import Point, usual_point
from fecontact.analysis.resolved import resolved
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.runs import (
    AXES,
    energy_diagrams,
    force_diagrams,
    motion_diagrams,
    phase_diagram,
    usual_points,
)
from fecontact.output.plots.drawing import draw
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.style import add_note

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_history(
    trajectory: Trajectory, points: Sequence[Point] = (), *, path: str | Path | None = None
) -> "Figure":
    """Plot displacements and velocities of points, and the total contact forces, over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    points : sequence of str, int or (x, y)
        See :meth:`Trajectory.displacement`; B and the contact node in the middle by default,
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
    motions = motion_diagrams(trajectory, points)
    moving = sorted({axis for (_, axis), one in motions.items() if one.curves}) or [0]
    panels = [[motions["displacement", axis], motions["velocity", axis]] for axis in moving]
    forces = force_diagrams(trajectory)[:2]
    if forces:
        panels.append([one for one in forces if one is forces[0] or one.largest > 0.0])
    with new_figure(10.0, 2.5 * len(panels), path) as figure:
        add_note(figure, drawn)
        grid = figure.subplot_mosaic([[row[0].y_label, row[-1].y_label] for row in panels],
                                     sharex=True)
        bottom = {one.y_label for one in panels[-1]}
        for one in chain.from_iterable(panels):
            axes = grid[one.y_label]
            draw(axes, one)
            if one.y_label not in bottom:
                axes.set_xlabel("")
                axes.tick_params(labelbottom=False)
        for side in (0, -1):
            figure.align_ylabels([grid[row[side].y_label] for row in panels])
        points_shown = {text: line for one in motions.values() if one.y_label in grid
                        for line, text in zip(*grid[one.y_label].get_legend_handles_labels(),
                                              strict=True)}
        figure.legend(points_shown.values(), points_shown, loc="outside upper center",
                      ncols=max(1, min(len(points), 6)))
        for one in forces:
            if one.y_label in grid and len({curve.name for curve in one.curves} - {""}) > 0 and (
                    one is forces[0] or one.curves[0].name != forces[0].curves[0].name):
                # Above the forces: within the panel it would hide curves.
                grid[one.y_label].legend(loc="lower left", bbox_to_anchor=(-0.02, 0.98),
                                         ncols=max(1, min(len(one.curves), 6)))
    return figure


def direction_row(trajectory: Trajectory, component: str) -> int:
    """Row of a direction of motion; InputError for one that the bodies do not have."""
    axes = AXES[: trajectory.basis.dimension]
    if component not in axes:
        raise InputError(f"component = {component!r} is not known; choose from {choices(axes)}.")
    return axes.index(component)


def plot_phase(
    trajectory: Trajectory, point: Point | None = None, component: str = "x", *,
    path: str | Path | None = None,
) -> "Figure":
    """Plot the velocity of a point over its displacement, and the speed of the ground.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    point : str, int or (x, y), optional
        See :func:`fecontact.analysis.history`.
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
    point = usual_point(trajectory.basis) if point is None else point
    drawn = resolved(trajectory)
    with new_figure(6.4, 5.2, path) as figure:
        add_note(figure, drawn)
        plane = figure.subplots()
        draw(plane, phase_diagram(drawn.trajectory, point, row))
        plane.legend(loc="best")
    return figure


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
    panels = energy_diagrams(trajectory)
    with new_figure(10.0, 0.5 + 2.5 * len(panels), path) as figure:
        add_note(figure, drawn)
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, diagram in zip(axes, panels, strict=True):
            if len(diagram.curves) == 1:  # nothing but the total, which is zero
                axis.set(ylim=(-1.0, 1.0), yticks=[0.0])
            draw(axis, diagram)
            axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        for axis in axes[:-1]:
            axis.set_xlabel("")
        figure.align_ylabels(axes)
        axes[0].set_title(f"error of the energy balance: {imbalance:.1e} of the largest term")
    return figure
