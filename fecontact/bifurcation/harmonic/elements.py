r"""Elastic Coulomb elements in harmonic balance, one by one; those of plane bodies exactly.

Along one tangent, the slip path s of a node is a Fourier series, known at all times. The deflection
z of an element follows it within its limit l = mu P / k under the pressing force P: from where slip
ends, at s_e, the element sticks with

.. math:: z = s - s_e \pm l_e,

until z meets a limit again, and slides with z = +-l then. Both places are located, between samples
too: slip ends where s' falls to the rate of the limit, and begins where z crosses the limit. P goes
through its samples as a cubic spline of Catmull and Rom.

z(T) as a function of z(0) is a translation between two ends, those of motions that begin far on
either side. It repeats between these ends, as near to the deflection that was kept as they allow,
and on ground that travels at one of them.

Where slip begins and ends between samples the slope and the curvature of the force jump. Sampled as
they are, answers would depend on where between the samples that is. Forces near by are means with
the kernel of :mod:`fecontact.bifurcation.harmonic.compiled.kinks`: to each sample at the distance
y h from a jump, all jumps of the p-th derivative add themselves times h^p G_p(y), the mean of
y_+^p / p! less this itself.

Derivatives are those of these equations. They follow one node's own coefficients, whatever the
number of modes, and change from sample to sample only where an element begins or ceases to slide:
the work hardly grows with the number of elements.

Elements along two tangents are marched, see :mod:`fecontact.bifurcation.harmonic.memory`, each by
itself, with derivatives to the coefficients of the node.
"""

import math
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.harmonic.compiled.kinks import kernel_integrals
from fecontact.bifurcation.harmonic.memory import (
    LEAK,
    element_law,
    march_block,
    solve_around,
    take_element,
)
from fecontact.core.compiled import borrowing, helper, kernel, routine
from fecontact.core.records import Block, IntegerVector, Matrix, Vector
from fecontact.system.elastic_sliders import limit_of, pressing_on
from fecontact.system.kernels import node_gradients
from fecontact.system.nodes import (
    NodeMotion,
    SystemArrays,
    force_room,
    ground_motion,
    ground_moved,
)

# Largest number of periods after which elements repeat, and relative change that is none.
_ROUNDS, _REPEATS = 6, 1e-12
# Relative way around a period on ground that does not travel.
_STILL = 1e-11
# Steps and relative accuracy of places between samples.
_STEPS, _LOCATED = 60, 1e-15
# Part of its limit by which an element is beyond it that does not slide.
_ROUNDING = 1e-12
# Distance in intervals up to which a place is a zero.
_CLOSE = 1e-6
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
def _moved_at(path, n, part, s):
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
def _pressing_at(path, n, part, order):
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
def _beyond(path, n, part, order, pull, base, s):
    """Path less ``pull`` times P less ``base``, or a derivative of it, and the next derivative."""
    place, rate, bend, third = _moved_at(path, n, part, s)
    if order == 0:
        return (place - pull * _pressing_at(path, n, part, 0) - base,
                rate - pull * _pressing_at(path, n, part, 1))
    if order == 1:
        return (rate - pull * _pressing_at(path, n, part, 1),
                bend - pull * _pressing_at(path, n, part, 2))
    return bend, third


@borrowing
def _zero(path, n, low, high, order, pull, base, s):
    """Zero of :func:`_beyond` between two parts of interval n; the nearer end if the sign stays."""
    f_low, f_high = (_beyond(path, n, low, order, pull, base, s)[0],
                     _beyond(path, n, high, order, pull, base, s)[0])
    if f_low * f_high >= 0.0:
        return high if abs(f_high) < abs(f_low) else low
    x = low - f_low * (high - low) / (f_high - f_low)
    for _ in range(_STEPS):
        f, slope = _beyond(path, n, x, order, pull, base, s)
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
        return _zero(path, n, 0.0, 1.0, 1, 0.0, 0.0, s), 2.0
    if v * a < 0.0 and w * b > 0.0:
        between = _zero(path, n, 0.0, 1.0, 2, 0.0, 0.0, s)
        if _moved_at(path, n, between, s)[1] * v < 0.0:
            return (_zero(path, n, 0.0, between, 1, 0.0, 0.0, s),
                    _zero(path, n, between, 1.0, 1, 0.0, 0.0, s))
    return 2.0, 2.0


