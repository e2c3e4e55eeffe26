r"""Power series of the motion over a step, whose coefficients follow from one another.

With x the part of a reference length h_0 that has passed, displacements, signals and forces are
series in x. Their coefficients obey the equations of motion power by power:

.. math::

    (k + 1)(k + 2)\, q_{k+2} = h_0^2\, (f_k - K q_k - D v_k - V'_k + T_y^T F_k), \qquad
    v_k = (k + 1)\, q_{k+1} / h_0

V is the potential of :mod:`fecontact.system.polynomial_forces`. Sines have known coefficients, and
products of series are sums of products. The series of the piece of a law that acts goes on beyond
its ends, so that where it ends can be found on it.
"""

import math

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.integrate.series.branches import ACTS, PLACE
from fecontact.integrate.series.polynomials import COEFFICIENTS, DEGREE
from fecontact.laws.pieces import DAMPING, ELASTIC
from fecontact.system.polynomial_forces import has_polynomial

_INVERSE = np.array([0.0] + [1.0 / k for k in range(1, COEFFICIENTS + 1)])
# Rows of `Series.powers`.
DRIVE_POWER, LOAD_POWER, MODAL_LOSS, DASHPOT_LOSS, CONTACT_LOSS = range(5)


@helper
def set_forcing(t, h, s, series):
    """Fill ``series.forcing``, and ``series.signal`` unless it is empty, from time t on."""
    forcing, signal = series.forcing, series.signal
    sine, cosine = series.line[0], series.line[1]
    for i in range(len(forcing)):
        for k in range(COEFFICIENTS):
            forcing[i, k] = 0.0
        forcing[i, 0] = series.constant_force[i]
    for g in range(len(signal)):
        signal[g, :] = 0.0
        signal[g, 0] = series.constants[g]
    for row in range(len(series.sines)):
        w = series.sines[row, 2]
        angle = w * t + series.sines[row, 3]
        sine[0], cosine[0] = math.sin(angle), math.cos(angle)
        for k in range(DEGREE):
            # The derivative of a sine is a cosine, that of a cosine minus a sine.
            part = w * h * _INVERSE[k + 1]
            sine[k + 1], cosine[k + 1] = part * cosine[k], -part * sine[k]
        for i in range(len(forcing)):
            in_phase, ahead = series.sine_force[row, i], series.cosine_force[row, i]
            for k in range(COEFFICIENTS):
                forcing[i, k] += in_phase * sine[k] + ahead * cosine[k]
        if len(signal):
            g, amplitude = int(series.sines[row, 0]), series.sines[row, 1]
            for k in range(COEFFICIENTS):
                signal[g, k] += amplitude * sine[k]


@helper
def _product(a, b, k):
    """Coefficient k of the product of two series."""
    total = 0.0
    for i in range(k + 1):
        total += a[i] * b[k - i]
    return total


@helper
def _curved(piece):
    """Whether a force is more than linear in u and v."""
    return (piece[ELASTIC + 2] != 0.0 or piece[DAMPING + 1] != 0.0 or piece[DAMPING + 2] != 0.0)


@helper
def _add_penetration(j, k, s, series):
    """Fill coefficient k of the penetration of node j and of its powers."""
    total = -s.gap[j] if k == 0 else 0.0
    for i in range(len(series.q)):
        total -= s.rows[j, 1, i] * series.q[i, k]
    series.u[j, k] = total
    if series.states[j, ACTS] and _curved(series.pieces[j, series.states[j, PLACE]]):
        series.square[j, k] = _product(series.u[j], series.u[j], k)
        if series.pieces[j, series.states[j, PLACE], DAMPING + 2] != 0.0:
            series.cube[j, k] = _product(series.square[j], series.u[j], k)


@helper
def _force(j, k, h, series):
    """Coefficient k of the force of node j."""
    if not series.states[j, ACTS]:
        return 0.0
    piece, rise = series.pieces[j, series.states[j, PLACE]], (k + 1) / h
    total = piece[ELASTIC + 1] * series.u[j, k] + piece[DAMPING] * rise * series.u[j, k + 1]
    if k == 0:
        total += piece[ELASTIC]
    if _curved(piece):
        # The rate of u^2 is 2 u v.
        total += (piece[ELASTIC + 2] * series.square[j, k]
                  + rise * 0.5 * piece[DAMPING + 1] * series.square[j, k + 1])
        if piece[DAMPING + 2] != 0.0:
            total += rise * piece[DAMPING + 2] * series.cube[j, k + 1] / 3.0
    return total


@helper
def _add_polynomial_forces(k, s, series):
    """Fill coefficient k of the forces ``series.polynomial``, and of what they depend on."""
    rows, pairs, L, Q = (s.polynomial_rows, s.polynomial_pairs, s.polynomial_cubic,
                         s.polynomial_quartic)
    c, p, slopes, q, polynomial = (series.combined, series.products, series.slopes, series.q,
                             series.polynomial)
    m = len(q)
    for a in range(len(rows)):
        total = 0.0
        for i in range(m):
            total += rows[a, i] * q[i, k]
        c[a, k] = total
    for r in range(len(pairs)):
        p[r, k] = _product(c[pairs[r, 0]], c[pairs[r, 1]], k)
    for i in range(m):
        polynomial[i, k] = 0.0
    for r in range(len(pairs)):
        total = 0.0
        for other in range(len(pairs)):
            total += Q[r, other] * p[other, k]
        for i in range(m):
            total += L[r, i] * q[i, k]
            polynomial[i, k] -= p[r, k] * L[r, i]
        slopes[r, k] = total
        first, second = _product(slopes[r], c[pairs[r, 1]], k), _product(
            slopes[r], c[pairs[r, 0]], k)
        for i in range(m):
            polynomial[i, k] -= first * rows[pairs[r, 0], i] + second * rows[pairs[r, 1], i]


