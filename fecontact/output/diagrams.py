"""Bifurcation diagrams, eigenvalues over a parameter, and stability maps."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError, choices
from fecontact.output.figures import COLOURS, new_figure
from fecontact.output.saving import save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fecontact.bifurcation.branch import Branch, BranchPoint
    from fecontact.bifurcation.stability_map import StabilityMap

Array = NDArray[np.float64]
Quantity = str | int | Callable[["BranchPoint"], float]

# Letters and markers of special points.
_SPECIAL = {
    "Hopf": ("H", "o"), "fold": ("F", "s"), "branch point": ("BP", "D"),
    "period doubling": ("PD", "^"), "Neimark-Sacker": ("NS", "v"), "cusp": ("CP", "P"),
    "Bogdanov-Takens": ("BT", "*"), "Bautin": ("GH", "X"), "zero-Hopf": ("ZH", "<"),
    "double Hopf": ("HH", ">"),
}
_DASHES = (0, (4, 2.5))


def plot_branches(
    branches: "Branch | Sequence[Branch]", path: str | Path, y: Quantity = 0, *,
    x: Quantity = "parameter", x_label: str | None = None, y_label: str | None = None,
    names: Sequence[str] = (),
) -> Path:
    """Plot branches: stable parts solid, unstable ones dashed, special points marked and labelled.

    Parameters
    ----------
    branches : Branch or sequence of Branch
        Each gets its own colour.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    y, x : str, int or callable
        What to draw: 'parameter', the name of a stored number, the number of a state counted from
        0, or a function of a :class:`fecontact.bifurcation.branch.BranchPoint`.
    x_label, y_label : str, optional
        Labels of the axes, with units.
    names : sequence of str
        Names of the branches for the legend.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For a quantity that is not stored, another suffix, or a file that cannot be written.
    """
    from fecontact.bifurcation.branch import Branch

    several = [branches] if isinstance(branches, Branch) else list(branches)
    return save_figure(path, lambda: branches_figure(several, y, x, x_label, y_label, names))


def plot_eigenvalues(branch: "Branch", path: str | Path, *, x_label: str | None = None,
                     range_hz: tuple[float, float] = (0.0, np.inf)) -> Path:
    """Plot frequencies [Hz] and growth rates [1/s] of all modes over the parameter of a branch.

    As in the analysis of brake squeal: two frequencies that meet and a growth rate that becomes
    positive are flutter by mode coupling.

    Parameters
    ----------
    branch : Branch
        Of equilibria.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    x_label : str, optional
        Label of the parameter, with its unit.
    range_hz : (float, float)
        Modes that are never in this range are left out.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the branch stores no eigenvalues, for another suffix, or a file that cannot be written.
    """
    return save_figure(path, lambda: eigenvalues_figure(branch, x_label, range_hz))


def plot_stability_map(
    found: "StabilityMap", path: str | Path, *, x_label: str | None = None,
    y_label: str | None = None,
) -> Path:
    """Plot where an equilibrium is unstable, with the frequency of the mode that grows fastest.

    Parameters
    ----------
    found : StabilityMap
        The first parameter goes along x.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    x_label, y_label : str, optional
        Labels of the parameters, with their units.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return save_figure(path, lambda: stability_map_figure(found, x_label, y_label))


def branches_figure(
    branches: "Sequence[Branch]", y: Quantity = 0, x: Quantity = "parameter",
    x_label: str | None = None, y_label: str | None = None, names: Sequence[str] = (),
) -> "Figure":
    """See :func:`plot_branches`."""
    figure = new_figure(8.0, 5.2)
    axis = figure.subplots()
    known: dict[str, list[tuple[float, float]]] = {}
    dashed = False
    for number, branch in enumerate(branches):
        places, heights = _values(branch, x), _values(branch, y)
        stable = _stable_pieces(branch)
        dashed |= not stable.all()
        colour = COLOURS[number % len(COLOURS)]
        for first, last in _runs(stable):
            axis.plot(places[first : last + 1], heights[first : last + 1], color=colour,
                      linewidth=1.8 if stable[first] else 1.2,
                      linestyle="-" if stable[first] else _DASHES)
        for index, point in enumerate(branch.points):
            if point.kind is not None:
                known.setdefault(point.kind, []).append((places[index], heights[index]))
    axis.set_xlabel(x_label or _label(x, branches[0].name))
    axis.set_ylabel(y_label or _label(y, branches[0].name))
    axis.margins(x=0.02, y=0.06)
    axis.autoscale_view()
    _mark(axis, known)
    _legend(axis, [COLOURS[k % len(COLOURS)] for k in range(len(branches))], names, known, dashed)
    return figure


