"""Steps by power series for systems of one or two nodes that few modes move.

As in :mod:`fecontact.integrate.rodas5p.small_systems`, loops over one or two numbers are written
out for arrays of a known size. Those over coefficients are not, so that they are vectorised.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

from fecontact.core.constants import constants
from fecontact.core.records import shapes
from fecontact.integrate.rodas5p import small_systems
from fecontact.integrate.rodas5p.state import Problem
from fecontact.integrate.series.branches import Series
from fecontact.integrate.series.method import advance

# Modes and nodes.
SIZES = ((1, 1), (2, 1), (3, 1), (2, 2))


def advance_for(problem: Problem) -> Any:
    """The loop for a system of this size, or for all."""
    nodes, _, modes = problem.system.rows.shape
    if (modes, nodes) in SIZES and problem.system.second_motion == 0:
        return _advance(modes, nodes)
    return advance


@cache
def _advance(modes: int, nodes: int) -> Any:
    return advance.for_values(constants(fixed_values(modes, nodes)))


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all systems of a size, for each type of tuples."""
    return small_systems.fixed_values(modes, nodes) | shapes(
        small_systems.sizes_of(modes, nodes), Series)


def usual() -> list[Callable[[], object]]:
    """Functions that each compile the loop of one size."""
    return [partial(lambda size: _advance(*size).ready(), size) for size in SIZES]
