"""Points of interest: rows that map nodal displacements to a point's displacement and rotation.

Every function returns sparse rows (3, 2 N): displacement x, y and rotation phi of the point as
linear functions of the nodal displacements. Their transpose distributes a force at the point over
the nodes, with the same virtual work.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from fecontact.core.checks import as_pair
from fecontact.core.errors import InputError, MeshError, choices, nearest, require_positive
from fecontact.core.types import Array, Integers
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.interpolation import interpolation

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Patch:
    """The part of the outline within a distance of a place, with its mean motion.

    Parameters
    ----------
    at : str or (x, y)
        Name of a point of the mesh, or a place [m].
    radius : float
        Distance, positive [m].

    Raises
    ------
    InputError
        For a radius that is not positive, or a place that is not a pair of finite numbers.
    """

    at: Annotated[str | tuple[float, float], Unit("m")]
    radius: Annotated[float, Unit("m")]

    def __post_init__(self) -> None:
        require_positive("Patch", radius=self.radius)
        if not isinstance(self.at, str):
            object.__setattr__(self, "at", as_pair(self.at, "Patch: at"))


Place = str | tuple[float, float] | Patch


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of one point: sparse (3, 2 N) matrix, and the point's reference place (2,) [m]."""

    matrix: Any
    position: Array


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of straight edges: nodes (k, degree + 1), from s = start to s = end in [0, 1]."""

    nodes: Integers
    start: Array
    end: Array


def place_rows(body: ElasticBody, place: Place, name: str) -> Rows:
    """Rows of a place: a mesh point, a boundary, coordinates or a patch.

    Raises
    ------
    MeshError, InputError
        If the mesh has no such name, or the place lies outside the body.
    """
    mesh = body.mesh
    if isinstance(place, Patch):
        centre = _centre(body, place.at, name)
        pieces = _within(body, centre, place.radius)
        if not len(pieces.nodes):
            raise InputError(f"Point {name}: no part of the outline lies within "
                             f"{place.radius:g} m of ({centre[0]:g}, {centre[1]:g}); choose a "
                             f"place on the outline or a larger radius.")
        return patch_rows(body, pieces)
    if isinstance(place, str):
        if place in mesh.boundaries:
            return patch_rows(body, whole(body.edge_nodes(mesh.boundaries[place])))
        if place in mesh.points:
            nodes = mesh.points[place]
            return node_rows(body, int(nodes[0])) if len(nodes) == 1 else _node_set_rows(
                body, nodes)
        known = {*mesh.points, *mesh.boundaries}
        raise MeshError(f"Point {name}: the mesh has no point or boundary '{place}'"
                        f"{nearest(place, known)}; it has: {choices(known)}.")
    centre = _centre(body, place, name)
    distance = np.linalg.norm(body.nodes - centre, axis=1)
    if distance.min() < 1e-9 * mesh.extent:
        return node_rows(body, int(np.argmin(distance)))
    return Rows(rotating_rows(len(body.nodes), *interpolation(
        body.nodes, body.basis.element_dofs.T, centre, f"Point {name}")), centre)


def rotating_rows(count: int, nodes: Integers, weights: Array) -> Any:
    """Sparse rows (3, 2 N) from weights (3, k) of the value and its derivatives at k of N nodes."""
    import scipy.sparse as sp

    value, slope_x, slope_y = weights
    data = np.concatenate([value, value, -0.5 * slope_y, 0.5 * slope_x])
    row = np.repeat([0, 1, 2, 2], len(nodes))
    column = np.concatenate([2 * nodes, 2 * nodes + 1, 2 * nodes, 2 * nodes + 1])
    return sp.csr_array(sp.coo_array((data, (row, column)), shape=(3, 2 * count)))


def node_rows(body: ElasticBody, node: int) -> Rows:
    """Rows of a displacement node; its rotation is the mean of the adjacent elements."""
    return Rows(node_matrix(body, np.array([node])), body.nodes[node])


def node_matrix(body: ElasticBody, nodes: Integers) -> Any:
    """Rows (3 k, 2 N) of k displacement nodes, one after the other."""
    import scipy.sparse as sp

    dx, dy = body.gradients
    chosen = sp.csr_array((np.ones(len(nodes)), (np.arange(len(nodes)), nodes)),
                          shape=(len(nodes), len(body.nodes)))
    parts = [(chosen, [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]),
             (0.5 * dx[nodes], [[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
             (-0.5 * dy[nodes], [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])]
    return sp.csr_array(sum(sp.kron(matrix, pattern) for matrix, pattern in parts))


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
    length = np.linalg.norm(places[pieces.nodes[:, -1]] - places[pieces.nodes[:, 0]], axis=1)
    return pieces.nodes, values, (length * half)[:, None] * _WEIGHTS


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


def _centre(body: ElasticBody, at: str | tuple[float, float], name: str) -> Array:
    if isinstance(at, str):
        if at not in body.mesh.points:
            raise MeshError(f"Point {name}: the mesh has no point '{at}'"
                            f"{nearest(at, body.mesh.points)}; its points are: "
                            f"{choices(body.mesh.points)}.")
        return np.asarray(body.mesh.nodes[body.mesh.points[at]].mean(axis=0))
    return np.array(as_pair(at, f"Point {name}"))


def _node_set_rows(body: ElasticBody, nodes: Integers) -> Rows:
    """Rows of several nodes: their best-fitting rigid motion, with equal weights."""
    import scipy.sparse as sp

    centre = body.nodes[nodes].mean(axis=0)
    arm = (body.nodes[nodes] - centre) / ((body.nodes[nodes] - centre) ** 2).sum()
    count = len(nodes)
    data = np.concatenate([np.full(2 * count, 1.0 / count), -arm[:, 1], arm[:, 0]])
    row = np.repeat([0, 1, 2, 2], count)
    column = np.concatenate([2 * nodes, 2 * nodes + 1, 2 * nodes, 2 * nodes + 1])
    shape = (3, 2 * len(body.nodes))
    return Rows(sp.csr_array(sp.coo_array((data, (row, column)), shape=shape)), centre)
