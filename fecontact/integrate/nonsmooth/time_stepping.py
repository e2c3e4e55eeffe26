"""Compiled run by implicit steps of variable length with set-valued friction at many nodes.

The method is the diagonally implicit Runge-Kutta method of Alexander, of order 3, stiffly
accurate and L-stable, with an embedded one of order 2 for the error.

References
----------
R. Alexander, Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s, SIAM Journal on
Numerical Analysis 14 (1977).
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.core.dense_lu import solve
from fecontact.core.types import Array
from fecontact.integrate.bernstein import DEPTH, NOWHERE, first_below, fit, largest, smallest
from fecontact.integrate.nonsmooth.equations import contact_powers, observe, set_implicit_matrix
from fecontact.integrate.nonsmooth.event_search import (
    ROUGHLY,
    first_pressed,
    missed_force,
    pressed,
)
from fecontact.integrate.nonsmooth.problem import (
    CUTS,
    FORCE,
    KNOWN,
    LIMIT,
    NODE_ENTRIES,
    PENETRATION,
    RATE,
    SLIP_OF,
    SLIP_SIZE,
    WITH_WORK,
    Evaluation,
    Limits,
    NonsmoothProblem,
    Output,
    Progress,
    next_target,
    pace,
    pass_break,
)
from fecontact.integrate.nonsmooth.stage_newton import Hold, NewtonWorkspace, Stage, solve_stage
from fecontact.integrate.step_loop import (
    CUT,
    FAILED,
    NOT_A_NUMBER,
    OUTPUTS,
    RUNNING,
    STEPS,
    TAKEN,
    Method,
    step_loop,
)
from fecontact.system.nodes import AXES, MODES, NODES, ground_motion, ground_speed, size_of
from fecontact.system.polynomial_forces import add_polynomial_product, has_polynomial
from fecontact.system.powers import POWER_COUNT, body_powers

GAMMA = 0.43586652150845899942
A21 = 0.5 * (1.0 - GAMMA)
B1 = -0.25 * (6.0 * GAMMA**2 - 16.0 * GAMMA + 1.0)
B2 = 0.25 * (6.0 * GAMMA**2 - 20.0 * GAMMA + 5.0)
ERROR_1 = B1 - GAMMA / (1.0 - GAMMA)
ERROR_2 = B2 - (1.0 - 2.0 * GAMMA) / (1.0 - GAMMA)
MOMENTS = (GAMMA, GAMMA + A21, 1.0)
STAGES = len(MOMENTS)
# A step is cut so often at most before the rest counts as error.
MOST_CUTS = 3
# Stages may fail in a range of lengths that short steps, of less than this part of the longest one,
# do not get past as they grow: after so many failures a longest step is tried.
_SHORT, _MOST_UNSOLVED = 1e-3, 50.0
# Stiffness that holds a sticking node during Newton's iteration, relative to its inertia, rounding
# of slip velocities, and the part of the softness against it that is enough for a node in space.
_GRIP, _ROUNDING, _FINER = 1e6, 2e-8, 1e-4
# Outputs nearer to an end of a step, in parts of it, are at that end.
_NEAR = 1e-9
# Entries of `Workspace.tries`: the largest floor of the slip velocities, attempts in a row whose
# error was too large, and attempts at short steps whose stages could not be solved.
TRIES = 3
SLOWEST, IN_A_ROW, UNSOLVED = range(TRIES)
# From values at the thirds of a step to the coefficients of a cubic.
_THIRDS = fit(np.arange(4) / 3.0)


class Workspace(NamedTuple):
    """Workspace of implicit steps.

    Attributes
    ----------
    newton, hold : NewtonWorkspace, Hold
        Workspace and stick variables of the stages.
    states, accelerations, forces, rates : (3, 2 m), (3, m), (3, n), (3, p + n) arrays
        Of the stages: Y, q'', friction forces, in space (3, 2 n), and powers.
    start, known : (m,) arrays
        Places and velocities that a stage adds to.
    new, before, after : (size,), (m + p + n,), (m + p + n,) arrays
        Y at the end of the step; accelerations and powers at both ends.
    old : (n, columns) array
        Results at the begin of the step.
    sides : (n,) array, in space (2 n,)
        ``hold.side`` at the begin of the step.
    inertia : (n,) array
        Tx Tx^T of each node, or in space T2 T2^T if that is larger.
    tries : (3,) array
        Results of an attempt at a step for the next attempt.
    cubic, speed, halves : (4,), (4,), (DEPTH, 5) arrays
        Polynomials over the step, and parts of it.
    """

    newton: NewtonWorkspace
    hold: Hold
    states: Annotated[Array, STAGES, 2 * MODES]
    accelerations: Annotated[Array, STAGES, MODES]
    forces: Annotated[Array, STAGES, (AXES - 1) * NODES]
    rates: Annotated[Array, STAGES, NODES + POWER_COUNT]
    start: Annotated[Array, MODES]
    known: Annotated[Array, MODES]
    new: Annotated[Array, WITH_WORK]
    before: Annotated[Array, MODES + NODES + POWER_COUNT]
    after: Annotated[Array, MODES + NODES + POWER_COUNT]
    old: Annotated[Array, NODES, NODE_ENTRIES]
    sides: Annotated[Array, (AXES - 1) * NODES]
    inertia: Annotated[Array, NODES]
    tries: Annotated[Array, TRIES]
    cubic: Annotated[Array, 4]
    speed: Annotated[Array, 4]
    halves: Annotated[Array, DEPTH, 5]


class Data(NamedTuple):
    """A run by implicit steps."""

    problem: NonsmoothProblem
    limits: Limits
    progress: Progress
    output: Output
    kept: Output
    evaluation: Evaluation
    workspace: Workspace


@helper
def _fastest_side(moved, p):
    """Largest speed of what slides under the nodes."""
    s, fastest = p.system, 0.0
    for j in range(len(s.gap)):
        speed = 0.0
        for tangent in range(s.rows.shape[1] - 1):
            speed = size_of((ground_speed(tangent, j, moved, s), speed))
        fastest = max(fastest, speed)
    return fastest


@routine
def _slips_back(j, step, p, w, tolerance, workspace):
    """Part of a step at which node j slips back between ends with slip of one sense; or 1.

    Along the direction of the slip at the begin.
    """
    s, b, speed, old, h = p.system, workspace.cubic, workspace.speed, workspace.old, step.h
    first, last, rise, fall = 0.0, 0.0, 0.0, 0.0
    for k in range(s.rows.shape[1] - 1):
        first = size_of((old[j, SLIP_OF[k]], first))
    if old[j, FORCE] == 0.0 or w.nodes[j, FORCE] == 0.0 or first <= tolerance:
        return 1.0
    speed[:] = 0.0
    for k in range(s.rows.shape[1] - 1):
        e = old[j, SLIP_OF[k]] / first
        last += e * w.nodes[j, SLIP_OF[k]]
        for i in range(s.rows.shape[2]):
            rise += e * s.rows[j, 2 * k, i] * workspace.before[i]
            fall += e * s.rows[j, 2 * k, i] * workspace.accelerations[STAGES - 1, i]
        for third in range(4):
            moved = ground_motion(step.t + h * third / 3.0, s)
            for i in range(4):
                speed[i] += _THIRDS[i, third] * e * ground_speed(k, j, moved, s)
    if last <= tolerance:
        return 1.0
    b[0], b[3] = first + speed[0], last + speed[3]
    b[1], b[2] = b[0] + h * rise / 3.0, b[3] - h * fall / 3.0
    for i in range(4):
        b[i] += tolerance - speed[i]
    back = first_below(b, workspace.halves)
    if back == NOWHERE:
        return 1.0
    b[0], b[1], b[2], b[3] = b[3], b[2], b[1], b[0]
    return 0.5 * (back + 1.0 - first_below(b, workspace.halves))


@routine
def _touches(j, h, p, w, limits, workspace):
    """Part of a step at which node j touches between ends that do not feel it; or 1."""
    s, b = p.system, workspace.cubic
    b[0], b[3] = workspace.old[j, PENETRATION], w.nodes[j, PENETRATION]
    b[1], b[2] = b[0] + h * workspace.old[j, RATE] / 3.0, b[3] - h * w.nodes[j, RATE] / 3.0
    above = missed_force(b, 1.0, j, p, limits)
    if max(pressed(smallest(b), j, s), pressed(largest(b), j, s)) > above:
        return first_pressed(b, above, ROUGHLY, j, s, workspace.halves)
    return 1.0


@routine
def _passed_over(step, p, limits, tolerance, w, workspace):
    """Part of a step at which a node slips back, or touches, between ends that show neither; or 1.

    Between the ends cubics count. Reversals below ``tolerance`` are left out.
    """
    shorter = 1.0
    for j in range(len(workspace.old)):
        shorter = min(shorter, _slips_back(j, step, p, w, tolerance, workspace),
                      _touches(j, step.h, p, w, limits, workspace))
    return shorter


@helper
def _slip_changes(w, workspace):
    """True if a node begins to slip, comes to rest or slips back within the step."""
    n, side, before = len(workspace.old), workspace.hold.side, workspace.sides
    for j in range(n):
        if workspace.old[j, FORCE] == 0.0 and w.nodes[j, FORCE] == 0.0:
            continue
        along, size, was = 0.0, 0.0, 0.0
        for k in range(j, len(side), n):
            along += side[k] * before[k]
            size += side[k] * side[k]
            was += before[k] * before[k]
        if along <= 0.0 and size + was > 0.0:
            return True
    return False


@routine
def _fill(row, output, step, data):
    """State at an output time within a step, by cubics through both ends."""
    p, progress, w, workspace = data.problem, data.progress, data.evaluation, data.workspace
    m, h = p.system.rows.shape[2], step.target - step.t
    Y, new, before, after = progress.state, workspace.new, workspace.before, workspace.after
    states, time = output.states, output.times[row]
    x = (time - step.t) / h
    early, late = (1.0 - x) * (1.0 - x), x * x
    for i in range(len(Y)):
        rate, rate_new = (Y[m + i], new[m + i]) if i < m else (before[i - m], after[i - m])
        states[row, i] = (early * ((1.0 + 2.0 * x) * Y[i] + x * h * rate)
                          + late * ((3.0 - 2.0 * x) * new[i] + (x - 1.0) * h * rate_new))
    observe(ground_motion(time, p.system), states[row], p, w.nodes)
    put(w.nodes[:, FORCE], output.normal[row])
    for j in range(len(progress.carried)):
        output.friction[row, j] = ((1.0 - x) * progress.carried[j]
                                   + x * workspace.forces[STAGES - 1, j])


@routine
def _set_inertia(p, limits, workspace):
    """Fill ``workspace.inertia``; returns the largest floor of the slip velocities."""
    s = p.system
    n, d, m = s.rows.shape
    slowest = 0.0
    for j in range(n):
        workspace.inertia[j], part = 0.0, 0.0
        for axis in range(0, d, 2):
            inertia = 0.0
            for i in range(m):
                inertia += s.rows[j, axis, i] * s.rows[j, axis, i]
                part = max(part, abs(s.rows[j, axis, i]) * limits.floor[m + i])
            workspace.inertia[j] = max(workspace.inertia[j], inertia)
        slowest = max(slowest, part)
    return slowest


@routine
def _prepare(step, quick, p, progress, workspace):
    """Set the linear matrix of a step, and the parameters r of the nodes in stick."""
    hold, inertia, old, g = workspace.hold, workspace.inertia, workspace.old, GAMMA * step.h
    set_implicit_matrix(g, g * g, p.system, workspace.newton.linear)
    rounding = _ROUNDING * quick
    if p.system.rows.shape[1] > 2:
        # Across a fast belt slip velocities are small; nodes must come to rest in shorter steps.
        rounding *= _FINER
    for j in range(len(inertia)):
        # Of a force within its limit the rounding of the slip velocity may move no more.
        softest = inertia[j] * g / _GRIP
        if old[j, LIMIT] > 0.0:
            softest += rounding / old[j, LIMIT]
        hold.grip[j] = 1.0 / softest if inertia[j] > 0.0 else 0.0
    put(progress.carried, hold.multiplier)


@routine
def _solve_stages(step, finest, p, limits, progress, workspace):
    """Solve the stages of a step; returns how many succeeded."""
    m = p.system.rows.shape[2]
    Y, h, g = progress.state, step.h, GAMMA * step.h
    start, known, states, accelerations = (workspace.start, workspace.known, workspace.states,
                                           workspace.accelerations)
    for k in range(STAGES):
        state = states[k]
        for i in range(m):
            start[i], known[i] = Y[i], Y[m + i]
            if k == 1:
                start[i] += h * A21 * states[0, m + i]
                known[i] += h * A21 * accelerations[0, i]
            elif k == 2:
                start[i] += h * (B1 * states[0, m + i] + B2 * states[1, m + i])
                known[i] += h * (B1 * accelerations[0, i] + B2 * accelerations[1, i])
            state[m + i] = Y[m + i] if k == 0 else states[k - 1, m + i]
        stage = Stage(min(step.t + MOMENTS[k] * h, step.latest), g, start, known, state)
        if not solve_stage(stage, p, workspace.hold, limits, finest, workspace.newton,
                           workspace.forces[k]):
            return k
        for i in range(m):
            accelerations[k, i] = (state[m + i] - known[i]) / g
        put(workspace.forces[k], workspace.hold.multiplier)
    return STAGES


@routine
def _error(step, p, limits, Y, workspace):
    """Error of the state in units of what is allowed, filtered by the matrix of the last stage."""
    s, start, known, floor = p.system, workspace.start, workspace.known, limits.floor
    states, accelerations = workspace.states, workspace.accelerations
    m, h, g = s.rows.shape[2], step.h, GAMMA * step.h
    for i in range(m):
        start[i] = h * (ERROR_1 * states[0, m + i] + ERROR_2 * states[1, m + i]
                        + GAMMA * states[2, m + i])
        known[i] = h * (ERROR_1 * accelerations[0, i] + ERROR_2 * accelerations[1, i]
                        + GAMMA * accelerations[2, i])
    for i in range(m):
        for k in range(m):
            known[i] -= g * s.stiffness[i, k] * start[k]
    if has_polynomial(s):
        add_polynomial_product(-g, workspace.newton.polynomial, start, s, known)
    solve(workspace.newton.matrix, workspace.newton.pivots, known)
    worst = 0.0
    for i in range(m):
        place = start[i] + g * known[i]
        worst = max(worst, abs(place) / (limits.rtol * (floor[i] + abs(Y[i]))),
                    abs(known[i]) / (limits.rtol * (floor[m + i] + abs(Y[m + i]))))
    return worst


@routine
def _set_rates(step, p, w, workspace):
    """Fill ``workspace.rates`` with the powers at the stages, and w with the nodes at the end."""
    for k in range(STAGES):
        moment = min(step.t + MOMENTS[k] * step.h, step.latest)
        moved = ground_motion(moment, p.system)
        observe(moved, workspace.states[k], p, w.nodes)
        body_powers(moment, workspace.states[k], p.system, workspace.rates[k])
        contact_powers(moved, p, w.nodes, workspace.forces[k], workspace.rates[k])


@routine
def _set_end(h, m, progress, workspace):
    """Fill ``workspace.new`` and ``workspace.after`` from the stages of an accepted step."""
    Y, rates = progress.state, workspace.rates
    put(workspace.states[STAGES - 1], workspace.new[: 2 * m])
    for i in range(rates.shape[1]):
        workspace.new[2 * m + i] = Y[2 * m + i] + h * (
            B1 * rates[0, i] + B2 * rates[1, i] + GAMMA * rates[2, i])
    put(workspace.accelerations[STAGES - 1], workspace.after[:m])
    put(rates[STAGES - 1], workspace.after[m:])


@routine
def _begin(t, data):
    """Prepare the first step, which fills the first row."""
    data.workspace.tries[SLOWEST] = _set_inertia(data.problem, data.limits, data.workspace)
    data.progress.counts[OUTPUTS] = 0
    return RUNNING


@routine
def _attempt(step, last, smallest, data):
    """Try a step; its outcome, and the length of the next one."""
    p, limits, progress, output, w, workspace = (data.problem, data.limits, data.progress,
                                                 data.output, data.evaluation, data.workspace)
    Y, counts, sizes, tries = progress.state, progress.counts, progress.largest, workspace.tries
    n, _, m = p.system.rows.shape
    length, slowest = step.h, tries[SLOWEST]
    moved = ground_motion(step.t, p.system)
    observe(moved, Y, p, workspace.old)
    quick = sizes[SLIP_SIZE] + _fastest_side(moved, p)
    _prepare(step, quick, p, progress, workspace)
    finest = (1e-2 * limits.rtol + 1e-11) * max(slowest, quick)
    if p.system.rows.shape[1] > 2:
        # Athwart a fast belt slip velocities are small, and their errors count.
        finest *= 0.01
    solved = _solve_stages(step, finest, p, limits, progress, workspace)
    if solved < STAGES:
        tries[UNSOLVED] += 1.0
        finite = math.isfinite(workspace.states[solved, m])
        return FAILED if finite else NOT_A_NUMBER, 0.25 * length
    worst = _error(step, p, limits, Y, workspace)
    if worst > 1.0:
        tries[IN_A_ROW] += 1.0
        # Where a node begins to slip or to stick, the error falls with the length only.
        factor = 0.9 * worst ** (-1.0 / 3.0) if tries[IN_A_ROW] == 1.0 else 0.7 / worst
        return FAILED, length * max(factor, 0.02)
    _set_rates(step, p, w, workspace)
    if counts[KNOWN] == 0:
        put(workspace.accelerations[0], workspace.before[:m])
        put(workspace.rates[0], workspace.before[m:])
    if counts[CUTS] < MOST_CUTS:
        part = _passed_over(step, p, limits, limits.rtol * (slowest + quick), w, workspace)
        if part * length > smallest and part < 1.0:
            counts[CUTS] += 1
            return CUT, part * length
    row = counts[OUTPUTS]
    # Ends of steps are exact; polynomials over a step know no change of slip within it.
    part = (output.times[row] - step.t) / length
    if _NEAR < part < 1.0 - _NEAR and _slip_changes(w, workspace):
        return CUT, part * length
    for j in range(n):
        slip = 0.0
        for k in range(p.system.rows.shape[1] - 1):
            slip = size_of((w.nodes[j, SLIP_OF[k]], slip))
        sizes[SLIP_SIZE] = max(sizes[SLIP_SIZE], slip)
    _set_end(length, m, progress, workspace)
    if counts[STEPS] == 0:
        put(workspace.forces[0], progress.carried)
    tries[IN_A_ROW], counts[CUTS] = 0.0, 0
    if length > _SHORT * limits.longest:
        tries[UNSOLVED] = 0.0
    elif tries[UNSOLVED] > _MOST_UNSOLVED:
        tries[UNSOLVED] = 0.0
        return TAKEN, limits.longest
    return TAKEN, length * min(8.0, max(0.3, 0.9 * max(worst, 1e-12) ** (-1.0 / 3.0)))


@routine
def _go_on(step, h, data):
    """Make the end of the step the state of the run."""
    progress, workspace = data.progress, data.workspace
    put(workspace.new, progress.state)
    put(workspace.after, workspace.before)
    put(workspace.forces[STAGES - 1], progress.carried)
    put(workspace.hold.side, workspace.sides)
    progress.counts[KNOWN] = 0 if step.at_break else 1
    if step.at_break:
        pass_break(step, data.problem, progress, data.output)
    return pace(step, progress, data.output.times), h


METHOD = Method("implicit", Data, next_target, _attempt, _fill, _go_on, _begin, places=1)
run_steps = step_loop(METHOD)
