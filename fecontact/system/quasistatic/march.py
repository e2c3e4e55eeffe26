"""Compiled quasi-static motion along a path of loads, in increments that are cut where needed.

Work is taken by the trapezoidal rule, which is exact for the elastic body. The loss in friction is
exact where displacement and normal force of a node change in proportion within an increment. The
two disagree where sliders begin to slide, in space turn while they slide, or nodes close and open
within it; an increment is cut until they agree. Turned by the angle b within an increment, the
force of a slider takes the part b^2 / 4 of its loss more or less as work, and is off by about b / 2
itself.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.copies import put, put_rows
from fecontact.core.records import Matrix, Size, Vector
from fecontact.core.types import Array, Integers
from fecontact.system.node_forces import normal_force
from fecontact.system.nodes import MODES, NODES, GroundMotion, SystemArrays, ground_moved
from fecontact.system.polynomial_forces import (
    add_polynomial_forces,
    has_polynomial,
    polynomial_potential,
)
from fecontact.system.quasistatic.increment import energy_of_forces, find_equilibrium
from fecontact.system.quasistatic.pose import (
    AGAINST,
    ALONG_SURFACE,
    FORCE,
    FORCES,
    NODE_COLUMNS,
    PENETRATION,
    PER_TANGENT,
    PLACE,
    PRESSING,
    Pose,
    Sliders,
    Workspace,
)

# Works that a path does, and the columns of `march` in which they stand before the losses.
WORKS = ("load", "drive", "travel", "circulatory")
_LOAD, _DRIVE, _TRAVEL, _CIRCULATORY = range(len(WORKS))
# Entries of `counts`: increments solved, increments cut, increments with a jump.
COUNTS = 3
SOLVED, CUT, JUMPS = range(COUNTS)
# Shortest increments, as parts of the one asked for: at a jump, and where none is in equilibrium.
_SHORTEST, _LEAST = 2.0**-40, 2.0**-20
# Energies that are noise beside all works of an increment: forces balance to 1e-13 at best; and
# beside the energy of all forces that cancel.
_UNRESOLVED, _ROUNDING = 1e-11, 2e-16
# Entries of the turnover of an increment.
ERROR, TURNED, GAP, PRESSED = range(4)
# Abscissae and weights of Gauss on [0, 1].
_PLACES = (0.046910077030668, 0.230765344947158, 0.5, 0.769234655052842, 0.953089922969332)
_WEIGHTS = (0.118463442528095, 0.239314335249683, 0.284444444444444, 0.239314335249683,
            0.118463442528095)

ROWS = Size("rows")


class Kept(NamedTuple):
    """Results of a march.

    Poses, and the work: that of :data:`WORKS` and the loss of each node so far; and numbers of
    increments.
    """

    q: Annotated[Array, ROWS, MODES]
    node: Annotated[Array, ROWS, NODES, NODE_COLUMNS]
    force: Annotated[Array, ROWS, NODES, FORCES]
    left: Annotated[Array, ROWS, NODES, FORCES]
    work: Annotated[Array, ROWS, NODES + len(WORKS)]
    counts: Annotated[Integers, COUNTS]


@helper
def _apply(given, s, load):
    """Fill load (m,) from a row of given loads and motions; returns the motion of the ground."""
    m, d = len(load), len(s.drive_stiffness)
    for i in range(m):
        load[i] = given[i]
        for axis in range(d):
            load[i] += given[m + axis] * s.drive_stiffness[axis] * s.drive_shapes[axis, i]
    return GroundMotion(given[m + d], 0.0, given[m + d + 1] if d > 2 else 0.0, 0.0)


@helper
def _pressed_energy(j, before, after, s):
    """Energy that the normal law of node j stores between two penetrations."""
    total = 0.0
    for k in range(len(_PLACES)):
        u = before + _PLACES[k] * (after - before)
        total += _WEIGHTS[k] * normal_force(j, u, 0.0, s)[0]
    return total * (after - before)


@helper
def _begin(j, e, old, new, sliders):
    """Part of an increment in proportional motion at which slider e of node j reaches its limit.

    There |R + t c dg| = phi (P + t dP), a quadratic equation in t.
    """
    tangents = old.force.shape[1] // sliders.stiffness.shape[1]
    limit, P = sliders.limit[j, e], old.node[j, PRESSING]
    risen = new.node[j, PRESSING] - P
    second, first, below = -(limit * risen) ** 2, -limit**2 * P * risen, -(limit * P) ** 2
    for k in range(tangents):
        R, place = old.force[j, tangents * e + k], PLACE + PER_TANGENT * k
        rise = sliders.stiffness[j, e] * (new.node[j, place] - old.node[j, place])
        second += rise * rise
        first += R * rise
        below += R * R
    root = np.sqrt(max(first * first - second * below, 0.0))
    if first > 0.0:
        return min(max(-below / (first + root), 0.0), 1.0)
    return min(max((root - first) / second, 0.0), 1.0) if second > 0.0 else 0.0


@helper
def _slid(j, e, old, new, sliders):
    """Friction loss and work of slider e of node j between two poses, in proportional motion.

    The work is the mean force times the displacement of the slider. Last the work of that force on
    the way of the node, without its sign.
    """
    tangents = old.force.shape[1] // sliders.stiffness.shape[1]
    way, work, rubbed = 0.0, 0.0, 0.0
    for k in range(tangents):
        at, place = tangents * e + k, PLACE + PER_TANGENT * k
        force, part = 0.5 * (old.force[j, at] + new.force[j, at]), new.left[j, at] - old.left[j, at]
        way = math.hypot(way, part)
        work += force * part
        rubbed += force * (new.node[j, place] - old.node[j, place])
    if way == 0.0:
        return 0.0, 0.0, abs(rubbed)
    P0, P1 = old.node[j, PRESSING], new.node[j, PRESSING]
    begin = 0.0 if sliders.rigid[j, e] != 0.0 else _begin(j, e, old, new, sliders)
    loss = 0.5 * sliders.limit[j, e] * (P0 + begin * (P1 - P0) + P1) * way
    return loss, work, abs(rubbed)


@helper
def _surface_work(j, tangent, old, new):
    """Work of contact forces along the surface, as node j moves along a tangent."""
    k = PER_TANGENT * tangent
    return 0.5 * (old.node[j, ALONG_SURFACE + k] + new.node[j, ALONG_SURFACE + k]) * (
        new.node[j, PLACE + k] - old.node[j, PLACE + k])


@helper
def _moving(j, tangent, travelled, old, new, s):
    """Work of the other side of node j, which has travelled along a tangent."""
    k = PER_TANGENT * tangent
    work = -0.5 * (old.node[j, AGAINST + k] + new.node[j, AGAINST + k]) * travelled
    # Ground that pushes vertically lifts the node wherever it moves along.
    return work if s.follows_surface else work + _surface_work(j, tangent, old, new)


@helper
def _works(old, new, given, s, out):
    """Fill out (4,) with the works of an increment between two rows ``given``."""
    m, d = len(old.q), len(s.drive_stiffness)
    for i in range(len(WORKS)):
        out[i] = 0.0
    for i in range(m):
        moved = new.q[i] - old.q[i]
        out[_LOAD] += 0.5 * (given[0, i] + given[1, i]) * moved
        for k in range(m):
            out[_CIRCULATORY] -= 0.25 * (s.stiffness[i, k] - s.stiffness[k, i]) * (
                old.q[k] + new.q[k]) * moved
    for axis in range(d):
        stretch = given[0, m + axis] + given[1, m + axis]
        for i in range(m):
            stretch -= s.drive_shapes[axis, i] * (old.q[i] + new.q[i])
        out[_DRIVE] += 0.5 * s.drive_stiffness[axis] * stretch * (
            given[1, m + axis] - given[0, m + axis])
    travelled, second = given[1, m + d] - given[0, m + d], 0.0
    if d > 2:
        second = given[1, m + d + 1] - given[0, m + d + 1]
    for j in range(len(old.node)):
        for tangent in range(d - 1):
            gone = ground_moved(tangent, j, travelled, second, s)
            out[_TRAVEL] += _moving(j, tangent, gone, old, new, s)


@routine
def _polynomial_work(old, new, s):
    """Change of the potential of large deflections, and its work by the trapezoidal rule."""
    forces = np.zeros((2, len(old)))
    add_polynomial_forces(old, s, forces[0])
    add_polynomial_forces(new, s, forces[1])
    work = 0.0
    for i in range(len(old)):
        work -= 0.5 * (forces[0, i] + forces[1, i]) * (new[i] - old[i])
    return polynomial_potential(new, s) - polynomial_potential(old, s), work


@kernel
def _measure(
    s: SystemArrays, sliders: Sliders, old: Pose, new: Pose, given: Matrix,
    part: Vector, turnover: Vector,
) -> None:
    """Fill part (4 + n,) with the works and losses of an increment, and ``turnover`` (4,).

    The latter are the error and the work of friction, and those of the normal forces.
    """
    _works(old, new, given, s, part)
    error, turned, gap, pressed = 0.0, 0.0, 0.0, 0.0
    for j in range(len(old.node)):
        lost = 0.0
        for e in range(sliders.stiffness.shape[1]):
            loss, work, rubbed = _slid(j, e, old, new, sliders)
            lost += loss
            error += abs(work - loss)
            turned += rubbed
        part[len(WORKS) + j] = lost
        # By the trapezoidal rule F du is F y_R' dg - F dy.
        F = 0.5 * (old.node[j, FORCE] + new.node[j, FORCE])
        along, size, lifted = 0.0, 0.0, 0.0
        for tangent in range(s.rows.shape[1] - 1):
            part_along = _surface_work(j, tangent, old, new)
            along += part_along
            size += abs(part_along)
        for i in range(len(old.q)):
            lifted += s.rows[j, 1, i] * (new.q[i] - old.q[i])
        before, after = old.node[j, PENETRATION], new.node[j, PENETRATION]
        gap += _pressed_energy(j, before, after, s) - along + F * lifted
        pressed += abs(F * (after - before)) + size
    if has_polynomial(s):
        kept, work = _polynomial_work(old.q, new.q, s)
        gap += kept - work
        pressed += abs(work)
    turnover[ERROR], turnover[TURNED] = error, turned
    turnover[GAP], turnover[PRESSED] = abs(gap), pressed


@helper
def _copy(source, target):
    """Copy a pose."""
    put(source.q, target.q)
    put_rows(source.node, target.node)
    put_rows(source.force, target.force)
    put_rows(source.left, target.left)


@kernel
def march(
    s: SystemArrays, sliders: Sliders, given: Matrix, rtol: float, old: Pose,
    new: Pose, workspace: Workspace, kept: Kept,
) -> int:
    """Go along rows of given loads and motions: modal loads, drive in x and y, travel, (N, m + 3).

    In space (N, m + 5): with the drive in z, and the travel along y.

    ``old`` holds the pose at the first row, whose F and places are found here; ``new`` is
    workspace. Fills ``kept`` and returns the number of rows that were reached.
    """
    rows, columns = given.shape
    size = kept.work.shape[1]
    load, ends = np.empty(len(old.q)), np.zeros((2, columns))
    part, total, turnover = np.zeros(size), np.zeros(size), np.zeros(4)
    rubbed, pressed, rubbing, pressing = 0.0, 0.0, 0.0, 0.0
    row, done, proposed, failed, steepness = 0, 0.0, 1.0, 2.0, 0.0
    while row < rows:
        goal = min(1.0, done + proposed)
        if failed <= 1.0:
            # The whole rest up to where it failed, if it is short enough by then; or half of it.
            rest = failed - done
            goal = failed if steepness * rest * rest <= 1.0 else done + 0.5 * rest
        length = goal - done
        last = max(row - 1, 0)
        for i in range(columns):
            ends[1, i] = given[row, i] if goal == 1.0 else (
                given[last, i] + goal * (given[row, i] - given[last, i]))
        _copy(old, new)
        moved = _apply(ends[1], s, load)
        solved = find_equilibrium(load, moved, sliders, s, new, workspace)
        kept.counts[SOLVED] += 1
        excess = np.inf if row > 0 else 0.0
        turnover[TURNED], turnover[PRESSED] = 0.0, 0.0
        if solved and row > 0:
            _measure(s, sliders, old, new, ends, part, turnover)
            turned, heaved = turnover[TURNED], turnover[PRESSED]
            if length == 1.0:
                rubbed, pressed = max(rubbed, turned), max(pressed, heaved)
            floor = rubbed + pressed
            for i in range(len(WORKS)):
                floor += abs(part[i])
            cancelling = energy_of_forces(workspace)
            floor = min(_UNRESOLVED, 0.01 * rtol) * floor + _ROUNDING * cancelling + 1e-300
            excess = max(turnover[ERROR] / (rtol * max(rubbed, rubbing + turned) + floor),
                         turnover[GAP] / (rtol * max(pressed, pressing + heaved) + floor))
        if not solved and (row == 0 or length <= _LEAST):
            return row
        if excess > 1.0:
            if not solved or length > _SHORTEST:
                kept.counts[CUT] += 1
                failed = goal
                steepness = excess / (length * length)
                continue
            kept.counts[JUMPS] += 1
        for i in range(size):
            total[i] += part[i]
        _copy(new, old)
        put(ends[1], ends[0])
        done = goal
        rubbing += turnover[TURNED]
        pressing += turnover[PRESSED]
        if goal >= failed or not np.isfinite(steepness):
            failed = 2.0
        proposed = length * min(8.0, max(0.9 / np.sqrt(max(excess, 1e-4)), 1.0))
        if done == 1.0:
            _copy(old, Pose(kept.q[row], kept.node[row], kept.force[row], kept.left[row]))
            put(total, kept.work[row])
            rubbed, pressed = max(rubbed, rubbing), max(pressed, pressing)
            rubbing, pressing = 0.0, 0.0
            row, done, proposed, failed = row + 1, 0.0, 1.0, 2.0
    return rows
