r"""Derivatives of internal variables of friction where nodes touch down and lift off.

Internal variables z of an open node decay to zero within 1e-7 s, and their derivatives with them.
A node touches down where its penetration passes a level e, or where its normal force e begins
because a dashpot had kept it from acting. A motion beside it, whose e differs by de, touches down
earlier by de / e', and z follows its rate z' in contact for so much longer (saltation):

.. math:: dz = z'\, de / e', \qquad de = \nabla e \cdot dy + (\partial e / \partial p) dp

Elastic Coulomb elements do not decay; :mod:`fecontact.integrate.rodas5p.sliders` has theirs.
"""

from fecontact.core.compiled import helper, routine
from fecontact.integrate.rodas5p import tableau
from fecontact.system.node_forces import node_forces
from fecontact.system.nodes import (
    change_by,
    ground_motion,
    ground_moved,
    ground_speed,
    memory_of,
    node_motion,
)

# Part of the penetration scale within which a penetration is at a level.
_NEAR = 1e-6


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
