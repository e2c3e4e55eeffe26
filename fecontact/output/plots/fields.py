"""Plots of stress over a body."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind, require_scale
from fecontact.core.errors import require_choice
from fecontact.core.units import suitable_unit
from fecontact.fem.fields import BodyFields
from fecontact.output.plots.bodies import DRAWN_DISPLACEMENT, draw_body, in_picture
from fecontact.output.plots.drawing import name_axis
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.solids.surface import draw_triad
from fecontact.output.plots.style import stress_limit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STRESSES = ("xx", "yy", "zz", "xy", "yz", "xz")
# Inches: width, limits of the height, and what title and labels take of it.
_WIDTH, _LARGEST, _LEAST, _WORDS = 9.0, 8.5, 2.5, 0.8


def plot_stress(
    fields: BodyFields, *, component: str = "von_mises", scale: float | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """Plot a stress over the deformed body, and its undeformed outline.

    Where few nodes have much higher stresses than all others, colours end at their 99th percentile,
    and a mark names the peak.

    Parameters
    ----------
    fields : BodyFields
        Result of :func:`fecontact.static_solution` or :meth:`fecontact.ModalBasis.fields`.
    component : 'von_mises', 'xx', 'yy', 'zz' or 'xy', of solids 'yz' and 'xz' too
        The stress that colours the body, of solids their surface.
    scale : float, optional
        Magnification of displacements; by default chosen so that the largest is clearly visible.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For an unknown component, a scale that is not a number above zero, another
        suffix, or a file that cannot be written.
    """
    require_kind("plot_stress", BodyFields, fields=fields)
    d = fields.nodes.shape[1]
    require_choice("plot_stress", "component", component,
                   ("von_mises", *_STRESSES[: 4 if d == 2 else 6]))
    if scale is not None:
        require_scale("plot_stress", scale)
    stress = fields.von_mises if component == "von_mises" else (
        fields.stress[:, _STRESSES.index(component)])
    moved = float(np.linalg.norm(fields.displacement, axis=1).max())
    if scale is None:
        extent = float(np.linalg.norm(np.ptp(fields.nodes, axis=0)))
        scale = DRAWN_DISPLACEMENT * extent / moved if moved else 1.0
    places = fields.nodes + scale * fields.displacement
    everything = in_picture(np.vstack([fields.nodes, places]))
    width, height = np.ptp(everything, axis=0)
    factor, unit = suitable_unit(float(np.abs(stress).max()), "Pa")
    peak = int(np.abs(stress).argmax())
    largest = float(np.abs(stress[peak]) / factor) or 1.0
    top = stress_limit(np.abs(stress)) / factor or 1.0
    cut = top < largest
    name = "von Mises stress" if component == "von_mises" else f"stress {component}"
    signed = component != "von_mises"
    drawn_height = float(np.clip(0.75 * _WIDTH * height / width + _WORDS, _LEAST, _LARGEST))
    with new_figure(_WIDTH, drawn_height + 0.35 * cut, path) as figure:
        axis = figure.subplots()
        margin = (0.02 if d == 2 else 0.06) * max(width, height)
        low, high = everything.min(axis=0) - margin, everything.max(axis=0) + margin
        drawn = draw_body(axis, fields, places, stress / factor, low=-top if signed else 0.0,
                          high=top, cmap="RdBu_r" if signed else "viridis")
        if d == 2:
            name_axis(axis, "x", "x [m]", everything[:, 0])
            name_axis(axis, "y", "y [m]", everything[:, 1])
        else:
            draw_triad(axis, 0.07 * max(width, height), low + 0.5 * margin)
            axis.set_axis_off()
        axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal",
                 title=f"displacements times {scale:.3g}" if moved else "")
        ends: Any = ("both" if signed else "max") if cut else "neither"
        figure.colorbar(drawn, ax=axis, label=f"{name} [{unit}]", extend=ends)
        if cut:
            axis.plot(*in_picture(places[peak]), "o", markersize=7.0, markerfacecolor="none",
                      color="#d55e00", label=f"peak {stress[peak] / factor:.3g} {unit}")
            figure.legend(loc="outside lower right")
    return figure
