"""Compiled steps of the explicit Runge-Kutta method of Dormand and Prince of order 8.

References
----------
E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.5 (the
method), section II.6 (its interpolation of order 7).
"""

import math

import numpy as np
from scipy.integrate import DOP853

from fecontact.core.compiled import helper
from fecontact.integrate.nonsmooth.equations import derivative

A, B, C = (np.ascontiguousarray(table) for table in (DOP853.A, DOP853.B, DOP853.C))
ERROR_5, ERROR_3 = np.ascontiguousarray(DOP853.E5), np.ascontiguousarray(DOP853.E3)
A_DENSE, C_DENSE = np.ascontiguousarray(DOP853.A_EXTRA), np.ascontiguousarray(DOP853.C_EXTRA)
DENSE = np.ascontiguousarray(DOP853.D)
STAGES = len(B)
SLOPES = STAGES + 1 + len(A_DENSE)
PARTS = 3 + len(DENSE)


@helper
def take(step, p, progress, w, room):
    """Put the state at the end of a step into ``room.new``.

    slopes[0] of ``room.slopes`` (SLOPES, size) is Y' at its begin, slopes[STAGES] becomes that at
    its end.
    """
    Y, slopes, new = progress.state, room.slopes, room.new
    size = len(Y)
    for stage in range(1, STAGES + 1):
        for i in range(size):
            total = 0.0
            if stage < STAGES:
                for k in range(stage):
                    total += A[stage, k] * slopes[k, i]
            else:
                for k in range(stage):
                    total += B[k] * slopes[k, i]
            new[i] = Y[i] + step.h * total
        node = C[stage] if stage < STAGES else 1.0
        derivative(min(step.t + node * step.h, step.latest), new, p, progress.status,
                   progress.closed, w, slopes[stage])


@helper
def error(h, Y, limits, room):
    """Error of a step in units of what is allowed, ``rtol (floor + |Y|)``, the largest of all."""
    new, slopes, rtol, floor = room.new, room.slopes, limits.rtol, limits.floor
    fifth, third = 0.0, 0.0
    for i in range(len(Y)):
        five, three = 0.0, 0.0
        for k in range(STAGES + 1):
            five += ERROR_5[k] * slopes[k, i]
            three += ERROR_3[k] * slopes[k, i]
        allowed = rtol * (floor[i] + max(abs(Y[i]), abs(new[i])))
        fifth = max(fifth, abs(five) / allowed)
        third = max(third, abs(three) / allowed)
        if not math.isfinite(new[i]):
            return math.inf
    if fifth == 0.0:
        return 0.0
    return h * fifth * fifth / math.sqrt(fifth * fifth + 0.01 * third * third)


@helper
def prepare_dense(step, p, progress, w, room):
    """Fill ``room.parts`` (PARTS, size) for `interpolate`; needs three more slopes."""
    t, h, Y = step.t, step.h, progress.state
    new, slopes, parts, state = room.new, room.slopes, room.parts, room.state
    size = len(Y)
    for extra in range(len(A_DENSE)):
        stage = STAGES + 1 + extra
        for i in range(size):
            total = 0.0
            for k in range(stage):
                total += A_DENSE[extra, k] * slopes[k, i]
            state[i] = Y[i] + h * total
        derivative(t + C_DENSE[extra] * h, state, p, progress.status, progress.closed, w,
                   slopes[stage])
    for i in range(size):
        change = new[i] - Y[i]
        parts[0, i] = change
        parts[1, i] = h * slopes[0, i] - change
        parts[2, i] = 2.0 * change - h * (slopes[STAGES, i] + slopes[0, i])
        for k in range(len(DENSE)):
            total = 0.0
            for stage in range(SLOPES):
                total += DENSE[k, stage] * slopes[stage, i]
            parts[3 + k, i] = h * total


@helper
def interpolate(theta, Y, parts, out):
    """State at the part theta of the step."""
    for i in range(len(Y)):
        total = 0.0
        for k in range(PARTS - 1, -1, -1):
            total += parts[k, i]
            total *= theta if (PARTS - 1 - k) % 2 == 0 else 1.0 - theta
        out[i] = Y[i] + total
