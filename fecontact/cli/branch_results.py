"""Results of the command ``branch``: files, tables and plots."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import (
    UNRESOLVED,
    UNRESOLVED_MEANING,
    HopfPoint,
    UnresolvedPoint,
)
from fecontact.cli.console import echo
from fecontact.core.files.atomic_write import write_text
from fecontact.core.files.csv_text import csv_text
from fecontact.output.files.branches import write_branches
from fecontact.reduction.report import beyond_basis

if TYPE_CHECKING:
    from fecontact.bifurcation.attractors.poincare_scan import PoincareScan
    from fecontact.bifurcation.diagram import Branches
    from fecontact.bifurcation.diagram_options import BranchSettings
    from fecontact.system.contact_system import ContactSystem

_BORN = {"supercritical": "stable orbits", "subcritical": "unstable orbits",
         "undecided": "orbits, stability undecided"}
_COLUMNS = ("branch", "kind", "parameter", "stable", "unstable_directions", "period",
            "frequency_hz", "minimum", "maximum", "amplitude", "criticality", "parameter_error",
            "state_error", "beyond_basis")


def write_branch_results(
    result: "Branches", wanted: "BranchSettings", folder: Path, name: str, *,
    beneath: "PoincareScan | None" = None, study: str | None = None, root: Path | None = None,
    highest_hz: float = math.inf, usable_hz: float = math.inf,
) -> list[Path]:
    """Write branches as HDF5, CSV and a page, and plot them; returns the files.

    The plot of the stability shows modes up to ``highest_hz``. Points above ``usable_hz``, the
    frequency up to which the basis is usable, are marked in the table and on the page.
    """
    from fecontact.output.plots.bifurcation_diagram import plot_branches
    from fecontact.output.plots.stability import plot_eigenvalues
    from fecontact.output.report.branch_report import report_branches
    from fecontact.study.study import with_given_keys

    files = [write_branches(folder / f"{name}-branch.h5", result.found, study=study, root=root,
                            system=result.contact_field.system())]
    table = folder / f"{name}-branch.csv"
    write_text(table, branches_csv(result.found, usable_hz))
    files.append(table)
    several = list(result.found.values())
    show = wanted.show if beneath is None else "section"
    files.append(folder / f"{name}-branch.png")
    plot_branches(
        several, f"observed_{show}", names=list(result.found), beneath=beneath,
        observe=result.observe, path=files[-1])
    files.append(report_branches(
        result.found, result.contact_field, folder / f"{name}-branch.html", observe=result.observe,
        y=f"observed_{show}", title=name, study=with_given_keys(study),
        usable_hz=usable_hz))
    if wanted.kind != "orbits":
        files.append(folder / f"{name}-stability.png")
        plot_eigenvalues(several[0], range_hz=(0.0, highest_hz), path=files[-1])
    return files


def runs_beneath(system: "ContactSystem", wanted: "BranchSettings", initial: Any) -> "PoincareScan":
    """Runs over the range of the parameter, up and down.

    Raises
    ------
    InputError
        If the system has no periodic excitation.
    """
    import numpy as np

    from fecontact.bifurcation.attractors.poincare_scan import poincare_scan

    values = np.linspace(*wanted.checked_bounds, wanted.poincare_scan)
    return poincare_scan(system, wanted.checked_parameter, values, initial=initial, progress=True)


def branches_csv(branches: Mapping[str, Branch], usable_hz: float = math.inf) -> str:
    """All points of branches as CSV, special points with their kind.

    ``beyond_basis`` is 1 for frequencies above ``usable_hz``.
    """
    rows: list[Sequence[Any]] = [_COLUMNS]
    for name, branch in branches.items():
        for point in branch.points:
            values, period = point.values, _period(point)
            rows.append([
                name, point.kind or "", repr(point.parameter), int(values["stable"]),
                int(values["unstable"]) if "unstable" in values else "",
                "" if period is None else repr(period),
                "" if period is None else repr(1.0 / period),
                *(repr(float(values[f"observed_{what}"]))
                  for what in ("minimum", "maximum", "amplitude")),
                point.criticality or "",
                "" if math.isnan(point.parameter_error) else repr(point.parameter_error),
                repr(float(values["state_error"])) if "state_error" in values else "",
                "" if period is None else int(1.0 / period > usable_hz)])
    return csv_text(rows)


def special_table(branch: Branch, usable_hz: float = math.inf) -> Any:
    """Table of ends and special points of a branch: parameter, frequency, change of stability.

    Points above ``usable_hz``, the frequency up to which the basis is usable, are marked.
    """
    from fecontact.cli.tables import table

    rows = []
    for index, point in enumerate(branch.points):
        if point.kind is None and 0 < index < len(branch) - 1:
            continue
        period = _period(point)
        beyond = beyond_basis(None if period is None else 1.0 / period, usable_hz)
        rows.append((point.kind or ("start" if index == 0 else "end"), point.parameter_text(),
                     "" if period is None else f"{1.0 / period:.5g}",
                     "; ".join(filter(None, (_remark(point), beyond)))))
    return table("point", branch.parameter_name, "frequency [Hz]", "", rows=rows)


def echo_unresolved(branches: Iterable[Branch]) -> None:
    """Say what unresolved points of branches are, if there are any."""
    if any(point.kind == UNRESOLVED for branch in branches for point in branch.points):
        echo(f"{UNRESOLVED}: {UNRESOLVED_MEANING}.")


def _period(point: BranchPoint) -> float | None:
    """Period of an orbit, or of the orbits that emerge at a Hopf point [s]."""
    if isinstance(point, HopfPoint):
        return point.period
    return float(point.values["period"]) if point.is_orbit else None


def _remark(point: BranchPoint) -> str:
    if point.kind is not None:
        return _what_changes(point)
    if point.is_torus:
        first, second = (f"{float(point.values[f'frequency_{k}']):.5g} Hz" for k in (1, 2))
        return f"{first} and {second}, {'stable' if point.values['stable'] else 'unstable'}"
    unstable = int(point.values["unstable"])
    if not unstable:
        return "stable"
    if point.is_orbit:
        return f"{unstable} unstable multiplier{'s' if unstable > 1 else ''}"
    return f"unstable in {unstable} direction{'s' if unstable > 1 else ''}"


def _what_changes(point: BranchPoint) -> str:
    """The solutions that emerge at a special point, or the change in unstable directions."""
    if isinstance(point, UnresolvedPoint):
        if point.instead_of is not None:
            return f"{point.instead_of} on this mesh, not on finer ones: take more intervals"
        return f"{point.unstable_before} to {point.unstable_after} unstable directions"
    criticality = point.criticality or ""
    return _BORN.get(criticality, "") if isinstance(point, HopfPoint) else criticality

