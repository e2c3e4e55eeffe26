"""Fields over the body at chosen times, for files and pictures."""

from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.reduction.assembly.contact_faces import contact_directions
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes


def frame_indices(
    time: Array, frames: int, t_start: float | None = None, t_end: float | None = None
) -> NDArray[np.intp]:
    """Indices of the output times nearest to ``frames`` evenly spaced times, without repetition.

    Parameters
    ----------
    time : (N,) array
        Ascending [s].
    frames : int
        Largest number of times, zero or above.
    t_start, t_end : float, optional
        First and last time to choose from [s].

    Raises
    ------
    InputError
        If ``frames`` is negative, or no output time lies between t_start and t_end.
    """
    for name, value in (("t_start", t_start), ("t_end", t_end)):
        if value is not None and not (isinstance(value, Real) and value == value):
            raise InputError(f"{name} = {value!r} must be a time of the run.")
    if isinstance(frames, bool) or not isinstance(frames, int | np.integer) or frames < 0:
        raise InputError(f"frames = {frames!r} must be a whole number, zero or above.")
    first = 0 if t_start is None else int(np.searchsorted(time, t_start, side="left"))
    last = len(time) if t_end is None else int(np.searchsorted(time, t_end, side="right"))
    if first >= last:
        raise InputError(f"There is no output time from {t_start} s to {t_end} s; the run has "
                         f"times from {time[0]:g} s to {time[-1]:g} s.")
    chosen = np.arange(first, last)
    if frames >= len(chosen):
        return chosen
    inside = time[chosen]
    wanted = np.linspace(inside[0], inside[-1], frames)
    right = np.clip(np.searchsorted(inside, wanted), 1, len(inside) - 1)
    nearest = np.where(wanted - inside[right - 1] < inside[right] - wanted, right - 1, right)
    return chosen[np.unique(nearest)]


def require_field(trajectory: Trajectory) -> ModeShapes:
    """The modes over the body; InputError if the modal basis holds none."""
    require_kind("A picture", Trajectory, trajectory=trajectory)
    field = trajectory.system.basis.mode_shapes
    if field is None:
        raise InputError("This run cannot be drawn: its modal basis holds no shapes over the "
                         "body; make the basis with modal_basis(body, ...).")
    return field


def body_numbers(basis: ModalBasis) -> NDArray[np.int32]:
    """Number (N,) of the body of each mesh node, in the order of ``basis.parts``."""
    assert basis.mode_shapes is not None
    found = np.zeros(len(basis.mode_shapes.nodes), dtype=np.int32)
    for number, part in enumerate(basis.parts):
        found[part.nodes[0] : sum(part.nodes)] = number
    return found


def displacement(field: ModeShapes, q: Array) -> Array:
    """Displacements (F, N, 2) of the nodes [m] at modal coordinates q (F, m)."""
    nodes, _, modes = field.shapes.shape
    return np.asarray(q @ field.shapes.reshape(2 * nodes, modes).T).reshape(len(q), nodes, 2)


def von_mises(field: ModeShapes, q: Array) -> Array:
    """Von Mises stress (F, N) at the nodes [Pa] at modal coordinates q (F, m)."""
    nodes, _, modes = field.stress.shape
    components = field.stress.transpose(1, 0, 2).reshape(4 * nodes, modes)
    xx, yy, zz, xy = np.moveaxis((q @ components.T).reshape(len(q), 4, nodes), 1, 0)
    square = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * xy**2
    return np.sqrt(square)


def cell_stress(field: ModeShapes, q: Array) -> Array:
    """Stresses (F, M, 4) xx, yy, zz, xy of the cells, means of their corners [Pa]."""
    count, corners = field.cells.shape
    modes = field.stress.shape[2]
    # Corner by corner: all at once would hold the stress of each cell several times.
    mean = sum(field.stress[field.cells[:, corner]] for corner in range(corners)) / corners
    return np.asarray(q @ mean.reshape(4 * count, modes).T).reshape(len(q), count, 4)


