"""Events within the steps of other libraries' solvers, by the search of the compiled ones."""

from collections.abc import Callable

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.types import Array
from fecontact.integrate.event_arrays import take_events
from fecontact.integrate.event_table import Events
from fecontact.integrate.rodas5p import dynamics
from fecontact.integrate.rodas5p.event_kernels import Watch, begin, note_events_at
from fecontact.integrate.rodas5p.state import Problem, Progress, Step, Workspace
from fecontact.integrate.step_polynomials import set_ends, set_polynomials
from fecontact.integrate.task import Task
from fecontact.system.nodes import ground_motion

# Pieces of a step that are searched one by one: dense outputs have degree up to five, and twelve
# for LSODA where it is not stiff; that of a piece is taken to be four.
_PIECES = 4


class Watched:
    """Search for events in the steps of a run from a time and state."""

    def __init__(self, task: Task, t: float, state: Array) -> None:
        from fecontact.integrate.rodas5p.driver import start

        # Of this run no step is taken; it has the room that the search needs.
        self._run = start(task.system, state, task.times, rtol=task.rtol, work=False,
                          events=task.events, method="rodas5p")
        run = self._run
        _begin(t, run.problem, run.progress, run.workspace, run.watch)

    def look(
        self, t: float, end: float, latest: float, dense: Callable[[float], Array],
    ) -> float | None:
        """Note the events from t to the end of a step; the time at which the run ends, if any.

        ``latest`` is the last time at which what is given in time counts.

        Raises
        ------
        InputError
            If a user's function is not finite.
        """
        run = self._run
        size = len(run.progress.state)
        places = np.linspace(t, end, 4 * _PIECES + 1)
        states = np.array([dense(float(place))[:size] for place in places])
        for first in range(0, 4 * _PIECES, 4):
            _set_interpolant(states[first : first + 5], run.progress, run.workspace)
            low, h = float(places[first]), float(places[first + 4] - places[first])
            part = _search(low, h, latest, run.problem, run.progress, run.workspace, run.watch)
            take_events(run.watch, run.found, low + h)
            if part <= 1.0:
                return low + part * h
        return None

    @property
    def events(self) -> Events:
        """Events so far, in chronological order."""
        return self._run.events


def _set_interpolant(states: Array, progress: Progress, workspace: Workspace) -> None:
    """Let a piece of a step be the polynomial through five states, equally far apart."""
    first, last = states[0], states[4]
    # The rest beside the line through the ends, over s (1 - s), is quadratic.
    left, middle, right = ((states[k] - (1.0 - 0.25 * k) * first - 0.25 * k * last)
                           / (0.25 * k * (1.0 - 0.25 * k)) for k in (1, 2, 3))
    progress.state[:], workspace.after[:] = first, last
    workspace.dense[2] = 8.0 * (left - 2.0 * middle + right)
    workspace.dense[1] = 2.0 * (right - left) - workspace.dense[2]
    workspace.dense[0] = middle - 0.5 * workspace.dense[1] - 0.25 * workspace.dense[2]


@kernel
def _begin(t: float, problem: Problem, progress: Progress, workspace: Workspace,
           watch: Watch) -> None:
    """Take the state at the start of a run for that from which things change."""
    begin(t, progress.state, problem.system, problem.control.depth, watch, workspace.scratch)


@kernel
def _search(
    t: float, h: float, latest: float, problem: Problem, progress: Progress, workspace: Workspace,
    watch: Watch,
) -> float:
    """Note the events of a piece of a step; the part of it after which the run ends, or 2."""
    s, bounds = problem.system, problem.control.ground
    step = Step(t, h, t + h, latest, ground_motion(np.nextafter(t, t + h), s), 0.0, False)
    set_ends(t, progress.state, s, problem.blocks, bounds, workspace.ends)
    dynamics.project(problem.blocks, workspace.after, workspace.nodes[0], workspace.nodes[1])
    set_polynomials(s, problem.blocks, bounds, progress.state, workspace.after, workspace)
    return note_events_at(watch.note)(step, problem, progress, workspace, watch)
