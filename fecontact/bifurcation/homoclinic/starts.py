"""Starts of curves of homoclinic orbits: from orbits of long periods, and from points of curves."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import damped_newton
from fecontact.bifurcation.continuation.point import BranchPoint, attributes_of
from fecontact.bifurcation.continuation.problem import sizes_of
from fecontact.bifurcation.homoclinic import open_mesh
from fecontact.bifurcation.homoclinic.problem import HomoclinicProblem
from fecontact.bifurcation.homoclinic.saddle import left_subspaces, saddle_of
from fecontact.bifurcation.orbit_methods import Collocation
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.same_orbit import beside_rest
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField

# Mesh for orbits that were not found by collocation.
_INTERVALS, _DEGREE = 80, 4
# Distance from the saddle, in the farthest one, within which an orbit has to pass it.
_NEAR = 0.3
# Samples of an orbit from which a start is taken.
_SAMPLES = 4001
_CORRECTIONS, _TOLERANCE, _LENGTHENINGS = 25, 1e-9, 4


def homoclinic_curve(
    field: VectorField, point: BranchPoint, second: str, widths: Mapping[str, float],
    scales: ArrayLike | None,
) -> tuple[HomoclinicProblem, Array, dict[str, Any]]:
    """Problem, unknowns and attributes of the curve of homoclinic orbits near an orbit.

    Arguments are those of :func:`fecontact.bifurcation.orbits.curves.codim2.orbit_curve`; the
    point is an orbit by any method, or a point of such a curve.

    Raises
    ------
    InputError
        If the orbit passes no saddle, or the field is excited.
    AnalysisError
        If no homoclinic orbit is found beside it.
    """
    known, method = point.branch.attributes, point.branch.method
    names = (second, point.branch.parameter_name)
    active = (field.index(second), field.index(names[1]))
    on_mesh = type(method) is Collocation
    if point.is_homoclinic:
        values = point._curve_values(field)
        motion, degree = None, method.degree
    else:
        values = point.parameter_values(field)
        motion, degree = point.orbit(field, _SAMPLES), method.degree if on_mesh else _DEGREE
    if field.forcing_period(values) is not None:
        raise InputError(f"{point.place} is one of an excited system, whose orbits approach no "
                         f"saddle at rest.")
    d = field.dimension
    branch_scales = np.asarray(known["scales"], dtype=float)
    sizes = branch_scales[:d] if scales is None else sizes_of(scales, branch_scales[:d])[0]
    # The parameter of the branch may be zero at the orbit, but the branch has a width in it.
    width = [widths.get(second, abs(float(values[active[0]])) or 1.0),
             widths.get(names[1], float(branch_scales[-1]))]
    if motion is None:
        mesh = np.asarray(point.values["mesh"], dtype=float)
        nodes = open_mesh.nodes_of(point.u, d)
        rest = np.asarray(point.values["saddle"], dtype=float)
        time = float(point.values["time"])
    else:
        given = len(point.values["mesh"]) - 1 if on_mesh else _INTERVALS
        nodes, rest, mesh, time = _cut_open(field, values, motion, point, given, degree, sizes)
    _, J, _ = field.derivatives(np.zeros(1), rest[None], values)
    jacobian = J[0] * sizes / sizes[:, None]
    saddle_of(jacobian)
    problem = HomoclinicProblem(field, values, active[1], mesh, degree, time, nodes,
                                np.concatenate([sizes, width]), left_subspaces(jacobian),
                                active[0], intervals=len(mesh) - 1)
    u = np.concatenate([nodes.reshape(-1), rest, values[list(active)]])
    problem, u = _converged(problem, u, point)
    return problem, u, attributes_of(field, values) | {
        "scales": problem.scales, "method": Collocation(len(mesh) - 1, degree)}


def _cut_open(
    field: VectorField, values: Array, motion: PeriodicMotion, point: BranchPoint, intervals: int,
    degree: int, sizes: Array,
) -> tuple[Array, Array, Array, float]:
    """Nodes, saddle, mesh and time of an orbit that begins and ends next to a saddle."""
    times, states = motion.times - motion.times[0], np.ascontiguousarray(motion.states)
    found = beside_rest(field, values, states, sizes)
    if found is None or found[2].min() > _NEAR * found[2].max():
        raise InputError(f"{point.place} passes no equilibrium, as orbits beside a homoclinic one "
                         f"do; follow the branch to a longer period first.")
    rest, jacobian, away = found
    if not jacobian.size or not (np.linalg.eigvals(jacobian).real > 0.0).any():
        raise InputError(f"{point.place} is slowest beside an equilibrium that is no saddle; "
                         f"follow the branch to a longer period first.")
    time, begin = float(times[-1]), float(times[int(np.argmin(away))])

    def sampled(phases: Array) -> Array:
        places = np.mod(begin + phases * time, time)
        return np.stack([np.interp(places, times, column) for column in states.T], axis=1)

    fine = np.linspace(0.0, 1.0, 4 * intervals + 1)
    mesh = open_mesh.equidistributed(fine, sampled(open_mesh.node_times(fine, degree)), degree,
                                     intervals)
    return sampled(open_mesh.node_times(mesh, degree)), rest, mesh, time


def _converged(
    problem: HomoclinicProblem, u: Array, point: BranchPoint
) -> tuple[HomoclinicProblem, Array]:
    """The homoclinic orbit at the same second parameter, on an interval and a mesh made for it.

    Raises
    ------
    AnalysisError
        If Newton's method does not converge.
    """
    turned = np.zeros_like(u)
    for _ in range(_LENGTHENINGS):
        u = _newton(problem, u, point)
        before = problem.time
        problem, u, turned = problem.adapted(u, turned)
        if problem.time == before:
            break
    return problem, _newton(problem, u, point)


def _newton(problem: HomoclinicProblem, u: Array, point: BranchPoint) -> Array:
    amplitude = problem.amplitude(u)
    u, _, converged = damped_newton(problem, u, unit(len(u), -2), _TOLERANCE, _CORRECTIONS)
    # A step may lead to the saddle itself.
    if converged and problem.amplitude(u) >= 0.1 * amplitude:
        return u
    raise AnalysisError(f"{point.place}: no homoclinic orbit was found beside it; follow the "
                        f"branch to a longer period, or take more intervals.")
