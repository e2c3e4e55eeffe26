"""Periodic orbits of contact systems by multiple shooting with the compiled integrator."""

import dataclasses
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.point import attributes_of
from fecontact.bifurcation.continuation.predictor import BENT, Predictor
from fecontact.bifurcation.continuation.problem import BranchStatus, Problem, enlarged
from fecontact.bifurcation.continuation.rounding import Rounding
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.estimates import OBSERVED_SAMPLES
from fecontact.bifurcation.harmonic.layout import kept_by, layout_of
from fecontact.bifurcation.linalg import condensation
from fecontact.bifurcation.linalg.bordered import Border, Bordered
from fecontact.bifurcation.orbit_methods import Shooting
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.floquet import Floquet, FloquetTests, floquet_of, require_same
from fecontact.bifurcation.orbits.mesh import extremes_of_run, interpolate, require_segments
from fecontact.bifurcation.orbits.multiplier_rounding import MultiplierRounding
from fecontact.bifurcation.orbits.same_orbit import (
    HALVES_MEET,
    HALVES_PART,
    HALVING,
    VANISHING,
    near_saddle,
    same_place,
    shrunk,
)
from fecontact.bifurcation.orbits.unknowns import OrbitUnknowns, by_differences
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array
from fecontact.integrate.ensembles import ensemble
from fecontact.integrate.sensitivities import Sensitivity, differentiated
from fecontact.integrate.solvers import AUTO, Solver
from fecontact.integrate.trajectory import Status
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import slider_counts

# Phase after the start of a segment below which the start itself is used.
_AT_START = 1e-10
# Phase about the nearest state of an orbit within which it crosses the plane of the phase.
_IN_PHASE = 1.0 / 64.0
# Largest change of what an element keeps that sticks, by derivatives of runs.
_STICKS = 1e-6
# Part of a period over which rates of set-valued motions are taken.
_BRIEF = 1e-5
# Largest gap between the runs of a set-valued orbit, in scales of the states.
_RETURNS = 1e-7


