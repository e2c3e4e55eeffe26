"""Steps along a branch of forced orbits of a contact system, many of them in one compiled call.

Per step: predictor along the tangent with the curvature of the last step, Newton's method at right
angles to it, tangent, step control, as in
:mod:`fecontact.bifurcation.continuation.pseudo_arclength`. The factors made at the prediction serve
all Newton steps, as long as these converge quickly, and the tangent. What is not a plain step, a
fold, a bound, a failure, ends the call.
"""

import math

import numpy as np

from fecontact.bifurcation.harmonic.compiled.arrays import (
    EQUATIONS,
    FIRST_BOUND,
    HIGH,
    LARGEST_STEP,
    LARGEST_TURN,
    LAST_BOUND,
    LOW,
    REACHED,
    ROUNDING,
    TOLERANCE,
)
from fecontact.bifurcation.harmonic.compiled.evaluation import (
    condense,
    evaluate_at,
    take_forces,
    take_mean,
)
from fecontact.bifurcation.harmonic.compiled.linear_systems import (
    choose_coupled,
    factorise_with,
    inner,
    length,
    solve_with,
)
from fecontact.core.compiled import helper, i8, kernel, routine, vector
from fecontact.core.references import borrowed

# Newton steps before a step fails, and largest factor by which a step with kept factors may leave
# the error of the one before.
_STEPS, _SERVES = 8, 0.2
# Largest curvature correction of the predictor, in steps.
_MOST_BENT = 0.2
# Halvings of a step in one call; a turn that stays the same over two of them is a corner.
_HALVINGS, _SAME_TURN = 8, 0.8
# Overshoot of a bound.
_OVERSHOOT = 1.2
# Growth of an orbit from which its scales follow.
_GROWN = 1.5

# Relative errors of tangents and of Newton steps where they are found by iteration.
_TANGENT, _INEXACT = 1e-7, 1e-3

# Why a call ended: as many points as were asked for, something to look at in the next step, a step
# that fails, modes that cannot be separated.
FULL, EVENT, FAILED, COUPLED = range(4)


@routine
def _corrected(u, guess, row, weights, e):
    """Newton's method from u = guess at right angles to a row.

    Returns how often factors were made; zero where it fails, -1 where modes cannot be separated.
    """
    room = e.room
    n = len(room.residual)
    tolerance = e.numbers[TOLERANCE]
    change = room.vectors[0]
    scale = 1.0 + length(weights, guess)
    before, made, fresh, made_at = np.inf, 0, True, 0.0
    for count in range(1, _STEPS + 1):
        T = evaluate_at(u, fresh, e)
        if not T > 0.0:
            return 0
        for k in range(n):
            change[k] = -room.residual[k]
        off = 0.0
        for k in range(n + 1):
            off += row[k] * (u[k] - guess[k])
        change[n] = -off
        if fresh:
            if len(room.condensed) < n * (n + 1) and choose_coupled(T, e) == 0:
                return -1
            condense(u, T, False, e)
            factorise_with(row, T, e)
            made, made_at = made + 1, T
            for k in range(n):
                room.along[k] = 0.0
            room.along[n] = 1.0
            if solve_with(row, weights, T, _TANGENT, e, room.along) == 0:
                return -1
        if solve_with(row, weights, made_at, _INEXACT, e, change) == 0:
            return -1
        size = length(weights, change)
        if count > 1 and size > before and before <= e.numbers[ROUNDING] * scale:
            return made
        if not size < np.inf or (count > 1 and size > before):
            return 0
        for k in range(n + 1):
            u[k] += change[k]
        if fresh and size <= tolerance * scale:
            return made
        falls = size / before
        if count > 1 and size * falls <= max(0.1 * tolerance, 1e-13) * scale:
            return made
        fresh = not fresh and falls > _SERVES
        before = size
    return 0


@helper
def _set_weights(scales, H, weights):
    """Weights of the unknowns for scales (m + 1,) of displacements and parameter."""
    m = len(scales) - 1
    for k in range(2 * H + 1):
        for j in range(m):
            weights[k * m + j] = (1.0 if k == 0 else 0.5) / (scales[j] * scales[j])
    weights[len(weights) - 1] = 1.0 / (scales[m] * scales[m])


@helper
def _grow(u, scales, e):
    """Enlarge the scales where the orbit has outgrown them; returns whether it has."""
    m, L = e.springs.shape[1], e.values.shape[1]
    grown = False
    for j in range(m):
        total = 0.0
        for k in range(1, L):
            total += u[k * m + j] * u[k * m + j]
        if min(math.sqrt(total), e.limits[j]) > _GROWN * scales[j]:
            grown = True
    if grown:
        for j in range(m):
            total = 0.0
            for k in range(1, L):
                total += u[k * m + j] * u[k * m + j]
            scales[j] = max(scales[j], min(math.sqrt(total), e.limits[j]))
    return grown


