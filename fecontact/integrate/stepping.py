"""The compiled time integrator: Rodas5P steps of variable size over given output times."""

import numpy as np
from numba import types

from fecontact.compiled import borrowed, helper, i8, kernel, matrix, vector
from fecontact.contact_energy import powers
from fecontact.contact_kernels import SYSTEM
from fecontact.integrate import linear, motion, rodas, run_arrays
from fecontact.integrate.run_arrays import (
    CAUTIOUS,
    ENERGY,
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
    WORST_NODE,
)
from fecontact.integrate.work import add_up, work_error, work_until
from fecontact.laws.contract import signal_at

RUNNING, FINISHED, MINIMUM_STEP, NOT_FINITE = range(4)

_SAFETY, _SMALLEST_FACTOR, _LARGEST_FACTOR = 0.9, 0.1, 8.0
_POWER = -1.0 / rodas.ORDER


@helper
def _linearise(t, after_t, h, latest, s, shapes, control, progress, room):  # type: ignore[no-untyped-def]
    """What a step needs of the derivatives at its start besides the matrices."""
    m = len(control.largest)
    later = min(t + 1e-4 * h, latest)
    acceleration = 0.0
    if later > t:
        speed = signal_at(s.ground_motion)(later, s.ground_motion_parameters)[1]
        acceleration = (speed - room.given[motion.SPEED]) / (later - t)
    for i in range(m):
        room.pull_rate[i] = 0.0
    for k in range(len(s.load)):
        rate = signal_at(s.load[k])(after_t, s.load_parameters[k])[1]
        for i in range(m):
            room.pull_rate[i] += rate * s.load_shapes[k, i]
    motion.set_time_rate(s, shapes, room.given, acceleration, progress.gradients, room.pull_rate,
                         room.nodes, room.time_rate)
    for i in range(m):
        progress.extremes[i] = max(progress.extremes[i], abs(progress.state[i]))
        speed = abs(progress.state[m + i]) * control.largest[i]
        progress.numbers[SPEED_SCALE] = max(progress.numbers[SPEED_SCALE], speed)


@helper
def _stages(t, h, latest, G, s, shapes, progress, room):  # type: ignore[no-untyped-def]
    """All stages of a step, and its end in ``room.after``."""
    size = len(progress.state)
    m = len(room.pull)
    last = t
    for i in range(rodas.STAGES):
        if i == 0:
            for k in range(size):
                room.right[k] = progress.rate[k]
        else:
            rodas.combined(rodas.A[i], 1.0, progress.state, room.stages, room.stage)
            now = min(t + rodas.NODES[i] * h, latest)
            if now != last:
                motion.set_given(now, s, room.given, room.pull)
                last = now
            motion.set_rate(room.stage, s, shapes, room.given, room.pull, room.nodes,
                            room.scratch, room.base)
            rodas.combined(rodas.C[i], 1.0 / h, room.base, room.stages, room.right)
        factor = rodas.TIME[i] * h
        if factor != 0.0:
            for k in range(m, size):
                room.right[k] += factor * room.time_rate[k]
        linear.solve_stage(G, s, shapes, progress.gradients, room.reduced, room.right, room.nodes,
                           room.stages[i])
    for k in range(size):
        room.after[k] = room.stage[k] + room.stages[rodas.STAGES - 1, k]


@helper
def _error(control, progress, room):  # type: ignore[no-untyped-def]
    """Error of a step as a multiple of what is allowed, of modes and internal variables."""
    m = len(control.largest)
    difference = room.stages[rodas.STAGES - 1]
    speed_scale = max(progress.numbers[SPEED_SCALE], control.speed_scale)
    error = 0.0
    for i in range(m):
        scale = max(max(progress.extremes[i], abs(room.after[i])), control.displacement_scale[i])
        error = max(error, abs(difference[i]) / scale)
        error = max(error, abs(difference[m + i]) * control.largest[i] / speed_scale)
    for k in range(len(control.memory_scale)):
        error = max(error, abs(difference[2 * m + k]) / control.memory_scale[k])
    # Comparisons with NaN are false: make sure that it is not lost.
    for k in range(len(difference)):
        if not abs(room.after[k]) < np.inf:
            error = np.inf
    return error / control.rtol


@helper
def _slip_error(error, s, shapes, control, progress, room):  # type: ignore[no-untyped-def]
    """The larger of the error and that of the slip velocities at the end of the step.

    Only where friction has no memory: there the force follows the slip velocity alone.
    """
    m, rows = shapes.shape
    n = rows // 2
    difference = room.stages[rodas.STAGES - 1]
    for j in range(n):
        if s.memory[j] == 0 and room.nodes[2, n + j] != 0.0:
            slip_error = 0.0
            for i in range(m):
                slip_error += shapes[i, j] * difference[m + i]
            slip = abs(room.nodes[1, j] - room.given[motion.SPEED])
            part = abs(slip_error) / (control.slip_part * (control.slip_scale[j] + slip))
            if part > error:
                error = part
                progress.counts[WORST_NODE] = j
    return error


