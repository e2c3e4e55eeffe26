"""Records of kernels: arrays of eight numbers, and numbers read in the order of the fields."""

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from fecontact.core.cache_lines import in_lines
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


def test_large_arrays_begin_at_a_line_of_the_cache():
    made = allocate(Outer, {ANY: 101})
    for array in (made.inner.weights, made.places, made.matrix):
        assert array.ctypes.data % 64 == 0
        assert array.flags.c_contiguous
        assert array.flags.aligned
        assert not array.any()
    assert made.places.dtype == np.int64
    # They lie side by side, and none reaches into another.
    for array in (made.places, made.matrix):
        array[...] = 7
        assert not (made.inner.weights == 7).any()
    assert (made.places == 7).all()
    assert (made.matrix == 7).all()


def test_a_copy_in_lines_is_that_array_at_a_line_of_the_cache():
    array = np.arange(600.0).reshape(20, 30).T
    copy = in_lines(array)
    assert copy.ctypes.data % 64 == 0
    assert copy.flags.c_contiguous
    np.testing.assert_array_equal(copy, array)
    array[0, 0] = 5.0
    assert copy[0, 0] == 0.0


def test_numbers_are_read_in_the_order_of_the_fields():
    one = Outer(2.0, Inner(7, np.full(3, 3.0)), np.arange(3), np.ones((3, 2)))
    scale, weights, matrix = reader(Outer, float, Array)(one)
    assert scale == 2.0
    assert weights is one.inner.weights
    assert matrix is one.matrix
    assert reader(Outer, int, Integers)(one) == (7, one.places)
