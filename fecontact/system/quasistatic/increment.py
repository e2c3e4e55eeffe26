"""Compiled equilibrium of a body on friction springs with sliders, the other side at rest.

Each contact node has sliders in parallel. With F of the normal law at rest, xi and y_R of the
ground, g = x_j - s the place of the node relative to ground that has travelled s, and z the place
where a slider was left,

    R* = lambda + c (g - z),     R = R* min(1, phi F / |R*|)
    A q = f + T^T [-(R + F y_R'(xi)), F]

lambda is zero for a spring c, and the force so far of a slider that sticks rigidly; c is then the
penalty of an augmented Lagrangian, which is repeated until g = z wherever R stays below its limit.
"""


from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import f8, helper, i8, integers, kernel, matrix, vector
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.references import borrowed
from fecontact.core.types import Array, Integers
from fecontact.system.kernels import normal_gradients
from fecontact.system.nodes import SYSTEM, GroundMotion, NodeMotion, leaning, node_contact

# Out-of-balance force that counts as rounding, relative to the forces that cancel, and the most
# that is accepted where it falls no further.
_FINE, _ROUGH = 1e-13, 1e-10
# Part of the forces themselves that is never accepted, however far springs would have to stretch.
_WRONG = 1e-6
# Part of what the displacements of friction springs would do alone that counts among these forces.
_SPRINGS = 1e-2
# Newton steps in full, steps that must lead closer to balance, and shifts tried in each of these.
_HASTY, _TRIES, _SHIFTS = 12, 60, 15
# Part of the typical stiffness of a mode below which rounding alone resists its motion.
_LOOSE = 1e-13
# Repetitions of the augmented Lagrangian, and the part of the force that may change in the last.
_REPEATS, _SETTLED = 100, 1e-11
# Columns of `Node`.
NODE_COLUMNS = 6
FORCE, PRESSING, PENETRATION, PLACE, AGAINST, LEANING = range(NODE_COLUMNS)


class Sliders(NamedTuple):
    """Sliders of the contact nodes, each array (n, e).

    ``stiffness`` is c, ``limit`` phi; ``rigid`` is 1 where c is only a penalty, else 0.
    """

    stiffness: Array
    limit: Array
    rigid: Array


SLIDERS = types.NamedUniTuple(matrix, 3, Sliders)


class Pose(NamedTuple):
    """A body in equilibrium, or on the way to it.

    ``q`` (m,); ``node`` (n, 6) with F, the force that friction sees, u, g, the force in -x and
    its part F y_R'; ``force`` and ``left`` (n, e) are R and z of the sliders.
    """

    q: Array
    node: Array
    force: Array
    left: Array


POSE = types.NamedTuple([vector, matrix, matrix, matrix], Pose)


class Room(NamedTuple):
    """Room for Newton's method; ``scale`` (m,) are typical stiffnesses of the modes.

    ``acting`` (m,) sums the magnitudes of the forces on each mode.
    """

    scale: Array
    start: Array
    acting: Array
    residual: Array
    step: Array
    before: Array
    multiplier: Array
    along: Array
    away: Array
    matrix: Array
    partial: Array
    pivots: Integers


ROOM = types.NamedTuple(
    [vector] * 6 + [matrix] * 5 + [integers], Room)


def pose_for(m: int, n: int, sliders: int) -> Pose:
    """An empty pose."""
    return Pose(np.zeros(m), np.zeros((n, NODE_COLUMNS)), np.zeros((n, sliders)),
                np.zeros((n, sliders)))


def room_for(m: int, n: int, sliders: int, scale: Array) -> Room:
    """Room for a body of m modes and n contact nodes."""
    start, acting, residual, step, before = np.zeros((5, m))
    return Room(np.ascontiguousarray(scale, dtype=float), start, acting, residual, step, before,
                np.zeros((n, sliders)), np.zeros((n, m)), np.zeros((n, m)), np.zeros((m, m)),
                np.zeros((3, 4)), np.zeros(m, np.int64))


