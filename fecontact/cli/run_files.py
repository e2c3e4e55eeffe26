"""Reading of studies and runs and writing of results, shared by several commands."""

import os
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from glob import escape
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

from fecontact.cli.console import echo, loading, note
from fecontact.core.errors import FecontactError, InputError, shown
from fecontact.core.units import listed

if TYPE_CHECKING:
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.laws.wear import WearLaw
    from fecontact.reduction.assembly.interface_compliance import InterfaceCompliance
    from fecontact.study.render_section import RenderSettings
    from fecontact.study.study import Study
    from fecontact.system.quasistatic.history import LoadHistory


_LONGEST_NAME = 200  # bytes; endings such as -contact_map.png make it longer, up to 255


def require_short(name: str) -> None:
    """Refuse the name of a study that leaves no room for the endings of its results."""
    if (size := len(os.fsencode(name))) > _LONGEST_NAME:
        raise InputError(f"The name of the study, {shown(name)}, has {size} bytes, and those of "
                         f"its results would be longer still; rename the file to at most "
                         f"{_LONGEST_NAME}.")


def read_study(file: Path, changes: Iterable[str] | None = None) -> "Study":
    """Read a study and override keys by assignments such as ``ground.speed=0.1``."""
    with loading():
        from fecontact.core.tables import parsed
        from fecontact.study.study import Study
    study = Study.read(file)
    require_short(study.name)
    values: dict[str, Any] = {}
    for change in changes or ():
        name, equals, text = (part.strip() for part in change.partition("="))
        if not equals or not name:
            raise InputError(f"--set {change} must have the form KEY=VALUE, like "
                             f"ground.speed=0.1.")
        try:
            values[name] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            # Strings from a shell come without quotes.
            values[name] = text
        except (RecursionError, ValueError):
            parsed(f"value = {text}", f"--set {name}")
    if values:
        before = study
        study = study.with_(**values)
        for name in values:
            if name.endswith(".law"):
                _tell_dropped_keys(before, study, name)
    if study.preload is not None:
        with loading():
            import fecontact.system.quasistatic.loading  # noqa: F401
    return study


def _tell_dropped_keys(before: "Study", after: "Study", name: str) -> None:
    """Print a note on the keys that another law ``name`` of a study does not have."""
    section = name.removesuffix(".law")
    old, new = (one.tables(defaults=False) for one in (before, after))
    for part in section.split("."):
        old, new = (table[int(part)] if isinstance(table, list) else table.get(part, {})
                    for table in (old, new))
    gone = [key for key in old if key not in new and key != "law"]
    if gone:
        echo(f"note: [{section}]: the law {new.get('law', 'chosen')} has no {listed(gone)}; "
             f"{'these keys are' if len(gone) > 1 else 'this key is'} left out.")


def require_same_study(study: "Study", file: Path, *free: str) -> None:
    """Raise InputError if a file of results was computed with other values.

    Sections that say nothing of its numbers may differ, and the keys ``free`` of [response].
    """
    from fecontact.output.files.stored_system import read_tables

    stored = read_tables(file).study
    if changed := _changed_since(study, stored):
        raise InputError(f"{file} was computed with another content of {listed(changed)}; leave "
                         f"out --resume.")
    if not _same_values(study, stored, False, "branch", "simulation", "wear", free=free):
        raise InputError(f"{file} was computed with other values than {study.title} has now; "
                         f"leave out --resume.")


def tell_replaced(study: "Study", file: Path, changes: Iterable[str] | None) -> None:
    """Print a note before ``--set`` replaces results that the study has of other values."""
    from fecontact.output.files.stored_system import read_study_text

    if not changes or not file.exists():
        return
    try:
        stored, _ = read_study_text(file)
    except FecontactError:
        return
    if not _same_values(study, stored, False):
        note(f"note: {file} has results of other values, which will be replaced; keep both by "
             f"-o FOLDER.")


def write_results_of_run(
    study: "Study", trajectory: "Trajectory", folder: Path
) -> list[Path]:
    """Write a run and its plots into a folder; returns the files.

    Raises
    ------
    InputError
        If a file cannot be written. A run that cannot be written there goes to a temporary folder;
        the message says where it is.
    """
    from fecontact.output.files.case import write_case

    def write(path: Path) -> Path:
        return write_case(path, trajectory, frames=study.output.frames, study=study.to_toml(),
                          root=study.folder)

    path = folder / f"{study.name}.vtkhdf"
    try:
        write(path)
    except InputError as error:
        try:
            kept = write(Path(mkdtemp(prefix="fecontact-")) / path.name)
        except (InputError, OSError):
            raise error from None
        raise InputError(f"{str(error).removesuffix('.')}; the run is kept in {kept}.") from None
    try:
        return [path, *write_plots(study, trajectory, folder)]
    except InputError as error:
        raise InputError(f"{str(error).removesuffix('.')}; the run is in {path}.") from None


