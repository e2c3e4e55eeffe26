"""Arctangent and sine of laws against those of the C library, at every interval they have."""

import math

import numpy as np
import pytest

from fecontact.laws.elementary import arctangent, sine_and_cosine

# Ends of the intervals of the arctangent.
ENDS = (0.4375, 0.6875, 1.1875, 2.4375)
SIZES = (*np.geomspace(1e-9, 1e9, 2000),
         *(np.nextafter(end, to) for end in ENDS for to in (0.0, end, 9.0)))


def test_arctangent_is_right_to_two_units_in_the_last_place():
    for size in SIZES:
        for x in (size, -size):
            wanted = math.atan(x)
            assert abs(arctangent(x) - wanted) <= 2.0 * np.spacing(abs(wanted)), x


@pytest.mark.parametrize("x", [0.0, -0.0, math.inf, -math.inf])
def test_arctangent_of_zero_and_of_infinity(x):
    assert arctangent(x) == math.atan(x)
    assert math.copysign(1.0, arctangent(x)) == math.copysign(1.0, x)


def test_what_is_no_number_has_no_arctangent_and_no_sine():
    assert math.isnan(arctangent(math.nan))
    assert all(map(math.isnan, sine_and_cosine(math.nan)))


def test_sine_and_cosine_in_every_quarter_turn():
    # Multiples of a quarter turn are where angles are reduced; beyond a million radians those of
    # the library serve.
    turns = np.arange(-60.0, 61.0) * math.pi / 4.0
    some = np.random.default_rng(1).uniform(-1.0, 1.0, 500)
    for x in (*turns, *(turns + 1e-9), *(30.0 * some), *(1e6 * some), 1.0000001e6, -3e12):
        sine, cosine = sine_and_cosine(x)
        assert sine == pytest.approx(math.sin(x), rel=0.0, abs=2.3e-16), x
        assert cosine == pytest.approx(math.cos(x), rel=0.0, abs=2.3e-16), x
