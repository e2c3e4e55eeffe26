"""Motions in phase space: curves of two or three quantities of their states."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, choices, nearest, shown
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import COLOURS, distinct_colours
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Motion = FieldRun | Trajectory | PeriodicMotion


@dataclass(frozen=True, eq=False)
class Curve:
    """A motion in phase space: times (N,), places (N, 2 or 3), and where its events are (K, 2)."""

    time: Array
    places: Array
    events: Array


def phase_curves(
    motions: Motion | Sequence[Motion], coordinates: Sequence[str | int | ArrayLike],
    labels: Sequence[str] | None,
) -> tuple[list[Curve], list[str]]:
    """Curves of motions and the names of their axes; see :func:`plot_phase_space`.

    Raises
    ------
    InputError
        For what is no motion, no state, or not two or three of them.
    """
    require_kind("A plot in phase space", (Sequence, FieldRun, Trajectory, PeriodicMotion),
                 motions=motions)
    require_kind("A plot in phase space", (Sequence, np.ndarray), coordinates=coordinates)
    given = [motions] if isinstance(motions, Motion) else list(motions)
    if not given or not all(isinstance(one, Motion) for one in given):
        raise InputError("motions must be a FieldRun, a Trajectory or a PeriodicMotion, or several "
                         "of them.")
    if isinstance(coordinates, str) or len(coordinates) not in (2, 3):
        raise InputError(f"coordinates = {shown(coordinates)} must be two or three states.")
    if labels is not None and len(labels) != len(coordinates):
        raise InputError(f"labels = {shown(labels)} must be {len(coordinates)} texts, one for each "
                         f"coordinate.")
    curves = []
    for one in given:
        rows = np.array([_row(one, coordinate) for coordinate in coordinates])
        time = one.times if isinstance(one, PeriodicMotion) else one.time
        events = None if isinstance(one, PeriodicMotion) else one.events
        passed = np.zeros((0, len(rows))) if events is None else events.states @ rows.T
        curves.append(Curve(time, one.states @ rows.T, passed))
    known = _names(given[0])
    names = [one if isinstance(one, str) else f"quantity {number + 1}"
             if not isinstance(one, int | np.integer) else known[one] if known else f"state {one}"
             for number, one in enumerate(coordinates)]
    return curves, names if labels is None else list(labels)


def _names(motion: Motion) -> tuple[str, ...]:
    """Names of the states of a motion; none of a trajectory."""
    return () if isinstance(motion, Trajectory) else tuple(motion.state_names)


def _row(motion: Motion, coordinate: Any) -> Array:
    """A coordinate as a row (size,) that acts on states."""
    size = motion.states.shape[1]
    names = _names(motion)
    if isinstance(coordinate, str):
        if coordinate not in names:
            known = choices(names) if names else f"their numbers from 0 to {size - 1}"
            raise InputError(f"There is no state {coordinate!r}{nearest(coordinate, names)}; the "
                             f"states of this motion are: {known}.")
        return np.eye(size)[names.index(coordinate)]
    if isinstance(coordinate, int | np.integer) and not isinstance(coordinate, bool):
        if not 0 <= coordinate < size:
            raise InputError(f"There is no state {coordinate}; this motion has {size}, from 0.")
        return np.eye(size)[coordinate]
    row = as_floats(coordinate, "coordinates")
    if row.shape != (size,):
        raise InputError(f"coordinates: a row must have {size} numbers, one for each state, not "
                         f"shape {row.shape}.")
    return row


def phase_axis(figure: "Figure", labels: Sequence[str], curves: Sequence[Curve]) -> Any:
    """Axes of a plane or of space that hold all curves, with their names."""
    space = len(labels) == 3
    axis: Any = figure.add_subplot(projection="3d" if space else None)
    low = np.min([curve.places.min(axis=0) for curve in curves], axis=0)
    high = np.max([curve.places.max(axis=0) for curve in curves], axis=0)
    margin = 0.05 * np.where(high > low, high - low, np.maximum(np.abs(high), 1.0))
    for name, label, below, above in zip("xyz", labels, low - margin, high + margin, strict=False):
        axis.set(**{f"{name}label": label, f"{name}lim": (below, above)})
    return axis


def plot_phase_space(
    motions: Motion | Sequence[Motion],
    coordinates: Sequence[str | int | ArrayLike] = (0, 1),
    *,
    labels: Sequence[str] | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """Plot motions as curves of two or three of their states, with their ends and events.

    Parameters
    ----------
    motions : FieldRun, Trajectory, PeriodicMotion or sequence of them
        Runs, and orbits of branches (``point.orbit(field)``).
    coordinates : sequence of two or three
        States by name, of runs and orbits of vector fields, or by number from 0; or rows (size,)
        that give a quantity from a state, such as ``displacement_row`` of a contact field.
    labels : sequence of str, optional
        Names of the axes.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a state that does not exist, another suffix, or a file that cannot be written.
    """
    curves, names = phase_curves(motions, coordinates, labels)
    with new_figure(6.4, 5.2, path) as figure:
        axis = phase_axis(figure, names, curves)
        for curve, colour in zip(curves, distinct_colours(len(curves)), strict=True):
            axis.plot(*curve.places.T, color=colour, linewidth=0.9)
            axis.plot(*curve.places[-1:].T, "o", color=colour, markersize=5.0)
            if len(curve.events):
                axis.plot(*curve.events.T, "o", markersize=2.5, linestyle="none",
                          color=COLOURS[1] if len(curves) == 1 else colour)
    return figure
