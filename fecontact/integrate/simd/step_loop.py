"""The compiled time integrator for many small runs: eight at once, one in each lane.

Every lane has its own time and step; all try a step together, and each goes on by the outcome of
its own. A lane whose run has ended takes the next one that waits. No lane has a part in what
another one computes, so that results do not depend on which runs are side by side.
"""

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.simd.functions import reciprocal_fifth_root
from fecontact.core.simd.vectors import (
    WIDTH,
    bits,
    magnitude,
    mask_of,
    read,
    select,
    spread,
    write,
)
from fecontact.integrate.polynomial_bounds import needs_search
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p.driver import SWITCH_PART as _SWITCH_PART
from fecontact.integrate.rodas5p.missed_contacts import first_missed_at
from fecontact.integrate.rodas5p.state import Step
from fecontact.integrate.simd import arrays, checks, equations, stages
from fecontact.integrate.simd.arrays import (
    AGAIN,
    ATTEMPTS,
    CAUTIOUS,
    END,
    EXACTLY,
    LAST_ROOT,
    LAST_STEP,
    LEAST_SPEED,
    LONGEST,
    NEXT_OUTPUT,
    OPEN,
    REJECTED_LAST,
    SMALLEST,
    SPEED_SCALE,
    STEP,
    TAKEN,
    TIME,
    WAITING,
)
from fecontact.integrate.small_systems import FEW, Sized
from fecontact.integrate.step_loop import FINISHED, MINIMUM_STEP, NOT_FINITE
from fecontact.integrate.step_polynomials import QUICKEST, set_polynomials
from fecontact.system.nodes import GroundMotion

# How a call returned: so many attempts were made, lanes are free that more runs may take, or all
# runs have ended.
GOES_ON, HUNGRY, DONE = range(3)

# Safety factor and limits of the ratio of steps, as in the step loop of one run.
_SAFETY, _SMALLEST_FACTOR, _LARGEST_FACTOR = 0.9, 0.1, 8.0
# Errors are counted as within these bounds, and as the third at least, for the length of a step.
_LEAST_ERROR, _LARGEST_ERROR = 1e-6, 1e10
_LARGEST_ROOT = 0.01**-0.2
_MOST_AGAIN = 20.0


@helper
def _load(lane, run, b, runs):
    """Begin a run in a lane; one that follows another from its last state."""
    for row in range(len(b.parameters)):
        b.parameters[row, lane] = runs.parameters[run, row]
    for row in range(len(b.start)):
        b.start[row, lane] = runs.starts[run, row]
    progress, last = b.progress, runs.times.shape[1] - 1
    for row in range(runs.states.shape[2]):
        if runs.follows[run] != 0:
            progress.state[row, lane] = runs.states[run - 1, last, row]
        runs.states[run, 0, row] = progress.state[row, lane]
    progress.runs[lane], progress.rows[lane] = run, 1
    progress.counts[0, lane], progress.counts[1, lane] = 0, 0
    progress.fresh[0] |= 1 << lane


@routine
def _end(lane, status, b, runs):
    """Note how the run in a lane has ended; begin the one that follows, or free the lane."""
    progress = b.progress
    run, going = progress.runs[lane], True
    while going:
        runs.ends[run, arrays.STATUS], runs.ends[run, arrays.OUTPUTS] = status, progress.rows[lane]
        runs.ends[run, arrays.STEPS] = progress.counts[0, lane]
        runs.ends[run, arrays.REJECTIONS] = progress.counts[1, lane]
        run += 1
        going = False
        if status == FINISHED and run < len(runs.follows) and runs.follows[run] != 0:
            _load(lane, run, b, runs)
            going = runs.times.shape[1] == 1
        else:
            progress.runs[lane] = -1


@routine
def _fill(b, runs):
    """Give free lanes runs that wait; the lanes at work, one bit each."""
    active = 0
    for lane in range(WIDTH):
        while b.progress.runs[lane] < 0 and runs.counts[TAKEN] < runs.counts[WAITING]:
            run = runs.queue[runs.counts[TAKEN]]
            runs.counts[TAKEN] += 1
            _load(lane, run, b, runs)
            if runs.times.shape[1] == 1:
                _end(lane, FINISHED, b, runs)
        if b.progress.runs[lane] >= 0:
            active |= 1 << lane
    return active