@dataclass(frozen=True, eq=False)
class ShootingProblem(OrbitUnknowns, FloquetTests, Problem):
    """Equations of a periodic orbit of a contact system, one parameter free.

    The period is divided into K segments; the run from the start x_j of each ends at the start of
    the next. The integrator chooses its own steps, so that steep friction (k_s = 1e6 s/m) and many
    states cost no more than in a run, while collocation needs a mesh that resolves them. For
    autonomous systems the period T is an unknown, and the phase is fixed by
    <f(y_0), x_0 - y_0> = 0 with the start y_0 of the previous orbit; else T is ``periods`` times
    the period of the forcing.

    The unknowns are ``u = [x_0 .. x_(K-1) (K d), T if it is unknown, parameter]``. Stored values
    are those of collocation; minimum and maximum lie on cubics between samples, of which a
    period has 512.

    Attributes
    ----------
    field : ContactField
    values : (k,) array
        Parameters; the free one is taken from u.
    free : int
        Index of the free parameter.
    mesh : (K + 1,) array
        Ends of the segments, from 0 to 1.
    reference : (d,) array
        Start of the orbit that fixes the phase.
    scales : (d + 2,) array
        Scales in the step length: of each state, the period and the parameter.
    periods : int
        Number of forcing periods in one period of the orbit.
    rtol : float
        Relative tolerance of the runs.
    derivative_rtol : float or None
        Relative tolerance of the derivatives; see :func:`fecontact.sensitivity`.
    solver : Auto, Rodas5P, Radau or SetValued
        Solver that runs the segments.
    precision : float
        Tolerance of the location of special points, relative to the step: that of the runs.
    predictor : Predictor
        Of the next orbit, from those before it.
    limits : (d,) array, optional
        Upper limits up to which the scales of the states grow with the orbit; None keeps the
        scales.
    noted : list of (u, sizes)
        Half the ranges (d,) of the states along the orbit whose values were stored last.
    """

    field: ContactField
    values: Array
    free: int
    mesh: Array
    reference: Array
    scales: Array
    periods: int = 1
    rtol: float = 1e-9
    derivative_rtol: float | None = None
    solver: Solver = AUTO
    precision: float = 1e-7
    predictor: Predictor = BENT
    limits: Array | None = None
    noted: list[tuple[Array, Array]] = dataclasses.field(default_factory=list)

    keeps_matrix: ClassVar[bool] = True
    polishes: ClassVar[bool] = True
    event_precision: ClassVar[float] = 1e-9
    ends: ClassVar[Mapping[str, BranchStatus]] = {VANISHING: BranchStatus.HOPF}

    def attributes(self) -> dict[str, Any]:
        """Attributes of a branch from which the problem of its points is restored."""
        found = {**attributes_of(self.field, self.values), "scales": self.scales,
                 "periods": self.periods, "method": Shooting(
                     len(self.mesh) - 1, self.rtol, self.derivative_rtol, self.solver)}
        if self.limits is not None:
            found["limits"] = self.limits
        return found

    def starts(self, u: Array) -> Array:
        """Starts (K, d) of the segments."""
        return np.ascontiguousarray(u[: -self.common].reshape(-1, self.field.dimension))

    @cached_property
    def phase_row(self) -> Array:
        """Unit direction (d,) of the motion at the reference, in the scaled states."""
        f = self.rates(0.0, self.reference, self.values)
        row = f / self.scales[: len(f)] ** 2
        return row / np.linalg.norm(row * self.scales[: len(f)])

    @cached_property
    def _sliders(self) -> Any:
        """Whether states (d,) are deflections of elastic Coulomb elements."""
        system = self.field.system()
        nodes, modes = slider_counts(system) > 0, system.basis.modes
        return np.append(np.zeros(2 * modes, dtype=bool), np.repeat(nodes, system.memory))

    def rates(self, t: float, state: Array, values: Array) -> Array:
        """Rates (d,) of a state.

        Those of set-valued motions, and of deflections that an element keeps while it slides, are
        those of a brief run from there.
        """
        smooth = np.asarray(self.field.rates(np.array([t]), state[None].copy(), values)[0])
        if self.solver.smooth and not self._sliders.any():
            return smooth
        h = _BRIEF * float(self.scales[-2])
        first, middle, last = run_from(self.field.system(values), t + np.array([[0.0, h, 2.0 * h]]),
                                       state[None].copy(), self.rtol, self.solver)[0]
        found = (4.0 * middle - 3.0 * first - last) / (2.0 * h)
        return np.where(self._sliders, found, smooth) if self.solver.smooth else np.asarray(found)

    def linearise(self, u: Array) -> "ShootingLinearisation":
        """Residual and linearisation at u, each computed on demand."""
        return ShootingLinearisation(self, u)

    def weights(self) -> Array:
        """Weights of the inner product: mean of the scaled starts, T, parameter."""
        d = self.field.dimension
        nodal = (np.diff(self.mesh)[:, None] / self.scales[:d] ** 2).reshape(-1)
        return np.concatenate([nodal, 1.0 / self.scales[-self.common:] ** 2])

    @cached_property
    def rounding(self) -> Rounding:
        """Of the multipliers; the errors of the runs dominate in small Newton steps."""
        return MultiplierRounding(float(self.scales[-1]), max(1e-7, 10.0 * self.rtol))

    def adapted(self, u: Array, tangent: Array) -> "tuple[ShootingProblem, Array, Array]":
        """The problem for the next step, with the phase condition at u."""
        return replace(
            self, reference=self.starts(u)[0].copy(), values=self.parameters(u),
            scales=self._grown(u),
            predictor=self.predictor.after(self.weights(), u, tangent)), u, tangent

    def _grown(self, u: Array) -> Array:
        """Scales of states, period and parameter, enlarged with the orbit."""
        found = next((sizes for known, sizes in self.noted if known is u), None)
        return self.scales if found is None else enlarged(self.scales, found, self.limits)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, stability, segments and the extremes of the states."""
        if not self.solver.smooth:
            self._require_return(u)
            linearisation.require_certain()
        elif self._sliders.any() and not self.autonomous:
            linearisation.require_sliding()
        low, high = linearisation.extremes
        self.noted[:] = [(u, (high - low) / 2.0)]
        return {"period": self.period(u), **linearisation.floquet.stored, "mesh": self.mesh,
                "minimum": low, "maximum": high}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Test functions of the multipliers, and of orbits that shrink to an equilibrium."""
        found = super().tests(u, linearisation, tangent)
        before = self.predictor.last
        if self.autonomous and before is not None:
            # About the middle of this orbit, which is nearly that of the one before.
            middle = linearisation.paths.mean(axis=(0, 1))
            found[VANISHING] = shrunk(self.scales[: len(middle)] ** -2.0, self.starts(u) - middle,
                                      self.starts(before) - middle)
        return found

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """At orbits that are homoclinic to a saddle, as far as numbers tell."""
        states = linearisation.paths.reshape(-1, self.field.dimension)
        samples = linearisation.paths.shape[1]
        shares = np.repeat(np.diff(self.mesh) / samples, samples)
        near = self.autonomous and near_saddle(self, self.parameters(u), states, shares, tangent)
        return BranchStatus.HOMOCLINIC if near else None

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """The kind of a torus bifurcation; None for a neutral saddle.

        A branch point at which a doubled orbit becomes a single one is a period halving. The
        parameter turns there, too.
        """
        if kind in ("fold", "branch point") and self._halves_meet(u, linearisation, tangent):
            return {"kind": HALVING} if kind == "branch point" else None
        return super().examine(kind, u, linearisation, tangent)

    def _halves_meet(self, u: Array, linearisation: Any, tangent: Array) -> bool:
        """Whether an orbit is a single one traversed twice, whose halves the branch separates."""
        if len(self.mesh) % 2 == 0:
            return False
        sizes = self.scales[: self.field.dimension]
        apart, separating = (np.subtract(*np.split(self.starts(one) / sizes, 2))
                             for one in (u, tangent))
        motion = np.ptp(linearisation.paths, axis=(0, 1)) / sizes
        along = np.linalg.norm(self.starts(tangent) / sizes)
        return bool(np.linalg.norm(apart) < HALVES_MEET * np.linalg.norm(motion)
                    and 0.5 * np.linalg.norm(separating) ** 2 > HALVES_PART * along**2)

    def _require_return(self, u: Array) -> None:
        """Raise AnalysisError unless the runs from u meet; a jump looks like a solution."""
        d = self.field.dimension
        gaps = self.linearise(u).residual[: len(u) - self.common].reshape(-1, d)
        if np.abs(gaps / self.scales[:d]).max() > _RETURNS:
            raise AnalysisError("The set-valued motion jumps there: an event appears or vanishes.")

    def met_again(
        self, origin: Any, u: Array, tangent: Array, like: Array, heading: Array, within: float
    ) -> Array | None:
        """See :meth:`Problem.met_again`: started in the phase of ``like``."""
        if len(u) != len(like) or not same_place(self, (u, tangent), (like, heading), within):
            return None
        try:
            return started_in_phase(self, u, like)
        except AnalysisError:
            return None

    def at_phases(self, u: Array, phases: Array) -> Array:
        """States (k, d) of an orbit at phases (k,) in periods, each run from its segment's start.

        Raises
        ------
        AnalysisError
            If a run fails.
        """
        inside = np.mod(phases, 1.0)
        segments = np.searchsorted(self.mesh, inside + _AT_START, side="right") - 1
        since = inside - self.mesh[segments]
        segments %= len(self.mesh) - 1
        found = self.starts(u)[segments]
        runs = np.flatnonzero(since > _AT_START)
        if len(runs):
            begin = self.mesh[segments[runs]]
            times = self.period(u) * np.stack([begin, begin + since[runs]], axis=1)
            found[runs] = run_from(self.field.system(self.parameters(u)), times, found[runs],
                                   self.rtol, self.solver)[:, -1]
        return found


