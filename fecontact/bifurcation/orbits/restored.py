"""Continuation problems of orbits, restored from points of branches."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, sizes_of
from fecontact.bifurcation.continuation.pseudo_arclength import continuation
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.harmonic.starts import restored as restored_balance
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.orbit_points import (
    BY_COLLOCATION,
    BY_HARMONICS,
    BY_SHOOTING,
    OrbitPoints,
    holder_of,
    orbit_points_of,
)
from fecontact.bifurcation.orbits.shooting import ShootingProblem
from fecontact.core.errors import InputError, require_positive
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField

P = TypeVar("P", CollocationProblem, ShootingProblem, HarmonicProblem)


def restored(
    field: VectorField, point: BranchPoint
) -> tuple[CollocationProblem, Array, Array]:
    """Problem, unknowns and tangent of an orbit by collocation, to continue from.

    Raises
    ------
    InputError
        If the point is not such an orbit, or belongs to another field.
    """
    known = point.branch.attributes
    if holder_of(point) is not BY_COLLOCATION:
        raise InputError(f"{point.place} is no periodic orbit by collocation; follow a branch from "
                         f"it by orbit_branch(field, point, method=Collocation()), and take a "
                         f"point of that.")
    values, free = point.parameter_values(field), field.index(point.branch.parameter_name)
    mesh, degree, d = np.asarray(point.values["mesh"]), point.branch.method.degree, field.dimension
    nodes = point.u[: (len(mesh) - 1) * degree * d].reshape(-1, d).copy()
    problem = CollocationProblem(field, values, free, mesh, degree, nodes,
                                 np.asarray(known["scales"]), int(known["periods"]))
    return problem, point.u, point.tangent


def restored_shooting(
    field: VectorField, point: BranchPoint
) -> tuple[ShootingProblem, Array, Array]:
    """Problem, unknowns and tangent of an orbit by shooting.

    Raises
    ------
    InputError
        If the point is not such an orbit or belongs to another field, or the field is not that of
        a contact system.
    """
    known = point.branch.attributes
    method = point.branch.method
    if holder_of(point) is not BY_SHOOTING:
        raise InputError(f"{point.place} is no periodic orbit by shooting.")
    values, free = point.parameter_values(field), field.index(point.branch.parameter_name)
    if not isinstance(field, ContactField):
        raise InputError(f"{point.place} was found by shooting, which runs contact systems; make "
                         f"the field with contact_field.")
    problem = ShootingProblem(field, values, free, np.asarray(point.values["mesh"], dtype=float),
                              point.u[: field.dimension].copy(),
                              np.asarray(known["scales"], dtype=float), int(known["periods"]),
                              method.rtol, method.derivative_rtol, method.solver)
    return problem, point.u, point.tangent


def restored_orbit(
    field: VectorField, point: BranchPoint
) -> tuple[Any, Array, Array]:
    """Problem, unknowns and tangent of an orbit, by its own method."""
    return _RESTORED[orbit_points_of(point)](field, point)


def continued(
    field: VectorField, point: BranchPoint, sign: float, options: ContinuationOptions
) -> Iterator[BranchPoint]:
    """Points from an orbit on, forward along its branch for sign 1 and back for -1.

    Set-valued orbits go from event to event where that is possible, as their branches do.
    """
    further = _FURTHER.get(orbit_points_of(point), _along)
    return further(*restored_orbit(field, point), sign, options)


def _along(
    problem: Any, u: Array, tangent: Array, sign: float, options: ContinuationOptions
) -> Iterator[BranchPoint]:
    return continuation(problem, u, options, tangent=sign * tangent)


def _along_runs(
    problem: ShootingProblem, u: Array, tangent: Array, sign: float, options: ContinuationOptions
) -> Iterator[BranchPoint]:
    from fecontact.bifurcation.events.starts import as_shot, orbit_of

    found = None if problem.solver.smooth else orbit_of(problem, u)[0]
    if found is None:
        return _along(problem, u, tangent, sign, options)
    ahead = float(np.copysign(1.0, sign * tangent[-1]))
    return (as_shot(found[0], each) for each in continuation(*found, options, direction=ahead))


def rescaled(problem: P, scales: ArrayLike | None, width: float | None) -> P:
    """The problem with other scales of the states and another width of the diagram, if given."""
    if scales is None and width is None:
        return problem
    changed, d = problem.scales.copy(), problem.field.dimension
    if scales is not None:
        changed[:d] = sizes_of(scales, changed[:d])[0]
    if width is not None:
        require_positive("A branch", width=width)
        changed[-1] = width
    return replace(problem, scales=changed)


_RESTORED: Mapping[OrbitPoints, Callable[..., tuple[Any, Array, Array]]] = {
    BY_COLLOCATION: restored, BY_SHOOTING: restored_shooting, BY_HARMONICS: restored_balance}
_FURTHER: Mapping[OrbitPoints, Callable[..., Iterator[BranchPoint]]] = {BY_SHOOTING: _along_runs}
