"""Runs with set-valued friction and rigid stops: the limit of infinite smoothing slope."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError, choices
from fecontact.core.records import allocate
from fecontact.core.types import Array, Integers
from fecontact.integrate.coefficients import Coefficient, node_values
from fecontact.integrate.event_arrays import watch_for
from fecontact.integrate.kept_rows import workspace_for_rows
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.integrate.nonsmooth import problem as kinds
from fecontact.integrate.nonsmooth.equations import compiled_derivative
from fecontact.integrate.nonsmooth.event_log import note_events
from fecontact.integrate.nonsmooth.rigid_stops import compiled_change
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.integrate.run_limits import largest_motions, longest_step
from fecontact.integrate.step_loop import REJECTIONS, STEPS
from fecontact.integrate.step_runs import StepRun, complete, until_end
from fecontact.integrate.task import SetValuedOptions, Task
from fecontact.integrate.trajectory import Solution, Status
from fecontact.laws.base import FrictionLaw
from fecontact.laws.friction.stribeck import Frictionless
from fecontact.laws.friction_curve import CREEP, STEEP
from fecontact.laws.friction_curve import static_coefficient as coefficient_at_rest
from fecontact.system.contact_system import ContactSystem
from fecontact.system.loads import work_of_loads
from fecontact.system.powers import POWER_COUNT

# Largest number of independent slip velocities that run from event to event unless asked to.
_FEW = 8
# Longest step in periods of the excitation, where it is the only thing given in time.
_PERIOD_PART = 0.125
# Change of a signal within rounding of a time, in parts of its largest value, that is a jump.
_JUMP = 1e-9
# Errors of velocities count relative to this part of what drive and loads bring about.
_DRIVEN = 1e-3


def integrate_set_valued(task: Task, options: SetValuedOptions) -> Solution:
    """Integrate by :class:`fecontact.integrate.SetValued`; also a run that ends early.

    Raises
    ------
    InputError
        For friction that cannot be unsmoothed, or a method that cannot run the system.

    References
    ----------
    R. I. Leine, N. van de Wouw, Stability and Convergence of Mechanical Systems with Unilateral
    Constraints, Springer 2008. V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical
    Systems, Springer 2008.
    """
    begin, basis = clock.perf_counter(), task.system.basis
    run = start(task, options)
    output, counts = run.output, run.progress.counts
    n, m, solid = basis.contact_nodes, basis.modes, basis.dimension == 3
    ended = complete(run, task.progress)
    statistics: dict[str, Any] = {
        "method": run.method, "steps": int(counts[STEPS]),
        "rejected": int(counts[REJECTIONS]), "events": int(counts[kinds.EVENTS]),
        "impacts": int(counts[kinds.IMPACTS]),
        "seconds": clock.perf_counter() - begin}
    if ended is Status.FINISHED and counts[kinds.GAINED]:
        ended = Status.IMPACT_GAINED
    last = run.outputs - 1
    time, *found = until_end(run, (output.states, run.progress.state), *(
        (rows, rows[last]) for rows in (output.friction, output.normal)))
    end = 2 * m + POWER_COUNT

    def columns(states: Array, friction: Array, normal: Array) -> dict[str, Array]:
        if solid:
            friction = np.stack([friction[:, :n], friction[:, n:]], axis=-1)
        return {"states": states[:, : 2 * m].copy(), "work": states[:, 2 * m : end].copy(),
                "normal_force": normal, "friction_force": friction}

    between = [values[: run.kept_rows] for values in run.kept]
    kept = KeptSteps(between[0], **cast("dict[str, Any]", columns(*between[1:]))).before(time[-1])
    return Solution(time, status=ended, statistics=statistics,
                    node_friction_work=found[0][:, end:].copy(), events=run.events,
                    kept=kept if task.keep_steps else None,
                    **columns(*found))


@dataclass(frozen=True, eq=False)
class Run(StepRun):
    """A run with set-valued friction; ``loop`` is that of its method, with its data."""

    loop: Callable[[int], int]
    progress: kinds.Progress
    output: kinds.Output
    kept: kinds.Output
    watch: Watch
    method: str
    found: list[tuple[Array, Array]] = field(default_factory=list)

    def step(self, most: int) -> int:
        """Try so many steps by the loop; how it ended."""
        return self.loop(most)


def start(task: Task, options: SetValuedOptions) -> Run:
    """A run before its first step; see :func:`integrate_set_valued`."""
    system, state, events, restitution = task.system, task.state, task.events, options.restitution
    times = np.ascontiguousarray(task.times, dtype=float)
    default, longest = longest_step(system, times), longest_step(system, times, task.max_step)
    problem, rubbing = nonsmooth_problem(system, restitution, options.static_coefficient, longest,
                                         tangential=options.tangential_restitution)
    problem = problem._replace(poisson=int(options.impact_law == "poisson"))
    method = _chosen(problem, options.method)
    progress = kinds.progress_for(problem, rubbing, state, float(times[0]), 0.01 * longest)
    limits = kinds.Limits(
        _stops_of(system, float(times[0]), float(times[-1])),
        _floor_of(system, state, times, longest), task.rtol, longest)
    if longest == default and method == "event-driven" and restitution is None:
        most = np.inf if task.max_step is None else float(task.max_step)
        limits = limits._replace(longest=min(_longest_between_events(system, times), most))
    columns = len(progress.state), len(progress.carried), system.basis.contact_nodes
    workspace = workspace_for_rows(task.keep_steps, sum(columns))
    output, kept = (kinds.Output(rows, *(np.empty((len(rows), size)) for size in columns))
                    for rows in (times, np.zeros(workspace)))
    sizes = kinds.sizes_of(problem)
    data = problem, limits, progress, output, kept
    watch = watch_for(system, events, False)
    watch = watch._replace(note=note_events.address if events else 0)
    loop: Callable[..., int]
    if method == "event-driven":
        from fecontact.integrate.nonsmooth.event_driven import run_for
        from fecontact.integrate.nonsmooth.event_search import Data, Workspace
        loop = partial(run_for(problem), Data(*data, allocate(kinds.Evaluation, sizes),
                                              allocate(Workspace, sizes), watch))
    elif events:
        raise InputError("TimeStepping(), which this system needs, locates no events; leave them "
                         "out, or take fewer contact nodes.")
    elif restitution is not None:
        from fecontact.integrate.nonsmooth import impact_steps
        loop = partial(impact_steps.run_impact_steps, impact_steps.Data(
            *data, allocate(impact_steps.ImpactWorkspace, sizes)))
    else:
        from fecontact.integrate.nonsmooth import time_stepping
        loop = partial(time_stepping.run_steps, time_stepping.Data(
            *data, allocate(kinds.Evaluation, sizes), allocate(time_stepping.Workspace, sizes)))
    return Run(loop, progress, output, kept, watch, method)


def nonsmooth_problem(
    system: ContactSystem,
    restitution: Coefficient | None,
    static_coefficient: Coefficient | None,
    longest: float,
    *,
    tangential: Coefficient = 0.0,
) -> tuple[kinds.NonsmoothProblem, NDArray[np.bool_]]:
    """The problem, and which of its clusters (k,) friction may stop."""
    n = system.basis.contact_nodes
    groups = [(_unsmoothed(law), share) for _, share, law in system.law_groups("friction")]
    tables = [law.table(share) for law, share in groups]
    width = max(table.shape[1] for table in tables)
    arrays = system.arrays._replace(friction_parameters=np.vstack(
        [np.pad(table, ((0, 0), (0, width - table.shape[1]))) for table in tables]))
    if system.basis.dimension == 3:
        cluster, rows = np.arange(n), np.ascontiguousarray(arrays.rows[:, 0])
    else:
        cluster, rows = _clusters(arrays.rows[:, 0], arrays.sliding[:, 0, 0])
        # Nodes slip exactly as their cluster does.
        whole = arrays.rows.copy()
        whole[:, 0] = rows[cluster]
        arrays = arrays._replace(rows=whole)
    sliding = np.zeros(len(rows))
    sliding[cluster] = arrays.sliding[:, 0, 0]
    ground = system.ground
    wave = ground.shortest_wavelength if ground.wavy else None
    plane = system.basis.dimension == 2
    static = node_values("static_coefficient", static_coefficient, system.basis, -1.0)
    _require_static(system, static)
    problem = kinds.NonsmoothProblem(
        arrays, static, cluster, rows, sliding, 1e-4 * longest, int(restitution is not None),
        node_values("restitution", restitution, system.basis, 0.0),
        _of_clusters(node_values("tangential_restitution", tangential, system.basis, 0.0), cluster),
        0,
        np.array([*ground.height_range, np.inf if wave is None else wave]),
        int(system.prescribed_motion.constant), compiled_derivative.address if plane else 0,
        compiled_change.address if plane and restitution is not None else 0)
    rubbing = np.any(rows != 0.0, axis=1)
    if restitution is not None and system.basis.springs:
        raise InputError(f"SetValued: restitution puts rigid stops in place of all normal laws, "
                         f"but the system has nonlinear springs, {choices(system.basis.springs)}; "
                         f"leave restitution out.")
    if restitution is not None and system.basis.large_deflections:
        raise InputError("SetValued: impacts with a coefficient of restitution are those of linear "
                         "bodies, but the basis has large deflections; leave restitution out.")
    if restitution is not None:
        rough = _rough_nodes(groups, problem.static)
        rubbing &= np.array([rough[cluster == c].any() for c in range(len(rows))])
        if plane:
            _require_independence(arrays.rows[:, 1], rows[rubbing])
    return problem, rubbing


def _require_static(system: ContactSystem, static: Array) -> None:
    """Raise InputError unless static coefficients (n,), if given, are at least those of slip."""
    given = static >= 0.0
    if not given.any():
        return
    slipping = np.empty(len(static))
    for nodes, _, law in system.law_groups("friction"):
        slipping[nodes] = coefficient_at_rest(law, nodes.stop - nodes.start)
    below = np.flatnonzero(given & (static < (1.0 - 1e-9) * slipping))
    if len(below):
        j = below[0]
        raise InputError(f"SetValued: static_coefficient = {static[j]:g} of contact node {j} must "
                         f"be at least {slipping[j]:.6g}, the coefficient at which its friction "
                         f"law begins to slip; give more, or leave it out.")


def by_events(
    system: ContactSystem, method: str, restitution: Coefficient | None, impact_law: str,
    static_coefficient: Coefficient | None,
) -> bool:
    """Whether a system runs from event to event, with impacts of Newton's law if any."""
    problem, _ = nonsmooth_problem(system, restitution, static_coefficient, 1.0)
    newton = restitution is None or impact_law == "newton"
    return newton and _chosen(problem, method) == "event-driven"


