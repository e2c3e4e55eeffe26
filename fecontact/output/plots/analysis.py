"""Plots of what a run is analysed for, as files: PNG, PDF or SVG, whole or not at all."""

from collections.abc import Sequence
from pathlib import Path

from fecontact.analysis.frequency_response import FrequencyResponse
from fecontact.analysis.histories import Point
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots import analysis_figures as figures
from fecontact.output.plots.style import save_figure


def plot_spectrum(
    trajectory: Trajectory,
    path: str | Path,
    quantity: str = "velocity",
    point: Point = "B",
    axis: str = "x",
    *,
    density: bool = False,
    highest_hz: float | None = None,
) -> Path:
    """Plot the spectrum of a quantity of a run at evenly spaced output times.

    Parameters
    ----------
    trajectory : Trajectory
        The run, transients cut off by :func:`fecontact.analysis.window.window`.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    quantity, point, axis
        As for :func:`fecontact.analysis.histories.history`.
    density : bool
        Power spectral density by Welch's method in the place of amplitudes.
    highest_hz : float, optional
        End of the axis [Hz].

    Raises
    ------
    InputError
        For a quantity or a point that does not exist, uneven times, another suffix, or a file
        that cannot be written.
    """
    return save_figure(path, lambda: figures.spectrum_figure(
        trajectory, quantity, point, axis, density=density, highest_hz=highest_hz))


def plot_spectrogram(
    trajectory: Trajectory,
    path: str | Path,
    quantity: str = "velocity",
    point: Point = "B",
    axis: str = "x",
    *,
    piece: float | None = None,
    highest_hz: float | None = None,
) -> Path:
    """Plot the amplitudes of a quantity of a run over time and frequency.

    Parameters
    ----------
    trajectory, path, quantity, point, axis, highest_hz
        As for :func:`plot_spectrum`.
    piece : float, optional
        Length of the pieces that are transformed [s]; a thirty-second of the run by default.

    Raises
    ------
    InputError
        As :func:`plot_spectrum`.
    """
    return save_figure(path, lambda: figures.spectrogram_figure(
        trajectory, quantity, point, axis, piece=piece, highest_hz=highest_hz))


def plot_poincare(
    trajectory: Trajectory,
    path: str | Path,
    point: Point = "B",
    axis: str = "x",
    *,
    period: float | None = None,
    phase: float = 0.0,
) -> Path:
    """Plot a Poincare section: the state of a point once per period, over its motion.

    Parameters
    ----------
    trajectory, path
        As for :func:`plot_spectrum`.
    point : str, int or (x, y)
        As for :meth:`Trajectory.displacement`.
    axis : "x" or "y"
        Direction of the motion.
    period, phase
        As for :func:`fecontact.analysis.periodicity.strobed_states`.

    Raises
    ------
    InputError
        For a point or an axis that does not exist, a system without a period, another suffix, or
        a file that cannot be written.
    """
    return save_figure(path, lambda: figures.poincare_figure(
        trajectory, point, axis, period=period, phase=phase))


def plot_friction_work(trajectory: Trajectory, path: str | Path) -> Path:
    """Plot where on the face friction works: energy per length [J/m] and slip [m] of each node.

    Parameters
    ----------
    trajectory, path
        As for :func:`plot_spectrum`.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return save_figure(path, lambda: figures.friction_work_figure(trajectory))


def plot_response(
    responses: FrequencyResponse | Sequence[FrequencyResponse],
    path: str | Path,
    labels: Sequence[str] = (),
) -> Path:
    """Plot magnitude and phase of frequency responses.

    Parameters
    ----------
    responses : FrequencyResponse or sequence of them
        What :func:`fecontact.analysis.frequency_response.frequency_response` found, all of one
        kind.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    labels : sequence of str
        A name for each.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    several = [responses] if isinstance(responses, FrequencyResponse) else list(responses)
    return save_figure(path, lambda: figures.response_figure(several, labels))
