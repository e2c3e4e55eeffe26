"""Time integration of a contact system."""

import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any, overload

import numpy as np

from fecontact.core.checks import require_kind, require_rtol
from fecontact.core.errors import AnalysisError, InputError, ModelWarning
from fecontact.core.errors import shown as text_of
from fecontact.core.progress import progress_bar, shown
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.resources.memory import require_memory
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.events import AnyEvent, ContactEvents, Event, as_events
from fecontact.integrate.field_runs.field_run import FieldRun, field_state, run_field
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.integrate.solvers import AUTO, CompiledSolver, Solver, require_solver
from fecontact.integrate.task import Task
from fecontact.integrate.trajectory import Solution, Status, Trajectory
from fecontact.laws.normal.linear import PrescribedForce
from fecontact.system.columns import POWERS
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import in_time
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.model_limits import Planned, implausible_values, warn_of_limits
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState

# Initial penetration, in penetration scales, beyond which to warn.
_DEEP = 100.0
# Spurious energy growth, relative to the largest energy, that is an error, and the number of output
# times that are checked.
_GROWTH, _LOOKS = 1e-2, 200
# Shortest run [s], and in spacings of floating-point numbers at its times.
_SHORTEST, _SPACINGS = 1e-100, 1e5
# Rounding of the time of an event, relative to the times of the run.
_EVENT_ROUNDING = 1e-13
# Energy that friction may give within the error of a run, relative to what it exchanges.
_GIVEN = 1e-3


