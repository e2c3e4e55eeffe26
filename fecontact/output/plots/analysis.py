"""Plots of analyses: spectra, Poincare sections, friction work, frequency responses."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.histories import Point, history, point_name, usual_point
from fecontact.analysis.periodicity import Strobe, section_states, strobed_states
from fecontact.analysis.resolved import resolved
from fecontact.analysis.sampling import evenly_sampled_history
from fecontact.analysis.spectra import (
    FEWEST_PERIODS,
    amplitude_spectrum,
    power_spectral_density,
    require_periods,
    spectrogram,
)
from fecontact.core.checks import as_several, require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.types import Array
from fecontact.core.units import count, listed
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import COLOURS, distinct_colours
from fecontact.output.diagrams.diagram import WIDTH, Curve, Diagram
from fecontact.output.diagrams.maps import spectrogram_map
from fecontact.output.diagrams.runs import phase_diagram
from fecontact.output.diagrams.spectra import beyond_band, end_of_content, spectrum_diagram
from fecontact.output.plots.drawing import colour_bar, draw
from fecontact.output.plots.face_panels import abscissa_unit, face_panels, scale_row
from fecontact.output.plots.figure import new_figure
from fecontact.output.plots.run import direction_row
from fecontact.output.plots.style import add_note
from fecontact.reduction.assembly.contact_faces import shown_faces

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fecontact.analysis.receptance import Receptance

_RETURNS = 1e-3  # of the motion, within which an orbit has returned
_ROUND_OFF = 1e-9  # of the largest response, below which others are not drawn


def plot_spectrum(
    trajectory: Trajectory,
    quantity: str = "velocity",
    point: Point | None = None,
    component: str = "x",
    *,
    density: bool = False,
    highest_hz: float | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """Plot the spectrum of a quantity of a run, with its peaks.

    Where outputs are too far apart, it is that of what the run has kept between them too.

    Parameters
    ----------
    trajectory : Trajectory
        The run, transients cut off by :meth:`fecontact.Trajectory.between`.
    quantity, point, component
        See :func:`fecontact.analysis.history`.
    density : bool
        Power spectral density by Welch's method in the place of amplitudes.
    highest_hz : float, optional
        End of the axis [Hz].
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For a quantity or a point that does not exist, fewer than five periods, another suffix, or
        a file that cannot be written.

    Warns
    -----
    ModelWarning
        If outputs are too far apart and the motion between them is not known.
    """
    from matplotlib.patheffects import withStroke

    require_kind("plot_spectrum", Trajectory, trajectory=trajectory)
    if highest_hz is not None:
        require_positive("plot_spectrum", highest_hz=highest_hz)
    sampled = evenly_sampled_history(trajectory, quantity, point, component)
    shown = sampled.history
    make = power_spectral_density if density else amplitude_spectrum
    if not density:
        require_periods(sampled.time, shown.values, float(sampled.time[-1] - sampled.time[0]))
    found = make(sampled.time, shown.values)
    diagram = spectrum_diagram(
        [found], f"density [({shown.unit})²/Hz]" if density else f"amplitude [{shown.unit}]",
        [""], COLOURS[:1], title=shown.title, highest_hz=highest_hz)
    end = diagram.x_limits[1] or 0.0
    with new_figure(9.0, 4.6, path) as figure:
        add_note(figure, sampled)
        panel = figure.subplots()
        draw(panel, diagram)
        named: list[float] = []
        for peak in found.peaks(40):
            # Leave out labels that overlap those of higher peaks.
            apart = all(abs(peak.frequency_hz - other) > 0.06 * end for other in named)
            if peak.frequency_hz < end and apart and len(named) < 6:
                named.append(peak.frequency_hz)
                # Numbers near an end stand beside their peak, not on the axis.
                ends = int(peak.frequency_hz < 0.04 * end) - int(peak.frequency_hz > 0.96 * end)
                panel.annotate(f"{peak.frequency_hz:.4g}", (peak.frequency_hz, peak.value),
                               xytext=(3 * ends, 4), textcoords="offset points", fontsize=8.5,
                               path_effects=[withStroke(linewidth=2.0, foreground="white")],
                               ha={1: "left", 0: "center", -1: "right"}[ends])
    return figure


def plot_spectrogram(
    trajectory: Trajectory,
    quantity: str = "velocity",
    point: Point | None = None,
    component: str = "x",
    *,
    piece: float | None = None,
    highest_hz: float | None = None,
    path: str | Path | None = None,
) -> "Figure":
    """Plot the amplitudes of a quantity of a run over time and frequency, below its history.

    Parameters
    ----------
    trajectory, quantity, point, component, highest_hz, path
        See :func:`plot_spectrum`.
    piece : float, optional
        Length of the pieces that are transformed [s]; by default a thirty-second of the run, or
        ten periods of the mean frequency if these are longer.

    Raises
    ------
    InputError
        As in :func:`plot_spectrum`.
    """
    require_kind("plot_spectrogram", Trajectory, trajectory=trajectory)
    if highest_hz is not None:
        require_positive("plot_spectrogram", highest_hz=highest_hz)
    sampled = evenly_sampled_history(trajectory, quantity, point, component)
    shown = sampled.history
    found = spectrogram(sampled.time, shown.values, piece=piece, overlap=0.9)
    drawn = resolved(trajectory)
    line = history(drawn.trajectory, quantity, point, component).values
    time = trajectory.time
    ends = (float(time[0]), float(time[-1]))
    above = Diagram("time [s]", f"{quantity.replace('_', ' ')} [{shown.unit}]",
                    (Curve("", COLOURS[0], drawn.trajectory.time, line, 0.8),),
                    title=shown.title, x_limits=ends)
    with new_figure(9.5, 5.6, path) as figure:
        add_note(figure, drawn)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 2.2))
        draw(upper, above)
        upper.set_xlabel("")
        below = Diagram("time [s]", "frequency [Hz]", maps=(spectrogram_map(found, shown.unit),),
                        x_limits=ends, y_limits=(0.0, highest_hz or end_of_content(
                            found.frequency_hz, found.values.max(axis=1))))
        colour_bar(draw(lower, below)[0], below.maps[0], lower)
    return figure


def plot_poincare(
    trajectory: Trajectory,
    point: Point | None = None,
    component: str = "x",
    *,
    period: float | None = None,
    phase: float = 0.0,
    path: str | Path | None = None,
) -> "Figure":
    """Plot a Poincare section: the state of a point once per period, over its motion.

    Without a drive and a period, as for self-excited motion, when the point passes its largest
    displacements.

    Parameters
    ----------
    trajectory, path
        See :func:`plot_spectrum`.
    point : str, int or (x, y), optional
        See :func:`fecontact.analysis.history`.
    component : "x" or "y", of solids "z" too
        Direction of the motion.
    period, phase
        See :func:`fecontact.analysis.strobed_states`.

    Raises
    ------
    InputError
        For a point or a component that does not exist, a motion without maxima, fewer than five
        points unless the last one is the first again, another suffix, or a file that cannot be
        written.
    """
    require_kind("plot_poincare", Trajectory, trajectory=trajectory)
    row = direction_row(trajectory, component)
    start = float(trajectory.time[0])
    point = usual_point(trajectory.basis) if point is None else point
    if period is None and not trajectory.system.drive.fundamental_hz > 0.0:
        found = section_states(trajectory, point, component, t_start=start)
    else:
        found = strobed_states(trajectory, period=period, phase=phase, t_start=start)
    basis = trajectory.basis
    drawn = resolved(trajectory)
    rows = trajectory._rows(point)[row]
    m = basis.modes
    once = found.states[:, :m] @ rows, found.states[:, m : 2 * m] @ rows
    diagram = phase_diagram(drawn.trajectory, point, row, Curve(
        f"once per {found.period:.4g} s" if found.maxima_of is None else
        f"maxima of {component}, {found.period:.4g} s apart", COLOURS[1], *once, 0.0, 3.5))
    motion = diagram.curves[0]
    _require_section(found, once, (np.ptp(motion.x), np.ptp(motion.y)))
    diagram = replace(diagram,
                      title=f"{point_name(point, basis)}, {count(len(found.time), 'point')}")
    with new_figure(6.4, 5.2, path) as figure:
        add_note(figure, drawn)
        plane = figure.subplots()
        draw(plane, diagram)
        plane.legend(loc="best")
    return figure


def _require_section(
    found: Strobe, once: tuple[Array, Array], ranges: tuple[float, float]
) -> None:
    """Refuse a section of few points, unless they are those of a whole orbit.

    ``once`` are the displacements and velocities of the points, ``ranges`` those of the motion.
    """
    points, fewest = len(found.time), int(FEWEST_PERIODS)
    returns = points > 1 and all(abs(values[-1] - values[0]) <= _RETURNS * largest
                                 for values, largest in zip(once, ranges, strict=True))
    if points < fewest and not returns:
        raise InputError(f"A Poincare section: the run has {count(points, 'point')}, "
                         f"{found.period:.4g} s apart, but needs {fewest}; run it for longer.")


def plot_friction_work(trajectory: Trajectory, *, path: str | Path | None = None) -> "Figure":
    """Plot friction work per length [J/m] and slip distance [m] along the contact face.

    Of several bodies along each interface, of one body along each contact group, in columns; those
    of similar values have one scale.

    Wear by Archard's law is proportional to the integral of pressure times slip, which with a
    constant coefficient is the friction work over that coefficient. Of solids work per area [J/m^2]
    and slip distance over the faces.

    Parameters
    ----------
    trajectory, path
        See :func:`plot_spectrum`.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    require_kind("plot_friction_work", Trajectory, trajectory=trajectory)
    if trajectory.basis.dimension == 3:
        from fecontact.output.plots.solids.maps import friction_work_maps

        return friction_work_maps(trajectory, path)
    drawn = resolved(trajectory)
    trajectory = drawn.trajectory
    faces = shown_faces(trajectory.basis, "friction work")
    work = trajectory.friction_work[-1] / trajectory.basis.tributary
    touching = trajectory.normal_force != 0.0
    speed = np.abs(trajectory.slip_velocity) * touching
    slip = np.trapezoid(speed, trajectory.time, axis=0)
    with new_figure(max(9.0, 4.5 * len(faces)), 5.6, path) as figure:
        add_note(figure, drawn)
        panels = face_panels(figure, faces, 2)
        for row, (values, name, base) in enumerate(((work, "friction work per length", "J/m"),
                                                    (slip, "slip in contact", "m"))):
            sizes = [float(np.abs(values[face.nodes]).max()) for face in faces]
            factors = scale_row(panels[row], sizes, name, base)
            for face, panel, factor in zip(faces, panels[row], factors, strict=True):
                unit = abscissa_unit(face)
                panel.bar(face.abscissa / unit, values[face.nodes] / factor,
                          width=0.92 * face.tributary / unit, color=COLOURS[0])
            # Not before all of a row are drawn: its panels may share their scale.
            for panel in panels[row]:
                panel.set_ylim(bottom=min(0.0, panel.dataLim.y0))
        figure.align_ylabels(panels[:, 0])
    return figure


