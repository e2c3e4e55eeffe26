"""Many runs of small systems side by side: which systems, and how runs are dealt to the lanes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import Any

import numpy as np

from fecontact.core.checks import require_state
from fecontact.core.records import reader
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p.blocks import one_block
from fecontact.integrate.rodas5p.driver import control_for, start
from fecontact.integrate.rodas5p.state import NUMBERS, Problem
from fecontact.integrate.series.branches import series_pay
from fecontact.integrate.simd import arrays, step_loop
from fecontact.integrate.simd.arrays import ATTEMPTS, OPEN, TAKEN, WAITING, Alone, Lanes, Runs
from fecontact.integrate.small_systems import FEW
from fecontact.integrate.step_loop import FINISHED, RUNNING, TIME
from fecontact.integrate.step_runs import ENDS
from fecontact.integrate.trajectory import Status
from fecontact.laws.simd import simd_address
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import exact_arrays, slider_counts
from fecontact.system.nodes import SystemArrays

# Steps of a call, in all lanes; runs that a worker takes at once, at most.
_STEPS, _DEALT = 20_000, 32

# Runs with internal variables from which on it pays to compile their steps, which no one does
# ahead of time.
_MANY = 64

# Internal variables of a node, at most: eight lanes hold matrices of their squares. With four, runs
# side by side are ten times as fast as one by one, with 8 to 160 twice to four times.
_MOST_STATES = 160

# Integers of a system that are addresses of laws.
_LAWS = ("normal", "friction", "drive", "load", "ground_motion")


@dataclass(frozen=True)
class Kind:
    """Common properties of runs that go side by side: laws by address, integers, and shapes.

    ``size`` are the numbers of modes, contact nodes and internal variables of a node, ``levels``
    that of penetrations at which normal forces begin or end, ``sliders`` those of elastic Coulomb
    elements of each node.
    """

    laws: tuple[tuple[int, ...], ...]
    integers: tuple[bytes, ...]
    shapes: tuple[tuple[int, ...], ...]
    levels: int
    size: tuple[int, int, int]
    sliders: tuple[int, ...]

    def eight(self, problem: Problem) -> Problem:
        """A problem of this kind with the integers that eight systems have."""
        laws: dict[str, Any] = {
            name: np.array(given, dtype=np.int64) if np.ndim(getattr(problem.system, name))
            else given[0] for name, given in zip(_LAWS, self.laws, strict=True)}
        return problem._replace(system=problem.system._replace(
            **laws, on_ground=np.zeros_like(problem.system.on_ground), follows_surface=0))


def kind_of(system: ContactSystem, begin: float, end: float) -> Kind | None:
    """The kind of a system; None if it does not go side by side with others.

    It does if it is plane and of a usual size, on level ground that moves as one, without
    large deflections, without breaks of what is given in time, and if there are functions for eight
    of all its laws and signals.
    """
    counts = slider_counts(system)
    s = exact_arrays(system.arrays, counts)
    (n, d, m), states = s.rows.shape, system.memory
    if ((m, n) not in FEW or d > 2 or states > _MOST_STATES or (s.memory != states).any()
            or s.second_motion or s.friction_scale or len(s.polynomial_pairs)
            or system.ground.wavy or system.breakpoints(begin, end)):
        return None
    acts = (s.drive_stiffness != 0.0) | (s.drive_damping != 0.0)
    laws = []
    for name in _LAWS:
        # Along axes without spring or dashpot nothing is driven.
        given = np.where(acts, s.drive, 0) if name == "drive" else np.atleast_1d(getattr(s, name))
        found = [simd_address(int(law)) if law else 0 for law in given]
        if None in found:
            return None
        laws.append(tuple(law for law in found if law is not None))
    none: dict[str, Any] = dict.fromkeys(_LAWS, 0)
    others = s._replace(**none)
    levels = max(len(law.onsets(nodes.stop - nodes.start))
                 for nodes, _, law in system.law_groups("normal"))
    integers = reader(SystemArrays, int, Integers)(others)
    return Kind(tuple(laws), tuple(np.asarray(one).tobytes() for one in integers),
                tuple(one.shape for one in reader(SystemArrays, Array)(s)), levels, (m, n, states),
                tuple(counts.tolist()))


def problem_of(
    system: ContactSystem, times: Array, rtol: float, max_step: float | None,
) -> Problem:
    """A system in one block, and the limits of its steps as single runs have them."""
    s = exact_arrays(system.arrays, slider_counts(system))
    shapes = s.rows.swapaxes(0, 1).reshape(-1, s.rows.shape[2]).T.copy()
    return Problem(s, one_block(shapes, len(s.gap)), control_for(
        system, np.zeros(system.size), times, rtol=rtol, max_step=max_step, work=False))


def _starts(times: Array, size: int, modes: int) -> Array:
    """Columns of runs from rest in the table of starts, which first steps are not yet in."""
    found = np.zeros((len(times), arrays.LIMITS + NUMBERS + size + modes))
    begin, end = times[:, 0], times[:, -1]
    found[:, arrays.LIMITS + TIME], found[:, arrays.END] = begin, end
    found[:, arrays.SMALLEST] = 1e-14 * np.maximum(np.abs(begin), np.abs(end))
    found[:, arrays.NEXT_OUTPUT] = times[:, min(1, times.shape[1] - 1)]
    return found


class SideBySide:
    """Runs of one kind on their way through lanes.

    Parameters
    ----------
    numbers : list of int
        Numbers of the runs in their ensemble.
    members, times : sequences
        System and output times of each run.
    state_of : callable
        Initial state of a run, by its number here; it is asked for when a worker takes the run.
    follows : list of bool
        Whether a run begins where the one before it has ended; from its own initial state if that
        one has failed.
    rtol, max_step : float
        As for :func:`fecontact.integrate.rodas5p.driver.start`.

    Attributes
    ----------
    runs : Runs
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
        count, size, modes = len(members), members[0].size, kind.size[0]
        known: dict[tuple[int, float, float], Array] = {}
        keys = [_key(*pair) for pair in zip(members, times, strict=True)]
        for key, member, row in zip(keys, members, times, strict=True):
            if key not in known:
                known[key] = arrays.column_of(problem_of(member, row, rtol, max_step))
        self.runs = Runs(
            np.array([known[key] for key in keys]), _starts(times, size, modes),
            np.ascontiguousarray(times), np.full((count, times.shape[1], size), np.nan),
            np.array(follows, dtype=np.int64), np.zeros((count, 4), dtype=np.int64),
            np.zeros(0, dtype=np.int64), np.zeros(4, dtype=np.int64))
        self._spare = start(members[0], np.zeros(size), times[0], rtol=rtol, max_step=max_step,
                            work=False, method="rodas5p")
        self._problem = problem_of(members[0], times[0], rtol, max_step)
        self._waiting = np.flatnonzero(self.runs.follows == 0).tolist()
        self._lock, self.attempts = Lock(), 0

    def _start(self, run: int) -> None:
        """Let a run begin from its initial state."""
        state = self._state_of(run)
        require_state(state, np.inf)
        first = arrays.LIMITS + NUMBERS
        self.runs.starts[run, first : first + len(state)] = state

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
        """Status of each run at its end."""
        return [ENDS.get(int(ended), Status.INTERRUPTED)
                for ended in self.runs.ends[:, arrays.STATUS]]

    def work(self, workers: int, wanted: Callable[[], bool]) -> None:
        """Go on with runs that no other worker has until none is left, or they are not wanted."""
        lanes = self.lanes()
        spare = self.spare(lanes)
        runs = self.runs._replace(counts=np.zeros(4, dtype=np.int64))
        loop = step_loop.WITH_SLIDERS if any(self._kind.sliders) else step_loop.SMALL
        advance = loop.of(*self._kind.size)
        ended = step_loop.GOES_ON
        while wanted() and (ended != step_loop.DONE or self._resume()):
            runs = self._dealt_to(runs, workers)
            ended = advance(lanes, runs, spare, _STEPS)
        with self._lock:
            self.attempts += int(runs.counts[ATTEMPTS])

    def lanes(self) -> Lanes:
        """Empty lanes for these runs."""
        return arrays.lanes_for(self._problem, self._kind.eight(self._problem),
                                self.runs.starts.shape[1])

    def spare(self, lanes: Lanes) -> Alone:
        """A run alone for what is looked at in single lanes."""
        own = arrays.seen_in(lanes.column, self._problem)
        own = own._replace(control=own.control._replace(speed_scale=0.0))
        # All nodes are near.
        workspace = _copied(self._spare.workspace)._replace(near=own.blocks)
        return Alone(own, _copied(self._spare.progress), workspace, self._spare.variation)

    def _dealt_to(self, runs: Runs, workers: int) -> Runs:
        """Return the runs with a longer queue; at the end each worker takes few at once."""
        rest = runs.queue[runs.counts[TAKEN] : runs.counts[WAITING]]
        with self._lock:
            left = len(self._waiting)
            more = min(max(_DEALT - len(rest), 0), -(-left // (2 * workers)))
            dealt = self._waiting[:more]
            del self._waiting[:more]
        for run in dealt:
            self._start(run)
        queue = np.concatenate([rest, np.array(dealt, dtype=np.int64)])
        runs.counts[TAKEN], runs.counts[WAITING] = 0, len(queue)
        runs.counts[OPEN] = left > more
        return runs._replace(queue=queue)

    def _resume(self) -> bool:
        """Let chains go on behind runs that have failed; whether runs wait for a lane."""
        with self._lock:
            status = self.runs.ends[:, arrays.STATUS]
            failed = (status != FINISHED) & (status != RUNNING)
            for run in np.flatnonzero(failed[:-1] & (self.runs.follows[1:] != 0)).tolist():
                self.runs.follows[run + 1] = 0
                self._waiting.append(run + 1)
            return bool(self._waiting)


def side_by_side(
    members: Sequence[Any], state_of: Callable[[int], Array], times: Array, rtol: float,
    max_step: float | None, method: str, chain: int = 1, in_all: int | None = None,
) -> list[SideBySide]:
    """The runs of an ensemble that go through lanes, kind by kind; chains as a whole.

    Runs whose motion is expanded in power series, which takes less time, are left out, and so are
    runs with internal variables if there are few ``in_all``.
    """
    many = max(in_all or 0, len(members)) >= _MANY
    kinds: dict[Kind, list[int]] = {}
    known: dict[tuple[int, float, float], Kind | None] = {}

    def kind(index: int) -> Kind | None:
        member, key = members[index], _key(members[index], times[index])
        if not isinstance(member, ContactSystem):
            return None
        if key not in known:
            begin, end = key[1:]
            found = kind_of(member, begin, end)
            if method == "auto" and found is not None and series_pay(member, begin, end):
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
            for one, numbers in kinds.items() if one.size[2] == 0 or many]


def _key(member: Any, times: Array) -> tuple[int, float, float]:
    """Key shared by runs whose steps have the same limits."""
    return id(member), float(times[0]), float(times[-1])


def _state_of(state_of: Callable[[int], Array], numbers: list[int], run: int) -> Array:
    return state_of(numbers[run])


def _copied(item: Any) -> Any:
    """A tuple of arrays, all of which may be overwritten."""
    if isinstance(item, tuple):
        return type(item)(*map(_copied, item))
    return item.copy() if isinstance(item, np.ndarray) else item
