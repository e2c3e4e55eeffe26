"""Residual of harmonic balance of a contact system and its derivatives, in compiled code.

The equations are those of :class:`fecontact.bifurcation.harmonic.balance.Balance`.
"""

import math

import numpy as np
from numba import types

from fecontact.bifurcation.harmonic.compiled.arrays import EQUATIONS, PERIOD, TURN
from fecontact.bifurcation.harmonic.memory import LEAK, march, solve_around
from fecontact.bifurcation.harmonic.series import fill_blocks
from fecontact.core.compiled import block, f8, helper, i8, kernel, matrix, routine, vector
from fecontact.core.references import borrowed
from fecontact.system.jacobian import batch_derivatives, batch_rates

# Relative steps of one-sided and of central differences in the parameter.
_ONE_SIDED, _CENTRAL = 1e-6, 1e-5


@helper
def take_parameter(p, e):
    """Set the arrays of the system and the times for a parameter; returns the period."""
    for k in range(len(e.flat)):
        e.flat[k] = e.base[k] + p * e.slope[k]
    T = e.numbers[TURN] / p if e.numbers[TURN] != 0.0 else e.numbers[PERIOD]
    for k in range(len(e.tau)):
        e.room.t[k] = e.tau[k] * T
    return T


@helper
def take_states(u, T, e, x):
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
def evaluate_at(u, derivatives, e):
    """Residual at u, with derivatives at the samples if asked for; returns the period.

    Zero where internal variables do not come to repeat.
    """
    room = e.room
    m, c = e.springs.shape[1], len(e.offsets)
    T = take_parameter(u[len(u) - 1], e)
    take_states(u, T, e, room.x)
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
        T = take_parameter(p + sign * h, e)
        take_states(u, T, e, room.x)
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
                room.slopes[k, node, i - node * s, other] = J[k, 2 * m + i,
                                                             2 * m + node * s + other]
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
def condense(u, T, central, e):
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
    take_parameter(u[n], e)
    if c > 0:
        _add_memory(T, e)


@kernel(i8(vector, i8, EQUATIONS, matrix, matrix))
def evaluate(u, derivatives, e, forces, mean):
    """Fill forces (N, m) and leave ``residual`` and ``z`` at u (n + 1,) in the room of e.

    With derivatives also ``condensed``, and the mean derivatives (m, 2 m) of the forces to q and
    q'. Returns 0 where internal variables do not come to repeat, else 1.
    """
    u, e, forces, mean = borrowed(u), borrowed(e), borrowed(forces), borrowed(mean)
    room = e.room
    m, N = e.springs.shape[1], len(e.tau)
    T = evaluate_at(u, derivatives != 0, e)
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
        condense(u, T, True, e)
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
        T = take_parameter(us[k, us.shape[1] - 1], e)
        take_states(us[k], T, e, e.room.x)
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
