"""Steps by collocation for systems of one or two nodes that few modes move.

As in :mod:`fecontact.integrate.rodas5p.small_systems`, loops over one or two numbers are written
out for arrays of a known size.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

from fecontact.core.constants import constants
from fecontact.core.records import shapes
from fecontact.integrate.collocation.columns import propagate
from fecontact.integrate.collocation.method import advance
from fecontact.integrate.collocation.room import Collocation
from fecontact.integrate.rodas5p import small_systems
from fecontact.integrate.rodas5p.state import Problem
from fecontact.integrate.rodas5p.variational import Variation


def advance_for(problem: Problem) -> Any:
    """The loop for a system of one of the sizes."""
    nodes, _, modes = problem.system.rows.shape
    return _advance(modes, nodes)


@cache
def _advance(modes: int, nodes: int) -> Any:
    return advance.for_values(constants(fixed_values(modes, nodes)))


def propagate_for(problem: Problem) -> int:
    """Address of what carries derivatives over a step, for a system of one of the sizes."""
    nodes, _, modes = problem.system.rows.shape
    return _propagate(modes, nodes)


@cache
def _propagate(modes: int, nodes: int) -> int:
    known = small_systems.values_of_derivatives(modes, nodes) | _of_room(modes, nodes)
    return int(propagate.for_values(constants(known)).address)


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each record."""
    values = small_systems.fixed_values(modes, nodes) | _of_room(modes, nodes)
    # Of any number of columns, or none.
    del values[Variation]
    return values


def _of_room(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    return shapes(small_systems.sizes_of(modes, nodes), Collocation)


def usual() -> list[Callable[[], object]]:
    """Functions that each compile the loop of a size, or derivatives of steps of a usual one."""
    return [*(partial(lambda size: _advance(*size).ready(), size) for size in small_systems.SIZES),
            *(partial(_propagate, *size) for size in small_systems.USUAL)]
