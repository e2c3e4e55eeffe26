"""Derivatives of a motion to its initial state and to a parameter."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.rodas5p import step_loop
from fecontact.integrate.rodas5p.driver import ENDS, finish, start
from fecontact.integrate.rodas5p.variational import MOVE
from fecontact.integrate.simulate import output_times, require_max_step
from fecontact.system.contact_system import ContactSystem

Parameter = str | tuple[Callable[[ContactSystem, float], ContactSystem], float]

# Part of the slip velocity over which friction rises by which the ground may be moved.
_SLIP = 0.05


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """A motion at K times, and how it changes with its start and a parameter.

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
    """

    times: Array
    states: Array
    transitions: Array
    forced: Array | None

    @property
    def monodromy(self) -> Array:
        """dy(t_end) / dy(t_start) (size, size): the product of the transitions.

        Small multipliers are lost in a product over long times; the transitions keep them.
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
    rtol: float = 1e-8,
    derivative_rtol: float | None = None,
    max_step: float | None = None,
) -> Sensitivity:
    """Integrate, and carry the derivatives to the initial state and a parameter along.

    They are the derivatives of the computed steps themselves, to differences of the laws' own
    derivatives of relative accuracy 1e-8, not of a second approximation of the equations; only
    the choice of the steps' lengths is not differentiated. The integrator's laws are continuous,
    so that contact and stick need no jumps.

    Parameters
    ----------
    system, t_end, t_start, initial, outputs
        As for :func:`fecontact.simulate`.
    parameter : str, or (function, value), optional
        Dotted name of a number of the system, ``"ground.speed"``; or a function that makes the
        system for a value, and the value.
    rtol : float
        Relative tolerance of the run.
    derivative_rtol : float, optional
        Error of one step of the derivatives as those of the motion, relative to the largest they
        have been since the last output time; by default ten times ``rtol`` of their size at the
        time. Whatever it is, they are exact for the steps taken; 1e-2 saves most of the steps that
        fast modes cost which only disturbances, but not the motion have.
    max_step : float, optional
        Longest step [s]; see :func:`fecontact.simulate`.

    Raises
    ------
    InputError
        For values out of range, and parameters that do not exist or are no number.
    AnalysisError
        If the run could not reach its end.
    """
    require_kind("sensitivity", ContactSystem, system=system)
    times = output_times(t_start, t_end, outputs)
    if not (isinstance(rtol, Real) and 1e-13 <= rtol <= 1e-2):
        raise InputError(f"rtol = {rtol!r} must be a number from 1e-13 to 0.01.")
    if derivative_rtol is not None and not (isinstance(derivative_rtol, Real)
                                            and 1e-13 <= derivative_rtol <= 1.0):
        raise InputError(f"derivative_rtol = {derivative_rtol!r} must be a number from 1e-13 to 1.")
    require_max_step(max_step)
    state = initial_state(system, initial, t_start)
    vary = True if parameter is None else _moved(system, parameter)
    run = start(system, state, times, rtol=float(rtol), max_step=max_step, work=False,
                vary=vary, vary_rtol=derivative_rtol)
    result = finish(run)
    if result != step_loop.FINISHED:
        raise AnalysisError(f"The run ended at t = {run.time:.9g} s, before t_end = {t_end:.9g}: "
                            f"{ENDS[result].value}")
    columns = run.variation.transitions[1:].transpose(0, 2, 1)
    size = len(state)
    return Sensitivity(times, run.states, np.ascontiguousarray(columns[:, :, :size]),
                       None if parameter is None else columns[:, :, size].copy())


def _moved(
    system: ContactSystem, parameter: Parameter,
) -> tuple[ContactSystem, ContactSystem, float]:
    """The system with the parameter moved up and down, and how far these are apart."""
    if isinstance(parameter, str):
        name, value = parameter, system.parameters().get(parameter, 0.0)
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
    move *= _slip_limit(system, system_at, value, move)
    try:
        return system_at(value + move), system_at(value - move), 2.0 * move
    except InputError:
        # At the end of what is allowed, or no such parameter.
        try:
            return system_at(value + move), system_at(value), move
        except InputError:
            return system_at(value), system_at(value - move), move


def _slip_limit(
    system: ContactSystem, system_at: Callable[[float], ContactSystem], value: float, move: float,
) -> float:
    """Part of a move of the parameter that is small beside the smoothing of friction.

    A belt of 0.2 m/s that moves by a part of 1e-5 passes all of a friction that rises over
    1 um/s, and the difference is no derivative any more.
    """
    try:
        shift = abs(system_at(value + move).ground.speed - system_at(value).ground.speed)
    except InputError:
        return 1.0
    scales = [law.velocity_scale for _, _, law in system.law_groups("friction")]
    return float(min(1.0, _SLIP * min(scales) / shift)) if shift > 0.0 and scales else 1.0
