"""Dispatch of jobs to an executor; jobs lost with a worker are submitted again."""

import queue
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future
from dataclasses import dataclass, replace
from typing import Any

from fecontact.core.errors import AnalysisError, FecontactError
from fecontact.sweeps.executors import Pool


@dataclass(frozen=True)
class Job:
    """A function and its batch; ``breaks`` is 1 if the job may have crashed a worker.

    The batch is a dataclass with a tuple of ``cases``, such as
    :class:`fecontact.sweeps.batch.Batch`.
    """

    function: Callable[[Any], Any]
    batch: Any
    breaks: int = 0


class LostError(FecontactError):
    """A single case crashed its worker repeatedly."""

    def __init__(self) -> None:
        super().__init__("The process that computed it ended without a message; it may have needed "
                         "more memory than there is.")


def results(waiting: deque[Job], pool: Pool) -> Iterator[tuple[Job, Any]]:
    """Yield jobs and their results as they finish; ``waiting`` may grow meanwhile.

    When a worker crashes, the jobs it may have been running are repeated one by one. The job that
    crashes again is split into its cases. A single case that crashes its worker is returned with
    a :class:`LostError`.

    Raises
    ------
    FecontactError
        As raised by the functions, and if the executor has been shut down.
    """
    flying: dict[Future[Any], Job] = {}
    done: queue.SimpleQueue[Future[Any]] = queue.SimpleQueue()
    try:
        while waiting or flying:
            broken = not _launch(waiting, flying, done, pool)
            future = None if broken else done.get()
            if future is not None:
                job = flying.pop(future)
                try:
                    result = future.result()
                except BrokenExecutor:
                    flying[future] = job
                    broken = True
                except (FecontactError, KeyboardInterrupt):
                    raise
                except BaseException as error:
                    if type(error).__name__ != "KilledWorker":
                        raise _stopped(error) from error
                    yield job, LostError()
                else:
                    yield job, result
            if broken:
                suspects = []
                for future, job in flying.items():
                    if future.done() and not future.cancelled() and future.exception() is None:
                        yield job, future.result()
                    else:
                        suspects.append(job)
                flying, done = {}, queue.SimpleQueue()
                pool.renew()
                for job in reversed(suspects):
                    if not job.breaks:
                        waiting.appendleft(replace(job, breaks=1))
                    elif len(job.batch.cases) == 1:
                        yield job, LostError()
                    else:
                        waiting.extendleft(
                            replace(job, batch=replace(job.batch, cases=(case,)))
                            for case in reversed(job.batch.cases))
    finally:
        pool.cancel(flying)


def _launch(
    waiting: deque[Job], flying: "dict[Future[Any], Job]", done: "queue.SimpleQueue[Future[Any]]",
    pool: Pool,
) -> bool:
    """Submit the jobs that can run; False if the executor is broken."""
    while waiting and len(flying) < pool.window:
        alone = waiting[0].breaks or any(job.breaks for job in flying.values())
        if alone and flying:
            break
        job = waiting.popleft()
        try:
            future = pool.submit(job.function, job.batch)
        except BrokenExecutor:
            waiting.appendleft(job)
            return False
        except RuntimeError as error:
            raise _stopped(error) from error
        flying[future] = job
        future.add_done_callback(done.put)
    return True


def _stopped(error: BaseException) -> AnalysisError:
    if isinstance(error, MemoryError):
        reason = "a worker ran out of memory; take fewer workers"
    elif isinstance(error, CancelledError):
        reason = "the scheduler has gone"
    else:
        reason = f"{type(error).__name__}: {str(error).rstrip('.')}"
    return AnalysisError(f"The sweep stopped: {reason}.")
