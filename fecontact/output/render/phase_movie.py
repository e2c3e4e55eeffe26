"""Movies of motions in phase space."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_count, is_numeric
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.phase_space import Curve, Motion, phase_axis, phase_curves
from fecontact.output.render.movie import Progress, target, write_images
from fecontact.output.render.overlay import Image
from fecontact.output.render.pixels import pixels

_DPI = 100
_PATH = "#d0ccc4"  # of the whole motion


def render_phase_space(
    motions: Motion | Sequence[Motion],
    path: str | Path,
    coordinates: Sequence[str | int | ArrayLike] = (0, 1),
    *,
    labels: Sequence[str] | None = None,
    frames: int = 200,
    fps: float = 25,
    size: tuple[int, int] = (960, 540),
    trail: float = 0.1,
    turn: float = 0.0,
    title: str | None = None,
    progress: bool | Progress | None = None,
) -> Path:
    """Draw motions in phase space as a movie or as numbered pictures, whole or not at all.

    A dot with a trail moves along each curve; all dots share one time.

    Parameters
    ----------
    motions, coordinates, labels
        See :func:`fecontact.plot.plot_phase_space`; in space with three coordinates.
    path : str or Path
        See :func:`fecontact.render`.
    frames : int
        Number of frames, evenly spaced over the longest motion, at least 2.
    fps, size, progress
        See :func:`fecontact.render`.
    trail : float
        Length of the trail, as a part of the whole time, from 0 to 1.
    turn : float
        Angle by which the view turns about the third axis in the movie [degrees].
    title : str, optional
        Shown at the top, in front of the time.

    Returns
    -------
    Path
        The movie, the folder, or the first picture.

    Raises
    ------
    InputError, MissingLibraryError
        For a state that does not exist, values out of range, and as :func:`fecontact.render`.
    """
    curves, names = phase_curves(motions, coordinates, labels)
    path, _ = target(path, fps, size)
    frames = as_count(frames, "frames", 2)
    if not (is_numeric([trail]) and 0.0 <= trail <= 1.0):
        raise InputError(f"trail = {trail!r} must be a part of the time, from 0 to 1.")
    if not (is_numeric([turn]) and np.isfinite(turn)):
        raise InputError(f"turn = {turn!r} must be a finite angle in degrees.")
    images = _images(curves, names, frames, size, float(trail), float(turn), title)
    return write_images(images, frames, path, fps, size, progress)


def _images(
    curves: Sequence[Curve], names: Sequence[str], frames: int, size: tuple[int, int],
    trail: float, turn: float, title: str | None,
) -> Iterator[Image]:
    start = min(float(curve.time[0]) for curve in curves)
    end = max(float(curve.time[-1]) for curve in curves)
    scale = min(size[0] / 960.0, size[1] / 540.0)
    with new_figure(size[0] / _DPI, size[1] / _DPI) as figure:
        figure.set_dpi(_DPI)
        axis = phase_axis(figure, names, curves)
        space, drawn = len(names) == 3, []
        azimuth = axis.azim if space else 0.0
        for curve, colour in zip(curves, distinct_colours(len(curves)), strict=True):
            axis.plot(*curve.places.T, color=_PATH, linewidth=0.7 * scale)
            (line,) = axis.plot(*curve.places[:1].T, color=colour, linewidth=2.2 * scale)
            (dot,) = axis.plot(*curve.places[:1].T, "o", color=colour, markersize=8.0 * scale)
            drawn.append((curve, line, dot))
        for now in np.linspace(start, end, frames):
            for curve, line, dot in drawn:
                recent = _between(curve, now - trail * (end - start), now)
                _place(line, recent)
                _place(dot, recent[-1:])
            axis.set_title(f"{title}    t = {now:.4g} s" if title else f"t = {now:.4g} s")
            if space and turn:
                axis.view_init(azim=azimuth + turn * (now - start) / (end - start))
            figure.canvas.draw()
            yield pixels(figure.canvas)


def _between(curve: Curve, first: float, last: float) -> Array:
    """Places of a motion over a time, both ends interpolated; at its own ends outside of it."""
    inside = (curve.time > first) & (curve.time < last)
    ends = [[np.interp(time, curve.time, values) for values in curve.places.T]
            for time in (first, last)]
    return np.vstack([ends[0], curve.places[inside], ends[1]])


def _place(line: Any, places: Array) -> None:
    if places.shape[1] == 3:
        line.set_data_3d(*places.T)
    else:
        line.set_data(*places.T)
