"""Internal variables of friction with memory at rest in steady sliding."""

import numpy as np
from numba import types

from fecontact.core.compiled import f8, kernel, vector
from fecontact.core.types import Array
from fecontact.system.kernels import (
    SYSTEM,
    SystemArrays,
    ground_motion,
    memory_of,
    node_forces,
    node_motion,
)


@kernel(types.void(f8, vector, SYSTEM))
def _settle(t, y, s):
    """Bring z of each node to z' = 0 by implicit Euler steps of increasing length."""
    n = len(s.Tx)
    states = s.memory.max()
    force, rates = np.empty(3 + states), np.empty((states, 3 + states))
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
