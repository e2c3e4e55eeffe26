"""Factors of small dense matrices in kernels, against LAPACK."""

import numpy as np
import pytest
from numba import njit

from fecontact.core import dense_lu


@njit
def _solutions(a, pivots, x, b):
    dense_lu.factorise(a, len(a), pivots)
    dense_lu.solve(a, pivots, x)
    dense_lu.solve_rows(a, pivots, b)


@njit
def _eliminated(a, count, pivots, r, row, weights, known):
    dense_lu.factorise(a, count, pivots)
    dense_lu.forward(a, count, pivots, r)
    dense_lu.reduce_row(a, count, row, weights)
    dense_lu.backward(a, count, r, known)


@pytest.mark.parametrize("size", [1, 2, 3, 5, 8, 21])
def test_solutions_are_those_of_lapack(size):
    """The diagonal is zero and the rows are of very different sizes: pivots have to be sought."""
    rng = np.random.default_rng(size)
    a = rng.standard_normal((size, size)) * 10.0 ** rng.integers(-4, 5, (size, 1))
    if size > 1:
        np.fill_diagonal(a, 0.0)
    x, b = rng.standard_normal(size), rng.standard_normal((size, 3))
    wanted, columns = np.linalg.solve(a, x), np.linalg.solve(a, b)
    _solutions(a.copy(), np.empty(size, dtype=np.int64), x, b)
    assert x == pytest.approx(wanted, rel=1e-9, abs=1e-12 * np.abs(wanted).max())
    assert b == pytest.approx(columns, rel=1e-9, abs=1e-12 * np.abs(columns).max())


def test_elimination_of_the_first_columns():
    """Three of five rows in eight unknowns are eliminated; the known solution solves what is left.

    A further row loses the multiples ``weights`` of the reduced right sides.
    """
    rng = np.random.default_rng(0)
    a, row, x = rng.standard_normal((5, 8)), rng.standard_normal(8), rng.standard_normal(8)
    reduced, further, weights = a @ x, row.copy(), np.empty(3)
    known = np.concatenate([np.zeros(3), x[3:]])
    _eliminated(a, 3, np.empty(3, dtype=np.int64), reduced, further, weights, known)
    assert known == pytest.approx(x, rel=1e-11)
    assert a[3:, 3:] @ x[3:] == pytest.approx(reduced[3:], rel=1e-11)
    assert further[3:] @ x[3:] == pytest.approx(row @ x - weights @ reduced[:3], rel=1e-11)


@njit
def _banded(a, reach, starts, pivots, x):
    dense_lu.factorise_within(a, reach, starts, pivots)
    dense_lu.solve_within(a, reach, starts, pivots, x)


@pytest.mark.parametrize("sizes", [(1,), (7,), (1, 1, 1, 1, 1), (3, 5, 2, 6), (6, 1, 6, 1, 6)])
def test_rows_that_end_early_are_solved_as_by_lapack(sizes):
    """Block-tridiagonal matrices whose diagonal is zero, so that pivots fill their rows."""
    rng = np.random.default_rng(len(sizes))
    block = np.repeat(np.arange(len(sizes)), sizes)
    a = rng.standard_normal((len(block),) * 2) * 10.0 ** rng.integers(-3, 4, (len(block), 1))
    a[np.abs(block[:, None] - block) > 1] = 0.0
    if len(block) > 5:
        np.fill_diagonal(a, 0.0)
    ends = np.cumsum(sizes)
    column = ends[np.minimum(block + 1, len(sizes) - 1)]
    reach = np.array([column, column[column - 1]])
    x = rng.standard_normal(len(block))
    wanted, factors = np.linalg.solve(a, x), a.copy()
    _banded(factors, reach, np.zeros(len(block), np.int64), np.zeros(len(block), np.int64), x)
    assert x == pytest.approx(wanted, rel=1e-8, abs=1e-12 * np.abs(wanted).max())
    beyond = np.arange(len(block)) >= reach[1][:, None]
    assert not factors[beyond].any()
