"""Scales that keep squares of large numbers finite."""

from typing import Any

import numpy as np


def magnitude(values: Any) -> float:
    """Largest power of two that does not exceed the maximum of the absolute values.

    Division by it is exact. 1.0 if all values are zero, or if one of them is not finite.
    """
    largest = float(np.abs(values).max(initial=0.0))
    if not 0.0 < largest < np.inf:
        return 1.0
    return float(np.ldexp(1.0, int(np.frexp(largest)[1]) - 1))
