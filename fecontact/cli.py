"""The command line ``fecontact``.

Libraries that take time to load are imported inside the commands, so that help comes at once.
"""

import sys
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter

from fecontact.console import INTERRUPTED
from fecontact.errors import FecontactError, InputError

StudyFile = Annotated[Path, Parameter(help="Study file; `fecontact init` writes one.")]
Changes = Annotated[list[str] | None, Parameter(
    name="--set", negative=(), show_default=False,
    help="A key of the study and its value, `ground.speed=0.1`; may be given several times.")]
Folder = Annotated[Path | None, Parameter(
    name=["--output", "-o"], help="Folder for the results, instead of that of the study.")]


def _version() -> str:
    from fecontact import __version__

    return __version__


app = App(
    name="fecontact",
    help="Elastic bodies in contact with friction: from a study file to modes, motion and movies.",
    version=_version,
    help_format="markdown",
    suppress_keyboard_interrupt=False,
)
app.meta.suppress_keyboard_interrupt = False


def main() -> None:
    """Run the command line and leave Python with its exit code."""
    sys.exit(execute(sys.argv[1:]))


def execute(tokens: list[str]) -> int:
    """Run one command line; the exit code.

    0 when all went well, 1 for an error, 2 for a command line that cannot be understood, 130
    after Ctrl-C. Errors are one sentence on stderr; ``--debug`` shows where they come from.
    """
    debug = "--debug" in tokens
    try:
        return int(app.meta(tokens, exit_on_error=False, print_error=False,
                            result_action="return_value") or 0)
    except CycloptsError as error:
        return _complain(str(error).replace("\n", " "), 2)
    except FecontactError as error:
        if debug:
            raise
        return _complain(str(error), 1)
    except KeyboardInterrupt:
        return _complain("interrupted.", INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone; there is nobody to tell.
        sys.stdout = None
        return 1
    except OSError as error:
        if debug:
            raise
        return _complain(f"{error.filename or 'a file'}: {(error.strerror or str(error)).lower()}.",
                         1)
    except Exception as error:
        if _was_interrupted(error):
            return _complain("interrupted.", INTERRUPTED)
        if debug:
            raise
        return _complain(f"this should not happen ({type(error).__name__}: {error}); run it again "
                         f"with --debug and report what it prints.", 1)


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: libraries hide it if it comes while they are loaded."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


@app.meta.default
def _launch(
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    debug: Annotated[bool, Parameter(negative=(), help="Show where an error comes from.")] = False,
) -> Any:
    return app(tokens, exit_on_error=False, print_error=False, result_action="return_value")


@app.command(sort_key=1)
def init(
    file: Annotated[Path, Parameter(help="The file to write.")] = Path("study.toml"),
    /,
    *,
    shape: Annotated[Literal["beam", "pendulum", "block"], Parameter(
        help="Beam on wavy ground, pendulum on a stop, or block on a moving belt.")] = "beam",
    force: Annotated[bool, Parameter(negative=(), help="Replace the file if there is one.")]
    = False,
) -> None:
    """Write a commented study file to start from."""
    from fecontact.console import write_text
    from fecontact.templates import template

    if file.suffix.lower() != ".toml":
        raise InputError(f"{file} must end in .toml.")
    if file.exists() and not force:
        raise InputError(f"{file} exists; choose another name, or replace it with --force.")
    write_text(file, template(shape))
    _say(f"{file} is written; next: fecontact run {file}")


@app.command(sort_key=2)
def mesh(study: StudyFile, /, *, set_: Changes = None, output: Folder = None) -> None:
    """Make the mesh of a study, and print its size and its groups."""
    from fecontact.console import output_folder
    from fecontact.mesh_io import write_mesh
    from fecontact.report import mesh_table
    from fecontact.results import read_study

    described = read_study(study, set_)
    with output_folder(output or described.results) as folder:
        made = described.mesh()
        _show(mesh_table(made))
        write_mesh(made, folder / f"{described.name}.msh")
        _say_written(folder / f"{described.name}.msh")


@app.command(sort_key=3)
def modes(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    converge: Annotated[bool, Parameter(negative=(), help=(
        "Refine the mesh, and take more modes: what changes, as a table and a plot."))]
    = False,
) -> None:
    """Print frequency, damping, kind and effective mass of the modes, and draw their shapes."""
    from fecontact.console import output_folder, progress_bar, waiting
    from fecontact.results import convergence_of, read_study

    described = read_study(study, set_)
    from fecontact.output.plots import plot_convergence, plot_modes

    with output_folder(output or described.results) as folder:
        with waiting("Computing modes"):
            basis = described.basis()
        _say(str(basis.report()))
        picture = folder / f"{described.name}-modes.png"
        plot_modes(basis, picture)
        _say_written(picture)
        if converge:
            with progress_bar("Refining", 1.0) as progress:
                result = convergence_of(described, progress)
            _say(f"\n{result}")
            picture = folder / f"{described.name}-convergence.png"
            plot_convergence(result, picture)
            _say_written(picture)


@app.command(sort_key=4)
def run(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    resume: Annotated[bool, Parameter(
        negative=(), help="Go on with a run that was interrupted.")] = False,
) -> int:
    """Run a study in time; write the run (NAME.vtkhdf, opens in ParaView) and plots.

    Ctrl-C stops the run; what was computed until then is written, and --resume goes on from there.
    """
    from fecontact.console import output_folder, progress_bar, waiting
    from fecontact.report import notes, run_table
    from fecontact.results import read_study, write_run

    described = read_study(study, set_)
    t_end = described.t_end
    with waiting("Compiling, once after an installation"):
        from fecontact.integrate import control  # noqa: F401
    with output_folder(output or described.results) as folder:
        with waiting("Computing modes"):
            described.system()
        checkpoint = folder / f"{described.name}.checkpoint"
        if not resume:
            checkpoint.unlink(missing_ok=True)
        elif not checkpoint.exists():
            raise InputError(f"There is no interrupted run to go on with: {checkpoint} does not "
                             f"exist; run the study without --resume.")
        with progress_bar("Running", t_end, described.simulation.t_start) as progress:
            trajectory = described.run(progress, checkpoint)
        with waiting("Writing"):
            files = write_run(described, trajectory, folder)
        _show(run_table(trajectory))
        for note in notes(trajectory):
            _say(f"note: {note}")
        _say_written(*files)
    ended = trajectory.status.name
    if ended not in ("FINISHED", "INTERRUPTED"):
        return _complain("the run did not reach its end; what was computed is written.", 1)
    return INTERRUPTED if ended == "INTERRUPTED" else 0


@app.command(sort_key=5)
def render(
    file: Annotated[Path, Parameter(help="What `fecontact run` wrote, or the study it ran.")],
    /,
    *,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"],
        help="NAME.mp4 for a movie; NAME.png or a folder for numbered pictures.")] = None,
    frames: Annotated[int | None, Parameter(help="Number of pictures.")] = None,
    fps: Annotated[float | None, Parameter(help="Pictures a second.")] = None,
    size: Annotated[tuple[int, int] | None, Parameter(
        help="Width and height in pixels, even.")] = None,
    colour: Annotated[Literal["displacement", "von_mises"] | None, Parameter(
        help="Quantity that colours the body.")] = None,
    scale: Annotated[float | None, Parameter(
        help="Factor by which displacements are drawn larger.")] = None,
    start: Annotated[float | None, Parameter(help="Begin at this time of the run [s].")] = None,
    end: Annotated[float | None, Parameter(help="Stop at this time of the run [s].")] = None,
) -> None:
    """Draw a run as a movie or as numbered pictures; [render] of the study holds the defaults."""
    from dataclasses import replace

    from fecontact.console import output_folder
    from fecontact.results import movie, stored_run

    changes: dict[str, Any] = {
        "frames": frames, "fps": fps, "size": size, "colour": colour, "scale": scale,
        "start": start, "end": end}
    stored = stored_run(file)
    from fecontact.tables import located

    with located("render:", "RenderSettings"):
        settings = replace(stored.settings,
                           **{key: value for key, value in changes.items() if value is not None})
    target = output or stored.path.with_suffix(".mp4")
    with output_folder(target.parent):
        _say_written(movie(stored.trajectory, target, settings))
    _note_age(file, stored.current)


