"""Forces on a body at rest over a period, for several values of a parameter, in compiled code."""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.copies import put, put_rows
from fecontact.core.records import Array4, Block, Matrix, Vector
from fecontact.system.kernels import prescribed_at
from fecontact.system.node_forces import axis_force, force_workspace, node_forces
from fecontact.system.nodes import SystemArrays, memory_of, most_memory, node_motion


class AffineSystem(NamedTuple):
    """A system whose arrays are parts of ``flat`` = ``base`` + p ``slope`` at a parameter p."""

    flat: Vector
    base: Vector
    slope: Vector
    system: SystemArrays


@kernel
def forces_at_rest(
    places: Vector, periods: Vector, tau: Vector, affine: AffineSystem, loads: Block,
    rest: Matrix, matrices: Array4,
) -> None:
    """Fill what acts on a body at rest, for P places of a parameter and N samples of a period.

    These are its loads (P, N, m), loads with contact forces at rest (N, m) for the last place, and
    matrices (P, 2, m, m) of stiffness and damping.
    """
    s = affine.system
    n, d, m = s.rows.shape
    states = most_memory(s)
    force, rates = force_workspace(s)
    load, still = np.empty(m), np.zeros(2 * m + n * states)
    for place in range(len(places)):
        for k in range(len(affine.flat)):
            affine.flat[k] = affine.base[k] + places[place] * affine.slope[k]
        for c in range(len(tau)):
            moved = prescribed_at(tau[c] * periods[place], s, load)
            put(load, loads[place, c])
            if place + 1 < len(places):
                continue
            put(load, rest[c])
            for j in range(n):
                node = node_forces(j, node_motion(j, still, s), moved, memory_of(j, still, s), s,
                                   force, rates)
                for axis in range(d):
                    push = axis_force(axis, node, force, rates, s)
                    for i in range(m):
                        rest[c, i] += s.rows[j, axis, i] * push
        put_rows(s.stiffness, matrices[place, 0])
        put_rows(s.damping, matrices[place, 1])
