"""Powers of a contact system in a state: what is put in, lost and stored, for energy balances."""

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.records import Vector
from fecontact.laws.signatures import signal_at
from fecontact.system.columns import POWERS
from fecontact.system.node_forces import force_workspace, friction_entry, node_forces, normal_force
from fecontact.system.nodes import (
    NODES,
    SystemArrays,
    ground_motion,
    ground_speed,
    memory_of,
    node_motion,
    size_of,
)

POWER_COUNT = len(POWERS)
(DRIVE, BELT_NORMAL, BELT_FRICTION, LOAD, CIRCULATORY, MODAL_DAMPING, DASHPOTS, CONTACT_DAMPING,
 FRICTION, BRISTLES) = range(POWER_COUNT)
NODE_POWERS = 2
# Entries of what is integrated of the powers.
WORKS = NODE_POWERS * NODES + POWER_COUNT


@helper
def given_powers(t, y, s, out):
    """Fill out (p,) with the powers of drive and loads, the others with zero."""
    m = s.rows.shape[2]
    out[:POWER_COUNT] = 0.0
    for axis in range(len(s.drive)):
        value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
        place, speed = 0.0, 0.0
        for i in range(m):
            place += s.drive_shapes[axis, i] * y[i]
            speed += s.drive_shapes[axis, i] * y[m + i]
        damping = s.drive_damping[axis]
        out[DRIVE] += (s.drive_stiffness[axis] * (value - place) + damping * (rate - speed)) * rate
        out[DASHPOTS] += damping * rate * (rate - 2.0 * speed)
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        for i in range(m):
            out[LOAD] += value * s.load_shapes[k, i] * y[m + i]
    for i in range(m):
        out[LOAD] += s.constant_load[i] * y[m + i]


@helper
def matrix_powers(ends, y, s, out):
    """Add to out (p,) the powers of a block of the matrices: first and last row and column."""
    m = s.rows.shape[2]
    top, bottom, left, right = ends
    modal, relative, circulatory = 0.0, 0.0, 0.0
    for i in range(top, bottom):
        for k in range(left, right):
            product = y[m + i] * y[m + k]
            modal += s.modal_damping[i, k] * product
            relative += (s.damping[i, k] - s.modal_damping[i, k]) * product
            circulatory += 0.5 * (s.stiffness[i, k] - s.stiffness[k, i]) * y[m + i] * y[k]
    out[MODAL_DAMPING] += modal
    out[DASHPOTS] += relative
    out[CIRCULATORY] -= circulatory


@helper
def body_powers(t, y, s, out):
    """Fill out (p,) with the powers outside the contact, the others with zero."""
    m = s.rows.shape[2]
    given_powers(t, y, s, out)
    matrix_powers((0, m, 0, m), y, s, out)


@helper
def drive_jump(before, after, y, s):
    """Work that the drive puts in where its motions jump, between two times on both sides [J]."""
    work = 0.0
    for axis in range(len(s.drive)):
        old = signal_at(s.drive[axis])(before, s.drive_parameters[axis])[0]
        new = signal_at(s.drive[axis])(after, s.drive_parameters[axis])[0]
        stretch = 0.5 * (old + new)
        for i in range(s.rows.shape[2]):
            stretch -= s.drive_shapes[axis, i] * y[i]
        work += s.drive_stiffness[axis] * stretch * (new - old)
    return work


@helper
def belt_normal_power(F, slope, slip, speed, s):
    """Power of the normal force's motion: of the drag up the slopes, or of lifting the node.

    Along one tangent, by the slope, slip velocity and speed of the other side there.
    """
    return -F * slope * speed if s.follows_surface else F * slope * slip


@helper
def storing_power(j, F, z, rates, s):
    """Power that goes into the bristles of node j at constant normal force."""
    total = 0.0
    for k in range(s.memory[j]):
        stiffness = s.bristle_stiffness[0, j, k] + s.bristle_stiffness[1, j, k] * abs(F)
        total += stiffness * z[k] * rates[k, 0]
    return total


@helper
def add_node_powers(j, motion, moved, z, s, force, rates, out):
    """Add to out (p,) the powers of node j; returns what friction takes, and the slip speed."""
    node = node_forces(j, motion, moved, z, s, force, rates)
    F, contact, taken = node.normal, node.contact, 0.0
    elastic = normal_force(j, contact.penetration, 0.0, s)[0]
    for tangent in range(s.rows.shape[1] - 1):
        R, slip = force[friction_entry(tangent, len(rates))], contact.slip[tangent]
        speed = ground_speed(tangent, j, moved, s)
        out[BELT_NORMAL] += belt_normal_power(F, contact.slope[tangent], slip, speed, s)
        out[BELT_FRICTION] -= R * speed
        taken += R * slip
    out[CONTACT_DAMPING] += (F - elastic) * contact.rate
    storing = storing_power(j, F, z, rates, s)
    lost = taken - storing
    out[BRISTLES] += storing
    out[FRICTION] += lost
    return lost, size_of(contact.slip)


@helper
def set_losses(j, lost, speed, stick_speed, out):
    """Fill the entries of node j of out (2 n,): its loss in friction, and that by creep."""
    out[j] = lost
    out[len(out) // 2 + j] = lost if speed < stick_speed else 0.0


@routine
def set_powers(t, y, s, stick_speed, out, nodes):
    """Fill out (p,) with the powers and ``nodes`` (2 n,) with those of each node.

    ``nodes`` holds the losses in friction of all nodes, then those by creep, at slip velocities
    below ``stick_speed`` (n,).
    """
    n = len(s.rows)
    moved = ground_motion(t, s)
    force, rates = force_workspace(s)
    body_powers(t, y, s, out)
    for j in range(n):
        lost, speed = add_node_powers(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force,
                                      rates, out)
        set_losses(j, lost, speed, stick_speed[j], nodes)


@kernel
def powers(
    t: float, y: Vector, s: SystemArrays, stick_speed: Vector, out: Vector, nodes: Vector,
) -> None:
    """Compiled entry point of :func:`set_powers`."""
    set_powers(t, y, s, stick_speed, out, nodes)
