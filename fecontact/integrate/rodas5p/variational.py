"""Derivatives of a step of the integrator to its start and to a parameter.

A step maps y to y + sum_j A_8j u_j + u_8 with stages u_i of
:mod:`fecontact.integrate.rodas5p.tableau`. For a column x of dy/dy_0, or of dy/dp, its stages U_i
solve the same systems, with the factors of the step,

    (I / (h gamma) - J) U_i = J(t_i, Y_i) X_i + sum_j C_ij U_j / h + H_i x  [+ p_i]
    X_i = x + sum_j A_ij U_j,     H_i = d/de J(t + e d_i h, y + e u_i) at e = 0

and p_i = df/dp(t_i, Y_i) + dJ/dp(t, y) u_i + d_i h d2f/dt dp(t, y) for the column of the
parameter. Where the speed of the ground varies, its motion in the stages, as
:mod:`fecontact.integrate.rodas5p.moving_ground` has it, takes the place of its part in d_i h.
So the result is the derivative of what is computed, not another approximation of the
same thing. H_i are differences over steps that are small against the scales of the laws, central
ones but beside kinks: of the forces of each node, once a step along each direction of its motion.
Derivatives to p are differences between a system above and one below.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.copies import put, put_rows
from fecontact.core.records import Block, Size, allocate, shapes
from fecontact.core.types import Array
from fecontact.integrate import collocated_columns as collocation
from fecontact.integrate.rodas5p import dynamics, moving_ground, stage_solver, tableau
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p import variational_stages as columns
from fecontact.integrate.rodas5p.blocks import block_at
from fecontact.integrate.rodas5p.saltation import cross_levels, switch_memory
from fecontact.integrate.small_systems import USUAL, Sized, Values, is_small, sizes_of
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import keep_sides, set_sides, widen_scales
from fecontact.system.nodes import (
    AXES,
    COMBINATIONS,
    MEMORY,
    MODES,
    NODES,
    SIZE,
    GroundMotion,
    SystemArrays,
    ground_motion,
    memory_of,
)

# Parameters are moved by this part of their value for differences of the right-hand side.
MOVE = 1e-5
# Parts of a step, at most, and tries to find their number.
_MOST_PARTS, _MOST_TRIES = 12, 6


# Columns that are carried, and directions in which forces of a node change.
COLUMNS, DIRECTIONS = Size("columns"), Size("directions")


class Variation(NamedTuple):
    """Columns of derivatives, and workspace of a step of them.

    Attributes
    ----------
    columns : (k, size) array
        dy/dy_0 column by column, then dy/dp if a parameter varies. Empty if none are wanted.
    after : (k, size) array
        Columns at the end of the step.
    norms : (2, k) array
        Largest size of each column since it began, and at the end of the step.
    least : (k,) array
        Lower bounds of the sizes in ``norms``: the size from which on the column of a parameter,
        which begins at zero, is controlled.
    stages : (STAGES k, size) array
        U_i of column c in row STAGES c + i.
    tolerance, error_floor : float
        Largest error of a column in a step that is allowed, relative to its size, or to the part
        ``error_floor`` of its largest size so far where that is more.
    column_forces : (k, m) array
        Accelerations by the parameter, in the last row; for steps by collocation.
    vectors : (7, size) array
        Work arrays of states.
    nodes : (3, d n) array
        Work array: displacements, velocities and forces of the nodes.
    given, load : (2, GIVEN), (2, m) arrays
        Motions and loads that are prescribed at a stage in the systems above and below.
    ground : (2, STAGES, WIDTH) array
        Motion of ground of varying speed in the stages, in these systems.
    forces : (d n,) array
        Work array of node forces.
    paths : (STAGES, D, n) array
        Displacements of the nodes by the stages along each of their directions.
    inside, ahead, behind, usual, between, second_derivatives : Gradients
        Gradients inside a stage, their change along it, work array, their usual sizes, their
        derivatives to the parameter, and their change along each direction of each node.
    """

    columns: Annotated[Array, COLUMNS, SIZE]
    after: Annotated[Array, COLUMNS, SIZE]
    norms: Annotated[Array, 2, COLUMNS]
    least: Annotated[Array, COLUMNS]
    stages: Annotated[Array, tableau.STAGES * COLUMNS, SIZE]
    tolerance: float
    error_floor: float
    column_forces: Annotated[Array, COLUMNS, MODES]
    vectors: Annotated[Array, 7, SIZE]
    nodes: Annotated[Array, 3, AXES * NODES]
    given: Annotated[Array, 2, dynamics.GIVEN]
    load: Annotated[Array, 2, MODES]
    ground: Annotated[Array, 2, tableau.STAGES, moving_ground.WIDTH]
    none: Annotated[Array, MODES]
    forces: Annotated[Array, AXES * NODES]
    paths: Annotated[Array, tableau.STAGES, DIRECTIONS, NODES]
    inside: dynamics.Gradients
    ahead: dynamics.Gradients
    behind: dynamics.Gradients
    usual: dynamics.Gradients
    between: dynamics.Gradients
    second_derivatives: dynamics.Gradients


class Vary(NamedTuple):
    """Derivatives that go with a run.

    ``above`` and ``below`` are the system with the parameter moved up and down, ``width`` apart;
    with width = 0 no parameter varies; ``central`` says that it could be moved both ways.
    ``transitions`` (N, k, size) holds, for each output time, the columns since the one before.
    ``propagate`` is the address of the compiled
    :func:`propagate`: runs without derivatives do not need it.
    """

    above: SystemArrays
    below: SystemArrays
    width: float
    central: int
    variation: Variation
    transitions: Block
    propagate: int


def variation_for(
    system: ContactSystem, columns: int, width: float, tolerance: float, error_floor: float,
) -> Variation:
    """Workspace for so many columns; the first ``size`` of them are the unit matrix.

    ``width`` is that of the parameter whose column comes last: 2e-5 of its value; zero without.
    """
    nodes, dimension, modes = system.arrays.rows.shape
    directions = 2 * dimension + system.memory if columns else 1
    sizes = {COLUMNS: columns, DIRECTIONS: directions, MODES: modes, NODES: nodes,
             MEMORY: system.memory, AXES: dimension,
             COMBINATIONS: len(system.arrays.polynomial_rows)}
    made = allocate(
        Variation, sizes, tolerance=tolerance, error_floor=error_floor,
        second_derivatives=allocate(dynamics.Gradients, {**sizes, NODES: directions * nodes}))
    np.fill_diagonal(made.columns, 1.0)
    if width:
        # A tenth of the state's own sizes, if the parameter changed by all of its value.
        made.least[-1] = 0.1 * MOVE * 2.0 / (width * error_floor)
    made.norms[:] = made.least
    return made


@routine
def _expand(side, step, y, varying, s, blocks, v, g, time_rate):
    """Fill gradients g and the rate at a fixed state of y' of a system at the begin of a step.

    What is given there goes to row ``side`` of that in v, and so does ground that is ``varying``.
    """
    given, load = v.given[side], v.load[side]
    after_t, later = np.nextafter(step.t, np.inf), dynamics.t_plus(step)
    dynamics.set_given(after_t, s, given, load)
    dynamics.set_gradients(y, s, blocks, dynamics.motion_given(given), v.nodes, g)
    dynamics.set_load_rate(step.t, later, after_t, s, v.none)
    change = dynamics.rates_of_ground(varying, dynamics.motion_given(given))
    dynamics.set_time_rate(s, blocks, given, change, g, v.none, v.nodes, time_rate)
    v.none[:] = 0.0
    if varying:
        moving_ground.set_ground(step, dynamics.motion_given(given), s, v.ground[side])


@routine
def _begin_parameter(step, varying, progress, blocks, vary):
    """Fill d2f/dt dp (v.vectors[6]) and v.between at the begin of a step."""
    v, y = vary.variation, progress.state
    drift, other = v.vectors[6], v.vectors[5]
    _expand(0, step, y, varying, vary.above, blocks, v, v.ahead, drift)
    _expand(1, step, y, varying, vary.below, blocks, v, v.behind, other)
    for k in range(len(y)):
        drift[k] = (drift[k] - other[k]) / vary.width
    columns.set_between(v.ahead, progress.gradients, v.behind, vary.width, vary.central != 0,
                        v.usual, v.between)


@helper
def add_matrices(x, blocks, vary, out):
    """Add to out what the parameter makes of the matrices' accelerations at a state x."""
    above, below, m = vary.above, vary.below, len(vary.variation.none)
    for own in range(len(blocks.own)):
        top, bottom, left, right = block_at(blocks.own, own)
        for i in range(top, bottom):
            total = 0.0
            for k in range(left, right):
                total += ((above.stiffness[i, k] - below.stiffness[i, k]) * x[k]
                          + (above.damping[i, k] - below.damping[i, k]) * x[m + k])
            out[m + i] -= total / vary.width


