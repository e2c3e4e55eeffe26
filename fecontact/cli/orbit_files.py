"""Orbits, plots and pages of files that ``fecontact branch`` and ``response`` write."""

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.core.errors import FecontactError, InputError, choices

if TYPE_CHECKING:
    from fecontact.bifurcation.continuation.branch import Branch
    from fecontact.bifurcation.continuation.points import BranchPoint
    from fecontact.bifurcation.fields.contact_field import ContactField
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.output.files.stored_system import StoredModel

_TURN = 2.0 * np.pi


@dataclass(frozen=True)
class OrbitChoice:
    """Which orbit of a file is meant.

    Attributes
    ----------
    branch : str or None
        Name or number of a branch.
    at, at_hz : float or None
        Value of the parameter, or of an angular frequency in Hz.
    which : int
        Which of several there, counted along the branch.
    """

    branch: str | None = None
    at: float | None = None
    at_hz: float | None = None
    which: int = 0

    @property
    def given(self) -> bool:
        """Whether anything is chosen."""
        return self != OrbitChoice()


def holds_branches(file: Path) -> bool:
    """Whether a file is one of branches, by its name."""
    return file.suffix.lower() in (".h5", ".hdf5")


def require_no_choice(file: Path, choice: OrbitChoice) -> None:
    """InputError where an orbit is chosen of what is no file of branches."""
    if choice.given:
        raise InputError(f"--branch, --at, --at-hz and --which choose an orbit of a file of "
                         f"branches, NAME-branch.h5 or NAME-response.h5, but {file} is none.")


def read_orbit(
    file: Path, choice: OrbitChoice, outputs: int, trust: bool
) -> "tuple[Trajectory, StoredModel, str]":
    """An orbit of a file as a trajectory, the model of the file, and words for a title.

    Raises
    ------
    InputError
        If the file has no such branch or orbit.
    """
    from fecontact.output.files.branches import read_branches
    from fecontact.output.files.stored_system import read_model

    named, model = read_branches(file), read_model(file, trust)
    name, branch = _branch(file, named, choice.branch)
    field = field_of(branch, model)
    point = _point(file, branch, field, choice)
    period = float(point.values["period"])
    words = f"{branch.parameter_name} = {point.parameter:.5g}, {1.0 / period:.5g} Hz"
    return point.trajectory(field, outputs), model, words if len(named) == 1 else f"{name}: {words}"


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
    name = names[int(wanted)] if wanted.isdigit() and int(wanted) < len(names) else wanted
    if name not in named:
        raise InputError(f"{file} has no branch '{wanted}'; there are: "
                         f"{choices(_numbered(named))}.")
    return name, named[name]


def _numbered(named: "dict[str, Branch]") -> list[str]:
    """Numbers and names of branches, of responses with their level."""
    found = []
    for number, (name, branch) in enumerate(named.items()):
        level_name = str(branch.attributes.get("level_name", ""))
        level = f"{level_name} = {float(branch.attributes['level']):g}" if level_name else name
        found.append(f"{number} ({level})")
    return found


def _point(
    file: Path, branch: "Branch", field: "ContactField", choice: OrbitChoice
) -> "BranchPoint":
    """The orbit that is chosen; of the largest observed amplitude where nothing is."""
    name = branch.parameter_name
    if choice.at is not None and choice.at_hz is not None:
        raise InputError("--at and --at-hz mean the same; give one of them.")
    if choice.at_hz is not None and not name.endswith("angular_frequency"):
        raise InputError(f"--at-hz = {choice.at_hz:g} is for branches over an angular frequency, "
                         f"but those of {file} are over {name}; give --at.")
    value = choice.at if choice.at_hz is None else _TURN * choice.at_hz
    if value is None:
        amplitudes = [float(point.values.get("observed_amplitude", 0.0)) if point.is_orbit else -1.0
                      for point in branch.points]
        return branch.points[int(np.argmax(amplitudes))]
    return branch.at(field, value, choice.which)


def settings_of(model: "StoredModel") -> dict[str, object]:
    """The section [render] of the study of a file, as far as this version can read it."""
    try:
        found = tomllib.loads(model.study or "").get("render", {})
    except (FecontactError, tomllib.TOMLDecodeError):
        return {}
    return dict(found)


def write_orbit_page(file: Path, target: Path, trust: bool) -> Path:
    """Write the page of a file of branches or responses."""
    from fecontact.bifurcation.harmonic.response import response_of
    from fecontact.output.files.branches import read_branches
    from fecontact.output.files.stored_system import read_model
    from fecontact.output.report.branch_report import report_branches
    from fecontact.output.report.response_report import report_response

    named, model = read_branches(file), read_model(file, trust)
    first = next(iter(named.values()))
    title = file.stem.removesuffix("-branch").removesuffix("-response")
    if "level" in first.attributes:
        point, _, component = str(first.attributes["observed"]).rpartition(" ")
        return report_response(response_of(named), model.system, target, title=title,
                               observe=(int(point) if point.isdigit() else point, component),
                               study=model.study)
    settings = tomllib.loads(model.study or "").get("branch", {})
    basis, point = model.system.basis, settings.get("point")
    if point is None:
        point = "B" if basis.T[0].any() else basis.contact_nodes // 2
    return report_branches(named, field_of(first, model), target, title=title, study=model.study,
                           observe=(point, settings.get("component", "x")),
                           y=f"observed_{settings.get('show', 'maximum')}")


def plotted(file: Path, kind: str, target: Path) -> Iterable[Path]:
    """Draw the diagram of a file of branches, or amplitude and phase of a response."""
    from fecontact.output.files.branches import read_branches, read_response
    from fecontact.output.plots.bifurcation_diagram import plot_branches
    from fecontact.output.plots.response import plot_response

    if kind == "response":
        plot_response(read_response(file), path=target)
    else:
        named = read_branches(file)
        plot_branches(list(named.values()), "observed_amplitude", names=list(named), path=target)
    return [target]
