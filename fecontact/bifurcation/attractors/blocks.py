"""Many runs in blocks, on threads or other processes, each block kept in a file where asked for.

A folder of blocks belongs to one computation, by the fingerprint in ``blocks.json``. Blocks are
written whole or not at all; those that are there are not computed again.
"""

import json
import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from os import cpu_count
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_count, as_path
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.files.atomic_write import clear_leftovers, output_folder, replaced, write_text
from fecontact.core.files.locks import locked
from fecontact.core.files.stored import DamagedError, from_json, npz_arrays, reading
from fecontact.core.resources.blas_threads import one_blas_thread

Found = dict[str, NDArray[Any]]
_ABOUT = "blocks.json"
_AHEAD = 1000  # blocks given to an executor that does not tell how many workers it has


class Block(Protocol):
    """Some runs that are computed together; others can pickle it."""

    @property
    def runs(self) -> int:
        """Number of runs."""

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the arrays that are found, by name."""

    def found(self, tell: Callable[[int], None] | None = None, workers: int | None = 1) -> Found:
        """Compute them on some threads; ``tell`` is called with the number of runs done."""


@dataclass(frozen=True)
class Place:
    """Folder and executor with which blocks are computed and kept.

    Attributes
    ----------
    folder : Path or None
        Folder of the finished blocks; None keeps them in memory.
    executor : Executor or None
        Executor that computes the blocks; None for ``workers`` threads of this process.
    """

    folder: Path | None
    executor: Executor | None
    workers: int | None

    @classmethod
    def checked(
        cls, owner: str, folder: str | Path | None, executor: Executor | None, workers: int | None,
    ) -> "Place":
        """The place that arguments name.

        Raises
        ------
        InputError
            For what is no executor, one without a folder, a number of workers beside it, and one
            that is no whole number from 1 on.
        """
        if executor is not None:
            if not callable(getattr(executor, "submit", None)):
                raise InputError(f"{owner}: executor = {executor!r} must have the methods of "
                                 f"concurrent.futures.Executor.")
            if folder is None:
                raise InputError(f"{owner}: an executor needs a folder, where finished blocks are "
                                 f"kept; give folder='runs' too.")
            if workers is not None:
                raise InputError(f"{owner}: workers = {workers!r} has no effect beside an "
                                 f"executor, which has its own; leave it out.")
        if workers is not None:
            workers = as_count(workers, "workers")
        return cls(None if folder is None else as_path(folder, f"{owner}: folder"), executor,
                   workers)


def work_off(
    blocks: Sequence[Block], place: Place, known: str, tell: Callable[[int], None] | None,
) -> list[Callable[[], Found]]:
    """Compute all blocks; return for each, in their order, a function that reads its results.

    Raises
    ------
    InputError
        If the folder cannot be written, is in use, or holds another computation.
    AnalysisError
        If the executor broke; finished blocks are kept.
    """
    if place.folder is None:
        kept, before = [], 0
        for block in blocks:
            kept.append(block.found(tell and partial(_tell_after, tell, before), place.workers))
            before += block.runs
        return [partial(kept.__getitem__, number) for number in range(len(blocks))]
    files = [place.folder / f"{number:06d}.npz" for number in range(len(blocks))]
    with _owned(place.folder, known, len(blocks)):
        missing = [number for number, file in enumerate(files) if not file.exists()]
        _compute(blocks, missing, place,
                 lambda number, found: _write(files[number], found), tell)
    return [partial(_read, file, block.shapes) for file, block in zip(files, blocks, strict=True)]


def _tell_after(tell: Callable[[int], None], before: int, runs: int) -> None:
    tell(before + runs)


@contextmanager
def _owned(folder: Path, known: str, count: int) -> Iterator[None]:
    """A folder that holds this computation, or nothing of any, and is not in use."""
    busy = (f"Another process computes blocks in {folder}; wait for it, or choose another folder.")
    with output_folder(folder), locked(folder / ".lock", busy, keep=True):
        about = folder / _ABOUT
        stored, wanted = None, {"fingerprint": known, "blocks": count}
        if about.exists():
            with reading(about, "not of fecontact"):
                stored = from_json(about.read_text(encoding="utf-8"), dict, "it")
        if stored != wanted:
            # Without blocks it is of a call that was refused, or ended before its first block.
            if stored is not None and any(folder.glob("*.npz")):
                raise InputError(f"{folder} holds the runs of another system, grid or version; "
                                 f"choose another folder, or remove it.")
            write_text(about, json.dumps(wanted) + "\n")
        clear_leftovers(folder)
        yield


def _write(path: Path, found: Found) -> None:
    with replaced(path) as part, part.open("wb") as file:
        np.savez(file, **found)  # type: ignore[arg-type]


def _read(path: Path, shapes: dict[str, tuple[int, ...]]) -> Found:
    with reading(path, "damaged; remove it, and its runs are computed again"):
        found = npz_arrays(path)
        for name, shape in shapes.items():
            if found[name].shape != shape or found[name].dtype.kind not in "fi":
                raise DamagedError(f"'{name}' has shape {found[name].shape}, not {shape}")
    return found


def _compute(
    blocks: Sequence[Block], numbers: Sequence[int], place: Place,
    keep: Callable[[int, Found], None], tell: Callable[[int], None] | None,
) -> None:
    """Compute some of the blocks, and keep each when it is done."""
    done = {number: blocks[number].runs for number in set(range(len(blocks))) - set(numbers)}

    def keep_one(number: int, found: Found) -> None:
        keep(number, found)
        done[number] = blocks[number].runs

    def tell_all() -> None:
        if tell is not None:
            tell(sum(list(done.values())))

    if place.executor is not None:
        _on_executor(blocks, numbers, place.executor, keep_one, tell_all)
        return
    left = [False]

    def run(number: int) -> Found:
        def count(runs: int) -> None:
            if left[0]:
                raise _LeftError
            done[number] = runs

        return blocks[number].found(count)

    with one_blas_thread, ThreadPoolExecutor(place.workers or cpu_count()) as pool:
        pending = {pool.submit(run, number): number for number in numbers}
        try:
            while pending:
                failed = _keep_ended(pending, keep_one)
                if failed is not None:
                    raise failed
                tell_all()
        except BaseException:
            left[0] = True
            for future in pending:
                future.cancel()
            raise


class _LeftError(Exception):
    """Raised in runs whose results are no longer wanted."""


def _on_executor(
    blocks: Sequence[Block], numbers: Sequence[int], executor: Executor,
    keep: Callable[[int, Found], None], tell: Callable[[], None],
) -> None:
    workers = getattr(executor, "_max_workers", None)
    window = 2 * workers + 2 if isinstance(workers, int) and workers > 0 else _AHEAD
    ahead = list(numbers)[::-1]
    flying: dict[Future[Found], int] = {}
    try:
        while ahead or flying:
            while ahead and len(flying) < window:
                try:
                    flying[executor.submit(found_of, blocks[ahead[-1]])] = ahead[-1]
                except RuntimeError as error:  # it was shut down
                    raise _broken(error) from error
                ahead.pop()
            failed = _keep_ended(flying, keep)
            if isinstance(failed, BrokenExecutor | CancelledError) or (
                    type(failed).__name__ == "KilledWorker"):  # of Dask
                raise _broken(failed) from failed
            if isinstance(failed, pickle.PicklingError) or (
                    isinstance(failed, AttributeError | TypeError)
                    and ("pickle" in str(failed) or "local object" in str(failed))):
                raise InputError(
                    f"The executor cannot send the runs to another process ({_reason(failed)}): "
                    f"a function as parameter, and functions and classes of laws and fields, must "
                    f"be ones that other processes can import, at the top of a module; or leave "
                    f"out the executor.") from failed
            if failed is not None:
                raise failed
            tell()
    finally:
        for future in flying:
            future.cancel()


def _keep_ended(
    flying: dict[Future[Found], int], keep: Callable[[int, Found], None],
) -> Exception | None:
    """Wait a little, and keep all blocks that have ended; the first error among them."""
    failed = None
    ended = wait(flying, timeout=0.2, return_when=FIRST_COMPLETED).done
    for future in sorted(ended, key=flying.__getitem__):
        try:
            keep(flying.pop(future), future.result())
        except Exception as error:
            failed = failed or error
    return failed


def _reason(error: BaseException | None) -> str:
    return str(error).partition("\n")[0].rstrip(".")


def _broken(error: BaseException | None) -> AnalysisError:
    reason = _reason(error) or "its work was cancelled"
    return AnalysisError(f"The executor broke ({reason}); finished blocks are kept: go on with a "
                         f"new executor and the same folder.")


def found_of(block: Block) -> Found:
    """Results of a block, for an executor of other processes."""
    return block.found()
