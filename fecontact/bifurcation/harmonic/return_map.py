r"""Return map of elastic Coulomb elements over the samples of a period, and its derivatives.

From sample to sample the slip s of a node changes by

    \Delta s_n = W (q_n - q_(n-1)) - (V_n + V_(n-1)) T / (2 N)

with the tangential rows W of the node and the velocity V of the other side. The deflection of an
element is ``z_n + Delta s`` as long as it sticks; beyond its limit l = mu F / k it returns to the
limit along its own direction. The map is exact for slip that is linear between samples. Stored are
the deflections before their return: an element slides at the samples where these exceed the limit.
"""

import numpy as np
from numba import types

from fecontact.core.compiled import block, f8, helper, kernel, matrix, vector
from fecontact.core.references import borrowed
from fecontact.system.elastic_sliders import deflection_of, limit_of, pressing_on
from fecontact.system.kernels import node_forces, node_gradients
from fecontact.system.nodes import (
    SYSTEM,
    force_room,
    ground_motion,
    in_space,
    memory_of,
    moved_across,
    moved_along,
    node_motion,
)

# Largest number of rounds in space, and the relative change that ends them.
_ROUNDS, _REPEATS = 400, 1e-13
# Net slip over a period, relative to its path, that counts as none.
_CLOSED = 1e-12


@helper
def has_elements(j, states, springs):
    """Return True if node j has elastic Coulomb elements: rows of ``springs`` that are not zero."""
    for i in range(j * states, (j + 1) * states):
        for k in range(springs.shape[1]):
            if springs[i, k] != 0.0:
                return True
    return False


@helper
def _take_path(j, t, y, s, T, slips, pressings, force, rates):
    """Fill the changes of slip (N, 2) and the pressing forces (N,) of node j."""
    N, m = len(t), s.Tx.shape[1]
    half = 0.5 * T / N
    for n in range(N):
        moved, before = ground_motion(t[n], s), ground_motion(t[n - 1], s)
        F, _, contact = node_forces(j, node_motion(j, y[n], s), moved, memory_of(j, y[n], s), s,
                                    force, rates)
        pressings[n] = pressing_on(j, contact, F, s)
        along = -half * (moved_along(j, moved.speed, moved.second_speed, s)
                         + moved_along(j, before.speed, before.second_speed, s))
        across = 0.0
        for k in range(m):
            along += s.Tx[j, k] * (y[n, k] - y[n - 1, k])
        if in_space(s):
            across = -half * (moved_across(j, moved.speed, moved.second_speed, s)
                              + moved_across(j, before.speed, before.second_speed, s))
            for k in range(m):
                across += s.T2[j, k] * (y[n, k] - y[n - 1, k])
        slips[n, 0], slips[n, 1] = along, across


@helper
def _march_in_plane(j, i, first, slips, pressings, s, target, z):
    """March element i of node j; column ``first`` of z.

    A period maps the deflection z to max(low, min(high, z + net slip)): its fixed point is an end
    of this range, or without net slip the value of the range next to the target.
    """
    N, count = len(slips), s.memory[j]
    low, high, net, path = -np.inf, np.inf, 0.0, 0.0
    for n in range(N):
        change, limit = slips[n, 0], limit_of(j, i, count, pressings[n], s)
        low = min(max(low + change, -limit), limit)
        high = min(max(high + change, -limit), limit)
        net += change
        path += abs(change)
    here = target[N - 1, first]
    if abs(net) > _CLOSED * path:
        here = high if net > 0.0 else low
    here = min(max(here, low), high)
    for n in range(N):
        limit = limit_of(j, i, count, pressings[n], s)
        z[n, first] = here + slips[n, 0]
        here = min(max(z[n, first], -limit), limit)


