"""Derivatives of a motion with respect to its initial state and a parameter."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from numbers import Real
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind, require_rtol
from fecontact.core.errors import AnalysisError, InputError, ModelWarning
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.core.user_code import made_by
from fecontact.integrate import step_loop
from fecontact.integrate.derivative_check import doubts, perturbed_systems
from fecontact.integrate.ensembles import Ensemble, ensemble
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.jumping_nodes import jumping_nodes
from fecontact.integrate.rodas5p.driver import start
from fecontact.integrate.rodas5p.variational import MOVE
from fecontact.integrate.simulate import output_times, require_max_step
from fecontact.integrate.solvers import AUTO, CompiledSolver, Solver, require_solver
from fecontact.integrate.step_runs import ENDS, finish
from fecontact.integrate.trajectory import Status
from fecontact.system import columns
from fecontact.system.contact_system import PARTS, ContactSystem
from fecontact.system.elastic_sliders import slider_counts

EndsAt = Callable[[Array], Array]
Sides = tuple[bool, bool]
Parameter = str | tuple[Callable[[ContactSystem, float], ContactSystem], float]

# Largest change of ground velocity, relative to the velocity scale of friction, and at how many
# times it is looked for where it varies.
_SLIP, _OFTEN = 0.005, 101
# Largest change of penetrations, relative to their scale, and at how many times it is examined.
_DEPTH, _SOMETIMES = 1e-4, 9
# Change of the state for a difference of runs, in parts of its largest value.
_DIFFERENCE = 1e-5
# Derivatives by differences to both sides may be so far apart, in parts of the largest or of 1, and
# so many times the tolerance. Others are formed again with changes that are smaller by a factor;
# where the ends of runs are smooth, they come at least so much closer.
_APART, _COARSE, _FINER, _CLOSER = 1e-3, 1e3, 30.0, 0.5
# Part of the change of a parameter with elastic Coulomb elements, whose forces have kinks.
_SLIDERS = 1e-4
# Steps between two output times at which states are examined for their largest values.
_BETWEEN = 16


@read_only_arrays
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
    note : str
        Derivatives that disagree with differences of runs, or to both sides; else empty.
    """

    times: Array
    states: Array
    transitions: Array
    forced: Array | None
    sided: Array | None = None
    note: str = ""

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
    solver: Solver = AUTO,
    rtol: float = 1e-8,
    derivative_rtol: float | None = None,
    max_step: float | None = None,
    check: bool = True,
) -> Sensitivity:
    """Integrate a motion and its derivatives with respect to initial state and a parameter.

    Runs by collocation (see Radau) solve its derivative at the stages of each step. Else the
    computed steps are differentiated, at fixed step sizes, with second derivatives of laws by
    differences; with more than four modes or two nodes, and no memory, the linear equation of the
    derivatives is solved along the motion. Where a node touches down with a force that jumps, as
    that of :class:`fecontact.laws.LinearContact` with damping, derivatives contain the saltation.
    A ModelWarning and ``note`` name spans where they are 2 % apart from differences of runs.

    With SetValued, forces and velocities jump. Its runs locate the jumps, so that the end of a run
    is a function of its start that is smooth except where a jump appears or vanishes; derivatives
    are central differences of this function, which contain the saltation at the jumps, of relative
    accuracy 1e-6. Each costs two runs. At a start that touches a rigid stop they are differences
    into the open. A ModelWarning names starts where the derivatives to both sides differ.

    Parameters
    ----------
    system, t_end, t_start, initial, outputs
        As for :func:`fecontact.simulate`.
    parameter : str, or (function, value), optional
        Dotted name of a number of the system, ``"ground.speed"``; or a function that returns the
        system for a value, and the value.
    solver : Auto, Rodas5P, Radau or SetValued
        Whose steps, or runs, are differentiated.
    rtol : float
        Relative tolerance of the run.
    derivative_rtol : float, optional
        Tolerance of the derivatives per step, relative to their largest values since the last
        output time; by default ten times ``rtol``, 200 times along the motion, relative to their
        current values or a tenth of the largest. 1e-2 saves work for fast disturbances. But along
        the motion, derivatives of small motions take steps that the run does not need.
    max_step : float, optional
        Longest step [s]; see :func:`fecontact.simulate`.
    check : bool
        Compare one direction with differences of runs, for half of the time or more.

    Raises
    ------
    InputError
        For values out of range, and parameters that do not exist or are not numbers.
    AnalysisError
        If the run does not reach its end.
    """
    require_kind("sensitivity", ContactSystem, system=system)
    times = output_times(t_start, t_end, outputs)
    require_rtol(rtol)
    if derivative_rtol is not None:
        require_rtol(derivative_rtol, "derivative_rtol", 1.0)
    require_max_step(max_step)
    require_solver(solver, "derivatives")
    state = initial_state(system, initial, t_start)
    found = differentiated(system, times, state, parameter, solver, float(rtol), derivative_rtol,
                           max_step)
    if check and isinstance(solver, CompiledSolver):
        at = None if parameter is None else _function_of(system, parameter)
        found = replace(found, note=doubts(system, times, found.states, found.transitions,
                                           found.forced, at, solver=solver, rtol=float(rtol),
                                           max_step=max_step))
    if found.note:
        warnings.warn(found.note, ModelWarning, stacklevel=2)
    return found


