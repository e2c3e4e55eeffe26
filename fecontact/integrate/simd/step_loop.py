"""The compiled time integrator for many small runs: eight at once, one in each lane.

Every lane has its own time and step; all try a step together, and each goes on by the outcome of
its own. A lane whose run has ended takes the next one that waits. No lane has a part in what
another one computes, so that results do not depend on which runs are side by side.

Stages, errors and checks are those of single runs, :mod:`fecontact.integrate.rodas5p.method`,
with eight numbers in place of each.
"""

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.simd.functions import at_unknown_place, lane_of, opposite, somewhere, with_lane
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import bits, mask_of, select, spread
from fecontact.integrate.near_nodes import set_end
from fecontact.integrate.polynomial_bounds import may_switch, needs_search
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.rodas5p.dynamics import motion_given, next_kink, set_given
from fecontact.integrate.rodas5p.error_control import sign_of, switches
from fecontact.integrate.rodas5p.method import error_at_end, solve, switch_error
from fecontact.integrate.rodas5p.missed_contacts import first_missed_at
from fecontact.integrate.rodas5p.state import CAUTIOUS, MISSED, SPEED_SCALE, Step
from fecontact.integrate.rodas5p.step_length import (
    LAST_ROOT,
    LAST_STEP,
    REJECTED_LAST,
    growth,
    next_length,
    root_of,
    target_of,
)
from fecontact.integrate.simd import arrays
from fecontact.integrate.simd.arrays import (
    ATTEMPTS,
    END,
    EXACTLY,
    KNOWN,
    NEXT_OUTPUT,
    OPEN,
    SMALLEST,
    TAKEN,
    WAITING,
)
from fecontact.integrate.small_systems import FEW, Sized
from fecontact.integrate.step_loop import FINISHED, MINIMUM_STEP, NOT_FINITE, STEP, TIME
from fecontact.integrate.step_polynomials import set_polynomials
from fecontact.system.nodes import GroundMotion

# How a call returned: so many attempts were made, lanes are free that more runs may take, or all
# runs have ended.
GOES_ON, HUNGRY, DONE = range(3)

_MOST_AGAIN = 20.0


@helper
def _load(lane, run, b, runs):
    """Begin a run in a lane; one that follows another from its last state."""
    state, last = b.progress.state, runs.times.shape[1] - 1
    for row in range(len(b.parameters)):
        b.parameters[row, lane] = runs.parameters[run, row]
    for k in range(len(state)):
        if runs.follows[run] == 0:
            runs.states[run, 0, k] = runs.starts[run, arrays.LIMITS + run_arrays.NUMBERS + k]
        else:
            runs.states[run, 0, k] = runs.states[run - 1, last, k]
    for row in range(len(b.start)):
        b.start[row, lane] = runs.starts[run, row]
    for k in range(len(state)):
        state[k] = with_lane(state[k], lane, runs.states[run, 0, k])
    b.runs[lane], b.rows[lane] = run, 1
    b.counts[0, lane], b.counts[1, lane] = 0, 0
    b.fresh[0] |= 1 << lane


@routine
def _end(lane, status, b, runs):
    """Note how the run in a lane has ended; begin the one that follows, or free the lane."""
    run, going = b.runs[lane], True
    while going:
        runs.ends[run, arrays.STATUS], runs.ends[run, arrays.OUTPUTS] = status, b.rows[lane]
        runs.ends[run, arrays.STEPS] = b.counts[0, lane]
        runs.ends[run, arrays.REJECTIONS] = b.counts[1, lane]
        run += 1
        going = False
        if status == FINISHED and run < len(runs.follows) and runs.follows[run] != 0:
            _load(lane, run, b, runs)
            going = runs.times.shape[1] == 1
        else:
            b.runs[lane] = -1


