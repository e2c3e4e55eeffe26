"""What the integrator of eight runs side by side works on: parameters, states, room to work in.

Each quantity of a run is a row (8,), with one entry for each lane. All rows of the parameters lie
in one table (rows, 8), those of the progress in another, so that a run is loaded as one column.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.lanes.vectors import WIDTH
from fecontact.core.records import Block, IntegerMatrix, IntegerVector, Matrix, Vector
from fecontact.core.types import Array
from fecontact.integrate.rodas5p import tableau

# Rows of `LaneProgress.numbers`.
(TIME, STEP, END, SMALLEST, SPEED_SCALE, LAST_STEP, LAST_ROOT, REJECTED_LAST, CAUTIOUS, AGAIN,
 EXACTLY, NEXT_OUTPUT) = range(12)
NUMBERS = 12
# Rows of `LaneControl.numbers`.
RTOL, LONGEST, LEAST_SPEED, QUICKEST = range(4)
LIMITS = 4
# Columns of `LaneProgress.forces`: F, dF/du, dF/dv, dR/dv and dR/dF with the sign of F.
FORCE, BY_PLACE, BY_RATE, BY_SLIP, BY_FORCE = range(5)
FORCES = 5


class LaneSystem(NamedTuple):
    """Parameters of a system in each lane; names are those of the fields of ``SystemArrays``.

    Laws are the same in all lanes: ``normal``, ``friction``, ``drive``, ``load`` and
    ``ground_motion`` are addresses of their functions for lanes; ``steady`` says whether the speed
    of the ground is constant.
    """

    stiffness: Block
    damping: Block
    constant_load: Matrix
    drive_shapes: Block
    drive_stiffness: Matrix
    drive_damping: Matrix
    load_shapes: Block
    Tx: Block
    Ty: Block
    gap: Matrix
    sliding: Matrix
    normal_parameters: Block
    friction_parameters: Block
    ground_motion_parameters: Matrix
    drive_parameters: Block
    load_parameters: Block
    normal: IntegerVector
    friction: IntegerVector
    drive: IntegerVector
    load: IntegerVector
    ground_motion: int
    steady: int


class LaneControl(NamedTuple):
    """What limits the steps in each lane; see :class:`fecontact.integrate.rodas5p.state.Control`.

    ``numbers`` holds the relative tolerance, the longest step, the velocity below which errors
    count as if it were that large, and the largest acceleration of the ground.
    """

    displacement_scale: Matrix
    slip_scale: Matrix
    slow: Matrix
    depth: Matrix
    largest: Matrix
    levels: Block
    numbers: Matrix


class LaneProgress(NamedTuple):
    """All that the runs in the lanes need to go on.

    Attributes
    ----------
    numbers : (NUMBERS, 8) array
        See the names of its rows in this module.
    state, extremes : (2 m, 8), (m, 8) arrays
        y, and the largest modal displacements so far.
    rate : (2 m, 8) array
        y'.
    forces : (n, FORCES, 8) array
        Normal force of each node, and derivatives of its forces.
    places, speeds : (2 n, 8) arrays
        Displacements and velocities of the nodes: all x, all y.
    ground : (8,) array
        Speed of the ground.
    counts : (2, 8) integer array
        Steps, and those that failed.
    runs, rows : (8,) integer arrays
        Number of the run in each lane, -1 where there is none, and of its outputs so far.
    fresh : (1,) integer array
        Lanes, one bit each, whose rates and forces are not known yet.
    """

    numbers: Matrix
    state: Matrix
    extremes: Matrix
    rate: Matrix
    forces: Block
    places: Matrix
    speeds: Matrix
    ground: Vector
    counts: IntegerMatrix
    runs: IntegerVector
    rows: IntegerVector
    fresh: IntegerVector


class LaneRoom(NamedTuple):
    """Room for one step of all lanes.

    Attributes
    ----------
    stages : (8, 2 m, 8) array
    by_place, by_speed : (m, m, 8) arrays
        The derivatives Jq and Jv of the accelerations.
    work, inverse, answers : (m, m, 8) arrays
        The matrix of the stages, its inverse, and this times Jq.
    stage, right, after, base : (2 m, 8) arrays
    dense : (3, 2 m, 8) array
    load, time_rate : (m, 8) arrays
    places, speeds : (2 n, 8) arrays
        As in the progress, at a stage or at the end.
    forces : (n, FORCES, 8) array
        At a stage, of which only normal forces are known, or at the end.
    inner : (2, 2 n, 8) array
        Displacements and velocities of the nodes at a point within the step.
    inner_forces : (n, FORCES, 8) array
        Normal forces there.
    """

    stages: Block
    by_place: Block
    by_speed: Block
    work: Block
    inverse: Block
    answers: Block
    stage: Matrix
    right: Matrix
    after: Matrix
    base: Matrix
    dense: Block
    load: Matrix
    time_rate: Matrix
    places: Matrix
    speeds: Matrix
    forces: Block
    inner: Block
    inner_forces: Block


class LaneRuns(NamedTuple):
    """Runs to go through lanes, and what is known of them.

    Attributes
    ----------
    parameters, starts : (E, rows) arrays
        Columns of the tables of parameters and of progress for each run.
    times, states : (E, K), (E, K, 2 m) arrays
        Output times, and states there.
    follows : (E,) integer array
        Whether a run begins in its lane where the one before it has ended.
    ends : (E, 4) integer array
        Status of each run, outputs, steps and steps that failed.
    queue : (L,) integer array
        Numbers of runs that wait for a lane.
    counts : (4,) integer array
        How many of the queue have been taken, its length, and whether more may follow; attempts.
    """

    parameters: Matrix
    starts: Matrix
    times: Matrix
    states: Block
    follows: IntegerVector
    ends: IntegerMatrix
    queue: IntegerVector
    counts: IntegerVector


TAKEN, WAITING, OPEN, ATTEMPTS = range(4)
STATUS, OUTPUTS, STEPS, REJECTIONS = range(4)
def _views(table: Array, shapes: Sequence[tuple[int, ...]]) -> list[Array]:
    """Parts of a table (rows, 8), of given shapes without the lanes."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    return [part.reshape(*shape, WIDTH)
            for part, shape in zip(np.split(table, ends[:-1]), shapes, strict=True)]


