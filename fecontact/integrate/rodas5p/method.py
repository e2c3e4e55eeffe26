"""Steps of Rodas5P for contact systems."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.vectors import select, somewhere
from fecontact.integrate.near_nodes import choose_near, set_end
from fecontact.integrate.polynomial_bounds import may_switch, needs_search
from fecontact.integrate.rodas5p import dynamics, stage_solver, state, tableau
from fecontact.integrate.rodas5p.error_control import (
    defect_error,
    memory_error,
    passes_corner,
    set_creeps,
    set_scale,
    set_signs,
    set_stage_rate,
    slip_error,
    state_error,
    switches,
    take_scales,
    work_error,
    work_until,
)
from fecontact.integrate.rodas5p.event_kernels import (
    KINKS,
    NODES,
    Watch,
    begin,
    full,
    next_switch,
    note_events_at,
)
from fecontact.integrate.rodas5p.kinks import caution_after_failure, up_to_kink
from fecontact.integrate.rodas5p.missed_contacts import first_missed_at
from fecontact.integrate.rodas5p.moving_ground import ground_in, increments_in, set_ground
from fecontact.integrate.rodas5p.sliders import BEGIN, END, OUTPUT, SWITCH, attend_at
from fecontact.integrate.rodas5p.state import CAUTIOUS, MISSED, Step
from fecontact.integrate.rodas5p.step_length import (
    REJECTED_LAST,
    growth,
    length_beyond,
    next_stop,
    root_of,
    target_of,
)
from fecontact.integrate.rodas5p.variational import (
    Variation,
    Vary,
    keep,
    propagate_at,
    write_columns,
)
from fecontact.integrate.small_systems import Sized, is_small
from fecontact.integrate.step_loop import (
    ANEW,
    BEYOND,
    CUT,
    FAILED,
    NOT_A_NUMBER,
    OUTPUTS,
    RATES,
    RUNNING,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.integrate.step_polynomials import keep_ends, set_ends, set_polynomials
from fecontact.system.nodes import ground_motion
from fecontact.system.powers import DRIVE, POWER_COUNT, drive_jump, set_powers

# Attempts at a step that end where something was not felt.
_MOST_AGAIN = 20


class Data(NamedTuple):
    """A run by Rodas5P.

    If the columns of ``vary.variation`` are not empty, those that belong to each output time are
    put into ``vary.transitions`` and restarted there; the output times must then be breaks.
    Events are noted in ``watch``.
    """

    problem: state.Problem
    progress: state.Progress
    workspace: state.Workspace
    output: state.Output
    kept: state.Output
    vary: Vary
    watch: Watch


@routine
def _begin(t, data):
    """Prepare the first step of a run."""
    problem, progress, workspace, output, watch = (data.problem, data.progress, data.workspace,
                                                   data.output, data.watch)
    s, control = problem.system, problem.control
    after = np.nextafter(t, output.times[-1])
    dynamics.set_given(after, s, workspace.given, workspace.load)
    dynamics.set_rate_and_gradients(progress.state, s, problem.blocks, workspace.given,
                                    workspace.load, workspace.nodes, progress.gradients,
                                    progress.rate)
    n = len(s.gap)
    set_signs(workspace.nodes[2, n : 2 * n], progress.signs)
    if control.work:
        set_powers(after, progress.state, s, control.stick_speed, progress.power[:POWER_COUNT],
                   progress.power[POWER_COUNT:])
    if _watched(watch) or watch.counts[KINKS]:
        begin(t, progress.state, s, control.depth, watch, workspace.scratch)
    return RUNNING


@routine
def _resume(t, data):
    """Nodes and polynomials at the start of a step."""
    problem, progress = data.problem, data.progress
    set_ends(t, progress.state, problem.system, problem.blocks, problem.control.ground,
             data.workspace.ends)
    progress.numbers[MISSED] = 0.0


@helper
def _full(data):
    """Whether a step may have more events than there is room for."""
    return _watched(data.watch) and full(data.watch)


@helper
def _watched(watch):
    """Whether events are watched for."""
    return watch.counts[NODES] != 0 or len(watch.own) > 0


@helper
def _next_target(t, h, last, smallest, data):
    """The next step to try, of about the length h, or exactly that if the last one was cut.

    It does not go past a break. After one that has failed it ends at a kink of the forces that
    lies ahead.
    """
    problem, progress, workspace = data.problem, data.progress, data.workspace
    s, control = problem.system, problem.control
    end = data.output.times[-1]
    after = np.nextafter(t, end)
    # Just after t: what is given may jump at a break.
    moved = ground_motion(after, s)
    stop, latest, is_break = next_stop(t, control.breaks, end)
    target = target_of(t, h, last == CUT, stop)
    target, caution = up_to_kink(t, target, stop, smallest, moved, problem, progress, workspace)
    if last <= ANEW:
        dynamics.set_given(after, s, workspace.given, workspace.load)
        choose_near(h, problem, progress, workspace)
    return Step(t, target - t, target, latest, moved, caution, is_break and target == stop)


@routine
def _linearise(step, after_t, problem, progress, workspace):
    """Compute the derivatives that a step needs at its start besides the matrices."""
    s, later = problem.system, dynamics.t_plus(step)
    dynamics.set_load_rate(step.t, later, after_t, s, workspace.pull_rate)
    change = dynamics.rates_of_ground(problem.control.varying,
                                      dynamics.motion_given(workspace.given))
    dynamics.set_time_rate(s, workspace.near, workspace.given, change, progress.gradients,
                           workspace.pull_rate, workspace.nodes, workspace.time_rate)
    take_scales(problem.control, progress)


@routine
def _stages(step, G, problem, progress, workspace):
    """Compute all stages of a step, and its end ``workspace.after``.

    Returns True if a normal force has another sign at a stage than at the start.
    """
    s, blocks, switched = problem.system, problem.blocks, False
    size = len(progress.state)
    m = len(workspace.load)
    last, rise, varying = step.t, 1.0 / step.h, problem.control.varying
    if varying:
        set_ground(step, step.moved, s, workspace.ground)
    tableau.begin_stages(progress.state, workspace.sums)
    for i in range(tableau.STAGES):
        if i == 0:
            for k in range(size):
                workspace.right[k] = progress.rate[k]
        else:
            tableau.next_stage(i, rise, progress.state, workspace.stages, workspace.sums,
                               workspace.stage, workspace.right)
            now = min(step.t + tableau.NODES[i] * step.h, step.latest)
            if somewhere(now != last):
                dynamics.set_given(now, s, workspace.given, workspace.load)
                last = now
            if varying:
                dynamics.give_motion(ground_in(i, workspace.ground), workspace.given)
            set_stage_rate(problem, progress, workspace, workspace.nodes)
            switched = switched | switches(workspace.near.used[0], workspace.near.nodes,
                                           workspace.nodes[2], progress.signs)
            for k in range(size):
                workspace.right[k] += workspace.base[k]
        if tableau.TIME[i] != 0.0:
            for k in range(m, size):
                workspace.right[k] += tableau.TIME[i] * step.h * workspace.time_rate[k]
        if varying:
            dynamics.add_ground_change(increments_in(i, workspace.ground), s, workspace.near,
                                       progress.gradients, workspace.nodes, workspace.right)
        stage_solver.solve_stage(G, s, blocks, progress.gradients, workspace.reduced,
                                 workspace.right, workspace.nodes, workspace.stages[i])
    if varying:
        dynamics.give_motion(ground_motion(last, s), workspace.given)
    for k in range(size):
        workspace.after[k] = workspace.stage[k] + workspace.stages[tableau.STAGES - 1, k]
    progress.counts[RATES] += tableau.STAGES
    return switched


@routine
def solve(step, G, new, end, problem, progress, workspace):
    """Compute a step; ``new`` if it is the first attempt from where it begins.

    Returns True if a normal force has another sign at a stage than at the start.
    """
    s = problem.system
    memory = len(progress.state) > 2 * len(problem.control.largest)
    if new:
        _linearise(step, dynamics.just_after(step.t, end), problem, progress, workspace)
    if memory:
        stage_solver.eliminate_memory(G, s, progress.gradients, workspace.reduced)
    if new or memory:
        stage_solver.assemble(s, workspace.near, progress.gradients, workspace.reduced)
    stage_solver.factorise_step(G, problem.blocks, workspace.reduced)
    return _stages(step, G, problem, progress, workspace)


@routine
def error_at_end(step, end, problem, progress, workspace):
    """Error of the state and of the slip velocities at the end of a step.

    Where the state is within its tolerance, its rates and gradients are evaluated too.
    """
    error = state_error(problem.control, progress, workspace)
    if somewhere(error <= 1.0):
        if step.at_break:
            dynamics.set_given(dynamics.just_after(step.target, end), problem.system,
                               workspace.given, workspace.load)
        set_end(problem, progress, workspace)
        at_nodes = memory_error(slip_error(error, problem, progress, workspace), problem, progress,
                                workspace)
        error = select(error <= 1.0, at_nodes, error)
    return error


@routine
def switch_error(step, G, end, problem, progress, workspace):
    """Error of a step in which a normal force switches; what is known of the end stays."""
    known = workspace.near.used[0]
    error = defect_error(step, G, problem, progress, workspace)
    if somewhere(error <= 1.0):
        last = min(step.target, step.latest)
        if step.at_break:
            last = dynamics.just_after(step.target, end)
        dynamics.set_given(last, problem.system, workspace.given, workspace.load)
        if workspace.near.used[0] != known:
            set_end(problem, progress, workspace)
    return error


@routine
def _missed_part(step, smallest, problem, progress, workspace):
    """Part of the step to which it has to be shortened, as its stages missed a force; 1 if none."""
    s, blocks, control = problem.system, problem.blocks, problem.control
    again = int(progress.numbers[MISSED])
    if may_switch(step, problem, progress, workspace) and again < _MOST_AGAIN:
        set_polynomials(s, blocks, control.ground, progress.state, workspace.after, workspace)
        if needs_search(step.moved, step.h, s, control.ground, control.levels, control.slip_scale,
                    workspace):
            part = first_missed_at(control.missed)(step, again, problem, progress, workspace)
            if part * step.h > 100.0 * smallest and part < 1.0:
                return part
    return 1.0


@routine
def _switch_part(step, smallest, problem, progress, workspace, watch):
    """Part of the step to which it has to be shortened, to end at a kink; 1 if there is none."""
    part = next_switch(step, problem, progress, workspace, watch)
    # A switch within rounding of a step end counts as lying on that end.
    near = max(1e-6 * step.h, 100.0 * smallest)
    if part * step.h > near and (1.0 - part) * step.h > near:
        return part * (1.0 + 1e-9)
    return 1.0


@helper
def _refused(step, error, progress, workspace):
    """Outcome of a step whose error is too large, and the length of the next attempt."""
    progress.numbers[REJECTED_LAST] = 1.0
    progress.numbers[CAUTIOUS] = caution_after_failure(step)
    if not error < np.inf:
        workspace.stages[:] = 0.0
    return FAILED if error < np.inf else NOT_A_NUMBER, step.h * growth(root_of(error))


@helper
def _attempt(step, last, smallest, data):
    """Try a step; its outcome, and the length of the next one."""
    problem, progress, workspace, vary, watch = (data.problem, data.progress, data.workspace,
                                                 data.vary, data.watch)
    control, numbers, end = problem.control, progress.numbers, data.output.times[-1]
    G = 1.0 / (step.h * tableau.GAMMA)
    if last == TAKEN and control.sliders != 0:
        attend_at(control.sliders)(BEGIN, step, problem, progress, workspace, vary, step.t,
                                   workspace.right)
    switched = solve(step, G, last <= ANEW, end, problem, progress, workspace)
    error = error_at_end(step, end, problem, progress, workspace)
    if error <= 1.0:
        tableau.dense_coefficients(workspace.stages, workspace.dense)
        part = _missed_part(step, smallest, problem, progress, workspace)
        if part < 1.0:
            numbers[MISSED] += 1.0
            return CUT, step.h * part
        switched |= switches(len(problem.system.gap), problem.blocks.nodes, workspace.nodes[2],
                             progress.signs)
        if switched or passes_corner(control, problem.system, workspace):
            error = max(error, switch_error(step, G, end, problem, progress, workspace))
        if error <= 1.0 and control.work:
            error = max(error, work_error(step, problem, progress, workspace))
    if error <= 1.0:
        part = 1.0
        if control.sliders != 0:
            part = attend_at(control.sliders)(SWITCH, step, problem, progress, workspace, vary,
                                              step.t, workspace.right)
            if part == 0.0:
                return ANEW, step.h
        if part == 1.0 and watch.counts[KINKS]:
            part = _switch_part(step, smallest, problem, progress, workspace, watch)
        if part < 1.0:
            return CUT, step.h * part
        if len(vary.variation.columns) > 0:
            set_scale(control, progress, workspace)
            error = max(error, propagate_at(vary.propagate)(step, problem, progress, workspace,
                                                            vary)
                        / vary.variation.tolerance)
    if not error <= 1.0:
        return _refused(step, error, progress, workspace)
    h = length_beyond(step.caution, step.h, root_of(error), control.longest, numbers)
    numbers[MISSED] = 0.0
    numbers[CAUTIOUS] = step.caution
    return TAKEN, h


@routine
def _find_end(step, data):
    """Note the events of a step; the part of it after which the run ends."""
    problem, progress, workspace, watch = data.problem, data.progress, data.workspace, data.watch
    s, control = problem.system, problem.control
    if _watched(watch):
        set_polynomials(s, problem.blocks, control.ground, progress.state, workspace.after,
                        workspace)
        return note_events_at(watch.note)(step, problem, progress, workspace, watch)
    if watch.counts[KINKS]:
        begin(min(step.target, step.latest), workspace.after, s, control.depth, watch,
              workspace.scratch)
    return BEYOND


@routine
def _close(step, writes, data):
    """Keep the columns of a step, and write them if an output is in it."""
    problem, progress, workspace, vary = data.problem, data.progress, data.workspace, data.vary
    control, variation = problem.control, vary.variation
    if len(variation.columns) > 0:
        keep(variation)
        if writes and control.sliders != 0:
            attend_at(control.sliders)(END, step, problem, progress, workspace, vary, step.t,
                                       workspace.right)
    if control.work:
        set_creeps(step, problem, progress, workspace)
    if writes and len(variation.columns) > 0:
        write_columns(variation, vary.transitions[progress.counts[OUTPUTS]])


@routine
def _fill(row, output, step, data):
    """Fill a row of the output."""
    problem, progress, workspace, vary = data.problem, data.progress, data.workspace, data.vary
    time = output.times[row]
    part = (time - step.t) / step.h
    tableau.interpolated(part, progress.state, workspace.after, workspace.dense, output.states[row])
    if problem.control.sliders != 0:
        attend_at(problem.control.sliders)(OUTPUT, step, problem, progress, workspace, vary,
                                           min(time, step.latest), output.states[row])
    if problem.control.work:
        work_until(part, step.h, progress.work, workspace, output.work[row])


@routine
def _stop_at(part, step, data):
    """End the run at a part of the step."""
    progress, workspace = data.progress, data.workspace
    if data.problem.control.work:
        work_until(part, step.h, progress.work, workspace, progress.work)
    tableau.interpolated(part, progress.state, workspace.after, workspace.dense, workspace.right)
    for k in range(len(progress.state)):
        progress.state[k] = workspace.right[k]


@helper
def add_jump(step, state, problem, progress, output):
    """Add what the drive puts in by jumping at the end of a step, to the outputs there too."""
    row, times = progress.counts[OUTPUTS] - 1, output.times
    while row >= 0 and times[row] > step.latest:
        output.work[row, DRIVE] += drive_jump(step.latest, times[row], state, problem.system)
        row -= 1
    progress.work[DRIVE] += drive_jump(step.latest, np.nextafter(step.target, times[-1]), state,
                                       problem.system)


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run."""
    problem, progress, workspace, output = data.problem, data.progress, data.workspace, data.output
    if problem.control.work:
        work_until(1.0, step.h, progress.work, workspace, progress.work)
        if step.at_break:
            set_powers(np.nextafter(step.target, output.times[-1]), workspace.after, problem.system,
                       problem.control.stick_speed, progress.power[:POWER_COUNT],
                       progress.power[POWER_COUNT:])
            add_jump(step, workspace.after, problem, progress, output)
        else:
            for k in range(len(progress.power)):
                progress.power[k] = workspace.power[3, k]
    for k in range(len(progress.state)):
        progress.state[k] = workspace.after[k]
        progress.rate[k] = workspace.rate_after[k]
    n = len(problem.system.gap)
    set_signs(workspace.nodes[2, n : 2 * n], progress.signs)
    # Gradients of nodes that are not near stay zero.
    dynamics.copy_gradients(workspace.gradients_after, progress.gradients, workspace.near)
    keep_ends(n, workspace)
    return RUNNING, h


METHOD = Method("rodas5p", Data, _next_target, _attempt, _fill, _go_on, _begin, _resume, _close,
                _full, _find_end, _stop_at, places=2)
advance = step_loop(METHOD)
SMALL = Sized(partial(step_loop, METHOD), (state.Problem, state.Progress, state.Workspace,
                                           state.Output),
              more=lambda modes, nodes: {Variation: {"columns": (0, None)}})


def advance_for(problem: state.Problem, vary: Vary) -> Any:
    """The loop of a run: that of the size of its system if it is small, or that of all.

    Runs with derivatives have the latter.
    """
    if len(vary.variation.columns) or not is_small(problem):
        return advance
    nodes, _, modes = problem.system.rows.shape
    return SMALL.of(modes, nodes)
