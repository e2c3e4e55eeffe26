"""Guesses of the next point of a branch from the last two points and their tangents.

Lengths along the branch are those of its projection on the last tangent, x = <t, u - u_0>, with
x = -L at the point before. A parabola has the tangents of both points, a cubic their places too;
its error is u''''/24 x^2 (x + L)^2, that of the parabola u'''/12 x^2 (2 x + 3 L).
"""

import math
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.newton import weighted_norm, weighted_product
from fecontact.core.compiled import f8, kernel, matrix, vector
from fecontact.core.references import borrowed
from fecontact.core.types import Array

# Part of the largest error of late that counts at the next point.
_REMEMBERED = 0.9
# Cosine between both tangents below which the point before does not tell of the next one.
_LEAST_COSINE = 0.5


class Bends(NamedTuple):
    """How far guesses were off: both at the last point, and that which was taken, of late.

    The first two are over the powers of the lengths.
    """

    third: float = math.inf
    fourth: float = math.inf
    worst: float = 0.0


@kernel(f8(vector, vector, vector, vector, vector, f8, matrix))
def _guesses(weights, u, tangent, old, old_tangent, step, out):
    """Fill out (2, n) with parabola and cubic a step ahead; returns L, 0 where there are none."""
    weights, u, tangent = borrowed(weights), borrowed(u), borrowed(tangent)
    old, old_tangent, out = borrowed(old), borrowed(old_tangent), borrowed(out)
    own, other, along, size = 0.0, 0.0, 0.0, 0.0
    for k in range(len(u)):
        weighted = weights[k] * tangent[k]
        own += weighted * tangent[k]
        other += weighted * old_tangent[k]
        along += weighted * (u[k] - old[k])
        size += weights[k] * old_tangent[k] ** 2
    root = math.sqrt(own)
    if not (other > _LEAST_COSINE * root * math.sqrt(size) and along > 0.0):
        return 0.0
    length = along / root
    first, last = root / other, 1.0 / root
    x = 1.0 + step / length
    by_old = length * x * (1.0 - x) ** 2 * first
    by_here = length * x * x * (x - 1.0) * last
    aside = x * x * (3.0 - 2.0 * x)
    half = 0.5 * step * step / length
    for k in range(len(u)):
        ahead = last * tangent[k]
        out[0, k] = u[k] + step * ahead + half * (ahead - first * old_tangent[k])
        out[1, k] = (old[k] + by_old * old_tangent[k] + aside * (u[k] - old[k])
                     + by_here * tangent[k])
    return length


def predicted(
    weights: Array, here: tuple[Array, Array], before: tuple[Array, Array], step: float,
    bends: Bends, most: float,
) -> Array:
    """The guess a step ahead by what was nearer at the last point, parabola or cubic.

    Parameters
    ----------
    weights : (n,) array
        Of the inner product.
    here, before : pairs of (n,) arrays
        u and tangent of the last point, and of the one before it.
    step : float
        Along the tangent.
    bends : Bends
        Of the last point.
    most : float
        Largest distance from the tangent, in steps; beyond it the guess lies on the tangent.
    """
    u, tangent = here
    straight: Array = u + step * tangent
    found = np.empty((2, len(u)))
    length = _guesses(weights, u, tangent, *before, step, found)
    if length == 0.0:
        return straight
    by_parabola, by_cubic = _off(bends, step, length)
    guess: Array = found[int(by_cubic < by_parabola)]
    return straight if weighted_norm(weights, guess - straight) > most * step else guess


def expected(
    weights: Array, u: Array, before: tuple[Array, Array], step: float, bends: Bends
) -> float:
    """How far :func:`predicted` is likely to be off a step ahead of u."""
    return max(min(_off(bends, step, float(weighted_norm(weights, u - before[0])))), bends.worst)


def bends_at(
    weights: Array, there: Array, here: tuple[Array, Array], before: tuple[Array, Array],
    bends: Bends,
) -> Bends:
    """The :class:`Bends` at a point ``there`` that was reached from ``here``, with those there."""
    u, tangent = here
    step = float(weighted_product(weights, tangent, there - u) / weighted_norm(weights, tangent))
    found = np.empty((2, len(u)))
    length = _guesses(weights, u, tangent, *before, step, found) if step > 0.0 else 0.0
    if length == 0.0:
        return Bends()
    parabola, cubic = (float(weighted_norm(weights, guess - there)) for guess in found)
    powers, guessed = _powers(step, length), _off(bends, step, length)
    taken = cubic if guessed[1] < guessed[0] else parabola
    return Bends(parabola / powers[0], cubic / powers[1], max(taken, _REMEMBERED * bends.worst))


def _off(bends: Bends, step: float, length: float) -> tuple[float, float]:
    """Errors of parabola and cubic a step ahead of points at this distance."""
    parabola, cubic = _powers(step, length)
    return bends.third * parabola, bends.fourth * cubic


def _powers(step: float, length: float) -> tuple[float, float]:
    return step * step * (2.0 * step + 3.0 * length), step * step * (step + length) ** 2
