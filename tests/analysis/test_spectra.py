"""Spectra of signals whose spectra are known."""

import numpy as np
import pytest

from fecontact import InputError
from fecontact.analysis import amplitude_spectrum, history, power_spectral_density, spectrogram
from fecontact.analysis.spectra import evenly_sampled

T = np.linspace(0.0, 4.0, 4001)


@pytest.mark.parametrize("window", ["hann", "flattop", "boxcar", "blackman"])
@pytest.mark.parametrize("frequency", [50.0, 50.123, 123.4])
def test_a_sine_shows_with_its_amplitude_and_frequency(window, frequency):
    x = 7.0 + 3e-3 * np.sin(2.0 * np.pi * frequency * T + 0.4)
    found = amplitude_spectrum(T, x, window=window)
    assert found.values[0] < 1e-5
    peak = found.peaks(1)[0]
    # Without a window the negative frequency leaks in; a flat top is flat within 5e-4.
    fine = {"boxcar": 2e-3, "flattop": 5e-4}.get(window, 2e-4)
    # A flat top shows the height, not the place.
    off = 0.5 if window == "flattop" else 0.02
    assert peak.frequency_hz == pytest.approx(frequency, abs=off * found.resolution_hz)
    assert peak.value == pytest.approx(3e-3, rel=fine)
    assert found.resolution_hz == pytest.approx(0.25, rel=1e-3)


def test_peaks_come_by_height_and_not_from_lobes():
    x = 2.0 * np.sin(2.0 * np.pi * 30.3 * T) + 0.5 * np.cos(2.0 * np.pi * 91.0 * T) + (
        0.05 * np.sin(2.0 * np.pi * 200.7 * T))
    peaks = amplitude_spectrum(T, x).peaks(10)
    assert [peak.frequency_hz for peak in peaks] == pytest.approx([30.3, 91.0, 200.7], abs=3e-3)
    assert [peak.value for peak in peaks] == pytest.approx([2.0, 0.5, 0.05], rel=2e-3)
    assert len(amplitude_spectrum(T, x).peaks(2)) == 2
    assert len(amplitude_spectrum(T, x).peaks(10, least=0.1)) == 2


def test_density_of_noise_integrates_to_its_variance():
    random = np.random.default_rng(3)
    t = np.arange(200_000) * 1e-3
    x = 5.0 + 0.7 * random.standard_normal(len(t))
    found = power_spectral_density(t, x, piece=0.5)
    assert np.trapezoid(found.values, found.frequency_hz) == pytest.approx(0.49, rel=0.01)
    # White up to 500 Hz.
    inner = found.values[5:-5]
    assert inner.mean() == pytest.approx(0.49 / 500.0, rel=0.01)
    assert inner.std() < 0.1 * inner.mean()
    assert found.resolution_hz == pytest.approx(2.0)


def test_density_of_a_sine_has_its_mean_square():
    x = 3.0 * np.sin(2.0 * np.pi * 40.0 * T)
    found = power_spectral_density(T, x)
    near = np.abs(found.frequency_hz - 40.0) < 20.0
    square = np.trapezoid(found.values[near], found.frequency_hz[near])
    assert square == pytest.approx(4.5, rel=0.01)


def test_spectrogram_follows_a_rising_frequency():
    x = (1.0 + T) * np.sin(2.0 * np.pi * (50.0 * T + 0.5 * 20.0 * T**2))
    found = spectrogram(T, x, piece=0.25)
    assert found.values.shape == (len(found.frequency_hz), len(found.time))
    assert found.time[0] == pytest.approx(0.125, abs=1e-3)
    highest = found.frequency_hz[found.values.argmax(axis=0)]
    assert highest == pytest.approx(50.0 + 20.0 * found.time, abs=0.6 * found.resolution_hz)
    # The frequency sweeps over 5 Hz in a piece of resolution 4 Hz: peaks are a little lower.
    assert found.values.max(axis=0) == pytest.approx(1.0 + found.time, rel=0.08)
    assert np.diff(found.time) == pytest.approx(0.0625, abs=1.1e-3)
    steady = spectrogram(T, 3.0 * np.sin(2.0 * np.pi * 60.0 * T), piece=0.25)
    assert steady.values.max(axis=0) == pytest.approx(3.0, rel=1e-9)


def test_uneven_times_are_refused_or_resampled():
    uneven = T + 2e-4 * np.sin(3.0 * T)
    x = np.sin(2.0 * np.pi * 20.0 * uneven)
    with pytest.raises(InputError, match="spectrum needs even ones; leave out the uneven part"):
        amplitude_spectrum(uneven, x)
    peak = amplitude_spectrum(uneven, x, resample=True).peaks(1)[0]
    assert peak.frequency_hz == pytest.approx(20.0, abs=2e-3)
    assert peak.value == pytest.approx(1.0, rel=1e-3)
    t, same = evenly_sampled(T + 100.0, x)
    assert t == pytest.approx(T + 100.0)
    assert (same == x).all()
    # Two parts, each even, are not even together.
    with pytest.raises(InputError, match="even ones"):
        evenly_sampled(np.concatenate([[0.0], 1.0 + T]), np.zeros(4002))


@pytest.mark.parametrize(("call", "message"), [
    (lambda: amplitude_spectrum(T[:5], T[:5]), "at least 8"),
    (lambda: amplitude_spectrum(T, np.full(4001, np.nan)), "finite"),
    (lambda: amplitude_spectrum(T[::-1], T), "ascend"),
    (lambda: amplitude_spectrum(T, T, padding=0), "padding = 0"),
    (lambda: power_spectral_density(T, T, piece=5.0), r"piece = 5\.0 s must be from 0\.008 s"),
    (lambda: spectrogram(T, T, overlap=1.0), r"overlap = 1\.0 must be"),
])
def test_what_has_no_spectrum(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_histories_by_name():
    from synthetic import run

    trajectory = run(times=21)
    cases = {
        ("displacement", "B", "y"): (trajectory.displacement("B")[:, 1], "m"),
        ("velocity", 3, "phi"): (trajectory.velocity(3)[:, 2], "rad/s"),
        ("normal_force", 2, "x"): (trajectory.normal_force[:, 2], "N"),
        ("total_friction_force", "B", "x"): (trajectory.friction_force.sum(axis=1), "N"),
        ("line_load", 1, "x"): (trajectory.line_load[:, 1], "N/m"),
        ("penetration_rate", 0, "x"): (trajectory.penetration_rate[:, 0], "m/s"),
    }
    for given, (values, unit) in cases.items():
        found = history(trajectory, *given)
        np.testing.assert_array_equal(found.values, values)
        assert found.unit == unit
    assert history(trajectory, "velocity", 3, "y").title == "velocity y of contact node 3"
    with pytest.raises(InputError, match=r"quantity = 'speed' is not known.*choose from"):
        history(trajectory, "speed")
    with pytest.raises(InputError, match="the modal basis has no thickness"):
        history(trajectory, "pressure", 1)
    with pytest.raises(InputError, match="one of contact nodes, not of point = 'B'"):
        history(trajectory, "line_load")
    with pytest.raises(InputError, match="component = 'z' is not one of B"):
        history(trajectory, "velocity", "B", "z")
    with pytest.raises(InputError, match="Contact node 7"):
        history(trajectory, "slip_velocity", 7)
