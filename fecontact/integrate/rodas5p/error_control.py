"""Errors of a step as multiples of what is allowed."""


import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.simd.vectors import everywhere, select, somewhere
from fecontact.integrate.brackets import Bracket, between, narrowed
from fecontact.integrate.near_nodes import extend_near
from fecontact.integrate.rodas5p import dynamics, stage_solver, tableau
from fecontact.integrate.rodas5p.blocks import block_at
from fecontact.integrate.rodas5p.state import ENERGY, SPEED_SCALE, WORST_NODE
from fecontact.integrate.step_loop import RATES
from fecontact.system.nodes import ground_motion, ground_speed, size_of, slip_velocity
from fecontact.system.powers import (
    POWER_COUNT,
    add_node_powers,
    given_powers,
    matrix_powers,
    set_losses,
)


@routine
def state_error(control, progress, workspace):
    """Error of the modes in a step, as a multiple of the allowed error."""
    error = modal_error(workspace.stages[tableau.STAGES - 1], control, progress, workspace)
    # Comparisons with NaN are false: make sure that it is not lost.
    finite = error < np.inf
    for k in range(len(workspace.after)):
        finite = finite & (abs(workspace.after[k]) < np.inf)
    return select(finite, error, np.inf)


@helper
def modal_error(difference, control, progress, workspace):
    """Largest entry of a difference of modal states, as a multiple of the allowed error."""
    m = len(control.largest)
    speed_scale = max(progress.numbers[SPEED_SCALE], control.speed_scale)
    error = 0.0
    for i in range(m):
        scale = max(max(progress.extremes[i], abs(workspace.after[i])),
                    control.displacement_scale[i])
        error = max(error, abs(difference[i]) / scale)
        error = max(error, abs(difference[m + i]) * control.largest[i] / speed_scale)
    return error / control.rtol


@routine
def memory_error(error, problem, progress, workspace):
    """The larger of the error and the errors of internal variables at nodes in contact.

    Forces do not depend on the internal variables of nodes that are open at the end of the step.
    These fade within 1e-7 s: their rates jump at lift-off, and small tolerances of them would
    need steps of rounding size. In space, elastic Coulomb elements of nodes that touch down turn at
    once: steps end at the touch, from where their deflections are set.
    """
    control = problem.control
    m, n = len(control.largest), len(problem.system.gap)
    states = len(control.memory_scale) // max(n, 1)
    difference = workspace.stages[tableau.STAGES - 1]
    for j in range(n):
        begins = (control.slider_counts[j] > 0 and problem.system.rows.shape[1] > 2
                  and everywhere(progress.signs[j] == 0.0))
        if not begins:
            touching = workspace.nodes[2, n + j] != 0.0
            for k in range(j * states, (j + 1) * states):
                part = abs(difference[2 * m + k]) / (control.memory_scale[k] * control.rtol)
                error = select(touching, max(error, part), error)
    return error


@helper
def sign_of(force):
    """1, 0 or -1."""
    return select(force > 0.0, 1.0, select(force < 0.0, -1.0, 0.0))


@routine
def set_signs(forces, signs):
    """Fill ``signs`` (n,) with the signs of normal forces (n,)."""
    for j in range(len(signs)):
        signs[j] = sign_of(forces[j])


@routine
def switches(places, nodes, forces, signs):
    """True if one of so many normal forces has another sign than at the start of the step."""
    some, pressing = False, forces[len(signs) :]
    for at in range(np.uint64(places)):
        some = some | (sign_of(pressing[at]) != signs[np.uint64(nodes[at])])
    return some


@routine
def passes_corner(control, s, workspace):
    """True if a penetration passes the corner of its normal law between the ends of a step."""
    n, ends, some = len(s.gap), workspace.ends, False
    for j in range(n):
        level = s.gap[j] + control.corner[j]
        before = ends[2, j] - ends[0, n + j] - level
        after = ends[2, n + j] - workspace.nodes[0, n + j] - level
        some = some | (before * after < 0.0)
    return some


