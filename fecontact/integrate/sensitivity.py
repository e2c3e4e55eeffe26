"""Derivatives of a motion with respect to its initial state and a parameter."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.ensemble import Ensemble, ensemble
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.rodas5p import step_loop
from fecontact.integrate.rodas5p.driver import ENDS, finish, start
from fecontact.integrate.rodas5p.variational import MOVE
from fecontact.integrate.simulate import output_times, require_max_step
from fecontact.integrate.solvers import RODAS5P, Rodas5P, Solver, require_solver
from fecontact.integrate.trajectory import Status
from fecontact.system.contact_system import ContactSystem

Parameter = str | tuple[Callable[[ContactSystem, float], ContactSystem], float]

# Largest change of ground velocity, relative to the velocity scale of friction.
_SLIP = 0.05
# Change of the state for a difference of runs, in parts of its largest value.
_DIFFERENCE = 1e-5
# Steps between two output times at which states are looked at for their largest values.
_BETWEEN = 16


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """A motion at K times, and its derivatives.

    Attributes
    ----------
    times : (K,) array
        [s].
    states : (K, size) array
        y = [q, q', z].
    transitions : (K - 1, size, size) array
        dy(t_k+1) / dy(t_k).
    forced : (K - 1, size) array or None
        dy(t_k+1) / dp for a fixed state at t_k.
    sided : (2, K - 1, size, size) array or None
        The transitions by differences to one side, above and below the state, where runs are
        differenced. Where a jump of their ends lies near, they are far apart.
    """

    times: Array
    states: Array
    transitions: Array
    forced: Array | None
    sided: Array | None = None

    @property
    def monodromy(self) -> Array:
        """dy(t_end) / dy(t_start) (size, size): the product of the transitions.

        Products over long times lose small multipliers, which the single transitions keep.
        """
        result = np.eye(self.states.shape[1])
        for transition in self.transitions:
            result = transition @ result
        return result

    @property
    def parameter_derivative(self) -> Array:
        """dy(t_end) / dp (size,) for a fixed initial state.

        Raises
        ------
        InputError
            If no parameter was named.
        """
        if self.forced is None:
            raise InputError("No parameter was named; give parameter = '...' to sensitivity.")
        result = np.zeros(self.states.shape[1])
        for transition, forced in zip(self.transitions, self.forced, strict=True):
            result = transition @ result + forced
        return result


def sensitivity(
    system: ContactSystem,
    t_end: float,
    *,
    t_start: float = 0.0,
    initial: Initial = "rest",
    outputs: int | ArrayLike = 2,
    parameter: Parameter | None = None,
    solver: Solver = RODAS5P,
    rtol: float = 1e-8,
    derivative_rtol: float | None = None,
    max_step: float | None = None,
) -> Sensitivity:
    """Integrate a motion and its derivatives with respect to initial state and a parameter.

    The computed steps themselves are differentiated (discrete sensitivities), at fixed step sizes;
    second derivatives of laws are found by finite differences, of relative accuracy 1e-8. With more
    than four modes or two nodes, and no memory, the linear equation of the derivatives is solved
    along the computed motion instead. Forces are continuous: contact and stick need no jumps.

    With SetValued, forces and velocities jump. Its runs locate the jumps, so that the end of a run
    is a function of its start that is smooth except where a jump appears or vanishes; derivatives
    are central differences of this function, which contain the saltation at the jumps, of relative
    accuracy 1e-6. Each costs two runs.

    Parameters
    ----------
    system, t_end, t_start, initial, outputs
        As for :func:`fecontact.simulate`.
    parameter : str, or (function, value), optional
        Dotted name of a number of the system, ``"ground.speed"``; or a function that returns the
        system for a value, and the value.
    solver : Rodas5P or SetValued
        Whose steps, or runs, are differentiated.
    rtol : float
        Relative tolerance of the run.
    derivative_rtol : float, optional
        Tolerance of the derivatives per step, relative to their largest values since the last
        output time; by default ten times ``rtol`` where steps are differentiated, 200 times
        along the motion, relative to their current values or a tenth of the largest. 1e-2 saves
        work that only fast disturbances require. Where steps are differentiated, derivatives of
        small motions take steps that the run, whose tolerance is then absolute, does not need.
    max_step : float, optional
        Longest step [s]; see :func:`fecontact.simulate`.

    Raises
    ------
    InputError
        For values out of range, and parameters that do not exist or are not numbers.
    AnalysisError
        If the run does not reach its end.
    """
    require_kind("sensitivity", ContactSystem, system=system)
    times = output_times(t_start, t_end, outputs)
    if not (isinstance(rtol, Real) and 1e-13 <= rtol <= 1e-2):
        raise InputError(f"rtol = {rtol!r} must be a number from 1e-13 to 0.01.")
    if derivative_rtol is not None and not (isinstance(derivative_rtol, Real)
                                            and 1e-13 <= derivative_rtol <= 1.0):
        raise InputError(f"derivative_rtol = {derivative_rtol!r} must be a number from 1e-13 to 1.")
    require_max_step(max_step)
    require_solver(solver)
    state = initial_state(system, initial, t_start)
    if not isinstance(solver, Rodas5P):
        return _differences(system, times, state, parameter, solver, float(rtol), max_step)
    vary = True if parameter is None else _moved(system, parameter)
    run = start(system, state, times, rtol=float(rtol), max_step=max_step, work=False,
                vary=vary, vary_rtol=derivative_rtol, collocation=solver.collocation)
    result = finish(run)
    if result != step_loop.FINISHED:
        raise AnalysisError(f"The run ended at t = {run.time:.9g} s, before t_end = {t_end:.9g}: "
                            f"{ENDS[result].value}")
    columns = run.variation.transitions[1:].transpose(0, 2, 1)
    size = len(state)
    return Sensitivity(times, run.states, np.ascontiguousarray(columns[:, :, :size]),
                       None if parameter is None else columns[:, :, size].copy())


def _differences(
    system: ContactSystem, times: Array, state: Array, parameter: Parameter | None,
    solver: Solver, rtol: float, max_step: float | None,
) -> Sensitivity:
    """Derivatives by differences of runs between the output times."""
    # Errors of runs are divided by the change of the state.
    settings: dict[str, Any] = {"solver": solver, "rtol": max(1e-3 * rtol, 1e-12),
                                "max_step": max_step}
    size, pieces = len(state), len(times) - 1
    # At the output times alone the system may be at rest.
    parts = np.linspace(0.0, 1.0, _BETWEEN + 1)[:-1]
    close = np.append((times[:-1, None] + np.diff(times)[:, None] * parts).reshape(-1), times[-1])
    found = _states(ensemble(system, close, initial=state[None], **settings))[0]
    states = found[::_BETWEEN]
    largest = np.abs(found).reshape(len(close), 2, -1).max(axis=(0, 2))
    moves = np.repeat(_DIFFERENCE * np.where(largest > 0.0, largest, 1.0), size // 2)
    spans = np.stack([times[:-1], times[1:]], axis=1)
    aside = np.concatenate([np.diag(moves), -np.diag(moves)])
    ends = _states(ensemble(system, np.repeat(spans, 2 * size, axis=0), **settings, initial=(
        states[:-1, None] + aside).reshape(-1, size)))[:, -1].reshape(pieces, 2, size, size)
    columns = (ends[:, 0] - ends[:, 1]) / (2.0 * moves[:, None])
    sided = np.stack([ends[:, 0] - states[1:, None], states[1:, None] - ends[:, 1]]) / (
        moves[:, None])
    forced = None
    if parameter is not None:
        above, below, width = _moved(system, parameter, False)
        ends = _states(ensemble([above] * pieces + [below] * pieces, np.tile(spans, (2, 1)),
                                initial=np.tile(states[:-1], (2, 1)), **settings))[:, -1]
        forced = (ends[:pieces] - ends[pieces:]) / width
    return Sensitivity(times, states, np.ascontiguousarray(columns.transpose(0, 2, 1)), forced,
                       sided.swapaxes(2, 3))


def _states(found: Ensemble) -> Array:
    """States of runs that must all have reached their end."""
    for status in found.status:
        if status is not Status.FINISHED:
            raise AnalysisError(f"A run ended before its end: {status.value}")
    return found.states


def _moved(
    system: ContactSystem, parameter: Parameter, smooth: bool = True,
) -> tuple[ContactSystem, ContactSystem, float]:
    """The system with the parameter increased and decreased, and the difference of both."""
    if isinstance(parameter, str):
        name, value = parameter, system.parameter(parameter)
        value = 0.0 if value is None else value
        if not isinstance(value, Real) or isinstance(value, bool):
            raise InputError(f"parameter = {name!r} is {value!r}, not one number; give a function "
                             f"and a value.")
        value = float(value)

        def system_at(at: float) -> ContactSystem:
            return system.with_(**{name: at})
    else:
        if not (isinstance(parameter, tuple) and len(parameter) == 2 and callable(parameter[0])
                and isinstance(parameter[1], Real)):
            raise InputError(f"parameter = {parameter!r} must be the dotted name of a number, or a "
                             f"function of a system and a value, and the value: (function, 0.5).")
        function, value = parameter

        def system_at(at: float) -> ContactSystem:
            return function(system, at)

    move = MOVE * (abs(value) or 1.0)
    move *= _slip_limit(system, system_at, value, move) if smooth else 1.0
    try:
        return system_at(value + move), system_at(value - move), 2.0 * move
    except InputError:
        # At a limit of the range, or an unknown parameter.
        try:
            return system_at(value + move), system_at(value), move
        except InputError:
            return system_at(value), system_at(value - move), move


def _slip_limit(
    system: ContactSystem, system_at: Callable[[float], ContactSystem], value: float, move: float,
) -> float:
    """Factor that keeps the change of the parameter small relative to the friction smoothing.

    A relative change of 1e-5 of a belt speed of 0.2 m/s exceeds a velocity scale of 1 um/s, so that
    the difference would not approximate the derivative.
    """
    try:
        shift = np.abs(_passing(system_at(value + move)) - _passing(system_at(value))).max()
    except InputError:
        return 1.0
    scales = [law.velocity_scale for _, _, law in system.law_groups("friction")]
    return float(min(1.0, _SLIP * min(scales) / shift)) if shift > 0.0 and scales else 1.0


def _passing(system: ContactSystem) -> Array:
    """Speed (n,) with which the other side passes each node, as its parameter says."""
    motion = system.prescribed_motion
    return np.tensordot([one.speed for one in motion.motions], motion.factors, 1)