def plot_receptance(
    responses: "Receptance | Sequence[Receptance]", labels: Sequence[str] = (), *,
    usable_hz: float = np.inf, path: str | Path | None = None,
) -> "Figure":
    """Plot magnitude and phase of frequency responses; those of unstable states are dashed.

    What is linearised about an unstable state is not what a measurement would show: the legend
    says so. Responses that stay below a billionth of the largest of their unit are round-off: they
    are left out and named below the figure.

    Parameters
    ----------
    responses : Receptance or sequence of them
        Result of :func:`fecontact.analysis.receptance`, all of one
        kind.
    labels : sequence of str
        A name for each.
    usable_hz : float
        Frequency up to which the basis is usable [Hz]; what lies beyond is shaded.
    path : str or Path, optional
        A .png, .pdf or .svg file to write too; it is replaced if it exists.

    Raises
    ------
    InputError
        For nothing to draw, another suffix, or a file that cannot be written.
    """
    from fecontact.analysis.receptance import Receptance

    responses = as_several(responses, Receptance, "plot_receptance", "responses")
    if not responses:
        raise InputError("responses = [] holds nothing to draw; give at least one.")
    if not any(response.values.any() for response in responses):
        raise InputError(f"{_place(responses[0].responses[0])} does not move by a force at "
                         f"{_place(responses[0].excitations[0])}; choose another point or "
                         f"component.")
    curves, still = _responses(responses, labels)
    many = len(responses) > 1 or responses[0].values[0].size > 1
    units = list(dict.fromkeys(curve.unit for curve in curves))
    first = responses[0]
    f = first.frequency_hz
    ends = (float(f[0]), float(f[-1])) if len(f) > 1 else (None, None)
    bands = beyond_band(np.concatenate([one.frequency_hz for one in responses]), usable_hz)
    upper_curves, lower_curves = [], []
    for number, (curve, colour) in enumerate(zip(curves, distinct_colours(len(curves)),
                                                 strict=True)):
        name = f"{curve.name} [{curve.unit}]" if len(units) > 1 else curve.name
        if not curve.of.stable:
            name += f"\nUNSTABLE, not to be measured:\n{curve.of.growth_in_words}"
        # The first is the widest: others on top do not hide it.
        shown: dict[str, Any] = {
            "width": 3.0 if many and number == 0 else WIDTH,
            "dashed": not curve.of.stable}
        # From the lower end of the axis on: what follows a force at 180 degrees does not leap.
        degrees = (np.degrees(np.angle(curve.values)) + 190.0) % 360.0 - 190.0
        upper_curves.append(Curve(name, colour, curve.of.frequency_hz, np.abs(curve.values),
                                  **shown))
        lower_curves.append(Curve("", colour, curve.of.frequency_hz, degrees, **shown))
    upper_diagram = Diagram(
        "frequency [Hz]", f"{first.kind} [{units[0]}]" if len(units) == 1 else first.kind,
        tuple(upper_curves), bands=bands, logarithmic="y", x_limits=ends)
    lower_diagram = Diagram("frequency [Hz]", "phase [°]", tuple(lower_curves), bands=bands,
                            x_limits=ends, y_limits=(-190.0, 190.0))
    with new_figure(9.0, 6.0, path) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
        draw(upper, upper_diagram)
        draw(lower, lower_diagram)
        upper.set_xlabel("")
        if still:
            figure.supxlabel(f"not drawn, as zero but for round-off: {listed(still)}", x=0.99,
                             ha="right", fontsize=8.0, color="#6a6a6a")
        if many or bands or not first.stable:
            upper.legend(loc="best")
        else:
            upper.set_title(f"{_place(first.responses[0])} by a force at "
                            f"{_place(first.excitations[0])}")
        lower.set_yticks([-180, -90, 0, 90, 180])
        figure.align_ylabels([upper, lower])
    return figure


class _Response(NamedTuple):
    name: str
    unit: str
    values: NDArray[np.complex128]
    of: "Receptance"


def _responses(
    responses: "Sequence[Receptance]", labels: Sequence[str]
) -> tuple[list[_Response], list[str]]:
    """The curves to draw, and the names of those that are round-off."""
    found, largest = [], dict[str, float]()
    for index, response in enumerate(responses):
        for r, seen in enumerate(response.responses):
            for e, pushed in enumerate(response.excitations):
                name = f"{_place(seen)} by {_place(pushed)}"
                if index < len(labels):
                    name = f"{labels[index]}, {name}" if response.values[0].size > 1 else (
                        labels[index])
                one = _Response(name, response.unit(r, e), response.values[:, r, e], response)
                found.append(one)
                largest[one.unit] = max(largest.get(one.unit, 0.0), float(np.abs(one.values).max()))
    moves = [np.abs(one.values).max() > _ROUND_OFF * largest[one.unit] for one in found]
    return ([one for one, moving in zip(found, moves, strict=True) if moving],
            [one.name for one, moving in zip(found, moves, strict=True) if not moving])


def _place(place: tuple[str | int, str]) -> str:
    return f"{point_name(place[0])} {place[1]}"
