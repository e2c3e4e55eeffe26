"""Forces on a body at rest over a period, for several values of a parameter, in compiled code."""

import numpy as np
from numba import types

from fecontact.core.compiled import block, f8, kernel, matrix, vector
from fecontact.core.references import borrowed
from fecontact.system.kernels import given_at, node_forces
from fecontact.system.nodes import SYSTEM, force_room, in_space, leaning, memory_of, node_motion


@kernel(types.void(vector, vector, vector, vector, vector, vector, SYSTEM, block,
                   types.Array(f8, 4, "C"), matrix))
def forces_at_rest(places, periods, tau, flat, base, slope, s, loads, matrices, forces):
    """Fill loads (P, N, m) and matrices (P, 2, m, m), stiffness and damping, at P values.

    The arrays of the system are ``flat`` = ``base`` + p ``slope``. With the forces (N, m) of loads
    and contact at rest for the last value.
    """
    s, loads, forces = borrowed(s), borrowed(loads), borrowed(forces)
    n, m = s.Tx.shape
    states = s.memory.max()
    length, width = force_room(states, in_space(s))
    force, rates = np.empty(length), np.empty((states, width))
    load, still = np.empty(m), np.zeros(2 * m + n * states)
    for place in range(len(places)):
        for k in range(len(flat)):
            flat[k] = base[k] + places[place] * slope[k]
        for c in range(len(tau)):
            moved = given_at(tau[c] * periods[place], s, load)
            for i in range(m):
                loads[place, c, i] = load[i]
            if place + 1 < len(places):
                continue
            for i in range(m):
                forces[c, i] = load[i]
            for j in range(n):
                F, R, contact = node_forces(j, node_motion(j, still, s), moved,
                                            memory_of(j, still, s), s, force, rates)
                T = leaning(F, R, contact.slope, s)
                for i in range(m):
                    forces[c, i] += s.Ty[j, i] * F - s.Tx[j, i] * T
        for i in range(m):
            for j in range(m):
                matrices[place, 0, i, j] = s.stiffness[i, j]
                matrices[place, 1, i, j] = s.damping[i, j]
