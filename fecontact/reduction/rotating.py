"""Rotation of a body in its modes: Coriolis, centrifugal and stress terms of the reduced body."""

from dataclasses import dataclass

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.rotation import (
    Rotation,
    centrifugal_force,
    coriolis_matrix,
)
from fecontact.fem.stress_stiffness import stress_stiffness
from fecontact.reduction.eigenmodes import FreeSystem


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ModalRotation:
    """Rotation of a body in its modes: what a basis adds to damping, stiffness and load.

    Attributes
    ----------
    speed : float
        Angular speed W of the body and its frame, positive counter-clockwise [rad/s].
    coriolis : (m, m) array
        Skew; ``W coriolis`` is part of the damping.
    stiffening : (m, m) array
        Symmetric; ``W^2 stiffening``, of the centrifugal stress and force, is part of the
        stiffness.
    load : (m,) array
        ``W^2 load`` is the centrifugal force on the undeformed body.
    """

    speed: float
    coriolis: Array
    stiffening: Array
    load: Array


def modal_rotation(
    body: ElasticBody, system: FreeSystem, rotation: Rotation, shapes: Array
) -> ModalRotation:
    """The terms of a rotation in mass-normalised shapes (2 N, m) of the body at rest.

    The stress is that of the linear static response to the centrifugal force; where supports do
    not balance it, the inertia of the rigid motion does.
    """
    m = shapes.shape[1]
    force = centrifugal_force(body, rotation.centre)
    coriolis, stiffening, load = np.zeros((m, m)), np.zeros((m, m)), np.zeros(m)
    if rotation.coriolis:
        coriolis = shapes.T @ (coriolis_matrix(body) @ shapes)
        coriolis = 0.5 * (coriolis - coriolis.T)
    if rotation.centrifugal_load:
        load = shapes.T @ force
    if rotation.spin_softening:
        stiffening -= np.eye(m)
    if rotation.stress_stiffening:
        stiffening += _stress_stiffening(body, system, force, shapes)
    return ModalRotation(rotation.speed, coriolis, stiffening, load)


def _stress_stiffening(
    body: ElasticBody, system: FreeSystem, force: Array, shapes: Array
) -> Array:
    """Geometric stiffness (m, m) of the stress under a force, and of hinges under its reactions."""
    E = body.expansion
    stretched = E @ system.deflection(E.T @ force)
    geometric = shapes.T @ (stress_stiffness(body, stretched) @ shapes)
    stiffening = np.asarray(0.5 * (geometric + geometric.T))
    rigid = E @ (system.rigid @ (system.rigid.T @ (E.T @ force)))
    reaction = (body.stiffness @ stretched - force + body.mass @ rigid).reshape(-1, 2)
    for nodes, centre, *_ in body.hinges:
        # Nodes at r run on circles: turned by an angle a they also move by -a^2 r / 2.
        arm = body.nodes[nodes] - centre
        motion = shapes.reshape(-1, 2, shapes.shape[1])[nodes]
        angle = np.einsum("i,im->m", arm[:, 0], motion[:, 1]) - np.einsum(
            "i,im->m", arm[:, 1], motion[:, 0])
        angle /= (arm**2).sum()
        stiffening -= (reaction[nodes] * arm).sum() * np.outer(angle, angle)
    return stiffening
