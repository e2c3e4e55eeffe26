"""Compiled equilibrium of a body on friction springs with sliders, the other side at rest.

Each contact node has sliders in parallel. With F of the normal law at rest, xi and y_R of the
ground, g = x_j - s the place of the node relative to ground that has travelled s, and z the place
where a slider was left,

    R* = lambda + c (g - z),     R = R* min(1, phi F / |R*|)
    A q = f + T^T [-(R + F y_R'(xi)), F]

lambda is zero for a spring c, and the force so far of a slider that sticks rigidly; c is then the
penalty of an augmented Lagrangian, which is repeated until g = z wherever R stays below its limit.
Where R as the next lambda leads there slowly, because modes hardly tell forces of neighbours apart,
lambda takes the Newton step with the matrix S = T M^-1 T^T of the sliders that stick, up to the
first one that reaches its limit.

In space g, z and R have two components, along the tangents of the node: R* returns to the disc of
radius phi F along its own direction a = R* / |R*|, with

    dR = c dg  where it sticks,     dR = phi a dF + phi F c / |R*| (I - a a^T) dg  where it slides.
"""

import math

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.copies import put, put_rows
from fecontact.core.dense_lu import factorise, solve
from fecontact.core.records import Vector
from fecontact.system.node_forces import normal_gradients, tangent_force
from fecontact.system.nodes import (
    GroundMotion,
    NodeMotion,
    SystemArrays,
    ground_travel,
    node_contact,
)
from fecontact.system.polynomial_forces import (
    add_polynomial,
    add_polynomial_stiffness,
    has_polynomial,
)
from fecontact.system.quasistatic.pose import (
    AGAINST,
    ALONG_SURFACE,
    FORCE,
    PENETRATION,
    PER_TANGENT,
    PLACE,
    PRESSING,
    Pose,
    Sliders,
    Workspace,
)

# Out-of-balance force that counts as rounding, relative to the forces that cancel, and the most
# that is accepted where it falls no further.
_FINE, _ROUGH = 1e-13, 1e-10
# Part of the forces themselves that is never accepted, however far springs would have to stretch.
_WRONG = 1e-6
# Part of what the displacements of friction springs would do alone that counts among these forces.
_SPRINGS = 1e-2
# Newton steps in full, steps that must lead closer to balance, and shifts tried in each of these.
_HASTY, _TRIES, _SHIFTS = 12, 60, 15
# Changes of state that are followed, by sliders, and beside these; bisections for the place of one.
_PIECES, _FEW_PIECES, _BISECTIONS = 2, 20, 100
# Part of the out-of-balance force, at most, that a step across changes of state may leave.
_LEFT = 0.5
# States of sliders.
_STICKS, _SLIDING, _OPEN = 0.0, 1.0, 2.0
# Part of the typical stiffness of a mode below which rounding alone resists its motion.
_LOOSE = 1e-13
# Repetitions of the augmented Lagrangian, and the part of the force that may change in the last.
_REPEATS, _SETTLED = 100, 1e-11
# Repetitions with the force itself as the next multiplier, and then at least before rounding of the
# forces is accepted; largest such change, as parts of the forces and of those that cancel.
_PLAIN, _PATIENT, _ROUGHLY, _NOISY = 4, 20, 1e-9, 1e-13
# Distance from the limit, as a part of it, below which a slider is held in Newton steps of the
# multipliers, and a shift of their matrix, for motions that no mode resolves.
_NEAR, _REGULAR = 1e-9, 1e-8
# Rounding of a displacement.
_ROUNDING = 1e-15
# Relative distance from its limit, by rounding, at which a slider slides.
_SLIDES = 1e-14


@helper
def _motion(j, q, s):
    """Motion of node j at rest."""
    x, height, across = 0.0, 0.0, 0.0
    for i in range(len(q)):
        x += s.rows[j, 0, i] * q[i]
        height += s.rows[j, 1, i] * q[i]
    if s.rows.shape[1] > 2:
        for i in range(len(q)):
            across += s.rows[j, 2, i] * q[i]
    return NodeMotion((x, height, across), (0.0, 0.0, 0.0))


