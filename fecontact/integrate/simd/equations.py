"""Accelerations of small systems and their derivatives, eight systems at once.

The equations of :mod:`fecontact.system.kernels` for plane systems on level ground whose friction
has no memory.
"""

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.vectors import (
    bits,
    magnitude,
    mask_of,
    read,
    select,
    spread,
    write,
)
from fecontact.integrate.simd.arrays import BY_FORCE, BY_PLACE, BY_RATE, BY_SLIP, FORCE
from fecontact.laws.simd import node_lanes_at, signal_lanes_at


@helper
def ground_speed(t, s):
    """Speed of the ground's motion."""
    return signal_lanes_at(s.ground_motion)(t, s.ground_motion_parameters)[1]


@helper
def add_load(factor, shape, load):
    """Add a multiple of a shape (m, 8) to the modal forces."""
    for i in range(len(load)):
        write(load[i], read(load[i]) + factor * read(shape[i]))


@routine
def set_given(t, s, load):
    """Fill ``load`` (m, 8) with the modal forces given at times t."""
    for i in range(len(load)):
        write(load[i], read(s.constant_load[i]))
    for axis in range(len(s.drive)):
        if s.drive[axis] != 0:
            value, rate = signal_lanes_at(s.drive[axis])(t, s.drive_parameters[axis])
            add_load(read(s.drive_stiffness[axis]) * value + read(s.drive_damping[axis]) * rate,
                     s.drive_shapes[axis], load)
    for k in range(len(s.load)):
        value = signal_lanes_at(s.load[k])(t, s.load_parameters[k])[0]
        add_load(value, s.load_shapes[k], load)


@helper
def project(s, y, places, speeds):
    """Fill displacements and velocities (2 n, 8) of the contact nodes: all x, all y."""
    n, m = s.rows.shape[0], s.rows.shape[2]
    for j in range(n):
        x, height, x_rate, height_rate = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
        for i in range(m):
            along, away, place, speed = (read(s.rows[j, 0, i]), read(s.rows[j, 1, i]), read(y[i]),
                                         read(y[m + i]))
            x += along * place
            height += away * place
            x_rate += along * speed
            height_rate += away * speed
        write(places[j], x)
        write(places[n + j], height)
        write(speeds[j], x_rate)
        write(speeds[n + j], height_rate)


@helper
def _accelerate(y, s, load, rate):
    """Fill ``rate`` (2 m, 8) without the forces of nodes."""
    m = len(load)
    for i in range(m):
        total = read(load[i])
        for k in range(m):
            total = total - (read(s.stiffness[i, k]) * read(y[k])
                             + read(s.damping[i, k]) * read(y[m + k]))
        write(rate[i], read(y[m + i]))
        write(rate[m + i], total)


@helper
def _add_node_force(j, F, R, s, rate):
    """Add the forces of node j."""
    m = s.rows.shape[2]
    for i in range(m):
        write(rate[m + i], read(rate[m + i]) + (read(s.rows[j, 1, i]) * F
                                                - read(s.rows[j, 0, i]) * R))


@helper
def set_rate(y, speed, s, load, places, speeds, forces, rate):
    """Fill ``rate`` (2 m, 8) with y', and normal forces; ``speed`` is that of the ground."""
    n = s.rows.shape[0]
    project(s, y, places, speeds)
    _accelerate(y, s, load, rate)
    for j in range(n):
        slip = read(speeds[j]) - read(s.sliding[j, 0, 0]) * speed
        F = node_lanes_at(s.normal[j])(-read(places[n + j]) - read(s.gap[j]),
                                       -read(speeds[n + j]), s.normal_parameters[j])[0]
        R = node_lanes_at(s.friction[j])(slip, magnitude(F), s.friction_parameters[j])[0]
        write(forces[j, FORCE], F)
        _add_node_force(j, F, R, s, rate)


