"""Compiled powers of a contact system; see :mod:`fecontact.system.kernels`."""

import numpy as np
from numba import types

from fecontact.core.compiled import f8, kernel, vector
from fecontact.laws.signatures import normal_at, signal_at
from fecontact.system.body_powers import body_powers
from fecontact.system.kernels import SYSTEM, contact_state

# Columns of `powers`: put in by the drive's springs, the ground's lifting, the belt and the loads;
# lost in the modes, in the dashpots at B, in the contact's damping, by friction.
POWERS = ("drive", "ground", "belt", "load", "modal_damping", "dashpots", "contact_damping",
          "friction")


@kernel(types.void(f8, vector, SYSTEM, vector, vector))
def powers(t, y, s, out, friction):  # type: ignore[no-untyped-def]
    """Fill out (8,) with the powers and ``friction`` (n,) with that of each node's friction."""
    n = len(s.Tx)
    speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)[1]
    state = np.empty((n, 6))
    contact_state(t, y, s, state)
    body_powers(t, y, s, out)
    for j in range(n):
        force, tangential, v, slip = state[j, 0], state[j, 1], state[j, 3], state[j, 4]
        elastic = normal_at(s.normal[j])(state[j, 2], 0.0, s.normal_parameters[j])[0]
        out[1] += force * state[j, 5]
        out[2] -= tangential * speed
        out[6] += (force - elastic) * v
        friction[j] = tangential * slip
        out[7] += friction[j]
