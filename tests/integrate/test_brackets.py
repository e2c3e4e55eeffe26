"""False position in brackets, beside zeros that are known."""

import math

import pytest

from fecontact.integrate.brackets import Bracket, between, narrowed


@pytest.mark.parametrize(("function", "low", "high", "zero"), [
    (lambda x: x**3 - 0.3, 0.0, 1.0, 0.3 ** (1.0 / 3.0)),
    (lambda x: 0.3 - x**9, 0.0, 1.0, 0.3 ** (1.0 / 9.0)),
    (lambda x: math.expm1(5.0 * (x - 0.1)), 0.0, 1.0, 0.1)])
def test_bracket_closes_on_the_zero(function, low, high, zero):
    bracket = Bracket(low, high, function(low), function(high), 0)
    for _ in range(30):
        place = between(bracket)
        assert bracket.low < place < bracket.high
        if abs(place - zero) < 1e-12:
            break
        bracket = narrowed(bracket, place, function(place))
        assert bracket.at_low * bracket.at_high < 0.0
        assert bracket.low < zero < bracket.high
    assert place == pytest.approx(zero, abs=1e-12)


def test_place_is_within_a_bracket_whose_values_rounding_has_made_equal():
    assert between(Bracket(1.0, 2.0, -1e-320, 1e300, 0)) == 1.5
