"""Forces of elastic Coulomb elements in harmonic balance, node by node and one by one.

Elements of plane bodies are followed exactly, see
:mod:`fecontact.bifurcation.harmonic.stick_and_slip`. Along two tangents they are found at the
samples, each by itself, see :func:`fecontact.bifurcation.harmonic.memory.solve_around_limit`.
Derivatives are those to a node's own coefficients, whatever the number of modes.
"""

import math

import numpy as np

from fecontact.bifurcation.harmonic.memory import (
    LEAK,
    solve_around,
    solve_around_limit,
    take_element,
)
from fecontact.bifurcation.harmonic.slip_path import Path, cut_pieces, moved_at
from fecontact.bifurcation.harmonic.stick_and_slip import follow_along
from fecontact.core.addresses import function_at
from fecontact.core.compiled import kernel, routine
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


@routine
def _pressing_of(j, X, T, values, s, derivatives, series, moved, pressing, slopes):
    """Fill series and motion of node j, the force that presses it, and its derivatives.

    X (L, m) are coefficients of the displacements, those of the node along its d axes are
    ``series`` (d, L); its places and velocities at the samples are ``moved`` (N, 2 d). Returns
    whether ``pressing`` (N,) varies, or may vary, and whether this or the slip depend on T for
    given coefficients; ``slopes`` are (N, d L).
    """
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
def _along_one_tangent(j, X, T, s, count, offsets, values, derivatives, r, z, rows):
    """Forces of the ``count`` elements of a node of a plane body; see :func:`element_forces`."""
    N, L = values.shape
    series, moved, pressing = np.empty((2, L)), np.empty((N, 4)), np.empty(N)
    slopes, nothing = np.zeros((N, 2 * L)), np.empty((0, 2 * L))
    varies, timed = _pressing_of(j, X, T, values, s, derivatives, series, moved, pressing, slopes)
    most = 3 * N
    path = Path(series[0], pressing, slopes if varies else nothing,
                np.empty(most, dtype=np.int64), np.empty(most), np.empty(most), np.empty(most),
                np.empty(most), np.empty(most), np.empty(most), s.sliding[j, 0, 0], T)
    pieces = cut_pieces(path, s)
    own = rows[0] if derivatives else nothing
    own[:, :] = 0.0
    workspace, p, done = np.empty((5, 2 * L)), s.friction_parameters[j], 1
    held, sliding = np.zeros(N), np.zeros(N)
    turned = np.zeros((N if derivatives else 0, 2 * L))
    start = moved_at(path, 0, 0.0, s)[0] + path.slides * ground_motion(0.0, s).travel
    for i in range(count):
        if not follow_along(path, pieces, limit_of(j, i, count, 1.0, s), p[1 + i],
                            start + offsets[i], p[0], s, z[:, i], r[0], (held, sliding, turned),
                            own, workspace):
            done = 0
    if not derivatives:
        return done, timed
    stiffness, limits, kept = 0.0, 0.0, workspace[0]
    kept[:] = 0.0
    for n in range(N):
        stiffness += held[n]
        limits += sliding[n]
        for k in range(2 * L):
            kept[k] += turned[n, k]
            own[n, k] += kept[k]
        for k in range(L):
            own[n, k] += stiffness * values[n, k]
        if varies:
            for k in range(2 * L):
                own[n, k] += limits * slopes[n, k]
    return done, timed


@routine
def _along_two_tangents(j, X, T, s, count, offsets, values, derivatives, r, z, rows):
    """Forces of the ``count`` elements of a node in space; see :func:`element_forces`."""
    N, L = values.shape
    series, moved, pressing = np.empty((3, L)), np.empty((N, 6)), np.empty(N)
    slopes = np.zeros((N, 3 * L))
    _, timed = _pressing_of(j, X, T, values, s, derivatives, series, moved, pressing, slopes)
    rate, leak = N / T, LEAK / T
    slip, target, path = np.empty((N, 3)), np.empty((N, 2)), np.empty((N, 2))
    p, force, rates, blocks = np.empty(3), np.empty(12), np.empty((2, 6)), np.array([2])
    by_z, change = np.empty((N, 1, 2, 2)), np.empty((N if derivatives else 0, 2, 3 * L))
    by_pair = np.empty((N, 2, 3))
    for n in range(N):
        ground = ground_motion(n * T / N, s)
        slip[n, 2] = pressing[n]
        for c in range(2):
            slip[n, c] = rate * (1.5 * moved[n, 2 * c] - 2.0 * moved[n - 1, 2 * c]
                                 + 0.5 * moved[n - 2, 2 * c]) - ground_speed(c, j, ground, s)
    rows[:, :, :] = 0.0
    done = 1
    for i in range(count):
        take_element(j, i, count, s, p)
        for n in range(N):
            for c in range(2):
                target[n, c] = moved[n, 2 * c] + offsets[2 * i + c]
        if solve_around_limit(j, s, T, slip, p, target, path) == 0:
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
                    speed = rate * (1.5 * values[n, k] - 2.0 * values[n - 1, k]
                                    + 0.5 * values[n - 2, k])
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
    X: Matrix, T: float, s: SystemArrays, laws: SystemArrays, elements: IntegerVector,
    offsets: Vector, values: Matrix, derivatives: bool, r: Matrix, z: Matrix, rows: Block,
) -> int:
    """Fill r (t n, N) with the friction of the elements of n nodes along their t tangents.

    X (L, m) are coefficients of the displacements, T the period [s], s the system without elements
    and ``laws`` with them, ``elements`` (n,) their numbers, ``offsets`` (c,) deflections less
    displacements of those that never slide, ``values`` (N, L) the series at the samples. Also fills
    the deflections z (N, c) and, with derivatives, rows (t n, N, d L) of those of r to the
    coefficients of a node along its d axes. Returns 0 where an element does not come to repeat,
    else 1, or 2 if r depends on T for given X.
    """
    tangents = s.rows.shape[1] - 1
    states = len(offsets) // len(elements)
    done, by_period = 1, False
    r[:, :] = 0.0
    z[:, :] = 0.0
    for j in range(len(elements)):
        if elements[j] == 0:
            continue
        first, at = tangents * j, j * states
        own = rows[first : first + tangents] if derivatives else rows
        if tangents == 1:
            found, timed = _along_one_tangent(
                j, X, T, s, elements[j], offsets[at : at + states], values, derivatives,
                r[first : first + 1], z[:, at : at + states], own)
        else:
            found, timed = _along_two_tangents(
                j, X, T, laws, elements[j], offsets[at : at + states], values, derivatives,
                r[first : first + 2], z[:, at : at + states], own)
        done, by_period = min(done, found), by_period or timed
    return 2 * done if by_period else done


element_forces_at = function_at(element_forces)


@kernel
def follow_elements(
    X: Matrix, T: float, s: SystemArrays, laws: SystemArrays, elements: IntegerVector,
    offsets: Vector, values: Matrix, derivatives: int, r: Matrix, z: Matrix, rows: Block,
) -> int:
    """:func:`element_forces` for Python; ``rows`` may be empty without derivatives."""
    return element_forces(X, T, s, laws, elements, offsets, values, derivatives != 0, r, z, rows)
