"""Fields over the body at chosen times, for files and pictures."""

from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.magnitude import magnitude
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import widths
from fecontact.fem.von_mises import von_mises_of
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.contact_facets import contact_facets
from fecontact.reduction.assembly.contact_faces import contact_directions
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes

if TYPE_CHECKING:
    from fecontact.laws.ground.ground import Ground

LARGEST_DRAWN = 1e100  # of states and contact forces in pictures and pages


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
        begin, end = (f"{time[k]:g}" if given is None else given
                      for k, given in ((0, t_start), (-1, t_end)))
        raise InputError(f"There is no output time from {begin} s to {end} s; the run has times "
                         f"from {time[0]:g} s to {time[-1]:g} s.")
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
    return shapes_of(trajectory.basis, "This run")


def shapes_of(basis: ModalBasis, what: str) -> ModeShapes:
    """The modes of a basis over the body, needed to draw ``what``; InputError without them."""
    if basis.mode_shapes is None:
        raise InputError(f"{what} cannot be drawn: the modal basis holds no shapes over the body; "
                         f"make the basis with modal_basis(body, ...).")
    return basis.mode_shapes


def drawable(trajectory: Trajectory, which: Any = slice(None)) -> NDArray[np.bool_]:
    """Whether the state and the contact forces (F,) are finite and at most 1e100 at output times.

    Lengths of larger vectors would overflow.
    """
    found = [trajectory.states[which], trajectory.normal_force[which],
             trajectory.friction_force[which]]
    return np.all([(np.abs(values) <= LARGEST_DRAWN).all(axis=1) for values in found], axis=0)


def require_drawable(trajectory: Trajectory, which: Any) -> None:
    """Raise InputError unless the run has numbers that can be drawn at some output times."""
    bad = np.flatnonzero(~drawable(trajectory, which))
    if len(bad):
        raise InputError(f"This run cannot be drawn at t = {trajectory.time[which][bad[0]]:.6g} s: "
                         f"its state or contact forces are not finite, or beyond "
                         f"{LARGEST_DRAWN:g}; draw an earlier part (t_end), or check loads, "
                         f"stiffnesses and supports.")


def body_numbers(basis: ModalBasis) -> NDArray[np.int32]:
    """Number (N,) of the body of each mesh node, in the order of ``basis.parts``."""
    assert basis.mode_shapes is not None
    found = np.zeros(len(basis.mode_shapes.nodes), dtype=np.int32)
    for number, part in enumerate(basis.parts):
        found[part.nodes[0] : sum(part.nodes)] = number
    return found


def displacement(field: ModeShapes, q: Array) -> Array:
    """Displacements (F, N, d) of the nodes [m] at modal coordinates q (F, m)."""
    nodes, d, modes = field.shapes.shape
    unit = magnitude(q)
    found = (q / unit) @ field.shapes.reshape(d * nodes, modes).T
    with np.errstate(over="ignore"):
        return np.asarray(found * unit).reshape(len(q), nodes, d)


def von_mises(field: ModeShapes, q: Array) -> Array:
    """Von Mises stress (F, N) at the nodes [Pa] at modal coordinates q (F, m)."""
    nodes, count, terms = field.stress_terms.shape
    components = field.stress_terms.transpose(1, 0, 2).reshape(count * nodes, terms)
    # Squares of large numbers would overflow.
    factors = field.stress_coordinates(q)
    unit = magnitude(factors)
    values = (factors / unit) @ components.T
    size = magnitude(values)
    parts = np.moveaxis((values / size).reshape(len(q), count, nodes), 1, 0)
    with np.errstate(over="ignore"):
        return von_mises_of(parts) * size * unit


def cell_stress(field: ModeShapes, q: Array, cells: Integers | None = None) -> Array:
    """Stresses (F, M, 4) xx, yy, zz, xy, or (F, M, 6) with yz, xz, of the cells [Pa].

    They are the means of their nodes. ``cells`` are those of the field by default.
    """
    cells = field.cells if cells is None else cells
    count, size = len(cells), widths(cells)[:, None, None]
    stress, factors = field.stress_terms, field.stress_coordinates(q)
    _, components, terms = stress.shape
    # Corner by corner: all at once would hold the stress of each cell several times.
    mean = sum(stress[nodes] * (corner < size)
               for corner, nodes in enumerate(cells.T)) / size
    unit = magnitude(factors)
    found = (factors / unit) @ mean.reshape(components * count, terms).T
    with np.errstate(over="ignore"):
        return np.asarray(found * unit).reshape(len(q), count, components)


