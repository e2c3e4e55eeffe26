"""Room for implicit steps with set-valued friction, and what is called by its address in space."""

from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import f8, i8, matrix, vector
from fecontact.core.references import Reference
from fecontact.core.types import Array
from fecontact.integrate.bernstein import DEPTH, fit
from fecontact.integrate.nonsmooth.problem import (
    PROBLEM,
    STEP,
    WORKSPACE,
    NonsmoothProblem,
    node_columns,
    tangents,
)
from fecontact.integrate.nonsmooth.stage_newton import (
    HOLD,
    NEWTON_ROOM,
    Hold,
    NewtonRoom,
    newton_room_for,
)
from fecontact.system.nodes import GROUND_MOTION
from fecontact.system.powers import POWER_COUNT

STAGES = 3
# From values at the thirds of a step to the coefficients of a cubic.
THIRDS = fit(np.arange(4) / 3.0)


class InSpace(NamedTuple):
    """Addresses of what is different in space; see `nonsmooth.space_contact`."""

    observe: int
    powers: int
    slips_back: int
    linearise: int


IN_PLANE = InSpace(0, 0, 0, 0)
IN_SPACE = types.NamedUniTuple(i8, 4, InSpace)

OBSERVE = types.void(GROUND_MOTION, vector, Reference(PROBLEM), matrix)
POWERS = types.void(GROUND_MOTION, Reference(PROBLEM), matrix, vector, vector)


class Room(NamedTuple):
    """Room for implicit steps.

    Attributes
    ----------
    newton, hold : NewtonRoom, Hold
        Those of the stages.
    space : InSpace
        What is different in space.
    states, accelerations, forces, rates : (3, 2 m), (3, m), (3, n), (3, p + n) arrays
        Of the stages: Y, q'', friction forces, in space (3, 2 n), and powers.
    start, known : (m,) arrays
        Places and velocities that a stage adds to.
    new, before, after : (size,), (m + p + n,), (m + p + n,) arrays
        Y at the end of the step; accelerations and powers at both ends.
    old : (n, columns) array
        What `observe` says of the begin.
    sides : (n,) array, in space (2 n,)
        ``hold.side`` at the begin of the step.
    inertia : (n,) array
        Tx Tx^T of each node, or in space T2 T2^T if that is larger.
    cubic, speed, halves : (4,), (4,), (DEPTH, 5) arrays
        Polynomials over the step, and parts of it.
    """

    newton: NewtonRoom
    hold: Hold
    space: InSpace
    states: Array
    accelerations: Array
    forces: Array
    rates: Array
    start: Array
    known: Array
    new: Array
    before: Array
    after: Array
    old: Array
    sides: Array
    inertia: Array
    cubic: Array
    speed: Array
    halves: Array


ROOM = types.NamedTuple(
    [NEWTON_ROOM, HOLD, IN_SPACE] + [matrix] * 4 + [vector] * 5 + [matrix] + [vector] * 4
    + [matrix], Room)

SLIPS_BACK = f8(i8, STEP, Reference(PROBLEM), Reference(WORKSPACE), f8, Reference(ROOM))


def room_for(problem: NonsmoothProblem, space: InSpace = IN_PLANE) -> Room:
    """Room for a problem."""
    n, m = problem.system.Tx.shape
    size, k = m + POWER_COUNT + n, tangents(problem)
    start, known = np.zeros((2, m))
    before, after = np.zeros((2, size))
    return Room(newton_room_for(n, m, k),
                Hold(np.zeros(n), np.zeros(k * n), np.zeros(k * n), space.linearise), space,
                np.zeros((STAGES, 2 * m)), np.zeros((STAGES, m)), np.zeros((STAGES, k * n)),
                np.zeros((STAGES, size - m)), start, known, np.zeros(m + size), before, after,
                np.zeros((n, node_columns(problem))), np.zeros(k * n),
                np.zeros(n), np.zeros(4), np.zeros(4), np.zeros((DEPTH, 5)))