def _unsmoothed(law: FrictionLaw) -> FrictionLaw:
    if isinstance(law, Frictionless):
        return law
    if law.memory or "smoothing_slope" not in (entry.name for entry in fields(law)):
        raise InputError(f"{type(law).__name__} has no smoothing_slope that could become infinite; "
                         f"set-valued friction needs a law with one, without memory.")
    steep: dict[str, Any] = {"smoothing_slope": STEEP}
    return replace(law, **steep)


def _clusters(Tx: Array, sliding: Array) -> tuple[Integers, Array]:
    """Cluster (n,) of each node and row (k, m) of each cluster.

    Nodes of a cluster have one row and one factor (n,) of the prescribed motion.
    """
    scale, fastest = np.abs(Tx).max(initial=0.0), np.abs(sliding).max(initial=0.0)
    rows: list[Array] = []
    factors: list[float] = []
    cluster = np.empty(len(Tx), dtype=np.int64)
    for j, row in enumerate(Tx):
        row = np.where(np.abs(row) > 1e-13 * scale, row, 0.0)
        for c, other in enumerate(rows):
            if np.abs(row - other).max() <= 1e-11 * scale and (
                    abs(sliding[j] - factors[c]) <= 1e-11 * fastest):
                cluster[j] = c
                break
        else:
            cluster[j] = len(rows)
            rows.append(row)
            factors.append(float(sliding[j]))
    return cluster, np.array(rows).reshape(-1, Tx.shape[1])


