"""Steps by collocation for systems of one or two nodes that few modes move.

As in :mod:`fecontact.integrate.rodas5p.small_systems`, loops over one or two numbers are written
out for arrays of a known size.
"""

from functools import cache
from typing import Any

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.references import constants
from fecontact.integrate.collocation.advance import ADVANCE, advance
from fecontact.integrate.collocation.room import COLLOCATION, collocation_for
from fecontact.integrate.rodas5p import small_systems
from fecontact.integrate.rodas5p.state import Problem


def advance_for(problem: Problem) -> Any:
    """The loop for a system of one of the sizes."""
    nodes, modes = problem.system.Tx.shape
    return _advance(modes, nodes)


@cache
def _advance(modes: int, nodes: int) -> Any:
    return kernel(ADVANCE, constants=constants(fixed_values(modes, nodes)), nogil=True)(advance)


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each type of tuples."""
    room = collocation_for(modes, nodes, 1.0)._asdict()
    return {**small_systems.fixed_values(modes, nodes), COLLOCATION: {
        name: value.shape for name, value in room.items() if isinstance(value, np.ndarray)}}


def compile_usual() -> None:
    """Compile the loops of all sizes."""
    for size in small_systems.SIZES:
        _advance(*size)
