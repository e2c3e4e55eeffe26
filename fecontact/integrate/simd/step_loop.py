"""The compiled time integrator for many small runs: eight at once, one in each lane.

Every lane has its own time and step; all try a step together, and each goes on by the outcome of
its own. A lane whose run has ended takes the next one that waits. No lane has a part in what
another one computes, so that results do not depend on which runs are side by side.

Stages, errors and checks are those of single runs, :mod:`fecontact.integrate.rodas5p.method`,
with eight numbers in place of each.
"""

from functools import partial
from typing import Any

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.simd.functions import at_unknown_place, lane_of, with_lane
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import bits, mask_of, opposite, select, somewhere, spread
from fecontact.integrate.near_nodes import set_end
from fecontact.integrate.polynomial_bounds import may_switch, needs_search
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.rodas5p.dynamics import set_given
from fecontact.integrate.rodas5p.error_control import passes_corner, sign_of, switches
from fecontact.integrate.rodas5p.kinks import caution_after_failure, up_to_kink
from fecontact.integrate.rodas5p.method import error_at_end, solve, switch_error
from fecontact.integrate.rodas5p.missed_contacts import first_missed_at
from fecontact.integrate.rodas5p.sliders import (
    BEGIN,
    OUTPUT,
    SWITCH,
    attend_at,
    touched,
)
from fecontact.integrate.rodas5p.sliders import (
    may_switch as sliders_may_switch,
)
from fecontact.integrate.rodas5p.state import CAUTIOUS, MISSED, SPEED_SCALE, Step
from fecontact.integrate.rodas5p.step_length import (
    LAST_ROOT,
    LAST_STEP,
    REJECTED_LAST,
    growth,
    length_beyond,
    root_of,
    target_of,
)
from fecontact.integrate.simd import arrays
from fecontact.integrate.simd.arrays import (
    ATTEMPTS,
    END,
    KNOWN,
    NEXT_OUTPUT,
    OPEN,
    OUTCOME,
    SMALLEST,
    TAKEN,
    WAITING,
)
from fecontact.integrate.small_systems import FEW, Sized
from fecontact.integrate.step_loop import (
    ANEW,
    CUT,
    FAILED,
    FINISHED,
    MINIMUM_STEP,
    NOT_FINITE,
    STEP,
    TIME,
)
from fecontact.integrate.step_loop import TAKEN as ACCEPTED
from fecontact.integrate.step_polynomials import set_polynomials
from fecontact.system.nodes import GroundMotion, ground_motion

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
    anew = (t != b.limits[KNOWN]) | (numbers[CAUTIOUS] != 0.0)
    moved = ground_motion(t, problem.system)
    target = target_of(t, h, b.limits[OUTCOME] == float(CUT), stop)
    target, caution = up_to_kink(t, target, stop, b.limits[SMALLEST], moved, problem, progress, w)
    if somewhere(anew):
        set_given(t, problem.system, w.given, w.load)
    b.limits[KNOWN] = t
    return Step(t, target - t, target, target, moved, caution, False)


@routine
def _take_out(lane, step, b, spare):
    """Let a run alone take the parameters, state and step of a lane; the step."""
    mine, w = b.progress, b.workspace
    progress, workspace = spare.progress, spare.workspace
    for row in range(len(b.column)):
        b.column[row] = b.parameters[row, lane]
    for i in range(len(progress.extremes)):
        progress.extremes[i] = lane_of(mine.extremes[i], lane)
    for k in range(len(progress.numbers)):
        progress.numbers[k] = lane_of(mine.numbers[k], lane)
    progress.numbers[SPEED_SCALE] = max(progress.numbers[SPEED_SCALE],
                                        lane_of(b.problem.control.speed_scale, lane))
    for k in range(len(progress.state)):
        progress.state[k] = lane_of(mine.state[k], lane)
        progress.rate[k] = lane_of(mine.rate[k], lane)
        workspace.after[k] = lane_of(w.after[k], lane)
        for row in range(3):
            workspace.dense[row, k] = lane_of(w.dense[row, k], lane)
    for j in range(w.nodes.shape[1]):
        for row in range(2):
            workspace.nodes[row, j] = lane_of(w.nodes[row, j], lane)
    moved = GroundMotion(lane_of(step.moved.travel, lane), lane_of(step.moved.speed, lane),
                         0.0, 0.0)
    t, h, target = lane_of(step.t, lane), lane_of(step.h, lane), lane_of(step.target, lane)
    return Step(t, h, target, target, moved, 0.0, False)


