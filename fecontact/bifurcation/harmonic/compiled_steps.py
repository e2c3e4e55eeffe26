"""Steps along a branch of forced orbits of a contact system, many of them in one compiled call.

Per step: predictor along the tangent with the curvature of the last step, Newton's method at right
angles to it, tangent, step control, as in
:mod:`fecontact.bifurcation.continuation.pseudo_arclength`. The factors made at the prediction serve
all Newton steps, as long as these converge quickly, and the tangent. What is not a plain step, a
fold, a bound, a failure, ends the call.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.bifurcation.harmonic.memory import LEAK, march, solve_around
from fecontact.bifurcation.harmonic.series import fill_blocks
from fecontact.core.compiled import block, f8, helper, i8, kernel, matrix, routine, vector
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.references import borrowed
from fecontact.core.types import Array, Integers
from fecontact.system.jacobian import batch_derivatives, batch_rates
from fecontact.system.nodes import SYSTEM, SystemArrays

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
# Relative steps of one-sided and of central differences in the parameter.
_ONE_SIDED, _CENTRAL = 1e-6, 1e-5

# Why a call ended: as many points as were asked for, something to look at in the next step, a step
# that fails.
FULL, EVENT, FAILED = range(3)


class Room(NamedTuple):
    """Room for the work at one orbit; n unknown coefficients of m modes, N samples, d states.

    ``a`` (n + 1, n + 1) holds the factors, ``along`` (n + 1,) the solution of the equations without
    right side that has one in the last row.
    """

    t: Array
    x: Array
    y: Array
    z: Array
    target: Array
    f: Array
    J: Array
    J_marched: Array
    coefficients: Array
    rows: Array
    spectra: Array
    square: Array
    followed: Array
    forces: Array
    slopes: Array
    condensed: Array
    a: Array
    pivots: Integers
    residual: Array
    beside: Array
    along: Array
    vectors: Array


class Equations(NamedTuple):
    """Equations of orbits over one parameter p, and how a branch is followed.

    Arrays of ``system`` that depend on p lie in ``flat`` = ``base`` + p ``slope``. ``springs``
    (c, m) and ``offsets`` (c,) give the deflections to which internal variables return. ``numbers``:
    period times p or 0, period, least and largest p for which this holds, bounds of the branch,
    tolerance, largest step, cosine of the largest turn, its size, Newton's rounding. ``limits``
    (m,) bound the scales of the displacements; ``nodes`` have internal variables.
    """

    system: SystemArrays
    flat: Array
    base: Array
    slope: Array
    tau: Array
    values: Array
    projection: Array
    cosines: Array
    sines: Array
    springs: Array
    offsets: Array
    limits: Array
    numbers: Array
    nodes: int
    room: Room


(TURN, PERIOD, LOW, HIGH, FIRST_BOUND, LAST_BOUND, TOLERANCE, LARGEST_STEP, LARGEST_TURN,
 ROUNDING) = range(10)

_blocks = types.Array(f8, 4, "C")
_pivots = types.Array(i8, 1, "C")
ROOM = types.NamedTuple(
    [vector, matrix, matrix, matrix, matrix, matrix, block, block, block, matrix, block, _blocks,
     block, block, _blocks, matrix, matrix, _pivots, vector, vector, vector, matrix], Room)
EQUATIONS = types.NamedTuple(
    [SYSTEM, *[vector] * 4, *[matrix] * 5, *[vector] * 3, i8, ROOM], Equations)


class Reached(NamedTuple):
    """Points that were reached, K at most.

    u, tangent (K, n + 1), internal variables z (K, N, c), accelerations (K, N, m), mean derivatives
    of these (K, m, 2 m) to q and q', scales (K, m + 1) for the step behind, and ``step`` (1,).
    """

    u: Array
    tangent: Array
    z: Array
    forces: Array
    mean: Array
    scales: Array
    step: Array


REACHED = types.NamedTuple([matrix, matrix, block, block, block, matrix, vector], Reached)


def room_for(harmonics: int, samples: int, modes: int, memory: int, nodes: int) -> Room:
    """Room for a system of so many modes and internal variables, on so many nodes."""
    L, N, m, c = 2 * harmonics + 1, samples, modes, memory
    n, d = L * m, 2 * m + c
    s = c // nodes if nodes else 0
    return Room(
        np.empty(N), np.empty((N, d)), np.empty((N, d)), np.empty((N, c)), np.empty((N, c)),
        np.empty((N, d)), np.empty((N, d, d)), np.empty((N if c else 0, d, d)),
        np.empty((2, m, L)), np.empty((2 * m * m, N)), np.empty((4, L, m * m)),
        np.empty((L, m, L, m)), np.empty((N if c else 0, c, n + 1)),
        np.empty((N if c else 0, m, n + 1)), np.empty((N, nodes, s, s)), np.empty((n, n + 1)),
        np.empty((n + 1, n + 1)), np.empty(n + 1, dtype=np.int64), np.empty(n),
        np.empty(n), np.empty(n + 1), np.empty((6, n + 1)))


@helper
def _take_parameter(p, e):
    """Set the arrays of the system and the times for a parameter; returns the period."""
    for k in range(len(e.flat)):
        e.flat[k] = e.base[k] + p * e.slope[k]
    T = e.numbers[TURN] / p if e.numbers[TURN] != 0.0 else e.numbers[PERIOD]
    for k in range(len(e.tau)):
        e.room.t[k] = e.tau[k] * T
    return T


@helper
def _take_states(u, T, e, x):
    """Fill displacements and velocities of the states (N, d) at the samples."""
    X = e.room.coefficients
    m, L = X.shape[1], X.shape[2]
    for j in range(m):
        X[0, j, 0], X[1, j, 0] = u[j], 0.0
        for k in range(1, L // 2 + 1):
            turn = 2.0 * math.pi * k / T
            c, s = u[(2 * k - 1) * m + j], u[2 * k * m + j]
            X[0, j, 2 * k - 1], X[0, j, 2 * k] = c, s
            X[1, j, 2 * k - 1], X[1, j, 2 * k] = turn * s, -turn * c
    for n in range(len(x)):
        for part in range(2):
            for j in range(m):
                total = 0.0
                for k in range(L):
                    total += e.values[n, k] * X[part, j, k]
                x[n, part * m + j] = total


@helper
def _take_differences(T, e):
    """Fill the states in which internal variables are marched, and their targets."""
    x, y, m = e.room.x, e.room.y, e.springs.shape[1]
    N = len(x)
    rate = N / T
    for n in range(N):
        for j in range(m):
            y[n, j] = x[n, j]
            y[n, m + j] = rate * (1.5 * x[n, j] - 2.0 * x[n - 1, j] + 0.5 * x[n - 2, j])
        for i in range(len(e.offsets)):
            total = e.offsets[i]
            for j in range(m):
                total += e.springs[i, j] * x[n, j]
            e.room.target[n, i] = total


@helper
def _balance(u, T, f, e, out):
    """Fill out (n,) with the harmonics of q'' - f."""
    m, L, N = e.springs.shape[1], e.values.shape[1], len(e.tau)
    rows = e.room.rows
    for j in range(m):
        for n in range(N):
            rows[j, n] = f[n, m + j]
    for k in range(L):
        turn = 2.0 * math.pi * ((k + 1) // 2) / T
        for j in range(m):
            total = 0.0
            for n in range(N):
                total += e.projection[k, n] * rows[j, n]
            out[k * m + j] = -turn * turn * u[k * m + j] - total


@routine
def _evaluate(u, derivatives, e):
    """Residual at u, with derivatives at the samples if asked for; returns the period.

    Zero where internal variables do not come to repeat.
    """
    room = e.room
    m, c = e.springs.shape[1], len(e.offsets)
    T = _take_parameter(u[len(u) - 1], e)
    _take_states(u, T, e, room.x)
    if c > 0:
        _take_differences(T, e)
        for n in range(len(room.t)):
            for i in range(c):
                room.y[n, 2 * m + i] = 0.0
        if march(room.t, room.y, e.system, T, room.target, room.z) == 0:
            return 0.0
        for n in range(len(room.t)):
            for i in range(c):
                room.x[n, 2 * m + i] = room.z[n, i]
                room.y[n, 2 * m + i] = room.z[n, i]
    if derivatives:
        batch_derivatives(room.t, room.x, e.system, e.system, 0.0, room.f, room.J,
                          np.empty((0, 0)))
    else:
        batch_rates(room.t, room.x, e.system, room.f)
    _balance(u, T, room.f, e, room.residual)
    return T


@helper
def _harmonics_of_derivatives(T, e):
    """Fill the derivatives of the balance to the coefficients, z held."""
    room = e.room
    m, L, N = e.springs.shape[1], e.values.shape[1], len(e.tau)
    for part in range(2):
        for i in range(m):
            for j in range(m):
                row = room.rows[(part * m + i) * m + j]
                for n in range(N):
                    row[n] = room.J[n, m + i, part * m + j]
        for k in range(L):
            for p in range(m * m):
                row = room.rows[part * m * m + p]
                c, s = 0.0, 0.0
                for n in range(N):
                    c += e.cosines[k, n] * row[n]
                    s += e.sines[k, n] * row[n]
                room.spectra[2 * part, k, p], room.spectra[2 * part + 1, k, p] = c, s
    fill_blocks(room.spectra[0], room.spectra[1], room.spectra[2], room.spectra[3], T, m, m,
                room.square)


@helper
def _beside(u, central, e, followed):
    """Fill the last columns of ``condensed``, and of ``followed``, by differences; z held."""
    room = e.room
    n, p = len(room.residual), u[len(u) - 1]
    m, c, N = e.springs.shape[1], len(e.offsets), len(e.tau)
    h = (_CENTRAL if central else _ONE_SIDED) * max(abs(p), 1e-3)
    # Without a second side what is marched meets its equations.
    width = 2.0 * h if central else h
    for k in range(n):
        room.condensed[k, n] = 0.0 if central else -room.residual[k] / h
    for side in range(2 if central else 1):
        sign = 1.0 if side == 0 else -1.0
        T = _take_parameter(p + sign * h, e)
        _take_states(u, T, e, room.x)
        batch_rates(room.t, room.x, e.system, room.f)
        _balance(u, T, room.f, e, room.beside)
        for k in range(n):
            room.condensed[k, n] += sign * room.beside[k] / width
        if c > 0:
            _take_differences(T, e)
            batch_rates(room.t, room.y, e.system, room.f)
            rate = N / T
            for k in range(N):
                for i in range(c):
                    off = (room.f[k, 2 * m + i] - LEAK / T * (room.z[k, i] - room.target[k, i])
                           - rate * (1.5 * room.z[k, i] - 2.0 * room.z[k - 1, i]
                                     + 0.5 * room.z[k - 2, i]))
                    followed[k, i, n] = (sign * off / width
                                         + (followed[k, i, n] if side > 0 else 0.0))


@helper
def _add_memory(T, e):
    """Add what internal variables contribute to ``condensed``; ``followed`` holds its last column.

    ``J_marched`` holds the derivatives at the states in which they were marched.
    """
    room = e.room
    m, L, N, c = e.springs.shape[1], e.values.shape[1], len(e.tau), len(e.offsets)
    n, rate = L * m, N / T
    s = c // e.nodes
    followed, J = room.followed, room.J_marched
    for k in range(N):
        for i in range(c):
            node = i // s
            for other in range(s):
                room.slopes[k, node, i - node * s, other] = J[k, 2 * m + i, 2 * m + node * s + other]
            for q in range(L):
                speed = rate * (1.5 * e.values[k, q] - 2.0 * e.values[k - 1, q]
                                + 0.5 * e.values[k - 2, q])
                for j in range(m):
                    followed[k, i, q * m + j] = (
                        e.values[k, q] * (J[k, 2 * m + i, j] + LEAK / T * e.springs[i, j])
                        + speed * J[k, 2 * m + i, m + j])
    solve_around(room.slopes, T, followed)
    room.forces[:, :, :] = 0.0
    for k in range(N):
        for j in range(m):
            for i in range(c):
                by_memory = room.J[k, m + j, 2 * m + i]
                if by_memory != 0.0:
                    for column in range(n + 1):
                        room.forces[k, j, column] += by_memory * followed[k, i, column]
    for q in range(L):
        for k in range(N):
            part = e.projection[q, k]
            for j in range(m):
                for column in range(n + 1):
                    room.condensed[q * m + j, column] -= part * room.forces[k, j, column]


@routine
def _condense(u, T, central, e):
    """Fill ``condensed``, the derivatives of the residual that was evaluated at u."""
    room = e.room
    n, c = len(room.residual), len(e.offsets)
    _harmonics_of_derivatives(T, e)
    square = room.square.reshape((n, n))
    for i in range(n):
        for j in range(n):
            room.condensed[i, j] = square[i, j]
    if c > 0:
        batch_derivatives(room.t, room.y, e.system, e.system, 0.0, room.f, room.J_marched,
                          np.empty((0, 0)))
    _beside(u, central, e, room.followed)
    _take_parameter(u[n], e)
    if c > 0:
        _add_memory(T, e)


@helper
def _factorise(row, e):
    """Factorise ``condensed`` with a further row (n + 1,)."""
    room = e.room
    n = len(room.residual)
    for i in range(n):
        for j in range(n + 1):
            room.a[i, j] = room.condensed[i, j]
    for j in range(n + 1):
        room.a[n, j] = row[j]
        room.along[j] = 0.0
    room.along[n] = 1.0
    factorise(room.a, n + 1, room.pivots)
    solve(room.a, room.pivots, room.along)


@helper
def _inner(a, b):
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@helper
def _length(weights, a):
    total = 0.0
    for k in range(len(a)):
        total += weights[k] * a[k] * a[k]
    return math.sqrt(total)


@routine
def _corrected(u, guess, row, weights, e):
    """Newton's method from u = guess at right angles to a row.

    Returns how often factors were made; zero where it fails.
    """
    room = e.room
    n = len(room.residual)
    tolerance = e.numbers[TOLERANCE]
    change = room.vectors[0]
    scale = 1.0 + _length(weights, guess)
    before, made, fresh = np.inf, 0, True
    for count in range(1, _STEPS + 1):
        T = _evaluate(u, fresh, e)
        if not T > 0.0:
            return 0
        for k in range(n):
            change[k] = -room.residual[k]
        off = 0.0
        for k in range(n + 1):
            off += row[k] * (u[k] - guess[k])
        change[n] = -off
        if fresh:
            _condense(u, T, False, e)
            _factorise(row, e)
            made += 1
        solve(room.a, room.pivots, change)
        size = _length(weights, change)
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
    room = e.room
    m, N, c = e.springs.shape[1], len(e.tau), len(e.offsets)
    out.u[count, :] = u
    out.tangent[count, :] = tangent
    for n in range(N):
        for i in range(c):
            out.z[count, n, i] = room.z[n, i]
        for j in range(m):
            out.forces[count, n, j] = room.f[n, m + j]
    for i in range(m):
        for j in range(2 * m):
            total = 0.0
            for n in range(N):
                total += room.J[n, m + i, j]
            out.mean[count, i, j] = total / N


@kernel(i8(vector, vector, vector, vector, EQUATIONS, REACHED, vector))
def steps(u, tangent, bend, scales, e, out, why):
    """Make steps from u along a tangent until ``out`` is full or something is to be looked at.

    u, tangent and bend (n + 1,), the derivative of the tangent, and scales (m + 1,) are overwritten;
    ``out.step`` holds the length of the first step, and then of the next one. why (1,) says why the
    call ended. Returns the number of points.
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
        if aside * _length(weights, bend) > _MOST_BENT * step:
            aside = 0.0
        for k in range(n + 1):
            guess[k] = u[k] + step * tangent[k] + aside * bend[k]
            there[k] = guess[k]
        if not e.numbers[LOW] < guess[n] < e.numbers[HIGH]:
            why[0] = EVENT
            break
        made = _corrected(there, guess, row, weights, e)
        size = _length(weights, room.along)
        failed = made == 0 or not 0.0 < size < np.inf
        turned = False
        if not failed:
            for k in range(n + 1):
                chord[k] = there[k] - u[k]
            aligned = _inner(row, room.along) / size
            ahead = _inner(row, chord) / _length(weights, chord)
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
        length = _inner(row, chord)
        for k in range(n + 1):
            new = room.along[k] / size
            bend[k] = (new - tangent[k]) / length if last_turn == 0.0 else 0.0
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
            size = _length(weights, tangent)
            for k in range(n + 1):
                tangent[k] /= size
                bend[k] = 0.0
        for k in range(len(scales)):
            out.scales[count, k] = scales[k]
        count += 1
    out.step[0] = step
    return count


