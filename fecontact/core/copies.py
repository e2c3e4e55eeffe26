"""Copies of arrays in kernels.

Numba's assignment of one array to another checks shapes, and compiles texts for when they differ.
"""

from fecontact.core.compiled import helper


@helper
def put(values, out):
    """Copy the numbers of an array (n,) into another."""
    for k in range(len(out)):
        out[k] = values[k]


@helper
def put_rows(values, out):
    """Copy the numbers of an array (n, k) into another."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            out[row, column] = values[row, column]
