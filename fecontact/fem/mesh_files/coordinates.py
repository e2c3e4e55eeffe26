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
