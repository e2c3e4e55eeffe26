r"""Cyclic symmetry: one sector of a wheel of N equal ones.

With alpha = 2 pi / N and the rotation R by alpha about the axis, motions of the nodal diameter k
repeat from sector to sector with the phase k alpha,

.. math:: u_{s+1} = e^{i k \alpha} R u_s, \qquad u_H = e^{i k \alpha} R u_L

for the nodes L and H of the faces that meet the neighbours: H of one is L of the next.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from fecontact.core.checks import as_direction, as_place, is_numeric, require_kind
from fecontact.core.errors import InputError, MeshError, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Coordinates, Integers
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.equations import facets_of_boundary
from fecontact.fem.rotation import cross_matrix

# Names of bodies of the next sector begin so.
NEXT = "next_"
# Distance of nodes that match, and of a node on the axis, relative to that of neighbours.
_MATCH, _ON_AXIS = 1e-3, 1e-6
# Distance of tied faces, relative to the mean size of facets.
_REACH = 0.05
# Difference between what supports allow at two nodes that match.
_SAME = 1e-9


@dataclass(frozen=True)
class CyclicSymmetry:
    """Cyclic symmetry: both faces of a sector to its neighbours, and the number of sectors.

    Parameters
    ----------
    low, high : str
        Boundaries of the mesh; ``high`` is ``low`` turned by 360 / N degrees about the axis by the
        right-hand rule. Their nodes must match unless they are tied.
    sectors : int
        N, two or more.
    centre : (x, y) or (x, y, z)
        A point of the axis; two numbers in a solid have z = 0 [m].
    axis : (x, y, z)
        Direction of the axis, of any length above zero; of plane bodies z.
    tied : bool
        For faces of different meshes: the nodes of ``high`` follow the facets of ``low``, turned,
        as in :class:`~fecontact.fem.Tie`. Give ``low`` the coarser mesh.

    Raises
    ------
    InputError
        For values out of range.
    """

    low: str
    high: str
    sectors: int
    centre: Annotated[Coordinates, Unit("m")] = (0.0, 0.0)
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    tied: bool = False

    def __post_init__(self) -> None:
        require_kind("CyclicSymmetry", str, low=self.low, high=self.high)
        require_kind("CyclicSymmetry", int, sectors=self.sectors)
        require_kind("CyclicSymmetry", bool, tied=self.tied)
        if self.low == self.high:
            raise InputError(f"CyclicSymmetry: low and high are both '{self.low}'; name the two "
                             f"faces that meet the neighbours.")
        if self.sectors < 2:
            raise InputError(f"CyclicSymmetry: sectors = {self.sectors} must be two or more.")
        object.__setattr__(self, "centre", as_place(
            self.centre if is_numeric(self.centre) else (), "CyclicSymmetry: centre"))
        object.__setattr__(self, "axis", as_direction(
            self.axis if is_numeric(self.axis) else (), "CyclicSymmetry: axis"))
        if len(self.axis) != 3:
            raise InputError(f"CyclicSymmetry: axis = {shown(self.axis)} must have three "
                             f"components, x, y and z.")

    @property
    def angle(self) -> float:
        """Angle alpha between neighbours [rad]."""
        return 2.0 * np.pi / self.sectors

    @property
    def diameters(self) -> range:
        """Nodal diameters k from 0 to N / 2."""
        return range(self.sectors // 2 + 1)

    def is_real(self, diameter: int) -> bool:
        """True for k = 0 and N / 2, whose modes are real and single; others are double."""
        return diameter == 0 or 2 * diameter == self.sectors

    def turned(self, places: Array, sectors: float = 1.0) -> Array:
        """Places (n, d) turned about the axis by some sectors [m]."""
        centre = np.array([*self.centre, 0.0][: places.shape[1]])
        return np.asarray(centre + (places - centre) @ self.rotation(
            places.shape[1], sectors).T)

    def rotation(self, dimension: int, sectors: float = 1.0) -> Array:
        """Matrix (d, d) of the rotation by some sectors."""
        S = cross_matrix(self.axis)
        angle = sectors * self.angle
        R = np.eye(3) + np.sin(angle) * S + (1.0 - np.cos(angle)) * (S @ S)
        return R[:dimension, :dimension]

    def next_sector(self, bodies: Mapping[str, ElasticBody]) -> dict[str, ElasticBody]:
        """Bodies of the next sector, turned by alpha and named ``next_NAME``, without supports.

        Pair faces with them by :func:`~fecontact.fem.pair_faces` where a body touches the next
        sector; see :func:`fecontact.reduction.cyclic_basis`.
        """
        from scipy.spatial.transform import Rotation as Turn

        require_kind("next_sector", Mapping, bodies=bodies)
        found = {}
        for name, body in bodies.items():
            require_kind(f"next_sector: body '{name}'", ElasticBody, body=body)
            R = self.rotation(body.dimension)
            centre = np.array([*self.centre, 0.0][: body.dimension])
            angles = (360.0 / self.sectors if body.dimension == 2 else
                      Turn.from_matrix(R).as_euler("xyz", degrees=True))
            mesh = body.mesh.placed(centre - R @ centre, angles)
            found[f"{NEXT}{name}"] = replace(body, mesh=mesh, fixed={})
        return found

    def radii(self, places: Array) -> Array:
        """Distances (n,) of places (n, d) from the axis [m]."""
        arm = np.zeros((len(places), 3))
        arm[:, : places.shape[1]] = places - np.array([*self.centre, 0.0][: places.shape[1]])
        return np.linalg.norm(np.cross(self.axis, arm), axis=1)


@read_only_arrays
@dataclass(frozen=True, eq=False)
class SectorNodes:
    """Nodes of a sector on its faces ``low`` and ``high``, and ``on_axis``; no node is in two.

    ``low[i]`` and ``high[i]`` are the two places of one node of the wheel. Tied faces have no such
    pairs: displacements of ``high`` are then ``weights``, sparse (d h, d N), times those of all
    nodes, turned by one sector.
    """

    low: Integers
    high: Integers
    on_axis: Integers
    weights: Any = None


def sector_nodes(body: ElasticBody, symmetry: CyclicSymmetry) -> SectorNodes:
    """Pair the nodes of the two faces of a sector.

    Raises
    ------
    MeshError
        For boundaries that the mesh does not have, or whose nodes do not match under the rotation.
    InputError
        For a plane body with an axis in its plane, for constraints, hinges, masses and springs at
        points, and for supports that differ on the two faces.
    """
    require_kind("sector_modes", CyclicSymmetry, symmetry=symmetry)
    if body.dimension == 2 and (len(symmetry.centre) != 2 or symmetry.axis != (0.0, 0.0, 1.0)):
        raise InputError("CyclicSymmetry: the axis of a plane body is z through a centre (x, y); "
                         "leave axis and the third number out.")
    if body.equations or body.hinges or body.added:
        raise InputError("sector_modes is for sectors without constraints, hinges, masses and "
                         "springs at points; leave them out, or model the whole wheel.")
    low, high = (np.asarray(np.unique(body.facet_nodes(body.mesh.boundary(name))))
                 for name in (symmetry.low, symmetry.high))
    step = _spacing(body, symmetry.low)
    central = symmetry.radii(body.nodes[low]) <= _ON_AXIS * body.mesh.extent
    on_axis, low = low[central], low[~central]
    high = high[symmetry.radii(body.nodes[high]) > _ON_AXIS * body.mesh.extent]
    turned = symmetry.turned(body.nodes[low])
    if not len(low) or not len(high):
        raise MeshError(f"CyclicSymmetry: all nodes of '{symmetry.low}' or '{symmetry.high}' lie "
                        f"on the axis; name the faces that meet the neighbours.")
    if symmetry.tied:
        return _tied(body, symmetry, SectorNodes(low, high, on_axis))
    distance, which = _nearest(turned, body.nodes[high])
    if len(low) != len(high) or distance.max() > _MATCH * step or (
            len(np.unique(which)) != len(which)):
        raise MeshError(_mismatch(body, symmetry, low, high, distance))
    _require_same_supports(body, symmetry, low[which], high)
    return SectorNodes(low[which], high, on_axis)


def _tied(body: ElasticBody, symmetry: CyclicSymmetry, nodes: SectorNodes) -> SectorNodes:
    """Nodes of the high face with weights on those of the low one.

    Raises
    ------
    MeshError
        For a node that is not near the other face.
    InputError
        For supports that differ on the two faces.
    """
    import scipy.sparse as sp

    d, high = body.dimension, nodes.high
    face = facets_of_boundary(body, symmetry.low)
    back = symmetry.turned(body.nodes[high], -1.0)
    facet, local, distance = face.closest(back)
    reach = _REACH * float((face.shape_integrals.sum(axis=1) ** (1.0 / (d - 1))).mean())
    if distance.max() > reach:
        raise MeshError(_mismatch(body, symmetry, nodes.low, high, distance))
    each = face.following(back, facet, local)
    count, k = each.shape[:2]
    columns = d * face.nodes[facet][:, None, :, None] + np.arange(d)
    rows = np.repeat(np.arange(count * d), k * d)
    weights = sp.csr_array(sp.coo_array(
        (np.swapaxes(each, 1, 2).ravel(),
         (rows, np.broadcast_to(columns, (count, d, k, d)).ravel())),
        shape=(count * d, body.unknowns)))
    found = SectorNodes(nodes.low, high, nodes.on_axis, weights)
    B, _ = cyclic_expansion(body, symmetry, found, 0)
    held = np.zeros(body.unknowns, dtype=bool)
    held[body.fixed_dofs] = True
    moves = np.asarray(abs(B).sum(axis=1)).ravel() > _SAME
    differs = (moves == held).reshape(-1, d)[high].any(axis=1)
    if differs.any():
        raise InputError(_other_supports(body, symmetry, high[int(np.argmax(differs))]))
    return found


def _spacing(body: ElasticBody, boundary: str) -> float:
    """Least length of an edge of a boundary [m]."""
    ends = body.mesh.nodes[body.mesh.boundary(boundary)]
    return float(np.linalg.norm(np.diff(ends, axis=1), axis=2).min())


def _nearest(places: Array, wanted: Array) -> tuple[Array, Integers]:
    from scipy.spatial import cKDTree

    distance, which = cKDTree(places).query(wanted)
    return np.asarray(distance), np.asarray(which)


def _mismatch(
    body: ElasticBody, symmetry: CyclicSymmetry, low: Integers, high: Integers, distance: Array
) -> str:
    """Reason why the faces do not match: the numbers of nodes, N, their order, or the mesh."""
    worst = int(np.argmax(distance))
    where = ", ".join(f"{x:g}" for x in body.nodes[high[worst]])
    what = (f"CyclicSymmetry: '{symmetry.low}' turned by 360 / {symmetry.sectors} degrees does not "
            f"match '{symmetry.high}': ")
    what += (f"they have {len(low)} and {len(high)} nodes off the axis, and t"
             if len(low) != len(high) and not symmetry.tied else "t")
    what += f"he node at ({where}) is {distance[worst]:.3g} m from its partner; "
    close = _MATCH * _spacing(body, symmetry.low)
    for turns, remedy in ((-1.0, "exchange low and high"), *(
            (symmetry.sectors / n, f"give sectors = {n}") for n in _possible(body, symmetry,
                                                                             low, high))):
        found, _ = _nearest(symmetry.turned(body.nodes[low], turns), body.nodes[high])
        if len(low) == len(high) and found.max() <= close:
            return f"{what}{remedy}."
    same = "" if symmetry.tied else ", and give both faces the same mesh, or tied = True"
    return f"{what}check axis, centre and sectors{same}."


def _possible(
    body: ElasticBody, symmetry: CyclicSymmetry, low: Integers, high: Integers
) -> list[int]:
    """Numbers of sectors near the angle between the middles of the faces."""
    d = body.dimension
    arms = [body.nodes[one].mean(axis=0) - np.array([*symmetry.centre, 0.0][:d])
            for one in (low, high)]
    first, second = (np.array([*arm, 0.0][:3]) for arm in arms)
    axis = np.array(symmetry.axis)
    angle = abs(np.arctan2(axis @ np.cross(first, second), first @ second
                           - (axis @ first) * (axis @ second)))
    return [round(2.0 * np.pi / angle)] if angle > 1e-3 else []


def _require_same_supports(
    body: ElasticBody, symmetry: CyclicSymmetry, low: Integers, high: Integers
) -> None:
    d = body.dimension
    moving = np.ones(body.unknowns)
    moving[body.fixed_dofs] = 0.0
    free = moving.reshape(-1, d)
    R = symmetry.rotation(d)
    turned = np.einsum("ij,nj,kj->nik", R, free[low], R)
    differs = np.abs(turned - free[high][:, :, None] * np.eye(d)).max(axis=(1, 2)) > _SAME
    if differs.any():
        raise InputError(_other_supports(body, symmetry, high[int(np.argmax(differs))]))


def _other_supports(body: ElasticBody, symmetry: CyclicSymmetry, node: int) -> str:
    x = ", ".join(f"{value:g}" for value in body.nodes[node])
    return (f"CyclicSymmetry: supports hold other directions on '{symmetry.high}' at ({x}) than on "
            f"'{symmetry.low}', turned; hold all directions there, or that along the axis.")


def cyclic_expansion(
    body: ElasticBody, symmetry: CyclicSymmetry, nodes: SectorNodes, diameter: int
) -> tuple[Any, Any]:
    """Displacements from independent unknowns of a nodal diameter, and these from displacements.

    B, sparse (d N, n), and its left inverse, sparse (n, d N); real for k = 0 and N / 2, else
    complex. Columns are displacements that no support holds, without those of ``high``. On the
    axis motions satisfy ``u = e^{i k alpha} R u``: along it for k = 0, across it for k = 1.
    """
    import scipy.sparse as sp

    d, size = body.dimension, body.unknowns
    phase = np.exp(1j * diameter * symmetry.angle)
    turn = phase * symmetry.rotation(d)
    if symmetry.is_real(diameter):
        turn = turn.real
    free = np.ones(size, dtype=bool)
    free[body.fixed_dofs] = False
    own = free.reshape(-1, d).copy()
    own[nodes.high] = own[nodes.on_axis] = False
    rows = np.flatnonzero(own.ravel())
    column = np.full(size, -1)
    column[rows] = np.arange(len(rows))
    parts = [(rows, column[rows], np.ones(len(rows), dtype=turn.dtype))]
    inverse = [(column[rows], rows, np.ones(len(rows), dtype=turn.dtype))]
    count = len(rows)
    for node in nodes.on_axis:
        allowed = _allowed(turn, free[d * node : d * node + d])
        for motion in allowed.T:
            at = d * node + np.arange(d)
            parts.append((at, np.full(d, count), motion))
            inverse.append((np.full(d, count), at, motion.conj()))
            count += 1

    def matrix(entries: list[Any], shape: tuple[int, int]) -> Any:
        where, columns, values = (np.concatenate(one) for one in zip(*entries, strict=True))
        return sp.csc_array(sp.coo_array((values, (where, columns)), shape=shape))

    own_motions = matrix(parts, (size, count))
    places = (d * nodes.high[:, None] + np.arange(d)).ravel()
    seen = own_motions[(d * nodes.low[:, None] + np.arange(d)).ravel()] if (
        nodes.weights is None) else nodes.weights @ own_motions
    follow = sp.coo_array(sp.kron(sp.eye_array(len(nodes.high)), turn) @ seen)
    following = sp.csc_array(sp.coo_array(
        (follow.data, (places[follow.row], follow.col)), shape=own_motions.shape))
    return own_motions + following, matrix(inverse, (count, size))


def _allowed(turn: Array, free: Array) -> Array:
    """Orthonormal motions (d, a) of a node on the axis that turns into itself, where it is free."""
    conditions = np.vstack([turn - np.eye(len(turn)), np.diag(1.0 - free)])
    _, values, directions = np.linalg.svd(conditions)
    return np.asarray(directions[values < 1e-9].conj().T)
