"""Fourier coefficients of motions and orbits in closed form."""

import numpy as np
import pytest
from oscillators import duffing, jenkins_system
from scipy.interpolate import CubicSpline
from systems import TURN

from fecontact import AnalysisError, ContactSystem, Drive, InputError, basis_from_matrices
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    PeriodicMotion,
    Shooting,
    contact_field,
    frequency_response,
    orbit_branch,
    periodic_motion,
)


def linear(w=1.7):
    """Masses of 2 kg on springs, driven through 1 N/m by cos w t: X = A c / (K - m w^2 + i w b)."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(2.0 * np.eye(2), np.diag([8.0, 18.0]), {"B": rows, "C": rows},
                                damping=0.5 * np.eye(2))
    return ContactSystem(basis, drive=Drive(
        stiffness_x=1.0, amplitude_x=0.1, frequency_hz=w / TURN))


def test_coefficients_of_a_motion_in_closed_form():
    """Mean, cosines and sines, of uneven samples too, over the last of two periods."""
    T, t0 = 2.5, 0.4
    w = 2.0 * np.pi / T

    def moved(t):
        return np.stack([0.3 + 2.0 * np.cos(w * t) - 0.7 * np.sin(3.0 * w * t),
                         1.5 * np.sin(w * t)], axis=1)

    even = np.linspace(t0, t0 + 2.0 * T, 2 * 60 + 1)
    uneven = t0 + 2.0 * T * np.linspace(0.0, 1.0, 801) ** 1.2
    for times, error in ((even, 1e-12), (uneven, 1e-6)):
        found = PeriodicMotion(times, moved(times), T).harmonics(4)
        exact = np.zeros((5, 2), dtype=complex)
        exact[0, 0], exact[1, 0], exact[3, 0], exact[1, 1] = 0.3, 2.0, 0.7j, -1.5j
        assert found == pytest.approx(exact, abs=error)
    observed = PeriodicMotion(even, moved(even), T).harmonics(1, observe=[1.0, 2.0])
    assert observed == pytest.approx([0.3, 2.0 - 3.0j])


@pytest.mark.parametrize("method", [Collocation(), Shooting(), HarmonicBalance()])
def test_coefficients_of_a_linear_orbit(method):
    field = contact_field(linear(), ["drive.frequency_hz"])
    branch = orbit_branch(field, periodic_motion(linear()), method=method,
                          bounds=(1.5 / TURN, 1.8 / TURN))
    for point in (branch.points[0], branch.points[-1]):
        w = TURN * point.parameter
        orbit = point.orbit(field, 200)
        # A drive A sin w t.
        exact = -0.1j / (8.0 + 1.0 - 2.0 * w**2 + 0.5j * w)
        found = orbit.harmonics(3, field=field, observe=("B", "x"))
        assert abs(found[1] - exact) < 1e-6 * abs(exact)
        assert np.abs(found[[0, 2, 3]]).max() < 1e-6 * abs(exact)
        m = field.system().basis.modes
        assert orbit.harmonics(1)[1, m:] == pytest.approx(
            1j * w * orbit.harmonics(1)[1, :m], abs=1e-6)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"count": 60}, "count = 60 must be a whole number from 0 to 49"),
    ({"count": -1}, "count = -1"),
    ({"observe": ("B", "x")}, "give its field"),
    ({"observe": [1.0]}, "2 numbers")])
def test_bad_input_is_named(arguments, message):
    times = np.linspace(0.0, 1.0, 101)
    motion = PeriodicMotion(times, np.stack([np.cos(times), np.sin(times)], axis=1), 1.0)
    with pytest.raises(InputError, match=message):
        motion.harmonics(**arguments)
    with pytest.raises(InputError, match="does not know its period"):
        PeriodicMotion(times, motion.states).harmonics(1)
    with pytest.raises(InputError, match="less than its period"):
        PeriodicMotion(times, motion.states, 2.0).harmonics(1)


@pytest.mark.parametrize("method", [Collocation()])
def test_duffing_response_is_that_of_harmonic_balance(method):
    """Folds, amplitude and phase of the peak, and the third harmonic."""
    found = frequency_response(duffing(), (0.6, 2.0), "W", method=method)
    exact = frequency_response(duffing(), (0.6, 2.0), "W", method=HarmonicBalance(15))
    folds = [[fold.parameter for fold in one.branches[0].of_kind("fold")]
             for one in (found, exact)]
    assert len(folds[0]) == 2
    assert folds[0] == pytest.approx(folds[1], rel=1e-5)
    here, there = found.branches[0].of_kind("fold")[0], exact.branches[0].of_kind("fold")[0]
    assert here.values["observed_amplitude"] == pytest.approx(
        there.values["observed_amplitude"], rel=1e-3)
    assert np.abs(found.harmonic(3)).max() == pytest.approx(np.abs(exact.harmonic(3)).max(),
                                                            rel=1e-2)
    assert found.phase()[[0, -1]] == pytest.approx(exact.phase()[[0, -1]], abs=1e-4)


@pytest.mark.slow
def test_jenkins_response_by_shooting_is_that_of_harmonic_balance():
    """Levels at which the element slides: amplitudes and third harmonics of the first points."""
    levels, bounds = {"drive.amplitude_x": [4.0, 5.0]}, (0.9 / TURN, 1.3 / TURN)
    found = frequency_response(jenkins_system(), bounds, levels=levels,
                               options=ContinuationOptions(points=4), method=Shooting(segments=1))
    exact = frequency_response(jenkins_system(), bounds, levels=levels,
                               method=HarmonicBalance(31))
    assert found.levels.tolist() == [4.0, 5.0]
    for level in (0, 1):
        w = found.branches[level].parameter
        for here, there in ((found.amplitude(level), exact.amplitude(level)),
                            (np.abs(found.harmonic(3, level)), np.abs(exact.harmonic(3, level)))):
            interpolated = CubicSpline(exact.branches[level].parameter, there)(w)
            assert here == pytest.approx(interpolated, rel=5e-3)
        assert all(point.values["stable"] for point in found.branches[level].points)


def test_elements_that_stick_are_told():
    """Below the limit of sliding the deflection of the element is free."""
    with pytest.raises(AnalysisError, match="never slide keep any deflection"):
        frequency_response(jenkins_system(), (0.8 / TURN, 0.9 / TURN),
                           levels={"drive.amplitude_x": [0.5]}, method=Shooting(segments=1))
