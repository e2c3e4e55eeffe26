"""Bodies of a page: shapes over them and their coordinates, as coarse as can be seen by nobody.

What is shown is a sum ``sum_m s_m q_m``. Shape m has the step ``2 e / (M max|q_m|)`` of M modes and
coordinate m the step ``2 e / (M max|s_m|)``, so that each adds at most e to the error of the sum,
whatever cancels in it. As modes are not at their largest all at once, both are then made as coarse
as the bound ``sum_m step_m |q_m| / 2`` over all times, or ``|s_m|`` over all nodes, allows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.output.plots.style import beyond_words, stress_limit
from fecontact.output.report.drawing import DrawnBodies
from fecontact.output.report.payload import Payload

# Of the largest displacement and von Mises stress: errors of coordinates, which are few, and of
# shapes.
TOLERANCE = 1e-5
_SHAPES = 8e-5
_ALONE = 1e-4  # error of a mode that is shown alone, of its largest value
# Largest error of von Mises stress per error of its components, (4 + 3 k)^(1/2) with k shears.
_VON_MISES = {4: 7.0**0.5, 6: 13.0**0.5}
# Quantities that colour contact faces of solids.
PRESSURE, STATE = "contact pressure", "contact state"
_BLOCK = 2**18  # numbers of a field over nodes and times that stay in cache


@dataclass(frozen=True, eq=False)
class _Reached:
    """Range of a field over time: largest size (P,), lowest and highest values (P, c)."""

    largest: Array
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions that a page shows: modal coordinates (N, m), and ranges over bodies and time.

    In ``coordinates`` the products (N, p) of nonlinear stress follow the modal coordinates, see
    ``ModeShapes.stress_coordinates``. ``drift`` (m,) or (2, m) is the motion along x (and y) that
    is not magnified.
    """

    bodies: DrawnBodies
    coordinates: Array
    drift: Array | None = None

    @property
    def modal(self) -> Array:
        """Modal coordinates (N, m)."""
        return self.coordinates[:, : self.bodies.shapes.shape[2]]

    @cached_property
    def _whole(self) -> _Reached:
        return _reached(self.bodies.shapes, self.modal, _length)

    @cached_property
    def _magnified(self) -> _Reached:
        """Range of the displacements without the drift."""
        if self.drift is None or not self.drift.any():
            return self._whole
        shapes = self.bodies.shapes.copy()
        for axis, rows in enumerate(np.atleast_2d(self.drift)):
            shapes[:, axis] -= rows
        return _reached(shapes, self.modal, _length)

    @cached_property
    def _stresses(self) -> Array:
        """Largest von Mises stress (P,) of each node over time."""
        stress = self.bodies.stress
        used = np.flatnonzero(stress.any(axis=(0, 2)))
        names = [self.bodies.components[k] for k in used]
        if not names:
            return np.zeros(len(stress))
        return _reached(stress[:, used], self.coordinates,
                        lambda values: von_mises(names, values)).largest

    @property
    def largest_displacement(self) -> float:
        """[m]."""
        return float(self._whole.largest.max())

    @property
    def largest_magnified(self) -> float:
        """Largest displacement without the drift [m]."""
        return float(self._magnified.largest.max())

    @property
    def largest_stress(self) -> float:
        """Largest von Mises stress [Pa]."""
        return float(self._stresses.max())

    @property
    def peak_node(self) -> int:
        """Mesh node of the largest von Mises stress."""
        return int(self._stresses.argmax())

    @property
    def stress_range(self) -> float:
        """End of the colour range [Pa]: singular corners do not darken all others."""
        return stress_limit(self._stresses)

    def box(self, scale: float) -> list[float]:
        """Smallest and largest x, y (and z) that the bodies reach, magnified [m]."""
        nodes, moved = self.bodies.nodes, self._magnified
        low = (nodes + scale * moved.low).min(axis=0)
        high = (nodes + scale * moved.high).max(axis=0)
        if self.drift is not None:
            for axis, rows in enumerate(np.atleast_2d(self.drift)):
                drift = self.modal @ rows
                low[axis], high[axis] = low[axis] + drift.min(), high[axis] + drift.max()
        ends = [np.minimum(low, nodes.min(axis=0)), np.maximum(high, nodes.max(axis=0))]
        return [float(end) for end in np.stack(ends, axis=1).ravel()]

    @property
    def _errors(self) -> tuple[float, float]:
        """Errors of displacement and stress components that an error of one stands for."""
        return (self.largest_displacement / self.bodies.dimension**0.5,
                self.largest_stress / _VON_MISES[self.bodies.stress.shape[1]])

    def coordinate_steps(self) -> Array:
        """Steps (m + p,) of the coordinates."""
        moved, stress = (
            _steps(np.abs(field).reshape(-1, field.shape[2]), TOLERANCE * error)
            for field, error in zip((self.bodies.shapes, self.bodies.stress), self._errors,
                                    strict=True))
        stress[: len(moved)] = np.minimum(stress[: len(moved)], moved)
        return stress

    def shape_steps(self) -> tuple[Array, Array]:
        """Steps (m,) of shapes and (m + p,) of stresses."""
        found = []
        for field, error in zip((self.bodies.shapes, self.bodies.stress), self._errors,
                                strict=True):
            used = np.abs(self.coordinates[:, : field.shape[2]])
            sizes = np.abs(field).max(axis=(0, 1), initial=0.0)
            found.append(np.minimum(_steps(used, _SHAPES * error),
                                    np.where(sizes > 0.0, _ALONE * sizes, 1.0)))
        return found[0], found[1]


