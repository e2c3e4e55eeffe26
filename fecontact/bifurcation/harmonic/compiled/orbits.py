"""Equations of harmonic balance at one orbit, and derivatives along several, in compiled code."""

import numpy as np

from fecontact.bifurcation.harmonic.compiled.arrays import STEADY, TOLERANCE, Equations
from fecontact.bifurcation.harmonic.compiled.evaluation import (
    condensation_at,
    evaluation_at,
    take_forces,
    take_mean,
    take_parameter,
)
from fecontact.bifurcation.harmonic.compiled.kinks import SampledRates, add_kinks
from fecontact.bifurcation.harmonic.compiled.linear_systems import (
    PRECISE,
    choose_coupled,
    factorise_with,
    solve_with,
)
from fecontact.bifurcation.harmonic.compiled.newton import damped_newton
from fecontact.core.compiled import kernel
from fecontact.core.records import Array4, Block, Matrix, Vector
from fecontact.system.jacobian import batch_derivatives

# Kinds of results at an orbit.
RESIDUAL, DERIVATIVES, SOLUTION, ORBIT = range(4)


@kernel
def evaluate(
    u: Vector, wanted: int, e: Equations, forces: Matrix, mean: Matrix, row: Vector,
    weights: Vector, x: Vector,
) -> int:
    """Fill forces (N, m) and leave ``residual`` and ``z`` at u (n + 1,) in the workspace of e.

    With derivatives, ``wanted`` = DERIVATIVES, also ``condensed``, and the mean derivatives
    (m, 2 m) of the forces to q and q'. With SOLUTION the right side x (n + 1,) becomes the solution
    with the derivatives and a last row, for more unknowns than are solved for together. With ORBIT
    u becomes the orbit nearby, and x the solution without right side but one in the last row.
    Returns 0 where internal variables do not come to repeat, or an iteration does not converge,
    else 1.
    """
    if wanted == ORBIT:
        if damped_newton(u, row, weights, e.numbers[TOLERANCE], e) == 0:
            return 0
        for k in range(len(x)):
            x[k] = e.workspace.along[k]
        take_mean(e, mean)
        if e.numbers[STEADY] == 0.0:
            evaluation_at(e.evaluate)(u, False, e)
        take_forces(u[len(u) - 1], e, forces)
        return 1
    T = evaluation_at(e.evaluate)(u, wanted != RESIDUAL, e)
    if not T > 0.0:
        return 0
    if wanted == SOLUTION and choose_coupled(T, e) == 0:
        return 0
    take_forces(u[len(u) - 1], e, forces)
    if wanted != RESIDUAL:
        take_mean(e, mean)
        condensation_at(e.condense)(u, T, True, e)
    if wanted == SOLUTION:
        factorise_with(row, T, e)
        return solve_with(row, weights, T, PRECISE, e, x)
    return 1


@kernel
def derivatives_along(p: Vector, x: Block, tau: Vector, e: Equations, J: Array4) -> None:
    """Fill J (K, P, d, d) with the derivatives of the rates of K orbits at parameters p (K,).

    Their states x (K, P, d) are those at times tau (P,). Kinks of normal forces are means over
    samples, as in the equations of the orbits.
    """
    m, linear = e.springs.shape[1], e.workspace.linear
    P, d = x.shape[1], x.shape[2]
    t, f, widths = np.empty(P), np.empty((P, d)), np.empty((m, P))
    for k in range(len(p)):
        T = take_parameter(p[k], e)
        for n in range(P):
            t[n] = tau[n] * T
        batch_derivatives(t, x[k], e.whole, e.whole, 0.0, f, J[k], np.empty((0, 0)))
        add_kinks(t, x[k], e.whole, e.onsets, T / len(e.tau), 1, SampledRates(f, J[k], widths))
        for n in range(P):
            for i in range(m):
                for j in range(m):
                    J[k, n, m + i, j] -= linear[0, i, j]
                    J[k, n, m + i, m + j] -= linear[1, i, j]
