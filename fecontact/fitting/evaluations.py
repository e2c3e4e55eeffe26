"""Evaluations of a fit: the model at places in the ranges, in files, and on several processes."""

import hashlib
import json
import pickle
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    ThreadPoolExecutor,
    as_completed,
)
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.types import Array
from fecontact.fitting.problem import Problem
from fecontact.sweeps.executors import Pool, opened

STEP = 1e-3  # of differences, in parts of the range
# Relative difference of the derivatives to both sides from which on there is a kink between.
_KINK = 0.25
_SEARCHES = 64  # largest number of searches at a time
T = TypeVar("T")


def _numbers(problem: Problem, u: Array) -> Array | str:
    """Numbers of the model at places u, or why there are none."""
    try:
        return problem.predicted(u)
    except FecontactError as error:
        return str(error)


def _exact(problem: Problem, u: Array, k: int, wanted: tuple[int, ...]) -> list[Array | None]:
    return problem.derivatives(u, k, wanted)


@lru_cache(maxsize=1)
def unpacked(body: bytes) -> Any:
    """Object of its pickled form, which is unpacked once."""
    return pickle.loads(body)


_held: dict[str, Any] = {}


def _on_worker(job: tuple[str, bytes | None, Any, tuple[Any, ...]]) -> Any:
    """Result of a function of a problem, which is sent to each process once; None without it."""
    mark, body, function, arguments = job
    problem = _held.get(mark) if body is None else pickle.loads(body)
    if body is not None:
        _held.clear()
        _held[mark] = problem
    return None if problem is None else function(problem, *arguments)


