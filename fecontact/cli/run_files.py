"""Reading studies and runs, writing results: shared by several commands."""

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.cli.console import loading
from fecontact.core.errors import FecontactError, InputError

if TYPE_CHECKING:
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.reduction.convergence import ModeConvergence
    from fecontact.study.sections import RenderSettings
    from fecontact.study.study import Study


def read_study(file: Path, changes: Iterable[str] | None = None) -> "Study":
    """A study, with other values for some of its keys: texts ``ground.speed=0.1``."""
    with loading():
        from fecontact.core.tables import parsed
        from fecontact.study.study import Study
    study = Study.read(file)
    values: dict[str, Any] = {}
    for change in changes or ():
        name, equals, text = (part.strip() for part in change.partition("="))
        if not equals or not name:
            raise InputError(f"--set {change} must have the form KEY=VALUE, like "
                             f"ground.speed=0.1.")
        try:
            values[name] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            # Texts come without quotes from a shell.
            values[name] = text
        except (RecursionError, ValueError):
            parsed(f"value = {text}", f"--set {name}")
    return study.with_(**values) if values else study


def write_run(study: "Study", trajectory: "Trajectory", folder: Path) -> list[Path]:
    """Write a run and its plots into a folder; the files."""
    from fecontact.output.files.case import write_case

    case = write_case(folder / f"{study.name}.vtkhdf", trajectory, frames=study.output.frames,
                      study=study.to_toml(), root=study.folder)
    return [case, *write_plots(study, trajectory, folder)]


def write_plots(study: "Study", trajectory: "Trajectory", folder: Path) -> list[Path]:
    """Plot histories, phase plane, contact and energies of a run into a folder; the files."""
    from fecontact.analysis.histories import usual_component
    from fecontact.output.plots import run as plots

    system, points = trajectory.system, study.output.points
    middle = system.basis.contact_nodes // 2
    point = points[0] if points else "B" if system.basis.T[0].any() else middle
    history, phase, contact_map, energies = files = [
        folder / f"{study.name}-{kind}.png"
        for kind in ("history", "phase", "contact_map", "energies")]
    plots.plot_history(trajectory, points, path=history)
    plots.plot_phase(trajectory, point, usual_component(system), path=phase)
    plots.plot_contact_map(trajectory, path=contact_map)
    plots.plot_energies(trajectory, path=energies)
    return files


@dataclass(frozen=True)
class StoredRun:
    """A run as found on disk.

    Attributes
    ----------
    path : Path
        Its file.
    trajectory : Trajectory
        The run.
    settings : RenderSettings
        How its study wants it drawn.
    current : bool
        Whether the study file still says what the run was computed from.
    """

    path: Path
    trajectory: "Trajectory"
    settings: "RenderSettings"
    current: bool = True


def stored_run(file: Path, trust: bool = False) -> StoredRun:
    """A run from its own file, or found by the file of its study.

    ``trust`` says whether to run code that the file of the run names; that of laws which the
    study names is run.

    Raises
    ------
    InputError
        If there is no such file, or the study was not run yet.
    """
    with loading():
        from fecontact.core.tables import from_table
        from fecontact.laws.registry import law_files
        from fecontact.output.files.case import read_case
        from fecontact.study.sections import RenderSettings
        from fecontact.study.study import Study
        from fecontact.system.model_limits import warn_of_limits

    if file.suffix.lower() == ".toml":
        study = Study.read(file)
        path = study.results / f"{study.name}.vtkhdf"
        if not path.is_file():
            raise InputError(f"{path} does not exist; run the study first: fecontact run {file}")
        known = law_files(study.tables())
        case = read_case(path, trust=trust or known)
        warn_of_limits(case.trajectory.limits_exceeded, "In this run")
        return StoredRun(path, case.trajectory, study.render,
                         _same_run(study, case.study, trust or known))
    case = read_case(file, trust=trust)
    try:
        settings = from_table(RenderSettings, tomllib.loads(case.study or "").get("render", {}),
                              "[render]")
    except FecontactError:
        # A run with a study that this version does not know can still be drawn.
        settings = RenderSettings()
    warn_of_limits(case.trajectory.limits_exceeded, "In this run")
    return StoredRun(file, case.trajectory, settings)


def _same_run(study: "Study", stored: str | None, trust: bool | set[Path]) -> bool:
    from fecontact.laws.registry import trusting
    from fecontact.study.study import Study

    try:
        with trusting(trust):
            earlier = Study.from_toml(stored or "")
    except FecontactError:
        return False
    return study == replace(earlier, output=study.output, render=study.render,
                            sweep=study.sweep)


def movie(trajectory: "Trajectory", target: Path, settings: "RenderSettings") -> Path:
    """Draw a run with a progress bar; the file or folder."""
    from fecontact.output.render.movie import render

    return render(trajectory, target, frames=settings.frames, fps=settings.fps,
                  size=settings.size, colour=settings.colour, scale=settings.scale,
                  title=settings.title, t_start=settings.t_start, t_end=settings.t_end,
                  progress=True)


def convergence_of(study: "Study") -> "ModeConvergence":
    """Frequencies and contact compliance of a study as its mesh is refined and modes are added."""
    from fecontact.reduction.convergence import mode_convergence

    settings = replace(study.basis, select=None)
    body = study.elastic_body()
    return mode_convergence(
        body, lambda part, count: replace(settings, modes=count).modal_basis(part), settings.modes,
        levels=4 if body.mass.shape[0] < 4000 else 3,
        progress=True)
