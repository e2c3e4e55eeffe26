"""Derivatives of a step of the integrator to its start and to a parameter.

A step maps y to y + sum_j A_8j u_j + u_8 with stages u_i of
:mod:`fecontact.integrate.rodas5p.tableau`. For a column x of dy/dy_0, or of dy/dp, its stages U_i
solve the same systems, with the factors of the step,

    (I / (h gamma) - J) U_i = J(t_i, Y_i) X_i + sum_j C_ij U_j / h + H_i x  [+ p_i]
    X_i = x + sum_j A_ij U_j,     H_i = d/de J(t + e d_i h, y + e u_i) at e = 0

and p_i = df/dp(t_i, Y_i) + d/de df/dp(t + e d_i h, y + e u_i) for the column of the parameter. So
the result is the derivative of what is computed, not another approximation of the same thing.
H_i and p_i are differences over steps that are small against the scales of the laws, central ones
but beside kinks.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import block, compile_law, f8, function_at, helper, i8, matrix, vector
from fecontact.core.references import Reference
from fecontact.core.types import Array
from fecontact.integrate.rodas5p import dynamics, tableau
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.rodas5p import variational_stages as columns
from fecontact.system.nodes import (
    SYSTEM,
    ground_motion,
    in_space,
    moved_across,
    moved_along,
    node_contact,
)
from fecontact.system.space_nodes import contact_in_space, laws_of

# Differences are taken over this part of the scales of the laws.
_PART = 1e-4
# Differences of larger parts of the usual size of a derivative are jumps.
_JUMP = 3.0 * _PART


@helper
def probing_distance(u, blocks, control, w):
    """Multiple e of the stage u that is small against the scales of all laws."""
    m, n = len(control.largest), len(control.depth)
    dynamics.project(blocks, u, w[0], w[1])
    largest = 1.0
    for j in range(n):
        largest = max(largest, abs(w[1, j]) / control.slip_scale[j])
        largest = max(largest, abs(w[0, n + j]) / control.depth[j])
        if w.shape[1] > 2 * n:
            largest = max(largest, abs(w[1, 2 * n + j]) / control.slip_scale[j])
    for k in range(len(control.memory_scale)):
        largest = max(largest, abs(u[2 * m + k]) / control.memory_scale[k])
    return _PART / largest


@helper
def _difference(ahead, here, behind, factor, forward, usual):
    """Difference quotient, that of one side where a kink or a jump lies within reach.

    A difference that is not small against the ``usual`` size has met a jump. Of two sides that
    differ without one, that of the step itself counts.
    """
    a, b = ahead - here, here - behind
    jump_ahead, jump_behind = abs(a) > _JUMP * usual, abs(b) > _JUMP * usual
    if jump_ahead or jump_behind:
        if jump_ahead and jump_behind:
            return factor * (a if abs(a) < abs(b) else b)
        return factor * (b if jump_ahead else a)
    if abs(a - b) <= 0.5 * max(abs(a), abs(b)):
        return 0.5 * factor * (a + b)
    return factor * (a if forward else b)


@helper
def friction_length(g):
    """Number of entries of ``force`` that tell of friction."""
    width = g.rates.shape[2]
    return 2 * width if g.partial.shape[1] > 3 else width


@helper
def learn(here, usual):
    """Let the usual sizes be the largest seen."""
    n, states, width = here.rates.shape
    for j in range(n):
        for row in range(here.partial.shape[1]):
            for k in range(here.partial.shape[2]):
                usual.partial[j, row, k] = max(usual.partial[j, row, k],
                                               abs(here.partial[j, row, k]))
        for k in range(friction_length(here)):
            usual.force[j, k] = max(usual.force[j, k], abs(here.force[j, k]))
        for k in range(width):
            for row in range(states):
                usual.rates[j, row, k] = max(usual.rates[j, row, k], abs(here.rates[j, row, k]))


@helper
def set_sinking(t, y, s, blocks, v, out):
    """Fill out (2, n): slope of the ground under each node, and rate of its penetration.

    In space (3, n): with the slope along the second tangent.
    """
    moved = ground_motion(t, s)
    dynamics.project(blocks, y, v.nodes[0], v.nodes[1])
    for j in range(len(s.abscissa)):
        motion = dynamics.motion_of(j, v.nodes, s)
        if in_space(s):
            contact = contact_in_space(motion, moved, laws_of(j, s), s.sides[j],
                                       s.profile_parameters)
            out[2, j] = contact.slope_across
        else:
            contact = node_contact(j, motion, moved, s)
        out[0, j], out[1, j] = contact.slope, contact.rate


@helper
def differences(ahead, here, behind, usual, factor, u, travelled, sinking, s, blocks, w):
    """Put the difference quotients of gradients along the stage u into those ahead.

    A stage that moves a node as the step does shows with its forward side what is within the
    step. ``travelled`` is what the ground's two motions have done by then.
    """
    n, states, width = ahead.rates.shape
    dynamics.project(blocks, u, w[0], w[1])
    for j in range(n):
        sunk = sinking[0, j] * (
            w[0, j] - moved_along(j, travelled[0], travelled[1], s)) - w[0, n + j]
        if in_space(s):
            sunk += sinking[2, j] * (
                w[0, 2 * n + j] - moved_across(j, travelled[0], travelled[1], s))
        forward = sunk * sinking[1, j] >= 0.0
        for row in range(ahead.partial.shape[1]):
            for k in range(ahead.partial.shape[2]):
                ahead.partial[j, row, k] = _difference(
                    ahead.partial[j, row, k], here.partial[j, row, k], behind.partial[j, row, k],
                    factor, forward, usual.partial[j, row, k])
        for k in range(friction_length(ahead)):
            ahead.force[j, k] = _difference(ahead.force[j, k], here.force[j, k],
                                            behind.force[j, k], factor, forward,
                                            usual.force[j, k])
        for k in range(width):
            for row in range(states):
                ahead.rates[j, row, k] = _difference(
                    ahead.rates[j, row, k], here.rates[j, row, k], behind.rates[j, row, k], factor,
                    forward, usual.rates[j, row, k])


# Parameters are moved by this part of their value for differences of the right-hand side.
MOVE = 1e-5


class Variation(NamedTuple):
    """Columns of derivatives, and room for a step of them.

    Attributes
    ----------
    columns : (k, size) array
        dy/dy_0 column by column, then dy/dp if a parameter varies. Empty if none are wanted.
    after : (k, size) array
        They at the end of the step.
    norms : (2, k) array
        Largest size of each column since it began, and at the end of the step.
    least : (k,) array
        What these are at least: what makes the column of a parameter, which begins at zero,
        worth attention.
    stages : (STAGES k, size) array
        U_i of column c in row STAGES c + i.
    tolerance, faded : float
        Error of a column in a step that is allowed, in units of its size; of the part ``faded``
        of the largest size that it has had where it is smaller.
    moved, right : (k, size) arrays
        X_i and the right sides of a stage, column by column.
    pushed, bent : (k, m) arrays
        Accelerations by X_i and by H_i; solutions u_v.
    inside_matrix, ahead_matrix, solver : (m, 2 m) arrays
        What makes these of X_i, x and the right sides.
    """

    columns: Array
    after: Array
    norms: Array
    least: Array
    stages: Array
    tolerance: float
    faded: float
    moved: Array
    pushed: Array
    bent: Array
    right: Array
    inside_matrix: Array
    ahead_matrix: Array
    solver: Array
    vectors: Array
    nodes: Array
    sinking: Array
    given: Array
    load: Array
    none: Array
    inside: dynamics.Gradients
    ahead: dynamics.Gradients
    behind: dynamics.Gradients
    usual: dynamics.Gradients


VARIATION = types.NamedTuple(
    [matrix] * 3 + [vector, matrix, f8, f8] + [matrix] * 10 + [vector] * 3
    + [dynamics.GRADIENTS] * 4, Variation)


class Vary(NamedTuple):
    """Derivatives that go with a run.

    ``above`` and ``below`` are the system with the parameter moved up and down, ``width`` apart;
    with width = 0 no parameter varies. ``transitions`` (N, k, size) holds, for each output time,
    the columns since the one before. ``propagate`` is the address of :data:`propagate`.
    """

    above: Any
    below: Any
    width: float
    variation: Variation
    transitions: Array
    propagate: int


VARY = types.NamedTuple([SYSTEM, SYSTEM, f8, VARIATION, block, i8], Vary)
_PROPAGATE = f8(run_arrays.STEP_TYPE, Reference(run_arrays.PROBLEM), Reference(run_arrays.PROGRESS),
                Reference(run_arrays.ROOM), Reference(VARY))
propagate_at = function_at(_PROPAGATE)


def variation_for(
    columns: int, modes: int, nodes: int, states: int, dimension: int, width: float,
    tolerance: float, faded: float,
) -> Variation:
    """Room for so many columns; the first ``size`` of them are the unit matrix.

    ``width`` is that of the parameter whose column comes last: 2e-5 of its value; zero without.
    """
    size = 2 * modes + nodes * states
    room = [run_arrays.gradients_for(nodes, states, dimension) for _ in range(4)]
    start = np.zeros((columns, size))
    np.fill_diagonal(start, 1.0)
    least = np.zeros(columns)
    if width:
        # A tenth of the state's own sizes, if the parameter changed by all of its value.
        least[-1] = 0.1 * MOVE * 2.0 / (width * faded)
    return Variation(start, np.zeros((columns, size)), np.tile(least, (2, 1)), least,
                     np.zeros((tableau.STAGES * columns, size)), tolerance, faded,
                     np.zeros((columns, size)), np.zeros((columns, modes)),
                     np.zeros((columns, modes)), np.zeros((columns, size)),
                     np.zeros((modes, 2 * modes)), np.zeros((modes, 2 * modes)),
                     np.zeros((modes, 2 * modes)), np.zeros((7, size)),
                     np.zeros((3, dimension * nodes)), np.zeros((dimension, nodes)),
                     np.zeros(dynamics.GIVEN),
                     np.zeros(modes), np.zeros(modes), *room)


@helper
def _rates_between(t, Y, blocks, vary, factor, out):
    """Fill out = factor (f of the system above less f of that below)."""
    v = vary.variation
    rate, other = v.vectors[4], v.vectors[5]
    dynamics.set_given(t, vary.above, v.given, v.load)
    dynamics.set_rate(Y, vary.above, blocks, v.given, v.load, v.nodes, v.behind, rate)
    dynamics.set_given(t, vary.below, v.given, v.load)
    dynamics.set_rate(Y, vary.below, blocks, v.given, v.load, v.nodes, v.behind, other)
    for k in range(len(Y)):
        out[k] = factor * (rate[k] - other[k])


@helper
def _largest_error(scale, v):
    largest = 0.0
    for c in range(len(v.columns)):
        before, after, error = 0.0, 0.0, 0.0
        last = v.stages[tableau.STAGES * c + tableau.STAGES - 1]
        for k in range(len(scale)):
            before = max(before, abs(v.columns[c, k]) / scale[k])
            after = max(after, abs(v.after[c, k]) / scale[k])
            error = max(error, abs(last[k]) / scale[k])
        size = max(before, after)
        v.norms[1, c] = max(v.norms[0, c], size)
        if error > 0.0:
            largest = max(largest, error / max(size, v.faded * v.norms[1, c]))
    return largest


def _propagate(step, problem, progress, room, vary):
    """Carry the columns over the step whose stages and factors the room holds.

    Returns the largest error of a column in units of its size, or of the part ``faded`` of the
    largest it has been, with ``room.right`` (size,) as the units of the state; columns of a
    parameter that are still faint count as if they were not.
    """
    s, blocks, v = problem.system, problem.blocks, vary.variation
    state, gradients, reduced, stages = (progress.state, progress.gradients, room.reduced,
                                         room.stages)
    size = len(state)
    m = len(v.none)
    w = v.nodes
    Y, right, forced, rate = v.vectors[0], v.vectors[1], v.vectors[3], v.vectors[4]
    varies = vary.width != 0.0
    G = 1.0 / (step.h * tableau.GAMMA)
    if size == 2 * m:
        columns.set_solver(G, blocks, reduced, v)
    set_sinking(step.t, state, s, blocks, v, v.sinking)
    moved = ground_motion(step.t, s)
    for i in range(tableau.STAGES):
        now = step.t if i == 0 else min(step.t + tableau.NODES[i] * step.h, step.latest)
        tableau.combined(tableau.A[i], 1.0, state, stages, Y)
        dynamics.set_given(now, s, v.given, v.load)
        dynamics.set_rate_and_gradients(Y, s, blocks, v.given, v.load, w, v.inside, rate)
        learn(v.inside, v.usual)
        advance = tableau.TIME[i] * step.h
        reach = probing_distance(stages[i], blocks, problem.control, w)
        if varies:
            _rates_between(now, Y, blocks, vary, 1.0 / vary.width, forced)
        for side in range(2):
            e = reach if side == 0 else -reach
            for k in range(size):
                Y[k] = state[k] + e * stages[i, k]
            later = step.t + e * advance
            if varies:
                _rates_between(later, Y, blocks, vary, 0.5 / (e * vary.width), right)
                for k in range(size):
                    forced[k] += right[k]
            dynamics.set_given(later, s, v.given, v.load)
            if side == 0:
                dynamics.set_rate_and_gradients(Y, s, blocks, v.given, v.load, w, v.ahead, rate)
            else:
                dynamics.set_rate_and_gradients(Y, s, blocks, v.given, v.load, w, v.behind, rate)
        differences(v.ahead, gradients, v.behind, v.usual, 1.0 / reach, stages[i],
                    (moved.speed * advance, moved.second_speed * advance), v.sinking, s, blocks, w)
        if size > 2 * m:
            columns.one_by_one(i, step.h, G, s, blocks, gradients, reduced, forced, varies, v)
        else:
            columns.all_at_once(i, step.h, G, s, blocks, reduced, forced, varies, v)
    return _largest_error(room.right, v)


# By its address: runs without derivatives do not need it compiled.
propagate = compile_law(_PROPAGATE, "propagate(step, problem, progress, room, vary)", _propagate)


@helper
def keep(v):
    """Take the columns at the end of the step for those of the next."""
    for c in range(len(v.columns)):
        for k in range(v.columns.shape[1]):
            v.columns[c, k] = v.after[c, k]
    v.norms[0] = v.norms[1]


@helper
def write_columns(v, out):
    """Fill out (k, size) with the columns."""
    for c in range(len(v.columns)):
        for k in range(v.columns.shape[1]):
            out[c, k] = v.columns[c, k]


@helper
def begin_anew(v):
    """Let the columns be the unit matrix again."""
    v.columns[:] = 0.0
    v.norms[0], v.norms[1] = v.least, v.least
    for k in range(v.columns.shape[1]):
        v.columns[k, k] = 1.0
