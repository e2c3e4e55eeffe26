"""The step loop of lanes for each usual size of small systems, whose loops are written out."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from fecontact.core.compiled import kernel
from fecontact.core.constants import constants
from fecontact.core.lanes.vectors import WIDTH
from fecontact.integrate.lanes import arrays, step_loop
from fecontact.integrate.rodas5p import small_systems

# Modes and nodes of systems that go through lanes; installations compile the step loop for each.
USUAL = ((1, 1), (2, 1), (3, 1), (2, 2))


def compile_usual() -> None:
    """Compile the step loops of the usual sizes, or find them stored."""
    for size in USUAL:
        advance_for(*size)


@cache
def advance_for(modes: int, nodes: int) -> Any:
    """The step loop for so many modes and nodes."""
    given = constants(fixed_values(modes, nodes))
    return kernel(step_loop.advance, constants=given, nogil=True)


def fixed_values(modes: int, nodes: int) -> dict[Any, dict[str, Any]]:
    """What is the same in all lanes for systems of a size, for each type of tuples.

    The arrays of the run that checks of single lanes are made with are among them.
    """
    m, n = modes, nodes
    shapes = [(m, m), (m, m), (m,), (2, m), (2,), (2,), (None, m), (n, m), (n, m), (n,), (n,),
              (n, None), (n, None), (None,), (2, None), (None, None)]
    limits = [(m,), (n,), (n,), (n,), (m,), (None, n), (arrays.LIMITS,)]
    laws = [np.zeros(count, dtype=np.int64) for count in (n, n, 2, 0)]
    lanes = arrays.lanes_for(_filled(shapes), _filled(limits), [*laws, 0, 0], m, n)
    return {
        arrays.LaneSystem: {
            **{name: (*shape, WIDTH)
               for name, shape in zip(arrays.LaneSystem._fields, shapes, strict=False)},
            "normal": (n,), "friction": (n,), "drive": (2,)},
        arrays.LaneControl: {
            name: (*shape, WIDTH)
            for name, shape in zip(arrays.LaneControl._fields, limits, strict=True)},
        arrays.LaneProgress: _shapes(lanes.progress),
        arrays.LaneRoom: _shapes(lanes.room),
        arrays.LaneRuns: {"states": (None, None, 2 * m)},
        **small_systems.fixed_values(m, n),
    }


def _filled(shapes: Sequence[tuple[int | None, ...]]) -> list[tuple[int, ...]]:
    """Shapes with a one for each length that is not the same everywhere."""
    return [tuple(length or 1 for length in shape) for shape in shapes]


def _shapes(values: Any) -> dict[str, tuple[int, ...]]:
    return {name: value.shape for name, value in values._asdict().items()}