def write_plots(study: "Study", trajectory: "Trajectory", folder: Path) -> list[Path]:
    """Plot histories, phase plane, contact and energies of a run into a folder; the files.

    Without points that move there are no histories and no phase plane.
    """
    from fecontact.analysis.histories import component_of, observes_motion, usual_point
    from fecontact.output.plots import run as plots
    from fecontact.output.plots.contact_map import plot_contact_map

    basis, points = trajectory.basis, study.output.points
    files: list[Path] = []

    def file_of(kind: str) -> Path:
        files.append(folder / f"{study.name}-{kind}.png")
        return files[-1]

    if observes_motion(basis):
        point = points[0] if points else usual_point(basis)
        plots.plot_history(trajectory, points, path=file_of("history"))
        plots.plot_phase(trajectory, point, component_of(trajectory), path=file_of("phase"))
    plots.plot_energies(trajectory, path=file_of("energies"))
    if (~basis.spring_nodes).any():
        plot_contact_map(trajectory, path=file_of("contact_map"))
    return files


def write_preload(study: "Study", history: "LoadHistory", folder: Path) -> list[Path]:
    """Write table and plots of quasi-static loading into a folder; returns the files."""
    import numpy as np

    from fecontact.core.files.atomic_write import write_text
    from fecontact.core.files.csv_text import csv_text
    from fecontact.output.plots.preload import plot_loop, plot_shear

    # Of solids along both tangents.
    tangents = ("", "_across")[: history.slips.shape[2]]
    kinds = {"normal_force_N": history.normal_force,
             **{f"friction_force{name}_N": history.friction_forces[..., k]
                for k, name in enumerate(tangents)},
             **{f"slip{name}_m": history.slips[..., k] for k, name in enumerate(tangents)},
             "state": history.contact_state}
    columns = ["point", *("travel_m", "travel_y_m")[: len(tangents)], "work_J", "loss_J",
               *(f"{kind}_{j}" for kind in kinds for j in range(history.slip.shape[1]))]
    values = np.column_stack([np.arange(len(history)), history.travels, history.work, history.loss,
                              *kinds.values()])
    text = csv_text([columns, *([f"{value:.12g}" for value in row] for row in values.tolist())])
    files = [folder / f"{study.name}-preload.csv", folder / f"{study.name}-shear.png"]
    write_text(files[0], text)
    plot_shear(history, path=files[1])
    if history.status == "finished":
        files.append(folder / f"{study.name}-loop.png")
        plot_loop(history, path=files[-1])
    return files


@dataclass(frozen=True)
class StoredRun:
    """A run read from disk.

    Attributes
    ----------
    path : Path
        File of the run.
    trajectory : Trajectory
        The run.
    settings : RenderSettings
        Render settings of its study.
    current : bool
        Whether the study file is unchanged since the run.
    study : str or None
        The study that described the run, as TOML text.
    versions : mapping
        Versions of the programs that computed it.
    observed : (point, component) or None
        Point and component that are observed along the branch of an orbit.
    """

    path: Path
    trajectory: "Trajectory"
    settings: "RenderSettings"
    current: bool = True
    study: str | None = None
    versions: Mapping[str, str] = field(default_factory=dict)
    observed: tuple[str | int, Any] | None = None


def has_run(file: Path, changes: Iterable[str] | None = None) -> Path:
    """File of a stored run: of a study, in a folder of results, or the file itself.

    Raises
    ------
    InputError
        If there is none, or several to choose from.
    """
    if file.suffix.lower() == ".toml":
        study = read_study(file, changes)
        found = run_of(study)
        if found is None:
            raise InputError(f"{study.results / study.name}.vtkhdf does not exist; run the study "
                             f"first: fecontact run {file}")
        return found
    require_stored(file, changes)
    if not file.is_dir():
        return file
    runs = sorted(file.glob("*.vtkhdf"))
    if len(runs) != 1:
        raise InputError(f"{file} holds {len(runs) or 'no'} runs; name the file of one"
                         f"{': ' * bool(runs)}{', '.join(str(run) for run in runs[:5])}.")
    return runs[0]


