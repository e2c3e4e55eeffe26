r"""First zero of a power series within a step, with none missed.

A power series :math:`p(x) = \sum_k c_k x^k`, 0 <= x <= 1, has in Bernstein form coefficients

.. math:: b_i = \sum_{k \le i} \binom{i}{k} \binom{n}{k}^{-1} c_k

by which :mod:`fecontact.integrate.bernstein` encloses its zero.
"""

import math

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.integrate.bernstein import DEPTH, NOWHERE, first_change, only_zero, signs_by

# Highest power of the series.
DEGREE = 23
COEFFICIENTS = DEGREE + 1
# Rows and columns of the workspace.
WORKSPACE = (DEPTH + 2, COEFFICIENTS + 1)
# Part of the largest coefficient up to which a minimum below zero is rounding, and no zero.
_ROUNDING = 1e-15

# Matrix that makes Bernstein coefficients of coefficients of powers.
_POWERS = np.arange(COEFFICIENTS)
_TO_BERNSTEIN = np.array([[math.comb(i, k) / math.comb(DEGREE, k) for k in _POWERS]
                          for i in _POWERS])


@helper
def value_at(c, x):
    """p(x) for coefficients c (n + 1,)."""
    total = 0.0
    for k in range(DEGREE, -1, -1):
        total = total * x + c[k]
    return total


@helper
def _value_and_slope(c, x):
    """p(x) and p'(x) for coefficients c (n + 1,)."""
    total, slope = c[DEGREE], 0.0
    for k in range(DEGREE - 1, -1, -1):
        slope = slope * x + total
        total = total * x + c[k]
    return total, slope


@helper
def _zero(part, begin, width, row, given):
    """Only zero in a part of the step, for coefficients of powers and the largest of them."""
    c, size = given
    return only_zero(_value_and_slope, c, size, part, begin, width)


_signs = signs_by(_zero)


@routine
def first_zero(p, limit, workspace):
    """The first zero of p from above within 0 < x <= limit, or 2 ``limit`` if there is none.

    Zero at once where p begins negative. ``workspace`` (DEPTH + 2, n + 2) is to work in.
    """
    c, b = workspace[DEPTH], workspace[DEPTH + 1, :COEFFICIENTS]
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
    # The length as it is known when this runs: loops of a fixed length are not vectorised.
    for i in range(len(b)):
        total = 0.0
        for k in range(len(b)):
            total += _TO_BERNSTEIN[i, k] * c[k]
        b[i] = total
    x = first_change(_signs, (_ROUNDING * size, (c, size)), b, workspace)
    return x * limit if x != NOWHERE else 2.0 * limit
