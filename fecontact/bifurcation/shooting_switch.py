"""Branches of orbits by shooting that begin on others: at Hopf points and period doublings."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation import orbit_starts
from fecontact.bifurcation.branch import Branch, BranchPoint
from fecontact.bifurcation.contact_field import ContactField
from fecontact.bifurcation.equilibria import Equilibrium
from fecontact.bifurcation.equilibrium_branch import default_scales
from fecontact.bifurcation.follow import follow
from fecontact.bifurcation.interpolation import interpolate
from fecontact.bifurcation.orbit_options import settings_of, sizes_of, width_of
from fecontact.bifurcation.problem import Settings
from fecontact.bifurcation.shooting import Shooting, Shot, shooting_from
from fecontact.errors import InputError

Array = NDArray[np.float64]


def restored_shooting(
    field: ContactField, branch: Branch, point: BranchPoint
) -> tuple[Shooting, Array]:
    """Problem and unknowns of a point of a branch of :func:`orbits_by_shooting`.

    Raises
    ------
    InputError
        If the branch was not found by shooting.
    """
    known = branch.attributes
    if "segments" not in known or "mesh" not in point.values:
        raise InputError("The branch is not one of periodic orbits by shooting.")
    values = np.array(known["parameter_values"], dtype=float)
    free = field.index(branch.name)
    values[free] = point.parameter
    problem = Shooting(field, values, free, np.asarray(point.values["mesh"], dtype=float),
                       point.u[: field.dimension].copy(),
                       np.asarray(known["scales"], dtype=float), int(known["periods"]),
                       float(known.get("rtol", 1e-9)))
    return problem, point.u


def hopf_orbits_by_shooting(
    field: ContactField, branch: Branch, point: BranchPoint, *, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None, segments: int = 4, rtol: float = 1e-9,
    scales: ArrayLike | None = None, width: float | None = None,
) -> Branch:
    """The branch of orbits that is born at a Hopf point, by shooting.

    For orbits that come to stick on steep friction; the arguments are those of
    :func:`fecontact.bifurcation.orbits.orbits_from_hopf` and
    :func:`fecontact.bifurcation.shooting_branch.orbits_by_shooting`, the branch that of the latter.

    Raises
    ------
    InputError
        If the point is no Hopf point, or there are no orbits near it.
    """
    if point.kind != "Hopf":
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g}, "
                         f"{point.kind or 'a regular point'!r}, is no Hopf point.")
    free = field.index(branch.name)
    values = np.array(branch.attributes["parameter_values"], dtype=float)
    values[free] = point.parameter
    state = np.ascontiguousarray(point.u[:-1])
    chosen = settings_of(settings, bounds)
    sizes, _ = sizes_of(scales, default_scales(Equilibrium(field, values, state)))
    found, u, leaving = orbit_starts.from_hopf(
        field, values, free, state, float(point.details["angular_frequency"]),
        point.details["eigenvector"], 50, 4,
        np.append(sizes, width_of(width, chosen, point.parameter)))
    problem, start = shooting_from(found, u, segments, rtol)
    shape = interpolate(found.mesh, found.nodes(leaving), problem.mesh[:-1])
    tangent = np.concatenate([shape.reshape(-1), leaving[found.size :]])
    attributes = {"state_names": list(field.state_names),
                  "parameter_names": list(field.parameters), "parameter_values": values,
                  "scales": problem.scales, "segments": segments, "periods": 1, "rtol": rtol}
    return follow(problem, start, chosen, name=branch.name,
                  tangent=tangent / np.sqrt(problem.weights() @ tangent**2),
                  attributes=attributes)


def doubled_by_shooting(
    field: ContactField, branch: Branch, point: BranchPoint, settings: Settings | None = None,
    bounds: tuple[float, float] | None = None,
) -> Branch:
    """The branch of orbits of twice the period that begins at a period doubling.

    They leave along the eigenvector of the multiplier -1, carried along the orbit; the second
    round takes it with the other sign. The arguments are those of
    :func:`fecontact.bifurcation.orbits.orbits_beyond`, the branch that of
    :func:`fecontact.bifurcation.shooting_branch.orbits_by_shooting`.

    Raises
    ------
    InputError
        If the point is no period doubling of such a branch.
    """
    if point.kind != "period doubling":
        raise InputError(f"The point at {branch.name} = {point.parameter:.6g}, "
                         f"{point.kind or 'a regular point'!r}, is no period doubling.")
    problem, u = restored_shooting(field, branch, point)
    twice, start, tangent = _doubled(problem, u)
    chosen = settings_of(settings, bounds)
    attributes = {**branch.attributes, "parameter_values": problem.values,
                  "scales": twice.scales, "periods": twice.periods,
                  "segments": len(twice.mesh) - 1}
    return follow(twice, start + chosen.step * tangent, chosen, name=branch.name, tangent=tangent,
                  attributes=attributes)


def _doubled(problem: Shooting, u: Array) -> tuple[Shooting, Array, Array]:
    """The orbit run through twice, and the direction (of length one) in which it parts."""
    starts = problem.starts(u)
    rounds = [run.monodromy for run in Shot(problem, u).runs]
    around = np.eye(starts.shape[1])
    for matrix in rounds:
        around = matrix @ around
    values, vectors = np.linalg.eig(around)
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    carried = [vector]
    for matrix in rounds[:-1]:
        carried.append(matrix @ carried[-1])
    mesh = np.concatenate([problem.mesh[:-1], 1.0 + problem.mesh]) / 2.0
    scales = problem.scales.copy()
    scales[-2] *= 2.0
    twice = replace(problem, mesh=mesh, scales=scales, periods=2 * problem.periods)
    tail = u[-problem.common:].copy()
    if problem.autonomous:
        tail[0] *= 2.0
    start = np.concatenate([starts.reshape(-1), starts.reshape(-1), tail])
    shape = np.concatenate(carried)
    tangent = np.concatenate([shape, -shape, np.zeros(problem.common)])
    return twice, start, tangent / np.sqrt(twice.weights() @ tangent**2)