@helper
def _friction(j, tangents, pressing, sliders, pose, workspace, total, out):
    """Fill ``total`` (d - 1,) with the forces of the sliders of node j along its tangents.

    Places g of the node along its tangents stand in ``pose.node``. Fills rows 0 and 2 of ``out``
    with the derivatives of the forces to displacements along the axes, by those of the pressing
    force in its row d.
    """
    d = tangents + 1
    for k in range(tangents):
        total[k] = 0.0
        for axis in range(d):
            out[2 * k, axis] = 0.0
    for e in range(sliders.stiffness.shape[1]):
        stiffness, limit, first = sliders.stiffness[j, e], sliders.limit[j, e], tangents * e
        R, size = pose.force[j, first : first + tangents], 0.0
        for k in range(tangents):
            g = pose.node[j, PLACE + PER_TANGENT * k]
            R[k] = workspace.multiplier[j, first + k] + stiffness * (g - pose.left[j, first + k])
            size = math.hypot(size, R[k])
        sticks = size <= limit * pressing
        workspace.state[j, e] = _OPEN if pressing == 0.0 else _STICKS if sticks else (
            _SLIDING if tangents > 1 or R[0] > 0.0 else -_SLIDING)
        turn = 0.0 if sticks or tangents == 1 else limit * pressing * stiffness / size
        for k in range(tangents):
            a = 0.0 if sticks else R[k] / size
            out[2 * k, 2 * k] += stiffness if sticks else turn
            for axis in range(d):
                out[2 * k, axis] += limit * a * out[d, axis]
            for other in range(tangents):
                out[2 * k, 2 * other] -= turn * a * (0.0 if sticks else R[other] / size)
        for k in range(tangents):
            if not sticks:
                R[k] = limit * pressing * R[k] / size
            total[k] += R[k]


@helper
def _follow_surface(F, contact, d, out):
    """Add what contact forces along the surface change to the derivatives of a node."""
    for tangent in range(d - 1):
        for axis in range(d):
            out[2 * tangent, axis] += contact.slope[tangent] * out[1, axis]
        for other in range(d - 1):
            out[2 * tangent, 2 * other] += F * contact.curvature[tangent][other]


@helper
def _add_forces(away, F, along, T, rounding, workspace):
    """Add F along one row and -T along another to the out-of-balance force, and to sizes."""
    for i in range(len(away)):
        workspace.residual[i] += away[i] * F - along[i] * T
        size = abs(away[i] * F) + abs(along[i] * T)
        workspace.acting[i] += size
        workspace.before[i] += size + abs(along[i]) * rounding


@helper
def _rounding(j, tangent, moved, sliders, pose):
    """Part of the forces of the springs of node j along a tangent that counts for rounding [N].

    Springs round off with the displacements whose difference they feel: those ``moved`` by the
    node and the other side, and those of the sliders.
    """
    elements = sliders.stiffness.shape[1]
    tangents = pose.left.shape[1] // elements
    total = 0.0
    for e in range(elements):
        total += sliders.stiffness[j, e] * (moved + abs(pose.left[j, tangents * e + tangent]))
    return _SPRINGS * total


@helper
def _size(force, scale):
    """Size of modal forces (m,), by the typical stiffnesses of the modes."""
    total = 0.0
    for i in range(len(scale)):
        total += force[i] ** 2 / scale[i]
    return np.sqrt(total)


@helper
def energy_of_forces(workspace):
    """Energy that all forces which cancel would store in the modes [J], one by one."""
    total = 0.0
    for i in range(len(workspace.scale)):
        total += workspace.acting[i] ** 2 / workspace.scale[i]
    return total


