"""Commands that work on a run: ``report``, ``open``, ``render``, ``plot`` and ``export``."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from fecontact.cli.console import (
    INTERRUPTED,
    echo,
    echo_written,
    fail,
    waiting,
    warn_if_stale,
)
from fecontact.cli.options import All, At, Branches, Changes, RunFile, Trust, Which


def report(
    file: RunFile,
    /,
    *,
    set_: Changes = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="A .html file; by default beside the run.")] = None,
    trust: Trust = False,
) -> int:
    """Write a run as one HTML page that plays it in any browser, without a network.

    For a study, the stored run is taken if the values of the study are those of the run. Otherwise
    the study is run first, and only the page is stored. For a file of branches or responses, the
    page is a diagram, in which a click on a point plays its orbit.
    """
    from fecontact.analysis.run_facts import notes
    from fecontact.cli.orbit_files import holds_branches, write_orbit_page
    from fecontact.cli.run_files import (
        own_page,
        require_stored,
        stored_or_computed_run,
        write_report,
    )
    from fecontact.core.files.atomic_write import output_folder, require_possible

    require_possible(output)
    if holds_branches(file):
        require_stored(file, set_)
        target = output or own_page(file)
        with output_folder(target.parent), waiting("Writing"):
            echo_written(write_orbit_page(file, target, trust))
        return 0
    stored = stored_or_computed_run(file, set_, trust)
    target = output or own_page(stored.path)
    with output_folder(target.parent), waiting("Writing"):
        written = write_report(stored, file.stem, target)
    for note in notes(stored.trajectory):
        echo(f"note: {note}")
    echo_written(written)
    ended = stored.trajectory.status.name
    if ended not in ("FINISHED", "EVENT", "INTERRUPTED"):
        return fail("the run did not reach its end; what was computed is in the report.", 1)
    return INTERRUPTED if ended == "INTERRUPTED" else 0


def open(
    file: Annotated[Path, Parameter(help=(
        "A run or its study, frames for ParaView (.pvd, .vtu), branches or a response (.h5), or a "
        "picture, movie or PDF."))],
    /,
    *,
    set_: Changes = None,
    with_: Annotated[Literal["paraview", "browser"] | None, Parameter(
        name="--with", help="Program to use; for runs and frames ParaView if it is found.")] = None,
    trust: Trust = False,
) -> None:
    """Show a result file in ParaView or in the browser.

    The browser shows a run, branches or a response as the page that fecontact report writes.
    Without --trust, no code that the file contains or names is run.
    """
    from fecontact.cli import viewers
    from fecontact.cli.orbit_files import holds_branches, write_orbit_page
    from fecontact.cli.run_files import has_run, own_page, stored_run, write_report
    from fecontact.laws.own_files import trusting

    shown, study = file, file.suffix.lower() == ".toml"
    with trusting(trust):
        if study or file.is_dir() or set_:
            shown = has_run(file, set_)
        viewers.require_kind_of_result(shown)
        if holds_branches(shown):
            page = own_page(shown)
            with waiting("Writing"):
                write_orbit_page(shown, page, trust)
            echo_written(page)
            viewers.show_in_browser(page)
            echo(f"{page} is opened in the browser")
            return
        frames = shown.suffix.lower() in viewers.FRAMES
        program = viewers.paraview() if frames and with_ != "browser" else None
        run = shown.suffix.lower() == ".vtkhdf"
        if with_ == "paraview" or (frames and not run) or (
                program is not None and viewers.has_frames(shown)):
            viewers.show_in_paraview(shown, program)
            echo(f"{shown} is opened in ParaView")
            return
        if run:
            stored = stored_run(file if study else shown, trust, set_)
            page = own_page(shown)
            with waiting("Writing"):
                write_report(stored, shown.stem, page)
            echo_written(page)
            warn_if_stale(file, stored.current)
            shown = page
        viewers.show_in_browser(shown)
        echo(f"{shown} is opened in the browser")


def render(
    file: RunFile,
    /,
    *,
    set_: Changes = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"],
        help="NAME.mp4 for a movie; NAME.png or a folder for numbered pictures.")] = None,
    frames: Annotated[int | None, Parameter(help="Number of frames.")] = None,
    fps: Annotated[float | None, Parameter(help="Frames per second.")] = None,
    size: Annotated[tuple[int, int] | None, Parameter(
        help="Width and height in pixels, even numbers.")] = None,
    colour: Annotated[Literal["displacement", "von_mises"] | None, Parameter(
        help="Quantity that colours the body.")] = None,
    scale: Annotated[float | None, Parameter(
        help="Magnification of displacements.")] = None,
    view: Annotated[Literal["above", "below"] | None, Parameter(
        help="Viewpoint of solids; below shows the contact faces on the ground.")] = None,
    t_start: Annotated[float | None, Parameter(help="Start of the interval to draw [s].")] = None,
    t_end: Annotated[float | None, Parameter(help="End of the interval to draw [s].")] = None,
    branch: Branches = None,
    at: At = None,
    which: Which = 0,
    trust: Trust = False,
) -> None:
    """Render a run as a movie or as numbered pictures; defaults come from [render] of the study.

    For a file of branches or responses, one period of an orbit is rendered.
    """
    from dataclasses import replace

    from fecontact.cli.orbit_files import OrbitChoice, stored_orbit_or_run
    from fecontact.cli.run_files import movie, wear_of
    from fecontact.core.files.atomic_write import output_folder, require_possible

    require_possible(output)
    changes: dict[str, Any] = {
        "frames": frames, "fps": fps, "size": size, "colour": colour, "scale": scale,
        "view": view,
        "t_start": t_start, "t_end": t_end}
    stored = stored_orbit_or_run(file, trust, set_, OrbitChoice(branch, at, which))
    from fecontact.core.tables import located

    with located("render:", "RenderSettings"):
        settings = replace(stored.settings,
                           **{key: value for key, value in changes.items() if value is not None})
    target = output or stored.path.with_suffix(".mp4")
    with output_folder(target.parent):
        echo_written(movie(stored.trajectory, target, settings, wear_of(stored)))
    warn_if_stale(file, stored.current)


def plot(
    file: RunFile,
    kind: Annotated[str | None, Parameter(show_default=False, help=(
        "history, phase, contact_map, energies, modes, spectrum, density, spectrogram, "
        "poincare, friction_work or receptance; for files NAME.h5 also branches, response or "
        "mode."))] = None,
    /,
    *,
    set_: Changes = None,
    point: Annotated[list[str] | None, Parameter(
        negative=(), show_default=False,
        help="Name of a point, number of a contact node, or place x,y or x,y,z; by default B, or "
        "the first that moves of the contact, C and other points; of an orbit the observed point. "
        "A history takes several.")] = None,
    component: Annotated[Literal["x", "y", "z", "phi", "phi_x", "phi_y", "phi_z"] | None, Parameter(
        help="Component of the motion: x, y or phi of plane bodies, x, y, z, phi_x, phi_y or phi_z "
        "of solids. By default that of the drive.")] = None,
    quantity: Annotated[str, Parameter(
        help="Quantity for spectra: velocity, displacement, normal_force, ...")] = "velocity",
    highest_hz: Annotated[float | None, Parameter(help="Highest frequency to plot [Hz].")] = None,
    period: Annotated[float | None, Parameter(help=(
        "Time between the points of a Poincare section [s]. By default the period of the drive; "
        "without a drive, points are maxima of the displacement."))] = None,
    t_start: Annotated[float | None, Parameter(help="Start of the interval to draw [s].")] = None,
    t_end: Annotated[float | None, Parameter(help="End of the interval to draw [s].")] = None,
    style: Annotated[str | None, Parameter(
        help="A style of matplotlib, or a file NAME.mplstyle.")] = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="A .png, .pdf or .svg file.")] = None,
    branch: Branches = None,
    at: At = None,
    which: Which = 0,
    all_: All = False,
    trust: Trust = False,
) -> None:
    """Plot a stored run, branches or a response, or one orbit of these like a run."""
    from fecontact.cli.orbit_files import (
        DIAGRAMS,
        OrbitChoice,
        holds_branches,
        plotted,
        stored_orbit_or_run,
    )
    from fecontact.cli.plot_kinds import PlotRequest, point_of, redraw, require_kind_of_plot
    from fecontact.cli.run_files import require_stored
    from fecontact.core.files.atomic_write import output_folder, require_possible
    from fecontact.output.plots.figure import styled

    require_possible(output)
    chosen = OrbitChoice(branch, at, which)
    kind = require_kind_of_plot(kind, file, chosen)
    if kind in DIAGRAMS and holds_branches(file):
        require_stored(file, set_)
        target = output or file.with_name(f"{file.stem}-{kind}.png")
        with output_folder(target.parent), waiting("Drawing"), styled(style or {}):
            echo_written(plotted(file, kind, target))
        return
    stored = stored_orbit_or_run(file, trust, set_, chosen)
    points = tuple(point_of(text) for text in point or ())
    if stored.observed is not None:
        place, along = stored.observed
        # Rotations are no direction of a phase diagram or a Poincare section.
        points = points or (place,)
        component = component or (None if along.startswith("phi") else along)
    choice = PlotRequest(quantity, points, component, highest_hz, period, all_)
    target = output or stored.path.with_name(f"{stored.path.stem}-{kind}.png")
    with output_folder(target.parent), waiting("Drawing"), styled(style or {}):
        redraw(stored.trajectory, kind, choice, t_start=t_start, t_end=t_end, path=target)
        echo_written(target)
    warn_if_stale(file, stored.current)


def export(
    file: RunFile,
    /,
    *,
    set_: Changes = None,
    format_: Annotated[Literal["pvd", "csv", "mat", "netcdf"], Parameter(
        name="--format", help="pvd with VTU files, for ParaView before 5.12; csv for "
        "spreadsheets; mat for MATLAB and Octave; netcdf for xarray.")] = "pvd",
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="Output file, or a folder for pvd.")] = None,
    frames: Annotated[int, Parameter(help="Number of fields over the body, for pvd.")] = 200,
    trust: Trust = False,
) -> None:
    """Export a run to another format."""
    from fecontact.cli.run_files import stored_run
    from fecontact.core.files.atomic_write import output_folder, require_possible

    require_possible(output)
    stored = stored_run(file, trust, set_)
    from fecontact.output.files.export import export_run

    with output_folder((output or stored.path).parent), waiting("Writing"):
        written = export_run(stored.trajectory, stored.path, format_, output, frames)
    echo_written(written)
    warn_if_stale(file, stored.current)
