"""Compiled derivatives of a contact system's equations with respect to a parameter.

The chain rule covers all linear terms and the derivatives that laws return; only the dependence of
a law on its own parameters is found by finite differences, at fixed state and forces. The system is
given as arrays s, and their derivatives with respect to the parameter as arrays r of the same form.
"""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.types import Array
from fecontact.laws.friction.planar import direction
from fecontact.laws.signatures import (
    friction_at,
    ground_at,
    memory_at,
    normal_at,
    planar_at,
    signal_at,
    surface_at,
)
from fecontact.system.nodes import (
    GroundMotion,
    ground_moved,
    in_space,
)

# Fourth-order differences: offsets in steps, and weights in twelfths of a step.
_PLACES = np.array([1.0, -1.0, 2.0, -2.0])
_WEIGHTS = np.array([8.0, -8.0, -1.0, 1.0])


class LawsBeside(NamedTuple):
    """Parameters of all laws at the places of the differences, and the step between these.

    Arrays (4, k, p) for k laws of p parameters, (0, k, p) where no parameter moves.
    """

    normal: Array
    friction: Array
    profile: Array
    friction_scale: Array
    ground_motion: Array
    second_motion: Array
    drive: Array
    load: Array
    step: float


@helper
def _beside(parameters, rates, h):
    """Laws' parameters (4, k, p) at the offsets of the differences; (0, k, p) if none varies."""
    k, p = parameters.shape
    count = 4 if h > 0.0 and moves(rates) else 0
    out = np.empty((count, k, p))
    for place in range(count):
        for i in range(k):
            for c in range(p):
                out[place, i, c] = parameters[i, c] + _PLACES[place] * h * rates[i, c]
    return out


@helper
def moves(rates):
    """Whether any entry of an array (k, p) of rates is not zero."""
    for row in rates:
        for rate in row:
            if rate != 0.0:
                return True
    return False


@helper
def laws_beside(s, r, h):
    """Parameters of all laws beside those of the system, for differences of step h."""
    return LawsBeside(
        _beside(s.normal_parameters, r.normal_parameters, h),
        _beside(s.friction_parameters, r.friction_parameters, h),
        _beside(s.profile_parameters.reshape(1, -1), r.profile_parameters.reshape(1, -1), h),
        _beside(s.friction_scale_parameters.reshape(1, -1),
                r.friction_scale_parameters.reshape(1, -1), h),
        _beside(s.ground_motion_parameters.reshape(1, -1),
                r.ground_motion_parameters.reshape(1, -1), h),
        _beside(s.second_motion_parameters.reshape(1, -1),
                r.second_motion_parameters.reshape(1, -1), h),
        _beside(s.drive_parameters, r.drive_parameters, h),
        _beside(s.load_parameters, r.load_parameters, h), h)


@helper
def _signal_rates(address, t, beside, row, h):
    """Derivatives of a signal's value and rate."""
    value, slope = 0.0, 0.0
    for k in range(len(beside)):
        a, b = signal_at(address)(t, beside[k, row])
        value += _WEIGHTS[k] / (12.0 * h) * a
        slope += _WEIGHTS[k] / (12.0 * h) * b
    return value, slope


@helper
def given_rates(t, s, r, laws, load):
    """Fill load (m,) with derivatives of the modal forces; returns those of the ground's motion."""
    m, h = len(load), laws.step
    for i in range(m):
        load[i] = r.constant_load[i]
    for k in range(len(s.drive)):
        value, rate = signal_at(s.drive[k])(t, s.drive_parameters[k])
        value_p, rate_p = _signal_rates(s.drive[k], t, laws.drive, k, h)
        pull = s.drive_stiffness[k] * value + s.drive_damping[k] * rate
        pull_p = (r.drive_stiffness[k] * value + s.drive_stiffness[k] * value_p
                  + r.drive_damping[k] * rate + s.drive_damping[k] * rate_p)
        for i in range(m):
            load[i] += pull * r.drive_shapes[k, i] + pull_p * s.drive_shapes[k, i]
    for k in range(len(s.load)):
        value = signal_at(s.load[k])(t, s.load_parameters[k])[0]
        rate = _signal_rates(s.load[k], t, laws.load, k, h)[0]
        for i in range(m):
            load[i] += value * r.load_shapes[k, i] + rate * s.load_shapes[k, i]
    travel, speed = _signal_rates(s.ground_motion, t, laws.ground_motion, 0, h)
    second_travel, second_speed = 0.0, 0.0
    if s.second_motion != 0:
        second_travel, second_speed = _signal_rates(s.second_motion, t, laws.second_motion, 0, h)
    return GroundMotion(travel, speed, second_travel, second_speed)


@helper
def _ground_rates(address, xi, beside, h):
    """Derivatives of a ground law's value and slope at one abscissa."""
    value, slope = 0.0, 0.0
    for k in range(len(beside)):
        a, b, _ = ground_at(address)(xi, beside[k, 0])
        value += _WEIGHTS[k] / (12.0 * h) * a
        slope += _WEIGHTS[k] / (12.0 * h) * b
    return value, slope


@helper
def _surface_rates(contact, s, laws):
    """Derivatives of the ground's height under a node and of its slopes."""
    h = laws.step
    if not in_space(s):
        ground, slope = _ground_rates(s.profile, contact.place, laws.profile, h)
        return ground, slope, 0.0
    ground, slope, across = 0.0, 0.0, 0.0
    if s.surface != 0:
        for k in range(len(laws.profile)):
            found = surface_at(s.surface)(contact.place, contact.place_across, laws.profile[k, 0])
            weight = _WEIGHTS[k] / (12.0 * h)
            ground += weight * found[0]
            slope += weight * found[1]
            across += weight * found[2]
        return ground, slope, across
    a, b = s.wave_direction[0], s.wave_direction[1]
    ground, slope = _ground_rates(s.profile, a * contact.place + b * contact.place_across,
                                  laws.profile, h)
    return ground, a * slope, b * slope