def _rows_of(shapes: Sequence[tuple[int, ...]]) -> int:
    """Number of rows of a table with parts of these shapes."""
    return int(sum(np.prod(shape) for shape in shapes))


def _progress_shapes(modes: int) -> list[tuple[int, ...]]:
    """Shapes of what a run starts with: numbers, state, extremes."""
    return [(NUMBERS,), (2 * modes,), (modes,)]


class Lanes(NamedTuple):
    """Eight lanes of one worker: tables, and their parts by name."""

    parameters: Matrix
    start: Matrix
    system: LaneSystem
    control: LaneControl
    progress: LaneProgress
    room: LaneRoom


def lanes_for(
    system_shapes: Sequence[tuple[int, ...]], control_shapes: Sequence[tuple[int, ...]],
    laws: Sequence[Any], modes: int, nodes: int,
) -> Lanes:
    """Empty lanes for systems whose parameters have these shapes."""
    m, n = modes, nodes

    def zeros(*shape: int) -> NDArray[np.float64]:
        return np.zeros((*shape, WIDTH))

    shapes = [*system_shapes, *control_shapes]
    parameters = np.ones((_rows_of(shapes), WIDTH))
    start = zeros(_rows_of(_progress_shapes(m)))
    views: list[Any] = list(_views(parameters, shapes))
    counted = len(system_shapes)
    numbers, state, extremes = _views(start, _progress_shapes(m))
    progress = LaneProgress(
        numbers, state, extremes, zeros(2 * m), zeros(n, FORCES), zeros(2 * n), zeros(2 * n),
        zeros(), np.zeros((2, WIDTH), dtype=np.int64), np.full(WIDTH, -1, dtype=np.int64),
        np.zeros(WIDTH, dtype=np.int64), np.zeros(1, dtype=np.int64))
    square, state_room = zeros(5, m, m), zeros(4, 2 * m)
    room = LaneRoom(
        zeros(tableau.STAGES, 2 * m), square[0], square[1], square[2], square[3], square[4],
        state_room[0], state_room[1], state_room[2], state_room[3], zeros(3, 2 * m), zeros(m),
        zeros(m), zeros(2 * n), zeros(2 * n), zeros(n, FORCES), zeros(2, 2 * n), zeros(n, FORCES))
    return Lanes(parameters, start, LaneSystem(*views[:counted], *laws),
                 LaneControl(*views[counted:]), progress, room)
