"""Coordinates of rectangular, cylindrical and spherical systems of mesh files."""

import numpy as np

from fecontact.core.types import Array


def cartesian(places: Array, system: str) -> Array:
    """Cartesian coordinates (k, 3) of places in a system R, C or S.

    Of C they are (r, theta, z), of S (r, theta, phi), with angles in degrees; phi is the angle
    above the x-y plane.
    """
    if system == "R":
        return places
    r, theta, z = places[:, 0], np.radians(places[:, 1]), places[:, 2]
    if system == "S":
        r, z = r * np.cos(np.radians(z)), r * np.sin(np.radians(z))
    return np.column_stack([r * np.cos(theta), r * np.sin(theta), z])


def directions(places: Array, system: str) -> Array:
    """Unit vectors (k, 3, 3), by rows, along the coordinates at places (k, 3) in a system R, C, S.

    The places are Cartesian coordinates. On the axis of C and S, r is along x.
    """
    found = np.tile(np.eye(3), (len(places), 1, 1))
    if system == "R":
        return found
    angle = np.arctan2(places[:, 1], places[:, 0])
    c, s = np.cos(angle), np.sin(angle)
    found[:, 0, 0], found[:, 0, 1], found[:, 1, 0], found[:, 1, 1] = c, s, -s, c
    if system == "S":
        above = np.arctan2(places[:, 2], np.hypot(places[:, 0], places[:, 1]))[:, None]
        radial, z = found[:, 0].copy(), found[:, 2].copy()
        found[:, 0] = np.cos(above) * radial + np.sin(above) * z
        found[:, 2] = np.cos(above) * z - np.sin(above) * radial
    return found
