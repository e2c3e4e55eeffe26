"""The report of branches: a page with a diagram whose points show their orbit."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.points import BranchPoint, HopfPoint
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.checks import as_path, require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.core.units import UNITS, count, round_125, suitable_unit
from fecontact.output.files.case import library_versions
from fecontact.output.plots.bifurcation_diagram import LETTERS, stable_pieces
from fecontact.output.plots.parameter_labels import parameter_label
from fecontact.output.plots.style import distinct_colours
from fecontact.output.report.bodies import Motions, bodies_table
from fecontact.output.report.drawing import drawn_bodies
from fecontact.output.report.page import write_page
from fecontact.output.report.payload import SMALLEST, Payload
from fecontact.output.report.run_report import colour_maps, require_page, study_tables

_SAMPLES = 129  # of an orbit, both ends included
_ORBITS = 240  # of all branches together
_ORBITS_RUN = 60  # by shooting, which are run again
_STEP = 1e-4  # of curves, of their largest value
_VISIBLE = 0.1  # largest motion drawn, as a part of the bodies' extent


def report_branches(
    branches: Branch | Mapping[str, Branch], field: ContactField, path: str | Path, *,
    y: str = "observed_maximum", observe: tuple[str | int, Literal["x", "y", "z"]] = ("B", "x"),
    title: str | None = None, study: str | None = None,
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
        That of the branches.
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
    path = require_page(as_path(path, "a report"))
    named = {"branch": branches} if isinstance(branches, Branch) else dict(branches)
    for name, branch in named.items():
        require_kind("report_branches", Branch, **{name: branch})
    if not named or not all(len(branch) for branch in named.values()):
        raise InputError("report_branches needs branches with at least one point each.")
    payload, title = Payload(), path.stem if title is None else title
    kept = _kept(named)
    motions = [_orbit(named[name].points[index], field) for name, index in kept]
    point, component = observe
    # Only what is observed has a unit that is known here.
    largest = max(float(np.abs(np.asarray(one.column(y))).max()) for one in named.values())
    factor, symbol = suitable_unit(largest, "m") if y.startswith("observed") else (1.0, "")
    header: dict[str, Any] = {
        "format": 1, "title": title, "units": UNITS,
        "status": "; ".join(f"{name}: {branch.status.value.removesuffix('.')}"
                            for name, branch in named.items()) + ".",
        "good": all(branch.status.name != "STALLED" for branch in named.values()),
        "notes": [f"{name}: {branch.message}" for name, branch in named.items() if branch.message],
        "xLabel": parameter_label(next(iter(named.values())).parameter_name),
        "yLabel": y.replace("_", " ").replace("observed", f"displacement {component} of {point},")
                  + f" [{symbol}]" * bool(symbol),
        "columns": ["point", "parameter", "period", "frequency", "stability"],
        "branches": _branch_tables(named, y, factor, kept, payload),
        "samples": _SAMPLES,
        "observed": f"displacement {component} of {point}",
        "study": study_tables(study),
        "versions": list(map(list, library_versions().items())),
        "contact": None, "ground": None,
    }
    basis = field.system().basis
    row = field.displacement_row(point, component)[: basis.modes]
    header["orbits"], q = _orbit_tables(motions, row, payload)
    if basis.mode_shapes is not None:
        seen = Motions(drawn_bodies(basis), q)
        largest = seen.largest_displacement
        scale = max(1.0, round_125(_VISIBLE * seen.bodies.extent / largest)) if largest else 1.0
        header |= {"bodies": bodies_table(seen, payload), "scale": scale, "maps": colour_maps(),
                   "box": seen.box(scale)}
        header["orbits"]["coordinates"] = payload.add(q, seen.coordinate_steps())
    return write_page(path, title, payload.block(header), "branches")


def _kept(named: Mapping[str, Branch]) -> list[tuple[str, int]]:
    """Names of branches and indices of points whose orbits are stored."""
    found, total = [], sum(map(len, named.values()))
    for name, branch in named.items():
        most = _ORBITS_RUN if any(point.by_shooting for point in branch.points) else _ORBITS
        count = min(len(branch), max(2, most * len(branch) // total))
        chosen = set(np.linspace(0, len(branch) - 1, count).astype(int).tolist())
        chosen |= {index for index, point in enumerate(branch.points) if point.kind is not None}
        found += [(name, index) for index in sorted(chosen)]
    return found


def _orbit(point: BranchPoint, field: ContactField) -> tuple[float, Array]:
    """Period [s] and states (k, d) of a point at equal distances in time.

    An equilibrium has the period zero and two equal states.
    """
    if not point.is_orbit:
        return 0.0, np.repeat(np.asarray(point.values["state"], dtype=float)[None], _SAMPLES, 0)
    motion = point.orbit(field if point.by_shooting else None, _SAMPLES)
    period = float(motion.times[-1] - motion.times[0])
    times = motion.times[0] + period * np.linspace(0.0, 1.0, _SAMPLES)
    return period, np.column_stack([np.interp(times, motion.times, one) for one in motion.states.T])


def _orbit_tables(
    motions: list[tuple[float, Array]], row: Array, payload: Payload
) -> tuple[dict[str, Any], Array]:
    """Curves of all orbits, one after the other, and their modal coordinates (O k, m)."""
    m = len(row)
    states = np.concatenate([one for _, one in motions])
    moved = {"displacement": (states[:, :m] @ row, "m"),
             "velocity": (states[:, m : 2 * m] @ row, "m/s")}
    found: dict[str, Any] = {"units": []}
    for name, (values, unit) in moved.items():
        largest = float(np.abs(values).max())
        factor, symbol = suitable_unit(largest, unit)
        found[name] = payload.add(values / factor, max(_STEP * largest / factor, SMALLEST))
        found["units"].append(symbol)
    # Equilibria last a second, so that time has a length.
    periods = np.array([period or 1.0 for period, _ in motions])
    found["periods"] = payload.add(periods, 1e-9 * float(periods.min()))
    return found, states[:, :m]


def _branch_tables(
    named: Mapping[str, Branch], y: str, factor: float, kept: list[tuple[str, int]],
    payload: Payload,
) -> list[dict[str, Any]]:
    places = {place: number for number, place in enumerate(kept)}
    found = []
    for (name, branch), colour in zip(named.items(), distinct_colours(len(named)), strict=True):
        heights = np.asarray(branch.column(y), dtype=float).reshape(len(branch), -1) / factor
        indices = [index for other, index in kept if other == name]
        size = max(float(np.ptp(branch.parameter)), 1e-6 * float(np.abs(branch.parameter).max()))
        found.append({
            "name": name, "colour": colour,
            "x": payload.add(branch.parameter, max(1e-6 * size, SMALLEST)),
            "y": payload.add(heights, max(1e-5 * float(np.abs(heights).max()), SMALLEST)),
            "stable": payload.add(np.append(stable_pieces(branch), True)),
            "special": [[index, LETTERS.get(point.kind, point.kind)]
                        for index, point in enumerate(branch.points) if point.kind is not None],
            "kept": indices, "first": places[name, indices[0]],
            "rows": [_texts(branch.points[index]) for index in indices],
        })
    return found


def _texts(point: BranchPoint) -> list[str]:
    """What is told of a point, in the order of the columns."""
    period = point.period if isinstance(point, HopfPoint) else point.values.get("period")
    unstable = int(point.values.get("unstable", 0))
    kind = point.kind or ("orbit" if point.is_orbit else "steady sliding")
    return [kind + (f", {point.criticality}" if point.criticality else ""),
            f"{point.parameter:.7g}", "" if period is None else f"{float(period):.6g} s",
            "" if period is None else f"{1.0 / float(period):.6g} Hz",
            count(unstable, "unstable direction") if unstable else "stable"]
