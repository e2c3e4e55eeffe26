"""Steps along a branch of forced orbits of a contact system, many of them in one compiled call.

Per step: predictor along the Hermite cubic of the last step, Newton's method at right angles to the
tangent, tangent, step control, as in
:mod:`fecontact.bifurcation.continuation.pseudo_arclength`. The factors made at the prediction serve
all Newton steps, as long as these converge quickly, and the tangent. Folds are located where they
alone are asked for, and so is the bound at which the branch ends. What is no such step, a failure
or the change of another test, ends the call.
"""

import math

import numpy as np

from fecontact.bifurcation.continuation.inner_product import weighted_norm
from fecontact.bifurcation.harmonic.compiled.arrays import (
    FIRST_BOUND,
    FOLDS,
    HIGH,
    LARGEST_STEP,
    LARGEST_TURN,
    LAST_BOUND,
    LOW,
    SQUARE,
    Equations,
    Reached,
)
from fecontact.bifurcation.harmonic.compiled.evaluation import take_forces, take_mean
from fecontact.bifurcation.harmonic.compiled.linear_systems import inner
from fecontact.bifurcation.harmonic.compiled.newton import (
    Chord,
    bound_between,
    fold_between,
    linearised,
    newton,
)
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Vector

# Largest curvature correction of the predictor, in steps.
_MOST_BENT = 0.2
# Halvings of a step in one call; a turn that stays the same over two of them is a corner.
_HALVINGS, _SAME_TURN = 8, 0.8
# Overshoot of a bound.
_OVERSHOOT = 1.2
# Growth of an orbit from which its scales follow.
_GROWN = 1.5

# Why a call ended: as many points as were asked for, something to look at in the next step, a step
# that fails, modes that cannot be separated, a bound on which the last point lies.
FULL, EVENT, FAILED, COUPLED, BOUND = range(5)


@helper
def _set_weights(scales, H, weights):
    """Weights of the unknowns for scales (m + 1,) of displacements and parameter."""
    m = len(scales) - 1
    for k in range(2 * H + 1):
        for j in range(m):
            weights[k * m + j] = (1.0 if k == 0 else 0.5) / (scales[j] * scales[j])
    weights[len(weights) - 1] = 1.0 / (scales[m] * scales[m])


@helper
def _size_of(u, j, e):
    """Size of the motion of displacement j, up to its limit."""
    m, total = e.springs.shape[1], 0.0
    for k in range(1, e.values.shape[1]):
        total += u[k * m + j] * u[k * m + j]
    return min(math.sqrt(total), e.limits[j])


@helper
def _grow(u, scales, e):
    """Enlarge the scales where the orbit has outgrown them; returns whether it has."""
    grown = False
    for j in range(e.springs.shape[1]):
        grown = grown or _size_of(u, j, e) > _GROWN * scales[j]
    if grown:
        for j in range(e.springs.shape[1]):
            scales[j] = max(scales[j], _size_of(u, j, e))
    return grown


@helper
def _keep(count, u, size, scales, way, e, out):
    """Store a point, its direction ``along`` over ``size``, and what its values are made from."""
    for k in range(len(u)):
        out.u[count, k], out.tangent[count, k] = u[k], e.workspace.along[k] / size
    for n in range(len(e.tau)):
        for i in range(len(e.kept_offsets)):
            out.z[count, n, i] = e.workspace.z[n, i]
    take_forces(u[len(u) - 1], e, out.forces[count])
    take_mean(e, out.mean[count])
    for k in range(len(scales)):
        out.scales[count, k] = scales[k]
    out.lengths[count], out.folds[count] = way, 0


@helper
def _predict(u, tangent, bend, third, step, weights, guess):
    """Fill the guess a step ahead: along the cubic, or the tangent where that bends too much."""
    curvature = 0.0
    for k in range(len(u)):
        off = step * step * (bend[k] + step * third[k])
        guess[k] = off
        curvature += weights[k] * off * off
    kept = 1.0 if curvature <= (_MOST_BENT * step) ** 2 else 0.0
    for k in range(len(u)):
        guess[k] = u[k] + step * tangent[k] + kept * guess[k]


@helper
def _exact(count, row, weights, e, out):
    """Make the last tangent that of the equations at its point; 0 if its slope changes sign."""
    u, tangent = out.u[count], out.tangent[count]
    along, n = e.workspace.along, len(u) - 1
    for k in range(n + 1):
        row[k] = weights[k] * tangent[k]
    if linearised(u, row, weights, e) == 0:
        return 0
    size = weighted_norm(weights, along)
    if not 0.0 < size < np.inf or along[n] * tangent[n] <= 0.0:
        return 0
    for k in range(n + 1):
        tangent[k] = along[k] / size
    return 1