@routine
def _fill(b, runs):
    """Give free lanes runs that wait; the lanes at work, one bit each."""
    active = 0
    for lane in range(WIDTH):
        while b.runs[lane] < 0 and runs.counts[TAKEN] < runs.counts[WAITING]:
            run = runs.queue[runs.counts[TAKEN]]
            runs.counts[TAKEN] += 1
            _load(lane, run, b, runs)
            if runs.times.shape[1] == 1:
                _end(lane, FINISHED, b, runs)
        if b.runs[lane] >= 0:
            active |= 1 << lane
    return active


@helper
def _take(where, values, out):
    """Fill the lanes of an array with values where the mask is true."""
    before = at_unknown_place(out)
    for k in range(len(values)):
        out[k] = select(where, values[k], before[k])


@helper
def _go_to_end(where, b):
    """Let the end of the step be where lanes are, rates, gradients and nodes known."""
    progress, w = b.progress, b.workspace
    _take(where, w.after, progress.state)
    _take(where, w.rate_after, progress.rate)
    there, here = w.gradients_after, progress.gradients
    for j in range(len(here.partial)):
        for row in range(here.partial.shape[1]):
            _take(where, there.partial[j, row], here.partial[j, row])
        if here.rates.shape[1] > 0:
            _take(where, there.force[j], here.force[j])
        for row in range(here.rates.shape[1]):
            _take(where, there.rates[j, row], here.rates[j, row])
    for row in range(2):
        _take(where, w.nodes[row], w.ends[row])
    n = len(progress.signs)
    for j in range(n):
        progress.signs[j] = select(where, sign_of(w.nodes[2, n + j]), progress.signs[j])


@routine
def _begin(b):
    """Rates, forces and first steps of lanes that have just been filled."""
    problem, progress, w = b.problem, b.progress, b.workspace
    numbers, new = progress.numbers, mask_of(b.fresh[0])
    for k in range(len(progress.state)):
        w.after[k] = progress.state[k]
    set_given(numbers[TIME], problem.system, w.given, w.load)
    b.limits[KNOWN] = numbers[TIME]
    set_end(problem, progress, w)
    _go_to_end(new, b)
    control = problem.control
    m, quickest = len(w.load), spread(1e-300)
    for i in range(m):
        quickest = max(abs(w.rate_after[m + i]) * control.largest[i], quickest)
    first = min(0.01 * control.longest, 0.1 * control.speed_scale / quickest)
    numbers[STEP] = select(new, first, numbers[STEP])
    b.fresh[0] = 0


@routine
def _next_step(b):
    """The step to try; it does not go past the end of a run.

    After one that has failed it ends at a kink of the forces that lies ahead.
    """
    problem, progress, w = b.problem, b.progress, b.workspace
    numbers = progress.numbers
    t, h, stop = numbers[TIME], numbers[STEP], b.limits[END]
    if somewhere(t != b.limits[KNOWN]):
        set_given(t, problem.system, w.given, w.load)
    b.limits[KNOWN] = t
    moved = motion_given(w.given)
    target = target_of(t, h, b.limits[EXACTLY] > 0.0, stop)
    limit, caution = numbers[CAUTIOUS], spread(0.0)
    if somewhere(limit > 0.0):
        reach = max(limit, target - t)
        kink = next_kink(moved, problem, progress, w.nodes, reach)
        cut = (limit > 0.0) & (kink > max(1e-3 * limit, 100.0 * b.limits[SMALLEST])) & (
            kink < 0.9 * reach)
        target = select(cut, min(stop, t + 1.0003 * kink), target)
        caution = select(cut, limit, 0.0)
        numbers[CAUTIOUS] = spread(0.0)
    return Step(t, target - t, target, target, moved, caution, False)


