"""The phases of a periodic motion, from a state on it."""

import numpy as np

from fecontact.bifurcation.events.conditions import PhaseSequence
from fecontact.bifurcation.events.flow import decide
from fecontact.bifurcation.events.phases import PERIOD, Motion, Phase
from fecontact.core.errors import AnalysisError
from fecontact.core.records import allocate
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.event_search import Workspace
from fecontact.integrate.nonsmooth.problem import (
    OPEN,
    SLIP_SIZE,
    STICK,
    Progress,
    progress_for,
    sizes_of,
)
from fecontact.integrate.nonsmooth.rigid_stops import NO_ACCELERATION, NO_IMPULSES

# Samples of a period in which events are sought, and most events of one.
_SAMPLES, _MOST = 1000, 60
# Part of a period below which phases are chatter.
_SHORTEST = 1e-5
_CLOSELY = "The motion has events that follow each other too closely."
# Speeds below this part of the largest are none.
_NEAR = 1e-9
# Heights below this part of the largest displacement are rounding at the begin of a motion.
_AT_REST = 1e-11


def traced(
    motion: Motion, begin: float, start: Array, period: float, forced: bool
) -> PhaseSequence:
    """Phases of the motion from a state, over one period.

    They begin behind the first event, or at a multiple of the period where there is none.

    Raises
    ------
    AnalysisError
        For motions without events that nothing excites, with more than 60 events, chatter, or
        compliant contacts that open: their runs can be differenced, but not traced.
    """
    phases, begins, states = _followed(motion, begin, start, period)
    if len(phases) == 1:
        if not forced:
            raise AnalysisError("The motion has no events.")
        end = period * np.ceil(begin / period)
        moved = motion.reached(begin, end - begin, start, phases[0]) if end > begin else start
        return _measured(motion, (phases[0].ending(PERIOD),), np.zeros(1), moved[None],
                         np.array([period]))
    if np.diff(begins[1:]).min(initial=period) < _SHORTEST * period:
        raise AnalysisError(_CLOSELY)
    # The phase after the last event leads to the first event again, a period later.
    if phases[-1].state != phases[0].state:
        raise AnalysisError("The contact state does not repeat after the period; run the motion "
                            "longer until it has settled.")
    last = phases[-1].ending(phases[0].event, phases[0].strike)
    found = [*phases[1:-1], last]
    ends = np.append(begins[2:], begins[1] + period)
    durations = ends - begins[1:]
    if durations.min() < _SHORTEST * period:
        raise AnalysisError(_CLOSELY)
    ordered = tuple(phase.ending(phase.event, phase.strike, order_of(motion, before, phase))
                    for before, phase in zip([found[-1], *found[:-1]], found, strict=True))
    return _measured(motion, ordered, begins[1:], states[1:], durations)


def _measured(
    motion: Motion, phases: tuple[Phase, ...], begins: Array, starts: Array, durations: Array
) -> PhaseSequence:
    """Phases with scales (2, 2 k + n) of speeds and heights, and of forces, from samples."""
    k = motion.clusters
    scales = np.zeros((2, 2 * k + motion.nodes))
    for phase, begin, start, duration in zip(phases, begins, starts, durations, strict=True):
        times = np.linspace(0.0, duration, 33)
        states = motion.run(begin, times, start, phase)[0]
        margins = motion.observed(begin + times, states, phase)[0]
        largest = np.where(np.isfinite(margins), np.abs(margins), 0.0).max(axis=0)
        for c in range(k):
            if phase.status[c] == STICK:
                limit = 0.5 * np.abs(margins[:, 2 * c] + margins[:, 2 * c + 1]).max()
                scales[1, 2 * c : 2 * c + 2] = np.maximum(scales[1, 2 * c : 2 * c + 2], limit)
            else:
                scales[0, 2 * c] = max(scales[0, 2 * c], largest[2 * c])
                scales[1, 2 * c + 1] = max(scales[1, 2 * c + 1], largest[2 * c + 1])
        for j in range(2 * k, 2 * k + motion.nodes):
            row = int(phase.closed[j - 2 * k])
            scales[row, j] = max(scales[row, j], largest[j])
    for kinds in scales:
        kinds[kinds == 0.0] = kinds.max() or 1.0
    return PhaseSequence(motion, phases, begins, starts, durations, scales)


def sizes_without_contact(motion: Motion, begin: float, start: Array, period: float) -> Array:
    """Sizes (d,) of the states for a system that contacts hold at rest: a / w^2 and a / w.

    a is the largest acceleration that it would have without them, w that of the period.
    """
    k, n, m = motion.clusters, motion.nodes, motion.modes
    times = begin + np.linspace(0.0, period, 33)
    free = motion.observed(times, np.tile(start, (len(times), 1)), Phase((OPEN,) * k, (0,) * n,
                                                                         PERIOD))[1][:, m:]
    turn, largest = period / (2.0 * np.pi), float(np.abs(free).max()) or 1.0
    return np.repeat([largest * turn**2, largest * turn], m)


def order_of(motion: Motion, before: Phase, phase: Phase) -> int:
    """Order of the zero of the phase's last event function at its begin; see :class:`Phase`."""
    cluster = before.cluster()
    if phase.event == PERIOD or phase.cluster() != cluster:
        return 0
    if cluster is None:
        stop = phase.stop
        if phase.event != before.event or phase.lifts_off():
            return 0
        # Behind an impact without rebound the speed vanishes too, and where the force of a stop
        # has vanished the acceleration.
        return 3 if before.closed[stop] else 2 if motion.problem.restitution[stop] == 0.0 else 1
    if phase.status[cluster] == STICK or before.status[cluster] == OPEN:
        return 0
    if before.status[cluster] != STICK:
        return 1
    return 1 if jumps(motion, cluster) else 2


