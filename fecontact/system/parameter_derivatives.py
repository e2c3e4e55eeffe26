"""Compiled derivatives of a contact system's equations with respect to a parameter.

The chain rule covers all linear terms and the derivatives that laws return; only the dependence of
a law on its own parameters is found by finite differences, at fixed state and forces. The system is
given as arrays s, and their derivatives with respect to the parameter as arrays r of the same form.
"""

from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.types import Array
from fecontact.laws.signatures import ground_at, signal_at, surface_at
from fecontact.system.node_forces import (
    friction_entry,
    friction_onset,
    friction_scale,
    normal_force_with,
    set_friction,
    slip_entry,
)
from fecontact.system.nodes import GroundMotion, ground_speed, ground_travel

# Fourth-order differences: offsets in steps, and weights in twelfths of a step.
_PLACES = np.array([1.0, -1.0, 2.0, -2.0])
_WEIGHTS = np.array([8.0, -8.0, -1.0, 1.0])


class OffsetLaws(NamedTuple):
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
def _offsets(parameters, rates, h):
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
def offset_laws(s, r, h):
    """Parameters of all laws beside those of the system, for differences of step h."""
    return OffsetLaws(
        _offsets(s.normal_parameters, r.normal_parameters, h),
        _offsets(s.friction_parameters, r.friction_parameters, h),
        _offsets(s.profile_parameters.reshape(1, -1), r.profile_parameters.reshape(1, -1), h),
        _offsets(s.friction_scale_parameters.reshape(1, -1),
                 r.friction_scale_parameters.reshape(1, -1), h),
        _offsets(s.ground_motion_parameters.reshape(1, -1),
                 r.ground_motion_parameters.reshape(1, -1), h),
        _offsets(s.second_motion_parameters.reshape(1, -1),
                 r.second_motion_parameters.reshape(1, -1), h),
        _offsets(s.drive_parameters, r.drive_parameters, h),
        _offsets(s.load_parameters, r.load_parameters, h), h)


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
        drive_force = s.drive_stiffness[k] * value + s.drive_damping[k] * rate
        drive_force_p = (r.drive_stiffness[k] * value + s.drive_stiffness[k] * value_p
                  + r.drive_damping[k] * rate + s.drive_damping[k] * rate_p)
        for i in range(m):
            load[i] += drive_force * r.drive_shapes[k, i] + drive_force_p * s.drive_shapes[k, i]
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
    """Derivatives of the ground's height under a node and of its slopes along the tangents."""
    h, place = laws.step, contact.place
    if s.surface != 0:
        ground, x, y = 0.0, 0.0, 0.0
        for k in range(len(laws.profile)):
            found = surface_at(s.surface)(place[0], place[1], laws.profile[k, 0])
            weight = _WEIGHTS[k] / (12.0 * h)
            ground += weight * found[0]
            x += weight * found[1]
            y += weight * found[2]
        return ground, (x, y)
    a, b = s.wave_direction[0], s.wave_direction[1]
    ground, slope = _ground_rates(s.profile, a * place[0] + b * place[1], laws.profile, h)
    return ground, (a * slope, b * slope)


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
        shifts[axis], shifts[d + axis] = place, speed
    shifts[1] += r.gap[j]
    for tangent in range(d - 1):
        axis = 2 * tangent
        shifts[axis] += r.places[j, tangent] - (ground_travel(tangent, j, moved_p, s)
                                                + ground_travel(tangent, j, moved, r))
        shifts[d + axis] -= (ground_speed(tangent, j, moved_p, s)
                             + ground_speed(tangent, j, moved, r))


@helper
def _pressing_rate(j, node, F_p, shifts, s, laws):
    """Derivative of the force that friction sees of node j, by that of its normal force."""
    size, pressing_p = abs(node.normal), F_p if node.normal >= 0.0 else -F_p
    if s.friction_scale == 0 or not s.on_ground[j]:
        return pressing_p
    scale, rise = friction_scale(j, node.contact, s)
    a, b = s.wave_direction[0], s.wave_direction[1]
    place = a * node.contact.place[0] + b * node.contact.place[1]
    own = _ground_rates(s.friction_scale, place, laws.friction_scale, laws.step)[0]
    for tangent in range(s.rows.shape[1] - 1):
        own += rise[tangent] * shifts[2 * tangent]
    return scale * pressing_p + size * own