class Workers:
    """Processes that evaluate a problem."""

    def __init__(self, pool: Pool, problem: Problem) -> None:
        self.pool, self.body = pool, pickle.dumps(problem)
        self.mark = hashlib.sha256(self.body).hexdigest()
        self.stopped = False

    def results(self, function: Any, arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
        """Results of ``function(problem, *one)`` for each one of the arguments."""
        flying = [self._sent(None, function, one) for one in arguments]
        found = [one.result() for one in flying]
        again = {k: self._sent(self.body, function, one)
                 for k, one in enumerate(arguments) if found[k] is None}
        return [again[k].result() if k in again else one for k, one in enumerate(found)]

    def _sent(self, body: bytes | None, function: Any, one: tuple[Any, ...]) -> Any:
        if self.stopped:
            raise CancelledError
        return self.pool.submit(_on_worker, (self.mark, body, function, one))


@dataclass(eq=False)
class Evaluator:
    """Evaluates a problem and keeps what was evaluated, also in a file.

    A fit that goes on repeats its search from the numbers in the file, so that its result is that
    of a fit without interruption.

    Attributes
    ----------
    problem : Problem
    file : Path or None
        Lines of JSON: the key of the problem, then places and predicted numbers.
    workers : Workers or None
        Processes that evaluate the model; None for this one.
    """

    problem: Problem
    file: Path | None = None
    workers: Workers | None = None
    evaluations: int = 0
    kinks: dict[str, float] = field(default_factory=dict)
    exact: dict[tuple[str, str], bool] = field(default_factory=dict)
    _known: dict[bytes, Array | str] = field(default_factory=dict)
    _lock: Any = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        if self.file is None:
            return
        key = self.problem.key()
        if self.file.exists():
            text = self.file.read_text(encoding="utf-8", errors="replace")
            lines = text.splitlines()
            if not lines or lines[0] != json.dumps({"key": key}):
                raise InputError(f"{self.file} is of a fit of another model or of other data; give "
                                 f"another folder, or replace it with overwrite = True.")
            for line in lines[1:]:
                try:
                    stored = json.loads(line)
                    place = np.array([float.fromhex(one) for one in stored["u"]])
                    self._known[place.tobytes()] = (
                        stored["failed"] if "failed" in stored else
                        np.array([float.fromhex(one) for one in stored["y"]]))
                except (ValueError, KeyError, TypeError):
                    continue  # the last line of a fit that was killed
            if not text.endswith("\n"):
                with self.file.open("a", encoding="utf-8") as stream:
                    stream.write("\n")
        else:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self.file.write_text(json.dumps({"key": key}) + "\n", encoding="utf-8")

    def predicted(self, u: Array) -> Array:
        """Numbers (n,) of the model at places u; FecontactError if it has none there."""
        self.evaluate([u])
        found = self._known[_mark(u)]
        if isinstance(found, str):
            raise AnalysisError(found)
        return found

    def evaluate(self, places: Sequence[Array]) -> None:
        """Evaluate the model at places that are not known yet, on all processes."""
        missing = list({_mark(u): u for u in places if _mark(u) not in self._known}.values())
        for u, found in zip(missing, self._results(_numbers, [(u,) for u in missing]),
                            strict=True):
            with self._lock:
                self.evaluations += 1
                self._known[_mark(u)] = found
                self._store(u, found)

    def _results(self, function: Any, arguments: Sequence[tuple[Any, ...]]) -> Any:
        """Results of a function of the problem, in turn."""
        if self.workers is None:
            return (function(self.problem, *one) for one in arguments)
        return self.workers.results(function, arguments)

    def _store(self, u: Array, found: Array | str) -> None:
        if self.file is None:
            return
        line: dict[str, Any] = {"u": [float(one).hex() for one in u]}
        line |= ({"failed": found} if isinstance(found, str)
                 else {"y": [float(one).hex() for one in found]})
        with self.file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")

    def residual(self, u: Array) -> Array:
        """Residuals (n,) in standard deviations."""
        return self.problem.whitened(self.predicted(u) - self.problem.measured)

    def jacobian(self, u: Array, free: Array | None = None) -> Array:
        """Derivatives (n, p) of the residuals over the places.

        Exact ones where the data have some, else central differences, one-sided at a bound and
        beside models that fail. Columns that are not ``free`` are zero.
        """
        problem = self.problem
        moving = range(len(u)) if free is None else np.flatnonzero(free).tolist()
        found = self._exact_parts(u, moving)
        rough = [k for k in moving if len(found[k]) < len(problem.data)]
        self.evaluate([moved for k in rough for moved in self._beside(u, k).values()])
        J = np.zeros((len(problem.measured), len(u)))
        for k in moving:
            if k in rough:
                J[:, k] = self._difference(u, k)
            for i, column in found[k].items():
                J[problem.parts[i], k] = column
        return problem.whitened(J)

    def _exact_parts(self, u: Array, moving: Sequence[int]) -> dict[int, dict[int, Array]]:
        """Exact derivatives over places k, by k and number of the data that have some."""
        titles, names = [one.title for one in self.problem.data], self.problem.names
        wanted = {k: tuple(i for i, title in enumerate(titles)
                           if self.problem.exact and self.exact.get((title, names[k]), True))
                  for k in moving}
        asked = [(u, k, wanted[k]) for k in moving if wanted[k]]
        given = dict(zip((k for _, k, _ in asked), self._results(_exact, asked), strict=True))
        found = {k: {i: one for i, one in zip(wanted[k], given.get(k, ()), strict=True)
                     if one is not None} for k in moving}
        for k in moving:
            for i, title in enumerate(titles):
                self.exact[title, names[k]] = i in found[k]
        return found

    def _beside(self, u: Array, k: int) -> dict[float, Array]:
        """Places beside u along place k by side, -1 and 1, those within the range."""
        found = {}
        for side in (-1.0, 1.0):
            moved = np.array(u, dtype=float)
            moved[k] = min(max(u[k] + side * STEP, 0.0), 1.0)
            if abs(moved[k] - u[k]) >= 0.5 * STEP:
                found[side] = moved
        return found

    def _difference(self, u: Array, k: int) -> Array:
        """Derivative (n,) of the predicted numbers over place k by differences."""
        sides: dict[float, Array] = {}
        reason = ""
        for side, moved in self._beside(u, k).items():
            try:
                sides[side] = (self.predicted(moved) - self.predicted(u)) / (moved[k] - u[k])
            except FecontactError as error:
                reason = str(error)
        if not sides:
            raise AnalysisError(f"The model fails on both sides of {self.problem.names[k]} = "
                                f"{self.problem.parameters[k].value(float(u[k])):g}: {reason}")
        if len(sides) == 2:
            apart = float(np.linalg.norm(self.problem.whitened(sides[1.0] - sides[-1.0])))
            size = float(np.linalg.norm(self.problem.whitened(sides[1.0] + sides[-1.0])))
            self.kinks[self.problem.names[k]] = apart / size if size > 0.0 else 0.0
        return np.asarray(sum(sides.values()) / len(sides))

    def kinked(self) -> list[str]:
        """Names of parameters whose last differences to both sides disagree."""
        return [name for name, apart in self.kinks.items() if apart > _KINK]


def searched(
    evaluators: Sequence[Evaluator], searches: Sequence[Callable[[], T]],
    executor: Executor | None, workers: int | None,
    tell: Callable[[int, int], None] | None = None,
) -> list[T]:
    """Results of searches: one after the other, or together if processes evaluate the model.

    Parameters
    ----------
    evaluators : sequence of Evaluator
        Evaluators of one problem, which the searches use.
    searches : sequence of callable
        The searches.
    executor, workers
        See :func:`fecontact.fit`.
    tell : callable, optional
        Called with the numbers of finished and of all searches.
    """
    count = len(searches)
    found: list[T] = []
    if executor is None and workers == 1:
        for one in searches:
            found.append(one())
            if tell is not None:
                tell(len(found), count)
        return found
    problem = evaluators[0].problem
    require_picklable(problem)
    threads = ThreadPoolExecutor(min(count, _SEARCHES))
    processes = None
    try:
        with opened(executor, workers) as pool:
            processes = Workers(pool, problem)
            for evaluator in evaluators:
                evaluator.workers = processes
            flying = [threads.submit(one) for one in searches]
            for done, future in enumerate(as_completed(flying), 1):
                future.result()
                if tell is not None:
                    tell(done, count)
        return [future.result() for future in flying]
    except BrokenExecutor:
        raise AnalysisError("fit: one of the processes that evaluate the model ended; take fewer "
                            "of them, or more memory. With a folder, what was evaluated is "
                            "kept.") from None
    finally:
        if processes is not None:
            processes.stopped = True
        for evaluator in evaluators:
            evaluator.workers = None
        threads.shutdown(cancel_futures=True)


def _mark(u: Array) -> bytes:
    return np.ascontiguousarray(u, dtype=float).tobytes()


def require_picklable(problem: Problem) -> None:
    """Raise InputError unless other processes can be given the problem."""
    try:
        pickle.dumps(problem)
    except Exception as error:
        raise InputError(f"fit: the model or the data cannot be sent to other processes "
                         f"({' '.join(str(error).split())[:200]}); define functions in a module, "
                         f"or leave out workers.") from None
