"""Newton's method of compiled steps: to a branch, to a fold or a bound on it, to an orbit."""

import math
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.inner_product import weighted_norm
from fecontact.bifurcation.continuation.newton import right_side
from fecontact.bifurcation.harmonic.compiled.arrays import (
    KINKS,
    PLAIN,
    ROUNDING,
    SQUARE,
    TOLERANCE,
    TRUSTED,
)
from fecontact.bifurcation.harmonic.compiled.evaluation import condensation_at, evaluation_at
from fecontact.bifurcation.harmonic.compiled.linear_systems import (
    PRECISE,
    choose_coupled,
    factorise_with,
    inner,
    solve_with,
)
from fecontact.core.compiled import helper, routine
from fecontact.core.records import Vector

# Newton steps before a step fails, and largest factor by which a step with kept factors may leave
# the error of the one before.
_STEPS, _SERVES = 8, 0.2
# First Newton steps up to this relative size may be the only ones, so many times before one is
# measured again, if the next one is so many times shorter than it need be.
_SHORT, _RELIED, _MARGIN = 1e-5, 3, 10.0
# Relative errors of tangents and of Newton steps where they are found by iteration.
_TANGENT, _INEXACT = 1e-7, 1e-3
# Relative size of the last Newton step at special points and bounds, and most such steps.
_EXACT, _EXACT_STEPS = 1e-10, 12
# Part of a step to which folds are located, the one that rounding may leave, factor by which the
# test falls at the end, and most solutions that are examined.
_LOCATED, _ROUNDED, _FALLS, _TRIES = 1e-12, 1e-10, 0.1, 30
# Steps to an orbit, and the shortest part of one.
_CORRECTIONS, _LEAST = 40, 1e-4
# Part of the larger value at both ends that the test of a fold must come below.
_SMALL = 1e-3


@routine
def _factorised(u, T, row, weights, central, tolerance, e):
    """Factorise the derivatives at u and fill ``along``; 0 if modes cannot be separated, else 1."""
    along, n = e.workspace.along, len(u) - 1
    if len(e.workspace.condensed) < n * (n + 1) and choose_coupled(T, e) == 0:
        return 0
    condensation_at(e.condense)(u, T, central, e)
    factorise_with(row, T, e)
    for k in range(len(along)):
        along[k] = 0.0
    along[len(along) - 1] = 1.0
    return solve_with(row, weights, T, tolerance, e, along)


@helper
def _relies(size, scale, e):
    """Whether a first Newton step ends the iteration: the next one is known to be short enough.

    It is proportional to the square of this one, where forces have no kinks; the factor is that of
    steps before, measured again after some.
    """
    smooth = e.numbers[PLAIN] != 0.0 and e.numbers[KINKS] == 0.0
    if not smooth or not e.numbers[SQUARE] >= 0.0 or size > _SHORT * scale:
        return False
    e.numbers[TRUSTED] += 1.0
    following = _MARGIN * e.numbers[SQUARE] * size * size
    return following <= 0.1 * e.numbers[TOLERANCE] * scale and e.numbers[TRUSTED] <= _RELIED


@routine
def newton(u, guess, row, weights, e):
    """Newton's method from u = guess at right angles to a row.

    Returns how often factors were made; zero where it fails, -1 where modes cannot be separated.
    """
    workspace = e.workspace
    n = len(workspace.residual)
    tolerance = e.numbers[TOLERANCE]
    change = workspace.vectors[0]
    scale = 1.0 + weighted_norm(weights, guess)
    before, made, fresh, made_at = np.inf, 0, True, 0.0
    for count in range(1, _STEPS + 1):
        T = evaluation_at(e.evaluate)(u, fresh, e)
        if not T > 0.0:
            return 0
        right_side(workspace.residual, row, u, guess, change)
        if fresh:
            if _factorised(u, T, row, weights, False, _TANGENT, e) == 0:
                return -1
            made, made_at = made + 1, T
        if solve_with(row, weights, made_at, _INEXACT, e, change) == 0:
            return -1
        size = weighted_norm(weights, change)
        if count > 1 and size > before and before <= e.numbers[ROUNDING] * scale:
            return made
        if not size < np.inf or (count > 1 and size > before):
            return 0
        for k in range(n + 1):
            u[k] += change[k]
        if fresh and (size <= tolerance * scale or (count == 1 and _relies(size, scale, e))):
            return made
        if count == 2 and made == 1:
            e.numbers[SQUARE], e.numbers[TRUSTED] = size / (before * before), 0.0
        falls = size / before
        # Behind a kink the next step may be no shorter.
        known = e.numbers[KINKS] == 0.0 or size <= tolerance * scale
        if count > 1 and known and size * falls <= max(0.1 * tolerance, 1e-13) * scale:
            return made
        fresh = not fresh and falls > _SERVES
        before = size
    return 0


@routine
def linearised(u, row, weights, e):
    """Fill ``along`` with the derivatives at u; 0 if that fails, else 1."""
    T = evaluation_at(e.evaluate)(u, True, e)
    return _factorised(u, T, row, weights, True, PRECISE, e) if T > 0.0 else 0


@helper
def _exact_step(u, guess, row, weights, e, change):
    """Fill a Newton step with its own derivatives; returns its length, infinite where it fails."""
    if linearised(u, row, weights, e) == 0:
        return np.inf
    right_side(e.workspace.residual, row, u, guess, change)
    if solve_with(row, weights, e.workspace.t[1] * len(e.tau), PRECISE, e, change) == 0:
        return np.inf
    size = weighted_norm(weights, change)
    return size if size < np.inf else np.inf


