"""Pictures of a fit: measured and computed curves, profile likelihood, posterior distribution."""

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.ticker import MaxNLocator

from fecontact.core.checks import require_kind
from fecontact.fitting.diagrams import (
    fit_diagrams,
    marginal_diagrams,
    pair_diagrams,
    profile_diagram,
)
from fecontact.fitting.posterior import Posterior
from fecontact.fitting.profile import ProfileLikelihood
from fecontact.fitting.result import Fit
from fecontact.output.plots.drawing import draw
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TICKS = 3  # of small panels beside each other


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
    diagrams = fit_diagrams(fit, level)
    with new_figure(max(6.0, 4.4 * len(diagrams)), 5.6, path) as figure:
        panels = figure.subplots(2, len(diagrams), sharex="col", squeeze=False,
                                 height_ratios=(3.0, 1.0))
        for column, both in zip(panels.T, diagrams, strict=True):
            for panel, diagram in zip(column, both, strict=True):
                draw(panel, diagram)
            column[0].set_xlabel("")
            column[1].set_ylabel(column[1].get_ylabel().replace("/ ", "/\n"))
        panels[0, 0].legend(loc="best")
        figure.align_ylabels(panels[:, 0])
    return figure


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
        draw(axis, profile_diagram(profile))
        axis.legend(loc="upper center")
    return figure


def plot_posterior(
    chains: Posterior, *, level: float = 0.95, path: str | Path | None = None
) -> "Figure":
    """Plot the marginal densities of a posterior distribution, and its samples by pairs.

    Dashed lines are the ends of the intervals. Ellipses are those of the fit, of its covariance;
    samples that leave their shape show that the model is not linear there.

    Parameters
    ----------
    chains : Posterior
        Result of :func:`fecontact.fitting.posterior`.
    level : float
        Probability of intervals and ellipses.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a level out of range, another suffix, or a file that cannot be written.
    """
    require_kind("plot_posterior", Posterior, chains=chains)
    size = len(chains.names)
    edge = max(2.6 * size, 4.5)
    marginals, pairs = marginal_diagrams(chains, level), pair_diagrams(chains, level)
    with new_figure(edge, 0.85 * edge, path) as figure:
        panels = figure.subplots(size, size, squeeze=False, sharex="col")
        for row in range(size):
            for column in range(size):
                panel = panels[row, column]
                if column > row:
                    panel.remove()
                    continue
                draw(panel, marginals[row] if column == row else pairs[column, row])
                if panel.get_xscale() != "log":
                    panel.xaxis.set_major_locator(MaxNLocator(_TICKS))
                if row < size - 1:
                    panel.set_xlabel("")
                if 0 < column < row:
                    panel.set_ylabel("")
            panels[row, row].set_yticks([])
        if size > 1:
            figure.legend(*panels[1, 0].get_legend_handles_labels(), loc="upper right")
        figure.align_ylabels(panels[:, 0])
    return figure
