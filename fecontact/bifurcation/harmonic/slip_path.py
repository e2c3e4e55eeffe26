"""Slip path of a contact node over a period: a Fourier series, known between samples too.

The pressing force goes through its samples as a cubic spline of Catmull and Rom.
"""

import math
from typing import NamedTuple

from fecontact.core.compiled import borrowing, helper
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.system.nodes import ground_motion

# Steps and relative accuracy of places between samples.
_STEPS, _LOCATED = 60, 1e-15
# Part of a sample's distance over which the acceleration of the ground is taken.
_BESIDE = 0.125


class Path(NamedTuple):
    """Slip path of a node over a period: coefficients (L,) of its series, and pieces of it.

    Pieces (k,) lie in one interval of samples each, between two ends ``first`` and ``last`` in
    parts of it; slip has one direction there. ``moved`` is the way [m]; ``end_rate`` is the rate
    of the path, ``end_pressing`` and ``end_pressing_rate`` are P [N] and its rate at the last end.
    Rates are per interval. ``pressing`` (N,) are samples of P, ``slopes`` (N, 2 L) their
    derivatives to the node's coefficients along tangent and normal, without entries if P is
    constant. ``slides`` is the factor of the motion of the ground, ``period`` is T [s].
    """

    series: Vector
    pressing: Vector
    slopes: Matrix
    interval: IntegerVector
    first: Vector
    last: Vector
    moved: Vector
    end_rate: Vector
    end_pressing: Vector
    end_pressing_rate: Vector
    slides: float
    period: float


