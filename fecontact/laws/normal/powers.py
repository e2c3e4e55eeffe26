"""Powers of the penetration, for normal laws."""

import math

from fecontact.core.compiled import helper
from fecontact.core.simd.vectors import everywhere, select


@helper
def lower_power(x, exponent):
    """x^(exponent - 1) of x >= 0; exponents 1, 3/2 and 2 are much faster than others."""
    by_root, flat, usual = exponent == 1.5, exponent == 1.0, exponent == 2.0
    usual = usual | by_root | flat
    power = select(by_root, math.sqrt(x), select(flat, 1.0, x))
    if not everywhere(usual):
        power = select(usual, power, x ** (exponent - 1.0))
    return power