@helper
def _take(where, values, out):
    """Fill the lanes of a table with values where the mask is true."""
    for k in range(len(values)):
        write(out[k], select(where, read(values[k]), read(out[k])))


@routine
def _begin(b):
    """Rates, forces and first steps of lanes that have just been filled."""
    s, progress, w = b.system, b.progress, b.workspace
    t, new = read(progress.numbers[TIME]), mask_of(progress.fresh[0])
    equations.set_given(t, s, w.load)
    speed = equations.ground_speed(t, s)
    equations.set_rate_and_forces(progress.state, speed, s, w.load, w.places, w.speeds, w.forces,
                                  w.base)
    write(progress.ground, select(new, speed, read(progress.ground)))
    _take(new, w.base, progress.rate)
    _go_to_end(new, progress, w)
    m, quickest = len(w.load), spread(1e-300)
    for i in range(m):
        quickest = max(magnitude(read(w.base[m + i])) * read(b.control.largest[i]), quickest)
    limits, numbers = b.control.numbers, progress.numbers
    first = min(0.01 * read(limits[LONGEST]), 0.1 * read(limits[LEAST_SPEED]) / quickest)
    write(numbers[STEP], select(new, first, read(numbers[STEP])))
    progress.fresh[0] = 0


@helper
def _go_to_end(where, progress, w):
    """Take the nodes and forces in ``w`` for those of the state."""
    _take(where, w.places, progress.places)
    _take(where, w.speeds, progress.speeds)
    for j in range(len(w.forces)):
        _take(where, w.forces[j], progress.forces[j])


@helper
def _next_target(t, b):
    """End of the step to try, and the length of the step before, which failed, or zero."""
    progress, numbers = b.progress, b.progress.numbers
    h, stop = read(numbers[STEP]), read(numbers[END])
    target = t + h
    near = select(target + 0.01 * h >= stop, stop,
                  select(target + h > stop, t + 0.5 * (stop - t), target))
    target = select(read(numbers[EXACTLY]) > 0.0, min(stop, target), near)
    limit = read(numbers[CAUTIOUS])
    careful = limit > 0.0
    caution = spread(0.0)
    if bits(careful) != 0:
        reach = max(limit, target - t)
        kink = checks.next_kink(b.system, b.control, progress, reach)
        cut = careful & (kink > 1e-3 * limit) & (kink < 0.9 * reach)
        target = select(cut, min(stop, t + 1.0003 * kink), target)
        caution = select(cut, limit, 0.0)
        write(numbers[CAUTIOUS], spread(0.0))
    return target, caution


@routine
def _missed_part(lane, t, h, target, b, problem, progress, workspace):
    """Part of a lane's step to which it has to be shortened; 1 if none.

    By the functions for one run, on ``problem``, ``progress`` and ``workspace``, which take the
    lane's numbers; but ``problem.control.speed_scale`` is zero.
    """
    mine, w, s, control = b.progress, b.workspace, problem.system, problem.control
    again, smallest = mine.numbers[AGAIN, lane], mine.numbers[SMALLEST, lane]
    if again >= _MOST_AGAIN:
        return 1.0
    n, _, m = s.rows.shape
    for j in range(n):
        s.gap[j], s.sliding[j, 0, 0] = b.system.gap[j, lane], b.system.sliding[j, 0, 0, lane]
        control.slip_scale[j] = b.control.slip_scale[j, lane]
        for level in range(len(control.levels)):
            control.levels[level, j] = b.control.levels[level, j, lane]
        for k in range(s.normal_parameters.shape[1]):
            s.normal_parameters[j, k] = b.system.normal_parameters[j, k, lane]
        for k in range(s.friction_parameters.shape[1]):
            s.friction_parameters[j, k] = b.system.friction_parameters[j, k, lane]
        for i in range(m):
            problem.blocks.shapes[i, j] = b.system.rows[j, 0, i, lane]
            problem.blocks.shapes[i, n + j] = b.system.rows[j, 1, i, lane]
    for k in range(len(s.ground_motion_parameters)):
        s.ground_motion_parameters[k] = b.system.ground_motion_parameters[k, lane]
    for i in range(m):
        control.displacement_scale[i] = b.control.displacement_scale[i, lane]
        control.largest[i] = b.control.largest[i, lane]
        progress.extremes[i] = mine.extremes[i, lane]
    progress.numbers[run_arrays.SPEED_SCALE] = max(
        mine.numbers[SPEED_SCALE, lane], b.control.numbers[LEAST_SPEED, lane])
    control.ground[QUICKEST] = b.control.numbers[arrays.QUICKEST, lane]
    for k in range(2 * m):
        progress.state[k], workspace.after[k] = mine.state[k, lane], w.after[k, lane]
        for row in range(3):
            workspace.dense[row, k] = w.dense[row, k, lane]
    for j in range(2 * n):
        workspace.nodes[0, j], workspace.nodes[1, j] = w.places[j, lane], w.speeds[j, lane]
    moved = GroundMotion(0.0, mine.ground[lane], 0.0, 0.0)
    set_polynomials(s, problem.blocks, control.ground, progress.state, workspace.after, workspace)
    if needs_search(moved, h, s, control.ground, control.levels, control.slip_scale, workspace):
        one = Step(t, h, target, target, moved, 0.0, False)
        part = first_missed_at(control.missed)(one, int(again), problem, progress, workspace)
        if part * h > 100.0 * smallest and part < 1.0:
            return part
    return 1.0