@routine
def _set_pushes(Y, blocks, vary, out):
    """Fill ``out`` with df/dp at Y, whose nodes move as v.nodes says.

    By what is given in the systems above and below at the time of Y.
    """
    v, above, below = vary.variation, vary.above, vary.below
    w, forces, rate = v.nodes, v.forces, v.vectors[4]
    m = len(v.none)
    dynamics.set_forces(Y, below, blocks, dynamics.motion_given(v.given[1]), w, v.behind, rate)
    for k in range(len(forces)):
        forces[k] = w[2, k]
    dynamics.set_forces(Y, above, blocks, dynamics.motion_given(v.given[0]), w, v.behind, out)
    for k in range(len(forces)):
        w[2, k] = (w[2, k] - forces[k]) / vary.width
    for k in range(2 * m, len(out)):
        out[k] = (out[k] - rate[k]) / vary.width
    for i in range(m):
        out[i] = 0.0
        out[m + i] = (v.load[0, i] - v.load[1, i]) / vary.width
    dynamics.add_node_forces(blocks, w[2], out[m : 2 * m])
    add_matrices(Y, blocks, vary, out)


@routine
def _set_forced(part, Y, u, blocks, vary, out):
    """Fill ``out`` with df/dp at Y, and dJ/dp u + ``part`` d2f/dt dp at the begin of the step.

    By what is given in the systems above and below at the time of Y.
    """
    v = vary.variation
    w, m = v.nodes, len(v.none)
    dynamics.project(blocks, Y, w[0], w[1])
    _set_pushes(Y, blocks, vary, out)
    w[2, :] = 0.0
    for k in range(m, len(out)):
        out[k] += part * v.vectors[6, k]
    columns.add_node_forces(v.between, vary.above, blocks, u, w, out)
    dynamics.add_node_forces(blocks, w[2], out[m : 2 * m])
    add_matrices(u, blocks, vary, out)


