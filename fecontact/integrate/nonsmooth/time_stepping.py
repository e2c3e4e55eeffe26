"""Compiled run by implicit steps of variable length with set-valued friction at many nodes.

The method is the diagonally implicit Runge-Kutta method of Alexander, of order 3, stiffly
accurate and L-stable, with an embedded one of order 2 for the error.

References
----------
R. Alexander, Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s, SIAM Journal on
Numerical Analysis 14 (1977).
"""

import math

import numpy as np
from numba import types

from fecontact.core.compiled import borrowed, f8, helper, i8, integers, kernel, matrix, vector
from fecontact.integrate.bernstein import DEPTH, NOWHERE, first_below, fit
from fecontact.integrate.nonsmooth.equations import contact_powers, observe
from fecontact.integrate.nonsmooth.event_search import ROUGHLY, UNFELT, first_pressed, pressed
from fecontact.integrate.nonsmooth.problem import (
    DIVERGED,
    EFFORTS,
    FINISHED,
    FORCE,
    GOING_ON,
    LIMIT,
    OUTPUTS,
    PENETRATION,
    PROBLEM,
    RATE,
    REJECTED,
    SLIP,
    STARTED,
    STEPS,
    STUCK,
    WORKSPACE,
)
from fecontact.integrate.nonsmooth.stage_newton import GRIP, ROUNDING, solve_stage
from fecontact.laws.signatures import signal_at
from fecontact.system.kernels import body_powers, drive_jump

GAMMA = 0.43586652150845899942
A21 = 0.5 * (1.0 - GAMMA)
B1 = -0.25 * (6.0 * GAMMA**2 - 16.0 * GAMMA + 1.0)
B2 = 0.25 * (6.0 * GAMMA**2 - 20.0 * GAMMA + 5.0)
ERROR_1 = B1 - GAMMA / (1.0 - GAMMA)
ERROR_2 = B2 - (1.0 - 2.0 * GAMMA) / (1.0 - GAMMA)
_THIRDS = fit(np.arange(4) / 3.0)
# A step is cut so often at most before what is left counts as error.
CUTS = 3


@helper
def _passed_over(t, h, before, after, old, p, tolerance, floor, rtol, nodes, b, speed, room):
    """Part of a step at which a node slips back, or touches, between ends that show neither; or 1.

    ``old`` and ``nodes`` are what `observe` fills at both ends, ``before`` and ``after`` the
    accelerations there; between them cubics count. Reversals below ``tolerance`` are left out.
    """
    s = p.system
    n, m = s.Tx.shape
    for i in range(4):
        speed[i] = 0.0
        for k in range(4):
            speed[i] += _THIRDS[i, k] * signal_at(s.ground_motion)(
                t + h * k / 3.0, s.ground_motion_parameters)[1]
    shorter = 1.0
    for j in range(n):
        first, last = old[j, SLIP], nodes[j, SLIP]
        if (old[j, FORCE] != 0.0 and nodes[j, FORCE] != 0.0 and first * last > 0.0
                and min(abs(first), abs(last)) > tolerance):
            sign = 1.0 if first > 0.0 else -1.0
            rise, fall = 0.0, 0.0
            for i in range(m):
                rise += s.Tx[j, i] * before[i]
                fall += s.Tx[j, i] * after[i]
            b[0], b[3] = first + speed[0], last + speed[3]
            b[1], b[2] = b[0] + h * rise / 3.0, b[3] - h * fall / 3.0
            for i in range(4):
                b[i] = sign * (b[i] - speed[i]) + tolerance
            back = first_below(b, room)
            if back != NOWHERE:
                b[0], b[1], b[2], b[3] = b[3], b[2], b[1], b[0]
                shorter = min(shorter, 0.5 * (back + 1.0 - first_below(b, room)))
        b[0], b[3] = old[j, PENETRATION], nodes[j, PENETRATION]
        b[1], b[2] = b[0] + h * old[j, RATE] / 3.0, b[3] - h * nodes[j, RATE] / 3.0
        depth = 0.0
        for i in range(m):
            depth = max(depth, abs(s.Ty[j, i]) * floor[i])
        above = UNFELT * max(pressed(b[0], j, s), pressed(b[3], j, s))
        above += pressed(rtol * depth, j, s)
        if max(pressed(b.min(), j, s), pressed(b.max(), j, s)) > above:
            shorter = min(shorter, first_pressed(b, above, ROUGHLY, j, s, room))
    return shorter


