r"""Polynomials over a step in Bernstein form, whose coefficients bound them.

.. math::

    p(s) = \sum_k b_k \binom{n}{k} s^k (1 - s)^{n - k}, \qquad
    \min_k b_k \le p(s) \le \max_k b_k \quad (0 \le s \le 1)

The interpolant of a step is a polynomial in the normalised time s of the step, and so is every
linear combination of states, such as the height of a node above flat ground. Its coefficients
decide whether it changes sign within the step; if they are inconclusive, those of its halves do.

References
----------
G. Farin, Curves and Surfaces for CAGD, 5th ed., chapters 4 and 5 (de Casteljau's algorithm,
the convex hull, multiplication by s and 1 - s). J. M. Lane, R. F. Riesenfeld, Bounds on a
polynomial, BIT 21 (1981) 112. L. L. Schumaker, W. Volk, Efficient evaluation of multivariate
polynomials, Computer Aided Geometric Design 3 (1986) 149 (values by one loop).
"""

import math
from collections.abc import Callable
from fractions import Fraction
from math import comb
from typing import Any

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.types import Array

# Resolution within a step, and rows of the workspace: the depth of bisection that reaches it and
# three more, for the whole step, for a part that is looked at, and for what is found.
FINEST = 2.0**-46
DEPTH = 49
# Where there is no change, and what a look says of a part that is to be halved.
NOWHERE, UNDECIDED = 2.0, -1.0
_MOST_NEWTON = 60


@helper
def times_s(b, degree):
    """Multiply p by s: b[: degree + 2] becomes that of the degree one higher."""
    up = 1.0 / (degree + 1)
    for i in range(degree + 1, 0, -1):
        b[i] = i * up * b[i - 1]
    b[0] = 0.0


@helper
def times_rest(b, degree):
    """Multiply p by 1 - s: b[: degree + 2] becomes that of the degree one higher."""
    up = 1.0 / (degree + 1)
    for i in range(degree + 1):
        b[i] = (degree + 1 - i) * up * b[i]
    b[degree + 1] = 0.0


@helper
def smallest(b):
    """Lower bound of p, the smallest coefficient."""
    least = b[0]
    for i in range(1, len(b)):
        least = min(least, b[i])
    return least


@helper
def value(b, s, row):
    """p(s) by de Casteljau's algorithm; ``row`` (n + 1,) is workspace."""
    n = len(b)
    for i in range(n):
        row[i] = b[i]
    for k in range(n - 1, 0, -1):
        for i in range(k):
            row[i] += s * (row[i + 1] - row[i])
    return row[0]


@helper
def split(b, left):
    """Put the coefficients of p over [0, 1/2] into ``left``, and those over [1/2, 1] into b."""
    n = len(b)
    for k in range(n):
        left[k] = b[0]
        for i in range(n - 1 - k):
            b[i] = 0.5 * (b[i] + b[i + 1])


@helper
def changes_of_sign(look, data, b, sign, places, stack):
    """Fill ``places`` with the s at which a quantity changes its sign, ascending; their number.

    The step is halved, the left half first, until a look at each part tells the sign of the
    quantity there. ``look(part, begin, width, rows, data)`` is a compiled function that returns the
    signs at the begin and at the end of a part, zero for none, and the place at which they change
    between these; or UNDECIDED as the place, for a part that is to be halved. ``part`` (n + 1,) are
    the coefficients of p over the part. ``rows`` (2, ...) are its row of the stack and the next
    one, which is workspace. Columns beyond n + 2 belong to the look: where it is undecided, it may
    keep numbers about the right half in the first row, and about the left half in the second.

    ``stack`` (DEPTH, n + 2 or more) is workspace; b is kept. ``sign`` is the sign before the step,
    zero for none. Changes beyond the length of ``places`` are left out.
    """
    n = len(b)
    # Parts that are left, the earliest on top, with their widths in the last column.
    for i in range(n):
        stack[0, i] = b[i]
    stack[0, n] = 1.0
    waiting, begin, found = 1, 0.0, 0
    while waiting > 0 and found < len(places):
        part, width = stack[waiting - 1, :n], stack[waiting - 1, n]
        first, last, place = look(part, begin, width, stack[waiting - 1 : waiting + 1], data)
        if place == UNDECIDED:
            split(part, stack[waiting, :n])
            stack[waiting - 1, n] = stack[waiting, n] = 0.5 * width
            waiting += 1
            continue
        if first * sign < 0.0:
            places[found] = begin
            found += 1
        sign = first if first != 0.0 else sign
        if last * sign < 0.0 and found < len(places):
            places[found] = place
            found += 1
        sign = last if last != 0.0 else sign
        begin += width
        waiting -= 1
    return found


@helper
def first_change(look, data, b, stack):
    """First s at which a quantity falls below zero, as :func:`changes_of_sign`; NOWHERE if none."""
    places = stack[DEPTH - 1, :1]
    return places[0] if changes_of_sign(look, data, b, 1.0, places, stack) > 0 else NOWHERE