def run_of(study: "Study") -> Path | None:
    """The stored run of a study, None if there is none.

    It is looked for among the results of the study, then where ``run -o`` may have written it: in
    the folder of the study, the current one, and two levels of folders in them.

    Raises
    ------
    InputError
        If there are several and none among the results of the study.
    """
    name = f"{study.name}.vtkhdf"
    if (study.results / name).is_file():
        return study.results / name
    near = {path.resolve(): path for folder in (study.folder, Path())
            for depth in range(3)
            for path in sorted(folder.glob("[!.]*/" * depth + escape(name))) if path.is_file()}
    if len(near) > 1:
        raise InputError(f"there are several runs of the study: "
                         f"{', '.join(str(path) for path in near.values())}; name one of them.")
    return next(iter(near.values()), None)


def require_stored(file: Path, changes: Iterable[str] | None) -> None:
    """InputError where keys of a study are changed of what is a stored result."""
    if changes:
        raise InputError(f"--set changes keys of a study, but {file} is a stored result; name the "
                         f"study instead.")


def stored_run(
    file: Path, trust: bool = False, changes: Iterable[str] | None = None
) -> StoredRun:
    """Read a run from its own file or folder, or find it by the file of its study.

    ``trust`` allows code named by the file of the run to be executed. Laws named by the study are
    always executed. ``changes`` of the study also change its render settings.

    Raises
    ------
    InputError
        If the file does not exist, the study has not been run yet, or ``changes`` are given for
        what is not a study.
    """
    with loading():
        from fecontact.core.tables import from_table
        from fecontact.laws.own_files import law_files
        from fecontact.output.files.case import stored_case
        from fecontact.study.render_section import RenderSettings

    path = has_run(file, changes)
    study = read_study(file, changes) if file.suffix.lower() == ".toml" else None
    case = stored_case(path, trust=trust or (study is not None and law_files(study.tables())))
    if exceeded := case.trajectory.limits_exceeded:
        from fecontact.system.model_limits import warn_of_limits

        warn_of_limits(exceeded, "In this run")
    _warn_of_gaps(path, case.trajectory)
    current = study is None or _same_run(study, case.study, trust)
    if current:
        warn_of_changed_files(path)
    if study is not None:
        settings = study.render
    else:
        try:
            settings = from_table(RenderSettings, tomllib.loads(case.study or "").get("render", {}),
                                  "[render]")
        except FecontactError:
            # The run can be drawn even if this version cannot read its study.
            settings = RenderSettings()
    return StoredRun(path, case.trajectory, settings, current, case.study, case.versions)


def stored_or_computed_run(
    file: Path, changes: Iterable[str] | None = None, trust: bool = False
) -> StoredRun:
    """Read a run, or compute it, without storing it, where a study has none with its values.

    Raises
    ------
    InputError
        If the file does not exist, or ``changes`` are given for what is not a study.
    """
    if file.suffix.lower() != ".toml":
        return stored_run(file, trust, changes)
    study = read_study(file, changes)
    from fecontact.laws.own_files import law_files
    from fecontact.output.files.case import read_case

    found = run_of(study)
    path = found or study.results / f"{study.name}.vtkhdf"
    known = trust or law_files(study.tables())
    if found is not None:
        case = read_case(path, trust=known)
        if _same_run(study, case.study, trust) and not _changed_since(study, case.study):
            _warn_of_gaps(path, case.trajectory)
            return StoredRun(path, case.trajectory, study.render, True, case.study, case.versions)
    _ = study.t_end
    return StoredRun(path, study.run(True), study.render, True, study.to_toml())


def _warn_of_gaps(file: Path, run: "Trajectory") -> None:
    """Print one line if some output times of a stored run have no numbers."""
    import numpy as np

    bad = np.flatnonzero(~np.isfinite(run.states).all(axis=1))
    if len(bad):
        note(f"warning: {file} has a motion that is not finite at {len(bad)} of {len(run.time)} "
             f"output times, first at {run.time[bad[0]]:.6g} s; plots and exported data have gaps "
             f"there.")


def _same_run(study: "Study", stored: str | None, trust: bool) -> bool:
    """Whether a stored study has the values of a study that affect its run in time."""
    preload = [] if study.simulation.initial == "preload" else ["preload"]
    return _same_values(study, stored, trust, "branch", "response", "wear", *preload)


