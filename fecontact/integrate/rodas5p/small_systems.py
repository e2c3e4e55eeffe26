"""The step loop for systems of one or two contact nodes that few modes move.

Their steps take a microsecond, most of it to begin and end loops over one or two numbers. Each size
here has a step loop of its own, compiled for arrays of that size, in which loops are written out.
It gives the same numbers up to rounding. So do derivatives of steps, which are compiled for a size
when they are first asked for.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from fecontact.core.constants import constants
from fecontact.core.records import Size, shapes
from fecontact.integrate.rodas5p import dynamics, stage_solver, state
from fecontact.integrate.rodas5p.blocks import Blocks, one_block
from fecontact.integrate.rodas5p.method import advance
from fecontact.integrate.rodas5p.variational import (
    DIRECTIONS,
    Variation,
    Vary,
    propagate,
    propagate_in_parts,
)
from fecontact.system.nodes import AXES, MEMORY, MODES, NODES, SystemArrays

# Modes and nodes.
SIZES = tuple((modes, nodes) for modes in (1, 2, 3, 4) for nodes in (1, 2))
USUAL = ((1, 1), (2, 1), (3, 1), (1, 2), (2, 2))


def advance_for(problem: state.Problem, vary: Vary) -> Any:
    """The step loop of a system: that of its size, or that of all.

    Step loops of small systems are for plane ones of one block, with one motion of the ground,
    without internal variables and without derivatives.
    """
    if len(vary.variation.columns) or not _small(problem):
        return advance
    n, _, m = problem.system.rows.shape
    return _advance(m, n)


def propagate_for(problem: state.Problem) -> int:
    """Address of what carries derivatives over a step: that of the size of the system, or of all.

    For the same systems as the step loops, with any number of columns; other systems without
    internal variables go in parts of steps.
    """
    n, _, m = problem.system.rows.shape
    return _propagate((m, n) if _small(problem) else None, in_parts(problem))


def in_parts(problem: state.Problem) -> bool:
    """Whether derivatives go over a step in parts, which leaves the steps to the motion."""
    return not (_small(problem) or problem.system.memory.any())


def _small(problem: state.Problem) -> bool:
    return len(problem.blocks.coupled) == 1 and not_small(problem.system) is None


def not_small(system: SystemArrays) -> str | None:
    """Why there is no step loop of its size for a system, even of one block; or None."""
    n, _, m = system.rows.shape
    if system.rows.shape[1] > 2:
        return "bodies in space are not among them"
    if (m, n) not in SIZES:
        return f"{m} modes and {n} nodes are not among them"
    if system.memory.any():
        return "there is friction with memory"
    return "two motions are prescribed" if system.second_motion != 0 else None


@cache
def _advance(modes: int, nodes: int) -> Any:
    return advance.for_values(constants(fixed_values(modes, nodes)))


@cache
def _propagate(size: tuple[int, int] | None, parts: bool = False) -> int:
    """Address of what carries derivatives over a step, of modes and nodes of a size or of all."""
    known = "" if size is None else constants(values_of_derivatives(*size))
    return int((propagate_in_parts if parts else propagate).for_values(known).address)


def step_loops() -> list[Callable[[], object]]:
    """Functions that each compile the step loop of one size.

    They take a fraction of the time where the step loop of all systems has just been compiled.
    """
    return [partial(lambda size: _advance(*size).ready(), size) for size in SIZES]


def usual() -> list[Callable[[], object]]:
    """Functions that each compile the derivatives of steps of all systems or of a usual size."""
    return [*(partial(_propagate, size) for size in (None, *USUAL)),
            partial(_propagate, None, True)]


def sizes_of(modes: int, nodes: int) -> dict[Size, int]:
    """Sizes of the records of small systems: plane ones without internal variables."""
    return {MODES: modes, NODES: nodes, AXES: 2, MEMORY: 0,
            dynamics.FRICTION_ENTRIES: 3}


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each record."""
    found = shapes(sizes_of(modes, nodes), state.Problem, state.Progress, state.Room, state.Output)
    blocks = one_block(np.zeros((modes, 2 * nodes)), nodes)
    tables = {name: value for name, value in blocks._asdict().items() if name != "shapes"}
    found[Blocks] = {"shapes": blocks.shapes.shape, **tables}
    found[SystemArrays] |= {"memory": np.zeros(nodes, dtype=np.int64), "second_motion": 0}
    found[state.Control]["sliders"] = 0
    found[stage_solver.Reduced]["solver"] = (modes, 2 * modes)
    found[Variation] = {"columns": (0, None)}
    return found


def values_of_derivatives(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """As :func:`fixed_values` for derivatives of steps, of any number of columns."""
    sizes = sizes_of(modes, nodes) | {DIRECTIONS: 4}
    values = fixed_values(modes, nodes) | {Variation: shapes(sizes, Variation)[Variation]}
    # Of the nodes, and in the room for differences of all directions of each of them.
    gradients = {name: (None, *shape[1:]) for name, shape in values[dynamics.Gradients].items()}
    return {**values, dynamics.Gradients: gradients}

