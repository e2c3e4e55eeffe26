"""The compiled time integrator: Rodas5P steps of variable size over given output times."""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.compiled import block, f8, i8, integers, kernel, matrix, vector
from fecontact.contact_energy import POWERS, powers
from fecontact.contact_kernels import SYSTEM
from fecontact.integrate import linear, motion, rodas
from fecontact.integrate.borrowed import borrowed, inlined
from fecontact.laws.contract import signal_at

Array = NDArray[np.float64]

RUNNING, FINISHED, MINIMUM_STEP, NOT_FINITE = range(4)

TIME, STEP, SPEED_SCALE, REJECTED_LAST, LAST_STEP, LAST_ERROR, CAUTIOUS = range(7)
NUMBERS = 7
STARTED, OUTPUTS, STEPS, REJECTIONS, RATES, WORST_NODE = range(6)
COUNTS = 6

# Gauss-Lobatto points of a step for the work: both ends and two inside.
_INSIDE = 0.5 - 0.5 / np.sqrt(5.0)
_POINTS = np.array([0.0, _INSIDE, 1.0 - _INSIDE, 1.0])
# Row k: coefficients of s, s^2, s^3, s^4 in the integral from 0 to s of the k-th Lagrange
# polynomial on these points.
_INTEGRALS = np.array([
    np.polynomial.polynomial.polyint(np.polynomial.polynomial.polyfromroots(
        np.delete(_POINTS, k)) / np.prod(_POINTS[k] - np.delete(_POINTS, k)))[1:]
    for k in range(4)])

_SAFETY, _SMALLEST_FACTOR, _LARGEST_FACTOR = 0.9, 0.1, 8.0


class Control(NamedTuple):
    """What limits the steps.

    displacement_scale (m,), memory_scale (n s,), slip_scale (n,): see
    :func:`fecontact.integrate.control.integrate`; largest (m,): largest motion of each mode at
    any point; breaks (k,): times to step on to; rtol; friction_part: error of slip velocities
    that is allowed, as a part of their distance from sticking; longest step; smallest velocity
    scale; whether to add up the work.
    """

    displacement_scale: Array
    memory_scale: Array
    slip_scale: Array
    depth: Array
    slow: Array
    largest: Array
    breaks: Array
    rtol: float
    friction_part: float
    longest: float
    velocity_scale: float
    work: int


CONTROL = types.NamedTuple([vector, vector, vector, vector, vector, vector, vector, f8, f8, f8, f8, i8], Control)


class Progress(NamedTuple):
    """All that a run needs to go on, bit for bit: copy the arrays to make a checkpoint.

    numbers, counts: see the names of their entries in this module; state and rate (size,);
    extremes (m,), largest modal coordinates so far; work and power (8 + n,); and the
    :class:`~fecontact.integrate.motion.Gradients` at the state.
    """

    numbers: Array
    counts: NDArray[np.int64]
    state: Array
    rate: Array
    extremes: Array
    work: Array
    power: Array
    partial: Array
    force: Array
    rates: Array


PROGRESS = types.NamedTuple(
    [vector, integers, vector, vector, vector, vector, vector, block, matrix, block], Progress)


class Room(NamedTuple):
    """Room to work in, which outlives a call: rows of the size of the state, and so on."""

    arena: Array
    nodes: Array
    given: Array
    power: Array
    reduced: linear.Reduced
    scratch: motion.Gradients
    candidate: motion.Gradients


ROOM = types.NamedTuple([matrix, matrix, vector, matrix, linear.REDUCED, motion.GRADIENTS,
                         motion.GRADIENTS], Room)


def room_for(modes: int, nodes: int, states: int) -> Room:
    """Room for a system of so many modes, contact nodes and internal variables per node."""
    size = 2 * modes + nodes * states

    def gradients() -> motion.Gradients:
        return motion.Gradients(np.zeros((nodes, 3, 4)), np.zeros((nodes, 3 + states)),
                                np.zeros((nodes, states, 3 + states)))

    reduced = linear.Reduced(
        np.zeros((modes, 2 * modes)), np.zeros((modes, modes)), np.zeros(modes, dtype=np.int64),
        np.zeros((nodes, states, states)), np.zeros((nodes, states)), np.zeros(modes),
        np.zeros((4, 2 * nodes)), np.zeros((2 * modes, 2 * nodes)))
    return Room(np.zeros((20, size)), np.zeros((3, 2 * nodes)), np.zeros(motion.GIVEN),
                np.zeros((4, len(POWERS) + nodes)), reduced, gradients(), gradients())


@inlined
def _work(s, h, power, k):  # type: ignore[no-untyped-def]
    """Work of the k-th power from the start of a step to its part s."""
    total = 0.0
    for point in range(4):
        row = _INTEGRALS[point]
        total += power[point, k] * s * (row[0] + s * (row[1] + s * (row[2] + s * row[3])))
    return h * total


