"""Meshes in rows, columns and layers of cells, between lines at given coordinates."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.fem.elements.cell_kinds import CELL_KINDS

# Names of the sides across each axis: at its first line and at its last.
_SIDES = {2: (("left", "right"), ("bottom", "top")),
          3: (("left", "right"), ("front", "back"), ("bottom", "top"))}


def structured(
    lines: Sequence[ArrayLike]
) -> tuple[Array, Integers, dict[str, Integers], dict[str, Integers]]:
    """Nodes, cells, boundaries and points of a grid between lines along each axis.

    Raises
    ------
    InputError
        Unless the lines are two or more finite, ascending numbers.
    """
    axes = [_ascending(axis, one) for axis, one in zip("xyz", lines, strict=False)]
    d, shape = len(axes), tuple(map(len, axes))
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, d)
    number = np.arange(len(nodes)).reshape(shape)
    steps = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corners = steps if d == 2 else [(*step, level) for level in (0, 1) for step in steps]
    cells = np.stack([number[tuple(slice(at, count - 1 + at) for at, count in zip(
        corner, shape, strict=True))].ravel() for corner in corners], axis=1)
    boundaries, places = {}, np.array(corners)
    for axis, names in enumerate(_SIDES[d]):
        for name, level in zip(names, (0, 1), strict=True):
            at = np.array(np.unravel_index(cells[:, 0], shape))[axis]
            side = cells[at == level * (shape[axis] - 2)]
            facet = next(one for one in CELL_KINDS[d, len(corners)].facets
                         if (places[list(one), axis] == level).all())
            boundaries[name] = side[:, facet]
    points = {" ".join(_SIDES[d][axis][end] for axis, end in reversed(tuple(enumerate(ends)))):
              np.array([number[tuple(-end for end in ends)]])
              for ends in product((0, 1), repeat=d)}
    return nodes, cells, boundaries, points


def _ascending(axis: str, given: ArrayLike) -> Array:
    """Lines along an axis."""
    found = as_floats(given, f"Mesh.grid: {axis}")
    if found.ndim != 1 or len(found) < 2 or not np.isfinite(found).all() or not (
            np.diff(found) > 0.0).all():
        raise InputError(f"Mesh.grid: {axis} must be the ascending coordinates [m] of two or more "
                         f"lines of nodes, such as np.linspace(0.0, 0.1, 21).")
    return found
