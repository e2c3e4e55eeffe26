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
from fecontact.core.copies import put

# Highest power of the series.
DEGREE = 23
COEFFICIENTS = DEGREE + 1
# Halvings until what touches zero counts as positive, or as zero if it is below by more.
_DEEPEST = 48
DEPTH = _DEEPEST + 2
_ROUNDING = 1e-15
_MOST_NEWTON = 60

# Matrices that make Bernstein coefficients of coefficients of powers, and of those of the whole
# interval those of its left and right halves.
_POWERS = np.arange(COEFFICIENTS)
_TO_BERNSTEIN = np.array([[math.comb(i, k) / math.comb(DEGREE, k) for k in _POWERS]
                          for i in _POWERS])
_LEFT = np.array([[math.comb(i, k) / 2.0**i for k in _POWERS] for i in _POWERS])
_RIGHT = _LEFT[::-1, ::-1].copy()


@helper
def value_at(c, x):
    """p(x) for coefficients c (n + 1,)."""
    total = 0.0
    for k in range(DEGREE, -1, -1):
        total = total * x + c[k]
    return total


@helper
def _apply(matrix, b, out):
    """Fill ``out`` with the product of a matrix and b."""
    # The length as it is known when this runs: loops of a fixed length are not vectorised.
    for i in range(len(b)):
        total = 0.0
        for k in range(len(b)):
            total += matrix[i, k] * b[k]
        out[i] = total


@helper
def _changes(b):
    """Number of changes of sign; zero counts as positive."""
    count = 0
    for i in range(len(b) - 1):
        count += (b[i] < 0.0) != (b[i + 1] < 0.0)
    return count


@helper
def _only_zero(c, b, low, width, size):
    """The zero of c in an interval where its Bernstein coefficients b change their sign once.

    ``size`` is the largest of the coefficients.
    """
    k = DEGREE
    while k > 0 and b[k - 1] < 0.0:
        k -= 1
    if b[k] >= 0.0:
        return low + width
    # The zero of the control polygon is near; Newton's steps stay within what encloses the zero.
    high = low + width
    x = low + width * (k - 1 + b[k - 1] / (b[k - 1] - b[k])) / DEGREE
    for _ in range(_MOST_NEWTON):
        total, slope = c[DEGREE], 0.0
        for i in range(DEGREE - 1, -1, -1):
            slope = slope * x + total
            total = total * x + c[i]
        if abs(total) <= 2e-16 * size:
            return x
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
def first_zero(p, limit, workspace):
    """The first zero of p from above within 0 < x <= limit, or 2 ``limit`` if there is none.

    Zero at once where p begins negative. ``workspace`` (DEPTH + 3, n + 1) is to work in.
    """
    c, b, half = workspace[DEPTH], workspace[DEPTH + 1], workspace[DEPTH + 2]
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
    _apply(_TO_BERNSTEIN, c, b)
    low, width, depth, waiting = 0.0, 1.0, 0, 0
    while True:
        if b[0] < 0.0:
            return low * limit
        count = _changes(b)
        if count == 1:
            return _only_zero(c, b, low, width, size) * limit
        if count > 0:
            least = 0.0
            for i in range(COEFFICIENTS):
                least = min(least, b[i])
            if depth < _DEEPEST:
                # The right half waits in the row of its depth.
                _apply(_RIGHT, b, workspace[depth])
                _apply(_LEFT, b, half)
                put(half, b)
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
        put(workspace[depth - 1], b)
