"""Many runs of small systems side by side: which systems, and how runs are dealt to the lanes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.integrate.courses import QUICKEST
from fecontact.integrate.lanes import arrays, step_loop
from fecontact.integrate.lanes.arrays import (
    ATTEMPTS,
    OPEN,
    TAKEN,
    WAITING,
    LaneRuns,
    Lanes,
    lanes_for,
)
from fecontact.integrate.lanes.small_systems import advance_for
from fecontact.integrate.rodas5p.blocks import one_block
from fecontact.integrate.rodas5p.driver import ENDS, control_for, start
from fecontact.integrate.rodas5p.state import Control, Problem, Progress, Room
from fecontact.integrate.rodas5p.step_loop import FINISHED, RUNNING
from fecontact.integrate.series.branches import series_pay
from fecontact.integrate.trajectory import Status
from fecontact.laws.ground.motion import constant_speed
from fecontact.laws.lanes import lane_address
from fecontact.system.contact_system import ContactSystem

# The most modes and nodes of small systems.
MOST_MODES, MOST_NODES = 4, 2
# Steps of a call, in all lanes; runs that a worker takes at once, at most.
_STEPS, _DEALT = 20_000, 32

# Fields of `SystemArrays` that are parameters of lanes, in the order of `LaneSystem`.
_FIELDS = arrays.LaneSystem._fields[:16]


@dataclass(frozen=True)
class Kind:
    """What runs have in common that go side by side: laws by address, and shapes of parameters."""

    laws: tuple[tuple[int, ...], ...]
    steady: bool
    shapes: tuple[tuple[int, ...], ...]
    limits: tuple[tuple[int, ...], ...]

    @property
    def modes(self) -> int:
        """Number of modes."""
        return self.shapes[_FIELDS.index("Tx")][1]

    @property
    def nodes(self) -> int:
        """Number of contact nodes."""
        return self.shapes[_FIELDS.index("Tx")][0]


def kind_of(system: ContactSystem, begin: float, end: float) -> Kind | None:
    """The kind of a system; None if it does not go side by side with others.

    It does if it is small and plane, on level ground, without friction with memory, and if there
    are functions for lanes of all its laws and signals.
    """
    s = system.arrays
    n, m = s.Tx.shape
    if (m > MOST_MODES or n > MOST_NODES or len(s.T2) or s.memory.any() or s.second_motion
            or s.friction_scale or system.ground.wavy
            or system.breakpoints(begin, end)):
        return None
    acts = (s.drive_stiffness != 0.0) | (s.drive_damping != 0.0)
    drive = np.where(acts, s.drive, 0)
    laws = []
    for given in (s.normal, s.friction, drive, s.load, [s.ground_motion]):
        # Along axes without spring or dashpot nothing is driven.
        found = [0 if given is drive and not law else lane_address(int(law)) for law in given]
        if None in found:
            return None
        laws.append(tuple(law for law in found if law is not None))
    levels = max(len(law.onsets(nodes.stop - nodes.start))
                 for nodes, _, law in system.law_groups("normal"))
    return Kind(tuple(laws), s.ground_motion == constant_speed.address,
                tuple(getattr(s, name).shape for name in _FIELDS),
                ((m,), (n,), (n,), (n,), (m,), (levels, n), (arrays.LIMITS,)))


def _parameters(system: ContactSystem, control: Control) -> Array:
    """The column of a run in the table of parameters."""
    limits = [control.rtol, control.longest, control.speed_scale, control.ground[QUICKEST]]
    return np.concatenate([
        *(getattr(system.arrays, name).ravel() for name in _FIELDS), control.displacement_scale,
        control.slip_scale, control.slow, control.depth, control.largest, control.levels.ravel(),
        limits])


def _begin(state: Array, times: Array) -> Array:
    """The column of a run in the table of progress, which the first step is not yet in."""
    numbers = np.zeros(arrays.NUMBERS)
    begin, end = float(times[0]), float(times[-1])
    numbers[arrays.TIME], numbers[arrays.END] = begin, end
    numbers[arrays.SMALLEST] = 1e-14 * max(abs(begin), abs(end))
    numbers[arrays.NEXT_OUTPUT] = times[min(1, len(times) - 1)]
    return np.concatenate([numbers, state, np.zeros(len(state) // 2)])


class SideBySide:
    """Runs of one kind on their way through lanes.

    Parameters
    ----------
    numbers : list of int
        Those of the runs in their ensemble.
    members, times : sequences
        System and output times of each run.
    state_of : callable
        Initial state of a run, by its number here.
    follows : list of bool
        Whether a run begins where the one before it has ended; from its own initial state if that
        one has failed.
    rtol, max_step : float
        As for :func:`fecontact.integrate.rodas5p.driver.start`.

    Attributes
    ----------
    runs : LaneRuns
        The runs and what is known of them.
    attempts : int
        Steps that workers which are done have tried, each in all lanes at once.
    """

    def __init__(
        self, kind: Kind, numbers: list[int], members: Sequence[ContactSystem],
        state_of: Callable[[int], Array], follows: Sequence[bool], times: Array, rtol: float,
        max_step: float | None,
    ) -> None:
        self.numbers, self._kind, self._state_of = numbers, kind, state_of
        count, rest = len(members), np.zeros(2 * kind.modes)
        limits: dict[tuple[int, float, float], Control] = {}
        for member, row in zip(members, times, strict=True):
            if _key(member, row) not in limits:
                limits[_key(member, row)] = control_for(member, rest, row, rtol=rtol,
                                                        max_step=max_step, work=False)
        controls = [limits[_key(*pair)] for pair in zip(members, times, strict=True)]
        starts = [rest if later else self._start(run) for run, later in enumerate(follows)]
        self.runs = LaneRuns(
            np.array([_parameters(*pair) for pair in zip(members, controls, strict=True)]),
            np.array([_begin(*pair) for pair in zip(starts, times, strict=True)]),
            np.ascontiguousarray(times), np.full((count, times.shape[1], len(rest)), np.nan),
            np.array(follows, dtype=np.int64), np.zeros((count, 4), dtype=np.int64),
            np.zeros(0, dtype=np.int64), np.zeros(4, dtype=np.int64))
        self._spare = start(members[0], rest, times[0], rtol=rtol, max_step=max_step, work=False,
                            series="never")
        self._waiting = np.flatnonzero(self.runs.follows == 0).tolist()
        self._lock, self.attempts = Lock(), 0

    def _start(self, run: int) -> Array:
        """Initial state of a run."""
        state = self._state_of(run)
        if not np.isfinite(state).all():
            raise InputError("The initial state holds values that are not finite.")
        return state

    @property
    def done(self) -> int:
        """Number of runs that have ended."""
        return int(np.count_nonzero(self.runs.ends[:, arrays.STATUS]))

    @property
    def steps(self) -> Integers:
        """Steps of each run."""
        return self.runs.ends[:, arrays.STEPS]

    @property
    def status(self) -> list[Status]:
        """How each run ended."""
        return [ENDS.get(int(ended), Status.INTERRUPTED)
                for ended in self.runs.ends[:, arrays.STATUS]]

    def work(self, workers: int, wanted: Callable[[], bool]) -> None:
        """Go on with runs that no other worker has until none is left, or they are not wanted."""
        lanes, spare = self.lanes(), self.spare()
        runs = self.runs._replace(counts=np.zeros(4, dtype=np.int64))
        advance = advance_for(self._kind.modes, self._kind.nodes)
        ended = step_loop.GOES_ON
        while wanted() and (ended != step_loop.DONE or self._resume()):
            runs = self._dealt_to(runs, workers)
            ended = advance(lanes, runs, *spare, _STEPS)
        with self._lock:
            self.attempts += int(runs.counts[ATTEMPTS])

    def lanes(self) -> Lanes:
        """Empty lanes for these runs."""
        kind = self._kind
        *laws, ground = (np.array(given, dtype=np.int64) for given in kind.laws)
        return lanes_for(kind.shapes, kind.limits, [*laws, int(ground[0]), int(kind.steady)],
                         kind.modes, kind.nodes)

    def spare(self) -> tuple[Problem, Progress, Room]:
        """Arrays of a run for checks of single lanes, which take the numbers of a lane."""
        problem = self._spare.problem
        own = problem._replace(
            blocks=one_block(problem.blocks.shapes, self._kind.nodes),
            control=problem.control._replace(speed_scale=0.0))
        return _copied(own), _copied(self._spare.progress), _copied(self._spare.room)

    def _dealt_to(self, runs: LaneRuns, workers: int) -> LaneRuns:
        """The same with more runs that wait; at the end each worker takes few at once."""
        rest = runs.queue[runs.counts[TAKEN] : runs.counts[WAITING]]
        with self._lock:
            left = len(self._waiting)
            more = min(max(_DEALT - len(rest), 0), -(-left // (2 * workers)))
            queue = np.concatenate([rest, np.array(self._waiting[:more], dtype=np.int64)])
            del self._waiting[:more]
        runs.counts[TAKEN], runs.counts[WAITING] = 0, len(queue)
        runs.counts[OPEN] = left > more
        return runs._replace(queue=queue)

    def _resume(self) -> bool:
        """Let chains go on behind runs that have failed; whether runs wait for a lane."""
        with self._lock:
            status = self.runs.ends[:, arrays.STATUS]
            failed = (status != FINISHED) & (status != RUNNING)
            for run in np.flatnonzero(failed[:-1] & (self.runs.follows[1:] != 0)).tolist():
                later = run + 1
                self.runs.starts[later] = _begin(self._start(later), self.runs.times[later])
                self.runs.follows[later] = 0
                self._waiting.append(later)
            return bool(self._waiting)


def side_by_side(
    members: Sequence[Any], state_of: Callable[[int], Array], times: Array, rtol: float,
    max_step: float | None, series: str, chain: int = 1,
) -> list[SideBySide]:
    """The runs of an ensemble that go through lanes, kind by kind; chains as a whole.

    Those whose motion is expanded in power series, which takes less time, are not among them.
    """
    kinds: dict[Kind, list[int]] = {}
    known: dict[tuple[int, float, float], Kind | None] = {}

    def kind(index: int) -> Kind | None:
        member, key = members[index], _key(members[index], times[index])
        if not isinstance(member, ContactSystem) or series == "always":
            return None
        if key not in known:
            begin, end = key[1:]
            found = kind_of(member, begin, end)
            if series == "auto" and found is not None and series_pay(member, begin, end):
                found = None
            known[key] = found
        return known[key]

    for first in range(0, len(members), chain):
        links = range(first, min(first + chain, len(members)))
        common = {kind(index) for index in links}
        one = common.pop()
        if one is not None and not common:
            kinds.setdefault(one, []).extend(links)
    return [SideBySide(one, numbers, [members[index] for index in numbers],
                       partial(_state_of, state_of, numbers),
                       [index % chain != 0 for index in numbers], times[numbers], rtol, max_step)
            for one, numbers in kinds.items()]


def _key(member: Any, times: Array) -> tuple[int, float, float]:
    """What tells runs apart whose steps have the same limits."""
    return id(member), float(times[0]), float(times[-1])


def _state_of(state_of: Callable[[int], Array], numbers: list[int], run: int) -> Array:
    return state_of(numbers[run])


def _copied(item: Any) -> Any:
    """A tuple of arrays, all of which may be overwritten."""
    if isinstance(item, tuple):
        return type(item)(*map(_copied, item))
    return item.copy() if isinstance(item, np.ndarray) else item
