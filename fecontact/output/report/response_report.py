"""The report of a frequency response: a page with amplitude and phase whose points show orbits."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.fields.contact_field import contact_field
from fecontact.bifurcation.harmonic.response import FrequencyResponse
from fecontact.core.checks import require_kind
from fecontact.core.units import quantity
from fecontact.output.diagrams.branches import level_texts, response_diagrams
from fecontact.output.report.branch_report import COLUMNS, shown_of
from fecontact.output.report.diagram_page import point_texts, write_diagrams
from fecontact.output.report.page import require_page
from fecontact.system.contact_system import ContactSystem


def report_response(
    response: FrequencyResponse, system: ContactSystem, path: str | Path, *,
    observe: tuple[str | int, str] = ("B", "x"), title: str | None = None,
    study: str | None = None, usable_hz: float = np.inf,
) -> Path:
    """Write a frequency response as one HTML file; a click on a point plays its orbit.

    Above the amplitude, below the phase of the first harmonic against a sine drive, a colour for
    each level; unstable parts are dashed. The orbit is played by the deformed bodies and drawn
    over time and in the phase plane.

    Parameters
    ----------
    response : FrequencyResponse
        Frequency response of a contact system.
    system : ContactSystem
        System of the response.
    path : str or Path
        The .html file; it is replaced if it exists.
    observe : (point, component)
        The displacement whose orbits are drawn.
    title : str, optional
        Heading; the name of the file by default.
    study : str, optional
        The study that described the system, as TOML text.
    usable_hz : float
        Frequency up to which the basis is usable [Hz]; a note marks points beyond.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        For a response of another system, another suffix, or a file that cannot be written.
    """
    require_kind("report_response", FrequencyResponse, response=response)
    require_kind("report_response", ContactSystem, system=system)
    path = require_page(path)
    names = [*response.branches[0].parameter_names,
             *([response.level_name] if response.level_name and not response.force_name else [])]
    field = contact_field(system, dict.fromkeys(names))
    heading, levels = level_texts(response)
    named = {f"{heading} {text}".strip() or "response": branch
             for text, branch in zip(levels, response.branches, strict=True)}
    unit = "rad" if observe[1].startswith("phi") else "m"
    diagrams = response_diagrams(response, usable_hz=usable_hz)
    shown = shown_of(field, observe)

    def texts(point: BranchPoint) -> list[str]:
        size = quantity(float(point.values["observed_amplitude"]), unit, 5)
        error = [f"{float(point.values['truncation_error']):.1e}"] if balanced else []
        return [*point_texts(point, usable_hz), size, *error]

    # Truncation is the error of harmonic balance alone.
    balanced = all("truncation_error" in branch.points[0].values for branch in response.branches)
    shown = replace(shown, columns=(*COLUMNS, "amplitude", *["truncation error"] * balanced),
                    texts=texts)
    return write_diagrams(path, path.stem if title is None else title, named, diagrams, shown,
                          study)
