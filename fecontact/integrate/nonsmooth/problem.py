"""Problem, workspace and names of columns that the kernels of set-valued contact share."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.compiled import helper
from fecontact.core.records import ANY, Size, Vector, allocate
from fecontact.core.types import Array, Integers
from fecontact.integrate import step_loop
from fecontact.integrate.step_loop import (
    CUT,
    MINIMUM_STEP,
    OUTPUTS,
    REJECTIONS,
    RUNNING,
    STEP,
    STEPS,
    TIME,
)
from fecontact.system.nodes import AXES, COMBINATIONS, MODES, NODES, SystemArrays
from fecontact.system.powers import DRIVE, POWER_COUNT, drive_jump

# Columns of `Evaluation.nodes`; the last two in space only.
NODE_COLUMNS, SPACE_NODE_COLUMNS = 9, 11
(FORCE, PRESSING, PENETRATION, RATE, SLIP, SLOPE, CURVED, LIMIT, GRIP, SLIP_ACROSS,
 SLOPE_ACROSS) = range(SPACE_NODE_COLUMNS)
# Columns along both tangents.
SLIP_OF, SLOPE_OF = (SLIP, SLIP_ACROSS), (SLOPE, SLOPE_ACROSS)

# Status of a cluster; a slipping one has the sign of its slip velocity, +1 or -1.
OPEN, STICK, FIXED = 0, 2, 3

# State of a closed stop, and of one that an event closes though no force presses it yet.
CLOSED, HELD = 1, 2

# Entries of Progress.numbers after those of the step loop: the error of the last step, whether the
# next one repeats one that failed, the length of that which an event cuts short, and a time from
# which the pace of the run is examined.
NUMBERS = 6
LAST_ERROR, REPEATED, UNCUT, MARK = range(STEP + 1, NUMBERS)
# Entries of Progress.counts after those of the step loop: changes of contact, impacts and those
# that gained energy; changes in a row without any time between them; whether the step ends at one,
# and whether that has just begun to move; how often a step was cut; whether what its begin has is
# known from the step before; steps at the time `MARK`.
COUNTS = step_loop.COUNTS + 8
EVENTS, IMPACTS, GAINED, IDLE, AT_EVENT, CUTS, KNOWN, MARKED = range(step_loop.COUNTS, COUNTS)
# A run is stuck that advances by less than this part of its span in so many steps.
_MANY_STEPS, _LEAST_PART = 20_000, 1e-8
# Entries of Progress.largest: slip velocity, penetration rate and penetration.
SIZES = 3
SLIP_SIZE, RATE_SIZE, DEPTH_SIZE = range(SIZES)

# Entries of what is given in time: the time, travel and speed of the ground, and from MOTION on
# the motion of the drive along each axis and its rate.
GIVEN = 7
WHEN, TRAVEL, SPEED, MOTION = range(4)

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


class ContactState(NamedTuple):
    """Status (k,) of the clusters, and whether stops are closed, (n,)."""

    status: Annotated[Integers, CLUSTERS]
    closed: Annotated[Integers, NODES]


class Limits(NamedTuple):
    """Step-size limits and error scales of a run.

    ``stops`` are ascending times at which a step ends; ``floor`` (size,) are values below which
    the error is not measured relative to the state; ``longest`` is the longest step.
    """

    stops: Vector
    floor: Annotated[Array, WITH_WORK]
    rtol: float
    longest: float


class Progress(NamedTuple):
    """Present state of a run.

    ``state`` is Y; ``status`` (k,) is that of the clusters, ``closed`` (n,) tells the closed
    stops; ``largest`` (3,) are the largest sizes so far, and ``carried`` (n,) the friction forces
    of implicit steps, in space (2 n,) along the first tangents and then along the second ones.
    """

    numbers: Annotated[Array, NUMBERS]
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
    """A step.

    Attributes
    ----------
    t, h : float
        Its begin and its length.
    latest : float
        The last time at which what is given in time counts: as before a break, at its end.
    target : float
        The time at its end.
    at_break : bool
        Whether it ends at a break.
    """

    t: float
    h: float
    latest: float
    target: float
    at_break: bool


@helper
def next_target(t, h, last, smallest, data):
    """A step of the length h at most, exactly that if it was cut, to the next break or the end."""
    limits, end = data.limits, data.output.times[-1]
    goal, is_break = end, False
    for k in range(len(limits.stops)):
        if t < limits.stops[k]:
            is_break = limits.stops[k] <= end
            goal = min(end, limits.stops[k])
            break
    length = min(h, limits.longest)
    near = 0.0 if last == CUT else 1e-10
    if length >= (goal - t) * (1.0 - near) or t + length >= goal:
        return Step(t, goal - t, np.nextafter(goal, t), goal, is_break)
    return Step(t, length, np.nextafter(goal, t), t + length, False)


@helper
def pace(step, progress, times):
    """Status of a run after a step: whether it advances fast enough ever to end."""
    numbers, counts = progress.numbers, progress.counts
    if counts[STEPS] + counts[REJECTIONS] - counts[MARKED] < _MANY_STEPS:
        return RUNNING
    stuck = counts[MARKED] > 0 and step.target - numbers[MARK] < _LEAST_PART * (
        times[-1] - times[0])
    numbers[MARK], counts[MARKED] = step.target, counts[STEPS] + counts[REJECTIONS]
    return MINIMUM_STEP if stuck else RUNNING


@helper
def pass_break(step, p, progress, output):
    """Add the work that the drive puts in where its motions jump, at the end of a step."""
    first = 2 * p.system.rows.shape[2]
    work = drive_jump(step.latest, step.target, progress.state, p.system)
    progress.state[first + DRIVE] += work
    last = progress.counts[OUTPUTS] - 1
    if last >= 0 and output.times[last] == step.target:
        output.states[last, first + DRIVE] += work


class Evaluation(NamedTuple):
    """Results per node and per cluster of the last evaluation, and workspace for small systems.

    ``given`` (GIVEN,) and ``loads`` (m,) are given in time, ``applied_forces`` (m,) with the drive.
    """

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
    given: Annotated[Array, GIVEN]
    loads: Annotated[Array, MODES]
    applied_forces: Annotated[Array, MODES]


def sizes_of(problem: NonsmoothProblem) -> dict[Size, int]:
    """Sizes of the records of a run."""
    n, d, m = problem.system.rows.shape
    return {MODES: m, NODES: n, CLUSTERS: len(problem.rows), AXES: d,
            COMBINATIONS: len(problem.system.polynomial_rows),
            NODE_ENTRIES: SPACE_NODE_COLUMNS if d > 2 else NODE_COLUMNS}


def progress_for(
    problem: NonsmoothProblem, rubbing: NDArray[np.bool_], state: Array, time: float, length: float
) -> Progress:
    """A run that is about to start; ``rubbing`` (k,) are the clusters that friction may stop."""
    made = allocate(Progress, sizes_of(problem), status=np.where(rubbing, OPEN, FIXED))
    made.numbers[TIME], made.numbers[STEP] = time, length
    made.state[:len(state)] = state
    return made