@routine
def solved(u, guess, row, weights, e):
    """The solution at right angles to a row with ``along`` there; 0 where it fails, else 1."""
    change, scale, before = e.workspace.vectors[0], 1.0 + weighted_norm(weights, guess), np.inf
    for _ in range(_EXACT_STEPS):
        size = _exact_step(u, guess, row, weights, e, change)
        if size == np.inf or size > 2.0 * before > 2.0 * e.numbers[ROUNDING] * scale:
            return 0
        if size > before:
            return 1
        for k in range(len(u)):
            u[k] += change[k]
        if size <= _EXACT * scale:
            return 1
        before = size
    return 0


@routine
def damped_newton(u, row, weights, tolerance, e):
    """The orbit near u at right angles to a row, with ``along`` there; 0 where it fails, else 1.

    Steps are shortened until the residual falls. u is overwritten.
    """
    workspace = e.workspace
    n = len(workspace.residual)
    change, guess, trial = workspace.vectors[0], workspace.vectors[3], workspace.vectors[4]
    for k in range(n + 1):
        guess[k] = u[k]
    for _ in range(_CORRECTIONS):
        size = _exact_step(u, guess, row, weights, e, change)
        if size == np.inf:
            return 0
        norm = math.sqrt(inner(workspace.residual, workspace.residual))
        small = size < tolerance * (1.0 + weighted_norm(weights, u))
        factor = 1.0
        while True:
            for k in range(n + 1):
                trial[k] = u[k] + factor * change[k]
            found = np.inf
            if evaluation_at(e.evaluate)(trial, False, e) > 0.0:
                found = math.sqrt(inner(workspace.residual, workspace.residual))
            if found < (1.0 - 0.1 * factor) * norm or (small and found < np.inf):
                break
            factor *= 0.5
            if factor < _LEAST:
                return 0
        for k in range(n + 1):
            u[k] = trial[k]
        if small:
            return linearised(u, row, weights, e)
    return 0


class Chord(NamedTuple):
    """Two points of a branch, from ``start`` to ``end`` (n + 1,), with directions (n + 1,) there.

    Lengths between them count along the ``row``, that of the direction at the start.
    """

    start: Vector
    entering: Vector
    end: Vector
    leaving: Vector
    row: Vector


@helper
def _length_of(chord):
    """Length between the points of a chord."""
    way = 0.0
    for k in range(len(chord.row)):
        way += chord.row[k] * (chord.end[k] - chord.start[k])
    return way


@helper
def _cubic(chord, way, along, out):
    """Fill out with the Hermite cubic through the points of a chord, at a length."""
    x = along / way
    first = way * x * (1.0 - x) ** 2 / inner(chord.row, chord.entering)
    last = way * x * x * (x - 1.0) / inner(chord.row, chord.leaving)
    rest = x * x * (3.0 - 2.0 * x)
    for k in range(len(out)):
        out[k] = (chord.start[k] + first * chord.entering[k]
                  + rest * (chord.end[k] - chord.start[k]) + last * chord.leaving[k])


@routine
def fold_between(chord, weights, e, found):
    """Fill found with the fold between two points; ``along`` is its direction.

    Returns 0 where no fold is found, else 1.
    """
    guess, n = e.workspace.vectors[11], len(chord.row) - 1
    way = _length_of(chord)
    low, high, f_low, f_high = 0.0, way, chord.entering[n], chord.leaving[n]
    largest = max(abs(f_low), abs(f_high))
    x, f, at, value = low, f_low, high, f_high
    for _ in range(_TRIES):
        # The secant of the last two values, else of the bracket.
        new = at - value * (at - x) / (value - f)
        if not low < new < high:
            new = 0.5 * (low + high)
        _cubic(chord, way, new, guess)
        for k in range(n + 1):
            found[k] = guess[k]
        if solved(found, guess, chord.row, weights, e) == 0:
            return 0
        x, f, at = at, value, new
        value = e.workspace.along[n] / weighted_norm(weights, e.workspace.along)
        if value * f_low > 0.0:
            low = at
        else:
            high = at
        left = abs(value * (at - x)) / abs(value - f) if value != f else 0.0
        converged = left <= 0.5 * _LOCATED * way and abs(value) <= _FALLS * abs(f)
        stuck = left <= _ROUNDED * way and abs(value) > _FALLS * abs(f)
        if value == 0.0 or converged or stuck or high - low <= _LOCATED * way:
            return 1 if abs(value) <= _SMALL * largest else 0
    return 0


@routine
def bound_between(chord, weights, bound, e, found):
    """Fill found with the point at a bound of the parameter between two points.

    ``along`` becomes its direction, with one as the last number. Returns 0 where there is none.
    """
    guess, unit, n = e.workspace.vectors[11], e.workspace.vectors[12], len(chord.row) - 1
    way, along, first = _length_of(chord), 0.0, chord.start[n]
    unit[:] = 0.0
    unit[n] = 1.0
    _cubic(chord, way, way * (bound - first) / (chord.end[n] - first), guess)
    guess[n] = bound
    for k in range(n + 1):
        found[k] = guess[k]
    if solved(found, guess, unit, weights, e) == 0:
        return 0
    found[n] = bound
    for k in range(n + 1):
        along += chord.row[k] * (found[k] - chord.start[k])
    return 1 if 0.0 < along <= way else 0
