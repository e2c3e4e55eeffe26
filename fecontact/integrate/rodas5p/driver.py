"""Running the compiled integrator: tolerances, pieces of a run, interrupts, checkpoints."""

import time as clock
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import require_state
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate import step_loop
from fecontact.integrate.collocation.workspace import chosen_collocation, collocation_for
from fecontact.integrate.event_arrays import watch_for
from fecontact.integrate.events import AnyEvent
from fecontact.integrate.kept_rows import workspace_for_rows
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.integrate.near_nodes import take_near
from fecontact.integrate.polynomial_bounds import counts_as_few, modes_may_switch
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p.blocks import FEW, blocks_of
from fecontact.integrate.rodas5p.checkpoint import Checkpoint
from fecontact.integrate.rodas5p.missed_contacts import first_missed
from fecontact.integrate.rodas5p.run import Run
from fecontact.integrate.rodas5p.sliders import attend
from fecontact.integrate.rodas5p.state import (
    Control,
    Output,
    Problem,
    Progress,
    output_for,
    progress_for,
    workspace_for,
)
from fecontact.integrate.rodas5p.variational import (
    Vary,
    in_parts,
    propagate_for,
    variation_for,
)
from fecontact.integrate.run_limits import (
    breaks,
    energy_scale,
    largest_motions,
    longest_step,
    work_of_jump,
)
from fecontact.integrate.series.branches import chosen_series, from_state
from fecontact.integrate.step_runs import complete, until_end
from fecontact.integrate.task import Task
from fecontact.integrate.trajectory import Solution, Status
from fecontact.laws.base import NormalLaw
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import (
    booked,
    exact_arrays,
    slider_counts,
)
from fecontact.system.friction_memory import velocity_scale
from fecontact.system.powers import DRIVE, NODE_POWERS, POWER_COUNT

# Slip velocities are resolved to this part of their distance from stick. Where friction falls
# with slip velocity, what is left undetermined there decides when a contact breaks away.
SLIP_PART = 0.01
# Part of the tolerance allowed for a step in which a normal force begins or ends. Its estimate is
# the error of the result; that of other steps is the larger error of the embedded solution.
SWITCH_PART = 0.1
# Slip velocities, in widths of the smoothing, at which slip is about to turn into stick.
_SLOW = 20.0
# Derivatives of the motion may be in error by so many times the tolerance in a step, of their size
# or of this part of the largest that it has been. In parts of steps the error is that of what is
# kept, else that of a solution of lower order.
_LOOSER, _COLLOCATED, _IN_PARTS, _FADED = 10.0, 10.0, 200.0, 0.1


def start(
    system: ContactSystem,
    state: Array,
    times: Array,
    *,
    rtol: float,
    max_step: float | None = None,
    work: bool = True,
    vary: bool | tuple[ContactSystem, ContactSystem, float] = False,
    vary_rtol: float | None = None,
    events: Sequence[AnyEvent] = (),
    method: str = "auto",
    keep_steps: bool = False,
) -> Run:
    """A run from ``times[0]``, before its first step.

    Parameters
    ----------
    system : ContactSystem
        Contact system to integrate.
    state : (2 m + n s,) array
        y = [q, q', z] at the start.
    times : (N,) array
        Output times, ascending [s].
    rtol : float
        Error of one step: of each modal displacement relative to its largest value so far, or to
        the penetration scale of the normal laws where that is more; of modal velocities relative
        to the largest so far; of internal variables relative to their scale. At nodes with
        friction without memory slip velocities are resolved to a hundredth of their distance
        from rest, or of the width of the smoothing.
    max_step : float, optional
        Longest step [s]; shorter ones where :func:`longest_step` says so.
    work : bool
        Whether to integrate the powers. Their error of one step is kept below ``rtol`` of the
        largest energy so far, so that the energy balance closes.
    vary : bool or (above, below, width)
        Whether to carry the derivatives to the initial state along; with those to a parameter if
        the system is given with the parameter moved up and down, ``width`` apart. Steps then end
        where normal forces begin, end or pass the depth of their law, at output times too.
    vary_rtol : float, optional
        Error of one step of the derivatives, relative to the largest they have been. By default
        ten times ``rtol`` of their size, or of a tenth of the largest, by collocation too; 200
        times ``rtol`` where they go over a step in parts, which :func:`in_parts` says.
    events : sequence of ContactEvents, Crossing and Event
        Events to watch for.
    method : 'auto', 'rodas5p', 'radau' or 'power-series'
        How to go on; 'auto' as :class:`fecontact.integrate.Auto` says.
    keep_steps : bool
        Whether to keep rows between the outputs; not of runs with derivatives.
    """
    require_state(state, np.inf)
    basis = system.basis
    m, n, states = basis.modes, basis.contact_nodes, system.memory
    combinations = len(system.arrays.polynomial_rows)
    times = np.array(times, dtype=float)
    control = control_for(system, state, times, rtol=rtol, max_step=max_step, work=work)
    above, below, width, columns = system, system, 0.0, 0
    if vary:
        # Derivatives are those of all nodes.
        control.untouched[:] = -np.inf
        control = control._replace(breaks=breaks(system, times, times[1:-1])[1])
        columns = len(state)
        if not isinstance(vary, bool):
            above, below, width = vary
            columns += 1
    blocks = blocks_of(basis, system.arrays)
    counts = control.slider_counts
    problem = Problem(exact_arrays(system.arrays, counts), blocks, control)
    expanded, collocated = None, None
    if method == "power-series" or (method == "auto" and not vary):
        expanded = chosen_series(system, state, times, rtol, max_step, events, work,
                                 method == "power-series")
    if method == "radau" or (method == "auto" and expanded is None):
        collocated = chosen_collocation(system, rtol, events, method == "radau")
    propagate, looser = 0, _LOOSER
    if vary and collocated:
        # Compiled for runs that need it only.
        from fecontact.integrate.collocation import columns as carried

        propagate, looser = int(carried.SMALL.of(m, n).address), _COLLOCATED
    elif vary:
        propagate, looser = propagate_for(problem), _IN_PARTS if in_parts(problem) else _LOOSER
    return Run(
        problem,
        _progress(system, control, times, state),
        workspace_for(m, n, states, basis.dimension, blocks, combinations),
        output_for(times, len(state), n),
        output_for(np.empty(workspace_for_rows(keep_steps,
                                               len(state) + POWER_COUNT + NODE_POWERS * n)),
                   len(state), n, np.empty),
        Vary(exact_arrays(above.arrays, counts), exact_arrays(below.arrays, counts), width,
             _moved_both_ways(system, above, below),
             variation_for(system, columns, width, float(vary_rtol or looser * rtol),
                           1.0 if vary_rtol else _FADED),
             np.zeros((len(times) if vary else 0, columns, len(state))),
             propagate),
        watch_for(system, events, bool(vary)),
        expanded, collocated)


