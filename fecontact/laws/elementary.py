"""Arctangent and sine of one number or eight, for laws that integrators call millions of times.

They become part of the law, while those of the C library are called, which costs as much again as
the law itself. Functions of eight numbers are in :mod:`fecontact.core.simd.functions`; branches
are faster for one. Arguments are brought to a short interval, on which a polynomial serves; its
coefficients and intervals are those of the freely distributable library of Sun Microsystems
(fdlibm). Results are right to two units in the last place of the largest value that they can have.
"""

import math

from fecontact.core.compiled import helper
from fecontact.core.kernel_parts import part
from fecontact.core.simd import functions
from fecontact.core.simd.functions import by_kind

# A quarter turn in three parts, the first two of 33 bits, so that multiples of them are exact.
_QUARTER = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_LARGEST_ANGLE = 1e6


@helper
def _arctangent(x):
    size = abs(x)
    if size >= 2.4375:
        base, r = 1.57079632679489655800, -1.0 / size
    elif size < 0.4375:
        base, r = 0.0, size
    elif size < 0.6875:
        base, r = 4.63647609000806093515e-01, (2.0 * size - 1.0) / (2.0 + size)
    elif size < 1.1875:
        base, r = 7.85398163397448278999e-01, (size - 1.0) / (size + 1.0)
    else:
        base, r = 9.82793723247329054082e-01, (size - 1.5) / (1.0 + 1.5 * size)
    z = r * r
    w = z * z
    odd = z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (
        9.09088713343650656196e-02 + w * (6.66107313738753120669e-02 + w * (
            4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))))
    even = w * (-1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * (
        -7.69187620504482999495e-02 + w * (
            -5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))))
    return math.copysign(base + (r - r * (odd + even)), x)


# Arctangent of x [rad].
arctangent = by_kind(_arctangent, functions.arctangent)


def _reduced(x):
    """The nearest number of quarter turns, and what is left of the angle."""
    quarters = math.floor(x * (2.0 / math.pi) + 0.5)
    return quarters, ((x - quarters * _QUARTER[0]) - quarters * _QUARTER[1]) - (
        quarters * _QUARTER[2])


# Sums of this function must not be reordered.
_reduced = part(_reduced, error_model="numpy", fastmath=False, forceinline=True)


@helper
def _sine_and_cosine(x):
    if not abs(x) < _LARGEST_ANGLE:
        return math.sin(x), math.cos(x)
    quarters, r = _reduced(x)
    z = r * r
    sine = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * (
            -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))))
    cosine = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * (
        -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * (
            -2.75573143513906633035e-07 + z * (
                2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))))
    turn = int(quarters) & 3
    first, second = (cosine, sine) if turn & 1 else (sine, cosine)
    return -first if turn & 2 else first, -second if (turn + 1) & 2 else second


# Sine and cosine of an angle x [rad].
sine_and_cosine = by_kind(_sine_and_cosine, functions.sine_and_cosine)
