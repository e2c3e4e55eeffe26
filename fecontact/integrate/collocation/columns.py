r"""Derivatives of a step by collocation to its start and to a parameter.

A column x = [dq, dv] of dy/dy_0, or of dy/dp, has accelerations at the stages that obey the
derivative of the equations of the step,

.. math::

    \alpha_i = J_q(t_i, y_i) \left(dq + c_i h\, dv + h^2 \sum_l (A^2)_{il} \alpha_l\right)
        + J_v(t_i, y_i) \left(dv + h \sum_l A_{il} \alpha_l\right)
        + \partial f / \partial p\, (t_i, y_i)

whose last term is for the column of a parameter only. It is linear: the Jacobians at the solved
stages make one matrix for all columns. Forces are smooth within a step, as it ends where they
switch, so that columns are as accurate as the motion. What their polynomials miss within the step,
which it has through the accelerations at its begin too, is their error.
"""


import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.dense_lu import factorise, solve
from fecontact.integrate.collocation.stages import (
    move_back,
    place_scale,
    set_matrix_rows,
    set_stage,
    speed_scale,
)
from fecontact.integrate.collocation.step_polynomials import factorise_defect, look
from fecontact.integrate.collocation.tableau import (
    AT_PLACES,
    LOOKS,
    PLACES,
    PLACES_AT,
    POINTS,
    SPEEDS_AT,
    STAGES,
)
from fecontact.integrate.collocation.workspace import Collocation, Step
from fecontact.integrate.rodas5p import dynamics, stage_solver
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p import tableau as rows
from fecontact.integrate.rodas5p.saltation import contact_at, cross_level
from fecontact.integrate.rodas5p.variational import (
    DIRECTIONS,
    RECORDS,
    Vary,
    add_matrices,
    open_nodes,
)
from fecontact.integrate.small_systems import USUAL, Sized
from fecontact.system.node_forces import (
    normal_force,
    plane_friction,
    pressing_force,
)
from fecontact.system.nodes import ground_motion, node_contact


@routine
def _linearise(t, Y, moved, problem, workspace, vary, forced):
    """Put the derivatives of the accelerations at Y into J, those to the parameter into ``forced``.

    ``moved`` is how the ground moves at time t.
    """
    v = vary.variation
    dynamics.set_gradients(Y, problem.system, problem.blocks, moved, v.nodes, v.inside)
    stage_solver.assemble(problem.system, problem.blocks, v.inside, workspace.reduced)
    if vary.width != 0.0:
        _set_forced(t, Y, moved, problem, vary, forced)


@helper
def _law_forces(j, own, here, s):
    """F and R by the laws of a system at the penetration and slip of ``own``, in its place."""
    F, R = normal_force(j, own.penetration, own.rate, s)[0], 0.0
    if F != 0.0:
        R = plane_friction(j, own.slip[0], pressing_force(j, here, F, s), s)[0]
    return F, R


@routine
def _set_forced(t, Y, moved, problem, vary, out):
    """Fill out (m,) with the derivatives of the accelerations to the parameter.

    Differences are those of the laws, at the penetrations and slips that are; where these change
    with the parameter themselves, the derivatives of the forces say what follows. So no
    difference mixes forces from both sides of a switch.
    """
    s, blocks, v, above, below = (problem.system, problem.blocks, vary.variation, vary.above,
                                  vary.below)
    w, rate, n, m = v.nodes, v.vectors[3], len(s.gap), len(out)
    dynamics.set_given(t, above, v.given[0], v.load[0])
    dynamics.set_given(t, below, v.given[1], v.load[1])
    moved_above, moved_below = (dynamics.motion_given(v.given[0]),
                                dynamics.motion_given(v.given[1]))
    for at in range(n):
        j = blocks.nodes[at]
        motion, p = dynamics.motion_of(at, w, s), v.inside.partial[j]
        own = node_contact(j, motion, moved, s)
        one, other = (node_contact(j, motion, moved_above, above),
                      node_contact(j, motion, moved_below, below))
        F, R = _law_forces(j, own, one, above)
        F_below, R_below = _law_forces(j, own, other, below)
        deeper, faster, slip = (one.penetration - other.penetration, one.rate - other.rate,
                                one.slip[0] - other.slip[0])
        F += -F_below - p[1, 1] * deeper - p[1, 3] * faster
        R += -R_below + p[0, 1] * deeper + p[0, 3] * faster - p[0, 2] * slip
        w[2, at], w[2, n + at] = -R / vary.width, F / vary.width
    for i in range(m):
        rate[i] = 0.0
        rate[m + i] = (v.load[0, i] - v.load[1, i]) / vary.width
    dynamics.add_node_forces(blocks, w[2], rate[m:])
    add_matrices(Y, blocks, vary, rate)
    for i in range(m):
        out[i] = rate[m + i]


@helper
def _set_rates(i, ahead, J, v):
    """Put into row i of the stages of each column what its begin makes, the time ``ahead`` later.

    ``v.column_forces`` holds in its last row what the parameter makes in its column, or zero.
    """
    m, count = len(J), len(v.columns)
    for c in range(count):
        x, out = v.columns[c], v.stages[rows.STAGES * c + i]
        for k in range(m):
            total = 0.0
            for l in range(m):
                total += J[k, l] * (x[l] + ahead * x[m + l]) + J[k, m + l] * x[m + l]
            out[k] = total
            if c == count - 1:
                out[k] += v.column_forces[c, k]


