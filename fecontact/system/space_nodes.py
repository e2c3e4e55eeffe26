"""Contact nodes of solids: forces, slip and their derivatives, by one function of its address.

Kernels for plane bodies would take twice the time to compile if they held all this; so they call it
for systems in space only. With slopes y_i of the ground along the tangents i = 1, 2,

    u = y_R - y - g,    v_i = x_i' - V_i,    u' = y_1 v_1 + y_2 v_2 - y',    T_i = R_i + F y_i
"""

from collections.abc import Callable
from typing import NamedTuple

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper
from fecontact.core.records import Matrix, Vector
from fecontact.laws.signatures import ground_at, normal_at, planar_at, surface_at
from fecontact.system.nodes import (
    CONTACT_FIELDS,
    SPACE_COLUMNS,
    GroundMotion,
    NodeContact,
    NodeMotion,
)

# Entries of a row of `SystemArrays.sides`.
SIDES = 11
(GAP, ABSCISSA, ORDINATE, ALONG, ALONG_SECOND, ACROSS, ACROSS_SECOND, ON_GROUND, LEANS, WAVES_X,
 WAVES_Y) = range(SIDES)


class SpaceLaws(NamedTuple):
    """Addresses of the laws of a node in space."""

    normal: int
    friction: int
    planar: int
    profile: int
    surface: int
    scale: int


_SPACE_NODE = Callable[[
    NodeMotion, GroundMotion, SpaceLaws, Vector, Vector, Vector, Vector, Vector, Vector, Vector,
    Matrix,
], None]
space_node_at = function_at(_SPACE_NODE)


@helper
def surface_under(place, across, a, b, profile, surface, p):
    """Height of the ground with its derivatives: along, across; twice, mixed, twice.

    Of ``surface``, or where that is 0 of ``profile`` along the direction (a, b).
    """
    if surface != 0:
        return surface_at(surface)(place, across, p)
    height, slope, bend = ground_at(profile)(a * place + b * across, p)
    return height, a * slope, b * slope, a * a * bend, a * b * bend, b * b * bend


@helper
def contact_in_space(motion, moved, laws, side, profile_parameters):
    """Contact kinematics of a node in space; ``moved`` is the motion of the other side."""
    place = side[ABSCISSA] + motion.along - (side[ALONG] * moved.travel
                                             + side[ALONG_SECOND] * moved.second_travel)
    across = side[ORDINATE] + motion.across - (side[ACROSS] * moved.travel
                                               + side[ACROSS_SECOND] * moved.second_travel)
    slip = motion.along_rate - (side[ALONG] * moved.speed + side[ALONG_SECOND] * moved.second_speed)
    slip_across = motion.across_rate - (side[ACROSS] * moved.speed
                                        + side[ACROSS_SECOND] * moved.second_speed)
    ground, slope, slope_across, curvature, twist, curvature_across = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if side[ON_GROUND] != 0.0:
        ground, slope, slope_across, curvature, twist, curvature_across = surface_under(
            place, across, side[WAVES_X], side[WAVES_Y], laws.profile, laws.surface,
            profile_parameters)
    return NodeContact(place, ground - motion.height - side[GAP],
                       slope * slip + slope_across * slip_across - motion.height_rate, slip, slope,
                       curvature, across, slip_across, slope_across, curvature_across, twist)


@helper
def scale_under(contact, a, b, address, p):
    """Variation of friction along the ground at a node, and its derivative along (a, b)."""
    scale, slope, _ = ground_at(address)(a * contact.place + b * contact.place_across, p)
    return scale, slope


@helper
def _normal_part(contact, F_u, F_v, out):
    """Fill a row (6,) of derivatives of the normal force to the motion along the axes."""
    out[0] = F_u * contact.slope + F_v * (
        contact.curvature * contact.slip + contact.twist * contact.slip_across)
    out[1] = -F_u
    out[2] = F_u * contact.slope_across + F_v * (
        contact.twist * contact.slip + contact.curvature_across * contact.slip_across)
    out[3] = F_v * contact.slope
    out[4] = -F_v
    out[5] = F_v * contact.slope_across


