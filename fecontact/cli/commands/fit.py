"""The command ``fit``: parameters of a study from measurements."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, note, show, waiting
from fecontact.cli.options import Changes, StudyFile


def fit(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="Folder of the fit, instead of NAME-fit among the results of "
                                      "the study.")] = None,
    overwrite: Annotated[bool, Parameter(
        negative=(), help="Begin anew; otherwise a fit that was cancelled goes on.")] = False,
    workers: Annotated[int | None, Parameter(
        help="Processes for the starts and walkers.")] = 1,
    posterior: Annotated[int | None, Parameter(
        help="Sample the posterior distribution by this number of steps of emcee too; a larger "
             "number goes on.")] = None,
) -> int:
    """Fit the parameters of [fit] of a study to its measurements; write intervals (fit.json)
    and a picture (fit.png).

    Ctrl-C stops the fit; the same command continues it.
    """
    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.fitting.from_study import fit_study, settings_of
    from fecontact.fitting.plots import plot_fit
    from fecontact.fitting.posterior import posterior as sampled
    from fecontact.sweeps.store import write_whole

    described = read_study(study, set_)
    settings = settings_of(described)
    folder = output or described.results / f"{described.name}-fit"
    with waiting("Compiling, once after an installation"):
        pass
    with output_folder(folder):
        try:
            found = fit_study(described, workers=workers, folder=folder, overwrite=overwrite,
                              progress=True)
            chains = None if posterior is None else sampled(
                found, steps=posterior, seed=settings.seed, workers=workers, folder=folder,
                overwrite=overwrite, progress=True)
        except KeyboardInterrupt:
            note(f"What was evaluated is kept in {folder}; the same command goes on.")
            raise
        show(table("parameter, in SI units", "value", "95 % from", "to", rows=found.rows()))
        echo(f"chi square {found.chi_square:.4g} for {found.freedom} degrees of freedom, "
             f"{sum(one.evaluations for one in found.starts)} evaluations of the model")
        for one in found.notes:
            note(f"note: {one}")
        results = found.table()
        if chains is not None:
            show(table("posterior, in SI units", "median", "95 % from", "to", rows=chains.rows()))
            echo(f"{chains.effective:.0f} independent samples, acceptance {chains.acceptance:.2f}")
            results["posterior"] = chains.table()
        with waiting("Writing"):
            result, picture = folder / "fit.json", folder / "fit.png"
            write_whole(result, json.dumps(results, indent=1) + "\n")
            plot_fit(found, path=picture)
        echo_written(result, picture)
    return 0
