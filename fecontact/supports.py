"""Supports: which motions of the nodes are free, and which rigid motions they leave."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError, MeshError, choices, nearest

if TYPE_CHECKING:
    from fecontact.body import ElasticBody

Array = NDArray[np.float64]

KINDS = ("x", "y", "xy", "hinge")


def check_supports(body: "ElasticBody") -> None:
    """Raise unless the supports name boundaries or points of the mesh and known kinds."""
    known = {*body.mesh.boundaries, *body.mesh.points}
    for name, kind in body.fixed.items():
        if name not in known:
            raise MeshError(f"The mesh has no boundary or point '{name}' to be fixed"
                            f"{nearest(name, known)}; it has: {choices(known)}.")
        if kind not in KINDS:
            raise InputError(f"ElasticBody: fixed['{name}'] = {kind!r} must be one of "
                             f"{choices(KINDS)}.")


def fixed_dofs(body: "ElasticBody") -> NDArray[np.int64]:
    """Degrees of freedom held at zero, ascending."""
    held: list[NDArray[np.int64]] = [np.empty(0, np.int64)]
    for name, kind in body.fixed.items():
        nodes = _support_nodes(body, name)
        if kind == "hinge" and len(nodes) > 1:
            continue
        held += [2 * nodes + axis for axis in range(2) if "xy"[axis] in kind or kind == "hinge"]
    return np.unique(np.concatenate(held))


def hinges(body: "ElasticBody") -> list[tuple[NDArray[np.int64], Array]]:
    """Nodes and centre (2,) [m] of each boundary that turns rigidly about its centre."""
    found = []
    for name, kind in body.fixed.items():
        nodes = _support_nodes(body, name)
        if kind == "hinge" and len(nodes) > 1:
            found.append((nodes, _centre(body, name, nodes)))
    return found


def expansion(body: "ElasticBody") -> Any:
    """All degrees of freedom from the free ones, sparse (2 N, f).

    The free ones are the displacements that no support holds, then one angle per hinge.
    """
    import scipy.sparse as sp

    size = 2 * len(body.nodes)
    turning = hinges(body)
    taken = [np.concatenate([2 * nodes, 2 * nodes + 1]) for nodes, _ in turning]
    held = np.concatenate([body.fixed_dofs, *taken]).astype(np.int64)
    if len(np.unique(held)) < len(held):
        raise InputError("Two supports hold the same node, one of them a hinge; separate them.")
    free = np.setdiff1d(np.arange(size), held)
    rows, columns, values = [free], [np.arange(len(free))], [np.ones(len(free))]
    for index, (nodes, centre) in enumerate(turning):
        arm = body.nodes[nodes] - centre
        rows += [2 * nodes, 2 * nodes + 1]
        columns.append(np.full(2 * len(nodes), len(free) + index))
        values += [-arm[:, 1], arm[:, 0]]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csc_array(sp.coo_array(entries, shape=(size, len(free) + len(turning))))


def rigid_modes(body: "ElasticBody") -> Array:
    """Mass-normalised rigid modes (2 N, r) that the supports leave, r = 0 ... 3.

    Translation in x, in y, and a counter-clockwise rotation about the place where the lines of
    the held displacements meet, about the centre of mass where they leave it open.
    """
    M = body.mass
    x, y = body.nodes.T
    held_x, held_y = (body.fixed_dofs[body.fixed_dofs % 2 == axis] // 2 for axis in range(2))
    centres = np.array([centre for _, centre in hinges(body)]).reshape(-1, 2)
    lines_x = np.concatenate([x[held_y], centres[:, 0]])
    lines_y = np.concatenate([y[held_x], centres[:, 1]])
    ones = np.zeros(2 * len(x))
    ones[0::2] = 1.0
    inertia = (M @ ones)[0::2] / (ones @ (M @ ones))
    pivot_x = lines_x.mean() if lines_x.size else inertia @ x
    pivot_y = lines_y.mean() if lines_y.size else inertia @ y
    shapes = np.column_stack([ones, np.roll(ones, 1)])[:, [not lines_y.size, not lines_x.size]]
    off = np.concatenate([lines_x - pivot_x, lines_y - pivot_y])
    if np.abs(off).max(initial=0.0) <= 1e-9 * body.mesh.extent:
        rotation = np.column_stack([pivot_y - y, x - pivot_x]).ravel()
        rotation[body.fixed_dofs] = 0.0
        shapes = np.column_stack([shapes, rotation])
    for column in range(shapes.shape[1]):
        for _ in range(2):
            earlier = shapes[:, :column]
            shapes[:, column] -= earlier @ (earlier.T @ (M @ shapes[:, column]))
        shapes[:, column] /= np.sqrt(shapes[:, column] @ (M @ shapes[:, column]))
    return shapes


def _support_nodes(body: "ElasticBody", name: str) -> NDArray[np.int64]:
    # Meshes may hold a group both ways; only the boundary has the nodes in the middle of edges.
    if name in body.mesh.boundaries:
        return np.unique(body.edge_nodes(body.mesh.boundaries[name]))
    return np.asarray(body.mesh.points[name])


def _centre(body: "ElasticBody", name: str, nodes: NDArray[np.int64]) -> Array:
    if name not in body.mesh.boundaries:
        return np.asarray(body.nodes[nodes].mean(axis=0))
    ends = body.mesh.nodes[body.mesh.boundaries[name]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.asarray((lengths @ ends.mean(axis=1)) / lengths.sum())