def jumps(motion: Motion, cluster: int) -> bool:
    """Whether a cluster has less friction in slip than its limit in stick."""
    p = motion.problem
    given = motion.problem.static[p.cluster == cluster]
    if (given < 0.0).all():
        return False
    own = motion.kinetic[p.cluster == cluster]
    return bool((given > own * (1.0 + 1e-9)).any())


def _followed(
    motion: Motion, begin: float, start: Array, period: float
) -> tuple[list[Phase], Array, Array]:
    """Phases from a state on, the last of which is cut, with begins and states there."""
    progress = progress_for(motion.problem, motion.rubbing, start, begin, 0.0)
    workspace = allocate(Workspace, sizes_of(motion.problem))
    phases: list[Phase] = []
    begins, states, t = [begin], [start], begin
    _first_state(motion, progress, workspace, t)
    if motion.problem.rigid == 0:
        progress.closed[:] = 1
    while True:
        phase = Phase(tuple(progress.status.tolist()), tuple(progress.closed.tolist()), PERIOD)
        if motion.problem.rigid == 0 and OPEN in phase.status:
            raise AnalysisError("A compliant contact opens.")
        found = _first_event(motion, phase, t, states[-1], begin + period - t, period)
        if found is None:
            return [*phases, phase], np.array(begins), np.array(states)
        after, event, end = found
        if motion.problem.rigid == 0 and phase.opens(event):
            raise AnalysisError("A compliant contact opens.")
        ending = phase.ending(event)
        t += after
        moved = _decided(motion, progress, workspace, t, end, ending)
        if ending.stop >= 0 and not ending.lifts_off():
            struck = motion.strike_at(t, end, ending, moved[motion.modes :])
            ending = phase.ending(event, struck)
            moved = motion.struck(t, end, ending)
        phases.append(ending)
        if len(phases) > _MOST:
            raise AnalysisError(f"The motion has more than {_MOST} events.")
        begins.append(t)
        states.append(moved)


def _first_state(motion: Motion, progress: Progress, workspace: Workspace, t: float) -> None:
    """Decide which clusters stick and which stops are closed at the start."""
    phase = Phase(tuple(progress.status.tolist()), tuple(progress.closed.tolist()), PERIOD)
    d = 2 * motion.modes
    heights = motion.observed_at(t, progress.state[:d], phase)[0]
    if motion.problem.rigid:
        scale = float(motion.sizes[: motion.modes].max())
        workspace.touched[:] = heights[2 * motion.clusters :] <= _AT_REST * scale
    _require_decided(motion, progress, workspace, t)


def _require_decided(motion: Motion, progress: Progress, workspace: Workspace, t: float) -> None:
    fastest = float(motion.sizes[motion.modes :].max())
    progress.largest[SLIP_SIZE] = fastest
    # Elsewhere it is the time of a flight.
    if decide(motion.problem, motion.evaluation, progress, workspace, t, _NEAR * fastest,
              1e-12 * fastest) in (NO_ACCELERATION, NO_IMPULSES):
        raise AnalysisError("The contact state is not unique there.")


def _decided(
    motion: Motion, progress: Progress, workspace: Workspace, t: float, state: Array, phase: Phase
) -> Array:
    """The state after an event, and the new contact state in ``progress``."""
    d, event, k = 2 * motion.modes, phase.event, motion.clusters
    progress.state[:d] = state
    progress.status[:], progress.closed[:] = phase.contact
    for flags in (workspace.released, workspace.arrived, workspace.touched, workspace.parting):
        flags[:] = False
    if event < 2 * k:
        c = event // 2
        if phase.status[c] == STICK:
            workspace.released[c] = True
            progress.status[c] = released_sense(event)
        else:
            workspace.arrived[c] = True
    else:
        flags = workspace.parting if phase.lifts_off() else workspace.touched
        flags[phase.stop] = True
    _require_decided(motion, progress, workspace, t)
    return progress.state[:d].copy()


def released_sense(event: int) -> int:
    """Sense in which a cluster begins to slip whose margin vanishes in stick."""
    return 1 if event % 2 == 0 else -1


def _first_event(
    motion: Motion, phase: Phase, t: float, state: Array, left: float, period: float
) -> tuple[float, int, Array] | None:
    """Time to the first event within the time that is left, its event function, and the state."""
    from scipy.optimize import brentq

    if left <= 0.0:
        return None
    times = np.linspace(0.0, left, max(8, int(np.ceil(_SAMPLES * left / period))) + 1)
    # The event function that began a phase, such as the height after an impact, is zero at first.
    fine = np.concatenate([times[:1], times[1] * np.array([1e-3, 1e-2, 1e-1]), times[1:]])
    states = motion.run(t, fine, state, phase)[0]
    margins = motion.observed(t + fine, states, phase)[0]
    first: tuple[float, int] | None = None
    for event in range(margins.shape[1]):
        column = margins[:, event]
        if not np.isfinite(column).all():
            continue
        scale = np.abs(column).max() or 1.0
        passed = np.flatnonzero((column[1:] < 0.0) & (column[:-1] > 1e-12 * scale))
        if not len(passed):
            continue
        place = int(passed[0])

        def left_of(after: float, event: int = event, place: int = place) -> float:
            reached = motion.reached(t + fine[place], after - fine[place], states[place], phase)
            return float(motion.observed_at(t + after, reached, phase)[0][event])

        at = float(brentq(left_of, fine[place], fine[place + 1], xtol=1e-15 * period, rtol=1e-14))
        if first is None or at < first[0]:
            first = at, event
    if first is None:
        return None
    at, event = first
    return at, event, motion.reached(t, at, state, phase)

