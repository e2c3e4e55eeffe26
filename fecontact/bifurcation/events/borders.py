"""Names of the borders that orbits meet, and the phases of orbits beyond them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fecontact.bifurcation.events.conditions import (
    BEGIN,
    CROSSING,
    DURATION,
    RATE,
    WITHIN,
    Condition,
    crosses,
)
from fecontact.bifurcation.events.orbit import EventOrbit
from fecontact.bifurcation.events.phases import PERIOD, Motion, Phase, Strike
from fecontact.bifurcation.events.tracing import order_of, released_sense
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.problem import STICK

# Part of the period below which a phase vanishes together with another condition.
_VANISHING = 1e-5


def border_of(problem: EventOrbit, u: Array, condition: Condition) -> str:
    """The kind of border at which a condition has nothing left."""
    phases, i = problem.phases, condition.phase
    phase, before, behind = phases[i], phases[i - 1], phases[(i + 1) % len(phases)]
    k = len(phase.status)
    if condition.what == DURATION:
        return _of_duration(before, phase, behind)
    if condition.event >= 2 * k:
        closed = phase.closed[condition.event - 2 * k]
        return "corner" if condition.what == BEGIN else ("lift-off" if closed else "grazing")
    cluster = condition.event // 2
    if condition.what in (RATE, WITHIN):
        if phase.status[cluster] == STICK:
            return "adding-sliding"
        return "grazing-sliding" if condition.event % 2 == 0 else "lift-off"
    if before.cluster() != cluster:
        return "corner"
    if condition.what == BEGIN and before.status[cluster] == released_sense(condition.event):
        return "grazing-sliding"
    # What begins there soon ends, or goes on.
    short = problem.durations(u)[i] < _VANISHING * problem.period(u)
    stays = condition.what == CROSSING
    return "crossing-sliding" if short != stays else "switching-sliding"


def _of_duration(before: Phase, phase: Phase, behind: Phase) -> str:
    k, cluster = len(phase.status), phase.cluster()
    if cluster != before.cluster() or (cluster is None and before.event != phase.event):
        return "corner"
    if cluster is None:
        return "lift-off" if phase.closed[phase.event - 2 * k] else "grazing"
    first, here, last = (each.status[cluster] for each in (before, phase, behind))
    if here == STICK:
        return "grazing-sliding" if first == last else "crossing-sliding"
    return "adding-sliding" if first == last == STICK else "switching-sliding"


def nodes_of(problem: EventOrbit, motion: Motion, condition: Condition) -> tuple[int, ...]:
    """Contact nodes to which a condition belongs."""
    k = motion.clusters
    event = condition.event if condition.event != PERIOD else 0
    if event >= 2 * k:
        return (event - 2 * k,)
    return tuple(np.flatnonzero(motion.problem.cluster == event // 2).tolist())


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
        if self.phases[before].state == self.phases[behind].state:
            self._delete(i)
            self.join((i - 1) % (count - 1))
            return
        self.phases[before] = self.phases[before].ending(self.phases[before].event)
        self._delete(i)

    def _delete(self, i: int) -> None:
        if i == 0:
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
        if behind == 0:
            # The orbit now begins behind what was its second event.
            self.first += self.durations[0]
        for each in (self.phases, self.starts, self.durations):
            del each[behind]

    def _without_events(self) -> None:
        """One phase without any event, from a multiple of the period on."""
        T = self.durations[0]
        end = T * np.ceil(self.first / T)
        phase = self.phases[0].ending(PERIOD)
        if end > self.first:
            self.starts[0] = self.motion.run(self.first, np.array([end - self.first]),
                                             self.starts[0], phase)[0][-1]
        self.phases, self.first = [phase], 0.0

    def insert(self, i: int, phase: Phase) -> None:
        """Put a phase without duration before phase i."""
        self.phases.insert(i, phase)
        self.starts.insert(i, self.starts[i].copy())
        self.durations.insert(i, 0.0)

    def split(self, i: int, after: float, ending: Phase) -> None:
        """Divide a phase at a time after its begin; the first part gets another end."""
        phase, begin = self.phases[i], self.begin(i)
        state = self.motion.run(begin, np.array([after]), self.starts[i], phase)[0][-1]
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


def _with(phase: Phase, cluster: int, status: int, event: int) -> Phase:
    found = list(phase.status)
    found[cluster] = status
    return Phase(tuple(found), phase.closed, event)


def beyond(problem: EventOrbit, u: Array, condition: Condition) -> Iterator[Successor]:
    """Orbits that may go on where a condition has nothing left."""
    i, event = condition.phase, condition.event
    phase = problem.phases[i]
    k = len(phase.status)
    cluster = event // 2 if 0 <= event < 2 * k else None
    found = Successor(problem, u)
    if condition.what == DURATION and problem.count > 1:
        found.drop(i)
        yield found
    elif condition.what == RATE and cluster is None and not phase.closed[event - 2 * k]:
        if phase.state == problem.phases[(i + 1) % problem.count].state:
            found.join(i)
            yield found
    elif condition.what == WITHIN and cluster is None and not phase.closed[event - 2 * k]:
        rubs = found.motion.rubbing[found.motion.problem.cluster[event - 2 * k]]
        if not rubs:
            found.split(i, condition.after, phase.ending(event, _touch(found.motion, event)))
            yield found
    elif condition.what == WITHIN and cluster is not None:
        sense = phase.status[cluster]
        if sense == STICK:
            begun = _with(phase, cluster, released_sense(event), 2 * cluster)
        else:
            begun = _with(phase, cluster, STICK, 2 * cluster + (0 if sense == 1 else 1))
        found.split(i, condition.after, phase.ending(event))
        if problem.phases[i].event == PERIOD:
            found.insert(0, begun)
        else:
            found.insert(i + 1, begun)
        yield found
    elif condition.what == BEGIN and cluster is not None and not crosses(
            problem.phases[i - 1], phase) and problem.phases[i - 1].cluster() == cluster:
        found.insert(i, _with(phase, cluster, released_sense(event), 2 * cluster))
        yield found
    elif condition.what == CROSSING and cluster is not None:
        found.insert(i, _with(phase, cluster, STICK, event))
        yield found


def _touch(motion: Motion, event: int) -> Strike:
    """The impact of a stop without friction that is only touched."""
    return Strike((event - 2 * motion.clusters,), (0,) * motion.clusters)
