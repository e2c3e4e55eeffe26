"""Whether a law does what the contract of laws says, tried at a few points."""

from functools import lru_cache

import numpy as np

from fecontact.core.compiled import CompiledLaw
from fecontact.core.errors import InputError
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.sampling import friction_values, memory_values, normal_values
from fecontact.laws.signatures import FRICTION_FORM, MEMORY_FORM, NORMAL_FORM

_NORMAL_PLACES = np.array([(u, v) for u in (-1e-3, 0.0, 1e-9, 1e-6, 1e-4)
                           for v in (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)]).T
_FRICTION_PLACES = np.array([(v, F) for v in (-1.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0)
                             for F in (0.0, 1e-3, 1.0, 100.0)]).T


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
        raise InputError(f"{name}: kernel must be a class variable, a function "
                         f"{' or '.join(forms.values())} decorated with {' or '.join(forms)}.")
    if isinstance(law, FrictionLaw):
        count = law.memory
        if isinstance(count, bool) or not isinstance(count, int) or (
                count < 0) or (count > 0) != (function.form == MEMORY_FORM):
            raise InputError(f"{name}: memory = {count!r} must be the number of internal "
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
    if isinstance(law, NormalLaw):
        names, (first, second) = "u, v", _NORMAL_PLACES
        out = normal_values(law.kernel.address, row, first, second)
    else:
        names, (first, second) = "v, F", _FRICTION_PLACES
        address, z = law.kernel.address, np.zeros((len(first), law.memory))
        out = (memory_values(address, row, first, second, z).reshape(len(first), -1)
               if law.memory else friction_values(address, row, first, second))
    wrong = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(wrong):
        place = f"{first[wrong[0]]:g}, {second[wrong[0]]:g}"
        shown = ", ".join(f"{value:g}" for value in out[wrong[0], :3])
        raise InputError(f"{name} returns ({shown}{', ...' * (out.shape[1] > 3)}) at ({names}) = "
                         f"({place}); a law must return finite numbers everywhere.")