@helper
def _add_piece(path, k, n, first, last, moved, rate):
    """Fill piece k, in interval n."""
    path.interval[k], path.first[k], path.last[k] = n, first, last
    path.moved[k], path.end_rate[k] = moved, rate
    path.end_pressing[k] = _pressing_at(path, n, last, 0)
    path.end_pressing_rate[k] = _pressing_at(path, n, last, 1)


@borrowing
def _cut(path, s):
    """Fill the pieces of a path; returns their number."""
    k = 0
    start, v, a, _ = _moved_at(path, 0, 0.0, s)
    for n in range(len(path.pressing)):
        end, w, b, _ = _moved_at(path, n, 1.0, s)
        first = 0.0
        for turn in _turns(path, n, v, a, w, b, s):
            if first < turn < 1.0:
                place = _moved_at(path, n, turn, s)[0]
                _add_piece(path, k, n, first, turn, place - start, 0.0)
                start, first, k = place, turn, k + 1
        _add_piece(path, k, n, first, 1.0, end - start, w)
        start, v, a, k = end, w, b, k + 1
    return k


@borrowing
def _stuck_since(path, n, ends, last, pull, s):
    """Deflection at the end of a piece of an element that slid up to a place before."""
    return (pull * _pressing_at(path, n, ends, 0) + _moved_at(path, n, last, s)[0]
            - _moved_at(path, n, ends, s)[0])


@borrowing
def _change(path, k, ratio, z, side, locate, s):
    """Deflection and side at the end of piece k, from those before it.

    ``side`` is 0 for an element that sticks, else the sign of its deflection. Also where slip ends,
    and where it begins, in parts of the interval, -1 where it does not, and the side of the slip
    that ends. Where slip begins is found if that is asked for.
    """
    limit, n = ratio * path.end_pressing[k], path.interval[k]
    first, last = path.first[k], path.last[k]
    ends, begins, of = -1.0, -1.0, side
    if side == 0.0:
        z += path.moved[k]
    else:
        ends = first
        if side * _beyond(path, n, first, 1, side * ratio, 0.0, s)[0] > 0.0:
            ends = _zero(path, n, first, last, 1, side * ratio, 0.0, s)
        z = _stuck_since(path, n, ends, last, side * ratio, s)
        first = ends
    if abs(z) <= limit * (1.0 + _ROUNDING):
        return z, 0.0, ends, begins, of
    side = 1.0 if z > 0.0 else -1.0
    stays = side * (path.end_rate[k] - side * ratio * path.end_pressing_rate[k]) >= 0.0
    if locate or not stays:
        base = _moved_at(path, n, last, s)[0] - z
        begins = _zero(path, n, first, last, 0, side * ratio, base, s)
    if stays or ends >= 0.0:
        return side * limit, side, ends, begins, of
    # The limit grows faster than the path again.
    ends = _zero(path, n, begins, last, 1, side * ratio, 0.0, s)
    return _stuck_since(path, n, ends, last, side * ratio, s), 0.0, ends, begins, side


@helper
def _advance(path, k, ratio, z, side, locate, s):
    """As :func:`_change`, quickly where nothing begins or ends."""
    limit = ratio * path.end_pressing[k]
    if side == 0.0:
        ahead = z + path.moved[k]
        if abs(ahead) <= limit * (1.0 + _ROUNDING):
            return ahead, side, -1.0, -1.0, side
    elif side * (path.end_rate[k] - side * ratio * path.end_pressing_rate[k]) >= 0.0:
        return side * limit, side, -1.0, -1.0, side
    return _change(path, k, ratio, z, side, locate, s)


