"""Many runs of small systems side by side: which systems, and how runs are dealt to the lanes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.integrate.lanes import arrays, step_loop
from fecontact.integrate.lanes.small_systems import advance_for
from fecontact.integrate.lanes.arrays import OPEN, TAKEN, WAITING, LaneRuns, lanes_for, rows_of
from fecontact.integrate.rodas5p.driver import ENDS, control_for, first_step, start
from fecontact.integrate.rodas5p.state import Control
from fecontact.integrate.series.branches import chosen_series
from fecontact.integrate.trajectory import Status
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


def kind_of(system: ContactSystem, times: Array) -> Kind | None:
    """The kind of a system; None if it does not go side by side with others.

    It does if it is small and plane, on level ground, without friction with memory, and if there
    are functions for lanes of all its laws and signals.
    """
    s = system.arrays
    n, m = s.Tx.shape
    if (m > MOST_MODES or n > MOST_NODES or len(s.T2) or s.memory.any() or s.second_motion
            or s.friction_scale or system.ground.wavy
            or system.breakpoints(float(times[0]), float(times[-1]))):
        return None
    acts = (s.drive_stiffness != 0.0) | (s.drive_damping != 0.0)
    drive = np.where(acts, s.drive, 0)
    laws = [tuple(lane_address(int(law)) if law else 0 for law in given)
            for given in (s.normal, s.friction, drive, s.load, [s.ground_motion])]
    if any(law is None for given in laws for law in given):
        return None
    levels = max(len(law.onsets(nodes.stop - nodes.start))
                 for nodes, _, law in system.law_groups("normal"))
    return Kind(tuple(laws), not system._motions(),
                tuple(getattr(s, name).shape for name in _FIELDS),
                ((m,), (n,), (n,), (n,), (m,), (levels, n), (arrays.LIMITS,)))


def _parameters(system: ContactSystem, control: Control) -> Array:
    """The column of a run in the table of parameters."""
    limits = [control.rtol, control.longest, control.speed_scale, control.ground[4]]
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
    members, states, times : sequences
        System, initial state and output times of each run.
    rtol, max_step : float
        As for :func:`fecontact.integrate.rodas5p.driver.start`.
    """

    def __init__(
        self, kind: Kind, members: Sequence[ContactSystem], states: Sequence[Array],
        times: Array, rtol: float, max_step: float | None,
    ) -> None:
        for state in states:
            if not np.isfinite(state).all():
                raise InputError("The initial state holds values that are not finite.")
        self.kind, self._members, self._states = kind, members, states
        self._rtol, self._max_step = rtol, max_step
        count, modes = len(members), kind.shapes[0][0]
        controls = [control_for(member, state, row, rtol=rtol, max_step=max_step, work=False)
                    for member, state, row in zip(members, states, times, strict=True)]
        self.runs = LaneRuns(
            np.array([_parameters(*pair) for pair in zip(members, controls, strict=True)]),
            np.array([_begin(*row) for row in zip(members, states, times, controls, strict=True)]),
            np.ascontiguousarray(times), np.full((count, times.shape[1], 2 * modes), np.nan),
            np.zeros((count, 4), dtype=np.int64), np.zeros(0, dtype=np.int64),
            np.zeros(4, dtype=np.int64))
        self._dealt, self._lock = 0, Lock()

    def work(self, workers: int, wanted: Callable[[], bool]) -> None:
        """Go on with runs that no other worker has until none is left, or they are not wanted."""
        kind = self.kind
        nodes, modes = kind.shapes[7]
        lanes = lanes_for(list(kind.shapes), list(kind.limits),
                          [np.array(given, dtype=np.int64) for given in kind.laws[:4]]
                          + [kind.laws[4][0], int(kind.steady)], modes, nodes)
        spare = start(self._members[0], self._states[0], self.runs.times[0], rtol=self._rtol,
                      max_step=self._max_step, work=False)
        problem = _own(spare.problem)
        runs = self.runs._replace(counts=np.zeros(4, dtype=np.int64))
        advance = advance_for(modes, nodes)
        while wanted():
            runs = self._deal(runs, workers)
            if advance(lanes, runs, problem, spare.progress, spare.room,
                       _STEPS) == step_loop.DONE:
                return

    def _deal(self, runs: LaneRuns, workers: int) -> LaneRuns:
        """Fill the queue of a worker."""
        rest = runs.queue[runs.counts[TAKEN] : runs.counts[WAITING]]
        with self._lock:
            left = len(self._members) - self._dealt
            more = min(left, max(_DEALT - len(rest), 0), max(1, -(-left // (2 * workers))))
            queue = np.concatenate([rest, np.arange(self._dealt, self._dealt + more)])
            self._dealt += more
            left -= more
        runs.counts[TAKEN], runs.counts[WAITING], runs.counts[OPEN] = 0, len(queue), left > 0
        return runs._replace(queue=queue)


def _own(problem: Any) -> Any:
    """A problem whose arrays may be overwritten."""
    if isinstance(problem, tuple):
        return type(problem)(*map(_own, problem))
    return problem.copy() if isinstance(problem, np.ndarray) else problem
