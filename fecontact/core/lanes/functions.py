"""Elementary functions of eight numbers at once, to a few units in the last place.

Those of the C library take one number at a time, and a vector library that numba would use is
not part of its wheels. Arguments are brought to a short interval, on which a polynomial or a ratio
of two serves; those of arctan and tanh are from S. L. Moshier's Cephes library.
"""

import math

from fecontact.core.compiled import helper
from fecontact.core.lanes.vectors import (
    chosen,
    exponent,
    fused,
    magnitude,
    root,
    scaled,
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
    x = chosen(x > _LARGEST, _LARGEST, chosen(x < -_LARGEST, -_LARGEST, x))
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
    part = chosen(above, part * 0.5, part)
    power = chosen(above, power + 1.0, power)
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
    """Both, of angles up to 1e9."""
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
    first, second = chosen(odd, cosine, sine), chosen(odd, sine, cosine)
    return (chosen(turn > 0.375, -first, first),
            chosen((turn > 0.125) & (turn < 0.625), -second, second))


@helper
def arctangent(x):
    """Arctangent [rad]."""
    size = magnitude(x)
    far, middle = size > 2.414213562373095, size > 0.66
    above = chosen(far, -1.0, chosen(middle, size - 1.0, size))
    below = chosen(far, size, chosen(middle, size + 1.0, spread(1.0)))
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
    base = chosen(far, _QUARTER[0], chosen(middle, 0.5 * _QUARTER[0], spread(0.0)))
    rest = chosen(far, _QUARTER[1], chosen(middle, 0.5 * _QUARTER[1], spread(0.0)))
    return signed(base + (r + (r * z * (p / q) + rest)), x)


@helper
def hyperbolic_tangent(x):
    """Hyperbolic tangent."""
    size = magnitude(x)
    z = x * x
    p = spread(-9.64399179425052238628e-1)
    p = p * z - 9.92877231001918586564e1
    p = p * z - 1.61468768441708447952e3
    q = z + 1.12811678491632931402e2
    q = q * z + 2.23548839060100448583e3
    q = q * z + 4.84406305325125486048e3
    near = x + x * z * (p / q)
    far = 1.0 - 2.0 / (exponential(2.0 * size) + 1.0)
    return chosen(size < 0.625, near, signed(far, x))


@helper
def reciprocal_fifth_root(x):
    """x^(-1/5) of normal x above zero."""
    return exponential(-0.2 * logarithm(x))


@helper
def reciprocal_root(x):
    """1 / sqrt(x)."""
    return 1.0 / root(x)
