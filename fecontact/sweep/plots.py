"""Plots of sweeps as files: PNG, PDF or SVG, written whole or not at all."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.output.plots.style import save_figure
from fecontact.sweep import sweep_figures
from fecontact.sweep.statistics import SobolIndices
from fecontact.sweep.table import SweepTable


def plot_sweep(
    table: SweepTable, name: str, path: str | Path, over: Sequence[str] | None = None
) -> Path:
    """Plot a summary of a sweep over the parameters that changed.

    A map for a grid of two parameters with many values each, curves for a grid of one parameter,
    or of two where one has few values or values that are not numbers; for all other sweeps a
    scatter plot for each parameter, and a histogram.

    Parameters
    ----------
    table : SweepTable
        What :func:`fecontact.sweep` returned.
    name : str
        The summary.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.
    over : one or two parameters, optional
        One for curves, two for a map in which the others have their first value.

    Raises
    ------
    InputError
        For a summary or parameter that does not exist, a sweep of one case, another suffix, or a
        file that cannot be written.
    """
    require_kind("plot_sweep", SweepTable, table=table)
    for column in (name, *(over or ())):
        table.column(column)
    if name not in table.values:
        raise InputError(f"'{name}' is a parameter of the sweep; plot one of its summaries "
                         f"{choices(table.values)}.")
    if over is None:
        return save_figure(path, lambda: sweep_figures.sweep_figure(table, name))
    if len(over) == 1:
        return save_figure(path, lambda: sweep_figures.diagram_figure(table, name, over[0]))
    return save_figure(path, lambda: sweep_figures.map_figure(table, name, over[0], over[1]))


def plot_strobed(table: SweepTable, parameter: str, path: str | Path) -> Path:
    """Plot displacements once per period over a parameter: a brute-force bifurcation diagram.

    Parameters
    ----------
    table : SweepTable
        Of a sweep that strobes.
    parameter : str
        One of those that changed.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Raises
    ------
    InputError
        For a sweep that does not strobe, a parameter that does not exist, another suffix, or a
        file that cannot be written.
    """
    if parameter not in table.parameters:
        raise InputError(f"The sweep has no parameter '{parameter}'; there are: "
                         f"{choices(table.parameters)}.")
    return save_figure(path, lambda: sweep_figures.strobed_figure(table, parameter))


def plot_sobol(found: Mapping[str, SobolIndices], path: str | Path) -> Path:
    """Plot Sobol indices of summaries with their confidence intervals.

    Parameters
    ----------
    found : mapping of summary to SobolIndices
        What :func:`fecontact.sobol_indices` found.
    path : str or Path
        A .png, .pdf or .svg file; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    return save_figure(path, lambda: sweep_figures.sensitivity_figure(found))
