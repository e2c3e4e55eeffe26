"""Names of the borders that orbits meet, and the phases of orbits beyond them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fecontact.bifurcation.events.conditions import (
    BEGIN,
    CROSSING,
    DURATION,
    RATE,
    STRIKE,
    WITHIN,
    Condition,
    crosses,
    crossing_event,
)
from fecontact.bifurcation.events.orbit import EventOrbit
from fecontact.bifurcation.events.phases import PERIOD, Motion, Phase
from fecontact.bifurcation.events.tracing import jumps, order_of, released_sense
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.problem import FIXED, OPEN, STICK

# Part of the period below which a phase vanishes together with another condition.
_VANISHING = 1e-5
# Part of the period after which a force is seen to grow or fall.
_SOON = 1e-4


def border_of(problem: EventOrbit, u: Array, condition: Condition) -> str:
    """Kind of the border at which the margin of a condition is zero."""
    phases, i = problem.phases, condition.phase
    phase, before, behind = phases[i], phases[i - 1], phases[(i + 1) % len(phases)]
    k = len(phase.status)
    if condition.what == DURATION:
        return _of_duration(before, phase, behind)
    if condition.what == STRIKE:
        return "impact-sliding" if condition.event < 2 * k else "lift-off"
    if condition.event >= 2 * k:
        closed = phase.closed[condition.event - 2 * k]
        if condition.what == BEGIN and condition.event != before.event:
            return "corner"
        return "lift-off" if closed else "grazing"
    cluster = condition.event // 2
    if condition.what in (RATE, WITHIN):
        if phase.status[cluster] == STICK:
            return "adding-sliding"
        return "grazing-sliding" if condition.event % 2 == 0 else "lift-off"
    # An impact that stops the slip is an event of the cluster too.
    stopped = (condition.what == CROSSING and before.strike is not None
               and before.strike.modes[cluster] == STICK)
    if before.cluster() != cluster and not stopped:
        return "corner"
    if condition.what == BEGIN and before.status[cluster] == released_sense(condition.event):
        return "grazing-sliding"
    stays = condition.what == CROSSING
    if stays and jumps(motion := problem.motion(u), cluster):
        return "switching-sliding" if _holds(problem, u, condition, motion) else "crossing-sliding"
    # The phase that begins at the border soon ends, or goes on.
    short = problem.durations(u)[i] < _VANISHING * problem.period(u)
    return "crossing-sliding" if short != stays else "switching-sliding"


def _holds(problem: EventOrbit, u: Array, condition: Condition, motion: Motion) -> bool:
    """Whether the force that slip through zero would stick with leaves its limit."""
    i, cluster = condition.phase, condition.event // 2
    held = problem.phases[i].with_status(cluster, STICK)
    begin, start = float(problem.begins(u)[i]), problem.starts(u)[i]
    times = np.array([0.0, _SOON * problem.period(u)])
    states = motion.run(begin, times, start, held)[0]
    here, there = motion.observed(begin + times, states, held)[0][:, condition.event]
    return bool(there > here)


def _of_duration(before: Phase, phase: Phase, behind: Phase) -> str:
    cluster = phase.cluster()
    if _of_others(before, phase):
        return "corner"
    if cluster is None:
        return "lift-off" if phase.lifts_off() or before.closed[phase.stop] else "grazing"
    first, here, last = (each.status[cluster] for each in (before, phase, behind))
    if here == STICK:
        return "grazing-sliding" if first == last else "crossing-sliding"
    return "adding-sliding" if first == last == STICK else "switching-sliding"


def _of_others(before: Phase, phase: Phase) -> bool:
    """Whether the events at both ends of a phase are those of different contacts."""
    cluster = phase.cluster()
    return cluster != before.cluster() or (cluster is None and before.event != phase.event)


def nodes_of(
    problem: EventOrbit, motion: Motion, condition: Condition, kind: str
) -> tuple[int, ...]:
    """Contact nodes to which the condition of a border belongs; at a corner those of both."""
    phase, before = problem.phases[condition.phase], problem.phases[condition.phase - 1]
    events = [condition.event]
    if kind == "corner":
        events.append(before.event)
    return tuple(sorted({node for event in events for node in _of_event(motion, phase, event)}))


def _of_event(motion: Motion, phase: Phase, event: int) -> list[int]:
    cluster = phase.cluster(max(event, 0))
    if cluster is None:
        return [event - 2 * motion.clusters]
    found: list[int] = np.flatnonzero(motion.problem.cluster == cluster).tolist()
    return found


class Successor:
    """An orbit in the making: phases with their starts and durations, and the first begin."""

    def __init__(self, problem: EventOrbit, u: Array) -> None:
        self.problem, self.motion = problem, problem.motion(u)
        self.phases = list(problem.phases)
        self.starts = list(problem.starts(u))
        self.durations = problem.durations(u).tolist()
        self.first, self.parameter = float(problem.begins(u)[0]), float(u[-1])

    def begin(self, i: int) -> float:
        """Begin of a phase [s]."""
        return self.first + sum(self.durations[:i])

    def drop(self, i: int) -> None:
        """Take out a phase without duration; its neighbours join if their states are the same."""
        count = len(self.phases)
        before, behind = (i - 1) % count, (i + 1) % count
        join = (self.phases[before].state == self.phases[behind].state
                and self.phases[before].strike is None)
        self._delete(i)
        if join:
            self.join((i - 1) % (count - 1))

    def swap(self, i: int) -> None:
        """Exchange the events at both ends of a phase without duration."""
        count = len(self.phases)
        before, phase, behind = (self.phases[(i + step) % count] for step in (-1, 0, 1))
        first = before.ending(phase.event, phase.strike)
        status, closed = (
            tuple(there if there != here else old for old, here, there in zip(*each, strict=True))
            for each in zip(before.state, phase.state, behind.state, strict=True))
        t, last = self.begin(i), (i - 1) % count
        state = self.motion.reached(t - self.durations[last], self.durations[last],
                                    self.starts[last], before)
        if first.strike is not None:
            state = self.motion.struck(t, state, first)
        self.phases[last] = first
        self.phases[i] = Phase(status, closed, before.event, before.strike)
        self.starts[i] = state

    def _delete(self, i: int) -> None:
        if i == 0:
            # The orbit now begins behind what was its second event.
            self.first += self.durations[0]
        for each in (self.phases, self.starts, self.durations):
            del each[i]

    def join(self, i: int) -> None:
        """Join a phase with the next one, which has the same contact state."""
        count = len(self.phases)
        if count == 1:
            self._without_events()
            return
        behind = (i + 1) % count
        following = self.phases[behind]
        self.phases[i] = self.phases[i].ending(following.event, following.strike)
        self.durations[i] += self.durations[behind]
        self._delete(behind)

    def _without_events(self) -> None:
        """One phase without any event, from a multiple of the period on."""
        T = self.durations[0]
        end = T * np.ceil(self.first / T)
        phase = self.phases[0].ending(PERIOD)
        if end > self.first:
            self.starts[0] = self.motion.reached(self.first, end - self.first, self.starts[0],
                                                 phase)
        self.phases, self.first = [phase], 0.0

    def insert(self, i: int, phase: Phase) -> None:
        """Put a phase without duration before phase i."""
        self.phases.insert(i, phase)
        self.starts.insert(i, self.starts[i].copy())
        self.durations.insert(i, 0.0)

    def split(self, i: int, after: float, ending: Phase) -> None:
        """Divide a phase at a time after its begin; the first part gets another end."""
        phase, begin = self.phases[i], self.begin(i)
        state = self.motion.reached(begin, after, self.starts[i], phase)
        if phase.event == PERIOD:
            # The orbit begins behind its only event.
            self.phases, self.starts, self.first = [ending], [state], begin + after
            return
        rest = self.durations[i] - after
        self.phases[i], self.durations[i] = ending, after
        self.phases.insert(i + 1, phase)
        self.starts.insert(i + 1, state)
        self.durations.insert(i + 1, rest)

    def made(self) -> tuple[EventOrbit, Array] | None:
        """Problem and unknowns; None for an orbit without events that nothing excites."""
        if self.phases[0].event == PERIOD and not self.problem.forced:
            return None
        count = len(self.phases)
        ordered = tuple(
            phase.ending(phase.event, phase.strike,
                         order_of(self.motion, self.phases[(i - 1) % count], phase))
            for i, phase in enumerate(self.phases))
        problem = replace(self.problem, phases=ordered)
        begin = [self.first] if self.problem.forced else []
        return problem, np.concatenate([*self.starts, self.durations, begin, [self.parameter]])


def beyond(problem: EventOrbit, u: Array, condition: Condition) -> Iterator[Successor]:
    """Orbits that may go on where the margin of a condition is zero."""
    i, event = condition.phase, condition.event
    phase, before = problem.phases[i], problem.phases[i - 1]
    k = len(phase.status)
    cluster = event // 2 if 0 <= event < 2 * k else None
    found = Successor(problem, u)
    if condition.what in (RATE, WITHIN, BEGIN) and cluster is not None and phase.opens(event):
        return
    if condition.what == STRIKE:
        if cluster is not None:
            yield from _other_impacts(problem, u, condition, cluster)
    elif cluster is None and condition.what != DURATION:
        yield from _at_stop(problem, u, condition)
    elif condition.what == DURATION and problem.count > 1:
        found.drop(i)
        yield found
        if _of_others(before, phase):
            found = Successor(problem, u)
            found.swap(i)
            yield found
    elif condition.what == WITHIN and cluster is not None:
        sense = phase.status[cluster]
        if sense == STICK:
            begun = phase.with_status(cluster, released_sense(event), 2 * cluster)
        else:
            begun = phase.with_status(cluster, STICK, crossing_event(cluster, sense))
        found.split(i, condition.after, phase.ending(event))
        if problem.phases[i].event == PERIOD:
            found.insert(0, begun)
        else:
            found.insert(i + 1, begun)
        yield found
    elif condition.what == BEGIN and cluster is not None and not crosses(
            before, phase) and before.cluster() == cluster:
        found.insert(i, phase.with_status(cluster, released_sense(event), 2 * cluster))
        yield found
    elif condition.what == CROSSING and cluster is not None:
        found.insert(i, phase.with_status(cluster, STICK, event))
        yield found


def _at_stop(
    problem: EventOrbit, u: Array, condition: Condition
) -> Iterator[Successor]:
    """Orbits behind a touch without speed."""
    i, event, count = condition.phase, condition.event, problem.count
    found = Successor(problem, u)
    phase, motion = problem.phases[i], found.motion
    stop = event - 2 * motion.clusters
    if condition.what == RATE and not phase.closed[stop]:
        if phase.state == problem.phases[(i + 1) % count].state:
            found.join(i)
            yield found
    elif condition.what == WITHIN and not phase.closed[stop]:
        begin, after = found.begin(i), condition.after
        state = motion.reached(begin, after, found.starts[i], phase)
        for touch in motion.touches(begin + after, state, phase.ending(event)):
            found = Successor(problem, u)
            found.split(i, after, phase.ending(event, touch))
            yield found
    elif phase.lifts_off(event) and motion.problem.restitution[stop] == 0.0 and (
            condition.what == WITHIN
            or (condition.what == BEGIN and problem.phases[i - 1].event == event)):
        yield from _with_flight(problem, u, condition)


def _with_flight(
    problem: EventOrbit, u: Array, condition: Condition
) -> Iterator[Successor]:
    """Orbits with a flight without duration where the force of a closed stop touches zero.

    That is within the phase, or where the stop has just been struck. Masses that rebound strike it
    without end before they rest again.
    """
    i, event, after = condition.phase, condition.event, condition.after
    found = Successor(problem, u)
    phase, motion, begin = problem.phases[i], found.motion, found.begin(i)
    stop = event - 2 * motion.clusters
    closed = tuple(int(each and j != stop) for j, each in enumerate(phase.closed))
    own, status = motion.problem.cluster[stop], list(phase.status)
    beside = any(each and motion.problem.cluster[j] == own for j, each in enumerate(closed))
    if status[own] != FIXED and not beside:
        status[own] = OPEN
    flight = Phase(tuple(status), closed, event)
    state = motion.reached(begin, after, found.starts[i], phase)
    for touch in motion.touches(begin + after, state, flight):
        found = Successor(problem, u)
        flight = replace(flight, strike=touch)
        if condition.what == WITHIN:
            found.split(i, after, phase.ending(event))
            found.insert(0 if phase.event == PERIOD else i + 1, flight)
        else:
            found.insert(i, flight)
        yield found


def _other_impacts(
    problem: EventOrbit, u: Array, condition: Condition, cluster: int
) -> Iterator[Successor]:
    """Orbits whose impact stops the slip that it did not stop, or the other way round.

    Where its contact stays closed, what it stops no more slips for a moment before it sticks.
    """
    i = condition.phase
    phase, behind = problem.phases[i], problem.phases[(i + 1) % problem.count]
    assert phase.strike is not None
    modes, stopped = list(phase.strike.modes), phase.strike.modes[cluster] == STICK
    sense = released_sense(condition.event)
    modes[cluster] = sense if stopped else STICK
    found = Successor(problem, u)
    found.phases[i] = phase.ending(phase.event, replace(phase.strike, modes=tuple(modes)))
    # With tangential restitution the stopped contact rebounds, and slips after it on either side.
    rests = stopped and found.motion.problem.tangential[cluster] == 0.0
    if rests and behind.status[cluster] in (STICK, -sense):
        found.insert((i + 1) % problem.count, behind.with_status(cluster, sense, 2 * cluster))
    yield found
