"""Guesses of the next point of a branch from the last points and their tangents.

Guesses of :class:`Bent` lie on a parabola through the last two points, those of :class:`Trail` on
curves through up to four. There lengths along the branch are those of its projection on the last
tangent t_0, x_j = <t_0, u_j - u_0> for the points u_0, u_1, ... backwards, with the slopes du/dx =
t_j / <t_0, t_j>. A parabola, a cubic and a quartic have the slopes of the last two, three and four
points (Adams and Bashforth); another cubic, of Hermite, those of two points and their places, too.
That counts which was nearest at the last point. Rounding and a change of mesh tell against higher
orders.
"""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self

import numpy as np

from fecontact.bifurcation.continuation.inner_product import weighted_norm, weighted_product
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array

# Points behind the last one that count at most.
_MOST_BEHIND = 3
# Largest distance of a guess from the tangent, in steps.
_MOST_BENT = 0.2
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


_UNKNOWN = Misses()


@dataclass(frozen=True, eq=False)
class Predictor:
    """Guesses along the tangent.

    Attributes
    ----------
    rows : (k, n) array
        First u and tangent of the last point, then data of the branch behind it; empty before the
        first step.
    """

    rows: Array = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def last(self) -> Array | None:
        """The last point (n,); None before the first step."""
        return self.rows[0] if len(self.rows) else None

    @property
    def bend(self) -> Array | None:
        """Derivative (n,) of the tangent along the branch; None if unknown."""
        return None

    def ahead(self, weights: Array, u: Array, tangent: Array, step: float) -> Array:
        """The guess a step ahead of u, in the inner product of the weights (n,)."""
        return u + step * tangent

    def off(self, step: float) -> float:
        """Expected error of the guess a step ahead; infinite if unknown."""
        return math.inf

    def after(self, weights: Array, u: Array, tangent: Array) -> Self:
        """The predictor at the next point."""
        return replace(self, rows=np.array([u, tangent]))

    def moved(self, rows: Array) -> Self:
        """The predictor for other unknowns, such as those on a new mesh."""
        return replace(self, rows=rows)


class Bent(Predictor):
    """Guesses with the curvature of the last step, the third of the rows where it is known."""

    @classmethod
    def of(cls, u: Array, tangent: Array, bend: Array | None) -> Self:
        """The predictor at a point, with the derivative of the tangent along the branch."""
        return cls(np.array([u, tangent] if bend is None else [u, tangent, bend]))

    @property
    def bend(self) -> Array | None:
        """Derivative (n,) of the tangent along the branch; None if unknown."""
        return self.rows[2] if len(self.rows) > 2 else None

    def ahead(self, weights: Array, u: Array, tangent: Array, step: float) -> Array:
        """A parabola, or the tangent where that is bent too much to be believed."""
        straight, bend = super().ahead(weights, u, tangent, step), self.bend
        if bend is None:
            return straight
        # The length of the old tangent changes with mesh and scales.
        length = step / weighted_norm(weights, self.rows[1])
        bow = 0.5 * length * length * bend
        return straight if weighted_norm(weights, bow) > _MOST_BENT * step else straight + bow

    def after(self, weights: Array, u: Array, tangent: Array) -> Self:
        """With the curvature of the step to the point."""
        if self.last is None:
            return super().after(weights, u, tangent)
        direction = self.rows[1] / weighted_norm(weights, self.rows[1])
        length = weighted_product(weights, direction, u - self.last)
        return self.of(u, tangent, (tangent - direction) / length if length > 0.0 else None)


# Before the first step.
BENT = Bent()


@dataclass(frozen=True, eq=False)
class Trail(Predictor):
    """Guesses by what was nearest at the last point; the rows are u and tangent of each point.

    Attributes
    ----------
    misses : Misses
        How far guesses of the last point were off.
    """

    misses: Misses = _UNKNOWN

    def ahead(self, weights: Array, u: Array, tangent: Array, step: float) -> Array:
        """The guess, or the tangent where that is bent too much to be believed."""
        straight = super().ahead(weights, u, tangent, step)
        found = np.empty((len(_POWERS), len(u)))
        count = _guesses(weights, self.rows, step, found) if len(self.rows) > 2 else 0
        if count == 0:
            return straight
        expected = _expected(self.misses, step)[:count]
        guess: Array = found[expected.index(min(expected))] if expected else found[0]
        bent = weighted_norm(weights, guess - straight) > _MOST_BENT * step
        return straight if bent else guess

    def off(self, step: float) -> float:
        """Expected error of the guess, from those at the last points; infinite if unknown."""
        return max(min(_expected(self.misses, step), default=math.inf), self.misses.worst)

    def after(self, weights: Array, u: Array, tangent: Array) -> Self:
        """With one more point, and how far it was off."""
        here = np.array([u, tangent])
        if self.last is None:
            return replace(self, rows=here)
        return replace(self, rows=np.concatenate([here, self.rows[: 2 * _MOST_BEHIND]]),
                       misses=self._misses_at(weights, u))

    def _misses_at(self, weights: Array, there: Array) -> Misses:
        u, tangent = self.rows[:2]
        step = float(weighted_product(weights, tangent, there - u)
                     / weighted_norm(weights, tangent))
        found = np.empty((len(_POWERS), len(u)))
        count = _guesses(weights, self.rows, step, found) if step > 0.0 else 0
        if count == 0:
            return _UNKNOWN
        each = tuple(float(weighted_norm(weights, guess - there)) for guess in found[:count])
        before, worst = _expected(self.misses, step)[:count], 0.0
        if before:
            worst = max(each[before.index(min(before))], _REMEMBERED * self.misses.worst)
        return Misses(each, step, worst)


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


def _expected(misses: Misses, step: float) -> list[float]:
    """Errors of all guesses a step ahead, as far as they are known."""
    ratio = step / misses.step
    return [miss * ratio**power for miss, power in zip(misses.each, _POWERS, strict=False)]
