"""Nonlinear modes of ``fecontact modes --nonlinear``: files, table and plots."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.cli.console import INTERRUPTED, echo, echo_written, fail, show, waiting
from fecontact.core.errors import InputError
from fecontact.core.files.csv_text import csv_text

if TYPE_CHECKING:
    from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import NonlinearMode
    from fecontact.study.study import Study

_COLUMNS = ("kind", "amplitude", "frequency_hz", "damping_ratio", "loss", "energy", "stable",
            "truncation_error")
_SHOWN = 8  # rows of the table
# Keys of [response] that a mode does not read.
_OF_RESPONSES = ("parameter", "bounds", "start", "levels", "most_harmonics",
                 "stability", "step", "largest_step", "points")
_SAME = 1e-3  # relative difference of amplitudes that mean the same


def follow_mode(
    study: "Study", number: int, amplitudes: tuple[float, float] | None, folder: Path,
    resume: bool = False,
) -> int:
    """Follow a nonlinear mode of a study and write its files; returns the exit code.

    Raises
    ------
    InputError
        Without amplitudes, for a mode or point that does not exist, or with nothing to resume.
    """
    if amplitudes is None:
        raise InputError("--nonlinear needs the smallest and largest amplitude of the mode in m; "
                         "give --amplitudes LOW HIGH.")
    if not 0.0 < amplitudes[0] < amplitudes[1] < math.inf:
        raise InputError(f"--amplitudes {amplitudes[0]:g} {amplitudes[1]:g} must be two amplitudes "
                         f"above zero in m, the smaller one first.")
    from fecontact.bifurcation.modes_of_study import follow_mode as followed
    from fecontact.bifurcation.modes_of_study import unfinished
    from fecontact.bifurcation.responses import observed_point
    from fecontact.core.files.locks import locked
    from fecontact.core.progress import progress_bar
    from fecontact.core.tables import located
    from fecontact.output.files.branches import write_mode

    wanted, system, wave = study.response, study.system(), study.wave()
    with located(f"{study.title}: [response]:", "ResponseSettings"):
        observe = observed_point(system, wanted)
    file = folder / f"{study.name}-mode-{number}.h5"

    def keep(mode: "NonlinearMode") -> None:
        write_mode(file, mode, system=system, study=study.to_toml(), root=study.folder)

    with locked(folder / f".{file.stem}.lock",
                f"Another command is writing {file}; wait for it, or choose another folder with "
                f"-o."):
        earlier = _earlier(study, file, amplitudes) if resume else None
        mode = earlier
        if earlier is None or unfinished(earlier, wanted.points):
            preload = study.load_history() if wanted.preload else None
            with (progress_bar(f"Mode {number}", wanted.points) as tell,
                  located("--nonlinear:", "nonlinear_mode")):
                mode = followed(system, wanted, amplitudes, number, tell, earlier=earlier,
                                keep=keep, preload=preload, wave=wave)
        assert mode is not None
        with waiting("Writing"):
            files = write_mode_results(study, mode, observe, folder, page=wave is None)
    echo(f"\nnonlinear mode {number}, which begins at {mode.frequency_hz[0]:.6g} Hz: {_end(mode)}")
    if mode.branch.message:
        echo(f"note: {mode.branch.message}")
    show(mode_table(mode))
    echo_written(*files)
    if mode.branch.status.name == "INTERRUPTED":
        return INTERRUPTED
    if mode.branch.status.name == "STALLED":
        return fail("the steps became too small to go on; what was computed is written.", 1)
    return 0


def _earlier(study: "Study", file: Path, amplitudes: tuple[float, float]) -> "NonlinearMode":
    """The interrupted mode of a study.

    Raises
    ------
    InputError
        If there is none, or it is one of other values.
    """
    from fecontact.bifurcation.continuation.problem import BranchStatus
    from fecontact.cli.run_files import require_same_study
    from fecontact.output.files.branches import read_mode

    if not file.is_file():
        raise InputError(f"There is no interrupted mode to go on with: {file} does not exist; "
                         f"leave out --resume.")
    require_same_study(study, file, *_OF_RESPONSES)
    mode = read_mode(file)
    begins = float(mode.amplitude[0])
    if abs(begins - amplitudes[0]) > _SAME * amplitudes[0]:
        raise InputError(f"{file} begins at the amplitude {begins:.6g}, not at "
                         f"{amplitudes[0]:g}; give the same --amplitudes, or leave out --resume.")
    reached = float(mode.amplitude[-1])
    if (mode.branch.status is BranchStatus.BOUND and reached > 1.5 * amplitudes[0]
            and abs(reached - amplitudes[1]) > _SAME * amplitudes[1]):
        raise InputError(f"{file} ends at the amplitude {reached:.6g}, not at {amplitudes[1]:g}; "
                         f"give the same --amplitudes, or leave out --resume.")
    return mode


def write_mode_results(
    study: "Study", mode: "NonlinearMode", observe: tuple[str | int, str], folder: Path,
    page: bool = True,
) -> list[Path]:
    """Write a nonlinear mode as HDF5, CSV, picture and page; returns the files."""
    from fecontact.core.files.atomic_write import write_text
    from fecontact.output.files.branches import write_mode
    from fecontact.output.plots.responses import plot_nonlinear_mode
    from fecontact.output.report.mode_report import report_modes
    from fecontact.study.study import with_given_keys

    system, text, name = study.system(), study.to_toml(), f"{study.name}-mode-{mode.number}"
    files = [folder / f"{name}.{ending}" for ending in ("h5", "csv", "png")]
    write_mode(files[0], mode, system=system, study=text, root=study.folder)
    write_text(files[1], mode_csv(mode))
    plot_nonlinear_mode(mode, path=files[2])
    if page:
        files.append(report_modes(
            mode, system, folder / f"{name}.html", observe=observe, study=with_given_keys(text),
            title=f"{study.name}, nonlinear mode {mode.number}"))
    return files


def _end(mode: "NonlinearMode") -> str:
    """How the mode ended, by its amplitude."""
    from fecontact.core.units import quantity

    return mode.branch.end_at(f"the amplitude {quantity(float(mode.amplitude[-1]), _unit(mode), 5)}"
                              f" of {mode.observed}")


def _unit(mode: "NonlinearMode") -> str:
    return "rad" if mode.observed.rpartition(" ")[2].startswith("phi") else "m"


def mode_csv(mode: "NonlinearMode") -> str:
    """All points of a nonlinear mode as CSV, in SI units."""
    energy, stable = mode.energy, mode.stable
    columns = (mode.amplitude, mode.frequency_hz, mode.damping_ratio, mode.loss)
    return csv_text([_COLUMNS, *([
        point.kind or "",
        *(repr(float(column[place])) for column in columns),
        "" if energy is None else repr(float(energy[place])),
        "" if stable is None else int(stable[place]),
        repr(float(point.values["truncation_error"]))]
        for place, point in enumerate(mode.branch.points))])


def mode_table(mode: "NonlinearMode") -> Any:
    """Some points along a mode, ends and special points among them."""
    from fecontact.cli.tables import table
    from fecontact.core.units import quantity

    unit, last = _unit(mode), len(mode) - 1
    chosen = {round(last * part / (_SHOWN - 1)) for part in range(_SHOWN)}
    chosen |= {place for place, point in enumerate(mode.branch.points) if point.kind is not None}
    amplitude, frequency, ratio = mode.amplitude, mode.frequency_hz, mode.damping_ratio
    return table(
        "", f"amplitude of {mode.observed}", "frequency [Hz]", "damping ratio",
        rows=((mode.branch.points[place].kind or "", quantity(float(amplitude[place]), unit, 5),
               f"{frequency[place]:.6g}",
               "none" if mode.conservative else f"{ratio[place]:.4g}")
              for place in sorted(chosen)))
