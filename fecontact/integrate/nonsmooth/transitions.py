"""Compiled decisions of set-valued contact: which clusters stick, which stops close, and impacts.

A cluster without slip velocity sticks if a friction force within its limit holds it. Those of all
such clusters are the solution of a quadratic program, found by projected Gauss-Seidel sweeps:

    -L_c <= R_c <= L_c,    a_c = 0 where |R_c| < L_c,    sign(R_c) a_c >= 0 where |R_c| = L_c

Impacts on rigid stops follow Newton's law with restitution e: impulses P_j >= 0 of the nodes in
contact, with the penetration rates v- before and v+ after, ``v+ + e max(v-, 0) <= 0``, and
``P_j = 0`` unless that is zero.
"""

import math

import numpy as np

from fecontact.core.compiled import helper
from fecontact.integrate.nonsmooth.equations import (
    derivative,
    lifting_row,
    sinking_row,
    solve_small,
    speed_rate,
)
from fecontact.integrate.nonsmooth.problem import (
    CURVED,
    FIXED,
    OPEN,
    PENETRATION,
    RATE,
    SLOPE,
    STICK,
)
from fecontact.system.kernels import CONTACT_DAMPING

SWEEPS = 20000


@helper
def hold_velocity(p, held, w, Y):
    """Change q' so that the held clusters have no slip velocity; w.slip must be theirs."""
    clusters, m = p.rows.shape
    count = 0
    for c in range(clusters):
        if held[c]:
            w.indices[count] = c
            count += 1
    if count == 0:
        return
    for a in range(count):
        w.right[a] = w.slip[w.indices[a]]
        for b in range(count):
            total = 0.0
            for i in range(m):
                total += p.rows[w.indices[a], i] * p.rows[w.indices[b], i]
            w.matrix[a, b] = total
    solve_small(w, count)
    for a in range(count):
        for i in range(m):
            Y[m + i] -= p.rows[w.indices[a], i] * w.right[a]


@helper
def _least_friction(p, candidate, relative, w):
    """Forces of the candidates put into w.right, and what remains of a into ``relative``."""
    clusters, m = p.rows.shape
    for c in range(clusters):
        w.right[c] = 0.0
        for d in range(clusters):
            total = 0.0
            for i in range(m):
                total += p.rows[c, i] * p.rows[d, i]
            w.matrix[c, d] = total
    for _ in range(SWEEPS):
        moved, scale = 0.0, 0.0
        for c in range(clusters):
            if not candidate[c]:
                continue
            force = w.right[c] + relative[c] / w.matrix[c, c]
            force = min(max(force, -w.limit[c]), w.limit[c])
            change = force - w.right[c]
            w.right[c] = force
            for d in range(clusters):
                relative[d] -= w.matrix[d, c] * change
            moved, scale = max(moved, abs(change)), max(scale, abs(force))
        if moved <= 1e-15 * scale:
            break


@helper
def decide_clusters(t, p, progress, room, near, w, out):
    """Set the status of all clusters at a moment at which some may change.

    ``room.released`` clusters have reached the limit of stick and slip in the sense of ``status``;
    those whose slip has ``arrived`` at its end, up to the error of the step, and others with a
    slip velocity below ``near`` stick or slip by their forces. ``room.fresh`` tells those that
    begin to slip from no slip velocity. Fills ``out`` with Y'.
    """
    clusters, m = p.rows.shape
    Y, status, closed = progress.state, progress.status, progress.closed
    released, arrived, fresh = room.released, room.arrived, room.fresh
    derivative(t, Y, p, status, closed, w, out)
    candidate, held = np.zeros(clusters, np.bool_), np.zeros(clusters, np.bool_)
    for c in range(clusters):
        fresh[c] = False
        if status[c] == FIXED:
            continue
        still = status[c] == STICK or arrived[c] or abs(w.slip[c]) <= near
        if not w.pressing[c] > 0.0:
            status[c] = OPEN
        elif released[c]:
            fresh[c] = held[c] = True
        elif still:
            candidate[c] = held[c] = True
        else:
            status[c] = 1 if w.slip[c] > 0.0 else -1
    relative = np.empty(clusters)
    for _ in range(clusters + 1):
        for c in range(clusters):
            if candidate[c]:
                status[c] = OPEN
        derivative(t, Y, p, status, closed, w, out)
        ground = speed_rate(t, p)
        largest = 0.0
        for c in range(clusters):
            relative[c] = -ground
            for i in range(m):
                relative[c] += p.rows[c, i] * out[m + i]
            largest = max(largest, abs(relative[c]))
        _least_friction(p, candidate, relative, w)
        changed = False
        for c in range(clusters):
            if not candidate[c]:
                continue
            force = w.right[c]
            sign = 1.0 if force > 0.0 else -1.0
            if abs(force) >= w.limit[c] and sign * relative[c] > 1e-10 * largest:
                status[c] = int(sign)
                candidate[c] = False
                fresh[c] = changed = True
            else:
                status[c] = STICK
        if not changed:
            break
    hold_velocity(p, held, w, Y)
    derivative(t, Y, p, status, closed, w, out)


