"""Frequency responses from histories: a filter whose response is known, and noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import freqz, lfilter

from fecontact.core.errors import InputError
from fecontact.measured import Channel, Measurement, averaged_responses, experimental_modes

RATE = 1000.0
DECAY, TURN = 0.97, 2.0 * np.pi * 120.0 / RATE
B, A = [0.0, 1.0], [1.0, -2.0 * DECAY * np.cos(TURN), DECAY**2]


def measured(noise=0.0, samples=200_000):
    """Random force, response of a filter of second order, and noise of the response."""
    random = np.random.default_rng(3)
    force = random.normal(size=samples)
    answer = lfilter(B, A, force)
    # The noise has the spectrum of the response, so that coherence is the same everywhere.
    other = noise * lfilter(B, A, random.normal(size=samples))
    return Measurement(np.arange(samples) / RATE, np.column_stack([answer + other, force]), (
        Channel("end", "m/s^2", 7, "+y"), Channel("force", "N", 3, "-y")))


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_response_of_a_filter_and_its_coherence(noise):
    found = averaged_responses(measured(noise), "force", segment=1.024)
    true = freqz(B, A, worN=found.abscissa, fs=RATE)[1]
    off = np.abs(found.values[:, 0] / true - 1.0)[2:-2]
    assert np.median(off) < (0.002 if noise == 0.0 else 0.05)
    assert found.coherence[2:-2, 0].mean() == pytest.approx(1.0 / (1.0 + noise**2), abs=0.01)
    channel, = found.channels
    assert (channel.name, channel.unit) == ("end", "m/s^2/N")
    assert (channel.node, channel.reference_node, channel.reference_direction) == (7, 3, "-y")
    assert found.abscissa[1] == pytest.approx(RATE / 1024)


def test_modes_are_found_from_histories():
    """The pole of the filter: exp((-D w + i w sqrt(1 - D^2)) / rate)."""
    found = averaged_responses(measured(), "force", segment=2.048).between(60.0, 200.0)
    modes = experimental_modes(found, [119.0])
    pole = RATE * complex(np.log(DECAY), TURN)
    assert modes.frequencies_hz[0] == pytest.approx(abs(pole) / (2.0 * np.pi), rel=5e-3)


@pytest.mark.parametrize(("change", "segment", "message"), [
    ({}, 1e-3, "16 samples"), ({}, 150.0, "half of the measurement"),
    ({"abscissa": np.cumsum(1.0 + 0.1 * (np.arange(400) % 2))}, 30.0, "evenly"),
    ({"values": np.zeros((400, 2))}, 0.1, "no content")])
def test_what_cannot_be_averaged_is_told(change, segment, message):
    given = replace(measured(samples=400 if change else 200_000), **change)
    with pytest.raises(InputError, match=message):
        averaged_responses(given, 1, segment=segment)


def test_a_force_alone_has_no_response():
    alone = Measurement(np.arange(100) / RATE, np.ones(100), "force")
    with pytest.raises(InputError, match="beside the force"):
        averaged_responses(alone, "force", segment=0.02)
