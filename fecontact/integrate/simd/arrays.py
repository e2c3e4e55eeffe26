"""Parameters, states and workspace of the integrator of eight runs side by side.

Each quantity of a run is a row (8,), with one entry for each lane. All rows of the parameters lie
in one table (rows, 8), those of the progress in another, so that a run is loaded as one column.
"""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from fecontact.core.records import (
    ANY,
    IntegerVector,
    Matrix,
    allocate,
)
from fecontact.core.simd.vectors import WIDTH
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p import tableau
from fecontact.system.nodes import MODES, NODES

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

    stiffness: Annotated[Array, MODES, MODES, WIDTH]
    damping: Annotated[Array, MODES, MODES, WIDTH]
    constant_load: Annotated[Array, MODES, WIDTH]
    drive_shapes: Annotated[Array, 2, MODES, WIDTH]
    drive_stiffness: Annotated[Array, 2, WIDTH]
    drive_damping: Annotated[Array, 2, WIDTH]
    load_shapes: Annotated[Array, ANY, MODES, WIDTH]
    rows: Annotated[Array, NODES, 2, MODES, WIDTH]
    gap: Annotated[Array, NODES, WIDTH]
    sliding: Annotated[Array, NODES, 1, 2, WIDTH]
    normal_parameters: Annotated[Array, NODES, ANY, WIDTH]
    friction_parameters: Annotated[Array, NODES, ANY, WIDTH]
    ground_motion_parameters: Annotated[Array, ANY, WIDTH]
    drive_parameters: Annotated[Array, 2, ANY, WIDTH]
    load_parameters: Annotated[Array, ANY, ANY, WIDTH]
    normal: Annotated[Integers, NODES]
    friction: Annotated[Integers, NODES]
    drive: Annotated[Integers, 2]
    load: IntegerVector
    ground_motion: int
    steady: int


class LaneControl(NamedTuple):
    """Step-size limits and error scales in each lane.

    See :class:`fecontact.integrate.rodas5p.state.Control`. ``numbers`` holds the relative
    tolerance, the longest step, the velocity below which errors count as if it were that large,
    and the largest acceleration of the ground.
    """

    displacement_scale: Annotated[Array, MODES, WIDTH]
    slip_scale: Annotated[Array, NODES, WIDTH]
    slow: Annotated[Array, NODES, WIDTH]
    depth: Annotated[Array, NODES, WIDTH]
    largest: Annotated[Array, MODES, WIDTH]
    levels: Annotated[Array, ANY, NODES, WIDTH]
    numbers: Annotated[Array, LIMITS, WIDTH]


class LaneProgress(NamedTuple):
    """Complete state of the runs in the lanes.

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

    numbers: Annotated[Array, NUMBERS, WIDTH]
    state: Annotated[Array, 2 * MODES, WIDTH]
    extremes: Annotated[Array, MODES, WIDTH]
    rate: Annotated[Array, 2 * MODES, WIDTH]
    forces: Annotated[Array, NODES, FORCES, WIDTH]
    places: Annotated[Array, 2 * NODES, WIDTH]
    speeds: Annotated[Array, 2 * NODES, WIDTH]
    ground: Annotated[Array, WIDTH]
    counts: Annotated[Integers, 2, WIDTH]
    runs: Annotated[Integers, WIDTH]
    rows: Annotated[Integers, WIDTH]
    fresh: Annotated[Integers, 1]


class LaneWorkspace(NamedTuple):
    """Workspace for one step of all lanes.

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

    stages: Annotated[Array, tableau.STAGES, 2 * MODES, WIDTH]
    by_place: Annotated[Array, MODES, MODES, WIDTH]
    by_speed: Annotated[Array, MODES, MODES, WIDTH]
    work: Annotated[Array, MODES, MODES, WIDTH]
    inverse: Annotated[Array, MODES, MODES, WIDTH]
    stiffness_inverse: Annotated[Array, MODES, MODES, WIDTH]
    stage: Annotated[Array, 2 * MODES, WIDTH]
    right: Annotated[Array, 2 * MODES, WIDTH]
    after: Annotated[Array, 2 * MODES, WIDTH]
    base: Annotated[Array, 2 * MODES, WIDTH]
    dense: Annotated[Array, 3, 2 * MODES, WIDTH]
    load: Annotated[Array, MODES, WIDTH]
    time_rate: Annotated[Array, MODES, WIDTH]
    places: Annotated[Array, 2 * NODES, WIDTH]
    speeds: Annotated[Array, 2 * NODES, WIDTH]
    forces: Annotated[Array, NODES, FORCES, WIDTH]
    inner: Annotated[Array, 2, 2 * NODES, WIDTH]
    inner_forces: Annotated[Array, NODES, FORCES, WIDTH]


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
    states: Annotated[Array, ANY, ANY, 2 * MODES]
    follows: IntegerVector
    ends: Annotated[Integers, ANY, 4]
    queue: IntegerVector
    counts: Annotated[Integers, 4]


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
    workspace: LaneWorkspace


def lanes_for(
    system_shapes: Sequence[tuple[int, ...]], control_shapes: Sequence[tuple[int, ...]],
    laws: Sequence[Any], modes: int, nodes: int,
) -> Lanes:
    """Empty lanes for systems whose parameters have these shapes."""
    sizes = {MODES: modes, NODES: nodes}
    shapes = [*system_shapes, *control_shapes]
    parameters = np.ones((_rows_of(shapes), WIDTH))
    start = np.zeros((_rows_of(_progress_shapes(modes)), WIDTH))
    views: list[Any] = list(_views(parameters, shapes))
    counted = len(system_shapes)
    numbers, state, extremes = _views(start, _progress_shapes(modes))
    progress = allocate(LaneProgress, sizes, numbers=numbers, state=state, extremes=extremes,
                        runs=np.full(WIDTH, -1, dtype=np.int64))
    return Lanes(parameters, start, LaneSystem(*views[:counted], *laws),
                 LaneControl(*views[counted:]), progress, allocate(LaneWorkspace, sizes))
