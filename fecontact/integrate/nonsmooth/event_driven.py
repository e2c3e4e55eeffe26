"""Compiled run from event to event, of order 8, for contact with few independent slip velocities.

Between events the sticking clusters and the closed stops are constraints. A step in which a
cluster or a stop goes past its margin is cut at the moment where that begins, found in the
step's interpolation to the last digits, and repeated with the shorter length.
"""

import math

import numpy as np
from numba import types

from fecontact.core.compiled import borrowed, f8, i8, integers, kernel, matrix, vector
from fecontact.integrate.nonsmooth.dop853 import (
    STAGES,
    error,
    interpolate,
    prepare_dense,
    step,
)
from fecontact.integrate.nonsmooth.equations import derivative
from fecontact.integrate.nonsmooth.event_search import ROOM, first_changes
from fecontact.integrate.nonsmooth.problem import (
    DIVERGED,
    EVENTS,
    FINISHED,
    FORCE,
    GOING_ON,
    IMPACTS,
    OUTPUTS,
    PENETRATION,
    PROBLEM,
    RATE,
    REJECTED,
    STARTED,
    STEPS,
    STICK,
    STUCK,
    WORKSPACE,
)
from fecontact.integrate.nonsmooth.transitions import (
    decide_clusters,
    hold_velocity,
    resolve_impacts,
)
from fecontact.system.kernels import drive_jump

# What has just begun to move and turns back in this part of a step is looked at more closely.
EARLY = 0.25


@kernel(types.i8(vector, vector, vector, PROBLEM, f8, f8, vector, vector, integers, integers,
                 integers, vector, i8, matrix, matrix, matrix, WORKSPACE, ROOM))
