"""Equations of a periodic orbit that goes from event to event, and its stability."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.problem import BranchStatus, Problem
from fecontact.bifurcation.continuation.rounding import Rounding
from fecontact.bifurcation.events.linearisation import EventLinearisation
from fecontact.bifurcation.events.phases import Motion, Phase
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.orbits.floquet import FloquetTests
from fecontact.bifurcation.orbits.multiplier_rounding import MultiplierRounding
from fecontact.bifurcation.orbits.shooting import run_from
from fecontact.bifurcation.orbits.unknowns import FreeParameters
from fecontact.core.errors import AnalysisError
from fecontact.core.ties import first_largest
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.problem import STICK
from fecontact.integrate.solvers import SetValued

# Name of the test function that is negative where an orbit breaks the conditions of its phases.
ADMISSIBLE = "admissible"
# Runs check orbits whose conditions have this much left; they come back to this part of the scales.
_CLEAR, _RETURNS = 1e-3, 1e-6
# Steps are followed to this part of the tolerance of the orbits.
_FINER, _FINEST = 1e-2, 1e-13


@dataclass(frozen=True, eq=False)
class EventOrbit(FreeParameters, FloquetTests, Problem):
    r"""A periodic orbit of a set-valued system whose K phases are known.

    Within a phase the contact state is kept, whatever its conditions say, so that the equations are
    smooth functions of the unknowns beyond the end of the orbit's kind too:

    .. math::

        R_i(\varphi_i(x_i, \tau_i)) - x_{i+1} = 0, \qquad
        h_i(\varphi_i(x_i, \tau_i)) / \tau_i^{o_i} = 0

    with the flow of the phase, the impact R_i at its end, and the event function h_i there. With
    an excitation the time of the first event is unknown too, and the durations add up to the
    period; an orbit without any event begins at t = 0.

    The unknowns are ``u = [x_0 .. x_(K-1), tau_0 .. tau_(K-1), t_0 if excited, parameter]``. The
    test function 'admissible' is the smallest margin of the conditions of the phases. Its
    zero ends the branch.

    Attributes
    ----------
    field, values, free
        As for :class:`fecontact.bifurcation.orbits.shooting.ShootingProblem`.
    phases : tuple of Phase
    solver : SetValued
    scales : (d + 2,) array
        Scales of the states, the period and the parameter in the step length.
    margins : (2, 2 k + n) array
        Scales of what events watch; see :func:`fecontact.bifurcation.events.phases.scales_of`.
    periods : int
        Number of forcing periods in one period of the orbit.
    rtol : float
        Relative tolerance.
    """

    field: ContactField
    values: Array
    free: int
    phases: tuple[Phase, ...]
    solver: SetValued
    scales: Array
    margins: Array
    periods: int = 1
    rtol: float = 1e-9

    ends: ClassVar[Mapping[str, BranchStatus]] = {ADMISSIBLE: BranchStatus.DISCONTINUITY}

    @property
    def dimension(self) -> int:
        """Number of states d."""
        return self.field.dimension

    @cached_property
    def forced(self) -> bool:
        """Whether something is given in time."""
        return self.field.forcing_period(self.values) is not None

    @cached_property
    def resting(self) -> tuple[int, ...]:
        """Stops that are closed all the time."""
        if self.solver.restitution is None:
            return ()
        closed = np.array([phase.closed for phase in self.phases], dtype=bool)
        return tuple(np.flatnonzero(closed.all(axis=0)).tolist())

    @property
    def count(self) -> int:
        """Number of phases K."""
        return len(self.phases)

    def starts(self, u: Array) -> Array:
        """States (K, d) at the begins of the phases."""
        return np.ascontiguousarray(u[: self.count * self.dimension].reshape(self.count, -1))

    def durations(self, u: Array) -> Array:
        """Durations (K,) of the phases [s]."""
        first = self.count * self.dimension
        return u[first : first + self.count]

    def begins(self, u: Array) -> Array:
        """Times (K + 1,) of the begins of the phases, and of the end [s]."""
        first = float(u[self.count * (self.dimension + 1)]) if self.forced else 0.0
        return first + np.append(0.0, np.cumsum(self.durations(u)))

    def period(self, u: Array) -> float:
        """Period [s]."""
        return float(self.durations(u).sum())

    def motion(self, u: Array) -> Motion:
        """The system at the parameters of u."""
        d = self.dimension
        return Motion(self.field, self.parameters(u), self.free, self.solver, self.scales[:d],
                      float(self.scales[-1]), float(self.scales[-2]),
                      max(_FINEST, _FINER * self.rtol))

    def given_period(self, values: Array) -> float:
        """Period of the forcing [s], as often as the orbit takes."""
        return self.periods * float(self.field.forcing_period(values) or 0.0)

    def linearise(self, u: Array) -> EventLinearisation:
        """Residual and linearisation at u."""
        return EventLinearisation(self, u)

    def weights(self) -> Array:
        """Weights of the inner product: mean of the scaled starts, durations, parameters."""
        d, K = self.dimension, self.count
        period = 1.0 / self.scales[-2] ** 2
        found = [np.tile(1.0 / (K * self.scales[:d] ** 2), K), np.full(K, period)]
        if self.forced:
            found.append(np.array([period]))
        return np.concatenate([*found, 1.0 / self.scales[-1:] ** 2])

    @cached_property
    def rounding(self) -> Rounding:
        """Of the multipliers; the errors of the steps dominate in small Newton steps."""
        return MultiplierRounding(float(self.scales[-1]), max(1e-10, self.rtol))

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, stability, and the extremes of the states.

        Raises
        ------
        AnalysisError
            If a run does not come back to its start.
        """
        found = linearisation.floquet
        if linearisation.least.left > _CLEAR:
            self._require_return(u, float(np.abs(found.multipliers).max()))
        low, high = linearisation.extremes
        return {"period": self.period(u), **found.stored, "mesh": np.array([0.0, 1.0]),
                "minimum": low, "maximum": high}

    def _require_return(self, u: Array, growth: float) -> None:
        """Raise AnalysisError unless a run that knows nothing of the phases closes."""
        i, after = anchor(self, u)
        begin = float(self.begins(u)[i]) + after
        start = self.runs_from(u)
        times = begin + np.array([[0.0, self.period(u)]])
        end = run_from(self.field.system(self.parameters(u)), times, start[None], self.rtol,
                       self.solver)[0, -1]
        off = float((np.abs(end - start) / self.scales[: self.dimension]).max())
        if off > _RETURNS * max(1.0, growth):
            raise AnalysisError("A run from the orbit does not come back: an event between its "
                                "phases was not seen.")

    def runs_from(self, u: Array) -> Array:
        """The state (d,) from which runs of the orbit start; see :func:`anchor`."""
        i, after = anchor(self, u)
        begin, start = float(self.begins(u)[i]), self.starts(u)[i]
        if after == 0.0:
            return start
        return self.motion(u).reached(begin, after, start, self.phases[i])

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Test functions of the multipliers, and the smallest margin of the phases' conditions."""
        return {**super().tests(u, linearisation, tangent),
                ADMISSIBLE: linearisation.least.left}

    def adapted(self, u: Array, tangent: Array) -> "tuple[EventOrbit, Array, Array]":
        """Problem with the parameter values of u; u and the tangent are unchanged."""
        return replace(self, values=self.parameters(u)), u, tangent


def anchor(problem: EventOrbit, u: Array) -> tuple[int, float]:
    """Phase in which runs of an orbit start, and when in it [s].

    With an excitation at a multiple of the period, else in the middle of the longest phase, of
    those in which something slips or flies if there are any.
    """
    durations = problem.durations(u)
    if not problem.forced:
        moving = [any(status != STICK for status in phase.status) or (
            problem.solver.restitution is not None and not all(phase.closed))
            for phase in problem.phases]
        i = first_largest(durations * (1.0 + 1e6 * np.array(moving)))
        return i, 0.5 * float(durations[i])
    begins, T = problem.begins(u), problem.period(u)
    time = T * np.ceil(begins[0] / T)
    i = int(np.searchsorted(begins, time, side="right")) - 1
    if i >= problem.count:
        return 0, 0.0
    return i, float(time - begins[i])
