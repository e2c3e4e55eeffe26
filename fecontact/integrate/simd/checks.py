"""Errors of a step, kinks ahead and forces that it may have missed, eight systems at once.

Checks and their limits are as in :mod:`fecontact.integrate.rodas5p.error_control`,
:func:`fecontact.integrate.rodas5p.dynamics.next_kink` and
:mod:`fecontact.integrate.polynomial_bounds`.
"""

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.vectors import (
    magnitude,
    mask_of,
    read,
    root,
    select,
    signed,
    spread,
    write,
)
from fecontact.integrate.polynomial_bounds import coefficient_range
from fecontact.integrate.rodas5p.driver import SLIP_PART as _SLIP_PART
from fecontact.integrate.rodas5p.tableau import STAGES
from fecontact.integrate.simd.arrays import (
    BY_PLACE,
    BY_RATE,
    FORCE,
    LEAST_SPEED,
    QUICKEST,
    RTOL,
    SPEED_SCALE,
)


@helper
def note_extremes(control, progress):
    """Take the state at the start of a step into the sizes so far."""
    m = len(progress.extremes)
    speed = read(progress.numbers[SPEED_SCALE])
    for i in range(m):
        write(progress.extremes[i], max(magnitude(read(progress.state[i])),
                                        read(progress.extremes[i])))
        speed = max(magnitude(read(progress.state[m + i])) * read(control.largest[i]), speed)
    write(progress.numbers[SPEED_SCALE], speed)


@helper
def state_error(control, progress, w):
    """Error of the state at the end of a step, as a multiple of the allowed error."""
    m = len(progress.extremes)
    error, finite = modal_error(w.stages[STAGES - 1], control, progress, w), ~mask_of(0)
    for k in range(2 * m):
        finite = finite & (magnitude(read(w.after[k])) < np.inf)
    return select(finite & (error < np.inf), error, np.inf)


@helper
def modal_error(difference, control, progress, w):
    """Largest entry of a difference of modal states, as a multiple of the allowed error."""
    m, error = len(progress.extremes), spread(0.0)
    per_speed = 1.0 / max(read(control.numbers[LEAST_SPEED]), read(progress.numbers[SPEED_SCALE]))
    for i in range(m):
        scale = max(read(control.displacement_scale[i]),
                    max(magnitude(read(w.after[i])), read(progress.extremes[i])))
        error = max(magnitude(read(difference[i])) / scale, error)
        error = max(magnitude(read(difference[m + i])) * read(control.largest[i]) * per_speed,
                    error)
    return error / read(control.numbers[RTOL])


@helper
def slip_error(error, speed, s, control, w):
    """The larger of the error and that of the slip velocities at the end of the step."""
    n, m = s.rows.shape[0], s.rows.shape[2]
    difference = w.stages[STAGES - 1]
    for j in range(n):
        slip = spread(0.0)
        for i in range(m):
            slip += read(s.rows[j, 0, i]) * read(difference[m + i])
        distance = magnitude(read(w.speeds[j]) - read(s.sliding[j, 0, 0]) * speed)
        part = magnitude(slip) / (_SLIP_PART * (read(control.slip_scale[j]) + distance))
        touching = magnitude(read(w.forces[j, FORCE])) > 0.0
        error = select(touching & (part > error), part, error)
    return error


@helper
def _crossing(u, v, a, within):
    """Smallest positive root of u + v t + a t^2 / 2, or ``within`` if that is earlier."""
    q = -(v + signed(root(v * v - 2.0 * a * u), v))
    one, other = q / a, 2.0 * u / q
    within = select((one > 0.0) & (one < within), one, within)
    return select((other > 0.0) & (other < within), other, within)


@routine
def next_kink(s, control, progress, within):
    """Time until forces of a node change their character, or ``within`` if later."""
    n, m = s.rows.shape[0], s.rows.shape[2]
    speed = read(progress.ground)
    first = within
    for j in range(n):
        x, y = spread(0.0), spread(0.0)
        for i in range(m):
            x += read(s.rows[j, 0, i]) * read(progress.rate[m + i])
            y += read(s.rows[j, 1, i]) * read(progress.rate[m + i])
        u, v, a = -read(progress.places[n + j]) - read(s.gap[j]), -read(progress.speeds[n + j]), -y
        first = _crossing(u, v, a, first)
        first = _crossing(u - read(control.depth[j]), v, a, first)
        force = read(progress.forces[j, FORCE])
        pressed = force > 0.0
        fall = (read(progress.forces[j, BY_PLACE]) * v + read(progress.forces[j, BY_RATE]) * a)
        lift = -force / fall
        first = select(pressed & (fall < 0.0) & (lift < first), lift, first)
        slip = read(progress.speeds[j]) - read(s.sliding[j, 0, 0]) * speed
        towards = select(slip > 0.0, -x, x)
        slow, size = read(control.slow[j]), magnitude(slip)
        stop = (size - slow) / towards
        first = select(pressed & (size > 1.5 * slow) & (towards > 0.0) & (stop < first), stop,
                       first)
    return first


@helper
def _course(rows, first_row, dense):
    """The three inner coefficients of a node's interpolant; without its ends."""
    k1, k2, k3 = spread(0.0), spread(0.0), spread(0.0)
    for i in range(len(rows)):
        shape = read(rows[i])
        k1 += shape * read(dense[0, first_row + i])
        k2 += shape * read(dense[1, first_row + i])
        k3 += shape * read(dense[2, first_row + i])
    return k1, k2, k3


@routine
def may_switch(h, s, control, progress, w):
    """Lanes, one bit each, in which a contact may have changed unnoticed within the step."""
    n, m = s.rows.shape[0], s.rows.shape[2]
    speed = read(progress.ground)
    some = mask_of(0)
    for j in range(n):
        spread_ = magnitude(read(s.sliding[j, 0, 0])) * read(control.numbers[QUICKEST]) * h
        k1, k2, k3 = _course(s.rows[j, 1], 0, w.dense)
        first, last = read(progress.places[n + j]), read(w.places[n + j])
        low, high, monotone = coefficient_range(first, last, k1, k2, k3)
        nearer = min(last, first)
        touching = magnitude(read(w.forces[j, FORCE])) > 0.0
        for level in range(len(control.levels)):
            shift = read(s.gap[j]) + read(control.levels[level, j])
            at_ends = 2.0 * min(spread(0.0), nearer + shift)
            bottom = low + shift
            mixed = (bottom < 0.0) & (high + shift > 0.0)
            some = some | ((mixed | (bottom < at_ends)) & ~monotone)
            touching = touching | (bottom < 0.0) | mask_of(-1 if level > 0 else 0)
        k1, k2, k3 = _course(s.rows[j, 0], m, w.dense)
        passing = read(s.sliding[j, 0, 0]) * speed
        first, last = read(progress.speeds[j]) - passing, read(w.speeds[j]) - passing
        low, high, monotone = coefficient_range(first, last, k1, k2, k3)
        largest = max(high, -low) + spread_
        width = read(control.slip_scale[j])
        mixed = (low < spread_) & (high > -spread_) & (largest > width)
        at_ends = 2.0 * max(width, max(magnitude(last), magnitude(first))) + spread_
        some = some | (touching & (mixed | (largest > at_ends)) & ~(monotone & (spread_ == 0.0)))
    return some