@helper
def set_stage_rate(problem, progress, workspace, motion):
    """Fill ``workspace.base`` with the rates of ``stage``, by ``given`` and ``load``.

    ``motion`` (3, d n) takes the motion and the forces of the near nodes.
    """
    extend_near(workspace.stage, problem, progress, workspace)
    dynamics.set_rate(workspace.stage, problem.system, workspace.near, workspace.given,
                      workspace.load, motion, workspace.scratch, workspace.base)


@routine
def defect_error(step, G, problem, progress, workspace):
    """Error of a step by the defect of its interpolant, as a multiple of the allowed error.

    The defect is v_1 - v_0 less the integral of the accelerations v' along the interpolant. A
    filter (I - h gamma J)^-1 damps its stiff part, as in error estimates of implicit Runge-Kutta
    methods. Unlike the difference of the embedded solutions, the defect holds for steps in which a
    normal force begins, ends or has a corner.

    ``workspace.given`` and ``workspace.load`` are overwritten, and more nodes may be near.
    """
    s, right = problem.system, workspace.right
    m = len(problem.control.largest)
    for k in range(len(right)):
        right[k] = 0.0
    for point in range(len(DEFECT_POINTS)):
        part, weight = DEFECT_POINTS[point], DEFECT_WEIGHTS[point] * step.h
        tableau.interpolated(part, progress.state, workspace.after, workspace.dense,
                             workspace.stage)
        dynamics.set_given(min(step.t + part * step.h, step.latest), s, workspace.given,
                           workspace.load)
        set_stage_rate(problem, progress, workspace, workspace.slots)
        for k in range(m, 2 * m):
            right[k] -= weight * workspace.base[k]
    for k in range(m, 2 * m):
        right[k] = G * (right[k] + workspace.after[k] - progress.state[k])
    progress.counts[RATES] += len(DEFECT_POINTS)
    stage_solver.solve_stage(G, s, problem.blocks, progress.gradients, workspace.reduced, right,
                             workspace.slots, workspace.base)
    return modal_error(workspace.base, problem.control, progress,
                       workspace) / problem.control.switch_part


@routine
def slip_error(error, problem, progress, workspace):
    """The larger of the error and that of the slip velocities at the end of the step.

    Only where friction has no memory: there the force follows the slip velocity alone.
    """
    s, control = problem.system, problem.control
    n, near, slips = len(s.gap), workspace.near, workspace.between[1]
    dynamics.project(near, workspace.stages[tableau.STAGES - 1], workspace.between[0], slips)
    moved = dynamics.motion_given(workspace.given)
    for at in range(near.used[0]):
        j = near.nodes[at]
        if s.memory[j] == 0 and somewhere(workspace.nodes[2, n + j] != 0.0):
            slip, distance = 0.0, 0.0
            for tangent in range(s.rows.shape[1] - 1):
                first = 2 * tangent * n
                slip = size_of((slips[first + at], slip))
                distance = size_of((workspace.nodes[1, first + j] - ground_speed(
                    tangent, j, moved, s), distance))
            part = slip / (control.slip_part * (control.slip_scale[j] + distance))
            worse = (part > error) & (workspace.nodes[2, n + j] != 0.0)
            error = select(worse, part, error)
            progress.numbers[WORST_NODE] = select(worse, float(j), progress.numbers[WORST_NODE])
    return error


@helper
def largest_energy(after, control, progress):
    """The largest of kinetic energy, work of a power and the energy scale so far [J]."""
    kinetic = 0.0
    for i in range(len(control.largest), 2 * len(control.largest)):
        kinetic += 0.5 * after[i] ** 2
    energy = max(max(progress.numbers[ENERGY], kinetic), control.energy_scale)
    for k in range(POWER_COUNT):
        energy = max(energy, abs(progress.work[k]))
    progress.numbers[ENERGY] = energy
    return energy


@helper
def take_scales(control, progress):
    """Note the sizes of displacements and velocities of the state that the run is at."""
    m = len(control.largest)
    for i in range(m):
        progress.extremes[i] = max(progress.extremes[i], abs(progress.state[i]))
        speed = abs(progress.state[m + i]) * control.largest[i]
        progress.numbers[SPEED_SCALE] = max(progress.numbers[SPEED_SCALE], speed)


