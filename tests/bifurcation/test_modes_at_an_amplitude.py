"""Nonlinear modes at one amplitude or frequency, against elliptic integrals and closed forms."""

import numpy as np
import pytest
from test_nonlinear_modes import duffing_frequency, masses

from fecontact.bifurcation import HarmonicBalance, nonlinear_mode
from fecontact.core.errors import InputError


@pytest.fixture(scope="module")
def hard():
    system = masses(between=0.5)
    return system, nonlinear_mode(system, (1e-3, 2.0), 2, observe=("a.p", "y"),
                                  method=HarmonicBalance(11))


@pytest.mark.parametrize("amplitude", [1e-3, 0.0123, 0.7, 1.43, 2.0])
def test_frequency_is_that_of_the_elliptic_integral(hard, amplitude):
    system, mode = hard
    found = mode.at(system, amplitude=amplitude)
    assert len(found) == 1
    assert found.amplitude[0] == pytest.approx(amplitude, rel=1e-6)
    exact = duffing_frequency(3.0, 4.0, amplitude)
    assert found.angular_frequency[0] == pytest.approx(exact, rel=1e-6)
    shape = found.coordinates()[0]
    assert np.abs(shape[0] + shape[1]) < 1e-6 * np.abs(shape[0])


def test_amplitude_follows_from_the_frequency(hard):
    system, mode = hard
    frequency = duffing_frequency(3.0, 4.0, 0.9) / (2.0 * np.pi)
    assert mode.at(system, frequency_hz=frequency).amplitude[0] == pytest.approx(0.9, rel=1e-5)


def test_errors_say_what_the_mode_has(hard):
    system, mode = hard
    with pytest.raises(InputError, match=r"amplitude = 3 must lie within the mode, from 0\.001"):
        mode.at(system, amplitude=3.0)
    with pytest.raises(InputError, match="frequency_hz = 100 Hz must lie within"):
        mode.at(system, frequency_hz=100.0)
    with pytest.raises(InputError, match="give either amplitude or frequency_hz"):
        mode.at(system)


def test_one_frequency_of_a_linear_mode_does_not_name_an_amplitude():
    system = masses()
    mode = nonlinear_mode(system, (1e-3, 0.1), 1, observe=("a.p", "y"),
                          method=HarmonicBalance(3))
    assert mode.at(system, amplitude=0.02).angular_frequency[0] == pytest.approx(1.0, rel=1e-10)
    with pytest.raises(InputError, match="times; give the amplitude"):
        mode.at(system, frequency_hz=float(mode.frequency_hz[0]))
