"""Forces on a body at rest over a period, for several values of a parameter, in compiled code."""

import math
from typing import NamedTuple

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.records import Block, Vector
from fecontact.system.kernels import prescribed_at
from fecontact.system.node_forces import axis_force, force_workspace, node_forces
from fecontact.system.nodes import SystemArrays, memory_of, most_memory, node_motion


class AffineSystem(NamedTuple):
    """A system whose arrays are parts of ``flat`` = ``base`` + p ``slope`` at a parameter p."""

    flat: Vector
    base: Vector
    slope: Vector
    system: SystemArrays


@kernel
def forces_at_rest(
    places: Vector, periods: Vector, tau: Vector, affine: AffineSystem, body: Block, given: Block,
    sizes: Vector,
) -> None:
    """Fill body (4, m, m) and given (2, N, m), affine in a parameter p, from its first two places.

    These are stiffness and damping, and loads at the samples: values at p = 0 and their slopes.
    Entries of ``sizes`` (3,) are the
    largest deviation of the loads from the affine ones over all places, relative to the largest;
    the largest mean of the forces of loads and contact at rest for the last place, relative to the
    largest force; and the largest change of the mean of the loads, relative to the largest load.
    """
    s = affine.system
    n, d, m = s.rows.shape
    P, N, states = len(places), len(tau), most_memory(s)
    force, rates = force_workspace(s)
    load, still = np.empty(m), np.zeros(2 * m + n * states)
    loads, rest, matrices = np.empty((P, N, m)), np.empty((N, m)), np.empty((P, 2, m, m))
    for place in range(P):
        for k in range(len(affine.flat)):
            affine.flat[k] = affine.base[k] + places[place] * affine.slope[k]
        for c in range(N):
            moved = prescribed_at(tau[c] * periods[place], s, load)
            for i in range(m):
                loads[place, c, i] = load[i]
            if place + 1 < P:
                continue
            for i in range(m):
                rest[c, i] = load[i]
            for j in range(n):
                node = node_forces(j, node_motion(j, still, s), moved, memory_of(j, still, s), s,
                                   force, rates)
                for axis in range(d):
                    push = axis_force(axis, node, force, rates, s)
                    for i in range(m):
                        rest[c, i] += s.rows[j, axis, i] * push
        for i in range(m):
            for j in range(m):
                matrices[place, 0, i, j] = s.stiffness[i, j]
                matrices[place, 1, i, j] = s.damping[i, j]
    span = places[1] - places[0]
    for part in range(2):
        for i in range(m):
            for j in range(m):
                first, rate = matrices[0, part, i, j], (
                    matrices[1, part, i, j] - matrices[0, part, i, j]) / span
                body[part, i, j], body[2 + part, i, j] = first - places[0] * rate, rate
    largest, most, off = 0.0, 0.0, 0.0
    for c in range(N):
        for i in range(m):
            rate = (loads[1, c, i] - loads[0, c, i]) / span
            given[0, c, i], given[1, c, i] = loads[0, c, i] - places[0] * rate, rate
            largest = max(largest, abs(given[0, c, i]), abs(rate))
    mean, change, heaviest = 0.0, 0.0, 0.0
    for place in range(P):
        p, worst = places[place], 0.0
        for c in range(N):
            for i in range(m):
                worst = max(worst, abs(given[0, c, i] + p * given[1, c, i] - loads[place, c, i]))
                heaviest = max(heaviest, abs(loads[place, c, i]))
        if worst > 0.0:
            off = max(off, worst / (largest * max(1.0, abs(p)))) if largest > 0.0 else math.inf
    for i in range(m):
        last, total = 0.0, 0.0
        for c in range(N):
            last += loads[P - 1, c, i] / N
            total += rest[c, i] / N
            most = max(most, abs(rest[c, i]))
        mean = max(mean, abs(total))
        for place in range(P):
            other = 0.0
            for c in range(N):
                other += loads[place, c, i] / N
            change = max(change, abs(other - last))
    sizes[0] = off
    sizes[1] = mean / most if mean > 0.0 else 0.0
    sizes[2] = change / heaviest if change > 0.0 else 0.0