@app.command(sort_key=6)
def plot(
    file: Annotated[Path, Parameter(help="What `fecontact run` wrote, or the study it ran.")],
    kind: Annotated[str, Parameter(
        help="history, phase, contact, energies, modes, spectrum, density, spectrogram, poincare, "
        "friction_work or receptance.")],
    /,
    *,
    point: Annotated[list[str] | None, Parameter(
        negative=(), show_default=False,
        help="Name of a point, number of a contact node, or place `x,y`; B by default. A history "
        "takes several.")] = None,
    axis: Annotated[Literal["x", "y", "phi"], Parameter(help="Direction of the motion.")] = "x",
    quantity: Annotated[str, Parameter(
        help="Of spectra: velocity, displacement, normal_force, ...")] = "velocity",
    highest: Annotated[float | None, Parameter(help="End of the frequencies [Hz].")] = None,
    start: Annotated[float | None, Parameter(help="Begin at this time of the run [s].")] = None,
    end: Annotated[float | None, Parameter(help="Stop at this time of the run [s].")] = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="A .png, .pdf or .svg file.")] = None,
) -> None:
    """Draw a plot of a run, again or of another kind."""
    from fecontact.console import output_folder, waiting
    from fecontact.results import stored_run

    stored = stored_run(file)
    from fecontact.output.redraw import Choice, point_of, redraw

    choice = Choice(quantity, tuple(point_of(text) for text in point or ()), axis, highest)
    target = output or stored.path.with_name(f"{stored.path.stem}-{kind}.png")
    with output_folder(target.parent), waiting("Drawing"):
        _say_written(redraw(stored.trajectory, kind, target, choice, start=start, end=end))
    _note_age(file, stored.current)


