"""Commands that work on a run: ``render`` and ``export``."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from fecontact.cli.options import RunFile
from fecontact.cli.printing import note_age, say_written


def render(
    file: RunFile,
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
        say_written(movie(stored.trajectory, target, settings))
    note_age(file, stored.current)


def export(
    file: RunFile,
    /,
    *,
    format_: Annotated[Literal["pvd"], Parameter(
        name="--format", help="PVD with VTU files, for ParaView before 5.12.")] = "pvd",
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="Folder for the files, of its own.")] = None,
    frames: Annotated[int, Parameter(help="Number of fields over the body.")] = 200,
) -> None:
    """Write fields over the body in another format."""
    from fecontact.console import output_folder, waiting
    from fecontact.results import stored_run

    stored = stored_run(file)
    from fecontact.output.pvd import export_pvd

    folder = output or stored.path.with_name(f"{stored.path.stem}-{format_}")
    with output_folder(folder.parent), waiting("Writing"):
        collection = export_pvd(stored.trajectory, folder / f"{stored.path.stem}.pvd",
                                frames=frames)
    say_written(collection)
    note_age(file, stored.current)
