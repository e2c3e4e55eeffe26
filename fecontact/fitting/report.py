"""The report of a fit: a page with curves, residuals, parameters, and what the data determine."""

from collections.abc import Sequence
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.fitting.diagrams import (
    fit_diagrams,
    marginal_diagrams,
    pair_diagrams,
    profile_diagram,
)
from fecontact.fitting.posterior import Posterior
from fecontact.fitting.profile import ProfileLikelihood
from fecontact.fitting.result import Fit
from fecontact.output.report.charts import diagram_table
from fecontact.output.report.page import page_block, require_page, write_page
from fecontact.output.report.payload import Payload

_NAMED = 0.02  # least component of a combination that is written


def report_fit(
    fit: Fit, path: str | Path, *, profiles: Sequence[ProfileLikelihood] = (),
    posterior: Posterior | None = None, level: float = 0.95, title: str | None = None,
    study: str | None = None,
) -> Path:
    """Write a fit as one HTML file: curves, residuals, parameters, and what the data determine.

    It shows measured and fitted curves with bands of the model, residuals, parameters with their
    intervals, correlation, combinations of parameters by their deviations, starts, and which
    derivatives are exact; profile likelihoods and a posterior distribution where they are given.

    Parameters
    ----------
    fit : Fit
        Result of :func:`fecontact.fit`.
    path : str or Path
        The .html file; it is replaced if it exists.
    profiles : sequence of ProfileLikelihood
        Results of :func:`fecontact.fitting.profile_likelihood` for parameters of the fit.
    posterior : Posterior, optional
        Result of :func:`fecontact.fitting.posterior`.
    level : float
        Probability of intervals and bands.
    title : str, optional
        Heading; the name of the file by default.
    study : str, optional
        The study that described the fit, as TOML text.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        For profiles of parameters that the fit does not have, another suffix, or a file that cannot
        be written.
    """
    require_kind("report_fit", Fit, fit=fit)
    require_kind("report_fit", Sequence, profiles=profiles)
    require_kind("report_fit", (Posterior, NoneType), posterior=posterior)
    for one in profiles:
        require_kind("report_fit", ProfileLikelihood, profiles=one)
        _ = fit[one.name]
    if posterior is not None and posterior.names != fit.names:
        raise InputError("report_fit: the posterior distribution is of a fit of other parameters.")
    path = require_page(path)
    title, payload = path.stem if title is None else title, Payload()

    def tables(diagrams: Any) -> list[dict[str, Any]]:
        return [diagram_table(one, payload) for one in diagrams]

    notes = [*fit.notes, *(posterior.notes if posterior is not None else ())]
    converged = sum(not one.failed for one in fit.starts)
    header: dict[str, Any] = {
        "names": list(fit.names),
        "status": f"chi square {fit.chi_square:.4g} for {fit.freedom} degrees of freedom, "
                  f"{converged} of {len(fit.starts)} starts",
        "good": not notes, "notes": notes,
        **_parameters(fit, profiles, posterior, level),
        "curves": [tables(pair) for pair in fit_diagrams(fit, level)],
        "facts": [list(row) for row in _facts(fit)],
        "correlation": [[name, *(f"{value:.3f}" if np.isfinite(value) else "unknown"
                                 for value in row)]
                        for name, row in zip(fit.names, fit.correlation, strict=True)],
        "combinations": _combinations(fit),
        "profiles": [_named(one, f"{name}: rise of chi square") for one, name in zip(
            tables(map(profile_diagram, profiles)), (one.name for one in profiles), strict=True)],
        "marginals": [], "pairs": [], "sampled": [],
        "startHeadings": ["chi square", *(f"{name}, start and end" for name in fit.names),
                          "evaluations", "message"],
        "starts": [[f"{one.chi_square:.5g}" if not one.failed else "failed",
                    *(f"{a:.5g} → {b:.5g}" if not one.failed else f"{a:.5g}"
                      for a, b in zip(one.start, one.values, strict=True)),
                    f"{one.evaluations}", one.message] for one in fit.starts],
        "derivatives": [[*key.rsplit(": ", 1), kind] for key, kind in fit.derivatives.items()],
    }
    if posterior is not None:
        rows = len(posterior.names)
        marginals, pairs = marginal_diagrams(posterior, level), pair_diagrams(posterior, level)
        header |= {"marginals": [_named(one, name) for one, name in zip(
                       tables(marginals), fit.names, strict=True)],
                   "pairs": [_named(one, f"{fit.names[j]} over {fit.names[i]}") for one, (i, j) in
                             zip(tables(pairs.values()), pairs, strict=True)],
                   "sampled": [list(row) for row in posterior.summary()[rows:]
                               if row[0] != "note"]}
    return write_page(path, title, page_block(title, header, payload, study), "fit")


def _parameters(
    fit: Fit, profiles: Sequence[ProfileLikelihood], posterior: Posterior | None, level: float
) -> dict[str, Any]:
    """Rows of values and intervals: to first order, of profiles, and of the posterior."""
    part = f"{100.0 * level:g} %"
    headings = ["parameter", "value", "deviation", f"{part} of the fit"]
    rows = [[name, value, f"{fit.deviations[name]:.3g}", _range(low, high)]
            for (name, value, _, _), (low, high) in zip(
                fit.rows(level), fit.intervals(level).values(), strict=True)]
    if profiles:
        headings.append(f"{100.0 * profiles[0].level:g} % by profile likelihood")
        of = {one.name: _range(*one.interval) for one in profiles}
        rows = [[*row, of.get(row[0], "")] for row in rows]
    if posterior is not None:
        headings += ["median of the posterior", f"{part} of the posterior"]
        rows = [[*row, median, _range(*posterior.intervals(level)[row[0]])]
                for row, (_, median, _, _) in zip(rows, posterior.rows(level), strict=True)]
    return {"headings": [*headings, "range"], "parameters": [
        [*row, f"{_range(one.low, one.high)}, {one.scale}"]
        for row, one in zip(rows, fit.problem.parameters, strict=True)]}


def _named(table: dict[str, Any], title: str) -> dict[str, Any]:
    """A small chart whose title names both axes."""
    return {**table, "title": title, "unit": "", "xLabel": ""}


def _range(low: float, high: float) -> str:
    return f"{low:.5g} ... {high:.5g}".replace("-inf", "unbounded").replace("inf", "unbounded")


def _facts(fit: Fit) -> list[tuple[str, str]]:
    deviations = "stated" if fit.problem.weighted else "from the residuals"
    return [("data", ", ".join(f"{one.title} ({len(one.measured)} values)" for one in fit.data)),
            ("deviations", deviations), ("loss", fit.options.loss),
            ("evaluations", f"{sum(one.evaluations for one in fit.starts)}"),
            ("not determined", "; ".join(fit.not_found) or "none"),
            ("on bounds", ", ".join(fit.on_bounds) or "none"),
            ("contacts change at", ", ".join(fit.kinks) or "none")]


def _combinations(fit: Fit) -> list[list[str]]:
    """Deviations of combinations of parameters in parts of their ranges, and their components."""
    found = []
    for value, direction in zip(fit.singular_values, fit.directions, strict=True):
        parts = sorted(zip(direction.tolist(), fit.names, strict=True),
                       key=lambda one: -abs(one[0]))
        found.append([f"{1.0 / value:.3g}" if value > 0.0 else "unbounded",
                      ", ".join(f"{part:+.2f} {name}" for part, name in parts
                                if abs(part) > _NAMED)])
    return found