@helper
def _march_in_space(j, i, first, slips, pressings, s, target, z):
    """March element i of node j until it repeats; columns ``first`` and the next of z.

    Returns whether it does. Newton's method finds the start; where it leads away, the map is
    repeated, which never does.
    """
    N, count = len(slips), s.memory[j] // 2
    a0, b0 = target[N - 1, first], target[N - 1, first + 1]
    last, newton = np.inf, True
    for _ in range(_ROUNDS):
        a, b, size = a0, b0, 0.0
        # Derivatives to the start.
        aa, ab, ba, bb = 1.0, 0.0, 0.0, 1.0
        for n in range(N):
            limit = limit_of(j, i, count, pressings[n], s)
            a += slips[n, 0]
            b += slips[n, 1]
            z[n, first], z[n, first + 1] = a, b
            length = np.hypot(a, b)
            if length > limit:
                part, e, f = limit / length, a / length, b / length
                a, b = part * a, part * b
                for column in range(2):
                    p, q = (aa, ba) if column == 0 else (ab, bb)
                    along = e * p + f * q
                    p, q = part * (p - e * along), part * (q - f * along)
                    if column == 0:
                        aa, ba = p, q
                    else:
                        ab, bb = p, q
            size = max(size, length)
        off_a, off_b = a - a0, b - b0
        off = np.hypot(off_a, off_b)
        if off <= _REPEATS * size:
            return True
        newton = off < last or not newton
        last = off
        determinant = (1.0 - aa) * (1.0 - bb) - ab * ba
        if newton and determinant > 1e-12:
            a0 += ((1.0 - bb) * off_a + ab * off_b) / determinant
            b0 += ((1.0 - aa) * off_b + ba * off_a) / determinant
        else:
            a0, b0 = a, b
    return False