def _of_clusters(tangential: Array, cluster: Integers) -> Array:
    """Tangential restitution (k,) of clusters, whose nodes must agree as they slip together."""
    found = np.zeros(cluster.max(initial=-1) + 1)
    found[cluster] = tangential
    apart = np.flatnonzero(found[cluster] != tangential)
    if len(apart):
        j = int(apart[0])
        other = int(np.flatnonzero((cluster == cluster[j]) & (tangential != tangential[j]))[0])
        raise InputError(f"SetValued: tangential_restitution = {tangential[j]:g} of contact node "
                         f"{j + 1} and {tangential[other]:g} of node {other + 1} must be equal, "
                         f"for both move along the ground in the same way; give one value.")
    return found


def _rough_nodes(groups: list[tuple[FrictionLaw, Array]], static: Array) -> NDArray[np.bool_]:
    """Nodes (n,) with friction, which has to be proportional to the normal force."""
    rough = []
    for law, share in groups:
        for row in law.table(share):
            small, large = (law.kernel.python(1e-3, force, row)[0] for force in (1.0, 10.0))
            if abs(large - 10.0 * small) > 1e-9 * abs(large):
                raise InputError(f"Friction of {type(law).__name__} is not proportional to the "
                                 f"normal force, as that of rigid stops has to be; use another "
                                 f"law, or leave restitution out.")
            rough.append(law.kernel.python(CREEP, 1.0, row)[0] != 0.0)
    return np.array(rough) | (static > 0.0)


