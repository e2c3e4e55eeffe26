"""Pictures of a fit: measured and computed curves with their bands and residuals."""

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.types import Array
from fecontact.fitting.profile import ProfileLikelihood
from fecontact.fitting.result import Fit
from fecontact.output.diagrams.colours import COLOURS, DASHES
from fecontact.output.plots.drawing import name_axis
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points from which on measured values are drawn small, and up to which they have bars; reach of
# these in standard deviations, 95 %.
_MOST, _BARS, _DEVIATIONS = 400, 60, 1.96


def plot_fit(fit: Fit, *, level: float = 0.95, path: str | Path | None = None) -> "Figure":
    """Plot measured and fitted curves with the band of the model, and residuals below.

    Parameters
    ----------
    fit : Fit
        Result of :func:`fecontact.fit`.
    level : float
        Probability of the bands, which hold the uncertainty of the parameters.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_fit", Fit, fit=fit)
    curves = [(one, part, band, curve) for one, part, band in zip(
        fit.data, fit.problem.parts, fit.bands(level), strict=True) for curve in one.curves()]
    with new_figure(max(6.0, 4.4 * len(curves)), 5.6, path) as figure:
        panels = figure.subplots(2, len(curves), sharex="col", squeeze=False,
                                 height_ratios=(3.0, 1.0))
        for (upper, lower), (one, part, (low, high), curve) in zip(panels.T, curves, strict=True):
            model, residual = fit.predicted[part][curve.part], fit.residuals[part][curve.part]
            size = 2.0 if len(model) > _MOST else 3.5
            x = curve.x
            bars = None if one.deviations is None or len(x) > _BARS else (
                _DEVIATIONS * one.deviations[curve.part])
            upper.errorbar(x, one.measured[curve.part], bars, fmt="o", color=COLOURS[6],
                           markersize=size, label="measured", alpha=0.7, elinewidth=0.9)
            upper.plot(x, model, color=COLOURS[1], label="fitted", linewidth=1.6)
            for section in _sections(x):
                upper.fill_between(x[section], low[curve.part][section],
                                   high[curve.part][section], color=COLOURS[1], alpha=0.25,
                                   linewidth=0.0, label=None if section.start else
                                   f"{100.0 * level:g} %")
            if curve.logarithmic:
                upper.set_xscale("log")
            name_axis(upper, "y", curve.y_label, one.measured[curve.part])
            lower.plot(x, residual, "o", color=COLOURS[0], markersize=size)
            for height in (-2.0, 2.0):
                lower.axhline(height, color="#6a6a6a", linestyle=DASHES, linewidth=0.8)
            if curve.logarithmic:
                lower.set_xscale("log")
            name_axis(lower, "x", curve.x_label, curve.x)
        panels[0, 0].legend(loc="best")
        panels[1, 0].set_ylabel("residual /\ndeviation" if fit.problem.weighted else "residual")
        figure.align_ylabels(panels[:, 0])
    return figure


def _sections(x: Array) -> list[slice]:
    """Parts along which an abscissa goes one way; one along a loop ends where it turns."""
    ways = np.sign(np.diff(x))
    turns = [k + 1 for k in range(len(ways) - 1) if ways[k] * ways[k + 1] < 0.0]
    return [slice(a, b + 1) for a, b in pairwise([0, *turns, len(x) - 1])]


def plot_profile(profile: ProfileLikelihood, *, path: str | Path | None = None) -> "Figure":
    """Plot a profile likelihood with its interval.

    Parameters
    ----------
    profile : ProfileLikelihood
        Result of :func:`fecontact.fitting.profile_likelihood`.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_profile", ProfileLikelihood, profile=profile)
    with new_figure(6.0, 4.2, path) as figure:
        axis = figure.subplots()
        axis.plot(profile.values, profile.chi_square - profile.best, marker="o", markersize=3.5)
        axis.axhline(profile.limit, color="#6a6a6a", linestyle=DASHES,
                     label=f"{100.0 * profile.level:g} %")
        for end in profile.interval:
            if np.isfinite(end):
                axis.axvline(end, color=COLOURS[1], linewidth=1.0)
        axis.set(xlabel=profile.name, ylabel="rise of chi square")
        axis.legend(loc="upper center")
    return figure
