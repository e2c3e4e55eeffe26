"""Displacement and rotation of reference points, as rows over the displacements of the nodes.

The equations of all constraints read ``C_u u + C_m m = 0`` with the motions m of reference points.
As many of them as determine m, chosen by pivoting, give ``m = -C_m^-1 C_u u``; supports hold some
components at zero, and those that move no node are taken as zero.
"""

from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.constraints import Coupling, Tie
from fecontact.fem.equations import Unknowns, constraint_equations

# Singular value, relative to the largest, of motions that move no node.
_UNSEEN = 1e-9


def displacement_rows(body: Any, at: int | tuple[int, int]) -> Any:
    """Rows, sparse (3, 2 N) or (6, 3 N), of a node or the middle of an edge, without rotation."""
    import scipy.sparse as sp

    unknowns = Unknowns(body)
    parts = unknowns.of_node(at)
    d = unknowns.d
    rows = np.tile(np.arange(d), len(parts))
    return sp.csr_array((np.full(len(rows), 1.0 / len(parts)), (rows, np.concatenate(parts))),
                        shape=(3 * (d - 1), body.nodes.size))


def reference_motions(body: Any) -> dict[str, Any]:
    """Rows, sparse (3, 2 N) or (6, 3 N), of each reference point by name."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    unknowns = Unknowns(body)
    size, first = unknowns.angles, unknowns.angles + len(body.hinges)
    moving = np.setdiff1d(np.arange(first, unknowns.count), unknowns.held)
    C = sp.csr_array(sp.vstack([sp.csr_array((0, unknowns.count)), *(
        one.matrix for one in constraint_equations(unknowns))]))
    C = C[abs(C[:, moving]).sum(axis=1) > 0.0]
    C_m, C_u = sp.csr_array(C[:, moving]), sp.csr_array(C[:, :size])
    # Rotations count with the length of the body.
    turning = np.concatenate([turns for _, turns in unknowns.motions.values()])
    scale = np.where(np.isin(moving, turning), 1.0 / body.mesh.extent, 1.0)
    found = sp.lil_array((unknowns.count, size))
    found.setdiag(1.0)
    # Signs aside, as arms on both sides of a reference point would cancel.
    parts, label = connected_components(abs(C_m).T @ abs(C_m), directed=False)
    for part in range(parts):
        own = np.flatnonzero(label == part)
        rows = np.unique(C_m[:, own].nonzero()[0])
        if len(rows):
            found[moving[own]] = _determined(C_m[rows][:, own].toarray() * scale[own],
                                             C_u[rows], scale[own])
    found = sp.csr_array(found)
    return {name: sp.csr_array(found[np.concatenate([shift, turns])])
            for name, (shift, turns) in unknowns.motions.items()}


def reference_position(body: Any, name: str) -> Array:
    """Place (d,) of a reference point; that of a control point is the middle of its face."""
    if not any(isinstance(one, Coupling) and one.reference == name for one in body.equations):
        for one in body.equations:
            if isinstance(one, Tie) and one.control == name:
                return np.asarray(body.nodes[body.group_nodes(one.independent)].mean(axis=0))
        if name not in body.mesh.points:
            return np.asarray(body.nodes.mean(axis=0))
    return Unknowns(body).place(name)


def _determined(C_m: Array, C_u: Any, scale: Array) -> Any:
    """Sparse rows (r, d N) of r motions, of which ``C_m`` (k, r) is scaled by ``scale``."""
    import scipy.sparse as sp
    from scipy.linalg import qr

    triangle, order = qr(C_m.T, mode="r", pivoting=True)
    sizes = np.abs(np.diag(triangle))
    chosen: Integers = order[: np.count_nonzero(sizes > _UNSEEN * sizes[0])]
    inverse = scale[:, None] * np.linalg.pinv(C_m[chosen], rcond=_UNSEEN)
    return sp.csr_array(-sp.csr_array(inverse) @ C_u[chosen])
