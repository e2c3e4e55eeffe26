"""Linearised equations of an orbit from event to event: residual, saltation, multipliers."""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.events.conditions import Condition, PhaseSequence, conditions
from fecontact.bifurcation.events.phases import BRIEF, PERIOD, Motion, Phase, scales_of
from fecontact.bifurcation.orbits.floquet import Floquet, by_falling_modulus
from fecontact.bifurcation.orbits.mesh import extremes_of_run
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array

_SAMPLES = 129  # of a phase, for the extremes of the states
# Places between which equations divided by a brief duration are interpolated over it, by order.
_TWO, _FOUR = np.array([-1.0, 1.0]), np.array([-2.0, -1.0, 1.0, 2.0])
_PLACES = (np.zeros(0), _TWO, _TWO, _FOUR)
# Singular values of a jump below this part of the largest are zero.
_RANK = 1e-9
# Smallest rate with which something vanishes, relative to its scale and the period.
_SLOWEST = 1e-13
# Periods that no phase takes; a step of Newton's method may ask for thousands.
_MOST_PERIODS = 2.0


def _weights(places: Array, at: float) -> tuple[Array, Array]:
    """Weights of values at places for the polynomial through them, and for its slope."""
    powers = np.vander(places, increasing=True)
    exponents = np.arange(len(places))
    here = at**exponents
    slope = np.append(0.0, exponents[1:] * at ** exponents[:-1])
    return np.linalg.solve(powers.T, here), np.linalg.solve(powers.T, slope)


def bordered_solution(matrix: Array, row: Array, rhs: Array) -> Array:
    """Solution of ``[[matrix], [row]] x = rhs``; not finite where that is singular."""
    try:
        return np.asarray(np.linalg.solve(np.vstack([matrix, row]), rhs), dtype=float)
    except np.linalg.LinAlgError:
        return np.full(len(rhs), np.nan)


@dataclass(frozen=True, eq=False)
class End:
    """The end of a phase: the state before and behind the impact, and the event function there.

    ``moved`` (d, d + 2) and ``jumped`` (d, d + 2) are the slopes of the flow by start, begin and
    parameter, and of the impact by state, time and parameter; ``margin`` and ``margin_slopes``
    (d + 2,) are those of the event function.
    """

    state: Array
    rates: Array
    moved: Array
    after: Array
    jumped: Array
    margin: float
    margin_slopes: Array

    @property
    def rate(self) -> float:
        """Rate of the event function."""
        d = len(self.rates)
        return float(self.margin_slopes[:d] @ self.rates + self.margin_slopes[d])


