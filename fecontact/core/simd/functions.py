"""Functions that take one number or eight, so that a kernel is written once for both.

``math.exp``, ``log``, ``sqrt``, ``atan``, ``tanh``, ``abs``, ``min``, ``max`` and powers take eight
numbers too, and a float beside eight numbers counts as eight equal ones. What replaces branches,
which SIMD lanes share, is in :mod:`fecontact.core.simd.vectors`: ``select`` chooses a value;
``somewhere`` and ``everywhere`` guard work that no lane needs.

Functions of the C library take one number at a time, and a vector library that numba would use is
not part of its wheels. The elementary functions of eight numbers here reduce the argument to a
short interval, on which a polynomial or a ratio of two is accurate to a few units in the last
place; the coefficients of arctan and tanh are from S. L. Moshier's Cephes library.
"""

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from fecontact.core.compiled import OVERLOAD, helper
from fecontact.core.records import is_eight
from fecontact.core.simd.kinds import lanes
from fecontact.core.simd.vectors import (
    _code,
    exponent,
    fused,
    scaled,
    select,
    signed,
    spread,
    whole,
)

_PER_OCTAVE = 1.0 / math.log(2.0)
# The logarithm of two, and a quarter turn, in two parts whose sum has twice the digits.
_OCTAVE = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_QUARTER = 1.5707963267948966, 6.123233995736766e-17
_LARGEST = 708.0

_E = [1.0 / math.factorial(k) for k in range(14)]
_S = [(-1.0) ** k / math.factorial(2 * k + 1) for k in range(9)]
_C = [(-1.0) ** k / math.factorial(2 * k) for k in range(9)]
_E2, _E3, _E4, _E5, _E6, _E7, _E8, _E9, _E10, _E11, _E12, _E13 = _E[2:]
_S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8 = _S[1:]
_C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8 = _C[1:]


@helper
def exponential(x):
    """e^x; beyond +-708 as there."""
    x = select(x > _LARGEST, _LARGEST, select(x < -_LARGEST, -_LARGEST, x))
    power = whole(x * _PER_OCTAVE + 0.5)
    r = fused(power, spread(-_OCTAVE[1]), fused(power, spread(-_OCTAVE[0]), x))
    r2 = r * r
    r4 = r2 * r2
    low = (r + 1.0) + (r * _E3 + _E2) * r2
    middle = (r * _E5 + _E4) + (r * _E7 + _E6) * r2
    high = (r * _E9 + _E8) + (r * _E11 + _E10) * r2
    top = r * _E13 + _E12
    return scaled(low + r4 * (middle + r4 * (high + r4 * top)), power)


@helper
def logarithm(x):
    """The natural logarithm of normal x above zero."""
    power = exponent(x)
    part = scaled(x, -power)
    above = part > 1.4142135623730951
    part = select(above, part * 0.5, part)
    power = select(above, power + 1.0, power)
    # log(part) = 2 artanh(z), |z| < 0.172.
    z = (part - 1.0) / (part + 1.0)
    y = z * z
    series = spread(1.0 / 21.0)
    series = series * y + 1.0 / 19.0
    series = series * y + 1.0 / 17.0
    series = series * y + 1.0 / 15.0
    series = series * y + 1.0 / 13.0
    series = series * y + 1.0 / 11.0
    series = series * y + 1.0 / 9.0
    series = series * y + 1.0 / 7.0
    series = series * y + 1.0 / 5.0
    series = series * y + 1.0 / 3.0
    small = 2.0 * z + 2.0 * z * y * series
    return power * _OCTAVE[0] + (small + power * _OCTAVE[1])


@helper
def sine_and_cosine(x):
    """Sine and cosine of angles up to 1e9."""
    quarters = whole(x * (2.0 / math.pi) + 0.5)
    r = fused(quarters, spread(-_QUARTER[1]), fused(quarters, spread(-_QUARTER[0]), x))
    y = r * r
    y2 = y * y
    y4 = y2 * y2
    sine = r + r * y * ((_S1 + y * _S2) + y2 * (_S3 + y * _S4)
                        + y4 * ((_S5 + y * _S6) + y2 * (_S7 + y * _S8)))
    cosine = 1.0 + y * ((-0.5 + y * _C2) + y2 * (_C3 + y * _C4)
                        + y4 * ((_C5 + y * _C6) + y2 * (_C7 + y * _C8)))
    # Of the quarter turns modulo four: odd ones exchange both, two of them change signs.
    half = quarters * 0.5
    odd = half - whole(half) > 0.25
    part = quarters * 0.25
    turn = part - whole(part)
    first, second = select(odd, cosine, sine), select(odd, sine, cosine)
    return (select(turn > 0.375, -first, first),
            select((turn > 0.125) & (turn < 0.625), -second, second))


@helper
def arctangent(x):
    """Arctangent [rad]."""
    size = abs(x)
    far, middle = size > 2.414213562373095, size > 0.66
    above = select(far, -1.0, select(middle, size - 1.0, size))
    below = select(far, size, select(middle, size + 1.0, spread(1.0)))
    r = above / below
    z = r * r
    p = spread(-8.750608600031904122785e-1)
    p = p * z - 1.615753718733365076637e1
    p = p * z - 7.500855792314704667340e1
    p = p * z - 1.228866684490136173410e2
    p = p * z - 6.485021904942025371773e1
    q = z + 2.485846490142306297962e1
    q = q * z + 1.650270098316988542046e2
    q = q * z + 4.328810604912902668951e2
    q = q * z + 4.853903996359136964868e2
    q = q * z + 1.945506571482613964425e2
    base = select(far, _QUARTER[0], select(middle, 0.5 * _QUARTER[0], spread(0.0)))
    rest = select(far, _QUARTER[1], select(middle, 0.5 * _QUARTER[1], spread(0.0)))
    return signed(base + (r + (r * z * (p / q) + rest)), x)


