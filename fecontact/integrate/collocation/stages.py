"""The stages of a step by collocation, by Newton's method."""

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.dense_lu import factorise, solve
from fecontact.integrate.collocation.tableau import ONCE, POINTS, RATE_TERMS, STAGES, TWICE
from fecontact.integrate.collocation.workspace import BEGINS, ITERATIONS, JACOBIANS
from fecontact.integrate.rodas5p import dynamics, stage_solver
from fecontact.integrate.rodas5p.state import SPEED_SCALE
from fecontact.integrate.rodas5p.step_length import LAST_STEP
from fecontact.integrate.step_loop import RATES

# Part of the tolerance to which the stages are solved, and the change after which one iteration is
# enough.
_SOLVED, _AT_ONCE = 0.03, 3e-5
_MOST_ITERATIONS = 8
# Changes that shrink less from one iteration to the next ask for a new matrix.
_SLOW = 0.02
# The acceleration is extrapolated over steps up to so many times as long as the one before.
_FARTHEST = 3.0


@routine
def set_stage(i, h, y, accelerations, out):
    """Fill ``out`` (2 m,) with the state at stage i of a step from y, or with that of a column.

    ``accelerations`` are those at the begin, which does not count, and at the stages.
    """
    m = len(out) // 2
    for k in range(m):
        speed, place = 0.0, 0.0
        for other in range(STAGES):
            speed += ONCE[i, other] * accelerations[other + 1, k]
            place += TWICE[i, other] * accelerations[other + 1, k]
        out[m + k] = y[m + k] + h * speed
        out[k] = y[k] + h * (POINTS[i] * y[m + k] + h * place)


@helper
def move_back(before, h, c):
    """Put the state that part of the step ``before`` the last stage, at which it is, into ``c.y``.

    Towards the end of a step that ends at a switch of forces: its side of the switch.
    """
    m = c.accelerations.shape[1]
    for k in range(m):
        c.y[k] -= before * h * c.y[m + k]
        c.y[m + k] -= before * h * c.accelerations[STAGES, k]


@helper
def place_scale(k, problem, progress):
    """Size of the displacement of mode k, relative to which its errors count."""
    return max(max(progress.extremes[k], abs(progress.state[k])),
               problem.control.displacement_scale[k])


@helper
def speed_scale(problem, progress):
    """Size of the velocities, relative to which their errors count."""
    return max(progress.numbers[SPEED_SCALE], problem.control.speed_scale)


@routine
def extrapolate(h, progress, c):
    """First guess of the accelerations at the stages: what those of the step before go on to."""
    m = c.accelerations.shape[1]
    ratio = 0.0
    if progress.numbers[LAST_STEP] > 0.0:
        ratio = h / progress.numbers[LAST_STEP]
    for i in range(STAGES):
        x = 1.0 + 2.0 * ratio * POINTS[i]
        for k in range(m):
            value = c.accelerations[0, k]
            if c.flags[BEGINS] == 0 and ratio <= _FARTHEST:
                value = 0.0
                for power in range(RATE_TERMS - 1, -1, -1):
                    value = value * x + c.before[power, k]
            c.accelerations[i + 1, k] = value


@helper
def set_matrix_rows(i, h, J, c):
    """Fill the rows of stage i of the linear system for the accelerations, by J = [Jq, Jv]."""
    m = len(J)
    for k in range(m):
        row = i * m + k
        for other in range(STAGES):
            by_speed, by_place = h * ONCE[i, other], h * h * TWICE[i, other]
            for l in range(m):
                c.matrix[row, other * m + l] = -by_speed * J[k, m + l] - by_place * J[k, l]
        c.matrix[row, row] += 1.0


