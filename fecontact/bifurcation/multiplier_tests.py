"""Test functions of special points of orbits, from the multipliers."""

import numpy as np
from numba import types

from fecontact.compiled import i8, kernel, vector

_complex_vector = types.Array(types.complex128, 1, "C")


@kernel(types.void(_complex_vector, i8, vector))
def multiplier_tests(mu, trivial, out):  # type: ignore[no-untyped-def]
    """Fill out (3,) with the products of mu + 1, mu - 1 and, over pairs, mu_i mu_k - 1, scaled.

    Without the multiplier ``trivial``, if it is not negative. They change sign where a multiplier
    passes -1, where one passes 1, and where a complex pair passes the unit circle.
    """
    minus, plus, pairs = 1.0 + 0.0j, 1.0 + 0.0j, 1.0 + 0.0j
    for i in range(len(mu)):
        if i == trivial:
            continue
        size = 1.0 + abs(mu[i])
        minus *= (mu[i] + 1.0) / size
        plus *= (mu[i] - 1.0) / size
        for k in range(i + 1, len(mu)):
            if k == trivial:
                continue
            both = mu[i] * mu[k]
            if abs(both) < np.inf:
                pairs *= (both - 1.0) / (abs(both) + 1.0)
    out[0], out[1], out[2] = minus.real, plus.real, pairs.real
