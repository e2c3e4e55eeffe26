"""Bifurcation diagrams."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_texts, require_kind
from fecontact.core.errors import InputError, choices, shown
from fecontact.core.types import Array
from fecontact.output.plots.diagram_insets import (
    DOTS,
    Label,
    draw_beneath,
    draw_insets,
    main_axis,
    place_labels,
)
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.parameter_labels import branch_label, name_axis
from fecontact.output.plots.style import DASHES, distinct_colours, legend_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.bifurcation.continuation.point import BranchPoint
    from fecontact.output.plots.diagram_insets import Inset

Quantity = str | int | Callable[["BranchPoint"], float]

# Letters and markers of special points.
SPECIAL = {
    "Hopf": ("H", "o"), "fold": ("F", "s"), "branch point": ("BP", "D"),
    "period doubling": ("PD", "^"), "Neimark-Sacker": ("NS", "v"), "cusp": ("CP", "P"),
    "Bogdanov-Takens": ("BT", "*"), "Bautin": ("GH", "X"), "zero-Hopf": ("ZH", "<"),
    "double Hopf": ("HH", ">"), "unresolved": ("?", "x"),
    "generalised period doubling": ("GPD", "p"), "Chenciner": ("CH", "h"),
    "resonance 1:1": ("R1", "1"), "resonance 1:2": ("R2", "2"), "resonance 1:3": ("R3", "3"),
    "resonance 1:4": ("R4", "4"), "fold-flip": ("FPD", "d"),
    "fold-Neimark-Sacker": ("FNS", "d"), "flip-Neimark-Sacker": ("PDNS", "d"),
    "double Neimark-Sacker": ("NSNS", "d"), "neutral saddle": ("NSS", "d"),
    "stable double eigenvalue": ("DRS", "d"), "unstable double eigenvalue": ("DRU", "d"),
    "stable orbit flip": ("OFS", "d"), "unstable orbit flip": ("OFU", "d"),
    "stable inclination flip": ("IFS", "d"), "unstable inclination flip": ("IFU", "d"),
    # Borders of contact states: one marker for all.
    "grazing": ("G", "d"), "grazing-sliding": ("GS", "d"), "crossing-sliding": ("CS", "d"),
    "switching-sliding": ("SS", "d"), "adding-sliding": ("AS", "d"), "lift-off": ("LO", "d"),
    "impact-sliding": ("IS", "d"), "corner": ("CC", "d"),
}
# Letters alone, for diagrams of other kinds.
LETTERS = {kind: letters for kind, (letters, _) in SPECIAL.items()}


def plot_branches(
    branches: "Branch | Sequence[Branch]", y: Quantity = 0, *,
    x: Quantity = "parameter", x_label: str | None = None, y_label: str | None = None,
    names: Sequence[str] = (), beneath: "PoincareScan | None" = None,
    observe: tuple[str | int, str] | str = ("B", "x"), insets: "Sequence[Inset]" = (),
    path: str | Path | None = None,
) -> "Figure":
    """Plot branches: stable parts solid, unstable ones dashed, special points marked and labelled.

    Parameters
    ----------
    branches : Branch or sequence of Branch
        Each gets its own colour, those of one name the same.
    y, x : str, int or callable
        Quantities of the axes: 'parameter', the name of a stored number, the number of a state from
        0 (of orbits its largest value), or a function of a
        :class:`fecontact.bifurcation.BranchPoint`. For y also 'observed_section' of
        :func:`fecontact.bifurcation.observe`, one curve for each period of the excitation.
    x_label, y_label : str, optional
        Labels of the axes, with SI units, such as ``amplitude [m]``; ticks are in a unit that
        suits the values.
    names : sequence of str
        Names of the branches for the legend, in which each name stands once; several branches
        without names are numbered there.
    beneath : PoincareScan, optional
        Runs over the same parameter, drawn as dots beneath the branches, up and down apart; y
        should be 'observed_section'.
    observe : (point, component) or str
        The displacement of the runs that is drawn, of a vector field a state; see
        :meth:`fecontact.bifurcation.PoincareScan.observed`.
    insets : sequence of Inset
        Phase planes of chosen points, drawn above the diagram; see
        :func:`fecontact.plot.phase_inset`. A letter names each and its point.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a quantity that is not stored, another suffix, or a file that cannot be written.
    """
    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.output.plots.diagram_insets import Inset

    require_kind("plot_branches", (Branch, Sequence), branches=branches)
    branches = [branches] if isinstance(branches, Branch) else list(branches)
    for branch in branches:
        require_kind("plot_branches", Branch, branch=branch)
    require_kind("plot_branches", (PoincareScan, type(None)), beneath=beneath)
    require_kind("plot_branches", Sequence, insets=insets)
    for inset in insets:
        require_kind("plot_branches", Inset, inset=inset)
    require_kind("plot_branches", (str, type(None)), x_label=x_label, y_label=y_label)
    names = as_texts(names, "plot_branches: names")
    for name, quantity in (("x", x), ("y", y)):
        if not (isinstance(quantity, str | int | np.integer) or callable(quantity)):
            raise InputError(f"plot_branches: {name} = {shown(quantity)} must be the name of a "
                             f"stored number, the number of a state, or a function of a point.")
    if not branches:
        raise InputError("branches = [] holds nothing to draw; give at least one Branch.")
    with new_figure(8.0, 7.2 if insets else 5.2, path) as figure:
        axis = main_axis(figure, insets)
        dots = draw_beneath(axis, beneath, observe)
        known: dict[str, list[tuple[float, float]]] = {}
        dashed = False
        if len(branches) > 1:
            names = [*names, *(f"branch {k + 1}" for k in range(len(names), len(branches)))]
        groups = [*names[: len(branches)], *range(len(names), len(branches))]
        # One colour more than needed, as those of the runs are left out.
        apart = [colour for colour in distinct_colours(len(set(groups)) + 1)
                 if colour not in DOTS.values()]
        colours = dict(zip(dict.fromkeys(groups), apart, strict=False))
        for group, branch in zip(groups, branches, strict=True):
            places, curves = _values(branch, x), _values(branch, y, rows=True)
            stable = stable_pieces(branch)
            dashed |= not stable.all()
            colour = colours[group]
            heights = curves if curves.ndim == 1 else curves[:, 0]
            for first, last in runs_of(stable):
                axis.plot(places[first : last + 1], curves[first : last + 1], color=colour,
                          linewidth=1.8 if stable[first] else 1.2,
                          linestyle="-" if stable[first] else DASHES)
            for index, point in enumerate(branch.points):
                if point.kind is not None:
                    known.setdefault(point.kind, []).append((places[index], heights[index]))
        axis.ticklabel_format(axis="y", scilimits=(-3, 5))
        limits = axis.dataLim
        name_axis(axis, "x", x_label or _label(x, branches[0]), np.array(limits.intervalx))
        name_axis(axis, "y", y_label or _label(y, branches[0]), np.array(limits.intervaly))
        axis.margins(x=0.02, y=0.06)
        axis.autoscale_view()
        special = _mark(axis, known)
        letters = draw_insets(figure, axis, insets, lambda at: (_value(at, x), _value(at, y)))
        _legend(axis, {name: colours[name] for name in names[: len(branches)]}, known, dashed, dots)
        place_labels(figure, axis, [*letters, *special])
    return figure


def _values(branch: "Branch", quantity: Quantity, rows: bool = False) -> Array:
    """Values (N,) of a quantity, or (N, s) of a row of them where these are allowed."""
    if callable(quantity):
        return np.array([quantity(point) for point in branch.points], dtype=float)
    if not isinstance(quantity, str):
        return np.array([_of_state(point, int(quantity)) for point in branch.points])
    if quantity == "parameter":
        return branch.parameter
    found = branch.column(quantity)
    if rows and quantity == "observed_section" and found.ndim == 2:
        return found
    if found.ndim != 1 or found.dtype.kind not in "fiub":
        plain = [name for name, value in branch.points[0].values.items()
                 if np.ndim(value) == 0 and not isinstance(value, complex)]
        raise InputError(f"{quantity!r} is not one number at each point; choose from "
                         f"{choices(plain)}, the number of a state, or give a function.")
    return found.astype(float)


def _of_state(point: "BranchPoint", number: int) -> float:
    """A state of an equilibrium, or its largest value over an orbit."""
    states = point.values.get("state", point.values.get("maximum"))
    if states is None or not -len(states) <= number < len(states):
        many = "no states" if states is None else f"{len(states)} states, from 0"
        raise InputError(f"There is no state {number}: the branch stores {many}.")
    return float(states[number])


def _value(point: "BranchPoint", quantity: Quantity) -> float:
    """A quantity of one point; of a row of them the first."""
    if callable(quantity):
        return float(quantity(point))
    if quantity == "parameter":
        return point.parameter
    if not isinstance(quantity, str):
        return _of_state(point, int(quantity))
    if quantity not in point.values:
        raise InputError(f"{point.place}, of an inset, stores no value {quantity!r}; make the "
                         f"inset from a point of a branch that is drawn.")
    return float(np.ravel(point.values[quantity])[0])


def stable_pieces(branch: "Branch") -> NDArray[np.bool_]:
    """Whether each piece (N - 1,) between neighbours is stable, judged by its regular points."""
    stable = [None if point.kind is not None else bool(point.values.get("stable", True))
              for point in branch.points]
    pieces: list[bool] = []
    for before, after in pairwise(stable):
        known = [value for value in (before, after) if value is not None]
        pieces.append(all(known) if known else (pieces[-1] if pieces else True))
    return np.array(pieces or [True], dtype=bool)


def runs_of(stable: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last point of each run of equal pieces."""
    edges = [0, *(np.flatnonzero(np.diff(stable)) + 1).tolist(), len(stable)]
    return list(pairwise(edges))