@routine
def set_rate_and_forces(y, speed, s, load, places, speeds, forces, rate):
    """Fill ``rate`` as :func:`set_rate`, and ``forces`` (n, 5, 8) with F and derivatives."""
    n = s.rows.shape[0]
    project(s, y, places, speeds)
    _accelerate(y, s, load, rate)
    for j in range(n):
        slip = read(speeds[j]) - read(s.sliding[j, 0, 0]) * speed
        F, by_place, by_rate = node_lanes_at(s.normal[j])(
            -read(places[n + j]) - read(s.gap[j]), -read(speeds[n + j]), s.normal_parameters[j])
        R, by_slip, by_force = node_lanes_at(s.friction[j])(slip, magnitude(F),
                                                            s.friction_parameters[j])
        closed = magnitude(F) > 0.0
        write(forces[j, FORCE], F)
        write(forces[j, BY_PLACE], by_place)
        write(forces[j, BY_RATE], by_rate)
        write(forces[j, BY_SLIP], select(closed, by_slip, 0.0))
        write(forces[j, BY_FORCE], select(F >= 0.0, by_force, -by_force))
        _add_node_force(j, F, R, s, rate)


@helper
def _sign_of(force):
    return select(force > 0.0, 1.0, select(force < 0.0, -1.0, 0.0))


@helper
def switches(forces, before):
    """Mask of the lanes in which a normal force has another sign than before."""
    some = mask_of(0)
    for j in range(len(forces)):
        some = some | ~(_sign_of(read(forces[j, FORCE])) == _sign_of(read(before[j, FORCE])))
    return some


@helper
def set_derivatives(s, forces, by_place, by_speed):
    """Fill Jq and Jv (m, m, 8), the derivatives of the accelerations."""
    n, m = s.rows.shape[0], s.rows.shape[2]
    for i in range(m):
        for k in range(m):
            write(by_place[i, k], -read(s.stiffness[i, k]))
            write(by_speed[i, k], -read(s.damping[i, k]))
        for j in range(n):
            along = read(s.rows[j, 0, i])
            pushing = along * read(forces[j, BY_FORCE]) - read(s.rows[j, 1, i])
            place = pushing * read(forces[j, BY_PLACE])
            rate = pushing * read(forces[j, BY_RATE])
            slip = along * read(forces[j, BY_SLIP])
            for k in range(m):
                away = read(s.rows[j, 1, k])
                write(by_place[i, k], read(by_place[i, k]) + place * away)
                write(by_speed[i, k], read(by_speed[i, k]) + (rate * away
                                                              - slip * read(s.rows[j, 0, k])))


@helper
def set_time_rate(t, later, speed, s, forces, out):
    """Fill ``out`` (m, 8) with the time derivatives of the accelerations at a fixed state.

    ``later`` is a little after t, for differences of rates.
    """
    n, m = s.rows.shape[0], s.rows.shape[2]
    per_time = select(later > t, 1.0 / (later - t), 0.0)
    for i in range(m):
        write(out[i], spread(0.0))
    for axis in range(len(s.drive)):
        if s.drive[axis] != 0:
            damping = read(s.drive_damping[axis])
            rate = signal_lanes_at(s.drive[axis])(t, s.drive_parameters[axis])[1]
            drive_force = read(s.drive_stiffness[axis]) * rate
            if bits(magnitude(damping) > 0.0) != 0:
                rise = signal_lanes_at(s.drive[axis])(later, s.drive_parameters[axis])[1] - rate
                drive_force += damping * rise * per_time
            add_load(drive_force, s.drive_shapes[axis], out)
    for k in range(len(s.load)):
        add_load(signal_lanes_at(s.load[k])(t, s.load_parameters[k])[1], s.load_shapes[k], out)
    if s.steady != 0:
        return
    acceleration = (ground_speed(later, s) - speed) * per_time
    for j in range(n):
        push = read(s.sliding[j, 0, 0]) * acceleration * read(forces[j, BY_SLIP])
        add_load(push, s.rows[j, 0], out)
