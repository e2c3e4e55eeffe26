"""Rotation of a body in its modes: Coriolis, centrifugal and stress terms of the reduced body."""

import numpy as np

from fecontact.core.errors import InputError
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
from fecontact.reduction.modal_rotation import ModalRotation
from fecontact.reduction.prestress import refuse_circles


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
