"""Margins of the conditions that hold in the phases of an orbit.

An orbit stops being of its kind where a margin becomes zero: a phase has no duration, its event
function vanishes at its end without any rate (the orbit only touches there), another event function
vanishes within a phase or at its begin, a contact whose slip passes through zero could stick there,
or an impact begins or ceases to stop the slip of a contact.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.events.phases import BRIEF, PERIOD, Motion, Phase, scales_of
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.problem import STICK

# Kinds of conditions.
DURATION, RATE, WITHIN, BEGIN, CROSSING, STRIKE = range(6)
# Parts of a phase at which conditions are examined, closer together at its ends, and places of the
# polynomial about a minimum.
_NEAR = np.array([1e-4, 3e-4, 1e-3, 3e-3, 1e-2])
_PARTS = np.concatenate([[0.0], _NEAR, np.linspace(0.02, 0.98, 49), 1.0 - _NEAR[::-1], [1.0]])
_PLACES, _ONCE_MORE = 9, 1.0 + 0.02 * np.arange(5)
# Part of the period below which what vanishes at both ends of a phase has no minimum between them,
# and part of a phase in which what vanishes at its begin with speed and acceleration is rounding.
_SHORT, _FLAT = 1e-2, 0.02
# Parts of the period below which a phase has no rate at its end, by order: those of orders one and
# two are known at durations that are too short for the slopes of the equations.
_NO_RATE = (0.0, 1e-6, 1e-6, BRIEF[3])
# Minima below this part of the scale are examined closely.
_CLOSE = 0.3


class Condition(NamedTuple):
    """Margin of a condition, relative to its scale, and the condition.

    ``what`` is DURATION, RATE, WITHIN, BEGIN, CROSSING or STRIKE, ``phase`` the number of the
    phase, ``event`` the event function that vanishes, and ``after`` the time when it does, from the
    begin of the phase [s].
    """

    left: float
    what: int
    phase: int
    event: int
    after: float = 0.0


@dataclass(frozen=True, eq=False)
class PhaseSequence:
    """Phases with their begins (K,) or more [s], states (K, d) there and durations (K,) [s].

    ``margins`` (2, 2 k + n) are those of
    :func:`fecontact.bifurcation.events.phases.scales_of`.
    """

    motion: Motion
    phases: tuple[Phase, ...]
    begins: Array
    starts: Array
    durations: Array
    margins: Array

    @property
    def period(self) -> float:
        """Sum of the durations [s]."""
        return float(self.durations.sum())


def conditions(sequence: PhaseSequence, rates: list[float]) -> Iterator[Condition]:
    """All conditions of the phases; ``rates`` are those of the event functions at their ends."""
    for i, rate in enumerate(rates):
        yield from of_phase(sequence, i, rate)


def of_phase(
    sequence: PhaseSequence, i: int, rate: float, what: int | None = None, event: int | None = None
) -> Iterator[Condition]:
    """Conditions of one phase; ``rate`` is that of the event function at its end.

    With ``what`` and ``event`` those that can be of this kind; what others need is not computed.
    """
    phase, T, duration = sequence.phases[i], sequence.period, float(sequence.durations[i])
    if what in (None, DURATION):
        yield Condition(duration / T, DURATION, i, phase.event, duration)
    # An event function that is zero at both ends of a phase without duration has no rate there.
    if what in (None, RATE) and phase.event != PERIOD and not (
            abs(duration) < _NO_RATE[phase.order] * T):
        scale = scales_of(phase, sequence.margins)[phase.event] * (duration / T) ** phase.order
        yield Condition(float(-rate * T / scale), RATE, i, phase.event, duration)
    if what in (None, WITHIN) and duration > 0.0:
        yield from _within(sequence, i, event)
    if what in (None, BEGIN, CROSSING):
        yield from _at_begin(sequence, i)
    if what in (None, STRIKE) and phase.strike is not None:
        begin = float(sequence.begins[i])
        state = sequence.motion.reached(begin, duration, sequence.starts[i], phase)
        for struck, left in sequence.motion.impact(begin + duration, state, phase)[1]:
            yield Condition(left, STRIKE, i, struck, duration)


def sampled(sequence: PhaseSequence, i: int, after: Array) -> Array:
    """Margins (N, 2 k + n) of a phase at times (N,) after its begin, in their scales."""
    phase, motion, begin = sequence.phases[i], sequence.motion, float(sequence.begins[i])
    states = motion.run(begin, after, sequence.starts[i], phase)[0]
    return motion.observed(begin + after, states, phase)[0] / scales_of(phase, sequence.margins)


def _within(sequence: PhaseSequence, i: int, only: int | None = None) -> Iterator[Condition]:
    """The least value within a phase of each margin, or of one, that has a minimum there."""
    duration = float(sequence.durations[i])
    # Without an event, what is at the end is at the begin again.
    parts = _PARTS if sequence.phases[i].event != PERIOD else np.append(_PARTS[:-1], _ONCE_MORE)
    times = duration * parts
    found = sampled(sequence, i, times)
    phase = sequence.phases[i]
    for event in range(found.shape[1]) if only is None else (only,):
        column = found[:, event]
        between = phase.order and event == phase.event and duration < _SHORT * sequence.period
        if between or not np.isfinite(column).all():
            continue
        low = 1 + np.flatnonzero((column[1:-1] < column[:-2]) & (column[1:-1] <= column[2:]))
        if event == phase.event and phase.order == len(BRIEF) - 1:
            low = low[parts[low] > _FLAT]
        for place in low:
            after, value = float(times[place]), float(column[place])
            if value < _CLOSE:
                after, value = _minimum(sequence, i, event, float(times[place - 1]),
                                        float(times[place + 1]))
            yield Condition(value, WITHIN, i, event, after)


def _minimum(
    sequence: PhaseSequence, i: int, event: int, first: float, last: float,
) -> tuple[float, float]:
    """Time and value of a minimum between two times, of the polynomial through nine places."""
    nodes = -np.cos(np.pi * np.arange(_PLACES) / (_PLACES - 1))
    middle, half = 0.5 * (first + last), 0.5 * (last - first)
    values = sampled(sequence, i, middle + half * nodes)[:, event]
    polynomial = np.polynomial.Chebyshev.fit(nodes, values, _PLACES - 1, domain=[-1.0, 1.0])
    turns = [float(root.real) for root in np.atleast_1d(polynomial.deriv().roots())
             if abs(root.imag) < 1e-6 and abs(root.real) <= 1.0]
    places = [*turns, float(nodes[np.argmin(values)])]
    at = min(places, key=lambda place: float(polynomial(place)))
    return middle + half * at, float(polynomial(at))


def _at_begin(sequence: PhaseSequence, i: int) -> Iterator[Condition]:
    """Margins at the begin of a phase, except those that its first event has just made zero."""
    phase, before = sequence.phases[i], sequence.phases[i - 1]
    if before.event == PERIOD:
        return
    k, event = sequence.motion.clusters, before.event
    margins = sampled(sequence, i, np.zeros(1))[0]
    cluster = before.cluster()
    turning = [cluster] if cluster is not None and crosses(before, phase) else []
    for place in np.flatnonzero(np.isfinite(margins)).tolist():
        own = phase.cluster(place)
        if cluster is not None and own == cluster:
            if phase.status[cluster] != STICK or before.status[cluster] == STICK:
                continue
        elif cluster is None and place == event and not phase.closed[event - 2 * k]:
            continue
        elif own is not None and place == 2 * own and before.strike is not None and (
                before.strike.modes[own] == STICK and phase.status[own] in (1, -1)
                and sequence.motion.problem.tangential[own] == 0.0):
            # A contact that an impact has stopped slips again at once.
            turning.append(own)
            continue
        yield Condition(float(margins[place]), BEGIN, i, place)
    for cluster in turning:
        held = phase.with_status(cluster, STICK)
        found = sequence.motion.observed_at(float(sequence.begins[i]), sequence.starts[i], held)[0]
        place = crossing_event(cluster, phase.status[cluster])
        # The limit of stick is half the sum of the margins to both sides.
        limit = float(0.5 * (found[2 * cluster] + found[2 * cluster + 1])) or 1.0
        yield Condition(-float(found[place]) / limit, CROSSING, i, place)


def crosses(before: Phase, phase: Phase) -> bool:
    """Whether the event between two phases turns the sense of slip of its cluster."""
    cluster = before.cluster()
    return cluster is not None and (before.status[cluster], phase.status[cluster]) in (
        (1, -1), (-1, 1))


def crossing_event(cluster: int, sense: int) -> int:
    """The margin in stick that is negative where a cluster begins to slip in a sense."""
    return 2 * cluster + (0 if sense == 1 else 1)
