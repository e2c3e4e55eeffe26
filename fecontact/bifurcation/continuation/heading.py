"""Direction in which another branch leaves a special point."""

import numpy as np

from fecontact.core.ties import first_largest
from fecontact.core.types import Array

# Part of a unit tangent along the parameter below which the parameter rests, as it does where a
# fork begins.
_RESTS = 1e-2


def heading(tangent: Array, weights: Array) -> Array:
    """The tangent (N + 1,), made of length one and turned so that the parameter grows.

    Null vectors of singular equations have any sign. Where the parameter, the last unknown, rests,
    the largest of the other unknowns grows, in the lengths of the weights (N + 1,).
    """
    lengths = np.sqrt(weights) * tangent
    size = float(np.linalg.norm(lengths))
    place = -1 if abs(lengths[-1]) > _RESTS * size else first_largest(np.abs(lengths[:-1]))
    return np.asarray(np.copysign(1.0, lengths[place]) * tangent / size)
