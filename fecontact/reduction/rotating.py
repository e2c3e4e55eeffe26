"""Rotation of a body in its modes: Coriolis, centrifugal and stress terms of the reduced body."""

from dataclasses import dataclass, replace

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.rotation import (
    Rotation,
    centrifugal_force,
    coriolis_matrix,
    softening_matrix,
)
from fecontact.fem.stress_stiffness import stress_stiffness
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.prestress import refuse_circles


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ModalRotation:
    """Rotation of a body in its modes: what a basis adds to damping, stiffness and load.

    Attributes
    ----------
    speed : float
        Angular speed W of the body and its frame [rad/s].
    coriolis : (m, m) array
        Skew; ``W coriolis`` is part of the damping.
    stiffening : (m, m) array
        Symmetric; ``W^2 stiffening``, of the centrifugal stress and force, is part of the
        stiffness.
    load : (m,) array
        ``W^2 load`` is the centrifugal force on the undeformed body.
    axis, centre : (x, y, z)
        Direction of the axis, and a point of it [m].
    stressed : bool
        Whether the stiffening includes that of the stress of the body, held by its supports alone.
    standing : bool
        Whether the frame is that at rest.
    """

    speed: float
    coriolis: Array
    stiffening: Array
    load: Array
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    stressed: bool = False
    standing: bool = False

    def in_modes(self, modes: Array) -> "ModalRotation":
        """Rotation in other coordinates p, ``q = modes p`` with modes (m, k)."""
        return replace(self, coriolis=modes.T @ self.coriolis @ modes,
                       stiffening=modes.T @ self.stiffening @ modes, load=self.load @ modes)

    def is_about_that_of(self, other: "ModalRotation") -> bool:
        """True if both have the same axis, speed and frame."""
        apart = np.cross(np.subtract(self.centre, other.centre), self.axis)
        size = 1e-9 * (1.0 + np.abs(self.centre).max())
        return bool(self.speed == other.speed and self.standing == other.standing
                    and np.abs(apart).max() <= size
                    and np.allclose(self.axis, other.axis, rtol=0.0, atol=1e-9))


def modal_rotation(
    body: ElasticBody, system: FreeSystem, rotation: Rotation, shapes: Array,
    deflected: Integers | None = None,
) -> ModalRotation:
    """The terms of a rotation in mass-normalised shapes (d N, m) of the body at rest.

    The stress is that of the linear static response to the centrifugal force; where supports do
    not balance it, the inertia of the rigid motion does. ``deflected`` are modes with forces of
    large deflections, by which the load stiffens them: their stretching is a coordinate.

    Raises
    ------
    InputError
        For couplings, masses and springs at points, and an axis that a plane body cannot have.
    """
    refuse_circles(body, "rotation")
    if body.added:
        raise InputError("rotation is that of bodies without masses and springs at points; leave "
                         "it out, or give attachments = ().")
    m = shapes.shape[1]
    force = centrifugal_force(body, rotation)
    coriolis, stiffening, load = np.zeros((m, m)), np.zeros((m, m)), np.zeros(m)
    if rotation.coriolis:
        coriolis = shapes.T @ (coriolis_matrix(body, rotation) @ shapes)
        coriolis = 0.5 * (coriolis - coriolis.T)
    if rotation.centrifugal_load:
        load = shapes.T @ force
    if rotation.spin_softening:
        softening = shapes.T @ (softening_matrix(body, rotation) @ shapes)
        stiffening -= 0.5 * (softening + softening.T)
    if rotation.stress_stiffening:
        stressed = _stress_stiffening(body, system, force, shapes)
        if deflected is not None:
            stressed[np.ix_(deflected, deflected)] = 0.0
        stiffening += stressed
    return ModalRotation(rotation.speed, coriolis, stiffening, load, rotation.axis,
                         (*rotation.centre, 0.0)[:3], rotation.stress_stiffening,
                         rotation.frame == "standing")


def _stress_stiffening(
    body: ElasticBody, system: FreeSystem, force: Array, shapes: Array
) -> Array:
    """Geometric stiffness (m, m) of the stress under a force, and of hinges under its reactions."""
    E, d = body.expansion, body.dimension
    stretched = E @ system.deflection(E.T @ force)
    geometric = shapes.T @ (stress_stiffness(body, stretched) @ shapes)
    stiffening = np.asarray(0.5 * (geometric + geometric.T))
    rigid = E @ (system.rigid @ (system.rigid.T @ (E.T @ force)))
    reaction = (body.stiffness @ stretched - force + body.mass @ rigid).reshape(-1, d)
    for nodes, centre, axis in body.hinges:
        # Nodes at r run on circles: turned by an angle a they also move by -a^2 r / 2.
        arm = body.nodes[nodes] - centre
        if d == 3:
            arm = arm - np.outer(arm @ axis, axis)
        turned = np.column_stack([-arm[:, 1], arm[:, 0]]) if d == 2 else np.cross(axis, arm)
        motion = shapes.reshape(-1, d, shapes.shape[1])[nodes]
        angle = np.einsum("ik,ikm->m", turned, motion) / (arm**2).sum()
        stiffening -= (reaction[nodes] * arm).sum() * np.outer(angle, angle)
    return stiffening
