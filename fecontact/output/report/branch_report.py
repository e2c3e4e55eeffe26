"""The report of branches: a page with a diagram whose points show their orbit."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.tori.motion import torus_motion
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.output.diagrams.branches import branch_diagram
from fecontact.output.report.diagram_page import (
    SAMPLES,
    Motion,
    Shown,
    point_texts,
    sampled,
    write_diagrams,
)
from fecontact.output.report.page import require_page

COLUMNS = ("point", "parameter", "period", "frequency", "stability", "note")


def report_branches(
    branches: Branch | Mapping[str, Branch], field: ContactField, path: str | Path, *,
    y: str = "observed_maximum", observe: tuple[str | int, Literal["x", "y", "z"]] = ("B", "x"),
    title: str | None = None, study: str | None = None, usable_hz: float = np.inf,
) -> Path:
    """Write branches as one HTML file with a diagram; a click on a point shows its orbit.

    The orbit is played by the deformed bodies and drawn over time and in the phase plane, beside
    the parameter, period, frequency and stability of the point. Long branches store the orbits of
    points along them, special ones among these; a click takes the nearest of them.

    Parameters
    ----------
    branches : Branch or mapping of name to Branch
        Branches of equilibria or orbits over the same parameter; see
        :func:`fecontact.bifurcation.observe`.
    field : ContactField
        Field of the branches.
    path : str or Path
        The .html file; it is replaced if it exists.
    y : str
        The stored number to draw.
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
        For no branch or an empty one, a value that is not stored, another suffix, or a file that
        cannot be written.
    """
    require_kind("report_branches", (Branch, Mapping), branches=branches)
    require_kind("report_branches", ContactField, field=field)
    path = require_page(path)
    named = {"branch": branches} if isinstance(branches, Branch) else dict(branches)
    for name, branch in named.items():
        require_kind("report_branches", Branch, **{name: branch})
    if not named or not all(len(branch) for branch in named.values()):
        raise InputError("report_branches needs branches with at least one point each.")
    title = path.stem if title is None else title
    diagram = branch_diagram(list(named.values()), list(named), y)
    return write_diagrams(path, title, named, [diagram], shown_of(field, observe, usable_hz),
                          study)


def shown_of(
    field: ContactField, observe: tuple[str | int, str], usable_hz: float = np.inf
) -> Shown:
    """Texts, coordinates and motions that a page shows of points on branches of a field."""
    basis, (point, component) = field.system().basis, observe
    row = field.displacement_row(point, component)[: basis.modes]
    return Shown(basis, row, f"displacement {component} of {point}",
                 lambda one: _orbit(one, field), COLUMNS,
                 lambda one: point_texts(one, usable_hz))


def _orbit(point: BranchPoint, field: ContactField) -> Motion:
    """The orbit of a point; an equilibrium has the period zero and equal states.

    A torus shows the longer of its two periods, after which it does not repeat.
    """
    if point.is_torus:
        torus = torus_motion(point)
        times = np.linspace(0.0, 1.0 / torus.frequencies.min(), SAMPLES)
        return sampled(times, torus.states(times))
    if not point.is_orbit:
        return 0.0, np.repeat(np.asarray(point.values["state"], dtype=float)[None], SAMPLES, 0)
    motion = point.orbit(None if point.stores_orbit else field, SAMPLES)
    return sampled(motion.times, motion.states)
