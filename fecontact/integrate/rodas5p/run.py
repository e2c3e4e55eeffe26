"""A run of the compiled integrator: what it goes on from, and what it has found."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.events import Events
from fecontact.integrate.rodas5p import state, step_loop
from fecontact.integrate.rodas5p.event_kernels import FOUND, Watch
from fecontact.integrate.rodas5p.state import Control, Progress, Room
from fecontact.integrate.rodas5p.variational import Variation


class Vary(NamedTuple):
    """Derivatives that go with a run, see :mod:`fecontact.integrate.rodas5p.variational`.

    ``transitions`` (N, k, size) holds, for each output time, the columns since the one before.
    """

    above: Any
    below: Any
    width: float
    variation: Variation
    transitions: Array


@dataclass(frozen=True, eq=False)
class Run:
    """A run of the compiled integrator that can be left and taken up again.

    Attributes
    ----------
    status : int
        ``step_loop.RUNNING`` while output times are left, ``FINISHED``, ``MINIMUM_STEP``,
        ``NOT_FINITE``, or ``STOPPED`` at an event.
    variation : Vary
        Derivatives that go with the run.
    states, work : arrays (N, 2 m + n s), (N, 8 + n)
        At the output times; rows from ``outputs`` on are not filled yet. Work of the powers
        :data:`fecontact.system.kernels.POWERS`, then friction work of each node [J].
    progress : Progress
        All that is needed to go on.
    watch : Watch
        What is watched for; what was found is in ``events``.
    """

    arrays: Any
    shapes: Array
    times: Array
    control: Control
    progress: Progress
    room: Room
    states: Array
    work: Array
    variation: Vary
    watch: Watch
    found: list[tuple[Array, Array]] = field(default_factory=list)

    @property
    def events(self) -> Events:
        """Events so far."""
        rows = [np.zeros((0, 3)), *(rows for rows, _ in self.found)]
        states = [np.zeros((0, self.states.shape[1])), *(states for _, states in self.found)]
        return Events.of_rows(np.vstack(rows), np.vstack(states))

    @property
    def outputs(self) -> int:
        """Number of output times passed."""
        return int(self.progress.counts[state.OUTPUTS])

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.progress.numbers[state.TIME])

    @property
    def attempts(self) -> int:
        """Steps so far, those that failed included."""
        counts = self.progress.counts
        return int(counts[state.STEPS] + counts[state.REJECTIONS])

    @property
    def statistics(self) -> dict[str, int]:
        """Counts of steps, rejected steps, right-hand sides and Jacobians."""
        counts = self.progress.counts
        return {"steps": int(counts[state.STEPS]),
                "rejected": int(counts[state.REJECTIONS]),
                "right_hand_sides": int(counts[state.RATES]),
                "jacobians": int(counts[state.STEPS]) + 1}

    def advance(self, steps: int) -> int:
        """So many steps more, those that fail included; returns the status."""
        status = step_loop.advance(self.arrays, self.shapes, self.times, self.control,
                                   self.progress, self.room, steps, self.states, self.work,
                                   *self.variation, self.watch)
        found = int(self.watch.counts[FOUND])
        if found:
            self.found.append((self.watch.found[:found].copy(), self.watch.states[:found].copy()))
            self.watch.counts[FOUND] = 0
        if not np.isfinite(self.watch.own_values).all():
            number = int(np.argmin(np.isfinite(self.watch.own_values)))
            raise InputError(f"'event {number}' is not a finite number before t = {self.time:.6g} "
                             f"s; its function g(t, y, p) must be finite for every state.")
        return int(status)
