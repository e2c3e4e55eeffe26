"""Contact nodes whose normal force jumps, as at touch-down on a spring with a dashpot."""

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.laws.base import NormalLaw
from fecontact.system.contact_system import ContactSystem
from fecontact.system.node_forces import normal_values

# Part of the penetration scale: how far from a level forces are examined.
_ASIDE = 1e-6
# So much closer to a level a force that does not jump has changed much less across it.
_CLOSER, _JUMPS = 1e-3, 0.5


def jumping_nodes(system: ContactSystem) -> NDArray[np.bool_]:
    """Whether the normal force (n,) of each node jumps where it begins or ends, at some rate."""
    found = np.zeros(system.basis.contact_nodes, dtype=np.bool_)
    for nodes, share, law in system.law_groups("normal"):
        near, speed = _ASIDE * law.penetration_scale, system.velocity_scale
        for level in law.onsets(len(share)):
            for rate in (-speed, speed):
                found[nodes] |= _jumps(law, level, near, np.full(len(share), rate),
                                       law.table(share))
    return found


def _jumps(
    law: NormalLaw, level: Array, near: float, rate: Array, table: Array,
) -> NDArray[np.bool_]:
    """Whether forces (n,) differ across a level as much as from a thousand times closer to it."""
    def across(by: float) -> Array:
        out, slope = np.empty((2, len(level))), np.empty(len(level))
        for row, side in zip(out, (by, -by), strict=True):
            normal_values(np.full(len(level), law.kernel.address), level + side, rate, table, row,
                          slope)
        return np.abs(out[0] - out[1])

    # Laws without an onset name a level beyond all forces, where these have no difference.
    with np.errstate(invalid="ignore"):
        return np.asarray(across(_CLOSER * near) > _JUMPS * across(near))