@helper
def _output(
        row, time, t, h, Y, before, after, new, p, old_force, force, w, states, friction,
        normal):
    """State at an output time within a step, by cubics through both ends."""
    m = p.system.Tx.shape[1]
    x = (time - t) / h
    early, late = (1.0 - x) * (1.0 - x), x * x
    for i in range(m):
        q, q_new, v, v_new = Y[i], new[i], Y[m + i], new[m + i]
        states[row, i] = (early * ((1.0 + 2.0 * x) * q + x * h * v)
                          + late * ((3.0 - 2.0 * x) * q_new + (x - 1.0) * h * v_new))
        states[row, m + i] = (early * ((1.0 + 2.0 * x) * v + x * h * before[i])
                              + late * ((3.0 - 2.0 * x) * v_new + (x - 1.0) * h * after[i]))
    for i in range(2 * m, len(Y)):
        states[row, i] = (early * ((1.0 + 2.0 * x) * Y[i] + x * h * before[i - m])
                          + late * ((3.0 - 2.0 * x) * new[i] + (x - 1.0) * h * after[i - m]))
    observe(time, states[row], p, w.nodes)
    normal[row] = w.nodes[:, FORCE]
    for j in range(len(force)):
        friction[row, j] = (1.0 - x) * old_force[j] + x * force[j]


@kernel(types.i8(vector, vector, vector, PROBLEM, f8, f8, vector, vector, integers, integers,
                 integers, vector, i8, matrix, matrix, matrix, WORKSPACE))
