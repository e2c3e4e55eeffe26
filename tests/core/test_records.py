"""Records of kernels: arrays of eight numbers, and numbers read in the order of the fields."""

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from fecontact.core.records import ANY, allocate, of_eight, reader
from fecontact.core.types import Array, Integers

SIZES = {ANY: 3}


class Inner(NamedTuple):
    """Within another record."""

    count: int
    weights: Annotated[Array, ANY]


class Outer(NamedTuple):
    """A record with all kinds of fields."""

    scale: float
    inner: Inner
    places: Annotated[Integers, ANY]
    matrix: Annotated[Array, ANY, 2]


@pytest.mark.parametrize("repetition", range(20))
def test_eight_numbers_lie_in_one_line_of_the_cache(repetition):
    made = allocate(of_eight(Outer), SIZES)
    for array in (made.scale, made.inner.weights, made.matrix):
        assert array.ctypes.data % 64 == 0
        assert array.flags.c_contiguous
        assert not array.any()
    assert made.matrix.shape == (3, 2, 8)
    assert made.places.shape == (3,)


def test_numbers_are_read_in_the_order_of_the_fields():
    one = Outer(2.0, Inner(7, np.full(3, 3.0)), np.arange(3), np.ones((3, 2)))
    scale, weights, matrix = reader(Outer, float, Array)(one)
    assert scale == 2.0
    assert weights is one.inner.weights
    assert matrix is one.matrix
    assert reader(Outer, int, Integers)(one) == (7, one.places)
