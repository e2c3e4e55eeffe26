"""Straight elements along curved boundaries, and how far their chords are from the curve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import edges_around
from fecontact.fem.mesh import Mesh

# Facets that meet at less are one plane, at more they form an edge of the body [rad].
_FLAT, _EDGE = 1e-3, np.radians(44.0)
_LEAST = 4  # directions in succession that make a curve of facets


@dataclass(frozen=True)
class Chords:
    """Straight facets along a curved boundary.

    Attributes
    ----------
    straight : int
        Number of straight facets that follow the curve.
    angle : float
        Largest angle between neighbours [rad].
    error : float
        Largest distance of a chord from the arc of a circle through its ends [m].
    """

    straight: int
    angle: float
    error: float


def chords(mesh: Mesh, boundary: str, least_angle: float = 0.0) -> Chords | None:
    """Straight facets of a boundary that stand for a curve; None without any.

    Neighbours that meet at up to 44 degrees belong to a curve where four different directions or
    more follow each other; a polygon with sharper corners is meant as it is. Neighbours that meet
    at less than ``least_angle`` [rad] are left out.
    """
    facets = mesh.boundary(boundary)
    facets = facets[~_curved(mesh, facets)]
    if len(facets) < _LEAST:
        return None
    normals = _normals(mesh.nodes[facets])
    first, second, along = _neighbours(mesh, facets)
    cosine = np.clip((normals[first] * normals[second]).sum(axis=1), -1.0, 1.0)
    angle = np.arccos(cosine)
    bent = (angle > _FLAT) & (angle < _EDGE)
    followed = normals[np.union1d(first[bent], second[bent])]
    if len(np.unique(np.round(followed, 5), axis=0)) < _LEAST:
        return None
    bent &= angle >= least_angle
    if not bent.any():
        return None
    middles = mesh.nodes[facets].mean(axis=1)
    apart = middles[second[bent]] - middles[first[bent]]
    apart = apart - (apart * along[bent]).sum(axis=1, keepdims=True) * along[bent]
    half = 0.5 * angle[bent]
    error = 0.5 * np.linalg.norm(apart, axis=1) * np.tan(0.5 * half) / np.cos(half)
    return Chords(len(np.union1d(first[bent], second[bent])), float(angle[bent].max()),
                  float(error.max()))


def _curved(mesh: Mesh, facets: Integers) -> NDArray[np.bool_]:
    """Whether facets (k, n) have an edge that the mesh gives as curved."""
    if not len(mesh.curved_edges):
        return np.zeros(len(facets), bool)
    known = {tuple(edge) for edge in np.sort(mesh.curved_edges, axis=1).tolist()}
    sides = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1), axis=-1)
    return np.array([any(tuple(edge) in known for edge in edges) for edges in sides.tolist()])


def _normals(corners: Array) -> Array:
    """Unit normals (k, d) of facets with corners (k, n, d)."""
    if corners.shape[2] == 2:
        side = corners[:, 1] - corners[:, 0]
        normal = np.column_stack([side[:, 1], -side[:, 0]])
    else:
        normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1]) if (
            corners.shape[1] == 4) else np.cross(corners[:, 1] - corners[:, 0],
                                                 corners[:, 2] - corners[:, 0])
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _neighbours(mesh: Mesh, facets: Integers) -> tuple[Integers, Integers, Array]:
    """Pairs of facets that share a node, of solids an edge, and its unit direction (k, d)."""
    if facets.shape[1] == 2:
        flat, owner = facets.reshape(-1, 1), np.repeat(np.arange(len(facets)), 2)
    else:
        flat, owner = edges_around(facets)
    order = np.lexsort(flat.T)
    same = (flat[order[1:]] == flat[order[:-1]]).all(axis=1)
    first, second = owner[order[:-1][same]], owner[order[1:][same]]
    if flat.shape[1] == 1:
        return first, second, np.zeros((len(first), mesh.nodes.shape[1]))
    ends = mesh.nodes[flat[order[1:][same]]]
    along = ends[:, 1] - ends[:, 0]
    return first, second, along / np.linalg.norm(along, axis=1, keepdims=True)

