"""Forces of elastic Coulomb elements in harmonic balance, node by node and one by one.

Elements of plane bodies are followed exactly, see
:mod:`fecontact.bifurcation.harmonic.stick_and_slip`. Along two tangents they are found at the
samples, each by itself, see :func:`fecontact.bifurcation.harmonic.memory.solve_around_limit`.
Derivatives are those to a node's own coefficients, whatever the number of modes.
"""

import math
from typing import NamedTuple

import numpy as np

from fecontact.bifurcation.harmonic.memory import (
    LEAK,
    Sliding,
    difference,
    solve_around,
    solve_around_limit,
    take_element,
)
from fecontact.bifurcation.harmonic.slip_path import Path, cut_pieces, moved_at
from fecontact.bifurcation.harmonic.stick_and_slip import Element, Sums, follow_along
from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.records import Block, IntegerVector, Matrix, Vector
from fecontact.system.elastic_sliders import limit_of
from fecontact.system.node_forces import normal_gradients, set_friction
from fecontact.system.nodes import (
    SystemArrays,
    ground_motion,
    ground_speed,
    motion_in,
    node_contact,
)


class Displacements(NamedTuple):
    """Displacements of the modes over a period T [s].

    ``coefficients`` (L, m) are those of their series, ``values`` (N, L) the functions of the series
    at the samples.
    """

    coefficients: Matrix
    period: float
    values: Matrix


class ElementForces(NamedTuple):
    """Elements of n nodes at N samples.

    Their friction (t n, N) along the t tangents of each node, their deflections (N, c), and the
    derivatives (t n, N, d L) of the former to the coefficients of a node along its d axes.
    """

    friction: Matrix
    deflections: Matrix
    rows: Block


class NodeSamples(NamedTuple):
    """Motion of a node with d axes, and the force that presses it, at N samples.

    ``series`` (d, L) are the coefficients of its displacements along the axes; ``moved`` (N, 2 d)
    places and velocities; ``pressing`` (N,) the force, ``slopes`` (N, d L) its derivatives.
    """

    series: Matrix
    moved: Matrix
    pressing: Vector
    slopes: Matrix


@helper
def _node_samples(d, values):
    """Arrays for a node with d axes."""
    N, L = values.shape
    return NodeSamples(np.empty((d, L)), np.empty((N, 2 * d)), np.empty(N), np.zeros((N, d * L)))


