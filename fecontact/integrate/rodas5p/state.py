"""Records of the compiled integrator: limits, state of a run, workspace."""

from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.records import ANY, allocate
from fecontact.core.types import Array, Integers
from fecontact.integrate import bernstein, step_loop, step_polynomials
from fecontact.integrate.rodas5p import dynamics as motion
from fecontact.integrate.rodas5p import moving_ground, stage_solver, tableau
from fecontact.integrate.rodas5p.blocks import Blocks, near_blocks
from fecontact.integrate.rodas5p.step_length import LAST_ROOT
from fecontact.integrate.step_loop import STEP, TIME
from fecontact.system.nodes import (
    AXES,
    COMBINATIONS,
    MEMORY,
    MODES,
    NODES,
    SIZE,
    GroundMotion,
    SystemArrays,
)
from fecontact.system.powers import NODE_POWERS, POWER_COUNT, WORKS

# Entries of Progress.numbers, after those of `step_length`. CAUTIOUS is the length of a step that
# failed, while what made it fail may still lie ahead, else zero. ENERGY is the largest energy or
# work so far; MISSED the number of attempts at a step that missed a force; WORST_NODE the number of
# the node at which the error is largest.
NUMBERS = 10
SPEED_SCALE, CAUTIOUS, ENERGY, MISSED, WORST_NODE = range(LAST_ROOT + 1, NUMBERS)
# Entry of Progress.counts after those of the step loop: switches at one time so far.
COUNTS = step_loop.COUNTS + 1
SWITCHES = step_loop.COUNTS


class Control(NamedTuple):
    """Step-size limits and error scales of a run.

    Attributes
    ----------
    displacement_scale : (m,) array
        Modal displacements below which errors count as if the displacement were this large.
    memory_scale : (n s,) array
        Scales of the internal variables.
    slip_scale, slow, stick_speed, depth : (n,) arrays
        Width of the smoothing of friction, slip velocity at which slip is about to become stick,
        slip velocity below which the loss in friction counts as creep, penetration at which the
        normal law changes its character.
    corner : (n,) array
        Penetration at which the slope of the normal force jumps while the node touches; inf if
        there is none.
    largest : (m,) array
        Largest motion of each mode at any point.
    untouched : (n,) array
        Penetration up to which a node has no force and need not be evaluated; -inf if there is
        none, or if the node has to be evaluated all the same.
    breaks : (k, 2) array
        Times at which steps end, ascending: the first and the last of those that agree within
        rounding.
    levels : (l, n) array
        Penetrations at which normal forces begin or end.
    ground : (5,) array
        Lowest and highest place of the ground, its steepest slope, its largest speed and
        acceleration, as :mod:`fecontact.integrate.step_polynomials` names them.
    rtol, slip_part, switch_part, longest, speed_scale, energy_scale : float
        Relative tolerance, part of the distance from stick to which slip velocities are resolved,
        part of the tolerance allowed where normal forces begin or end within a step, longest
        step [s], velocity and energy below which errors count as if they were this large.
    work : int
        Whether to integrate the powers.
    missed : int
        Address of :data:`fecontact.integrate.rodas5p.missed_contacts.first_missed`.
    near, many : int
        Addresses of :func:`fecontact.integrate.near_nodes.take_near` and
        :func:`fecontact.integrate.polynomial_bounds.modes_may_switch`; zero for few nodes.
    sliders : int
        Address of :data:`fecontact.integrate.rodas5p.sliders.attend`; zero without elastic Coulomb
        elements.
    slider_counts : (n,) array
        Number of these elements of each node.
    varying : int
        Whether the speed of the ground varies in time.
    """

    displacement_scale: Annotated[Array, MODES]
    memory_scale: Annotated[Array, NODES * MEMORY]
    slip_scale: Annotated[Array, NODES]
    slow: Annotated[Array, NODES]
    stick_speed: Annotated[Array, NODES]
    depth: Annotated[Array, NODES]
    corner: Annotated[Array, NODES]
    largest: Annotated[Array, MODES]
    untouched: Annotated[Array, NODES]
    breaks: Annotated[Array, ANY, 2]
    levels: Annotated[Array, ANY, NODES]
    ground: Annotated[Array, 5]
    rtol: float
    slip_part: float
    switch_part: float
    longest: float
    speed_scale: float
    energy_scale: float
    work: int
    missed: int
    near: int
    many: int
    sliders: int
    slider_counts: Annotated[Integers, NODES]
    varying: int


class Problem(NamedTuple):
    """Equations to integrate, and limits of the steps."""

    system: SystemArrays
    blocks: Blocks
    control: Control


class Step(NamedTuple):
    """A step that is tried.

    Attributes
    ----------
    t, h, target : float
        Its begin, its length, and the time at its end.
    latest : float
        The last time at which what is given in time counts: before ``target`` if that is a break.
    moved : GroundMotion
        Motion of the ground just after its begin.
    caution : float
        Length of the step before, which failed, if this one is cut to end at a kink of the
        forces; negative if it ends before that, as the time of the kink is in doubt or the kink
        itself was too far; else zero.
    at_break : bool
        Whether it ends at a break.
    """

    t: float
    h: float
    target: float
    latest: float
    moved: GroundMotion
    caution: float
    at_break: bool


