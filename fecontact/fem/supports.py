"""Supports: constraints of nodal displacements, and their elimination."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, MeshError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.mesh import Mesh

KINDS = ("x", "y", "xy", "hinge")


def check_supports(mesh: Mesh, fixed: Mapping[str, str]) -> None:
    """Raise unless all supports name boundaries or points of the mesh, and known kinds."""
    known = {*mesh.boundaries, *mesh.points}
    for name, kind in fixed.items():
        if name not in known:
            raise MeshError(f"The mesh has no boundary or point '{name}' to be fixed"
                            f"{nearest(name, known)}; it has: {choices(known)}.")
        if kind not in KINDS:
            raise InputError(f"ElasticBody: fixed['{name}'] = {kind!r} must be one of "
                             f"{choices(KINDS)}.")


def fixed_dofs(fixed: Mapping[str, str], supported: Mapping[str, Integers]) -> Integers:
    """Degrees of freedom fixed at zero, ascending.

    ``fixed`` maps the name of each support to its kind, ``supported`` to its displacement nodes.
    """
    held: list[Integers] = [np.empty(0, np.int64)]
    for name, kind in fixed.items():
        nodes = supported[name]
        if kind == "hinge" and len(nodes) > 1:
            continue
        held += [2 * nodes + axis for axis in range(2) if "xy"[axis] in kind or kind == "hinge"]
    return np.unique(np.concatenate(held))


def hinges(
    mesh: Mesh, nodes: Array, fixed: Mapping[str, str], supported: Mapping[str, Integers]
) -> list[tuple[Integers, Array]]:
    """Nodes and centre (2,) [m] of each boundary that rotates rigidly about its centre.

    ``nodes`` (N, 2) are the places of the displacement nodes [m].
    """
    return [(supported[name], _centre(mesh, nodes[supported[name]], name))
            for name, kind in fixed.items() if kind == "hinge" and len(supported[name]) > 1]


def expansion(nodes: Array, fixed_dofs: Integers, turning: list[tuple[Integers, Array]]) -> Any:
    """All degrees of freedom from the free ones, sparse (2 N, f).

    The free ones are the displacements without a support, then one angle per hinge.
    """
    import scipy.sparse as sp

    size = 2 * len(nodes)
    taken = [np.concatenate([2 * held, 2 * held + 1]) for held, _ in turning]
    held = np.concatenate([fixed_dofs, *taken]).astype(np.int64)
    if len(np.unique(held)) < len(held):
        raise InputError("Two supports share a node, and one of them is a hinge; separate them.")
    free = np.setdiff1d(np.arange(size), held)
    rows, columns, values = [free], [np.arange(len(free))], [np.ones(len(free))]
    for index, (around, centre) in enumerate(turning):
        arm = nodes[around] - centre
        rows += [2 * around, 2 * around + 1]
        columns.append(np.full(2 * len(around), len(free) + index))
        values += [-arm[:, 1], arm[:, 0]]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csc_array(sp.coo_array(entries, shape=(size, len(free) + len(turning))))


def _centre(mesh: Mesh, places: Array, name: str) -> Array:
    if name not in mesh.boundaries:
        return np.asarray(places.mean(axis=0))
    ends = mesh.nodes[mesh.boundaries[name]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.asarray((lengths @ ends.mean(axis=1)) / lengths.sum())
