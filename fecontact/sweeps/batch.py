"""Batches, the unit of work of a worker: cases go in, rows of numbers come out.

Workers exchange nothing else with the parent process, so any executor can run them. They import
neither Gmsh (unless they generate meshes) nor VTK nor matplotlib.
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
from fecontact.core.files.stored import array, member
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.laws.registry import PART_CLASSES
from fecontact.output.files.hdf5 import new_file, open_file, store_basis, stored_basis
from fecontact.study.bodies_section import Reduced
from fecontact.study.study import Study
from fecontact.study.sweep_section import Strobing
from fecontact.sweeps.case import Row, SweepCase, of_basis
from fecontact.sweeps.strobed import strobed_rows
from fecontact.sweeps.summaries import functions_for, summarise

Functions = dict[str, Callable[[Trajectory], float]]

_BASES_KEPT = 4  # in a worker


@dataclass(frozen=True)
class Batch:
    """Cases that a worker computes together.

    Attributes
    ----------
    study : mapping
        Tables of the study before the changes of the cases.
    path : str or None
        File of the study.
    cases : tuple of SweepCase
    bases : mapping of key to bytes, Path or str
        Modal bases from :func:`packed`, paths of their files, or the reason why a basis cannot be
        computed; the worker computes missing ones.
    summaries : tuple of str
    t_start : float or None
        See :class:`fecontact.study.SweepSettings`.
    files : str or None
        Folder for the files of the cases; None to write none.
    frames : int
        Number of fields in each of them.
    strobe : Strobing or None
        Settings of stroboscopic runs, which keep only the states once per period.
    in_all : int
        Number of cases of the sweep.
    """

    study: Mapping[str, Any]
    path: str | None
    cases: tuple[SweepCase, ...]
    summaries: tuple[str, ...]
    t_start: float | None = None
    bases: Mapping[str, bytes | Path | str] = field(default_factory=dict)
    files: str | None = None
    frames: int = 0
    strobe: Strobing | None = None
    in_all: int = 1


class UnwritableError(FecontactError):
    """A case cannot be written to disk; neither can the cases after it."""


def run_batch(batch: Batch) -> list[Row]:
    """Compute all cases of a batch.

    The row of a failed case holds the reason; the other cases still run.

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
        return strobed_rows(batch.cases, batch.strobe,
                            lambda case: prepared(batch, study, case), batch.in_all)
    summaries: dict[Any, Functions] = {}
    return [_row(batch, study, case, summaries) for case in batch.cases]


def make_basis(batch: Batch) -> bytes | str:
    """Modal basis of the first case of a batch, packed, or the reason why it failed."""
    path = None if batch.path is None else Path(batch.path)
    try:
        study = Study.from_tables(batch.study, path).with_(**batch.cases[0].basis_changes)
        return packed(study.reduced, shapes=True)
    except FecontactError as error:
        return str(error)


def packed(reduced: Reduced, *, shapes: bool) -> bytes:
    """Serialise a modal basis; shapes over the body are included only on request."""
    basis = reduced.basis
    if not shapes:
        basis = replace(basis, mode_shapes=None, quality=None,
                        parts=tuple(replace(part, nodes=(0, 0)) for part in basis.parts))
    return pickle.dumps(replace(reduced, basis=basis))


def write_reduced(path: Path, reduced: Reduced) -> None:
    """Write a modal basis, and the gaps between several bodies, to an HDF5 file."""
    with new_file(path) as file:
        store_basis(file.create_group("basis"), reduced.basis)
        if reduced.gaps is not None:
            file.create_dataset("gaps", data=reduced.gaps)


def read_reduced(path: Path) -> Reduced:
    """Read what :func:`write_reduced` wrote; InputError for a damaged file."""
    with open_file(path, "basis") as file:
        basis = stored_basis(member(file, "basis"))
        return Reduced(basis, array(file, "gaps", (basis.contact_nodes,))
                       if "gaps" in file else None)


