"""Sweeps: many cases of a study on all cores or a cluster, stored and resumable."""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import FecontactError, InputError
from fecontact.core.progress import clock, shown, titled_bar
from fecontact.core.tables import from_table, plain, require_known, to_table
from fecontact.core.types import Array
from fecontact.study.study import Study
from fecontact.study.sweep_section import SweepSettings, flat_axes
from fecontact.sweeps.batch import Batch, make_basis
from fecontact.sweeps.case import Row, SweepCase
from fecontact.sweeps.case_key import case_keys
from fecontact.sweeps.dispatch import LostError, results
from fecontact.sweeps.executors import opened, worker_count
from fecontact.sweeps.plan import Plan, plan
from fecontact.sweeps.shared_bases import Bases
from fecontact.sweeps.store import Store, write_whole
from fecontact.sweeps.summaries import functions_for
from fecontact.sweeps.table import SweepTable
from fecontact.system.parameter_labels import parameter_label

Progress = Callable[[int, int, int], None]

_BATCHES, _LARGEST = 64, 64  # fewest batches of a sweep, most cases of a batch


def sweep(
    study: Study | str | Path,
    axes: Mapping[str, Any] | None = None,
    executor: Executor | None = None,
    *,
    folder: str | Path | None = None,
    resume: bool = False,
    overwrite: bool = False,
    retry: bool = False,
    workers: int | None = None,
    progress: bool | Progress | None = None,
    **settings: Any,
) -> SweepTable:
    """Run many cases of a study.

    ``sweep("study.toml", {"ground.speed": [0.1, 0.2], "friction.decay": Span(1.0, 9.0, 5)})``

    Each case gives bit for bit the numbers of ``study.with_(**changes).run()``. Cases that fail
    have their reason in the table and do not stop the others; finished ones are kept, also after
    Ctrl-C, so that a sweep can be resumed. See docs/sweeps.md.

    Parameters
    ----------
    study : Study or path
        The study that all cases share.
    axes : mapping, optional
        Parameters by dotted names, each with a list of values, a :class:`fecontact.study.Span` or a
        :class:`fecontact.study.Distribution`; by default those of ``[sweep.axes]``. ``cases``
        lists the cases themselves instead: ``sweep(study, cases=[{"ground.speed": 0.1}])``.
    executor : concurrent.futures.Executor, optional
        Threads, or that of a Dask client, mpi4py.futures or executorlib; by default processes.
    folder : path, optional
        Folder that stores finished cases; by default ``NAME-sweep`` among the results of the study.
    resume, overwrite : bool
        Continue the sweep in the folder, or remove it; otherwise an existing one is an error.
    retry : bool
        Compute failed cases again.
    workers : int, optional
        Number of processes on this machine; by default one per core.
    progress : bool or callable, optional
        True for a progress bar; a function is called with the numbers of finished, failed and all
        cases.
    **settings
        Other values for the keys of ``[sweep]``; see :class:`fecontact.study.SweepSettings`.

    Returns
    -------
    SweepTable
        Table of all cases; also written to ``folder`` as ``index.csv``.

    Raises
    ------
    InputError, AnalysisError
        If a parameter or summary is unknown, an axis is empty or does not suit the method, the
        folder holds a sweep, is in use or cannot be written, or the executor cannot go on.
    """
    study = study if isinstance(study, Study) else Study.read(study)
    worker_count(workers)
    wanted = _settings(study, axes, settings)
    base = replace(study, sweep=None)
    vars(base).update({name: value for name, value in vars(study).items() if name[0] == "_"})
    if wanted.strobe is None:
        _ = base.t_end
    if wanted.t_start is not None and wanted.t_start >= base.t_end:
        raise InputError(f"[sweep]: t_start = {wanted.t_start:g} must lie before the end of the "
                         f"run, t_end = {base.t_end:g}.")
    functions_for(wanted.summaries, base.folder, wear=base.wear.law_if_any,
                  thickness=base.thickness)
    work = _Work.of(base, wanted, plan(wanted))
    place = Path(folder) if folder is not None else base.results / f"{base.name}-sweep"
    store = Store(place, files=wanted.keep != "none")
    described = place / "sweep.toml"
    if study.path is not None and described.exists() and (
            study.path.exists() and described.samefile(study.path)):
        raise InputError(f"The sweep would write {described} in the place of its study; choose "
                         f"another folder, or another name for the study.")
    with store.begun(resume=resume, overwrite=overwrite):
        write_whole(described, replace(study, sweep=wanted).to_toml())
        rows = store.rows()
        work.require_points(rows)
        if retry:
            rows = {key: row for key, row in rows.items() if not row["reason"]}
        finished = False
        try:
            with shown(progress, _sweep_bar) as tell:
                _compute(work, store, rows, executor, workers, tell)
            finished = True
        except FecontactError as error:
            done = sum(case.key in rows for case in work.cases)
            if not done:
                raise
            raise type(error)(f"{error} {done} of {len(work.cases)} cases are kept in {place}; go "
                              f"on with --resume (resume=True).") from None
        finally:
            table = work.table(rows, place)
            # Do not hide an earlier error.
            with contextlib.nullcontext() if finished else contextlib.suppress(InputError):
                table.write(place / "index.csv")
    return table


