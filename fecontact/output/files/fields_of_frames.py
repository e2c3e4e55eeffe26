"""Fields over the bodies at chosen times, as files for ParaView hold them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.contact_facets import contact_facets
from fecontact.output.files.frames import (
    cell_stress,
    contact_forces,
    contact_owners,
    displacement,
    nodal_contact_force,
    nodal_contact_states,
    require_field,
    von_mises,
)
from fecontact.output.files.vtk_cells import written_cells
from fecontact.reduction.modal_basis import ModalBasis

_VECTOR = ("x", "y", "z")
_LARGEST = float(np.finfo(np.float32).max)
_STATES = "-1 no contact node, 0 open, 1 stick, 2 slip"


@dataclass(frozen=True)
class FieldKind:
    """A field of each frame: components as VTK orders and ParaView names them, and the unit."""

    name: str
    of: str  # Point or Cell
    components: tuple[str, ...]
    unit: str
    kind: Any = np.float32
    rounded: bool = False  # to 16 significant bits, which compress well

    def flat(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (F, N) or (F, N, k) as rows of VTK, components that a plane lacks zero.

        Numbers beyond single precision become its largest number, 3.4e38.
        """
        if self.kind is np.float32:
            values = np.clip(values, -_LARGEST, _LARGEST)
        if self.rounded:
            values = _rounded(values)
        if not self.components:
            return values.reshape(-1).astype(self.kind)
        out = np.zeros((values.shape[0] * values.shape[1], len(self.components)), dtype=self.kind)
        out[:, : values.shape[2]] = values.reshape(-1, values.shape[2])
        return out


def _rounded(values: NDArray[Any]) -> NDArray[Any]:
    """Values (F, ...) in single precision with 16 significant bits, each to 1.6e-5 of itself.

    The last byte of each number is zero, and compresses to nothing.
    """
    single = np.ascontiguousarray(values, dtype=np.float32)
    bits = single.view(np.uint32)
    near = ((bits + np.uint32(0x80)) & np.uint32(0xFFFFFF00)).view(np.float32)
    # The largest numbers would become infinite.
    return np.where(np.isfinite(near), near, single)



_PLANE = (
    FieldKind("displacement", "Point", _VECTOR, "m", rounded=True),
    FieldKind("velocity", "Point", _VECTOR, "m/s", rounded=True),
    FieldKind("von_mises", "Point", (), "Pa", rounded=True),
    FieldKind("contact_force", "Point", _VECTOR, "N"),
    FieldKind("contact_state", "Point", (), _STATES, np.int8),
    FieldKind("stress", "Cell", ("xx", "yy", "zz", "xy", "yz", "xz"), "Pa", rounded=True),
)
# Of solids, constant over the patches: cells beside the contact faces hold the traction there.
_SPACE = (
    FieldKind("contact_pressure", "Point", (), "Pa"),
    FieldKind("contact_pressure", "Cell", (), "Pa"),
    FieldKind("contact_traction", "Cell", _VECTOR, "Pa"),
    FieldKind("contact_state", "Cell", (), _STATES, np.int8),
)


def field_kinds(basis: ModalBasis) -> tuple[FieldKind, ...]:
    """The fields that frames of runs with this basis have."""
    return _PLANE if basis.dimension == 2 else (*_PLANE, *_SPACE)


class FrameFields:
    """The fields of a run at any of its output times.

    Parameters
    ----------
    trajectory : Trajectory
        Run whose modal basis holds shapes over the body.

    Attributes
    ----------
    kinds : tuple of FieldKind
    sizes : dict
        Numbers of points and cells, by 'Point' and 'Cell'.
    cells : (M, n) integer array
        Cells of files, see :func:`fecontact.output.files.vtk_cells.written_cells`.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        field, basis = require_field(trajectory), trajectory.basis
        self._run, self._field = trajectory, field
        self.kinds = field_kinds(basis)
        self.cells = written_cells(field.nodes, field.elements, field.cells)
        self.sizes = {"Point": len(field.nodes), "Cell": len(self.cells)}
        self._owners = contact_owners(basis)
        # Cells of solids with a facet on a contact face, their contact nodes, and 1 on the body of
        # the contact node, -1 on the other side.
        self._cells = self._nodes = self._signs = np.zeros(0, dtype=np.int64)
        if basis.dimension == 3:
            facets = contact_facets(basis)
            beside = facets.at_cells(self.cells, len(field.nodes))
            self._cells = np.flatnonzero(beside >= 0)
            self._nodes = facets.owner[beside[self._cells]]
            self._signs = np.where(facets.own[beside[self._cells]], 1, -1)

    def at(self, which: Any) -> dict[tuple[str, str], NDArray[Any]]:
        """Values (F, N) or (F, N, k) at output times (F,), by 'Point' or 'Cell' and name."""
        run, field = self._run, self._field
        q, rate = run.modal_coordinates[which], run.modal_velocities[which]
        found: dict[tuple[str, str], NDArray[Any]] = {
            ("Point", "displacement"): displacement(field, q),
            ("Point", "velocity"): displacement(field, rate),
            ("Point", "von_mises"): von_mises(field, q),
            ("Point", "contact_force"): nodal_contact_force(run, which),
            ("Point", "contact_state"): nodal_contact_states(run, which, self._owners),
            ("Cell", "stress"): cell_stress(field, q, self.cells)}
        if run.basis.dimension == 2:
            return found
        areas = run.basis.contact_areas
        pressure = run.normal_force[which] / areas
        traction = contact_forces(run, which) / areas[:, None]
        at_points = np.zeros((len(q), self.sizes["Point"]))
        at_points[:, self._owners[0]] = pressure[:, self._owners[1]]
        return found | {
            ("Point", "contact_pressure"): at_points,
            ("Cell", "contact_pressure"): self._at_cells(pressure[:, self._nodes], 0.0),
            ("Cell", "contact_traction"): self._at_cells(
                traction[:, self._nodes] * self._signs[:, None], 0.0),
            ("Cell", "contact_state"): self._at_cells(run.contact_state[which][:, self._nodes],
                                                      -1)}

    def _at_cells(self, values: NDArray[Any], without: float) -> NDArray[Any]:
        """Values (F, M, ...) of all cells from those (F, k, ...) of cells on contact faces."""
        found = np.full((len(values), self.sizes["Cell"], *values.shape[2:]), without,
                        dtype=values.dtype)
        found[:, self._cells] = values
        return found
