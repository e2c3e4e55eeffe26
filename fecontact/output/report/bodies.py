"""Bodies of a page: shapes over them and their coordinates, as coarse as can be seen by nobody.

What is shown is a sum ``sum_m s_m q_m``. Shape m has the step ``2 e / (M max|q_m|)`` of M modes and
coordinate m the step ``2 e / (M max|s_m|)``, so that each adds at most e to the error of the sum,
whatever cancels in it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.output.files.frames import blocks, displacement, von_mises
from fecontact.output.render.frames_data import body_labels
from fecontact.output.report.payload import Payload
from fecontact.reduction.assembly.contact_faces import mode_names
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes
from fecontact.reduction.report import BasisReport

# Of the largest displacement and von Mises stress: errors of shapes and of coordinates each.
TOLERANCE = 3e-5
_ALONE = 1e-4  # error of a mode that is shown alone, of its largest value
_VON_MISES = 3.0  # largest error of von Mises stress per error of the components xx, yy, zz, xy
_COMPONENTS = ("xx", "yy", "zz", "xy")
_PEAK = 0.98  # part of the nodes whose largest stress lies within the colour range
_PEAKED = 1.5  # ratio of the peak to that stress above which the peak is left out of the range


@dataclass(frozen=True, eq=False)
class Motions:
    """What a page shows of modal coordinates (N, m): their ranges over bodies and time."""

    basis: ModalBasis
    coordinates: Array

    @cached_property
    def shapes(self) -> ModeShapes:
        """Mode shapes over the bodies; rigid ones without the round-off of their stresses."""
        found = self.basis.mode_shapes
        assert found is not None
        return replace(found, stress=found.stress * (self.basis.angular_frequencies > 0.0))

    @cached_property
    def _peaks(self) -> tuple[Array, Array]:
        """Largest displacement and von Mises stress (P,) of each node over time."""
        nodes = len(self.shapes.nodes)
        largest = np.zeros((2, nodes))
        for which in blocks(np.arange(len(self.coordinates)), nodes):
            q = self.coordinates[which]
            length = np.linalg.norm(displacement(self.shapes, q), axis=2)
            for row, values in zip(largest, (length, von_mises(self.shapes, q)), strict=True):
                np.maximum(row, values.max(axis=0), out=row)
        return largest[0], largest[1]

    @property
    def largest_displacement(self) -> float:
        """[m]."""
        return float(self._peaks[0].max())

    @property
    def largest_stress(self) -> float:
        """Of von Mises [Pa]."""
        return float(self._peaks[1].max())

    @property
    def peak_node(self) -> int:
        """Mesh node of the largest von Mises stress."""
        return int(self._peaks[1].argmax())

    @property
    def stress_range(self) -> float:
        """End of the colour range [Pa]: singular corners do not darken all others."""
        usual = float(np.quantile(self._peaks[1], _PEAK))
        return usual if 0.0 < _PEAKED * usual < self.largest_stress else self.largest_stress

    def coordinate_steps(self) -> Array:
        """Steps (m,) of the coordinates."""
        fields = [(np.abs(self.shapes.shapes).max(axis=(0, 1)), self.largest_displacement),
                  (np.abs(self.shapes.stress).max(axis=(0, 1)), self.largest_stress / _VON_MISES)]
        return np.min([_steps(sizes, TOLERANCE * largest) for sizes, largest in fields], axis=0)

    def shape_steps(self, field: Array, largest: float) -> Array:
        """Steps (c, m) of a field (P, c, m) of the modes, of which ``largest`` is seen."""
        sizes = np.abs(field).max(axis=(0, 1), initial=0.0)
        used = np.abs(self.coordinates).max(axis=0, initial=0.0)
        steps = np.minimum(_steps(used, TOLERANCE * largest),
                           np.where(sizes > 0.0, _ALONE * sizes, 1.0))
        return np.tile(steps, (field.shape[1], 1))


def _steps(sizes: Array, error: float) -> Array:
    """Steps (m,) of what is multiplied with numbers up to ``sizes`` (m,), for an error in the sum.

    Without any motion there is no error to keep to.
    """
    wide = np.finfo(float).max ** 0.25
    if error <= 0.0:
        return np.full(len(sizes), wide)
    return 2.0 * error / (len(sizes) * np.maximum(sizes, error / wide))


def bodies_table(motions: Motions, payload: Payload) -> dict[str, Any]:
    """Bodies of a page: places, triangles, outline, shapes and stresses of the modes.

    All places have ``dimension`` coordinates, two for plane bodies; stresses are those of
    ``components``.
    """
    basis, field = motions.basis, motions.shapes
    extent = float(np.linalg.norm(np.ptp(field.nodes, axis=0)))
    cells = field.cells
    # Triangles of one cell after the other, so that overlapping bodies are drawn in turn.
    triangles = cells if cells.shape[1] == 3 else cells[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    used = [k for k in range(len(_COMPONENTS)) if field.stress[:, k].any()]
    stress = field.stress[:, used]
    parts = [{"name": name, "label": node} for name, node in body_labels(basis)]
    ratios = [f"{50.0 * rate / w:.3g} %" if w > 0.0 else ""
              for rate, w in zip(np.diag(basis.damping), basis.angular_frequencies, strict=True)]
    # The modes that complete the bases of several bodies are not told from vibrations.
    kinds = [kind if kind == "rigid" or not basis.parts else ""
             for kind in BasisReport(basis).kinds]
    return {
        "dimension": field.nodes.shape[1],
        "points": payload.add(field.nodes, 1e-7 * extent),
        "triangles": payload.add(triangles),
        "edges": payload.add(field.outline),
        "shapes": payload.add(field.shapes, motions.shape_steps(
            field.shapes, motions.largest_displacement)),
        "stress": payload.add(stress, motions.shape_steps(
            stress, motions.largest_stress / _VON_MISES)),
        "components": [_COMPONENTS[k] for k in used],
        "paints": [*(["von Mises stress"] if used else []), "displacement",
                   *(f"stress {_COMPONENTS[k]}" for k in used), "none"],
        "parts": parts,
        "modes": [[name, f"{hz:.6g}", ratio, kind] for name, hz, ratio, kind in zip(
            mode_names(basis), basis.frequencies_hz, ratios, kinds, strict=True)],
        "largest": {"displacement": motions.largest_displacement,
                    "stress": motions.stress_range, "peak": motions.largest_stress},
        "peak": motions.peak_node,
    }
