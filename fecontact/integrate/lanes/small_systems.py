"""The step loop of lanes for each usual size of small systems, whose loops are written out."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

from fecontact.core.compiled import kernel
from fecontact.core.constants import constants
from fecontact.core.records import shapes
from fecontact.integrate.lanes import arrays, step_loop
from fecontact.integrate.rodas5p import small_systems

# Modes and nodes of systems that go through lanes; installations compile the step loop for each.
USUAL = ((1, 1), (2, 1), (3, 1), (2, 2))


def usual() -> list[Callable[[], object]]:
    """Functions that each compile the step loop of a usual size, or find it stored."""
    return [partial(lambda size: advance_for(*size).ready(), size) for size in USUAL]


@cache
def advance_for(modes: int, nodes: int) -> Any:
    """The step loop for so many modes and nodes."""
    given = constants(fixed_values(modes, nodes))
    return kernel(step_loop.advance, constants=given, nogil=True)


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all lanes for systems of a size, for each record.

    The arrays of the run that checks of single lanes are made with are among them.
    """
    return small_systems.fixed_values(modes, nodes) | shapes(
        small_systems.sizes_of(modes, nodes), arrays.LaneSystem, arrays.LaneControl,
        arrays.LaneProgress, arrays.LaneRoom, arrays.LaneRuns)