@helper
def _rub(j, g, pressing, sliders, pose, room, out):
    """Forces of the sliders of node j; fills out[1, :2] with the derivatives of their sum."""
    total = 0.0
    out[1, 0], out[1, 1] = 0.0, 0.0
    for e in range(sliders.stiffness.shape[1]):
        stiffness, limit = sliders.stiffness[j, e], sliders.limit[j, e]
        trial = room.multiplier[j, e] + stiffness * (g - pose.left[j, e])
        if abs(trial) <= limit * pressing:
            pose.force[j, e] = trial
            out[1, 0] += stiffness
        else:
            side = limit if trial > 0.0 else -limit
            pose.force[j, e] = side * pressing
            out[1, 0] += side * out[2, 0]
            out[1, 1] += side * out[2, 1]
        total += pose.force[j, e]
    return total


@kernel(types.f8(vector, f8, SLIDERS, SYSTEM, POSE, ROOM, i8))
def _evaluate(load, travel, held_sliders, held_s, held_pose, held_room, derive):
    """Set nodes, slider forces, out-of-balance force and its matrix; size of forces that cancel.

    The matrix is minus the derivative of the out-of-balance force.
    """
    sliders, s, pose, room = (borrowed(held_sliders), borrowed(held_s), borrowed(held_pose),
                              borrowed(held_room))
    n, m = s.Tx.shape
    q, node, residual, out = pose.q, pose.node, room.residual, room.partial
    moved = GroundMotion(travel, 0.0, 0.0, 0.0)
    terms = 0.0
    for i in range(m):
        total, size = load[i], abs(load[i])
        for k in range(m):
            part = s.stiffness[i, k] * q[k]
            total -= part
            size += abs(part)
        residual[i] = total
        room.before[i] = room.acting[i] = size
    for j in range(n):
        x, height = 0.0, 0.0
        for i in range(m):
            x += s.Tx[j, i] * q[i]
            height += s.Ty[j, i] * q[i]
        contact = node_contact(j, NodeMotion(x, height, 0.0, 0.0, 0.0, 0.0), moved, s)
        F, pressing = normal_gradients(j, contact, s, out)
        gone = s.sliding[j] * travel
        R = _rub(j, x - gone, pressing, sliders, pose, room, out)
        T = leaning(F, R, contact.slope, s)
        node[j, FORCE], node[j, PRESSING], node[j, PENETRATION] = F, pressing, contact.penetration
        node[j, PLACE], node[j, AGAINST], node[j, LEANING] = x - gone, T, F * contact.slope
        if s.leans:
            out[1, 0] += contact.slope * out[0, 0] + F * contact.curvature
            out[1, 1] += contact.slope * out[0, 1]
        # Springs round off with the displacements whose difference they feel.
        rounding = 0.0
        for e in range(sliders.stiffness.shape[1]):
            rounding += sliders.stiffness[j, e] * (abs(x) + abs(gone) + abs(pose.left[j, e]))
        rounding = abs(T) + _SPRINGS * rounding
        for i in range(m):
            tx, ty = s.Tx[j, i], s.Ty[j, i]
            residual[i] += ty * F - tx * T
            room.before[i] += abs(ty * F) + abs(tx) * rounding
            room.acting[i] += abs(ty * F) + abs(tx * T)
            if derive:
                room.along[j, i] = out[1, 0] * tx + out[1, 1] * ty
                room.away[j, i] = out[0, 0] * tx + out[0, 1] * ty
    for i in range(m):
        terms += room.before[i] ** 2 / room.scale[i]
    if derive:
        room.matrix[:] = s.stiffness
        room.matrix[:] += np.dot(held_s.Tx.T, held_room.along)
        room.matrix[:] -= np.dot(held_s.Ty.T, held_room.away)
    return np.sqrt(terms)


@helper
def _size(room):
    """Size of the out-of-balance force."""
    total = 0.0
    for i in range(len(room.scale)):
        total += room.residual[i] ** 2 / room.scale[i]
    return np.sqrt(total)


@helper
def _balanced(size, terms, part, room):
    """Whether an out-of-balance force is rounding, up to a part of the forces that cancel."""
    acting = 0.0
    for i in range(len(room.scale)):
        acting += room.acting[i] ** 2 / room.scale[i]
    return size <= part * terms and size <= _WRONG * np.sqrt(acting)


@helper
def _step(q, room):
    """Take the Newton step of the matrix, in place; False where nothing resists some motion."""
    m = len(q)
    room.step[:] = room.residual
    factorise(room.matrix, m, room.pivots)
    for i in range(m):
        # The diagonal holds the inverse pivots.
        if not abs(room.matrix[i, i]) * _LOOSE * room.scale[i] < 1.0:
            return False
    solve(room.matrix, room.pivots, room.step)
    for i in range(m):
        q[i] += room.step[i]
    return True


