"""Folds of the orbits of four periods that begin at a resonance 1:4."""

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import FoldPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions
from fecontact.bifurcation.orbit_methods import Collocation
from fecontact.bifurcation.orbits.branches import orbit_branch
from fecontact.bifurcation.orbits.codim2 import orbit_curve
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.curves.singularity import of_torus
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.normal_forms import Expansion
from fecontact.core.errors import AnalysisError, FecontactError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Distances from the point, in widths of the diagram, at which orbits of four periods are sought.
_AWAY = (0.01, 0.03, 0.003)
# Step of the differences of the normal form, in ranges of the states, and of those of the
# multipliers over both parameters, in widths of the diagram.
_STEP, _SHIFT = 1e-3, 1e-4
# Newton steps to the orbit beside the point, and their length at its end.
_ITERATIONS, _TOLERANCE = 8, 1e-9
_SEARCH = ContinuationOptions(step=1e-3, largest_step=0.02, points=200, stop_at=("fold",))


def folds_at_quarter(
    field: VectorField, point: BranchPoint, single: BranchPoint, parameter: str, side: float
) -> FoldPoint:
    """A fold of orbits of four periods beside a resonance 1:4 of a curve of tori.

    With the amplitude z of the vector v of the multiplier i, the fourth iterate goes along
    z' = e z + C z |z|^2 + D conj(z)^3. For |C| > |D| it has no or eight rest points besides zero;
    the folds e = -t C (1 +- i tan a), t > 0, sin a = |D / C|, lie between (Kuznetsov, Elements of
    Applied Bifurcation Theory, section 9.5.4). Between both, orbits start at the smaller rest
    points of e = -t C, and are followed to the fold at the ``side`` of e with the larger angle (1)
    or the smaller one (-1). ``single`` is the point on a branch over the first parameter.

    Raises
    ------
    AnalysisError
        If |C| <= |D|, or no fold is found.
    """
    first = point.branch.parameter_name
    width = dict(zip((parameter, first),
                     np.asarray(point.branch.attributes["scales"])[-2:].tolist(), strict=True))
    curve, u, _ = orbit_curve(field, single, parameter, width, None, "Neimark-Sacker")
    orbit, widths = curve.orbit, np.array([width[parameter], width[first]])
    linearised = orbit.linearise(u)
    found = of_torus(linearised, 0.5 * np.pi)
    C, D = Expansion(orbit, u, linearised, found).quarter(_STEP)
    if not abs(C) > abs(D):
        raise AnalysisError(f"{point.place}: no folds of orbits of four periods begin there; its "
                            f"normal form has |C / D| = {abs(C / D):.4g}, and must exceed 1.")
    # The exponent e per period over both parameters, in widths.
    slopes = np.array([(_exponent(orbit, u, shift * widths) - _exponent(orbit, u, -shift * widths))
                       / (2.0 * _SHIFT) for shift in _SHIFT * np.eye(2)])
    e_of = np.array([slopes.real, slopes.imag])
    towards = np.linalg.solve(e_of, [-(C / abs(C)).real, -(C / abs(C)).imag])
    towards /= np.linalg.norm(towards)
    across = first if abs(towards[0]) > abs(towards[1]) else parameter
    place = 0 if across == parameter else 1
    turn = np.exp(0.25j * np.angle(D / C))
    V = found.terms[0].states + 1j * found.terms[1].states
    last: FecontactError | None = None
    for away in _AWAY:
        size = float(np.sqrt(abs(complex(*(e_of @ (away * towards)))) / (abs(C) + abs(D))))
        try:
            begin = _quadrupled(orbit, _at(orbit, u, away * towards * widths), size * turn * V)
            branch = orbit_branch(
                field, begin, across, method=Collocation(4 * orbit.intervals, orbit.degree),
                options=_SEARCH, scales=orbit.scales[: field.dimension], width=width[across],
                bounds=_about(begin, field.index(across), width[across]), both=True)
        except FecontactError as error:
            last = error
            continue
        for end in branch.of_kind("fold"):
            shift = away * towards
            shift[place] = (end.parameter - u[place - 2]) / width[across]
            e = complex(*(e_of @ shift))
            if (e / -C).imag * side > 0.0:
                return end
    raise AnalysisError(f"{point.place}: no fold of orbits of four periods was found beside it; "
                        f"follow these from a run near it.") from last


def _about(motion: PeriodicMotion, index: int, width: float) -> tuple[float, float]:
    assert motion.parameter_values is not None
    value = float(motion.parameter_values[index])
    return value - 0.3 * width, value + 0.3 * width


def _at(orbit: CollocationProblem, u: Array, shift: Array) -> Array:
    """The orbit with both parameters moved."""
    u = u.copy()
    u[-2:] += shift
    for _ in range(_ITERATIONS):
        linearised = orbit.linearise(u)
        step = linearised.at_fixed_parameters().solve(np.append(-linearised.residual, [0.0, 0.0]))
        u = u + step
        if float(np.sqrt(orbit.weights() @ step**2)) < _TOLERANCE:
            return u
    raise AnalysisError("The orbit beside the resonance was not found.")


def _exponent(orbit: CollocationProblem, u: Array, shift: Array) -> complex:
    """Exponent e of the multiplier i exp(e), with both parameters moved."""
    pair = of_torus(orbit.linearise(_at(orbit, u, shift)), 0.5 * np.pi).pair
    assert pair is not None
    return complex(np.log(pair[0] / 1j))


def _quadrupled(orbit: CollocationProblem, u: Array, displaced: Array) -> PeriodicMotion:
    """Four periods of x + 2 Re (displaced i^k) in the k-th period, from the Gauss points."""
    x, _ = orbit.at_gauss_points(orbit.nodes(u))
    period, values = orbit.period(u), orbit.parameters(u)
    times = np.concatenate([(k + orbit.times) * period for k in range(4)])
    states = np.concatenate([x + 2.0 * (displaced * 1j**k).real for k in range(4)])
    forced = 1 if orbit.autonomous else 4 * orbit.periods
    return PeriodicMotion(np.append(times, times[0] + 4.0 * period),
                          np.vstack([states, states[:1]]), 4.0 * period, forced, values)