def again(run: Run, system: ContactSystem, state: Array) -> Run:
    """New run of a system from another state, without powers, derivatives and events.

    It shares the workspace and the tables of ``run``, which must have ended.
    """
    # Columns and watched events would go on from where that run has left them; the scale of
    # energies is that of its start.
    control = run.problem.control
    assert not len(run.variation.variation.columns)
    assert not run.watch.note
    assert not control.work
    require_state(state, np.inf)
    output = run.output
    return Run(
        run.problem, _progress(system, control, run.times, state), run.workspace,
        Output(output.times, np.zeros_like(output.states), np.zeros_like(output.work)), run.kept,
        run.variation, run.watch,
        None if run.series is None else from_state(run.series, system, state),
        None if run.collocation is None else collocation_for(
            system.basis.modes, system.basis.contact_nodes, control.rtol))


def _progress(system: ContactSystem, control: Control, times: Array, state: Array) -> Progress:
    """Before the first step, whose length the acceleration at the start limits.

    Signals that jump at the start, within rounding, have jumped.
    """
    basis, m = system.basis, system.basis.modes
    time = breaks(system, times)[0]
    with np.errstate(over="ignore", invalid="ignore"):
        acceleration = np.abs(system.rhs(time, state)[m : 2 * m]) * control.largest
    first = min(0.1 * control.speed_scale / max(float(acceleration.max()), 1e-300),
                0.01 * control.longest)
    progress = progress_for(state, time, first, m, basis.contact_nodes, basis.dimension,
                            len(system.arrays.polynomial_rows))
    if control.work:
        progress.work[DRIVE] = work_of_jump(system, float(times[0]),
                                            float(np.nextafter(time, times[-1])), state)
    return progress


def _moved_both_ways(system: ContactSystem, above: ContactSystem, below: ContactSystem) -> int:
    """Whether both systems differ from the system itself."""
    return int(not any(moved is system or all(
        np.array_equal(np.asarray(one), np.asarray(other))
        for one, other in zip(system.arrays, moved.arrays, strict=True))
        for moved in (above, below)))


