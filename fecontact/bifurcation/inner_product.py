"""The inner product of continuation, compiled."""

import math

from fecontact.compiled import f8, kernel, vector


@kernel(f8(vector, vector))
def weighted_norm(weights, x):  # type: ignore[no-untyped-def]
    """Square root of sum w x x."""
    total = 0.0
    for k in range(len(x)):
        total += weights[k] * x[k] * x[k]
    return math.sqrt(total)
