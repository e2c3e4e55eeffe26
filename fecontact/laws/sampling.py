"""Laws evaluated at many places at once, through their compiled functions."""

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.core.compiled import block, i8, kernel, matrix, vector
from fecontact.laws.signatures import friction_at, memory_at, normal_at

Array = NDArray[np.float64]


@kernel(types.void(i8, vector, vector, vector, matrix))
def _normal(address, u, v, p, out):  # type: ignore[no-untyped-def]
    for k in range(len(u)):
        out[k, 0], out[k, 1], out[k, 2] = normal_at(address)(u[k], v[k], p)


@kernel(types.void(i8, vector, vector, vector, matrix))
def _friction(address, v, F, p, out):  # type: ignore[no-untyped-def]
    for k in range(len(v)):
        out[k, 0], out[k, 1], out[k, 2] = friction_at(address)(v[k], F[k], p)


@kernel(types.void(i8, vector, vector, matrix, vector, block))
def _memory(address, v, F, z, p, out):  # type: ignore[no-untyped-def]
    for k in range(len(v)):
        memory_at(address)(v[k], F[k], z[k], p, out[k, 0], out[k, 1:])


def normal_values(address: int, p: Array, u: Array, v: Array) -> Array:
    """F, dF/du, dF/dv (k, 3) at penetrations and rates (k,), for one row of parameters."""
    out = np.full((len(u), 3), np.nan)
    _normal(address, _floats(u), _floats(v), p, out)
    return out


def friction_values(address: int, p: Array, v: Array, F: Array) -> Array:
    """R, dR/dv, dR/dF (k, 3) at slip velocities and normal forces (k,), without memory."""
    out = np.full((len(v), 3), np.nan)
    _friction(address, _floats(v), _floats(F), p, out)
    return out


def memory_values(address: int, p: Array, v: Array, F: Array, z: Array) -> Array:
    """R and its derivatives, then z' and theirs, (k, 1 + s, 3 + s), at z (k, s); with memory.

    The columns are the value and its derivatives to v, F and z.
    """
    out = np.full((len(v), 1 + z.shape[1], 3 + z.shape[1]), np.nan)
    _memory(address, _floats(v), _floats(F), _floats(z), p, out)
    return out


def _floats(values: Array) -> Array:
    return np.ascontiguousarray(values, dtype=float)