@overload
def simulate(
    system: ContactSystem, t_end: float, *, t_start: float | None = None,
    initial: Initial = "rest", outputs: int | ArrayLike = 1001, solver: Solver = AUTO,
    rtol: float = 1e-6, max_step: float | None = None,
    events: AnyEvent | Sequence[AnyEvent] | None = None,
    keep_steps: bool = True,
    progress: bool | Callable[[float], None] | None = None,
) -> Trajectory: ...
@overload
def simulate(
    system: VectorField, t_end: float, *, t_start: float | None = None,
    initial: Initial | FieldRun | ArrayLike, outputs: int | ArrayLike = 1001,
    solver: Solver = AUTO, rtol: float = 1e-6, max_step: float | None = None,
    events: AnyEvent | Sequence[AnyEvent] | None = None,
    keep_steps: bool = True,
    progress: bool | Callable[[float], None] | None = None,
) -> FieldRun: ...
def simulate(
    system: ContactSystem | VectorField,
    t_end: float,
    *,
    t_start: float | None = None,
    initial: Any = "rest",
    outputs: int | ArrayLike = 1001,
    solver: Solver = AUTO,
    rtol: float = 1e-6,
    max_step: float | None = None,
    events: AnyEvent | Sequence[AnyEvent] | None = None,
    keep_steps: bool = True,
    progress: bool | Callable[[float], None] | None = None,
) -> Trajectory | FieldRun:
    """Integrate a contact system or a vector field in time.

    Parameters
    ----------
    system : ContactSystem or VectorField
        The system; a field at its base values, see :meth:`fecontact.bifurcation.VectorField.with_`.
    t_end, t_start : float
        End and start of the run [s]; by default it starts where a run ``initial`` ends, or at zero.
    initial : 'rest', 'sliding', RigidStart, Trajectory, LoadHistory, RestState or array
        Initial state; see :func:`fecontact.integrate.initial_state`. Of a field a state, or a run.
    outputs : int or (N,) array
        Number of equally spaced output times, both ends included, or ascending times [s].
    solver : Auto, Rodas5P, Radau, PowerSeries, SetValued, EventDriven, TimeStepping, Scipy or CVODE
        Auto, the default, chooses one of the next three (docs/integrator.md). The next three are
        for set-valued friction and rigid stops; Scipy and CVODE are references.
    rtol : float
        Tolerance of the local error of each state, relative to its largest value so far.
    max_step : float, optional
        Longest step [s]; by default a fraction of the shortest period of drive, loads and waves.
        Give it for a vector field with a brief excitation.
    events : ContactEvents, Crossing, Event or sequence of them, optional
        Events to locate within the steps; stored in :attr:`Trajectory.events`.
    keep_steps : bool
        Whether a run keeps motion between the outputs for plots; see :attr:`Trajectory.kept`.
    progress : bool or callable, optional
        True for a progress bar; a function is called with the time reached [s].

    Returns
    -------
    Trajectory or FieldRun
        Its ``status`` says why it ended, also after Ctrl-C or a failure of the solver. A
        ModelWarning names values that are likely an error, ``limits_exceeded``, and friction that
        gave energy to the motion, as LuGre friction with large bristle damping can.

    Raises
    ------
    InputError
        For values out of range, or a checkpoint of another run.
    AnalysisError
        If there is no equilibrium to start from.
    """
    moving = in_time("simulate", system)
    if t_start is None:
        t_start = float(initial.time[-1]) if isinstance(initial, Trajectory | FieldRun) else 0.0
    if isinstance(outputs, int | np.integer) and not isinstance(outputs, bool):
        require_memory("outputs", int(outputs), _row_size(moving))
    times = output_times(t_start, t_end, outputs)
    require_rtol(rtol)
    require_max_step(max_step)
    require_kind("simulate", bool, keep_steps=keep_steps)
    require_solver(solver, *(["events"] if events is not None else []))
    watched = as_events(events)
    if (isinstance(initial, Trajectory | FieldRun) and initial.status is Status.EVENT
            and t_start == initial.time[-1]):
        # The event that ended the run before lies at its last time, up to rounding.
        watched.after = t_start + _EVENT_ROUNDING * max(abs(t_start), abs(t_end))
    if isinstance(moving, ContactSystem) and isinstance(initial, FieldRun):
        initial = initial.states[-1]
    if isinstance(system, VectorField):
        if isinstance(moving, ContactSystem):
            run = simulate(moving, t_end, t_start=t_start, initial=initial, outputs=times,
                           solver=solver, rtol=rtol, max_step=max_step, events=watched,
                           keep_steps=False, progress=progress)
            return FieldRun(system.parameters, system.state_names, run.time, run.states, run.status,
                            run.statistics, run.events)
        require_fields(solver)
        state = field_state(system, initial)
        with shown(progress, lambda: progress_bar("Running", times[-1], times[0])) as tell:
            return run_field(system, state, times, rtol=float(rtol), max_step=max_step,
                             events=watched, progress=tell)
    require_runs(solver, system, f"simulate by {solver.name}")
    state = initial_state(system, initial, t_start)
    if not isinstance(initial, str | Trajectory | LoadHistory | RestState):
        _warn_of_depth(system, state, t_start)
    warn_of_limits(implausible_values(Planned(system, float(times[-1] - times[0]), state)),
                   "In this run")
    m = system.basis.modes
    with (shown(progress, lambda: progress_bar("Running", times[-1], times[0])) as tell,
          one_blas_thread):
        found = solver.run(Task(system, state, times, float(rtol), max_step, watched,
                                keep_steps, tell))
    _require_finite_events(watched, system, found)
    states = found.states
    trajectory = Trajectory(
        system, found.time, states[:, :m], states[:, m : 2 * m], found.work, found.status,
        {"solver": solver.name, "rtol": float(rtol), "method": solver.name, **found.statistics},
        memory=states[:, 2 * m :] if system.memory else None,
        node_friction_work=found.node_friction_work, node_creep_work=found.node_creep_work,
        held_normal_force=found.normal_force,
        held_friction_force=found.friction_force, events=found.events if watched else None,
        kept=found.kept)
    if found.status in (Status.FINISHED, Status.EVENT):
        trajectory = replace(trajectory, status=_checked(trajectory, solver, rtol))
    _warn_of_active_friction(trajectory, rtol)
    warn_of_limits(trajectory.limits_exceeded, "In this run")
    return trajectory


