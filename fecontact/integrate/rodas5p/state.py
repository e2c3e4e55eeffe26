"""What the compiled integrator works on: limits, the state of a run, room to work in."""

from typing import NamedTuple

import numpy as np

from fecontact.core.records import Block, IntegerVector, Matrix, Vector
from fecontact.core.types import Array
from fecontact.integrate import bernstein, courses
from fecontact.integrate.rodas5p import dynamics as motion
from fecontact.integrate.rodas5p import stage_solver, tableau
from fecontact.integrate.rodas5p.blocks import Blocks, near_blocks
from fecontact.integrate.rodas5p.step_length import LAST_ROOT, STEP, TIME
from fecontact.integrate.shared_nodes.team import ALONE, Team
from fecontact.system.nodes import (
    CONTACT_FIELDS,
    TOLD,
    GroundMotion,
    SystemArrays,
)
from fecontact.system.powers import NODE_POWERS, POWER_COUNT

# Entries of Progress.numbers, after those of `step_length`. CAUTIOUS is the length of a step that
# failed, while what made it fail may still lie ahead, else zero. ENERGY is the largest energy or
# work so far.
NUMBERS = 8
SPEED_SCALE, CAUTIOUS, ENERGY = range(LAST_ROOT + 1, NUMBERS)
# Entries of Progress.counts.
COUNTS = 6
STARTED, OUTPUTS, STEPS, REJECTIONS, RATES, WORST_NODE = range(COUNTS)


class Control(NamedTuple):
    """What limits the steps.

    Attributes
    ----------
    displacement_scale : (m,) array
        Modal displacements below which errors count as if the displacement were this large.
    memory_scale : (n s,) array
        Scales of the internal variables.
    slip_scale, slow, stick_speed, depth : (n,) arrays
        Width of the smoothing of friction, slip velocity at which slip is about to become stick,
        that below which what friction loses is creep, penetration at which the normal law changes
        its character.
    largest : (m,) array
        Largest motion of each mode at any point.
    untouched : (n,) array
        Penetration up to which a node has no force, so that it need not be looked at; -inf if
        there is none, or if it has to be looked at all the same.
    breaks : (k, 2) array
        Times to step on to, ascending: the first and the last of those that are one but for
        rounding.
    levels : (l, n) array
        Penetrations at which normal forces begin or end.
    ground : (5,) array
        Lowest and highest place of the ground, its steepest slope, its largest speed and
        acceleration, as :mod:`fecontact.integrate.courses` names them.
    rtol, slip_part, switch_part, longest, speed_scale, energy_scale : float
        Relative tolerance, part of the distance from stick to which slip velocities are resolved,
        part of the tolerance allowed where normal forces begin or end within a step, longest
        step [s], velocity and energy below which errors count as if they were this large.
    work : int
        Whether to integrate the powers.
    unfelt : int
        Address of :data:`fecontact.integrate.rodas5p.unfelt.first_unfelt`.
    sliders : int
        Address of :data:`fecontact.integrate.rodas5p.sliders.attend`; zero without elastic Coulomb
        elements.
    slider_counts : (n,) array
        Number of these elements of each node.
    """

    displacement_scale: Vector
    memory_scale: Vector
    slip_scale: Vector
    slow: Vector
    stick_speed: Vector
    depth: Vector
    largest: Vector
    untouched: Vector
    breaks: Matrix
    levels: Matrix
    ground: Vector
    rtol: float
    slip_part: float
    switch_part: float
    longest: float
    speed_scale: float
    energy_scale: float
    work: int
    unfelt: int
    sliders: int
    slider_counts: IntegerVector


class Problem(NamedTuple):
    """What is integrated, and how finely."""

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
        forces; else zero.
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
    """All that a run needs to go on, bit for bit; copies of the arrays are a checkpoint.

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
    signs : (n,) integer array
        Signs of the normal forces: 1, 0 or -1.
    """

    numbers: Vector
    counts: IntegerVector
    state: Vector
    rate: Vector
    extremes: Vector
    work: Vector
    power: Vector
    gradients: motion.Gradients
    signs: IntegerVector


class Output(NamedTuple):
    """Output times (N,), and states (N, size) and work (N, p + 2 n) there."""

    times: Vector
    states: Matrix
    work: Matrix


