"""Ensembles of runs: many parameter sets or initial states of one system, on all cores.

Each run is one compiled call that releases the GIL, so that threads share the cores without copying
data; only the requested states are kept. Runs of small systems go eight at once through the lanes
of a core's vector instructions (:mod:`fecontact.integrate.simd`).
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from numbers import Integral, Real
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_count, as_floats, require_kind, require_rtol
from fecontact.core.errors import LARGEST, InputError, require_positive
from fecontact.core.errors import shown as text_of
from fecontact.core.progress import progress_bar, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.core.units import Summarised, listed, span
from fecontact.integrate.event_table import Events
from fecontact.integrate.events import AnyEvent, as_events
from fecontact.integrate.field_runs.start import start_any, start_state
from fecontact.integrate.initial_state import Initial
from fecontact.integrate.rodas5p.driver import again
from fecontact.integrate.rodas5p.run import Run
from fecontact.integrate.simd.driver import SideBySide, side_by_side
from fecontact.integrate.simulate import (
    require_max_step,
    require_resolved_span,
    require_runs,
)
from fecontact.integrate.solvers import AUTO, CompiledSolver, Solver, require_solver
from fecontact.integrate.step_loop import RUNNING
from fecontact.integrate.step_runs import ENDS
from fecontact.integrate.task import Task
from fecontact.integrate.trajectory import Status
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import MOVING, Moving, in_time, state_size
from fecontact.system.forcing_period import forcing_period

# Most periods of an excitation, before states count and after.
_MOST_PERIODS = 10**15


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Summarised):
    """States of E runs at K times each.

    Attributes
    ----------
    times : (E, K) array
        [s].
    states : (E, K, 2 m + n s) array
        y = [q, q', z]; NaN after the end of a run that failed or stopped.
    status : tuple of Status
        How each run ended.
    steps : (E,) array
        Steps of the integrator.
    events : tuple of Events, or None
        Events located in each run; None if none were requested.
    """

    times: Array
    states: Array
    status: tuple[Status, ...]
    steps: Integers
    events: tuple[Events, ...] | None = None

    def summary(self) -> list[tuple[str, str]]:
        """Number of runs, how they ended, and their times."""
        ends = [f"{self.status.count(status)} {status.name.lower().replace('_', ' ')}"
                for status in dict.fromkeys(self.status)]
        return [
            ("runs", f"{len(self.status)}"), ("status", listed(ends)),
            ("time", span(self.times.ravel(), "s")), ("outputs", f"{self.times.shape[-1]}"),
            ("values of a state", f"{self.states.shape[-1]}"),
            ("steps", span(self.steps)),
        ]

    @property
    def finished(self) -> NDArray[np.bool_]:
        """Mask (E,) of the runs that reached their end."""
        return np.array([status is Status.FINISHED for status in self.status])


def ensemble(
    systems: Moving | Sequence[Moving],
    times: ArrayLike,
    *,
    initial: Initial | Sequence[Any] = "rest",
    solver: Solver = AUTO,
    rtol: float = 1e-6,
    max_step: float | None = None,
    chain: int = 1,
    in_all: int | None = None,
    events: AnyEvent | Sequence[AnyEvent] | None = None,
    workers: int | None = None,
    progress: bool | Callable[[int], None] | None = None,
) -> Ensemble:
    """Run many systems or fields, or one from many initial states; keep states at a few times.

    The results agree with those of :func:`fecontact.simulate` within the tolerance: compiled
    solvers integrate no powers here, whose errors limit its steps too. Threads share the cores. On
    each, eight runs of plane systems of one node and up to three modes, or two of each, go side by
    side, with the results of single ones up to rounding: on level and even ground, with at most 160
    internal variables per node, constant or harmonic excitation, no events, by Rodas5P or Auto.

    Parameters
    ----------
    systems : ContactSystem or VectorField, or sequence of E
        The modal bases may differ in everything but the size of the state; fields count at their
        base values, see :meth:`fecontact.bifurcation.VectorField.with_`.
    times : (K,) or (E, K) array
        Start of each run and the times to keep states at, ascending [s].
    initial : (E, size) array, sequence of E, or one for all
        Initial states, or anything that :func:`fecontact.integrate.initial_state` takes.
    solver : Auto, Rodas5P, Radau, PowerSeries, SetValued, Scipy or CVODE
        Solver of all runs; see :func:`fecontact.simulate`.
    rtol : float
        Relative tolerance.
    max_step : float, optional
        Longest step [s]; see :func:`fecontact.simulate`.
    chain : int
        Length of chains of runs, each on one core, in which a run starts from the last state of the
        one before, as when a parameter is moved slowly; from its own behind a run that failed.
    in_all : int, optional
        Number of runs that these are part of, if there are more: from 64 on those with internal
        variables go side by side.
    events : ContactEvents, Crossing, Event or sequence of them, optional
        Events to locate; a run that stops at one has no states after it.
    workers : int, optional
        Number of threads; by default one per core.
    progress : bool or callable, optional
        True for a progress bar; a function is called with the number of completed runs.

    Raises
    ------
    InputError
        For states or times that do not fit the systems, systems that the solver cannot run, and
        values out of range.
    """
    require_solver(solver)
    members, starts, instants = _members(systems, initial, times)
    require_rtol(rtol)
    require_max_step(max_step)
    chain = as_count(chain, "chain")
    in_all = None if in_all is None else as_count(in_all, "in_all")
    workers = None if workers is None else as_count(workers, "workers")
    count, kept = instants.shape
    states = np.full((count, kept, state_size(members[0])), np.nan)
    status = [Status.INTERRUPTED] * count
    steps = np.zeros(count, dtype=np.int64)
    watched = as_events(events)
    require_solver(solver, *(["events"] if watched else []))
    seen = [Events.none(state_size(members[0]))] * count
    for member in members:
        require_runs(solver, member, "ensemble")
    if isinstance(solver, CompiledSolver) and solver.checkpoint is not None:
        raise InputError(f"solver = {solver!r}: runs of an ensemble keep no checkpoint; leave it "
                         f"out.")
    done, leave = [0], [False]

    method = solver.method if isinstance(solver, CompiledSolver) else None

    def compiled(index: int, state: Array, before: "_Before") -> None:
        system = members[index]
        if before.run is not None and system is before.system and not watched and np.array_equal(
                instants[index], before.run.times):
            run: Any = again(before.run, before.system, state)
        else:
            run = start_any(system, state, instants[index], rtol=float(rtol), max_step=max_step,
                            events=watched, method=method or "rodas5p")
        before.keep(system, run)
        result = RUNNING
        while result == RUNNING:
            if leave[0]:
                raise _LeftError
            result = run.advance(100_000)
        states[index, : run.outputs] = run.states[: run.outputs]
        seen[index] = run.events
        status[index], steps[index] = ENDS[result], run.statistics["steps"]

    def other(index: int, state: Array, before: "_Before") -> None:
        def look(time: float) -> None:
            if leave[0]:
                raise _LeftError

        if kept == 1:
            states[index, 0], status[index] = state, Status.FINISHED
            return
        system = members[index]
        assert isinstance(system, ContactSystem)
        found = solver.run(Task(system, state, instants[index], float(rtol), max_step,
                                watched, progress=look))
        outputs = int(np.searchsorted(instants[index], found.time[-1], side="right"))
        states[index, :outputs] = found.states[:outputs]
        if found.events is not None:
            seen[index] = found.events
        status[index], steps[index] = found.status, found.statistics.get("steps", 0)

    run_one = compiled if method else other
    together: list[SideBySide] = []
    if method in ("auto", "rodas5p") and not watched:
        together = side_by_side(members, starts, instants, float(rtol), max_step, method,
                                int(chain), in_all)
    apart = set(range(count)).difference(*(one.numbers for one in together))
    firsts, turn = iter([first for first in range(0, count, chain) if first in apart]), Lock()

    def run_chains() -> None:
        before = _Before()
        while True:
            with turn:
                first = next(firsts, count)
            if first == count:
                return
            last: Array | None = None
            for index in range(first, min(first + chain, count)):
                try:
                    run_one(index, starts(index) if last is None else last, before)
                except _LeftError:
                    return
                end = states[index, -1]
                # A motion that escapes leaves no state to go on from.
                last = end if (np.abs(end) <= LARGEST).all() else None
                with turn:
                    done[0] += 1

    threads = min(workers or os.cpu_count() or 1, -(-count // chain))
    with (shown(progress, lambda: progress_bar("Running", count)) as tell, one_blas_thread,
          ThreadPoolExecutor(threads) as pool):
        pending = {pool.submit(one.work, threads, lambda: not leave[0])
                   for one in together for _ in range(threads)}
        pending |= {pool.submit(run_chains) for _ in range(threads)}
        try:
            while pending:
                ended, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in ended:
                    future.result()
                if tell is not None:
                    tell(done[0] + sum(one.done for one in together))
        except BaseException:
            leave[0] = True
            raise
    for one in together:
        states[one.numbers], steps[one.numbers] = one.runs.states, one.steps
        for index, outcome in zip(one.numbers, one.status, strict=True):
            status[index] = outcome
    return Ensemble(instants, states, tuple(status), steps, tuple(seen) if watched else None)


@dataclass
class _Before:
    """The last run of a thread, whose tables serve the next one of the same system."""

    system: ContactSystem | None = None
    run: Run | None = None

    def keep(self, system: Moving, run: Any) -> None:
        """Keep it if it is of a contact system."""
        if isinstance(system, ContactSystem):
            self.system, self.run = system, run


class _LeftError(Exception):
    """Raised in a run whose results are no longer wanted."""


def strobe(
    systems: Moving | Sequence[Moving],
    *,
    transient_periods: int,
    keep: int,
    period: float | ArrayLike | None = None,
    **settings: Any,
) -> Ensemble:
    """States once per period of the excitation, after a transient (stroboscopic map).

    Parameters
    ----------
    systems : ContactSystem or VectorField, or sequence of E
        The systems.
    transient_periods : int
        Number of periods before the first state that is kept.
    keep : int
        Number of states to keep, one per period.
    period : float or (E,) array, optional
        Sampling period [s]; by default that of each system's excitation.
    **settings
        As for :func:`ensemble`.

    Returns
    -------
    Ensemble
        With ``keep`` states per run.

    Raises
    ------
    InputError
        As :func:`ensemble`, or if a system is not excited periodically and no period is given.
    """
    for name, value, least in (
            ("transient_periods", transient_periods, 0), ("keep", keep, 1)):
        if not (isinstance(value, Integral) and value >= least):
            raise InputError(f"{name} = {text_of(value)} must be a whole number from {least} on.")
        if value > _MOST_PERIODS:
            raise InputError(f"{name} = {text_of(value)} must be at most {_MOST_PERIODS}: floating-"
                             f"point numbers cannot tell the periods behind apart.")
    given = [systems] if isinstance(systems, MOVING) else list(systems)
    if period is None:
        periods = np.array([forcing_period(system) for system in given])
    else:
        periods = as_floats(period, "period")
        for one in periods.ravel().tolist():
            require_positive("strobe", period=one)
    # Times of a run are made from these.
    require_memory("keep", int(keep), 16.0 * (1 + periods.size))
    counts = np.arange(transient_periods, transient_periods + keep, dtype=float)
    first = 1 if transient_periods else 0
    if transient_periods:
        counts = np.concatenate([[0.0], counts])
    found = ensemble(systems, periods.reshape(-1, 1) * counts if periods.ndim else periods * counts,
                     **settings)
    return Ensemble(found.times[:, first:], found.states[:, first:], found.status, found.steps,
                    found.events)


def _members(
    systems: Moving | Sequence[Moving], initial: Any, times: ArrayLike,
) -> tuple[list[Moving], Callable[[int], Array], Array]:
    """System and times of each run, and a function that returns its initial state."""
    require_kind("ensemble", (*MOVING, Sequence), systems=systems)
    instants = np.array(as_floats(times, "times"))
    single = isinstance(systems, MOVING)
    given = [systems] if isinstance(systems, MOVING) else list(systems)
    if not given:
        raise InputError("systems must be a ContactSystem, a VectorField or a list of them, not "
                         "empty.")
    for place, system in enumerate(given):
        if not isinstance(system, MOVING):
            raise InputError(f"systems[{place}] = {text_of(system)} must be a ContactSystem or a "
                             f"VectorField.")
    members = [in_time("ensemble", system) for system in given]
    many = initial if is_many(initial) else None
    count = len(members) if not single else len(many) if many is not None else (
        len(instants) if instants.ndim == 2 else 1)
    members = members * count if single else members
    sizes = {state_size(system) for system in members}
    if len(sizes) > 1:
        raise InputError(f"The states of all systems must have the same size, not {sorted(sizes)}.")
    if not count:
        raise InputError(f"initial = {text_of(initial)} holds no states; give one for each run.")
    if many is not None and len(many) != count:
        raise InputError(f"There are {len(many)} initial states for {count} systems.")
    # Times, states and the largest of what is derived from them.
    require_memory("ensemble: the number of times", instants.shape[-1] if instants.ndim else 1,
                   8.0 * count * (3 + max(sizes)), ", or fewer runs")
    if instants.ndim == 1 or (instants.ndim and len(instants) == 1):
        instants = np.tile(instants, (count, 1))
    if instants.ndim != 2 or len(instants) != count or instants.shape[1] < 1 or (
            not np.isfinite(instants).all() or not (np.diff(instants, axis=1) > 0.0).all()):
        raise InputError(f"times must be ascending and finite, of shape (K,) or ({count}, K), not "
                         f"{np.shape(times)}.")
    if instants.shape[1] > 1:
        for begin, end in instants[:, [0, -1]].tolist():
            require_resolved_span("the last of the times", end, "the first", begin)

    def state(index: int) -> Array:
        given = initial if many is None else many[index]
        return start_state(members[index], given, float(instants[index, 0]))

    return members, state, np.ascontiguousarray(instants)


def is_many(initial: Any) -> bool:
    """Whether there is an initial state for each run; a list of numbers is one state."""
    if isinstance(initial, list | tuple):
        return not all(isinstance(value, Real) for value in initial)
    return isinstance(initial, np.ndarray) and initial.ndim == 2
