"""Contact faces of a basis: places along each interface, directions, and the bodies on both sides.

For what shows or stores results: systems of several bodies have contact nodes on faces of any
direction, whose rows in ``T`` are those of the motion relative to the other side.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.reduction.modal_basis import ModalBasis

_FLAT = 1e-6  # largest slope of a face that counts as one along x


@dataclass(frozen=True, eq=False)
class ContactFace:
    """The contact nodes of one interface, or of a single body on the ground.

    Attributes
    ----------
    name : str
        Name of the interface, or of a contact group of a single body; empty for all its nodes.
    bodies : tuple of str
        Names of the bodies that meet there, and 'ground'; empty for a single body.
    nodes : slice
        Contact nodes of the face among those of the basis.
    abscissa : (k,) array
        Places of the nodes [m]: x on the ground and on faces along x, else the arc length from the
        beginning of the face, which increases along the tangents; x in space.
    axis : 'x' or 's'
        Kind of the abscissa: x, or the length s along the face.
    tributary : (k,) array
        Lengths of the face that the nodes represent [m], in space areas [m^2].
    spring : bool
        True for a nonlinear spring between two points, which is no face.
    nodes_on : str
        Body with the contact nodes, for one of two passes.
    """

    name: str
    bodies: tuple[str, ...]
    nodes: slice
    abscissa: Array
    axis: Literal["x", "s"]
    tributary: Array
    spring: bool = False
    nodes_on: str = ""

    @property
    def title(self) -> str:
        """``shoe: pad and disc``; empty for a single body."""
        bodies = " and ".join(self.bodies) if len(self.bodies) > 1 else (
            f"{self.bodies[0]} with itself" if self.bodies else "")
        nodes = f", nodes on {self.nodes_on}" if self.nodes_on else ""
        return f"{self.name}: {bodies}{nodes}" if bodies else self.name

    @property
    def label(self) -> str:
        """Label of an axis along the face, without its unit."""
        return "contact position x" if self.axis == "x" else "position along the face s"


def several_bodies(basis: ModalBasis) -> bool:
    """Whether the basis has interfaces, rather than contact nodes of one body on the ground."""
    return bool(basis.parts) or basis.contact_normals is not None or basis.on_ground is not None


def contact_directions(basis: ModalBasis) -> tuple[Array, Array]:
    """Tangents (n, 2) and normals (n, 2) of the contact nodes in global axes.

    Normals point out of the other side; a tangent is its normal turned clockwise by 90 degrees. In
    space tangents (n, 2, 3), t and t2, and normals (n, 3).
    """
    normals = basis.normals
    if basis.dimension == 3:
        return basis.tangents, normals
    return np.column_stack([normals[:, 1], -normals[:, 0]]), normals


def contact_faces(basis: ModalBasis) -> tuple[ContactFace, ...]:
    """One face for each interface.

    For a single body one of all its contact nodes, along x; without contact nodes one without name
    and nodes.
    """
    found: dict[str, ContactFace] = {}
    for one in _passes(basis):
        first = found.get(one.name, one)
        found[one.name] = one if first is one else replace(
            first, nodes=slice(first.nodes.start, one.nodes.stop), nodes_on="",
            abscissa=np.append(first.abscissa, one.abscissa),
            axis="x" if first.axis == one.axis == "x" else "s",
            tributary=0.5 * np.append(first.tributary, one.tributary))
    return tuple(found.values())


def _passes(basis: ModalBasis) -> tuple[ContactFace, ...]:
    """Faces as in :func:`contact_faces`, but one for each pass of a two-pass interface.

    Their tributary lengths are not halved.
    """
    x, length = basis.contact_x, np.array(basis.tributary)
    if not several_bodies(basis) or not len(x):
        return (ContactFace("", (), slice(0, len(x)), x, "x", length),)
    ground, (tangents, normals) = basis.ground_nodes, contact_directions(basis)
    places = basis.positions[2 : 2 + len(x)]
    found, first = [], 0
    halves = dict(basis.first_passes)
    sizes = ((name, size) for name, count in basis.groups for size in (
        (halves[name], count - halves[name]) if name in halves else (count,)))
    for name, size in sizes:
        nodes = slice(first, first + size)
        first += size
        length[nodes] *= 2.0 if name in halves else 1.0
        flat = basis.dimension == 3 or bool(
            ground[nodes].all() or np.abs(normals[nodes, 0]).max(initial=0.0) < _FLAT)
        abscissa = x[nodes] if flat else _arc_length(places[nodes], normals[nodes],
                                                     tangents[nodes], length[nodes])
        bodies = _bodies_at(basis, nodes) + ["ground"] * bool(ground[nodes].any())
        if name in basis.springs and len(bodies) == 1:
            bodies.append("base")
        found.append(ContactFace(name, tuple(bodies), nodes, abscissa, "x" if flat else "s",
                                 length[nodes], name in basis.springs,
                                 _owner(basis, nodes) if name in halves else ""))
    return tuple(found)


def touching_faces(basis: ModalBasis, what: str) -> tuple[ContactFace, ...]:
    """The faces of :func:`contact_faces` without nonlinear springs, and one for each pass.

    Raises
    ------
    AnalysisError
        If there are none, for ``what`` is shown on them.
    """
    if not basis.contact_nodes:
        raise AnalysisError(f"There is no {what}: the system has no contact nodes.")
    found = tuple(face for face in _passes(basis) if not face.spring)
    if not found:
        raise AnalysisError(f"There is no {what}: nonlinear springs join the bodies, which touch "
                            f"at no interface.")
    return found


def shown_faces(basis: ModalBasis, what: str) -> tuple[ContactFace, ...]:
    """Faces of :func:`touching_faces`; a single body has one for each of several contact groups."""
    found = touching_faces(basis, what)
    if several_bodies(basis) or len(basis.groups) < 2:
        return found
    ends = np.cumsum([0, *(count for _, count in basis.groups)])
    parts = [slice(int(first), int(end)) for first, end in pairwise(ends)]
    return tuple(ContactFace(name, (), nodes, basis.contact_x[nodes], "x", basis.tributary[nodes])
                 for (name, _), nodes in zip(basis.groups, parts, strict=True))


def node_name(basis: ModalBasis, node: int) -> str:
    """``contact node 3``, or ``shoe: node 3`` with its interface; numbers as in the basis."""
    if not several_bodies(basis):
        return f"contact node {node}"
    ends = np.cumsum([count for _, count in basis.groups])
    return f"{basis.groups[int(np.searchsorted(ends, node, side='right'))][0]}: node {node}"


def mode_names(basis: ModalBasis) -> list[str]:
    """``mode 3`` for each mode, or with its body and counted there, ``pad: mode 3``.

    Modes of linked bodies are those of all of them.
    """
    if sum(part.modes[1] for part in basis.parts) < basis.modes:
        return [f"mode {mode}" for mode in range(basis.modes)]
    return [f"{part.name}: mode {mode}" for part in basis.parts for mode in range(part.modes[1])]


def contact_sides(basis: ModalBasis) -> tuple[Any, Any]:
    """Displacements of the contact nodes and of their feet from those of the mesh nodes.

    Returns
    -------
    (sparse (d n, d N), sparse (d n, d N))
        Along the axes, node by node. What lies on the other side enters the relative rows with
        weights below zero; rows of feet on the ground are zero.
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    field, n = basis.mode_shapes, basis.contact_nodes
    assert field is not None
    d, each = basis.dimension, basis.T.shape[1]
    rows = field.restriction.tocsr()[2 * each : (2 + n) * each]
    local = rows[np.flatnonzero(np.arange(each * n) % each < d)]
    tangents, normals = contact_directions(basis)
    axes = (np.stack([tangents, normals], axis=2) if d == 2 else
            np.swapaxes(np.concatenate([tangents, normals[:, None]], axis=1), 1, 2))
    turned = sp.bsr_array((axes, np.arange(n), np.arange(n + 1)), shape=(d * n, d * n))
    both = sp.csr_array(turned @ local)
    # Of nonlinear springs only the parts along their direction.
    weights = sp.coo_array(sum(both[axis::d][:, axis::d] for axis in range(d)))
    weights.sum_duplicates()
    row, node = weights.coords
    if not len(row):  # springs between coordinates, which lie at no place
        nowhere = sp.csr_array((d * n, d * len(field.nodes)))
        return nowhere, nowhere
    # Mesh nodes of one side hang together along the outline, also where a body touches itself.
    entry = sp.csr_array((np.arange(1, len(row) + 1), (row, node)), shape=weights.shape)
    sides = field.outline
    start, end = sides.T if d == 2 else np.stack(
        [sides, np.roll(sides, -1, axis=1)], axis=2).reshape(-1, 2).T
    used = sp.csr_array((np.ones(len(row)), (row, node)), shape=weights.shape)
    at, edge = (used[:, start] * used[:, end]).nonzero()
    links = sp.coo_array((np.ones(len(at)), (np.asarray(entry[at, start[edge]]).ravel() - 1,
                                             np.asarray(entry[at, end[edge]]).ravel() - 1)),
                         shape=(len(row), len(row)))
    _, side = connected_components(links, directed=False)
    own = np.bincount(side, weights.data)[side] > 0.0
    masks = [sp.kron(sp.coo_array((chosen.astype(float), (row, node)), shape=weights.shape),
                     np.ones((d, d))) for chosen in (own, ~own)]
    return sp.csr_array(both * masks[0]), sp.csr_array(-(both * masks[1]))


