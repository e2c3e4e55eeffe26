"""Compiled decisions of set-valued friction: which clusters stick and which slip.

A cluster without slip velocity sticks if a friction force within its limit holds it. Those of all
such clusters are the solution of a quadratic program:

    -L_c <= R_c <= L_c,    a_c = 0 where |R_c| < L_c,    sign(R_c) a_c >= 0 where |R_c| = L_c

Projected Gauss-Seidel sweeps find which forces are at their limits, and a linear system the others.
Clusters of nearly dependent rows, as of a beam of few modes, would need too many sweeps.

A touch-down is decided by its event. The state there has a penetration of zero up to rounding, of
either sign; :func:`press` moves it to the side on which the normal law acts.
"""

import math

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.dense_lu import factorise, solve
from fecontact.integrate.nonsmooth.equations import (
    derivative,
    hold,
    place_size,
    residual,
    sinking_row,
    speed_rate,
)
from fecontact.integrate.nonsmooth.event_search import ROUNDING, pressed
from fecontact.integrate.nonsmooth.problem import FIXED, OPEN, PENETRATION, RATE, STICK

# Sweeps at most, and between two solutions for the forces below their limits.
SWEEPS, _TOGETHER = 20000, 20
# Rounding of a time relative to it or to the longest step, in which a problem has so many ticks.
_TIME_ROUNDING, _TICKS = 1e-14, 1e4
# Accelerations that are none, in parts of the largest.
_ACCELERATION = 1e-10
# How often the distance by which a node is moved into contact is enlarged fourfold.
_PRESSES = 4


@helper
def hold_velocity(p, held, w, Y):
    """Change q' so that the held clusters have no slip velocity; w.slip must be theirs."""
    count, m = 0, p.rows.shape[1]
    for c in range(len(p.rows)):
        if held[c]:
            w.indices[count], w.right[count] = len(p.cluster) + c, -w.slip[c]
            count += 1
    hold(count, p, w, Y[m : 2 * m])


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
    for sweep in range(1, SWEEPS + 1):
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
        if sweep % _TOGETHER == 0 and _balance(candidate, relative, w):
            break


@routine
def _balance(candidate, relative, w):
    """Change the forces that are below their limits so that their clusters do not accelerate.

    Or as far towards that as the first comes to its limit. Whether these forces are the solution.
    """
    clusters = len(candidate)
    free, count = np.empty(clusters, np.int64), 0
    for c in range(clusters):
        if candidate[c] and abs(w.right[c]) < w.limit[c]:
            free[count] = c
            count += 1
    matrix, change, pivots = np.empty((count, count)), np.empty(count), np.empty(count, np.int64)
    for a in range(count):
        change[a] = relative[free[a]]
        for b in range(count):
            matrix[a, b] = w.matrix[free[a], free[b]]
    factorise(matrix, count, pivots)
    solve(matrix, pivots, change)
    part, first = 1.0, -1
    for a in range(count):
        c = free[a]
        way = w.limit[c] - w.right[c] if change[a] > 0.0 else w.limit[c] + w.right[c]
        if not abs(change[a]) < math.inf:
            return False
        if part * abs(change[a]) > way:
            part, first = way / abs(change[a]), c
    for a in range(count):
        c = free[a]
        w.right[c] += part * change[a]
        for d in range(clusters):
            relative[d] -= w.matrix[d, c] * part * change[a]
    if first >= 0:
        w.right[first] = w.limit[first] if w.right[first] > 0.0 else -w.limit[first]
        return False
    largest = 0.0
    for d in range(clusters):
        largest = max(largest, abs(relative[d]))
    for c in range(clusters):
        if candidate[c] and abs(w.right[c]) >= w.limit[c] and (
                w.right[c] * relative[c] < -_ACCELERATION * w.limit[c] * largest):
            return False
    return True


@helper
def press(t, p, touched, w, Y):
    """Move touched nodes into contact by the rounding of their penetrations.

    Nodes that are open by more, as those of a step that ends before its touch-down, are left.
    """
    s = p.system
    m = s.rows.shape[2]
    for j in range(len(touched)):
        u, rate = w.nodes[j, PENETRATION], w.nodes[j, RATE]
        if not touched[j] or pressed(u, j, s) > 0.0:
            continue
        size, stretch = place_size(j, Y, p), 0.0
        for i in range(m):
            stretch += sinking_row(j, i, w, s) ** 2
        depth = ROUNDING * size + abs(rate) * _TIME_ROUNDING * (abs(t) + _TICKS * p.tick)
        for _ in range(_PRESSES):
            way = depth if pressed(u + depth, j, s) > 0.0 else (
                -depth if pressed(u - depth, j, s) > 0.0 else 0.0)
            if way != 0.0 and stretch > 0.0:
                for i in range(m):
                    Y[i] -= sinking_row(j, i, w, s) / stretch * way
                break
            depth *= 4.0


@helper
def decide_clusters(t, p, progress, workspace, near, w, out):
    """Set the status of all clusters at a moment at which some may change.

    ``workspace.released`` clusters have reached the limit of stick and slip in the sense of
    ``status``; those whose slip has ``arrived`` at its end, up to the error of the step, and others
    with a slip velocity below ``near`` stick or slip by their forces; ``workspace.touched`` nodes
    touch down. ``workspace.fresh`` tells clusters that begin to slip from no slip velocity. Fills
    ``out`` with Y'.
    """
    clusters, m = p.rows.shape
    Y, status, closed = progress.state, progress.status, progress.closed
    released, arrived, fresh = workspace.released, workspace.arrived, workspace.fresh
    derivative(t, Y, p, status, closed, w, out)
    if workspace.touched.any():
        press(t, p, workspace.touched, w, Y)
        workspace.touched[:] = False
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
            relative[c] = -residual(len(p.cluster) + c, ground, out[m : 2 * m], p, w)
            largest = max(largest, abs(relative[c]))
        _least_friction(p, candidate, relative, w)
        changed = False
        for c in range(clusters):
            if not candidate[c]:
                continue
            force = w.right[c]
            sign = 1.0 if force > 0.0 else -1.0
            if abs(force) >= w.limit[c] and sign * relative[c] > _ACCELERATION * largest:
                status[c] = int(sign)
                candidate[c] = False
                fresh[c] = changed = True
            else:
                status[c] = STICK
        if not changed:
            break
    hold_velocity(p, held, w, Y)
    derivative(t, Y, p, status, closed, w, out)