class EventLinearisation:
    """The equations of an orbit from event to event at u, each part computed on demand.

    ``problem`` is a :class:`fecontact.bifurcation.events.orbit.EventOrbit`.
    """

    def __init__(self, problem: Any, u: Array) -> None:
        self.problem, self.u = problem, u
        self.begins = problem.begins(u)
        period = problem.period(u)
        if not period > 0.0:
            raise AnalysisError("The period became negative.")
        if problem.forced:
            period = problem.given_period(problem.parameters(u))
        if not np.abs(problem.durations(u)).max() <= _MOST_PERIODS * period:
            raise AnalysisError("A phase of the orbit would last longer than its period.")

    @cached_property
    def motion(self) -> Motion:
        """The system at u."""
        found: Motion = self.problem.motion(self.u)
        return found

    @cached_property
    def _ends(self) -> list[End]:
        starts, durations = self.problem.starts(self.u), self.problem.durations(self.u)
        found = [self.end(phase, begin, start, duration) for phase, begin, start, duration in zip(
            self.problem.phases, self.begins, starts, durations, strict=False)]
        found[-1] = self._held_at_rest(found[-1])
        return found

    def _held_at_rest(self, end: End) -> End:
        """The end of the period with stops that are always closed where they are held.

        Their equations tell accelerations alone, which would leave place and speed free.
        """
        if not self.problem.resting:
            return end
        held = partial(self.motion.held_at_rest, phase=self.problem.phases[-1],
                       stops=self.problem.resting)
        after, slopes = self.motion.changed(held, float(self.begins[-1]), end.after)
        d = len(after)
        jumped = slopes[:, :d] @ end.jumped
        jumped[:, d:] += slopes[:, d:]
        return replace(end, after=after, jumped=jumped)

    def end(self, phase: Phase, begin: float, start: Array, duration: float) -> End:
        """The end of a phase, with its derivatives."""
        motion = self.motion
        states, moved = motion.run(begin, np.array([duration]), start, phase, True)
        state, t = states[-1], float(begin + duration)
        margins, rates = motion.observed_at(t, state, phase)
        d = len(state)
        margin, slopes = 0.0, np.zeros(d + 2)
        if phase.event != PERIOD:
            margin = float(margins[phase.event])
            slopes = motion.margin_slopes(t, state, phase, phase.event)
        after, jumped = state, np.eye(d, d + 2)
        if phase.strike is not None:
            after, jumped = motion.changed(partial(motion.struck, phase=phase), t, state)
        elif phase.lifts_off():
            # A flight begins at the stop and without speed, whatever the equations of rest say.
            after, jumped = motion.changed(
                partial(motion.held_at_rest, phase=phase, stops=(phase.stop,)), t, state)
        return End(state, rates, moved, after, jumped, margin, slopes)

    def _event(self, i: int) -> tuple[float, Array]:
        """Equation of the end of phase i, and its slopes (d + 3,): start, begin, parameter, tau."""
        problem, phase, end = self.problem, self.problem.phases[i], self._ends[i]
        T, scale = float(problem.scales[-2]), float(scales_of(phase, problem.margins)[phase.event])
        tau = float(problem.durations(self.u)[i])
        factor, near = T**phase.order / scale, BRIEF[phase.order] * T
        if phase.order == 0 or abs(tau) > near:
            value, slopes = self._divided(end, phase.order, tau)
            return value * factor, slopes * factor
        # The quotient is smooth where the duration vanishes.
        places = _PLACES[phase.order]
        sides = [self._divided(self.end(phase, float(self.begins[i]), problem.starts(self.u)[i],
                                        near * place), phase.order, near * place)
                 for place in places.tolist()]
        parts, rates = _weights(places, tau / near)
        values = np.array([side[0] for side in sides])
        slopes = parts @ np.array([side[1] for side in sides])
        slopes[-1] = rates @ values / near
        return float(parts @ values) * factor, slopes * factor

    @staticmethod
    def _divided(end: End, order: int, tau: float) -> tuple[float, Array]:
        d = len(end.state)
        gradient = end.margin_slopes
        slopes = np.empty(d + 3)
        slopes[: d + 2] = gradient[:d] @ end.moved
        slopes[d : d + 2] += gradient[d:]
        slopes[-1] = end.rate
        if order:
            slopes[-1] -= order * end.margin / tau
            slopes /= tau**order
        return (end.margin / tau**order if order else end.margin), slopes

    @cached_property
    def _equations(self) -> tuple[Array, Array]:
        """Residual (N,) and its derivative (N, N + 1)."""
        problem, u = self.problem, self.u
        K, d, forced = problem.count, problem.dimension, problem.forced
        starts, size = problem.starts(u), len(u)
        residual, matrix = np.zeros(size - 1), np.zeros((size - 1, size))
        # Derivatives by the begins of phases go to the durations before them, and to t_0.
        taus = K * d
        for i, phase in enumerate(problem.phases):
            end, rows = self._ends[i], slice(i * d, (i + 1) * d)
            here, there = i * d, ((i + 1) % K) * d
            slopes = np.empty((d, d + 3))
            slopes[:, : d + 2] = end.jumped[:, :d] @ end.moved
            slopes[:, d : d + 2] += end.jumped[:, d:]
            slopes[:, -1] = end.jumped[:, :d] @ end.rates + end.jumped[:, d]
            residual[rows] = (end.after - starts[(i + 1) % K]) / problem.scales[:d]
            value, row = (0.0, np.zeros(d + 3)) if phase.event == PERIOD else self._event(i)
            residual[taus + i] = value
            both = np.vstack([slopes / problem.scales[:d, None], row])
            places = [*range(i * d, (i + 1) * d), taus + i]
            matrix[np.ix_(places, range(here, here + d))] += both[:, :d]
            matrix[places, taus + i] += both[:, -1]
            matrix[places, -1] += both[:, d + 1]
            if forced:
                matrix[np.ix_(places, range(taus, taus + i))] += both[:, d : d + 1]
                matrix[places, taus + K] += both[:, d]
            matrix[range(i * d, (i + 1) * d), range(there, there + d)] -= 1.0 / problem.scales[:d]
            if phase.event == PERIOD:
                residual[taus + i] = u[taus + K] / problem.scales[-2]
                matrix[taus + i, taus + K] = 1.0 / problem.scales[-2]
        if forced:
            self._close(residual, matrix)
        return residual, matrix

    def _close(self, residual: Array, matrix: Array) -> None:
        """Add the equation that the durations add up to the period of the forcing."""
        problem, u = self.problem, self.u
        K, T = problem.count, problem.scales[-2]
        taus, values = K * problem.dimension, problem.parameters(u)
        row = taus + K
        residual[row] = (problem.period(u) - problem.given_period(values)) / T
        matrix[row, taus : taus + K] = 1.0 / T
        change = 1e-4 * (abs(float(values[problem.free])) or 1.0)
        beside = [values.copy(), values.copy()]
        beside[0][problem.free] += change
        beside[1][problem.free] -= change
        if not problem.field.constant_period:
            matrix[row, -1] = -(problem.given_period(beside[0])
                                - problem.given_period(beside[1])) / (2.0 * change * T)

    @cached_property
    def extremes(self) -> tuple[Array, Array]:
        """Smallest and largest value (d,) of each state, on cubics between samples."""
        problem, lows, highs = self.problem, [], []
        for phase, begin, start, duration in zip(
                problem.phases, self.begins, problem.starts(self.u), problem.durations(self.u),
                strict=False):
            times = np.linspace(0.0, float(duration), _SAMPLES)
            states = self.motion.run(float(begin), times, start, phase)[0]
            rates = self.motion.observed(begin + times, states, phase)[1]
            low, high = extremes_of_run(states, times[1] * rates)
            lows.append(low)
            highs.append(high)
        return np.min(lows, axis=0), np.max(highs, axis=0)

    @property
    def residual(self) -> Array:
        """The residual (N,)."""
        return self._equations[0]

    @property
    def matrix(self) -> Array:
        """The derivative (N, N + 1)."""
        return self._equations[1]

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        return bordered_solution(self.matrix, row, rhs)

    @cached_property
    def jumps(self) -> list[Array]:
        r"""Saltation matrices (d, d) at the ends of the phases.

        .. math::

            S = R_x + (f^+ - R_x f^- - R_t) \frac{h_x^T}{h_x^T f^- + h_t}

        R is the impact or the identity, h the event function, f the rates before and behind.
        """
        problem, found = self.problem, []
        d, K = problem.dimension, problem.count
        starts = problem.starts(self.u)
        for i, (phase, end) in enumerate(zip(problem.phases, self._ends, strict=True)):
            jump = end.jumped[:, :d].copy()
            if phase.event != PERIOD:
                following = (i + 1) % K
                behind = self.motion.observed_at(float(self.begins[i + 1]), starts[following],
                                                 problem.phases[following])[1]
                scale = scales_of(phase, problem.margins)[phase.event]
                slowest = _SLOWEST * scale / problem.scales[-2]
                rate = np.copysign(max(abs(end.rate), slowest), end.rate)
                off = behind - jump @ end.rates - end.jumped[:, d]
                jump += np.outer(off, end.margin_slopes[:d]) / rate
            found.append(jump)
        return found

    @cached_property
    def monodromy(self) -> Array:
        """Derivative (d, d) of the state a period later, from the begin of the first phase."""
        return self._around(0)

    def _around(self, first: int) -> Array:
        d, K = self.problem.dimension, self.problem.count
        result = np.eye(d)
        for step in range(K):
            i = (first + step) % K
            result = self.jumps[i] @ (self._ends[i].moved[:, :d] @ result)
        return result

    @cached_property
    def floquet(self) -> Floquet:
        """Multipliers and stability; those that jumps take away are exactly zero."""
        d = self.problem.dimension
        factors = [np.linalg.svd(jump / self.problem.scales[:d, None] * self.problem.scales[:d])
                   for jump in self.jumps]
        ranks = [int((values > _RANK * values[0]).sum()) for _, values, _ in factors]
        least = int(np.argmin(ranks))
        rank = ranks[least]
        image = factors[least][0][:, :rank]
        scaled = (self._around((least + 1) % self.problem.count)
                  / self.problem.scales[:d, None] * self.problem.scales[:d])
        found: NDArray[np.complex128] = np.zeros(d, dtype=complex)
        if not np.isfinite(scaled).all():
            raise AnalysisError("The multipliers are not finite there.")
        found[:rank] = np.linalg.eigvals(image.T @ scaled @ image)
        found = by_falling_modulus(found)
        trivial = None if self.problem.forced else int(np.argmin(np.abs(found - 1.0)))
        return Floquet(found, trivial)

    @cached_property
    def conditions(self) -> list[Condition]:
        """Margins of the conditions of the phases."""
        problem = self.problem
        sequence = PhaseSequence(self.motion, problem.phases, self.begins, problem.starts(self.u),
                                 problem.durations(self.u), problem.margins)
        return list(conditions(sequence, [end.rate for end in self._ends]))

    @property
    def least(self) -> Condition:
        """The condition that has the least left."""
        return min(self.conditions, key=lambda condition: condition.left)