@routine
def _set_samples(j, x, s, derivatives, node):
    """Fill motion and force of node j.

    Returns whether the force varies, or may vary, and whether this or the slip depend on the period
    for given coefficients.
    """
    X, T, values = x.coefficients, x.period, x.values
    series, moved, pressing, slopes = node.series, node.moved, node.pressing, node.slopes
    N, L = values.shape
    d, m = len(series), X.shape[1]
    series[:, :] = 0.0
    for axis in range(d):
        for k in range(L):
            for i in range(m):
                series[axis, k] += s.rows[j, axis, i] * X[k, i]
    gradients = np.empty((d + 1, 2 * d))
    varies, timed = False, False
    for n in range(N):
        for axis in range(d):
            place, speed = series[axis, 0], 0.0
            for k in range(1, L // 2 + 1):
                w, c, e = 2.0 * math.pi * k / T, values[n, 2 * k - 1], values[n, 2 * k]
                one, other = series[axis, 2 * k - 1], series[axis, 2 * k]
                place += one * c + other * e
                speed += w * (other * c - one * e)
            moved[n, axis], moved[n, d + axis] = place, speed
        ground = ground_motion(n * T / N, s)
        contact = node_contact(j, motion_in(moved[n], d), ground, s)
        pressing[n] = normal_gradients(j, contact, s, gradients)[1]
        for tangent in range(d - 1):
            timed = timed or ground_speed(tangent, j, ground, s) != 0.0
        varies = varies or pressing[n] != pressing[0]
        for axis in range(d):
            place, speed = gradients[d, axis], gradients[d, d + axis]
            varies = varies or place != 0.0 or speed != 0.0
            timed = timed or speed != 0.0
            if derivatives:
                slopes[n, axis * L] = place
                for k in range(1, L // 2 + 1):
                    w, c, e = 2.0 * math.pi * k / T, values[n, 2 * k - 1], values[n, 2 * k]
                    slopes[n, axis * L + 2 * k - 1] = place * c - speed * w * e
                    slopes[n, axis * L + 2 * k] = place * e + speed * w * c
    return varies, timed


@routine
def _along_one_tangent(j, x, s, count, offsets, friction, z, rows):
    """Forces of the ``count`` elements of a node of a plane body; see :func:`element_forces`."""
    T, values, derivatives = x.period, x.values, len(rows) > 0
    N, L = values.shape
    node, nothing = _node_samples(2, values), np.empty((0, 2 * L))
    varies, timed = _set_samples(j, x, s, derivatives, node)
    slopes, most = node.slopes, 3 * N
    path = Path(node.series[0], node.pressing, slopes if varies else nothing,
                np.empty(most, dtype=np.int64), np.empty(most), np.empty(most), np.empty(most),
                np.empty(most), np.empty(most), np.empty(most), s.sliding[j, 0, 0], T)
    pieces = cut_pieces(path, s)
    own = rows[0] if derivatives else nothing
    own[:, :] = 0.0
    workspace, p, done = np.empty((5, 2 * L)), s.friction_parameters[j], 1
    sums = Sums(friction[0], own, np.zeros(N), np.zeros(N),
                np.zeros((N if derivatives else 0, 2 * L)), workspace[0], workspace[1],
                workspace[2], workspace[3], workspace[4])
    start = moved_at(path, 0, 0.0, s)[0] + path.slides * ground_motion(0.0, s).travel
    for i in range(count):
        element = Element(limit_of(j, i, count, 1.0, s), p[1 + i], start + offsets[i], p[0])
        if not follow_along(path, pieces, element, s, z[:, i], sums):
            done = 0
    if not derivatives:
        return done, timed
    stiffness, limits, kept = 0.0, 0.0, workspace[0]
    kept[:] = 0.0
    for n in range(N):
        stiffness += sums.held[n]
        limits += sums.sliding[n]
        for k in range(2 * L):
            kept[k] += sums.turned[n, k]
            own[n, k] += kept[k]
        for k in range(L):
            own[n, k] += stiffness * values[n, k]
        if varies:
            for k in range(2 * L):
                own[n, k] += limits * slopes[n, k]
    return done, timed


@routine
def _along_two_tangents(j, x, s, count, offsets, r, z, rows):
    """Forces of the ``count`` elements of a node in space; see :func:`element_forces`."""
    T, values, derivatives = x.period, x.values, len(rows) > 0
    N, L = values.shape
    node = _node_samples(3, values)
    _, timed = _set_samples(j, x, s, derivatives, node)
    moved, pressing, slopes = node.moved, node.pressing, node.slopes
    rate, leak = N / T, LEAK / T
    slip, target, path = np.empty((N, 3)), np.empty((N, 2)), np.empty((N, 2))
    p, force, rates, blocks = np.empty(3), np.empty(12), np.empty((2, 6)), np.array([2])
    by_z, change = np.empty((N, 1, 2, 2)), np.empty((N if derivatives else 0, 2, 3 * L))
    by_pair = np.empty((N, 2, 3))
    for n in range(N):
        ground = ground_motion(n * T / N, s)
        slip[n, 2] = pressing[n]
        for c in range(2):
            slip[n, c] = rate * difference(moved, n, 2 * c) - ground_speed(c, j, ground, s)
    rows[:, :, :] = 0.0
    done = 1
    for i in range(count):
        take_element(j, i, count, s, p)
        for n in range(N):
            for c in range(2):
                target[n, c] = moved[n, 2 * c] + offsets[2 * i + c]
        if solve_around_limit(j, s, T, Sliding(p, slip), target, path) == 0:
            done = 0
        for n in range(N):
            set_friction(j, (slip[n, 0], slip[n, 1]), slip[n, 2], path[n], p, s, force, rates)
            for c in range(2):
                z[n, 2 * i + c] = path[n, c]
                r[c, n] += force[6 * c]
                for k in range(2):
                    by_z[n, 0, c, k] = rates[c, 3 + k]
                    by_pair[n, c, k] = force[6 * c + 3 + k]
                by_pair[n, c, 2] = force[6 * c + 2]
                if not derivatives:
                    continue
                for k in range(3 * L):
                    change[n, c, k] = rates[c, 2] * slopes[n, k]
                for k in range(L):
                    speed = rate * difference(values, n, k)
                    change[n, c, k] += rates[c, 1] * speed
                    change[n, c, 2 * L + k] += rates[c, 5] * speed
                    change[n, c, 2 * L * c + k] += leak * values[n, k]
        if not derivatives:
            continue
        solve_around(by_z, T, blocks, change)
        for n in range(N):
            for c in range(2):
                for k in range(3 * L):
                    rows[c, n, k] += (by_pair[n, c, 0] * change[n, 0, k]
                                      + by_pair[n, c, 1] * change[n, 1, k]
                                      + by_pair[n, c, 2] * slopes[n, k])
    return done, timed


@kernel(by_address=True)
def element_forces(
    x: Displacements, s: SystemArrays, elements: IntegerVector, offsets: Vector, derivatives: bool,
    out: ElementForces,
) -> int:
    """Fill ``out``, without derivatives but for these.

    s is the system with elements, ``elements`` (n,) their numbers, ``offsets`` (c,) deflections
    less displacements of those that never slide. Returns 0 where an element does not come to
    repeat, else 1, or 2 if the friction depends on the period for given coefficients.
    """
    tangents = s.rows.shape[1] - 1
    states = len(offsets) // len(elements)
    done, by_period = 1, False
    out.friction[:] = 0.0
    out.deflections[:, :] = 0.0
    for j in range(len(elements)):
        if elements[j] == 0:
            continue
        first, at = tangents * j, j * states
        friction = out.friction[first : first + tangents]
        z, kept = out.deflections[:, at : at + states], offsets[at : at + states]
        rows = out.rows[first : first + tangents] if derivatives else out.rows[:0]
        if tangents == 1:
            found, timed = _along_one_tangent(j, x, s, elements[j], kept, friction, z, rows)
        else:
            found, timed = _along_two_tangents(j, x, s, elements[j], kept, friction, z, rows)
        done, by_period = min(done, found), by_period or timed
    return 2 * done if by_period else done


element_forces_at = function_at(element_forces)


@kernel
def follow_elements(
    x: Displacements, s: SystemArrays, elements: IntegerVector, offsets: Vector, derivatives: int,
    out: ElementForces,
) -> int:
    """:func:`element_forces` for Python; ``rows`` may be empty without derivatives."""
    return element_forces(x, s, elements, offsets, derivatives != 0, out)
