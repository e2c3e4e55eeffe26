"""Welds of whole faces: what is on one face moves with the other, node by node or in the mean.

The foot of a node may lie a little beside it where curved faces do not match. The displacement of
the place of the node is then that of the foot and its rotation times the way between them, so that
motions of the joined bodies as a whole strain nothing.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.fem.pairing import Pairing
from fecontact.reduction.modal_basis import ModalBasis

# Distance of welded places from each other, in lengths that a node stands for.
_APART = 0.1
_ROUND_OFF = 1e-9


@dataclass(frozen=True, eq=False)
class FaceWeld:
    """A face of one body welded to a face of another, whose meshes need not match.

    At every displacement node of the finer face, or in the mean over the segments of the pairing,
    both faces have the same displacement. Their gap must be zero; the weld has no mass and does not
    yield. The modal bases have to represent the forces on the faces, as
    :func:`fecontact.reduction.reduce_bodies` with the link makes them: without them too few modes
    are left to move the faces, and the joint is too stiff.

    Parameters
    ----------
    pairing : Pairing
        Pairing of the two faces, by :func:`fecontact.fem.pair_faces`.

    Raises
    ------
    InputError
        For a pairing with the ground, or of faces that do not touch.
    """

    pairing: Pairing

    def __post_init__(self) -> None:
        require_kind("FaceWeld", Pairing, pairing=self.pairing)
        if self.pairing.other is None:
            raise InputError(f"FaceWeld: '{self.first}' cannot be welded to the ground; fix the "
                             f"boundary of its body, fixed={{...: 'xy'}}.")
        worst = int(np.argmax(self.pairing.gaps / self.pairing.tributary))
        if self.pairing.gaps[worst] > _APART * self.pairing.tributary[worst]:
            where = ", ".join(f"{x:.4g}" for x in self.pairing.places[worst])
            raise InputError(f"FaceWeld: '{self.first}' is {self.pairing.gaps[worst]:.4g} m apart "
                             f"from '{self.second}' at ({where}) m; put the bodies where "
                             f"they touch, or make the pairing's reach smaller.")

    @property
    def first(self) -> str:
        """``body.boundary`` of the face with the nodes."""
        return self.pairing.report.face

    @property
    def second(self) -> str:
        """``body.boundary`` of the other face."""
        return self.pairing.report.other

    def rows(self, body: str) -> list[Any]:
        """Rows over the nodes of a body (d n, d N), sparse, on which the weld's forces act."""
        found = [(self.pairing.body, self.pairing.nodes), (self.pairing.other, self.pairing.feet)]
        return [_displacements(rows, self.pairing) for name, rows in found if name == body]


def welded_rows(basis: ModalBasis, weld: FaceWeld) -> Array:
    """Displacements (d n, m) of the nodes of a welded face relative to the other one.

    Raises
    ------
    InputError
        For bodies that are not those of the pairing, or whose modes are all taken up by the weld.
    """
    pairing = weld.pairing
    assert pairing.other is not None, "checked by the weld"
    first, here = _part(basis, pairing.body, pairing.nodes)
    second, there = _part(basis, pairing.other, pairing.feet)
    d = pairing.places.shape[1]
    nodes, feet = (_displacements(rows, pairing) for rows in (pairing.nodes, pairing.feet))
    arms = (nodes @ here - feet @ there).reshape(-1, d)
    own, other = np.asarray(nodes @ first), np.asarray(feet @ second)
    turns = np.asarray(_rotations(pairing.feet, pairing) @ second)
    if d == 2:
        swept = np.stack([-arms[:, 1], arms[:, 0]], axis=1)[:, :, None] * turns[:, None, :]
    else:
        swept = np.cross(turns.reshape(len(arms), 3, -1), arms[:, :, None], axis=1)
    other += swept.reshape(other.shape)
    for name, rows in ((pairing.body, own), (pairing.other, other)):
        _require_modes(basis, name, rows)
    return own - other


def _displacements(rows: Any, pairing: Pairing) -> Any:
    """Rows of displacements, without those of rotations, of all nodes."""
    d = pairing.places.shape[1]
    return rows[np.flatnonzero(np.arange(rows.shape[0]) % (3 * (d - 1)) < d)]


def _rotations(rows: Any, pairing: Pairing) -> Any:
    """Rows of rotations, without those of displacements, of all nodes."""
    d = pairing.places.shape[1]
    return rows[np.flatnonzero(np.arange(rows.shape[0]) % (3 * (d - 1)) >= d)]


def _part(basis: ModalBasis, name: str, rows: Any) -> tuple[Array, Array]:
    """Shapes (2 N, m) and coordinates (2 N,) of the nodes of one body."""
    part = {one.name: one for one in basis.parts}.get(name)
    if part is None or basis.mode_shapes is None or (
            basis.dimension * part.nodes[1] != rows.shape[1]):
        raise InputError(f"FaceWeld: the pairing was made for a mesh of body '{name}' that is none "
                         f"of the assembled bodies; pair the faces of the same bodies.")
    nodes = slice(part.nodes[0], sum(part.nodes))
    return (basis.mode_shapes.shapes[nodes].reshape(rows.shape[1], -1),
            basis.mode_shapes.nodes[nodes].ravel())


def _require_modes(basis: ModalBasis, name: str, rows: Array) -> None:
    """Raise InputError if every mode of a body is given by the motion of its welded face."""
    modes = next(part.modes for part in basis.parts if part.name == name)
    values = np.linalg.svd(rows[:, modes[0] : sum(modes)], compute_uv=False)
    rank = int(np.count_nonzero(values > _ROUND_OFF * values.max(initial=0.0)))
    if modes[1] and rank == modes[1] and len(rows) > rank:
        raise InputError(f"FaceWeld: the {modes[1]} modes of body '{name}' cannot follow the "
                         f"{len(rows)} displacements of its welded face; complete them by "
                         f"reduce_bodies(..., links=[...]), or pair the faces on fewer segments, "
                         f"pair_faces(..., nodes=...).")
