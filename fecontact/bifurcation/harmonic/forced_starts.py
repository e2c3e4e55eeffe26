"""Forces that excite systems, and orbits from which responses start: from rest or a run."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, width_of
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic import branches, starts
from fecontact.bifurcation.harmonic.compiled.arrays import RESTS
from fecontact.bifurcation.harmonic.engine_order import WaveField
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.harmonic.stalled import NO_WAVE
from fecontact.bifurcation.orbits.from_run import periodic_motion
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.types import Array, ComplexArray
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.model_limits import unresisted_motion
from fecontact.system.statics.equilibrium import equilibrium_coordinates

# Part of a level, or of the excitation, from which it is raised.
_FIRST = 1e-3
# Samples a period of given forces.
_SAMPLES = 32


@dataclass(frozen=True, eq=False)
class Forced:
    """Forced orbits over one parameter, the others held.

    Attributes
    ----------
    field : VectorField
    values : (k,) array
        Values of the parameters.
    free : int
        Index of the one that varies.
    method : Collocation, Shooting or HarmonicBalance
    options : ContinuationOptions
    held : (d,) array, optional
        State of a preload, whose deflections elements keep that never slide; by default of rest.
    level : int, optional
        Index of a parameter that can be raised from a small value, such as an amplitude.
    """

    field: VectorField
    values: Array
    free: int
    method: Any
    options: ContinuationOptions
    held: Array | None = None
    level: int | None = None

    @property
    def name(self) -> str:
        """Name of the parameter that varies."""
        return list(self.field.parameters)[self.free]

    def at(self, value: float) -> "Forced":
        """These orbits at another value of the parameter."""
        values = self.values.copy()
        values[self.free] = value
        return replace(self, values=values)


def values_to_start_at(wanted: Forced, first: float, *, both: bool) -> list[float]:
    """Values of the parameter at which a branch may start, in the order in which they are tried.

    They are the first value, and the bounds unless the branch goes to both sides.
    """
    return [first] if both else [first, *(end for end in wanted.options.bounds if end != first)]


def start_of(
    wanted: Forced, first: float, *, both: bool
) -> tuple[float, HarmonicProblem, Array]:
    """Value of the parameter, problem and unknowns of the orbit from which a branch starts.

    It is tried at :func:`values_to_start_at`.

    Raises
    ------
    InputError, AnalysisError
        If there is no orbit at any.
    """
    field = wanted.field
    ends = values_to_start_at(wanted, first, both=both)
    ways: list[Callable[[Forced], tuple[HarmonicProblem, Array]]] = [_from_rest]
    if wanted.level is not None:
        ways.append(_raised)
    if isinstance(field, WaveField):
        ways.append(_excited_further)
    elif isinstance(field, ContactField) and wanted.method.repeats is None:
        ways.append(_from_run)
    failure: FecontactError = AnalysisError("No orbit was found to start from.")
    for begin in ends:
        try:
            require_period(wanted.at(begin))
        except FecontactError as error:
            failure = error
            continue
        for way in ways:
            try:
                return begin, *way(wanted.at(begin))
            except FecontactError as error:
                failure = error
    # The supports of a wheel's sector are those of the wheel.
    resisted = isinstance(failure, InputError) or isinstance(field, WaveField)
    if isinstance(field, ContactField) and not resisted and (
            free_motion := unresisted_motion(field.system(wanted.at(ends[-1]).values))):
        raise AnalysisError(f"No orbit was found to start from. {free_motion}") from failure
    raise failure


def require_period(wanted: Forced) -> None:
    """Raise an error unless something excites the system with a period."""
    if wanted.field.forcing_period(wanted.values) is None:
        raise InputError("Nothing excites the system with a period; a frequency response needs a "
                         "harmonic drive or load.")


def _problem(wanted: Forced) -> HarmonicProblem:
    """The problem with scales of the states that grow with the response."""
    field, values, free, method = wanted.field, wanted.values, wanted.free, wanted.method
    scales = np.ones(field.dimension + 2)
    scales[-1] = width_of(None, wanted.options, float(values[free]))
    problem = starts.problem_for(field, values, free, method, scales,
                                 limits=np.full(field.dimension, 1e4))
    require_period(wanted)
    scales[-2] = problem.period(values[[free]])
    if not np.isfinite(scales[-2]):
        raise InputError(f"At {wanted.name} = {values[free]:g} the excitation has no period.")
    if method.orders is not None and not isinstance(field, WaveField):
        _require_excited(problem, rest_state(field, values), method.orders)
    if isinstance(field, ContactField) and method.orders is not None:
        starts.require_mean(method, rest_state(field, values)[: problem.layout.displacements])
    if isinstance(field, ContactField) and problem.layout.memory:
        state = rest_state(field, values) if wanted.held is None else wanted.held
        problem = replace(problem, kept=problem.kept.left_by(state[None]))
    return problem


def _require_excited(problem: HarmonicProblem, rest: Array, orders: tuple[int, ...]) -> None:
    """Raise InputError if a list of harmonics has none of those that force a system at rest."""
    values, N = problem.values, problem.samples
    times = problem.period(values[[problem.free]]) * np.arange(N) / N
    rates = problem.field.rates(times, np.tile(rest, (N, 1)), values)
    sizes = np.abs(np.fft.rfft(rates, axis=0)).max(axis=1)
    sizes[0] = 0.0
    forced = np.flatnonzero(sizes > max(1e-9 * sizes.max(), 1e-12 * N * np.abs(rates).max()))
    if len(forced) and not set(orders) & set(forced.tolist()):
        raise InputError(f"HarmonicBalance: harmonics = {list(orders)} leave out all harmonics of "
                         f"the excitation, {forced.tolist()[:9]}; add these.")


def _from_rest(wanted: Forced) -> tuple[HarmonicProblem, Array]:
    """The orbit that Newton's method finds from rest, and scales of its size."""
    problem, field = _problem(wanted), wanted.field
    u = np.append(np.zeros(problem.size), wanted.values[wanted.free])
    if isinstance(field, ContactField) and not _rests_at_zero(problem, field, u):
        state = rest_state(field, wanted.values)
        u = starts.unknowns(problem, np.tile(state, (problem.samples, 1)), 0.0)
    return _scaled(*starts.converged_orbit(problem, u))