def eigenvalues_figure(
    branch: "Branch", x_label: str | None = None, range_hz: tuple[float, float] = (0.0, np.inf)
) -> "Figure":
    """See :func:`plot_eigenvalues`."""
    values, followed = branch.parameter, _followed(branch.column("eigenvalues"))
    figure = new_figure(8.0, 6.4)
    upper, lower = figure.subplots(2, 1, sharex=True)
    shown = 0
    for mode in followed.T:
        hertz = mode.imag / (2.0 * np.pi)
        inside = (hertz >= range_hz[0]) & (hertz <= range_hz[1])
        if (hertz < 0.0).any() or not hertz.any() or not inside.any():
            continue
        colour = COLOURS[shown % len(COLOURS)]
        shown += 1
        upper.plot(values, hertz, color=colour)
        lower.plot(values, mode.real, color=colour)
    lower.axhline(0.0, color="#303030", linewidth=0.8)
    for point in branch.of_kind("Hopf"):
        for axis in (upper, lower):
            axis.axvline(point.parameter, color="#6a6a6a", linestyle=_DASHES, linewidth=0.9)
        upper.annotate(f"{point.details['frequency_hz']:.4g} Hz",
                       (point.parameter, point.details["frequency_hz"]), xytext=(6, 6),
                       textcoords="offset points", fontsize=9.0)
    upper.set_ylabel("frequency [Hz]")
    lower.set_ylabel("growth rate [1/s]")
    lower.set_xlabel(x_label or branch.name)
    lower.set_xlim(values.min(), values.max())
    figure.align_ylabels([upper, lower])
    return figure


def stability_map_figure(
    found: "StabilityMap", x_label: str | None = None, y_label: str | None = None
) -> "Figure":
    """See :func:`plot_stability_map`."""
    figure = new_figure(7.4, 5.2)
    axis = figure.subplots()
    unstable = (found.unstable > 0).T
    hertz = np.ma.masked_where(~unstable, found.frequency_hz.T)
    axis.set_facecolor("#f4f2ee")
    low, high = (float(hertz.min()), float(hertz.max())) if hertz.count() else (0.0, 1.0)
    image = axis.pcolormesh(found.first, found.second, hertz, cmap="viridis", shading="nearest",
                            vmin=low, vmax=high if high > low else low + 1e-3 * max(low, 1.0))
    figure.colorbar(image, ax=axis, pad=0.02, label="frequency of the fastest growing mode [Hz]")
    growth = found.growth_rate.T
    if unstable.any() and not unstable.all() and min(growth.shape) > 1:
        axis.contour(found.first, found.second, growth, levels=[0.0], colors="#303030",
                     linewidths=1.4)
    if (found.unstable < 0).any():
        axis.pcolormesh(found.first, found.second,
                        np.ma.masked_where((found.unstable >= 0).T, np.ones(unstable.shape)),
                        cmap="Greys", vmin=0.0, vmax=2.0, shading="nearest")
    inside = np.argwhere(~unstable & (found.unstable >= 0).T)
    if len(inside):
        centre = inside[np.argmin(((inside - inside.mean(axis=0)) ** 2).sum(axis=1))]
        axis.text(found.first[centre[1]], found.second[centre[0]], "stable", ha="center",
                  va="center")
    axis.set_xlabel(x_label or found.names[0])
    axis.set_ylabel(y_label or found.names[1])
    axis.grid(False)
    return figure


def _values(branch: "Branch", quantity: Quantity) -> Array:
    if callable(quantity):
        return np.array([quantity(point) for point in branch.points], dtype=float)
    if isinstance(quantity, int):
        return np.asarray(branch.column("state")[:, quantity])
    if quantity == "parameter":
        return branch.parameter
    found = branch.column(quantity)
    if found.ndim != 1 or found.dtype.kind not in "fiub":
        plain = [name for name, value in branch.points[0].values.items()
                 if np.ndim(value) == 0 and not isinstance(value, complex)]
        raise InputError(f"{quantity!r} is not one number at each point; choose from "
                         f"{choices(plain)}, the number of a state, or give a function.")
    return found.astype(float)


