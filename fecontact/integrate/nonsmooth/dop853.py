"""Compiled steps of the explicit Runge-Kutta method of Dormand and Prince of order 8.

References
----------
E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.5 (the
method), section II.6 (its interpolation of order 7).
"""

import math

import numpy as np
from scipy.integrate import DOP853

from fecontact.core.compiled import helper, routine
from fecontact.integrate.nonsmooth.equations import set_powers, set_rates

A, B, C = (np.ascontiguousarray(table) for table in (DOP853.A, DOP853.B, DOP853.C))
ERROR_5, ERROR_3 = np.ascontiguousarray(DOP853.E5), np.ascontiguousarray(DOP853.E3)
A_DENSE, C_DENSE = np.ascontiguousarray(DOP853.A_EXTRA), np.ascontiguousarray(DOP853.C_EXTRA)
DENSE = np.ascontiguousarray(DOP853.D)
STAGES = len(B)
SLOPES = STAGES + 1 + len(A_DENSE)
PARTS = 3 + len(DENSE)
# The first stages, which combine the second and third slopes, unlike those after them.
_FIRST = 5


@routine
def take(step, p, progress, w, workspace):
    """Put the state at the end of a step into ``workspace.new``.

    slopes[0] of ``workspace.slopes`` (SLOPES, size) is Y' at its begin, slopes[STAGES] becomes that
    at its end; all have to be finite. Works enter no stage, only the end.
    """
    Y, slopes, new = progress.state, workspace.slopes, workspace.new
    m, h = p.rows.shape[1], step.h
    for stage in range(1, STAGES):
        # Sums are written out; slopes that a stage does not combine have the factor zero.
        a = A[stage]
        for i in range(2 * m):
            total = a[0] * slopes[0, i] + a[3] * slopes[3, i]
            if stage < _FIRST:
                total += a[1] * slopes[1, i] + a[2] * slopes[2, i]
            else:
                total += (a[4] * slopes[4, i] + a[5] * slopes[5, i] + a[6] * slopes[6, i]
                          + a[7] * slopes[7, i] + a[8] * slopes[8, i] + a[9] * slopes[9, i]
                          + a[10] * slopes[10, i])
            new[i] = Y[i] + h * total
        set_rates(min(step.t + C[stage] * h, step.latest), new, p, progress, w, slopes[stage])
        if B[stage] != 0.0:
            set_powers(new, p, progress, w, slopes[stage, 2 * m :])
    for i in range(len(Y)):
        new[i] = Y[i] + h * _combined(B, slopes, i)
    set_rates(min(step.t + h, step.latest), new, p, progress, w, slopes[STAGES])
    set_powers(new, p, progress, w, slopes[STAGES, 2 * m :])


@helper
def _combined(row, slopes, i):
    """Sum of the slopes that enter the end of a step, with the factors in a row of a table."""
    return (row[0] * slopes[0, i] + row[5] * slopes[5, i] + row[6] * slopes[6, i]
            + row[7] * slopes[7, i] + row[8] * slopes[8, i] + row[9] * slopes[9, i]
            + row[10] * slopes[10, i] + row[11] * slopes[11, i])


@helper
def error(h, Y, limits, workspace):
    """Error of a step in units of what is allowed, ``rtol (floor + |Y|)``, the largest of all."""
    new, slopes, rtol, floor = workspace.new, workspace.slopes, limits.rtol, limits.floor
    fifth, third, finite = 0.0, 0.0, True
    for i in range(len(Y)):
        allowed = 1.0 / (rtol * (floor[i] + max(abs(Y[i]), abs(new[i]))))
        fifth = max(fifth, abs(_combined(ERROR_5, slopes, i)) * allowed)
        third = max(third, abs(_combined(ERROR_3, slopes, i)) * allowed)
        finite = finite and math.isfinite(new[i])
    if not finite:
        return math.inf
    if fifth == 0.0:
        return 0.0
    # A ratio, for squares of tiny errors vanish.
    return h * fifth / math.hypot(1.0, 0.1 * third / fifth)


@helper
def shortened(length, size_of_error):
    """Length of the next attempt at a step with too large an error."""
    if math.isfinite(size_of_error):
        return length * max(0.2, 0.9 * size_of_error**-0.125)
    return length * 0.1


@routine
def prepare_dense(step, p, progress, w, workspace):
    """Fill ``workspace.parts`` (PARTS, size) for `interpolate`; needs three more slopes."""
    t, h, Y = step.t, step.h, progress.state
    new, slopes, parts, state = workspace.new, workspace.slopes, workspace.parts, workspace.state
    m = p.rows.shape[1]
    for extra in range(len(A_DENSE)):
        stage, row = STAGES + 1 + extra, A_DENSE[extra]
        for i in range(2 * m):
            state[i] = Y[i] + h * (
                _combined(row, slopes, i) + row[12] * slopes[12, i] + row[13] * slopes[13, i]
                + row[14] * slopes[14, i])
        set_rates(t + C_DENSE[extra] * h, state, p, progress, w, slopes[stage])
        set_powers(state, p, progress, w, slopes[stage, 2 * m :])
    for i in range(len(Y)):
        change = new[i] - Y[i]
        parts[0, i] = change
        parts[1, i] = h * slopes[0, i] - change
        parts[2, i] = 2.0 * change - h * (slopes[STAGES, i] + slopes[0, i])
    for k in range(len(DENSE)):
        row = DENSE[k]
        for i in range(len(Y)):
            parts[3 + k, i] = h * (
                _combined(row, slopes, i) + row[12] * slopes[12, i] + row[13] * slopes[13, i]
                + row[14] * slopes[14, i] + row[15] * slopes[15, i])


@helper
def interpolate(theta, Y, parts, out):
    """State at the part theta of the step, or as much of it as there is room for in ``out``."""
    rest = 1.0 - theta
    for i in range(len(out)):
        out[i] = Y[i] + theta * (parts[0, i] + rest * (parts[1, i] + theta * (
            parts[2, i] + rest * (parts[3, i] + theta * (parts[4, i] + rest * (
                parts[5, i] + theta * parts[6, i]))))))
