"""Internal variables of friction with memory: what they store, and steady ones."""

import numpy as np
from numba import types

from fecontact.core.compiled import block, f8, kernel, matrix, vector
from fecontact.core.types import Array
from fecontact.system.kernels import node_forces
from fecontact.system.nodes import (
    SYSTEM,
    SystemArrays,
    force_room,
    ground_motion,
    in_space,
    memory_of,
    node_motion,
)
from fecontact.system.powers import storing_power


@kernel(types.void(vector, matrix, SYSTEM, block))
def bristle_history(times, states, s, out):
    """Fill out (2, N, n): what the bristles store, and the power into it at constant force."""
    count = s.memory.max()
    length, width = force_room(count, in_space(s))
    force, rates = np.empty(length), np.empty((count, width))
    for i in range(len(times)):
        y, moved = states[i], ground_motion(times[i], s)
        for j in range(len(s.Tx)):
            z = memory_of(j, y, s)
            F = node_forces(j, node_motion(j, y, s), moved, z, s, force, rates)[0]
            stored = 0.0
            for k in range(s.memory[j]):
                stored += (s.bristle_stiffness[0, j, k]
                           + s.bristle_stiffness[1, j, k] * abs(F)) * z[k] * z[k]
            out[0, i, j] = 0.5 * stored
            out[1, i, j] = storing_power(j, F, z, rates, s)


@kernel(types.void(f8, vector, SYSTEM))
def _settle(t, y, s):
    """Bring z of each node to z' = 0 by implicit Euler steps of increasing length."""
    n = len(s.Tx)
    states = s.memory.max()
    length, width = force_room(states, in_space(s))
    force, rates = np.empty(length), np.empty((states, width))
    moved = ground_motion(t, s)
    for j in range(n):
        count = s.memory[j]
        if count == 0:
            continue
        motion = node_motion(j, y, s)
        z = memory_of(j, y, s)
        step = 1e-9
        while step < 1e12:
            node_forces(j, motion, moved, z, s, force, rates)
            matrix = np.empty((count, count))
            for k in range(count):
                for other in range(count):
                    matrix[k, other] = -step * rates[k, 3 + other]
                matrix[k, k] += 1.0
            z += np.linalg.solve(matrix, step * rates[:count, 0].copy())
            step *= 2.0


def settled(t: float, y: Array, arrays: SystemArrays) -> Array:
    """The state y with the steady internal variables for its slip velocities and forces.

    They are unchanged at nodes without slip.
    """
    state = np.array(y, dtype=float)
    if arrays.memory.any():
        _settle(t, state, arrays)
    return state