def _stable_pieces(branch: "Branch") -> NDArray[np.bool_]:
    """Whether each piece (N - 1,) between neighbours is stable; decided by regular points."""
    stable = [None if point.kind is not None else bool(point.values.get("stable", True))
              for point in branch.points]
    pieces: list[bool] = []
    for before, after in pairwise(stable):
        known = [value for value in (before, after) if value is not None]
        pieces.append(all(known) if known else (pieces[-1] if pieces else True))
    return np.array(pieces or [True], dtype=bool)


def _runs(stable: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last point of each row of pieces of the same kind."""
    edges = [0, *(np.flatnonzero(np.diff(stable)) + 1).tolist(), len(stable)]
    return list(pairwise(edges))


def _mark(axis: "Axes", known: dict[str, list[tuple[float, float]]]) -> None:
    """Markers and letters; those of points close to another one point away from it."""
    special: list[tuple[str, str, float, float]] = []
    for kind, places in known.items():
        letters, marker = _SPECIAL.get(kind, ("", "."))
        # A point that two branches share is marked once.
        distinct: list[tuple[float, float]] = []
        for place in places:
            if not any(np.allclose(place, other, rtol=1e-6) for other in distinct):
                distinct.append(place)
        for number, (x, y) in enumerate(distinct):
            count = str(number + 1) if letters and len(distinct) > 1 else ""
            special.append((f"{letters or kind}{count}", marker, x, y))
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white")]
    to_axes = axis.transData + axis.transAxes.inverted()
    seen = np.array([to_axes.transform((x, y)) for _, _, x, y in special]).reshape(-1, 2)
    for index, (text, marker, x, y) in enumerate(special):
        axis.plot(x, y, marker, color="#303030", markerfacecolor="white", markersize=7.0,
                  linestyle="none", zorder=4)
        away = seen[index] - np.delete(seen, index, axis=0)
        near = away[np.abs(away).max(axis=1) < 0.06]
        left, below = (near.sum(axis=0) < 0.0) if len(near) else (False, False)
        axis.annotate(text, (x, y), xytext=(-6.0 if left else 6.0, -6.0 if below else 6.0),
                      ha="right" if left else "left", va="top" if below else "bottom",
                      textcoords="offset points", fontsize=9.0, zorder=5, path_effects=halo)


def _legend(
    axis: "Axes", colours: Sequence[str], names: Sequence[str],
    known: dict[str, list[tuple[float, float]]], dashed: bool,
) -> None:
    from matplotlib.lines import Line2D

    handles: list[Any] = [Line2D([], [], color=colour, linewidth=1.8, label=name)
                          for colour, name in zip(colours, names, strict=False)]
    if dashed:
        handles.append(Line2D([], [], color="#303030", linewidth=1.8, label="stable"))
        handles.append(Line2D([], [], color="#303030", linewidth=1.2, linestyle=_DASHES,
                              label="unstable"))
    for kind in known:
        letters, marker = _SPECIAL.get(kind, ("", "."))
        handles.append(Line2D([], [], color="#303030", marker=marker, markerfacecolor="white",
                              linestyle="none", markersize=7.0,
                              label=f"{kind} ({letters})" if letters else kind))
    if handles:
        axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5))


def _label(quantity: Quantity, parameter: str) -> str:
    if quantity == "parameter":
        return parameter
    if isinstance(quantity, int):
        return f"state {quantity}"
    return quantity if isinstance(quantity, str) else ""


def _followed(eigenvalues: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Eigenvalues (N, d) in an order that follows each from point to point."""
    from scipy.optimize import linear_sum_assignment

    result = eigenvalues.copy()
    for k in range(1, len(result)):
        ahead = 2.0 * result[k - 1] - result[k - 2] if k > 1 else result[0]
        distance = np.abs(ahead[:, None] - eigenvalues[k][None, :])
        result[k] = eigenvalues[k][linear_sum_assignment(distance)[1]]
    return result