@routine
def _write_outputs(lane, t, h, target, b, runs):
    """Write the outputs of a lane up to the end of its step; whether they were the last."""
    progress, w = b.progress, b.workspace
    run, row, count = progress.runs[lane], progress.rows[lane], runs.times.shape[1]
    while row < count and runs.times[run, row] <= target:
        part = (runs.times[run, row] - t) / h
        for k in range(len(w.after)):
            runs.states[run, row, k] = (1.0 - part) * progress.state[k, lane] + part * (
                w.after[k, lane] + (1.0 - part) * (w.dense[0, k, lane] + part * (
                    w.dense[1, k, lane] + part * w.dense[2, k, lane])))
        row += 1
    progress.rows[lane] = row
    if row == count:
        return True
    progress.numbers[NEXT_OUTPUT, lane] = runs.times[run, row]
    return False


@helper
def _set_next(h, error, caution, good, missed, part, b):
    """Lengths of the next steps: of lanes whose step was ``good``, missed something, or failed."""
    numbers = b.progress.numbers
    bounded = min(spread(_LARGEST_ERROR), max(_LEAST_ERROR, error))
    root = reciprocal_fifth_root(bounded)
    factor = min(spread(_LARGEST_FACTOR), max(_SMALLEST_FACTOR, _SAFETY * root))
    last, last_root = read(numbers[LAST_STEP]), read(numbers[LAST_ROOT])
    # Steps that had to shrink will have to shrink on (predictive control, Gustafsson).
    predicted = min(factor * (h / last) * (root / last_root), factor)
    grown = select(last > 0.0, max(_SMALLEST_FACTOR, predicted), factor)
    grown = select(read(numbers[REJECTED_LAST]) > 0.0, min(spread(1.0), grown), grown)
    longer = min(read(b.control.numbers[LONGEST]), h * grown)
    failed = ~(good | missed)
    write(numbers[STEP], select(good, longer, h * select(missed, part, factor)))
    write(numbers[LAST_STEP], select(good, h, last))
    write(numbers[LAST_ROOT], select(good, min(spread(_LARGEST_ROOT), root),
                                     last_root))
    write(numbers[REJECTED_LAST],
          select(failed, 1.0, select(good, 0.0, read(numbers[REJECTED_LAST]))))
    after_failure = select(failed & ~(caution > 0.0), h, 0.0)
    write(numbers[CAUTIOUS], select(good, caution, after_failure))
    write(numbers[EXACTLY], select(missed, spread(1.0), 0.0))
    write(numbers[AGAIN], select(good, 0.0, select(missed, read(numbers[AGAIN]) + 1.0,
                                                   read(numbers[AGAIN]))))


