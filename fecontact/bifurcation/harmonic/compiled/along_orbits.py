"""Derivatives of the rates along orbits of a contact system, in compiled code."""

import numpy as np

from fecontact.bifurcation.harmonic.compiled.arrays import Equations
from fecontact.bifurcation.harmonic.compiled.evaluation import speed_coefficient, take_parameter
from fecontact.bifurcation.harmonic.compiled.kinks import SampledRates, add_kinks
from fecontact.bifurcation.harmonic.compiled.memoryless_forces import combine
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Array4, Block, Matrix, Vector
from fecontact.system.jacobian import batch_derivatives


@helper
def _take_coefficients(u, T, X):
    """Fill X (2, m, 2 H + 1) with the coefficients of displacements and velocities."""
    m = X.shape[1]
    for j in range(m):
        for k in range(X.shape[2]):
            X[0, j, k], X[1, j, k] = u[k * m + j], speed_coefficient(u, k, j, m, T)


@kernel
def derivatives_along(
    us: Matrix, zs: Block, tau: Vector, series: Matrix, e: Equations, J: Array4,
) -> None:
    """Fill J (K, P, d, d) with the derivatives of the rates at times tau (P,) of K orbits.

    Kinks of normal forces are means over samples, as in the equations of the orbits.

    ``series`` (2 H + 1, P) holds the functions of the series there. Internal variables zs
    (K, N, c) are linear between the samples.
    """
    m, N, c = e.springs.shape[1], zs.shape[1], zs.shape[2]
    X, linear = e.workspace.coefficients, e.workspace.linear
    P = len(tau)
    t, x, f, row = np.empty(P), np.empty((P, 2 * m + c)), np.empty((P, 2 * m + c)), np.empty(P)
    widths = np.empty((m, P))
    for k in range(len(us)):
        T = take_parameter(us[k, us.shape[1] - 1], e)
        _take_coefficients(us[k], T, X)
        for part in range(2):
            for j in range(m):
                combine(series, X[part, j], X.shape[2], row)
                for p in range(P):
                    x[p, part * m + j] = row[p]
        for p in range(P):
            t[p] = tau[p] * T
            place = tau[p] * N
            first = int(place)
            part_of = place - first
            for i in range(c):
                x[p, 2 * m + i] = ((1.0 - part_of) * zs[k, first % N, i]
                                   + part_of * zs[k, (first + 1) % N, i])
        batch_derivatives(t, x, e.whole, e.whole, 0.0, f, J[k], np.empty((0, 0)))
        add_kinks(t, x, e.whole, e.onsets, T / N, 1, SampledRates(f, J[k], widths))
        for p in range(P):
            for i in range(m):
                for j in range(m):
                    J[k, p, m + i, j] -= linear[0, i, j]
                    J[k, p, m + i, m + j] -= linear[1, i, j]
