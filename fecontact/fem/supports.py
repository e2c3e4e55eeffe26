"""Supports: constraints of nodal displacements, and their elimination."""

from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np

from fecontact.core.errors import InputError, MeshError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_geometry import centres_of
from fecontact.fem.mesh import Mesh

KINDS = {2: ("x", "y", "xy", "hinge"),
         3: ("x", "y", "z", "xy", "xz", "yz", "xyz", "hinge", "hinge_x", "hinge_y", "hinge_z")}
_ROUND = 1e-3  # normals of a round face along its axis, mean square


class HingeSupport(NamedTuple):
    """Nodes (k,) that rotate rigidly about an axis through a centre (d,) [m].

    The axis (3,) is a unit vector; of plane bodies it is z. Motion along the axis is held too.
    """

    nodes: Integers
    centre: Array
    axis: Array


def held_components(dimension: int, name: str, kind: str) -> tuple[int, ...]:
    """Components of the motion of a reference point that a support of this kind holds at zero.

    They count x, y, phi, in space x, y, z, phi_x, phi_y, phi_z, from 0. Kinds are those of other
    points; 'clamped', all; 'hinge_x', all but phi_x; or components with spaces between them.

    Raises
    ------
    InputError
        For another kind.
    """
    names = ("x", "y", "phi") if dimension == 2 else ("x", "y", "z", "phi_x", "phi_y", "phi_z")
    if kind == "clamped":
        return tuple(range(len(names)))
    if kind.startswith("hinge_") and dimension == 3 and kind in KINDS[3]:
        return tuple(k for k, one in enumerate(names) if one != f"phi_{kind[-1]}")
    if kind in KINDS[dimension]:
        return tuple(k for k in range(dimension) if kind == "hinge" or names[k] in kind)
    words = kind.split()
    if not words or not set(words) <= set(names):
        raise InputError(f"ElasticBody: fixed['{name}'] = {kind!r} must be one of "
                         f"{choices((*KINDS[dimension], 'clamped'))}, or some of "
                         f"{choices(names)} with spaces between them.")
    return tuple(k for k, one in enumerate(names) if one in words)


def check_supports(
    mesh: Mesh, fixed: Mapping[str, str], references: Collection[str] = ()
) -> None:
    """Raise unless all supports name groups of the mesh or reference points, and known kinds."""
    known = {*mesh.boundaries, *mesh.points, *references}
    for name, kind in fixed.items():
        if name in references:
            held_components(mesh.dimension, name, kind)
            continue
        if name not in known:
            raise MeshError(f"The mesh has no boundary or point '{name}' to be fixed"
                            f"{nearest(name, known)}; it has: {choices(known)}.")
        if kind not in KINDS[mesh.dimension]:
            raise InputError(f"ElasticBody: fixed['{name}'] = {kind!r} must be one of "
                             f"{choices(KINDS[mesh.dimension])}.")


def fixed_dofs(
    dimension: int, fixed: Mapping[str, str], supported: Mapping[str, Integers]
) -> Integers:
    """Degrees of freedom fixed at zero, ascending.

    ``fixed`` maps the name of each support to its kind, ``supported`` to its displacement nodes.
    """
    held: list[Integers] = [np.empty(0, np.int64)]
    for name, nodes in supported.items():
        kind = fixed[name]
        hinge = kind.startswith("hinge")
        if hinge and len(nodes) > 1:
            continue
        held += [dimension * nodes + axis for axis in range(dimension)
                 if hinge or "xyz"[axis] in kind]
    return np.unique(np.concatenate(held))


def hinges(
    mesh: Mesh, nodes: Array, fixed: Mapping[str, str], supported: Mapping[str, Integers]
) -> list[HingeSupport]:
    """Each boundary that rotates rigidly about an axis through its centre.

    ``nodes`` (N, d) are the places of the displacement nodes [m].
    """
    return [HingeSupport(held, _centre(mesh, nodes[held], name),
                         _axis(mesh, nodes[held], name, fixed[name]))
            for name, held in supported.items()
            if fixed[name].startswith("hinge") and len(held) > 1]


def _centre(mesh: Mesh, places: Array, name: str) -> Array:
    if name not in mesh.boundaries:
        return np.asarray(places.mean(axis=0))
    ends = mesh.nodes[mesh.boundaries[name]]
    if mesh.dimension == 3:
        weights = np.linalg.norm(_area_vectors(ends), axis=1)
    else:
        weights = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.asarray(weights @ centres_of(mesh.nodes, mesh.boundaries[name]) / weights.sum())


def _area_vectors(corners: Array) -> Array:
    """Outward normals times areas (k, 3) of faces (k, n, 3)."""
    diagonal = corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1]
    if corners.shape[1] == 3:
        diagonal = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(0.5 * np.cross(*diagonal))


def _axis(mesh: Mesh, places: Array, name: str, kind: str) -> Array:
    """Unit vector (3,) of a hinge's axis."""
    if mesh.dimension == 2:
        return np.array([0.0, 0.0, 1.0])
    if kind != "hinge":
        return np.eye(3)["xyz".index(kind[-1])]
    if name in mesh.boundaries:
        # Normals of a round face are perpendicular to its axis.
        normals = _area_vectors(mesh.nodes[mesh.boundaries[name]])
        weights = np.linalg.norm(normals, axis=1)
        strength, axes = np.linalg.eigh((normals.T / weights) @ normals / weights.sum())
        if strength[0] < _ROUND and strength[1] > 0.1:
            return np.asarray(axes[:, 0])
    else:
        arm = places - places.mean(axis=0)
        strength, axes = np.linalg.eigh(arm.T @ arm)
        if strength[1] < _ROUND * strength[2]:
            return np.asarray(axes[:, 2])
    raise InputError(f"ElasticBody: fixed['{name}'] = 'hinge' finds no axis, since '{name}' is "
                     f"neither a round face nor a straight line of points; give 'hinge_x', "
                     f"'hinge_y' or 'hinge_z'.")