def _require_finite_events(
    events: Sequence[AnyEvent], system: ContactSystem, found: Solution
) -> None:
    """Raise InputError where a user's function is not a number at some of the output times."""
    own = [one for one in events if not isinstance(one, ContactEvents)]
    some = np.unique(np.linspace(0, len(found.time) - 1, _LOOKS).astype(int))
    for number, one in enumerate(own):
        if not isinstance(one, Event):
            continue
        row = one.row(system)
        for k in some.tolist():
            try:
                with np.errstate(all="ignore"):
                    value = one.kernel.python(float(found.time[k]), found.states[k], row)
            except (ArithmeticError, ValueError):
                value = np.nan
            if not np.isfinite(value) and np.isfinite(found.states[k]).all():
                raise InputError(f"'event {number}' is not a finite number at t = "
                                 f"{found.time[k]:.6g} s; its function g(t, y, p) must be finite "
                                 f"for every state.")


@one_blas_thread
def _checked(run: Trajectory, solver: Solver, rtol: float) -> Status:
    """Status of a completed run after a check of its energies at some output times."""
    some = np.unique(np.linspace(0, len(run.time) - 1, min(len(run.time), _LOOKS)).astype(int))
    histories = ("time", "modal_coordinates", "modal_velocities", "work", "memory",
                 "held_normal_force", "held_friction_force")
    part = replace(run, kept=None, **{name: value[some] for name in histories
                           if (value := getattr(run, name)) is not None})
    with np.errstate(over="ignore", invalid="ignore"):
        energies = part.energies
        amounts = np.array(list(energies.terms.values()))
        if not (np.isfinite(amounts).all() and np.isfinite(part.normal_force).all()
                and np.isfinite(part.friction_forces).all()
                and np.isfinite(run.states).all() and np.isfinite(run.work).all()):
            return Status.ENERGY_NOT_FINITE
        grown = solver.smooth and energies.growth > max(_GROWTH, 1e3 * rtol)
    return Status.ENERGY_GREW if grown and run.status is Status.FINISHED else run.status


def _warn_of_active_friction(run: Trajectory, rtol: float) -> None:
    """Warn where the energy lost by friction fell: friction gave energy."""
    lost = run.friction_work
    # Impacts by Newton's law may give energy at one node and take it at others; if they gain some
    # in all, the status says so.
    if not np.isfinite(lost).all() or run.statistics.get("impacts"):
        return
    given = (np.maximum.accumulate(lost, axis=0) - lost).max(axis=0)
    if not given.any():
        return
    j = int(given.argmax())
    exchanged = np.trapezoid(np.abs(run.slip_power), run.time, axis=0)
    if (given[j] > max(_GIVEN, 1e3 * rtol) * exchanged.max()
            and given[j] > max(rtol * run.energies.stored.max(), run.energies.rounding)):
        law = next(law for nodes, _, law in run.system.law_groups("friction")
                   if nodes.start <= j < nodes.stop)
        warnings.warn(f"{type(law).__name__} gave {given[j]:.3g} J to the motion at contact node "
                      f"{j}, {given[j] / exchanged.max():.1e} of all that it exchanged: its "
                      f"parameters do not describe dissipative friction at these slip velocities; "
                      f"fecontact.laws.check_law tells more.", ModelWarning, stacklevel=3)


def _row_size(system: ContactSystem | VectorField) -> float:
    """Memory per output time [bytes]: two copies of states and work, and contact quantities."""
    if isinstance(system, VectorField):
        return 16.0 * system.dimension
    n = system.basis.contact_nodes
    states = 2 * system.basis.modes + n * system.memory
    return 8.0 * (2 * (states + len(POWERS) + n) + 10 * n)


