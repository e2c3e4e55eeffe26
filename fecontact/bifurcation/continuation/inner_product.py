"""Inner product of the unknowns of a branch, with a weight for each."""

import math

from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Vector


@helper
def _product(weights, a, b):
    total = 0.0
    for k in range(len(a)):
        total += weights[k] * a[k] * b[k]
    return total


@kernel
def weighted_product(weights: Vector, a: Vector, b: Vector) -> float:
    """Sum w a b."""
    return _product(weights, a, b)


@kernel
def weighted_norm(weights: Vector, x: Vector) -> float:
    """Square root of sum w x x."""
    return math.sqrt(_product(weights, x, x))
