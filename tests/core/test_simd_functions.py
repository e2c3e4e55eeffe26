"""Elementary functions of eight numbers at once, against those of the C library."""

import math

import numpy as np
import pytest

from fecontact.core.compiled import kernel
from fecontact.core.records import Block, Matrix
from fecontact.core.simd import functions
from fecontact.core.simd.vectors import bits, mask_of, read, select, write


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
    write(x[0], select(where, read(x[0]), -1.0))
    return bits(where)


@kernel
def of_python(x: Matrix, y: Matrix, out: Block) -> None:
    """Functions that laws use, one a row of ``out``."""
    for i in range(len(x)):
        a, b = read(x[i]), read(y[i])
        write(out[0, i], math.exp(a))
        write(out[1, i], math.log(a))
        write(out[2, i], math.sqrt(a))
        write(out[3, i], math.atan(a))
        write(out[4, i], math.tanh(a))
        write(out[5, i], abs(a))
        write(out[6, i], min(a, b))
        write(out[7, i], max(a, b))
        write(out[8, i], a**b)
        write(out[9, i], a**3)
        write(out[10, i], a**-2)
        write(out[11, i], a**2.0)
        write(out[12, i], functions.select(a > b, a, 1.0))


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


def test_functions_of_python_take_eight_numbers():
    special = [0.0, -0.0, 1.0, -1.0, 0.5, -2.0, 3.0, np.inf, -np.inf, np.nan, 1e-310, 1e300]
    x, y = (part.ravel() for part in np.meshgrid(special, [-3.0, -1.5, 0.0, 0.5, 1.0, 2.0, 3.0]))
    more = RNG.normal(size=(2, 4))
    x, y = (np.concatenate(pair).reshape(-1, 8) for pair in zip((x, y), more, strict=True))
    out = np.zeros((13, *x.shape))
    of_python(x, y, out)
    with np.errstate(all="ignore"):
        wanted = [np.exp(x), np.log(x), np.sqrt(x), np.arctan(x), np.tanh(x), np.abs(x),
                  np.where(y < x, y, x), np.where(y > x, y, x), x**y, x**3, x**-2.0, x**2.0,
                  np.where(x > y, x, 1.0)]
    # Exponentials end at 708, before they overflow. Powers of numbers below the smallest normal
    # one, of negative zero and infinity are those of zero and infinity.
    wanted[0] = np.clip(wanted[0], np.exp(-708.0), np.exp(708.0))
    extreme = (x == 0.0) | np.isinf(x)
    usual = ~(((x == 1e-310) | np.isnan(x)) & (y != 0.0) | np.isnan(x) | extreme & np.signbit(x))
    for row, exact in enumerate(wanted):
        # A power x^y is exp(y log x), with the rounding of its exponent of up to 700.
        np.testing.assert_allclose(out[row][usual], exact[usual], rtol=2e-13 if row == 8 else 2e-15,
                                   err_msg=str(row))