def run_events(
    clock, held_times, stops, held_p, rtol, longest, held_floor, held_Y, held_status, held_closed,
    counts, largest, limit, held_states, held_friction, held_normal, held_w, held_room,
):
    """Go on for at most ``limit`` steps, up to the last of ``times``.

    ``clock`` is the time reached and the length of the next step; ``stops`` ascending times at
    which a step ends; ``largest`` the largest slip velocity, penetration rate and penetration so
    far. ``states`` (N, size), ``friction`` and ``normal`` (N, n) are filled as ``counts`` says.
    """
    times, p, floor, Y = borrowed(held_times), borrowed(held_p), borrowed(held_floor), borrowed(
        held_Y)
    status, closed, w = borrowed(held_status), borrowed(held_closed), borrowed(held_w)
    states, friction, normal = (borrowed(held_states), borrowed(held_friction),
                                borrowed(held_normal))
    room = borrowed(held_room)
    slopes, parts, new, rate, place = room.slopes, room.parts, room.new, room.rate, room.place
    n = len(p.cluster)
    clusters, m, size = len(p.rows), p.rows.shape[1], len(Y)
    rigid = p.restitution >= 0.0
    past = np.zeros(clusters + n, np.bool_)
    fresh = np.zeros(clusters + n, np.bool_)
    released, held = np.zeros(clusters, np.bool_), np.zeros(clusters, np.bool_)
    arrived = np.zeros(clusters, np.bool_)
    touched, parting = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    t, h, end = clock[0], clock[1], times[-1]
    tiny = 1e-14 * max(abs(times[0]), abs(end), longest)
    stop = 0
    while stop < len(stops) and stops[stop] <= t:
        stop += 1
    idle = 0

    if counts[STARTED] == 0:
        counts[STARTED] = 1
        derivative(t, Y, p, status, closed, w, rate)
        if rigid:
            height = 0.0
            for j in range(n):
                touched[j] = w.nodes[j, PENETRATION] >= 0.0
                height = max(height, abs(w.nodes[j, PENETRATION]))
                largest[1] = max(largest[1], abs(w.nodes[j, RATE]))
            resolve_impacts(t, Y, p, touched, parting, 1e-9 * largest[1], height,
                            1e-9 * longest, status, closed, fresh[clusters:], w, rate)
        else:
            for c in range(clusters):
                largest[0] = max(largest[0], abs(w.slip[c]))
            decide_clusters(t, Y, p, released, arrived, 1e-12 * largest[0], status,
                            fresh[:clusters], closed, w, rate)
    while counts[OUTPUTS] < len(times) and times[counts[OUTPUTS]] <= t:
        derivative(t, Y, p, status, closed, w, rate)
        row = counts[OUTPUTS]
        states[row], friction[row] = Y, w.friction
        normal[row] = w.nodes[:, FORCE]
        counts[OUTPUTS] += 1

    derivative(t, Y, p, status, closed, w, slopes[0])
    for _ in range(limit):
        if t >= end:
            break
        goal = end
        if stop < len(stops):
            goal = min(goal, stops[stop])
        left = goal - t
        reaching = h >= left * (1.0 - 1e-10)
        length = left if reaching else min(h, longest)
        length = min(length, longest)
        reaching = reaching and length == left
        # At the end of a step that ends at a break, signals are as before the break.
        latest = np.nextafter(goal, t)
        step(t, latest, length, Y, p, status, closed, w, slopes, new)
        size_of_error = error(length, Y, new, slopes, rtol, floor)
        counts[STEPS] += 1
        if not size_of_error <= 1.0:
            counts[REJECTED] += 1
            if not math.isfinite(size_of_error) and length < 1e-6 * longest:
                clock[0], clock[1] = t, length
                return DIVERGED
            h = length * (max(0.2, 0.9 * size_of_error**-0.125)
                          if math.isfinite(size_of_error) else 0.1)
            if h < tiny:
                clock[0], clock[1] = t, h
                return STUCK
            continue
        quick, fast, deep = largest[0], largest[1], largest[2]
        for c in range(clusters):
            quick = max(quick, abs(w.slip[c]))
        for j in range(n):
            fast, deep = max(fast, abs(w.nodes[j, RATE])), max(deep, abs(w.nodes[j, PENETRATION]))
        prepare_dense(t, length, Y, new, p, status, closed, w, slopes, room.state, parts)

        shorter = first_changes(t, latest, length, Y, p, status, closed, w, floor, rtol, room)
        high, found, again = 1.0, False, False
        for k in range(clusters + n):
            found = found or place[k] <= 1.0
            high = min(high, place[k])
        if shorter < high and shorter * length > tiny:
            h = shorter * length
            counts[REJECTED] += 1
            continue
        for k in range(clusters + n):
            past[k] = found and place[k] <= high
            again = again or (past[k] and fresh[k] and high < EARLY)
        if again and length > tiny:
            # What has just begun to move cannot be told from its start: look at a shorter step.
            h = 0.2 * length
            counts[REJECTED] += 1
            continue
        if again:
            high = 0.0

        reached = t + high * length
        if not found and reaching:
            reached = goal
        while counts[OUTPUTS] < len(times) and (
                times[counts[OUTPUTS]] < reached
                or (not found and times[counts[OUTPUTS]] == reached)):
            row = counts[OUTPUTS]
            interpolate((times[row] - t) / length, Y, parts, states[row])
            derivative(times[row], states[row], p, status, closed, w, rate)
            friction[row], normal[row] = w.friction, w.nodes[:, FORCE]
            counts[OUTPUTS] += 1

        if not found:
            t = reached
            for i in range(size):
                Y[i] = new[i]
                slopes[0, i] = slopes[STAGES, i]
            passing = reaching and stop < len(stops) and goal == stops[stop]
            if passing:
                stop += 1
                work = drive_jump(latest, t, Y, p.system)
                Y[2 * m] += work
                if counts[OUTPUTS] > 0 and times[counts[OUTPUTS] - 1] == t:
                    states[counts[OUTPUTS] - 1, 2 * m] += work
            fresh[:] = False
            idle = 0
            h = length * min(5.0, max(0.5, 0.9 * max(size_of_error, 1e-12) ** -0.125))
            if length < h < 1.1 * length:
                h = length
            any_held = False
            for c in range(clusters):
                held[c] = status[c] == STICK
                any_held = any_held or held[c]
            largest[0], largest[1], largest[2] = quick, fast, deep
            if any_held:
                derivative(t, Y, p, status, closed, w, rate)
                hold_velocity(p, held, w, Y)
            if passing:
                derivative(t, Y, p, status, closed, w, slopes[0])
            continue

        idle = idle + 1 if high * length <= tiny else 0
        if idle > 200:
            clock[0], clock[1] = t, length
            return STUCK
        if high > 0.0:
            step(t, latest, high * length, Y, p, status, closed, w, slopes, new)
            for i in range(size):
                Y[i] = new[i]
            t = reached
        derivative(t, Y, p, status, closed, w, rate)
        h = min(max(0.1 * length, 1e3 * tiny), longest)
        # The repeated step may end, by its error, before what holds lets go: it holds on.
        held_on = not again
        for k in range(clusters + n):
            if past[k]:
                held_on = held_on and (
                    closed[k - clusters] == 1 and w.nodes[k - clusters, FORCE] > 0.0
                    if k >= clusters else status[k] == STICK and w.pressing[k] > 0.0
                    and abs(w.total[k]) < (1.0 - 1e-12) * w.limit[k])
        if not held_on:
            counts[EVENTS] += 1
        if held_on:
            for i in range(size):
                slopes[0, i] = rate[i]
        elif rigid:
            height = largest[2]
            for j in range(n):
                event = past[clusters + j]
                touched[j], parting[j] = event and closed[j] == 0, event and closed[j] == 1
                if touched[j]:
                    counts[IMPACTS] += 1
            flight = resolve_impacts(t, Y, p, touched, parting, 0.01 * rtol * largest[1], height,
                                     1e-9 * longest, status, closed, fresh[clusters:], w, slopes[0])
            h = min(h, max(0.5 * flight, tiny))
        else:
            for c in range(clusters):
                released[c] = past[c] and status[c] == STICK and w.pressing[c] > 0.0 and not again
                arrived[c] = past[c] and (status[c] == 1 or status[c] == -1)
                if released[c]:
                    status[c] = 1 if w.total[c] > 0.0 else -1
            decide_clusters(t, Y, p, released, arrived, 1e-9 * largest[0], status,
                            fresh[:clusters], closed, w, slopes[0])
        # Wherever the motion goes on from, an output at this moment shows what comes after.
        while counts[OUTPUTS] < len(times) and times[counts[OUTPUTS]] <= t:
            row = counts[OUTPUTS]
            states[row], friction[row] = Y, w.friction
            normal[row] = w.nodes[:, FORCE]
            counts[OUTPUTS] += 1
    clock[0], clock[1] = t, h
    return FINISHED if t >= end else GOING_ON


