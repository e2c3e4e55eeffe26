"""Transition matrices of linearised equations of motion beside closed forms and other methods."""

import numpy as np
import pytest
from scipy.linalg import expm

from fecontact.bifurcation.linalg import condensation
from fecontact.bifurcation.linalg.motion_transitions import integrals, motion_transitions
from fecontact.bifurcation.linalg.transition_matrices import transitions
from fecontact.bifurcation.orbits.mesh import rule

GAUSS = rule(4)


def made(J, T):
    """Matrices over the intervals of a period T, four collocation points each."""
    N, d = len(J) // 4, J.shape[1]
    out = np.empty((N, d, d))
    motion_transitions(J, T / N, GAUSS.points, *integrals(tuple(GAUSS.points.tolist())), out)
    return out


def constant(K, D, count):
    """Derivatives of [q', q''] at so many points."""
    m = len(K)
    return np.tile(np.block([[np.zeros((m, m)), np.eye(m)], [-K, -D]]), (count, 1, 1))


def test_integrals_are_those_of_polynomials():
    A, b = integrals(tuple(GAUSS.points.tolist()))
    for degree in range(4):
        values = GAUSS.points**degree
        assert A @ values == pytest.approx(GAUSS.points ** (degree + 1) / (degree + 1), abs=1e-14)
    # Weights of Gauss integrate polynomials up to degree 7.
    for degree in range(8):
        assert b @ GAUSS.points**degree == pytest.approx(1.0 / (degree + 1), abs=1e-14)


@pytest.mark.parametrize("modes", [1, 3])
def test_constant_equations_have_the_exponential_with_order_eight(modes):
    rng = np.random.default_rng(modes)
    K, D = rng.normal(size=(modes, modes)), 0.3 * rng.normal(size=(modes, modes))
    exact = expm(constant(K, D, 1)[0] * 2.0)
    errors = []
    for intervals in (2, 4):
        found = np.linalg.multi_dot([np.eye(2 * modes), *made(constant(K, D, 4 * intervals),
                                                                2.0)[::-1]])
        errors.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert errors[1] < 1e-6
    assert np.log2(errors[0] / errors[1]) == pytest.approx(8.0, abs=0.5)


@pytest.mark.parametrize(("modes", "intervals"), [(1, 27), (2, 8), (5, 9)])
def test_they_are_those_of_the_same_collocation_of_all_states(modes, intervals):
    """Nine intervals leave lanes empty, and derivatives differ at all points."""
    rng = np.random.default_rng(intervals)
    J = constant(np.eye(modes), np.eye(modes), 4 * intervals)
    J[:, modes:] = rng.normal(size=(4 * intervals, modes, 2 * modes))
    d, T = 2 * modes, 3.0
    factors = condensation.factors_for(intervals, 4, d, 1)
    condensation.condense(J, np.zeros((4 * intervals, d)), np.zeros((4 * intervals, d, 1)),
                          np.full(intervals, 1.0 / intervals), T, GAUSS.values, GAUSS.slopes, 0,
                          factors)
    other = np.empty((intervals, d, d))
    transitions(factors, other)
    assert made(J, T) == pytest.approx(other, abs=1e-12 * np.abs(other).max())
