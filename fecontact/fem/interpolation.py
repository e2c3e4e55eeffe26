"""Interpolation of nodal values at any place of a body, by the shape functions of its elements."""

from collections.abc import Sequence

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers

# Mid-side and centre nodes of quadratic elements, as pairs of corners and of lines (start, end,
# middle) in the two directions of a square.
_SIDES = ((0, 1), (1, 2), (0, 2))
_LINEAR = ((0, 0), (1, 0), (1, 1), (0, 1))
_QUADRATIC = (*_LINEAR, (2, 0), (1, 2), (2, 1), (0, 2), (2, 2))
_INSIDE = 1e-9  # of local coordinates, which run from 0 to 1


def interpolation(
    nodes: Array, elements: Integers, place: Sequence[float] | Array, name: str
) -> tuple[Integers, Array]:
    """Nodes (k,) and their weights (3, k) for the value and its derivatives in x and y at a place.

    Where elements meet, the derivatives are the means over them, weighted by their areas.

    Parameters
    ----------
    nodes : (N, 2) array
        Places of the displacement nodes [m].
    elements : (E, 3), (E, 6), (E, 4) or (E, 9) integer array
        Nodes of straight-sided triangles or quadrilaterals: corners along the outline, mid-sides
        (of triangles 0-1, 1-2, 0-2; of quadrilaterals 0-1, 1-2, 2-3, 0-3), centre.
    place : (x, y)
        [m].
    name : str
        What is looked for, for messages.

    Raises
    ------
    InputError
        If the place lies outside the body.
    """
    at = np.asarray(place, dtype=float)
    corners = nodes[elements[:, : 3 if elements.shape[1] in (3, 6) else 4]]
    near = 1e-6 * np.ptp(corners, axis=1)
    around = np.flatnonzero(((corners.min(axis=1) - near <= at) & (
        at <= corners.max(axis=1) + near)).all(axis=1))
    found, total = [], 0.0
    for element in around:
        local = _local(corners[element], at)
        if local is None:
            continue
        values, slopes = _functions(elements.shape[1], *local)
        x, y = corners[element].T
        jacobian = corners[element].T @ _functions(len(x), *local)[1]
        area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
        weights = np.vstack([values, np.linalg.solve(jacobian.T, slopes.T)])
        found.append((elements[element], area * weights))
        total += area
    if not found:
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        raise InputError(f"{name}: ({at[0]:g}, {at[1]:g}) lies outside the body, which spans "
                         f"x = {low[0]:g} ... {high[0]:g}, y = {low[1]:g} ... {high[1]:g}.")
    which, index = np.unique(np.concatenate([one for one, _ in found]), return_inverse=True)
    weights = np.zeros((3, len(which)))
    np.add.at(weights.T, index, np.hstack([one for _, one in found]).T / total)
    return which, weights


def _local(corners: Array, place: Array) -> tuple[float, float] | None:
    """Local coordinates of a place in an element (k, 2); None outside."""
    local = np.full(2, 1.0 / 3.0 if len(corners) == 3 else 0.5)
    for _ in range(30):  # one step for parallelograms and triangles
        values, slopes = _functions(len(corners), *local)
        step = np.linalg.solve(corners.T @ slopes, place - values @ corners)
        local = local + step
        if not 1e-14 <= np.abs(step).max() <= 10.0:  # done, or far outside
            break
    beyond = local.sum() if len(corners) == 3 else local.max()
    if not -_INSIDE <= local.min() <= beyond <= 1.0 + _INSIDE:
        return None
    return float(local[0]), float(local[1])


def _functions(count: int, r: float, s: float) -> tuple[Array, Array]:
    """Shape functions (k,) and their derivatives (k, 2) at local coordinates."""
    if count in (3, 6):
        L, D = np.array([1.0 - r - s, r, s]), np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
        if count == 3:
            return L, D
        sides = [(4.0 * L[i] * L[j], 4.0 * (L[i] * D[j] + L[j] * D[i])) for i, j in _SIDES]
        return (np.concatenate([L * (2.0 * L - 1.0), [value for value, _ in sides]]),
                np.vstack([(4.0 * L - 1.0)[:, None] * D, *(slope for _, slope in sides)]))
    (a, da), (b, db) = _line(count, r), _line(count, s)
    pairs = _LINEAR if count == 4 else _QUADRATIC
    return (np.array([a[i] * b[j] for i, j in pairs]),
            np.array([[da[i] * b[j], a[i] * db[j]] for i, j in pairs]))


def _line(count: int, s: float) -> tuple[Array, Array]:
    """Functions of one direction and their derivatives: start, end, middle."""
    if count == 4:
        return np.array([1.0 - s, s]), np.array([-1.0, 1.0])
    return (np.array([(1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)]),
            np.array([4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s]))