class DerivativesWorkspace(NamedTuple):
    """Workspace of the derivatives of the rates at a state.

    Modal forces ``load`` (m,) and their derivatives to the parameter, ``load_p``; of a node
    ``force``, ``rates`` and ``partial`` as :func:`fecontact.system.node_forces.node_gradients`
    fills them, its forces ``node_force`` (d,) along the axes and their ``gradient`` (d, 2 m) to q
    and q'. Rows ``pushed`` (n d, m) and ``gradients`` (n d, blocks, 8), padded by zeros, of all
    nodes with forces where there are many modes, and ``sums`` (4, 8) of their products.
    ``stiffening`` (D, m) is of :mod:`fecontact.system.polynomial_forces`. For the parameter:
    results of the friction law beside it, ``offset_force`` and ``offset_rates``; what its own
    parameters add to the rates of the internal variables, ``memory`` (s,); ``shifts`` (2 d,) of
    :func:`set_shifts`; and the derivatives ``node_force_p`` (d,) of the forces.
    """

    load: Vector
    load_p: Vector
    force: Vector
    rates: Matrix
    partial: Matrix
    node_force: Vector
    gradient: Matrix
    pushed: Matrix
    gradients: Block
    sums: Matrix
    stiffening: Matrix
    offset_force: Vector
    offset_rates: Matrix
    memory: Vector
    shifts: Vector
    node_force_p: Vector


@helper
def node_rates(j, node, z, s, laws, workspace):
    """Fill ``node_force_p`` and ``memory`` of node j; returns the rate of what friction sees.

    ``node``, ``force`` and ``partial`` are results of
    :func:`fecontact.system.node_forces.node_gradients`.
    """
    force, partial, shifts = workspace.force, workspace.partial, workspace.shifts
    offset_force, offset_rates = workspace.offset_force, workspace.offset_rates
    memory, out = workspace.memory, workspace.node_force_p
    contact, F, h, d = node.contact, node.normal, laws.step, s.rows.shape[1]
    states = len(memory)
    ground, slope = 0.0, (0.0, 0.0)
    if s.on_ground[j]:
        ground, slope = _surface_rates(contact, s, laws)
    F_p = -partial[1, 1] * ground - partial[1, d + 1] * (
        slope[0] * contact.slip[0] + slope[1] * contact.slip[1])
    for k in range(len(shifts)):
        F_p += partial[1, k] * shifts[k]
    for k in range(len(laws.normal)):
        F_p += _WEIGHTS[k] / (12.0 * h) * normal_force_with(
            laws.normal[k, j], j, contact.penetration, contact.rate, s)[0]
    pressing_p = _pressing_rate(j, node, F_p, shifts, s, laws)
    # Friction is zero without a normal force, but may be about to begin.
    begins, onset = s.memory[j] == 0 and F == 0.0 and F_p != 0.0, (0.0, 0.0)
    if begins:
        onset = friction_onset(j, contact.slip, s)
    out[1] = F_p
    for tangent in range(d - 1):
        first = friction_entry(tangent, states)
        R_p = (onset[tangent] if begins else force[first + 2]) * pressing_p
        for other in range(d - 1):
            R_p += force[first + slip_entry(other, states)] * shifts[d + 2 * other]
        if s.follows_surface:
            R_p += contact.slope[tangent] * F_p + F * slope[tangent]
            for other in range(d - 1):
                R_p += F * contact.curvature[tangent][other] * shifts[2 * other]
        out[2 * tangent] = -R_p
    for i in range(s.memory[j]):
        memory[i] = 0.0
    for k in range(len(laws.friction)):
        weight = _WEIGHTS[k] / (12.0 * h)
        set_friction(j, contact.slip, node.pressing, z, laws.friction[k, j], s, offset_force,
                     offset_rates)
        for tangent in range(d - 1):
            out[2 * tangent] -= weight * offset_force[friction_entry(tangent, states)]
        for i in range(s.memory[j]):
            memory[i] += weight * offset_rates[i, 0]
    return pressing_p
