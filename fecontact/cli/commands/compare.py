"""The command ``compare``: several runs or branches over each other."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, show, waiting
from fecontact.cli.options import Trust
from fecontact.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence


def compare(
    *files: Annotated[Path, Parameter(help=(
        "Files written by fecontact run, their folders or studies; or files of branches."))],
    point: Annotated[list[str] | None, Parameter(
        negative=(), show_default=False,
        help="Name of a point or number of a contact node; by default B, or "
        "another point that moves. May be repeated.")] = None,
    component: Annotated[str | None, Parameter(
        help="Direction of the motion, x, y or z; by default that of the drive.")] = None,
    quantity: Annotated[str, Parameter(
        help="Quantity of the picture: velocity, displacement, normal_force, ...")] = "velocity",
    highest_hz: Annotated[float | None, Parameter(help="Highest frequency to plot [Hz].")] = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="A .html file; the picture is written beside it.")] = None,
    trust: Trust = False,
) -> None:
    """Compare runs: parameters that differ, key numbers, histories and spectra over each other.

    Numbers are taken over the second half of each run; changes are relative to the first run.
    Writes a page (NAME-compare.html) and a picture of histories and spectra (NAME-compare.png). For
    files of branches it draws the diagrams over each other and prints the parameters that differ.
    """
    from fecontact.cli.orbit_files import holds_branches
    from fecontact.core.files.atomic_write import require_possible

    if len(files) < 2:
        raise InputError(f"compare takes two files or more, not {len(files)}; name those of the "
                         f"runs.")
    kinds = {holds_branches(file) for file in files}
    if len(kinds) == 2:
        raise InputError("compare takes runs or files of branches, not both at once.")
    page = output or _beside(files[0])
    if page.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{page} must end in .html; the picture is written beside it.")
    require_possible(page)
    if kinds == {True}:
        _compare_branches(files, page.with_suffix(".png"), trust)
        return
    from fecontact.analysis.comparison import compare_runs
    from fecontact.cli.plot_kinds import point_of
    from fecontact.cli.run_files import stored_run
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.output.plots.many_runs import plot_runs
    from fecontact.output.report.run_comparison import report_runs

    stored = [stored_run(file, trust) for file in files]
    names = distinct_names([one.path for one in stored])
    runs = dict(zip(names, (one.trajectory for one in stored), strict=True))
    points = tuple(place for text in point or ()
                   if isinstance(place := point_of(text), str | int))
    studies = [one.study for one in stored]
    found = compare_runs(runs, points, studies=studies)
    with output_folder(page.parent), waiting("Writing"):
        picture = page.with_suffix(".png")
        plot_runs(runs, quantity, points[0] if points else None, component,
                  highest_hz=highest_hz, path=picture)
        report_runs(runs, page, points=points, component=component, studies=studies)
    _show_parameters(found.names, found.parameter_rows())
    show(table("", *found.names, rows=found.number_rows()))
    echo_written(page, picture)


def _beside(file: Path) -> Path:
    """Page beside a run; in the current folder of a study or a folder."""
    if file.suffix.lower() == ".toml" or file.is_dir():
        return Path(f"{file.stem or 'runs'}-compare.html")
    return file.with_name(f"{file.stem}-compare.html")


def distinct_names(paths: "Sequence[Path]") -> list[str]:
    """Short names of files, with as many of their folders as make them distinct."""
    parts = [path.resolve().with_suffix("").parts for path in paths]
    for count in range(1, max(map(len, parts)) + 1):
        names = ["/".join(one[-count:]) for one in parts]
        if len(set(names)) == len(names):
            return names
    return [f"{number}: {path}" for number, path in enumerate(paths, 1)]


def _show_parameters(names: "Sequence[str]", rows: "Sequence[Sequence[str]]") -> None:
    from fecontact.cli.tables import table

    if rows:
        show(table("parameter, in SI units", *names, rows=rows))
    else:
        echo("All parameters that the files hold are equal.")


def _compare_branches(files: "Sequence[Path]", picture: Path, trust: bool) -> None:
    from fecontact.analysis.comparison import differing_parameters
    from fecontact.cli.run_files import warn_of_changed_files
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.output.files.branches import read_branches
    from fecontact.output.files.stored_system import read_model
    from fecontact.output.plots.bifurcation_diagram import plot_branches

    names = distinct_names(files)
    read = {f"{name} {own}": branch for name, file in zip(names, files, strict=True)
            for own, branch in read_branches(file).items()}
    parameters = {branch.parameter_name for branch in read.values()}
    if len(parameters) > 1:
        raise InputError(f"the branches are over different parameters, "
                         f"{' and '.join(sorted(parameters))}; compare those over the same.")
    for file in files:
        warn_of_changed_files(file)
    differences = differing_parameters([read_model(file, trust).study for file in files])
    _show_parameters(names, [(key, *values) for key, values in differences.items()])
    with output_folder(picture.parent), waiting("Drawing"):
        plot_branches(list(read.values()), "observed_amplitude", names=list(read), path=picture)
        echo_written(picture)
