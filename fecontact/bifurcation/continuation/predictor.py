"""Guesses of the next point of a branch from the last points and their tangents.

Lengths along the branch are those of its projection on the last tangent t_0, x_j = <t_0, u_j - u_0>
for the points u_0, u_1, ... backwards, with the slopes du/dx = t_j / <t_0, t_j>. A parabola, a
cubic and a quartic have the slopes of the last two, three and four points (Adams and Bashforth);
another cubic, of Hermite, those of two points and their places, too. That counts which was nearest
at the last point. Rounding and a change of mesh tell against higher orders.
"""

import math
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.newton import weighted_norm, weighted_product
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array

# Points behind the last one that count at most.
MOST_BEHIND = 3
# Powers of the step with which the errors of parabola, Hermite's cubic, cubic and quartic grow.
_POWERS = (3, 4, 4, 5)
# Part of the largest error of late that counts at the next point.
_REMEMBERED = 0.7
# Cosine between both tangents below which a point behind does not tell of the next one.
_LEAST_COSINE = 0.5


class Misses(NamedTuple):
    """Errors of earlier predictions.

    each are those of all guesses at the last point, a ``step`` ahead of the one before; worst is
    the largest error of late of those that were taken.
    """

    each: tuple[float, ...] = ()
    step: float = 1.0
    worst: float = 0.0


UNKNOWN = Misses()


@helper
def _shares(places, count, step, product, out):
    """Fill out (count,) with the integrals from 0 to the step of Lagrange's polynomials."""
    for j in range(count):
        product[:] = 0.0
        product[0] = 1.0
        degree = 0
        for i in range(count):
            if i != j:
                scale = 1.0 / (places[j] - places[i])
                for k in range(degree + 1, 0, -1):
                    product[k] = (product[k - 1] - places[i] * product[k]) * scale
                product[0] *= -places[i] * scale
                degree += 1
        total, power = 0.0, step
        for k in range(count):
            total += product[k] * power / (k + 1)
            power *= step
        out[j] = total


@kernel
def _guesses(weights: Vector, trail: Matrix, step: float, out: Matrix) -> int:
    """Fill rows of out (4, n) with the guesses a step ahead; returns how many there are.

    ``trail`` (2 k, n) are u and tangent of the last point, of the one before it, and so on.
    """
    points, size = len(trail) // 2, trail.shape[1]
    places, factors = np.zeros(points), np.zeros(points)
    root, count = 0.0, 0
    for j in range(points):
        other, along, square = 0.0, 0.0, 0.0
        for k in range(size):
            weighted = weights[k] * trail[1, k]
            other += weighted * trail[2 * j + 1, k]
            along += weighted * (trail[2 * j, k] - trail[0, k])
            square += weights[k] * trail[2 * j + 1, k] ** 2
        if j == 0:
            root = math.sqrt(square)
        if not (other > _LEAST_COSINE * root * math.sqrt(square)
                and (j == 0 or along / root < places[j - 1])):
            break
        places[j], factors[j] = along / root, root / other
        count += 1
    if count < 2:
        return 0
    shares, product = np.zeros(points), np.zeros(points + 1)
    for order in range(2, count + 1):
        row = 0 if order == 2 else order - 1
        _shares(places, order, step, product, shares)
        for k in range(size):
            out[row, k] = trail[0, k]
        for j in range(order):
            share = shares[j] * factors[j]
            for k in range(size):
                out[row, k] += share * trail[2 * j + 1, k]
    length = -places[1]
    x = 1.0 + step / length
    by_old = length * x * (1.0 - x) ** 2 * factors[1]
    by_here = length * x * x * (x - 1.0) * factors[0]
    blend = x * x * (3.0 - 2.0 * x)
    for k in range(size):
        out[1, k] = (trail[2, k] + by_old * trail[3, k] + blend * (trail[0, k] - trail[2, k])
                     + by_here * trail[1, k])
    return count


def predicted(
    weights: Array, trail: Array, straight: Array, step: float, misses: Misses, most: float
) -> Array:
    """The guess a step ahead by what was nearest at the last point.

    Parameters
    ----------
    weights : (n,) array
        Of the inner product.
    trail : (2 k, n) array
        u and tangent of the last point, of the one before it, and so on; of any length.
    straight : (n,) array
        The guess along the tangent.
    step : float
        Its distance.
    misses : Misses
        At the last point.
    most : float
        Largest distance from the tangent, in steps; beyond it the guess lies on the tangent.
    """
    found = np.empty((len(_POWERS), len(straight)))
    count = _guesses(weights, trail, step, found)
    if count == 0:
        return straight
    expected = _expected(misses, step)[:count]
    guess: Array = found[expected.index(min(expected))] if expected else found[0]
    return straight if weighted_norm(weights, guess - straight) > most * step else guess


def expected(step: float, misses: Misses) -> float:
    """Expected error of :func:`predicted` a step ahead."""
    return max(min(_expected(misses, step), default=math.inf), misses.worst)


def misses_at(weights: Array, there: Array, trail: Array, misses: Misses) -> Misses:
    """The :class:`Misses` at a point ``there`` reached from the first of a trail, with its own."""
    u, tangent = trail[0], trail[1]
    step = float(weighted_product(weights, tangent, there - u) / weighted_norm(weights, tangent))
    found = np.empty((len(_POWERS), len(u)))
    count = _guesses(weights, trail, step, found) if step > 0.0 else 0
    if count == 0:
        return UNKNOWN
    each = tuple(float(weighted_norm(weights, guess - there)) for guess in found[:count])
    before, worst = _expected(misses, step)[:count], 0.0
    if before:
        worst = max(each[before.index(min(before))], _REMEMBERED * misses.worst)
    return Misses(each, step, worst)


def _expected(misses: Misses, step: float) -> list[float]:
    """Errors of all guesses a step ahead, as far as they are known."""
    ratio = step / misses.step
    return [miss * ratio**power for miss, power in zip(misses.each, _POWERS, strict=False)]
