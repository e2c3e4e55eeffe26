"""Accelerations of the reduced system, and their derivatives, for the time integrator.

The same equations as :mod:`fecontact.system.kernels`, laid out for speed, by the blocks of
:mod:`fecontact.integrate.rodas5p.blocks`.
"""

import math
from typing import NamedTuple

from numba import types

from fecontact.core.compiled import block, helper, matrix
from fecontact.core.types import Array
from fecontact.integrate.rodas5p.blocks import block_at
from fecontact.laws.signatures import normal_at, signal_at
from fecontact.system import kernels as kernels

# Entries of what is given in time: drive x and y, travel and speed of the ground, and their rates.
PULL_X, PULL_Y, TRAVEL, SPEED, PULL_X_RATE, PULL_Y_RATE = range(6)
GIVEN = 6


class Gradients(NamedTuple):
    """Derivatives of the node forces, as :func:`fecontact.system.kernels.node_gradients` gives.

    partial : (n, 3, 4), derivatives of F, T and the pressing force to x, y, x', y'
    force : (n, 3 + s), rates : (n, s, 3 + s), of friction with memory
    """

    partial: Array
    force: Array
    rates: Array


GRADIENTS = types.NamedTuple([block, matrix, block], Gradients)


@helper
def set_given(t, s, given, load):
    """Fill ``given`` (6,) with what is given at time t, and ``load`` (m,) with its modal force."""
    for axis in range(2):
        stiffness, damping = s.drive_stiffness[axis], s.drive_damping[axis]
        if stiffness != 0.0 or damping != 0.0:
            value, rate = signal_at(s.drive[axis])(t, s.drive_parameters[axis])
            given[PULL_X + axis] = stiffness * value + damping * rate
            given[PULL_X_RATE + axis] = stiffness * rate
    given[TRAVEL], given[SPEED] = signal_at(s.ground_motion)(t, s.ground_motion_parameters)
    kernels.set_load(t, given[PULL_X], given[PULL_Y], s, load)


@helper
def motion_of(j, w):
    """Motion of node j, as :func:`project` puts it into w (3, 2 n)."""
    n = w.shape[1] // 2
    return kernels.NodeMotion(w[0, j], w[0, n + j], w[1, j], w[1, n + j])


@helper
def project(blocks, y, places, speeds):
    """Fill displacements and velocities (2 n,), all x, then all y, of the contact nodes."""
    shapes = blocks.shapes
    m, rows = shapes.shape
    for j in range(rows):
        places[j] = 0.0
        speeds[j] = 0.0
    for tile in range(len(blocks.tiles)):
        i, end, left, right = block_at(blocks.tiles, tile)
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
def moved_by(blocks, column, q):
    """Motion of a node, along it in column j, away from it in n + j, by modal coordinates q."""
    n = len(blocks.spans)
    j = column if column < n else column - n
    total = 0.0
    for span in range(blocks.spans.shape[1]):
        for i in range(blocks.spans[j, span, 0], blocks.spans[j, span, 1]):
            total += blocks.shapes[i, column] * q[i]
    return total


@helper
def push(blocks, forces, out):
    """Add to ``out`` (m,) the modal forces of the node forces (2 n,), all -T, then all F."""
    for tile in range(len(blocks.tiles)):
        top, bottom, left, right = block_at(blocks.tiles, tile)
        for i in range(top, bottom):
            total = 0.0
            for j in range(left, right):
                total += blocks.shapes[i, j] * forces[j]
            out[i] += total


@helper
def gather(y, s, blocks, load, forces, rate):
    """Fill the first 2 m entries of ``rate`` from the node forces (2 n,), all -T, then all F."""
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
    push(blocks, forces, rate[m : 2 * m])


@helper
def set_rate(y, s, blocks, given, load, w, scratch, rate):
    """Fill ``rate`` (size,) with y'. ``w`` (3, 2 n) and ``scratch`` are room to work in."""
    m, n = len(load), len(s.gap)
    states = (len(y) - 2 * m) // n
    forces = w[2]
    project(blocks, y, w[0], w[1])
    moved = kernels.GroundMotion(given[TRAVEL], given[SPEED])
    force, rates = scratch.force[0], scratch.rates[0]
    for j in range(n):
        first = 2 * m + j * states
        F, R, contact = kernels.node_forces(j, motion_of(j, w), moved,
                                            y[first : first + s.memory[j]], s, force, rates)
        forces[j] = -kernels.force_against_x(F, R, contact, s)
        forces[n + j] = F
        for k in range(states):
            rate[first + k] = rates[k, 0] if k < s.memory[j] else 0.0
    gather(y, s, blocks, load, forces, rate)


