r"""Jumps of derivatives where nodes touch down and lift off (saltation).

If the penetration u of a node passes a level at the rate u', where the accelerations jump by D, a
motion beside it, whose penetration differs by du, passes it by du / u' earlier, and feels D for so
long:

.. math:: dv^+ = dv^- + D\, du / u', \qquad du = \nabla u \cdot dy + (\partial u / \partial p) dp

Internal variables z of an open node decay to zero within 1e-7 s, and their derivatives with them.
A node touches down where its penetration passes a level e, or where its normal force e begins
because a dashpot had kept it from acting. A motion beside it, whose e differs by de, touches down
earlier by de / e', and z follows its rate z' in contact for so much longer, :math:`dz = z'\,
de / e'`.

Elastic Coulomb elements do not decay; :mod:`fecontact.integrate.rodas5p.sliders` has theirs.
"""

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.functions import copysign
from fecontact.integrate.rodas5p import tableau
from fecontact.integrate.rodas5p.step_length import LAST_STEP
from fecontact.system.node_forces import axis_force, node_forces
from fecontact.system.nodes import (
    NodeMotion,
    change_by,
    ground_motion,
    ground_moved,
    ground_speed,
    memory_of,
    node_contact,
    node_motion,
)

# Parts of the penetration scale within which a penetration is at a level, and from which on a force
# is beside it.
_NEAR, _BESIDE = 1e-6, 1e-9
# A change of a force at once by more than this part of it is a jump.
_JUMP = 1e-3
# A level counts as passed this part of a step, or of the time, before it is.
_AHEAD, _BRIEFEST = 1e-5, 1e-13
# A node that passes a level in a step is no further from it than so many steps would bring it.
_FAR = 4.0


@helper
def _passes_level(j, before, after, control):
    """Whether the penetration passes a level at which the normal force of node j may begin."""
    passes, near = False, _NEAR * control.depth[j]
    for level in control.levels[:, j]:
        passes = passes or (before - level) * (after - level) <= 0.0 or abs(before - level) < near
    return passes


@routine
def _touch(j, step, acceleration, problem, progress, workspace, vary, row):
    """Rate e' and derivative to the parameter of what begins the force of node j in a step.

    Fills ``row`` with the derivatives of e to the motion of the node.
    """
    s, v, y = problem.system, vary.variation, workspace.after
    force, rates = v.inside.force[j], v.inside.rates[j]
    now = min(step.target, step.latest)
    moved, z = ground_motion(now, s), memory_of(j, y, s)
    before = node_forces(j, node_motion(j, progress.state, s), step.moved, z, s, force,
                         rates).contact
    own, _, contact = node_forces(j, node_motion(j, y, s), moved, z, s, force, rates)
    for k in range(len(row)):
        row[k] = workspace.gradients_after.partial[j, 1, k]
    rate = change_by(row, j, workspace.rate_after, s)
    d = s.rows.shape[1]
    for tangent in range(d - 1):
        axis = 2 * tangent
        rate -= (row[axis] * ground_speed(tangent, j, moved, s)
                 + row[d + axis] * ground_moved(tangent, j, acceleration[0], acceleration[1], s))
    # A force that jumps is cut off at a penetration.
    by_depth = abs(own) > 2.0 * abs(rate) * step.h or _passes_level(
        j, before.penetration, contact.penetration, problem.control)
    if by_depth:
        for k in range(len(row)):
            row[k] = 0.0
        row[1], rate = -1.0, contact.rate
        for tangent in range(d - 1):
            row[2 * tangent] = contact.slope[tangent]
    if vary.width == 0.0:
        return rate, 0.0
    F, _, above = node_forces(j, node_motion(j, y, s), ground_motion(now, vary.above), z,
                              vary.above, force, rates)
    other, _, below = node_forces(j, node_motion(j, y, s), ground_motion(now, vary.below), z,
                                  vary.below, force, rates)
    # The force is zero on one side of the parameter.
    change = above.penetration - below.penetration if by_depth else 2.0 * (F - other)
    return rate, change / vary.width


