"""Whether a law does what the contract of laws says, tried at a few points."""

from functools import lru_cache

import numpy as np
from numba import types

from fecontact.compiled import CompiledLaw, i8, kernel, matrix, vector
from fecontact.errors import InputError
from fecontact.laws.contract import (
    FRICTION_FORM,
    MEMORY_FORM,
    NORMAL_FORM,
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
    normal = isinstance(law, NormalLaw)
    forms = {"normal_law": NORMAL_FORM} if normal else {
        "friction_law": FRICTION_FORM, "memory_friction_law": MEMORY_FORM}
    function = getattr(type(law), "kernel", None)
    if not isinstance(function, CompiledLaw) or function.form not in forms.values():
        raise InputError(f"{name} needs kernel: ClassVar = a function "
                         f"{' or '.join(forms.values())} decorated with {' or '.join(forms)}.")
    if isinstance(law, FrictionLaw):
        states = law.memory
        if isinstance(states, bool) or not isinstance(states, int) or (
                states < 0) or (states > 0) != (function.form == MEMORY_FORM):
            raise InputError(f"{name}: memory = {states!r} must be the number of internal "
                             f"variables, a whole number, above zero exactly for kernels of "
                             f"memory_friction_law.")
    what = "penetration_scale" if normal else "velocity_scale"
    try:
        scale = getattr(law, what)
    except NotImplementedError:
        scale = None
    if not isinstance(scale, float | int) or not 0.0 < scale < np.inf:
        raise InputError(f"{name}: {what} = {scale!r} must be a finite number above zero; define "
                         f"it as a property of the law.")
    nodes = law.node_count() or 1
    row = law.table(np.full(nodes, 1.0 / nodes))[0]
    address = function.address
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
