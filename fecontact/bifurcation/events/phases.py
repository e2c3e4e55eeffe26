"""Phases of set-valued orbits: contact states between events, their motion, and impacts."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.events.flow import (
    PART,
    STATES,
    Data,
    FlowWorkspace,
    Given,
    RatesWorkspace,
    Reached,
    Rows,
    StrikeRows,
    flow,
    kinetic_coefficients,
    observe,
    set_strike_rows,
)
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.records import allocate
from fecontact.core.types import Array
from fecontact.integrate.nonsmooth.driver import nonsmooth_problem
from fecontact.integrate.nonsmooth.problem import (
    STICK,
    ContactState,
    Evaluation,
    NonsmoothProblem,
    sizes_of,
)
from fecontact.integrate.solvers import SetValued
from fecontact.integrate.step_loop import FINISHED
from fecontact.system.node_forces import normal_values

# In place of an event: the end of a period of the forcing.
PERIOD = -1
# Change of the parameter in widths of the diagram for its derivatives.
_CHANGE = 1e-5
# Steps are at most this part of the period.
_LONGEST = 0.02
# Steps that no motion needs.
_MOST_STEPS = 10**9
# Impulses and speeds within rounding of zero, relative to the largest.
_ROUNDING = 1e-9
# Durations in periods below which what vanishes at the end of a phase, divided by the power of the
# duration with which it vanishes at the begin too, is mostly rounding.
BRIEF = (0.0, 1e-5, 1e-5, 5e-3)
# Penetration at first contact [m].
_FIRST = 1e-100
# Offsets and weights of a difference of fourth order.
_OFFSETS, _WEIGHTS = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0


@dataclass(frozen=True)
class Strike:
    """An impact: the nodes that are pressed, and the clusters whose slip it stops or rubs.

    ``modes`` are 0 for clusters without impulse, STICK, or the sense of slip.
    """

    nodes: tuple[int, ...]
    modes: tuple[int, ...]


@dataclass(frozen=True)
class Phase:
    """A contact state, and the event at which it ends.

    Attributes
    ----------
    status : (k,) tuple
        Status of the clusters, as in :mod:`fecontact.integrate.nonsmooth.problem`.
    closed : (n,) tuple
        Whether stops are closed.
    event : int
        Place of the event function that vanishes at the end among those of
        :func:`fecontact.bifurcation.events.flow.observe`, or PERIOD.
    strike : Strike, optional
        The impact at the end.
    order : int
        Order of the zero that this event function has at the begin too: the equation of the end is
        divided by that power of the duration.
    """

    status: tuple[int, ...]
    closed: tuple[int, ...]
    event: int
    strike: Strike | None = None
    order: int = 0

    def opens(self, event: int) -> bool:
        """Whether an event ends the normal force of a cluster that slips, or of a node."""
        cluster = self.cluster(event)
        if cluster is None:
            return self.lifts_off(event)
        return event % 2 == 1 and self.status[cluster] in (1, -1)

    def lifts_off(self, event: int | None = None) -> bool:
        """Whether an event, by default its own, is where the force of a closed stop vanishes."""
        stop = (self.event if event is None else event) - 2 * len(self.status)
        return stop >= 0 and bool(self.closed[stop])

    @property
    def stop(self) -> int:
        """The stop at which it ends; below zero for events of clusters."""
        return self.event - 2 * len(self.status)

    @property
    def state(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The contact state."""
        return self.status, self.closed

    @cached_property
    def contact(self) -> ContactState:
        """The contact state for kernels."""
        return ContactState(np.array(self.status, dtype=np.int64),
                            np.array(self.closed, dtype=np.int64))

    def cluster(self, event: int | None = None) -> int | None:
        """The cluster to which an event belongs, by default its own; None for stops."""
        event = self.event if event is None else event
        return event // 2 if 0 <= event < 2 * len(self.status) else None

    def ending(self, event: int, strike: Strike | None = None, order: int = 0) -> "Phase":
        """Phase with this contact state and another end."""
        return replace(self, event=event, strike=strike, order=order)

    def with_status(self, cluster: int, status: int, event: int = PERIOD) -> "Phase":
        """Phase in which a cluster has another status, with another end."""
        return replace(self.ending(event), status=(*self.status[:cluster], status,
                                                   *self.status[cluster + 1 :]))


def scales_of(phase: Phase, margins: Array) -> Array:
    """Scales (2 k + n,) of the margins of a phase, of ``margins`` (2, 2 k + n).

    The first row has speeds of clusters and heights of stops, the second one forces.
    """
    k = len(phase.status)
    forces = np.zeros(margins.shape[1], dtype=int)
    forces[: 2 * k : 2] = np.array(phase.status) == STICK
    forces[1 : 2 * k : 2] = 1
    forces[2 * k :] = phase.closed
    return np.asarray(margins[forces, np.arange(margins.shape[1])])