@kernel
def steps(
    u: Vector, tangent: Vector, bend: Vector, scales: Vector, e: Equations, out: Reached,
    why: Vector,
) -> int:
    """Make steps from u along a tangent until ``out`` is full or something is to be examined.

    u, tangent and bend (n + 1,), the derivative of the tangent, and scales (m + 1,) are
    overwritten; ``out.step`` holds the length of the first step, and then of the next one. why (1,)
    says why the call ended. Returns the number of points.
    """
    workspace = e.workspace
    n, H = len(u) - 1, e.values.shape[1] // 2
    row, weights, guess, there, chord = (workspace.vectors[1], workspace.vectors[2],
                                         workspace.vectors[3], workspace.vectors[4],
                                         workspace.vectors[5])
    found, third = workspace.vectors[10], workspace.vectors[13]
    _set_weights(scales, H, weights)
    for k in range(n + 1):
        bend[k], third[k] = 0.5 * bend[k], 0.0
    step, count, halvings, last_turn, alike, far = out.step[0], 0, 0, 0.0, 0, 0.0
    # With internal variables of friction branches have kinks, too many for a cubic.
    smooth = 0.0 if len(e.kept_offsets) > 0 else 1.0
    why[0] = FULL
    e.numbers[SQUARE] = -1.0
    while count < len(out.u):
        for k in range(n + 1):
            row[k] = weights[k] * tangent[k]
        slope = tangent[n]
        bound = e.numbers[LAST_BOUND] if slope > 0.0 else e.numbers[FIRST_BOUND]
        if slope != 0.0:
            step = min(step, _OVERSHOOT * (bound - u[n]) / slope)
        _predict(u, tangent, bend, third, step, weights, guess)
        if not e.numbers[LOW] < guess[n] < e.numbers[HIGH]:
            why[0] = EVENT
            break
        for k in range(n + 1):
            there[k] = guess[k]
        made = newton(there, guess, row, weights, e)
        if made < 0:
            why[0] = COUPLED
            break
        size = weighted_norm(weights, workspace.along)
        failed = made == 0 or not 0.0 < size < np.inf
        turned = False
        if not failed:
            for k in range(n + 1):
                chord[k] = there[k] - u[k]
            far = weighted_norm(weights, chord)
            aligned = inner(row, workspace.along) / size
            ahead = inner(row, chord) / far
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
        turns = workspace.along[n] * slope <= 0.0
        leaves = there[n] <= e.numbers[FIRST_BOUND] or there[n] >= e.numbers[LAST_BOUND]
        if turns and (leaves or e.numbers[FOLDS] == 0.0 or last_turn != 0.0):
            why[0] = EVENT
            break
        if turns and count + 2 > len(out.u):
            break
        if leaves:
            why[0] = EVENT
            leaving = workspace.vectors[14]
            for k in range(n + 1):
                leaving[k] = workspace.along[k] / size
            if last_turn == 0.0 and bound_between(
                    Chord(u, tangent, there, leaving, row), weights, bound, e, found) == 1:
                size = weighted_norm(weights, workspace.along)
                _keep(count, found, size if slope > 0.0 else -size, scales, far, e, out)
                why[0] = BOUND
                count += 1
            break
        last = count + 1 if turns else count
        _keep(last, there, weighted_norm(weights, workspace.along), scales, far, e, out)
        if turns:
            between = Chord(u, tangent, there, out.tangent[last], row)
            if fold_between(between, weights, e, found) == 0:
                why[0] = EVENT
                break
            _keep(count, found, weighted_norm(weights, workspace.along), scales, far, e, out)
            out.folds[count] = 1
        way, bent = inner(row, chord), 1.0 if last_turn == 0.0 else 0.0
        cubic = smooth * bent / (way * way * way)
        for k in range(n + 1):
            new = out.tangent[last, k]
            third[k] = cubic * (way * (tangent[k] + new) - 2.0 * chord[k])
            bend[k] = bent * 0.5 * (new - tangent[k]) / way + 1.5 * way * third[k]
            tangent[k], u[k] = new, there[k]
        factor = 2.0 if made == 1 else (1.5 if made == 2 else 0.7)
        turn = math.acos(max(-1.0, min(1.0, aligned)))
        if turn > 0.0:
            factor = min(factor, max(0.5, 0.5 * e.numbers[LARGEST_TURN] / turn))
        step = min(factor * step, e.numbers[LARGEST_STEP])
        halvings, last_turn, alike = 0, 0.0, 0
        if _grow(u, scales, e):
            _set_weights(scales, H, weights)
            size = weighted_norm(weights, tangent)
            for k in range(n + 1):
                tangent[k] /= size
                bend[k], third[k] = 0.0, 0.0
            for k in range(len(scales)):
                out.scales[last, k] = scales[k]
        count = last + 1
    out.step[0] = step
    if why[0] != BOUND and count > 0:
        _set_weights(out.scales[max(count - 2, 0)], H, weights)
        while count > 0 and (out.folds[count - 1] == 1
                             or _exact(count - 1, row, weights, e, out) == 0):
            count -= 1
    return count
