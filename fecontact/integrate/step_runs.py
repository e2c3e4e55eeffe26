"""Runs by the step loop: they go on in pieces, to their end or as far as they come."""

import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.integrate import step_loop
from fecontact.integrate.event_arrays import take_events
from fecontact.integrate.event_table import Events
from fecontact.integrate.kept_rows import halve
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.integrate.trajectory import Status

# Steps of a piece of a run: at first, at least and at most.
_FEWEST, _MOST_STEPS = 200, 10_000_000
# Time between reports [s].
_SECONDS = 0.2
# How a run ended, by what the step loop returns.
ENDS = {step_loop.FINISHED: Status.FINISHED, step_loop.MINIMUM_STEP: Status.MINIMUM_STEP,
        step_loop.NOT_FINITE: Status.NOT_FINITE, step_loop.STOPPED: Status.EVENT,
        step_loop.PARADOX: Status.PARADOX, step_loop.IMPACT_UNSOLVED: Status.IMPACT_UNSOLVED}


class StepRun:
    """A run by the step loop that can be left and taken up again.

    Attributes
    ----------
    progress, output, kept : records
        From where it goes on, and what it fills, see :mod:`fecontact.integrate.step_loop`.
    watch : Watch
        Events to watch for.
    found : list
        Rows and states of the events so far.
    """

    progress: Any
    output: Any
    kept: Any
    watch: Watch
    found: list[tuple[Array, Array]]

    def step(self, most: int) -> int:
        """Try so many steps by the loop; how it ended."""
        raise NotImplementedError

    @property
    def times(self) -> Array:
        """Output times (N,) [s]."""
        return np.asarray(self.output.times)

    @property
    def states(self) -> Array:
        """States (N, size) at the output times; those passed are filled."""
        return np.asarray(self.output.states)

    @property
    def kept_rows(self) -> int:
        """Number of rows kept between the outputs."""
        return int(self.progress.counts[step_loop.KEPT])

    @property
    def outputs(self) -> int:
        """Number of output times passed."""
        return int(self.progress.counts[step_loop.OUTPUTS])

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.progress.numbers[step_loop.TIME])

    @property
    def attempts(self) -> int:
        """Steps so far, those that failed included."""
        counts = self.progress.counts
        return int(counts[step_loop.STEPS] + counts[step_loop.REJECTIONS])

    @property
    def statistics(self) -> dict[str, Any]:
        """Counts of steps, rejected steps, right-hand sides of the stages and Jacobians."""
        counts = self.progress.counts
        steps = int(counts[step_loop.STEPS])
        return {"steps": steps, "rejected": int(counts[step_loop.REJECTIONS]),
                "right_hand_sides": int(counts[step_loop.RATES]), "jacobians": steps + 1}

    @property
    def events(self) -> Events:
        """Events so far, in chronological order."""
        rows = [np.zeros((0, 3)), *(rows for rows, _ in self.found)]
        states = [self.watch.states[:0], *(states for _, states in self.found)]
        return Events.of_rows(np.vstack(rows), np.vstack(states))

    def advance(self, most: int) -> int:
        """Try so many steps; how the run stands, such as ``step_loop.RUNNING``.

        Raises
        ------
        InputError
            If an event is not finite.
        """
        counts = self.progress.counts
        if self.kept and step_loop.is_crowded(counts, self.kept.times):
            halve(self.kept, counts)
        try:
            status = self.step(most)
        finally:
            # An interrupt shows when the compiled code has returned, and its events are there.
            take_events(self.watch, self.found, self.time)
        return int(status)


def finish(
    run: StepRun, progress: Callable[[float], None] | None = None,
    keep: Callable[[], None] | None = None,
) -> int:
    """Go on to the end or a failure, with reports now and then; the status.

    ``keep`` is called after every piece of the run.
    """
    steps = _FEWEST
    while True:
        begin, first = clock.perf_counter(), run.attempts
        status, done, passed = step_loop.RUNNING, 0, 0.0
        # A call returns early when its events fill the table.
        while status == step_loop.RUNNING and done < steps and passed < _SECONDS:
            status = run.advance(steps - done)
            done, passed = run.attempts - first, clock.perf_counter() - begin
        if progress is not None:
            progress(run.time)
        if status != step_loop.RUNNING:
            return status
        if keep is not None:
            keep()
        steps = int(np.clip(done * _SECONDS / max(passed, 1e-9), _FEWEST,
                            min(10 * steps, _MOST_STEPS)))


def complete(
    run: StepRun, progress: Callable[[float], None] | None = None,
    keep: Callable[[], None] | None = None,
) -> Status:
    """Go on like :func:`finish`, or to an interrupt if there are results by then; how it ended."""
    try:
        return ENDS[finish(run, progress, keep=keep)]
    except KeyboardInterrupt:
        if not run.outputs:  # nothing was computed that could be kept
            raise
        return Status.INTERRUPTED


def until_end(run: StepRun, *columns: tuple[Array, Array]) -> list[Array]:
    """Output times passed, and rows there of ``columns``; also of the time reached, if later.

    Each column is its rows at the output times, and the row at the time reached.
    """
    done = run.outputs
    found = [run.times[:done], *(rows[:done] for rows, _ in columns)]
    # Some methods write the first output with their first step, which may fail.
    if done and run.time > found[0][-1] and np.isfinite(run.progress.state).all():
        last = [run.time, *(row for _, row in columns)]
        found = [np.concatenate([rows, [row]]) for rows, row in zip(found, last, strict=True)]
    return found