@routine
def _put_back(lane, b, spare):
    """Let a lane take the state of the run alone, its rates and gradients."""
    mine, progress = b.progress, spare.progress
    for k in range(len(progress.state)):
        mine.state[k] = with_lane(mine.state[k], lane, progress.state[k])
        mine.rate[k] = with_lane(mine.rate[k], lane, progress.rate[k])
    there, here = mine.gradients, progress.gradients
    for j in range(len(here.partial)):
        for row in range(here.partial.shape[1]):
            for k in range(here.partial.shape[2]):
                there.partial[j, row, k] = with_lane(there.partial[j, row, k], lane,
                                                     here.partial[j, row, k])
        for k in range(here.force.shape[1]):
            there.force[j, k] = with_lane(there.force[j, k], lane, here.force[j, k])
        for row in range(here.rates.shape[1]):
            for k in range(here.rates.shape[2]):
                there.rates[j, row, k] = with_lane(there.rates[j, row, k], lane,
                                                   here.rates[j, row, k])


@routine
def _missed_part(lane, step, b, spare):
    """Part of a lane's step to which it has to be shortened; 1 if none."""
    again, smallest = lane_of(b.progress.numbers[MISSED], lane), lane_of(b.limits[SMALLEST], lane)
    if again >= _MOST_AGAIN:
        return 1.0
    one = _take_out(lane, step, b, spare)
    problem, progress, workspace = spare.problem, spare.progress, spare.workspace
    s, control = problem.system, problem.control
    set_polynomials(s, problem.blocks, control.ground, progress.state, workspace.after, workspace)
    if needs_search(one.moved, one.h, s, control.ground, control.levels, control.slip_scale,
                    workspace):
        part = first_missed_at(control.missed)(one, int(again), problem, progress, workspace)
        if part * one.h > 100.0 * smallest and part < 1.0:
            return part
    return 1.0


@routine
def _attend(kind, lane, step, b, spare):
    """Attend to elastic Coulomb elements in a lane, as ``attend`` in a run.

    Where it returns 0, the state at the begin of the step has changed.
    """
    one = _take_out(lane, step, b, spare)
    problem, progress, workspace = spare.problem, spare.progress, spare.workspace
    part = attend_at(problem.control.sliders)(kind, one, problem, progress, workspace, spare.vary,
                                              one.t, workspace.right)
    if part == 0.0:
        _put_back(lane, b, spare)
    return part


@routine
def _write_outputs(lane, step, b, runs, spare):
    """Write the outputs of a lane up to the end of its step; whether they were the last."""
    progress, w = b.progress, b.workspace
    t, h, target = lane_of(step.t, lane), lane_of(step.h, lane), lane_of(step.target, lane)
    run, row, count = b.runs[lane], b.rows[lane], runs.times.shape[1]
    while row < count and runs.times[run, row] <= target:
        part = (runs.times[run, row] - t) / h
        for k in range(len(w.after)):
            runs.states[run, row, k] = lane_of(tableau.one_interpolated(
                part, k, progress.state, w.after, w.dense), lane)
        if spare.problem.control.sliders != 0:
            one = _take_out(lane, step, b, spare)
            attend_at(spare.problem.control.sliders)(
                OUTPUT, one, spare.problem, spare.progress, spare.workspace, spare.vary,
                runs.times[run, row], runs.states[run, row])
        row += 1
    b.rows[lane] = row
    if row == count:
        return True
    b.limits[NEXT_OUTPUT] = with_lane(b.limits[NEXT_OUTPUT], lane, runs.times[run, row])
    return False


@helper
def _set_next(step, error, good, missed, again, part, b):
    """Lengths of the next steps: of lanes whose step was ``good``, missed something, or failed.

    Those that are tried ``again``, as something was missed or for their elements, go on with a
    ``part`` of the step.
    """
    numbers, root = b.progress.numbers, root_of(error)
    failed = opposite(good | again)
    step_before, root_before, rejected = (numbers[LAST_STEP], numbers[LAST_ROOT],
                                          numbers[REJECTED_LAST])
    longer = length_beyond(step.caution, step.h, root, b.problem.control.longest, numbers)
    numbers[STEP] = select(good, longer, step.h * select(again, part, growth(root)))
    numbers[LAST_STEP] = select(good, numbers[LAST_STEP], step_before)
    numbers[LAST_ROOT] = select(good, numbers[LAST_ROOT], root_before)
    numbers[REJECTED_LAST] = select(failed, 1.0, select(good, 0.0, rejected))
    numbers[CAUTIOUS] = select(good, step.caution, select(failed, caution_after_failure(step), 0.0))
    b.limits[OUTCOME] = select(good, float(ACCEPTED), select(again, select(
        part < 1.0, float(CUT), float(ANEW)), float(FAILED)))
    numbers[MISSED] = select(good, 0.0, select(missed, numbers[MISSED] + 1.0, numbers[MISSED]))


