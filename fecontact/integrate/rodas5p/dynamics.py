"""Accelerations of the reduced system, and their derivatives, for the time integrator.

The same equations as :mod:`fecontact.system.kernels`, laid out for speed, by the blocks of
:mod:`fecontact.integrate.rodas5p.blocks`.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.functions import by_kind
from fecontact.core.simd.vectors import select, somewhere
from fecontact.core.types import Array
from fecontact.integrate.rodas5p.blocks import block_at
from fecontact.laws.signatures import signal_at
from fecontact.system import kernels, nodes
from fecontact.system.node_forces import (
    axis_force,
    node_forces,
    node_gradients,
    slip_entry,
)
from fecontact.system.nodes import AXES, COMBINATIONS, MEMORY, MODES, NODES
from fecontact.system.polynomial_forces import (
    add_polynomial,
    add_polynomial_forces,
    has_polynomial,
    set_polynomial_gradient,
)

# Entries of what is given in time: pulls of the drive along each axis, and their rates, travel and
# speed of the ground's two motions.
PULL, PULL_RATE, TRAVEL, SPEED, SECOND_TRAVEL, SECOND_SPEED = 0, 3, 6, 7, 8, 9
GIVEN = 10


class Gradients(NamedTuple):
    """Derivatives of the node forces, as :func:`fecontact.system.node_forces.node_gradients` gives.

    And of the polynomial forces, G of :mod:`fecontact.system.polynomial_forces`.

    partial : (n, d + 1, 2 d), derivatives of the forces on a node along its axes and of the
    pressing force, to displacements and velocities along the axes
    force : (n, 3 + s), rates : (n, s, 3 + s), of friction with memory; in space (n, 2 (4 + s)) and
    (n, s, 4 + s), of friction in two directions
    polynomial : (D, m), G
    """

    partial: Annotated[Array, NODES, AXES + 1, 2 * AXES]
    force: Annotated[Array, NODES, (AXES - 1) * (AXES + 1 + MEMORY)]
    rates: Annotated[Array, NODES, MEMORY, AXES + 1 + MEMORY]
    polynomial: Annotated[Array, COMBINATIONS, MODES]


@helper
def give_motion(moved, given):
    """Let the motion of the ground in ``given`` be another one."""
    given[TRAVEL], given[SPEED] = moved.travel, moved.speed
    given[SECOND_TRAVEL], given[SECOND_SPEED] = moved.second_travel, moved.second_speed


@routine
def set_given(t, s, given, load):
    """Fill ``given`` (10,) with what is given at time t, and ``load`` (m,) with its modal force."""
    kernels.set_constant_load(s, load)
    for axis in range(len(s.drive)):
        stiffness, damping = s.drive_stiffness[axis], s.drive_damping[axis]
        if somewhere((stiffness != 0.0) | (damping != 0.0)):
            value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
            given[PULL + axis] = stiffness * value + damping * rate
            given[PULL_RATE + axis] = stiffness * rate
            kernels.add_drive_force(given[PULL + axis], axis, s, load)
    give_motion(nodes.ground_motion(t, s), given)
    kernels.add_loads(t, s, load)


@helper
def motion_given(given):
    """Motion of the ground in ``given``."""
    return nodes.GroundMotion(given[TRAVEL], given[SPEED], given[SECOND_TRAVEL],
                              given[SECOND_SPEED])


@helper
def motion_of(j, w, s):
    """Motion of node j of the blocks, as :func:`project` puts it into w (3, d n)."""
    n = len(s.gap)
    return nodes.motion_at(j, w[0], w[1], n, s.rows.shape[1])


@helper
def _project_by_tiles(blocks, y, places, speeds):
    shapes = blocks.shapes
    columns = shapes.shape[1]
    count = blocks.used[0]
    for first in range(0, columns, len(blocks.nodes)):
        for j in range(first, first + count):
            places[j] = 0.0
            speeds[j] = 0.0
    for tile in range(len(blocks.tiles)):
        project_block(block_at(blocks.tiles, tile), shapes, y, places, speeds)


@helper
def _project_by_columns(blocks, y, places, speeds):
    """Sums of eight systems, which have one block, stay in registers."""
    shapes, m = blocks.shapes, len(blocks.shapes)
    for j in range(shapes.shape[1]):
        place, speed = 0.0, 0.0
        for i in range(m):
            place += shapes[i, j] * y[i]
            speed += shapes[i, j] * y[m + i]
        places[j], speeds[j] = place, speed


# Fill displacements and velocities (d n,) of the nodes: from 0 on x, n on y, 2 n on across.
project = by_kind(_project_by_tiles, _project_by_columns)


@helper
def project_block(ends, shapes, y, places, speeds):
    """Add to displacements and velocities what a block of the rows gives, see ``block_at``."""
    m = len(shapes)
    i, end, left, right = ends
    while i + 3 < end:
        for j in range(left, right):
            a, b, c, d = shapes[i, j], shapes[i + 1, j], shapes[i + 2, j], shapes[i + 3, j]
            places[j] += a * y[i] + b * y[i + 1] + c * y[i + 2] + d * y[i + 3]
            speeds[j] += (a * y[m + i] + b * y[m + i + 1] + c * y[m + i + 2]
                          + d * y[m + i + 3])
        i += 4
    while i < end:
        for j in range(left, right):
            places[j] += shapes[i, j] * y[i]
            speeds[j] += shapes[i, j] * y[m + i]
        i += 1


@helper
def change_of(row, j, n, w):
    """Change of what has the derivatives ``row`` (2 d,) by the motion of node j in w (3, d n)."""
    d, total = len(row) // 2, 0.0
    for axis in range(d):
        total += row[axis] * w[0, axis * n + j] + row[d + axis] * w[1, axis * n + j]
    return total


@helper
def add_node_forces(blocks, forces, out):
    """Add to ``out`` (m,) the modal forces of the node forces (d n,): -T, F, across."""
    shapes = blocks.shapes
    for tile in range(len(blocks.tiles)):
        top, bottom, left, right = block_at(blocks.tiles, tile)
        for i in range(top, bottom):
            total = 0.0
            for j in range(left, right):
                total += shapes[i, j] * forces[j]
            out[i] += total


@helper
def _gather_by_blocks(y, s, blocks, load, forces, rate):
    m = len(load)
    v = y[m : 2 * m]
    for i in range(m):
        rate[i] = v[i]
        rate[m + i] = load[i]
    for part in range(len(blocks.own)):
        top, bottom, left, right = block_at(blocks.own, part)
        for i in range(top, bottom):
            total = 0.0
            for k in range(left, right):
                total += s.stiffness[i, k] * y[k] + s.damping[i, k] * v[k]
            rate[m + i] -= total
    add_node_forces(blocks, forces, rate[m : 2 * m])


@helper
def _gather_by_rows(y, s, blocks, load, forces, rate):
    m, shapes = len(load), blocks.shapes
    for i in range(m):
        total = load[i]
        for k in range(m):
            total -= s.stiffness[i, k] * y[k] + s.damping[i, k] * y[m + k]
        for j in range(shapes.shape[1]):
            total += shapes[i, j] * forces[j]
        rate[i], rate[m + i] = y[m + i], total


# Fill the first 2 m entries of ``rate`` from node forces (d n,), see :func:`add_node_forces`.
# Without polynomial forces.
gather = by_kind(_gather_by_blocks, _gather_by_rows)


@helper
def set_forces(y, s, blocks, moved, w, scratch, rate):
    """Fill w[2] (d n,) with the node forces of :func:`add_node_forces`, and the z' of ``rate``.

    ``w`` (3, d n) holds the nodes as :func:`project` puts them there, ``scratch`` is workspace.
    """
    # Twice, because loops over axes are written out where their number is known.
    if s.rows.shape[1] == 2:
        _set_forces(y, s, blocks, moved, w, scratch, rate)
    else:
        _set_forces(y, s, blocks, moved, w, scratch, rate)


@helper
def _set_forces(y, s, blocks, moved, w, scratch, rate):
    """Body of :func:`set_forces`."""
    m, n = len(blocks.position), len(s.gap)
    states = (len(y) - 2 * m) // n
    forces = w[2]
    force, rates = scratch.force[0], scratch.rates[0]
    for at in range(blocks.used[0]):
        j = blocks.nodes[at]
        first = 2 * m + j * states
        node = node_forces(j, motion_of(at, w, s), moved, y[first : first + s.memory[j]], s, force,
                           rates)
        for axis in range(s.rows.shape[1]):
            forces[axis * n + at] = axis_force(axis, node, force, rates, s)
        for k in range(states):
            rate[first + k] = rates[k, 0] if k < s.memory[j] else 0.0


@helper
def set_rate(y, s, blocks, given, load, w, scratch, rate):
    """Fill ``rate`` (size,) with y', by forces of the nodes of ``blocks``.

    ``w`` (3, d n) and ``scratch`` are work arrays.
    """
    project(blocks, y, w[0], w[1])
    set_forces(y, s, blocks, motion_given(given), w, scratch, rate)
    gather(y, s, blocks, load, w[2], rate)
    if has_polynomial(s):
        add_polynomial_forces(y, s, rate[len(load) : 2 * len(load)])


@routine
def set_gradients(y, s, blocks, moved, w, out):
    """Fill the :class:`Gradients` ``out`` at the motion ``moved`` of the ground.

    The node forces go to w[2], in the order of :func:`add_node_forces`.
    """
    set_node_gradients(y, s, blocks, moved, w, out)
    if has_polynomial(s):
        set_polynomial_gradient(y, s, out.polynomial)


@helper
def set_node_gradients(y, s, blocks, moved, w, out):
    """Body of :func:`set_gradients` without polynomial forces."""
    project(blocks, y, w[0], w[1])
    if s.rows.shape[1] == 2:
        _set_node_gradients(y, s, blocks, moved, w, out)
    else:
        _set_node_gradients(y, s, blocks, moved, w, out)


@helper
def _set_node_gradients(y, s, blocks, moved, w, out):
    """Body of :func:`set_node_gradients`."""
    m, n = len(blocks.position), len(s.gap)
    states = out.rates.shape[1]
    forces = w[2]
    for at in range(blocks.used[0]):
        j = blocks.nodes[at]
        first = 2 * m + j * states
        node = node_gradients(j, motion_of(at, w, s), moved, y[first : first + s.memory[j]], s,
                              out.force[j], out.rates[j], out.partial[j])
        for axis in range(s.rows.shape[1]):
            forces[axis * n + at] = axis_force(axis, node, out.force[j], out.rates[j], s)


@routine
def set_rate_and_gradients(y, s, blocks, given, load, w, out, rate):
    """Fill ``rate`` as :func:`set_rate`, and the :class:`Gradients` ``out``."""
    set_node_gradients(y, s, blocks, motion_given(given), w, out)
    m, states = len(load), out.rates.shape[1]
    for j in range(len(s.gap)):
        for k in range(states):
            rate[2 * m + j * states + k] = out.rates[j, k, 0] if k < s.memory[j] else 0.0
    gather(y, s, blocks, load, w[2], rate)
    if has_polynomial(s):
        add_polynomial(y, s, out.polynomial, rate[m : 2 * m])


@helper
def copy_gradients(there, here, blocks):
    """Make the derivatives ``here`` those ``there``, at the nodes of ``blocks``."""
    for a in range(len(here.polynomial)):
        for k in range(here.polynomial.shape[1]):
            here.polynomial[a, k] = there.polynomial[a, k]
    states, width = here.rates.shape[1:]
    for at in range(blocks.used[0]):
        j = blocks.nodes[at]
        for row in range(here.partial.shape[1]):
            for k in range(here.partial.shape[2]):
                here.partial[j, row, k] = there.partial[j, row, k]
        for k in range(here.force.shape[1]):
            here.force[j, k] = there.force[j, k]
        for k in range(width):
            for row in range(states):
                here.rates[j, row, k] = there.rates[j, row, k]


@helper
def _next_number(t, end):
    return np.nextafter(t, end)


@helper
def _itself(t, end):
    return t


# The time just after t, on the way to the end: what is given may jump at t, but not in systems of
# which eight go side by side.
just_after = by_kind(_next_number, _itself)


@helper
def t_plus(step):
    """A time in a step so close to its begin that rates of what is given hardly change."""
    return min(step.t + 1e-4 * step.h, step.latest)


@helper
def ground_acceleration(t, later, moved, s):
    """Accelerations of the ground's two motions, by how fast they are ``later``; 0 at t itself."""
    ahead, per_time = nodes.ground_motion(later, s), _per(later - t)
    return ((ahead.speed - moved.speed) * per_time,
            (ahead.second_speed - moved.second_speed) * per_time)


