r"""An elastic Coulomb element along the slip path of its node.

The deflection z follows the path s within its limit l = mu P / k under the pressing force P: from
where slip ends, at s_e, the element sticks with

.. math:: z = s - s_e \pm l_e,

until z meets a limit again, and slides with z = +-l then. Both places are located, between samples
too: slip ends where s' falls to the rate of the limit, and begins where z crosses the limit.

z(T) as a function of z(0) is a translation between two ends, those of motions that begin far on
either side. It repeats between these ends, as near to the deflection that was kept as they allow,
and on ground that travels at one of them.

Where slip begins and ends between samples the slope and the curvature of the force jump. Sampled as
they are, answers would depend on where between the samples that is. Forces near by are means with
the kernel of :mod:`fecontact.bifurcation.harmonic.compiled.kinks`: to each sample at the distance
y h from a jump, all jumps of the p-th derivative add themselves times h^p G_p(y), the mean of
y_+^p / p! less this itself.

Derivatives are those of these equations. They change from sample to sample only where an element
begins or ceases to slide: the work hardly grows with the number of elements.
"""

from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.harmonic.compiled.kinks import kernel_integrals
from fecontact.bifurcation.harmonic.slip_path import (
    add_row,
    beyond,
    moved_at,
    pressing_at,
    zero_between,
)
from fecontact.core.compiled import borrowing, helper
from fecontact.core.records import Matrix, Vector

# Largest number of periods after which elements repeat, and relative change that is none.
_ROUNDS, _REPEATS = 6, 1e-12
# Relative way around a period on ground that does not travel.
_STILL = 1e-11
# Part of its limit by which an element is beyond it that does not slide.
_ROUNDING = 1e-12
# Distance in intervals up to which a place is a zero.
_CLOSE = 1e-6


@borrowing
def _stuck_since(path, n, ends, last, compliance, s):
    """Deflection at the end of a piece of an element that slid up to a place before."""
    return (compliance * pressing_at(path, n, ends, 0) + moved_at(path, n, last, s)[0]
            - moved_at(path, n, ends, s)[0])


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
        if side * beyond(path, n, first, 1, side * ratio, 0.0, s)[0] > 0.0:
            ends = zero_between(path, n, first, last, 1, side * ratio, 0.0, s)
        z = _stuck_since(path, n, ends, last, side * ratio, s)
        first = ends
    if abs(z) <= limit * (1.0 + _ROUNDING):
        return z, 0.0, ends, begins, of
    side = 1.0 if z > 0.0 else -1.0
    stays = side * (path.end_rate[k] - side * ratio * path.end_pressing_rate[k]) >= 0.0
    if locate or not stays:
        base = moved_at(path, n, last, s)[0] - z
        begins = zero_between(path, n, first, last, 0, side * ratio, base, s)
    if stays or ends >= 0.0:
        return side * limit, side, ends, begins, of
    # The limit grows faster than the path again.
    ends = zero_between(path, n, begins, last, 1, side * ratio, 0.0, s)
    return _stuck_since(path, n, ends, last, side * ratio, s), 0.0, ends, begins, side


@helper
def _advance(path, k, ratio, z, side, locate, s):
    """Results of :func:`_change`, found at once where nothing begins or ends."""
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


class Element(NamedTuple):
    """An elastic Coulomb element.

    ``ratio`` is its limit over the pressing force [m/N], ``stiffness`` [N/m], ``kept`` the
    deflection at the start of the period if it never slides [m], and ``return_time`` that of its
    return to the limit [s].
    """

    ratio: float
    stiffness: float
    kept: float
    return_time: float


class Sums(NamedTuple):
    """Forces (N,) of the elements of a node, their derivatives, and workspace.

    ``rows`` (N, 2 L), empty if none are wanted, are the derivatives of the forces about jumps. From
    each sample on, ``held`` (N,) is added to the stiffness of elements that stick, ``sliding`` (N,)
    to the limits of those that slide, ``turned`` (N, 2 L) to the derivatives that stay in stick.

    ``stuck`` (2 L,) are the derivatives of z - s of an element, ``last`` (2 L,) those at the sample
    before; ``shift``, ``by_jump``, ``by_bend`` (2 L,) those of the place and the size of a jump.
    """

    forces: Vector
    rows: Matrix
    held: Vector
    sliding: Vector
    turned: Matrix
    stuck: Vector
    last: Vector
    shift: Vector
    by_jump: Vector
    by_bend: Vector


@helper
def _add_means(n, part, jump, bend, spring, sums):
    """Add to forces, and to their derivatives, the means about a place where their slope jumps.

    ``jump`` and -``bend`` are the jumps of slope and curvature; their derivatives, and that of the
    place, stand in the sums.
    """
    r, rows, shift = sums.forces, sums.rows, sums.shift
    N = len(r)
    for i in range(-1, 3):
        place = (n + i) % N
        step, ramp, curve = _means(i - part)
        r[place] += spring * (jump * ramp - bend * curve)
        if len(rows) > 0:
            along = jump * step - bend * ramp
            for k in range(len(shift)):
                rows[place, k] += spring * (ramp * sums.by_jump[k] + curve * sums.by_bend[k]
                                            - along * shift[k])


