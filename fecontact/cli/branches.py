"""The command ``branch``: steady sliding of a study over a parameter."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from fecontact.cli.options import Changes, Folder, StudyFile
from fecontact.cli.printing import say, say_written, show
from fecontact.errors import InputError

if TYPE_CHECKING:
    from fecontact.bifurcation.branch import Branch


def branch(
    study: StudyFile,
    parameter: Annotated[str, Parameter(help="Dotted name of a number, `ground.speed`.")],
    /,
    *,
    start: Annotated[float, Parameter(name="--from", help="Value at which it begins.")],
    end: Annotated[float, Parameter(name="--to", help="Value at which it ends.")],
    set_: Changes = None,
    output: Folder = None,
) -> int:
    """Follow steady sliding over a parameter: where it loses stability, and in which mode.

    Writes the branch (NAME-branch.h5) and a plot of frequencies and growth rates of all modes.
    """
    from fecontact.console import INTERRUPTED, output_folder, waiting
    from fecontact.results import read_study

    if start == end:
        raise InputError(f"--from and --to are both {start:g}; give the two ends of a range.")
    described = read_study(study, set_)
    from fecontact.bifurcation.contact_field import contact_field
    from fecontact.bifurcation.equilibrium_branch import equilibrium_branch
    from fecontact.output.stability_plots import plot_eigenvalues

    with output_folder(output or described.results) as folder:
        with waiting("Computing modes"):
            field = contact_field(described.system(), {parameter: start})
        found = equilibrium_branch(field, parameter, bounds=(min(start, end), max(start, end)),
                                   direction=end - start)
        files = [found.save(folder / f"{described.name}-branch.h5")]
        picture = folder / f"{described.name}-branch.png"
        files.append(plot_eigenvalues(found, picture))
        show(branch_table(found))
        say(found.status.value)
        if found.message:
            say(f"The last step failed: {found.message}")
        say_written(*map(Path, files))
    if found.status.name == "INTERRUPTED":
        return INTERRUPTED
    return 1 if found.status.name == "STALLED" else 0


def branch_table(found: "Branch") -> Any:
    """Ends and special points of a branch of equilibria: where, and what changes there."""
    from fecontact.report import count, table

    born = {"supercritical": "stable orbits", "subcritical": "unstable orbits",
            "undecided": "orbits"}
    rows = []
    for index, point in enumerate(found.points):
        if point.kind is None and 0 < index < len(found) - 1:
            continue
        hertz, unstable = point.details.get("frequency_hz"), point.values["unstable"]
        rows.append((
            point.kind or ("start" if index == 0 else "end"),
            f"{point.parameter:.7g}",
            "" if hertz is None else f"{hertz:.5g}",
            born.get(point.details.get("criticality", ""), "") if point.kind else
            (f"unstable in {count(unstable, 'direction')}" if unstable else "stable")))
    return table("point", found.name, "frequency [Hz]", "", rows=rows)