@helper
def set_scale(control, progress, workspace):
    """Fill ``workspace.right`` with the sizes of the state: what its errors count relative to."""
    m = len(control.largest)
    speed_scale = max(progress.numbers[SPEED_SCALE], control.speed_scale)
    for i in range(m):
        workspace.right[i] = max(progress.extremes[i], control.displacement_scale[i])
        workspace.right[m + i] = speed_scale / control.largest[i]
    for k in range(len(control.memory_scale)):
        workspace.right[2 * m + k] = control.memory_scale[k]


# Gauss's rule of two points on each half of a step.
DEFECT_POINTS = np.array([0.25 + 0.5 * half + side * 0.25 / np.sqrt(3.0)
                          for half in range(2) for side in (-1.0, 1.0)])
DEFECT_WEIGHTS = np.full(4, 0.25)
# Gauss-Lobatto points: both ends and two inside; exact for powers of degree five.
_INSIDE = 0.5 - 0.5 / np.sqrt(5.0)
_POINTS = np.array([0.0, _INSIDE, 1.0 - _INSIDE, 1.0])


def _lagrange_integral(k: int) -> np.ndarray:
    """Coefficients of s ... s^4 in the integral from 0 to s of the k-th Lagrange polynomial."""
    others = np.delete(_POINTS, k)
    polynomial = np.polynomial.polynomial.polyfromroots(others) / np.prod(_POINTS[k] - others)
    return np.polynomial.polynomial.polyint(polynomial)[1:]


_INTEGRALS = np.array([_lagrange_integral(k) for k in range(4)])


def _third_difference() -> np.ndarray:
    """Weights of the integral of the cubic through four powers less that of a parabola."""
    divided = np.array([1.0 / np.prod(_POINTS[k] - np.delete(_POINTS, k)) for k in range(4)])
    left = np.polynomial.polynomial.polyint(
        np.polynomial.polynomial.polyfromroots([0.0, _INSIDE, 1.0]))
    return divided * float(np.abs(np.polynomial.polynomial.polyval(1.0, left)))


_DIFFERENCE = _third_difference()
# Slip speeds at which creep begins or ends are met to this part of them, in so many trials at most.
_CLOSE, _MOST_TRIALS = 1e-9, 40


@helper
def _powers(point, t, y, problem, progress, workspace):
    """Fill a row of ``workspace.power`` (4, p + 2 n) as :func:`fecontact.system.powers.powers`.

    It is that of the ``point`` of the step at the time t, where the state is y.
    """
    s, blocks, near, out = problem.system, problem.blocks, workspace.near, workspace.power[point]
    given_powers(t, y, s, out)
    for part in range(len(blocks.own)):
        matrix_powers(block_at(blocks.own, part), y, s, out)
    for j in range(POWER_COUNT, len(out)):
        out[j] = 0.0
    dynamics.project(near, y, workspace.between[0], workspace.between[1])
    n, m = len(s.gap), len(blocks.position)
    states = (len(y) - 2 * m) // n
    force, rates = workspace.scratch.force[0], workspace.scratch.rates[0]
    losses = out[POWER_COUNT:]
    moved = ground_motion(t, s)
    for at in range(near.used[0]):
        j = near.nodes[at]
        first = 2 * m + j * states
        lost, speed = add_node_powers(
            j, dynamics.motion_of(at, workspace.between, s), moved,
            y[first : first + s.memory[j]], s, force, rates, out)
        set_losses(j, lost, speed, problem.control.stick_speed[j], losses)


@helper
def _set_powers(step, problem, progress, workspace):
    """Fill ``workspace.power`` with the powers at the points of a step."""
    for k in range(len(progress.power)):
        workspace.power[0, k] = progress.power[k]
    for point in range(1, 4):
        if point < 3:
            tableau.interpolated(_POINTS[point], progress.state, workspace.after, workspace.dense,
                                 workspace.right)
            state = workspace.right
        else:
            state = workspace.after
        extend_near(state, problem, progress, workspace)
        _powers(point, min(step.t + _POINTS[point] * step.h, step.latest), state, problem,
                progress, workspace)


@helper
def _quadrature_error(h, workspace):
    """Estimated error of a work in a step, the largest of those of the system and its nodes [J]."""
    largest, power = 0.0, workspace.power
    # Losses in creep need no estimate: they are losses of the node in parts of the step.
    for k in range(POWER_COUNT + len(workspace.creeps)):
        difference = 0.0
        for point in range(4):
            difference += _DIFFERENCE[point] * power[point, k]
        largest = max(largest, abs(difference))
    return h * largest