@helper
def _per(duration):
    """One by a duration, zero where there is none."""
    return select(duration > 0.0, 1.0 / duration, 0.0)


@helper
def set_load_rate(t, later, after_t, s, out):
    """Fill ``out`` (m,) with the rates of the modal loads, but that of the springs of the drive.

    Rates of its dashpots follow from their pull ``later``; ``after_t`` is just after t.
    """
    for i in range(len(out)):
        out[i] = 0.0
    for axis in range(len(s.drive)):
        if somewhere(s.drive_damping[axis] != 0.0):
            rise = (signal_at(s.drive[axis])(later, s.drive_parameters[axis])[1]
                    - signal_at(s.drive[axis])(after_t, s.drive_parameters[axis])[1])
            quickening = s.drive_damping[axis] * (rise * _per(later - t))
            for i in range(len(out)):
                out[i] += quickening * s.drive_shapes[axis, i]
    for k in range(len(s.load)):
        rate = signal_at(s.load[k])(after_t, s.load_parameters[k])[1]
        for i in range(len(out)):
            out[i] += rate * s.load_shapes[k, i]


@routine
def set_time_rate(s, blocks, given, change, g, rate_of_loads, w, out):
    """Fill ``out`` (size,) with df/dt at a fixed state.

    ``change`` holds the rates of the ground's motion, ``rate_of_loads`` (m,) those of the modal
    loads; ``w`` (3, d n) is a work array.
    """
    m = len(rate_of_loads)
    for i in range(m):
        out[i] = 0.0
        out[m + i] = rate_of_loads[i]
        for axis in range(s.rows.shape[1]):
            out[m + i] += given[PULL_RATE + axis] * s.drive_shapes[axis, i]
    for k in range(2 * m, len(out)):
        out[k] = 0.0
    add_ground_change(change, s, blocks, g, w, out)


