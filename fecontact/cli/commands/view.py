"""The command ``open``: result files in ParaView or the browser."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, waiting, warn_if_stale
from fecontact.cli.options import Changes


def open(
    file: Annotated[Path, Parameter(help=(
        "A run or its study, frames for ParaView (.pvd, .vtu), or a picture, movie or PDF."))],
    /,
    *,
    set_: Changes = None,
    with_: Annotated[Literal["paraview", "browser"] | None, Parameter(
        name="--with", help="Program to use; for runs and frames ParaView if it is found.")] = None,
) -> None:
    """Show a result file in ParaView or in the browser.

    A run is shown in the browser as the page that `fecontact report` writes. No code is run that
    the file contains or names.
    """
    from fecontact.cli import viewers
    from fecontact.cli.run_files import has_run, stored_run, write_report

    shown, study = file, file.suffix.lower() == ".toml"
    if study or file.is_dir() or set_:
        shown = has_run(file, set_)
    viewers.require_kind_of_result(shown)
    frames = shown.suffix.lower() in viewers.FRAMES
    program = viewers.paraview() if frames and with_ != "browser" else None
    run = shown.suffix.lower() == ".vtkhdf"
    if with_ == "paraview" or (frames and not run) or (
            program is not None and viewers.has_frames(shown)):
        viewers.show_in_paraview(shown, program)
        echo(f"{shown} is opened in ParaView")
        return
    if run:
        stored = stored_run(file, changes=set_) if study else stored_run(shown)
        page = shown.with_suffix(".html")
        with waiting("Writing"):
            write_report(stored, shown.stem, page)
        echo_written(page)
        warn_if_stale(file, stored.current)
        shown = page
    viewers.show_in_browser(shown)
    echo(f"{shown} is opened in the browser")