@helper
def march_elements(j, t, y, s, T, target, z, force, rates):
    """Fill the columns of node j of z (N, c) with deflections that repeat, before their return.

    t (N,) and y (N, d) are times and states of the samples. An element that never slides has the
    deflections ``target`` (N, c). Returns whether all elements come to repeat.
    """
    N, states = len(t), s.memory.max()
    slips, pressings = np.empty((N, 2)), np.empty(N)
    _take_path(j, t, y, s, T, slips, pressings, force, rates)
    done = True
    if in_space(s):
        for i in range(s.memory[j] // 2):
            done = _march_in_space(j, i, j * states + 2 * i, slips, pressings, s, target,
                                   z) and done
    else:
        for i in range(s.memory[j]):
            _march_in_plane(j, i, j * states + i, slips, pressings, s, target, z)
    return done


@kernel(types.void(vector, matrix, SYSTEM, matrix, block))
def take_return_derivatives(t, y, s, springs, J):
    """Replace the rows of elements in J (N, d, d) by the derivatives of the returned deflections.

    Those to the state y (N, d) before the return, which holds the deflections z. The diagonal is
    one where an element sticks.
    """
    t, y, s, springs, J = borrowed(t), borrowed(y), borrowed(s), borrowed(springs), borrowed(J)
    n, m = s.Tx.shape
    states, space = s.memory.max(), in_space(s)
    tangents = 2 if space else 1
    length, width = force_room(states, space)
    force, rates = np.empty(length), np.empty((states, width))
    partial = np.empty((4, 6)) if space else np.empty((3, 4))
    for j in range(n):
        if not has_elements(j, states, springs):
            continue
        count, p = s.memory[j] // tangents, s.friction_parameters[j]
        for place in range(len(t)):
            z, A = memory_of(j, y[place], s), J[place]
            F, _, contact = node_gradients(j, node_motion(j, y[place], s),
                                           ground_motion(t[place], s), z, s, force, rates, partial)
            pressing = pressing_on(j, contact, F, s)
            for i in range(count):
                limit, size = limit_of(j, i, count, pressing, s), deflection_of(z, i, s)
                slope = limit / pressing if pressing > 0.0 else p[1 + count + i] / p[1 + i]
                first = 2 * m + j * states + tangents * i
                for c in range(tangents):
                    A[first + c, :] = 0.0
                    if size <= limit:
                        A[first + c, first + c] = 1.0
                        continue
                    e = z[tangents * i + c] / size
                    for k in range(m):
                        A[first + c, k] = e * slope * (partial[2, 0] * s.Tx[j, k]
                                                       + partial[2, 1] * s.Ty[j, k])
                        A[first + c, m + k] = e * slope * (partial[2, 2] * s.Tx[j, k]
                                                           + partial[2, 3] * s.Ty[j, k])
                        if space:
                            A[first + c, k] += e * slope * partial[2, 4] * s.T2[j, k]
                            A[first + c, m + k] += e * slope * partial[2, 5] * s.T2[j, k]
                    if space:
                        for other in range(2):
                            same = 1.0 if other == c else 0.0
                            A[first + c, first + other] = limit / size * (
                                same - e * z[2 * i + other] / size)


@kernel(types.void(vector, matrix, SYSTEM, matrix, f8, block, matrix))
def take_return_sums(t, y, s, springs, T, J, out):
    """Fill the columns of elements in out (N, c): change of slip, and limit at the sample before.

    The limit counts, along its direction, where an element slid at that sample by ``J`` of
    :func:`take_return_derivatives`. Differences of ``out`` are derivatives to a parameter.
    """
    t, y, s, springs, J, out = (borrowed(t), borrowed(y), borrowed(s), borrowed(springs),
                                borrowed(J), borrowed(out))
    n, m = s.Tx.shape
    N, states, space = len(t), s.memory.max(), in_space(s)
    tangents = 2 if space else 1
    length, width = force_room(states, space)
    force, rates = np.empty(length), np.empty((states, width))
    slips, pressings = np.empty((N, 2)), np.empty(N)
    for j in range(n):
        if not has_elements(j, states, springs):
            continue
        count = s.memory[j] // tangents
        _take_path(j, t, y, s, T, slips, pressings, force, rates)
        for place in range(N):
            z = memory_of(j, y[place - 1], s)
            for i in range(count):
                limit, size = limit_of(j, i, count, pressings[place - 1], s), deflection_of(z, i, s)
                for c in range(tangents):
                    column = j * states + tangents * i + c
                    out[place, column] = slips[place, c]
                    if J[place - 1, 2 * m + column, 2 * m + column] != 1.0:
                        out[place, column] += limit * z[tangents * i + c] / size


@helper
def solve_elements(slopes, node, tangents, starts, x):
    """Replace the right sides x of the elements of a node by z_n = A_(n-1) z_(n-1) + x_n, cyclic.

    ``slopes`` (N, n, s, s) holds the matrices A. An element that never slides has z_0 from
    ``starts`` (c, columns).
    """
    N, s, columns = slopes.shape[0], slopes.shape[2], x.shape[2]
    z, new = np.empty((tangents, columns)), np.empty((tangents, columns))
    turned, ring = np.empty((tangents, tangents)), np.empty((tangents, tangents))
    for first in range(0, s, tangents):
        row = node * s + first
        slid = False
        z[:, :] = 0.0
        turned[:, :] = 0.0
        for a in range(tangents):
            turned[a, a] = 1.0
        for n in range(N):
            A = slopes[n - 1, node]
            slid = slid or A[first, first] != 1.0
            for a in range(tangents):
                for c in range(columns):
                    new[a, c] = x[n, row + a, c]
                for c in range(tangents):
                    ring[a, c] = 0.0
                for b in range(tangents):
                    part = A[first + a, first + b]
                    if part != 0.0:
                        for c in range(columns):
                            new[a, c] += part * z[b, c]
                        for c in range(tangents):
                            ring[a, c] += part * turned[b, c]
            z[:, :] = new
            turned[:, :] = ring
        if slid:
            # The last value z obeys (1 - turned) z = what was found without it.
            for a in range(tangents):
                for b in range(tangents):
                    ring[a, b] = (1.0 if a == b else 0.0) - turned[a, b]
            if tangents == 1:
                for c in range(columns):
                    z[0, c] /= ring[0, 0]
            else:
                determinant = ring[0, 0] * ring[1, 1] - ring[0, 1] * ring[1, 0]
                for c in range(columns):
                    one, two = z[0, c], z[1, c]
                    z[0, c] = (ring[1, 1] * one - ring[0, 1] * two) / determinant
                    z[1, c] = (ring[0, 0] * two - ring[1, 0] * one) / determinant
        else:
            for a in range(tangents):
                for c in range(columns):
                    z[a, c] = starts[row + a, c] - x[0, row + a, c]
        for n in range(N):
            A = slopes[n - 1, node]
            for a in range(tangents):
                for c in range(columns):
                    new[a, c] = x[n, row + a, c]
                for b in range(tangents):
                    part = A[first + a, first + b]
                    if part != 0.0:
                        for c in range(columns):
                            new[a, c] += part * z[b, c]
            z[:, :] = new
            for a in range(tangents):
                for c in range(columns):
                    x[n, row + a, c] = new[a, c]
