"""The command ``response``: nonlinear frequency responses of a study."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from fecontact.cli.console import INTERRUPTED, echo, echo_written, fail, show, waiting
from fecontact.cli.options import Changes, Folder, StudyFile
from fecontact.core.errors import InputError

if TYPE_CHECKING:
    from fecontact.bifurcation.harmonic.response import FrequencyResponse
    from fecontact.bifurcation.response_options import ResponseSettings
    from fecontact.study.study import Study


def response(
    study: StudyFile,
    parameter: Annotated[str | None, Parameter(
        help="Parameter that varies along a response, by default drive.frequency_hz; "
        "overrides [response].")] = None,
    /,
    *,
    bounds: Annotated[tuple[float, float] | None, Parameter(
        help="Lowest and highest frequency [Hz], or values of another parameter; override "
        "[response].")] = None,
    levels: Annotated[str | None, Parameter(
        help="A second parameter and its values, such as drive.amplitude_x=1e-5,2e-5; one "
        "response for each value.")] = None,
    amplitudes: Annotated[str | None, Parameter(
        help="Amplitudes of vibration [m] to hold, such as 1e-5,2e-5, by a varying force; override "
        "[response] and its levels.")] = None,
    force: Annotated[str | None, Parameter(
        help="Parameter that varies to hold --amplitudes; by default the amplitude of the "
        "drive.")] = None,
    method: Annotated[Literal["harmonic balance", "collocation", "shooting"] | None, Parameter(
        help="Method for the periodic orbits; overrides [response].")] = None,
    harmonics: Annotated[str | None, Parameter(
        help="A number, 7, for all harmonics up to it, or a list, 1,3,5; overrides "
        "[response].")] = None,
    samples: Annotated[int | None, Parameter(
        help="Number of samples per period; overrides [response].")] = None,
    tolerance: Annotated[float | None, Parameter(
        help="Largest truncation error; overrides [response].")] = None,
    set_: Changes = None,
    output: Folder = None,
    movie: Annotated[bool, Parameter(negative=(), help=(
        "Draw the whole wheel at the peak of the last response, NAME-wheel.mp4."))] = False,
    resume: Annotated[bool, Parameter(
        negative=(), help="Continue an interrupted response.")] = False,
) -> int:
    """Nonlinear frequency response: steady vibration over the frequency of the excitation.

    The section [response] of the study gives range, levels and harmonics. Writes the responses
    (NAME-response.h5, NAME-response.csv), a picture of amplitude and phase, and a page with a
    diagram, in which a click on a point plays its orbit (NAME-response.html). Each level is stored
    when it is done. Ctrl-C stops the command; --resume continues it.

    With [symmetry] and an engine_order the response is that of a whole wheel, from one sector, and
    no page is written.
    """
    from fecontact.cli.run_files import read_study, tell_replaced
    from fecontact.core.files.atomic_write import output_folder
    from fecontact.core.files.locks import locked
    from fecontact.core.progress import titled_bar
    from fecontact.core.tables import located

    described = read_study(study, set_)
    with located(f"{described.title}: [response]:", "ResponseSettings"):
        wanted = _wanted(
            described.response, parameter, bounds, method=method, force=force, samples=samples,
            tolerance=tolerance, levels=None if levels is None else _levels(levels),
            harmonics=None if harmonics is None else _harmonics(harmonics),
            amplitudes=None if amplitudes is None else _amplitudes(amplitudes))
    with located(f"{described.title}:"):
        _ = wanted.checked_bounds
    described = replace(described, response=wanted)
    from fecontact.bifurcation.continuation.problem import BranchStatus
    from fecontact.bifurcation.responses import follow_responses, observed_point
    from fecontact.cli.branch_results import echo_unresolved
    from fecontact.cli.response_results import (
        keep_response,
        response_file,
        response_table,
        write_response_results,
        write_wheel_movie,
    )

    with (output_folder(output or described.results) as folder,
          locked(folder / f".{described.name}-response.lock",
                 f"Another response is writing {folder / described.name}-response.h5; wait for "
                 f"it, or choose another folder with -o.")):
        tell_replaced(described, response_file(described, folder), None if resume else set_)
        with waiting("Computing modes"):
            system, wave = described.system(), described.wave()
        if movie and wave is None:
            raise InputError("--movie is for a wheel, a study with [symmetry]; leave it out, and "
                             "see fecontact render.")
        with located(f"{described.title}: [response]:", "ResponseSettings"):
            observe = observed_point(system, wanted)
        earlier = _earlier(described, response_file(described, folder)) if resume else None
        with titled_bar() as progress:
            found = follow_responses(
                system, wanted, progress, earlier,
                lambda part: keep_response(described, part, folder),
                described.load_history() if wanted.preload else None, wave)
        assert found.response is not None
        with waiting("Writing"):
            files = write_response_results(described, found.response, observe, folder, wave)
        if movie and wave is not None:
            files.append(write_wheel_movie(described, found.response, wave, folder))
        show(response_table(found.response, described.usable_hz, system))
        echo_unresolved(found.response.branches)
        name = found.response.level_name
        for number, branch in enumerate(found.response.branches):
            if branch.status is BranchStatus.POINTS:
                where = "" if name is None else f"{name} = {found.response.levels[number]:g}: "
                peak = "" if found.response.peak_reached(number) else " Its peak may lie beyond."
                echo(f"note: {where}{branch.end}{peak}")
            if branch.message:
                echo(f"note: {branch.message}")
        for note in found.notes:
            echo(f"note: {note}")
        echo_written(*files)
    if found.interrupted:
        echo("note: The response was interrupted: the last branch may be incomplete, and levels "
             "after it are missing; go on with --resume.")
        return INTERRUPTED
    stalled = [f"{level:g}" for level, branch in zip(found.response.levels,
                                                     found.response.branches, strict=True)
               if branch.status.name == "STALLED"]
    if stalled:
        which = "" if found.response.level_name is None else f" at the levels {', '.join(stalled)}"
        return fail(f"the steps{which} became too small to go on; what was computed is written.", 1)
    return 1 if found.notes else 0


def _wanted(
    given: "ResponseSettings", parameter: str | None, bounds: tuple[float, float] | None,
    **options: object,
) -> "ResponseSettings":
    """The section [response] with the options of the command line, None for those not given."""
    changes = {name: value for name, value in {"parameter": parameter, **options}.items()
               if value is not None}
    other = parameter is not None and parameter != given.parameter
    if other and bounds is None and given.bounds is not None:
        raise InputError(f"the bounds are those of {given.parameter}; give those of "
                         f"{parameter} by --bounds LOW HIGH.")
    if bounds is not None or other:
        changes |= {"bounds": bounds, "start": None}
    if "amplitudes" in changes:
        changes.setdefault("levels", {})
    if "harmonics" in changes:
        changes.setdefault("samples", None)
    return replace(given, **changes)  # type: ignore[arg-type]


def _levels(text: str) -> dict[str, tuple[float, ...]]:
    """A parameter and its values from ``name=1,2``."""
    name, equals, listed = (part.strip() for part in text.partition("="))
    try:
        values = tuple(float(part) for part in listed.split(","))
    except ValueError:
        equals = ""
    if not (name and equals):
        raise InputError(f"--levels {text} must have the form KEY=VALUE,VALUE, like "
                         f"drive.amplitude_x=1e-5,2e-5.")
    return {name: values}


def _amplitudes(text: str) -> tuple[float, ...]:
    """Amplitudes from ``1e-5,2e-5``."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--amplitudes {text} must be numbers with commas between them, like "
                         f"1e-5,2e-5.") from None


def _harmonics(text: str) -> int | tuple[int, ...]:
    """A number of harmonics, or a list of them from ``1,3,5``."""
    try:
        found = tuple(int(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--harmonics {text} must be a whole number, or several with commas "
                         f"between them, like 1,3,5.") from None
    return found if len(found) > 1 else found[0]


def _earlier(study: "Study", file: Path) -> "FrequencyResponse":
    """The interrupted response of a study.

    Raises
    ------
    InputError
        If there is none, or it is one of other values.
    """
    from fecontact.cli.run_files import require_same_study
    from fecontact.output.files.branches import read_response

    if not file.is_file():
        raise InputError(f"There is no interrupted response to go on with: {file} does not exist; "
                         f"leave out --resume.")
    require_same_study(study, file, "levels", "amplitudes")
    return read_response(file)