def _mark(axis: "Axes", known: dict[str, list[tuple[float, float]]]) -> list[Label]:
    """Draw markers of special points; returns their letters and places."""
    labels: list[Label] = []
    for kind, places in known.items():
        letters, marker = SPECIAL.get(kind, ("", "."))
        # A point that two branches share is marked once.
        distinct: list[tuple[float, float]] = []
        for place in places:
            if not any(np.allclose(place, other, rtol=1e-6) for other in distinct):
                distinct.append(place)
        for number, (x, y) in enumerate(distinct):
            count = str(number + 1) if letters and len(distinct) > 1 else ""
            labels.append((f"{letters or kind}{count}", x, y))
            axis.plot(x, y, marker, color="#303030", markerfacecolor="white", markersize=7.0,
                      linestyle="none", zorder=4)
    return labels


def _legend(
    axis: "Axes", colours: dict[str, str], known: dict[str, list[tuple[float, float]]],
    dashed: bool, dots: Sequence[Any],
) -> None:
    from matplotlib.lines import Line2D

    handles: list[Any] = [Line2D([], [], color=colour, linewidth=1.8, label=legend_label(name))
                          for name, colour in colours.items()]
    if dashed:
        handles.append(Line2D([], [], color="#303030", linewidth=1.8, label="stable"))
        handles.append(Line2D([], [], color="#303030", linewidth=1.2, linestyle=DASHES,
                              label="unstable"))
    for kind in known:
        letters, marker = SPECIAL.get(kind, ("", "."))
        handles.append(Line2D([], [], color="#303030", marker=marker, markerfacecolor="white",
                              linestyle="none", markersize=7.0,
                              label=f"{kind} ({letters})" if letters else kind))
    handles += dots
    if handles:
        axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5))


def _label(quantity: Quantity, branch: "Branch") -> str:
    if callable(quantity):
        return ""
    return branch_label(branch, quantity if isinstance(quantity, str) else int(quantity))
