"""Points of interest: rows that map nodal displacements to a point's displacement and rotation.

Every function returns sparse rows (3, 2 N): displacement x, y and rotation phi of the point as
linear functions of the nodal displacements; in a solid (6, 3 N): displacements x, y, z and
rotations about x, y, z. Their transpose distributes a force at the point over the nodes, with the
same virtual work.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from typing_extensions import TypeAliasType

from fecontact.core.checks import as_place
from fecontact.core.errors import InputError, MeshError, choices, nearest, require_positive
from fecontact.core.types import Array, Coordinates, Integers
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.mean_motion import TURNS, mean_motion, sampled_rows
from fecontact.fem.faces.surface import Surface
from fecontact.fem.interpolation import interpolation
from fecontact.fem.reference_motions import reference_position

_CURVED = 1e-9  # distance of the middle of an edge from its chord, per length
_FINE = 24  # parts of a facet along each of its sides
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Patch:
    """The part of the outline within a distance of a place, with its mean motion.

    Faces of a solid that lie only partly within are cut to about 1/24 of their size.

    Parameters
    ----------
    at : str, (x, y) or (x, y, z)
        Name of a point of the mesh, or a place [m].
    radius : float
        Distance, positive [m].

    Raises
    ------
    InputError
        For a radius that is not positive, or a place that is not of finite numbers.
    """

    at: Annotated[str | Coordinates, Unit("m")]
    radius: Annotated[float, Unit("m")]

    def __post_init__(self) -> None:
        require_positive("Patch", radius=self.radius)
        if not isinstance(self.at, str):
            object.__setattr__(self, "at", as_place(self.at, "Patch: at"))


Place = TypeAliasType("Place", str | Coordinates | Patch)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of one point: sparse (3, 2 N) or (6, 3 N), and its reference place (2,) or (3,) [m]."""

    matrix: Any
    position: Array


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of straight edges: nodes (k, degree + 1), from s = start to s = end in [0, 1]."""

    nodes: Integers
    start: Array
    end: Array


def place_rows(body: ElasticBody, place: Place, name: str) -> Rows:
    """Rows of a place: a mesh point, a boundary, a reference point, coordinates or a patch.

    Those of a reference point hold for displacements that meet all constraints of the body.

    Raises
    ------
    MeshError, InputError
        If the mesh has no such name, or the place lies outside the body.
    """
    mesh = body.mesh
    if isinstance(place, Patch):
        centre = _centre(body, place.at, name)
        found = (_patch_in_space(body, centre, place.radius) if mesh.dimension == 3
                 else _patch_in_plane(body, centre, place.radius))
        if found is None:
            where = ", ".join(f"{x:g}" for x in centre)
            raise InputError(f"Point {name}: no part of the outline lies within "
                             f"{place.radius:g} m of ({where}); choose a place on the outline or "
                             f"a larger radius.")
        return found
    if isinstance(place, str):
        if place in body.references:
            return Rows(body.motion_rows(place), reference_position(body, place))
        if place in mesh.boundaries and mesh.dimension == 3:
            return face_rows(body, mesh.boundaries[place])
        if place in mesh.boundaries:
            return patch_rows(body, whole(body.edge_nodes(mesh.boundaries[place])))
        if place in mesh.points:
            nodes = mesh.points[place]
            return node_rows(body, int(nodes[0])) if len(nodes) == 1 else Rows(*mean_motion(
                len(body.nodes), nodes, body.nodes[nodes], np.ones(len(nodes))))
        known = {*mesh.points, *mesh.boundaries, *body.references}
        raise MeshError(f"Point {name}: the mesh has no point or boundary '{place}'"
                        f"{nearest(place, known)}; it has: {choices(known)}.")
    centre = _centre(body, place, name)
    distance = np.linalg.norm(body.nodes - centre, axis=1)
    if distance.min() < 1e-9 * mesh.extent:
        return node_rows(body, int(np.argmin(distance)))
    return Rows(rotating_rows(len(body.nodes), *interpolation(
        body.nodes, body.elements, centre, f"Point {name}")), centre)


def rotating_rows(count: int, nodes: Integers, weights: Array) -> Any:
    """Sparse rows from weights (1 + d, k) of the value and its derivatives at k of N nodes.

    The rotation is half the curl: (3, 2 N) in the plane, (6, 3 N) in space.
    """
    import scipy.sparse as sp

    if len(weights) == 3:
        value, slope_x, slope_y = weights
        data = np.concatenate([value, value, -0.5 * slope_y, 0.5 * slope_x])
        row = np.repeat([0, 1, 2, 2], len(nodes))
        column = np.concatenate([2 * nodes, 2 * nodes + 1, 2 * nodes, 2 * nodes + 1])
        return sp.csr_array(sp.coo_array((data, (row, column)), shape=(3, 2 * count)))
    entries = [(axis, axis, weights[0]) for axis in range(3)]
    for axis, ahead, last in TURNS:
        entries += [(3 + axis, last, 0.5 * weights[1 + ahead]),
                    (3 + axis, ahead, -0.5 * weights[1 + last])]
    data = np.concatenate([part for *_, part in entries])
    row = np.repeat([row for row, *_ in entries], len(nodes))
    column = np.concatenate([3 * nodes + axis for _, axis, _ in entries])
    return sp.csr_array(sp.coo_array((data, (row, column)), shape=(6, 3 * count)))


def node_rows(body: ElasticBody, node: int) -> Rows:
    """Rows of a displacement node; its rotation is the mean of the adjacent elements."""
    return Rows(node_matrix(body, np.array([node])), body.nodes[node])


def node_matrix(body: ElasticBody, nodes: Integers) -> Any:
    """Rows (3 k, 2 N), or (6 k, 3 N), of k displacement nodes, one after the other."""
    import scipy.sparse as sp

    chosen = sp.csr_array((np.ones(len(nodes)), (np.arange(len(nodes)), nodes)),
                          shape=(len(nodes), len(body.nodes)))
    if body.dimension == 2:
        dx, dy = body.gradients
        parts = [(chosen, [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]),
                 (0.5 * dx[nodes], [[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
                 (-0.5 * dy[nodes], [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])]
    else:
        parts = [(chosen, np.eye(6, 3).tolist())]
        for direction, slope in enumerate(body.gradients):
            curl = np.zeros((6, 3))
            for axis, ahead, last in TURNS:
                if direction in (ahead, last):
                    # phi_axis = (d u_last / d x_ahead - d u_ahead / d x_last) / 2
                    curl[3 + axis, last if direction == ahead else ahead] = (
                        0.5 if direction == ahead else -0.5)
            parts.append((slope[nodes], curl.tolist()))
    return sp.csr_array(sum(sp.kron(matrix, pattern) for matrix, pattern in parts))


def face_rows(body: ElasticBody, facets: Integers) -> Rows:
    """Rows of faces (k, 3) or (k, 4) of a solid: their area-weighted best-fitting rigid motion."""
    surface = Surface(body.nodes, body.facet_nodes(facets))
    patch = surface.patches(np.zeros(len(facets), np.int64))
    return Rows(patch.rows(), patch.centres[0])


def patch_rows(body: ElasticBody, pieces: Pieces) -> Rows:
    """Rows of a patch of the outline: its length-weighted best-fitting rigid motion.

    The displacement is the mean over the patch, the rotation the mean moment of the
    displacements about the patch's centroid over its polar second moment. A force on the point
    is a uniform traction.
    """
    import scipy.sparse as sp

    nodes, values, lengths = _sampled(pieces, body.nodes)
    places = np.einsum("kgn,knx->kgx", values, body.nodes[nodes])
    total = lengths.sum()
    centre = np.einsum("kg,kgx->x", lengths, places) / total
    arm = places - centre
    second_moment = np.einsum("kg,kgx->", lengths, arm**2)
    weights = {
        (0, 0): np.einsum("kg,kgn->kn", lengths, values) / total,
        (2, 0): -np.einsum("kg,kgn,kg->kn", lengths, values, arm[..., 1]) / second_moment,
        (2, 1): np.einsum("kg,kgn,kg->kn", lengths, values, arm[..., 0]) / second_moment,
    }
    weights[1, 1] = weights[0, 0]
    entries = [(weight.ravel(), np.full(nodes.size, row), 2 * nodes.ravel() + axis)
               for (row, axis), weight in weights.items()]
    data, row, column = (np.concatenate(part) for part in zip(*entries, strict=True))
    shape = (3, 2 * len(body.nodes))
    return Rows(sp.csr_array(sp.coo_array((data, (row, column)), shape=shape)), centre)


def whole(nodes: Integers) -> Pieces:
    """Whole edges as pieces."""
    return Pieces(nodes, np.zeros(len(nodes)), np.ones(len(nodes)))


def edge_weights(body: ElasticBody, nodes: Integers) -> Array:
    """Integrals (k, degree + 1) of the shape functions over whole edges [m]."""
    return piece_weights(body, whole(nodes))


def piece_weights(body: ElasticBody, pieces: Pieces) -> Array:
    """Integrals (k, degree + 1) of the shape functions over pieces of edges [m]."""
    _, values, lengths = _sampled(pieces, body.nodes)
    return np.einsum("kg,kgn->kn", lengths, values)


def _sampled(
    pieces: Pieces, places: Array
) -> tuple[Integers, Array, Array]:
    """Nodes (k, n), shape functions (k, g, n) and weights (k, g) [m] at Gauss points."""
    half = 0.5 * (pieces.end - pieces.start)
    s = pieces.start[:, None] + half[:, None] * (1.0 + _GAUSS)
    if pieces.nodes.shape[1] == 2:
        values = np.stack([1.0 - s, s], axis=-1)
    else:
        values = np.stack([(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)],
                          axis=-1)
    ends = places[pieces.nodes[:, [0, -1]]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    weights = (length * half)[:, None] * _WEIGHTS
    if pieces.nodes.shape[1] == 3:
        off = places[pieces.nodes[:, 1]] - ends.mean(axis=1)
        curved = np.linalg.norm(off, axis=1) > _CURVED * length
        # x = start + s (end - start) + 4 s (1 - s) off
        along = (ends[:, 1] - ends[:, 0])[:, None] + (4.0 - 8.0 * s)[..., None] * off[:, None]
        weights[curved] = (np.linalg.norm(along, axis=2) * half[:, None] * _WEIGHTS)[curved]
    return pieces.nodes, values, weights


def sampled_edges(places: Array) -> tuple[Array, Array, Array]:
    """Shape functions (g, 3), unit tangents (k, g, 2), weights (k, g) [m] of edges (k, 3, 2)."""
    s = 0.5 * (1.0 + _GAUSS)
    values = np.stack([(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)], -1)
    slopes = np.stack([4.0 * s - 3.0, 4.0 - 8.0 * s, 4.0 * s - 1.0], axis=-1)
    along = np.einsum("gn,knx->kgx", slopes, places)
    lengths = np.linalg.norm(along, axis=2)
    return values, along / lengths[..., None], 0.5 * lengths * _WEIGHTS


def _patch_in_plane(body: ElasticBody, centre: Array, radius: float) -> Rows | None:
    pieces = _within(body, centre, radius)
    return patch_rows(body, pieces) if len(pieces.nodes) else None


def _patch_in_space(body: ElasticBody, centre: Array, radius: float) -> Rows | None:
    """Rows of the part of the outline within a sphere, cut along fine parts of the facets."""
    surface = Surface(body.nodes, body.facet_nodes(body.mesh.outline))
    corners = body.nodes[surface.facets]
    # Only facets whose surrounding box reaches into the sphere.
    reach = np.ptp(corners, axis=1).max(axis=1)[:, None]
    away = np.maximum(corners.min(axis=1) - 0.25 * reach - centre,
                      centre - corners.max(axis=1) - 0.25 * reach)
    surface = surface.only((np.maximum(away, 0.0)**2).sum(axis=1) < radius**2)
    if not len(surface.facets):
        return None
    values, places, _, weights = surface.at(_fine_parts)
    inside = ((places - centre) ** 2).sum(axis=2) <= radius**2
    if not inside.any():
        return None
    which, sample = np.nonzero(inside)
    return Rows(*sampled_rows(len(body.nodes), surface.facets[which], values[which, sample],
                              places[which, sample], weights[which, sample]))


def _fine_parts(count: int) -> tuple[Array, Array]:
    """Centres (g, 2) in local coordinates, and weights (g,), of equal parts of a facet."""
    n = _FINE
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    if count in (4, 8, 9):
        return np.stack([i + 0.5, j + 0.5], axis=1) / n, np.full(n * n, 1.0 / n**2)
    upright, turned = i + j < n, i + j < n - 1
    third = 1.0 / 3.0
    local = np.concatenate([np.stack([i + third, j + third], axis=1)[upright],
                            np.stack([i + 2 * third, j + 2 * third], axis=1)[turned]]) / n
    return local, np.full(n * n, 0.5 / n**2)


def _within(body: ElasticBody, centre: Array, radius: float) -> Pieces:
    nodes = body.edge_nodes(body.mesh.outline)
    begin = body.nodes[nodes[:, 0]] - centre
    along = body.nodes[nodes[:, -1]] - centre - begin
    # |begin + s along| = radius
    a = (along**2).sum(axis=1)
    b = (begin * along).sum(axis=1)
    root = b**2 - a * ((begin**2).sum(axis=1) - radius**2)
    crosses = root > 0.0
    root = np.sqrt(np.where(crosses, root, 0.0))
    start = np.clip((-b - root) / a, 0.0, 1.0)
    end = np.clip((-b + root) / a, 0.0, 1.0)
    kept = crosses & (end > start)
    return Pieces(nodes[kept], start[kept], end[kept])


def _centre(body: ElasticBody, at: str | Coordinates, name: str) -> Array:
    if isinstance(at, str):
        if at not in body.mesh.points:
            raise MeshError(f"Point {name}: the mesh has no point '{at}'"
                            f"{nearest(at, body.mesh.points)}; its points are: "
                            f"{choices(body.mesh.points)}.")
        return np.asarray(body.mesh.nodes[body.mesh.points[at]].mean(axis=0))
    return np.array(as_place(at, f"Point {name}", body.dimension))