@borrowing
def _add_begun(path, n, part, compliance, spring, s, sums):
    """Add to forces, and to their derivatives, the means about a place where slip begins."""
    _, rate, bend, third = moved_at(path, n, part, s)
    jump = compliance * pressing_at(path, n, part, 1) - rate
    over = bend - compliance * pressing_at(path, n, part, 2)
    shift, by_jump, by_bend = sums.shift, sums.by_jump, sums.by_bend
    if len(sums.rows) > 0:
        for k in range(len(shift)):
            shift[k], by_jump[k], by_bend[k] = sums.stuck[k], 0.0, 0.0
        add_row(path, n, part, 0, compliance, 1.0, shift)
        add_row(path, n, part, 1, compliance, -1.0, by_jump)
        add_row(path, n, part, 2, 0.0, -1.0, by_bend)
        for k in range(len(shift)):
            shift[k] = shift[k] / jump if jump != 0.0 else 0.0
            by_jump[k] -= over * shift[k]
            by_bend[k] -= third * shift[k]
    _add_means(n, part, jump, bend, spring, sums)


@borrowing
def _add_ended(path, n, part, compliance, spring, s, sums):
    """Add to forces, and to their derivatives, the means about a place where slip ends."""
    _, _, bend, third = moved_at(path, n, part, s)
    off, over = beyond(path, n, part, 1, compliance, 0.0, s)
    shift, by_bend = sums.shift, sums.by_bend
    if len(sums.rows) > 0:
        for k in range(len(shift)):
            shift[k], sums.by_jump[k], by_bend[k] = 0.0, 0.0, 0.0
        # Elsewhere slip ends because P jumps.
        if abs(off) < _CLOSE * abs(over):
            add_row(path, n, part, 1, compliance, -1.0 / over, shift)
        add_row(path, n, part, 2, 0.0, 1.0, by_bend)
        for k in range(len(shift)):
            by_bend[k] += third * shift[k]
    _add_means(n, part, 0.0, -bend, spring, sums)


@helper
def _count_in(side, element, turned, sign, n, sums):
    """Count an element in, or out, of those that stick and slide from sample n on.

    ``turned`` (2 L,) are its derivatives in stick.
    """
    spring = sign * element.stiffness
    if side == 0.0:
        sums.held[n] += spring
        for k in range(len(turned)):
            sums.turned[n, k] += spring * turned[k]
    else:
        sums.sliding[n] += spring * side * element.ratio


@borrowing
def follow_along(path, count, element, s, z, sums):
    """Fill the deflections z (N,) of one element, and add what it does to the sums.

    ``count`` is the number of pieces of the path. Returns whether the element repeats.
    """
    ratio, spring = element.ratio, element.stiffness
    deflection, side, end, repeats = _repeated(path, count, ratio, element.kept, s)
    r, stuck, last = sums.forces, sums.stuck, sums.last
    N, wanted = len(r), len(sums.rows) > 0
    for k in range(len(stuck)):
        stuck[k] = 0.0
    if wanted and side == 0.0 and end[0] >= 0:
        add_row(path, path.interval[end[0]], end[1], 0, end[2] * ratio, -1.0, stuck)
    for k in range(len(stuck)):
        last[k] = stuck[k]
    last_side, changed = side, False
    if wanted:
        _count_in(side, element, stuck, 1.0, 0, sums)
    for k in range(count):
        n = path.interval[k]
        deflection, side, ends, begins, of = _advance(path, k, ratio, deflection, side, True, s)
        again = side == 0.0 and begins >= 0.0
        if again:
            _add_begun(path, n, begins, of * ratio, spring, s, sums)
        if ends >= 0.0:
            _add_ended(path, n, ends, of * ratio, spring, s, sums)
            if wanted:
                for i in range(len(stuck)):
                    stuck[i] = 0.0
                add_row(path, n, ends, 0, of * ratio, -1.0, stuck)
        if begins >= 0.0 and not again:
            _add_begun(path, n, begins, side * ratio, spring, s, sums)
        changed = changed or ends >= 0.0 or begins >= 0.0
        if path.last[k] < 1.0:
            continue
        sample = (n + 1) % N
        r[sample] += spring * deflection
        z[sample] = deflection
        if side != 0.0:
            z[sample] += side * element.return_time * abs(path.end_rate[k]) * N / path.period
        if changed and wanted and sample > 0:
            _count_in(last_side, element, last, -1.0, sample, sums)
            _count_in(side, element, stuck, 1.0, sample, sums)
            for i in range(len(stuck)):
                last[i] = stuck[i]
            last_side = side
            changed = False
    return repeats
