"""Branches of orbits by shooting that begin on others: those of twice the period."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.branch import Branch, BranchPoint
from fecontact.bifurcation.contact_field import ContactField
from fecontact.bifurcation.follow import follow
from fecontact.bifurcation.orbit_options import settings_of
from fecontact.bifurcation.problem import Settings
from fecontact.bifurcation.shooting import Shooting, Shot
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