@helper
def set_shifts(j, y, s, r, basis_moves, moved, moved_p, shifts):
    """Fill ``shifts`` (2 d,) with what the parameter alone adds to the motion of a node.

    To its displacements along the axes against the other side, and to their rates.
    """
    _, d, m = s.rows.shape
    for axis in range(d):
        place, speed = 0.0, 0.0
        if basis_moves:
            for i in range(m):
                place += r.rows[j, axis, i] * y[i]
                speed += r.rows[j, axis, i] * y[m + i]
        shifts[axis] = place - (
            ground_moved(axis, j, moved_p.travel, moved_p.second_travel, s)
            + ground_moved(axis, j, moved.travel, moved.second_travel, r))
        shifts[d + axis] = speed - (
            ground_moved(axis, j, moved_p.speed, moved_p.second_speed, s)
            + ground_moved(axis, j, moved.speed, moved.second_speed, r))
    shifts[0] += r.abscissa[j]
    shifts[1] += r.gap[j]
    if in_space(s):
        shifts[2] += r.ordinate[j]


class NodeRates(NamedTuple):
    """Derivatives of F and of the forces against both tangents, of slip and of pressing force."""

    F: float
    T: float
    T2: float
    slip: float
    slip_across: float
    pressing: float


@helper
def node_rates(j, contact, z, F, shifts, s, laws, force, partial, room):
    """The :class:`NodeRates` of node j.

    ``shifts`` are those of :func:`set_shifts`;
    ``contact``, ``force`` and ``partial`` are results of
    :func:`fecontact.system.kernels.node_gradients`. Of ``room``, for the results of friction with
    memory, the last is filled with what the friction law's own parameters add to the rates of its
    internal variables; the others are overwritten.
    """
    room_force, room_rates, memory = room
    slip, h, space, d = contact.slip, laws.step, in_space(s), s.rows.shape[1]
    second = 4 + len(memory)
    ground, slope, across = 0.0, 0.0, 0.0
    if s.on_ground[j]:
        ground, slope, across = _surface_rates(contact, s, laws)
    F_p = -partial[1, 1] * ground - partial[1, d + 1] * (
        slope * slip + across * contact.slip_across)
    for k in range(len(shifts)):
        F_p += partial[1, k] * shifts[k]
    for k in range(len(laws.normal)):
        F_p += _WEIGHTS[k] / (12.0 * h) * normal_at(s.normal[j])(
            contact.penetration, contact.rate, laws.normal[k, j])[0]
    size, pressing_p = abs(F), F_p if F >= 0.0 else -F_p
    pressing = size
    if s.friction_scale != 0 and s.on_ground[j]:
        place, shift = contact.place, shifts[0]
        if space:
            a, b = s.wave_direction[0], s.wave_direction[1]
            place = a * contact.place + b * contact.place_across
            shift = a * shifts[0] + b * shifts[2]
        scale, scale_x, _ = ground_at(s.friction_scale)(place, s.friction_scale_parameters)
        pressing = scale * size
        pressing_p = scale * pressing_p + size * (
            scale_x * shift + _ground_rates(s.friction_scale, place, laws.friction_scale, h)[0])
    R_F, R_F2 = force[2], 0.0
    if space:
        R_F2 = force[second + 2]
    if s.memory[j] == 0 and F == 0.0 and F_p != 0.0:
        # Friction is zero without a normal force, but may be about to begin.
        if space:
            speed, e1, e2 = direction(slip, contact.slip_across, 0.0, 0.0)
            R_F = friction_at(s.friction[j])(speed, 0.0, s.friction_parameters[j])[2]
            R_F, R_F2 = R_F * e1, R_F * e2
        else:
            R_F = friction_at(s.friction[j])(slip, 0.0, s.friction_parameters[j])[2]
    R_p, R_p2, slip_across = force[1] * shifts[d] + R_F * pressing_p, 0.0, 0.0
    if space:
        slip_across = shifts[5]
        R_p += force[3 + len(memory)] * slip_across
        R_p2 = (force[second + 1] * shifts[d] + force[second + 3 + len(memory)] * slip_across
                + R_F2 * pressing_p)
    for i in range(s.memory[j]):
        memory[i] = 0.0
    for k in range(len(laws.friction)):
        weight = _WEIGHTS[k] / (12.0 * h)
        if space:
            planar_at(s.planar[j])(s.friction[j], slip, contact.slip_across, pressing, z,
                                   laws.friction[k, j], room_force, room_rates)
            R_p += weight * room_force[0]
            R_p2 += weight * room_force[second]
        elif s.memory[j] > 0:
            memory_at(s.friction[j])(slip, pressing, z, laws.friction[k, j], room_force,
                                     room_rates)
            R_p += weight * room_force[0]
        elif F != 0.0:
            R_p += weight * friction_at(s.friction[j])(slip, pressing, laws.friction[k, j])[0]
        for i in range(s.memory[j]):
            memory[i] += weight * room_rates[i, 0]
    if s.follows_surface:
        if space:
            R_p2 += contact.slope_across * F_p + F * (
                across + contact.twist * shifts[0] + contact.curvature_across * shifts[2])
            R_p += F * contact.twist * shifts[2]
        R_p += contact.slope * F_p + F * (slope + contact.curvature * shifts[0])
    return NodeRates(F_p, R_p, R_p2, shifts[d], slip_across, pressing_p)