class Motion:
    """A system at one value of the free parameter, moving within given contact states.

    Parameters
    ----------
    field, values, free
        The system, its parameters, and the index of the free one.
    solver : SetValued
        Its friction and stops.
    sizes : (d,) array
        Sizes of the states.
    width, period, rtol : float
        Width of the diagram, about the period [s], tolerance of the steps.
    """

    def __init__(
        self, field: ContactField, values: Array, free: int, solver: SetValued, sizes: Array,
        width: float, period: float, rtol: float,
    ) -> None:
        self.solver, self.sizes, self.rtol = solver, np.ascontiguousarray(sizes), rtol
        self.longest, self._period = _LONGEST * period, period
        self._field, self._values, self._free, self._width = field, values, free, width
        forcing = field.forcing_period(values)
        self.tick = 0.0 if forcing is None else PART * forcing
        self.problem, self.rubbing = self._problem(values)
        self.clusters, self.nodes = len(self.problem.rows), len(self.problem.cluster)
        self.modes = self.problem.rows.shape[1]
        self._workspace = allocate(RatesWorkspace, sizes_of(self.problem))

    @property
    def evaluation(self) -> Evaluation:
        """Contacts and forces at the state that was evaluated last."""
        return self._workspace.evaluation

    @cached_property
    def kinetic(self) -> Array:
        """Coefficients of friction (n,) at the begin of slip."""
        found = np.empty(self.nodes)
        kinetic_coefficients(self.problem, found)
        return found

    @cached_property
    def _unwatched(self) -> NDArray[np.bool_]:
        """Nodes (n,) whose opening is no event of their own: their forces begin from zero."""
        s, n = self.problem.system, self.nodes
        if self.problem.rigid:
            return np.zeros(n, dtype=bool)
        still, fast, slope = np.empty((3, n))
        for rate, force in ((0.0, still), (1.0, fast)):
            normal_values(s.normal, np.full(n, _FIRST), np.full(n, rate), s.normal_parameters,
                          force, slope)
        return np.asarray(still == fast)

    def _problem(self, values: Array) -> tuple[NonsmoothProblem, NDArray[np.bool_]]:
        solver = self.solver
        return nonsmooth_problem(
            self._field.system(values), solver.restitution, solver.static_coefficient,
            self.longest, tangential=solver.tangential_restitution)

    @cached_property
    def _perturbed(self) -> tuple[NonsmoothProblem, NonsmoothProblem, float]:
        """Problems at larger and smaller parameters, and half their distance.

        Raises
        ------
        AnalysisError
            If the system exists at neither.
        """
        change, found = _CHANGE * self._width, []
        for sign in (1.0, -1.0):
            values = self._values.copy()
            values[self._free] += sign * change
            try:
                found.append(self._problem(values)[0])
            except InputError:  # beside the end of the parameter's range
                found.append(self.problem)
                change /= 2.0
        if found[0] is found[1]:
            raise AnalysisError("The system exists at this value of the parameter alone.")
        return found[0], found[1], change

    def run(
        self, begin: float, times: Array, start: Array, phase: Phase, derivatives: bool = False
    ) -> tuple[Array, Array]:
        """States (N, d) at times (N,) after a begin, and the slopes (d, d + 2) of the last.

        The first time may be zero.

        Raises
        ------
        AnalysisError
            If the steps become too short.
        """
        d = 2 * self.modes
        states, slopes = np.empty((len(times), d)), np.empty((d if derivatives else 0, d + 2))
        above, below, change = self._perturbed if derivatives else (self.problem, self.problem, 1.0)
        given = Given(self.problem, above, below, change, self.tick, self.rtol, self.longest, begin,
                      1.0 if times[-1] >= 0.0 else -1.0, phase.contact, self.sizes)
        sizes, rows = {STATES: d}, Rows(np.abs(times), states)
        reached = allocate(Reached, sizes, state=np.array(start, dtype=float),
                           numbers=np.array([0.0, min(self.longest, rows.times[-1])]))
        workspace = allocate(FlowWorkspace, sizes, rates=self._workspace)
        ended = flow(Data(given, reached, rows, slopes, workspace), _MOST_STEPS)
        if ended != FINISHED or not np.isfinite(states).all():
            raise AnalysisError("The motion between two events could not be followed.")
        return states, slopes

    def reached(self, begin: float, after: float, start: Array, phase: Phase) -> Array:
        """State (d,) so long after a begin."""
        return self.run(begin, np.array([after]), start, phase)[0][-1]

    def observed(
        self, times: Array, states: Array, phase: Phase, problem: NonsmoothProblem | None = None
    ) -> tuple[Array, Array]:
        """Margins (N, 2 k + n) and rates (N, d) at states (N, d), see
        :func:`fecontact.bifurcation.events.flow.observe`.
        """
        margins = np.empty((len(times), 2 * self.clusters + self.nodes))
        rates = np.empty_like(states)
        at = Rows(np.ascontiguousarray(times, dtype=float), np.ascontiguousarray(states))
        observe(self.problem if problem is None else problem, phase.contact, self._workspace, at,
                margins, rates)
        margins[:, 2 * self.clusters :][:, self._unwatched] = np.inf
        return margins, rates

    def observed_at(
        self, t: float, state: Array, phase: Phase, problem: NonsmoothProblem | None = None
    ) -> tuple[Array, Array]:
        """Margins (2 k + n,) and rates (d,) at one state."""
        margins, rates = self.observed(np.array([t]), state[None], phase, problem)
        return margins[0], rates[0]

    def margin_slopes(self, t: float, state: Array, phase: Phase, event: int) -> Array:
        """Slopes (d + 2,) of a margin by the states, time and parameter."""
        return self._slopes(lambda times, states, problem: self.observed(
            times, states, phase, problem)[0][:, [event]], t, state)[0]

    def changed(
        self, change: Callable[..., Array], t: float, state: Array
    ) -> tuple[Array, Array]:
        """The state after ``change(t, state, problem=...)``, and its slopes (d, d + 2).

        Slopes are by the state before, time and parameter.
        """
        def each(times: Array, states: Array, problem: NonsmoothProblem) -> Array:
            return np.array([change(time, state, problem=problem)
                             for time, state in zip(times, states, strict=True)])

        return change(t, state), self._slopes(each, t, state)

    def _slopes(
        self, values: Callable[[Array, Array, NonsmoothProblem], Array], t: float, state: Array
    ) -> Array:
        """Slopes (k, d + 2) of values (N, k) at times and states by the state, time, parameter."""
        d = len(state)
        steps = np.append(PART * self.sizes, self.tick)[: d + (self.tick > 0.0)]
        times, states = np.full(4 * len(steps), t), np.tile(state, (4 * len(steps), 1))
        for i in range(d):
            states[4 * i : 4 * i + 4, i] += steps[i] * _OFFSETS
        times[4 * d :] += self.tick * _OFFSETS[: len(times) - 4 * d]
        found = values(times, states, self.problem).reshape(len(steps), 4, -1)
        above, below, change = self._perturbed
        slopes = np.zeros((found.shape[2], d + 2))
        slopes[:, : len(steps)] = (np.einsum("ikj,k->ij", found, _WEIGHTS) / steps[:, None]).T
        larger, smaller = (values(np.array([t]), state[None], problem)[0]
                           for problem in (above, below))
        slopes[:, -1] = (larger - smaller) / (2.0 * change)
        return slopes

    def struck(
        self, t: float, state: Array, phase: Phase, problem: NonsmoothProblem | None = None
    ) -> Array:
        """The state after the impact at the end of a phase."""
        return self.impact(t, state, phase, problem)[0]

    def held_at_rest(
        self, t: float, state: Array, phase: Phase, stops: tuple[int, ...],
        problem: NonsmoothProblem | None = None,
    ) -> Array:
        """The state with closed stops at no height and without speed, to first order."""
        m = self.modes
        found = self._strike_rows(t, state, phase, problem)
        closed = tuple(0 if j in stops else each for j, each in enumerate(phase.closed))
        heights = self.observed_at(t, state, replace(phase, closed=closed),
                                   problem)[0][2 * self.clusters :]
        rows, each = found.held[list(stops)], list(stops)
        after = state.copy()
        after[:m] -= rows.T @ np.linalg.solve(rows @ rows.T, heights[each])
        after[m:] += rows.T @ np.linalg.solve(rows @ rows.T, found.speeds[each])
        return after

    def _strike_rows(
        self, t: float, state: Array, phase: Phase, problem: NonsmoothProblem | None
    ) -> StrikeRows:
        """Constraints at an impact at the end of a phase."""
        found = allocate(StrikeRows, sizes_of(self.problem))
        set_strike_rows(self.problem if problem is None else problem, phase.contact,
                        self._workspace, t, np.ascontiguousarray(state), found)
        return found

    def impact(
        self, t: float, state: Array, phase: Phase, problem: NonsmoothProblem | None = None
    ) -> tuple[Array, list[tuple[int, float]]]:
        """The state after the impact at the end of a phase, and the margins of its conditions.

        Margins are pairs of an event and a number relative to the largest impulse or speed. For a
        cluster whose slip the impact stops these are the distances of its impulse from both edges
        of the cone, for others the slip velocity in their sense, for stops the impulse that presses
        or the speed that parts them.
        """
        k, n, m = self.clusters, self.nodes, self.modes
        chosen, strike = self.problem if problem is None else problem, phase.strike
        assert strike is not None
        held, pushing, speeds, coefficients = self._strike_rows(t, state, phase, chosen)
        for j in strike.nodes:
            sense = strike.modes[chosen.cluster[j]]
            if sense in (1, -1):
                pushing[j] += sense * coefficients[j] * pushing[n + chosen.cluster[j]]
        stopped = [n + c for c, mode in enumerate(strike.modes) if mode == STICK]
        active = [*strike.nodes, *stopped]
        matrix = held[active] @ pushing[active].T
        struck_nodes = list(strike.nodes)
        across = chosen.tangential[np.array(stopped, dtype=int) - n]
        wanted = np.concatenate([(1.0 + chosen.restitution[struck_nodes]) * speeds[struck_nodes],
                                 -(1.0 + across) * speeds[stopped]])
        try:
            found = np.linalg.solve(matrix, wanted)
        except np.linalg.LinAlgError:
            return state, [(phase.event, -np.inf)]
        impulses = np.zeros(n + k)
        impulses[active] = found
        after = state.copy()
        after[m:] += pushing[active].T @ found
        moved = held @ (after[m:] - state[m:])
        most = np.abs(found).max() or 1.0
        fastest = np.abs(np.concatenate([speeds, moved])).max() or 1.0
        # Stops and clusters that nothing reaches meet their conditions with a margin of zero.
        sizes = np.linalg.norm(held, axis=1), np.linalg.norm(pushing, axis=1)
        near = np.abs(held @ pushing.T) > _ROUNDING * np.outer(*sizes)
        np.fill_diagonal(near, False)
        struck = phase.stop
        idle = np.array([j != struck and not near[j, active].any() for j in range(n)])
        # Impulses of a touch are rounding.
        touched = abs(speeds[struck]) <= _ROUNDING * fastest
        left = [(2 * k + j, float(impulses[j] / most)) for j in strike.nodes
                if not (idle[j] or touched or j == struck)]
        left += [(2 * k + j, float((moved[j] - speeds[j]) / fastest)) for j in range(n)
                 if phase.closed[j] and j not in strike.nodes and not idle[j]]
        for c, mode in enumerate(strike.modes):
            own = [j for j in strike.nodes if chosen.cluster[j] == c and not idle[j]]
            if mode == STICK and own and not touched:
                limit, given = float(coefficients[own] @ impulses[own]), float(impulses[n + c])
                left += [(2 * c, (limit - given) / most), (2 * c + 1, (limit + given) / most)]
            elif mode in (1, -1) and own:
                # The sense is that of s+ + e_T s-.
                behind = (1.0 + chosen.tangential[c]) * speeds[n + c] + moved[n + c]
                left.append((2 * c, float(mode * behind / fastest)))
        return after, left

    def touches(self, t: float, state: Array, phase: Phase) -> Iterator[Strike]:
        """Impacts that the stop at the end of a phase may have that is only touched.

        Its contact slips; which closed stops beside it take part, its speed tells alone.
        """
        own = int(self.problem.cluster[phase.stop])
        for strike in self._strikes(phase):
            if strike.modes[own] == STICK:
                continue
            left = self.impact(t, state, replace(phase, strike=strike))[1]
            if all(part > 0.0 for event, part in left
                   if event < 2 * self.clusters and strike.modes[event // 2] != STICK):
                yield strike

    def _strikes(self, phase: Phase) -> Iterator[Strike]:
        """Impacts that the stop at the end of a phase may have."""
        node = phase.stop
        others = [j for j in range(self.nodes) if phase.closed[j] and j != node]
        for count in range(len(others), -1, -1):
            for beside in combinations(others, count):
                nodes = (node, *beside)
                rubbed = sorted({int(self.problem.cluster[j]) for j in nodes})
                choices = [(STICK, 1, -1) if self.rubbing[c] else (0,) for c in rubbed]
                for modes in product(*choices):
                    given = [0] * self.clusters
                    for c, mode in zip(rubbed, modes, strict=True):
                        given[c] = mode
                    yield Strike(nodes, tuple(given))

    def strike_at(
        self, t: float, state: Array, phase: Phase, wanted: Array
    ) -> Strike:
        """The impact at the end of a phase that leads to the wanted velocities (m,).

        Raises
        ------
        AnalysisError
            If there is none.
        """
        size = np.abs(np.concatenate([state, wanted])[self.modes :]).max()
        for strike in self._strikes(phase):
            after, left = self.impact(t, state, replace(phase, strike=strike))
            fits = all(part >= -_ROUNDING for _, part in left)
            if fits and np.abs(after[self.modes :] - wanted).max() <= 1e-6 * size:
                return strike
        raise AnalysisError("An impact of the orbit is of a kind that has no derivative.")