@kernel
def evaluate(
    load: Vector, moved: GroundMotion, sliders: Sliders, s: SystemArrays,
    pose: Pose, workspace: Workspace, derive: int,
) -> float:
    """Set nodes, slider forces, out-of-balance force and its matrix; size of forces that cancel.

    The matrix is minus the derivative of the out-of-balance force.
    """
    n, d, m = s.rows.shape
    q, node, residual, out = pose.q, pose.node, workspace.residual, workspace.partial
    for i in range(m):
        total, size = load[i], abs(load[i])
        for k in range(m):
            part = s.stiffness[i, k] * q[k]
            total -= part
            size += abs(part)
        residual[i] = total
        workspace.before[i] = workspace.acting[i] = size
    tangents, total = d - 1, workspace.total
    gradient, force = np.empty_like(s.polynomial_rows), np.zeros(m)
    if has_polynomial(s):
        add_polynomial(q, s, gradient, force)
        for i in range(m):
            residual[i] += force[i]
            workspace.before[i] += abs(force[i])
            workspace.acting[i] += abs(force[i])
    for j in range(n):
        motion = _motion(j, q, s)
        contact = node_contact(j, motion, moved, s)
        F, pressing = normal_gradients(j, contact, s, out)
        node[j, FORCE], node[j, PRESSING], node[j, PENETRATION] = F, pressing, contact.penetration
        for k in range(tangents):
            node[j, PLACE + PER_TANGENT * k] = motion.places[2 * k] - ground_travel(k, j, moved, s)
        _friction(j, tangents, pressing, sliders, pose, workspace, total, out)
        if s.follows_surface:
            _follow_surface(F, contact, d, out)
        for k in range(tangents):
            second, gone = PER_TANGENT * k, ground_travel(k, j, moved, s)
            T = tangent_force(F, total[k], contact.slope[k], s)
            node[j, AGAINST + second], node[j, ALONG_SURFACE + second] = T, F * contact.slope[k]
            rounding = _rounding(j, k, abs(motion.places[2 * k]) + abs(gone), sliders, pose)
            _add_forces(s.rows[j, 1], F if k == 0 else 0.0, s.rows[j, 2 * k], T, rounding,
                        workspace)
        if derive:
            for axis in range(d):
                answer, sign = workspace.flexibility[j, axis], -1.0 if axis == 1 else 1.0
                for i in range(m):
                    answer[i] = 0.0
                for other in range(d):
                    for i in range(m):
                        answer[i] += sign * out[axis, other] * s.rows[j, other, i]
    if derive:
        put_rows(s.stiffness, workspace.matrix)
        if has_polynomial(s):
            add_polynomial_stiffness(1.0, gradient, s, workspace.matrix)
        matrix = workspace.matrix
        matrix += np.dot(s.rows.reshape((n * d, m)).T,
                         workspace.flexibility.reshape((n * d, m)))
    return _size(workspace.before, workspace.scale)


@helper
def _balanced(size, terms, part, workspace):
    """Whether an out-of-balance force is rounding, up to a part of the forces that cancel."""
    return size <= part * terms and size <= _WRONG * _size(workspace.acting, workspace.scale)


@routine
def _step(q, workspace):
    """Take the Newton step of the matrix, in place; False where nothing resists some motion."""
    m = len(q)
    put(workspace.residual, workspace.step)
    factorise(workspace.matrix, m, workspace.pivots)
    for i in range(m):
        # The diagonal holds the inverse pivots.
        if not abs(workspace.matrix[i, i]) * _LOOSE * workspace.scale[i] < 1.0:
            return False
    solve(workspace.matrix, workspace.pivots, workspace.step)
    for i in range(m):
        q[i] += workspace.step[i]
    return True


@routine
def _hasty_newton(load, moved, sliders, s, pose, workspace):
    """Newton's method in full steps; whether it succeeded, else the pose is as before.

    On its way to the set of sliders that slide, the balance may become worse for a step: at a
    reversal all of them are at their limits, and rounding decides which of them count as sliding.
    """
    q, last = pose.q, np.inf
    put(q, workspace.start)
    for _ in range(_HASTY):
        terms = evaluate(load, moved, sliders, s, pose, workspace, 1)
        size = _size(workspace.residual, workspace.scale)
        if _balanced(size, terms, _FINE, workspace) or (
                _balanced(size, terms, _ROUGH, workspace) and size >= 0.5 * last):
            return True
        if not np.isfinite(size) or not _step(q, workspace):
            break
        last = size
    put(workspace.start, q)
    return False


@routine
def _newton(load, moved, sliders, s, pose, workspace):
    """Newton's method with a shift that grows after failed steps; whether it succeeded."""
    if _hasty_newton(load, moved, sliders, s, pose, workspace):
        return True
    m = len(pose.q)
    shift, q = 0.0, pose.q
    for _ in range(_TRIES):
        terms = evaluate(load, moved, sliders, s, pose, workspace, 1)
        size = _size(workspace.residual, workspace.scale)
        if not np.isfinite(size):
            return False
        if _balanced(size, terms, _FINE, workspace):
            return True
        better = False
        # The matrix is factorised in place and made again for another shift.
        for _ in range(_SHIFTS):
            for i in range(m):
                workspace.matrix[i, i] += shift * workspace.scale[i]
            if not _step(q, workspace):
                shift = max(30.0 * shift, 1e-10)
                evaluate(load, moved, sliders, s, pose, workspace, 1)
                continue
            evaluate(load, moved, sliders, s, pose, workspace, 0)
            if _size(workspace.residual, workspace.scale) < size:
                better = True
                break
            for i in range(m):
                q[i] -= workspace.step[i]
            if shift == 0.0 and _balanced(size, terms, _ROUGH, workspace):
                break
            shift = max(30.0 * shift, 1e-10)
            evaluate(load, moved, sliders, s, pose, workspace, 1)
        if not better:
            evaluate(load, moved, sliders, s, pose, workspace, 0)
            return _balanced(size, terms, _ROUGH, workspace)
        shift = 0.0 if shift <= 1e-9 else 0.1 * shift
    return False


