"""The step loop for systems of one or two contact nodes that few modes move.

Their steps take a microsecond, most of it to begin and end loops over one or two numbers. Each size
here has a step loop of its own, compiled for arrays of that size, in which loops are written out.
It gives the same numbers up to rounding.
"""

from functools import cache
from typing import Any

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.references import constants
from fecontact.integrate.rodas5p import dynamics, stage_solver, state, step_loop
from fecontact.integrate.rodas5p.blocks import BLOCKS, one_block
from fecontact.integrate.rodas5p.variational import VARIATION, Vary
from fecontact.system.nodes import SYSTEM
from fecontact.system.powers import NODE_POWERS, POWER_COUNT

# Modes and nodes.
SIZES = tuple((modes, nodes) for modes in (1, 2, 3, 4) for nodes in (1, 2))


def advance_for(problem: state.Problem, vary: Vary) -> Any:
    """The step loop of a system: that of its size, or :func:`step_loop.advance`.

    Step loops of small systems are for plane ones of one block, with one motion of the ground,
    without internal variables and without derivatives.
    """
    s = problem.system
    n, m = s.Tx.shape
    if ((m, n) in SIZES and len(problem.blocks.coupled) == 1 and len(s.T2) == 0
            and s.second_motion == 0 and not s.memory.any() and not len(vary.variation.columns)):
        return _advance(m, n)
    return step_loop.advance


@cache
def _advance(modes: int, nodes: int) -> Any:
    return kernel(step_loop.ADVANCE, constants=constants(fixed_values(modes, nodes)), nogil=True)(
        step_loop.advance.py_func)


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each type of tuples."""
    m, n = modes, nodes
    progress = state.progress_for(np.zeros(2 * m), 0.0, 0.0, m, n, 2)
    blocks = one_block(np.zeros((m, 2 * n)), n)
    room = state.room_for(m, n, 0, 2, blocks)
    tables = {name: value for name, value in blocks._asdict().items() if name != "shapes"}
    return {
        SYSTEM: {
            **dict.fromkeys(("stiffness", "damping", "modal_damping"), (m, m)),
            **dict.fromkeys(("Tx", "Ty"), (n, m)), "T2": (0, m), "gap": (n,), "drive": (2,),
            "drive_shapes": (2, m), "load_shapes": (None, m), "constant_load": (m,),
            "memory": np.zeros(n, dtype=np.int64), "second_motion": 0},
        BLOCKS: {"shapes": blocks.shapes.shape, **tables},
        state.CONTROL: {"largest": (m,), "memory_scale": (0,), "levels": (None, n)},
        state.PROGRESS: _shapes(progress),
        state.ROOM: _shapes(room),
        stage_solver.REDUCED: _shapes(room.reduced),
        dynamics.GRADIENTS: _shapes(progress.gradients),
        state.OUTPUT: {"states": (None, 2 * m), "work": (None, POWER_COUNT + NODE_POWERS * n)},
        VARIATION: {"columns": (0, None)},
    }


def _shapes(arrays: Any) -> dict[str, Any]:
    return {name: value.shape for name, value in arrays._asdict().items()
            if isinstance(value, np.ndarray)}


# What they are compiled from is at hand while the step loop itself has just been compiled.
if step_loop.advance.stats.cache_misses:
    for size in SIZES:
        _advance(*size)
