"""Executors of batches: processes on this machine, a Dask cluster, or any other."""

import asyncio
import contextlib
import multiprocessing
import os
import re
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing.connection import wait
from typing import Any

from fecontact.core.errors import AnalysisError, InputError, MissingLibraryError

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
PATIENCE = 10.0  # for the Dask scheduler [s]
_PER_CORE = 32  # largest number of worker processes; more would only contend
_ADDRESS = re.compile(r"(?:\w+://)?(?:\[[0-9a-fA-F:.%]+\]|[^\s\[\]:/]+):(\d+)")


class Pool:
    """A user's executor, and the number of batches submitted in advance.

    The executor is not shut down at the end.
    """

    def __init__(self, executor: Executor) -> None:
        self.executor = executor
        # The number of workers of a cluster is unknown and may change.
        workers = getattr(executor, "_max_workers", None)
        self.window = 2 * workers + 2 if isinstance(workers, int) and workers > 0 else 1000

    def submit(self, function: Callable[[Any], Any], argument: Any) -> "Future[Any]":
        """Submit a call."""
        return self.executor.submit(function, argument)

    def renew(self) -> None:
        """Replace a broken executor.

        Raises
        ------
        AnalysisError
            If the executor cannot be replaced.
        """
        raise AnalysisError("The executor broke because one of its workers ended; finished cases "
                            "are kept, go on with a new executor and resume.")

    def cancel(self, futures: "Iterable[Future[Any]]") -> None:
        """Cancel the calls that have not begun."""
        for future in futures:
            future.cancel()

    def close(self, *, at_once: bool) -> None:
        """End the use of the executor; ``at_once`` cancels pending work."""


class Processes(Pool):
    """Processes on this machine, each with one thread for linear algebra."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        super().__init__(self._start())

    def _start(self) -> ProcessPoolExecutor:
        self._before = set(multiprocessing.active_children())
        executor = ProcessPoolExecutor(
            self.workers, mp_context=multiprocessing.get_context("spawn"), initializer=_begin)
        self._probe = executor.submit(os.getpid)
        return executor

    def renew(self) -> None:
        """Start new processes in place of those that ended."""
        if not self._probe.done() or self._probe.exception() is not None:
            raise AnalysisError("The worker processes end as soon as they start; a script must "
                                "call sweep below if __name__ == '__main__': and needs memory for "
                                f"{self.workers} processes.")
        self.close(at_once=True)
        self.executor = self._start()

    def cancel(self, futures: "Iterable[Future[Any]]") -> None:
        """Do nothing: ``close`` cancels what is pending.

        The thread that manages the processes fails (CPython before 3.12.1) where it finds futures
        cancelled by others when a process ends.
        """

    def close(self, *, at_once: bool) -> None:
        """End the processes."""
        mine = set(multiprocessing.active_children()) - self._before
        self.executor.shutdown(wait=not at_once, cancel_futures=True)
        if at_once:
            for child in mine:
                child.terminate()


def _begin() -> None:
    """Set up a worker: it ignores Ctrl-C and ends when its parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        def leave() -> None:
            wait([parent.sentinel])
            os._exit(1)

        threading.Thread(target=leave, daemon=True).start()


@contextlib.contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes started in this block use one thread for linear algebra."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def opened(executor: Executor | None, workers: int | None) -> Iterator[Pool]:
    """Wrap the executor as a pool, or start processes on this machine.

    Raises
    ------
    InputError
        If it is not an executor, or if a worker calls this while it imports the main script.
    """
    if executor is None:
        count = worker_count(workers)
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise SystemExit(1)  # the parent reports the error
        # Compile kernels once here instead of in every worker.
        with one_thread_each():
            yield from _closing(Processes(count))
        return
    if not callable(getattr(executor, "submit", None)):
        raise InputError(f"executor = {executor!r} must have the methods of "
                         f"concurrent.futures.Executor.")
    yield from _closing(Pool(executor))


def _closing(pool: Pool) -> Iterator[Pool]:
    try:
        yield pool
    except BaseException:
        pool.close(at_once=True)
        raise
    pool.close(at_once=False)


def worker_count(workers: int | None) -> int:
    """Number of worker processes, by default one per core; InputError if out of range."""
    count, most = cores() if workers is None else workers, _PER_CORE * cores()
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= most:
        raise InputError(f"workers = {count!r} must be a whole number from 1 to {most}, "
                         f"{_PER_CORE} for each of the {cores()} cores.")
    return count


def cores() -> int:
    """Number of cores available to this process."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def dask_executor(address: str, timeout: float | None = None) -> Iterator[Executor]:
    """Connect to a running Dask scheduler and return its executor.

    Parameters
    ----------
    address : str
        Like ``tcp://node1:8786``.
    timeout : float, optional
        Time to wait for the scheduler [s]; ten seconds by default.

    Raises
    ------
    MissingLibraryError
        If Dask is not installed.
    InputError
        If the address is invalid or no scheduler answers there.
    """
    timeout = PATIENCE if timeout is None else timeout
    found = _ADDRESS.fullmatch(address) if isinstance(address, str) else None
    if found is None or not 0 < int(found[1]) < 2**16:
        raise InputError(f"dask = {address!r} is not the address of a scheduler; give one like "
                         f"tcp://node1:8786, with a port from 1 to 65535.")
    try:
        from distributed import Client
    except ImportError:
        raise MissingLibraryError("A sweep over a cluster needs Dask; install it with "
                                  "pip install 'fecontact[dask]'.") from None
    try:
        _greet(address, timeout)
        client = Client(address, timeout=timeout, set_as_default=False)
    except Exception:  # servers of other kinds answer in any way
        raise InputError(f"No Dask scheduler answers at {address} within {timeout:g} s; start one "
                         f"with dask scheduler, and workers with dask worker {address}.") from None
    try:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            client.wait_for_workers(1, timeout=timeout)
        yield client.get_executor(pure=False)
    except TimeoutError:
        raise InputError(f"The Dask scheduler at {address} has no workers; start some with "
                         f"dask worker {address}.") from None
    finally:
        client.close(timeout=timeout)


def _greet(address: str, timeout: float) -> None:
    """Exchange the first messages with a Dask server; an exception if it does not answer in time.

    A client of Dask waits for them without limit at a server of another kind.
    """
    from distributed.comm.core import connect

    async def greet() -> None:
        comm = await asyncio.wait_for(connect(address, timeout=timeout), timeout)
        await comm.close()

    with ThreadPoolExecutor(1) as thread:  # notebooks have an event loop in theirs
        thread.submit(lambda: asyncio.run(greet())).result()
