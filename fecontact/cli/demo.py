"""The demonstration: three studies from geometry to movie."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.cli.console import loading
from fecontact.cli.templates import TEMPLATES, template
from fecontact.core.errors import MissingLibraryError
from fecontact.core.files.atomic_write import output_folder, write_text

SHOWN = ("beam", "pendulum", "solid")


@dataclass
class Log:
    """Steps of the demonstration, their durations and the files written."""

    steps: list[tuple[str, str, float]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    @contextmanager
    def step(self, study: str, what: str) -> Iterator[None]:
        """Time a step and echo on stderr when it is done."""
        begin = time.perf_counter()
        yield
        seconds = time.perf_counter() - begin
        self.steps.append((study, what, seconds))
        print(f"{study}: {what}, {seconds:.1f} s", file=sys.stderr)


def run_demo(folder: Path) -> int:
    """Run the demonstration in a folder and print the files written; returns the exit code.

    Without a working renderer only the movies are skipped.
    """
    log, reasons = Log(), dict[str, None]()
    with output_folder(folder):
        pass
    with log.step("fecontact", "loading and compiling"), loading():
        import fecontact.output.files.case
        import fecontact.study.study  # noqa: F401
    with output_folder(folder):
        for shape in SHOWN:
            try:
                _show_study(TEMPLATES[shape], template(shape), folder, log)
            except MissingLibraryError as error:
                reasons[str(error)] = None
        _print_tables(log)
    for reason in reasons:
        print(f"error: {reason}", file=sys.stderr)
    return 1 if reasons else 0


def _show_study(name: str, text: str, folder: Path, log: Log) -> None:
    from fecontact.cli.run_files import movie, write_plots
    from fecontact.core.units import count
    from fecontact.fem.mesh_files import write_mesh
    from fecontact.integrate.trajectory import Status
    from fecontact.output.files.case import write_case
    from fecontact.output.plots.modes import plot_modes
    from fecontact.study.study import Study

    path = folder / f"{name}.toml"
    write_text(path, text)
    log.files.append(path)
    study = Study.read(path)
    with log.step(name, "meshing"):
        write_mesh(study.mesh(), folder / f"{name}.msh")
        log.files.append(folder / f"{name}.msh")
    with log.step(name, "modes"):
        system = study.system()
    what = (f"running {study.t_end:g} s with {count(system.basis.modes, 'mode')} and "
            f"{count(system.basis.contact_nodes, 'contact node')}")
    with log.step(name, what):
        trajectory = study.run(progress=True)
    with log.step(name, "writing"):
        log.files.append(write_case(folder / f"{name}.vtkhdf", trajectory,
                                    frames=study.output.frames, study=study.to_toml()))
    if trajectory.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    with log.step(name, "plotting"):
        shapes = folder / f"{name}-modes.png"
        plot_modes(system.basis, path=shapes)
        log.files.append(shapes)
        log.files += write_plots(study, trajectory, folder)
    with log.step(name, f"drawing {study.render.frames} pictures"):
        log.files.append(movie(trajectory, folder / f"{name}.mp4", study.render))


def _print_tables(log: Log) -> None:
    from rich.console import Console

    from fecontact.cli.tables import file_size, table

    total = sum(seconds for _, _, seconds in log.steps)
    steps = [(study, what, f"{seconds:.1f} s") for study, what, seconds in log.steps]
    console = Console()
    steps.append(("", "total", f"{total:.1f} s"))
    console.print(table("study", "step", "time", left=2, rows=steps))
    console.print(table("made", "size", rows=[(str(path), file_size(path)) for path in log.files]))