@routine
def _add_ground(i, s, blocks, gradients, ground, vary, out):
    """Add to ``out`` the derivative of what the increments of the ground in stage i make of y'."""
    v, width = vary.variation, vary.width
    dynamics.add_ground_change(moving_ground.increments_in(i, ground), s, blocks, v.between,
                               v.nodes, out)
    above = moving_ground.increments_in(i, v.ground[0])
    below = moving_ground.increments_in(i, v.ground[1])
    change = GroundMotion(
        (above.travel - below.travel) / width, (above.speed - below.speed) / width,
        (above.second_travel - below.second_travel) / width,
        (above.second_speed - below.second_speed) / width)
    dynamics.add_ground_change(change, s, blocks, gradients, v.nodes, out)


@routine
def _largest_error(scale, v):
    largest = 0.0
    for c in range(len(v.columns)):
        before, after, error = 0.0, 0.0, 0.0
        last = v.stages[tableau.STAGES * c + tableau.STAGES - 1]
        for k in range(len(scale)):
            before = max(before, abs(v.columns[c, k]) / scale[k])
            after = max(after, abs(v.after[c, k]) / scale[k])
            error = max(error, abs(last[k]) / scale[k])
            # Comparisons with NaN are false.
            if not abs(v.after[c, k]) < np.inf:
                return np.inf
        size = max(before, after)
        v.norms[1, c] = max(v.norms[0, c], size)
        if error > 0.0:
            largest = max(largest, error / max(size, v.error_floor * v.norms[1, c]))
    return largest


@routine
def _leave_turns(y, progress, s, counts, here, inside):
    """Let elastic elements of contacts that are open at the start y of a step turn as there.

    In space they turn at once where the contact closes, which is at the end of the step; the next
    one sets their deflections.
    """
    for j in range(len(counts)):
        if counts[j] == 0 or progress.signs[j] != 0:
            continue
        deflected = False
        for deflection in memory_of(j, y, s):
            deflected |= deflection != 0.0
        if deflected:
            rates, there = inside.rates[j], here.rates[j]
            for row in range(rates.shape[0]):
                for column in range(rates.shape[1]):
                    rates[row, column] = there[row, column]


