"""Elimination on intervals, against dense matrices."""

import numpy as np
import pytest

from fecontact.bifurcation.linalg.bordered import (
    Border,
    Bordered,
    expand_open,
    original_rows,
)
from fecontact.bifurcation.linalg.condensation import condense, factors_for
from fecontact.bifurcation.linalg.transition_matrices import transitions
from fecontact.bifurcation.orbits.mesh import rule


def random_system(intervals, degree, states, parameters, seed=0):
    """J, f, P at the points, and widths; the states grow and decay by large factors."""
    rng = np.random.default_rng(seed)
    points = intervals * degree
    widths = rng.random(intervals) + 0.1
    return (20.0 * rng.standard_normal((points, states, states)),
            rng.standard_normal((points, states)),
            rng.standard_normal((points, states, parameters)), widths / widths.sum())


def dense(J, f, P, widths, T, degree, with_period):
    """Collocation equations as one matrix, for x_0 ... x_N and the common unknowns."""
    basis = rule(degree)
    points, d = f.shape
    matrix = np.zeros((points * d, (points + 1) * d + with_period + P.shape[2]))
    for row in range(points):
        j, point = divmod(row, degree)
        rows = slice(row * d, (row + 1) * d)
        for k in range(degree + 1):
            node = j * degree + k
            matrix[rows, node * d : (node + 1) * d] = (
                basis.slopes[point, k] * np.eye(d)
                - widths[j] * T * basis.values[point, k] * J[row])
        if with_period:
            matrix[rows, (points + 1) * d] = -widths[j] * f[row]
        matrix[rows, (points + 1) * d + with_period :] = -widths[j] * T * P[row]
    return matrix


# Fewer intervals than lanes, as many, one more, lanes that stay empty or half empty.
@pytest.mark.parametrize("intervals", [1, 2, 5, 8, 9, 23, 57])
@pytest.mark.parametrize(("degree", "states", "with_period", "parameters"),
                         [(4, 4, 1, 1), (3, 1, 1, 1), (2, 3, 0, 1), (7, 2, 1, 2), (4, 6, 0, 0)])
def test_bordered_solutions(intervals, degree, states, with_period, parameters):
    J, f, P, widths = random_system(intervals, degree, states, parameters)
    factors = factors_for(intervals, degree, states, with_period + parameters)
    basis, T, nodal = rule(degree), 1.3, f.size
    condense(J, f, P, widths, T, basis.values, basis.slopes, with_period, factors)
    rng = np.random.default_rng(1)
    rows = rng.standard_normal((with_period + parameters, nodal + with_period + parameters))
    rhs = rng.standard_normal(nodal + len(rows))
    for closing in (1.0, -1.0):
        whole = dense(J, f, P, widths, T, degree, with_period)
        whole[:, :states] += closing * whole[:, nodal : nodal + states]
        whole = np.vstack([np.delete(whole, np.s_[nodal : nodal + states], axis=1), rows])
        found = Bordered(factors, [Border(factors, row) for row in rows], closing).solve(rhs)
        assert np.abs(whole @ found - rhs).max() < 1e-13 * np.abs(whole).max() * np.abs(found).max()
        if np.linalg.cond(whole) < 1e8:
            wanted = np.linalg.solve(whole, rhs)
            assert np.abs(found - wanted).max() < 1e-7 * np.abs(wanted).max()


@pytest.mark.parametrize("intervals", [1, 2, 5, 8, 9, 23, 57])
@pytest.mark.parametrize(("degree", "states", "parameters"), [(4, 4, 2), (3, 1, 1), (2, 3, 0)])
def test_equations_of_the_ends(intervals, degree, states, parameters):
    """Equations are sums of the collocation rows, and hold between the ends of an open solution."""
    J, f, P, widths = random_system(intervals, degree, states, parameters)
    factors = factors_for(intervals, degree, states, parameters)
    basis, nodal, d = rule(degree), f.size, states
    condense(0.05 * J, f, P, widths, 1.0, basis.values, basis.slopes, 0, factors)
    whole = dense(0.05 * J, f, P, widths, 1.0, degree, 0)
    size = np.abs(whole).max()
    for row in range(d):
        rows = original_rows(factors, np.eye(d)[row])
        ends = rows @ whole
        assert ends[:d] == pytest.approx(factors.end[row, :d], abs=1e-12 * size)
        assert ends[nodal:] == pytest.approx(factors.end[row, d:], abs=1e-12 * size)
        assert np.abs(ends[d:nodal]).max(initial=0.0) < 1e-12 * size
    start = np.arange(1.0, d + 1.0)
    end = np.linalg.solve(factors.end[:, d : 2 * d], -factors.end[:, :d] @ start)
    found = np.concatenate([expand_open(factors, start, end), end])
    assert np.abs(whole[:, : nodal + d] @ found).max() < 1e-11 * size * np.abs(found).max()


@pytest.mark.parametrize("intervals", [3, 20])
@pytest.mark.parametrize("closing", [1.0, -1.0])
def test_singular_vectors(intervals, closing):
    """Two border rows that depend on the others make a system singular."""
    degree, d, parameters = 3, 4, 2
    J, f, P, widths = random_system(intervals, degree, d, parameters)
    factors = factors_for(intervals, degree, d, parameters)
    basis, nodal = rule(degree), f.size
    condense(0.05 * J, f, P, widths, 1.0, basis.values, basis.slopes, 0, factors)
    whole = dense(0.05 * J, f, P, widths, 1.0, degree, 0)
    whole[:, :d] += closing * whole[:, nodal : nodal + d]
    whole = np.delete(whole, np.s_[nodal : nodal + d], axis=1)
    rng = np.random.default_rng(2)
    free = rng.standard_normal(whole.shape[1])
    mixed = rng.standard_normal(nodal) @ whole
    rows = [free, mixed + 2.0 * free]
    value, left, right = Bordered(factors, [Border(factors, row) for row in rows],
                                  closing).weakest()
    size = np.abs(whole).max()
    assert value < 1e-12
    assert np.abs(np.vstack([whole, *rows]) @ right).max() < 1e-11 * size * np.abs(right).max()
    rest = left @ whole
    part = np.linalg.lstsq(np.array(rows).T, rest)[0]
    assert rest == pytest.approx(part @ np.array(rows), abs=1e-11 * np.abs(left).max() * size)
    assert np.abs(left).max() > 0.0


@pytest.mark.parametrize("intervals", [3, 20])
def test_transitions(intervals):
    """Each interval carries x_j to the x_(j+1) of the dense equations."""
    degree, d = 4, 3
    J, f, P, widths = random_system(intervals, degree, d, 0)
    factors = factors_for(intervals, degree, d, 0)
    basis = rule(degree)
    condense(J, f, P, widths, 1.0, basis.values, basis.slopes, 0, factors)
    found = np.empty((intervals, d, d))
    transitions(factors, found)
    whole = dense(J, f, P, widths, 1.0, degree, 0)
    size = degree * d
    for j in range(intervals):
        rows = whole[j * size : (j + 1) * size, j * size : (j + 1) * size + d]
        wanted = -np.linalg.solve(rows[:, d:], rows[:, :d])[-d:]
        assert np.abs(found[j] - wanted).max() < 1e-12 * np.abs(wanted).max()
