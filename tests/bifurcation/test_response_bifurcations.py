"""Torus points, subharmonic and superharmonic resonances by harmonic balance and by collocation."""

import numpy as np
import pytest

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    PeriodicMotion,
    frequency_response,
    orbit_branch,
    vector_field,
)

TURN = 2.0 * np.pi


def _van_der_pol(t, x, p, out):
    out[0] = x[1]
    out[1] = 0.2 * (1.0 - x[0] ** 2) * x[1] - x[0] + p[1] * np.cos(p[0] * t)


def _duffing(t, x, p, out):
    out[0] = x[1]
    out[1] = p[1] * np.cos(p[0] * t) - 0.02 * x[1] - x[0] - 0.5 * x[0] ** 3


def forced(function, W, P):
    return vector_field(function, {"W": W, "P": P}, 2, period=lambda p: TURN / p["W"])


def test_torus_point_of_the_forced_van_der_pol_oscillator():
    """Entrained at resonance; beside it the free vibration beats with the force."""
    field = forced(_van_der_pol, 1.05, 1.5)
    found = frequency_response(field, (1.05, 1.6), "W", method=HarmonicBalance(15))
    torus, = found.branches[0].special
    assert torus.kind == "Neimark-Sacker"
    start = min(found.branches[0].points, key=lambda point: abs(point.parameter - 1.36))
    other = orbit_branch(field, start.orbit(field), "W", method=Collocation(60),
                         bounds=(1.3, 1.6)).of_kind("Neimark-Sacker")[0]
    assert torus.parameter == pytest.approx(other.parameter, abs=1e-8)
    assert torus.angle == pytest.approx(other.angle, abs=1e-8)
    pairs = [sorted(point.values["multipliers"], key=np.imag) for point in (torus, other)]
    assert pairs[0] == pytest.approx(pairs[1], abs=1e-6)
    assert np.abs(pairs[0]) == pytest.approx(1.0, abs=1e-8)
    # To leading order entrainment ends where the amplitude of the forced part is the square root
    # of two: P = sqrt(2) |1 - W^2| for large detuning.
    assert torus.parameter == pytest.approx(np.sqrt(1.0 + 1.5 / np.sqrt(2.0)), rel=0.01)


def test_superharmonic_resonance_of_the_duffing_oscillator():
    """At a third of the (hardened) natural frequency the third harmonic is larger than the first.

    Folds are those of collocation.
    """
    field = forced(_duffing, 0.3, 1.0)
    found = frequency_response(field, (0.38, 0.6), "W", method=HarmonicBalance(25))
    branch, third = found.branches[0], np.abs(found.harmonic(3))
    best = int(np.argmax(third))
    assert third[best] > np.abs(found.harmonic(1))[best]
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    assert abs(branch.parameter[best] - branch.special[0].parameter) < 0.01
    start = min((point for point in branch.points if point.values["stable"]),
                key=lambda point: abs(point.parameter - 0.40))
    other = orbit_branch(field, start.orbit(field), "W", method=Collocation(60),
                         bounds=(0.39, 0.6)).of_kind("fold")
    assert [point.parameter for point in branch.special] == pytest.approx(
        [point.parameter for point in other], abs=1e-8)


def test_subharmonic_vibration_of_the_duffing_oscillator():
    """Three periods of the force in one of the motion, on a branch of its own that ends in a fold.

    x = A cos(W t / 3) + B cos W t with B = P / (1 - W^2 + (3/4) A^2) leads, without damping, to
    W^2 / 9 = 1 + (3/8) (A^2 + A B + 2 B^2): two harmonics alone.
    """
    field = forced(_duffing, 4.5, 4.0)
    t = np.linspace(0.0, TURN / 1.5, 301)
    motion = PeriodicMotion(t, np.stack([
        1.2 * np.cos(1.5 * t) - 0.2 * np.cos(4.5 * t),
        -1.8 * np.sin(1.5 * t) + 0.9 * np.sin(4.5 * t)], axis=1), TURN / 1.5, 3)
    options = ContinuationOptions(points=400, largest_step=0.05)
    found = orbit_branch(field, motion, "W", method=HarmonicBalance(15), bounds=(3.0, 5.0),
                         both=True, options=options)
    fold, = found.of_kind("fold")
    other, = orbit_branch(field, found.points[0].orbit(field), "W", method=Collocation(60),
                          bounds=(3.0, 5.0), both=True, options=options).of_kind("fold")
    assert fold.parameter == pytest.approx(other.parameter, abs=1e-8)
    for point in (found.points[0], found.points[-1]):
        assert point.parameter == pytest.approx(5.0)
        X = point.u[: 31 * 2].reshape(31, 2)[:, 0]
        A = np.hypot(X[1], X[2])
        B = 4.0 / (1.0 - 25.0 + 0.75 * A**2)
        assert np.abs(X[[3, 4]]).max() < 1e-10  # no even harmonics
        signs = np.array([1.0, -1.0])
        assert np.abs(25.0 / 9.0 - 1.0 - 0.375 * (A**2 + signs * A * B + 2.0 * B**2)).min() < 0.06
        assert point.values["period"] == pytest.approx(3.0 * TURN / 5.0)
