"""The example of a friction damper on a beam: both limits and the best load."""

import friction_damper as example
import numpy as np
import pytest


@pytest.fixture(scope="module")
def limits():
    return example.limit(0.0), example.limit(100.0 * example.BEST)


def test_beam_resonates_as_that_of_bernoulli_and_with_the_spring(limits):
    (free, _), (stuck, _) = limits
    bending = 1.8751**2 / (2.0 * np.pi * example.LENGTH**2) * np.sqrt(
        2.1e11 * example.HEIGHT**2 / 12.0 / 7850.0)
    assert free == pytest.approx(bending, rel=5e-3)
    # One mode with mass m / 4 at the end, and the spring there.
    mass = 0.25 * 7850.0 * 0.02 * example.HEIGHT * example.LENGTH
    alone = np.sqrt(free**2 + example.SPRING / mass / (2.0 * np.pi) ** 2)
    assert stuck == pytest.approx(alone, rel=0.01)


@pytest.mark.parametrize(("load", "periods"), [(0.0, 250), (100.0 * example.BEST, 150)])
def test_limits_are_those_of_linear_vibrations(limits, load, periods):
    frequency, amplitude = limits[int(load > 0.0)]
    found, = example.amplitudes(load, np.array([frequency]), periods)
    assert found == pytest.approx(amplitude, rel=5e-3)


@pytest.mark.slow
def test_best_load_is_the_classical_one(limits):
    (free, high), (stuck, low) = limits
    loads = example.BEST * np.array([0.75, 1.0, 1.35])
    expected = example.estimate(loads, example.FORCE / np.sqrt(high * low))
    near = example.between(loads, expected, free, stuck)
    found = np.array([example.resonance(*pair, 5) for pair in zip(loads, near, strict=True)])
    assert found[:, 0] == pytest.approx(near, rel=0.01)
    # The estimate has one harmonic and a damper without mass.
    assert found[:, 1] == pytest.approx(expected, rel=0.06)
    assert example.best(loads, found[:, 1]) == pytest.approx(example.BEST, rel=0.12)
    assert found[1, 1] < 0.12 * low
