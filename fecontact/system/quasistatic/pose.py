"""Sliders of contact nodes and poses of a body in equilibrium, as compiled functions see them."""

from typing import NamedTuple

import numpy as np
from numba import types

from fecontact.core.compiled import integers, matrix, vector
from fecontact.core.types import Array, Integers

# Columns of `Pose.node`; in space the last three follow for the second tangent.
FORCE, PRESSING, PENETRATION, PLACE, AGAINST, LEANING = range(6)
PER_TANGENT = 3


class Sliders(NamedTuple):
    """Sliders of the contact nodes, each array (n, e).

    ``stiffness`` is c, ``limit`` phi; ``rigid`` is 1 where c is only a penalty, else 0.
    """

    stiffness: Array
    limit: Array
    rigid: Array


SLIDERS = types.NamedUniTuple(matrix, 3, Sliders)


class Pose(NamedTuple):
    """A body in equilibrium, or on the way to it.

    ``q`` (m,); ``node`` (n, 6), in space (n, 9), with F, the force that friction sees, u, and per
    tangent g, the force against it and its part F y_R'; ``force`` and ``left`` (n, e) are R and z
    of the sliders, in space (n, 2 e), both components of each one after the other.
    """

    q: Array
    node: Array
    force: Array
    left: Array


POSE = types.NamedTuple([vector, matrix, matrix, matrix], Pose)


class Room(NamedTuple):
    """Room for Newton's method; ``scale`` (m,) are typical stiffnesses of the modes.

    ``acting`` (m,) sums the magnitudes of the forces on each mode.
    """

    scale: Array
    start: Array
    acting: Array
    residual: Array
    step: Array
    before: Array
    multiplier: Array
    along: Array
    away: Array
    across: Array
    matrix: Array
    partial: Array
    pivots: Integers


ROOM = types.NamedTuple(
    [vector] * 6 + [matrix] * 6 + [integers], Room)


def node_columns(tangents: int) -> int:
    """Number of columns of `Pose.node`."""
    return PLACE + PER_TANGENT * tangents


def pose_for(m: int, n: int, sliders: int, tangents: int) -> Pose:
    """An empty pose."""
    force, left = np.zeros((2, n, sliders * tangents))
    return Pose(np.zeros(m), np.zeros((n, node_columns(tangents))), force, left)


def room_for(m: int, n: int, sliders: int, tangents: int, scale: Array) -> Room:
    """Room for a body of m modes and n contact nodes."""
    start, acting, residual, step, before = np.zeros((5, m))
    return Room(np.ascontiguousarray(scale, dtype=float), start, acting, residual, step, before,
                np.zeros((n, sliders * tangents)), np.zeros((n, m)), np.zeros((n, m)),
                np.zeros((n if tangents == 2 else 0, m)), np.zeros((m, m)), np.zeros((4, 3)),
                np.zeros(m, np.int64))