@kernel(i8(vector, i8, EQUATIONS, matrix, matrix))
def evaluate(u, derivatives, e, forces, mean):
    """Fill forces (N, m) and leave ``residual`` and ``z`` at u (n + 1,) in the room of e.

    With derivatives also ``condensed``, and the mean derivatives (m, 2 m) of the forces to q and
    q'. Returns 0 where internal variables do not come to repeat, else 1.
    """
    u, e, forces, mean = borrowed(u), borrowed(e), borrowed(forces), borrowed(mean)
    room = e.room
    m, N = e.springs.shape[1], len(e.tau)
    T = _evaluate(u, derivatives != 0, e)
    if not T > 0.0:
        return 0
    for n in range(N):
        for j in range(m):
            forces[n, j] = room.f[n, m + j]
    if derivatives != 0:
        for i in range(m):
            for j in range(2 * m):
                total = 0.0
                for n in range(N):
                    total += room.J[n, m + i, j]
                mean[i, j] = total / N
        _condense(u, T, True, e)
    return 1


@kernel(types.void(matrix, block, vector, matrix, EQUATIONS, block, types.Array(f8, 4, "C")))
def derivatives_along(us, zs, tau, values, e, f, J):
    """Fill f (K, P, d) and J (K, P, d, d) at times tau (P,) of K orbits; values (P, 2 H + 1) there.

    Internal variables zs (K, N, c) are linear between the samples.
    """
    us, zs, e, f, J = borrowed(us), borrowed(zs), borrowed(e), borrowed(f), borrowed(J)
    m, N, c = e.springs.shape[1], zs.shape[1], zs.shape[2]
    X = e.room.coefficients
    L = X.shape[2]
    P = len(tau)
    t, x = np.empty(P), np.empty((P, 2 * m + c))
    for k in range(len(us)):
        T = _take_parameter(us[k, us.shape[1] - 1], e)
        _take_states(us[k], T, e, e.room.x)
        for p in range(P):
            t[p] = tau[p] * T
            for part in range(2):
                for j in range(m):
                    total = 0.0
                    for i in range(L):
                        total += values[p, i] * X[part, j, i]
                    x[p, part * m + j] = total
            place = tau[p] * N
            first = int(place)
            part_of = place - first
            for i in range(c):
                x[p, 2 * m + i] = ((1.0 - part_of) * zs[k, first % N, i]
                                   + part_of * zs[k, (first + 1) % N, i])
        batch_derivatives(t, x, e.system, e.system, 0.0, f[k], J[k], np.empty((0, 0)))
