"""Comparison of orbits up to a shift in time, and where branches of orbits end by themselves.

A closed branch returns to its first orbit on another mesh and in another phase. A branch of doubled
orbits may return to single orbits; beyond, it repeats the same orbits with their halves exchanged.
Others end at Hopf points and at homoclinic orbits.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from fecontact.bifurcation.continuation.inner_product import weighted_norm
from fecontact.bifurcation.equilibria.equilibrium import newton
from fecontact.bifurcation.orbits.collocation_equations import CollocationEquations
from fecontact.bifurcation.orbits.collocation_kernels import amplitude_along
from fecontact.bifurcation.orbits.mesh import compare_halves, interpolate, node_times
from fecontact.core.types import Array
from fecontact.system.complex_modes import sorted_eigenvalues
from fecontact.system.fields.vector_field import VectorField

# Samples of an orbit for the first estimate of the shift.
_SAMPLES = 512
# Largest relative difference of halves that coincide, and smallest fraction of the tangent that
# separates them.
HALVES_MEET, HALVES_PART = 0.02, 0.9

# How far behind the step, in twice its length, its bend may make a point ahead appear.
_BEHIND = 0.25

HALVING = "period halving"
# Name of the test function that is zero where an orbit shrinks to an equilibrium.
VANISHING = "vanishing orbit"
# Amplitude at which a branch ends, in that of the orbit before; along curves over two parameters,
# whose equations are singular at rest, more.
_VANISHED, VANISHED_ON_CURVES = 1e-3, 0.1
# Slowest motion on an orbit, in the fastest, from which an equilibrium is sought.
_SLOW = 0.02
# Distance of an orbit from a saddle, in amplitudes, at which it counts as homoclinic, the part of
# the period within ``_BESIDE`` amplitudes of it, and the change of the parameter in that of the
# period, both in the diagram.
_NEAREST, _MOST_TIME, _BESIDE, _RESTING = 1e-3, 0.5, 0.1, 1e-3
_TOLERANCE = 1e-10


class _Weighted(Protocol):
    @property
    def common(self) -> int:
        """Number of unknowns, last in u, that do not depend on the phase."""

    def weights(self) -> Array:
        """Weights of the unknowns in their inner product."""


class _Scaled(Protocol):
    """A problem of orbits with the period and the parameter last among its unknowns."""

    @property
    def field(self) -> VectorField:
        """The vector field."""

    @property
    def scales(self) -> Array:
        """Scales of the states, the period and the parameter."""

    def weights(self) -> Array:
        """Weights of the unknowns in their inner product."""


def same_place(
    problem: _Weighted, one: tuple[Array, Array], other: tuple[Array, Array], within: float
) -> bool:
    """Whether two points, unknowns and tangents, agree in period, parameter and heading.

    False too where the first one lies well behind the other.
    """
    weights, common = problem.weights()[-problem.common :], slice(-problem.common, None)
    row, off = weights * other[1][common], one[0][common] - other[0][common]
    if not float(row @ one[1][common]) > 0.0 or float(weighted_norm(weights, off)) > within:
        return False
    return bool(float(row @ off) >= -_BEHIND * within * weighted_norm(weights, other[1][common]))


def in_phase(problem: CollocationEquations, u: Array, like: Array) -> Array:
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
    problem: CollocationEquations, nodes: Array, like: Array, shifted: Callable[[float], Array]
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


def halves_meet(problem: CollocationEquations, u: Array, tangent: Array) -> bool:
    """Whether an orbit is a single orbit traversed twice whose halves separate along the branch."""
    times = np.mod(node_times(problem.mesh, problem.degree) + 0.5, 1.0)
    nodes, along = problem.nodes(u).copy(), problem.nodes(tangent).copy()
    weights = problem.weights()[: problem.size].reshape(nodes.shape)

    def apart(vector: Array) -> float:
        return float((weights * (vector - interpolate(problem.mesh, vector, times)) ** 2).sum() / 4)

    motion = float((weights * (nodes - nodes.mean(axis=0)) ** 2).sum())
    return (apart(nodes) < HALVES_MEET**2 * motion
            and apart(along) > HALVES_PART * float((weights * along**2).sum()))


def vanishing(problem: CollocationEquations, u: Array, least: float = _VANISHED) -> float:
    """See :func:`shrunk`, of an orbit by collocation."""
    return float(amplitude_along(problem.weights(), problem.nodes(u), problem.reference)) - least


def shrunk(weights: Array, moved: Array, before: Array, least: float = _VANISHED) -> float:
    """Amplitude along the shape of the orbit before, in its amplitude, less the least one.

    Beyond a Hopf point the same orbits come once more, half a period later: the amplitude has then
    changed its sign. ``moved`` and ``before`` are the motions about the means of both orbits.
    """
    return float((weights * before * moved).sum() / (weights * before**2).sum()) - least


def is_homoclinic(problem: CollocationEquations, u: Array, linearised: Any, tangent: Array) -> bool:
    """Whether an orbit by collocation is homoclinic to a saddle; see :func:`near_saddle`."""
    x, _ = problem.at_gauss_points(problem.nodes(u))
    shares = np.repeat(problem.widths / problem.degree, problem.degree)
    return near_saddle(problem, problem.parameters(u), x, shares, tangent,
                       linearised.derivatives[0])


def halves_apart(problem: CollocationEquations, u: Array) -> float:
    """Difference of the halves along that of the orbit before, see :func:`shrunk`; 1 without any.

    Where it vanishes a doubled orbit is a single one; beyond, the same orbits come once more, with
    their halves exchanged.
    """
    sums = np.empty(3)
    compare_halves(problem.mesh, problem.weights(), problem.nodes(u), problem.reference, sums)
    mixed, square, whole = sums.tolist()
    if square < HALVES_MEET**4 * whole:
        return 1.0
    return float(mixed / square) - VANISHED_ON_CURVES


def near_saddle(
    problem: _Scaled, values: Array, x: Array, shares: Array, tangent: Array,
    rates: Array | None = None,
) -> bool:
    """Whether an orbit stays near a saddle for most of its period, which alone changes.

    Its nearest distance from the saddle falls as exp(-l T / 2), the change of the parameter as
    exp(-l T) (Kuznetsov, Elements of Applied Bifurcation Theory, section 6.2); where the former is
    1e-3 of the amplitude, the branch has no more to tell. ``x`` (N, d) are states of the orbit,
    with these rates, ``shares`` (N,) the parts of the period that they stand for.
    """
    if not _period_alone(problem, tangent):
        return False
    sizes = problem.scales[: problem.field.dimension]
    found = beside_rest(problem.field, values, x, sizes, _SLOW, rates)
    if found is None:
        return False
    _, jacobian, away = found
    amplitude = float(np.linalg.norm(np.ptp(x, axis=0) / sizes)) / 2.0
    beside = float(shares[away < _BESIDE * amplitude].sum())
    if away.min() > _NEAREST * amplitude or beside < _MOST_TIME:
        return False
    real = sorted_eigenvalues(jacobian).real
    return bool(real[0] > 0.0 > real[-1])


def beside_rest(
    field: VectorField, values: Array, x: Array, sizes: Array, slow: float = np.inf,
    rates: Array | None = None,
) -> tuple[Array, Array, Array] | None:
    """The equilibrium next to the slowest of the states x (N, d) of an orbit.

    ``sizes`` are the scales of the states. Gives it, its Jacobian, and the distances (N,) of all
    states from it; None if there is none, or no speed is below ``slow`` times the largest one.
    """
    if rates is None:
        rates = field.rates(np.zeros(len(x)), x, values)
    speed = np.linalg.norm(rates / sizes, axis=1)
    if speed.min() > slow * speed.max():
        return None
    found = newton(field, x[int(np.argmin(speed))].copy(), values, _TOLERANCE)
    if found is None:
        return None
    return *found, np.linalg.norm((x - found[0]) / sizes, axis=1)


def _period_alone(problem: _Scaled, tangent: Array) -> bool:
    """Whether the period grows and the parameter rests, in the scales of the diagram."""
    period, parameter = (abs(tangent[place]) / problem.scales[place] for place in (-2, -1))
    whole = weighted_norm(problem.weights(), tangent)
    return bool(parameter <= _RESTING * period and period > _RESTING * whole)