def control_for(
    system: ContactSystem, state: Array, times: Array, *, rtol: float, max_step: float | None,
    work: bool,
) -> Control:
    """Step-size limits and error scales of a run; see :func:`start`."""
    largest = largest_motions(system)
    slip_scale, depth, stick_speed, untouched = np.zeros((4, system.basis.contact_nodes))
    for nodes, _, law in system.law_groups("friction"):
        slip_scale[nodes] = velocity_scale(law, system.force_scale)
        if work and not law.memory:
            stick_speed[nodes] = law.stick_velocity(nodes.stop - nodes.start)
    corner = np.full(system.basis.contact_nodes, np.inf)
    for nodes, share, law in system.law_groups("normal"):
        depth[nodes] = law.penetration_scale
        corner[nodes] = _corner(law, share)
        untouched[nodes] = law.untouched(nodes.stop - nodes.start)
    # Internal variables of friction decay without force: their nodes are always evaluated.
    untouched[system.arrays.memory[: len(untouched)] > 0] = -np.inf
    with np.errstate(over="ignore", invalid="ignore"):
        energy = energy_scale(system, state) if work else 0.0
    counts, bounds = slider_counts(system), _ground_bounds(system, times)
    n = system.basis.contact_nodes
    return Control(
        displacement_scale=system.penetration_scale / largest, memory_scale=system.memory_scales,
        slip_scale=slip_scale, slow=_SLOW * slip_scale, stick_speed=stick_speed, depth=depth,
        corner=corner, largest=largest, untouched=untouched,
        breaks=breaks(system, times)[1],
        levels=_levels(system), ground=bounds,
        rtol=float(rtol), slip_part=SLIP_PART, switch_part=SWITCH_PART,
        # The stages of a step meet what is given in time at five times.
        longest=longest_step(system, times, max_step, 1.0, 4.0),
        speed_scale=system.velocity_scale, energy_scale=energy,
        work=int(work), missed=first_missed.address,
        near=take_near.address if n > FEW else 0,
        many=0 if counts_as_few(n, bounds) else modes_may_switch.address,
        sliders=attend.address if counts.any() else 0, slider_counts=counts,
        varying=int(not system.prescribed_motion.constant))


def _levels(system: ContactSystem) -> Array:
    """Penetrations (l, n) at which the normal forces of the nodes begin or end."""
    parts = [law.onsets(nodes.stop - nodes.start) for nodes, _, law in system.law_groups("normal")]
    most = max(len(part) for part in parts)
    # Laws with fewer onsets repeat their first one.
    return np.hstack([np.vstack([part, *[part[:1]] * (most - len(part))]) for part in parts])


def _corner(law: NormalLaw, share: Array) -> Array:
    """Penetrations (n,) at which the last piece of a law begins, inf if its force begins there."""
    pieces, onsets = law.pieces(share), law.onsets(len(share))
    if pieces is None:
        return np.full(len(share), np.inf)
    last = pieces[:, -1, 0]
    return np.where((last == onsets).any(axis=0), np.inf, last)


def _ground_bounds(system: ContactSystem, times: Array) -> Array:
    """Bounds on the ground, in the order of :mod:`fecontact.integrate.step_polynomials`."""
    ground, motions = system.ground, system.prescribed_motion.motions
    start, end = float(times[0]), float(times[-1])
    low, high, slope = 0.0, 0.0, 0.0
    if ground.wavy:
        try:
            (low, high), slope = ground.height_range, ground.steepest_slope
        except NotImplementedError:
            raise InputError(f"Ground: profile = {ground.profile!r} must say its height_range and "
                             f"its steepest_slope, which bound it between the places where the "
                             f"integrator meets it.") from None
    if not system.basis.ground_nodes.all():
        low, high = min(low, 0.0), max(high, 0.0)
    return np.array([low, high, slope, sum(one.largest_speed(start, end) for one in motions),
                     sum(one.largest_acceleration(start, end) for one in motions)])


def integrate(task: Task, method: str, checkpoint: Path | None) -> Solution:
    """Integrate by a compiled method, with a checkpoint if it has a name."""
    begin, system, state = clock.perf_counter(), task.system, task.state
    run = start(system, state, task.times, rtol=task.rtol, max_step=task.max_step,
                events=task.events, method=method, keep_steps=task.keep_steps)
    stored = None if checkpoint is None else Checkpoint.of(checkpoint, run, state)
    if stored is not None:
        stored.read()
    ended = complete(run, task.progress, None if stored is None else stored.keep)
    statistics: dict[str, Any] = {"method": run.method, **run.statistics,
                                  "seconds": clock.perf_counter() - begin}
    if ended not in (Status.FINISHED, Status.EVENT):
        statistics["message"] = f"{_place(run, ended)}"
    if stored is not None and ended is Status.INTERRUPTED:
        try:
            stored.write()
        except InputError as error:
            statistics["message"] += f" {error}"
    times, states, work = until_end(
        run, (run.states, run.progress.state), (run.work, run.progress.work))
    begun, counts = (float(times[0]), run.states[0]), run.problem.control.slider_counts
    time, *values = (column[: run.kept_rows] for column in run.kept)
    kept = KeptSteps(time, *booked(system, counts, time, values[0], values[1], begun))
    kept = replace(kept, work=kept.work[:, :POWER_COUNT].copy()).before(times[-1])
    states, work = booked(system, counts, times, states, work, begun)
    lost, creep = np.split(work[:, POWER_COUNT:], NODE_POWERS, axis=1)
    return Solution(times, states, work[:, :POWER_COUNT], ended, statistics,
                    node_friction_work=lost, node_creep_work=creep, events=run.events,
                    kept=kept if task.keep_steps else None)


def _place(run: Run, ended: Status) -> str:
    where = f"It ended at t = {run.time:.9g} s"
    if ended is Status.MINIMUM_STEP and run.progress.counts[step_loop.REJECTIONS]:
        where += f", near contact node {int(run.progress.numbers[run_arrays.WORST_NODE])}"
    return f"{where}."
