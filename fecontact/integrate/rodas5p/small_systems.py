"""The step loop for systems of one or two contact nodes that few modes move.

Their steps take a microsecond, most of it to begin and end loops over one or two numbers. Each size
here has a step loop of its own, compiled for arrays of that size, in which loops are written out.
It gives the same numbers up to rounding. So do derivatives of steps, which are compiled for a size
when they are first asked for.
"""

from functools import cache
from typing import Any

import numpy as np

from fecontact.core.constants import constants
from fecontact.integrate.rodas5p import dynamics, stage_solver, state, step_loop
from fecontact.integrate.rodas5p.blocks import Blocks, one_block
from fecontact.integrate.rodas5p.variational import (
    Variation,
    Vary,
    propagate,
    propagate_in_parts,
    variation_for,
)
from fecontact.integrate.shared_nodes.team import Team
from fecontact.system.nodes import SystemArrays
from fecontact.system.powers import NODE_POWERS, POWER_COUNT

# Modes and nodes.
SIZES = tuple((modes, nodes) for modes in (1, 2, 3, 4) for nodes in (1, 2))
USUAL = ((1, 1), (2, 1), (3, 1), (1, 2), (2, 2))


def advance_for(problem: state.Problem, vary: Vary) -> Any:
    """The step loop of a system: that of its size, or :func:`step_loop.advance`.

    Step loops of small systems are for plane ones of one block, with one motion of the ground,
    without internal variables and without derivatives.
    """
    if len(vary.variation.columns) or not _small(problem):
        return step_loop.advance
    n, m = problem.system.Tx.shape
    return _advance(m, n)


def propagate_for(problem: state.Problem) -> int:
    """Address of what carries derivatives over a step: that of the size of the system, or of all.

    For the same systems as the step loops, with any number of columns; other systems without
    internal variables go in parts of steps.
    """
    n, m = problem.system.Tx.shape
    return _propagate((m, n) if _small(problem) else None, in_parts(problem))


def in_parts(problem: state.Problem) -> bool:
    """Whether derivatives go over a step in parts, which leaves the steps to the motion."""
    return not (_small(problem) or problem.system.memory.any())


def _small(problem: state.Problem) -> bool:
    return len(problem.blocks.coupled) == 1 and not_small(problem.system) is None


def not_small(system: SystemArrays) -> str | None:
    """Why there is no step loop of its size for a system, even of one block; or None."""
    n, m = system.Tx.shape
    if len(system.T2):
        return "bodies in space are not among them"
    if (m, n) not in SIZES:
        return f"{m} modes and {n} nodes are not among them"
    if system.memory.any():
        return "there is friction with memory"
    return "two motions are prescribed" if system.second_motion != 0 else None


@cache
def _advance(modes: int, nodes: int) -> Any:
    return step_loop.advance.for_values(constants(fixed_values(modes, nodes)))


@cache
def _propagate(size: tuple[int, int] | None, parts: bool = False) -> int:
    """Address of what carries derivatives over a step, of modes and nodes of a size or of all."""
    known = "" if size is None else constants(values_of_derivatives(*size))
    return int((propagate_in_parts if parts else propagate).for_values(known).address)


def compile_step_loops(last_first: bool = False) -> None:
    """Compile the step loops of all sizes.

    This takes a fraction of the time while the step loop itself has just been compiled in this
    process. Two processes in opposite order share the work.
    """
    for size in reversed(SIZES) if last_first else SIZES:
        _advance(*size)


def compile_usual() -> None:
    """Compile the derivatives of steps of all systems, and of those of the usual sizes."""
    for size in (None, *USUAL):
        _propagate(size)
    _propagate(None, True)


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each type of tuples."""
    m, n = modes, nodes
    progress = state.progress_for(np.zeros(2 * m), 0.0, 0.0, m, n, 2)
    blocks = one_block(np.zeros((m, 2 * n)), n)
    room = state.room_for(m, n, 0, 2, blocks)
    tables = {name: value for name, value in blocks._asdict().items() if name != "shapes"}
    return {
        SystemArrays: {
            **dict.fromkeys(("stiffness", "damping", "modal_damping"), (m, m)),
            **dict.fromkeys(("Tx", "Ty"), (n, m)), "T2": (0, m), "gap": (n,), "drive": (2,),
            "drive_shapes": (2, m), "load_shapes": (None, m), "constant_load": (m,),
            "memory": np.zeros(n, dtype=np.int64), "second_motion": 0},
        Blocks: {"shapes": blocks.shapes.shape, **tables},
        state.Control: {"largest": (m,), "memory_scale": (0,), "breaks": (None, 2),
                        "levels": (None, n), "sliders": 0},
        state.Progress: _shapes(progress),
        state.Room: _shapes(room),
        Team: {**_shapes(room.team), "most": 0},
        stage_solver.Reduced: _shapes(room.reduced),
        dynamics.Gradients: _shapes(progress.gradients),
        state.Output: {"states": (None, 2 * m), "work": (None, POWER_COUNT + NODE_POWERS * n)},
        Variation: {"columns": (0, None)},
    }


def values_of_derivatives(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """As :func:`fixed_values` for derivatives of steps, of any number of columns."""
    room = _shapes(variation_for(2 * modes, modes, nodes, 0, 2, 0.0, 1.0, 1.0))
    for name in ("columns", "after", "stages", "moved", "pushed", "right"):
        room[name] = (None, *room[name][1:])
    room["norms"], room["least"] = (2, None), (None,)
    values = fixed_values(modes, nodes)
    # Of the nodes, and in the room for differences of all directions of each of them.
    gradients = {name: (None, *shape[1:]) for name, shape in values[dynamics.Gradients].items()}
    return {**values, Variation: room, dynamics.Gradients: gradients}


def _shapes(arrays: Any) -> dict[str, Any]:
    return {name: value.shape for name, value in arrays._asdict().items()
            if isinstance(value, np.ndarray)}
