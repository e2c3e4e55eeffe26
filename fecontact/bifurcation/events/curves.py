"""Borders of the contact states of orbits over two parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.point import attributes_of
from fecontact.bifurcation.continuation.points import DiscontinuityPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, Problem, sizes_of
from fecontact.bifurcation.continuation.rounding import Rounding
from fecontact.bifurcation.events.borders import beyond
from fecontact.bifurcation.events.branches import FITS, nothing_left
from fecontact.bifurcation.events.conditions import (
    DURATION,
    RATE,
    Condition,
    PhaseSequence,
    of_phase,
)
from fecontact.bifurcation.events.linearisation import EventLinearisation, bordered_solution
from fecontact.bifurcation.events.orbit import ADMISSIBLE, EventOrbit
from fecontact.bifurcation.events.phases import BRIEF, PERIOD, Motion, Phase, Strike
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.solvers import SetValued
from fecontact.system.fields.vector_field import VectorField

# Step of differences of a condition, in scales of the states and parameters.
_STEP = 1e-5
# Conditions with less left than this at the start belong to the border that is followed.
_SAME = 1e-5
_ROUNDING = Rounding(1e-8)


@dataclass(frozen=True, eq=False)
class BorderCurve(Problem):
    """Orbits at which the margin of one condition is zero, with two free parameters.

    The unknowns are those of the orbit, with the second parameter before the first one. The curve
    ends where the margin of another condition is zero.

    Attributes
    ----------
    orbit : EventOrbit
        Over the first parameter.
    second : int
        Index of the second parameter.
    width : float
        Its width in the diagram.
    what, phase, event : int
        The condition; see :class:`fecontact.bifurcation.events.conditions.Condition`.
    beside : frozenset
        Other conditions, (what, phase, event), whose margins are zero at the border too.
    """

    orbit: EventOrbit
    second: int
    width: float
    what: int
    phase: int
    event: int
    beside: frozenset[tuple[int, int, int]] = frozenset()
    precision: float = 1e-8

    ends: ClassVar[Mapping[str, BranchStatus]] = {ADMISSIBLE: BranchStatus.DISCONTINUITY}

    def along_first(self, u: Array) -> tuple[EventOrbit, Array]:
        """The orbit and its unknowns over the first parameter."""
        values = self.orbit.values.copy()
        values[self.second], values[self.orbit.free] = u[-2], u[-1]
        return replace(self.orbit, values=values), np.append(u[:-2], u[-1])

    def along_second(self, u: Array) -> tuple[EventOrbit, Array]:
        """The orbit and its unknowns over the second parameter."""
        first, _ = self.along_first(u)
        scales = np.append(first.scales[:-1], self.width)
        return replace(first, free=self.second, scales=scales), u[:-1]

    def linearise(self, u: Array) -> "BorderLinearisation":
        """The equations about u."""
        return BorderLinearisation(self, u)

    def weights(self) -> Array:
        """Weights of the inner product, those of the orbit."""
        found = self.orbit.weights()
        return np.concatenate([found[:-1], [1.0 / self.width**2], found[-1:]])

    @property
    def rounding(self) -> Rounding:
        """Of Newton steps alone."""
        return _ROUNDING

    def left(
        self, orbit: EventOrbit, u: Array, start: Array, begin: float, tau: float, motion: Motion
    ) -> float:
        """Margin of the condition, for a phase with another start, begin and duration."""
        i = self.phase
        begins, starts = orbit.begins(u).copy(), orbit.starts(u).copy()
        durations = orbit.durations(u).copy()
        starts[i], begins[i], durations[i] = start, begin, tau
        sequence = PhaseSequence(motion, orbit.phases, begins, starts, durations, orbit.margins)
        phase, rate = orbit.phases[i], 0.0
        if self.what == RATE:
            state = motion.reached(begin, tau, start, phase)
            slopes = motion.margin_slopes(begin + tau, state, phase, phase.event)
            rates = motion.observed_at(begin + tau, state, phase)[1]
            rate = float(slopes[: len(rates)] @ rates + slopes[len(rates)])
        found = [each.left for each in of_phase(sequence, i, rate, self.what, self.event)
                 if (each.what, each.event) == (self.what, self.event)]
        if not found:
            raise AnalysisError("The orbit does not come near its border any more.")
        return min(found)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Both parameters, the period, and the extremes of the states."""
        names = list(self.orbit.field.parameters)
        orbit = linearisation.orbit
        low, high = orbit.extremes
        return {names[self.second]: float(u[-2]), names[self.orbit.free]: float(u[-1]),
                "period": orbit.problem.period(orbit.u), "minimum": low, "maximum": high}

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """A fold of the curve is where its first parameter turns."""
        return {"kind": "turning point"}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Smallest margin of the other conditions, as a test function."""
        others = [each.left for each in linearisation.orbit.conditions
                  if named(each) not in self.beside]
        return {ADMISSIBLE: min(others, default=1.0)}


def named(condition: Condition) -> tuple[int, int, int]:
    """Kind, phase and event of a condition."""
    return condition.what, condition.phase, condition.event


class BorderLinearisation:
    """The equations of a border at u."""

    def __init__(self, problem: BorderCurve, u: Array) -> None:
        self.problem, self.u = problem, u

    @cached_property
    def orbit(self) -> EventLinearisation:
        """Linearisation of the orbit, over the first parameter."""
        found, u = self.problem.along_first(self.u)
        return found.linearise(u)

    @cached_property
    def residual(self) -> Array:
        """The residual (N,)."""
        return np.append(self.orbit.residual, self._left())

    def _left(self, offset: Array | None = None) -> float:
        """Margin of the condition, with an offset (d + 4,) of start, begin, tau, parameters."""
        problem, u = self.problem, self.u.copy()
        d = problem.orbit.dimension
        moved = np.zeros(d + 4) if offset is None else offset
        u[-2:] += moved[-2:]
        orbit, known = problem.along_first(u)
        motion = orbit.motion(known) if moved[-2:].any() else self.orbit.motion
        i = problem.phase
        return problem.left(orbit, known, orbit.starts(known)[i] + moved[:d],
                            float(orbit.begins(known)[i] + moved[d]),
                            float(orbit.durations(known)[i] + moved[d + 1]), motion)

    @cached_property
    def matrix(self) -> Array:
        """The derivative (N, N + 1)."""
        problem, u = self.problem, self.u
        d, K, i = problem.orbit.dimension, problem.orbit.count, problem.phase
        other, beside = problem.along_second(u)
        first = self.orbit.matrix
        matrix = np.zeros((len(u) - 1, len(u)))
        matrix[:-1, :-2], matrix[:-1, -1] = first[:, :-1], first[:, -1]
        matrix[:-1, -2] = other.linearise(beside).matrix[:, -1]
        scales, row = problem.orbit.scales, matrix[-1]
        sizes = np.concatenate([scales[:d], scales[-2:-1], scales[-2:-1], [problem.width],
                                scales[-1:]])
        slopes = np.empty(d + 4)
        for k, size in enumerate(sizes):
            offset = np.zeros(d + 4)
            offset[k] = _STEP * size
            slopes[k] = (self._left(offset) - self._left(-offset)) / (2.0 * _STEP * size)
        row[i * d : (i + 1) * d] = slopes[:d]
        row[K * d + i] += slopes[d + 1]
        if problem.orbit.forced:
            row[K * d : K * d + i] += slopes[d]
            row[K * d + K] += slopes[d]
        row[-2:] = slopes[-2:]
        return matrix

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        return bordered_solution(self.matrix, row, rhs)


def border_curve(
    field: VectorField, point: DiscontinuityPoint, parameter: str, widths: Mapping[str, float],
    scales: ArrayLike | None = None,
) -> tuple[BorderCurve, Array, dict[str, Any]]:
    """Problem, unknowns and attributes of a border over the parameter of its branch and another.

    Raises
    ------
    InputError
        If the field is not that of a contact system, or ``scales`` are none of its states.
    """
    if not isinstance(field, ContactField):
        raise InputError(f"{point.place} is of a contact system; make the field with "
                         f"contact_field.")
    orbit, u = _restored(field, point)
    name = point.branch.parameter_name
    sizes = orbit.scales.copy()
    sizes[: field.dimension] = sizes_of(scales, sizes[: field.dimension])[0]
    sizes[-1] = widths.get(name, sizes[-1])
    orbit = replace(orbit, scales=sizes)
    second = field.index(parameter)
    value = float(orbit.values[second])
    width = widths.get(parameter, abs(value) or 1.0)
    what, phase, event = (int(each) for each in np.asarray(point._detail("condition")))
    here = orbit.phases[phase]
    flight = what == DURATION and here.order == len(BRIEF) - 1
    if flight or (here.event == PERIOD and not here.lifts_off(event)):
        orbit, u, (what, phase, event) = _other_side(orbit, u, (what, phase, event))
    beside = frozenset(named(each) for each in orbit.linearise(u).conditions
                       if abs(each.left) < _SAME) | {(what, phase, event)}
    problem = BorderCurve(orbit, second, width, what, phase, event, beside)
    return problem, np.concatenate([u[:-1], [value], u[-1:]]), (
        attributes_of(field, orbit.values) | {"scales": sizes})


def _other_side(
    orbit: EventOrbit, u: Array, condition: tuple[int, int, int]
) -> tuple[EventOrbit, Array, tuple[int, int, int]]:
    """The orbit on the other side of a border, and the condition there.

    One without events then begins where it meets the border, which may come to any time of the
    period. One with a flight without duration has no flight.
    """
    for each in nothing_left(orbit, u):
        for successor in beyond(orbit, u, each):
            made = successor.made()
            if made is not None and np.abs(made[0].linearise(made[1]).residual).max() < FITS:
                return *made, named(nothing_left(*made)[0])
    return orbit, u, condition


def _restored(field: ContactField, point: DiscontinuityPoint) -> tuple[EventOrbit, Array]:
    """The orbit of a border in its unknowns from event to event."""
    known = point.branch.attributes
    method = point.branch.method
    solver = method.solver
    assert isinstance(solver, SetValued)
    margins = np.asarray(point._detail("margins"), dtype=float)
    strikes = np.atleast_2d(np.asarray(point._detail("strikes"), dtype=np.int64))
    rows = np.atleast_2d(np.asarray(point._detail("phases"), dtype=np.int64))
    nodes = 2 * (rows.shape[1] - 2) - margins.shape[1]
    phases = []
    for row, strike in zip(rows.tolist(), strikes.tolist(), strict=True):
        status, closed = row[: -2 - nodes], row[-2 - nodes : -2]
        pressed = tuple(j for j in range(nodes) if strike[1 + j])
        phases.append(Phase(tuple(status), tuple(closed), row[-2],
                            Strike(pressed, tuple(strike[1 + nodes :])) if strike[0] else None,
                            row[-1]))
    values, free = point.parameter_values(field), field.index(point.branch.parameter_name)
    return EventOrbit(field, values, free, tuple(phases), solver,
                      np.asarray(known["scales"], dtype=float), margins, int(known["periods"]),
                      method.rtol), np.asarray(point._detail("unknowns"))
