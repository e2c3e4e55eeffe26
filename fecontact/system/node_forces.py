"""Forces at a contact node, with their derivatives: where compiled code evaluates contact laws.

In the plane friction has one component and may be a law of one direction; in space it has two. All
else is a sum over the tangents. ``force`` and ``rates`` are what friction says of a node, in the
order of :mod:`fecontact.laws.signatures`: R and its derivatives for each tangent, and the rates of
internal variables with theirs.
"""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper, kernel
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.core.simd.vectors import everywhere, select, somewhere
from fecontact.laws.friction.planar import direction
from fecontact.laws.signatures import friction_at, ground_at, memory_at, normal_at, planar_at
from fecontact.system.nodes import NodeContact, most_memory, node_contact


class NodeForces(NamedTuple):
    """Normal force F of a node [N], the force that friction sees of it [N], and the contact."""

    normal: float
    pressing: float
    contact: NodeContact


@helper
def friction_entries(states, s):
    """Number of entries of friction's ``force`` with so many internal variables."""
    d = s.rows.shape[1]
    return (d - 1) * (d + 1 + states)


@helper
def force_workspace(s):
    """Arrays for what a friction law says at a node of a system: ``force`` and ``rates``."""
    states = most_memory(s)
    return (np.empty(friction_entries(states, s)),
            np.empty((states, s.rows.shape[1] + 1 + states)))


@helper
def friction_entry(tangent, states):
    """First place in ``force`` of what belongs to the friction force along a tangent."""
    return 4 + states if tangent else 0


@helper
def slip_entry(tangent, states):
    """Place of the derivative to the slip velocity along a tangent, for a force or for a rate."""
    return 3 + states if tangent else 1


@helper
def normal_force(j, u, v, s):
    """Normal force of node j at a penetration and its rate, and its derivatives to these."""
    return normal_force_with(s.normal_parameters[j], j, u, v, s)


@helper
def normal_force_with(p, j, u, v, s):
    """Normal force of node j, and its derivatives, by its law with parameters p."""
    return normal_at(s.normal[j])(u, v, p)


@helper
def friction_scale(j, contact, s):
    """Variation of friction along the ground under node j, and its slopes along the tangents."""
    if s.friction_scale == 0 or not s.on_ground[j]:
        return 1.0, (0.0, 0.0)
    a, b = s.wave_direction[0], s.wave_direction[1]
    scale, slope, _ = ground_at(s.friction_scale)(
        a * contact.place[0] + b * contact.place[1], s.friction_scale_parameters)
    return scale, (a * slope, b * slope)


@helper
def pressing_force(j, contact, F, s):
    """The force that friction sees under a normal force: |F| times the ground's variation."""
    if everywhere(F == 0.0):
        return abs(F)
    return abs(F) * friction_scale(j, contact, s)[0]


@helper
def plane_friction(j, slip, pressing, s):
    """R, dR/dv and dR/dF of a law of one direction without memory, at node j."""
    return friction_at(s.friction[j])(slip, pressing, s.friction_parameters[j])


@helper
def friction_along(j, e, slip, pressing, s):
    """Friction force of node j against a slip velocity along the unit vector e, and derivatives.

    By a law without memory; in the plane e is 1 or -1, and the law may differ for these.
    """
    if s.rows.shape[1] == 2 and e[0] < 0.0:
        R, R_v, R_F = plane_friction(j, -slip, pressing, s)
        return -R, R_v, -R_F
    return plane_friction(j, slip, pressing, s)


@helper
def set_friction(j, slip, pressing, z, p, s, force, rates):
    """Fill ``force`` and ``rates`` with the friction of node j, by its law with parameters p."""
    if s.rows.shape[1] > 2:
        planar_at(s.planar[j])(s.friction[j], slip[0], slip[1], pressing, z, p, force, rates)
    elif s.memory[j] > 0:
        memory_at(s.friction[j])(slip[0], pressing, z, p, force, rates)
    elif somewhere(pressing != 0.0):
        R, R_v, R_F = friction_at(s.friction[j])(slip[0], pressing, p)
        force[0] = select(pressing != 0.0, R, 0.0)
        force[1] = select(pressing != 0.0, R_v, 0.0)
        force[2] = select(pressing != 0.0, R_F, 0.0)
    else:
        force[0], force[1], force[2] = 0.0, 0.0, 0.0