def _bodies_at(basis: ModalBasis, nodes: slice) -> list[str]:
    """Names of the bodies with a part in the motion of some contact nodes."""
    moving: Any = ()
    if basis.mode_shapes is not None:
        each = basis.T.shape[1]
        rows = basis.mode_shapes.restriction.tocsr()[
            each * (2 + nodes.start) : each * (2 + nodes.stop)]
        moving = np.unique(rows.indices[rows.data != 0.0] // basis.dimension)
    found = []
    for part in basis.parts:
        if part.nodes[1]:
            touches = np.searchsorted(moving, part.nodes[0]) < np.searchsorted(
                moving, sum(part.nodes))
        else:
            touches = basis.contact_T[nodes, :, part.modes[0] : sum(part.modes)].any()
        if touches:
            found.append(part.name)
    return found


def _owner(basis: ModalBasis, nodes: slice) -> str:
    """The body that contact nodes lie on: its part of their motion has weights of sum one."""
    assert basis.mode_shapes is not None, "faces with two passes have meshes"
    d, each = basis.dimension, basis.T.shape[1]
    row = basis.mode_shapes.restriction.tocsr()[[each * (2 + nodes.start) + d - 1]].toarray()[0]
    along = row.reshape(-1, d) @ basis.normals[nodes.start]
    return max(basis.parts, key=lambda part: along[part.nodes[0] : sum(part.nodes)].sum()).name


def _arc_length(places: Array, normals: Array, tangents: Array, tributary: Array) -> Array:
    """Arc lengths (k,) of nodes in the order of the face, which may be either way.

    Between two nodes the face is taken for a circle's arc that turns as its normals do.
    """
    steps = np.diff(places, axis=0)
    chord = np.linalg.norm(steps, axis=1)
    cosine = (normals[1:] * normals[:-1]).sum(axis=1)
    sine = normals[:-1, 0] * normals[1:, 1] - normals[:-1, 1] * normals[1:, 0]
    half = 0.5 * np.abs(np.arctan2(sine, cosine))
    # Normals of a corner turn without an arc between them.
    half[half > 0.25 * np.pi] = 0.0
    s = np.append(0.0, np.cumsum(chord / np.sinc(half / np.pi)))
    if (steps * (tangents[1:] + tangents[:-1])).sum() < 0.0:
        s = s[-1] - s
    # Outer nodes lie on the ends of the face, or half of their length away from them.
    return s + max(0.5 * (float(tributary.sum()) - float(np.ptp(s))), 0.0)
