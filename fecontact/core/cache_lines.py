"""Arrays that begin where a line of the processor's cache does.

Vector instructions read up to a whole line at once. Of an array that begins elsewhere, as those of
numpy do, every other read needs two lines: loops over rows take some four percent longer, in one
process and not in the next.
"""

import math
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array

Stored = TypeVar("Stored", bound=NDArray[Any])

# Bytes of a line, and of an array so small that it may as well begin anywhere.
_LINE, FEW = 64, 512


def lines(length: int) -> int:
    """Length of the lines [bytes] that ``length`` bytes take."""
    return -(-length // _LINE) * _LINE


def zeros_in_lines(shape: int | tuple[int, ...], kind: Any = np.float64) -> Array:
    """Zeros of a shape from the begin of a line on.

    >>> zeros_in_lines((3, 2)).ctypes.data % 64
    0
    """
    size = (math.prod(shape) if isinstance(shape, tuple) else shape) * np.dtype(kind).itemsize
    room = np.zeros(size + _LINE, np.uint8)
    return np.ndarray(shape, kind, room, -room.__array_interface__["data"][0] % _LINE)


def in_lines(array: Stored) -> Stored:
    """Copy of an array from the begin of a line on, unless it is small.

    >>> in_lines(np.eye(2)).tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    if array.nbytes <= FEW:
        return array.copy()
    copy: Any = zeros_in_lines(array.shape, array.dtype)
    copy[...] = array
    return cast(Stored, copy)
