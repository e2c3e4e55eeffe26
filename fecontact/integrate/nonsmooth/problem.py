"""What the kernels of set-valued contact share: the problem, room to work in, names of columns."""

from typing import Any, NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import f8, i8, integers, matrix, vector
from fecontact.core.types import Array, Integers
from fecontact.system.kernels import SYSTEM

# Smoothing slope and slip velocity at which every smoothed sign is 1 to the last digit while the
# curve of the coefficient has not begun to change.
STEEP, CREEP = 1e36, 1e-18

# Columns of `Workspace.nodes`.
FORCE, PRESSING, PENETRATION, RATE, SLIP, GROUND_RATE, SLOPE, CURVED, LIMIT = range(9)
NODE_COLUMNS = 9

# Status of a cluster; a slipping one has the sign of its slip velocity, +1 or -1.
OPEN, STICK, FIXED = 0, 2, 3

EFFORTS = 8

# What a run returns: steps used up, end reached, step too short, numbers not finite.
GOING_ON, FINISHED, STUCK, DIVERGED = range(4)

# Entries of a run's ``counts``: what it has done, outputs written, whether it has begun.
STEPS, REJECTED, EVENTS, IMPACTS, OUTPUTS, STARTED = range(6)


class NonsmoothProblem(NamedTuple):
    """A system with set-valued friction, as the kernels see it.

    ``system`` has unsmoothed friction; ``static`` (n,) is the coefficient that limits stick, below
    zero for the law's own; ``cluster`` (n,) is the cluster of each node, ``rows`` (k, m) are those
    of the clusters; ``tick`` is the time over which the ground's speed is differentiated;
    ``restitution`` is below zero for compliant contact; ``relief`` (3,) are the lowest and the
    highest ground and its shortest wave, infinite where it is level; ``steady`` is zero if the
    speed of the ground changes; ``derivative`` is the address of
    :data:`fecontact.integrate.nonsmooth.equations.compiled_derivative`.
    """

    system: Any
    static: Array
    cluster: Integers
    rows: Array
    tick: float
    restitution: float
    relief: Array
    steady: int
    derivative: int


PROBLEM = types.NamedTuple([SYSTEM, vector, integers, matrix, f8, f8, vector, i8, i8],
                           NonsmoothProblem)


class Workspace(NamedTuple):
    """Results per node and per cluster of the last evaluation, and room for small systems."""

    nodes: Array
    friction: Array
    total: Array
    limit: Array
    pressing: Array
    slip: Array
    matrix: Array
    right: Array
    indices: Integers


WORKSPACE = types.NamedTuple([matrix, vector, vector, vector, vector, vector, matrix, vector,
                              integers], Workspace)


def workspace_for(problem: NonsmoothProblem) -> Workspace:
    """Room for a problem."""
    n, k = len(problem.cluster), len(problem.rows)
    size = max(n, k)
    return Workspace(np.zeros((n, NODE_COLUMNS)), np.zeros(n), np.zeros(k), np.zeros(k),
                     np.zeros(k), np.zeros(k), np.zeros((size, size)), np.zeros(size),
                     np.zeros(size, np.int64))