def shooting_from(
    problem: CollocationProblem, u: Array, segments: int = 4, rtol: float = 1e-9,
    derivative_rtol: float | None = None, solver: Solver = AUTO,
) -> tuple[ShootingProblem, Array]:
    """The shooting problem of an orbit, with segments of equal length, and its first guess.

    Raises
    ------
    InputError
        If the field is not that of a contact system, or the number of segments is not positive.
    """
    field = problem.field
    if not isinstance(field, ContactField):
        raise InputError("Shooting runs contact systems; make the field with contact_field, or "
                         "stay with collocation.")
    require_segments(segments)
    mesh = np.linspace(0.0, 1.0, segments + 1)
    starts = interpolate(problem.mesh, problem.nodes(u), mesh[:-1])
    result = ShootingProblem(field, problem.parameters(u), problem.free, mesh, starts[0].copy(),
                             problem.scales, problem.periods, rtol, derivative_rtol, solver)
    return result, np.concatenate([starts.reshape(-1), u[problem.size :]])


def run_from(
    system: ContactSystem, times: Array, starts: Array, rtol: float, solver: Solver = AUTO
) -> Array:
    """States (K, k, d) at times (K, k) of runs from starts (K, d); AnalysisError if one fails."""
    found = ensemble(system, times, initial=starts, rtol=rtol, solver=solver)
    if not found.finished.all():
        status = found.status[int(np.argmin(found.finished))]
        if status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        raise AnalysisError(f"The run of a segment did not reach its end: {status.value}")
    return found.states


