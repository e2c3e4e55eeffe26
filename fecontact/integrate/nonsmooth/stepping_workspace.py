"""Workspace of implicit steps with set-valued friction."""

from typing import NamedTuple

import numpy as np

from fecontact.core.records import Matrix, Vector
from fecontact.integrate.bernstein import DEPTH, fit
from fecontact.integrate.nonsmooth.problem import NonsmoothProblem, node_columns, tangents
from fecontact.integrate.nonsmooth.stage_newton import Hold, NewtonWorkspace, newton_workspace_for
from fecontact.system.powers import POWER_COUNT

STAGES = 3
# Entries of `Workspace.tries`: the largest floor of the slip velocities, attempts in a row whose
# error was too large, and attempts at short steps whose stages could not be solved.
TRIES = 3
SLOWEST, IN_A_ROW, UNSOLVED = range(TRIES)
# From values at the thirds of a step to the coefficients of a cubic.
THIRDS = fit(np.arange(4) / 3.0)


class Workspace(NamedTuple):
    """Workspace of implicit steps.

    Attributes
    ----------
    newton, hold : NewtonRoom, Hold
        Workspace and stick variables of the stages.
    states, accelerations, forces, rates : (3, 2 m), (3, m), (3, n), (3, p + n) arrays
        Of the stages: Y, q'', friction forces, in space (3, 2 n), and powers.
    start, known : (m,) arrays
        Places and velocities that a stage adds to.
    new, before, after : (size,), (m + p + n,), (m + p + n,) arrays
        Y at the end of the step; accelerations and powers at both ends.
    old : (n, columns) array
        Results of `observe` at the begin of the step.
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
    states: Matrix
    accelerations: Matrix
    forces: Matrix
    rates: Matrix
    start: Vector
    known: Vector
    new: Vector
    before: Vector
    after: Vector
    old: Matrix
    sides: Vector
    inertia: Vector
    tries: Vector
    cubic: Vector
    speed: Vector
    halves: Matrix


def workspace_for(problem: NonsmoothProblem) -> Workspace:
    """Workspace for a problem."""
    n, _, m = problem.system.rows.shape
    size, k = m + POWER_COUNT + n, tangents(problem)
    start, known = np.zeros((2, m))
    before, after = np.zeros((2, size))
    return Workspace(newton_workspace_for(n, m, k, len(problem.system.polynomial_rows)),
                     Hold(np.zeros(n), np.zeros(k * n), np.zeros(k * n)),
                     np.zeros((STAGES, 2 * m)), np.zeros((STAGES, m)), np.zeros((STAGES, k * n)),
                     np.zeros((STAGES, size - m)), start, known, np.zeros(m + size), before, after,
                     np.zeros((n, node_columns(problem))), np.zeros(k * n),
                     np.zeros(n), np.zeros(TRIES), np.zeros(4), np.zeros(4), np.zeros((DEPTH, 5)))