@helper
def _attempt(active, b, runs, problem, progress, workspace):
    """Try a step in all lanes."""
    s, control, mine, w = b.system, b.control, b.progress, b.workspace
    numbers = mine.numbers
    t = read(numbers[TIME])
    checks.note_extremes(control, mine)
    target, caution = _next_target(t, b)
    h = target - t
    speed, switched = stages.step(t, h, target, s, mine, w)
    equations.set_rate_and_forces(w.after, speed, s, w.load, w.places, w.speeds, w.forces, w.base)
    error = checks.state_error(control, mine, w)
    error = select(error <= 1.0, checks.slip_error(error, speed, s, control, w), error)
    passed = (error <= 1.0) & mask_of(active)
    stages.set_dense(w)
    part, missed = spread(1.0), mask_of(0)
    doubt = bits(passed & checks.may_switch(h, s, control, mine, w))
    if doubt != 0:
        write(w.work[0, 0], t)
        write(w.right[0], h)
        write(w.right[1], target)
        for lane in range(WIDTH):
            w.stage[0, lane] = 1.0
            if (doubt >> lane) & 1:
                w.stage[0, lane] = _missed_part(lane, w.work[0, 0, lane], w.right[0, lane],
                                                w.right[1, lane], b, problem, progress, workspace)
        part = read(w.stage[0])
        missed = part < 1.0
    switched = (switched | equations.switches(w.forces, mine.forces)) & passed & ~missed
    if bits(switched) != 0:
        stages.set_defect(t, h, s, mine, w)
        found = checks.modal_error(w.stages[0], control, mine, w) / _SWITCH_PART
        error = select(switched, max(found, error), error)
    good = passed & ~missed & (error <= 1.0)
    outputs = bits(good & (read(numbers[NEXT_OUTPUT]) <= target))
    complete = 0
    if outputs != 0:
        write(w.work[0, 0], t)
        write(w.right[0], h)
        write(w.right[1], target)
        for lane in range(WIDTH):
            if (outputs >> lane) & 1 and _write_outputs(
                    lane, w.work[0, 0, lane], w.right[0, lane], w.right[1, lane], b, runs):
                complete |= 1 << lane
    _take(good, w.after, mine.state)
    _take(good, w.base, mine.rate)
    _go_to_end(good, mine, w)
    write(mine.ground, select(good, speed, read(mine.ground)))
    write(numbers[TIME], select(good, target, t))
    _set_next(h, error, caution, good, missed, part, b)
    stopped = active & bits(~(good | missed) & ~(read(numbers[STEP]) >= read(numbers[SMALLEST])))
    accepted = bits(good)
    for lane in range(WIDTH):
        if (active >> lane) & 1:
            mine.counts[1 - ((accepted >> lane) & 1), lane] += 1
    if complete | stopped:
        write(w.stage[0], error)
        for lane in range(WIDTH):
            if (complete >> lane) & 1:
                _end(lane, FINISHED, b, runs)
            elif (stopped >> lane) & 1:
                _end(lane, MINIMUM_STEP if w.stage[0, lane] < np.inf else NOT_FINITE, b, runs)


def advance(
    b: arrays.Lanes, runs: arrays.LaneRuns, problem: run_arrays.Problem,
    progress: run_arrays.Progress, workspace: run_arrays.Workspace, most: int,
) -> int:
    """Go on until ``most`` steps have been tried in all lanes; returns how it ended.

    ``problem``, ``progress`` and ``workspace`` are those of some run of the same kind, as room for
    checks of single lanes. It is compiled for each size: ``SMALL``.
    """
    active = _fill(b, runs)
    for _ in range(most):
        if active != (1 << WIDTH) - 1:
            active = _fill(b, runs)
            if active == 0:
                return HUNGRY if runs.counts[OPEN] else DONE
            if active != (1 << WIDTH) - 1 and runs.counts[OPEN]:
                return HUNGRY
        if b.progress.fresh[0] != 0:
            _begin(b)
        _attempt(active, b, runs, problem, progress, workspace)
        runs.counts[ATTEMPTS] += 1
        active = 0
        for lane in range(WIDTH):
            if b.progress.runs[lane] >= 0:
                active |= 1 << lane
    return GOES_ON


# The arrays of the run that checks of single lanes are made with are among these.
SMALL = Sized(
    lambda given: kernel(advance, constants=given, nogil=True),
    (run_arrays.Problem, run_arrays.Progress, run_arrays.Workspace, arrays.LaneSystem,
     arrays.LaneControl, arrays.LaneProgress, arrays.LaneWorkspace, arrays.LaneRuns), FEW)
