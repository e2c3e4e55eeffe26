"""Plots as files: PNG, PDF or SVG, written whole or not at all."""

from collections.abc import Sequence
from pathlib import Path

from fecontact.core.checks import require_kind
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots import figures
from fecontact.output.plots.figures import Point
from fecontact.output.plots.modes import convergence_figure, modes_figure
from fecontact.output.plots.style import save_figure as _save
from fecontact.reduction.convergence import ModeConvergence
from fecontact.reduction.modal_basis import ModalBasis


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

    Raises
    ------
    InputError
        For a point that does not exist, another suffix, or a file that cannot be written.
    """
    require_kind("plot_history", Trajectory, trajectory=trajectory)
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

    Raises
    ------
    InputError
        For a point or an axis that does not exist, another suffix, or a file that cannot be
        written.
    """
    require_kind("plot_phase", Trajectory, trajectory=trajectory)
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

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_contact_map", Trajectory, trajectory=trajectory)
    return _save(path, lambda: figures.contact_map_figure(trajectory))


def plot_energies(trajectory: Trajectory, path: str | Path) -> Path:
    """Plot stored energies, work put in and energy lost [J] over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_energies", Trajectory, trajectory=trajectory)
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

    Raises
    ------
    InputError
        For a basis without shapes, a count below one, another suffix, or a file that cannot be
        written.
    """
    require_kind("plot_modes", ModalBasis, basis=basis)
    return _save(path, lambda: modes_figure(basis, count))


def plot_convergence(result: ModeConvergence, path: str | Path) -> Path:
    """Plot how frequencies and contact compliance change with the mesh and the modes.

    Parameters
    ----------
    result : ModeConvergence
        What :func:`fecontact.reduction.convergence.mode_convergence` found.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return _save(path, lambda: convergence_figure(result))