@kernel(types.i8(SYSTEM, matrix, vector, CONTROL, PROGRESS, ROOM, i8, matrix, matrix))
def advance(s_, shapes_, times_, control_, progress_, room_, most, out_, work_out_):  # type: ignore[no-untyped-def]
    """Go on for at most ``most`` steps, accepted or not; returns how it ended.

    Fills the rows of ``out`` (N, size) and ``work_out`` (N, 8 + n) that belong to the output
    times passed.
    """
    s, shapes, times = borrowed(s_), borrowed(shapes_), borrowed(times_)
    control, progress, room = borrowed(control_), borrowed(progress_), borrowed(room_)
    out, work_out = borrowed(out_), borrowed(work_out_)
    numbers, counts = progress.numbers, progress.counts
    m, rows = shapes.shape
    n = rows // 2
    size = len(progress.state)
    states = (size - 2 * m) // n
    rtol = control.rtol

    arena, node_room, given, power = room.arena, room.nodes, room.given, room.power
    reduced, scratch, candidate = room.reduced, room.scratch, room.candidate
    stages, dense = arena[:8], arena[8:11]
    stage, right, base, time_rate, after, candidate_rate, inner = (
        arena[11], arena[12], arena[13], arena[14], arena[15], arena[16], arena[17])
    pull, pull_rate = arena[18][:m], arena[19][:m]
    current = motion.Gradients(progress.partial, progress.force, progress.rates)

    state = progress.state
    t, h = numbers[TIME], numbers[STEP]
    end = times[-1]
    smallest = 1e-14 * max(abs(times[0]), abs(end))
    if counts[STARTED] == 0:
        motion.set_given(t, s, given, pull)
        motion.set_rate_and_gradients(state, s, shapes, given, pull, node_room, current,
                                      progress.rate)
        if control.work:
            powers(t, state, s, progress.power[:8], progress.power[8:])
        for i in range(size):
            out[0, i] = state[i]
        counts[STARTED], counts[OUTPUTS] = 1, 1
        h = min(h, control.longest)
    new, speed = True, 0.0
    attempts = 0
    status = RUNNING
    while True:
        if counts[OUTPUTS] == len(times):
            status = FINISHED
            break
        if attempts == most:
            break
        attempts += 1
        # The end, or the next break: its time is approached from below.
        stop, is_break = end, False
        for k in range(len(control.breaks)):
            if t < control.breaks[k] < stop:
                stop, is_break = control.breaks[k], True
        target = t + h
        if target + 0.01 * h >= stop:
            target = stop
        elif target + h > stop:
            target = t + 0.5 * (stop - t)
        if new:
            motion.set_given(t, s, given, pull)
            speed = given[motion.SPEED]
        limited = False
        if numbers[CAUTIOUS] > 0.0:
            reach = max(target - t, numbers[CAUTIOUS])
            kink = motion.next_kink(state, progress.rate, s, shapes, current, control.depth,
                                    control.slow, speed, node_room, reach)
            if kink < 0.9 * reach and t + kink < stop:
                # Rather a little too far than too short.
                target = min(t + max(1.0003 * kink, 1e-3 * (target - t)), stop)
                limited = True
            numbers[CAUTIOUS] = 0.0
        h = target - t
        latest = np.nextafter(stop, t) if is_break else stop

        G = 1.0 / (h * rodas.GAMMA)
        if new:
            small = 1e-4 * h
            later = min(t + small, latest)
            acceleration = 0.0
            if later > t:
                acceleration = (signal_at(s.ground_motion)(later, s.ground_motion_parameters)[1]
                                - speed) / (later - t)
            for i in range(m):
                pull_rate[i] = 0.0
            for k in range(len(s.load)):
                value = signal_at(s.load[k])(t, s.load_parameters[k])[1]
                for i in range(m):
                    pull_rate[i] += value * s.load_shapes[k, i]
            motion.set_time_rate(s, shapes, given, acceleration, current, pull_rate, node_room,
                                 time_rate)
            for i in range(m):
                progress.extremes[i] = max(progress.extremes[i], abs(state[i]))
                numbers[SPEED_SCALE] = max(numbers[SPEED_SCALE],
                                           abs(state[m + i]) * control.largest[i])
        if states > 0:
            linear.eliminate_memory(G, s, current, reduced)
        if new or states > 0:
            linear.assemble(s, shapes, current, reduced)
        new = False
        linear.factorise_step(G, reduced)

        last = t
        for i in range(rodas.STAGES):
            if i == 0:
                for k in range(size):
                    right[k] = progress.rate[k]
            else:
                rodas.combined(rodas.A[i], 1.0, state, stages, stage)
                now = min(t + rodas.NODES[i] * h, latest)
                if now != last:
                    motion.set_given(now, s, given, pull)
                    last = now
                motion.set_rate(stage, s, shapes, given, pull, node_room, scratch, base)
                rodas.combined(rodas.C[i], 1.0 / h, base, stages, right)
            factor = rodas.TIME[i] * h
            if factor != 0.0:
                for k in range(m, size):
                    right[k] += factor * time_rate[k]
            linear.solve_stage(G, s, shapes, current, reduced, right, node_room, stages[i])
        counts[RATES] += rodas.STAGES - 1

        error = 0.0
        speed_scale = max(numbers[SPEED_SCALE], control.velocity_scale)
        difference = stages[rodas.STAGES - 1]
        for k in range(size):
            after[k] = stage[k] + difference[k]
        for i in range(m):
            scale = max(max(progress.extremes[i], abs(after[i])), control.displacement_scale[i])
            error = max(error, abs(difference[i]) / (rtol * scale))
            error = max(error, abs(difference[m + i]) * control.largest[i] / (rtol * speed_scale))
        for k in range(size - 2 * m):
            error = max(error, abs(difference[2 * m + k]) / (rtol * control.memory_scale[k]))

        if error <= 1.0:
            if is_break and target == stop:
                motion.set_given(stop, s, given, pull)
            motion.set_rate_and_gradients(after, s, shapes, given, pull, node_room, candidate,
                                          candidate_rate)
            counts[RATES] += 1
            for j in range(n):
                if s.memory[j] == 0 and node_room[2, n + j] != 0.0:
                    slip_error = 0.0
                    for i in range(m):
                        slip_error += shapes[i, j] * difference[m + i]
                    slip = abs(node_room[1, j] - given[motion.SPEED])
                    part = abs(slip_error) / (control.friction_part
                                              * (control.slip_scale[j] + slip))
                    if part > error:
                        error = part
                        counts[WORST_NODE] = j
        factor = _LARGEST_FACTOR
        if error > 1e-6:
            factor = min(_LARGEST_FACTOR,
                         max(_SMALLEST_FACTOR, _SAFETY * error ** (-1.0 / rodas.ORDER)))
        if not error <= 1.0:
            if not error < np.inf:
                factor = _SMALLEST_FACTOR
                for i in range(rodas.STAGES):
                    for k in range(size):
                        stages[i, k] = 0.0
            counts[REJECTIONS] += 1
            numbers[REJECTED_LAST] = 1.0
            numbers[CAUTIOUS] = 0.0 if limited else h
            h *= factor
            if h < smallest:
                status = MINIMUM_STEP if error < np.inf else NOT_FINITE
                break
            continue

        if control.work:
            rodas.dense_coefficients(stages, dense)
            for k in range(len(progress.work)):
                power[0, k] = progress.power[k]
            for point in range(1, 3):
                rodas.interpolated(_POINTS[point], state, after, dense, inner)
                powers(min(t + _POINTS[point] * h, latest), inner, s, power[point, :8],
                       power[point, 8:])
            powers(latest if target == stop else target, after, s, power[3, :8], power[3, 8:])
        first = counts[OUTPUTS]
        if times[first] <= target:
            if not control.work:
                rodas.dense_coefficients(stages, dense)
            row = first
            while row < len(times) and times[row] <= target:
                part = (times[row] - t) / h
                rodas.interpolated(part, state, after, dense, out[row])
                if control.work:
                    for k in range(len(progress.work)):
                        work_out[row, k] = progress.work[k] + _work(part, h, power, k)
                row += 1
            counts[OUTPUTS] = row
        if control.work:
            for k in range(len(progress.work)):
                progress.work[k] += _work(1.0, h, power, k)
                progress.power[k] = power[3, k]
            if is_break and target == stop:
                powers(target, after, s, progress.power[:8], progress.power[8:])
        for k in range(size):
            state[k] = after[k]
            progress.rate[k] = candidate_rate[k]
        for j in range(n):
            for row in range(3):
                for k in range(4):
                    current.partial[j, row, k] = candidate.partial[j, row, k]
            for k in range(3 + states):
                current.force[j, k] = candidate.force[j, k]
                for row in range(states):
                    current.rates[j, row, k] = candidate.rates[j, row, k]
        t = target
        new = True
        counts[STEPS] += 1
        if numbers[LAST_STEP] > 0.0:
            # Steps that had to shrink will have to shrink on (Gustafsson's predictive control).
            trend = (h / numbers[LAST_STEP]) * (numbers[LAST_ERROR] / max(error, 1e-6)) ** (
                1.0 / rodas.ORDER)
            factor = max(min(factor, factor * trend), _SMALLEST_FACTOR)
        numbers[LAST_STEP], numbers[LAST_ERROR] = h, max(error, 1e-2)
        if numbers[REJECTED_LAST] != 0.0:
            factor = min(factor, 1.0)
        numbers[REJECTED_LAST] = 0.0
        if limited:
            numbers[CAUTIOUS] = h
        h = min(h * factor, control.longest)
    numbers[TIME], numbers[STEP] = t, h
    return status
