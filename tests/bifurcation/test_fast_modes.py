"""Multipliers of modes that are too fast for the intervals."""

import re

import numpy as np
import pytest

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    orbit_branch,
    periodic_motion,
    vector_field,
)

FAST, DAMPING = 120.0, 0.1


def two_oscillators(t, x, p, out):
    # A slow one, forced, and a fast one beside it.
    out[0], out[1] = x[1], p[0] * np.cos(t) - 2.0 * x[0] - 0.5 * x[1]
    out[2], out[3] = x[3], -(FAST**2) * x[2] - 2.0 * DAMPING * x[3] + 0.1 * x[0]


@pytest.fixture(scope="module")
def start():
    field = vector_field(two_oscillators, {"force": 1.0}, ["x", "v", "y", "w"],
                         period=lambda p: 2.0 * np.pi)
    return field, periodic_motion(field, initial=np.zeros(4), transient=200.0)


def branch_by(start, method):
    field, motion = start
    return orbit_branch(field, motion, method=method, options=ContinuationOptions(points=1))


@pytest.mark.parametrize("method", [
    Collocation(intervals=20, most_intervals=20), HarmonicBalance(5)])
def test_a_note_tells_the_error_of_the_modulus(start, method):
    branch = branch_by(start, method)
    largest = np.abs(branch.points[0].values["multipliers"]).max()
    # The fast vibration decays by exp(-damping period), the slow one faster.
    error = largest - np.exp(-DAMPING * 2.0 * np.pi)
    assert 0.1 < error < 1.0 - np.exp(-DAMPING * 2.0 * np.pi)
    said = float(re.search(r"too large by some ([0-9.e-]+),", branch.message)[1])
    # One digit.
    assert said == pytest.approx(error, abs=0.051)
    assert "Shooting()" in branch.message


@pytest.mark.parametrize("method", [
    Collocation(intervals=400, most_intervals=400), HarmonicBalance(5, samples=1600)])
def test_more_intervals_resolve_them(start, method):
    branch = branch_by(start, method)
    assert np.abs(branch.points[0].values["multipliers"]).max() == pytest.approx(
        np.exp(-DAMPING * 2.0 * np.pi), rel=1e-4)
    assert "fast modes" not in branch.message
