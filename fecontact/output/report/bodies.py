"""Bodies of a page: shapes over them and their coordinates, as coarse as can be seen by nobody.

What is shown is a sum ``sum_m s_m q_m``. Shape m has the step ``2 e / (M max|q_m|)`` of M modes and
coordinate m the step ``2 e / (M max|s_m|)``, so that each adds at most e to the error of the sum,
whatever cancels in it. As modes are not at their largest all at once, both are then made as coarse
as the bound ``sum_m step_m |q_m| / 2`` over all times, or ``|s_m|`` over all nodes, allows.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.output.plots.style import beyond_words
from fecontact.output.render.ranges import Ranges
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


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions that a page shows, and the steps of their numbers.

    In ``coordinates`` (N, m + p) the products of nonlinear stress follow the modal ones, see
    ``ModeShapes.stress_coordinates``. ``drift`` (d - 1, m) is the motion along x (and y) that is
    not magnified; zero by default.
    """

    bodies: DrawnBodies
    coordinates: Array
    drift: Array | float = 0.0

    @cached_property
    def ranges(self) -> Ranges:
        """Largest values over the bodies and time."""
        bodies = self.bodies
        drift = np.broadcast_to(self.drift, (bodies.dimension - 1, bodies.shapes.shape[2]))
        return Ranges(bodies.nodes, bodies.shapes, bodies.stress, self.coordinates, drift)

    @property
    def _errors(self) -> tuple[float, float]:
        """Errors of displacement and stress components that an error of one stands for."""
        return (self.ranges.largest_displacement / self.bodies.dimension**0.5,
                self.ranges.largest_stress / _VON_MISES[self.bodies.stress.shape[1]])

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
    bodies, ranges = motions.bodies, motions.ranges
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
        "largest": {"displacement": ranges.largest_displacement,
                    "stress": ranges.stress_range, "peak": ranges.largest_stress,
                    "beyond": beyond_words(quantity(ranges.largest_stress, "Pa"))},
        "peak": ranges.peak_node, **owned,
    }
