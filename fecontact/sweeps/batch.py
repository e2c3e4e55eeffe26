"""Batches, the unit of work of a worker: cases go in, rows of numbers come out.

A batch is all that goes to a worker and rows are all that come back, so that any executor will
do. Workers import neither Gmsh nor VTK nor matplotlib, unless they are to make meshes.
"""

import pickle
import warnings
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from fecontact.core.dotted_parameters import with_parameters
from fecontact.core.errors import AnalysisError, FecontactError, ModelWarning
from fecontact.core.files.atomic_write import unwritable
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.laws.registry import PART_CLASSES
from fecontact.output.files.hdf5 import read_basis
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.study.study import Study
from fecontact.study.sweep_section import Strobing
from fecontact.sweeps.case import Row, SweepCase
from fecontact.sweeps.strobed import strobed_rows
from fecontact.sweeps.summaries import functions_for, summarise

Functions = dict[str, Callable[[Trajectory], float]]

_BASES_KEPT = 4  # in a worker


@dataclass(frozen=True)
class Batch:
    """Cases that a worker computes in one go.

    Attributes
    ----------
    study : mapping
        Tables of the study that the cases change.
    path : str or None
        Its file.
    cases : tuple of SweepCase
    bases : mapping of key to bytes, Path or str
        Modal bases as :func:`packed` gives them, files of them, or the reason why there is none;
        those that are missing are computed by the worker.
    summaries : tuple of str
    t_start, wear_coefficient : float or None
        See :class:`fecontact.study.SweepSettings`.
    files : str or None
        Folder for a file of each case; None for no files.
    frames : int
        Number of fields in each of them.
    strobe : Strobing or None
        Runs of which only the states once per period are kept.
    """

    study: Mapping[str, Any]
    path: str | None
    cases: tuple[SweepCase, ...]
    summaries: tuple[str, ...]
    t_start: float | None = None
    wear_coefficient: float | None = None
    bases: Mapping[str, bytes | Path | str] = field(default_factory=dict)
    files: str | None = None
    frames: int = 0
    strobe: Strobing | None = None


class UnwritableError(FecontactError):
    """A case could not be written; the cases after it could not be either."""


def run_batch(batch: Batch) -> list[Row]:
    """Compute all cases of a batch.

    A case that fails has a reason in its row, and does not stop the others.

    Raises
    ------
    UnwritableError
        If the file of a case cannot be written.
    KeyboardInterrupt
        If Ctrl-C reached a run.
    """
    path = None if batch.path is None else Path(batch.path)
    study = Study.from_tables(batch.study, path)
    if batch.strobe is not None:
        return strobed_rows(batch.cases, batch.strobe, lambda case: prepared(batch, study, case))
    summaries: dict[float, Functions] = {}
    return [_row(batch, study, case, summaries) for case in batch.cases]


def make_basis(batch: Batch) -> bytes | str:
    """The modal basis of the first case of a batch, packed, or the reason why there is none."""
    path = None if batch.path is None else Path(batch.path)
    try:
        study = Study.from_tables(batch.study, path).with_(**batch.cases[0].basis_changes)
        return packed(study.modal_basis(), shapes=True)
    except FecontactError as error:
        return str(error)


def packed(basis: ModalBasis, *, shapes: bool) -> bytes:
    """A modal basis as bytes, without shapes over the body unless they are wanted."""
    return pickle.dumps(basis if shapes else replace(basis, mode_shapes=None, quality=None))


def _row(batch: Batch, base: Study, case: SweepCase, summaries: dict[float, Functions]) -> Row:
    try:
        trajectory, study = _run(batch, base, case)
        thickness = study.body.thickness
        if thickness not in summaries:
            summaries[thickness] = functions_for(
                batch.summaries, study.folder, wear_coefficient=batch.wear_coefficient,
                thickness=thickness)
        values = summarise(trajectory, summaries[thickness], batch.t_start)
    except UnwritableError:
        raise
    except FecontactError as error:
        return Row(case=case.key, values={}, reason=str(error))
    except (MemoryError, OSError):
        raise
    except Exception as error:  # a law or a summary of the user's may raise anything
        return Row(case=case.key, values={}, reason=f"{type(error).__name__}: {error}")
    if batch.files is not None:
        _write(batch, case, study, trajectory)
    row = Row(case=case.key, values=values, reason="")
    if trajectory.limits_exceeded:
        row["warning"] = " ".join(f"In this run {one}" for one in trajectory.limits_exceeded)
    return row


def _run(batch: Batch, base: Study, case: SweepCase) -> tuple[Trajectory, Study]:
    study = prepared(batch, base, case)
    with warnings.catch_warnings():
        # They go into the row.
        warnings.simplefilter("ignore", ModelWarning)
        trajectory = study.run()
    if trajectory.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if trajectory.status not in (Status.FINISHED, Status.EVENT):
        place = trajectory.statistics.get("message", "")
        raise AnalysisError(f"{trajectory.status.value} {place}".strip())
    return trajectory, study


def changed(study: Study, changes: Mapping[str, Any]) -> Study:
    """As ``study.with_(**changes)``, and ten times faster where numbers of laws change alone."""
    values = {}
    for name, value in changes.items():
        present = _present(study, name)
        if not isinstance(present, float) or isinstance(value, bool) or (
                not isinstance(value, int | float)):
            return study.with_(**changes)
        values[name] = float(value)
    try:
        return cast(Study, with_parameters(study, values))
    except FecontactError:
        return study.with_(**changes)  # whose message says where in the study it is


def _present(study: Study, name: str) -> Any:
    first, *rest = name.split(".")
    if first not in PART_CLASSES:
        return None
    value: Any = study
    for part in (first, *rest):
        value = getattr(value, part, None)
    return value


def prepared(batch: Batch, base: Study, case: SweepCase) -> Study:
    """The study of a case, with its modal basis."""
    study = changed(base, case.changes)
    # Not by with_: the basis may come from another process.
    vars(study)["_basis"] = _basis(batch, study, case.basis)
    return study


_bases: OrderedDict[tuple[str, bool], ModalBasis] = OrderedDict()


def _basis(batch: Batch, study: Study, key: str) -> ModalBasis:
    """The basis of a key: kept in this process, sent along, read from a file or computed."""
    mark = key, batch.frames > 0
    basis = _bases.get(mark)
    if basis is None:
        given = batch.bases.get(key)
        if isinstance(given, str):
            raise AnalysisError(given)
        basis = (study.modal_basis() if given is None else read_basis(given)
                 if isinstance(given, Path) else pickle.loads(given))
        _bases[mark] = basis
        while len(_bases) > _BASES_KEPT:
            _bases.popitem(last=False)
    return basis


def case_file(folder: Path, key: str) -> Path:
    """The file of a case."""
    return folder / f"{key}.vtkhdf"


def _write(batch: Batch, case: SweepCase, study: Study, trajectory: Trajectory) -> None:
    from fecontact.output.files.case import write_case

    assert batch.files is not None
    target = case_file(Path(batch.files), case.key)
    # How long it took differs from run to run, all else is the same to the last bit.
    statistics = {key: value for key, value in trajectory.statistics.items() if key != "seconds"}
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_case(target, replace(trajectory, statistics=statistics), frames=batch.frames,
                   study=study.to_toml())
    except (OSError, FecontactError) as error:
        reason = str(error) if isinstance(error, FecontactError) else unwritable(target, error)
        raise UnwritableError(reason) from None