@one_blas_thread
def differentiated(
    system: ContactSystem, times: Array, state: Array, parameter: Parameter | None, solver: Solver,
    rtol: float, derivative_rtol: float | None = None, max_step: float | None = None,
) -> Sensitivity:
    """Sensitivity as in :func:`sensitivity`, from a given state and without its warning."""
    if not isinstance(solver, CompiledSolver):
        return _differences(system, times, state, parameter, solver, rtol, max_step)
    vary = True if parameter is None else _moved(system, parameter, times, state)
    run = start(system, state, times, rtol=rtol, max_step=max_step, work=False, vary=vary,
                vary_rtol=derivative_rtol, method=solver.method)
    result = finish(run)
    if result != step_loop.FINISHED:
        raise AnalysisError(f"The run ended at t = {run.time:.9g} s, before t_end = "
                            f"{times[-1]:.9g}: {ENDS[result].value}")
    columns, states, size = run.transitions[1:], run.states, len(state)
    forced = None if parameter is None else columns[:, :, size].copy()
    if (not isinstance(vary, bool) and run.collocation is None and jumping_nodes(system).any()
            and _deeper(vary[0], vary[1], times, state) > 0.0):
        # Differences at a state would mix forces from both sides of a jump.
        above, below, width = vary
        pieces, spans = len(times) - 1, np.stack([times[:-1], times[1:]], axis=1)
        ends = _states(ensemble([above] * pieces + [below] * pieces, np.tile(spans, (2, 1)),
                                initial=np.tile(states[:-1], (2, 1)), solver=solver,
                                rtol=max(1e-3 * rtol, 1e-12), max_step=max_step))[:, -1]
        forced = (ends[:pieces] - ends[pieces:]) / width
    return Sensitivity(times, states, np.ascontiguousarray(columns[:, :, :size]), forced)


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
    # An impact at the start belongs to the first piece.
    states = np.vstack([state, found[_BETWEEN::_BETWEEN]])
    largest = np.abs(found).reshape(len(close), 2, -1).max(axis=(0, 2))
    moves = np.repeat(_DIFFERENCE * np.where(largest > 0.0, largest, 1.0), size // 2)
    spans = np.stack([times[:-1], times[1:]], axis=1)
    # Changes of the state, and last that of the parameter, in these units.
    changes, units = np.diag(moves), moves
    both_ways = [True] * size
    if parameter is not None:
        system_at, value = _function_of(system, parameter)
        move = MOVE * (abs(value) or 1.0)
        *_, low, high = perturbed_systems(system_at, value, move)
        changes, units = np.vstack([changes, np.zeros(size)]), np.append(moves, 0.5 * (high - low))
        # At a limit of its range the parameter moves to one side alone.
        both_ways.append(value not in (low, high))

    def ends_at(piece: Any, change: Any, offset: Any) -> Array:
        """Ends (N, size) of runs over pieces with changes by so many units."""
        piece, change, offset = np.broadcast_arrays(piece, change, offset)
        systems = [system if k < size else system_at(min(max(
            0.5 * (low + high) + units[-1] * by, low), high))
                   for k, by in zip(change, offset, strict=True)]
        return _states(ensemble(systems, spans[piece], **settings, initial=(
            states[piece] + offset[:, None] * changes[change])))[:, -1]

    every = np.meshgrid(range(pieces), range(len(units)), [1.0, -1.0], indexing="ij")
    ends = ends_at(*map(np.ravel, every)).reshape(pieces, len(units), 2, size)
    sided = np.stack([ends[:, :, 0] - states[1:, None], states[1:, None] - ends[:, :, 1]])
    columns = 0.5 * (ends[:, :, 0] - ends[:, :, 1])
    settings["rtol"] = max(settings["rtol"] / _FINER, 1e-12)
    allowed, uncertain = max(_APART, _COARSE * rtol), []
    for piece in range(pieces):
        for k in range(len(units)):
            apart = _apart(ends[piece, k, 0], states[piece + 1], ends[piece, k, 1], moves)
            if apart <= allowed or not both_ways[k]:
                continue
            open_ = (True, True) if k == size else _open_sides(
                system, solver, float(times[piece]), states[piece], changes[k])
            columns[piece, k], sided[:, piece, k], certain = _closer(
                partial(ends_at, piece, k), moves, apart, allowed, open_)
            if not certain:
                what = "the parameter" if k == size else f"y[{k}]"
                uncertain.append(f"to {what} from t = {times[piece]:.6g} to "
                                 f"{times[piece + 1]:.6g} s")
    columns, sided = (np.swapaxes(each / units[:, None], -1, -2) for each in (columns, sided))
    forced = None if parameter is None else columns[:, :, size].copy()
    return Sensitivity(times, states, np.ascontiguousarray(columns[:, :, :size]), forced,
                       np.ascontiguousarray(sided[..., :size]), _note(uncertain))


def _apart(above: Array, middle: Array, below: Array, moves: Array) -> float:
    """Difference of derivatives to both sides, relative to the largest or to 1.

    By the ends of runs from both sides and between, and the changes of the states.
    """
    size = max(1.0, float((np.abs(above - below) / moves).max()) / 2.0)
    return float((np.abs(above - 2.0 * middle + below) / moves).max()) / size


def _closer(
    ends_at: EndsAt, moves: Array, apart: float, allowed: float, open_: Sides,
) -> tuple[Array, Array, bool]:
    """Derivative (d,) of the ends of runs at offset 0, those to both sides (2, d); if there is one.

    By smaller offsets than one, of which the sides were apart. Where one side alone is open, the
    derivative is that to this side.
    """
    h = 1.0 / _FINER
    middle, above, below, far_above, far_below = ends_at(h * np.array([0.0, 1.0, -1.0, 2.0, -2.0]))
    sided = np.stack([above - middle, middle - below]) / h
    if _apart(above, middle, below, h * moves) <= max(allowed, _CLOSER * apart):
        return sided.mean(axis=0), sided, True
    if open_[0] != open_[1]:
        side = 0 if open_[0] else 1
        near, far = sided[side], np.stack([far_above - middle, middle - far_below])[side] / (2 * h)
        size = max(1.0, float(np.abs(near / moves).max()))
        if float(np.abs((near - far) / moves).max()) <= allowed * size:
            derivative = 2.0 * near - far
            return derivative, np.stack([derivative, derivative]), True
    return sided.mean(axis=0), sided, False


def _open_sides(
    system: ContactSystem, solver: Solver, time: float, state: Array, change: Array,
) -> Sides:
    """Whether a state that is changed one way and the other reaches no deeper into rigid stops."""
    if getattr(solver, "restitution", None) is None:
        return True, True
    deep = system.contact_history(np.full(3, time), state + np.array([[0.0], [1.0], [-1.0]]) * (
        change))[:, :, columns.PENETRATION]
    margin = 1e-3 * np.abs(deep[1:] - deep[0]).max(initial=0.0)
    deeper = (np.maximum(deep[1:], 0.0) > np.maximum(deep[0], 0.0) + margin).any(axis=1)
    return not deeper[0], not deeper[1]


def _note(uncertain: list[str]) -> str:
    if not uncertain:
        return ""
    return (f"Differences of set-valued runs to one side are apart from those to the other, "
            f"{'; '.join(uncertain)}: there is no derivative, for a body breaks away, strikes or "
            f"comes to rest at the start or the end, or an event appears or vanishes nearby; begin "
            f"or end elsewhere.")


def _states(found: Ensemble) -> Array:
    """States of runs that must all have reached their end."""
    for status in found.status:
        if status is not Status.FINISHED:
            raise AnalysisError(f"A run ended before its end: {status.value}")
    return found.states


def _moved(
    system: ContactSystem, parameter: Parameter, times: Array, state: Array,
) -> tuple[ContactSystem, ContactSystem, float]:
    """The system with the parameter increased and decreased, and the difference of both."""
    system_at, value = _function_of(system, parameter)
    move = MOVE * (abs(value) or 1.0)
    if slider_counts(system).any():
        # Elements that have just begun or ceased to slide must not switch with the parameter.
        move *= _SLIDERS
    above, below, low, high = perturbed_systems(system_at, value, move)
    # A relative change of 1e-5 of a belt speed of 0.2 m/s exceeds a velocity scale of 1 um/s, and a
    # gap of zero has no size of its own of which a part could be taken.
    scale = min((law.velocity_scale for _, _, law in system.law_groups("friction")), default=np.inf)
    faster = _faster(above, below, times) * move / (high - low)
    deeper = _deeper(above, below, times, state)
    above, below, low, high = perturbed_systems(system_at, value, move / max(
        1.0, faster / (_SLIP * scale), deeper / (_DEPTH * system.penetration_scale)))
    return above, below, high - low


def _function_of(
    system: ContactSystem, parameter: Parameter,
) -> tuple[Callable[[float], ContactSystem], float]:
    """The system as a function of the parameter, and its value."""
    if isinstance(parameter, str):
        name = parameter
        value = getattr(system, name) if name in PARTS else system.parameter(name)
        # A name that does not exist is an error of the system with another value.
        value = 0.0 if value is None else value
        if not isinstance(value, Real) or isinstance(value, bool):
            raise InputError(f"parameter = {name!r} is {value!r}, not one number; give the dotted "
                             f"name of a number, or a function and a value.")
        value = float(value)

        return (lambda at: system.with_(**{name: at})), value
    if not (isinstance(parameter, tuple) and len(parameter) == 2 and callable(parameter[0])
            and isinstance(parameter[1], Real)):
        raise InputError(f"parameter = {parameter!r} must be the dotted name of a number, or a "
                         f"function of a system and a value, and the value: (function, 0.5).")
    function, number = parameter
    return (lambda at: made_by(function, system, at)), number


def _deeper(above: ContactSystem, below: ContactSystem, times: Array, state: Array) -> float:
    """Largest difference of penetrations at a state [m], at times from the first to the last."""
    sometimes = np.linspace(times[0], times[-1], _SOMETIMES)
    states = np.tile(state, (_SOMETIMES, 1))
    one, other = (of.contact_history(sometimes, states)[:, :, columns.PENETRATION]
                  for of in (above, below))
    return float(np.abs(one - other).max(initial=0.0))


def _faster(above: ContactSystem, below: ContactSystem, times: Array) -> float:
    """Largest difference of the speeds with which the other side passes a node in two systems."""
    one, other = above.prescribed_motion, below.prescribed_motion
    looks = 1 if one.constant and other.constant else _OFTEN
    return max(float(np.abs(one.velocity(t) - other.velocity(t)).max(initial=0.0))
               for t in np.linspace(times[0], times[-1], looks))