def _warn_of_depth(system: ContactSystem, state: Array, time: float) -> None:
    """Warn of an initial penetration so deep that a wrong unit is likely.

    Faces that loads and bolts press together may be far beyond the scale of its law.
    """
    depth = _depths(system, state, time)
    for nodes, _, law in system.law_groups("normal"):
        deepest, scale = depth[nodes].max(initial=-np.inf), law.penetration_scale
        if law.bilateral or isinstance(law, PrescribedForce) or not deepest > _DEEP * scale:
            continue
        if deepest > 10.0 * _depths_at_rest(system, time)[nodes].max():
            where = "the ground" if system.basis.ground_nodes.all() else "the other side"
            warnings.warn(f"The initial state is {deepest:.3g} m deep in {where}, "
                          f"{deepest / scale:.2g} times the {scale:.3g} m over which the normal "
                          f"law rises: the body will be thrown off.", stacklevel=3)
            return


def _depths(system: ContactSystem, state: Array, time: float) -> Array:
    return system.at(state, time=time).penetration


def _depths_at_rest(system: ContactSystem, time: float) -> Array:
    try:
        return _depths(system, initial_state(system, "rest", time), time)
    except AnalysisError:
        return np.zeros(system.basis.contact_nodes)


def require_runs(solver: Solver, system: ContactSystem | VectorField, what: str) -> None:
    """Raise InputError unless a solver runs a system: a field, or one with rigid stops."""
    if isinstance(system, VectorField):
        require_fields(solver)
    elif getattr(solver, "restitution", None) is None:
        system.require_compliance(what)


def require_fields(solver: Solver) -> None:
    """Raise InputError unless a solver runs vector fields, which keep no checkpoint."""
    require_solver(solver, "fields")
    if isinstance(solver, CompiledSolver) and solver.checkpoint is not None:
        raise InputError(f"solver = {solver!r}: runs of vector fields keep no checkpoint; leave it "
                         f"out.")


def require_max_step(max_step: Any) -> None:
    """Raise InputError unless ``max_step`` is None or a finite time above zero."""
    if max_step is not None and not (isinstance(max_step, Real) and not isinstance(max_step, bool)
                                     and max_step <= sys.float_info.max and not max_step <= 0.0):
        raise InputError(f"max_step = {text_of(max_step)} must be a finite time above zero [s]; "
                         f"leave it out for steps as long as the tolerance allows.")


def require_resolved_span(last: str, t_end: float, first: str, t_start: float) -> None:
    """Raise :class:`InputError` if no steps fit between two times; their names come before them."""
    latest = max(abs(t_start), abs(t_end))
    if t_end - t_start < max(_SHORTEST, _SPACINGS * float(np.spacing(latest))):
        raise InputError(f"{last} = {text_of(t_end)} is too close to {first} = {text_of(t_start)}: "
                         f"floating-point numbers cannot resolve steps between them; choose a "
                         f"later end.")


def output_times(t_start: float, t_end: float, outputs: Any) -> Array:
    """Output times (N,) of a run; see :func:`simulate`.

    Raises
    ------
    InputError
        If they are not ascending from ``t_start`` to ``t_end``.
    """
    if not (all(isinstance(time, Real) and not isinstance(time, bool) for time in (t_start, t_end))
            and -sys.float_info.max <= t_start < t_end <= sys.float_info.max):
        raise InputError(f"t_end = {text_of(t_end)} must be a finite time after t_start = "
                         f"{text_of(t_start)}.")
    require_resolved_span("t_end", t_end, "t_start", t_start)
    if isinstance(outputs, int | np.integer) and not isinstance(outputs, bool):
        if outputs < 2:
            raise InputError(f"outputs = {outputs} must be at least 2.")
        times = np.linspace(t_start, t_end, int(outputs))
        if not (np.diff(times) > 0.0).all():
            raise InputError(f"outputs = {outputs} are too many from t_start = {t_start!r} to "
                             f"t_end = {t_end!r}: floating-point numbers cannot resolve so "
                             f"many times; end later or take fewer outputs.")
        return times
    try:
        times = np.array(outputs, dtype=float)
    except (TypeError, ValueError, OverflowError):
        times = np.zeros(0)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0.0).all() or (
            times[0] != t_start or times[-1] != t_end):
        raise InputError("outputs must be a number of times, or ascending times from t_start to "
                         "t_end.")
    return times
