"""Contact nodes against the other side: what moves there, where they are, what presses them.

Arrays of a contact system as its compiled functions see them; the equations are those of
:mod:`fecontact.system.kernels`.
"""

from typing import NamedTuple

from numba import types

from fecontact.core.compiled import block, f8, helper, i8, integers, matrix, vector
from fecontact.core.types import Array, Integers
from fecontact.laws.signatures import ground_at, signal_at, surface_at


class SystemArrays(NamedTuple):
    """A contact system as the kernels see it: arrays, and laws by address.

    ``drive_damping`` (d,) is that of relative dashpots; ``sliding`` (n,) are the factors c_j;
    ``bristle_stiffness`` (2, n, s) are a and b of the stored ``(a + b |F|) z^2 / 2``; ``on_ground``
    is 0 for nodes between bodies, ``leans`` where contact forces stay vertical, else 1.

    In space, else of length zero: rows ``T2`` (n, m) and reference places ``ordinate`` (n,) along
    the second tangent; ``sliding_across`` (3, n), factors of the first motion for the second
    tangent, of the second motion for the first and for the second one; ``planar`` (n,), addresses
    of friction in two directions. Heights of the ground are those of ``surface``, or where that is
    0 of ``profile`` along the unit vector ``wave_direction`` (2,).
    """

    stiffness: Array
    damping: Array
    modal_damping: Array
    constant_load: Array
    drive_shapes: Array
    drive_stiffness: Array
    drive_damping: Array
    load_shapes: Array
    Tx: Array
    Ty: Array
    T2: Array
    abscissa: Array
    ordinate: Array
    gap: Array
    sliding: Array
    sliding_across: Array
    wave_direction: Array
    bristle_stiffness: Array
    normal_parameters: Array
    friction_parameters: Array
    profile_parameters: Array
    friction_scale_parameters: Array
    ground_motion_parameters: Array
    second_motion_parameters: Array
    drive_parameters: Array
    load_parameters: Array
    normal: Integers
    friction: Integers
    planar: Integers
    memory: Integers
    on_ground: Integers
    drive: Integers
    load: Integers
    profile: int
    surface: int
    friction_scale: int
    ground_motion: int
    second_motion: int
    leans: int


SYSTEM = types.NamedTuple(
    [matrix, matrix, matrix, vector, matrix, vector, vector, matrix, matrix, matrix, matrix, vector,
     vector, vector, vector, matrix, vector, block, matrix, matrix, vector, vector, vector, vector,
     matrix, matrix, integers, integers, integers, integers, integers, integers, integers,
     i8, i8, i8, i8, i8, i8], SystemArrays)

class GroundMotion(NamedTuple):
    """How far the ground has travelled, and its speed, or what slides in its place; two motions."""

    travel: float
    speed: float
    second_travel: float
    second_speed: float


GROUND_MOTION = types.NamedUniTuple(f8, 4, GroundMotion)


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
    return len(s.T2) > 0


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
    """What two motions of the ground are along the first tangent of node j."""
    total = s.sliding[j] * first
    if in_space(s):
        total += s.sliding_across[1, j] * second
    return total


@helper
def moved_across(j, first, second, s):
    """What two motions of the ground are along the second tangent of node j."""
    return s.sliding_across[0, j] * first + s.sliding_across[2, j] * second


@helper
def node_motion(j, y, s):
    """Motion of node j in the state y."""
    m = s.Tx.shape[1]
    x, height, x_rate, height_rate, across, across_rate = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        x += s.Tx[j, i] * y[i]
        height += s.Ty[j, i] * y[i]
        x_rate += s.Tx[j, i] * y[m + i]
        height_rate += s.Ty[j, i] * y[m + i]
    if in_space(s):
        for i in range(m):
            across += s.T2[j, i] * y[i]
            across_rate += s.T2[j, i] * y[m + i]
    return NodeMotion(x, height, x_rate, height_rate, across, across_rate)


@helper
def surface_under(place, across, s):
    """Height of the ground in space with its derivatives: along, across; twice, mixed, twice."""
    if s.surface != 0:
        return surface_at(s.surface)(place, across, s.profile_parameters)
    a, b = s.wave_direction[0], s.wave_direction[1]
    height, slope, bend = ground_at(s.profile)(a * place + b * across, s.profile_parameters)
    return height, a * slope, b * slope, a * a * bend, a * b * bend, b * b * bend


@helper
def node_contact(j, motion, moved, s):
    """Where node j is above the other side, under the prescribed motion ``moved``."""
    place = s.abscissa[j] + motion.along - moved_along(j, moved.travel, moved.second_travel, s)
    slip = motion.along_rate - moved_along(j, moved.speed, moved.second_speed, s)
    ground, slope, curvature = 0.0, 0.0, 0.0
    if not in_space(s):
        if s.on_ground[j]:
            ground, slope, curvature = ground_at(s.profile)(place, s.profile_parameters)
        return NodeContact(place, ground - motion.height - s.gap[j],
                           slope * slip - motion.height_rate, slip, slope, curvature,
                           0.0, 0.0, 0.0, 0.0, 0.0)
    across = (s.ordinate[j] + motion.across
              - moved_across(j, moved.travel, moved.second_travel, s))
    slip_across = motion.across_rate - moved_across(j, moved.speed, moved.second_speed, s)
    slope_across, twist, curvature_across = 0.0, 0.0, 0.0
    if s.on_ground[j]:
        ground, slope, slope_across, curvature, twist, curvature_across = surface_under(
            place, across, s)
    return NodeContact(place, ground - motion.height - s.gap[j],
                       slope * slip + slope_across * slip_across - motion.height_rate, slip, slope,
                       curvature, across, slip_across, slope_across, curvature_across, twist)


@helper
def memory_of(j, y, s):
    """Internal variables of node j: a view of the state y."""
    n, m = s.Tx.shape
    first = 2 * m + j * ((len(y) - 2 * m) // n)
    return y[first : first + s.memory[j]]


@helper
def scale_under(contact, s):
    """Variation of friction along the ground at a node, and its derivative along that direction."""
    place = contact.place
    if in_space(s):
        place = (s.wave_direction[0] * contact.place
                 + s.wave_direction[1] * contact.place_across)
    scale, slope, _ = ground_at(s.friction_scale)(place, s.friction_scale_parameters)
    return scale, slope


@helper
def pressing_force(j, contact, F, s):
    """The force that friction sees under a normal force: |F| times the ground's variation."""
    pressing = abs(F)
    if s.friction_scale != 0 and s.on_ground[j] and F != 0.0:
        pressing *= scale_under(contact, s)[0]
    return pressing


@helper
def leaning(F, R, slope, s):
    """Force of a node against a tangent: friction, and the part of the contact force that leans."""
    return R + F * slope if s.leans else R


@helper
def force_room(states, space):
    """Lengths of ``force`` and of a row of ``rates`` for so many internal variables."""
    return (2 * (4 + states), 4 + states) if space else (3 + states, 3 + states)
