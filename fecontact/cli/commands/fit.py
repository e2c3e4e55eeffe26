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
        help="Processes that evaluate the model.")] = 1,
    posterior: Annotated[int | None, Parameter(
        help="Sample the posterior distribution by this number of steps, in place of those of "
             "[fit.posterior]; a larger number goes on.")] = None,
) -> int:
    """Fit the parameters of [fit] of a study to its measurements; write a page with curves,
    residuals and intervals (fit.html), numbers (fit.json) and pictures (fit.png, posterior.png).

    Ctrl-C stops the fit; the same command continues it.
    """
    from dataclasses import replace

    from fecontact.cli.run_files import read_study
    from fecontact.cli.tables import table
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.fitting.from_study import fit_study, settings_of
    from fecontact.fitting.plots import plot_fit, plot_posterior
    from fecontact.fitting.posterior import posterior as sampled
    from fecontact.fitting.profile import profile_likelihood
    from fecontact.fitting.report import report_fit
    from fecontact.output.report.page import require_own_page
    from fecontact.study.fit_section import PosteriorSettings
    from fecontact.study.study import with_given_keys
    from fecontact.sweeps.store import write_whole

    described = read_study(study, set_)
    settings = settings_of(described)
    if posterior is not None:
        settings = replace(settings, posterior=replace(
            settings.posterior or PosteriorSettings(seed=settings.seed), steps=posterior))
    folder = output or described.results / f"{described.name}-fit"
    if not overwrite:
        require_own_page(folder / "fit.html")
    with waiting("Compiling, once after an installation"):
        pass
    with output_folder(folder):
        try:
            found = fit_study(described, workers=workers, folder=folder, overwrite=overwrite,
                              progress=True)
            profiles = [profile_likelihood(found, name, points=settings.profile,
                                           workers=workers, folder=folder)
                        for name in found.names if settings.profile]
            chains = None if settings.posterior is None else sampled(
                found, **vars(settings.posterior), workers=workers, folder=folder,
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
        if profiles:
            show(table("profile likelihood, in SI units", "95 % from", "to", rows=[
                (one.name, *(f"{end:.5g}" for end in one.interval)) for one in profiles]))
            results["profiles"] = [one.table() for one in profiles]
        if chains is not None:
            show(table("posterior, in SI units", "median", "95 % from", "to", rows=chains.rows()))
            echo(f"{chains.effective:.0f} independent samples, acceptance {chains.acceptance:.2f}")
            results["posterior"] = chains.table()
        written = [folder / name for name in ("fit.html", "fit.json", "fit.png")]
        with waiting("Writing"):
            page, numbers, picture = written
            report_fit(found, page, profiles=profiles, posterior=chains, title=described.name,
                       study=with_given_keys(described.to_toml()))
            write_whole(numbers, json.dumps(results, indent=1) + "\n")
            plot_fit(found, path=picture)
            if chains is not None:
                written.append(folder / "posterior.png")
                plot_posterior(chains, path=written[-1])
        echo_written(*written)
    return 0
