"""Elementary functions of eight numbers at once, against those of the C library."""

import numpy as np
import pytest

from fecontact.core.compiled import kernel
from fecontact.core.lanes import functions
from fecontact.core.lanes.vectors import bits, chosen, mask_of, read, write
from fecontact.core.records import Matrix


@kernel
def exponentials(x: Matrix, out: Matrix) -> None:
    for i in range(len(x)):
        write(out[i], functions.exponential(read(x[i])))


@kernel
def logarithms(x: Matrix, out: Matrix) -> None:
    for i in range(len(x)):
        write(out[i], functions.logarithm(read(x[i])))


@kernel
def arctangents(x: Matrix, out: Matrix) -> None:
    for i in range(len(x)):
        write(out[i], functions.arctangent(read(x[i])))


@kernel
def tangents(x: Matrix, out: Matrix) -> None:
    for i in range(len(x)):
        write(out[i], functions.hyperbolic_tangent(read(x[i])))


@kernel
def fifth_roots(x: Matrix, out: Matrix) -> None:
    for i in range(len(x)):
        write(out[i], functions.reciprocal_fifth_root(read(x[i])))


@kernel
def sines(x: Matrix, sine: Matrix, cosine: Matrix) -> None:
    for i in range(len(x)):
        first, second = functions.sine_and_cosine(read(x[i]))
        write(sine[i], first)
        write(cosine[i], second)


@kernel
def both(x: Matrix, given: int) -> int:
    """Lanes above zero that are among the given ones; x becomes -1 in all others."""
    where = (read(x[0]) > 0.0) & mask_of(given)
    write(x[0], chosen(where, read(x[0]), -1.0))
    return bits(where)


RNG = np.random.default_rng(5)
_SIZES = np.sinh(RNG.uniform(-20.0, 20.0, 4096))


@pytest.mark.parametrize(("function", "wanted", "x", "places"), [
    (exponentials, np.exp, RNG.uniform(-700.0, 700.0, 4096), 2.0),
    (exponentials, np.exp, 1e-3 * RNG.normal(size=4096), 2.0),
    (logarithms, np.log, np.exp(RNG.uniform(-700.0, 700.0, 4096)), 3.0),
    (logarithms, np.log, np.exp(RNG.uniform(-1.0, 1.0, 4096)), 3.0),
    (arctangents, np.arctan, _SIZES, 2.5),
    (tangents, np.tanh, 1e-4 * _SIZES, 2.5),
    (fifth_roots, lambda x: x ** (-1.0 / np.longdouble(5.0)),
     np.exp(RNG.uniform(-30.0, 30.0, 4096)), 12.0),
])
def test_to_units_in_the_last_place(function, wanted, x, places):
    x = x.reshape(-1, 8)
    found = np.zeros_like(x)
    function(x, found)
    exact = wanted(x.astype(np.longdouble))
    assert (np.abs(found - exact) < places * np.spacing(np.abs(exact.astype(float)))).all()


@pytest.mark.parametrize("largest", [1.0, 1e3, 1e9])
def test_sine_and_cosine(largest):
    x = RNG.uniform(-largest, largest, (512, 8))
    sine, cosine = np.zeros((2, 512, 8))
    sines(x, sine, cosine)
    assert np.abs(sine - np.sin(x)).max() < 3e-16
    assert np.abs(cosine - np.cos(x)).max() < 3e-16


def test_far_arguments():
    x = np.array([[-1e4, 1e4, np.inf, -np.inf, 0.0, -0.0, 708.0, -708.0]])
    out = np.zeros_like(x)
    exponentials(x, out)
    assert out[0, 4:] == pytest.approx([1.0, 1.0, np.exp(708.0), np.exp(-708.0)], rel=1e-15)
    assert out[0, [0, 3]] == pytest.approx(np.exp(-708.0), rel=1e-15)
    assert out[0, 1:3] == pytest.approx(np.exp(708.0), rel=1e-15)
    tangents(x, out)
    assert out[0].tolist() == [-1.0, 1.0, 1.0, -1.0, 0.0, 0.0, 1.0, -1.0]
    arctangents(x, out)
    assert out[0] == pytest.approx(np.arctan(x[0]), rel=1e-15)


def test_masks():
    x = np.array([[1.0, -1.0, 2.0, np.nan, 3.0, 4.0, -5.0, 6.0]])
    assert both(x, 0b11110101) == 0b10110101
    assert x[0].tolist() == [1.0, -1.0, 2.0, -1.0, 3.0, 4.0, -1.0, 6.0]
