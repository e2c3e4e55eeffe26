r"""Compiled run by implicit steps of variable length with set-valued friction at many nodes.

The method is the diagonally implicit Runge-Kutta method of Alexander, of order 3, stiffly
accurate and L-stable, with an embedded one of order 2 for the error. Each of its three stages
asks for the velocities V of the modes at t + c h,

    V = V_e + g q''(t + c h, Q_e + g V, V, R),    R_j in mu F_j Sign(v_j),    g = gamma h,

with friction as a set: R_j is the projection of ``lambda_j + r v_j`` on the limits of stick, or
the force of slip beyond them. Newton's method follows the set of sticking nodes; lambda becomes R
until nothing creeps (augmented Lagrangian). Nodes whose stick the others bring about already are
no trouble: the equations for V stay regular, and only the way in which such nodes share a force
remains open; each keeps what it carried when it came to rest, as far as its limit allows.

References
----------
R. Alexander, Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s, SIAM Journal on
Numerical Analysis 14 (1977). P. Alart, A. Curnier, A mixed formulation for frictional contact
problems prone to Newton like solution methods, Computer Methods in Applied Mechanics and
Engineering 92 (1991).
"""

import math

import numpy as np
from numba import types

from fecontact.compiled import f8, helper, i8, integers, kernel, matrix, vector
from fecontact.contact_kernels import node_motion
from fecontact.integrate.set_valued_nodes import (
    CREEP,
    DIVERGED,
    EFFORTS,
    FINISHED,
    FORCE,
    GOING_ON,
    LIMIT,
    OUTPUTS,
    PROBLEM,
    REJECTED,
    SLIP,
    STARTED,
    STEPS,
    STUCK,
    body_powers,
    contact_powers,
    free_acceleration,
    observe,
    workspace,
)
from fecontact.laws.contract import friction_at, ground_at, normal_at, signal_at

GAMMA = 0.43586652150845899942
A21 = 0.5 * (1.0 - GAMMA)
B1 = -0.25 * (6.0 * GAMMA**2 - 16.0 * GAMMA + 1.0)
B2 = 0.25 * (6.0 * GAMMA**2 - 20.0 * GAMMA + 5.0)
ERROR_1 = B1 - GAMMA / (1.0 - GAMMA)
ERROR_2 = B2 - (1.0 - 2.0 * GAMMA) / (1.0 - GAMMA)

# Stiffness of what holds a sticking node during Newton's iteration, relative to its inertia.
_GRIP = 1e6
_ROUNDING = 2e-8
_ITERATIONS = 60
# Newton steps without shortening.
_HASTY = 8

KEPT, HESITANT, FREE = range(3)


