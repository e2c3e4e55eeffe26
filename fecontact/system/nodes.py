"""Contact nodes against the other side: motions there, kinematics, and forces.

Arrays of a contact system as its compiled functions see them; the equations are those of
:mod:`fecontact.system.kernels`.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.records import ANY, IntegerVector, Matrix, Size, Vector
from fecontact.core.types import Array, Integers
from fecontact.laws.signatures import ground_at, signal_at

# Modes, contact nodes, dimensions of space, internal variables of a node; length of a state.
MODES, NODES, AXES, MEMORY = map(Size, ("modes", "nodes", "axes", "memory"))
# Combinations of coordinates on which polynomial forces depend, and their products.
COMBINATIONS, PRODUCTS = map(Size, ("combinations", "products"))
SIZE = 2 * MODES + NODES * MEMORY


class SystemArrays(NamedTuple):
    """A contact system as the kernels see it: arrays, and laws by address.

    ``drive_damping`` (d,) is that of relative dashpots; ``sliding`` (n,) are the factors c_j;
    ``bristle_stiffness`` (2, n, s) are a and b of the stored ``(a + b |F|) z^2 / 2``; ``on_ground``
    is 0 for nodes between bodies, ``follows_surface`` where contact forces stay vertical, else 1.

    ``rows`` (n, d, m) are those of the displacements of the nodes along their axes: the first
    tangent, the normal and, in space, the second tangent.

    ``polynomial_rows`` (D, m), ``polynomial_pairs`` (P, 2), ``polynomial_cubic`` (P, m) and
    ``polynomial_quartic`` (P, P) are those of :mod:`fecontact.system.polynomial_forces`.

    In space, else of length zero: reference places ``ordinate`` (n,) along the second tangent;
    ``sliding_across`` (3, n), factors of the first motion for the second
    tangent, of the second motion for the first and for the second one; ``planar`` (n,), addresses
    of friction in two directions; ``sides`` (n, 11), what :mod:`fecontact.system.space_nodes`
    evaluates, and ``space_node``, its address. Heights of the ground are those of ``surface``, or
    where that is 0 of ``profile`` along the unit vector ``wave_direction`` (2,).
    """

    stiffness: Annotated[Array, MODES, MODES]
    damping: Annotated[Array, MODES, MODES]
    modal_damping: Annotated[Array, MODES, MODES]
    constant_load: Annotated[Array, MODES]
    drive_shapes: Annotated[Array, AXES, MODES]
    drive_stiffness: Annotated[Array, AXES]
    drive_damping: Annotated[Array, AXES]
    load_shapes: Annotated[Array, ANY, MODES]
    rows: Annotated[Array, NODES, AXES, MODES]
    abscissa: Annotated[Array, NODES]
    ordinate: Annotated[Array, NODES * (AXES - 2)]
    gap: Annotated[Array, NODES]
    sliding: Annotated[Array, NODES]
    sliding_across: Matrix
    wave_direction: Vector
    sides: Matrix
    bristle_stiffness: Annotated[Array, 2, NODES, ANY]
    polynomial_rows: Annotated[Array, COMBINATIONS, MODES]
    polynomial_pairs: Annotated[Integers, PRODUCTS, 2]
    polynomial_cubic: Annotated[Array, PRODUCTS, MODES]
    polynomial_quartic: Annotated[Array, PRODUCTS, PRODUCTS]
    normal_parameters: Annotated[Array, NODES, ANY]
    friction_parameters: Annotated[Array, NODES, ANY]
    profile_parameters: Vector
    friction_scale_parameters: Vector
    ground_motion_parameters: Vector
    second_motion_parameters: Vector
    drive_parameters: Annotated[Array, AXES, ANY]
    load_parameters: Matrix
    normal: Annotated[Integers, NODES]
    friction: Annotated[Integers, NODES]
    planar: IntegerVector
    memory: IntegerVector
    on_ground: IntegerVector
    drive: Annotated[Integers, AXES]
    load: IntegerVector
    profile: int
    surface: int
    friction_scale: int
    ground_motion: int
    second_motion: int
    follows_surface: int
    space_node: int


# Entries that tell of a node in space: its NodeContact, F, and derivatives (4, 6).
CONTACT_FIELDS, SPACE_ROWS, SPACE_COLUMNS = 11, 4, 6
TOLD = CONTACT_FIELDS + 1 + SPACE_ROWS * SPACE_COLUMNS


class GroundMotion(NamedTuple):
    """Travel and speed of both motions of the ground, or of the side that slides in its place."""

    travel: float
    speed: float
    second_travel: float
    second_speed: float


class NodeMotion(NamedTuple):
    """Displacements of a node along the ground, away from it and across, and their rates."""

    along: float
    height: float
    along_rate: float
    height_rate: float
    across: float
    across_rate: float


class NodeContact(NamedTuple):
    """A node against the ground.

    Place xi, u, u', slip velocity, and y_R' and y_R'' of the profile; in space ``across`` are the
    place, the slip velocity, the slope and the curvature along the second tangent, and ``twist``
    is the mixed derivative of the height.
    """

    place: float
    penetration: float
    rate: float
    slip: float
    slope: float
    curvature: float
    place_across: float
    slip_across: float
    slope_across: float
    curvature_across: float
    twist: float


@helper
def in_space(s):
    """Whether nodes have a second tangent."""
    return s.rows.shape[1] > 2


@helper
def slip_entry(tangent, states):
    """Place of the derivative to the slip velocity along a tangent.

    Among the results of friction with so many internal variables, for a force or for a rate.
    """
    return 3 + states if tangent else 1


@helper
def friction_entry(tangent, states):
    """First place in the results of friction of those for the force along a tangent."""
    return 4 + states if tangent else 0


@helper
def ground_motion(t, s):
    """Motion of the ground at time t."""
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    second_travel, second_speed = 0.0, 0.0
    if s.second_motion != 0:
        second_travel, second_speed = signal_at(s.second_motion)(t, s.second_motion_parameters)
    return GroundMotion(travel, speed, second_travel, second_speed)


@helper
def moved_along(j, first, second, s):
    """Component of two motions of the ground along the first tangent of node j."""
    total = s.sliding[j] * first
    if in_space(s):
        total += s.sliding_across[1, j] * second
    return total


@helper
def moved_across(j, first, second, s):
    """Component of two motions of the ground along the second tangent of node j."""
    return s.sliding_across[0, j] * first + s.sliding_across[2, j] * second


@helper
def ground_moved(axis, j, first, second, s):
    """Two motions of the ground along an axis of node j; zero along its normal."""
    if axis == 1:
        return 0.0
    return moved_along(j, first, second, s) if axis == 0 else moved_across(j, first, second, s)


@helper
def node_motion(j, y, s):
    """Motion of node j in the state y."""
    m = s.rows.shape[2]
    x, height, x_rate, height_rate, across, across_rate = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        x += s.rows[j, 0, i] * y[i]
        height += s.rows[j, 1, i] * y[i]
        x_rate += s.rows[j, 0, i] * y[m + i]
        height_rate += s.rows[j, 1, i] * y[m + i]
    if in_space(s):
        for i in range(m):
            across += s.rows[j, 2, i] * y[i]
            across_rate += s.rows[j, 2, i] * y[m + i]
    return NodeMotion(x, height, x_rate, height_rate, across, across_rate)


@helper
def change_by(row, j, x, s):
    """Change of what has the derivatives ``row`` (2 d,) at node j by a change x of the state."""
    _, d, m = s.rows.shape
    total = 0.0
    for axis in range(d):
        place, speed = 0.0, 0.0
        for i in range(m):
            place += s.rows[j, axis, i] * x[i]
            speed += s.rows[j, axis, i] * x[m + i]
        total += row[axis] * place + row[d + axis] * speed
    return total


@helper
def node_contact(j, motion, moved, s):
    """Contact kinematics of node j of a plane body; ``moved`` is the motion of the ground."""
    place = s.abscissa[j] + motion.along - s.sliding[j] * moved.travel
    ground, slope, curvature = 0.0, 0.0, 0.0
    if s.on_ground[j]:
        ground, slope, curvature = ground_at(s.profile)(place, s.profile_parameters)
    slip = motion.along_rate - s.sliding[j] * moved.speed
    return NodeContact(place, ground - motion.height - s.gap[j],
                       slope * slip - motion.height_rate, slip, slope, curvature,
                       0.0, 0.0, 0.0, 0.0, 0.0)


@helper
def memory_of(j, y, s):
    """Internal variables of node j: a view of the state y."""
    n, _, m = s.rows.shape
    first = 2 * m + j * ((len(y) - 2 * m) // n)
    return y[first : first + s.memory[j]]


@helper
def pressing_force(j, contact, F, s):
    """The force that friction sees under a normal force: |F| times the ground's variation."""
    pressing = abs(F)
    if s.friction_scale != 0 and s.on_ground[j] and F != 0.0:
        pressing *= ground_at(s.friction_scale)(contact.place, s.friction_scale_parameters)[0]
    return pressing


@helper
def tangent_force(F, R, slope, s):
    """Force of a node against a tangent: friction, and the contact force along the surface."""
    return R + F * slope if s.follows_surface else R


@helper
def force_room(s):
    """Arrays for what a friction law says at a node of a system: ``force`` and ``rates``.

    In space what :mod:`fecontact.system.space_nodes` says of a node follows the friction.
    """
    states = s.memory.max()
    if in_space(s):
        return np.empty(2 * (4 + states) + TOLD), np.empty((states, 4 + states))
    return np.empty(3 + states), np.empty((states, 3 + states))
