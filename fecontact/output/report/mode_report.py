"""The report of nonlinear modes: a page whose points play the motion over its period."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.units import quantity
from fecontact.output.diagrams.branches import mode_diagrams
from fecontact.output.report.diagram_page import SAMPLES, Shown, sampled, write_diagrams
from fecontact.output.report.page import require_page
from fecontact.system.contact_system import ContactSystem


def report_modes(
    modes: NonlinearMode | Sequence[NonlinearMode], system: ContactSystem, path: str | Path, *,
    observe: tuple[str | int, str] = ("B", "x"), title: str | None = None,
    study: str | None = None,
) -> Path:
    """Write nonlinear modes as one HTML file; a click on a point plays the motion over its period.

    Above the frequency, below the damping ratio over the amplitude, or the energy where nothing is
    lost; unstable motions are dashed. The deformed bodies move as in the chosen point.

    Parameters
    ----------
    modes : NonlinearMode or sequence of NonlinearMode
        Modes of the same observed displacement.
    system : ContactSystem
        System whose modes they are.
    path : str or Path
        The .html file; it is replaced if it exists.
    observe : (point, component)
        The displacement that is drawn over time.
    title : str, optional
        Heading; the name of the file by default.
    study : str, optional
        The study that described the system, as TOML text.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        Without modes, for modes of different displacements, another suffix, or a file that cannot
        be written.
    """
    require_kind("report_modes", (NonlinearMode, Sequence), modes=modes)
    given = [modes] if isinstance(modes, NonlinearMode) else list(modes)
    for mode in given:
        require_kind("report_modes", NonlinearMode, mode=mode)
    require_kind("report_modes", ContactSystem, system=system)
    if not given or len({mode.observed for mode in given}) > 1:
        raise InputError("report_modes needs at least one mode, all of the same observed "
                         "displacement.")
    path = require_page(path)
    named = _numbered(given)
    unit = "rad" if observe[1].startswith("phi") else "m"
    lossless = all(mode.conservative for mode in given)
    diagrams = mode_diagrams(given, list(named))
    point, component = observe
    shown = Shown(system.basis, system.basis.point_row(point, component),
                  f"displacement {component} of {point}", _motion,
                  ("point", "amplitude", "frequency", "damping ratio", "stability"),
                  lambda one: _texts(one, unit, lossless), alike=True)
    return write_diagrams(path, path.stem if title is None else title,
                          {name: mode.branch for name, mode in named.items()}, diagrams, shown,
                          study)


def _numbered(modes: list[NonlinearMode]) -> dict[str, NonlinearMode]:
    """Modes by their numbers, each name once."""
    found: dict[str, NonlinearMode] = {}
    for place, mode in enumerate(modes):
        name = f"mode {mode.number}"
        found[f"{name} ({place})" if name in found else name] = mode
    return found


def _motion(point: BranchPoint) -> tuple[float, Any]:
    motion = point.orbit(samples=SAMPLES)
    return sampled(motion.times, motion.states)


def _texts(point: BranchPoint, unit: str, lossless: bool) -> list[str]:
    """Texts of a motion, in the order of the columns."""
    period = float(point.values["period"])
    ratio = point.parameter * period / (4.0 * np.pi)
    stable = point.values.get("stable") if lossless else None
    return [point.kind or "motion", quantity(float(point.values["observed_amplitude"]), unit, 5),
            f"{1.0 / period:.6g} Hz", "none" if lossless else f"{ratio:.5g}",
            "" if stable is None else "stable" if stable else "unstable"]
