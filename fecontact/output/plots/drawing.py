"""Diagrams drawn into axes of matplotlib, and their legends."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.ticker import Formatter, ScalarFormatter
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.output.diagrams.colours import BEYOND_COLOUR, DASHES, INK
from fecontact.output.diagrams.diagram import WIDTH, Curve, Diagram, thinned
from fecontact.output.diagrams.labels import in_unit
from fecontact.output.diagrams.maps import Map
from fecontact.output.diagrams.special_points import SPECIAL
from fecontact.output.plots.style import legend_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_RATIO = 1e3  # of the ends of a logarithmic axis with labels between decades
_DIGITS = 10  # of ticks, at most
_POWERS = (-3, 5)  # of ten, beyond which ticks have a common factor
_SHADED = 0.25  # opacity of ranges about curves
_SIZE = 7.0  # of the markers of special points [points]
_EMPTY: Any = {"color": INK, "markerfacecolor": "white", "linestyle": "none", "markersize": _SIZE}


class _InUnit(Formatter):
    """Ticks at values in SI units, labelled in a prefixed unit with equal numbers of digits."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x / self.factor:.{_DIGITS}g}".replace("-", "\N{MINUS SIGN}")

    def format_ticks(self, values: Any) -> list[str]:
        """Labels of all ticks of an axis."""
        texts = super().format_ticks(values)
        if any("e" in text for text in texts):
            return texts
        digits = max((len(text.partition(".")[2]) for text in texts), default=0)
        return [f"{value / self.factor:.{digits}f}".replace("-", "\N{MINUS SIGN}")
                for value in values]


class _OnDecades(_InUnit):
    """Major ticks of a logarithmic axis in a prefixed unit."""

    def format_ticks(self, values: Any) -> list[str]:
        """Labels of all ticks of an axis."""
        return [self(value) for value in values]


class _BetweenDecades(_OnDecades):
    """Minor ticks of a logarithmic axis in a prefixed unit: 2 and 5, where they have room."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        digit = round(x / 10.0 ** np.floor(np.log10(x) + 1e-9))
        low, high = np.abs(self.axis.get_view_interval())  # type: ignore[union-attr]
        return super().__call__(x, pos) if digit in (2, 5) and high < _MOST_RATIO * low else ""


def name_axis(axes: "Axes", which: Literal["x", "y"], label: str, values: Array) -> None:
    """Label an axis whose data are in SI units, with ticks in a unit that suits the values.

    ``ground speed [m/s]`` with values up to 4e-3 becomes ``ground speed [mm/s]``, with a tick 4
    there. Labels without a unit, or with one that has no prefixes, stay as they are.
    """
    factor, label = in_unit(label, values)
    axes.set(**{f"{which}label": label})
    if factor != 1.0:
        axis = axes.xaxis if which == "x" else axes.yaxis
        if axis.get_scale() == "log":
            axis.set_major_formatter(_OnDecades(factor))
            axis.set_minor_formatter(_BetweenDecades(factor))
        else:
            axis.set_major_formatter(_InUnit(factor))


def draw(axes: "Axes", diagram: Diagram, *, marker_size: float = _SIZE) -> list[Any]:
    """Draw a diagram into empty axes, and label them; return the images of its maps.

    Data are in SI units, ticks in units that suit them. Thick lines lie behind thin ones.
    """
    for name in diagram.logarithmic:
        axes.set(**{f"{name}scale": "log"})
    images = [_draw_map(axes, one) for one in diagram.maps]
    for curve in diagram.curves:
        _draw_curve(axes, curve)
    for mark in diagram.marks:
        axes.plot(mark.x, mark.y, SPECIAL.get(mark.kind, ("", "."))[1], zorder=4,
                  **_EMPTY | {"markersize": marker_size})
    for level in diagram.levels:
        line = axes.axhline if level.axis == "y" else axes.axvline
        line(level.value, color="#6a6a6a" if level.dashed else INK, linewidth=0.9,
             linestyle=DASHES if level.dashed else "-", label=level.name or None)
    for band in diagram.bands:
        axes.axvspan(band.low, band.high, color=BEYOND_COLOUR, zorder=0.5, label=band.name)
    if isinstance(ticks := axes.yaxis.get_major_formatter(), ScalarFormatter):
        ticks.set_powerlimits(_POWERS)
    name_axis(axes, "x", diagram.x_label, diagram.values("x"))
    name_axis(axes, "y", diagram.y_label, diagram.values("y"))
    if diagram.title:
        axes.set_title(diagram.title)
    if diagram.x_limits != (None, None):
        axes.set_xlim(*diagram.x_limits)
    ends = diagram.flat_range or diagram.y_limits
    if ends != (None, None):
        axes.set_ylim(*ends)
    return images


def _draw_map(axes: "Axes", one: Map) -> Any:
    """Draw the cells of a map over the whole of the axes."""
    from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize

    scale, count = one.scale, len(one.scale.names)
    norm = (BoundaryNorm(np.arange(count + 1) - 0.5, max(count, 2)) if count
            else (LogNorm if scale.logarithmic else Normalize)(*one.ends))
    colours = scale.colours if isinstance(scale.colours, str) else ListedColormap(
        list(scale.colours))
    if one.blank:
        axes.set_facecolor(one.blank)
    axes.grid(False)
    return axes.pcolormesh(one.x, one.y, np.ma.masked_invalid(one.values), cmap=colours, norm=norm,
                           alpha=one.opacity if one.opacity < 1.0 else None, rasterized=True)


def colour_bar(image: Any, one: Map, axes: "Axes | Sequence[Axes]") -> None:
    """Add the colour bar of a map beside axes, in a unit that suits its values."""
    figure = image.axes.figure
    factor, label = in_unit(one.scale.label, np.array(one.ends))
    bar = figure.colorbar(image, ax=axes, label=label, pad=0.02)
    bar.outline.set_visible(False)
    if one.scale.names:
        bar.set_ticks(range(len(one.scale.names)), labels=one.scale.names)
        bar.ax.tick_params(length=0)
    elif factor != 1.0:
        bar.formatter = (_OnDecades if one.scale.logarithmic else _InUnit)(factor)
        bar.update_ticks()


def _draw_curve(axes: "Axes", curve: Curve) -> None:
    shown: dict[str, Any] = {"color": curve.colour or INK, "label": legend_label(curve.name)}
    if curve.limits is not None:
        low, high = curve.limits
        for part in _one_way(curve.x):
            axes.fill_between(curve.x[part], low[part], high[part], color=shown["color"],
                              alpha=_SHADED, linewidth=0.0,
                              label=legend_label("" if part.start else curve.limits_name))
    if curve.marker:
        shown |= {"marker": "o", "markersize": curve.marker}
    if curve.bars is not None:
        axes.errorbar(curve.x, curve.y, curve.bars, elinewidth=0.9,
                      linestyle="-" if curve.width else "none", **shown)
    elif not curve.width:
        axes.plot(curve.x, curve.y, linestyle="none", markeredgewidth=0.0, rasterized=True, **shown)
    elif curve.solid is None:
        axes.plot(*thinned(curve.x, curve.y), linewidth=curve.width,
                  zorder=2.5 - 0.1 * curve.width, **shown)
    else:
        for first, last in runs_of(curve.solid):
            solid = bool(curve.solid[first])
            axes.plot(*thinned(curve.x[first : last + 1], curve.y[first : last + 1]),
                      linewidth=curve.width if solid else min(curve.width, WIDTH),
                      linestyle="-" if solid else DASHES, **shown)


def _one_way(x: Array) -> list[slice]:
    """Parts along which abscissae ascend or descend; those of a loop end where it turns."""
    ways = np.sign(np.diff(x))
    turns = np.flatnonzero(ways[:-1] * ways[1:] < 0.0) + 1
    return [slice(a, b + 1) for a, b in pairwise([0, *turns.tolist(), len(x) - 1])]


def runs_of(pieces: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last point of each run of equal pieces."""
    edges = [0, *(np.flatnonzero(np.diff(pieces)) + 1).tolist(), len(pieces)]
    return list(pairwise(edges))


