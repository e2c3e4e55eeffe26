"""Choices among values that are equal but for rounding: the first one counts."""

import numpy as np

from fecontact.core.types import Array, ArrayLike

# Difference, in parts of the largest size, up to which values count as equal.
_EQUAL = 1e-6


def first_largest(values: ArrayLike) -> int:
    """Index of the first of the values (n,) that equal the largest one."""
    given = np.asarray(values, dtype=float)
    return int(np.argmax(given >= given.max() - _EQUAL * np.abs(given).max()))


def first_least(values: ArrayLike) -> int:
    """Index of the first of the values (n,) that equal the least one."""
    return first_largest(-np.asarray(values, dtype=float))


def oriented(vector: Array) -> Array:
    """The real vector (n,), or its opposite, with a positive largest component.

    Among components of equal size the first one decides.
    """
    return np.asarray(np.copysign(1.0, vector[first_largest(np.abs(vector))]) * vector)
