"""Tangents of contact nodes, and matrices that turn motions into the frames of the nodes."""

import numpy as np

from fecontact.core.types import Array

# Within this angle of x, a normal leaves too little of x in the tangent plane.
_NEAR_X = np.cos(np.radians(10.0))


def tangents_of(normals: Array) -> Array:
    """Unit tangents (n, 2, 3) of unit normals (n, 3).

    The first one t is the projection of global x on the tangent plane, or of y where the normal is
    within 10 degrees of x; the second one is n x t, so that (t, t2, n) is right-handed. A normal
    along z gives x and y.
    """
    along = np.where(np.abs(normals[:, :1]) > _NEAR_X, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    first = along - (along * normals).sum(axis=1, keepdims=True) * normals
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first)], axis=1)


def frames_of(normals: Array) -> Array:
    """Rows t, t2, n (n, 3, 3) of the frames of unit normals (n, 3)."""
    return np.concatenate([tangents_of(normals), normals[:, None]], axis=1)


def turned(rows: Array, normals: Array) -> Array:
    """Rows (n, 6, m) of displacements and rotations along x, y, z in the frames of the normals."""
    frames = frames_of(normals)
    return np.concatenate([frames @ rows[:, :3], frames @ rows[:, 3:]], axis=1)
