"""Work of friction with memory over cycles of slip."""

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.core.compiled import f8, i8, kernel, vector
from fecontact.laws.signatures import memory_at

_CYCLES, _STEPS = 6, 1000


@kernel(types.void(i8, vector, f8, vector, vector, f8, vector))
def _cycles(address, p, F, travel, z, step, work):  # type: ignore[no-untyped-def]
    """Fill work with R v dt of every step: z by implicit Euler, forces at the middle of it."""
    s = len(z)
    force, rates = np.empty(3 + s), np.empty((s, 3 + s))
    A, residual, after = np.empty((s, s)), np.empty(s), np.empty(s)
    for k in range(len(work)):
        moved = travel[k + 1] - travel[k]
        v = moved / step
        after[:] = z
        for _ in range(30):
            memory_at(address)(v, F, after, p, force, rates)
            for i in range(s):
                residual[i] = after[i] - z[i] - step * rates[i, 0]
                for j in range(s):
                    A[i, j] = -step * rates[i, 3 + j]
                A[i, i] += 1.0
            change = np.linalg.solve(A, residual)
            largest = 0.0
            for i in range(s):
                after[i] -= change[i]
                largest = max(largest, abs(change[i]) / (abs(after[i]) + 1e-300))
            if largest < 1e-10:
                break
        for i in range(s):
            residual[i] = 0.5 * (z[i] + after[i])
        memory_at(address)(v, F, residual, p, force, rates)
        work[k] = force[0] * moved
        z[:] = after


def cycle_work(
    address: int, memory: int, p: NDArray[np.float64], normal_force: float, speed: float,
    reach: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Work (6,) of friction in each of six cycles of slip from z = 0 [J], and that of its size.

    The cycles are of two harmonics with the largest velocity ``speed`` [m/s]; the first one
    has the amplitude ``reach`` [m]. Passive friction never gives off more than it has taken.
    """
    t = np.linspace(0.0, _CYCLES, _CYCLES * _STEPS + 1)
    travel = -(np.cos(2.0 * np.pi * t) + 0.4 * np.cos(6.0 * np.pi * t + 1.0))
    rate = np.max(np.abs(np.diff(travel))) * _STEPS
    period = reach * rate / speed
    work = np.empty(len(t) - 1)
    _cycles(address, p, normal_force, travel * reach,
            np.zeros(memory), period / _STEPS, work)
    cycles = work.reshape(_CYCLES, _STEPS)
    return cycles.sum(axis=1), np.abs(cycles).sum(axis=1)
