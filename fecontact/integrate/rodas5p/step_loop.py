"""The compiled time integrator: Rodas5P steps of variable size over given output times."""

import numpy as np
from numba import types

from fecontact.core.compiled import block, borrowed, f8, helper, i8, kernel, matrix, vector
from fecontact.integrate.courses import doubtful, keep_ends, restless, set_courses, set_ends
from fecontact.integrate.rodas5p import dynamics, stage_solver, state, tableau
from fecontact.integrate.rodas5p.error_control import (
    add_up,
    energy_scale,
    set_scale,
    slip_error,
    state_error,
    work_error,
    work_until,
)
from fecontact.integrate.rodas5p.event_kernels import (
    KINKS,
    NODES,
    WATCH,
    begin,
    full,
    next_switch,
    note_events_at,
)
from fecontact.integrate.rodas5p.state import (
    CAUTIOUS,
    LAST_ERROR,
    LAST_STEP,
    OUTPUTS,
    RATES,
    REJECTED_LAST,
    REJECTIONS,
    SPEED_SCALE,
    STARTED,
    STEP,
    STEPS,
    TIME,
)
from fecontact.integrate.rodas5p.unfelt import first_unfelt_at
from fecontact.integrate.rodas5p.variational import VARIATION, begin_anew, keep, propagate
from fecontact.laws.signatures import signal_at
from fecontact.system.kernels import SYSTEM, drive_jump, powers

RUNNING, FINISHED, MINIMUM_STEP, NOT_FINITE, STOPPED = range(5)

_SAFETY, _SMALLEST_FACTOR, _LARGEST_FACTOR = 0.9, 0.1, 8.0
_POWER = -1.0 / tableau.ORDER
# Attempts at a step that end where something was not felt.
_MOST_AGAIN = 20


@helper
def _linearise(t, after_t, h, latest, s, shapes, control, progress, room):
    """What a step needs of the derivatives at its start besides the matrices."""
    m = len(control.largest)
    later = min(t + 1e-4 * h, latest)
    acceleration = 0.0
    if later > t:
        speed = signal_at(s.ground_motion)(later, s.ground_motion_parameters)[1]
        acceleration = (speed - room.given[dynamics.SPEED]) / (later - t)
    for i in range(m):
        room.pull_rate[i] = 0.0
    for k in range(len(s.load)):
        rate = signal_at(s.load[k])(after_t, s.load_parameters[k])[1]
        for i in range(m):
            room.pull_rate[i] += rate * s.load_shapes[k, i]
    dynamics.set_time_rate(s, shapes, room.given, acceleration, progress.gradients, room.pull_rate,
                           room.nodes, room.time_rate)
    for i in range(m):
        progress.extremes[i] = max(progress.extremes[i], abs(progress.state[i]))
        speed = abs(progress.state[m + i]) * control.largest[i]
        progress.numbers[SPEED_SCALE] = max(progress.numbers[SPEED_SCALE], speed)


@helper
def _stages(t, h, latest, G, s, shapes, progress, room):
    """All stages of a step, and its end in ``room.after``."""
    size = len(progress.state)
    m = len(room.pull)
    last = t
    for i in range(tableau.STAGES):
        if i == 0:
            for k in range(size):
                room.right[k] = progress.rate[k]
        else:
            tableau.combined(tableau.A[i], 1.0, progress.state, room.stages, room.stage)
            now = min(t + tableau.NODES[i] * h, latest)
            if now != last:
                dynamics.set_given(now, s, room.given, room.pull)
                last = now
            dynamics.set_rate(room.stage, s, shapes, room.given, room.pull, room.nodes,
                              room.scratch, room.base)
            tableau.combined(tableau.C[i], 1.0 / h, room.base, room.stages, room.right)
        factor = tableau.TIME[i] * h
        if factor != 0.0:
            for k in range(m, size):
                room.right[k] += factor * room.time_rate[k]
        stage_solver.solve_stage(G, s, shapes, progress.gradients, room.reduced, room.right,
                                 room.nodes, room.stages[i])
    for k in range(size):
        room.after[k] = room.stage[k] + room.stages[tableau.STAGES - 1, k]


@helper
def _go_on(progress, room):
    """Make the end of the step the state of the run."""
    for k in range(len(progress.state)):
        progress.state[k] = room.after[k]
        progress.rate[k] = room.rate_after[k]
    here, there = progress.gradients, room.gradients_after
    n, states, width = here.rates.shape
    for j in range(n):
        for row in range(3):
            for k in range(4):
                here.partial[j, row, k] = there.partial[j, row, k]
        for k in range(width):
            here.force[j, k] = there.force[j, k]
            for row in range(states):
                here.rates[j, row, k] = there.rates[j, row, k]