@dataclass(frozen=True, eq=False)
class _Work:
    """All cases of a sweep and the settings of their batches."""

    study: Study
    settings: SweepSettings
    plan: Plan
    cases: tuple[SweepCase, ...]

    @classmethod
    def of(cls, study: Study, settings: SweepSettings, cases: Plan) -> "_Work":
        request = {"summaries": list(settings.summaries), "t_start": settings.t_start,
                   "keep": settings.keep,
                   "frames": study.output.frames if settings.keep == "fields" else 0,
                   "strobe": None if settings.strobe is None else to_table(settings.strobe)}
        keys, bases = case_keys(study, cases.names, cases.rows, request)
        return cls(study, settings, cases, tuple(
            SweepCase(key, basis, dict(zip(cases.names, row, strict=True)))
            for key, basis, row in zip(keys, bases, cases.rows, strict=True)))

    def batches(self, store: Store) -> Iterator[Batch]:
        """All cases in batches, independent of which are already finished."""
        different = list({case.key: case for case in self.cases}.values())
        first: dict[str, int] = {}
        for case in different:
            first.setdefault(case.basis, len(first))
        different.sort(key=lambda case: first[case.basis])
        size = self.settings.batch or min(max(len(different) // _BATCHES, 1), _LARGEST)
        path = self.study.path
        common = Batch(
            self.study.tables(defaults=False), None if path is None else str(path.absolute()), (),
            self.settings.summaries, self.settings.t_start,
            files=str(store.cases.absolute()) if store.files else None,
            frames=self.study.output.frames if self.settings.keep == "fields" else 0,
            strobe=self.settings.strobe, in_all=len(self.cases))
        for start in range(0, len(different), size):
            yield replace(common, cases=tuple(different[start : start + size]))

    def table(self, rows: Mapping[str, Row], folder: Path) -> SweepTable:
        """Table of the finished cases."""
        found = [rows.get(case.key) for case in self.cases]
        nothing: dict[str, float] = {}
        return SweepTable(
            {name: tuple(row[k] for row in self.plan.rows)
             for k, name in enumerate(self.plan.names)},
            {name: np.array([(row["values"] if row else nothing).get(name, np.nan)
                             for row in found]) for name in self.settings.summaries},
            [case.key for case in self.cases],
            [None if row is None else row["reason"] for row in found],
            shape=self.plan.shape, folder=folder, strobed=self._strobed(found),
            warnings=["" if row is None else row.get("warning", "") for row in found],
            labels={name: parameter_label(name, Study, self.study) for name in self.plan.names})

    def require_points(self, rows: Mapping[str, Row]) -> None:
        """Raise InputError if a stored case has another number of points than is kept of each."""
        keep = 0 if self.settings.strobe is None else self.settings.strobe.keep
        for case in self.cases:
            points = rows[case.key].get("points") if case.key in rows else None
            if points is not None and len(points) != keep:
                raise InputError(f"The stored case {case.key} has {len(points)} displacements, one "
                                 f"a period, not {keep}; compute it again with --overwrite "
                                 f"(overwrite=True).")

    def _strobed(self, rows: Sequence[Row | None]) -> Array | None:
        if self.settings.strobe is None:
            return None
        nothing = [np.nan] * self.settings.strobe.keep
        return np.array([row.get("points", nothing) if row else nothing for row in rows])


def _settings(
    study: Study, axes: Mapping[str, Any] | None, changes: Mapping[str, Any]
) -> SweepSettings:
    for name in changes:
        require_known(name, [entry.name for entry in fields(SweepSettings)], "sweep()")
    given = study.sweep or SweepSettings()
    table: dict[str, Any] = {entry.name: getattr(given, entry.name)
                             for entry in fields(given) if getattr(given, entry.name) is not None}
    table |= {name: plain(value) for name, value in changes.items() if value is not None}
    # Cases given here replace the axes of the study, and axes its cases.
    if "cases" in changes:
        table["axes"] = {}
    if axes is not None:
        table |= {} if "cases" in changes else {"cases": ()}
        table["axes"] = {name: list(axis) if isinstance(axis, range) else axis
                         for name, axis in axes.items()}
    if table.get("strobe") is not None and "summaries" not in changes:
        table["summaries"] = ("periods",)
    return from_table(SweepSettings, flat_axes(table), "[sweep]")


def _compute(
    work: _Work, store: Store, rows: dict[str, Row], executor: Executor | None,
    workers: int | None, progress: Progress | None,
) -> None:
    """Compute the cases missing in ``rows``; add them to ``rows`` and to the store."""
    total = len({case.key for case in work.cases})
    done = sum(case.key in rows for case in {case.key: case for case in work.cases}.values())
    failed = sum(bool(rows[key]["reason"]) for key in {case.key for case in work.cases}
                 if key in rows)
    missing = [replace(batch, cases=cases) for batch in work.batches(store)
               if (cases := tuple(case for case in batch.cases if case.key not in rows))]

    def take(found: Sequence[Row]) -> None:
        nonlocal done, failed
        store.add(found)
        rows.update({row["case"]: row for row in found})
        done += len(found)
        failed += sum(bool(row["reason"]) for row in found)
        if progress is not None:
            progress(done, failed, total)

    if progress is not None:
        progress(done, failed, total)
    if not missing:
        return
    if work.study.preload is not None:
        # Compiled once, before there are workers.
        import fecontact.system.quasistatic.loading  # noqa: F401
    with opened(executor, workers) as pool:
        bases = Bases(work.study, store, missing)
        waiting = deque(bases.first())
        for job, result in results(waiting, pool):
            if job.function is make_basis:
                waiting.extend(bases.made(job.batch, result))
            elif isinstance(result, LostError):
                take([Row(case=case.key, values={}, reason=str(result))
                      for case in job.batch.cases])
            else:
                take(result)


@contextlib.contextmanager
def _sweep_bar() -> Iterator[Callable[[int, int, int], None]]:
    """Callback for the numbers of finished, failed and all cases, which draws the bar."""
    begin = time.perf_counter()
    first: int | None = None

    def tell(done: int, failed: int, total: int) -> None:
        nonlocal first
        # Cases of an earlier sweep do not count towards the rate.
        first = done if first is None else first
        show(f"Sweeping {done}/{total}", done / max(total, 1),
             note(done, failed, total, first, time.perf_counter() - begin))

    with titled_bar() as show:
        yield tell


def note(done: int, failed: int, total: int, first: int, passed: float) -> str:
    """``12.3 cases/s, 1:05 left, 2 failed``, after ``passed`` seconds from ``first`` cases on."""
    if done <= first:
        return "starting"
    rate = (done - first) / passed
    parts = [f"{rate:.3g} cases/s" if rate >= 1.0 else f"{1.0 / rate:.3g} s a case",
             f"{clock((total - done) / rate)} left"]
    return ", ".join(parts + ([f"{failed} failed"] if failed else []))
