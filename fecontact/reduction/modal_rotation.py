"""Terms that the rotation of a body adds to the equations of its modes."""

from dataclasses import dataclass, replace

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array


@read_only_arrays
@dataclass(frozen=True, eq=False)
class ModalRotation:
    """Rotation of a body in its modes: what a basis adds to damping, stiffness and load.

    Attributes
    ----------
    speed : float
        Angular speed W of the body and its frame [rad/s].
    coriolis : (m, m) array
        Skew; ``W coriolis`` is part of the damping.
    stiffening : (m, m) array
        Symmetric; ``W^2 stiffening``, of the centrifugal stress and force, is part of the
        stiffness.
    load : (m,) array
        ``W^2 load`` is the centrifugal force on the undeformed body.
    axis, centre : (x, y, z)
        Direction of the axis, and a point of it [m].
    stressed : bool
        Whether the stiffening includes that of the stress of the body, held by its supports alone.
    standing : bool
        Whether the frame is that at rest.
    """

    speed: float
    coriolis: Array
    stiffening: Array
    load: Array
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    stressed: bool = False
    standing: bool = False

    def in_modes(self, modes: Array) -> "ModalRotation":
        """Rotation in other coordinates p, ``q = modes p`` with modes (m, k)."""
        return replace(self, coriolis=modes.T @ self.coriolis @ modes,
                       stiffening=modes.T @ self.stiffening @ modes, load=self.load @ modes)

    def is_about_that_of(self, other: "ModalRotation") -> bool:
        """True if both have the same axis, speed and frame."""
        apart = np.cross(np.subtract(self.centre, other.centre), self.axis)
        size = 1e-9 * (1.0 + np.abs(self.centre).max())
        return bool(self.speed == other.speed and self.standing == other.standing
                    and np.abs(apart).max() <= size
                    and np.allclose(self.axis, other.axis, rtol=0.0, atol=1e-9))
