"""Many runs of small systems side by side: which systems, and how runs are dealt to the lanes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
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
from fecontact.integrate.rodas5p.driver import ENDS, control_for, first_step, start
from fecontact.integrate.rodas5p.state import Control, Problem, Progress, Room
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
        found = [lane_address(int(law)) if law else 0 for law in given]
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


def _begin(system: ContactSystem, state: Array, times: Array, control: Control) -> Array:
    """The column of a run in the table of progress."""
    numbers = np.zeros(arrays.NUMBERS)
    begin, end = float(times[0]), float(times[-1])
    numbers[arrays.TIME], numbers[arrays.END] = begin, end
    numbers[arrays.STEP] = first_step(system, state, begin, control)
    numbers[arrays.SMALLEST] = 1e-14 * max(abs(begin), abs(end))
    numbers[arrays.NEXT_OUTPUT] = times[min(1, len(times) - 1)]
    return np.concatenate([numbers, state, np.zeros(system.basis.modes)])


class SideBySide:
    """Runs of one kind on their way through lanes.

    Parameters
    ----------
    numbers : list of int
        Those of the runs in their ensemble.
    members, states, times : sequences
        System, initial state and output times of each run.
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
        states: Sequence[Array], times: Array, rtol: float, max_step: float | None,
    ) -> None:
        for state in states:
            if not np.isfinite(state).all():
                raise InputError("The initial state holds values that are not finite.")
        self.numbers, self._kind = numbers, kind
        count, modes = len(members), kind.modes
        controls = [control_for(member, state, row, rtol=rtol, max_step=max_step, work=False)
                    for member, state, row in zip(members, states, times, strict=True)]
        self.runs = LaneRuns(
            np.array([_parameters(*pair) for pair in zip(members, controls, strict=True)]),
            np.array([_begin(*row) for row in zip(members, states, times, controls, strict=True)]),
            np.ascontiguousarray(times), np.full((count, times.shape[1], 2 * modes), np.nan),
            np.zeros((count, 4), dtype=np.int64), np.zeros(0, dtype=np.int64),
            np.zeros(4, dtype=np.int64))
        self._spare = start(members[0], states[0], times[0], rtol=rtol, max_step=max_step,
                            work=False, series="never")
        self._dealt, self._lock, self.attempts = 0, Lock(), 0

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
        while ended != step_loop.DONE and wanted():
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
            left = len(runs.ends) - self._dealt
            more = min(max(_DEALT - len(rest), 0), -(-left // (2 * workers)))
            queue = np.concatenate([rest, np.arange(self._dealt, self._dealt + more)])
            self._dealt += more
        runs.counts[TAKEN], runs.counts[WAITING] = 0, len(queue)
        runs.counts[OPEN] = left > more
        return runs._replace(queue=queue)


def side_by_side(
    members: Sequence[Any], state_of: Callable[[int], Array], times: Array, rtol: float,
    max_step: float | None, series: str,
) -> list[SideBySide]:
    """The runs of an ensemble that go through lanes, kind by kind.

    Those whose motion is expanded in power series, which takes less time, are not among them.
    """
    kinds: dict[Kind, list[int]] = {}
    known: dict[int, Kind | None] = {}
    for index, member in enumerate(members):
        if isinstance(member, ContactSystem) and series != "always":
            begin, end = float(times[index, 0]), float(times[index, -1])
            key = id(member)
            if key not in known or member.breakpoints(begin, end):
                found = kind_of(member, begin, end)
                if series == "auto" and found is not None and series_pay(member, begin, end):
                    found = None
                known[key] = found
            kind = known[key]
            if kind is not None:
                kinds.setdefault(kind, []).append(index)
    return [SideBySide(kind, numbers, [members[index] for index in numbers],
                       [state_of(index) for index in numbers], times[numbers], rtol, max_step)
            for kind, numbers in kinds.items()]


def _copied(item: Any) -> Any:
    """A tuple of arrays, all of which may be overwritten."""
    if isinstance(item, tuple):
        return type(item)(*map(_copied, item))
    return item.copy() if isinstance(item, np.ndarray) else item