@helper
def moved_at(path, n, part, s):
    """Path and its first three derivatives at a part of interval n, per interval."""
    N, X = len(path.pressing), path.series
    tau = (n + part) / N
    turn = 2.0 * math.pi / N
    c1, s1 = math.cos(2.0 * math.pi * tau), math.sin(2.0 * math.pi * tau)
    place, rate, bend, third = X[0], 0.0, 0.0, 0.0
    c, d = 1.0, 0.0
    for k in range(1, len(X) // 2 + 1):
        c, d = c * c1 - d * s1, d * c1 + c * s1
        even, odd = X[2 * k - 1] * c + X[2 * k] * d, X[2 * k] * c - X[2 * k - 1] * d
        w = k * turn
        place += even
        rate += w * odd
        bend -= w * w * even
        third -= w * w * w * odd
    if path.slides == 0.0:
        return place, rate, bend, third
    h, t = path.period / N, tau * path.period
    moved = ground_motion(t, s)
    place -= path.slides * moved.travel
    rate -= path.slides * moved.speed * h
    beside = _BESIDE * h
    bend -= path.slides * (ground_motion(t + beside, s).speed
                           - ground_motion(t - beside, s).speed) * h / (2.0 * _BESIDE)
    return place, rate, bend, third


@helper
def _spline(part, order):
    """Weights of four samples about an interval for the spline, or a derivative of it."""
    x = part
    if order == 0:
        return (0.5 * x * (-1.0 + x * (2.0 - x)), 1.0 + 0.5 * x * x * (3.0 * x - 5.0),
                0.5 * x * (1.0 + x * (4.0 - 3.0 * x)), 0.5 * x * x * (x - 1.0))
    if order == 1:
        return (0.5 * (-1.0 + x * (4.0 - 3.0 * x)), 0.5 * x * (9.0 * x - 10.0),
                0.5 * (1.0 + x * (8.0 - 9.0 * x)), 0.5 * x * (3.0 * x - 2.0))
    return 2.0 - 3.0 * x, 9.0 * x - 5.0, 4.0 - 9.0 * x, 3.0 * x - 1.0


@helper
def pressing_at(path, n, part, order):
    """P, or a derivative of it, at a part of interval n; never below zero."""
    P, N = path.pressing, len(path.pressing)
    if len(path.slopes) == 0:
        return P[0] if order == 0 else 0.0
    a, b, c, d = _spline(part, 0)
    value = a * P[n - 1] + b * P[n] + c * P[(n + 1) % N] + d * P[(n + 2) % N]
    if order == 0 or value < 0.0:
        return max(value, 0.0) if order == 0 else 0.0
    a, b, c, d = _spline(part, order)
    return a * P[n - 1] + b * P[n] + c * P[(n + 1) % N] + d * P[(n + 2) % N]


@helper
def beyond(path, n, part, order, compliance, base, s):
    """Path - ``compliance`` P - ``base``, or a derivative of it, and the next derivative."""
    place, rate, bend, third = moved_at(path, n, part, s)
    if order == 0:
        return (place - compliance * pressing_at(path, n, part, 0) - base,
                rate - compliance * pressing_at(path, n, part, 1))
    if order == 1:
        return (rate - compliance * pressing_at(path, n, part, 1),
                bend - compliance * pressing_at(path, n, part, 2))
    return bend, third


@borrowing
def zero_between(path, n, low, high, order, compliance, base, s):
    """Zero of :func:`beyond` between two parts of interval n; the nearer end if the sign stays."""
    f_low, f_high = (beyond(path, n, low, order, compliance, base, s)[0],
                     beyond(path, n, high, order, compliance, base, s)[0])
    if f_low * f_high >= 0.0:
        return high if abs(f_high) < abs(f_low) else low
    x = low - f_low * (high - low) / (f_high - f_low)
    for _ in range(_STEPS):
        f, slope = beyond(path, n, x, order, compliance, base, s)
        if f * f_low > 0.0:
            low = x
        else:
            high = x
        ahead = x - f / slope if slope != 0.0 else low
        if not low < ahead < high:
            ahead = 0.5 * (low + high)
        if abs(ahead - x) <= _LOCATED:
            return ahead
        x = ahead
    return x


@borrowing
def _turns(path, n, v, a, w, b, s):
    """Parts of interval n at which slip turns, ascending; 2 for none.

    Rates and second derivatives of the path at the two ends are v, a and w, b.
    """
    if v * w < 0.0:
        return zero_between(path, n, 0.0, 1.0, 1, 0.0, 0.0, s), 2.0
    if v * a < 0.0 and w * b > 0.0:
        between = zero_between(path, n, 0.0, 1.0, 2, 0.0, 0.0, s)
        if moved_at(path, n, between, s)[1] * v < 0.0:
            return (zero_between(path, n, 0.0, between, 1, 0.0, 0.0, s),
                    zero_between(path, n, between, 1.0, 1, 0.0, 0.0, s))
    return 2.0, 2.0


@helper
def _add_piece(path, k, n, first, last, moved, rate):
    """Fill piece k, in interval n."""
    path.interval[k], path.first[k], path.last[k] = n, first, last
    path.moved[k], path.end_rate[k] = moved, rate
    path.end_pressing[k] = pressing_at(path, n, last, 0)
    path.end_pressing_rate[k] = pressing_at(path, n, last, 1)


@borrowing
def cut_pieces(path, s):
    """Fill the pieces of a path; returns their number."""
    k = 0
    start, v, a, _ = moved_at(path, 0, 0.0, s)
    for n in range(len(path.pressing)):
        end, w, b, _ = moved_at(path, n, 1.0, s)
        first = 0.0
        for turn in _turns(path, n, v, a, w, b, s):
            if first < turn < 1.0:
                place = moved_at(path, n, turn, s)[0]
                _add_piece(path, k, n, first, turn, place - start, 0.0)
                start, first, k = place, turn, k + 1
        _add_piece(path, k, n, first, 1.0, end - start, w)
        start, v, a, k = end, w, b, k + 1
    return k


@helper
def add_row(path, n, part, order, compliance, factor, row):
    """Add to a row (2 L,) a factor times the derivatives of :func:`beyond` to coefficients."""
    N, L = len(path.pressing), len(path.series)
    tau = (n + part) / N
    c1, s1 = math.cos(2.0 * math.pi * tau), math.sin(2.0 * math.pi * tau)
    c, d = 1.0, 0.0
    if order == 0:
        row[0] += factor
    for k in range(1, L // 2 + 1):
        c, d = c * c1 - d * s1, d * c1 + c * s1
        w = 2.0 * math.pi * k / N
        if order == 0:
            row[2 * k - 1] += factor * c
            row[2 * k] += factor * d
        elif order == 1:
            row[2 * k - 1] -= factor * w * d
            row[2 * k] += factor * w * c
        else:
            row[2 * k - 1] -= factor * w * w * c
            row[2 * k] -= factor * w * w * d
    if len(path.slopes) == 0 or compliance == 0.0:
        return
    if not pressing_at(path, n, part, 0) > 0.0:
        return
    weights = _spline(part, order)
    for i in range(4):
        there = path.slopes[(n - 1 + i) % N]
        for k in range(2 * L):
            row[k] -= factor * compliance * weights[i] * there[k]