@kernel(types.i8(SYSTEM, matrix, vector, state.CONTROL, state.PROGRESS, state.ROOM,
                 i8, matrix, matrix, SYSTEM, SYSTEM, f8, VARIATION, block, WATCH),
        nogil=True)
def advance(
    held_system, held_shapes, held_times, held_control, held_progress, held_room, most, held_out,
    held_work, held_above, held_below, width, held_variation, held_transitions, held_watch,
):
    """Go on until ``most`` steps have been tried and one accepted; returns how it ended.

    Fills the rows of ``out`` (N, size) and ``work`` (N, 8 + n) that belong to the output times
    passed. A run that is continued gives the same numbers as one that was not interrupted.

    If the columns of ``variation`` are not empty, those that belong to each output time are put
    into ``transitions`` (N, k, size), and begin anew there; the output times must then be breaks.
    See :func:`fecontact.integrate.rodas5p.variational.propagate` for ``above``, ``below`` and
    ``width``. What is watched for is noted in ``watch``; when that is full, the call returns.
    """
    s, shapes, times = borrowed(held_system), borrowed(held_shapes), borrowed(held_times)
    control, progress, room = borrowed(held_control), borrowed(held_progress), borrowed(held_room)
    out, work, watch = borrowed(held_out), borrowed(held_work), borrowed(held_watch)
    above, below, variation = borrowed(held_above), borrowed(held_below), borrowed(held_variation)
    transitions, columns = borrowed(held_transitions), variation.columns
    watched = watch.counts[NODES] != 0 or len(watch.own) > 0
    numbers, counts = progress.numbers, progress.counts
    size = len(progress.state)
    memory = size > 2 * len(control.largest)
    t, h = numbers[TIME], numbers[STEP]
    end = times[-1]
    smallest = 1e-14 * max(abs(times[0]), abs(end))
    if counts[STARTED] == 0:
        dynamics.set_given(t, s, room.given, room.pull)
        dynamics.set_rate_and_gradients(progress.state, s, shapes, room.given, room.pull,
                                        room.nodes, progress.gradients, progress.rate)
        if control.work:
            powers(t, progress.state, s, progress.power[:8], progress.power[8:])
        if watched or watch.counts[KINKS]:
            begin(t, progress.state, s, control.depth, watch, room.scratch)
        for k in range(size):
            out[0, k] = progress.state[k]
        counts[STARTED], counts[OUTPUTS] = 1, 1
    set_ends(t, progress.state, s, shapes, control.ground, room.ends)
    new, speed, attempts, to_switch, again = True, 0.0, 0, False, 0
    while counts[OUTPUTS] < len(times):
        # A step that failed is repeated before the call returns: derivatives are not kept.
        if new and (attempts >= most or (watched and full(watch))):
            break
        attempts += 1
        # The end, or the next break; that is approached from below.
        stop, is_break = end, False
        for k in range(len(control.breaks)):
            if t < control.breaks[k] < stop:
                stop, is_break = control.breaks[k], True
        latest = np.nextafter(stop, t) if is_break else stop
        target = t + h
        if to_switch:
            target = min(target, stop)
        elif target + 0.01 * h >= stop:
            target = stop
        elif target + h > stop:
            target = t + 0.5 * (stop - t)
        if new:
            # Rates just after t: they may jump at a break.
            dynamics.set_given(np.nextafter(t, end), s, room.given, room.pull)
            speed = room.given[dynamics.SPEED]
        limited, caution = False, numbers[CAUTIOUS]
        if caution > 0.0:
            reach = max(target - t, caution)
            kink = dynamics.next_kink(progress.state, progress.rate, s, shapes, progress.gradients,
                                      control.depth, control.slow, speed, room.nodes, reach)
            # Nearer ones are left to the error control, lest steps shrink without end.
            if 1e-3 * caution < kink < 0.9 * reach:
                # Rather a little too far than too short.
                target = min(t + 1.0003 * kink, stop)
                limited = True
            numbers[CAUTIOUS] = 0.0
        h = target - t

        G = 1.0 / (h * tableau.GAMMA)
        if new:
            _linearise(t, np.nextafter(t, end), h, latest, s, shapes, control, progress, room)
        if memory:
            stage_solver.eliminate_memory(G, s, progress.gradients, room.reduced)
        if new or memory:
            stage_solver.assemble(s, shapes, progress.gradients, room.reduced)
        new = False
        stage_solver.factorise_step(G, room.reduced)
        _stages(t, h, latest, G, s, shapes, progress, room)
        counts[RATES] += tableau.STAGES
        error = state_error(control, progress, room)
        if error <= 1.0:
            if is_break and target == stop:
                dynamics.set_given(np.nextafter(stop, end), s, room.given, room.pull)
            dynamics.set_rate_and_gradients(room.after, s, shapes, room.given, room.pull,
                                            room.nodes, room.gradients_after, room.rate_after)
            error = slip_error(error, s, shapes, control, progress, room)
        if error <= 1.0:
            tableau.dense_coefficients(room.stages, room.dense)
            if restless(speed, h, s, shapes, control, room) and again < _MOST_AGAIN:
                set_courses(s, shapes, control.ground, progress.state, room.after, room)
                if doubtful(speed, h, control.ground, control.levels, control.slip_scale, room):
                    part = first_unfelt_at(control.unfelt)(
                        t, h, latest, again, s, shapes, control, progress, room)
                    if part * h > 100.0 * smallest and part < 1.0:
                        counts[REJECTIONS] += 1
                        h *= part
                        to_switch = True
                        again += 1
                        continue
            if control.work:
                add_up(t, h, latest, s, progress, room)
                error = max(error, work_error(h, room.power) / (
                    control.rtol * energy_scale(control, progress, room)))

        if error <= 1.0 and watch.counts[KINKS]:
            part = next_switch(t, h, latest, s, control.depth, watch, room.scratch, progress.state,
                               room.after, room.dense, room.right)
            # Nearer to an end it is at that end, as far as the time can tell.
            near = max(1e-6 * h, 100.0 * smallest)
            if part * h > near and (1.0 - part) * h > near:
                counts[REJECTIONS] += 1
                h *= part * (1.0 + 1e-9)
                to_switch = True
                continue
        to_switch = False
        if error <= 1.0 and len(columns):
            set_scale(control, progress, room)
            error = max(error, propagate(
                t, h, latest, G, s, above, below, width, shapes, control.slip_scale, control.depth,
                control.memory_scale, progress.state, progress.gradients, room.reduced,
                room.stages, room.right, variation) / variation.tolerance)

        factor = _LARGEST_FACTOR
        if error > 1e-6:
            factor = min(_LARGEST_FACTOR, max(_SMALLEST_FACTOR, _SAFETY * error**_POWER))
        if not error <= 1.0:
            if not error < np.inf:
                room.stages[:] = 0.0
            counts[REJECTIONS] += 1
            numbers[REJECTED_LAST] = 1.0
            numbers[CAUTIOUS] = 0.0 if limited else h
            h *= factor
            if not h >= smallest:
                numbers[TIME], numbers[STEP] = t, h
                return MINIMUM_STEP if error < np.inf else NOT_FINITE
            continue

        ends = 2.0
        if watched:
            set_courses(s, shapes, control.ground, progress.state, room.after, room)
            ends = note_events_at(watch.note)(
                t, h, latest, s, control, progress.state, room, watch)
        elif watch.counts[KINKS]:
            begin(min(target, latest), room.after, s, control.depth, watch, room.scratch)
        reached = target if ends > 1.0 else t + ends * h

        if len(columns):
            keep(variation)
        row = counts[OUTPUTS]
        if times[row] <= reached:
            if len(columns):
                transitions[row] = columns
                begin_anew(variation)
            while row < len(times) and times[row] <= reached:
                part = (times[row] - t) / h
                tableau.interpolated(part, progress.state, room.after, room.dense, out[row])
                if control.work:
                    work_until(part, h, progress.work, room.power, work[row])
                row += 1
            counts[OUTPUTS] = row
        if ends <= 1.0:
            if control.work:
                work_until(ends, h, progress.work, room.power, progress.work)
            tableau.interpolated(ends, progress.state, room.after, room.dense, room.right)
            progress.state[:] = room.right
            numbers[TIME], numbers[STEP] = reached, h
            counts[STEPS] += 1
            return STOPPED
        if control.work:
            work_until(1.0, h, progress.work, room.power, progress.work)
            if is_break and target == stop:
                powers(stop, room.after, s, progress.power[:8], progress.power[8:])
                jump = drive_jump(latest, stop, room.after, s)
                progress.work[0] += jump
                if times[row - 1] == stop:
                    work[row - 1, 0] += jump
            else:
                progress.power[:] = room.power[3]
        _go_on(progress, room)
        keep_ends(len(s.gap), room)
        t = target
        new, again = True, 0
        counts[STEPS] += 1
        if numbers[LAST_STEP] > 0.0:
            # Steps that had to shrink will have to shrink on (predictive control, Gustafsson).
            factor = max(_SMALLEST_FACTOR, min(factor, factor * (h / numbers[LAST_STEP]) * (
                max(error, 1e-6) / numbers[LAST_ERROR]) ** _POWER))
        if numbers[REJECTED_LAST] != 0.0:
            factor = min(factor, 1.0)
        numbers[LAST_STEP], numbers[LAST_ERROR], numbers[REJECTED_LAST] = h, max(error, 1e-2), 0.0
        if limited:
            numbers[CAUTIOUS] = caution
        h = min(h * factor, control.longest)
    numbers[TIME], numbers[STEP] = t, h
    return FINISHED if counts[OUTPUTS] == len(times) else RUNNING