@helper
def only_zero(evaluate, c, size, part, begin, width):
    """Zero, to rounding, in a part of the step where the coefficients change their sign once.

    By Newton's method from the zero of the control polygon, within what encloses the zero.
    ``evaluate(c, s)`` is a compiled function that returns p(s) and p'(s), ``size`` the size of what
    it sums up.
    """
    n, k = len(part), 1
    while k < n - 1 and part[k - 1] == 0.0:
        k += 1
    sign = math.copysign(1.0, part[k - 1])
    while k < n - 1 and not part[k] * sign < 0.0:
        k += 1
    low, high = begin, begin + width
    s = begin + width * (k - 1 + part[k - 1] / (part[k - 1] - part[k])) / (n - 1)
    for _ in range(_MOST_NEWTON):
        p, slope = evaluate(c, s)
        if abs(p) <= 2e-16 * size:
            break
        if p * sign > 0.0:
            low = s
        else:
            high = s
        before = s
        s = s - p / slope if slope * sign < 0.0 else low
        if not low < s < high:
            s = 0.5 * (low + high)
        if abs(s - before) <= 4e-16 * s:
            break
    return s


def signs_by(zero: Callable[..., Any]) -> Any:
    """A look for :func:`changes_of_sign` that tells the signs of p itself.

    p has at most as many zeros as its coefficients have changes of sign, and with one change
    exactly one (Descartes' rule; Lane and Riesenfeld). The compiled function
    ``zero(part, begin, width, row, given)`` returns this one. The data of the look are ``dip`` and
    ``given``: changes closer than FINEST are missed, but for those that enclose values below
    -``dip``.
    """

    @helper
    def signs(part, begin, width, rows, data):
        """Signs of p at the begin and at the end of a part, and the place of a change."""
        dip, given = data
        first, last, changes = 0.0, 0.0, 0
        for i in range(len(part)):
            if part[i] != 0.0:
                if part[i] * last < 0.0:
                    changes += 1
                first = part[i] if first == 0.0 else first
                last = part[i]
        if changes == 1:
            return first, last, zero(part, begin, width, rows[1, : len(part)], given)
        if changes > 1 and width > FINEST:
            return first, last, UNDECIDED
        if changes > 1 and smallest(part) < -dip:
            return first, -1.0, begin
        return first, last, begin + width

    return signs


@helper
def _value_and_slope(c, s):
    """p(s) and p'(s) for c_k = b_k n! / (k! (n - k)!), in one loop."""
    p, slope, power, rest = c[0], 0.0, 1.0, 1.0 - s
    for k in range(1, len(c)):
        slope = slope * rest - p + k * c[k] * power
        power *= s
        p = p * rest + c[k] * power
    return p, slope


@helper
def _zero(part, begin, width, row, given):
    """End of the interval of length FINEST in which p has its only zero in a part of the step."""
    n, many, size = len(part), 1.0, 0.0
    for k in range(n):
        row[k] = many * part[k]
        many *= (n - 1 - k) / (k + 1)
        size = max(size, abs(part[k]))
    s = begin + width * only_zero(_value_and_slope, row, size, part, 0.0, 1.0)
    return min((math.floor(s / FINEST) + 1.0) * FINEST, begin + width)


_signs = signs_by(_zero)
_NO_DIPS = np.inf, 0.0


@helper
def first_below(b, stack):
    """First s at which p falls below zero, to a resolution of FINEST; NOWHERE if it does not.

    Zero is not below, and a dip shorter than FINEST may be missed. ``stack`` (DEPTH, n + 2) is
    workspace; b is kept.
    """
    if smallest(b) >= 0.0:
        return NOWHERE
    return first_change(_signs, _NO_DIPS, b, stack)


@helper
def sign_changes(b, places, stack, sign=0.0):
    """Fill ``places`` with the s at which p changes sign, ascending; return their number.

    Sign changes closer than FINEST may be missed, as may those beyond the length of ``places``.
    ``stack`` (DEPTH, n + 2) is workspace; b is kept. ``sign`` is the sign before, zero for none.
    """
    return changes_of_sign(_signs, _NO_DIPS, b, sign, places, stack)


@helper
def from_nested(c, b):
    """Coefficients b (n + 1,) of c_0 + s (c_1 + (1 - s) (c_2 + s (c_3 + ...))), c (n + 1,)."""
    degree = len(c) - 1
    b[:] = 0.0
    b[0] = c[degree]
    for k in range(degree - 1, -1, -1):
        have = degree - 1 - k
        if k % 2 == 0:
            times_s(b, have)
        else:
            times_rest(b, have)
        for i in range(have + 2):
            b[i] += c[k]


@helper
def largest(b):
    """Upper bound of p, the largest coefficient."""
    most = b[0]
    for i in range(1, len(b)):
        most = max(most, b[i])
    return most


def fit(places: Array) -> Array:
    """Matrix from values at n + 1 distinct points to Bernstein coefficients."""
    degree = len(places) - 1
    return np.ascontiguousarray(np.linalg.inv(np.array(
        [[comb(degree, k) * s**k * (1.0 - s) ** (degree - k) for k in range(degree + 1)]
         for s in places])))


def of_nested(degree: int) -> Array:
    """Bernstein coefficients, row by row, of 1, s, s (1 - s), s^2 (1 - s), s^2 (1 - s)^2, ...

    These are what :func:`from_nested` sums up.
    """
    powers, rows = [1] + [0] * degree, []
    for k in range(degree + 1):
        rows.append([float(sum(Fraction(comb(i, j) * powers[j], comb(degree, j))
                               for j in range(i + 1))) for i in range(degree + 1)])
        raised = [0, *powers[:-1]]
        powers = raised if k % 2 == 0 else [a - b for a, b in zip(powers, raised, strict=True)]
    return np.array(rows)
