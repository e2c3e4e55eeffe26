"""Test functions of special points of orbits, from the multipliers."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.core.compiled import i8, kernel, vector

Array = NDArray[np.float64]

# Slope of the parameter along a branch, in widths of the diagram, below which its sign is rounding.
FLAT = 1e-8
# A multiplier is told from one where it is farther from it than so many errors of the trivial one.
_RESOLVED = 10.0

_complex_vector = types.Array(types.complex128, 1, "C")


@kernel(types.void(_complex_vector, i8, vector))
def multiplier_tests(mu, trivial, out):  # type: ignore[no-untyped-def]
    """Fill out (3,) with the products of mu + 1, mu - 1 and, over pairs, mu_i mu_k - 1, scaled.

    Without the multiplier ``trivial``, if it is not negative. They change sign where a multiplier
    passes -1, where one passes 1, and where a complex pair passes the unit circle.
    """
    minus, plus, pairs = 1.0 + 0.0j, 1.0 + 0.0j, 1.0 + 0.0j
    for i in range(len(mu)):
        if i == trivial:
            continue
        size = 1.0 + abs(mu[i])
        minus *= (mu[i] + 1.0) / size
        plus *= (mu[i] - 1.0) / size
        for k in range(i + 1, len(mu)):
            if k == trivial:
                continue
            both = mu[i] * mu[k]
            if abs(both) < np.inf:
                pairs *= (both - 1.0) / (abs(both) + 1.0)
    out[0], out[1], out[2] = minus.real, plus.real, pairs.real


def unresolved(
    slopes: tuple[float, float],
    values: tuple[Mapping[str, Any], Mapping[str, Any]],
    tests: tuple[Mapping[str, float], Mapping[str, float]],
) -> set[str]:
    """Kinds of special points that rounding alone shows between two orbits of a branch.

    Towards a homoclinic orbit, on a canard and in a conservative family the parameter changes by
    less than its rounding: turns of it are no folds, and turns of its sign in the test for branch
    points no crossings. In a conservative family one multiplier more is one throughout.

    Parameters
    ----------
    slopes : pair of float
        Component of the tangents along the parameter, in widths of the diagram.
    values, tests : pairs of mappings
        What is stored of the two orbits, and their test functions.
    """
    flat = [abs(slope) < FLAT for slope in slopes]
    found: set[str] = {"fold"} if all(flat) else set()
    signs = [np.sign(test.get("branch point", 0.0)) * (-1.0 if slope <= -FLAT else 1.0)
             for slope, test in zip(slopes, tests, strict=True)]
    if any(flat) and signs[0] == signs[1]:
        found.add("branch point")
    if all(flat) and all(_near_one(stored) for stored in values):
        found.add("branch point")
    return found


def _near_one(stored: Mapping[str, Any]) -> bool:
    """Whether a multiplier besides the trivial one cannot be told from one."""
    off = np.sort(np.abs(np.asarray(stored["multipliers"]) - 1.0))
    error = max(float(stored["trivial_error"]), 1e-10)
    return len(off) > 1 and bool(off[1] <= _RESOLVED * error)
