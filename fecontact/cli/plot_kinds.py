"""Plots of stored runs by name, for ``fecontact plot``."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.analysis.histories import Point, component_of, usual_point
from fecontact.cli.orbit_files import DIAGRAMS, OrbitChoice, holds_branches
from fecontact.core.checks import whole_number
from fecontact.core.errors import AnalysisError, InputError, choices, nearest, require_positive
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.plots import analysis
from fecontact.output.plots import run as plots
from fecontact.output.plots.contact_map import plot_contact_map
from fecontact.output.plots.modes import plot_modes
from fecontact.reduction.report import usable_hz

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class PlotRequest:
    """Selection of the quantities and points to plot.

    Attributes
    ----------
    quantity, component : str
        See :func:`fecontact.analysis.history`; the component by default that of the drive.
    points : tuple of points
        Named points and contact nodes; a history shows all of them, other plots only the first.
    highest_hz : float or None
        Highest frequency to plot [Hz].
    period : float or None
        Time between the points of a Poincare section [s].
    beyond : bool
        Whether receptances go beyond the frequency up to which the basis is usable.
    """

    quantity: str = "velocity"
    points: tuple[Point, ...] = ()
    component: str | None = None
    highest_hz: float | None = None
    period: float | None = None
    beyond: bool = False

    def __post_init__(self) -> None:
        if self.highest_hz is not None:
            require_positive("plot", highest_hz=self.highest_hz)
        if self.period is not None:
            require_positive("plot", period=self.period)

    @property
    def point(self) -> Point | None:
        """The first point, None for the default of a plot."""
        return self.points[0] if self.points else None

    def shown_component(self, run: Trajectory) -> str:
        """The component; that in which the system moves most where none is chosen."""
        return self.component or component_of(run)


Draw = Callable[[Trajectory, PlotRequest, Path | None], "Figure"]


def _receptance(run: Trajectory, c: PlotRequest, path: Path | None) -> "Figure":
    basis = run.basis
    whole, usable = 1.2 * float(basis.frequencies_hz[-1] or 100.0), usable_hz(basis)
    end = c.highest_hz or (whole if c.beyond else min(whole, usable))
    f = np.linspace(end / 2000.0, end, 2000)
    point = usual_point(basis) if c.point is None else c.point
    if not isinstance(point, str | int):
        raise InputError(f"The receptance is one of named points and contact nodes, not of "
                         f"{point!r}.")
    from fecontact.analysis.receptance import Place, receptance

    place: list[Place] = [(point, c.shown_component(run))]
    found = [receptance(run.system, f, place)]
    labels = ["apart from the ground"]
    # Without steady sliding, as on waves, there is no equilibrium for the linearisation.
    with suppress(AnalysisError):
        found.append(receptance(run.system, f, place, linearised_at="sliding"))
        labels.append("steadily sliding")
    return analysis.plot_receptance(found, labels, usable_hz=usable, path=path)


KINDS: dict[str, Draw] = {
    "history": lambda run, c, path: plots.plot_history(run, c.points, path=path),
    "phase": lambda run, c, path: plots.plot_phase(run, c.point, c.shown_component(run), path=path),
    "contact_map": lambda run, c, path: plot_contact_map(run, path=path),
    "energies": lambda run, c, path: plots.plot_energies(run, path=path),
    "modes": lambda run, c, path: plot_modes(run.basis, path=path),
    "spectrum": lambda run, c, path: analysis.plot_spectrum(
        run, c.quantity, c.point, c.shown_component(run), highest_hz=c.highest_hz, path=path),
    "density": lambda run, c, path: analysis.plot_spectrum(
        run, c.quantity, c.point, c.shown_component(run), density=True, highest_hz=c.highest_hz,
        path=path),
    "spectrogram": lambda run, c, path: analysis.plot_spectrogram(
        run, c.quantity, c.point, c.shown_component(run), highest_hz=c.highest_hz, path=path),
    "poincare": lambda run, c, path: analysis.plot_poincare(
        run, c.point, c.shown_component(run), period=c.period, path=path),
    "friction_work": lambda run, c, path: analysis.plot_friction_work(run, path=path),
    "receptance": _receptance,
}


def require_kind_of_plot(kind: str | None, file: Path, choice: OrbitChoice) -> str:
    """The kind of a plot of a file, or of an orbit of it where one is chosen.

    Raises
    ------
    InputError
        If there is no such plot, of such a file; the message lists those that there are.
    """
    of_runs, diagrams = choices(KINDS), choices(DIAGRAMS)
    whole = holds_branches(file) and choice == OrbitChoice()
    known = (f"{diagrams} of the whole file, and of an orbit: {of_runs}" if whole
             else of_runs)
    meant = get_close_matches(str(file), (*KINDS, *DIAGRAMS), n=1)
    if meant and kind not in KINDS and kind not in DIAGRAMS and not file.exists():
        raise InputError(f"fecontact plot takes the file first, then the kind of plot: "
                         f"`fecontact plot {kind or 'FILE'} {meant[0]}`, and {file} is no file.")
    if kind is None:
        raise InputError(f"Say what to plot: `fecontact plot {file} KIND`, with one of {known}.")
    if kind in DIAGRAMS and not holds_branches(file):
        raise InputError(f"The plot '{kind}' is one of files NAME-branch.h5 and NAME-response.h5, "
                         f"which fecontact branch and response write, but {file} holds a run; "
                         f"its plots are: {known}.")
    if kind in DIAGRAMS and choice != OrbitChoice():
        raise InputError(f"The plot '{kind}' is one of the whole file, without --branch, --at "
                         f"and --which; plots of an orbit are: {of_runs}.")
    if kind not in KINDS and kind not in DIAGRAMS:
        near = nearest(kind, (*KINDS, *(DIAGRAMS if holds_branches(file) else ())))
        raise InputError(f"There is no plot '{kind}'{near}; there are: {known}.")
    return kind


def redraw(
    trajectory: Trajectory,
    kind: str,
    choice: PlotRequest | None = None,
    *,
    t_start: float | None = None,
    t_end: float | None = None,
    path: Path | None = None,
) -> "Figure":
    """Plot a stored run.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    kind : str
        One of :data:`KINDS`.
    choice : PlotRequest, optional
        Quantities and points to plot.
    t_start, t_end : float, optional
        Time interval to plot [s].
    path : Path, optional
        A .png, .pdf or .svg file to write too.

    Raises
    ------
    InputError
        For an unknown kind, and as raised by the plot.
    """
    if kind not in KINDS:
        raise InputError(f"There is no plot '{kind}'{nearest(kind, KINDS)}; there are: "
                         f"{choices(KINDS)}.")
    whole = t_start is None and t_end is None
    part = trajectory if whole else trajectory.between(t_start, t_end)
    chosen = choice or PlotRequest()
    if chosen.component is not None and chosen.component not in (known := part.basis.components):
        raise InputError(f"component = {chosen.component!r} is not one of this run; choose from "
                         f"{choices(known)}.")
    return KINDS[kind](part, chosen, path)


def point_of(text: str) -> Point:
    """A point from a command line: ``B``, ``3`` for a contact node, ``0.1,0.02`` for a place."""
    number = whole_number(text)
    if number is not None:
        return number
    if "," not in text:
        return text
    try:
        place = tuple(float(part) for part in text.split(","))
        if len(place) in (2, 3) and np.isfinite(place).all():
            return place
        raise ValueError
    except ValueError:
        raise InputError(f"The point {text} must be a name, the number of a contact node, or a "
                         f"place x,y in m, of a solid x,y,z.") from None
