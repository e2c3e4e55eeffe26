"""A run of the compiled integrator: what it goes on from, and what it has found."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.integrate.collocation.room import JACOBIANS, Collocation
from fecontact.integrate.event_arrays import take_events
from fecontact.integrate.events import Events
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.integrate.rodas5p.method import Data, advance_for
from fecontact.integrate.rodas5p.state import Output, Problem, Progress, Room
from fecontact.integrate.rodas5p.variational import Vary
from fecontact.integrate.series.branches import Series
from fecontact.integrate.step_loop import OUTPUTS, RATES, REJECTIONS, STEPS, TIME


@dataclass(frozen=True, eq=False)
class Run:
    """A run of the compiled integrator that can be left and taken up again.

    Attributes
    ----------
    status : int
        ``step_loop.RUNNING`` while output times are left, ``FINISHED``, ``MINIMUM_STEP``,
        ``NOT_FINITE``, or ``STOPPED`` at an event.
    problem : Problem
        What is integrated, and how finely.
    output : Output
        Output times and what belongs to them; rows from ``outputs`` on are not filled yet. Work
        of the powers :data:`fecontact.system.powers.POWERS`, then friction work of each node and
        its part in stick [J].
    variation : Vary
        Derivatives that go with the run.
    progress : Progress
        All that is needed to go on.
    watch : Watch
        What is watched for; what was found is in ``events``.
    series : Series or None
        Tables of a system whose motion is expanded in power series; else None.
    collocation : Collocation or None
        What steps by collocation hand on, and their room; None for steps of Rodas5P.
    """

    problem: Problem
    progress: Progress
    room: Room
    output: Output
    variation: Vary
    watch: Watch
    series: Series | None = None
    collocation: Collocation | None = None
    found: list[tuple[Array, Array]] = field(default_factory=list)

    @property
    def times(self) -> Array:
        """Output times (N,) [s]."""
        return self.output.times

    @property
    def states(self) -> Array:
        """States (N, size) at the output times."""
        return self.output.states

    @property
    def work(self) -> Array:
        """Work (N, p + 2 n) up to the output times [J]."""
        return self.output.work

    @property
    def events(self) -> Events:
        """Events so far."""
        rows = [np.zeros((0, 3)), *(rows for rows, _ in self.found)]
        states = [np.zeros((0, self.states.shape[1])), *(states for _, states in self.found)]
        return Events.of_rows(np.vstack(rows), np.vstack(states))

    @property
    def outputs(self) -> int:
        """Number of output times passed."""
        return int(self.progress.counts[OUTPUTS])

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.progress.numbers[TIME])

    @property
    def attempts(self) -> int:
        """Steps so far, those that failed included."""
        counts = self.progress.counts
        return int(counts[STEPS] + counts[REJECTIONS])

    @property
    def statistics(self) -> dict[str, int]:
        """Counts of steps, rejected steps, right-hand sides and Jacobians, or of expansions."""
        counts = self.progress.counts
        if self.series is not None:
            return {"steps": int(counts[STEPS]), "rejected": int(counts[REJECTIONS]),
                    "expansions": int(counts[RATES])}
        jacobians = int(counts[STEPS]) + 1
        if self.collocation is not None:
            jacobians = int(self.collocation.flags[JACOBIANS])
        return {"steps": int(counts[STEPS]),
                "rejected": int(counts[REJECTIONS]),
                "right_hand_sides": int(counts[RATES]),
                "jacobians": jacobians}

    @property
    def transitions(self) -> Array:
        """Derivatives (N, size, columns) of the states to those at the output time before."""
        return np.swapaxes(self.variation.transitions, 1, 2)

    @cached_property
    def _advance(self) -> Callable[[int], int]:
        """What goes on by so many steps."""
        data: Any
        if self.series is not None:
            # Compiled for runs that need it only.
            from fecontact.integrate.series import method as by_series

            data = by_series.Data(self.problem, self.progress, self.output, self.watch,
                                  self.series)
            loop = by_series.advance_for(self.problem)
        elif self.collocation is not None:
            from fecontact.integrate.collocation import method as by_collocation

            data = by_collocation.Data(self.problem, self.progress, self.room, self.output,
                                       self.collocation, self.variation)
            nodes, _, modes = self.problem.system.rows.shape
            loop = by_collocation.SMALL.of(modes, nodes)
        else:
            data = Data(self.problem, self.progress, self.room, self.output, self.variation,
                        self.watch)
            loop = advance_for(self.problem, self.variation)
        return partial(loop, data)

    def advance(self, steps: int) -> int:
        """So many steps more, those that fail included; returns the status."""
        try:
            status = self._advance(steps)
        finally:
            # An interrupt shows when the compiled code has returned, and its events are there.
            take_events(self.watch, self.found, self.time)
        return int(status)