@helper
def _slip_change(h, problem, workspace, c):
    """Largest change of a slip velocity by ``c.right`` at a stage, in units of what is allowed.

    The force of a node that sticks follows its slip velocity, which may be far below the errors of
    velocities that the tolerance of the run allows.
    """
    s, control, projected = problem.system, problem.control, c.line[0]
    m, n, largest = c.accelerations.shape[1], len(s.gap), 0.0
    for j in range(n):
        if workspace.nodes[2, n + j] != 0.0:
            for i in range(STAGES):
                projected[i] = 0.0
                for k in range(m):
                    projected[i] += s.rows[j, 0, k] * c.right[i * m + k]
            moved = s.sliding[j, 0, 0] * c.given[STAGES - 1, dynamics.SPEED]
            allowed = control.slip_part * (control.slip_scale[j]
                                           + abs(workspace.nodes[1, j] - moved))
            for i in range(STAGES):
                slip = 0.0
                for other in range(STAGES):
                    slip += ONCE[i, other] * projected[other]
                part = h * abs(slip) / allowed
                # Comparisons with NaN are false.
                if part > largest:
                    largest = part
    return largest


@routine
def _improve(h, before, anew, problem, progress, workspace, c):
    """One iteration of Newton's method; how much it changes, in units of the tolerance.

    Each stage has a Jacobian of its own, as stiffness changes a thousandfold where slip ends.
    """
    s, blocks = problem.system, problem.blocks
    m = c.accelerations.shape[1]
    for i in range(STAGES):
        set_stage(i, h, progress.state, c.accelerations, c.y)
        if i == STAGES - 1 and before > 0.0:
            move_back(before, h, c)
        dynamics.set_rate_and_gradients(c.y, s, blocks, c.given[i], c.load[i], workspace.nodes,
                                        workspace.scratch, c.rate)
        if anew:
            stage_solver.assemble(s, blocks, workspace.scratch, workspace.reduced)
            set_matrix_rows(i, h, workspace.reduced.J, c)
        for k in range(m):
            c.right[i * m + k] = c.rate[m + k] - c.accelerations[i + 1, k]
    if anew:
        factorise(c.matrix, STAGES * m, c.pivots)
        c.flags[JACOBIANS] += 1
    solve(c.matrix, c.pivots, c.right)
    progress.counts[RATES] += STAGES
    slipping = _slip_change(h, problem, workspace, c)
    size, speeds = 0.0, speed_scale(problem, progress)
    for k in range(m):
        to_speed = h * problem.control.largest[k] / speeds
        to_place = h * h / place_scale(k, problem, progress)
        for i in range(STAGES):
            speed, place = 0.0, 0.0
            for other in range(STAGES):
                speed += ONCE[i, other] * c.right[other * m + k]
                place += TWICE[i, other] * c.right[other * m + k]
            size = max(size, max(abs(speed) * to_speed, abs(place) * to_place))
            # Comparisons with NaN are false.
            if not abs(speed) < np.inf:
                size = np.inf
        for i in range(STAGES):
            c.accelerations[i + 1, k] += c.right[i * m + k]
    return max(size / c.tolerance, slipping)


@helper
def solve_stages(h, before, problem, progress, workspace, c):
    """Solve for the accelerations at the stages; whether that has succeeded.

    The last stage is that part of the step ``before`` its end: a step that ends at a switch of
    forces does not feel what comes after.
    """
    last, anew = np.inf, True
    for iteration in range(_MOST_ITERATIONS):
        c.flags[ITERATIONS] = iteration
        size = _improve(h, before, anew, problem, progress, workspace, c)
        if not size < np.inf:
            return False
        if size < _AT_ONCE:
            return True
        if iteration > 0:
            rate = size / last
            if rate < 1.0 and size * rate < _SOLVED * (1.0 - rate):
                return True
            # Corrections that no longer shrink are rounding, or the iteration does not converge.
            if iteration > 2 and rate > 0.5:
                if size < _SOLVED:
                    return True
                if rate > 2.0:
                    return False
            anew = rate > _SLOW
        else:
            anew = False
        last = size
    return False
