"""Runs from event to event of systems of one or two contact nodes that few modes move.

As in :mod:`fecontact.integrate.rodas5p.small_systems`, loops over one or two numbers are written
out for arrays of a known size.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from fecontact.core.constants import constants
from fecontact.core.records import shapes
from fecontact.integrate.nonsmooth import problem as kinds
from fecontact.integrate.nonsmooth.event_driven import run_events
from fecontact.integrate.nonsmooth.event_search import Room
from fecontact.integrate.rodas5p import small_systems
from fecontact.system.nodes import SystemArrays

# Modes and nodes.
SIZES = ((1, 1), (2, 1), (3, 1), (2, 2))


def run_for(problem: kinds.NonsmoothProblem) -> Any:
    """The run for a system of this size, or :func:`run_events` for all.

    Those of small systems are for nodes of which each has a slip velocity of its own.
    """
    nodes, _, modes = problem.system.rows.shape
    if ((modes, nodes) in SIZES and len(problem.rows) == nodes
            and problem.system.second_motion == 0):
        return _run(modes, nodes)
    return run_events


@cache
def _run(modes: int, nodes: int) -> Any:
    return run_events.for_values(constants(fixed_values(modes, nodes)))


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each type of tuples."""
    sizes = small_systems.sizes_of(modes, nodes) | {
        kinds.CLUSTERS: nodes, kinds.NODE_ENTRIES: kinds.NODE_COLUMNS}
    found = shapes(sizes, kinds.NonsmoothProblem, kinds.Limits, kinds.Progress, kinds.Output,
                   kinds.Workspace, Room)
    found[kinds.NonsmoothProblem]["cluster"] = np.arange(nodes)
    return found | {SystemArrays: small_systems.fixed_values(modes, nodes)[SystemArrays]}


def usual() -> list[Callable[[], object]]:
    """Functions that each compile the loop of one size."""
    return [partial(lambda size: _run(*size).ready(), size) for size in SIZES]
