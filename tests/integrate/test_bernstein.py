"""Polynomials in Bernstein form against numpy's, and first crossings against known roots."""

from math import comb

import numpy as np
import pytest
from numba import njit
from numpy.polynomial import Polynomial

from fecontact.integrate import bernstein


@njit
def _nested(parts, b):
    bernstein.from_nested(parts, b)


@njit
def _value(b, s):
    return bernstein.value(b, s, np.empty(len(b)))


@njit
def _first_below(b):
    return bernstein.first_below(b, np.empty((bernstein.DEPTH, len(b) + 1)))


@njit
def _sign_changes(b):
    places = np.empty(len(b))
    found = bernstein.sign_changes(b, places, np.empty((bernstein.DEPTH, len(b) + 1)))
    return places[:found]


def _of(polynomial: Polynomial) -> np.ndarray:
    """Bernstein coefficients from powers, b_k = sum_i c_i C(k, i) / C(n, i)."""
    n = len(polynomial.coef) - 1
    return np.array([sum(c * comb(k, i) / comb(n, i) for i, c in enumerate(polynomial.coef))
                     for k in range(n + 1)])


@pytest.mark.parametrize("degree", [1, 3, 4, 7])
def test_nested_products_become_the_same_polynomial(degree: int) -> None:
    rng = np.random.default_rng(degree)
    parts = rng.normal(size=degree + 1)
    b = np.empty(degree + 1)
    _nested(parts, b)
    s = Polynomial([0.0, 1.0])
    expected = Polynomial([parts[-1]])
    for k in range(degree - 1, -1, -1):
        expected = parts[k] + expected * (s if k % 2 == 0 else 1.0 - s)
    for place in np.linspace(0.0, 1.0, 11):
        assert _value(b, place) == pytest.approx(expected(place), abs=1e-13)
    np.testing.assert_allclose(b, _of(expected), atol=1e-13)


@pytest.mark.parametrize("roots", [
    [0.3], [0.25, 0.75], [0.499999, 0.500001], [0.1, 0.2, 0.3], [0.9, 1.7, -0.4],
    [0.5, 0.5000001, 0.7, 2.0], [0.0123, 0.0124, 0.9, 0.95, 0.99, 3.0, -1.0],
])
def test_the_first_crossing_is_the_first_root(roots: list[float]) -> None:
    polynomial = Polynomial.fromroots(roots)
    polynomial = polynomial if polynomial(0.0) > 0.0 else -polynomial
    first = min(root for root in roots if root > 0.0)
    found = _first_below(_of(polynomial))
    assert found == pytest.approx(first, abs=1e-8)
    # Lifted above its lowest value, the same has none.
    lowest = polynomial(np.linspace(0.0, 1.0, 200001)).min()
    lifted = polynomial - 1.01 * lowest
    assert _first_below(_of(lifted)) == bernstein.NOWHERE


def test_signs_at_the_ends() -> None:
    assert _first_below(np.array([-1.0, 1.0, 1.0])) == 0.0
    assert _first_below(np.array([0.0, 1.0, 2.0])) == bernstein.NOWHERE
    # Zero at the start, then below: at once.
    assert _first_below(np.array([0.0, -1.0, -2.0])) < 1e-12
    # Down to zero at the very end only: not below.
    assert _first_below(np.array([1.0, 0.5, 0.0])) == bernstein.NOWHERE
    # A double root touches zero and is not below, but for rounding at that place.
    touch = _first_below(np.array([0.25, -0.25, 0.25]))
    assert touch == bernstein.NOWHERE or touch == pytest.approx(0.5, abs=1e-7)


def test_the_first_crossing_is_exact_to_the_resolution() -> None:
    """At the end of the interval of length FINEST with the zero, but for rounding of the latter."""
    rng = np.random.default_rng(5)
    for root in 10.0 ** rng.uniform(-9.0, 0.0, 200):
        polynomial = Polynomial([root, -1.0]) * Polynomial([1.0, 0.3, 0.5, 20.0 * rng.random()])
        b = _of(polynomial)
        assert -0.1 * bernstein.FINEST < _first_below(b) - root < 1.1 * bernstein.FINEST
        assert _sign_changes(b) == pytest.approx([_first_below(b)], abs=0.0)


def test_many_random_polynomials_against_dense_sampling() -> None:
    rng = np.random.default_rng(7)
    places = np.linspace(0.0, 1.0, 2001)
    for _ in range(300):
        b = rng.normal(size=8)
        b[0] = abs(b[0])
        found = _first_below(b)
        values = np.array([_value(b, place) for place in places])
        below = np.flatnonzero(values < 0.0)
        if len(below):
            assert places[below[0]] - 1.0 / 2000 - 1e-12 <= found <= places[below[0]] or (
                found < places[below[0]] and _value(b, min(found + 1e-10, 1.0)) < 1e-9)
        elif found != bernstein.NOWHERE:
            assert _value(b, found + 1e-10) < 0.0


@pytest.mark.parametrize("roots", [
    [0.3], [0.25, 0.75], [0.499999, 0.500001], [0.1, 0.2, 0.3], [0.9, 1.7, -0.4], [0.5],
    [0.5, 0.25, 0.7, 2.0], [0.0123, 0.0124, 0.9, 0.95, 0.99, 3.0, -1.0], [1.5, -0.5], [0.0, 0.5],
])
def test_every_change_of_sign_is_found(roots: list[float]) -> None:
    within = sorted(root for root in roots if 0.0 < root < 1.0 and roots.count(root) == 1)
    for polynomial in (Polynomial.fromroots(roots), -Polynomial.fromroots(roots)):
        assert _sign_changes(_of(polynomial)) == pytest.approx(within, abs=1e-8)


def test_changes_of_sign_of_random_polynomials() -> None:
    rng = np.random.default_rng(3)
    places = np.linspace(0.0, 1.0, 4001)
    for _ in range(300):
        b = rng.normal(size=5)
        signs = np.sign([_value(b, place) for place in places])
        wanted = places[1:][signs[1:] != signs[:-1]]
        found = _sign_changes(b)
        assert len(found) == len(wanted)
        assert found == pytest.approx(wanted, abs=2.6e-4)
