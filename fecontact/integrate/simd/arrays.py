"""Parameters, states and workspace of the integrator of eight runs side by side.

They are the records of one run with eight numbers in place of each. All numbers of the parameters
lie in one table (rows, 8), those that a run begins with in another, so that a run is loaded into a
lane as one column.
"""

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from fecontact.core.cache_lines import zeros_in_lines
from fecontact.core.records import (
    ANY,
    Eights,
    IntegerVector,
    Matrix,
    Vector,
    allocate,
    of_eight,
    reader,
)
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.types import Array, Integers
from fecontact.integrate.rodas5p.stage_solver import Reduced
from fecontact.integrate.rodas5p.state import NUMBERS, Problem, Progress, Workspace
from fecontact.integrate.rodas5p.variational import Vary
from fecontact.system.nodes import AXES, COMBINATIONS, MEMORY, MODES, NODES

if TYPE_CHECKING:
    EightProblem = Problem
    EightProgress = Progress
    EightWorkspace = Workspace
else:
    EightProblem = of_eight(Problem)
    EightProgress = of_eight(Progress)
    EightWorkspace = of_eight(Workspace)

# Rows of `Lanes.limits`: last time of the run, shortest step, time of its next output, outcome of
# the last attempt as the step loop names it, and for when ``workspace.given`` holds.
END, SMALLEST, NEXT_OUTPUT, OUTCOME, KNOWN = range(5)
LIMITS = 5
# Entries of `Runs.counts` and of a row of `Runs.ends`.
TAKEN, WAITING, OPEN, ATTEMPTS = range(4)
STATUS, OUTPUTS, STEPS, REJECTIONS = range(4)


class Lanes(NamedTuple):
    """Eight runs of one worker.

    Attributes
    ----------
    parameters, start : (rows, 8) arrays
        All numbers of ``problem``; those of ``limits``, and of ``progress`` its numbers, state and
        extremes.
    column : (rows,) array
        Parameters of the single run that checks of one lane are made with.
    problem, progress, workspace
        As of one run, with eight numbers in place of each.
    limits : (LIMITS, 8) array
        See the names of its rows in this module.
    counts : (2, 8) integer array
        Steps, and those that failed.
    runs, rows : (8,) integer arrays
        Number of the run in each lane, -1 where there is none, and of its outputs so far.
    fresh : (1,) integer array
        Lanes, one bit each, whose rates and forces are not known yet.
    """

    parameters: Matrix
    start: Matrix
    column: Vector
    problem: EightProblem
    progress: EightProgress
    workspace: EightWorkspace
    limits: Annotated[Eights, LIMITS]
    counts: Annotated[Integers, 2, WIDTH]
    runs: Annotated[Integers, WIDTH]
    rows: Annotated[Integers, WIDTH]
    fresh: Annotated[Integers, 1]


class Alone(NamedTuple):
    """A run alone, by which what is rare is looked at in single lanes.

    The parameters of ``problem`` lie in ``Lanes.column``; but its ``control.speed_scale`` is zero.
    Nothing varies by ``vary``.
    """

    problem: Problem
    progress: Progress
    workspace: Workspace
    vary: Vary


class Runs(NamedTuple):
    """Runs to go through lanes, and what is known of them.

    Attributes
    ----------
    parameters, starts : (E, rows) arrays
        Columns of the tables of parameters and of starts for each run.
    times, states : (E, K), (E, K, size) arrays
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
    states: Annotated[Array, ANY, ANY, ANY]
    follows: IntegerVector
    ends: Annotated[Integers, ANY, 4]
    queue: IntegerVector
    counts: Annotated[Integers, 4]


def column_of(record: Any) -> Array:
    """All numbers of a record, one after the other."""
    kind: Any = type(record)
    return np.concatenate([number.ravel() if isinstance(number, np.ndarray) else (number,)
                           for number in reader(kind, float, Array)(record)])


def seen_in(table: Array, record: Any) -> Any:
    """A record like another one whose numbers are in a table (rows,) or (rows, 8), in their order.

    Single numbers stay what they are in a table for one.
    """
    made, count = _seen_in(table, record, 0)
    assert count == len(table)
    return made


def _seen_in(table: Array, record: Any, first: int) -> tuple[Any, int]:
    items: list[Any] = []
    for value in record:
        if isinstance(value, tuple):
            value, first = _seen_in(table, value, first)
        elif isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype == float):
            last = first + np.size(value)
            if table.ndim > 1 or isinstance(value, np.ndarray):
                value = table[first:last].reshape(*np.shape(value), *table.shape[1:])
            first = last
        items.append(value)
    kind: Any = type(record)
    return (kind if table.ndim == 1 else of_eight(kind))(*items), first


def lanes_for(problem: Problem, eight: Problem, starts: int) -> Lanes:
    """Lanes that are free, of systems like that of a problem.

    ``eight`` is that problem with the integers of eight systems; ``starts`` the number of rows that
    a run begins with.
    """
    nodes, axes, modes = problem.system.rows.shape
    sizes = {MODES: modes, NODES: nodes, AXES: axes, COMBINATIONS: 0,
             MEMORY: len(problem.control.memory_scale) // nodes}
    column = column_of(problem)
    parameters, start = (zeros_in_lines((count, WIDTH)) for count in (len(column), starts))
    parameters[:] = column[:, np.newaxis]
    limits, numbers, state, extremes = np.split(
        start, np.cumsum([LIMITS, NUMBERS, starts - LIMITS - NUMBERS - modes]))
    made = seen_in(parameters, eight)
    progress = allocate(EightProgress, sizes, numbers=numbers, state=state, extremes=extremes)
    reduced = allocate(of_eight(Reduced), sizes, solver=zeros_in_lines((modes, 2 * modes, WIDTH)))
    workspace = allocate(EightWorkspace, sizes, near=made.blocks, reduced=reduced)
    return Lanes(parameters, start, column, made, progress, workspace, limits,
                 np.zeros((2, WIDTH), dtype=np.int64), np.full(WIDTH, -1, dtype=np.int64),
                 np.zeros(WIDTH, dtype=np.int64), np.zeros(1, dtype=np.int64))
