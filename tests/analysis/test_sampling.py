"""Spectra are those of the motion, not of outputs too far apart."""

from dataclasses import replace

import numpy as np
import pytest
from systems import mass_in_y

from fecontact import InputError, ModelWarning, simulate
from fecontact.analysis import amplitude_spectrum, spectrogram
from fecontact.analysis.sampling import alias_message, evenly_sampled_history, fastest_period
from fecontact.analysis.spectra import require_periods
from fecontact.plot import plot_spectrum

HERTZ, DURATION = 145.6, 0.2


def free_vibration(outputs):
    """A mass above the ground, on a spring, at 145.6 Hz."""
    system = mass_in_y(spring=(2.0 * np.pi * HERTZ) ** 2, gap=1.0)
    return simulate(system, DURATION, initial=np.array([1e-3, 0.0]), outputs=outputs)


def test_forty_outputs_show_the_frequency_of_the_motion():
    run = free_vibration(40)
    # Their own spectrum ends at 97.5 Hz.
    aliased = amplitude_spectrum(run.time, run.velocity("C")[:, 1]).peaks(1)[0].frequency_hz
    assert aliased == pytest.approx(39.0 / DURATION - HERTZ, abs=1.0)
    found = evenly_sampled_history(run, "velocity", "C", "y")
    assert found.note == ""
    peak = amplitude_spectrum(found.time, found.history.values).peaks(1)[0]
    assert peak.frequency_hz == pytest.approx(HERTZ, abs=0.2)
    assert peak.value == pytest.approx(1e-3 * 2.0 * np.pi * HERTZ, rel=0.01)
    labels = [float(text.get_text()) for text in plot_spectrum(run, point="C", component="y")
              .axes[0].texts]
    assert labels[0] == pytest.approx(HERTZ, abs=0.2)


def test_fine_outputs_are_taken_as_they_are():
    run = free_vibration(2001)
    found = evenly_sampled_history(run, "velocity", "C", "y")
    assert found.time is run.time
    assert alias_message(run) == ""


def test_histories_that_cannot_be_resolved_are_warned_of():
    run = free_vibration(40)
    assert fastest_period(run) == pytest.approx(1.0 / HERTZ, rel=0.03)
    strange = replace(run, kept=None)
    with pytest.warns(ModelWarning, match=r"outputs lie 5\.13 ms apart, .*\(14[0-9.]+ Hz\)"
                                          r".*run with outputs = 4\d\d or more"):
        evenly_sampled_history(strange, "velocity", "C", "y")


def test_windows_have_enough_periods():
    t = np.linspace(0.0, 2.0, 4001)
    x = np.sin(2.0 * np.pi * 4.0 * t)
    # A thirty-second of the time would be a quarter of a period: ten periods at least, if any.
    assert spectrogram(t, x).resolution_hz == pytest.approx(0.5, rel=1e-3)
    with pytest.raises(InputError, match=r"a window of 1 s has 4 periods of the mean frequency"):
        spectrogram(t, x, piece=1.0)
    with pytest.raises(InputError, match=r"has 2 periods .* run for longer, or take windows of at "
                                         r"least 1\.25"):
        require_periods(t[:1000], x[:1000], 0.5)
    assert not amplitude_spectrum(t, 0.0 * t).values.any()
