"""Contact nodes against the other side: their motions and kinematics.

A node has d axes: its first tangent, its normal and, in space, its second tangent. Tangent k is
axis 2 k. What has a value for each tangent is a pair, of which the second is zero in the plane.
Arrays of a contact system as its compiled functions see them; the equations are those of
:mod:`fecontact.system.kernels`.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.records import ANY, IntegerVector, Matrix, Size, Vector
from fecontact.core.simd.functions import zero_of
from fecontact.core.simd.vectors import everywhere
from fecontact.core.types import Array, Integers
from fecontact.laws.signatures import ground_at, signal_at, surface_at

# Modes, contact nodes, dimensions of space, internal variables of a node; length of a state.
MODES, NODES, AXES, MEMORY = map(Size, ("modes", "nodes", "axes", "memory"))
# Combinations of coordinates on which polynomial forces depend, and their products.
COMBINATIONS, PRODUCTS = map(Size, ("combinations", "products"))
SIZE = 2 * MODES + NODES * MEMORY

# Values along both tangents, and along all axes; symmetric second derivatives along the tangents.
Pair = tuple[float, float]
Triple = tuple[float, float, float]
PairOfPairs = tuple[tuple[float, float], tuple[float, float]]


class SystemArrays(NamedTuple):
    """A contact system as the kernels see it: arrays, and laws by address.

    ``drive_damping`` (d,) is that of relative dashpots; ``bristle_stiffness`` (2, n, s) are a and b
    of the stored ``(a + b |F|) z^2 / 2``; ``on_ground`` is 0 for nodes between bodies,
    ``follows_surface`` where contact forces stay vertical, else 1.

    ``rows`` (n, d, m) are those of the displacements of the nodes along their axes. ``places``
    (n, d - 1) are reference places along the tangents; ``sliding`` (n, d - 1, 2) are the factors by
    which both motions of the other sides move along the tangents of a node.

    ``polynomial_rows`` (D, m), ``polynomial_pairs`` (P, 2), ``polynomial_cubic`` (P, m) and
    ``polynomial_quartic`` (P, P) are those of :mod:`fecontact.system.polynomial_forces`;
    ``polynomial`` is the address of its function, 0 without such forces.

    ``planar`` (n,) are addresses of friction in two directions, (0,) in the plane. Heights of the
    ground are those of ``surface``, or where that is 0 of ``profile`` along the unit vector
    ``wave_direction`` (2,), (1, 0) in the plane.
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
    places: Annotated[Array, NODES, AXES - 1]
    gap: Annotated[Array, NODES]
    sliding: Annotated[Array, NODES, AXES - 1, 2]
    wave_direction: Annotated[Array, 2]
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
    polynomial: int


class GroundMotion(NamedTuple):
    """Travel and speed of both motions of the ground, or of the side that slides in its place."""

    travel: float
    speed: float
    second_travel: float
    second_speed: float


class NodeMotion(NamedTuple):
    """Displacements of a node along its axes [m], and their rates [m/s]."""

    places: Triple
    speeds: Triple


class NodeContact(NamedTuple):
    """A node against the ground.

    Penetration u [m] and its rate [m/s]; along the tangents the place xi [m] and the slip velocity
    [m/s]; slopes of the ground's height and its second derivatives along the tangents.
    """

    penetration: float
    rate: float
    place: Pair
    slip: Pair
    slope: Pair
    curvature: PairOfPairs


@helper
def ground_motion(t, s):
    """Motion of the ground at time t."""
    travel, speed = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    second_travel, second_speed = 0.0, 0.0
    if s.second_motion != 0:
        second_travel, second_speed = signal_at(s.second_motion)(t, s.second_motion_parameters)
    return GroundMotion(travel, speed, second_travel, second_speed)


@helper
def ground_moved(tangent, j, first, second, s):
    """Component of two motions of the ground along a tangent of node j."""
    return s.sliding[j, tangent, 0] * first + s.sliding[j, tangent, 1] * second


@helper
def ground_speed(tangent, j, moved, s):
    """Speed of the ground along a tangent of node j [m/s]."""
    return ground_moved(tangent, j, moved.speed, moved.second_speed, s)


