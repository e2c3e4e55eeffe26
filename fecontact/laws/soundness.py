"""Whether a law does what the contract of laws says, tried at a few points."""

import math
from functools import lru_cache

import numpy as np

from fecontact.errors import InputError
from fecontact.laws.contract import FrictionLaw, NormalLaw

_PENETRATIONS = (-1e-3, 0.0, 1e-9, 1e-6, 1e-4)
_SPEEDS = (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)


@lru_cache(maxsize=256)
def require_sound(law: NormalLaw | FrictionLaw) -> None:
    """Raise :class:`InputError` if a law does not return finite numbers, as many as it must.

    The message says what it returned, and where.
    """
    if not hasattr(type(law), "kernel"):
        raise InputError(f"{type(law).__name__} has no 'kernel'; give it one, kernel: ClassVar = "
                         f"a function compiled by normal_law or friction_law.")
    _ = law.kernel.address
    values = [np.atleast_1d(value) for value in vars(law).values() if not isinstance(value, str)]
    nodes = max((len(value) for value in values), default=1)
    row = law.table(np.full(nodes, 1.0 / nodes))[0]
    if isinstance(law, NormalLaw):
        for u in _PENETRATIONS:
            for v in _SPEEDS:
                _require_finite(law, law.kernel.python(u, v, row), f"u = {u:g}, v = {v:g}")
        return
    states = law.memory
    for v in _SPEEDS:
        for F in (0.0, 1e-3, 1.0, 100.0):
            where = f"v = {v:g}, F = {F:g}"
            if not states:
                _require_finite(law, law.kernel.python(v, F, row), where)
                continue
            force, rates = np.full(3 + states, np.nan), np.full((states, 3 + states), np.nan)
            law.kernel.python(v, F, np.zeros(states), row, force, rates)
            if not (np.isfinite(force).all() and np.isfinite(rates).all()):
                raise InputError(f"{type(law).__name__} leaves values in force or rates that are "
                                 f"not finite at {where}, z = 0.")


def _require_finite(law: NormalLaw | FrictionLaw, values: object, where: str) -> None:
    if not isinstance(values, tuple) or len(values) != 3 or not all(map(math.isfinite, values)):
        raise InputError(f"{type(law).__name__} returns {values!r} at {where}; a law must return "
                         f"the force and its two derivatives, all finite.")