def started_in_phase(problem: ShootingProblem, u: Array, like: Array) -> Array:
    """An orbit by shooting, shifted in time to lie next to another one.

    If the phase is free, it starts on the plane of the phase condition, else an integer number of
    forcing periods later.

    Raises
    ------
    AnalysisError
        If a run fails.
    """
    from scipy.optimize import brentq

    d = problem.field.dimension
    paths = problem.linearise(u).paths
    samples = paths.shape[1] - 1
    grid = np.append(np.linspace(problem.mesh[:-1], problem.mesh[1:], samples, endpoint=False,
                                 axis=1).reshape(-1), 1.0)
    path = np.concatenate([paths[:, :-1].reshape(-1, d), paths[:1, 0]])
    starts, wanted = problem.mesh[:-1], problem.starts(like)

    def apart(shift: float) -> float:
        phases = np.mod(starts + shift, 1.0)
        near = np.stack([np.interp(phases, grid, column) for column in path.T], axis=1)
        return float((((near - wanted) / problem.scales[:d]) ** 2).sum())

    def off(shift: float) -> float:
        return float(problem.phase_row @ (problem.at_phases(u, np.array([shift]))[0]
                                          - problem.reference))

    if problem.autonomous:
        shift = min(grid[:-1], key=apart)
        low, high = shift - _IN_PHASE, shift + _IN_PHASE
        if off(low) * off(high) < 0.0:
            shift = float(brentq(off, low, high, xtol=1e-12))
    else:
        shift = min((k / problem.periods for k in range(problem.periods)), key=apart)
    return np.concatenate([problem.at_phases(u, starts + shift).reshape(-1), u[-problem.common:]])