def _require_independence(Ty: Array, rows: Array) -> None:
    """Raise InputError unless normal and tangential motions of the nodes are independent."""
    scale = max(np.abs(Ty).max(initial=1e-300), np.abs(rows).max(initial=0.0))
    together = np.vstack([Ty, rows])
    if np.linalg.matrix_rank(together, tol=1e-9 * scale) < len(together):
        along = f", and along it in {len(rows)} ways with friction," if len(rows) else ""
        raise InputError(f"The {len(Ty)} contact nodes move normal to the ground{along} by "
                         f"motions that are not independent in {Ty.shape[1]} modes, so that forces "
                         f"of rigid stops cannot be distinguished; use fewer nodes, or more modes.")


def _chosen(problem: kinds.NonsmoothProblem, method: str) -> str:
    """The method that runs a problem; InputError if the one that is named cannot."""
    if problem.system.rows.shape[1] > 2:
        if problem.poisson:
            raise InputError("SetValued: impact_law = 'poisson' is for plane bodies, but this "
                             "system has contact in space; use impact_law = 'newton'.")
        if method == "event-driven":
            raise InputError("EventDriven() is for plane bodies, but this system has contact in "
                             "space; take SetValued().")
        return "time-stepping"
    if problem.rigid:
        if method == "time-stepping":
            raise InputError("TimeStepping() has no rigid stops for plane bodies; take "
                             "SetValued(), or leave restitution out.")
        return "event-driven"
    moving = problem.rows[np.any(problem.rows != 0.0, axis=1)]
    scale = np.abs(moving).max(initial=0.0)
    independent = not len(moving) or np.linalg.matrix_rank(moving, tol=1e-6 * scale) == len(moving)
    if method == "set-valued":
        return "event-driven" if independent and len(moving) <= _FEW else "time-stepping"
    if method == "event-driven" and not independent:
        raise InputError(f"EventDriven() needs independent slip velocities, but the {len(moving)} "
                         f"different ones depend on fewer modes; take SetValued().")
    return method


def _stops_of(system: ContactSystem, start: float, end: float) -> Array:
    """Breaks (k,) up to the end; where signals jump right after one, the next number instead."""
    found = np.array(system.breakpoints(float(np.nextafter(start, -np.inf)),
                                        float(np.nextafter(end, np.inf))), dtype=float)
    near = np.stack([np.nextafter(found, -np.inf), found, np.nextafter(found, np.inf)])
    jumps = np.zeros((2, len(found)), dtype=bool)
    for signal in (*system.drive.motions, *system.load.signals.values()) if len(found) else ():
        value, rate = signal.history(near.ravel()).T.reshape(2, 3, -1)
        steepest = np.abs(rate).max(axis=0) * np.diff(near, axis=0).max(axis=0)
        jumps |= np.abs(np.diff(value, axis=0)) > 2.0 * steepest + _JUMP * signal.largest
    stops = np.union1d(found[jumps[0] | ~jumps[1]], near[2, jumps[1]])
    return stops[(stops > start) & (stops <= end)]


def _longest_between_events(system: ContactSystem, times: Array) -> float:
    """Longest step [s] of an event-driven run with compliant contact."""
    if not system.prescribed_motion.constant or system.ground.wavy:
        return longest_step(system, times)
    start, end = float(times[0]), float(times[-1])
    return min((end - start) / 50.0, _PERIOD_PART * system.shortest_period(start, end))


def _floor_of(system: ContactSystem, state: Array, times: Array, longest: float) -> Array:
    """Values (2 m + p + n,) below which the error is not measured relative to the state."""
    m, n = system.basis.modes, system.basis.contact_nodes
    arrays, drive = system.arrays, system.drive
    largest = largest_motions(system)
    depth = system.penetration_scale
    fastest = system.prescribed_motion.largest_speed(float(times[0]), float(times[-1]))
    speed = max(0.01 * fastest, depth / longest)
    # Velocities that drive and loads bring about in each mode, within a step where it is slow.
    springs = arrays.drive_stiffness[:, None] * arrays.drive_shapes
    applied_forces = [(springs, [motion.largest for motion in drive.motions[: len(springs)]]),
              (arrays.load_shapes, [signal.largest for signal in system.load.signals.values()])]
    applied = sum(np.array(sizes) @ np.abs(shapes) for shapes, sizes in applied_forces)
    slowest = np.maximum(np.diag(arrays.stiffness), 1.0 / longest**2)
    driven = applied / np.sqrt(slowest)
    energy = (0.5 * state[m : 2 * m] @ state[m : 2 * m]
              + 0.5 * abs(state[:m] @ system.arrays.stiffness @ state[:m])
              + work_of_loads(system.basis, system.load, depth)
              + sum(0.5 * c * motion.largest**2 for c, motion in zip(
                  drive.stiffness, drive.motions, strict=True))
              + 0.5 * driven @ driven)
    return np.concatenate([depth / largest, np.maximum(speed / largest, _DRIVEN * driven),
                           np.full(POWER_COUNT + n, energy or 0.5 * speed**2)])