@routine
def _set_columns(h, problem, progress, c, v):
    """Solve for the accelerations of all columns; they and their sizes at the end of the step."""
    m = c.accelerations.shape[1]
    speeds = speed_scale(problem, progress)
    for column in range(len(v.columns)):
        own = v.stages[rows.STAGES * column : rows.STAGES * (column + 1)]
        for i in range(STAGES):
            for k in range(m):
                c.right[i * m + k] = own[i + 1, k]
        solve(c.matrix, c.pivots, c.right)
        for i in range(STAGES):
            for k in range(m):
                own[i + 1, k] = c.right[i * m + k]
        after = v.after[column]
        set_stage(STAGES - 1, h, v.columns[column], own, after)
        v.norms[1, column] = max(v.norms[0, column], _size(after, speeds, problem, progress))


@helper
def _size(x, speeds, problem, progress):
    """Size of a column, relative to the scales of the state."""
    m, size = len(x) // 2, 0.0
    for k in range(m):
        size = max(size, abs(x[k]) / place_scale(k, problem, progress))
        size = max(size, abs(x[m + k]) * problem.control.largest[k] / speeds)
    return size


@routine
def _error_at(at, h, problem, progress, workspace, c, v):
    """Largest relative error of a column, by what its polynomial misses at one of the places."""
    m, J = c.accelerations.shape[1], workspace.reduced.J
    speeds, largest = speed_scale(problem, progress), 0.0
    g, to_place = factorise_defect(at, h, J, c)
    for column in range(len(v.columns)):
        own = v.stages[rows.STAGES * column : rows.STAGES * (column + 1)]
        x, y = v.columns[column], v.vectors[0]
        for k in range(m):
            place, speed, missing = 0.0, 0.0, 0.0
            for i in range(STAGES + 1):
                place += PLACES_AT[at, i] * own[i, k]
                speed += SPEEDS_AT[at, i] * own[i, k]
                missing -= AT_PLACES[at, i] * own[i, k]
            y[k] = x[k] + h * (PLACES[at] * x[m + k] + h * place)
            y[m + k] = x[m + k] + h * speed
            c.small_right[k] = missing
        for k in range(m):
            total = c.small_right[k]
            for l in range(2 * m):
                total += J[k, l] * y[l]
            c.small_right[k] = total
        if column == len(v.columns) - 1:
            for k in range(m):
                c.small_right[k] += v.column_forces[column, k]
        solve(c.small, c.small_pivots, c.small_right)
        error = 0.0
        for k in range(m):
            missing = abs(c.small_right[k])
            if not missing < np.inf:
                return np.inf
            error = max(error, missing * g * problem.control.largest[k] / speeds)
            error = max(error, missing * to_place / place_scale(k, problem, progress))
        size = max(_size(x, speeds, problem, progress),
                   _size(v.after[column], speeds, problem, progress))
        if error > 0.0:
            largest = max(largest, error / max(size, v.error_floor * v.norms[1, column]))
    return largest


@routine
def _cross_levels(t, near, problem, c, vary):
    """Add to the columns at the end of a step what forces that jump there make of them.

    A level is passed at the end of the step if the time ``near`` brings the node there.
    """
    s, levels = problem.system, problem.control.levels
    moved = ground_motion(t, s)
    for j in range(len(s.gap)):
        contact = contact_at(j, c.after, moved, s)
        for k in range(len(levels)):
            # Laws with fewer levels than others repeat their first one.
            if abs(contact.penetration - levels[k, j]) < near * abs(contact.rate) and (
                    k == 0 or levels[k, j] != levels[0, j]):
                cross_level(j, levels[k, j], t, c.after, problem, vary)


@kernel(by_address=True)
def propagate(
    step: Step, before: float, near: float, problem: run_arrays.Problem,
    progress: run_arrays.Progress, workspace: run_arrays.Workspace, c: Collocation, vary: Vary,
) -> float:
    """Carry the columns over the step whose stages ``c`` holds; return the largest error of one.

    The error is relative to the size of the column, or to ``error_floor`` times its largest size so
    far. The step continues for its part ``before`` after a switch of forces, which its last stage
    does not feel. The switch is located to the part ``near`` of the step.
    """
    t, h, latest = step.t, step.h, step.latest
    s, v = problem.system, vary.variation
    count, m = v.column_forces.shape
    J, forced = workspace.reduced.J, v.column_forces[count - 1]
    v.column_forces[count - 1] = 0.0
    after = np.nextafter(t, np.inf)
    dynamics.set_given(after, s, workspace.given, workspace.load)
    _linearise(after, progress.state, dynamics.motion_given(workspace.given), problem, workspace,
               vary, forced)
    _set_rates(0, 0.0, J, v)
    for i in range(STAGES):
        set_stage(i, h, progress.state, c.accelerations, c.y)
        if i == STAGES - 1 and before > 0.0:
            move_back(before, h, c)
        _linearise(min(t + POINTS[i] * h, latest), c.y, dynamics.motion_given(c.given[i]), problem,
                   workspace, vary, forced)
        set_matrix_rows(i, h, J, c)
        _set_rates(i + 1, POINTS[i] * h, J, v)
    factorise(c.matrix, STAGES * m, c.pivots)
    _set_columns(h, problem, progress, c, v)
    largest = 0.0
    for at in range(LOOKS):
        look(at, c)
        now = min(t + PLACES[at] * h, latest)
        dynamics.set_given(now, s, workspace.given, workspace.load)
        _linearise(now, c.y, dynamics.motion_given(workspace.given), problem, workspace, vary,
                   forced)
        error = _error_at(at, h, problem, progress, workspace, c, v)
        largest = max(largest, error) if error < np.inf else np.inf
    if before > 0.0:
        _cross_levels(min(t + h, latest), near * h, problem, c, vary)
    return largest


propagate_at = function_at(propagate)
SMALL = Sized(propagate.for_values, (*RECORDS, Collocation), USUAL, open_nodes,
              lambda nodes: {DIRECTIONS: 4})
