"""Compiled search of a step's interpolation for the first change of a cluster or a stop.

Heights and slip velocities on the interpolation are polynomials, whose Bernstein coefficients
bound them: what stays clear of its margin needs no further look, and a crossing is found by
halving, however short. Waves under a node and the speed of the ground go in as polynomials of the
same degree, through places so close that nothing is lost between them.

Forces of sticking clusters and of closed stops are evaluated at a few places; the polynomial
through these, less its last part, which tells how far it can be trusted, bounds them in the same
way. A part of the step that this leaves open is halved and looked at again.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import borrowed, f8, helper, integers, kernel, matrix, vector
from fecontact.core.types import Array
from fecontact.integrate.bernstein import (
    DEPTH,
    FINEST,
    NOWHERE,
    first_below,
    fit,
    from_nested,
    largest,
    smallest,
    split,
    value,
)
from fecontact.integrate.nonsmooth.dop853 import PARTS, SLOPES, interpolate
from fecontact.integrate.nonsmooth.equations import derivative
from fecontact.integrate.nonsmooth.problem import (
    FORCE,
    OPEN,
    PROBLEM,
    STICK,
    WORKSPACE,
    NonsmoothProblem,
)
from fecontact.laws.signatures import ground_at, normal_at, signal_at

# Rounding of a sum, and of forces that come from a system of equations, relative to their parts.
_ROUNDING, _FORCE_ROUNDING = 2e-15, 1e-13
# Part of the shortest wave that a node may pass in a step, for the polynomial through the places.
_WAVE = 0.25
_PLACES = 0.5 - 0.5 * np.cos(np.pi * np.arange(PARTS + 1) / PARTS)
_PLACES[-1] = 1.0
_FIT = fit(_PLACES)
# Forces are looked at in quarters of a part of the step.
_QUARTERS = 4
_FIT_QUARTERS = fit(np.arange(_QUARTERS + 1) / _QUARTERS)
# Size of the part of degree four over its fourth difference, 1 / (128 * 4! / 4^4).
_LAST = 1.0 / 12.0
_SHORTEST = 2.0**-8
# A contact whose force grows so much between the ends of a step was not felt by its stages.
UNFELT = 10.0
ROUGHLY = 2.0**-12


class Room(NamedTuple):
    """Room to work in for steps from event to event, and for the search in them.

    Attributes
    ----------
    slopes, parts : (SLOPES, size), (PARTS, size) arrays
        Slopes of a step, and the coefficients of its interpolation.
    new, state, rate : (size,) arrays
        The end of a step; a state within it and its slope.
    place : (k + n,) array
        Where each cluster and stop first changes.
    nested, bound, along, values : (PARTS + 1,) arrays
        Polynomials of one node over the step.
    halves : (DEPTH, PARTS + 2) array
        Parts of the step that are left to look at.
    left, scale : (_QUARTERS + 1, 2 k + n), (2 k + n,) arrays
        What forces have left at some places, and their sizes.
    waiting : (DEPTH, 2) array
        Begins and widths of parts whose forces are left to look at.
    """

    slopes: Array
    parts: Array
    new: Array
    state: Array
    rate: Array
    place: Array
    nested: Array
    bound: Array
    along: Array
    values: Array
    halves: Array
    left: Array
    scale: Array
    waiting: Array


ROOM = types.NamedTuple([matrix] * 2 + [vector] * 8 + [matrix] * 2 + [vector, matrix], Room)


def room_for(problem: NonsmoothProblem, size: int) -> Room:
    """Room for a problem whose state is of this size."""
    n, k = len(problem.cluster), len(problem.rows)
    new, state, rate = np.zeros((3, size))
    nested, bound, along, values = np.zeros((4, PARTS + 1))
    return Room(np.zeros((SLOPES, size)), np.zeros((PARTS, size)), new, state, rate,
                np.zeros(k + n), nested, bound, along, values, np.zeros((DEPTH, PARTS + 2)),
                np.zeros((_QUARTERS + 1, 2 * k + n)), np.zeros(2 * k + n), np.zeros((DEPTH, 2)))


@helper
def _along(rows, j, first, Y, parts, c, b):
    """Coefficients b of ``rows[j] Y[first:]`` over the step; returns the size of its terms."""
    size = 0.0
    c[:] = 0.0
    for i in range(rows.shape[1]):
        row = rows[j, i]
        c[0] += row * Y[first + i]
        size += abs(row) * (abs(Y[first + i]) + abs(parts[0, first + i]))
        for k in range(PARTS):
            c[1 + k] += row * parts[k, first + i]
    from_nested(c, b)
    return size


@helper
def _through(values, b):
    """Add to b the polynomial through values at the places."""
    for k in range(len(b)):
        for i in range(len(values)):
            b[k] += _FIT[k, i] * values[i]


@helper
def _slip(k, sign, t, h, Y, parts, p, c, b, values):
    """Coefficients b of ``sign`` times the slip velocity of cluster k, raised by its rounding."""
    s = p.system
    size = _along(p.rows, k, s.Tx.shape[1], Y, parts, c, b)
    speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)[1]
    if p.steady != 0:
        for i in range(len(b)):
            b[i] -= speed
    else:
        for i in range(len(b)):
            values[i] = -signal_at(s.ground_motion)(t + _PLACES[i] * h,
                                                    s.ground_motion_parameters)[1]
            speed = max(abs(speed), abs(values[i]))
        _through(values, b)
    for i in range(len(b)):
        b[i] = sign * b[i] + _ROUNDING * (size + abs(speed))


@helper
def _add_ground(j, t, h, Y, parts, p, c, b, x, values):
    """Add the ground under node j to b; returns the part of the step that resolves its waves."""
    s = p.system
    if p.relief[2] == np.inf:
        for i in range(len(b)):
            b[i] += p.relief[0]
        return 1.0
    _along(s.Tx, j, 0, Y, parts, c, x)
    low, high = np.inf, -np.inf
    for i in range(len(x)):
        travel = signal_at(s.ground_motion)(t + _PLACES[i] * h, s.ground_motion_parameters)[0]
        xi = s.abscissa[j] + value(x, _PLACES[i], c) - travel
        low, high = min(low, xi), max(high, xi)
        values[i] = ground_at(s.profile)(xi, s.profile_parameters)[0]
    _through(values, b)
    return _WAVE * p.relief[2] / max(high - low, _WAVE * p.relief[2])


@helper
def pressed(u, j, s):
    """Magnitude of the elastic normal force of node j at penetration u."""
    return abs(normal_at(s.normal[j])(u, 0.0, s.normal_parameters[j])[0])


@helper
def first_pressed(b, above, finest, j, s, room):
    """Where the penetration with coefficients b first makes a force above a bound.

    To a part ``finest`` of the step, the later end of it; the law's force must not fall while
    penetration grows, into the ground or into a stop above.
    """
    n = len(b)
    for i in range(n):
        room[0, i] = b[i]
    room[0, n] = 1.0
    waiting, begin = 1, 0.0
    while waiting > 0:
        part, width = room[waiting - 1, :n], room[waiting - 1, n]
        if pressed(part[0], j, s) > above:
            return begin
        clear = max(pressed(smallest(part), j, s), pressed(largest(part), j, s)) <= above
        if not clear and width > finest:
            split(part, room[waiting, :n])
            # The right half stays below, the left one comes on top.
            room[waiting - 1, n] = room[waiting, n] = 0.5 * width
            waiting += 1
            continue
        begin += width
        if not clear and pressed(part[n - 1], j, s) > above:
            return begin
        waiting -= 1
    return NOWHERE


@helper
def _forces(t, latest, h, part, Y, parts, p, status, closed, w, state, rate, out):
    """Fill out (2 k + n,) with what sticking clusters and closed stops have left, both ways."""
    interpolate(part, Y, parts, state)
    derivative(min(t + part * h, latest), state, p, status, closed, w, rate)
    clusters = len(p.rows)
    out[:] = 1.0
    for k in range(clusters):
        if status[k] == STICK:
            inside = w.pressing[k] > 0.0
            out[k] = w.limit[k] - w.total[k] if inside else -1.0
            out[clusters + k] = w.limit[k] + w.total[k] if inside else -1.0
        elif status[k] == OPEN:
            out[k] = -1.0 if w.pressing[k] > 0.0 else 1.0
    for j in range(len(closed)):
        if closed[j]:
            out[2 * clusters + j] = w.nodes[j, FORCE]


@helper
def _past(out, size):
    past = False
    for r in range(len(out)):
        past = past or out[r] < -_FORCE_ROUNDING * size[r]
    return past


@helper
def _first_let_go(t, latest, h, end, Y, p, status, closed, w, room):
    """Note where sticking clusters and closed stops first let go, up to the part ``end``."""
    clusters, count = len(p.rows), 2 * len(p.rows) + len(closed)
    parts, state, rate, left, size = room.parts, room.state, room.rate, room.left, room.scale
    size[:] = 0.0
    room.waiting[0, 0], room.waiting[0, 1], waiting = 0.0, end, 1
    while waiting > 0:
        begin, width = room.waiting[waiting - 1, 0], room.waiting[waiting - 1, 1]
        low, high = 0.0, NOWHERE
        for i in range(_QUARTERS + 1):
            here = begin + width * i / _QUARTERS
            _forces(t, latest, h, here, Y, parts, p, status, closed, w, state, rate, left[i])
            for r in range(count):
                size[r] = max(size[r], abs(left[i, r]))
            if i > 0 and _past(left[i], size):
                low, high = begin + width * (i - 1) / _QUARTERS, here
                break
        if high <= 1.0:
            for _ in range(60):
                middle = 0.5 * (low + high)
                if middle <= low or middle >= high:
                    break
                _forces(t, latest, h, middle, Y, parts, p, status, closed, w, state, rate,
                        left[0])
                if _past(left[0], size):
                    high = middle
                else:
                    low = middle
            _forces(t, latest, h, high, Y, parts, p, status, closed, w, state, rate, left[0])
            for r in range(count):
                if left[0, r] < -_FORCE_ROUNDING * size[r]:
                    room.place[r if r < clusters else r - clusters] = high
            return
        clear = True
        for r in range(count):
            last = _LAST * abs(left[0, r] - 4.0 * left[1, r] + 6.0 * left[2, r]
                               - 4.0 * left[3, r] + left[4, r])
            for k in range(_QUARTERS + 1):
                bound = -last
                for i in range(_QUARTERS + 1):
                    bound += _FIT_QUARTERS[k, i] * left[i, r]
                clear = clear and bound >= -_FORCE_ROUNDING * size[r]
        if not clear and width > _SHORTEST * end:
            room.waiting[waiting, 0], room.waiting[waiting - 1, 0] = begin, begin + 0.5 * width
            room.waiting[waiting, 1] = room.waiting[waiting - 1, 1] = 0.5 * width
            waiting += 1
        else:
            waiting -= 1


@kernel(types.f8(f8, f8, f8, vector, PROBLEM, integers, integers, WORKSPACE, vector, f8, ROOM))
def first_changes(
    t, latest, h, held_Y, held_p, held_status, held_closed, held_w, held_floor, rtol, held_room,
):
    """Fill ``room.place`` with the part of a step at which each cluster and stop first changes.

    ``room.parts`` is the interpolation of the step. NOWHERE for those that do not change. Of what
    comes after the first change nothing is promised.
    Returns the part to which the step has to be shortened because it passes a contact that its
    stages have not felt, or waves too short for it; 1 if it has not.
    """
    Y, p, w, floor = borrowed(held_Y), borrowed(held_p), borrowed(held_w), borrowed(held_floor)
    status, closed, room = borrowed(held_status), borrowed(held_closed), borrowed(held_room)
    s, parts, place, halves = p.system, room.parts, room.place, room.halves
    c, b, x, values = room.nested, room.bound, room.along, room.values
    n, m = s.Tx.shape
    clusters = len(p.rows)
    place[:] = NOWHERE
    first, shorter, forces = 1.0, 1.0, False
    if p.restitution >= 0.0:
        for j in range(n):
            if closed[j]:
                forces = True
                continue
            size = _along(s.Ty, j, 0, Y, parts, c, b)
            size += s.gap[j] + max(abs(p.relief[0]), abs(p.relief[1]))
            for i in range(len(b)):
                b[i] = -b[i] - s.gap[j]
            if largest(b) + p.relief[1] < 0.0:
                continue
            shorter = min(shorter, _add_ground(j, t, h, Y, parts, p, c, b, x, values))
            for i in range(len(b)):
                b[i] = _ROUNDING * size - b[i]
            place[clusters + j] = first_below(b, halves)
            first = min(first, place[clusters + j])
    else:
        for k in range(clusters):
            if status[k] == STICK:
                forces = True
            elif status[k] == 1 or status[k] == -1:
                _slip(k, float(status[k]), t, h, Y, parts, p, c, b, values)
                place[k] = first_below(b, halves)
                first = min(first, place[k])
        for j in range(n):
            _along(s.Ty, j, 0, Y, parts, c, b)
            depth = 0.0
            for i in range(m):
                depth = max(depth, abs(s.Ty[j, i]) * floor[i])
            for i in range(len(b)):
                b[i] = -b[i] - s.gap[j]
            if (pressed(smallest(b) + p.relief[0], j, s) == 0.0
                and pressed(largest(b) + p.relief[1], j, s) == 0.0):
                continue
            part = _add_ground(j, t, h, Y, parts, p, c, b, x, values)
            before = pressed(b[0], j, s)
            if status[p.cluster[j]] == OPEN:
                if before == 0.0:
                    shorter = min(shorter, part)
                    touch = first_pressed(b, 0.0, FINEST, j, s, halves)
                    place[p.cluster[j]] = min(place[p.cluster[j]], touch)
                    first = min(first, touch)
                else:
                    forces = True
                continue
            above = UNFELT * max(before, pressed(b[PARTS], j, s)) + pressed(
                0.01 * rtol * depth, j, s)
            if max(pressed(smallest(b), j, s), pressed(largest(b), j, s)) > above:
                shorter = min(shorter, part, first_pressed(b, above, ROUGHLY, j, s, halves))
    if forces:
        _first_let_go(t, latest, h, first, Y, p, status, closed, w, room)
    return shorter