@routine
def expand(y, h, s, series):
    """Fill the coefficients of displacements, velocities and forces from the state y on."""
    q, v = series.q, series.v
    m, n = len(q), len(s.gap)
    for i in range(m):
        q[i, 0], q[i, 1] = y[i], h * y[m + i]
    for j in range(n):
        _add_penetration(j, 0, s, series)
    for k in range(DEGREE):
        for j in range(n):
            _add_penetration(j, k + 1, s, series)
            series.F[j, k] = _force(j, k, h, series)
        if k + 2 > DEGREE:
            break
        ahead = h * _INVERSE[k + 2]
        factor = h * _INVERSE[k + 1] * ahead
        if has_polynomial(s):
            _add_polynomial_forces(k, s, series)
        for i in range(m):
            # The newest coefficients come last: other terms do not wait for them.
            total, damped = series.forcing[i, k], 0.0
            if has_polynomial(s):
                total += series.polynomial[i, k]
            for j in range(n):
                total += s.rows[j, 1, i] * series.F[j, k]
            for other in range(m):
                total -= s.stiffness[i, other] * q[other, k]
                damped += s.damping[i, other] * q[other, k + 1]
            q[i, k + 2] = factor * total - ahead * damped
    for i in range(m):
        for k in range(DEGREE):
            v[i, k] = (k + 1) / h * q[i, k + 1]
        v[i, 0], v[i, DEGREE] = y[m + i], 0.0


@helper
def _add_product(a, b, factor, out):
    """Add the product of two series to ``out``."""
    for k in range(COEFFICIENTS):
        out[k] += factor * _product(a, b, k)


@routine
def expand_powers(h, s, series):
    """Fill ``series.powers`` with the coefficients of the powers."""
    q, v, signal, powers = series.q, series.v, series.signal, series.powers
    m = len(q)
    first, second, third = series.line[0], series.line[1], series.line[2]
    powers[:] = 0.0
    for axis in range(len(s.drive)):
        c, b = s.drive_stiffness[axis], s.drive_damping[axis]
        if c == 0.0 and b == 0.0:
            continue
        for k in range(COEFFICIENTS):
            rate = (k + 1) / h * signal[axis, k + 1] if k < DEGREE else 0.0
            place, speed = 0.0, 0.0
            for i in range(m):
                place += s.drive_shapes[axis, i] * q[i, k]
                speed += s.drive_shapes[axis, i] * v[i, k]
            first[k] = c * (signal[axis, k] - place) + b * (rate - speed)
            second[k], third[k] = rate, rate - 2.0 * speed
        _add_product(first, second, 1.0, powers[DRIVE_POWER])
        if b != 0.0:
            _add_product(second, third, b, powers[DASHPOT_LOSS])
    for i in range(m):
        for k in range(COEFFICIENTS):
            powers[LOAD_POWER, k] += s.constant_load[i] * v[i, k]
            modal, relative = 0.0, 0.0
            for other in range(m):
                modal += s.modal_damping[i, other] * v[other, k]
                relative += (s.damping[i, other] - s.modal_damping[i, other]) * v[other, k]
            first[k], second[k] = modal, relative
        _add_product(first, v[i], 1.0, powers[MODAL_LOSS])
        _add_product(second, v[i], 1.0, powers[DASHPOT_LOSS])
    for load in range(len(s.load_shapes)):
        for k in range(COEFFICIENTS):
            first[k] = 0.0
            for i in range(m):
                first[k] += s.load_shapes[load, i] * v[i, k]
        _add_product(signal[len(s.drive) + load], first, 1.0, powers[LOAD_POWER])
    for j in range(len(s.gap)):
        piece = series.pieces[j, series.states[j, PLACE]]
        if piece[ELASTIC] == 0.0 and piece[ELASTIC + 1] == 0.0 and piece[ELASTIC + 2] == 0.0:
            continue
        for k in range(COEFFICIENTS):
            second[k] = (k + 1) / h * series.u[j, k + 1] if k < DEGREE else 0.0
            elastic = piece[ELASTIC + 1] * series.u[j, k]
            if piece[ELASTIC + 2] != 0.0:
                elastic += piece[ELASTIC + 2] * _product(series.u[j], series.u[j], k)
            first[k] = (series.F[j, k] if k < DEGREE else 0.0) - elastic
        first[0] -= piece[ELASTIC]
        _add_product(first, second, 1.0, powers[CONTACT_LOSS])


@helper
def integrate_powers(h, series):
    """Put the coefficients of the work into ``series.powers``; the last power is left out."""
    for row in range(len(series.powers)):
        for k in range(DEGREE, 0, -1):
            series.powers[row, k] = h * series.powers[row, k - 1] * _INVERSE[k]
        series.powers[row, 0] = 0.0