@routine
def work_error(step, problem, progress, workspace):
    """Error of the work in a step; fills ``workspace.power`` with the powers at its points."""
    control = problem.control
    _set_powers(step, problem, progress, workspace)
    return _quadrature_error(step.h, workspace) / (
        control.rtol * largest_energy(workspace.after, control, progress))


@routine
def set_creeps(step, problem, progress, workspace):
    """Fill ``workspace.creeps`` (n, 4) after :func:`work_error`: if a node creeps at first, and the
    parts of the step at which it begins or ceases to; 1 for those that there are not.
    """
    near, power, n = workspace.near, workspace.power, len(workspace.creeps)
    for at in range(near.used[0]):
        j = near.nodes[at]
        all_the_time, never = True, True
        for point in range(4):
            creep = power[point, POWER_COUNT + n + j]
            all_the_time = all_the_time and creep == power[point, POWER_COUNT + j]
            never = never and creep == 0.0
        row = workspace.creeps[j]
        row[0] = 1.0 if all_the_time else 0.0
        row[1] = row[2] = row[3] = 1.0
        if all_the_time or never:
            continue
        low, slow, passed = 0.0, _above_creep(0.0, j, step, problem, progress, workspace), 1
        row[0] = 1.0 if slow < 0.0 else 0.0
        for point in range(1, 4):
            high = _POINTS[point]
            fast = _above_creep(high, j, step, problem, progress, workspace)
            if (slow < 0.0) != (fast < 0.0):
                row[passed] = _passing(Bracket(low, high, slow, fast, 0), j, step, problem,
                                       progress, workspace)
                passed += 1
            low, slow = high, fast


@helper
def _above_creep(part, j, step, problem, progress, workspace):
    """Slip speed of node j at a part of the step less that below which it creeps."""
    s, m = problem.system, len(problem.control.largest)
    moved = ground_motion(min(step.t + part * step.h, step.latest), s)
    d, along, across = s.rows.shape[1], 0.0, 0.0
    for i in range(m):
        v = tableau.one_interpolated(part, m + i, progress.state, workspace.after, workspace.dense)
        along += s.rows[j, 0, i] * v
        if d > 2:
            across += s.rows[j, 2, i] * v
    slip = slip_velocity(j, (along, 0.0, across), moved, s)
    return size_of(slip) - problem.control.stick_speed[j]


@helper
def _passing(bracket, j, step, problem, progress, workspace):
    """Part of the step, within a bracket, at which node j begins or ceases to creep."""
    near, part = _CLOSE * problem.control.stick_speed[j], bracket.high
    for _ in range(_MOST_TRIALS):
        part = between(bracket)
        found = _above_creep(part, j, step, problem, progress, workspace)
        if abs(found) <= near:
            break
        bracket = narrowed(bracket, part, found)
    return part


@helper
def work_until(part, h, before, workspace, out):
    """Out = work ``before`` the step and in its part, by the cubic through the powers.

    In creep a node loses what it loses while it creeps.
    """
    power, n = workspace.power, len(workspace.creeps)
    w0, w1, w2, w3 = _weight(0, part), _weight(1, part), _weight(2, part), _weight(3, part)
    count = len(out) - n
    for k in range(count):
        out[k] = before[k] + h * (w0 * power[0, k] + w1 * power[1, k] + w2 * power[2, k]
                                  + w3 * power[3, k])
    for j in range(n):
        row, k = workspace.creeps[j], POWER_COUNT + j
        creeps, low, total = row[0] != 0.0, 0.0, 0.0
        for place in range(1, 5):
            high = min(part, row[place]) if place < 4 else part
            if creeps and high > low:
                for point in range(4):
                    total += (_weight(point, high) - _weight(point, low)) * power[point, k]
            creeps, low = not creeps, high
        out[count + j] = before[count + j] + h * total


@helper
def _weight(k, part):
    c = _INTEGRALS[k]
    return part * (c[0] + part * (c[1] + part * (c[2] + part * c[3])))