class Progress(NamedTuple):
    """Complete state of a run, bit for bit; copies of the arrays are a checkpoint.

    Attributes
    ----------
    numbers, counts : arrays
        See the names of their entries in this module.
    state, rate : (size,) arrays
        y and y'.
    extremes : (m,) array
        Largest modal displacements so far.
    work, power : (p + 2 n,) arrays
        Work so far and powers: those of POWERS, p of them, then those of each node.
    gradients : Gradients
        Derivatives of the node forces.
    signs : (n,) array
        Signs of the normal forces: 1, 0 or -1.
    """

    numbers: Annotated[Array, NUMBERS]
    counts: Annotated[Integers, COUNTS]
    state: Annotated[Array, SIZE]
    rate: Annotated[Array, SIZE]
    extremes: Annotated[Array, MODES]
    work: Annotated[Array, WORKS]
    power: Annotated[Array, WORKS]
    gradients: motion.Gradients
    signs: Annotated[Array, NODES]


class Output(NamedTuple):
    """Times (N,), and states (N, size) and work (N, p + 2 n) there: outputs, or what is kept."""

    times: Annotated[Array, ANY]
    states: Annotated[Array, ANY, SIZE]
    work: Annotated[Array, ANY, WORKS]


class Workspace(NamedTuple):
    """Workspace of a run.

    ``near`` are the blocks of the nodes that may touch, ``clearance`` (n + 1,) how far all nodes
    are from that. Vectors of the size of the state: the ``stages``, coefficients of the ``dense``
    output, and what the names say; ``nodes`` and ``slots`` (3, d n) for all nodes and the near
    ones, ``given`` and ``load`` for what acts at the time of a stage, ``between`` (2, d n) for the
    nodes at a point within the step, ``power`` (4, p + 2 n) for a quadrature, ``creeps`` (n, 4)
    for where nodes creep in the step, as
    :func:`fecontact.integrate.rodas5p.error_control.set_creeps` fills it. ``ends`` to ``places``
    serve to look at a step's polynomials: the nodes at its ends, its coefficients, those of the
    nodes, and room for what they may do. ``sums`` (2, size, 8) are what stages add to those after
    them, ``ground`` is the motion of ground of varying speed in these.
    """

    near: Blocks
    clearance: Annotated[Array, NODES + 1]
    stages: Annotated[Array, tableau.STAGES, SIZE]
    dense: Annotated[Array, 3, SIZE]
    stage: Annotated[Array, SIZE]
    right: Annotated[Array, SIZE]
    base: Annotated[Array, SIZE]
    time_rate: Annotated[Array, SIZE]
    after: Annotated[Array, SIZE]
    rate_after: Annotated[Array, SIZE]
    nodes: Annotated[Array, 3, AXES * NODES]
    slots: Annotated[Array, 3, AXES * NODES]
    between: Annotated[Array, 2, AXES * NODES]
    given: Annotated[Array, motion.GIVEN]
    load: Annotated[Array, MODES]
    pull_rate: Annotated[Array, MODES]
    power: Annotated[Array, 4, WORKS]
    creeps: Annotated[Array, NODES, 4]
    reduced: stage_solver.Reduced
    scratch: motion.Gradients
    gradients_after: motion.Gradients
    ends: Annotated[Array, 3, AXES * NODES]
    inner: Annotated[Array, 3, SIZE]
    polynomials: Annotated[Array, step_polynomials.SEARCH + 1, (2 * AXES - 1) * NODES]
    bound: Annotated[Array, 3, step_polynomials.COEFFICIENTS]
    halves: Annotated[Array, bernstein.DEPTH, step_polynomials.COLUMNS]
    places: Annotated[Array, step_polynomials.MOST]
    sums: Annotated[Array, 2, SIZE, tableau.STAGES]
    ground: Annotated[Array, tableau.STAGES, moving_ground.WIDTH]


def workspace_for(
    modes: int, nodes: int, states: int, dimension: int, blocks: Blocks, combinations: int = 0,
) -> Workspace:
    """Workspace for a system of so many modes, contact nodes and internal variables per node.

    ``combinations`` is the number D of :mod:`fecontact.system.polynomial_forces`.
    """
    return allocate(
        Workspace, {MODES: modes, NODES: nodes, MEMORY: states, AXES: dimension,
                    COMBINATIONS: combinations},
        near=near_blocks(blocks),
        reduced=stage_solver.reduced_for(modes, nodes, states, dimension))


def output_for(
    times: Array, size: int, nodes: int, made: Callable[..., Array] = np.zeros
) -> Output:
    """Rows for so many times, to be filled; by ``np.empty`` their memory is not touched before."""
    return Output(times, made((len(times), size)),
                  made((len(times), POWER_COUNT + NODE_POWERS * nodes)))


def progress_for(
    state: Array, time: float, step: float, modes: int, nodes: int, dimension: int,
    combinations: int = 0,
) -> Progress:
    """A run that is about to start."""
    states = (len(state) - 2 * modes) // max(nodes, 1)
    made = allocate(Progress, {MODES: modes, NODES: nodes, MEMORY: states, AXES: dimension,
                               COMBINATIONS: combinations})
    made.state[:] = state
    made.numbers[TIME], made.numbers[STEP] = time, step
    return made