@helper
def set_rate_and_gradients(y, s, blocks, given, load, w, out, rate):
    """As :func:`set_rate`, and fill the :class:`Gradients` ``out``."""
    m, n = len(load), len(s.gap)
    states = (len(y) - 2 * m) // n
    forces = w[2]
    project(blocks, y, w[0], w[1])
    moved = kernels.GroundMotion(given[TRAVEL], given[SPEED])
    for j in range(n):
        first = 2 * m + j * states
        F, T, _ = kernels.node_gradients(j, motion_of(j, w), moved,
                                         y[first : first + s.memory[j]], s, out.force[j],
                                         out.rates[j], out.partial[j])
        forces[j] = -T
        forces[n + j] = F
        for k in range(states):
            rate[first + k] = out.rates[j, k, 0] if k < s.memory[j] else 0.0
    gather(y, s, blocks, load, forces, rate)


@helper
def set_time_rate(s, blocks, given, acceleration, g, rate_of_loads, w, out):
    """Fill ``out`` (size,) with df/dt at a fixed state.

    The ground that moves on under a node acts as the node moving back: travel enters with x,
    speed with x'. ``acceleration`` is that of the ground, ``rate_of_loads`` (m,) the rate of the
    modal loads.
    """
    m, n = len(rate_of_loads), len(s.gap)
    states = g.rates.shape[1]
    forces = w[2]
    for i in range(m):
        out[i] = 0.0
        out[m + i] = (rate_of_loads[i] + given[PULL_X_RATE] * s.drive_shapes[0, i]
                      + given[PULL_Y_RATE] * s.drive_shapes[1, i])
    for j in range(n):
        v, a = s.sliding[j] * given[SPEED], s.sliding[j] * acceleration
        forces[j] = v * g.partial[j, 1, 0] + a * g.partial[j, 1, 2]
        forces[n + j] = -v * g.partial[j, 0, 0] - a * g.partial[j, 0, 2]
        pressing = -v * g.partial[j, 2, 0] - a * g.partial[j, 2, 2]
        for k in range(states):
            out[2 * m + j * states + k] = (
                -a * g.rates[j, k, 1] + g.rates[j, k, 2] * pressing
                if k < s.memory[j] else 0.0)
    push(blocks, forces, out[m : 2 * m])


@helper
def next_kink(y, rate, s, blocks, g, depth, slow, speed, w, within):
    """Time until the forces of a node change their character, or ``within`` if later.

    By the velocity and acceleration of the nodes: touch-down and lift-off on level ground, the
    penetrations ``depth`` (n,), slip velocities that fall to ``slow`` (n,) of either sign, and
    normal forces that fall to zero. Stepping there saves the steps that would fail because
    forces change within them; it is an estimate, and nothing depends on its accuracy.
    """
    m, n = len(blocks.position), len(s.gap)
    project(blocks, y, w[0], w[1])
    for j in range(2 * n):
        w[2, j] = moved_by(blocks, j, rate[m : 2 * m])
    first = within
    for j in range(n):
        u, v, a = -w[0, n + j] - s.gap[j], -w[1, n + j], -w[2, n + j]
        first = _crossing(u, v, a, first)
        first = _crossing(u - depth[j], v, a, first)
        force = normal_at(s.normal[j])(u, v, s.normal_parameters[j])[0]
        if force > 0.0:
            fall = g.partial[j, 0, 1] * -v + g.partial[j, 0, 3] * -a
            if fall < 0.0 and -force / fall < first:
                first = -force / fall
            slip = w[1, j] - s.sliding[j] * speed
            towards = -w[2, j] if slip > 0.0 else w[2, j]
            if abs(slip) > 1.5 * slow[j] and (abs(slip) - slow[j]) < towards * first:
                first = (abs(slip) - slow[j]) / towards
    return first


@helper
def _crossing(u, v, a, within):
    """Smallest positive root of u + v t + a t^2 / 2, or ``within`` if that is earlier."""
    if u * v > 0.0 and u * a >= 0.0:
        return within
    discriminant = v * v - 2.0 * a * u
    if discriminant < 0.0:
        return within
    q = -(v + math.copysign(math.sqrt(discriminant), v))
    one = q / a if a != 0.0 else -1.0
    other = 2.0 * u / q if q != 0.0 else -1.0
    if 0.0 < one < within:
        within = one
    if 0.0 < other < within:
        within = other
    return within