@helper
def _same_states(workspace):
    """Whether all sliders are in the states kept before."""
    for j in range(workspace.state.shape[0]):
        for e in range(workspace.state.shape[1]):
            if workspace.state[j, e] != workspace.state_before[j, e]:
                return False
    return True


@helper
def _go(part, q, workspace):
    """Go a part of the step from its begin."""
    for i in range(len(q)):
        q[i] = workspace.base[i] + part * workspace.step[i]


@routine
def _across_states(load, moved, sliders, s, pose, workspace):
    """Newton's method from one change of state to the next; whether it succeeded.

    The part t of a Newton step leaves 1 - t of the out-of-balance force as long as forces are
    linear. A step ends just behind the place where the first node opens or closes, or the first
    slider begins or ceases to slide; the next has the matrix found there. The first step is taken
    in full, away from where many sliders are at their limits.

    J. Katzenelson, An algorithm for solving nonlinear resistor networks, Bell System Technical
    Journal 44 (1965), 1605-1620.
    """
    q, last = pose.q, np.inf
    put(q, workspace.start)
    for piece in range(_PIECES * workspace.state.size + _FEW_PIECES):
        terms = evaluate(load, moved, sliders, s, pose, workspace, 1)
        size = _size(workspace.residual, workspace.scale)
        if _balanced(size, terms, _FINE, workspace) or (
                _balanced(size, terms, _ROUGH, workspace) and size >= 0.5 * last):
            return True
        put(q, workspace.base)
        put_rows(workspace.state, workspace.state_before)
        if not np.isfinite(size) or not _step(q, workspace):
            break
        last = np.inf
        if piece == 0:
            continue
        evaluate(load, moved, sliders, s, pose, workspace, 0)
        if _same_states(workspace) or _size(workspace.residual, workspace.scale) <= _LEFT * size:
            last = size
            continue
        before, behind = 0.0, 1.0
        for _ in range(_BISECTIONS):
            if behind - before <= _ROUNDING * behind:
                break
            part = 0.5 * (before + behind)
            _go(part, q, workspace)
            evaluate(load, moved, sliders, s, pose, workspace, 0)
            if _same_states(workspace):
                before = part
            else:
                behind = part
        _go(behind, q, workspace)
    put(workspace.start, q)
    return False


@routine
def _solved(load, moved, sliders, s, pose, workspace):
    """Whether one of the forms of Newton's method succeeded."""
    return _newton(load, moved, sliders, s, pose, workspace) or _across_states(
        load, moved, sliders, s, pose, workspace)


@helper
def _slides(j, e, near, sliders, pose):
    """Whether slider e of node j is at its limit, up to a part of it."""
    tangents = pose.force.shape[1] // sliders.stiffness.shape[1]
    size = 0.0
    for k in range(tangents):
        size = math.hypot(size, pose.force[j, tangents * e + k])
    return size >= (1.0 - near) * sliders.limit[j, e] * pose.node[j, PRESSING]


@helper
def _room(j, e, change, sliders, pose):
    """Part of a change (k,) of the force of slider e of node j with which it reaches its limit."""
    tangents = len(change)
    second, first, below = 0.0, 0.0, -(sliders.limit[j, e] * pose.node[j, PRESSING]) ** 2
    for k in range(tangents):
        R = pose.force[j, tangents * e + k]
        second += change[k] * change[k]
        first += R * change[k]
        below += R * R
    root = np.sqrt(max(first * first - second * below, 0.0))
    return (root - first) / second if second > 0.0 else np.inf


