"""Dots of runs beneath bifurcation diagrams, and phase planes above them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.types import Array
from fecontact.output.plots.style import DASHES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.continuation.points import BranchPoint
    from fecontact.bifurcation.fields.contact_field import ContactField


_INK = "#303030"
# Colours of runs; branches have others.
DOTS = {"up": "#b4b0a8", "down": "#e69f00"}


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
        That of the branch.
    point : BranchPoint
        A point of a branch of orbits, by collocation or shooting. The inset is joined to its place
        in the diagram of :func:`fecontact.plot.plot_branches`.
    observe : (point, component)
        Displacement u that is drawn: 'B', 'C', a named point or the number of a contact node; 'x',
        'y' or 'phi'.
    title : str, optional
        By default parameter and value.

    Raises
    ------
    InputError
        If the point is no orbit or on no branch, or there is no such displacement.
    """
    from fecontact.bifurcation.continuation.points import BranchPoint
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
) -> None:
    """Phase planes above the diagram, each with a line to the place of its point."""
    from matplotlib.patches import ConnectionPatch

    if not insets:
        return
    from fecontact.core.units import suitable_unit

    # From left to right as in the diagram, so that the lines do not cross.
    ordered = sorted(insets, key=lambda inset: place(inset.point)[0])
    length, length_name = suitable_unit(
        float(max(np.abs(inset.displacement).max() for inset in ordered)), "m")
    speed, speed_name = suitable_unit(
        float(max(np.abs(inset.velocity).max() for inset in ordered)), "m/s")
    grid = axis.get_gridspec()
    assert grid is not None
    for number, inset in enumerate(ordered):
        x, y = place(inset.point)
        small = figure.add_subplot(grid[0, number])
        small.plot(inset.displacement / length, inset.velocity / speed, color=_INK, linewidth=1.0,
                   linestyle="-" if inset.point.values["stable"] else DASHES)
        small.set_title(inset.title, fontsize=9.0)
        small.tick_params(labelsize=7.5)
        small.set_xlabel(f"displacement [{length_name}]" if number == 0 else "", fontsize=8.0,
                         loc="left")
        small.set_ylabel(f"velocity [{speed_name}]" if number == 0 else "", fontsize=8.0)
        small.margins(0.08)
        axis.plot(x, y, "o", markersize=4.0, color=_INK, zorder=6)
        figure.add_artist(ConnectionPatch(
            (0.5, 0.0), (x, y), small.transAxes, axis.transData,
            color="#8a8a8a", linewidth=0.7, zorder=5))


def draw_beneath(
    axis: "Axes", runs: "PoincareScan | None", observe: tuple[str | int, str]
) -> list[Any]:
    """Dots of runs once per period, up and down; handles for the legend."""
    if runs is None:
        return []
    from matplotlib.lines import Line2D

    point, component = observe
    up, down = runs.observed(point, component)  # type: ignore[arg-type]
    handles = []
    for name, values, size in (("up", up, 2.6), ("down", down, 1.3)):
        if not values.size:
            continue
        places = np.repeat(runs.values, values.shape[1])
        axis.plot(places, values.reshape(-1), "o", color=DOTS[name], markersize=size,
                  markeredgewidth=0.0, linestyle="none", zorder=1, rasterized=True)
        handles.append(Line2D([], [], color=DOTS[name], marker="o", linestyle="none",
                              markersize=4.0, label=f"runs, {name}"))
    return handles
