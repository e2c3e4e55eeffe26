"""Runs from event to event of systems of one or two contact nodes that few modes move.

As in :mod:`fecontact.integrate.rodas5p.small_systems`, loops over one or two numbers are written
out for arrays of a known size.
"""

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from fecontact.core.constants import constants
from fecontact.integrate.nonsmooth import problem as kinds
from fecontact.integrate.nonsmooth.event_driven import run_events
from fecontact.integrate.nonsmooth.event_search import Room, room_for
from fecontact.integrate.rodas5p import small_systems
from fecontact.system.nodes import SystemArrays
from fecontact.system.powers import POWER_COUNT

# Modes and nodes.
SIZES = ((1, 1), (2, 1), (3, 1), (2, 2))


def run_for(problem: kinds.NonsmoothProblem) -> Any:
    """The run for a system of this size, or :func:`run_events` for all.

    Those of small systems are for nodes of which each has a slip velocity of its own.
    """
    nodes, modes = problem.system.Tx.shape
    if ((modes, nodes) in SIZES and len(problem.rows) == nodes
            and problem.system.second_motion == 0):
        return _run(modes, nodes)
    return run_events


@cache
def _run(modes: int, nodes: int) -> Any:
    return run_events.for_values(constants(fixed_values(modes, nodes)))


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all small systems of a size, for each type of tuples."""
    m, n = modes, nodes
    own, size = np.arange(n), 2 * m + POWER_COUNT + n
    system = small_systems.fixed_values(m, n)[SystemArrays]
    problem: dict[str, Any] = {"static": (n,), "cluster": own, "rows": (n, m), "sliding": (n,),
                               "restitution": (n,), "tangential": (n,), "relief": (3,)}
    plain = kinds.NonsmoothProblem(
        SimpleNamespace(T2=()), np.zeros(n), own, np.zeros((n, m)), np.zeros(n), 0.0, 0,
        np.zeros(n), np.zeros(n), 0, np.zeros(3), 0, 0, 0)
    progress = kinds.progress_for(plain, own >= 0, np.zeros(2 * m), 0.0, 0.0)
    return {
        SystemArrays: system,
        kinds.NonsmoothProblem: problem,
        kinds.Limits: {"floor": (size,)},
        kinds.Progress: _shapes(progress),
        kinds.Output: {"states": (None, size), "friction": (None, n), "normal": (None, n)},
        kinds.Workspace: _shapes(kinds.workspace_for(plain)),
        Room: _shapes(room_for(plain, size)),
    }


def _shapes(arrays: Any) -> dict[str, Any]:
    return {name: value.shape for name, value in arrays._asdict().items()
            if isinstance(value, np.ndarray)}
