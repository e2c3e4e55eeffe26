"""Internal variables of friction with memory, on the samples of a period.

Their rates have kinks, of which a few harmonics know nothing: they are unknowns at the N samples
instead, by backward differences of second order around the period,

    (3 z_n - 4 z_(n-1) + z_(n-2)) N / (2 T) = g(x_n, z_n),

and are eliminated from the linearised equations of the harmonics node by node.
"""

import numpy as np
from numba import types

from fecontact.core.compiled import block, borrowed, f8, kernel
from fecontact.core.dense_lu import factorise, solve_rows
from fecontact.core.types import Array

_nodes = types.Array(f8, 4, "C")


def differences(z: Array) -> Array:
    """Derivatives (N, c) with respect to tau of samples (N, c) of a periodic function."""
    N = len(z)
    found: Array = N * (1.5 * z - 2.0 * np.roll(z, 1, axis=0) + 0.5 * np.roll(z, 2, axis=0))
    return found


@kernel(types.void(_nodes, f8, block))
def solve_around(slopes, T, x):
    """Replace right sides x (N, n s, columns) by the solutions z of D z / T - g_z z = x.

    ``slopes`` (N, n, s, s) holds the derivatives g_z of each of n nodes with s variables. The last
    two samples are guessed as zero first; what this leaves around the period is the solution of
    2 s equations, since solutions of the homogeneous equations combine.
    """
    slopes, x = borrowed(slopes), borrowed(x)
    N, n, s, _ = slopes.shape
    columns = x.shape[2]
    rate = N / T
    wide = columns + 2 * s
    a, pivots = np.empty((s, s)), np.empty(s, dtype=np.int64)
    z = np.empty((N, s, wide))
    ring, ring_pivots = np.empty((2 * s, 2 * s)), np.empty(2 * s, dtype=np.int64)
    given = np.empty((2 * s, columns))
    for node in range(n):
        for place in range(N):
            for i in range(s):
                for k in range(s):
                    a[i, k] = -slopes[place, node, i, k]
                a[i, i] += 1.5 * rate
                for c in range(wide):
                    value = x[place, node * s + i, c] if c < columns else 0.0
                    # Columns beyond the right sides: unit values of the last two samples.
                    one = z[place - 1, i, c] if place > 0 else (
                        1.0 if c == columns + i else 0.0)
                    two = z[place - 2, i, c] if place > 1 else (
                        (1.0 if c == columns + i else 0.0) if place == 1 else (
                            1.0 if c == columns + s + i else 0.0))
                    z[place, i, c] = value + rate * (2.0 * one - 0.5 * two)
            factorise(a, s, pivots)
            solve_rows(a, pivots, z[place])
        for last in range(2):
            for i in range(s):
                for k in range(2 * s):
                    ring[last * s + i, k] = -z[N - 1 - last, i, columns + k]
                ring[last * s + i, last * s + i] += 1.0
                for c in range(columns):
                    given[last * s + i, c] = z[N - 1 - last, i, c]
        factorise(ring, 2 * s, ring_pivots)
        solve_rows(ring, ring_pivots, given)
        for place in range(N):
            for i in range(s):
                for c in range(columns):
                    value = z[place, i, c]
                    for k in range(2 * s):
                        value += z[place, i, columns + k] * given[k, c]
                    x[place, node * s + i, c] = value
