"""Zeros of a function between two places at which it has different signs.

By false position; where one of the places stays twice in a row, its value is halved (Illinois).
"""

from typing import NamedTuple

from fecontact.core.compiled import helper


class Bracket(NamedTuple):
    """Two places, the values there, and which one was moved last: -1 the first, 1 the second."""

    low: float
    high: float
    at_low: float
    at_high: float
    moved: int


@helper
def between(bracket):
    """Place between those of a bracket at which to look next."""
    low, high, at_low, at_high, _ = bracket
    place = (low * at_high - high * at_low) / (at_high - at_low)
    return place if low < place < high else 0.5 * (low + high)


@helper
def narrowed(bracket, place, value):
    """The bracket with one of its places moved to where the function has been found."""
    low, high, at_low, at_high, moved = bracket
    if (value < 0.0) == (at_low < 0.0):
        return Bracket(place, high, value, 0.5 * at_high if moved < 0 else at_high, -1)
    return Bracket(low, place, 0.5 * at_low if moved > 0 else at_low, value, 1)