@app.command(sort_key=6)
def export(
    file: Annotated[Path, Parameter(help="What `fecontact run` wrote, or the study it ran.")],
    /,
    *,
    format_: Annotated[Literal["pvd", "csv", "mat", "netcdf"], Parameter(
        name="--format", help="`pvd` with VTU files, for ParaView before 5.12; `csv` for "
        "spreadsheets; `mat` for MATLAB and Octave; `netcdf` for xarray.")] = "pvd",
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="The file, or for pvd a folder of its own.")] = None,
    frames: Annotated[int, Parameter(help="Number of fields over the body, for pvd.")] = 200,
) -> None:
    """Write a run in another format."""
    from fecontact.console import output_folder, waiting
    from fecontact.results import stored_run

    stored = stored_run(file)
    from fecontact.output.export import export_run

    with output_folder((output or stored.path).parent), waiting("Writing"):
        written = export_run(stored.trajectory, stored.path, format_, output, frames)
    _say_written(written)
    _note_age(file, stored.current)


@app.command(sort_key=7)
def doctor() -> int:
    """Check that all libraries are there and work; say what to install."""
    from fecontact.console import waiting
    from fecontact.doctor import examine
    from fecontact.report import table

    with waiting("Looking"):
        found = examine()
    rows = [(finding.what if finding.works else f"MISSING {finding.what}", finding.detail)
            for finding in found]
    _show(table("", "", left=2, rows=rows))
    remedies = dict.fromkeys(finding.remedy for finding in found if not finding.works)
    for remedy in filter(None, remedies):
        _say(f"To repair: {remedy}")
    if remedies:
        return 1
    _say("All is well.")
    return 0


@app.command(sort_key=8)
def laws(
    name: Annotated[str | None, Parameter(help="A law, for its formula and parameters.")] = None,
    /,
) -> None:
    """List the laws of contact, friction, ground and drive, or explain one."""
    from rich import print as show

    from fecontact.law_help import law_help, laws_table

    if name is None:
        show(laws_table())
    else:
        print(law_help(name))


@app.command(sort_key=9)
def demo(
    folder: Annotated[Path, Parameter(help="Where the results go.")] = Path("demo-output"), /,
) -> int:
    """Make two studies from geometry to movie: a beam on wavy ground, a pendulum on a stop."""
    from fecontact.demo import run_demo

    return run_demo(folder)


def _show(renderable: Any) -> None:
    from rich.console import Console

    Console().print(renderable)


def _say(text: str) -> None:
    print(text)


def _say_written(*files: Path) -> None:
    from fecontact.report import file_size

    for file in files:
        size = f" ({file_size(file)})" if file.is_file() else ""
        _say(f"wrote {file}{size}")


def _note_age(file: Path, current: bool) -> None:
    if not current:
        print(f"note: the run was computed with other values than {file} has now; run it again to "
              f"see these.", file=sys.stderr)


def _complain(message: str, code: int) -> int:
    print(f"error: {message}", file=sys.stderr)
    return code
