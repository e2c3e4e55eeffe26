"""Internal variables of friction with memory: what they store, and steady ones."""

from collections.abc import Iterable

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.types import Array
from fecontact.laws.base import FrictionLaw
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.node_forces import force_workspace, node_forces
from fecontact.system.nodes import SystemArrays, ground_motion, memory_of, node_motion
from fecontact.system.powers import storing_power


@kernel
def bristle_history(times: Vector, states: Matrix, s: SystemArrays, out: Block) -> None:
    """Fill out (2, N, n): what the bristles store, and the power into it at constant force."""
    force, rates = force_workspace(s)
    for i in range(len(times)):
        y, moved = states[i], ground_motion(times[i], s)
        for j in range(len(s.rows)):
            z = memory_of(j, y, s)
            F = node_forces(j, node_motion(j, y, s), moved, z, s, force, rates).normal
            stored = 0.0
            for k in range(s.memory[j]):
                stored += (s.bristle_stiffness[0, j, k]
                           + s.bristle_stiffness[1, j, k] * abs(F)) * z[k] * z[k]
            out[0, i, j] = 0.5 * stored
            out[1, i, j] = storing_power(j, F, z, rates, s)


@kernel
def _set_steady(t: float, y: Vector, s: SystemArrays) -> None:
    """Bring z of each node to z' = 0 by implicit Euler steps of increasing length."""
    n = len(s.rows)
    force, rates = force_workspace(s)
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


def steady_memory(t: float, y: Array, arrays: SystemArrays) -> Array:
    """The state y with the steady internal variables for its slip velocities and forces.

    They are unchanged at nodes without slip.
    """
    state = np.array(y, dtype=float)
    if arrays.memory.any():
        _set_steady(t, state, arrays)
    return state


def velocity_scale(law: FrictionLaw, force: float) -> float:
    """Slip velocity of a law over which friction rises, with a scale of forces [N]; in m/s."""
    return law.velocity_scale * (force if law.scales_with_force else 1.0)


def memory_scales(basis: ModalBasis, memory: int, laws: Iterable[tuple[slice, Array, FrictionLaw]],
                  force: float) -> Array:
    """Scales (n s,) of s internal variables of each node, with a scale of forces [N]."""
    scales = np.ones((basis.contact_nodes, memory))
    for nodes, _, law in laws:
        # In space both components of a vector have its scale.
        scale = np.repeat(law.state_scale, basis.dimension - 1)
        scales[nodes, : len(scale)] = scale * (force if law.scales_with_force else 1.0)
    return scales.reshape(-1)