@helper
def hyperbolic_tangent(x):
    """Hyperbolic tangent."""
    size = abs(x)
    z = x * x
    p = spread(-9.64399179425052238628e-1)
    p = p * z - 9.92877231001918586564e1
    p = p * z - 1.61468768441708447952e3
    q = z + 1.12811678491632931402e2
    q = q * z + 2.23548839060100448583e3
    q = q * z + 4.84406305325125486048e3
    near = x + x * z * (p / q)
    far = 1.0 - 2.0 / (exponential(2.0 * size) + 1.0)
    return select(size < 0.625, near, signed(far, x))


@helper
def reciprocal_fifth_root(x):
    """x^(-1/5) of normal x above zero."""
    return exponential(-0.2 * logarithm(x))


def by_kind(one: Callable[..., Any], eight: Callable[..., Any]) -> Callable[..., Any]:
    """A function for kernels that calls ``eight`` where an argument is eight numbers, else ``one``.

    Arguments may be arrays and records of eight numbers too.
    """

    def function(*given):
        return one(*given)

    def typed(*given):
        if any(map(is_eight, given)):
            return lambda *given: eight(*given)
        return lambda *given: one(*given)

    overload(function, jit_options=OVERLOAD)(typed)
    return function


@helper
def _zero(numbers):
    return 0.0


@helper
def _eight_zeros(numbers):
    return spread(0.0)


# Zero of the kind of some numbers: where tuples are made of sums, these begin with it, since numba
# does not turn tuples of numbers into those of eight each.
zero_of = by_kind(_zero, _eight_zeros)


@helper
def _logarithm(x):
    """The natural logarithm; of zero -inf, below NaN."""
    small = x < 1e-290
    found = logarithm(select(small, x * 2.0**100, x)) - select(small, 100.0 * math.log(2.0), 0.0)
    found = select(x > 0.0, found, select(x == 0.0, -np.inf, np.nan))
    return select(x < np.inf, found, x)


@helper
def _power(x, exponent):
    """x^exponent; of x below zero for whole exponents, else NaN."""
    size = abs(x)
    usual = (size > 1e-290) & (size < np.inf)
    log = exponent * logarithm(select(usual, size, 1.0))
    power = select(log > 709.78, np.inf, select(log < -708.0, 0.0, exponential(log)))
    grows = ((exponent > 0.0) & (size > 1.0)) | ((exponent < 0.0) & (size < 1.0))
    extreme = select(exponent == 0.0, 1.0, select(grows, np.inf, spread(0.0)))
    power = select(size == size, select(usual, power, extreme), x)
    half = exponent * 0.5
    signed_power = select(whole(half) == half, power, -power)
    of_negative = select(whole(exponent) == exponent, signed_power, np.nan)
    return select(x < 0.0, of_negative, power)


@helper
def _whole_power(x, exponent):
    factor, rest, power = x, abs(exponent), spread(1.0)
    while rest > 0:
        if rest & 1:
            power = power * factor
        factor = factor * factor
        rest >>= 1
    return power if exponent >= 0 else 1.0 / power


@overload(operator.pow, jit_options=OVERLOAD)
def _typed_power(a, b):
    if a != lanes:
        return None
    if isinstance(b, types.Integer):
        return lambda a, b: _whole_power(a, b)
    if b == types.float64:
        return lambda a, b: _power(a, spread(b))
    return (lambda a, b: _power(a, b)) if b == lanes else None


def _for_eight(function: Any, eight: Any) -> None:
    """Let a function of one number, as Python has it, take eight."""
    overload(function, jit_options=OVERLOAD)(
        lambda x: (lambda x: eight(x)) if x == lanes else None)


for _of_one, _of_eight in (
        (math.exp, exponential), (math.log, _logarithm), (math.atan, arctangent),
        (math.tanh, hyperbolic_tangent)):
    _for_eight(_of_one, _of_eight)
copysign = by_kind(math.copysign, signed)


@intrinsic
def lane_of(typingctx: Any, numbers: Any, lane: Any) -> Any:
    """One of eight numbers."""
    return types.float64(lanes, types.int64), _code(ir.IRBuilder.extract_element)


@intrinsic
def with_lane(typingctx: Any, numbers: Any, lane: Any, number: Any) -> Any:
    """Eight numbers, one of which is replaced."""
    return lanes(lanes, types.int64, types.float64), _code(
        lambda builder, numbers, lane, number: builder.insert_element(numbers, number, lane))


@intrinsic
def in_lane(typingctx: Any, numbers: Any, lane: Any) -> Any:
    """One lane of an array of eight numbers each: an array of numbers that shares its memory."""
    kind = types.Array(types.float64, numbers.ndim, "A")

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        given = context.make_array(numbers)(context, builder, args[0])
        found = context.make_array(kind)(context, builder)
        for name in ("meminfo", "parent", "nitems", "shape", "strides"):
            setattr(found, name, getattr(given, name))
        found.itemsize = context.get_constant(types.intp, 8)
        first = builder.bitcast(given.data, ir.DoubleType().as_pointer())
        found.data = builder.gep(first, [args[1]])
        return found._getvalue()

    return kind(numbers, types.int64), codegen


@intrinsic
def at_unknown_place(typingctx: Any, numbers: Any) -> Any:
    """An array of eight numbers each, read from a place that the compiler does not know.

    What replaces some lanes of a place by others of the same place would become a masked store,
    which takes ten times as long as a whole one on many processors.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(numbers)(context, builder, args[0])
        kind = array.data.type
        array.data = builder.asm(ir.FunctionType(kind, [kind]), "", "=r,0", [array.data], False)
        return array._getvalue()

    return numbers(numbers), codegen