def legend_entries(diagrams: Iterable[Diagram]) -> list[Any]:
    """Handles of a legend: heading and curves by name, dashes, special points, bands."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    given = list(diagrams)
    curves = {curve.name: curve for one in given for curve in one.curves[::-1] if curve.name}
    names = list(dict.fromkeys(curve.name for one in given for curve in one.curves if curve.name))
    handles: list[Any] = [Line2D([], [], linestyle="none", label=heading)
                          for heading in dict.fromkeys(one.heading for one in given) if heading]
    for name in names:
        curve = curves[name]
        dashes: Any = DASHES if curve.dashed else "-" if curve.width else "none"
        handles.append(Line2D(
            [], [], color=curve.colour or INK, linewidth=curve.width, label=legend_label(name),
            linestyle=dashes, marker="o" if curve.marker else "",
            markersize=max(curve.marker, 4.0)))
    if any(curve.partly_unstable for one in given for curve in one.curves):
        handles += [Line2D([], [], color=INK, linewidth=1.8, label="stable"),
                    Line2D([], [], color=INK, linewidth=WIDTH, linestyle=DASHES, label="unstable")]
    for kind in dict.fromkeys(mark.kind for one in given for mark in one.marks):
        letters, marker = SPECIAL.get(kind, ("", "."))
        handles.append(Line2D([], [], marker=marker, **_EMPTY,
                              label=f"{kind} ({letters})" if letters else kind))
    handles += [Patch(color=BEYOND_COLOUR, label=name)
                for name in dict.fromkeys(band.name for one in given for band in one.bands)]
    return handles


def draw_stacked(
    figure: "Figure", diagrams: Sequence[Diagram], heights: Sequence[float]
) -> list["Axes"]:
    """Draw diagrams over a common x above each other, with one legend beside the uppermost."""
    panels = list(figure.subplots(len(diagrams), 1, sharex=True, height_ratios=heights))
    for panel, diagram in zip(panels, diagrams, strict=True):
        draw(panel, diagram)
        panel.margins(x=0.02)
    for panel in panels[:-1]:
        panel.set_xlabel("")
    if handles := legend_entries(diagrams):
        panels[0].legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    figure.align_ylabels(panels)
    return panels