def _rests_at_zero(problem: HarmonicProblem, field: ContactField, u: Array) -> bool:
    """Whether all forces without displacement are known to have no mean."""
    e = problem.equations(float(u[-1]))
    return (e is not None and not problem.layout.memory and e.numbers[RESTS] != 0.0
            and not field.system().basis.springs)


def rest_state(field: VectorField, values: Array) -> Array:
    """State (d,) of rest under the loads' means, of the normal problem alone; zero for others."""
    state = np.zeros(field.dimension)
    if not isinstance(field, ContactField):
        return state
    if isinstance(field, WaveField):
        return field.waves.rest(field, values)
    try:
        q = equilibrium_coordinates(field.system(values), "rest", 0.0, standing=True)
    except FecontactError:
        return state
    state[: len(q)] = q
    return state


def _scaled(problem: HarmonicProblem, u: Array) -> tuple[HarmonicProblem, Array]:
    """The problem with scales of the size of an orbit; it is found again to their precision."""
    if problem.layout.memory:
        low, high = problem.extremes(u, problem.linearise(u).memory)
        sizes = (high - low) / 2.0
    else:
        states = problem.states(u, problem.period(u), np.zeros((problem.samples, 0)))
        sizes = (states.max(axis=0) - states.min(axis=0)) / 2.0
    largest = float(sizes.max()) or 1.0
    sizes = np.maximum(sizes, 1e-3 * largest)
    scales = np.concatenate([sizes, problem.scales[-2:]])
    scaled = replace(problem, scales=scales, limits=1e4 * sizes)
    # A branch begins so by itself where that is quick.
    return (scaled, u) if scaled.equations(float(u[-1])) else starts.converged_orbit(scaled, u)


def _excited_further(wanted: Forced) -> tuple[HarmonicProblem, Array]:
    """The wave at full excitation, along a branch from a small part of it."""
    assert isinstance(wanted.field, WaveField)
    part = wanted.field.waves.excited(wanted.field, wanted.values)
    try:
        states = _up_to(replace(wanted, field=part, values=part.values), 0, 1.0)
    except AnalysisError as error:
        said = str(error).replace("No orbit was found at the level 1",
                                  "No wave was found under the whole excitation")
        raise AnalysisError(f"{said} {NO_WAVE}") from None
    return _taken(wanted, states)


def _raised(wanted: Forced) -> tuple[HarmonicProblem, Array]:
    """The orbit at a level, along a branch from a small part of it."""
    assert wanted.level is not None
    return _taken(wanted, _up_to(wanted, wanted.level, float(wanted.values[wanted.level])))


def _up_to(wanted: Forced, level: int, value: float) -> Array:
    """States (k, d) over the period of the orbit at a level, along a branch to it."""
    low = _FIRST * value
    options = replace(wanted.options, bounds=(min(low, value), max(low, value)))
    plain = replace(wanted.method, tolerance=None, sampling_tolerance=None)
    first = replace(wanted, free=level, method=plain, options=options).at(low)
    branch = branches.follow(*_from_rest(first), None, plain, replace(
        options, locate=False, progress=None), direction=np.sign(value))
    if branch.status is BranchStatus.INTERRUPTED:
        raise KeyboardInterrupt
    last = branch.points[-1]
    if last.parameter != value:
        raise AnalysisError(f"No orbit was found at the level {value:g}: raised from a thousandth "
                            f"of it, the branch ends at {last.parameter:.4g}.")
    return np.asarray(last.orbit(samples=501).states)


def _from_run(wanted: Forced) -> tuple[HarmonicProblem, Array]:
    """The orbit to which a run settles."""
    field, values = wanted.field, wanted.values
    assert isinstance(field, ContactField)
    motion = periodic_motion(field.system(values), longest_period=field.forcing_period(values))
    return _taken(wanted, motion.states)


def _taken(wanted: Forced, states: Array) -> tuple[HarmonicProblem, Array]:
    """The orbit near states (k, d) over a period, both ends included."""
    problem = _problem(wanted)
    phases = np.linspace(0.0, 1.0, len(states))
    sampled = np.stack([np.interp(problem.series.times, phases, column) for column in states.T],
                       axis=1)
    return _scaled(*starts.converged_orbit(problem, starts.unknowns(problem, sampled, 0.0)))


def given_force(field: ContactField, values: Array, state: Array, period: float) -> ComplexArray:
    """Harmonic P (m,) of the modal forces in time, ``f = Re(P exp(i w t))``, at a state (d,)."""
    m = field.system().basis.modes
    phases = np.arange(_SAMPLES) / _SAMPLES
    rates = field.rates(phases * period, np.tile(state, (_SAMPLES, 1)), values)[:, m : 2 * m]
    return np.asarray(2.0 / _SAMPLES * np.exp(-2.0j * np.pi * phases) @ rates)


def require_excitation(field: ContactField, values: Array) -> float:
    """Period [s] of the excitation.

    Raises
    ------
    InputError
        If nothing excites the system with a period.
    """
    period = field.forcing_period(values)
    if period is None or not np.isfinite(period):
        raise InputError("Nothing excites the system with a period; give it a harmonic drive or "
                         "load.")
    return period