@routine
def _improve_multipliers(load, moved, sliders, s, pose, workspace):
    """Take the Newton step of the multipliers of rigid sliders that stick, from their forces on."""
    n, elements = sliders.stiffness.shape
    tangents, m = pose.force.shape[1] // elements, len(pose.q)
    rows = np.zeros((n * elements * tangents, m))
    places = np.zeros((n * elements * tangents, 3), dtype=np.int64)
    root, misplaced = np.zeros(len(rows)), np.zeros(len(rows))
    count = 0
    for j in range(n):
        for e in range(elements):
            if sliders.rigid[j, e] != 0.0 and not _slides(j, e, _NEAR, sliders, pose):
                for k in range(tangents):
                    at = tangents * e + k
                    places[count, 0], places[count, 1], places[count, 2] = j, e, at
                    root[count] = np.sqrt(sliders.stiffness[j, e])
                    misplaced[count] = root[count] * (
                        pose.node[j, PLACE + PER_TANGENT * k] - pose.left[j, at])
                    put(s.rows[j, 2 * k], rows[count])
                    count += 1
    if count == 0:
        return
    found = np.zeros((n, elements * tangents))
    answer, matrix = np.empty(m), np.empty((count, count))
    pivots = np.zeros(count, dtype=np.int64)
    evaluate(load, moved, sliders, s, pose, workspace, 1)
    factorise(workspace.matrix, m, workspace.pivots)
    for c in range(count):
        put(rows[c], answer)
        solve(workspace.matrix, workspace.pivots, answer)
        for r in range(count):
            total = _REGULAR if r == c else 0.0
            for i in range(m):
                total += root[r] * rows[r, i] * answer[i] * root[c]
            matrix[r, c] = total
    step = misplaced[:count].copy()
    factorise(matrix, count, pivots)
    solve(matrix, pivots, step)
    part = 1.0
    for c in range(count):
        # The force has made the step c (g - z) already.
        found[places[c, 0], places[c, 2]] = root[c] * (step[c] - misplaced[c])
    for c in range(0, count, tangents):
        j, e = places[c, 0], places[c, 1]
        part = min(part, _room(j, e, found[j, tangents * e : tangents * (e + 1)], sliders, pose))
    if np.isfinite(part):
        for c in range(count):
            workspace.multiplier[places[c, 0], places[c, 2]] += (
                part * found[places[c, 0], places[c, 2]])


@kernel
def find_equilibrium(
    load: Vector, moved: GroundMotion, sliders: Sliders, s: SystemArrays,
    pose: Pose, workspace: Workspace,
) -> bool:
    """Bring ``pose`` into equilibrium from where it is; whether that succeeded.

    ``pose.force`` and ``pose.left`` are those of the last equilibrium at the begin. Rigid sliders
    that slid are left where their nodes are, springs a length R / c behind.
    """
    n, elements = sliders.stiffness.shape
    tangents = pose.force.shape[1] // elements
    held = False
    for j in range(n):
        for k in range(elements * tangents):
            rigid = sliders.rigid[j, k // tangents] != 0.0
            held |= rigid
            workspace.multiplier[j, k] = pose.force[j, k] if rigid else 0.0
    solved, before = False, np.inf
    for repeat in range(_REPEATS if held else 1):
        solved = _solved(load, moved, sliders, s, pose, workspace)
        if not solved or not held:
            break
        changed, largest, noise = 0.0, 0.0, 0.0
        for j in range(n):
            for k in range(elements * tangents):
                if sliders.rigid[j, k // tangents] != 0.0:
                    place = abs(pose.node[j, PLACE + PER_TANGENT * (k % tangents)])
                    noise = max(noise, sliders.stiffness[j, k // tangents] * (
                        place + abs(pose.left[j, k])))
                    changed = max(changed, abs(pose.force[j, k] - workspace.multiplier[j, k]))
                    largest = max(largest, abs(pose.force[j, k]))
                    workspace.multiplier[j, k] = pose.force[j, k]
        if changed <= _SETTLED * largest + _ROUNDING * noise:
            break
        if repeat >= _PATIENT and changed > 0.5 * before and (
                changed <= _ROUGHLY * largest + _NOISY * noise):
            break
        solved, before = False, changed
        if repeat >= _PLAIN:
            _improve_multipliers(load, moved, sliders, s, pose, workspace)
    if not solved:
        return False
    for j in range(n):
        for e in range(elements):
            if _slides(j, e, _SLIDES, sliders, pose):
                for k in range(tangents):
                    at = tangents * e + k
                    give = (0.0 if sliders.rigid[j, e] != 0.0
                            else pose.force[j, at] / sliders.stiffness[j, e])
                    pose.left[j, at] = pose.node[j, PLACE + PER_TANGENT * k] - give
    return True