@kernel(by_address=True)
def propagate(
    step: run_arrays.Step, problem: run_arrays.Problem, progress: run_arrays.Progress,
    workspace: run_arrays.Workspace, vary: Vary,
) -> float:
    """Carry the columns over the step whose stages and factors the workspace holds.

    Returns the largest error of a column relative to its size, or to ``error_floor`` times its
    largest size so far. ``workspace.right`` (size,) holds the units of the state. Columns of a
    parameter that are still smaller than ``least`` count as if they had that size.
    """
    s, blocks, v = problem.system, problem.blocks, vary.variation
    state, gradients, stages = progress.state, progress.gradients, workspace.stages
    m = len(v.none)
    Y = v.vectors[0]
    varies, varying = vary.width != 0.0, problem.control.varying
    acceleration = dynamics.ground_acceleration(step.t, dynamics.t_plus(step), step.moved, s)
    columns.learn(gradients, v.usual)
    columns.set_paths(step, varying, workspace.ground, s, blocks, stages, v)
    columns.set_second_derivatives(step, acceleration, problem, progress, workspace, v)
    if varies:
        _begin_parameter(step, varying, progress, blocks, vary)
    moved, last = step.moved, step.t
    counts, sliders = problem.control.slider_counts, problem.control.sliders != 0
    force, rates = np.empty(v.inside.force.shape[1]), np.empty(v.inside.rates.shape[1:])
    sides = np.zeros((len(s.gap), len(rates)))
    if sliders:
        set_sides(moved, state, s, counts, force, rates, sides)
    for i in range(tableau.STAGES):
        tableau.combined(tableau.A[i], 1.0, state, stages, Y)
        if i == 0:
            dynamics.copy_gradients(gradients, v.inside, blocks)
        else:
            now = min(step.t + tableau.NODES[i] * step.h, step.latest)
            if now != last:
                moved = ground_motion(now, s)
                if varies:
                    dynamics.set_given(now, vary.above, v.given[0], v.load[0])
                    dynamics.set_given(now, vary.below, v.given[1], v.load[1])
            last = now
            if varying:
                moved = moving_ground.ground_in(i, workspace.ground)
            if varying and varies:
                for side in range(2):
                    dynamics.give_motion(moving_ground.ground_in(i, v.ground[side]), v.given[side])
            if sliders:
                keep_sides(moved, Y, s, counts, force, rates, sides)
            dynamics.set_gradients(Y, s, blocks, moved, v.nodes, v.inside)
            if sliders:
                _leave_turns(state, progress, s, counts, gradients, v.inside)
            columns.learn(v.inside, v.usual)
        if varies:
            _set_forced(tableau.TIME[i] * step.h, Y, stages[i], blocks, vary, v.vectors[3])
            if varying:
                _add_ground(i, s, blocks, gradients, workspace.ground, vary, v.vectors[3])
        columns.set_ahead(i, state, s, stages, v)
        columns.solve_stage(i, step.h, problem, progress, workspace, vary)
    if len(state) > 2 * m:
        switch_memory(step, acceleration, problem, progress, workspace, vary)
    cross_levels(step, problem, progress, workspace.after, vary)
    if sliders:
        moved = ground_motion(min(step.target, step.latest), s)
        widen_scales(moved, workspace.after, s, counts, force, rates, workspace.right)
    return _largest_error(workspace.right, v)


@routine
def _parts(step, scale, x, forced, J, v):
    """In how many parts the columns x go over the step, and the error that is expected of them.

    As :func:`propagate` gives it, in one of the parts times their number. ``forced`` (4, m) acts
    on the last column at its begin, or (0, m) nothing does.
    """
    m, error, rate, ahead = len(v.none), np.empty_like(x), np.empty_like(x), np.empty_like(x)
    np.dot(J, x, rate[m:])
    for i in range(m):
        if len(forced) > 0:
            rate[m + i, len(v.columns) - 1] += forced[0, i]
        for c in range(len(v.columns)):
            rate[i, c] = x[m + i, c]
    parts, expected = 1, 0.0
    for _ in range(_MOST_TRIES):
        collocation.expected_error(step.h / parts, J, x, rate, ahead, error)
        expected = 0.0
        for c in range(len(v.columns)):
            size, off = 0.0, 0.0
            for k in range(2 * m):
                size = max(size, max(abs(x[k, c]), abs(ahead[k, c])) / scale[k])
                off = max(off, abs(error[k, c]) / scale[k])
            if off > 0.0:
                expected = max(expected, parts * off / max(
                    size, v.error_floor * max(v.norms[0, c], size)))
        if not expected > v.tolerance or parts >= _MOST_PARTS:
            break
        parts = min(_MOST_PARTS, max(parts + 1, int(np.ceil(
            parts * (expected / v.tolerance) ** (1.0 / 7.0)))))
    return parts, expected