@routine
def switch_memory(step, acceleration, problem, progress, workspace, vary):
    """Set the columns of internal variables of nodes that are open at the end of a step.

    So are those of nodes that touch down in it. ``acceleration`` is that of the ground's motions.
    """
    s, v = problem.system, vary.variation
    n, m = len(s.gap), len(v.none)
    states, columns = v.inside.rates.shape[1], len(v.columns)
    for j in range(n):
        opened = workspace.nodes[2, n + j] == 0.0
        if s.memory[j] == 0 or problem.control.slider_counts[j] > 0 or not (
                opened or progress.signs[j] == 0):
            continue
        first, row = 2 * m + j * states, v.inside.partial[j, 1]
        rate, varied = 1.0, 0.0
        if not opened:
            rate, varied = _touch(j, step, acceleration, problem, progress, workspace, vary, row)
        for c in range(columns):
            earlier = 0.0
            if not opened:
                earlier = change_by(row, j, v.after[c], s)
                if c == columns - 1:
                    earlier += varied
                earlier /= rate
            last = v.stages[tableau.STAGES * c + tableau.STAGES - 1]
            for k in range(first, first + s.memory[j]):
                v.after[c, k] = earlier * workspace.rate_after[k] if not opened else 0.0
                last[k] = 0.0


@helper
def contact_at(j, y, moved, s):
    """Node j against the other side at a state y."""
    return node_contact(j, node_motion(j, y, s), moved, s)


@routine
def cross_level(j, level, t, y, problem, vary):
    """Add to the columns at the end of a step what the force of node j that jumps makes of them.

    The penetration in the state y at the time t is at the level.
    """
    s, v, d = problem.system, vary.variation, problem.system.rows.shape[1]
    m, count, force, rates = len(v.none), len(v.columns), v.inside.force[0], v.inside.rates[0]
    moved, motion, z = ground_motion(t, s), node_motion(j, y, s), memory_of(j, y, s).copy()
    places, contact = motion.places, node_contact(j, motion, moved, s)
    jump, largest = np.zeros(d), 0.0
    # Both sides of the level, in the order in which they are passed.
    for side in (-1.0, 1.0):
        beside = side * copysign(_BESIDE * problem.control.depth[j], contact.rate)
        deeper = level + beside - contact.penetration
        node = node_forces(j, NodeMotion((places[0], places[1] - deeper, places[2]), motion.speeds),
                           moved, z, s, force, rates)
        for axis in range(d):
            jump[axis] += side * axis_force(axis, node, force, rates, s)
        largest = max(largest, abs(node.normal))
        if node.normal == 0.0 and problem.control.slider_counts[j] > 0:
            # Elastic elements begin without deflection; in the open they have followed the slip.
            z[:] = 0.0
    if abs(jump[1]) <= _JUMP * largest or contact.rate == 0.0:
        return
    for c in range(count):
        x = v.after[c]
        along, away, across = node_motion(j, x, s).places
        earlier = contact.slope[0] * along + contact.slope[1] * across - away
        if c == count - 1 and vary.width != 0.0:
            earlier += (
                contact_at(j, y, ground_motion(t, vary.above), vary.above).penetration
                - contact_at(j, y, ground_motion(t, vary.below), vary.below).penetration
            ) / vary.width
        earlier /= contact.rate
        for axis in range(d):
            for k in range(m):
                x[m + k] += s.rows[j, axis, k] * jump[axis] * earlier


@helper
def _ahead(h, t):
    """Time before it is passed from which on a level counts as passed, at an end of a step [s]."""
    return max(_AHEAD * h, _BRIEFEST * abs(t))


@routine
def cross_levels(step, problem, progress, y, vary):
    """Add to the columns at the end y of a step what forces that jump there make of them.

    Steps end where forces jump, within the part 1e-6 of a step, before or after. What is just ahead
    of the end counts as passed, and is not passed again in the next step.
    """
    s, levels, last = problem.system, problem.control.levels, progress.numbers[LAST_STEP]
    end, begun = min(step.target, step.latest), _ahead(last if last > 0.0 else step.h, step.t)
    now, ahead = ground_motion(end, s), _ahead(step.h, step.target)
    for j in range(len(s.gap)):
        after = contact_at(j, y, now, s)
        for k in range(len(levels)):
            level = levels[k, j]
            # Laws with fewer levels than others repeat their first one.
            if (abs(after.penetration - level) > _FAR * step.h * abs(after.rate)
                    or (k > 0 and level == levels[0, j])):
                continue
            before = contact_at(j, progress.state, step.moved, s)
            if (before.penetration + begun * before.rate < level) != (
                    after.penetration + ahead * after.rate < level):
                cross_level(j, level, end, y, problem, vary)