@helper
def _keep(count, u, tangent, e, out):
    """Store a point with what its values are made from."""
    out.u[count, :] = u
    out.tangent[count, :] = tangent
    for n in range(len(e.tau)):
        for i in range(len(e.offsets)):
            out.z[count, n, i] = e.room.z[n, i]
    take_forces(u[len(u) - 1], e, out.forces[count])
    take_mean(e, out.mean[count])


@kernel(i8(vector, vector, vector, vector, EQUATIONS, REACHED, vector))
def steps(u, tangent, bend, scales, e, out, why):
    """Make steps from u along a tangent until ``out`` is full or something is to be looked at.

    u, tangent and bend (n + 1,), the derivative of the tangent, and scales (m + 1,) are
    overwritten; ``out.step`` holds the length of the first step, and then of the next one. why (1,)
    says why the call ended. Returns the number of points.
    """
    u, tangent, bend, scales = borrowed(u), borrowed(tangent), borrowed(bend), borrowed(scales)
    e, out = borrowed(e), borrowed(out)
    room = e.room
    n, H = len(u) - 1, e.values.shape[1] // 2
    row, weights, guess, there, chord = (room.vectors[1], room.vectors[2], room.vectors[3],
                                         room.vectors[4], room.vectors[5])
    _set_weights(scales, H, weights)
    step, count, halvings, last_turn, alike = out.step[0], 0, 0, 0.0, 0
    why[0] = FULL
    while count < len(out.u):
        for k in range(n + 1):
            row[k] = weights[k] * tangent[k]
        slope = tangent[n]
        bound = e.numbers[LAST_BOUND] if slope > 0.0 else e.numbers[FIRST_BOUND]
        if slope != 0.0:
            step = min(step, _OVERSHOOT * (bound - u[n]) / slope)
        aside = 0.5 * step * step
        if aside * length(weights, bend) > _MOST_BENT * step:
            aside = 0.0
        for k in range(n + 1):
            guess[k] = u[k] + step * tangent[k] + aside * bend[k]
            there[k] = guess[k]
        if not e.numbers[LOW] < guess[n] < e.numbers[HIGH]:
            why[0] = EVENT
            break
        made = _corrected(there, guess, row, weights, e)
        if made < 0:
            why[0] = COUPLED
            break
        size = length(weights, room.along)
        failed = made == 0 or not 0.0 < size < np.inf
        turned = False
        if not failed:
            for k in range(n + 1):
                chord[k] = there[k] - u[k]
            aligned = inner(row, room.along) / size
            ahead = inner(row, chord) / length(weights, chord)
            cosine = math.cos(e.numbers[LARGEST_TURN])
            if min(aligned, ahead) < cosine:
                # At a corner the turn stays the same over shorter steps.
                turn = math.acos(max(-1.0, min(1.0, aligned)))
                alike = alike + 1 if turn > _SAME_TURN * last_turn > 0.0 else 0
                last_turn = turn
                turned = alike < 2 or ahead < 0.2 or aligned < 0.2
        if failed or turned:
            halvings += 1
            step *= 0.5
            if halvings > _HALVINGS:
                why[0] = FAILED
                break
            continue
        if (room.along[n] * slope <= 0.0 or there[n] <= e.numbers[FIRST_BOUND]
            or there[n] >= e.numbers[LAST_BOUND]):
            why[0] = EVENT
            break
        way = inner(row, chord)
        for k in range(n + 1):
            new = room.along[k] / size
            bend[k] = (new - tangent[k]) / way if last_turn == 0.0 else 0.0
            tangent[k], u[k] = new, there[k]
        _keep(count, u, tangent, e, out)
        factor = 2.0 if made == 1 else (1.5 if made == 2 else 0.7)
        turn = math.acos(max(-1.0, min(1.0, aligned)))
        if turn > 0.0:
            factor = min(factor, max(0.5, 0.5 * e.numbers[LARGEST_TURN] / turn))
        step = min(factor * step, e.numbers[LARGEST_STEP])
        halvings, last_turn, alike = 0, 0.0, 0
        if _grow(u, scales, e):
            _set_weights(scales, H, weights)
            size = length(weights, tangent)
            for k in range(n + 1):
                tangent[k] /= size
                bend[k] = 0.0
        for k in range(len(scales)):
            out.scales[count, k] = scales[k]
        count += 1
    out.step[0] = step
    return count