@routine
def _set_accelerations(t, Y, blocks, vary, out):
    """Fill out (m,) with the derivatives of the accelerations to the parameter, at Y and time t.

    For a system without memory, whose nodes move as v.nodes says.
    """
    v, m = vary.variation, len(out)
    dynamics.set_given(t, vary.above, v.given[0], v.load[0])
    dynamics.set_given(t, vary.below, v.given[1], v.load[1])
    _set_pushes(Y, blocks, vary, v.vectors[3])
    for i in range(m):
        out[i] = v.vectors[3, m + i]


@kernel(by_address=True)
def propagate_in_parts(
    step: run_arrays.Step, problem: run_arrays.Problem, progress: run_arrays.Progress,
    workspace: run_arrays.Workspace, vary: Vary,
) -> float:
    """Carry the columns as :func:`propagate`, by collocation in parts of the step.

    For systems without memory. The derivatives are those along the interpolant of the step. Returns
    zero where their errors are within the tolerance: the steps are then left to the motion.
    """
    s, blocks, v = problem.system, problem.blocks, vary.variation
    count, size = v.columns.shape
    m, scale, varies = len(v.none), workspace.right, vary.width != 0.0
    Y = v.vectors[0]
    x = np.empty((size, count))
    for c in range(count):
        for k in range(size):
            x[k, c] = v.columns[c, k]
    J = np.empty((collocation.STAGES, m, size))
    forced = np.zeros((collocation.STAGES if varies else 0, m))
    if varies:
        dynamics.project(blocks, progress.state, v.nodes[0], v.nodes[1])
        _set_accelerations(np.nextafter(step.t, np.inf), progress.state, blocks, vary, forced[0])
    parts, expected = _parts(step, scale, x, forced, workspace.reduced.J, v)
    if expected > v.tolerance:
        return expected
    for part in range(parts):
        for i in range(collocation.STAGES):
            place = (part + collocation.NODES[i]) / parts
            now = min(step.t + place * step.h, step.latest)
            tableau.interpolated(place, progress.state, workspace.after, workspace.dense, Y)
            dynamics.set_gradients(Y, s, blocks, ground_motion(now, s), v.nodes, v.inside)
            stage_solver.assemble(s, blocks, v.inside, workspace.reduced)
            put_rows(workspace.reduced.J, J[i])
            if varies:
                _set_accelerations(now, Y, blocks, vary, forced[i])
        collocation.collocate(step.h / parts, J, forced, x)
    for c in range(count):
        for k in range(size):
            v.after[c, k] = x[k, c]
    cross_levels(step, problem, progress, workspace.after, vary)
    for c in range(count):
        largest = v.norms[0, c]
        for k in range(size):
            largest = max(largest, max(abs(v.columns[c, k]), abs(v.after[c, k])) / scale[k])
        v.norms[1, c] = largest
    return 0.0


@helper
def keep(v):
    """Take the columns at the end of the step for those of the next."""
    put_rows(v.after, v.columns)
    put(v.norms[1], v.norms[0])


@helper
def write_columns(v, out):
    """Fill out (k, size) with the columns, which are the unit matrix again from then on."""
    put_rows(v.columns, out)
    v.columns[:] = 0.0
    for k in range(v.columns.shape[1]):
        v.norms[0, k], v.norms[1, k] = v.least[k], v.least[k]
        v.columns[k, k] = 1.0


propagate_at = function_at(propagate)


def open_nodes(modes: int, nodes: int) -> Values:
    """Gradients of any number of nodes: of all, or in a workspace for those of each of them."""
    known = shapes(sizes_of(modes, nodes), dynamics.Gradients)[dynamics.Gradients]
    return {dynamics.Gradients: {name: (None, *shape[1:]) for name, shape in known.items()
                                 if name != "polynomial"}}


RECORDS = (run_arrays.Problem, run_arrays.Progress, run_arrays.Workspace, run_arrays.Output,
           Variation)
SMALL = Sized(propagate.for_values, RECORDS, USUAL, open_nodes, lambda nodes: {DIRECTIONS: 4})


def propagate_for(problem: run_arrays.Problem) -> int:
    """Address of the kernel that carries derivatives over a step, for this size or for all.

    For the same systems as the step loops, with any number of columns; other systems without
    internal variables go in parts of steps.
    """
    if is_small(problem):
        n, _, m = problem.system.rows.shape
        return int(SMALL.of(m, n).address)
    return int((propagate_in_parts if in_parts(problem) else propagate).address)


def in_parts(problem: run_arrays.Problem) -> bool:
    """Whether derivatives go over a step in parts, which leaves the steps to the motion."""
    return not (is_small(problem) or problem.system.memory.any())
