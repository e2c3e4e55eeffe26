"""Orbits, plots and pages of files that ``fecontact branch`` and ``response`` write."""

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.analysis.histories import usual_point
from fecontact.cli.run_files import StoredRun, warn_of_changed_files
from fecontact.core.checks import whole_number
from fecontact.core.errors import FecontactError, InputError, choices

if TYPE_CHECKING:
    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.bifurcation.continuation.point import BranchPoint
    from fecontact.bifurcation.fields.contact_field import ContactField
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.output.files.stored_system import StoredModel
    from fecontact.study.render_section import RenderSettings

DIAGRAMS = ("branches", "response", "mode")  # plots of whole files
_OUTPUTS = 1001  # of an orbit


@dataclass(frozen=True)
class OrbitChoice:
    """Choice of one orbit of a file.

    Attributes
    ----------
    branch : str or None
        Name or number of a branch.
    at : float or None
        Value of the parameter, of a frequency in Hz.
    which : int
        Index among several orbits at this value, counted along the branch.
    """

    branch: str | None = None
    at: float | None = None
    which: int = 0


def holds_branches(file: Path) -> bool:
    """Whether a file is one of branches, by its name."""
    return file.suffix.lower() in (".h5", ".hdf5")


def stored_orbit_or_run(
    file: Path, trust: bool, changes: Iterable[str] | None, choice: OrbitChoice
) -> "StoredRun":
    """The chosen orbit of a file of branches as a run over one period, or a stored run.

    Raises
    ------
    InputError
        If the file has no such branch or orbit, or an orbit is chosen of what has none.
    """
    from fecontact.cli.run_files import require_stored, stored_run

    if not holds_branches(file):
        if choice != OrbitChoice():
            raise InputError(f"--branch, --at and --which choose an orbit of a file of "
                             f"branches, NAME-branch.h5 or NAME-response.h5, but {file} is none.")
        return stored_run(file, trust, changes)
    require_stored(file, changes)
    from fecontact.output.files.branches import read_branches
    from fecontact.output.files.stored_system import read_model

    named, model = read_branches(file), read_model(file, trust)
    warn_of_changed_files(file)
    _require_no_wave(file, named)
    name, branch = _branch(file, named, choice.branch)
    point, run = _motion(file, branch, model, choice)
    settings = _settings(model)
    if settings.title is None:
        settings = replace(settings, title=_title(name, branch, point))
    return StoredRun(file, run, settings, True, model.study, model.versions,
                     _observed(branch, model))


def _title(name: str, branch: "Branch", point: "BranchPoint") -> str:
    """Branch or level of an orbit, its parameter, and its frequency, with units."""
    from fecontact.output.diagrams.labels import branch_label, level_label, with_value

    known, parts = branch.attributes, []
    if "level" not in known:
        parts.append(name)
    elif known["level_name"]:
        parts.append(with_value(level_label(branch), float(known["level"])))
    if not branch.parameter_name.endswith(("frequency_hz", "xi")):
        parts.append(with_value(branch_label(branch), point.parameter))
    return ", ".join([*parts, f"{1.0 / float(point.values['period']):.5g} Hz"])


def _observed(branch: "Branch", model: "StoredModel") -> tuple[str | int, Any]:
    """Point and component that are observed along a branch."""
    if "observed" in branch.attributes:
        seen, _, component = str(branch.attributes["observed"]).rpartition(" ")
        number = whole_number(seen)
        return seen if number is None else number, component
    settings = tomllib.loads(model.study or "").get("branch", {})
    point = settings.get("point")
    return (usual_point(model.system.basis) if point is None else point,
            settings.get("component", "x"))


def _require_no_wave(file: Path, named: "dict[str, Branch]") -> None:
    """Raise InputError for waves of a wheel, whose orbits need its sector."""
    if any("engine_order" in branch.attributes for branch in named.values()):
        raise InputError(f"{file} holds waves of a wheel, whose motion is not that of one body; "
                         f"fecontact plot draws them, and fecontact response --movie the wheel.")


def _motion(
    file: Path, branch: "Branch", model: "StoredModel", choice: OrbitChoice
) -> "tuple[BranchPoint, Trajectory]":
    """The chosen point of a branch or a nonlinear mode, and its motion."""
    if "mode_number" not in branch.attributes:
        field = field_of(branch, model)
        point = _point(file, branch, field, choice)
        return point, point.trajectory(field, _OUTPUTS)
    from fecontact.bifurcation.nonlinear_modes.linear_start import unforced, with_mass_damping
    from fecontact.bifurcation.orbits.motions import sampled_run

    amplitudes = np.asarray(branch.column("observed_amplitude"))
    wanted = amplitudes.max() if choice.at is None else choice.at
    point = branch.points[int(np.argmin(np.abs(amplitudes - wanted)))]
    # Mass damping of negative sign makes the motion periodic.
    system = with_mass_damping(unforced(model.system), point.parameter)
    return point, sampled_run(system, point.orbit(samples=_OUTPUTS))


