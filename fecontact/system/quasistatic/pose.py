"""Sliders of contact nodes and poses of a body in equilibrium, as compiled functions see them."""

from typing import NamedTuple

import numpy as np

from fecontact.core.records import Block, IntegerVector, Matrix, Vector
from fecontact.core.types import Array

# Columns of `Pose.node`; in space the last three follow for the second tangent.
FORCE, PRESSING, PENETRATION, PLACE, AGAINST, ALONG_SURFACE = range(6)
PER_TANGENT = 3


class Sliders(NamedTuple):
    """Sliders of the contact nodes, each array (n, e).

    ``stiffness`` is c, ``limit`` phi; ``rigid`` is 1 where c is only a penalty, else 0.
    """

    stiffness: Matrix
    limit: Matrix
    rigid: Matrix


class Pose(NamedTuple):
    """A body in equilibrium, or on the way to it.

    ``q`` (m,); ``node`` (n, 6), in space (n, 9), with F, the force that friction sees, u, and per
    tangent g, the force against it and its part F y_R'; ``force`` and ``left`` (n, e) are R and z
    of the sliders, in space (n, 2 e), both components of each one after the other.
    """

    q: Vector
    node: Matrix
    force: Matrix
    left: Matrix


class Workspace(NamedTuple):
    """Workspace of Newton's method; ``scale`` (m,) are typical stiffnesses of the modes.

    ``acting`` (m,) sums the magnitudes of the forces on each mode; ``flexibility`` (n, d, m) are
    minus the forces on the nodes along their axes by the modes, ``partial`` (d + 1, 2 d) the
    derivatives of T, F, T across and the pressing force of a node to its displacements and
    velocities, and ``total`` (d - 1,) the forces of its sliders.
    """

    scale: Vector
    start: Vector
    acting: Vector
    residual: Vector
    step: Vector
    before: Vector
    multiplier: Matrix
    flexibility: Block
    matrix: Matrix
    partial: Matrix
    total: Vector
    pivots: IntegerVector


def node_columns(tangents: int) -> int:
    """Number of columns of `Pose.node`."""
    return PLACE + PER_TANGENT * tangents


def pose_for(m: int, n: int, sliders: int, tangents: int) -> Pose:
    """An empty pose."""
    force, left = np.zeros((2, n, sliders * tangents))
    return Pose(np.zeros(m), np.zeros((n, node_columns(tangents))), force, left)


def workspace_for(m: int, n: int, sliders: int, tangents: int, scale: Array) -> Workspace:
    """Workspace for a body of m modes and n contact nodes."""
    start, acting, residual, step, before = np.zeros((5, m))
    return Workspace(np.ascontiguousarray(scale, dtype=float), start, acting, residual, step,
                     before, np.zeros((n, sliders * tangents)), np.zeros((n, 1 + tangents, m)),
                     np.zeros((m, m)), np.zeros((2 + tangents, 2 * (1 + tangents))),
                     np.zeros(tangents), np.zeros(m, np.int64))
