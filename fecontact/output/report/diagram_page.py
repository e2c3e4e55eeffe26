"""Pages with diagrams over a parameter, whose points show their motion."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import HopfPoint
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.core.units import count, suitable_unit
from fecontact.output.diagrams.colours import distinct_colours
from fecontact.output.diagrams.diagram import Diagram
from fecontact.output.render.frames_data import visible_scale
from fecontact.output.report.bodies import Motions, bodies_table
from fecontact.output.report.charts import diagram_table
from fecontact.output.report.drawing import drawn_bodies
from fecontact.output.report.page import page_block, write_page
from fecontact.output.report.payload import SMALLEST, Payload
from fecontact.output.report.run_report import colour_maps
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.report import beyond_basis

SAMPLES = 129  # of a motion, both ends included
_ORBITS = 240  # of all branches together
_ORBITS_RUN = 60  # by shooting, which are run again
_STEP = 1e-4  # of motions, of their largest value
_HEIGHTS = {1: (440,), 2: (330, 190)}  # of diagrams above each other [pixels]

Motion = tuple[float, Array]  # period [s], and states (SAMPLES, d) at equal distances in time


@dataclass(frozen=True, eq=False)
class Shown:
    """Data and functions that show a chosen point.

    Attributes
    ----------
    basis : ModalBasis
    row : (m,) array
        Row of the displacement that is drawn over time.
    observed : str
        Name of this displacement.
    motion : callable
        The motion of a point.
    columns : tuple of str
        Headings of the texts of a point.
    texts : callable
        Texts of a point, in the same order.
    alike : bool
        Whether all motions are magnified to the same size, as shapes of modes are.
    """

    basis: ModalBasis
    row: Array
    observed: str
    motion: Callable[[BranchPoint], Motion]
    columns: tuple[str, ...]
    texts: Callable[[BranchPoint], list[str]]
    alike: bool = False


def write_diagrams(
    path: Path, title: str, named: Mapping[str, Branch], diagrams: Sequence[Diagram], shown: Shown,
    study: str | None = None,
) -> Path:
    """Write a page with diagrams above each other; a click on a point of one shows its motion.

    Raises
    ------
    InputError
        If there is no branch, or one without points.
    """
    if not named or not all(len(branch) for branch in named.values()):
        raise InputError("A report needs branches with at least one point each.")
    payload, kept = Payload(), _kept(named)
    motions = [shown.motion(named[name].points[index]) for name, index in kept]
    header: dict[str, Any] = {
        "status": _status(named),
        "good": all(branch.status.name != "STALLED" for branch in named.values()),
        "notes": [f"{name}: {branch.message}" for name, branch in named.items() if branch.message],
        "diagrams": _diagram_tables(list(named), diagrams, payload),
        "columns": shown.columns,
        "branches": _branch_tables(named, kept, shown.texts),
        "samples": SAMPLES,
        "observed": shown.observed,
        "contact": None, "ground": None,
    }
    header["orbits"], q = _orbit_tables(motions, shown.row, payload)
    if shown.basis.mode_shapes is not None:
        q = shown.basis.mode_shapes.stress_coordinates(q)
        seen = Motions(drawn_bodies(shown.basis), q)
        scale = visible_scale(seen.bodies.extent, seen.ranges.largest_displacement)
        header |= {"bodies": bodies_table(seen, payload), "scale": scale, "maps": colour_maps(),
                   "box": seen.ranges.box(scale).T.ravel().tolist()}
        if shown.alike:
            header["orbits"]["scales"] = _scales(seen, len(motions))
        header["orbits"]["coordinates"] = payload.add(q, seen.coordinate_steps())
    return write_page(path, title, page_block(title, header, payload, study, (
        "branch", "response")), "branches")


def _scales(seen: Motions, count: int) -> list[float]:
    """Factor of each of the motions, with which its largest is as well visible."""
    return [visible_scale(seen.bodies.extent, Motions(seen.bodies, q).ranges.largest_displacement)
            for q in np.split(seen.coordinates, count)]


def _status(named: Mapping[str, Branch]) -> str:
    """Reasons for the ends of the branches: one sentence where all are equal."""
    ends = {branch.end for branch in named.values()}
    if len(ends) == 1 and len(named) > 1:
        return f"All branches: {ends.pop()}"
    return "; ".join(f"{name}: {branch.end.removesuffix('.')}"
                     for name, branch in named.items()) + "."


def sampled(times: Array, states: Array) -> Motion:
    """A motion over one period in the samples of a page."""
    period = float(times[-1] - times[0])
    at = times[0] + period * np.linspace(0.0, 1.0, SAMPLES)
    return period, np.column_stack([np.interp(at, times, one) for one in states.T])


def _kept(named: Mapping[str, Branch]) -> list[tuple[str, int]]:
    """Names of branches and indices of points whose orbits are stored."""
    found, total = [], sum(map(len, named.values()))
    for name, branch in named.items():
        run = any(point.is_orbit and not point.stores_orbit for point in branch.points)
        most = _ORBITS_RUN if run else _ORBITS
        count = min(len(branch), max(2, most * len(branch) // total))
        chosen = set(np.linspace(0, len(branch) - 1, count).astype(int).tolist())
        chosen |= {index for index, point in enumerate(branch.points) if point.kind is not None}
        found += [(name, index) for index in sorted(chosen)]
    return found


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


def _diagram_tables(
    names: list[str], diagrams: Sequence[Diagram], payload: Payload
) -> list[dict[str, Any]]:
    """Diagrams above each other over one abscissa; each line has the number of its branch."""
    tables = [diagram_table(one, payload) | {"height": height}
              for one, height in zip(diagrams, _HEIGHTS[len(diagrams)], strict=True)]
    for table in tables[:-1]:
        table["xLabel"] = ""
    for line in (line for table in tables for line in table["lines"]):
        line["branch"] = names.index(line["name"]) if line["name"] else 0
    return tables


def _branch_tables(
    named: Mapping[str, Branch], kept: list[tuple[str, int]],
    texts: Callable[[BranchPoint], list[str]],
) -> list[dict[str, Any]]:
    places = {place: number for number, place in enumerate(kept)}
    found = []
    for (name, branch), colour in zip(named.items(), distinct_colours(len(named)), strict=True):
        indices = [index for other, index in kept if other == name]
        found.append({"name": name, "colour": colour, "kept": indices,
                      "first": places[name, indices[0]],
                      "rows": [texts(branch.points[index]) for index in indices]})
    return found


def point_texts(point: BranchPoint, usable_hz: float = np.inf) -> list[str]:
    """Texts of a point of a branch: kind, parameter, period, frequency, stability, note.

    The note marks frequencies above ``usable_hz``.
    """
    period = point.period if isinstance(point, HopfPoint) else point.values.get("period")
    hertz = None if period is None else 1.0 / float(period)
    unstable = point.values.get("unstable")
    kind = point.kind or ("orbit" if point.is_orbit else "torus" if point.is_torus
                          else "steady sliding")
    return [kind + (f", {point.criticality}" if point.criticality else ""),
            point.parameter_text(), "" if hertz is None else f"{1.0 / hertz:.6g} s",
            "" if hertz is None else f"{hertz:.6g} Hz",
            "" if unstable is None
            else count(int(unstable), "unstable direction") if unstable else "stable",
            beyond_basis(hertz, usable_hz)]
