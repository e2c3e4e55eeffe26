"""Static displacement and stress of an elastic body without contact, by its finite elements."""

from collections.abc import Mapping
from functools import cache

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, require_finite
from fecontact.core.types import Array, Coordinates
from fecontact.fem.body_forces import boundary_forces, inertia_forces
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import BodyFields, StressAxes, stress_of
from fecontact.fem.points import Place, place_rows
from fecontact.fem.rotation import Rotation, centrifugal_force
from fecontact.fem.thermal import (
    Temperature,
    held_stress,
    nodal_temperatures,
    thermal_forces,
)
from fecontact.laws.excitation import Load
from fecontact.laws.signals.base import value_at
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.system.loads import load_parts

# Largest resultant of the loads, relative to their size, that a free direction may have.
_BALANCED = 1e-9


def static_solution(
    body: ElasticBody,
    load: Load,
    *,
    points: Mapping[str, Place] | None = None,
    time: float = 0.0,
    rotation: Rotation | None = None,
    stress_axes: StressAxes = "global",
    temperature: Temperature | None = None,
) -> BodyFields:
    """Displacement and stress of a body at rest under loads, ``K u = f`` with its supports.

    The body is not in contact; for the rest state of a contact system see
    :func:`~fecontact.equilibrium` and :meth:`~fecontact.ModalBasis.fields`. A body with
    rigid modes must be under loads in balance; its displacement has no rigid part then.

    Parameters
    ----------
    body : ElasticBody
        With supports that hold it, or none.
    load : Load
        Forces at points of the mesh or at places, gravity, base acceleration, and loads on named
        boundaries. Those in time act with their values at ``time``.
    points : mapping of name to place, optional
        Further names of points, as for :func:`~fecontact.modal_basis`, 'C' among them.
    time : float
        [s]
    rotation : Rotation, optional
        Adds the centrifugal load of the undeformed body at this speed; loads turn with the body.
    stress_axes : 'global' or 'material'
        Axes of the stresses in anisotropic materials: x, y, z or those of the material.
    temperature : float, (N,) array or function of the coordinates, optional
        Change from the state without stress [K], of the body or at its displacement nodes; see
        :mod:`fecontact.fem.thermal`.

    Raises
    ------
    InputError, MeshError
        For names that the mesh does not have, places outside the body, numbers of contact nodes.
    AnalysisError
        If the loads push the body in a direction in which nothing holds it.
    """
    require_kind("static_solution", ElasticBody, body=body)
    require_kind("static_solution", Load, load=load)
    require_kind("static_solution", Mapping, points={} if points is None else points)
    require_finite("static_solution", time=time)
    system = FreeSystem.of(body)
    require_kind("static_solution", (Rotation, type(None)), rotation=rotation)
    force = nodal_forces(body, load, points or {}, time)
    if rotation is not None:
        force += rotation.speed**2 * centrifugal_force(body, rotation)
    warm = None if temperature is None else nodal_temperatures(body, temperature)
    if warm is not None:
        force = force + thermal_forces(body, warm)
    _require_balance(body, body.expansion @ system.rigid, force)
    u = np.asarray(body.expansion @ system.deflection(body.expansion.T @ force))
    stress = stress_of(body, u[:, None], stress_axes)[:, :, 0]
    if warm is not None:
        stress = stress + held_stress(body, warm)
    return BodyFields(body.nodes, body.elements, u.reshape(-1, body.mesh.dimension), stress,
                      warm)


def nodal_forces(
    body: ElasticBody, load: Load, points: Mapping[str, Place], time: float
) -> Array:
    """Nodal forces (d N,) of a load at a time; errors as of :func:`static_solution`."""

    def at(point: str | int | Coordinates) -> Array:
        if isinstance(point, int):
            raise InputError(f"static_solution: a force at contact node {point} cannot be placed, "
                             f"as there are no contact nodes; give its name or place.")
        place = points.get(point, point) if isinstance(point, str) else point
        name = point if isinstance(point, str) else "of a force"
        return np.asarray(place_rows(body, place, name).matrix.toarray())

    @cache
    def inertia(what: str) -> Array:
        return inertia_forces(body).T

    components = ("x", "y", "phi") if body.dimension == 2 else (
        "x", "y", "z", "phi_x", "phi_y", "phi_z")
    total = np.zeros(body.nodes.size)
    for part in load_parts(load, components, at, inertia,
                           lambda name: boundary_forces(body, name).T):
        total += value_at(part.value, time) * part.row
    return total


def _require_balance(body: ElasticBody, rigid: Array, force: Array) -> None:
    """Raise AnalysisError if nodal forces (d N,) have a resultant along a rigid mode (d N, r)."""
    if not rigid.shape[1] or not force.any():
        return
    # Each node counts with the lengths of its force and motion: directions without load hold
    # round-off of the others.
    d = body.dimension
    forces, motions = force.reshape(-1, d), rigid.reshape(-1, d, rigid.shape[1])
    size = np.linalg.norm(forces, axis=1) @ np.linalg.norm(motions, axis=1)
    loaded = np.abs(rigid.T @ force) > _BALANCED * size
    if not loaded.any():
        return
    mode = motions[:, :, int(np.argmax(loaded))]
    turns = np.ptp(mode, axis=0).max() > 1e-6 * np.abs(mode).max()
    way = "a rotation" if turns else f"a translation in {'xyz'[int(np.argmax(np.abs(mode[0])))]}"
    raise AnalysisError(f"There is no static solution: nothing holds the body against {way}, in "
                        f"which the loads push it; support it with fixed, or balance the loads.")
