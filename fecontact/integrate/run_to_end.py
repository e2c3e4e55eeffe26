"""Runs that go on in pieces, to their end or as far as they come."""

import time as clock
from collections.abc import Callable
from typing import Protocol

import numpy as np

from fecontact.integrate import step_loop
from fecontact.integrate.trajectory import Status

# Steps of a piece of a run: at first, at least and at most.
_FEWEST, _MOST_STEPS = 200, 10_000_000
# How a run ended, by what the step loop returns.
ENDS = {step_loop.FINISHED: Status.FINISHED, step_loop.MINIMUM_STEP: Status.MINIMUM_STEP,
        step_loop.NOT_FINITE: Status.NOT_FINITE, step_loop.STOPPED: Status.EVENT,
        step_loop.PARADOX: Status.PARADOX, step_loop.IMPACT_UNSOLVED: Status.IMPACT_UNSOLVED}


class Advancing(Protocol):
    """A run that can be left and taken up again."""

    @property
    def attempts(self) -> int:
        """Steps so far, those that failed included."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    def advance(self, most: int) -> int:
        """Try so many steps; ``step_loop.RUNNING`` while output times are left."""


def finish(
    run: Advancing, progress: Callable[[float], None] | None = None, seconds: float = 0.2,
    keep: Callable[[], None] | None = None,
) -> int:
    """Go on to the end or a failure, reporting about every ``seconds``; the status.

    ``keep`` is called after every piece of the run.
    """
    steps = _FEWEST
    while True:
        begin, first = clock.perf_counter(), run.attempts
        status, done, passed = step_loop.RUNNING, 0, 0.0
        # A call returns early when its events fill the table.
        while status == step_loop.RUNNING and done < steps and passed < seconds:
            status = run.advance(steps - done)
            done, passed = run.attempts - first, clock.perf_counter() - begin
        if progress is not None:
            progress(run.time)
        if status != step_loop.RUNNING:
            return status
        if keep is not None:
            keep()
        steps = int(np.clip(done * seconds / max(passed, 1e-9), _FEWEST,
                            min(10 * steps, _MOST_STEPS)))