@helper
def _nothing(active, step, b, spare):
    """Nothing is to be done at the begin of a step."""


@helper
def _parts_below_one(good, part, step, b, spare):
    """Lanes whose steps are shortened, and to which part."""
    return part < 1.0, part


@helper
def _begin_sliders(active, step, b, spare):
    """Set the deflections of contacts that closed at the end of the last step."""
    begun = b.limits[OUTCOME] == float(ACCEPTED)
    closed = active & bits(begun & touched(step, b.problem, b.progress, b.workspace))
    for lane in range(WIDTH):
        if (closed >> lane) & 1:
            _attend(BEGIN, lane, step, b, spare)


@helper
def _switch_sliders(good, part, step, b, spare):
    """Lanes whose steps are tried again, the whole of it or a part, as slip begins or ends."""
    doubt, anew = bits(good & sliders_may_switch(step, b.problem, b.progress, b.workspace)), 0
    for lane in range(WIDTH):
        if (doubt >> lane) & 1:
            found = _attend(SWITCH, lane, step, b, spare)
            part = with_lane(part, lane, found)
            anew |= int(found == 0.0) << lane
    return part < 1.0, select(mask_of(anew), 1.0, part)


@helper
def _attempt(active, b, runs, spare, begin, switch):
    """Try a step in all lanes; ``begin`` and ``switch`` attend to elastic Coulomb elements."""
    mine, w = b.progress, b.workspace
    numbers, end = mine.numbers, b.limits[END]
    step = _next_step(b)
    G = 1.0 / (step.h * tableau.GAMMA)
    begin(active, step, b, spare)
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
                part = with_lane(part, lane, _missed_part(lane, step, b, spare))
        missed = part < 1.0
    switched = (switched | switches(len(b.problem.system.gap), w.near.nodes, w.nodes[2], mine.signs)
                | passes_corner(b.problem.control, b.problem.system, w)) & passed & opposite(missed)
    if somewhere(switched):
        found = switch_error(step, G, end, b.problem, mine, w)
        error = select(switched, max(found, error), error)
    good = passed & opposite(missed) & (error <= 1.0)
    again, part = switch(good, part, step, b, spare)
    good = good & opposite(again)
    outputs = bits(good & (b.limits[NEXT_OUTPUT] <= step.target))
    complete = 0
    if outputs != 0:
        for lane in range(WIDTH):
            if (outputs >> lane) & 1 and _write_outputs(lane, step, b, runs, spare):
                complete |= 1 << lane
    _go_to_end(good, b)
    numbers[TIME] = select(good, step.target, step.t)
    _set_next(step, error, good, missed, again, part, b)
    hopeless = opposite(error < np.inf)
    if somewhere(hopeless):
        # Stages to come have no part in one, but are multiplied by zero.
        for i in range(tableau.STAGES):
            for k in range(len(w.after)):
                w.stages[i, k] = select(hopeless, 0.0, w.stages[i, k])
    going = good | again | (numbers[STEP] >= b.limits[SMALLEST])
    stopped, accepted = active & bits(opposite(going)), bits(good)
    for lane in range(WIDTH):
        if (active >> lane) & 1:
            b.counts[1 - ((accepted >> lane) & 1), lane] += 1
        if (complete >> lane) & 1:
            _end(lane, FINISHED, b, runs)
        elif (stopped >> lane) & 1:
            _end(lane, MINIMUM_STEP if lane_of(error, lane) < np.inf else NOT_FINITE, b, runs)


def _loop(begin: Any, switch: Any, constants: str) -> Any:
    """The compiled loop ``advance(b, runs, spare, most)``, with what attends to elements.

    It goes on until ``most`` steps have been tried in all lanes, and returns how it ended.
    """

    def advance(b, runs, spare, most):
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
            _attempt(active, b, runs, spare, begin, switch)
            runs.counts[ATTEMPTS] += 1
            active = 0
            for lane in range(WIDTH):
                if b.runs[lane] >= 0:
                    active |= 1 << lane
        return GOES_ON

    advance.__annotations__ = {"b": arrays.Lanes, "runs": arrays.Runs, "spare": arrays.Alone,
                               "most": int, "return": int}
    return kernel(advance, constants=constants, nogil=True)


_RECORDS = (run_arrays.Problem, run_arrays.Progress, run_arrays.Workspace, arrays.Lanes,
            arrays.Runs, arrays.Alone)
# The arrays of the run that checks of single lanes are made with are among these.
SMALL = Sized(partial(_loop, _nothing, _parts_below_one), _RECORDS, FEW)
WITH_SLIDERS = Sized(partial(_loop, _begin_sliders, _switch_sliders), _RECORDS, FEW, sliders=True)
