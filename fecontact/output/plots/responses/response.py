"""Nonlinear frequency responses: amplitude and phase at several levels."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.bifurcation.harmonic.response import FrequencyResponse
from fecontact.core.checks import require_kind
from fecontact.core.types import Array
from fecontact.output.diagrams.branches import response_diagrams
from fecontact.output.plots.drawing import draw_stacked
from fecontact.output.plots.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_response(
    response: FrequencyResponse, *, logarithmic: bool = False, y_label: str | None = None,
    usable_hz: float = np.inf,
    path: str | Path | None = None,
) -> "Figure":
    """Plot a frequency response: amplitude and phase, a colour for each level.

    Above half the range of the observed quantity, or the force that holds it, below the phase of
    its first harmonic against a sine drive. Stable parts are solid, unstable ones dashed, special
    points marked.

    Parameters
    ----------
    response : FrequencyResponse
        Result of :func:`fecontact.bifurcation.frequency_response`.
    logarithmic : bool
        Whether the amplitude has a logarithmic axis.
    y_label : str, optional
        Label of the amplitude with its unit, such as ``amplitude [m]``; ticks are in a unit that
        suits the values.
    usable_hz : float
        Frequency up to which the basis is usable [Hz]; over frequency, what lies beyond is shaded.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_response", FrequencyResponse, response=response)
    with new_figure(9.0, 6.4, path) as figure:
        _, lower = draw_stacked(figure, response_diagrams(
            response, logarithmic=logarithmic, y_label=y_label, usable_hz=usable_hz), (2.2, 1.0))
        lower.set_yticks(_degrees(lower.get_ylim()))
    return figure


def _degrees(limits: tuple[float, float]) -> Array:
    step = 45.0 if limits[1] - limits[0] < 300.0 else 90.0
    return np.arange(np.ceil(limits[0] / step), np.floor(limits[1] / step) + 1.0) * step
