"""Choices among values that are equal but for rounding."""

import numpy as np
import pytest

from fecontact.core.ties import first_largest, first_least, oriented

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(("values", "largest", "least"), [
    ([1.0, 3.0, 3.0, 2.0], 1, 0), ([-1.0, -1.0, -2.0], 0, 2), ([0.0, 0.0], 0, 0), ([5.0], 0, 0)])
def test_the_first_of_equal_values_counts(values, largest, least):
    for _ in range(50):
        moved = np.array(values) * (1.0 + 1e-15 * RNG.normal(size=len(values)))
        assert (first_largest(moved), first_least(moved)) == (largest, least)


def test_values_that_differ_are_told_apart():
    assert first_largest([1.0, 1.0 + 1e-4]) == 1
    assert first_least([1.0, 1.0 - 1e-4]) == 1


@pytest.mark.parametrize("vector", [[0.3, -0.5, 0.1], [1.0, -1.0], [-1.0, 1.0], [0.0, -2.0]])
def test_vectors_of_either_sign_are_turned_alike(vector):
    given = np.array(vector)
    expected = given if np.sign(given[np.argmax(np.abs(given))]) > 0.0 else -given
    for _ in range(50):
        moved = given + 1e-15 * RNG.normal(size=len(given))
        for sign in (1.0, -1.0):
            assert oriented(sign * moved) == pytest.approx(expected, abs=1e-13)
