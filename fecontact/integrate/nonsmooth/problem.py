"""What the kernels of set-valued contact share: the problem, room to work in, names of columns."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.compiled import helper
from fecontact.core.records import ANY, Size, Vector, allocate
from fecontact.core.types import Array, Integers
from fecontact.system.nodes import AXES, MODES, NODES, SystemArrays
from fecontact.system.powers import POWER_COUNT

# Smoothing slope and slip velocity at which every smoothed sign is 1 to the last digit while the
# curve of the coefficient has not begun to change.
STEEP, CREEP = 1e36, 1e-18

# Columns of `Workspace.nodes`; the last two in space only.
NODE_COLUMNS, SPACE_NODE_COLUMNS = 9, 11
(FORCE, PRESSING, PENETRATION, RATE, SLIP, SLOPE, CURVED, LIMIT, GRIP, SLIP_ACROSS,
 SLOPE_ACROSS) = range(SPACE_NODE_COLUMNS)

# Status of a cluster; a slipping one has the sign of its slip velocity, +1 or -1.
OPEN, STICK, FIXED = 0, 2, 3

# State of a closed stop, and of one that an event closes though no force presses it yet.
CLOSED, HELD = 1, 2

# What a run returns: steps used up, end reached, step too short, numbers not finite, no unique
# accelerations at rigid stops, no impulses of an impact, an event at which it is to end.
GOING_ON, FINISHED, STUCK, DIVERGED, PARADOX, UNSOLVED, STOPPED = range(7)

# Entries of Progress.clock: the time reached, the length of the next step, the error of the last
# one, and whether the next one repeats one that failed.
TIME, LENGTH, LAST_ERROR, REPEATED = range(4)
# Entries of Progress.counts: what the run has done, outputs written, whether it has begun, impacts
# that gained energy.
COUNTS = 7
STEPS, REJECTED, EVENTS, IMPACTS, OUTPUTS, STARTED, GAINED = range(COUNTS)
# Entries of Progress.largest: slip velocity, penetration rate and penetration.
SIZES = 3
SLIP_SIZE, RATE_SIZE, DEPTH_SIZE = range(SIZES)


# Groups of nodes that slip as one, and entries of a node; a state with the work after it.
CLUSTERS, NODE_ENTRIES = Size("clusters"), Size("entries of a node")
WITH_WORK = 2 * MODES + NODES + POWER_COUNT


class NonsmoothProblem(NamedTuple):
    """A system with set-valued friction, as the kernels see it.

    ``system`` has unsmoothed friction; ``static`` (n,) is the coefficient that limits stick, below
    zero for the law's own; ``cluster`` (n,) is the cluster of each node, ``rows`` (k, m) are those
    of the clusters and ``sliding`` (k,) their factors of the prescribed motion; ``tick`` is the
    time over which its speed is differentiated; ``rigid`` is not zero for rigid stops, with
    coefficients ``restitution`` (n,) of the nodes and ``tangential`` (k,) of the clusters along the
    ground; ``poisson`` is not zero where the former are ratios of impulses; ``relief`` (3,) are the
    lowest and the highest ground and its shortest wave, infinite where it is level; ``steady`` is
    zero if the prescribed speed changes; ``derivative`` and ``change`` are the addresses of
    :data:`fecontact.integrate.nonsmooth.equations.compiled_derivative` and
    :data:`fecontact.integrate.nonsmooth.rigid_stops.compiled_change`, which are 0 in space; the
    latter is 0 without rigid stops too.
    """

    system: SystemArrays
    static: Annotated[Array, NODES]
    cluster: Annotated[Integers, NODES]
    rows: Annotated[Array, CLUSTERS, MODES]
    sliding: Annotated[Array, CLUSTERS]
    tick: float
    rigid: int
    restitution: Annotated[Array, NODES]
    tangential: Annotated[Array, CLUSTERS]
    poisson: int
    relief: Annotated[Array, 3]
    steady: int
    derivative: int
    change: int


class Limits(NamedTuple):
    """What limits the steps of a run.

    ``stops`` are ascending times at which a step ends; ``floor`` (size,) are values below which
    the error is not measured relative to the state; ``longest`` is the longest step.
    """

    stops: Vector
    floor: Annotated[Array, WITH_WORK]
    rtol: float
    longest: float


class Progress(NamedTuple):
    """How far a run has come.

    ``state`` is Y; ``status`` (k,) is that of the clusters, ``closed`` (n,) tells the closed
    stops; ``largest`` (3,) are the largest sizes so far, and ``carried`` (n,) the friction forces
    of implicit steps, in space (2 n,) along the first tangents and then along the second ones.
    """

    clock: Annotated[Array, 4]
    counts: Annotated[Integers, COUNTS]
    state: Annotated[Array, WITH_WORK]
    status: Annotated[Integers, CLUSTERS]
    closed: Annotated[Integers, NODES]
    largest: Annotated[Array, SIZES]
    carried: Annotated[Array, NODES * (AXES - 1)]


class Output(NamedTuple):
    """Output times (N,), and states (N, size), friction and normal forces (N, n) there.

    In space friction (N, 2 n), as in `Progress`.
    """

    times: Vector
    states: Annotated[Array, ANY, WITH_WORK]
    friction: Annotated[Array, ANY, NODES * (AXES - 1)]
    normal: Annotated[Array, ANY, NODES]


class Step(NamedTuple):
    """A step: begin, length, and the last time at which what is given in time counts."""

    t: float
    h: float
    latest: float


@helper
def aimed(t, h, end, stop, limits):
    """The next stop or the end, length of a step to there, h at most, and whether it reaches."""
    goal = end if stop == len(limits.stops) else min(end, limits.stops[stop])
    length = min(h, limits.longest)
    reaches = length >= (goal - t) * (1.0 - 1e-10)
    return goal, goal - t if reaches else length, reaches


class Workspace(NamedTuple):
    """Results per node and per cluster of the last evaluation, and room for small systems."""

    nodes: Annotated[Array, NODES, NODE_ENTRIES]
    friction: Annotated[Array, NODES]
    total: Annotated[Array, CLUSTERS]
    limit: Annotated[Array, CLUSTERS]
    pressing: Annotated[Array, CLUSTERS]
    slip: Annotated[Array, CLUSTERS]
    matrix: Annotated[Array, NODES + CLUSTERS, NODES + CLUSTERS]
    right: Annotated[Array, NODES + CLUSTERS]
    indices: Annotated[Integers, NODES + CLUSTERS]
    pivots: Annotated[Integers, NODES + CLUSTERS]


def tangents(problem: NonsmoothProblem) -> int:
    """How many tangents a node has."""
    return 2 if problem.system.rows.shape[1] > 2 else 1


def node_columns(problem: NonsmoothProblem) -> int:
    """How many columns `Workspace.nodes` has."""
    return SPACE_NODE_COLUMNS if problem.system.rows.shape[1] > 2 else NODE_COLUMNS


def workspace_for(problem: NonsmoothProblem) -> Workspace:
    """Room for a problem."""
    return allocate(Workspace, sizes_of(problem))


def sizes_of(problem: NonsmoothProblem) -> dict[Size, int]:
    """Sizes of the records of a run."""
    k, m = problem.rows.shape
    return {MODES: m, NODES: len(problem.cluster), CLUSTERS: k, AXES: 1 + tangents(problem),
            NODE_ENTRIES: node_columns(problem)}


def progress_for(
    problem: NonsmoothProblem, rubbing: NDArray[np.bool_], state: Array, time: float, length: float
) -> Progress:
    """A run that is about to start; ``rubbing`` (k,) are the clusters that friction may stop."""
    made = allocate(Progress, sizes_of(problem), clock=np.array([time, length, 0.0, 0.0]),
                    status=np.where(rubbing, OPEN, FIXED))
    made.state[:len(state)] = state
    return made