@routine
def _missed_part(lane, step, b, problem, progress, workspace):
    """Part of a lane's step to which it has to be shortened; 1 if none.

    By the functions for one run, on ``problem``, ``progress`` and ``workspace``, which take the
    lane's numbers; but ``problem.control.speed_scale`` is zero.
    """
    mine, w, s, control = b.progress, b.workspace, problem.system, problem.control
    again, smallest = lane_of(mine.numbers[MISSED], lane), lane_of(b.limits[SMALLEST], lane)
    if again >= _MOST_AGAIN:
        return 1.0
    for row in range(len(b.column)):
        b.column[row] = b.parameters[row, lane]
    for i in range(len(control.largest)):
        progress.extremes[i] = lane_of(mine.extremes[i], lane)
    progress.numbers[SPEED_SCALE] = max(lane_of(mine.numbers[SPEED_SCALE], lane),
                                        lane_of(b.problem.control.speed_scale, lane))
    for k in range(len(progress.state)):
        progress.state[k] = lane_of(mine.state[k], lane)
        workspace.after[k] = lane_of(w.after[k], lane)
        for row in range(3):
            workspace.dense[row, k] = lane_of(w.dense[row, k], lane)
    for j in range(w.nodes.shape[1]):
        for row in range(2):
            workspace.nodes[row, j] = lane_of(w.nodes[row, j], lane)
    moved = GroundMotion(lane_of(step.moved.travel, lane), lane_of(step.moved.speed, lane),
                         0.0, 0.0)
    t, h, target = lane_of(step.t, lane), lane_of(step.h, lane), lane_of(step.target, lane)
    set_polynomials(s, problem.blocks, control.ground, progress.state, workspace.after, workspace)
    if needs_search(moved, h, s, control.ground, control.levels, control.slip_scale, workspace):
        one = Step(t, h, target, target, moved, 0.0, False)
        part = first_missed_at(control.missed)(one, int(again), problem, progress, workspace)
        if part * h > 100.0 * smallest and part < 1.0:
            return part
    return 1.0


@routine
def _write_outputs(lane, step, b, runs):
    """Write the outputs of a lane up to the end of its step; whether they were the last."""
    progress, w = b.progress, b.workspace
    t, h, target = lane_of(step.t, lane), lane_of(step.h, lane), lane_of(step.target, lane)
    run, row, count = b.runs[lane], b.rows[lane], runs.times.shape[1]
    while row < count and runs.times[run, row] <= target:
        part = (runs.times[run, row] - t) / h
        for k in range(len(w.after)):
            runs.states[run, row, k] = lane_of(tableau.one_interpolated(
                part, k, progress.state, w.after, w.dense), lane)
        row += 1
    b.rows[lane] = row
    if row == count:
        return True
    b.limits[NEXT_OUTPUT] = with_lane(b.limits[NEXT_OUTPUT], lane, runs.times[run, row])
    return False


@helper
def _set_next(step, error, good, missed, part, b):
    """Lengths of the next steps: of lanes whose step was ``good``, missed something, or failed."""
    numbers, root = b.progress.numbers, root_of(error)
    failed = opposite(good | missed)
    step_before, root_before, rejected = (numbers[LAST_STEP], numbers[LAST_ROOT],
                                          numbers[REJECTED_LAST])
    longer = next_length(step.h, root, b.problem.control.longest, numbers)
    numbers[STEP] = select(good, longer, step.h * select(missed, part, growth(root)))
    numbers[LAST_STEP] = select(good, numbers[LAST_STEP], step_before)
    numbers[LAST_ROOT] = select(good, numbers[LAST_ROOT], root_before)
    numbers[REJECTED_LAST] = select(failed, 1.0, select(good, 0.0, rejected))
    after_failure = select(failed & opposite(step.caution > 0.0), step.h, 0.0)
    numbers[CAUTIOUS] = select(good, step.caution, after_failure)
    b.limits[EXACTLY] = select(missed, spread(1.0), 0.0)
    numbers[MISSED] = select(good, 0.0, select(missed, numbers[MISSED] + 1.0, numbers[MISSED]))


