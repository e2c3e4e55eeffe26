r"""First zero of a polynomial within a step, with none missed.

A power series :math:`p(x) = \sum_k c_k x^k`, 0 <= x <= 1, has in Bernstein form coefficients

.. math:: b_i = \sum_{k \le i} \binom{i}{k} \binom{n}{k}^{-1} c_k

between whose smallest and largest p lies; p has at most as many zeros as they have changes of sign,
and with one change exactly one (Descartes' rule). Intervals with more are halved.

References
----------
G. Farin, Curves and Surfaces for CAGD, 5th ed., chapters 4 and 5. J. M. Lane, R. F. Riesenfeld,
Bounds on a polynomial, BIT 21 (1981) 112.
"""

import math

import numpy as np

from fecontact.core.compiled import helper, routine

# Highest power of the series.
DEGREE = 24
COEFFICIENTS = DEGREE + 1
# Halvings until what touches zero counts as positive, or as zero if it is below by more.
_DEEPEST = 48
DEPTH = _DEEPEST + 2
_ROUNDING = 1e-15
_MOST_NEWTON = 60

_TO_BERNSTEIN = np.array([[math.comb(i, k) / math.comb(DEGREE, k) for i in range(COEFFICIENTS)]
                          for k in range(COEFFICIENTS)])


@helper
def value_at(c, x):
    """p(x) for coefficients c (n + 1,)."""
    total = 0.0
    for k in range(DEGREE, -1, -1):
        total = total * x + c[k]
    return total


@helper
def _to_bernstein(c, out):
    """Fill ``out`` with the Bernstein coefficients of c."""
    for i in range(COEFFICIENTS):
        out[i] = c[0]
    for k in range(1, COEFFICIENTS):
        for i in range(COEFFICIENTS):
            out[i] += _TO_BERNSTEIN[k, i] * c[k]


@helper
def _halve(b, left):
    """Bernstein coefficients of the left half to ``left``; b becomes those of the right half."""
    for k in range(DEGREE):
        left[k] = b[0]
        for i in range(DEGREE - k):
            b[i] = 0.5 * (b[i] + b[i + 1])
    left[DEGREE] = b[0]


@helper
def _changes(b):
    """Number of changes of sign, zeros left out, and the first sign; 2 stands for more than one."""
    first, last, count = 0.0, 0.0, 0
    for i in range(COEFFICIENTS):
        if b[i] != 0.0:
            if first == 0.0:
                first = b[i]
            elif last * b[i] < 0.0:
                count += 1
            last = b[i]
    return count, first


@helper
def _bracketed(c, low, high):
    """The zero of c between low, where it is positive, and high, where it is negative."""
    at_low, at_high = value_at(c, low), value_at(c, high)
    if not at_high < 0.0:
        return high
    x = 0.5 * (low + high)
    if at_low > 0.0:
        x = low + (high - low) * (at_low / (at_low - at_high))
    for _ in range(_MOST_NEWTON):
        total, slope = 0.0, 0.0
        for k in range(DEGREE, -1, -1):
            slope = slope * x + total
            total = total * x + c[k]
        if total > 0.0:
            low = x
        else:
            high = x
        after = x - total / slope if slope < 0.0 else low
        if not low < after < high:
            after = 0.5 * (low + high)
        if abs(after - x) <= 4e-16 * after:
            return after
        x = after
    return x


@routine
def first_zero(p, limit, room):
    """The first zero of p from above within 0 < x <= limit, or 2 ``limit`` if there is none.

    Zero at once where p begins negative. ``room`` (DEPTH + 2, n + 1) is to work in.
    """
    c, b = room[DEPTH], room[DEPTH + 1]
    power, below, size = 1.0, 0.0, 0.0
    for k in range(COEFFICIENTS):
        c[k] = p[k] * power
        power *= limit
        size = max(size, abs(c[k]))
        if k > 0:
            below += min(c[k], 0.0)
    if c[0] < 0.0:
        return 0.0
    if c[0] + below > 0.0 or below == 0.0:
        return 2.0 * limit
    _to_bernstein(c, b)
    low, width, depth, waiting = 0.0, 1.0, 0, 0
    while True:
        count, first = _changes(b)
        if first < 0.0:
            return low * limit
        if count == 1:
            return _bracketed(c, low, low + width) * limit
        if count > 0:
            least = 0.0
            for i in range(COEFFICIENTS):
                least = min(least, b[i])
            if depth < _DEEPEST:
                # The right half waits in the row of its depth.
                _halve(b, room[depth])
                for i in range(COEFFICIENTS):
                    b[i], room[depth, i] = room[depth, i], b[i]
                depth += 1
                width *= 0.5
                waiting |= 1 << depth
                continue
            if least < -_ROUNDING * size:
                return low * limit
        # Nothing here: on to the next interval that waits.
        low += width
        while depth > 0 and not waiting & (1 << depth):
            depth -= 1
            width *= 2.0
        if depth == 0:
            return 2.0 * limit
        waiting &= ~(1 << depth)
        for i in range(COEFFICIENTS):
            b[i] = room[depth - 1, i]