@helper
def _stop_matrix(p, w):
    """Fill w.matrix (n, n) with the change of -u' of each node by unit impulses at the others."""
    s = p.system
    n, m = s.Tx.shape
    for j in range(n):
        for k in range(n):
            total = 0.0
            for i in range(m):
                total += sinking_row(j, i, w, s) * lifting_row(k, i, w, s)
            w.matrix[j, k] = total


@helper
def _impulses(touching, wanted, w):
    """Impulses (n,) of the touching nodes, put into w.right, that bring ``wanted`` to zero."""
    n = len(touching)
    w.right[:] = 0.0
    for _ in range(SWEEPS):
        moved, scale = 0.0, 0.0
        for j in range(n):
            if not touching[j]:
                continue
            impulse = max(0.0, w.right[j] + wanted[j] / w.matrix[j, j])
            change = impulse - w.right[j]
            w.right[j] = impulse
            for k in range(n):
                wanted[k] -= w.matrix[k, j] * change
            moved, scale = max(moved, abs(change)), max(scale, impulse)
        if moved <= 1e-15 * scale:
            break


@helper
def _push(p, touching, w, Y, first):
    """Bring the quantity in w.right of the touching nodes to zero: u (first 0) or u' (first m)."""
    s = p.system
    n, m = s.Tx.shape
    count = 0
    for j in range(n):
        if touching[j]:
            w.indices[count] = j
            count += 1
    for a in range(count):
        j = w.indices[a]
        for b in range(count):
            total = 0.0
            for i in range(m):
                total += sinking_row(j, i, w, s) * lifting_row(w.indices[b], i, w, s)
            w.matrix[a, b] = total
    solve_small(w, count)
    for a in range(count):
        for i in range(m):
            Y[first + i] += lifting_row(w.indices[a], i, w, s) * w.right[a]


@helper
def _pack(touching, w, column):
    count = 0
    for j in range(len(touching)):
        if touching[j]:
            w.right[count] = w.nodes[j, column]
            count += 1
    return count


@helper
def resolve_impacts(t, p, progress, room, slow, height, brief, w, out):
    """Impacts of the ``room.touched`` nodes, then which stops stay closed.

    ``room.parting`` nodes were closed and lift off. After the impact, stops whose penetration rate
    is below ``slow``, or whose rebound is lower than the rounding of the ``height`` [m] or shorter
    than the time ``brief`` [s], close if a force presses them. Returns the longest flight that a
    rebound may take [s], infinite if none, and fills ``out`` with Y'.
    """
    s = p.system
    n, m = s.Tx.shape
    Y, status, closed = progress.state, progress.status, progress.closed
    touched, parting, fresh = room.touched, room.parting, room.fresh[len(p.rows):]
    touching = np.zeros(n, np.bool_)
    for j in range(n):
        touching[j] = touched[j] or closed[j] or parting[j]
        fresh[j] = False
    derivative(t, Y, p, status, closed, w, out)
    if _pack(touched, w, PENETRATION):
        _push(p, touched, w, Y, 0)
    derivative(t, Y, p, status, closed, w, out)
    before = 0.0
    for i in range(m):
        before += 0.5 * Y[m + i] * Y[m + i]
    _stop_matrix(p, w)
    wanted = np.empty(n)
    for j in range(n):
        rate = w.nodes[j, RATE]
        wanted[j] = rate + p.restitution * max(rate, 0.0)
    _impulses(touching, wanted, w)
    for j in range(n):
        for i in range(m):
            Y[m + i] += lifting_row(j, i, w, s) * w.right[j]
    for i in range(m):
        before -= 0.5 * Y[m + i] * Y[m + i]
    Y[2 * m + CONTACT_DAMPING] += before

    derivative(t, Y, p, status, closed, w, out)
    closed[:] = False
    derivative(t, Y, p, status, closed, w, out)
    pressed = np.empty(n)
    _stop_matrix(p, w)
    ground = speed_rate(t, p)
    resting = np.zeros(n, np.bool_)
    for j in range(n):
        pressed[j] = w.nodes[j, CURVED] - w.nodes[j, SLOPE] * ground
        for i in range(m):
            pressed[j] -= sinking_row(j, i, w, s) * out[m + i]
        blurred = 30.0 * math.sqrt(2.2e-16 * height * abs(pressed[j])) + brief * abs(pressed[j])
        resting[j] = (touching[j] and not parting[j]
                      and abs(w.nodes[j, RATE]) <= max(slow, blurred))
    falling = pressed.copy()
    _impulses(resting, pressed, w)
    flight = math.inf
    for j in range(n):
        closed[j] = resting[j] and w.right[j] > 0.0
        fresh[j] = touching[j] and not closed[j]
        if fresh[j] and falling[j] > 0.0:
            flight = min(flight, -2.0 * w.nodes[j, RATE] / falling[j])
    if _pack(closed, w, RATE):
        _push(p, closed, w, Y, m)
    derivative(t, Y, p, status, closed, w, out)
    return flight
