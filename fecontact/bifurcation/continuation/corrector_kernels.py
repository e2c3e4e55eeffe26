"""Sums over all unknowns in Newton's method, compiled: one pass each, on one core."""

import math

from numba import types

from fecontact.core.compiled import borrowed, f8, helper, i8, kernel, matrix, vector


@helper
def _product(weights, a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(len(a)):
        total += weights[k] * a[k] * b[k]
    return total


@kernel(f8(vector, vector, vector))
def weighted_product(weights, a, b):  # type: ignore[no-untyped-def]
    """Sum w a b."""
    return _product(weights, a, b)


@kernel(f8(vector, vector))
def weighted_norm(weights, x):  # type: ignore[no-untyped-def]
    """Square root of sum w x x."""
    return math.sqrt(_product(weights, x, x))


@kernel(types.void(vector, vector, vector, vector, vector))
def right_side(residual, row, u, guess, rhs):  # type: ignore[no-untyped-def]
    """Fill rhs (N + 1,) with the negative residual (N,) and the negative row (u - guess)."""
    total = 0.0
    for k in range(len(u)):
        total += row[k] * (u[k] - guess[k])
    for k in range(len(residual)):
        rhs[k] = -residual[k]
    rhs[len(residual)] = -total


@kernel(f8(vector, matrix, i8))
def improve(weights, steps, count):  # type: ignore[no-untyped-def]
    """Correct steps[count], made with the matrix of steps[0], by what those before it taught.

    Broyden's update of the matrix, applied as sums over the steps. Returns the step's length.
    """
    weights, steps = borrowed(weights), borrowed(steps)
    change = steps[count]
    for index in range(count):
        step = steps[index]
        part = _product(weights, step, change) / _product(weights, step, step)
        if index + 1 < count:
            following = steps[index + 1]
            for k in range(len(change)):
                change[k] += part * following[k]
        else:
            for k in range(len(change)):
                change[k] /= 1.0 - part
    return math.sqrt(_product(weights, change, change))