@helper
def _linearise(  # type: ignore[no-untyped-def]
        t, Y, g, p, grip, multiplier, side, turning, force, gradients, active, balance):
    """Contact of one stage: accelerations, friction forces and rows of the Jacobian.

    Adds ``Ty F - Tx R`` to ``balance`` (m,), fills ``force`` (n,) with R, ``active`` (2, n, m)
    with rows Tx, Ty and ``gradients`` (2, n, m) with dR/dV and -dF/dV of the nodes under force.
    ``side`` (n,) is the sign of the slip of each node at the last call, zero for stick. KEPT
    nodes stay as they are; HESITANT ones that would turn their slip around are first tried as
    sticking, or the iteration would jump across stick for ever. Returns the number of nodes under
    force and the largest creep velocity of a sticking node, infinite when a node has
    changed between stick and slip.
    """
    s = p.system
    n, m = s.Tx.shape
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    count, creep = 0, 0.0
    for j in range(n):
        force[j] = 0.0
        x, height, x_rate, height_rate = node_motion(j, Y, s)
        xi = s.abscissa[j] + x - travel
        ground, slope, curvature = ground_at(s.profile)(xi, s.profile_parameters)
        slip = x_rate - speed
        F, F_u, F_v = normal_at(s.normal[j])(ground - height - s.gap[j],
                                             slope * slip - height_rate, s.normal_parameters[j])
        if F == 0.0:
            continue
        along = g * (F_u * slope + F_v * curvature * slip) + F_v * slope
        away = -g * F_u - F_v
        pressing = abs(F)
        sign = 1.0 if F >= 0.0 else -1.0
        pressing_along, pressing_away = sign * along, sign * away
        if s.friction_scale != 0:
            scale, scale_x, _ = ground_at(s.friction_scale)(xi, s.friction_scale_parameters)
            pressing_along = scale * pressing_along + g * scale_x * pressing
            pressing_away *= scale
            pressing *= scale
        limit = p.static[j] * pressing
        if p.static[j] < 0.0:
            limit = friction_at(s.friction[j])(CREEP, pressing, s.friction_parameters[j])[0]
        trial = multiplier[j] + grip[j] * slip
        turned = trial if abs(trial) > limit else 0.0
        if turning == KEPT:
            turned = side[j]
        if turned == 0.0 or (turning == HESITANT and turned * side[j] < 0.0):
            R, R_along, R_away = trial, grip[j], 0.0
            creep = max(creep, abs(slip)) if turned == side[j] == 0.0 else math.inf
            side[j] = 0.0
        else:
            sense = 1.0 if turned > 0.0 else -1.0
            if side[j] != sense:
                creep = math.inf
            side[j] = sense
            R, R_v, R_F = friction_at(s.friction[j])(sense * max(sense * slip, CREEP), pressing,
                                                     s.friction_parameters[j])
            if sense * slip < 0.0:
                creep = max(creep, abs(slip))
                R_v = 0.0
            R_along, R_away = R_v + R_F * pressing_along, R_F * pressing_away
        force[j] = R
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            balance[i] += ty * F - tx * R
            active[0, count, i], active[1, count, i] = tx, ty
            gradients[0, count, i] = R_along * tx + R_away * ty
            gradients[1, count, i] = -along * tx - away * ty
        count += 1
    return count, creep


@helper
def _residual(  # type: ignore[no-untyped-def]
        t, g, start, known, Y, p, grip, multiplier, side, turning, force, room, balance,
        residual):
    """What is left of the equations of a stage, with places and contact at the velocities in Y."""
    m = len(start)
    for i in range(m):
        Y[i] = start[i] + g * Y[m + i]
    free_acceleration(t, Y, p.system, balance)
    count, creep = _linearise(t, Y, g, p, grip, multiplier, side, turning, force, room[:2],
                              room[2:], balance)
    for i in range(m):
        residual[i] = known[i] + g * balance[i] - Y[m + i]
    return count, creep


@helper
def _stage(  # type: ignore[no-untyped-def]
        t, g, start, known, Y, p, grip, multiplier, side, force, room, linear,
        system_matrix, floor, rtol, finest):
    """Solve one stage for the velocities, Y[m : 2 m]; returns whether that succeeded.

    ``start`` and ``known`` (m,) are Q_e and V_e, ``linear`` is 1 + g C + g^2 K. With given normal
    forces the equations are those of a convex minimum: when the sticking set is not found at
    once, each Newton step is shortened to where the minimum along it lies.
    """
    m = len(start)
    balance, residual = np.empty(m), np.empty(m)
    turning = KEPT
    for iteration in range(_ITERATIONS):
        count, _ = _residual(t, g, start, known, Y, p, grip, multiplier, side, turning, force,
                             room, balance, residual)
        turning = HESITANT if iteration < _HASTY else FREE
        system_matrix[:] = linear
        if count:
            Tx, Ty = room[2, :count].T, room[3, :count].T
            system_matrix += g * (np.dot(Tx, room[0, :count]) + np.dot(Ty, room[1, :count]))
        for i in range(m):
            if not math.isfinite(residual[i]):
                return False
        change = np.linalg.solve(system_matrix, residual)
        moved, downhill = 0.0, 0.0
        for i in range(m):
            downhill += residual[i] * change[i]
            Y[m + i] += change[i]
            moved = max(moved, abs(change[i]) / (rtol * (floor[m + i] + abs(Y[m + i]))))
        if moved <= 1e-2:
            _, creep = _residual(t, g, start, known, Y, p, grip, multiplier, side, turning, force,
                                 room, balance, residual)
            if creep <= finest:
                return True
            if creep < math.inf:
                # The creep belongs to the old multiplier and must not count again with the new.
                multiplier[:] = force
                turning = KEPT
        elif turning == FREE:
            low, high, part = 0.0, 1.0, 1.0
            for _ in range(40):
                _residual(t, g, start, known, Y, p, grip, multiplier, side, FREE, force, room,
                          balance, residual)
                uphill = 0.0
                for i in range(m):
                    uphill -= residual[i] * change[i]
                if abs(uphill) <= 0.1 * abs(downhill) or (part == 1.0 and uphill < 0.0):
                    break
                if uphill > 0.0:
                    high = part
                else:
                    low = part
                middle = 0.5 * (low + high)
                for i in range(m):
                    Y[m + i] += (middle - part) * change[i]
                part = middle
    return False