def _row(batch: Batch, base: Study, case: SweepCase, summaries: dict[Any, Functions]) -> Row:
    try:
        trajectory, study = _run(batch, base, case)
        known = study.wear.law_if_any, study.thickness
        if known not in summaries:
            summaries[known] = functions_for(
                batch.summaries, study.folder, wear=known[0], thickness=known[1])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ModelWarning)
            values = summarise(trajectory, summaries[known], batch.t_start)
    except UnwritableError:
        raise
    except FecontactError as error:
        return Row(case=case.key, values={}, reason=str(error))
    except (MemoryError, OSError):
        raise
    except (Exception, SystemExit) as error:  # laws and summaries of the user may raise any
        return Row(case=case.key, values={}, reason=f"{type(error).__name__}: {error}")
    if batch.files is not None:
        _write(batch, case, study, trajectory)
    row = Row(case=case.key, values=values, reason="")
    said = [*(f"In this run {one}" for one in trajectory.limits_exceeded),
            *(str(one.message) for one in caught if issubclass(one.category, ModelWarning))]
    if said:
        row["warning"] = " ".join(dict.fromkeys(said))
    return row


def _run(batch: Batch, base: Study, case: SweepCase) -> tuple[Trajectory, Study]:
    study = prepared(batch, base, case)
    with warnings.catch_warnings():
        # Warnings go into the row of the case.
        warnings.simplefilter("ignore", ModelWarning)
        trajectory = study.run()
    if trajectory.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if trajectory.status not in (Status.FINISHED, Status.EVENT):
        place = trajectory.statistics.get("message", "")
        raise AnalysisError(f"{trajectory.status.value} {place}".strip())
    return trajectory, study


def changed(study: Study, changes: Mapping[str, Any]) -> Study:
    """Study with changes; ten times faster than ``with_`` if only parameters of laws change."""
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
        return study.with_(**changes)  # its message names the place in the study


def _present(study: Study, name: str) -> Any:
    if of_basis(name) or name.partition(".")[0] not in ("interfaces", *PART_CLASSES):
        return None
    value: Any = study
    for part in name.split("."):
        value = value.get(part) if isinstance(value, Mapping) else getattr(value, part, None)
    return value


def prepared(batch: Batch, base: Study, case: SweepCase) -> Study:
    """Study of a case, with its modal basis."""
    study = changed(base, case.changes)
    # with_ cannot be used: the basis may come from another process.
    vars(study)["_reduced"] = _reduced(batch, study, case.basis)
    return study


_bases: OrderedDict[tuple[str, bool], Reduced] = OrderedDict()


def _reduced(batch: Batch, study: Study, key: str) -> Reduced:
    """Basis of a key: cached in this process, sent with the batch, read from a file or computed."""
    at_places = any(isinstance(force.point, tuple) for force in study.load.forces)
    mark = key, batch.frames > 0 or at_places
    found = _bases.get(mark)
    if found is None:
        given = batch.bases.get(key)
        if isinstance(given, str):
            raise AnalysisError(given)
        found = (study.reduced if given is None else read_reduced(given)
                 if isinstance(given, Path) else pickle.loads(given))
        _bases[mark] = found
        while len(_bases) > _BASES_KEPT:
            _bases.popitem(last=False)
    return found


def case_file(folder: Path, key: str) -> Path:
    """Path of the file of a case."""
    return folder / f"{key}.vtkhdf"


def _write(batch: Batch, case: SweepCase, study: Study, trajectory: Trajectory) -> None:
    from fecontact.output.files.case import write_case

    assert batch.files is not None
    target = case_file(Path(batch.files), case.key)
    # Drop the computing time, the only part that is not reproducible to the last bit.
    statistics = {key: value for key, value in trajectory.statistics.items() if key != "seconds"}
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_case(target, replace(trajectory, statistics=statistics), frames=batch.frames,
                   study=study.to_toml())
    except (OSError, FecontactError) as error:
        reason = str(error) if isinstance(error, FecontactError) else unwritable(target, error)
        raise UnwritableError(reason) from None
