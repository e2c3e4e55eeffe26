"""What the integrator of eight runs side by side works on: parameters, states, room to work in.

Each quantity of a run is a row (8,), with one entry for each lane. All rows of the parameters lie
in one table (rows, 8), those of the progress in another, so that a run is loaded as one column.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from fecontact.core.compiled import block, f8, i8, integers, matrix
from fecontact.core.lanes.vectors import WIDTH
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p import tableau

_block4 = types.Array(f8, 4, "C")

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

    stiffness: Array
    damping: Array
    constant_load: Array
    drive_shapes: Array
    drive_stiffness: Array
    drive_damping: Array
    load_shapes: Array
    Tx: Array
    Ty: Array
    gap: Array
    sliding: Array
    normal_parameters: Array
    friction_parameters: Array
    ground_motion_parameters: Array
    drive_parameters: Array
    load_parameters: Array
    normal: Integers
    friction: Integers
    drive: Integers
    load: Integers
    ground_motion: int
    steady: int


LANE_SYSTEM = types.NamedTuple(
    [block, block, matrix, block, matrix, matrix, block, block, block, matrix, matrix, block,
     block, matrix, block, block, *[integers] * 4, i8, i8], LaneSystem)


class LaneControl(NamedTuple):
    """What limits the steps in each lane; see :class:`fecontact.integrate.rodas5p.state.Control`.

    ``numbers`` holds the relative tolerance, the longest step, the velocity below which errors
    count as if it were that large, and the largest acceleration of the ground.
    """

    displacement_scale: Array
    slip_scale: Array
    slow: Array
    depth: Array
    largest: Array
    levels: Array
    numbers: Array


LANE_CONTROL = types.NamedTuple([matrix] * 5 + [block, matrix], LaneControl)


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

    numbers: Array
    state: Array
    extremes: Array
    rate: Array
    forces: Array
    places: Array
    speeds: Array
    ground: Array
    counts: Integers
    runs: Integers
    rows: Integers
    fresh: Integers


_table = types.Array(i8, 2, "C")
LANE_PROGRESS = types.NamedTuple(
    [matrix] * 4 + [block, matrix, matrix, types.Array(f8, 1, "C"), _table, integers, integers,
                    integers], LaneProgress)


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

    stages: Array
    by_place: Array
    by_speed: Array
    work: Array
    inverse: Array
    answers: Array
    stage: Array
    right: Array
    after: Array
    base: Array
    dense: Array
    load: Array
    time_rate: Array
    places: Array
    speeds: Array
    forces: Array
    inner: Array
    inner_forces: Array


LANE_ROOM = types.NamedTuple(
    [block] * 6 + [matrix] * 4 + [block] + [matrix] * 4 + [block] * 3, LaneRoom)


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

    parameters: Array
    starts: Array
    times: Array
    states: Array
    follows: Integers
    ends: Integers
    queue: Integers
    counts: Integers


TAKEN, WAITING, OPEN, ATTEMPTS = range(4)
STATUS, OUTPUTS, STEPS, REJECTIONS = range(4)
LANE_RUNS = types.NamedTuple(
    [matrix, matrix, matrix, block, integers, _table, integers, integers], LaneRuns)


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

    parameters: Array
    start: Array
    system: LaneSystem
    control: LaneControl
    progress: LaneProgress
    room: LaneRoom


LANES = types.NamedTuple(
    [matrix, matrix, LANE_SYSTEM, LANE_CONTROL, LANE_PROGRESS, LANE_ROOM], Lanes)


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