@borrowing
def _repeated(path, count, ratio, kept, s):
    """Deflection at the start that repeats, its side, and where slip ended last.

    ``count`` is the number of pieces. The place is a piece, -1 for an element that never slides, a
    part of its interval, and the side on which the element slid. Also whether it repeats.
    """
    low, high, low_side, high_side, way, size = -np.inf, np.inf, 0.0, 0.0, 0.0, 0.0
    # Where slip ended last: piece, place and side.
    low_end, high_end, end = (-1, 0.0, 0.0), (-1, 0.0, 0.0), (-1, 0.0, 0.0)
    apart = True
    for k in range(count):
        high, high_side, ends, _, of = _advance(path, k, ratio, high, high_side, False, s)
        if ends >= 0.0:
            high_end = k, ends, of
        if apart:
            low, low_side, ends, _, of = _advance(path, k, ratio, low, low_side, False, s)
            if ends >= 0.0:
                low_end = k, ends, of
            apart = low < high
        way += path.moved[k]
        size = max(size, abs(way))
    if not apart:
        return high, high_side, high_end, True
    z, side = kept, 0.0
    if abs(way) > _STILL * size:
        z = np.inf if way > 0.0 else -np.inf
    if z >= high:
        z, end = high, high_end
    elif z <= low:
        z, end = low, low_end
    for _ in range(_ROUNDS):
        start = z
        for k in range(count):
            z, side, ends, _, of = _advance(path, k, ratio, z, side, False, s)
            size = max(size, abs(z))
            if ends >= 0.0:
                end = k, ends, of
        if abs(z - start) <= _REPEATS * size:
            return z, side, end, True
    return z, side, end, False


@helper
def _means(y):
    """G_0, G_1 and G_2 at a distance of y samples behind a jump."""
    _, step, ramp, curve = kernel_integrals(y)
    if y > 0.0:
        step, ramp, curve = step - 1.0, ramp - y, curve - 0.5 * y * y
    return step, ramp, curve


@helper
def _add_row(path, n, part, order, pull, factor, row):
    """Add to a row (2 L,) a factor times the derivatives of :func:`_beyond` to coefficients."""
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
    if len(path.slopes) == 0 or pull == 0.0:
        return
    if not _pressing_at(path, n, part, 0) > 0.0:
        return
    weights = _spline(part, order)
    for i in range(4):
        there = path.slopes[(n - 1 + i) % N]
        for k in range(2 * L):
            row[k] -= factor * pull * weights[i] * there[k]


@borrowing
def _add_begun(path, n, part, pull, spring, stuck, s, r, rows, room):
    """Add to forces r (N,), and to their derivatives, the means about a place where slip begins.

    ``stuck`` (2 L,) are the derivatives of z - s before.
    """
    N = len(r)
    _, rate, bend, third = _moved_at(path, n, part, s)
    jump = pull * _pressing_at(path, n, part, 1) - rate
    over = bend - pull * _pressing_at(path, n, part, 2)
    shift, by_jump, by_bend = room[0], room[1], room[2]
    if len(rows) > 0:
        for k in range(len(shift)):
            shift[k], by_jump[k], by_bend[k] = stuck[k], 0.0, 0.0
        _add_row(path, n, part, 0, pull, 1.0, shift)
        _add_row(path, n, part, 1, pull, -1.0, by_jump)
        _add_row(path, n, part, 2, 0.0, -1.0, by_bend)
        for k in range(len(shift)):
            shift[k] = shift[k] / jump if jump != 0.0 else 0.0
            by_jump[k] -= over * shift[k]
            by_bend[k] -= third * shift[k]
    for i in range(-1, 3):
        place = (n + i) % N
        step, ramp, curve = _means(i - part)
        r[place] += spring * (jump * ramp - bend * curve)
        if len(rows) > 0:
            along = jump * step - bend * ramp
            for k in range(len(shift)):
                rows[place, k] += spring * (ramp * by_jump[k] + curve * by_bend[k]
                                            - along * shift[k])


@borrowing
def _add_ended(path, n, part, pull, spring, s, r, rows, room):
    """Add to forces r (N,), and to their derivatives, the means about a place where slip ends."""
    N = len(r)
    _, _, bend, third = _moved_at(path, n, part, s)
    off, over = _beyond(path, n, part, 1, pull, 0.0, s)
    shift, by_bend = room[0], room[2]
    if len(rows) > 0:
        for k in range(len(shift)):
            shift[k], by_bend[k] = 0.0, 0.0
        # Elsewhere slip ends because P jumps.
        if abs(off) < _CLOSE * abs(over):
            _add_row(path, n, part, 1, pull, -1.0 / over, shift)
        _add_row(path, n, part, 2, 0.0, 1.0, by_bend)
        for k in range(len(shift)):
            by_bend[k] += third * shift[k]
    for i in range(-1, 3):
        place = (n + i) % N
        _, ramp, curve = _means(i - part)
        r[place] += spring * bend * curve
        if len(rows) > 0:
            for k in range(len(shift)):
                rows[place, k] += spring * (curve * by_bend[k] - bend * ramp * shift[k])