def _space_node(motion, moved, laws, z, side, normal_parameters, friction_parameters,
                profile_parameters, scale_parameters, force, rates):
    """Fill ``force`` and ``rates`` of friction in two directions, and append the contact's results.

    The friction results in ``force`` are followed by the
    :class:`~fecontact.system.nodes.NodeContact`, F, and derivatives (4, 6) as in
    :func:`fecontact.system.kernels.node_gradients`. The derivatives are left out where ``force``
    is too short for them.
    """
    states = len(rates)
    second, told = 4 + states, 2 * (4 + states)
    contact = contact_in_space(motion, moved, laws, side, profile_parameters)
    F, F_u, F_v = normal_at(laws.normal)(contact.penetration, contact.rate,
                                               normal_parameters)
    pressing, scale, scale_slope = abs(F), 1.0, 0.0
    a, b = side[WAVES_X], side[WAVES_Y]
    if laws.scale != 0 and side[ON_GROUND] != 0.0 and F != 0.0:
        scale, scale_slope = scale_under(contact, a, b, laws.scale, scale_parameters)
    planar_at(laws.planar)(laws.friction, contact.slip, contact.slip_across, scale * pressing,
                                 z, friction_parameters, force[:told], rates)
    for k in range(CONTACT_FIELDS):
        force[told + k] = contact[k]
    force[told + CONTACT_FIELDS] = F
    first = told + CONTACT_FIELDS + 1
    if len(force) <= first:
        return
    along, normal = force[first : first + 6], force[first + 6 : first + 12]
    across, pressed = force[first + 12 : first + 18], force[first + 18 : first + 24]
    _normal_part(contact, F_u, F_v, normal)
    sign = scale if F >= 0.0 else -scale
    for k in range(SPACE_COLUMNS):
        pressed[k] = sign * normal[k]
    pressed[0] += a * scale_slope * pressing
    pressed[2] += b * scale_slope * pressing
    for k in range(SPACE_COLUMNS):
        along[k] = -force[2] * pressed[k]
        across[k] = -force[second + 2] * pressed[k]
    along[3] -= force[1]
    along[5] -= force[3 + states]
    across[3] -= force[second + 1]
    across[5] -= force[second + 3 + states]
    if side[LEANS] != 0.0:
        for k in range(SPACE_COLUMNS):
            along[k] -= contact.slope * normal[k]
            across[k] -= contact.slope_across * normal[k]
        along[0] -= F * contact.curvature
        along[2] -= F * contact.twist
        across[0] -= F * contact.twist
        across[2] -= F * contact.curvature_across


space_node = compile_law(_SPACE_NODE, "space_node(motion, moved, laws, z, side, ...)", _space_node)


@helper
def laws_of(j, s):
    """Laws of node j."""
    return SpaceLaws(s.normal[j], s.friction[j], s.planar[j], s.profile, s.surface,
                     s.friction_scale)


@helper
def tell(j, motion, moved, z, s, force, rates):
    """Evaluate node j; returns F and its NodeContact. ``force`` and ``rates`` are filled."""
    space_node_at(s.space_node)(motion, moved, laws_of(j, s), z, s.sides[j], s.normal_parameters[j],
                                s.friction_parameters[j], s.profile_parameters,
                                s.friction_scale_parameters, force, rates)
    k = 2 * (4 + len(rates))
    contact = NodeContact(force[k], force[k + 1], force[k + 2], force[k + 3], force[k + 4],
                          force[k + 5], force[k + 6], force[k + 7], force[k + 8], force[k + 9],
                          force[k + 10])
    return force[k + CONTACT_FIELDS], contact


@helper
def told_gradients(force, rates, out):
    """Copy the derivatives (4, 6) of a node that was evaluated."""
    first = 2 * (4 + len(rates)) + CONTACT_FIELDS + 1
    for row in range(4):
        for k in range(SPACE_COLUMNS):
            out[row, k] = force[first + row * SPACE_COLUMNS + k]
