"""The von Mises stress of the components of stresses."""

import numpy as np

from fecontact.core.types import Array


def von_mises_of(stress: Array) -> Array:
    """Von Mises stress (...) of components (c, ...): xx, yy, zz and the shears, in equal units."""
    xx, yy, zz, *shears = stress
    square = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
    for shear in shears:
        square += 3.0 * shear**2
    return np.asarray(np.sqrt(square))