def contact_forces(trajectory: Trajectory, which: Any = slice(None)) -> Array:
    """Forces (F, n, d) of the other side on the contact nodes, along the axes [N].

    ``F n - R t`` with normal and tangent of each node, in space both of its tangents: [-R - F y_R',
    F] on the ground, where y_R' is the slope of the ground below a node, or zero for contact forces
    that stay vertical.
    """
    tangents, normals = contact_directions(trajectory.basis)
    forces = _local_forces(trajectory, which)
    if trajectory.basis.dimension == 2:
        return np.asarray(forces[..., :1] * tangents + forces[..., 1:] * normals)
    axes = np.concatenate([tangents, normals[:, None]], axis=1)
    return np.einsum("fnk,nkd->fnd", forces, axes)


def _local_forces(trajectory: Trajectory, which: Any) -> Array:
    """Forces (F, n, d) on the contact nodes along tangents and normals [N]."""
    normal, along = trajectory.normal_force[which], -trajectory.friction_force[which]
    ground, basis = trajectory.system.ground, trajectory.basis
    follows = ground.wavy and ground.normal == "surface"
    if basis.dimension == 3:
        tangential = -trajectory.friction_forces[which]
        if follows:
            tangential = tangential - (basis.ground_nodes * normal)[..., None] * (
                _slopes_below(trajectory, which))
        return np.concatenate([tangential, normal[..., None]], axis=-1)
    if follows:
        places = basis.contact_x + trajectory.modal_coordinates[which] @ basis.contact_T[:, 0].T
        along = along - basis.ground_nodes * normal * np.array([
            ground.slope(place, time)
            for place, time in zip(places, trajectory.time[which], strict=True)])
    return np.stack([along, normal], axis=-1)


def _slopes_below(trajectory: Trajectory, which: Any) -> Array:
    """Slopes (F, n, 2) of the ground along x and y below the contact nodes of solids."""
    system, basis = trajectory.system, trajectory.basis
    travel = np.array([system.prescribed_motion.travel(float(time))
                       for time in trajectory.time[which]])
    moved = np.einsum("fm,nkm->fnk", trajectory.modal_coordinates[which],
                      basis.contact_T[:, :2])
    places = basis.contact_places[:, :2] + moved - travel
    return ground_shape(system.ground, places[..., 0], places[..., 1])[..., 1:]


def ground_shape(ground: "Ground", x: Array, y: Array) -> Array:
    """Height [m] and slopes along x and y (..., 3) of ground at places of its own frame."""
    if ground.height_map is not None:
        return ground.height_map.shape(x, y)[..., :3]
    a, b = ground.wave_direction
    along = a * x + b * y + ground.travel(0.0)
    slope = ground.slope(along)
    return np.stack([ground.height(along), a * slope, b * slope], axis=-1)


def nodal_contact_force(trajectory: Trajectory, which: Any = slice(None)) -> Array:
    """Contact forces (F, N, d) along the axes, distributed over the mesh nodes [N].

    What acts on one body acts reversed on the other one, at the feet of its contact nodes; the
    total is preserved.
    """
    field = require_field(trajectory)
    forces = _local_forces(trajectory, which)
    _, n, d = forces.shape
    each = 3 * (d - 1)
    rows = field.restriction.tocsr()[2 * each : (2 + n) * each]
    moments = np.zeros((*forces.shape[:2], each - d))
    spread = rows.T @ np.concatenate([forces, moments], axis=2).reshape(len(forces), each * n).T
    return np.asarray(spread).T.reshape(len(forces), len(field.nodes), d)


def contact_owners(basis: ModalBasis) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Mesh nodes (k,) of the contact faces, and the contact node (k,) that each belongs to.

    It is the contact node in whose motion the mesh node has the largest part; of solids one whose
    patch it lies on. Where two bodies meet, the nodes of both faces have one.
    """
    field, n = basis.mode_shapes, basis.contact_nodes
    assert field is not None
    if basis.dimension == 3:
        found = contact_facets(basis).at_nodes(len(field.nodes))
        touching = np.flatnonzero(found >= 0)
        return touching, found[touching].astype(np.intp)
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
    touching, owner = owners or contact_owners(trajectory.basis)
    found = trajectory.contact_state[which]
    states = np.full((len(found), len(field.nodes)), -1, dtype=np.int8)
    states[:, touching] = found[:, owner]
    return states


def blocks(indices: NDArray[np.intp], nodes: int) -> list[NDArray[np.intp]]:
    """Blocks of the chosen times, small enough for four doubles per node to stay in cache."""
    size = max(1, 2**20 // (4 * nodes))
    return [indices[first : first + size] for first in range(0, len(indices), size)]
