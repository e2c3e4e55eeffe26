"""Sliders of contact nodes and poses of a body in equilibrium, as compiled functions see them."""

from typing import Annotated, NamedTuple

from fecontact.core.records import Matrix, Size
from fecontact.core.types import Array, Integers
from fecontact.system.nodes import AXES, MODES, NODES

# Columns of `Pose.node`; in space the last three follow for the second tangent.
FORCE, PRESSING, PENETRATION, PLACE, AGAINST, ALONG_SURFACE = range(6)
PER_TANGENT = 3

SLIDERS = Size("sliders")
NODE_COLUMNS = PLACE + PER_TANGENT * (AXES - 1)
FORCES = (AXES - 1) * SLIDERS


class Sliders(NamedTuple):
    """Sliders of the contact nodes, each array (n, e).

    ``stiffness`` is c, ``limit`` phi; ``rigid`` is 1 where c is only a penalty, else 0.
    """

    stiffness: Matrix
    limit: Matrix
    rigid: Matrix


class Pose(NamedTuple):
    """A body in equilibrium, or on the way to it.

    ``node`` has F, the force that friction sees, u, and per tangent g, the force against it and its
    part F y_R'; ``force`` and ``left`` are R and z of the sliders, in space both components of each
    one after the other.
    """

    q: Annotated[Array, MODES]
    node: Annotated[Array, NODES, NODE_COLUMNS]
    force: Annotated[Array, NODES, FORCES]
    left: Annotated[Array, NODES, FORCES]


class Workspace(NamedTuple):
    """Workspace of Newton's method; ``scale`` are typical stiffnesses of the modes.

    ``acting`` sums the magnitudes of the forces on each mode; ``flexibility`` are minus the forces
    on the nodes along their axes by the modes, ``partial`` the derivatives of T, F, T across and
    the pressing force of a node to its displacements and velocities, and ``total`` the forces of
    its sliders. ``state`` says of each slider whether its node is open (2), it sticks (0), or it
    slides (1, in the plane with the sign of its force); ``state_before`` holds another such set.
    """

    scale: Annotated[Array, MODES]
    start: Annotated[Array, MODES]
    acting: Annotated[Array, MODES]
    residual: Annotated[Array, MODES]
    step: Annotated[Array, MODES]
    before: Annotated[Array, MODES]
    base: Annotated[Array, MODES]
    multiplier: Annotated[Array, NODES, FORCES]
    state: Annotated[Array, NODES, SLIDERS]
    state_before: Annotated[Array, NODES, SLIDERS]
    flexibility: Annotated[Array, NODES, AXES, MODES]
    matrix: Annotated[Array, MODES, MODES]
    partial: Annotated[Array, AXES + 1, 2 * AXES]
    total: Annotated[Array, AXES - 1]
    pivots: Annotated[Integers, MODES]


def sizes_of(m: int, n: int, sliders: int, tangents: int) -> dict[Size, int]:
    """Sizes of the records of a body with m modes and n contact nodes."""
    return {MODES: m, NODES: n, SLIDERS: sliders, AXES: 1 + tangents}
