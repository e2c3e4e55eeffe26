"""The command ``sweep``: many cases of a study."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from fecontact.cli.console import echo, echo_written, note, show
from fecontact.cli.options import Changes, StudyFile
from fecontact.core.errors import InputError
from fecontact.core.units import listed

if TYPE_CHECKING:
    from fecontact.study.study import Study
    from fecontact.study.sweep_section import SweepSettings
    from fecontact.sweeps.table import SweepTable

_SHOWN = 10  # reasons, and cases of each
_LONGEST_NAME = 120  # bytes of the name of a summary in that of its picture


def sweep(
    study: StudyFile,
    /,
    *,
    set_: Changes = None,
    output: Annotated[Path | None, Parameter(
        name=["--output", "-o"], help="Folder of the sweep, instead of NAME-sweep among the "
                                      "results of the study.")] = None,
    resume: Annotated[bool, Parameter(
        negative=(), help="Resume a sweep; finished cases are not repeated.")] = False,
    retry: Annotated[bool, Parameter(
        negative=(), help="With --resume: repeat failed cases.")] = False,
    overwrite: Annotated[bool, Parameter(
        negative=(), help="Remove an existing sweep and start again.")] = False,
    workers: Annotated[int | None, Parameter(
        help="Processes on this machine; one per core by default.")] = None,
    dask: Annotated[str | None, Parameter(
        help="Address of a running Dask scheduler, such as tcp://node1:8786.")]
    = None,
    cases: Annotated[str | None, Parameter(
        help="Print cases of a stored sweep (failed, missing, or numbers such as 3,17), each with "
        "the command that runs this case alone; nothing is run.")] = None,
) -> int:
    """Run many cases of a study on all cores or a cluster; write a table (index.csv), a page
    (index.html) and plots.

    Ctrl-C stops the sweep and keeps finished cases; --resume continues it.
    """
    from fecontact.cli.console import waiting
    from fecontact.cli.run_files import read_study

    described = read_study(study, set_)
    if described.sweep is None:
        raise InputError(f"{study} has no section [sweep]; add one with the parameters that change "
                         f"in [sweep.axes].")
    if dask is not None and workers is not None:
        raise InputError("--workers is for processes on this machine; leave it out with --dask.")
    from fecontact.output.report.page import require_own_page
    from fecontact.sweeps.executors import dask_executor
    from fecontact.sweeps.sweep import sweep as run_sweep

    folder = output or described.results / f"{described.name}-sweep"

    def command(table: "SweepTable", case: int) -> str:
        return table.command(case, study, *(set_ or ()))

    if cases is not None:
        from fecontact.sweeps.table import read_table

        stored = read_table(folder / "index.csv")
        changes = _changes_of(folder / "sweep.toml", read_study(study), study)
        for case in _chosen(stored, cases):
            echo(_described(stored, case) + f"\n  {stored.command(case, study, *changes)}")
        return 0
    if not overwrite:
        require_own_page(folder / "index.html")
    with waiting("Compiling, once after an installation"):
        pass
    with contextlib.ExitStack() as stack:
        executor = None if dask is None else stack.enter_context(dask_executor(dask))
        try:
            table = run_sweep(described, executor=executor, folder=folder, resume=resume,
                              overwrite=overwrite, retry=retry, workers=workers,
                              progress=True)
        except KeyboardInterrupt:
            note(f"Finished cases are kept in {folder}; go on with --resume.")
            raise
    from fecontact.study.study import with_given_keys
    from fecontact.sweeps.report import report_sweep

    with waiting("Writing"):
        page = report_sweep(table, folder / "index.html", title=described.name,
                            study=with_given_keys(described.to_toml()),
                            command=partial(command, table))
    return _report(table, described.sweep, folder, page, partial(command, table))


def _chosen(table: "SweepTable", cases: str) -> list[int]:
    """Numbers of the cases that ``failed``, are ``missing``, or are listed like ``3,17``."""
    if cases in ("failed", "missing"):
        return list(getattr(table, cases))
    from fecontact.core.checks import whole_number

    numbers = [whole_number(part) for part in cases.split(",")]
    if any(number is None or not 0 <= number < len(table) for number in numbers):
        raise InputError(f"--cases {cases} must be 'failed', 'missing', or numbers of cases from 0 "
                         f"to {len(table) - 1}, like 3,17.")
    return [number for number in numbers if number is not None]


def _changes_of(file: Path, study: "Study", path: Path) -> list[str]:
    """Assignments that turn a study into the one that a sweep keeps in a file.

    They are those that the sweep was started with, and keys of the study that were edited since.
    """
    from fecontact.core.dotted_parameters import flattened
    from fecontact.core.tables import parsed
    from fecontact.study.study import of_the_run
    from fecontact.sweeps.table import text_of

    def leaves(tables: Mapping[str, Any]) -> dict[str, Any]:
        return flattened(_numbered(of_the_run(tables)))

    try:
        wanted = leaves(parsed(file.read_text(encoding="utf-8"), str(file)))
    except (OSError, UnicodeDecodeError):
        raise InputError(f"{file}, the study of the sweep, cannot be read; run the sweep again "
                         f"with --overwrite.") from None
    found = leaves(study.tables())
    changes = {name: value for name, value in wanted.items() if found.get(name) != value}
    try:
        found = leaves(study.with_(**changes).tables())
    except InputError:
        found |= changes
    if others := sorted(name for name in {*found, *wanted}
                        if found.get(name) != wanted.get(name)):
        note(f"note: {path} has changed since the sweep in keys that --set does not change back, "
             f"{listed(others, 5)}; the commands run other cases. The study of the sweep is "
             f"{file}.")
    return [f"{name}={text_of(value)}" for name, value in changes.items()]


def _numbered(value: Any) -> Any:
    """Tables with lists of tables as tables over their numbers, as --set names them."""
    if isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
        value = {f"{number}": one for number, one in enumerate(value)}
    if isinstance(value, Mapping):
        return {name: _numbered(one) for name, one in value.items()}
    return value


def _described(table: "SweepTable", case: int) -> str:
    """Number of a case with its summaries, or the reason of its failure."""
    reason = table.reasons[case]
    if reason is None:
        return f"case {case}: not computed"
    if reason:
        return f"case {case}: {reason}"
    from fecontact.core.units import UNITS, quantity
    from fecontact.sweeps.summaries import unit_of

    values = [(name, float(values[case]), unit_of(name)) for name, values in table.values.items()]
    return f"case {case}: " + ", ".join(
        f"{name} = {quantity(value, unit, 4) if unit in UNITS else f'{value:.4g} {unit}'.strip()}"
        for name, value, unit in values)


def _report(
    table: "SweepTable", settings: "SweepSettings", folder: Path, page: Path,
    command: Callable[[int], str],
) -> int:
    from fecontact.cli.console import waiting

    failed = table.failed
    echo(f"{len(table)} cases, {len(failed)} failed")
    if len(failed) < len(table):
        show(_summary_table(table, settings.method))
        if settings.method == "sensitivity":
            for name in table.values:
                with contextlib.suppress(InputError):  # too few base samples went well
                    show(_sensitivity_table(table, name, settings.seed))
    _complain(failed, command)
    _warn({case: one for case, one in enumerate(table.warnings) if one})
    with waiting("Drawing"):
        pictures = _draw(table, settings, folder)
    echo_written(folder / "index.csv", page, *pictures)
    return 1 if len(failed) == len(table) else 0


def _complain(failed: Mapping[int, str], command: Callable[[int], str]) -> None:
    """Print each reason of failure with its first cases and the command that repeats one."""
    cases: dict[str, list[int]] = {}
    for case, reason in failed.items():
        cases.setdefault(reason, []).append(case)
    for reason, numbers in list(cases.items())[:_SHOWN]:
        few = ", ".join(f"{number}" for number in numbers[:_SHOWN])
        more = ", ..." if len(numbers) > _SHOWN else ""
        note(f"failed: case{'s' * (len(numbers) > 1)} {few}{more}: {reason}")
        note(f"  case {numbers[0]} alone: {command(numbers[0])}")
    if len(cases) > _SHOWN:
        note(f"failed: for {len(cases) - _SHOWN} more reasons, see the table")


def _warn(warnings: Mapping[int, str]) -> None:
    """Print one line on cases that exceed the limits of the model, with the first warning."""
    if warnings:
        first = min(warnings)
        note(f"warning: {len(warnings)} of the cases leave the limits of the model, see the "
             f"column 'warning' of the table; case {first}: {warnings[first]}")


def _sensitivity_table(table: "SweepTable", name: str, seed: int) -> Any:
    from fecontact.cli.tables import table as make_table
    from fecontact.sweeps.statistics import Estimate, sobol_indices

    def shown(one: Estimate) -> tuple[str, str]:
        return f"{one.value:.2f}", f"{one.low:.2f} ... {one.high:.2f}"

    found = sobol_indices(table, name, seed=seed)
    return make_table(f"variance of {name}", "alone", "95 %", "with others", "95 %", rows=[
        (parameter, *shown(found.first[parameter]), *shown(found.total[parameter]))
        for parameter in found.first])


def _summary_table(table: "SweepTable", method: str) -> Any:
    """Statistics of random samples; smallest and largest value for grids and lists."""
    import numpy as np

    from fecontact.cli.tables import table as make_table
    from fecontact.core.units import UNITS, suitable_unit
    from fecontact.sweeps.statistics import statistics
    from fecontact.sweeps.summaries import unit_of

    rows: list[tuple[str, ...]] = []
    drawn = method not in ("grid", "list", "sensitivity")
    for name, values in table.values.items():
        known, unit = values[np.isfinite(values)], unit_of(name)
        if unit in UNITS and len(known):
            factor, unit = suitable_unit(float(np.abs(known).max()), unit)
            known = known / factor
        title = f"{name} [{unit}]" if unit else name
        if drawn and len(known) >= 3:
            rows += [(title if key == "mean" else "", key, f"{one.value:.4g}",
                      f"{one.low:.4g} ... {one.high:.4g}")
                     for key, one in statistics(known).items()]
        elif len(known):
            rows.append((title, f"{known.min():.4g}", f"{np.median(known):.4g}",
                         f"{known.max():.4g}"))
    if drawn:
        return make_table("", "", "value", "95 %", rows=rows, left=2)
    return make_table("", "smallest", "median", "largest", rows=rows)


def _draw(table: "SweepTable", settings: "SweepSettings", folder: Path) -> list[Path]:
    from fecontact.sweeps.plots import plot_sobol, plot_strobed, plot_sweep
    from fecontact.sweeps.statistics import sobol_indices

    if len(set(table.keys)) < 2:
        return []
    names = [name for name, values in table.values.items() if (values == values).any()]
    parts = _file_names([*table.values, *table.parameters])
    files = []
    for name in names:
        files.append(folder / f"{parts[name]}.png")
        plot_sweep(table, name, path=files[-1])
    if table.strobed is not None:
        for parameter, values in table.parameters.items():
            if len(set(values)) > 1:
                files.append(folder / f"strobed-{parts[parameter]}.png")
                plot_strobed(table, parameter, path=files[-1])
    if settings.method == "sensitivity" and names:
        found = {}
        for name in names:
            with contextlib.suppress(InputError):  # too few base samples went well
                found[name] = sobol_indices(table, name, seed=settings.seed)
        if found:
            files.append(folder / "sensitivity.png")
            plot_sobol(found, path=files[-1])
    return files


def _file_names(names: Sequence[str]) -> dict[str, str]:
    """Names of pictures without ending: letters, digits, ``-`` and ``_``, different ones each."""
    from fecontact.core.files.atomic_write import name_parts

    plain = ["".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in name)
             for name in names]
    return dict(zip(names, name_parts(plain, _LONGEST_NAME), strict=True))