@helper
def _hasty_newton(load, travel, sliders, s, pose, room):
    """Newton's method in full steps; whether it succeeded, else the pose is as before.

    On its way to the set of sliders that slide, the balance may become worse for a step: at a
    reversal all of them are at their limits, and rounding decides which of them count as sliding.
    """
    q, last = pose.q, np.inf
    room.start[:] = q
    for _ in range(_HASTY):
        terms = _evaluate(load, travel, sliders, s, pose, room, 1)
        size = _size(room)
        if _balanced(size, terms, _FINE, room) or (
                _balanced(size, terms, _ROUGH, room) and size >= 0.5 * last):
            return True
        if not np.isfinite(size) or not _step(q, room):
            break
        last = size
    q[:] = room.start
    return False


@helper
def _newton(load, travel, sliders, s, pose, room):
    """Newton's method with a shift that grows after failed steps; whether it succeeded."""
    if _hasty_newton(load, travel, sliders, s, pose, room):
        return True
    m = len(pose.q)
    shift, q = 0.0, pose.q
    for _ in range(_TRIES):
        terms = _evaluate(load, travel, sliders, s, pose, room, 1)
        size = _size(room)
        if not np.isfinite(size):
            return False
        if _balanced(size, terms, _FINE, room):
            return True
        better = False
        # The matrix is factorised in place and made again for another shift.
        for _ in range(_SHIFTS):
            for i in range(m):
                room.matrix[i, i] += shift * room.scale[i]
            if not _step(q, room):
                shift = max(30.0 * shift, 1e-10)
                _evaluate(load, travel, sliders, s, pose, room, 1)
                continue
            _evaluate(load, travel, sliders, s, pose, room, 0)
            if _size(room) < size:
                better = True
                break
            for i in range(m):
                q[i] -= room.step[i]
            if shift == 0.0 and _balanced(size, terms, _ROUGH, room):
                break
            shift = max(30.0 * shift, 1e-10)
            _evaluate(load, travel, sliders, s, pose, room, 1)
        if not better:
            _evaluate(load, travel, sliders, s, pose, room, 0)
            return _balanced(size, terms, _ROUGH, room)
        shift = 0.0 if shift <= 1e-9 else 0.1 * shift
    return False


@kernel(types.boolean(vector, f8, SLIDERS, SYSTEM, POSE, ROOM))
def find_equilibrium(load, travel, held_sliders, held_s, held_pose, held_room):
    """Bring ``pose`` into equilibrium from where it is; whether that succeeded.

    ``pose.force`` and ``pose.left`` are those of the last equilibrium at the begin. Rigid sliders
    that slid are left where their nodes are, springs a length R / c behind.
    """
    sliders, s, pose, room = (borrowed(held_sliders), borrowed(held_s), borrowed(held_pose),
                              borrowed(held_room))
    n, e = sliders.stiffness.shape
    held = False
    for j in range(n):
        for k in range(e):
            rigid = sliders.rigid[j, k] != 0.0
            held |= rigid
            room.multiplier[j, k] = pose.force[j, k] if rigid else 0.0
    solved = False
    for _ in range(_REPEATS if held else 1):
        solved = _newton(load, travel, sliders, s, pose, room)
        if not solved or not held:
            break
        changed, largest = 0.0, 0.0
        for j in range(n):
            for k in range(e):
                if sliders.rigid[j, k] != 0.0:
                    changed = max(changed, abs(pose.force[j, k] - room.multiplier[j, k]))
                    largest = max(largest, abs(pose.force[j, k]))
                    room.multiplier[j, k] = pose.force[j, k]
        if changed <= _SETTLED * largest:
            break
        solved = False
    if not solved:
        return False
    for j in range(n):
        for k in range(e):
            force, limit = pose.force[j, k], sliders.limit[j, k] * pose.node[j, PRESSING]
            if abs(force) >= limit:
                give = 0.0 if sliders.rigid[j, k] != 0.0 else force / sliders.stiffness[j, k]
                pose.left[j, k] = pose.node[j, PLACE] - give
    return True
