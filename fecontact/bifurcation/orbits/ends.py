"""Where branches of orbits end by themselves: at Hopf points and at homoclinic orbits."""

from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.newton import weighted_norm
from fecontact.bifurcation.equilibria.equilibrium import newton, sorted_eigenvalues
from fecontact.bifurcation.orbits.discretisation import Discretisation
from fecontact.core.types import Array

# Name of the test function that is zero where an orbit shrinks to an equilibrium.
VANISHING = "vanishing orbit"
# Amplitude at which a branch ends, in that of the orbit before; along curves over two parameters,
# whose equations are singular at rest, more.
_VANISHED, VANISHED_ON_CURVES = 1e-3, 0.1
# Slowest motion on an orbit, in the fastest, from which an equilibrium is looked for.
_SLOW = 0.02
# Distance of an orbit from a saddle, in amplitudes, at which it counts as homoclinic, the part of
# the period within ``_BESIDE`` amplitudes of it, and the change of the parameter in that of the
# period, both in the diagram.
_NEAREST, _MOST_TIME, _BESIDE, _RESTING = 1e-3, 0.5, 0.1, 1e-3
_TOLERANCE = 1e-10


def vanishing(problem: Discretisation, u: Array, least: float = _VANISHED) -> float:
    """Amplitude along the shape of the orbit before, in its amplitude, less the least one.

    Beyond a Hopf point the same orbits come once more, half a period later: the amplitude has then
    changed its sign.
    """
    nodes, before = problem.nodes(u), problem.reference
    weights = problem.weights()[: problem.size].reshape(before.shape)
    shape = weights * (before - before.mean(axis=0))
    return float((shape * (nodes - nodes.mean(axis=0))).sum()
                 / (shape * (before - before.mean(axis=0))).sum()) - least


def is_homoclinic(problem: Discretisation, u: Array, linearised: Any, tangent: Array) -> bool:
    """Whether an orbit stays near a saddle for most of its period, which alone changes.

    Its nearest distance from the saddle falls as exp(-l T / 2), the change of the parameter as
    exp(-l T) (Kuznetsov, Elements of Applied Bifurcation Theory, section 6.2); where the former is
    1e-3 of the amplitude, the branch has no more to tell.
    """
    d = problem.field.dimension
    sizes = problem.scales[:d]
    speed = np.linalg.norm(linearised.derivatives[0] / sizes, axis=1)
    if speed.min() > _SLOW * speed.max() or not _period_alone(problem, tangent):
        return False
    nodes, values = problem.nodes(u), problem.parameters(u)
    x, _ = problem.at_gauss_points(nodes)
    found = newton(problem.field, x[np.argmin(speed)].copy(), values, _TOLERANCE)
    if found is None:
        return False
    amplitude = float(np.linalg.norm(np.ptp(nodes, axis=0) / sizes)) / 2.0
    away = np.linalg.norm((x - found[0]) / sizes, axis=1)
    times = np.repeat(problem.widths / problem.degree, problem.degree)
    beside = float(times[away < _BESIDE * amplitude].sum())
    if away.min() > _NEAREST * amplitude or beside < _MOST_TIME:
        return False
    real = sorted_eigenvalues(found[1]).real
    return bool(real[0] > 0.0 > real[-1])


def _period_alone(problem: Discretisation, tangent: Array) -> bool:
    """Whether the period grows and the parameter rests, in the scales of the diagram."""
    period, parameter = (abs(tangent[place]) / problem.scales[place] for place in (-2, -1))
    whole = weighted_norm(problem.weights(), tangent)
    return bool(parameter <= _RESTING * period and period > _RESTING * whole)
