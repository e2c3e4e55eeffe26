"""Dots of runs beneath bifurcation diagrams, letters in them, and phase planes above them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.types import Array
from fecontact.output.diagrams.colours import DASHES, DOTS, INK
from fecontact.output.diagrams.diagram import Curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.continuation.point import BranchPoint
    from fecontact.bifurcation.fields.contact_field import ContactField


Label = tuple[str, float, float]  # text and place in a diagram

_AWAY = 6.0  # points between a place and its letters
# Sides on which letters may stand, the usual ones first: steps to the right and up.
_SIDES = ((1, 1), (-1, -1), (-1, 1), (1, -1), (0, 1), (0, -1), (1, 0), (-1, 0))


@dataclass(frozen=True, eq=False)
class Inset:
    """A phase plane that belongs to a point of a diagram; see :func:`phase_inset`.

    Attributes
    ----------
    point : BranchPoint
        The orbit, drawn dashed where its stored 'stable' is False.
    displacement, velocity : (k,) arrays
        The closed curve, in m and m/s (rad and rad/s of a rotation).
    title : str
        Above it.
    """

    point: "BranchPoint"
    displacement: Array
    velocity: Array
    title: str


def phase_inset(
    field: "ContactField", point: "BranchPoint", observe: tuple[str | int, str] = ("B", "x"),
    title: str | None = None,
) -> Inset:
    """The phase plane (u, du/dt) of an orbit, to be drawn above a bifurcation diagram.

    Parameters
    ----------
    field : ContactField
        Field of the branch.
    point : BranchPoint
        A point of a branch of orbits, by collocation or shooting. A letter joins the inset to its
        place in the diagram of :func:`fecontact.plot.plot_branches`.
    observe : (point, component)
        Displacement u that is drawn: 'B', 'C', a named point or the number of a contact node; 'x',
        'y' or 'phi', of solids also 'z', 'phi_x', 'phi_y', 'phi_z'.
    title : str, optional
        Title of the inset; by default parameter and value.

    Raises
    ------
    InputError
        If the point is no orbit or on no branch, or there is no such displacement.
    """
    from fecontact.bifurcation.continuation.point import BranchPoint
    from fecontact.bifurcation.fields.contact_field import ContactField

    require_kind("phase_inset", ContactField, field=field)
    require_kind("phase_inset", BranchPoint, point=point)
    states = point.orbit(field).states
    row = field.displacement_row(*observe)
    modes = field.system().basis.modes
    rate = np.concatenate([np.zeros(modes), row[:modes], np.zeros(len(row) - 2 * modes)])
    return Inset(point, states @ row, states @ rate,
                 title or f"{point.branch.parameter_name} = {point.parameter:.4g}")


def main_axis(figure: "Figure", insets: Sequence[Inset]) -> "Axes":
    """The axis of the diagram, with a row of small ones above it where there are insets."""
    if not insets:
        return figure.subplots()
    grid = figure.add_gridspec(2, max(3, len(insets)), height_ratios=(1.0, 2.4))
    return figure.add_subplot(grid[1, :])


def draw_insets(
    figure: "Figure", axis: "Axes", insets: Sequence[Inset],
    place: Callable[["BranchPoint"], tuple[float, float]],
) -> list[Label]:
    """Phase planes above the diagram; returns the letter of each and the place of its point."""
    if not insets:
        return []
    from fecontact.core.units import suitable_unit

    # From left to right as in the diagram.
    ordered = sorted(insets, key=lambda inset: place(inset.point)[0])
    length, length_name = suitable_unit(
        float(max(np.abs(inset.displacement).max() for inset in ordered)), "m")
    speed, speed_name = suitable_unit(
        float(max(np.abs(inset.velocity).max() for inset in ordered)), "m/s")
    grid = axis.get_gridspec()
    assert grid is not None
    letters: list[Label] = []
    for number, inset in enumerate(ordered):
        x, y = place(inset.point)
        letters.append((_letter(number), x, y))
        small = figure.add_subplot(grid[0, number])
        small.plot(inset.displacement / length, inset.velocity / speed, color=INK, linewidth=1.0,
                   linestyle="-" if inset.point.values.get("stable", True) else DASHES)
        small.set_title(f"{letters[-1][0]}: {inset.title}", fontsize=9.0)
        small.tick_params(labelsize=7.5)
        small.set_xlabel(f"displacement [{length_name}]" if number == 0 else "", fontsize=8.0,
                         loc="left")
        small.set_ylabel(f"velocity [{speed_name}]" if number == 0 else "", fontsize=8.0)
        small.margins(0.08)
        axis.plot(x, y, "o", markersize=4.0, color=INK, zorder=6)
    return letters


def _letter(number: int) -> str:
    return ascii_lowercase[number % 26] + (str(number // 26 + 1) if number > 25 else "")


def place_labels(figure: "Figure", axis: "Axes", labels: Sequence[Label]) -> None:
    """Write letters beside places of a finished diagram.

    They stand within the axes, on no marker and on no other letters, and on curves only if these
    are on all sides. Letters without room are left out.
    """
    from matplotlib.patheffects import withStroke

    if not labels:
        return
    figure.draw_without_rendering()  # the layout decides where the places are
    points = 72.0 / figure.dpi
    seen = axis.transData.transform([(x, y) for _, x, y in labels]) * points
    inside = axis.get_window_extent().get_points() * points
    drawn = np.concatenate([_along(axis.transData.transform(line.get_xydata()) * points,
                                   line.get_linestyle() != "None") for line in axis.lines])
    taken = [(place - 4.0, place + 4.0) for place in seen]
    for (text, x, y), place in zip(labels, seen, strict=True):
        size = np.array([6.5 * len(text), 10.0])
        free: list[tuple[int, int, Any, Any]] = []
        for rank, side in enumerate(_SIDES):
            low = place + _AWAY * np.array(side) - 0.5 * (1.0 - np.array(side)) * size
            high = low + size
            if (low < inside[0]).any() or (high > inside[1]).any() or any(
                    (low < end).all() and (start < high).all() for start, end in taken):
                continue
            crossed = int(((low <= drawn) & (drawn <= high)).all(axis=1).sum())
            free.append((crossed, rank, low, high))
        if not free:
            continue
        _, rank, low, high = min(free, key=lambda one: one[:2])
        taken.append((low, high))
        right, up = _SIDES[rank]
        axis.annotate(
            text, (x, y), xytext=(_AWAY * right, _AWAY * up), textcoords="offset points",
            ha=("right", "center", "left")[right + 1], va=("top", "center", "bottom")[up + 1],
            fontsize=9.0, zorder=7,
            path_effects=[withStroke(linewidth=2.5, foreground="white")])


def _along(places: Array, joined: bool) -> Array:
    """Places (k, 2) in points along a curve, at most some points apart, or those of dots alone."""
    places = places[np.isfinite(places).all(axis=1)]
    if not joined or len(places) < 2:
        return places
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
    at = np.linspace(0.0, length[-1], 2 + int(min(length[-1] / 2.0, 1e5)))
    return np.column_stack([np.interp(at, length, values) for values in places.T])


def scan_curves(
    runs: "PoincareScan | None", observe: tuple[str | int, str] | str
) -> list[Curve]:
    """Dots of runs once per period or on a section, up and down."""
    if runs is None:
        return []
    point, component = (observe, None) if isinstance(observe, str) else observe
    up, down = runs.observed(point, component)  # type: ignore[arg-type]
    return [Curve(f"runs, {name}", DOTS[name], np.repeat(runs.values, values.shape[1]),
                  values.reshape(-1), 0.0, size)
            for name, values, size in (("up", up, 2.6), ("down", down, 1.3)) if values.size]
