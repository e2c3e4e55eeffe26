"""Arrays of compiled harmonic balance: equations, room for the work, what steps reach."""

from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import block, f8, i8, matrix, vector
from fecontact.core.types import Array, Integers
from fecontact.system.nodes import SYSTEM, SystemArrays


class Room(NamedTuple):
    """Room for the work at one orbit; n unknown coefficients of m modes, N samples, d states.

    ``a`` (n + 1, n + 1) holds the factors, ``along`` (n + 1,) the solution of the equations without
    right side that has one in the last row.
    """

    t: Array
    x: Array
    y: Array
    z: Array
    target: Array
    f: Array
    J: Array
    J_marched: Array
    coefficients: Array
    rows: Array
    spectra: Array
    square: Array
    followed: Array
    forces: Array
    slopes: Array
    condensed: Array
    a: Array
    pivots: Integers
    residual: Array
    beside: Array
    along: Array
    vectors: Array


class Equations(NamedTuple):
    """Equations of orbits over one parameter p, and how a branch is followed.

    Arrays of ``system`` that depend on p lie in ``flat`` = ``base`` + p ``slope``. ``springs``
    (c, m) and ``offsets`` (c,) give the deflections to which internal variables return. Numbers are
    the period times p or 0, the period, least and largest p for which this holds, bounds of the
    branch, tolerance, largest step, largest turn, Newton's rounding. ``limits`` (m,) bound the
    scales of the displacements; ``nodes`` have internal variables.
    """

    system: SystemArrays
    flat: Array
    base: Array
    slope: Array
    tau: Array
    values: Array
    projection: Array
    cosines: Array
    sines: Array
    springs: Array
    offsets: Array
    limits: Array
    numbers: Array
    nodes: int
    room: Room


(TURN, PERIOD, LOW, HIGH, FIRST_BOUND, LAST_BOUND, TOLERANCE, LARGEST_STEP, LARGEST_TURN,
 ROUNDING) = range(10)

_blocks = types.Array(f8, 4, "C")
_pivots = types.Array(i8, 1, "C")
ROOM = types.NamedTuple(
    [vector, matrix, matrix, matrix, matrix, matrix, block, block, block, matrix, block, _blocks,
     block, block, _blocks, matrix, matrix, _pivots, vector, vector, vector, matrix], Room)
EQUATIONS = types.NamedTuple(
    [SYSTEM, *[vector] * 4, *[matrix] * 5, *[vector] * 3, i8, ROOM], Equations)


class Reached(NamedTuple):
    """Points that were reached, K at most.

    u, tangent (K, n + 1), internal variables z (K, N, c), accelerations (K, N, m), mean derivatives
    of these (K, m, 2 m) to q and q', scales (K, m + 1) for the step behind, and ``step`` (1,).
    """

    u: Array
    tangent: Array
    z: Array
    forces: Array
    mean: Array
    scales: Array
    step: Array


REACHED = types.NamedTuple([matrix, matrix, block, block, block, matrix, vector], Reached)


def room_for(harmonics: int, samples: int, modes: int, memory: int, nodes: int) -> Room:
    """Room for a system of so many modes and internal variables, on so many nodes."""
    L, N, m, c = 2 * harmonics + 1, samples, modes, memory
    n, d = L * m, 2 * m + c
    s = c // nodes if nodes else 0
    return Room(
        np.empty(N), np.empty((N, d)), np.empty((N, d)), np.empty((N, c)), np.empty((N, c)),
        np.empty((N, d)), np.empty((N, d, d)), np.empty((N if c else 0, d, d)),
        np.empty((2, m, L)), np.empty((2 * m * m, N)), np.empty((4, L, m * m)),
        np.empty((L, m, L, m)), np.empty((N if c else 0, c, n + 1)),
        np.empty((N if c else 0, m, n + 1)), np.empty((N, nodes, s, s)), np.empty((n, n + 1)),
        np.empty((n + 1, n + 1)), np.empty(n + 1, dtype=np.int64), np.empty(n),
        np.empty(n), np.empty(n + 1), np.empty((6, n + 1)))
