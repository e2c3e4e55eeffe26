"""Whether a law does what the contract of laws says, tried at a few points."""

from functools import lru_cache

import numpy as np
from numba import types

from fecontact.compiled import i8, kernel, matrix, vector
from fecontact.errors import InputError
from fecontact.laws.contract import (
    FrictionLaw,
    NormalLaw,
    friction_at,
    memory_at,
    normal_at,
)

_NORMAL_PLACES = np.array([(u, v) for u in (-1e-3, 0.0, 1e-9, 1e-6, 1e-4)
                           for v in (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)])
_FRICTION_PLACES = np.array([(v, F) for v in (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)
                             for F in (0.0, 1e-3, 1.0, 100.0)])


@kernel(types.void(i8, matrix, vector, matrix))
def _normal(address, places, p, out):  # type: ignore[no-untyped-def]
    for k in range(len(places)):
        out[k, 0], out[k, 1], out[k, 2] = normal_at(address)(places[k, 0], places[k, 1], p)


@kernel(types.void(i8, matrix, vector, matrix))
def _friction(address, places, p, out):  # type: ignore[no-untyped-def]
    for k in range(len(places)):
        out[k, 0], out[k, 1], out[k, 2] = friction_at(address)(places[k, 0], places[k, 1], p)


@kernel(types.void(i8, matrix, vector, i8, matrix))
def _memory(address, places, p, states, out):  # type: ignore[no-untyped-def]
    z, force, rates = np.zeros(states), np.empty(3 + states), np.empty((states, 3 + states))
    for k in range(len(places)):
        force[:] = np.nan
        rates[:] = np.nan
        memory_at(address)(places[k, 0], places[k, 1], z, p, force, rates)
        out[k, : 3 + states] = force
        for i in range(states):
            out[k, (i + 1) * (3 + states) : (i + 2) * (3 + states)] = rates[i]


@lru_cache(maxsize=256)
def require_sound(law: NormalLaw | FrictionLaw) -> None:
    """Raise :class:`InputError` if a law does not return finite numbers, as many as it must.

    The message says what it returned, and where.
    """
    name = type(law).__name__
    if not hasattr(type(law), "kernel"):
        raise InputError(f"{name} has no 'kernel'; give it one, kernel: ClassVar = a function "
                         f"compiled by normal_law or friction_law.")
    values = [np.atleast_1d(value) for value in vars(law).values() if not isinstance(value, str)]
    nodes = max((len(value) for value in values), default=1)
    row = law.table(np.full(nodes, 1.0 / nodes))[0]
    address = law.kernel.address
    if isinstance(law, NormalLaw):
        names, places = "u, v", _NORMAL_PLACES
        out = np.empty((len(places), 3))
        _normal(address, places, row, out)
    elif law.memory:
        names, places = "v, F", _FRICTION_PLACES
        out = np.empty((len(places), (1 + law.memory) * (3 + law.memory)))
        _memory(address, places, row, law.memory, out)
    else:
        names, places = "v, F", _FRICTION_PLACES
        out = np.empty((len(places), 3))
        _friction(address, places, row, out)
    wrong = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(wrong):
        first, second = places[wrong[0]]
        shown = ", ".join(f"{value:g}" for value in out[wrong[0], :3])
        raise InputError(f"{name} returns ({shown}{', ...' * (out.shape[1] > 3)}) at ({names}) = "
                         f"({first:g}, {second:g}); a law must return finite numbers everywhere.")