def _same_values(
    study: "Study", stored: str | None, trust: bool, *sections: str, free: Iterable[str] = ()
) -> bool:
    """Whether a stored study has the values of a study, whose own laws are trusted.

    The named sections, those that affect no numbers, and the keys ``free`` of [response] may
    differ.
    """
    from fecontact.laws.own_files import law_files
    from fecontact.study.measurement_section import masses_of_sensors
    from fecontact.study.study import NOT_OF_THE_RUN, stored_study

    try:
        earlier = stored_study(stored, trust or law_files(study.tables()), study.path)
    except FecontactError:
        return False
    kept = [*NOT_OF_THE_RUN, *sections]
    if masses_of_sensors(study.measurement) == masses_of_sensors(earlier.measurement):
        kept.append("measurement")
    response = replace(earlier.response, **{name: getattr(study.response, name) for name in free})
    return study == replace(earlier, **{"response": response}
                            | {name: getattr(study, name) for name in kept})


def _changed_since(study: "Study", stored: str | None) -> list[str]:
    """Names of files whose content differs between a study and a stored one."""
    from fecontact.study.comments import stored_hashes

    return [name for name, mark in stored_hashes(stored).items()
            if study.content_hashes.get(name, mark) != mark]


def warn_of_changed_files(file: Path) -> None:
    """Print one line if files that the study of stored results names have changed since."""
    from fecontact.core.files.named_files import changed_files
    from fecontact.output.files.stored_system import read_study_text
    from fecontact.study.comments import stored_hashes

    try:
        text, folder = read_study_text(file)
    except InputError:  # results without a study
        return
    changed = [] if folder is None else changed_files(stored_hashes(text), folder)
    if changed:
        note(f"warning: {listed(changed)} {'have' if len(changed) > 1 else 'has'} changed since "
             f"{file} was computed; compute it again to see what changes.")


def wear_of(stored: StoredRun) -> "WearLaw | None":
    """Wear law of the study of a run of solids, whose faces show the worn depth; None without."""
    from fecontact.core.tables import from_table
    from fecontact.study.sections import WearSettings

    if stored.trajectory.basis.dimension == 2:
        return None
    try:
        return from_table(WearSettings, tomllib.loads(stored.study or "").get("wear", {}),
                          "[wear]").law_if_any
    except FecontactError:
        # The run can be drawn even if this version cannot read its study.
        return None


def movie(
    trajectory: "Trajectory", target: Path, settings: "RenderSettings",
    wear: "WearLaw | None" = None,
) -> Path:
    """Render a run with a progress bar; returns the file or folder."""
    from fecontact.analysis.sampling import coarse_frames_message
    from fecontact.output.render.movie import frames_of, render

    start, end = settings.t_start, settings.t_end
    drawn, frames = frames_of(trajectory, settings.frames, start, end)
    if message := coarse_frames_message(drawn, drawn.time[frames]):
        echo(f"note: {message}")
    if wear is None and drawn is not trajectory:
        trajectory, start, end = drawn, None, None
    return render(trajectory, target, frames=settings.frames, fps=settings.fps,
                  size=settings.size, colour=settings.colour, scale=settings.scale,
                  title=settings.title, t_start=start, t_end=end,
                  view=settings.view, wear=wear, progress=True)


def write_report(stored: StoredRun, name: str, target: Path) -> Path:
    """Write the report of a run, with title, points and magnification as its study has them."""
    from fecontact.output.report.run_report import report
    from fecontact.study.study import with_given_keys

    output = tomllib.loads(stored.study or "").get("output", {})
    return report(stored.trajectory, target, title=stored.settings.title or name,
                  study=with_given_keys(stored.study), points=tuple(output.get("points", ())),
                  scale=stored.settings.scale, versions=stored.versions or None)


def own_page(file: Path) -> Path:
    """Page beside a file of results; InputError if a file of the user's has that name."""
    from fecontact.output.report.page import require_own_page

    page = file.with_suffix(".html")
    require_own_page(page)
    return page


def interfaces_of(study: "Study") -> list["InterfaceCompliance"]:
    """Compliance of the interfaces of several bodies, or of several boundaries of one body."""
    from fecontact.reduction.assembly.assembled_basis import assembled_basis
    from fecontact.reduction.assembly.interface_compliance import interface_compliance

    if study.bodies:
        # Links change the modes of the bodies, but not what the modes of each resolve.
        basis = assembled_basis(study.modal_bases(), study.pairings())
        bodies: Any = study.elastic_bodies()
    else:
        basis, bodies = study.modal_basis(), study.elastic_body()
    if len(basis.groups) < (1 if study.bodies else 2):
        return []
    return list(interface_compliance(basis, bodies).values())
