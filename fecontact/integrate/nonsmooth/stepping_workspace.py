"""Workspace of implicit steps with set-valued friction."""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.records import allocate
from fecontact.core.types import Array
from fecontact.integrate.bernstein import DEPTH, fit
from fecontact.integrate.nonsmooth.problem import (
    NODE_ENTRIES,
    WITH_WORK,
    NonsmoothProblem,
    sizes_of,
)
from fecontact.integrate.nonsmooth.stage_newton import Hold, NewtonWorkspace
from fecontact.system.nodes import AXES, COMBINATIONS, MODES, NODES
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
    newton, hold : NewtonWorkspace, Hold
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


def workspace_for(problem: NonsmoothProblem) -> Workspace:
    """Workspace for a problem."""
    return allocate(Workspace, sizes_of(problem) | {
        COMBINATIONS: len(problem.system.polynomial_rows)})
