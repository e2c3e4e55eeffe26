"""Vectorised evaluation of laws through their compiled functions."""

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.copies import put
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.types import Array
from fecontact.laws.signatures import friction_at, memory_at, normal_at


@kernel(nogil=True)
def _scalar(address: int, x: Vector, y: Vector, p: Vector, out: Matrix) -> None:
    for k in range(len(x)):
        out[k, 0], out[k, 1], out[k, 2] = friction_at(address)(x[k], y[k], p)


@kernel(nogil=True)
def _memory(address: int, v: Vector, F: Vector, z: Matrix, p: Vector, out: Block) -> None:
    for k in range(len(v)):
        memory_at(address)(v[k], F[k], z[k], p, out[k, 0], out[k, 1:])


def law_values(address: int, p: Array, x: Array, y: Array) -> Array:
    """A force and its derivatives (k, 3) at pairs of arguments (k,), for one row of parameters.

    A normal law gives F, dF/du, dF/dv at penetrations u and rates v; friction without memory gives
    R, dR/dv, dR/dF at slip velocities v and normal forces F.
    """
    out = np.full((len(x), 3), np.nan)
    _scalar(address, _floats(x), _floats(y), p, out)
    return out


def memory_values(address: int, p: Array, v: Array, F: Array, z: Array) -> Array:
    """R and its derivatives, then z' and theirs, (k, 1 + s, 3 + s), at z (k, s); with memory.

    The columns are the value and its derivatives with respect to v, F and z.
    """
    out = np.full((len(v), 1 + z.shape[1], 3 + z.shape[1]), np.nan)
    _memory(address, _floats(v), _floats(F), _floats(z), p, out)
    return out


def _floats(values: Array) -> Array:
    return np.ascontiguousarray(values, dtype=float)


_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def stored_energy(
    address: int, penetration: Array, parameters: Array, scale: float
) -> Array:
    """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u.

    Gauss-Legendre quadrature with 16 points in each interval between 0 and 1, 3, 9, 27, ... times
    the scale; laws with kinks elsewhere have a closed form instead.

    Parameters
    ----------
    address : int
        Address of the compiled function of the law.
    penetration : (..., n) array
        u of the contact nodes [m]; below zero the integral is taken from 0 down to u.
    parameters : (n, k) array
        Parameters of the law at each node.
    scale : float
        Characteristic penetration of the law [m].
    """
    given = np.asarray(penetration, dtype=float)
    rows = np.ascontiguousarray(given.reshape(-1, len(parameters)))
    energy = np.empty_like(rows)
    _energy(address, rows, parameters, scale, energy)
    return energy.reshape(given.shape)


@kernel
def _energy(address: int, penetration: Matrix, p: Matrix, scale: float, out: Matrix) -> None:
    """Fill out (N, n) from penetrations (N, n) and parameters (n, k)."""
    force = normal_at(address)
    for i in range(penetration.shape[0]):
        for j in range(penetration.shape[1]):
            end = penetration[i, j]
            direction = 1.0 if end > 0.0 else -1.0
            total, low, high = 0.0, 0.0, scale
            while low < abs(end):
                half, mean = 0.5 * (min(high, abs(end)) - low), 0.5 * (min(high, abs(end)) + low)
                for k in range(len(_POINTS)):
                    u = direction * (mean + half * _POINTS[k])
                    total += direction * half * _WEIGHTS[k] * force(u, 0.0, p[j])[0]
                low, high = high, 3.0 * high
            out[i, j] = total if end == end else end


_CYCLES, _STEPS = 6, 1000


@kernel
def _cycles(
    address: int, p: Vector, F: float, travel: Vector, z: Vector, step: float, work: Vector,
) -> None:
    """Fill work with R v dt of every step: z by implicit Euler, forces at mid-step."""
    s = len(z)
    force, rates = np.empty(3 + s), np.empty((s, 3 + s))
    A, residual, after = np.empty((s, s)), np.empty(s), np.empty(s)
    for k in range(len(work)):
        moved = travel[k + 1] - travel[k]
        v = moved / step
        put(z, after)
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
        put(after, z)


def cycle_work(
    address: int, memory: int, p: Array, normal_force: float, speed: float,
    reach: float,
) -> tuple[Array, Array]:
    """Work (6,) of friction in each of six cycles of slip from z = 0 [J], and its absolute value.

    Each cycle has two harmonics and the largest velocity ``speed`` [m/s]; the first one has the
    amplitude ``reach`` [m]. Passive friction never returns more energy than it has absorbed.
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
