r"""Friction in two directions: laws of one direction along the slip direction.

A law without memory keeps its function R(\|v\|, F):

    R_i = R e_i,    dR_i/dv_k = R' e_i e_k + (R / \|v\|) (delta_ik - e_i e_k),    e = v / \|v\|

with R' delta_ik at rest. A straight path gives the law of one direction, and forces turn with the
tangents.
"""

import math

from fecontact.core.compiled import helper
from fecontact.laws.signatures import friction_at, planar_friction_law


@helper
def clear(force, rates):
    """Set all forces, rates and their derivatives to zero."""
    for k in range(len(force)):
        force[k] = 0.0
    for row in range(len(rates)):
        for k in range(rates.shape[1]):
            rates[row, k] = 0.0


@helper
def direction(v1, v2, z1, z2):
    """Size of a slip velocity and its direction; at rest that of the internal variable."""
    speed = math.hypot(v1, v2)
    if speed > 0.0:
        return speed, v1 / speed, v2 / speed
    size = math.hypot(z1, z2)
    if size > 0.0:
        return 0.0, z1 / size, z2 / size
    return 0.0, 1.0, 0.0


@planar_friction_law
def along_slip(law, v1, v2, F, z, p, force, rates):
    """A law without memory along the slip direction; ``law`` is its address."""
    clear(force, rates)
    if F <= 0.0:
        return
    second = 4 + len(rates)
    speed, e1, e2 = direction(v1, v2, 0.0, 0.0)
    R, R_v, R_F = friction_at(law)(speed, F, p)
    round_slope = R / speed if speed > 0.0 else R_v
    force[0], force[second] = R * e1, R * e2
    force[1] = R_v * e1 * e1 + round_slope * e2 * e2
    mixed = (R_v - round_slope) * e1 * e2
    force[3 + len(rates)], force[second + 1] = mixed, mixed
    force[second + 3 + len(rates)] = R_v * e2 * e2 + round_slope * e1 * e1
    force[2], force[second + 2] = R_F * e1, R_F * e2