def _reached(field: Array, q: Array, size: Callable[[Any], Array]) -> _Reached:
    """Range over time of the sums of a field (P, c, m) over modes with coordinates q (N, m).

    ``size`` gives one number of values (c, ...). Times are sought in single precision, in blocks of
    nodes that stay in cache; the largest sizes are those of the sums in double precision there.
    """
    nodes, kinds, modes = field.shape
    used = np.abs(q).max(axis=0, initial=0.0)
    parts = field * used
    unit = float(np.abs(parts).max(initial=0.0)) or 1.0
    rows = np.ascontiguousarray((parts / unit).transpose(1, 0, 2), dtype=np.float32)
    columns = (q / np.where(used > 0.0, used, 1.0)).T.astype(np.float32)
    at = np.zeros(nodes, dtype=np.intp)
    low, high = np.zeros((nodes, kinds)), np.zeros((nodes, kinds))
    count = max(1, _BLOCK // (kinds * len(q)))
    for first in range(0, nodes, count):
        chosen = slice(first, first + count)
        values = (rows[:, chosen].reshape(-1, modes) @ columns).reshape(kinds, -1, len(q))
        at[chosen] = size(values).argmax(axis=1)
        low[chosen], high[chosen] = values.min(axis=2).T, values.max(axis=2).T
    largest = size(np.einsum("pcm,pm->cp", field, q[at]))
    return _Reached(largest, unit * low, unit * high)


def _length(values: Array) -> Array:
    return np.sqrt(np.einsum("c...,c...->...", values, values))


def von_mises(names: Sequence[str], values: Array) -> Array:
    """Von Mises stress (...) of stresses (c, ...), of which those without a name are zero."""
    parts = dict(zip(names, values, strict=True))
    xx, yy, zz = (parts.get(name, 0.0) for name in ("xx", "yy", "zz"))
    square = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
    for name in ("xy", "yz", "zx"):
        square = square + 3.0 * parts[name] ** 2 if name in parts else square
    return np.sqrt(square)


def _steps(factors: Array, error: float) -> Array:
    """Steps (m,) of what is multiplied with each row of factors (r, m) of zero or above and summed.

    Without any motion there is no error to keep to.
    """
    wide = np.finfo(float).max ** 0.25
    sizes = factors.max(axis=0, initial=0.0)
    if error <= 0.0:
        return np.full(len(sizes), wide)
    steps = 2.0 * error / (len(sizes) * np.maximum(sizes, error / wide))
    reached = 0.5 * float((factors @ steps).max(initial=0.0))
    return steps * max(1.0, error / reached) if reached > 0.0 else steps


def bodies_table(motions: Motions, payload: Payload) -> dict[str, Any]:
    """Bodies of a page: places, triangles, outline, shapes and stresses of the modes."""
    bodies = motions.bodies
    used = [k for k in range(len(bodies.components)) if bodies.stress[:, k].any()]
    steps = motions.shape_steps()
    stress, names = bodies.stress[:, used], [bodies.components[k] for k in used]
    touching = bodies.touching
    owned: dict[str, Any] = {} if not touching.any() else {
        "owners": payload.add(bodies.owners), "own": 3 * int(np.count_nonzero(~touching))}
    return {
        "dimension": bodies.dimension,
        "points": payload.add(bodies.nodes, 1e-7 * bodies.extent),
        "triangles": payload.add(bodies.triangles),
        "edges": payload.add(bodies.edges),
        "shapes": payload.add(bodies.shapes, np.tile(steps[0], bodies.dimension)),
        "stress": payload.add(stress, np.tile(steps[1], len(used))),
        "components": names,
        "paints": [*(["von Mises stress"] if used else []), "displacement",
                   *(f"stress {name}" for name in names),
                   *([PRESSURE, STATE] if owned else []), "none"],
        "parts": [{"name": name, "label": node} for name, node in bodies.labels],
        "modes": bodies.modes,
        "largest": {"displacement": motions.largest_displacement,
                    "stress": motions.stress_range, "peak": motions.largest_stress,
                    "beyond": beyond_words(quantity(motions.largest_stress, "Pa"))},
        "peak": motions.peak_node, **owned,
    }