@helper
def _output(  # type: ignore[no-untyped-def]
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
                 integers, vector, i8, matrix, matrix, matrix))
def run_steps(  # type: ignore[no-untyped-def]
        clock, times, stops, p, rtol, longest, floor, Y, status, closed, counts, carried,
        limit, states, friction, normal):
    """Go on for at most ``limit`` steps, up to the last of ``times``.

    Arguments as for :func:`fecontact.integrate.set_valued_events.run_events`; ``carried`` is the
    largest slip velocity so far, two unused numbers and the friction force (n,) of each node.
    """
    s = p.system
    n, m = s.Tx.shape
    size = len(Y)
    w = workspace(p)
    room = np.empty((4, n, m))
    linear, system_matrix = np.empty((m, m)), np.empty((m, m))
    stage_states, accelerations = np.empty((3, 2 * m)), np.empty((3, m))
    rates, new = np.empty((3, EFFORTS + n)), np.empty(size)
    start, known = np.empty(m), np.empty(m)
    before, after = np.empty(size - m), np.empty(size - m)
    grip, multiplier, stage_force = np.empty(n), np.empty(n), np.empty((3, n))
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
    in_a_row, known_before = 0, False

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
        g = GAMMA * length
        counts[STEPS] += 1
        observe(t, Y, p, w.nodes)
        quick = carried[0] + abs(signal_at(s.ground_motion)(t, s.ground_motion_parameters)[1])
        for i in range(m):
            for k in range(m):
                linear[i, k] = g * s.damping[i, k] + g * g * s.stiffness[i, k]
            linear[i, i] += 1.0
        for j in range(n):
            # Of a force within its limit the rounding of the slip velocity may move no more.
            softest = inertia[j] * g / _GRIP
            if w.nodes[j, LIMIT] > 0.0:
                softest += _ROUNDING * quick / w.nodes[j, LIMIT]
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
            good = _stage(t + node * length, g, start, known, state, p, grip, multiplier, side,
                          stage_force[k], room, linear, system_matrix, floor, rtol, finest)
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
            moment = t + node * length
            observe(moment, stage_states[k], p, w.nodes)
            body_powers(moment, stage_states[k], s, rates[k])
            contact_powers(moment, s, w.nodes, stage_force[k], True, rates[k])
        for j in range(n):
            carried[0] = max(carried[0], abs(w.nodes[j, SLIP]))
        new[: 2 * m] = stage_states[2]
        for i in range(EFFORTS + n):
            new[2 * m + i] = Y[2 * m + i] + length * (
                B1 * rates[0, i] + B2 * rates[1, i] + GAMMA * rates[2, i])
        reached = goal if reaching else t + length
        after[:m] = accelerations[2]
        after[m:] = rates[2]
        if not known_before:
            before[:m] = accelerations[0]
            before[m:] = rates[0]
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
        in_a_row = 0
        h = length * min(8.0, max(0.3, 0.9 * max(worst, 1e-12) ** (-1.0 / 3.0)))
    clock[0], clock[1] = t, h
    return FINISHED if t >= end else GOING_ON
