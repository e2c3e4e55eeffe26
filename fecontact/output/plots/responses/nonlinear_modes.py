"""Nonlinear modes and their resonances: frequency and damping over the amplitude."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.bifurcation.nonlinear_modes.resonance_curve import ResonanceCurve
from fecontact.core.checks import as_several
from fecontact.core.errors import InputError
from fecontact.output.diagrams.branches import mode_diagrams, resonance_diagrams
from fecontact.output.plots.drawing import draw_stacked
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_nonlinear_mode(
    modes: NonlinearMode | Sequence[NonlinearMode], *, names: Sequence[str] = (),
    logarithmic: bool = True, path: str | Path | None = None,
) -> "Figure":
    """Plot nonlinear modes: frequency above, damping ratio below, over the amplitude.

    Where all modes are conservative, their energy stands below instead. Unstable motions of these
    are dashed; points where modes meet are marked.

    Parameters
    ----------
    modes : NonlinearMode or sequence of NonlinearMode
        Result of :func:`fecontact.bifurcation.nonlinear_mode`, of the same observed displacement.
    names : sequence of str, optional
        For the legend, one for each mode; several modes are numbered by default.
    logarithmic : bool
        Whether the amplitude has a logarithmic axis.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        Without modes, for modes of different displacements, another number of names, another
        suffix, or a file that cannot be written.
    """
    given = as_several(modes, NonlinearMode, "plot_nonlinear_mode", "modes")
    diagrams = mode_diagrams(given, _labels(given, names), logarithmic=logarithmic)
    with new_figure(9.0, 6.4, path) as figure:
        draw_stacked(figure, diagrams, (1.4, 1.0))
    return figure


def plot_resonance_curve(
    curves: ResonanceCurve | Sequence[ResonanceCurve], *, names: Sequence[str] = (),
    path: str | Path | None = None,
) -> "Figure":
    """Plot resonances over a parameter: amplitude above, frequency below.

    Resonances that are unstable are dashed; extrema of the amplitude and folds are marked.

    Parameters
    ----------
    curves : ResonanceCurve or sequence of ResonanceCurve
        Result of :func:`fecontact.bifurcation.resonance_curve`, over the same parameter.
    names : sequence of str, optional
        For the legend, one for each curve.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        Without curves, for curves over different parameters, another number of names, another
        suffix, or a file that cannot be written.
    """
    given = as_several(curves, ResonanceCurve, "plot_resonance_curve", "curves")
    if not given:
        raise InputError("plot_resonance_curve: there are no curves; give at least one.")
    over = dict.fromkeys(curve.parameter_name for curve in given)
    if len(over) > 1:
        raise InputError(f"plot_resonance_curve: the curves run over {', '.join(over)}; give "
                         f"curves over the same parameter.")
    if names and len(names) != len(given):
        raise InputError(f"plot_resonance_curve: {len(names)} names do not go with {len(given)} "
                         f"curves; give one for each.")
    with new_figure(9.0, 6.4, path) as figure:
        draw_stacked(figure, resonance_diagrams(given, names), (1.4, 1.0))
    return figure


def _labels(modes: list[NonlinearMode], names: Sequence[str]) -> list[str]:
    """Names for the legend; none for a single mode."""
    if not modes:
        raise InputError("plot_nonlinear_mode: there are no modes; give at least one.")
    if len({mode.observed for mode in modes}) > 1:
        raise InputError(f"plot_nonlinear_mode: the amplitudes are those of "
                         f"{', '.join(dict.fromkeys(mode.observed for mode in modes))}; give modes "
                         f"that observe the same displacement.")
    if names and len(names) != len(modes):
        raise InputError(f"plot_nonlinear_mode: {len(names)} names do not go with {len(modes)} "
                         f"modes; give one for each.")
    if names:
        return [str(name) for name in names]
    return [f"mode {mode.number}" for mode in modes] if len(modes) > 1 else []