class Room(NamedTuple):
    """Room to work in.

    ``near`` are the blocks of the nodes that may touch, ``clearance`` (n + 1,) how far all nodes
    are from that. Vectors of the size of the state: the ``stages``, coefficients of the ``dense``
    output, and what the names say; ``nodes`` and ``slots`` (3, d n) for all nodes and the near
    ones, ``given`` and ``load`` for what acts at the time of a stage, ``between`` (2, d n) for the
    nodes at a point within the step, ``power`` (4, p + 2 n) for a quadrature, ``creeps`` (n, 4)
    for where nodes creep in the step, as
    :func:`fecontact.integrate.rodas5p.error_control.set_creeps` fills it. ``ends`` to ``places``
    serve to look at the course of a step: the nodes at its ends, its coefficients, those of the
    nodes, and room for what they may do. ``sums`` (2, size, 8) are what stages add to those after
    them. ``team`` is for systems of many nodes, which threads may share.
    """

    near: Blocks
    clearance: Vector
    stages: Matrix
    dense: Matrix
    stage: Vector
    right: Vector
    base: Vector
    time_rate: Vector
    after: Vector
    rate_after: Vector
    nodes: Matrix
    slots: Matrix
    between: Matrix
    given: Vector
    load: Vector
    pull_rate: Vector
    power: Matrix
    creeps: Matrix
    reduced: stage_solver.Reduced
    scratch: motion.Gradients
    gradients_after: motion.Gradients
    ends: Matrix
    inner: Matrix
    courses: Matrix
    bound: Matrix
    halves: Matrix
    places: Vector
    sums: Block
    team: Team


def gradients_for(
    nodes: int, states: int, dimension: int, *, told: int = TOLD
) -> motion.Gradients:
    """Zeros for so many contact nodes with so many internal variables each.

    ``told`` is the length of what is told of a node in space; without derivatives they are not
    computed.
    """
    length, width = (2 * (4 + states) + told, 4 + states) if dimension == 3 else (
        3 + states, 3 + states)
    return motion.Gradients(np.zeros((nodes, 1 + dimension, 2 * dimension)),
                            np.zeros((nodes, length)), np.zeros((nodes, states, width)))


def room_for(
    modes: int, nodes: int, states: int, dimension: int, blocks: Blocks, team: Team = ALONE,
) -> Room:
    """Room for a system of so many modes, contact nodes and internal variables per node."""
    columns = dimension * nodes
    size = 2 * modes + nodes * states
    stage, right, base, time_rate, after, rate_after = np.zeros((6, size))
    return Room(
        near_blocks(blocks), np.zeros(nodes + 1),
        np.zeros((tableau.STAGES, size)), np.zeros((3, size)),
        stage, right, base, time_rate, after, rate_after,
        np.zeros((3, columns)), np.zeros((3, columns)), np.zeros((2, columns)),
        np.zeros(motion.GIVEN),
        np.zeros(modes), np.zeros(modes),
        np.zeros((4, POWER_COUNT + NODE_POWERS * nodes)), np.zeros((nodes, 4)),
        stage_solver.reduced_for(modes, nodes, states, dimension),
        gradients_for(nodes, states, dimension, told=CONTACT_FIELDS + 1),
        gradients_for(nodes, states, dimension),
        np.zeros((3, columns)), np.zeros((3, size)),
        np.zeros((courses.DOUBT + 1, (2 * dimension - 1) * nodes)),
        np.zeros((3, courses.COEFFICIENTS)),
        np.zeros((bernstein.DEPTH, courses.COEFFICIENTS + 1)), np.zeros(courses.MOST),
        np.zeros((2, size, tableau.STAGES)), team)


def progress_for(
    state: Array, time: float, step: float, modes: int, nodes: int, dimension: int
) -> Progress:
    """A run that is about to start."""
    numbers = np.zeros(NUMBERS)
    numbers[TIME], numbers[STEP] = time, step
    size, powers = len(state), POWER_COUNT + NODE_POWERS * nodes
    return Progress(
        numbers, np.zeros(COUNTS, dtype=np.int64), np.array(state, dtype=float), np.zeros(size),
        np.zeros(modes), np.zeros(powers), np.zeros(powers),
        gradients_for(nodes, (size - 2 * modes) // max(nodes, 1), dimension),
        np.zeros(nodes, dtype=np.int64))