@helper
def _count_in(side, ratio, spring, kept, sign, n, held, sliding, turned):
    """Count an element in, or out, of those that stick and slide from sample n on."""
    if side == 0.0:
        held[n] += sign * spring
        for k in range(len(kept)):
            turned[n, k] += sign * spring * kept[k]
    else:
        sliding[n] += sign * spring * side * ratio


@borrowing
def _follow(path, count, ratio, spring, kept, return_time, s, z, r, sums, rows, room):
    """Fill the deflections z (N,) of one element, and add its forces to r (N,).

    With rows (N, 2 L), derivatives of the forces about jumps are added to them, and to ``sums``
    what the element adds to the stiffness of those that stick, (N,), to the limits of those that
    slide, (N,), and to derivatives that stay in stick, (N, 2 L). Returns whether it repeats.
    """
    deflection, side, end, repeats = _repeated(path, count, ratio, kept, s)
    N, wanted = len(r), len(rows) > 0
    held, sliding, turned = sums
    stuck, last = room[3], room[4]
    for k in range(len(stuck)):
        stuck[k] = 0.0
    if wanted and side == 0.0 and end[0] >= 0:
        _add_row(path, path.interval[end[0]], end[1], 0, end[2] * ratio, -1.0, stuck)
    for k in range(len(stuck)):
        last[k] = stuck[k]
    last_side, changed = side, False
    if wanted:
        _count_in(side, ratio, spring, stuck, 1.0, 0, held, sliding, turned)
    for k in range(count):
        n = path.interval[k]
        deflection, side, ends, begins, of = _advance(path, k, ratio, deflection, side, True, s)
        again = side == 0.0 and begins >= 0.0
        if again:
            _add_begun(path, n, begins, of * ratio, spring, stuck, s, r, rows, room)
        if ends >= 0.0:
            _add_ended(path, n, ends, of * ratio, spring, s, r, rows, room)
            if wanted:
                for i in range(len(stuck)):
                    stuck[i] = 0.0
                _add_row(path, n, ends, 0, of * ratio, -1.0, stuck)
        if begins >= 0.0 and not again:
            _add_begun(path, n, begins, side * ratio, spring, stuck, s, r, rows, room)
        changed = changed or ends >= 0.0 or begins >= 0.0
        if path.last[k] < 1.0:
            continue
        sample = (n + 1) % N
        r[sample] += spring * deflection
        z[sample] = deflection
        if side != 0.0:
            z[sample] += side * return_time * abs(path.end_rate[k]) * N / path.period
        if changed and wanted and sample > 0:
            _count_in(last_side, ratio, spring, last, -1.0, sample, held, sliding, turned)
            _count_in(side, ratio, spring, stuck, 1.0, sample, held, sliding, turned)
            for i in range(len(stuck)):
                last[i] = stuck[i]
            last_side = side
            changed = False
    return repeats


