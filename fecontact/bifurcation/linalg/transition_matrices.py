"""Transition matrices of an orbit from one interval to the next."""

import math

import numpy as np

from fecontact.bifurcation.linalg.condensation import CondensedFactors
from fecontact.core.compiled import kernel
from fecontact.core.copies import put_rows
from fecontact.core.dense_lu import factorise, solve_rows
from fecontact.core.records import Block


@kernel
def transitions(factors: CondensedFactors, out: Block) -> None:
    """Fill out (N, d, d) with the M_j of the condensed intervals, x_(j+1) = M_j x_j."""
    local = factors.local
    N, d, _ = out.shape
    a, pivots = np.empty((d, d)), np.empty(d, dtype=np.int64)
    for j in range(N):
        for i in range(d):
            for c in range(d):
                a[i, c] = local[j, i, d + c]
                out[j, i, c] = -local[j, i, c]
        factorise(a, d, pivots)
        solve_rows(a, pivots, out[j])


@kernel
def condense_products(M: Block) -> int:
    """Multiply neighbours of M (N, d, d) in place as long as no digits are lost.

    A product ends before the bound of its condition number exceeds 100. Returns the number of
    products.
    """
    N, d, _ = M.shape
    a, inverse, total = np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    pivots = np.empty(d, dtype=np.int64)
    count, bound = 0, 1.0
    for j in range(N):
        square = 0.0
        for i in range(d):
            for c in range(d):
                a[i, c] = M[j, i, c]
                inverse[i, c] = 1.0 if i == c else 0.0
                square += M[j, i, c] ** 2
        factorise(a, d, pivots)
        solve_rows(a, pivots, inverse)
        reverse = 0.0
        for i in range(d):
            for c in range(d):
                reverse += inverse[i, c] ** 2
        condition = math.sqrt(square * reverse) / d
        bound *= condition
        if count > 0 and bound < 100.0:
            for i in range(d):
                for c in range(d):
                    value = 0.0
                    for k in range(d):
                        value += M[j, i, k] * M[count - 1, k, c]
                    total[i, c] = value
            put_rows(total, M[count - 1])
        else:
            if j > count:
                put_rows(M[j], M[count])
            count += 1
            bound = condition
    return count