@helper
def ground_travel(tangent, j, moved, s):
    """Distance that the ground has gone along a tangent of node j [m]."""
    return ground_moved(tangent, j, moved.travel, moved.second_travel, s)


@helper
def size_of(pair):
    """Magnitude of a vector along the tangents."""
    if everywhere(pair[1] == 0.0):
        return abs(pair[0])
    return np.hypot(pair[0], pair[1])


@helper
def node_motion(j, y, s):
    """Motion of node j in the state y."""
    (_, d, m), zero = s.rows.shape, zero_of(y)
    x, height, across, x_rate, height_rate, across_rate = zero, zero, zero, zero, zero, zero
    for i in range(m):
        x += s.rows[j, 0, i] * y[i]
        height += s.rows[j, 1, i] * y[i]
        x_rate += s.rows[j, 0, i] * y[m + i]
        height_rate += s.rows[j, 1, i] * y[m + i]
    if d > 2:
        for i in range(m):
            across += s.rows[j, 2, i] * y[i]
            across_rate += s.rows[j, 2, i] * y[m + i]
    return NodeMotion((x, height, across), (x_rate, height_rate, across_rate))


@helper
def motion_in(row, d):
    """Motion of a node from a row (2 d,) of displacements along its axes, then of velocities."""
    if d > 2:
        return NodeMotion((row[0], row[1], row[2]), (row[3], row[4], row[5]))
    return NodeMotion((row[0], row[1], 0.0), (row[2], row[3], 0.0))


@helper
def motion_at(column, places, speeds, n, d):
    """Motion of a node from arrays (d n,) of all nodes, one axis after the other."""
    across, across_speed = 0.0, 0.0
    if d > 2:
        across, across_speed = places[2 * n + column], speeds[2 * n + column]
    return NodeMotion((places[column], places[n + column], across),
                      (speeds[column], speeds[n + column], across_speed))


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
def ground_under(j, place, s):
    """Height of the ground under node j, its slopes and second derivatives along the tangents."""
    if not s.on_ground[j]:
        return 0.0, (0.0, 0.0), ((0.0, 0.0), (0.0, 0.0))
    if s.surface != 0:
        height, x, y, xx, xy, yy = surface_at(s.surface)(place[0], place[1], s.profile_parameters)
        return height, (x, y), ((xx, xy), (xy, yy))
    a, b = s.wave_direction[0], s.wave_direction[1]
    height, slope, bend = ground_at(s.profile)(a * place[0] + b * place[1], s.profile_parameters)
    return height, (a * slope, b * slope), ((a * a * bend, a * b * bend), (a * b * bend,
                                                                          b * b * bend))


@helper
def node_place(j, along, across, moved, s):
    """Place of node j on the ground that has moved, at displacements along both tangents."""
    second = 0.0
    if s.rows.shape[1] > 2:
        second = s.places[j, 1] + across - ground_travel(1, j, moved, s)
    return s.places[j, 0] + along - ground_travel(0, j, moved, s), second


@helper
def slip_velocity(j, speeds, moved, s):
    """Slip velocity of node j along both tangents, of its velocities along the axes."""
    second = 0.0
    if s.rows.shape[1] > 2:
        second = speeds[2] - ground_speed(1, j, moved, s)
    return speeds[0] - ground_speed(0, j, moved, s), second


@helper
def node_contact(j, motion, moved, s):
    """Contact kinematics of node j; ``moved`` is the motion of the ground."""
    places, speeds = motion.places, motion.speeds
    place, slip = node_place(j, places[0], places[2], moved, s), slip_velocity(j, speeds, moved, s)
    height, slope, curvature = ground_under(j, place, s)
    return NodeContact(height - places[1] - s.gap[j],
                       slope[0] * slip[0] + slope[1] * slip[1] - speeds[1],
                       place, slip, slope, curvature)


@helper
def most_memory(s):
    """Largest number of internal variables of a node."""
    most = 0
    for j in range(len(s.memory)):
        most = max(most, s.memory[j])
    return most


@helper
def memory_of(j, y, s):
    """Internal variables of node j: a view of the state y."""
    n, _, m = s.rows.shape
    first = 2 * m + j * ((len(y) - 2 * m) // n)
    return y[first : first + s.memory[j]]
