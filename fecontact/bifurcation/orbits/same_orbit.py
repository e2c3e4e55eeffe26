"""Comparison of orbits up to a shift in time.

A closed branch returns to its first orbit on another mesh and in another phase. A branch of doubled
orbits may return to single orbits; beyond, it repeats the same orbits with their halves exchanged.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from fecontact.bifurcation.continuation.newton import weighted_norm
from fecontact.bifurcation.orbits.discretisation import Discretisation
from fecontact.bifurcation.orbits.mesh import interpolate, node_times
from fecontact.core.types import Array

# Samples of an orbit for the first estimate of the shift.
_SAMPLES = 512
# Largest relative difference of halves that coincide, and smallest fraction of the tangent that
# separates them.
_HALVES_MEET, _HALVES_PART = 0.02, 0.9

HALVING = "period halving"


class _Weighted(Protocol):
    @property
    def common(self) -> int:
        """Number of unknowns, last in u, that do not depend on the phase."""

    def weights(self) -> Array:
        """Weights of the unknowns in their inner product."""


def same_place(
    problem: _Weighted, one: tuple[Array, Array], other: tuple[Array, Array], within: float
) -> bool:
    """Whether two points, unknowns and tangents, agree in period, parameter and heading."""
    weights, common = problem.weights()[-problem.common :], slice(-problem.common, None)
    heading = float(weights * one[1][common] @ other[1][common])
    return heading > 0.0 and weighted_norm(weights, one[0][common] - other[0][common]) <= within


def in_phase(problem: Discretisation, u: Array, like: Array) -> Array:
    """An orbit on the mesh of the problem, shifted in time to match another one."""
    mesh, d = problem.mesh, problem.field.dimension
    nodes, times = problem.nodes(u).copy(), node_times(mesh, problem.degree)

    def shifted(shift: float) -> Array:
        return interpolate(mesh, nodes, np.mod(times + shift, 1.0))

    if problem.autonomous:
        shift = _shift(problem, nodes, problem.nodes(like).copy(), shifted)
    else:
        target = problem.nodes(like) / problem.scales[:d]
        shift = min((k / problem.periods for k in range(problem.periods)), key=lambda shift: float(
            np.abs(shifted(shift) / problem.scales[:d] - target).max()))
    return np.concatenate([shifted(shift).reshape(-1), u[problem.size :]])


def _shift(
    problem: Discretisation, nodes: Array, like: Array, shifted: Callable[[float], Array]
) -> float:
    """Shift in periods of the best correlation that meets the phase condition."""
    from scipy.optimize import brentq

    phases = np.arange(_SAMPLES) / _SAMPLES
    sides = [np.fft.rfft((side - side.mean(axis=0)) / problem.scales[: side.shape[1]], axis=0)
             for side in (interpolate(problem.mesh, each, phases) for each in (nodes, like))]
    correlation = np.fft.irfft((sides[0] * sides[1].conj()).sum(axis=1), _SAMPLES)
    rough = float(np.argmax(correlation)) / _SAMPLES

    def off(shift: float) -> float:
        return float(problem.phase_row @ shifted(shift).reshape(-1))

    low, high = rough - 1.0 / _SAMPLES, rough + 1.0 / _SAMPLES
    if off(low) * off(high) >= 0.0:
        return rough
    return float(brentq(off, low, high, xtol=1e-12))


def halves_meet(problem: Discretisation, u: Array, tangent: Array) -> bool:
    """Whether an orbit is a single orbit traversed twice whose halves separate along the branch."""
    times = np.mod(node_times(problem.mesh, problem.degree) + 0.5, 1.0)
    nodes, along = problem.nodes(u).copy(), problem.nodes(tangent).copy()
    weights = problem.weights()[: problem.size].reshape(nodes.shape)

    def apart(vector: Array) -> float:
        return float((weights * (vector - interpolate(problem.mesh, vector, times)) ** 2).sum() / 4)

    motion = float((weights * (nodes - nodes.mean(axis=0)) ** 2).sum())
    return (apart(nodes) < _HALVES_MEET**2 * motion
            and apart(along) > _HALVES_PART * float((weights * along**2).sum()))