@routine
def add_ground_change(change, s, blocks, g, w, out):
    """Add to ``out`` (size,) what a change of the ground's motion makes of y'.

    The ground that moves on under a node acts as the node moving back: travel enters with x,
    speed with x'. ``w`` (3, d n) is a work array.
    """
    n, d = len(s.gap), s.rows.shape[1]
    m, states, forces = len(blocks.position), g.rates.shape[1], w[2]
    for at in range(blocks.used[0]):
        j = blocks.nodes[at]
        pressing = 0.0
        for row in range(d):
            forces[row * n + at] = 0.0
        for tangent in range(d - 1):
            place, speed = 2 * tangent, d + 2 * tangent
            moved = nodes.ground_moved(tangent, j, change.travel, change.second_travel, s)
            faster = nodes.ground_moved(tangent, j, change.speed, change.second_speed, s)
            for row in range(d):
                forces[row * n + at] -= (moved * g.partial[j, row, place]
                                         + faster * g.partial[j, row, speed])
            pressing -= moved * g.partial[j, d, place] + faster * g.partial[j, d, speed]
        for k in range(s.memory[j]):
            rate = g.rates[j, k, 2] * pressing
            for tangent in range(d - 1):
                rate -= (nodes.ground_moved(tangent, j, change.speed, change.second_speed, s)
                         * g.rates[j, k, slip_entry(tangent, states)])
            out[2 * m + j * states + k] += rate
    add_node_forces(blocks, forces, out[m : 2 * m])


@helper
def rates_of_ground(varying, moved):
    """Rates of the motion of ground of constant speed; zero if it is ``varying``.

    The stages know those of the latter.
    """
    part = 0.0 if varying else 1.0
    return nodes.GroundMotion(part * moved.speed, 0.0, part * moved.second_speed, 0.0)