def field_of(branch: "Branch", model: "StoredModel") -> "ContactField":
    """The system of a file as a field of the parameters of a branch."""
    from fecontact.bifurcation.fields.contact_field import contact_field

    names = branch.attributes.get("parameter_names", [branch.parameter_name])
    return contact_field(model.system, dict.fromkeys(map(str, names)))


def _branch(file: Path, named: "dict[str, Branch]", wanted: str | None) -> "tuple[str, Branch]":
    names = list(named)
    orbits = [name for name in names if any(point.is_orbit for point in named[name].points)]
    if wanted is None:
        if len(orbits) != 1:
            raise InputError(f"{file} holds {len(orbits) or 'no'} branches of orbits"
                             f"{'; choose one with --branch: ' * bool(orbits)}"
                             f"{choices(_numbered(named))}.")
        return orbits[0], named[orbits[0]]
    number = whole_number(wanted)
    name = names[number] if number is not None and number < len(names) else wanted
    if name not in named:
        raise InputError(f"{file} has no branch '{wanted}'; there are: "
                         f"{choices(_numbered(named))}.")
    return name, named[name]


def _numbered(named: "dict[str, Branch]") -> list[str]:
    """Numbers and names of branches, of responses with their level."""
    return [f"{number} ({_called(name, branch).removesuffix(', ') or name})"
            for number, (name, branch) in enumerate(named.items())]


def _called(name: str, branch: "Branch") -> str:
    """Name of a branch and its level, put before the place of a point on the branch."""
    if "level" not in branch.attributes:
        return f"{name}, "
    level_name = str(branch.attributes["level_name"])
    return f"{level_name} = {float(branch.attributes['level']):g}, " if level_name else ""


def _point(
    file: Path, branch: "Branch", field: "ContactField", choice: OrbitChoice
) -> "BranchPoint":
    """The orbit that is chosen; of the largest observed amplitude where nothing is."""
    if choice.at is None:
        amplitudes = [float(point.values.get("observed_amplitude", 0.0)) if point.is_orbit else -1.0
                      for point in branch.points]
        return branch.points[int(np.argmax(amplitudes))]
    return branch.at(field, choice.at, choice.which)


def _settings(model: "StoredModel") -> "RenderSettings":
    """The section [render] of the study of a file, without times, which belong to its run."""
    from fecontact.core.tables import from_table
    from fecontact.study.render_section import RenderSettings

    try:
        found = from_table(RenderSettings, tomllib.loads(model.study or "").get("render", {}),
                           "[render]")
    except FecontactError:
        # An orbit can be drawn even if this version cannot read its study.
        return RenderSettings()
    return replace(found, t_start=None, t_end=None)


def write_orbit_page(file: Path, target: Path, trust: bool) -> Path:
    """Write the page of a file of branches or responses."""
    from fecontact.bifurcation.harmonic.response import response_of
    from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import mode_of
    from fecontact.output.files.branches import read_branches
    from fecontact.output.files.stored_system import read_model
    from fecontact.output.report.branch_report import report_branches
    from fecontact.output.report.mode_report import report_modes
    from fecontact.output.report.response_report import report_response
    from fecontact.study.study import with_given_keys

    named, model = read_branches(file), read_model(file, trust)
    warn_of_changed_files(file)
    _require_no_wave(file, named)
    first = next(iter(named.values()))
    title = file.stem.removesuffix("-branch").removesuffix("-response")
    observe = _observed(first, model)
    if "observed" in first.attributes:
        write: Any = report_response if "level" in first.attributes else report_modes
        shown: Any = (response_of(named) if "level" in first.attributes
                      else [mode_of(one) for one in named.values()])
        return Path(write(shown, model.system, target, title=title, observe=observe,
                          study=with_given_keys(model.study)))
    settings = tomllib.loads(model.study or "").get("branch", {})
    return report_branches(named, field_of(first, model), target, title=title,
                           study=with_given_keys(model.study),
                           observe=observe, y=f"observed_{settings.get('show', 'maximum')}")


def plotted(file: Path, kind: str, target: Path) -> Path:
    """Draw branches, amplitude and phase of a response, or frequency and damping of a mode."""
    from fecontact.output.files.branches import read_branches, read_mode, read_response
    from fecontact.output.plots.bifurcation_diagram import plot_branches
    from fecontact.output.plots.responses import plot_nonlinear_mode, plot_response

    if kind == "response":
        plot_response(read_response(file), path=target)
    elif kind == "mode":
        plot_nonlinear_mode(read_mode(file), path=target)
    else:
        named = read_branches(file)
        plot_branches(list(named.values()), "observed_amplitude", names=list(named), path=target)
    warn_of_changed_files(file)
    return target
