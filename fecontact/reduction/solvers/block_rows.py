"""Products of block-sparse matrices with many vectors at once, in threads.

Vectors are (N, d, k): d displacements at N nodes, k vectors side by side, so that each block of a
matrix is read once for all of them. Libraries multiply matrices of small blocks one entry at a
time, which is four times slower.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import types

from fecontact.core.compiled import kernel
from fecontact.core.types import Array, Integers


def _product(first, last, indptr, indices, blocks, x, y):
    """Rows first ... last of y = A x, blocks of 3 x 3."""
    width = x.shape[2]
    for i in range(first, last):
        for c in range(width):
            y[i, 0, c] = 0.0
            y[i, 1, c] = 0.0
            y[i, 2, c] = 0.0
        for s in range(indptr[i], indptr[i + 1]):
            j = indices[s]
            a00, a01, a02 = blocks[s, 0, 0], blocks[s, 0, 1], blocks[s, 0, 2]
            a10, a11, a12 = blocks[s, 1, 0], blocks[s, 1, 1], blocks[s, 1, 2]
            a20, a21, a22 = blocks[s, 2, 0], blocks[s, 2, 1], blocks[s, 2, 2]
            for c in range(width):
                u, v, w = x[j, 0, c], x[j, 1, c], x[j, 2, c]
                y[i, 0, c] += a00 * u + a01 * v + a02 * w
                y[i, 1, c] += a10 * u + a11 * v + a12 * w
                y[i, 2, c] += a20 * u + a21 * v + a22 * w


def _scalar_product(first, last, indptr, indices, data, x, y):
    """Rows first ... last of y = A x, for numbers that act on each of the three components."""
    width = x.shape[2]
    for i in range(first, last):
        y[i] = 0.0
        for s in range(indptr[i], indptr[i + 1]):
            j, a = indices[s], data[s]
            for p in range(3):
                for c in range(width):
                    y[i, p, c] += a * x[j, p, c]


def _diagonal_product(first, last, blocks, x, y):
    """Rows first ... last of y = D x for a diagonal D of 3 x 3 blocks (N, 3, 3)."""
    for i in range(first, last):
        for p in range(3):
            a, b, d = blocks[i, p, 0], blocks[i, p, 1], blocks[i, p, 2]
            for c in range(x.shape[2]):
                y[i, p, c] = a * x[i, 0, c] + b * x[i, 1, c] + d * x[i, 2, c]


def _smoothing(first, last, indptr, indices, blocks, inverse, step, factors, residual, x,
               following):
    """One Chebyshev step of A x = b over its block diagonal D, without temporary vectors.

    ``residual -= A step``, ``following = factors[0] step + factors[1] D^-1 residual`` and
    ``x += following``; ``inverse`` (N, 3, 3) are the blocks of D^-1.
    """
    width = x.shape[2]
    for i in range(first, last):
        for s in range(indptr[i], indptr[i + 1]):
            j = indices[s]
            a00, a01, a02 = blocks[s, 0, 0], blocks[s, 0, 1], blocks[s, 0, 2]
            a10, a11, a12 = blocks[s, 1, 0], blocks[s, 1, 1], blocks[s, 1, 2]
            a20, a21, a22 = blocks[s, 2, 0], blocks[s, 2, 1], blocks[s, 2, 2]
            for c in range(width):
                u, v, w = step[j, 0, c], step[j, 1, c], step[j, 2, c]
                residual[i, 0, c] -= a00 * u + a01 * v + a02 * w
                residual[i, 1, c] -= a10 * u + a11 * v + a12 * w
                residual[i, 2, c] -= a20 * u + a21 * v + a22 * w
        for p in range(3):
            d0, d1, d2 = inverse[i, p, 0], inverse[i, p, 1], inverse[i, p, 2]
            for c in range(width):
                change = factors[0] * step[i, p, c] + factors[1] * (
                    d0 * residual[i, 0, c] + d1 * residual[i, 1, c] + d2 * residual[i, 2, c])
                following[i, p, c] = change
                x[i, p, c] += change


def _step_on(first, last, step, direction, pushed, x, residual):
    """Rows first ... last of ``x += step direction`` and ``residual -= step pushed``."""
    for i in range(first, last):
        for c in range(len(step)):
            x[i, c] += step[c] * direction[i, c]
            residual[i, c] -= step[c] * pushed[i, c]


def _turn_to(first, last, ratio, z, direction):
    """Rows first ... last of ``direction = z + ratio direction``."""
    for i in range(first, last):
        for c in range(len(ratio)):
            direction[i, c] = z[i, c] + ratio[c] * direction[i, c]


def _compiled(function: Any, *arrays: tuple[int, bool]) -> dict[Any, Any]:
    """One kernel for single and one for double precision; arrays are (dimensions, whole)."""
    found = {}
    for name, kind in (("float32", types.float32), ("float64", types.float64)):
        given = [types.Array(kind if numbers else types.int32, n, "C") for n, numbers in arrays]
        signature = types.void(types.int64, types.int64, *given)
        found[np.dtype(name)] = kernel(function, signature=signature, nogil=True)
    return found


_products = _compiled(_product, (1, False), (1, False), (3, True), (3, True), (3, True))
_scalar_products = _compiled(_scalar_product, (1, False), (1, False), (1, True), (3, True),
                             (3, True))
_diagonal_products = _compiled(_diagonal_product, (3, True), (3, True), (3, True))
_smoothings = _compiled(_smoothing, (1, False), (1, False), (3, True), (3, True), (3, True),
                        (1, True), (3, True), (3, True), (3, True))

_steps_on = _compiled(_step_on, (1, True), (2, True), (2, True), (2, True), (2, True))
_turns_to = _compiled(_turn_to, (1, True), (2, True), (2, True))

# Rows that one thread does at a time, and fewer than which are not worth threads.
_ROWS = 4096


def _in_parts(kernel: Any, rows: int, *arrays: Any) -> None:
    threads = os.cpu_count() or 1
    if rows < 2 * _ROWS or threads == 1:
        kernel(0, rows, *arrays)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(lambda first: kernel(first, min(first + _ROWS, rows), *arrays),
                          range(0, rows, _ROWS)):
            pass


@dataclass(frozen=True, eq=False)
class BlockRows:
    """A matrix by rows of 3 x 3 blocks (e, 3, 3), or of numbers (e,) for each component."""

    indptr: Integers
    indices: Integers
    blocks: Any

    @classmethod
    def of(cls, matrix: Any, dtype: Any = np.float64) -> "BlockRows":
        """A scipy BSR array of 3 x 3 blocks, or a CSR array that acts on each component."""
        return cls(matrix.indptr.astype(np.int32, copy=False),
                   matrix.indices.astype(np.int32, copy=False),
                   np.ascontiguousarray(matrix.data, dtype=dtype))

    def single(self) -> "BlockRows":
        """Copy of the matrix in single precision."""
        return BlockRows(self.indptr, self.indices, self.blocks.astype(np.float32))

    def product(self, x: Any) -> Any:
        """A x (N, 3, k) of vectors of the matrix's precision."""
        rows = len(self.indptr) - 1
        y = np.empty((rows, *x.shape[1:]), dtype=x.dtype)
        kernels = _products if self.blocks.ndim == 3 else _scalar_products
        _in_parts(kernels[self.blocks.dtype], rows, self.indptr, self.indices,
                  self.blocks, x, y)
        return y

    def smooth(
        self, inverse: Any, step: Any, own: float, new: float, residual: Any, x: Any
    ) -> Any:
        """One Chebyshev step: residual -= A step, x += following, which is returned.

        following = own step + new D^-1 residual, D^-1 by blocks (N, 3, 3).
        """
        following = np.empty_like(x)
        factors = np.array([own, new], dtype=x.dtype)
        _in_parts(_smoothings[self.blocks.dtype], len(self.indptr) - 1, self.indptr, self.indices,
                  self.blocks, inverse, step, factors, residual, x, following)
        return following


def diagonal_product(blocks: Any, x: Any) -> Any:
    """D x (N, 3, k) with the blocks (N, 3, 3) of a block diagonal."""
    y = np.empty_like(x)
    _in_parts(_diagonal_products[blocks.dtype], len(blocks), blocks, x, y)
    return y


def step_on(step: Array, direction: Array, pushed: Array, x: Array, residual: Array) -> None:
    """``x += step direction`` and ``residual -= step pushed`` of vectors (n, k), step (k,)."""
    _in_parts(_steps_on[x.dtype], len(x), step.astype(x.dtype), direction, pushed, x, residual)


def turn_to(ratio: Array, z: Array, direction: Array) -> None:
    """``direction = z + ratio direction`` of vectors (n, k), ratio (k,)."""
    _in_parts(_turns_to[z.dtype], len(z), ratio.astype(z.dtype), z, direction)
