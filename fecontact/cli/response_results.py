"""Results of the command ``response``: files, tables and plots."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import contact_field
from fecontact.bifurcation.harmonic.engine_order import EngineOrder, WaveField
from fecontact.bifurcation.harmonic.response import FrequencyResponse, highest_harmonic
from fecontact.core.files.atomic_write import write_text
from fecontact.core.files.csv_text import csv_text
from fecontact.output.files.branches import write_response
from fecontact.reduction.report import beyond_basis

if TYPE_CHECKING:
    from fecontact.bifurcation.continuation.point import BranchPoint
    from fecontact.study.study import Study
    from fecontact.system.contact_system import ContactSystem

_COLUMNS = ("level", "kind", "parameter", "frequency_hz", "stable", "amplitude", "minimum",
            "maximum", "first_harmonic", "phase", "third_harmonic", "truncation_error",
            "parameter_error", "beyond_basis", "force")


def response_file(study: "Study", folder: Path) -> Path:
    """Path of the file that stores the response of a study."""
    return folder / f"{study.name}-response.h5"


def keep_response(study: "Study", response: FrequencyResponse, folder: Path) -> Path:
    """Store a response with its system and study."""
    return write_response(response_file(study, folder), response, system=study.system(),
                          study=study.to_toml(), root=study.folder)


def write_response_results(
    study: "Study", response: FrequencyResponse, observe: tuple[str | int, str], folder: Path,
    wave: EngineOrder | None = None,
) -> list[Path]:
    """Write a response as HDF5, CSV, picture and page; returns the files.

    The wave of a wheel has no page. Points above the frequency up to which the basis is usable are
    marked.
    """
    from fecontact.output.plots.responses import plot_response
    from fecontact.output.report.response_report import report_response
    from fecontact.study.study import with_given_keys

    name = f"{study.name}-response"
    files = [keep_response(study, response, folder),
             *(folder / f"{name}.{ending}" for ending in ("csv", "png"))]
    usable, seen_by = study.usable_hz, study.system() if wave is None else wave_field(
        study, response, wave)
    also = [response.of(seen_by, seen) for seen in study.response.also_observed]
    write_text(files[1], response_csv(response, usable, also))
    plot_response(response, usable_hz=usable, path=files[2])
    if wave is None:
        files.append(report_response(
            response, study.system(), folder / f"{name}.html", observe=observe, title=study.name,
            study=with_given_keys(study.to_toml()), usable_hz=usable))
    return files


def wave_field(study: "Study", response: FrequencyResponse, wave: EngineOrder) -> WaveField:
    """The field of the wave to which the points of a response belong."""
    names = response.branches[0].attributes.get("parameter_names", [response.parameter_name])
    return wave.field(contact_field(study.system(), dict.fromkeys(map(str, names))))


def write_wheel_movie(
    study: "Study", response: FrequencyResponse, wave: EngineOrder, folder: Path
) -> Path:
    """Draw the whole wheel at the peak of the last response."""
    from fecontact.bifurcation.harmonic.wheel_orbits import wheel_motion
    from fecontact.output.render.wheel_movie import render_wheel

    point = response.peak(len(response.branches) - 1)
    motion = wheel_motion(wave_field(study, response, wave), point)
    return render_wheel(motion, folder / f"{study.name}-wheel.mp4", fps=study.render.fps,
                        progress=True)


def response_csv(
    response: FrequencyResponse, usable_hz: float = math.inf,
    also: Sequence[FrequencyResponse] = (),
) -> str:
    """All points of a response as CSV, special points with their kind; SI units, phases in rad.

    ``beyond_basis`` is 1 for frequencies above ``usable_hz``; ``force`` is the level of the force
    where the amplitude is held, else empty. ``also`` are the same responses with further
    displacements, of which amplitude and phase are added.
    """
    rows: list[Sequence[Any]] = [(*_COLUMNS, *(f"{name} {one.observed}" for one in also
                                               for name in ("amplitude", "phase")))]
    for level, branch in enumerate(response.branches):
        first, phase = np.abs(response.harmonic(1, level)), response.phase(level)
        third, held = _third(response, level), response.force_name is not None
        more = np.array([(one.amplitude(level), one.phase(level)) for one in also])
        further = more.reshape(2 * len(also), len(branch)).T.tolist()
        force = [repr(one) for one in response.force(level).tolist()] if held else []
        for place, point in enumerate(branch.points):
            values = point.values
            rows.append([
                "" if response.level_name is None else repr(float(response.levels[level])),
                point.kind or "", repr(point.parameter), repr(1.0 / float(values["period"])),
                int(values["stable"]) if "stable" in values else "",
                repr(float(values["observed_amplitude"])),
                repr(float(values["observed_minimum"])), repr(float(values["observed_maximum"])),
                repr(float(first[place])), repr(float(phase[place])), third[place],
                (repr(float(values["truncation_error"])) if "truncation_error" in values else ""),
                "" if math.isnan(point.parameter_error) else repr(point.parameter_error),
                int(1.0 / float(values["period"]) > usable_hz), force[place] if held else "",
                *map(repr, further[place])])
    return csv_text(rows)


def _stability(point: "BranchPoint") -> str:
    """Empty where the stability was left out."""
    stable = point.values.get("stable")
    return "" if stable is None else "stable" if stable else "unstable"


def _third(response: FrequencyResponse, level: int) -> list[str]:
    if highest_harmonic(response.branches[level]) < 3:
        return [""] * len(response.branches[level])
    return [repr(float(one)) for one in np.abs(response.harmonic(3, level))]


def response_table(
    response: FrequencyResponse, usable_hz: float = math.inf, system: "ContactSystem | None" = None
) -> Any:
    """Table of peaks and special points of all levels; those above ``usable_hz`` are marked."""
    from fecontact.cli.tables import table
    from fecontact.core.units import quantity
    from fecontact.output.diagrams.branches import drawn, drawn_label, level_texts
    from fecontact.output.diagrams.labels import name_and_unit

    label, unit = name_and_unit(drawn_label(response))
    # The frequency of the response is then the same.
    over_frequency = response.parameter_name.endswith("frequency_hz")
    name, texts = ("", [""]) if response.level_name is None else level_texts(response)
    rows = []
    for level, branch in enumerate(response.branches):
        values, peak = drawn(response, level), response.peak(level)
        for place, point in enumerate(branch.points):
            if point is not peak and point.kind is None:
                continue
            largest = "peak" if response.peak_reached(level) else "largest"
            words = ", ".join(filter(None, (largest if point is peak else "", point.kind)))
            hertz = 1.0 / float(point.values["period"])
            remarks = ", ".join(filter(None, (_stability(point), beyond_basis(hertz, usable_hz))))
            rows.append((*([texts[level]] if name else []), words,
                         *([] if over_frequency else [f"{point.parameter:.7g}"]),
                         f"{hertz:.7g}", quantity(float(values[place]), unit, 5), remarks))
    return table(*([name] if name else []), "point",
                 *([] if over_frequency else [response.parameter_name]), "frequency [Hz]",
                 label, "", rows=rows, left=2)