def contact_forces(trajectory: Trajectory, which: Any = slice(None)) -> Array:
    """Forces (F, n, 2) of the other side on the contact nodes, along x and y [N].

    ``F n - R t`` with normal and tangent of each node: [-R - F y_R', F] on the ground, where y_R'
    is the slope of the ground below a node, or zero for contact forces that stay vertical.
    """
    tangents, normals = contact_directions(trajectory.system.basis)
    forces = _local_forces(trajectory, which)
    return np.asarray(forces[..., :1] * tangents + forces[..., 1:] * normals)


def _local_forces(trajectory: Trajectory, which: Any) -> Array:
    """Forces (F, n, 2) on the contact nodes along tangents and normals [N]."""
    normal, along = trajectory.normal_force[which], -trajectory.friction_force[which]
    ground, basis = trajectory.system.ground, trajectory.system.basis
    if ground.wavy and ground.normal == "surface":
        places = basis.contact_x + trajectory.modal_coordinates[which] @ basis.contact_T[:, 0].T
        along = along - basis.ground_nodes * normal * np.array([
            ground.slope(place, time)
            for place, time in zip(places, trajectory.time[which], strict=True)])
    return np.stack([along, normal], axis=-1)


def nodal_contact_force(trajectory: Trajectory, which: Any = slice(None)) -> Array:
    """Contact forces (F, N, 2) along x and y, distributed over the mesh nodes [N].

    What acts on one body acts reversed on the other one, at the feet of its contact nodes; the
    total is preserved.
    """
    field = require_field(trajectory)
    forces = _local_forces(trajectory, which)
    n = forces.shape[1]
    rows = field.restriction.tocsr()[6 : 6 + 3 * n]
    moments = np.zeros((*forces.shape[:2], 1))
    spread = rows.T @ np.concatenate([forces, moments], axis=2).reshape(len(forces), 3 * n).T
    return np.asarray(spread).T.reshape(len(forces), len(field.nodes), 2)


def contact_owners(field: ModeShapes, n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Mesh nodes (k,) of the contact faces, and the contact node (k,) that each belongs to.

    It is the one of the n contact nodes in whose motion the mesh node has the largest part. Where
    two bodies meet, the nodes of both faces have one.
    """
    rows = abs(field.restriction.tocsr()[6 : 6 + 3 * n]).tocoo()
    moves = rows.row % 3 < 2  # not by rotation, which takes part of all its neighbours
    owner, node, part = rows.row[moves] // 3, rows.col[moves] // 2, rows.data[moves]
    order = np.lexsort((part, node))
    order = order[part[order] > 1e-9]
    last = np.flatnonzero(np.diff(node[order], append=-1))
    return node[order][last].astype(np.intp), owner[order][last].astype(np.intp)


def nodal_contact_states(
    trajectory: Trajectory, which: Any,
    owners: tuple[NDArray[np.intp], NDArray[np.intp]] | None = None,
) -> NDArray[np.int8]:
    """States (F, N) at the mesh nodes: 0 open, 1 stick, 2 slip, and -1 where no contact node is.

    ``owners`` are those of :func:`contact_owners`, where they are needed again and again.
    """
    field = require_field(trajectory)
    touching, owner = owners or contact_owners(field, trajectory.system.basis.contact_nodes)
    found = trajectory.contact_state[which]
    states = np.full((len(found), len(field.nodes)), -1, dtype=np.int8)
    states[:, touching] = found[:, owner]
    return states


def blocks(indices: NDArray[np.intp], nodes: int) -> list[NDArray[np.intp]]:
    """Blocks of the chosen times, small enough for four doubles per node to stay in cache."""
    size = max(1, 2**20 // (4 * nodes))
    return [indices[first : first + size] for first in range(0, len(indices), size)]
