"""Inner product of the unknowns of a branch, with a weight for each."""

import math

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import Vector
from fecontact.core.types import Array


@kernel
def weighted_product(weights: Vector, a: Vector, b: Vector) -> float:
    """Sum w a b."""
    total = 0.0
    for k in range(len(a)):
        total += weights[k] * a[k] * b[k]
    return total


@kernel
def weighted_norm(weights: Vector, x: Vector) -> float:
    """Square root of sum w x x."""
    return math.sqrt(weighted_product(weights, x, x))


def unit(size: int, place: int = -1) -> Array:
    """Row (size,) of one unknown, by default of the last one, the parameter."""
    row = np.zeros(size)
    row[place] = 1.0
    return row