@helper
def _attempt(active, b, runs, problem, progress, workspace):
    """Try a step in all lanes."""
    mine, w = b.progress, b.workspace
    numbers, end = mine.numbers, b.limits[END]
    step = _next_step(b)
    G = 1.0 / (step.h * tableau.GAMMA)
    switched = solve(step, G, True, end, b.problem, mine, w)
    b.limits[KNOWN] = step.target
    error = error_at_end(step, end, b.problem, mine, w)
    passed = (error <= 1.0) & mask_of(active)
    tableau.dense_coefficients(w.stages, w.dense)
    part, missed = spread(1.0), mask_of(0)
    doubt = bits(passed & may_switch(step, b.problem, mine, w))
    if doubt != 0:
        for lane in range(WIDTH):
            if (doubt >> lane) & 1:
                part = with_lane(part, lane, _missed_part(lane, step, b, problem, progress,
                                                          workspace))
        missed = part < 1.0
    switched = (switched | switches(len(b.problem.system.gap), w.near.nodes, w.nodes[2],
                                    mine.signs)) & passed & opposite(missed)
    if somewhere(switched):
        found = switch_error(step, G, end, b.problem, mine, w)
        error = select(switched, max(found, error), error)
    good = passed & opposite(missed) & (error <= 1.0)
    outputs = bits(good & (b.limits[NEXT_OUTPUT] <= step.target))
    complete = 0
    if outputs != 0:
        for lane in range(WIDTH):
            if (outputs >> lane) & 1 and _write_outputs(lane, step, b, runs):
                complete |= 1 << lane
    _go_to_end(good, b)
    numbers[TIME] = select(good, step.target, step.t)
    _set_next(step, error, good, missed, part, b)
    hopeless = opposite(error < np.inf)
    if somewhere(hopeless):
        # Stages to come have no part in one, but are multiplied by zero.
        for i in range(tableau.STAGES):
            for k in range(len(w.after)):
                w.stages[i, k] = select(hopeless, 0.0, w.stages[i, k])
    going = good | missed | (numbers[STEP] >= b.limits[SMALLEST])
    stopped, accepted = active & bits(opposite(going)), bits(good)
    for lane in range(WIDTH):
        if (active >> lane) & 1:
            b.counts[1 - ((accepted >> lane) & 1), lane] += 1
        if (complete >> lane) & 1:
            _end(lane, FINISHED, b, runs)
        elif (stopped >> lane) & 1:
            _end(lane, MINIMUM_STEP if lane_of(error, lane) < np.inf else NOT_FINITE, b, runs)


def advance(
    b: arrays.Lanes, runs: arrays.Runs, problem: run_arrays.Problem,
    progress: run_arrays.Progress, workspace: run_arrays.Workspace, most: int,
) -> int:
    """Go on until ``most`` steps have been tried in all lanes; returns how it ended.

    ``problem``, ``progress`` and ``workspace`` are those of some run of the same kind, as room for
    checks of single lanes; the parameters of ``problem`` lie in ``b.column``. It is compiled for
    each size: ``SMALL``.
    """
    active = _fill(b, runs)
    for _ in range(most):
        if active != (1 << WIDTH) - 1:
            active = _fill(b, runs)
            if active == 0:
                return HUNGRY if runs.counts[OPEN] else DONE
            if active != (1 << WIDTH) - 1 and runs.counts[OPEN]:
                return HUNGRY
        if b.fresh[0] != 0:
            _begin(b)
        _attempt(active, b, runs, problem, progress, workspace)
        runs.counts[ATTEMPTS] += 1
        active = 0
        for lane in range(WIDTH):
            if b.runs[lane] >= 0:
                active |= 1 << lane
    return GOES_ON


# The arrays of the run that checks of single lanes are made with are among these.
SMALL = Sized(
    lambda given: kernel(advance, constants=given, nogil=True),
    (run_arrays.Problem, run_arrays.Progress, run_arrays.Workspace, arrays.Lanes, arrays.Runs),
    FEW)
