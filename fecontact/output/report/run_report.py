"""The report of a run: one HTML page to play, read and send."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np

from fecontact.analysis.histories import Point
from fecontact.analysis.key_numbers import key_numbers
from fecontact.analysis.run_facts import notes, run_facts
from fecontact.analysis.sampling import alias_message
from fecontact.core.checks import require_kind, require_scale
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.output.files.frames import LARGEST_DRAWN, drawable
from fecontact.output.render.frames_data import Motion, visible_scale
from fecontact.output.render.scene import COLOUR_MAPS
from fecontact.output.report.bodies import PRESSURE, STATE, Motions, bodies_table
from fecontact.output.report.charts import chart_tables, energy_charts, spectrum_tables
from fecontact.output.report.contact import contact_of_run, ground_table, state_colours
from fecontact.output.report.drawing import drawn_bodies
from fecontact.output.report.page import page_block, require_page, write_page
from fecontact.output.report.payload import Payload

_SHADES = 64  # of a colour map


def report(
    run: Trajectory, path: str | Path, *, title: str | None = None, study: str | None = None,
    points: Sequence[Point] = (), scale: float | None = None,
    versions: Mapping[str, str] | None = None,
) -> Path:
    """Write a run as one HTML file that opens in any browser, without a network.

    It plays the deformed bodies with stress, contact states and forces at all output times, shakes
    their modes, and shows linked histories, phase portraits, contact maps and energies, the study,
    warnings and versions. Displacements, stresses and forces are shown to within 1e-4 of their
    largest values. A basis without shapes over the body gives a report without bodies.

    Parameters
    ----------
    run : Trajectory
        The run; ``run.between(t_start, t_end)`` for a part of it.
    path : str or Path
        The .html file; it is replaced if it exists.
    title : str, optional
        Heading; the name of the file by default.
    study : str, optional
        The study that described the run, as TOML text.
    points : sequence of str, int or (x, y)
        Points of histories and phase portraits, as for :func:`fecontact.plot.plot_history`.
    scale : float, optional
        Magnification of displacements to begin with; one that makes them visible by default.
    versions : mapping, optional
        Versions of the programs that computed the run; those installed by default.

    Returns
    -------
    Path
        The file, written whole or not at all.

    Raises
    ------
    InputError
        For another suffix, a point that does not exist, or a file that cannot be written.

    Warns
    -----
    ModelWarning
        For a file above 20 MB.
    """
    require_kind("report", Trajectory, run=run)
    path = require_page(path)
    title = path.stem if title is None else title
    return write_page(path, title, run_block(run, title, study, points, scale, versions))


def run_block(
    run: Trajectory, title: str, study: str | None = None, points: Sequence[Point] = (),
    scale: float | None = None, versions: Mapping[str, str] | None = None,
) -> bytes:
    """The data of the report of a run; see :func:`report`."""
    require_kind("report", Sequence, points=points)
    require_kind("report", str, title=title)
    require_kind("report", (str, NoneType), study=study)
    require_kind("report", (Mapping, NoneType), versions=versions)
    if isinstance(points, str):
        raise InputError(f"report: points = {points!r} must be several points, such as ['B', 0].")
    for point in points:
        run._rows(point)  # says which points there are
    if scale is not None:
        require_scale("report", scale)
    payload = Payload()
    found, remarks = _finite(run), [*notes(run), *run.limits_exceeded]
    if message := alias_message(found):
        remarks.append(f"In this run {message}")
    if len(found.time) < len(run.time):
        remarks.append(f"Only the first {len(found.time)} of {len(run.time)} output times have a "
                    f"motion of finite numbers up to {LARGEST_DRAWN:g}.")
    system = found.system
    drawn = system.basis.mode_shapes is not None
    if not drawn:
        remarks.append("The modal basis holds no shapes over the body, so that no body is drawn.")
    motion = Motion(found, np.arange(len(found.time))) if drawn else None
    charts, phases = chart_tables(found, points, payload)
    header: dict[str, Any] = {
        "status": found.status.value,
        "good": found.status in (Status.FINISHED, Status.EVENT),
        "notes": remarks,
        "facts": [list(row) for row in run_facts(replace(found, statistics=run.statistics))],
        **_key_numbers(found, points),
        "system": [list(row) for row in system.summary()],
        "time": payload.add(found.time, 1e-9 * float(np.ptp(found.time) or 1.0)),
        "charts": charts, "spectra": spectrum_tables(found, points, payload), "phases": phases,
        "energies": energy_charts(found, payload),
        "balance": f"error of the energy balance: {found.energies.imbalance:.1e} of the largest "
                   f"term",
        "contact": None, "ground": None, "maps": colour_maps(),
    }
    if system.basis.contact_nodes:
        header["contact"] = contact_of_run(found, motion, payload)
    if motion is not None:
        q = motion.mode_shapes.stress_coordinates(found.modal_coordinates)
        motions = Motions(drawn_bodies(system.basis), q, motion.drift)
        scale = float(scale or visible_scale(motions.bodies.extent, max(
            motions.ranges.largest_magnified, motion.still_size)))
        box = motions.ranges.box(scale)
        header |= moving_tables(motions, scale, box, payload)
        header["ground"] = ground_table(motion, box, payload)
        if "owners" in header["bodies"]:
            states = header["contact"]["states"]
            header["bodies"]["ends"] = {PRESSURE: [0.0, motion.largest_pressure or 1.0],
                                        STATE: [-0.5, len(states) - 0.5]}
            header["maps"][STATE] = state_colours(header["contact"], _SHADES)
    return page_block(title, header, payload, study, versions=versions)


def moving_tables(
    motions: Motions, scale: float, box: Array, payload: Payload
) -> dict[str, Any]:
    """The bodies in a box (2, d), magnified, and their coordinates."""
    return {
        "bodies": bodies_table(motions, payload),
        "coordinates": payload.add(motions.coordinates, motions.coordinate_steps()),
        "scale": scale, "box": box.T.ravel().tolist(),
    }


def _finite(run: Trajectory) -> Trajectory:
    """The run up to its last output time that can be drawn."""
    bad = np.flatnonzero(~(drawable(run) & np.isfinite(run.work).all(axis=1)))
    if not len(bad):
        return run
    end = int(bad[0])
    if end < 2:
        raise InputError(f"The run has no motion to report: its numbers are not finite, or beyond "
                         f"{LARGEST_DRAWN:g}; check loads, stiffnesses and supports.")
    return run.between(None, float(run.time[end - 1]))


def _key_numbers(run: Trajectory, points: Sequence[Point]) -> dict[str, Any]:
    """Rows of the key numbers of a run and the interval that they are taken over."""
    if len(run.time) < 4:
        return {"numbers": [], "numbersOf": ""}
    found = key_numbers(run, tuple(point for point in points if isinstance(point, str | int)))
    begin, end = (quantity(time, "s") for time in found.interval)
    return {"numbers": [list(row) for row in found.rows()],
            "numbersOf": f"from {begin} to {end}"}


def colour_maps() -> dict[str, list[list[int]]]:
    """Colours of displacement, von Mises stress, pressure and signed components, 0 to 255."""
    from matplotlib import colormaps

    names = {"displacement": COLOUR_MAPS["displacement"],
             "von Mises stress": COLOUR_MAPS["von_mises"], PRESSURE: "viridis",
             "component": "coolwarm"}
    at = np.linspace(0.0, 1.0, _SHADES)
    return {what: np.asarray(colormaps[name](at, bytes=True))[:, :3].astype(int).tolist()
            for what, name in names.items()}