@routine
def _pressing_of(j, X, T, values, s, derivatives, series, moved, pressing, slopes):
    """Fill series and motion of node j, the force that presses it, and its derivatives.

    X (L, m) are coefficients of the displacements, those of the node along its d axes are
    ``series`` (d, L); its places and velocities at the samples are ``moved`` (N, 2 d). Returns
    whether ``pressing`` (N,) varies, or may vary, and whether this or the slip depend on T for
    given coefficients; ``slopes`` are (N, d L).
    """
    N, L = values.shape
    d, m = len(series), X.shape[1]
    series[:, :] = 0.0
    for axis in range(d):
        for k in range(L):
            for i in range(m):
                series[axis, k] += s.rows[j, axis, i] * X[k, i]
    force, rates = force_room(s)
    gradients, nothing = np.empty((d + 1, 2 * d)), np.empty(0)
    varies, timed = False, False
    for n in range(N):
        for axis in range(d):
            place, speed = series[axis, 0], 0.0
            for k in range(1, L // 2 + 1):
                w, c, e = 2.0 * math.pi * k / T, values[n, 2 * k - 1], values[n, 2 * k]
                one, other = series[axis, 2 * k - 1], series[axis, 2 * k]
                place += one * c + other * e
                speed += w * (other * c - one * e)
            moved[n, axis], moved[n, d + axis] = place, speed
        here = moved[n]
        motion = (NodeMotion(here[0], here[1], here[3], here[4], here[2], here[5]) if d > 2 else
                  NodeMotion(here[0], here[1], here[2], here[3], 0.0, 0.0))
        ground = ground_motion(n * T / N, s)
        F, _, contact = node_gradients(j, motion, ground, nothing, s, force, rates, gradients)
        for axis in range(0, d, 2):
            timed = timed or ground_moved(axis, j, ground.speed, ground.second_speed, s) != 0.0
        pressing[n] = pressing_on(j, contact, F, s)
        varies = varies or pressing[n] != pressing[0]
        for axis in range(d):
            place, speed = gradients[d, axis], gradients[d, d + axis]
            varies = varies or place != 0.0 or speed != 0.0
            timed = timed or speed != 0.0
            if derivatives:
                slopes[n, axis * L] = place
                for k in range(1, L // 2 + 1):
                    w, c, e = 2.0 * math.pi * k / T, values[n, 2 * k - 1], values[n, 2 * k]
                    slopes[n, axis * L + 2 * k - 1] = place * c - speed * w * e
                    slopes[n, axis * L + 2 * k] = place * e + speed * w * c
    return varies, timed


@routine
def _along_one_tangent(j, X, T, s, count, offsets, values, derivatives, r, z, rows):
    """As :func:`element_forces`, for the ``count`` elements of a node of a plane body."""
    N, L = values.shape
    series, moved, pressing = np.empty((2, L)), np.empty((N, 4)), np.empty(N)
    slopes, nothing = np.zeros((N, 2 * L)), np.empty((0, 2 * L))
    varies, timed = _pressing_of(j, X, T, values, s, derivatives, series, moved, pressing, slopes)
    most = 3 * N
    path = Path(series[0], pressing, slopes if varies else nothing,
                np.empty(most, dtype=np.int64), np.empty(most), np.empty(most), np.empty(most),
                np.empty(most), np.empty(most), np.empty(most), s.sliding[j], T)
    pieces = _cut(path, s)
    own = rows[0] if derivatives else nothing
    own[:, :] = 0.0
    room, p, done = np.empty((5, 2 * L)), s.friction_parameters[j], 1
    held, sliding = np.zeros(N), np.zeros(N)
    turned = np.zeros((N if derivatives else 0, 2 * L))
    start = _moved_at(path, 0, 0.0, s)[0] + path.slides * ground_motion(0.0, s).travel
    for i in range(count):
        if not _follow(path, pieces, limit_of(j, i, count, 1.0, s), p[1 + i], start + offsets[i],
                       p[0], s, z[:, i], r[0], (held, sliding, turned), own, room):
            done = 0
    if not derivatives:
        return done, timed
    stiffness, limits, kept = 0.0, 0.0, room[0]
    kept[:] = 0.0
    for n in range(N):
        stiffness += held[n]
        limits += sliding[n]
        for k in range(2 * L):
            kept[k] += turned[n, k]
            own[n, k] += kept[k]
        for k in range(L):
            own[n, k] += stiffness * values[n, k]
        if varies:
            for k in range(2 * L):
                own[n, k] += limits * slopes[n, k]
    return done, timed


@routine
def _along_two_tangents(j, X, T, s, count, offsets, values, derivatives, r, z, rows):
    """As :func:`element_forces`, for the ``count`` elements of a node in space, marched."""
    N, L = values.shape
    series, moved, pressing = np.empty((3, L)), np.empty((N, 6)), np.empty(N)
    slopes = np.zeros((N, 3 * L))
    _, timed = _pressing_of(j, X, T, values, s, derivatives, series, moved, pressing, slopes)
    rate, leak = N / T, LEAK / T
    slip, target, path = np.empty((N, 3)), np.empty((N, 2)), np.empty((N, 2))
    p, force, rates, nothing = np.empty(3), np.empty(12), np.empty((2, 6)), np.empty((0, 0))
    times, blocks = np.empty(N), np.array([2])
    by_z, change = np.empty((N, 1, 2, 2)), np.empty((N if derivatives else 0, 2, 3 * L))
    by_pair = np.empty((N, 2, 3))
    for n in range(N):
        ground = ground_motion(n * T / N, s)
        times[n], slip[n, 2] = n * T / N, pressing[n]
        for c in range(2):
            slip[n, c] = rate * (1.5 * moved[n, 2 * c] - 2.0 * moved[n - 1, 2 * c]
                                 + 0.5 * moved[n - 2, 2 * c]) - ground_moved(
                                     2 * c, j, ground.speed, ground.second_speed, s)
    rows[:, :, :] = 0.0
    done = 1
    for i in range(count):
        take_element(j, i, count, s, p)
        for n in range(N):
            for c in range(2):
                target[n, c] = moved[n, 2 * c] + offsets[2 * i + c]
        if march_block(j, True, times, nothing, s, T, slip, p, target, force, rates, path) == 0:
            done = 0
        for n in range(N):
            element_law(j, slip[n], path[n], s, p, force, rates)
            for c in range(2):
                z[n, 2 * i + c] = path[n, c]
                r[c, n] += force[6 * c]
                for k in range(2):
                    by_z[n, 0, c, k] = rates[c, 3 + k]
                    by_pair[n, c, k] = force[6 * c + 3 + k]
                by_pair[n, c, 2] = force[6 * c + 2]
                if not derivatives:
                    continue
                for k in range(3 * L):
                    change[n, c, k] = rates[c, 2] * slopes[n, k]
                for k in range(L):
                    speed = rate * (1.5 * values[n, k] - 2.0 * values[n - 1, k]
                                    + 0.5 * values[n - 2, k])
                    change[n, c, k] += rates[c, 1] * speed
                    change[n, c, 2 * L + k] += rates[c, 5] * speed
                    change[n, c, 2 * L * c + k] += leak * values[n, k]
        if not derivatives:
            continue
        solve_around(by_z, T, blocks, change)
        for n in range(N):
            for c in range(2):
                for k in range(3 * L):
                    rows[c, n, k] += (by_pair[n, c, 0] * change[n, 0, k]
                                      + by_pair[n, c, 1] * change[n, 1, k]
                                      + by_pair[n, c, 2] * slopes[n, k])
    return done, timed


@routine
def element_forces(X, T, s, laws, elements, offsets, values, derivatives, r, z, rows):
    """Fill r (t n, N) with the friction of the elements of n nodes along their t tangents.

    X (L, m) are coefficients of the displacements, T the period [s], s the system without elements
    and ``laws`` with them, ``elements`` (n,) their numbers, ``offsets`` (c,) deflections less
    displacements of those that never slide, ``values`` (N, L) the series at the samples. Also fills
    the deflections z (N, c) and, with derivatives, rows (t n, N, d L) of those of r to the
    coefficients of a node along its d axes. Returns 0 where an element does not come to repeat,
    else 1, or 2 if r depends on T for given X.
    """
    tangents = s.rows.shape[1] - 1
    states = len(offsets) // len(elements)
    done, by_period = 1, False
    r[:, :] = 0.0
    for j in range(len(elements)):
        if elements[j] == 0:
            continue
        first, at = tangents * j, j * states
        own = rows[first : first + tangents] if derivatives else rows
        if tangents == 1:
            found, timed = _along_one_tangent(
                j, X, T, s, elements[j], offsets[at : at + states], values, derivatives,
                r[first : first + 1], z[:, at : at + states], own)
        else:
            found, timed = _along_two_tangents(
                j, X, T, laws, elements[j], offsets[at : at + states], values, derivatives,
                r[first : first + 2], z[:, at : at + states], own)
        done, by_period = min(done, found), by_period or timed
    return 2 * done if by_period else done


@kernel
def follow_elements(
    X: Matrix, T: float, s: SystemArrays, laws: SystemArrays, elements: IntegerVector,
    offsets: Vector, values: Matrix, derivatives: int, r: Matrix, z: Matrix, rows: Block,
) -> int:
    """:func:`element_forces` for Python; ``rows`` may be empty without derivatives."""
    return element_forces(X, T, s, laws, elements, offsets, values, derivatives != 0, r, z, rows)