def run_steps(
    clock, held_times, stops, held_p, rtol, longest, held_floor, held_Y, status, closed, counts,
    held_carried, limit, held_states, held_friction, held_normal, held_w,
):
    """Go on for at most ``limit`` steps, up to the last of ``times``.

    Arguments as for :func:`fecontact.integrate.nonsmooth.event_driven.run_events`; ``carried`` is
    the largest slip velocity so far, two unused numbers and the friction force (n,) of each node.
    """
    times, p, floor, Y = borrowed(held_times), borrowed(held_p), borrowed(held_floor), borrowed(
        held_Y)
    carried, states, w = borrowed(held_carried), borrowed(held_states), borrowed(held_w)
    friction, normal = borrowed(held_friction), borrowed(held_normal)
    s = p.system
    n, m = s.Tx.shape
    size = len(Y)
    room = np.empty((4, n, m))
    linear, system_matrix = np.empty((m, m)), np.empty((m, m))
    stage_states, accelerations = np.empty((3, 2 * m)), np.empty((3, m))
    rates, new = np.empty((3, EFFORTS + n)), np.empty(size)
    start, known = np.empty(m), np.empty(m)
    before, after = np.empty(size - m), np.empty(size - m)
    grip, multiplier, stage_force = np.empty(n), np.empty(n), np.empty((3, n))
    old, cubic, speed = np.empty_like(w.nodes), np.empty(4), np.empty(4)
    halves = np.empty((DEPTH, 5))
    side = np.zeros(n)
    force = carried[3:]
    inertia = np.empty(n)
    slowest = 0.0
    for j in range(n):
        inertia[j], part = 0.0, 0.0
        for i in range(m):
            inertia[j] += s.Tx[j, i] * s.Tx[j, i]
            part = max(part, abs(s.Tx[j, i]) * floor[m + i])
        slowest = max(slowest, part)
    t, h, end = clock[0], clock[1], times[-1]
    tiny = 1e-14 * max(abs(times[0]), abs(end), longest)
    stop = 0
    while stop < len(stops) and stops[stop] <= t:
        stop += 1
    in_a_row, cuts, known_before = 0, 0, False

    for _ in range(limit):
        if t >= end:
            break
        goal = end
        if stop < len(stops):
            goal = min(goal, stops[stop])
        length = min(h, longest)
        reaching = length >= (goal - t) * (1.0 - 1e-10)
        if reaching:
            length = goal - t
        # At the end of a step that ends at a break, signals are as before the break.
        latest = np.nextafter(goal, t)
        g = GAMMA * length
        counts[STEPS] += 1
        observe(t, Y, p, w.nodes)
        old[:] = w.nodes
        quick = carried[0] + abs(signal_at(s.ground_motion)(t, s.ground_motion_parameters)[1])
        for i in range(m):
            for k in range(m):
                linear[i, k] = g * s.damping[i, k] + g * g * s.stiffness[i, k]
            linear[i, i] += 1.0
        for j in range(n):
            # Of a force within its limit the rounding of the slip velocity may move no more.
            softest = inertia[j] * g / GRIP
            if w.nodes[j, LIMIT] > 0.0:
                softest += ROUNDING * quick / w.nodes[j, LIMIT]
            grip[j] = 1.0 / softest if inertia[j] > 0.0 else 0.0
            multiplier[j] = force[j]
        finest = (1e-2 * rtol + 1e-11) * max(slowest, quick)
        good = True
        for k in range(3):
            node = GAMMA if k == 0 else (GAMMA + A21 if k == 1 else 1.0)
            state = stage_states[k]
            for i in range(m):
                start[i], known[i] = Y[i], Y[m + i]
                if k == 1:
                    start[i] += length * A21 * stage_states[0, m + i]
                    known[i] += length * A21 * accelerations[0, i]
                elif k == 2:
                    start[i] += length * (B1 * stage_states[0, m + i]
                                          + B2 * stage_states[1, m + i])
                    known[i] += length * (B1 * accelerations[0, i] + B2 * accelerations[1, i])
                state[m + i] = Y[m + i] if k == 0 else stage_states[k - 1, m + i]
            good = solve_stage(min(t + node * length, latest), g, start, known, state, p, grip,
                               multiplier, side, stage_force[k], room, linear, system_matrix,
                               floor, rtol, finest)
            if not good:
                break
            for i in range(m):
                accelerations[k, i] = (state[m + i] - known[i]) / g
            multiplier[:] = stage_force[k]
        if not good:
            counts[REJECTED] += 1
            h = 0.25 * length
            if h < tiny:
                clock[0], clock[1] = t, h
                return DIVERGED if not math.isfinite(state[m]) else STUCK
            continue

        for i in range(m):
            start[i] = length * (ERROR_1 * stage_states[0, m + i] + ERROR_2 * stage_states[1, m + i]
                                 + GAMMA * stage_states[2, m + i])
            known[i] = length * (ERROR_1 * accelerations[0, i] + ERROR_2 * accelerations[1, i]
                                 + GAMMA * accelerations[2, i])
        for i in range(m):
            for k in range(m):
                known[i] -= g * s.stiffness[i, k] * start[k]
        filtered = np.linalg.solve(system_matrix, known)
        worst = 0.0
        for i in range(m):
            place = start[i] + g * filtered[i]
            worst = max(worst, abs(place) / (rtol * (floor[i] + abs(Y[i]))),
                        abs(filtered[i]) / (rtol * (floor[m + i] + abs(Y[m + i]))))
        if worst > 1.0:
            counts[REJECTED] += 1
            in_a_row += 1
            # Where a node begins to slip or to stick, the error falls with the length only.
            factor = 0.9 * worst ** (-1.0 / 3.0) if in_a_row == 1 else 0.7 / worst
            h = length * max(factor, 0.02)
            if h < tiny:
                clock[0], clock[1] = t, h
                return STUCK
            continue

        for k in range(3):
            node = GAMMA if k == 0 else (GAMMA + A21 if k == 1 else 1.0)
            moment = min(t + node * length, latest)
            observe(moment, stage_states[k], p, w.nodes)
            body_powers(moment, stage_states[k], s, rates[k])
            contact_powers(moment, s, w.nodes, stage_force[k], True, rates[k])
        if not known_before:
            before[:m] = accelerations[0]
            before[m:] = rates[0]
        if cuts < CUTS:
            part = _passed_over(t, length, before, accelerations[2], old, p,
                                rtol * (slowest + quick), floor, rtol, w.nodes, cubic, speed,
                                halves)
            if part * length > tiny and part < 1.0:
                counts[REJECTED] += 1
                cuts += 1
                h = part * length
                continue
        for j in range(n):
            carried[0] = max(carried[0], abs(w.nodes[j, SLIP]))
        new[: 2 * m] = stage_states[2]
        for i in range(EFFORTS + n):
            new[2 * m + i] = Y[2 * m + i] + length * (
                B1 * rates[0, i] + B2 * rates[1, i] + GAMMA * rates[2, i])
        reached = goal if reaching else t + length
        after[:m] = accelerations[2]
        after[m:] = rates[2]
        if counts[STARTED] == 0:
            counts[STARTED] = 1
            force[:] = stage_force[0]
        while counts[OUTPUTS] < len(times) and times[counts[OUTPUTS]] <= reached:
            row = counts[OUTPUTS]
            _output(row, times[row], t, reached - t, Y, before, after, new, p, force,
                    stage_force[2], w, states, friction, normal)
            counts[OUTPUTS] += 1
        t = reached
        Y[:] = new
        before[:] = after
        known_before = True
        force[:] = stage_force[2]
        if reaching and stop < len(stops) and goal == stops[stop]:
            stop += 1
            known_before = False
            work = drive_jump(latest, t, Y, s)
            Y[2 * m] += work
            if counts[OUTPUTS] > 0 and times[counts[OUTPUTS] - 1] == t:
                states[counts[OUTPUTS] - 1, 2 * m] += work
        in_a_row, cuts = 0, 0
        h = length * min(8.0, max(0.3, 0.9 * max(worst, 1e-12) ** (-1.0 / 3.0)))
    clock[0], clock[1] = t, h
    return FINISHED if t >= end else GOING_ON