@helper
def _energy(control, progress, room):  # type: ignore[no-untyped-def]
    """The largest of kinetic energy, work of a power and the energy scale so far [J]."""
    m = len(control.largest)
    kinetic = 0.0
    for i in range(m):
        kinetic += 0.5 * room.after[m + i] ** 2
    energy = max(max(progress.numbers[ENERGY], kinetic), control.energy_scale)
    for k in range(8):
        energy = max(energy, abs(progress.work[k]))
    progress.numbers[ENERGY] = energy
    return energy


@helper
def _go_on(progress, room):  # type: ignore[no-untyped-def]
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


@kernel(types.i8(SYSTEM, matrix, vector, run_arrays.CONTROL, run_arrays.PROGRESS, run_arrays.ROOM,
                 i8, matrix, matrix), nogil=True)
def advance(  # type: ignore[no-untyped-def]
    held_system, held_shapes, held_times, held_control, held_progress, held_room, most, held_out,
    held_work,
):
    """Go on until ``most`` steps have been tried and one accepted; returns how it ended.

    Fills the rows of ``out`` (N, size) and ``work`` (N, 8 + n) that belong to the output times
    passed. A run that is continued gives the same numbers as one that was not interrupted.
    """
    s, shapes, times = borrowed(held_system), borrowed(held_shapes), borrowed(held_times)
    control, progress, room = borrowed(held_control), borrowed(held_progress), borrowed(held_room)
    out, work = borrowed(held_out), borrowed(held_work)
    numbers, counts = progress.numbers, progress.counts
    size = len(progress.state)
    memory = size > 2 * len(control.largest)
    t, h = numbers[TIME], numbers[STEP]
    end = times[-1]
    smallest = 1e-14 * max(abs(times[0]), abs(end))
    if counts[STARTED] == 0:
        motion.set_given(t, s, room.given, room.pull)
        motion.set_rate_and_gradients(progress.state, s, shapes, room.given, room.pull, room.nodes,
                                      progress.gradients, progress.rate)
        if control.work:
            powers(t, progress.state, s, progress.power[:8], progress.power[8:])
        for k in range(size):
            out[0, k] = progress.state[k]
        counts[STARTED], counts[OUTPUTS] = 1, 1
    new, speed, attempts = True, 0.0, 0
    while counts[OUTPUTS] < len(times):
        # A step that failed is repeated before the call returns: derivatives are not kept.
        if new and attempts >= most:
            break
        attempts += 1
        # The end, or the next break; that is approached from below.
        stop, is_break = end, False
        for k in range(len(control.breaks)):
            if t < control.breaks[k] < stop:
                stop, is_break = control.breaks[k], True
        latest = np.nextafter(stop, t) if is_break else stop
        target = t + h
        if target + 0.01 * h >= stop:
            target = stop
        elif target + h > stop:
            target = t + 0.5 * (stop - t)
        if new:
            # Rates just after t: they may jump at a break.
            motion.set_given(np.nextafter(t, end), s, room.given, room.pull)
            speed = room.given[motion.SPEED]
        limited, caution = False, numbers[CAUTIOUS]
        if caution > 0.0:
            reach = max(target - t, caution)
            kink = motion.next_kink(progress.state, progress.rate, s, shapes, progress.gradients,
                                    control.depth, control.slow, speed, room.nodes, reach)
            # Nearer ones are left to the error control, lest steps shrink without end.
            if 1e-3 * caution < kink < 0.9 * reach:
                # Rather a little too far than too short.
                target = min(t + 1.0003 * kink, stop)
                limited = True
            numbers[CAUTIOUS] = 0.0
        h = target - t

        G = 1.0 / (h * rodas.GAMMA)
        if new:
            _linearise(t, np.nextafter(t, end), h, latest, s, shapes, control, progress, room)
        if memory:
            linear.eliminate_memory(G, s, progress.gradients, room.reduced)
        if new or memory:
            linear.assemble(s, shapes, progress.gradients, room.reduced)
        new = False
        linear.factorise_step(G, room.reduced)
        _stages(t, h, latest, G, s, shapes, progress, room)
        counts[RATES] += rodas.STAGES
        error = _error(control, progress, room)
        if error <= 1.0:
            if is_break and target == stop:
                motion.set_given(np.nextafter(stop, end), s, room.given, room.pull)
            motion.set_rate_and_gradients(room.after, s, shapes, room.given, room.pull, room.nodes,
                                          room.gradients_after, room.rate_after)
            error = _slip_error(error, s, shapes, control, progress, room)
            if control.work and error <= 1.0:
                rodas.dense_coefficients(room.stages, room.dense)
                add_up(t, h, latest, s, progress, room)
                error = max(error, work_error(h, room.power) / (
                    control.rtol * _energy(control, progress, room)))

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

        row = counts[OUTPUTS]
        if times[row] <= target:
            if not control.work:
                rodas.dense_coefficients(room.stages, room.dense)
            while row < len(times) and times[row] <= target:
                part = (times[row] - t) / h
                rodas.interpolated(part, progress.state, room.after, room.dense, out[row])
                if control.work:
                    work_until(part, h, progress.work, room.power, work[row])
                row += 1
            counts[OUTPUTS] = row
        if control.work:
            work_until(1.0, h, progress.work, room.power, progress.work)
            if is_break and target == stop:
                powers(stop, room.after, s, progress.power[:8], progress.power[8:])
            else:
                progress.power[:] = room.power[3]
        _go_on(progress, room)
        t = target
        new = True
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
