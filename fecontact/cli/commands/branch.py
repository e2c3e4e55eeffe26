"""The command ``branch``: steady sliding and periodic orbits of a study over a parameter."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, fail, show
from fecontact.cli.options import All, Changes, Folder, StudyFile

if TYPE_CHECKING:
    from fecontact.bifurcation.diagram_options import BranchSettings


def branch(
    study: StudyFile,
    parameter: Annotated[str | None, Parameter(
        help="Continuation parameter, such as ground.speed; overrides [branch].")] = None,
    /,
    *,
    bounds: Annotated[tuple[float, float] | None, Parameter(
        help="Lower and upper bound of the parameter; overrides [branch].")] = None,
    start: Annotated[float | None, Parameter(
        help="Starting value; the lower bound by default.")] = None,
    set_: Changes = None,
    output: Folder = None,
    all_: All = False,
) -> int:
    """Follow steady sliding or periodic orbits over a parameter: a bifurcation diagram.

    The section [branch] of the study selects the solutions; without it, steady sliding is
    followed. Writes all branches (NAME-branch.h5, NAME-branch.csv), a page with a diagram, in which
    a click on a point plays its orbit (NAME-branch.html), and plots: the diagram, and frequencies
    and growth rates of the modes in steady sliding. Modes above the highest frequency at which the
    basis is accurate are left out; special points there are marked. Ctrl-C stops the command; the
    points computed so far are written.
    """
    import numpy as np

    from fecontact.cli.console import INTERRUPTED, waiting
    from fecontact.cli.run_files import read_study, tell_replaced
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.core.progress import titled_bar
    from fecontact.core.tables import located

    described = read_study(study, set_)
    wanted = _wanted(described.branch, parameter, bounds, start)
    with located(f"{described.title}:"):
        _ = wanted.checked_parameter, wanted.checked_bounds
    from fecontact.bifurcation.diagram import follow_branches
    from fecontact.cli.branch_results import (
        echo_unresolved,
        runs_beneath,
        special_table,
        write_branch_results,
    )

    described.require_no_sector("`fecontact response` computes its waves")
    with output_folder(output or described.results) as folder:
        tell_replaced(described, folder / f"{described.name}-branch.h5", set_)
        with waiting("Computing modes"):
            system, usable = described.system(), described.usable_hz
        with titled_bar() as progress:
            result = follow_branches(system, wanted, described.initial(), progress)
        beneath = None
        if wanted.poincare_scan and not result.interrupted:
            beneath = runs_beneath(system, wanted, described.initial())
        with waiting("Writing"):
            files = write_branch_results(
                result, wanted, folder, described.name, beneath=beneath, study=described.to_toml(),
                root=described.folder, highest_hz=np.inf if all_ else usable, usable_hz=usable)
        for name, found in result.found.items():
            echo(f"\n{name}: {found.end}")
            if found.message:
                echo(f"note: {found.message}")
            show(special_table(found, usable))
            echo_unresolved([found])
        for note in result.notes:
            echo(f"note: {note}")
        echo_written(*map(Path, files))
    if result.interrupted:
        return INTERRUPTED
    stalled = [name for name, found in result.found.items() if found.status.name == "STALLED"]
    if stalled:
        return fail(f"{', '.join(stalled)}: the steps became too small to go on; what was "
                    f"computed is written.", 1)
    return 1 if result.notes else 0


def _wanted(
    given: "BranchSettings", parameter: str | None, bounds: tuple[float, float] | None,
    start: float | None,
) -> "BranchSettings":
    """The section [branch] with the options of the command line."""
    changed = given if parameter is None else replace(given, parameter=parameter)
    if bounds is not None:
        changed = replace(changed, bounds=bounds, start=None)
    return changed if start is None else replace(changed, start=start)
