"""Plots as files: PNG, PDF or SVG, written whole or not at all."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.basis import ModalBasis
from fecontact.errors import InputError, choices
from fecontact.integrate.trajectory import Trajectory
from fecontact.mode_convergence import ModeConvergence
from fecontact.output import figures
from fecontact.output.figures import Point
from fecontact.output.mode_shapes import convergence_figure, modes_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fecontact.sweeps.statistics import Sensitivity
    from fecontact.sweeps.table import SweepTable

_SUFFIXES = (".png", ".pdf", ".svg")


def plot_history(trajectory: Trajectory, path: str | Path, points: Sequence[Point] = ()) -> Path:
    """Plot displacements and velocities of points, and the total contact forces, over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    points : sequence of str, int or (x, y)
        As for :meth:`Trajectory.displacement`; B and the contact node in the middle by default.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For a point that does not exist, another suffix, or a file that cannot be written.
    """
    return _save(path, lambda: figures.history_figure(trajectory, points))


def plot_phase(
    trajectory: Trajectory, path: str | Path, point: Point = "B", axis: str = "x"
) -> Path:
    """Plot the velocity of a point over its displacement, and the speed of the ground.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    point : str, int or (x, y)
        As for :meth:`Trajectory.displacement`.
    axis : "x" or "y"
        Direction of the motion.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For a point or an axis that does not exist, another suffix, or a file that cannot be
        written.
    """
    return _save(path, lambda: figures.phase_figure(trajectory, point, axis))


def plot_contact_map(trajectory: Trajectory, path: str | Path) -> Path:
    """Plot pressure [N/m] and state of the contact nodes over time and position.

    In runs with more output times than columns of the picture, a column shows the largest
    pressure and the most frequent state of its times. The band of a node is as wide as its
    tributary length; places without contact face stay blank. States are open, stick and slip, or
    open and contact if all friction forces of the run are zero.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return _save(path, lambda: figures.contact_map_figure(trajectory))


def plot_energies(trajectory: Trajectory, path: str | Path) -> Path:
    """Plot stored energies, work put in and energy lost [J] over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return _save(path, lambda: figures.energies_figure(trajectory))


def plot_modes(basis: ModalBasis, path: str | Path, *, count: int = 12) -> Path:
    """Plot the shapes of the first modes, each scaled to the same largest displacement.

    Parameters
    ----------
    basis : ModalBasis
        With shapes over the body.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    count : int
        Largest number of modes.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For a basis without shapes, a count below one, another suffix, or a file that cannot be
        written.
    """
    return _save(path, lambda: modes_figure(basis, count))


def plot_convergence(result: ModeConvergence, path: str | Path) -> Path:
    """Plot how frequencies and contact compliance change with the mesh and the modes.

    Parameters
    ----------
    result : ModeConvergence
        What :func:`fecontact.mode_convergence.mode_convergence` found.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return _save(path, lambda: convergence_figure(result))


def plot_sweep(
    table: "SweepTable", name: str, path: str | Path, over: Sequence[str] | None = None
) -> Path:
    """Plot a summary of a sweep over the parameters that changed.

    A map for a grid of two parameters with many values each, curves for a grid of one parameter,
    or of two where one has few values or values that are not numbers; for all other sweeps a
    scatter plot for each parameter, and a histogram.

    Parameters
    ----------
    table : SweepTable
        What :func:`fecontact.sweep` returned.
    name : str
        The summary.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    over : one or two parameters, optional
        One for curves, two for a map in which the others have their first value.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For a summary or parameter that does not exist, a sweep of one case, another suffix, or a
        file that cannot be written.
    """
    from fecontact.output import sweep_figures

    for column in (name, *(over or ())):
        table.column(column)
    if name not in table.values:
        raise InputError(f"'{name}' is a parameter of the sweep; plot one of its summaries "
                         f"{choices(table.values)}.")
    if over is None:
        return _save(path, lambda: sweep_figures.sweep_figure(table, name))
    if len(over) == 1:
        return _save(path, lambda: sweep_figures.diagram_figure(table, name, over[0]))
    return _save(path, lambda: sweep_figures.map_figure(table, name, over[0], over[1]))


def plot_sensitivity(found: "Mapping[str, Sensitivity]", path: str | Path) -> Path:
    """Plot Sobol indices of summaries with their confidence intervals.

    Parameters
    ----------
    found : mapping of summary to Sensitivity
        What :func:`fecontact.sensitivity` found.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    from fecontact.output import sweep_figures

    return _save(path, lambda: sweep_figures.sensitivity_figure(found))


def _save(path: str | Path, figure: Callable[[], "Figure"]) -> Path:
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} must end in {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
    if not path.parent.is_dir():
        raise InputError(f"{path} cannot be written: folder {path.parent} does not exist.")
    from matplotlib import rc_context

    part = path.with_name(path.name + ".part")
    try:
        with rc_context(figures.STYLE):
            figure().savefig(part, format=path.suffix[1:].lower())
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror or error}).") from None
    finally:
        part.unlink(missing_ok=True)
    return path
