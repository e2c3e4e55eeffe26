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
the convex hull, multiplication by s and 1 - s).
"""

from fractions import Fraction
from math import comb

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.types import Array

# Resolution within a step, and the depth of bisection that reaches it plus two.
FINEST = 2.0**-46
DEPTH = 48
NOWHERE = 2.0


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
def first_below(b, workspace):
    """First s at which p falls below zero, to a resolution of FINEST; NOWHERE if it does not.

    Zero is not below, and a dip shorter than FINEST may be missed. ``workspace`` (DEPTH, n + 1) is
    workspace; b is kept.

    The step is bisected, the left half first, until the coefficients of an interval have one sign
    or the interval is as short as FINEST.
    """
    if smallest(b) >= 0.0:
        return NOWHERE
    n = len(b)
    # Stack of the remaining intervals, the earliest on top, with their widths in the last column.
    for i in range(n):
        workspace[0, i] = b[i]
    workspace[0, n] = 1.0
    waiting, begin = 1, 0.0
    while waiting > 0:
        part, width = workspace[waiting - 1, :n], workspace[waiting - 1, n]
        if part[0] < 0.0:
            return begin
        bound = smallest(part)
        if bound < 0.0 and width > FINEST:
            split(part, workspace[waiting, :n])
            workspace[waiting - 1, n] = workspace[waiting, n] = 0.5 * width
            waiting += 1
            continue
        begin += width
        if bound < 0.0 and part[n - 1] < 0.0:
            return begin
        waiting -= 1
    return NOWHERE


@helper
def variations(b):
    """Sign changes of the coefficients, an upper bound of those of p within the step."""
    count, last = 0, 0.0
    for i in range(len(b)):
        if b[i] != 0.0:
            if b[i] * last < 0.0:
                count += 1
            last = b[i]
    return count


@helper
def sign_changes(b, workspace, row, places):
    """Fill ``places`` with the s at which p changes sign, ascending; return their number.

    Sign changes closer than FINEST may be missed, as may those beyond the length of ``places``.
    ``workspace`` (DEPTH, n + 1) and ``row`` (n + 1,) are workspace; b is kept.
    """
    n = len(b)
    for i in range(n):
        workspace[0, i] = b[i]
    workspace[0, n] = 1.0
    waiting, begin, found, sign = 1, 0.0, 0, 0.0
    while waiting > 0:
        part, width = workspace[waiting - 1, :n], workspace[waiting - 1, n]
        changes = variations(part)
        if changes > 1 and width > FINEST:
            split(part, workspace[waiting, :n])
            workspace[waiting - 1, n] = workspace[waiting, n] = 0.5 * width
            waiting += 1
            continue
        first, last = 0.0, 0.0
        for i in range(n):
            if part[i] != 0.0:
                first = part[i] if first == 0.0 else first
                last = part[i]
        # At the start if p is zero there, then within.
        if sign * first < 0.0 and found < len(places):
            places[found] = begin
            found += 1
        if first * last < 0.0 and found < len(places):
            low, high = 0.0, 1.0
            while (high - low) * width > FINEST:
                middle = 0.5 * (low + high)
                if value(part, middle, row) * first > 0.0:
                    low = middle
                else:
                    high = middle
            places[found] = begin + high * width
            found += 1
        sign = last if last != 0.0 else sign
        begin += width
        waiting -= 1
    return found


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
