"""The command ``preload``: quasi-static loading of a study."""

from typing import Annotated

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, fail, show
from fecontact.cli.options import Changes, Folder, StudyFile


def preload(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Folder = None,
    modes: Annotated[bool, Parameter(negative=(), help=(
        "Print frequency and damping of the modes at the end of the path too."))] = False,
) -> int:
    """Load a study along the path of [preload]; write a table and plots of shear and force loop."""
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study, write_preload
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.system.quasistatic.prestressed_modes import prestressed_modes

    described = read_study(study, set_)
    with output_folder(output or described.results) as folder:
        with waiting("Loading the body"):
            history = described.load_history()
        files = write_preload(described, history, folder)
        show(table("", "", rows=history.summary()))
        if modes:
            found = prestressed_modes(described.system(), history)
            show(table("mode", "frequency [Hz]", "damping ratio", rows=(
                (str(number), f"{frequency:.6g}", f"{ratio:.3g}")
                for number, (frequency, ratio) in enumerate(
                    zip(found.frequencies_hz, found.damping_ratios, strict=True)))))
        if history.statistics["jumps"]:
            echo(f"note: the body jumps {history.statistics['jumps']} times along the path.")
        echo_written(*files)
    if history.status != "finished":
        return fail("the path of loads has no equilibrium beyond the points that are written; "
                    "lower the loads of [preload], or add a support.", 1)
    return 0