@helper
def friction_onset(j, slip, s):
    """dR/dF along both tangents of friction without memory, where the normal force is zero."""
    p = s.friction_parameters[j]
    if s.rows.shape[1] == 2:
        return friction_at(s.friction[j])(slip[0], 0.0, p)[2], 0.0
    speed, e1, e2 = direction(slip[0], slip[1], 0.0, 0.0)
    by_force = friction_at(s.friction[j])(speed, 0.0, p)[2]
    return by_force * e1, by_force * e2


@helper
def node_forces(j, motion, moved, z, s, force, rates):
    """Evaluate node j: its :class:`NodeForces`; ``force`` and ``rates`` are filled by friction."""
    contact = node_contact(j, motion, moved, s)
    F = normal_force(j, contact.penetration, contact.rate, s)[0]
    pressing = pressing_force(j, contact, F, s)
    set_friction(j, contact.slip, pressing, z, s.friction_parameters[j], s, force, rates)
    return NodeForces(F, pressing, contact)


@helper
def tangent_force(F, R, slope, s):
    """Force of a node against a tangent: friction, and the contact force along the surface."""
    return R + F * slope if s.follows_surface else R


@helper
def axis_force(axis, node, force, rates, s):
    """Force on a node along one of its axes: F, or along a tangent -T."""
    if axis == 1:
        return node.normal
    tangent = axis // 2
    R = force[friction_entry(tangent, len(rates))]
    return -tangent_force(node.normal, R, node.contact.slope[tangent], s)


@helper
def normal_gradients(j, contact, s, out):
    """F of node j and the force that friction sees under it.

    Fills out[1] and out[d] with their derivatives to displacements and velocities along the axes.
    """
    d, slip = s.rows.shape[1], contact.slip
    F, F_u, F_v = normal_force(j, contact.penetration, contact.rate, s)
    out[1, 1], out[1, d + 1] = -F_u, -F_v
    for tangent in range(d - 1):
        axis, slope, bend = 2 * tangent, contact.slope[tangent], contact.curvature[tangent]
        out[1, axis] = F_u * slope + F_v * (bend[0] * slip[0] + bend[1] * slip[1])
        out[1, d + axis] = F_v * slope
    size, scale, rise = abs(F), 1.0, (0.0, 0.0)
    if somewhere(F != 0.0):
        scale, rise = friction_scale(j, contact, s)
    sign = select(F >= 0.0, scale, -scale)
    for k in range(2 * d):
        out[d, k] = sign * out[1, k]
    for tangent in range(d - 1):
        out[d, 2 * tangent] += rise[tangent] * size
    return F, scale * size


@helper
def node_gradients(j, motion, moved, z, s, force, rates, out):
    """Evaluate node j as :func:`node_forces`, with the derivatives of its forces.

    Fills out (d + 1, 2 d) with the derivatives of the forces on the node along its axes, -T, F and
    in space -T_2, and last of the force that friction sees, to displacements and velocities along
    the axes.
    """
    contact = node_contact(j, motion, moved, s)
    F, pressing = normal_gradients(j, contact, s, out)
    set_friction(j, contact.slip, pressing, z, s.friction_parameters[j], s, force, rates)
    d, states = s.rows.shape[1], len(rates)
    for tangent in range(d - 1):
        first, axis = friction_entry(tangent, states), 2 * tangent
        for k in range(2 * d):
            out[axis, k] = -force[first + 2] * out[d, k]
        for other in range(d - 1):
            out[axis, d + 2 * other] -= force[first + slip_entry(other, states)]
        if s.follows_surface:
            for k in range(2 * d):
                out[axis, k] -= contact.slope[tangent] * out[1, k]
            for other in range(d - 1):
                out[axis, 2 * other] -= F * contact.curvature[tangent][other]
    return NodeForces(F, pressing, contact)


@kernel
def normal_values(
    addresses: IntegerVector, u: Vector, v: Vector, p: Matrix, force: Vector, slope: Vector,
) -> None:
    """Fill force and dF/du (k,) of the normal laws of k nodes at their penetrations and rates."""
    for j in range(len(u)):
        force[j], slope[j], _ = normal_at(addresses[j])(u[j], v[j], p[j])
