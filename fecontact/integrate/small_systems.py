"""Kernels for systems of one or two contact nodes that few modes move.

Their steps take a microsecond, most of it to begin and end loops over one or two numbers. A kernel
for one size is compiled for arrays of that size, in which loops are written out. It gives the same
numbers up to rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from fecontact.core.constants import constants
from fecontact.core.records import Size, of_eight, shapes
from fecontact.integrate.rodas5p import stage_solver, state
from fecontact.integrate.rodas5p.blocks import Blocks, one_block
from fecontact.system.nodes import (
    AXES,
    COMBINATIONS,
    MEMORY,
    MODES,
    NODES,
    PRODUCTS,
    SystemArrays,
)

# Modes and nodes.
SIZES = tuple((modes, nodes) for modes in (1, 2, 3, 4) for nodes in (1, 2))
USUAL = ((1, 1), (2, 1), (3, 1), (1, 2), (2, 2))
FEW = ((1, 1), (2, 1), (3, 1), (2, 2))

Values = dict[Any, dict[str, Any]]


def sizes_of(modes: int, nodes: int, states: int = 0) -> dict[Size, int]:
    """Sizes of the records of small systems, plane ones without polynomial forces.

    ``states`` is the number of internal variables of a node.
    """
    return {MODES: modes, NODES: nodes, AXES: 2, MEMORY: states, COMBINATIONS: 0, PRODUCTS: 0}


def _same_values(modes: int, nodes: int, states: int, sliders: bool) -> Values:
    """Values that all small systems of a size share, for each record.

    They have one block and one motion of the ground, and elastic Coulomb elements only with
    ``sliders``. Systems of which eight go side by side are on level ground.
    """
    blocks = one_block(np.zeros((modes, 2 * nodes)), nodes)
    same: Values = {
        Blocks: {name: value for name, value in blocks._asdict().items() if name != "shapes"}
        | {"shapes": blocks.shapes.shape},
        SystemArrays: {"memory": np.full(nodes, states), "second_motion": 0},
        state.Control: {} if sliders else {"sliders": 0},
        stage_solver.Reduced: {"solver": (modes, 2 * modes)},
    }
    eight = {of_eight(record): dict(fields) for record, fields in same.items()}
    eight[of_eight(SystemArrays)] |= {
        "on_ground": np.zeros(nodes, dtype=np.int64), "surface": 0, "friction_scale": 0,
        "follows_surface": 0, "polynomial": 0}
    eight[of_eight(state.Control)] |= {"near": 0, "many": 0}
    return same | eight


def is_small(problem: state.Problem) -> bool:
    """Whether a run is of a small system of one block."""
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
    if len(system.polynomial_pairs):
        return "there are large deflections"
    return "two motions are prescribed" if system.second_motion != 0 else None


@dataclass(frozen=True, eq=False)
class Sized:
    """A kernel for small systems of some sizes.

    Attributes
    ----------
    kernel(constants)
        The kernel with values of :func:`fecontact.core.constants.constants`.
    records : tuple
        Records that it works on, whose arrays have a known size.
    sizes : tuple
        Modes and nodes of these systems, compiled when they are first asked for.
    more(modes, nodes)
        Values of fields beside these sizes, by record: a shape, an integer array or a number.
    lengths(nodes)
        Sizes of the records beside those of all small systems.
    sliders : bool
        Whether the systems have elastic Coulomb elements.
    """

    kernel: Callable[[str], Any]
    records: tuple[Any, ...]
    sizes: tuple[tuple[int, int], ...] = SIZES
    more: Callable[[int, int], Values] = lambda modes, nodes: {}
    lengths: Callable[[int], dict[Size, int]] = lambda nodes: {}
    sliders: bool = False

    def values(self, modes: int, nodes: int, states: int = 0) -> Values:
        """Values and shapes that are the same in all calls of the kernel of a size, by record."""
        found = shapes(sizes_of(modes, nodes, states) | self.lengths(nodes), *self.records)
        same = {record: fields for record, fields
                in _same_values(modes, nodes, states, self.sliders).items() if record in found}
        for values in (same, self.more(modes, nodes)):
            for record, fields in values.items():
                found[record] = found.get(record, {}) | fields
        return found

    def of(self, modes: int, nodes: int, states: int = 0) -> Any:
        """The kernel of a size."""
        return _compiled(self, modes, nodes, states)

    @property
    def compilers(self) -> list[Callable[[], object]]:
        """Functions that each compile the kernel of one size."""
        return [partial(lambda size: self.of(*size).ready(), size) for size in self.sizes]


@cache
def _compiled(sized: Sized, modes: int, nodes: int, states: int) -> Any:
    return sized.kernel(constants(sized.values(modes, nodes, states)))