class ShootingLinearisation:
    """Residual of the shooting equations at u, and solutions of systems with their derivative."""

    def __init__(self, problem: ShootingProblem, u: Array) -> None:
        self.problem, self.u = problem, u
        self._last: tuple[Array, Bordered] | None = None

    @cached_property
    def _system(self) -> Any:
        return self.problem.field.system(self.problem.parameters(self.u))

    @cached_property
    def _times(self) -> Array:
        T = self.problem.period(self.u)
        if not T > 0.0:
            raise AnalysisError("The period became negative.")
        return self.problem.mesh * T

    @cached_property
    def runs(self) -> list[Sensitivity]:
        """The segments, with derivatives to their starts and the parameter."""
        problem = self.problem
        values = problem.parameters(self.u)

        @cache
        def moved(value: float) -> ContactSystem:
            beside = values.copy()
            beside[problem.free] = value
            return problem.field.system(beside)

        def run(start: Array, begin: float, end: float) -> Sensitivity:
            return differentiated(self._system, np.array([begin, end]), start,
                                  (lambda _, value: moved(value), float(self.u[-1])),
                                  problem.solver, problem.rtol, problem.derivative_rtol)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(run, problem.starts(self.u), self._times[:-1], self._times[1:]))

    @cached_property
    def paths(self) -> Array:
        """States (K, samples, d) of the segments, from start to end."""
        problem = self.problem
        steps = -(-OBSERVED_SAMPLES * problem.periods // (len(problem.mesh) - 1))
        times = np.linspace(self._times[:-1], self._times[1:], steps + 1, axis=1)
        return run_from(self._system, times, problem.starts(self.u), problem.rtol, problem.solver)

    @property
    def extremes(self) -> tuple[Array, Array]:
        """Smallest and largest value (d,) of each state.

        Those of set-valued motions, which jump, and of deflections that an element keeps while it
        slides are those of the samples themselves.
        """
        problem, paths = self.problem, self.paths
        low, high = paths.min(axis=(0, 1)), paths.max(axis=(0, 1))
        if not problem.solver.smooth:
            return low, high
        times = np.linspace(self._times[:-1], self._times[1:], paths.shape[1], axis=1)
        rates = problem.field.rates(times.ravel(), paths.reshape(-1, paths.shape[2]),
                                    problem.parameters(self.u)).reshape(paths.shape)
        step = (np.diff(self._times) / (paths.shape[1] - 1))[:, None, None]
        between = extremes_of_run(paths, step * rates)
        return (np.where(problem._sliders, low, between[0]),
                np.where(problem._sliders, high, between[1]))

    @cached_property
    def _ends(self) -> Array:
        if "runs" in self.__dict__:
            return np.array([run.states[-1] for run in self.runs])
        return self.paths[:, -1]

    @cached_property
    def residual(self) -> Array:
        """Defects (K d,) between the segments, and the phase condition if the period is unknown."""
        problem, starts = self.problem, self.problem.starts(self.u)
        gaps = (self._ends - np.roll(starts, -1, axis=0)).reshape(-1)
        if not problem.autonomous:
            return gaps
        return np.append(gaps, problem.phase_row @ (starts[0] - problem.reference))

    @cached_property
    def factors(self) -> condensation.CondensedFactors:
        """The chained equations."""
        problem = self.problem
        K, d = len(problem.mesh) - 1, problem.field.dimension
        factors = condensation.factors_for(K, 1, d, problem.common)
        values = problem.parameters(self.u)
        slope = 0.0 if problem.autonomous else float(by_differences(problem.period, self.u))
        for j, run in enumerate(self.runs):
            factors.local[j, :, :d] = run.monodromy
            factors.local[j, :, d : 2 * d] = -np.eye(d)
            factors.local[j, :, -1] = run.parameter_derivative
            if problem.autonomous:
                f = problem.rates(0.0, run.states[-1], values)
                factors.local[j, :, -2] = (problem.mesh[j + 1] - problem.mesh[j]) * f
            elif slope:
                factors.local[j, :, -1] += slope * self._shifted(j, run, values)
        condensation.chain_intervals(factors)
        return factors

    def _shifted(self, j: int, run: Sensitivity, values: Array) -> Array:
        """Derivative (d,) of the end of segment j with respect to the period."""
        problem = self.problem
        before, after = (problem.rates(float(self._times[k]), state, values)
                         for k, state in ((j, run.states[0]), (j + 1, run.states[-1])))
        moved = problem.mesh[j + 1] * after - problem.mesh[j] * (run.monodromy @ before)
        return np.asarray(moved)

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        if self._last is None or self._last[0] is not row:
            borders = [Border(self.factors, row)]
            if self.problem.autonomous:
                phase = np.zeros_like(row)
                phase[: len(self.problem.phase_row)] = self.problem.phase_row
                borders.insert(0, Border(self.factors, phase))
            self._last = row, Bordered(self.factors, borders, 1.0)
        return self._last[1].solve(rhs)

    @cached_property
    def floquet(self) -> Floquet:
        """Multipliers and stability."""
        return floquet_of(self.factors, self.problem.autonomous)

    def require_sliding(self) -> None:
        """Raise AnalysisError if an elastic Coulomb element sticks all the time.

        Its deflection less its displacement, a row w, then is kept: w M = w of each segment.
        """
        problem = self.problem
        layout = layout_of(problem.field)
        w = np.zeros((layout.memory, layout.states))
        w[:, : layout.displacements] = -kept_by(problem.field, layout).rows
        w[:, layout.internal] = np.eye(layout.memory)
        w = w[problem._sliders[layout.internal]]
        if (np.max([np.abs(w @ run.monodromy - w).max(axis=1) for run in self.runs], axis=0)
                < _STICKS).any():
            raise AnalysisError(f"At {problem.parameter_name} = {self.u[-1]:.6g} an elastic "
                                f"Coulomb element never slides: it keeps any deflection, so that "
                                f"orbits are not isolated; follow them by HarmonicBalance().")

    def require_certain(self) -> None:
        """Warn where differences of set-valued runs to one side have other multipliers."""
        require_same(self.floquet.multipliers, [run.sided for run in self.runs],
                     f"{self.problem.parameter_name} = {self.u[-1]:.6g}")
