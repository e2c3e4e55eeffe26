"""Compiled derivatives of a contact system's equations with respect to a parameter.

The chain rule covers all linear terms and the derivatives that laws return; only the dependence of
a law on its own parameters is found by finite differences, at fixed state and forces. The system is
given as arrays s, and their derivatives with respect to the parameter as arrays r of the same form.
"""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.types import Array
from fecontact.laws.signatures import friction_at, ground_at, memory_at, normal_at, signal_at

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
    """Fill load (m,) with derivatives of the modal forces; returns those of travel and speed."""
    m, h = len(load), laws.step
    for i in range(m):
        load[i] = r.constant_load[i]
    for k in range(2):
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
    return _signal_rates(s.ground_motion, t, laws.ground_motion, 0, h)


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
def node_rates(j, contact, z, F, shifts, s, laws, force, partial, room):
    """Derivatives of F, T, slip velocity and pressing force at node j.

    ``shifts`` holds those of xi, height, slip velocity and rate of the height by themselves;
    ``contact``, ``force`` and ``partial`` are results of
    :func:`fecontact.system.kernels.node_gradients`. Of ``room``, (3 + s,), (s, 3 + s) and (s,),
    the last is filled with what the friction law's own parameters add to the rates of its
    internal variables; the others are overwritten.
    """
    room_force, room_rates, memory = room
    place, slip, h = contact.place, contact.slip, laws.step
    ground, slope = 0.0, 0.0
    if s.on_ground[j]:
        ground, slope = _ground_rates(s.profile, place, laws.profile, h)
    F_p = -partial[0, 1] * ground - partial[0, 3] * slope * slip
    for k in range(4):
        F_p += partial[0, k] * shifts[k]
    for k in range(len(laws.normal)):
        F_p += _WEIGHTS[k] / (12.0 * h) * normal_at(s.normal[j])(
            contact.penetration, contact.rate, laws.normal[k, j])[0]
    size, pressing_p = abs(F), F_p if F >= 0.0 else -F_p
    pressing = size
    if s.friction_scale != 0 and s.on_ground[j]:
        scale, scale_x, _ = ground_at(s.friction_scale)(place, s.friction_scale_parameters)
        pressing = scale * size
        pressing_p = scale * pressing_p + size * (
            scale_x * shifts[0]
            + _ground_rates(s.friction_scale, place, laws.friction_scale, h)[0])
    R_F = force[2]
    if s.memory[j] == 0 and F == 0.0 and F_p != 0.0:
        # Friction is zero without a normal force, but may be about to begin.
        R_F = friction_at(s.friction[j])(slip, 0.0, s.friction_parameters[j])[2]
    R_p = force[1] * shifts[2] + R_F * pressing_p
    for i in range(s.memory[j]):
        memory[i] = 0.0
    for k in range(len(laws.friction)):
        weight = _WEIGHTS[k] / (12.0 * h)
        if s.memory[j] > 0:
            memory_at(s.friction[j])(slip, pressing, z, laws.friction[k, j], room_force,
                                     room_rates)
            R_p += weight * room_force[0]
            for i in range(s.memory[j]):
                memory[i] += weight * room_rates[i, 0]
        elif F != 0.0:
            R_p += weight * friction_at(s.friction[j])(slip, pressing, laws.friction[k, j])[0]
    if s.leans:
        R_p += contact.slope * F_p + F * (slope + contact.curvature * shifts[0])
    return F_p, R_p, shifts[2], pressing_p
