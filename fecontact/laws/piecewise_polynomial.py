"""Piecewise polynomials of degree three, held or repeated outside their knots, for kernels."""

from typing import Any

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.types import Array


@helper
def piecewise(x, p, first):
    """Value and two derivatives at x of a curve from :func:`piecewise_parameters` in p[first:].

    Outside the knots a curve that is not repeated keeps its end values; derivatives at a knot are
    those of the piece that starts there.
    """
    n = int(p[first])
    knots = first + 2
    start, end = p[knots], p[knots + n]
    inside = start <= x < end
    if p[first + 1] != 0.0:
        x = np.fmod(x - start, end - start)
        x = start + x if x >= 0.0 else end + x
        inside = True
    x = min(max(x, start), end)
    # Direct index for equal steps, else bisection.
    k = min(max(int((x - start) / (end - start) * n), 0), n - 1)
    if not p[knots + k] <= x < p[knots + k + 1]:
        k, high = 0, n
        while high - k > 1:
            middle = (k + high) // 2
            if p[knots + middle] <= x:
                k = middle
            else:
                high = middle
    s = x - p[knots + k]
    c = knots + n + 1 + 4 * k
    value = p[c + 3] + s * (p[c + 2] + s * (p[c + 1] + s * p[c]))
    if not inside:
        return value, 0.0, 0.0
    slope = p[c + 2] + s * (2.0 * p[c + 1] + s * 3.0 * p[c])
    return value, slope, 2.0 * p[c + 1] + s * 6.0 * p[c]


def piecewise_parameters(curve: Any, repeat: bool) -> Array:
    """Parameters (5 n + 3,) of a scipy ``PPoly`` of n pieces of degree three at most."""
    n = len(curve.x) - 1
    coefficients = np.zeros((n, 4))
    coefficients[:, 4 - len(curve.c):] = curve.c.T
    return np.concatenate([[n, float(repeat)], curve.x, coefficients.ravel()])


def linear_curve(x: tuple[float, ...], y: tuple[float, ...]) -> Any:
    """Straight lines between points, a scipy ``PPoly``."""
    from scipy.interpolate import PPoly

    return PPoly(np.array([np.diff(y) / np.diff(x), y[:-1]]), np.array(x))


def curve_range(curve: Any) -> tuple[float, float]:
    """Smallest and largest value of a continuous scipy ``PPoly`` between its ends."""
    turns = curve.derivative().roots(extrapolate=False)
    places = np.concatenate([curve.x, turns[np.isfinite(turns)]])
    values = curve(places)
    return float(values.min()), float(values.max())


def equivalent_period(curve: Any) -> float | None:
    """Period of the harmonic with the range and the steepest slope of a ``PPoly``; None if flat.

    At least twice the shortest distance between knots, the resolution of a sampled curve.
    """
    low, high = curve_range(curve)
    steepest = float(_steepest(curve).max())
    if steepest == 0.0:
        return None
    return max(np.pi * (high - low) / steepest, 2.0 * float(np.diff(curve.x).min()))


def _steepest(curve: Any) -> Array:
    """Largest magnitude of the slope in each piece of a ``PPoly`` of degree three at most."""
    c = np.zeros((4, len(curve.x) - 1))
    c[4 - len(curve.c):] = curve.c
    widths = np.diff(curve.x)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = -c[1] / (3.0 * c[0])
    turn = np.where((turn > 0.0) & (turn < widths), turn, 0.0)
    return np.abs([(3.0 * c[0] * s + 2.0 * c[1]) * s + c[2] for s in (0.0, widths, turn)]).max(0)


# Steps per period of a smooth curve.
_STEPS_PER_PERIOD = 20.0


def steep_pieces(curve: Any) -> tuple[float | None, Array]:
    """Equivalent period of a ``PPoly`` without its steep pieces, and the ends of these.

    Steps end at the ends of steep pieces, which therefore do not limit the step elsewhere. The
    threshold of steepness minimises the number of steps along the curve; the period is None if no
    piece is left.
    """
    low, high = curve_range(curve)
    slopes, widths = _steepest(curve), np.diff(curve.x)
    order = np.argsort(-slopes)
    with np.errstate(divide="ignore", invalid="ignore"):
        periods = np.maximum(np.pi * (high - low) / slopes[order], 2.0 * widths[order])
    # The shortest of the remaining pieces; each piece removed adds up to two breaks.
    shortest = np.append(np.minimum.accumulate(periods[::-1])[::-1], np.inf)
    if high == low:
        shortest[:] = np.inf
    steps = 2.0 * np.arange(len(shortest)) + _STEPS_PER_PERIOD * (
        curve.x[-1] - curve.x[0]) / shortest
    count = int(np.argmin(steps))
    steep = np.union1d(curve.x[order[:count]], curve.x[order[:count] + 1])
    return None if np.isinf(shortest[count]) else float(shortest[count]), steep
