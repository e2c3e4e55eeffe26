"""Normal contact laws."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.laws.contract import NodeLaw, PerNode, normal_law


@normal_law
def _rough_surface(u, v, p):  # type: ignore[no-untyped-def]
    stiffness, height, damping = p[0], p[1], p[2]
    s = u / height
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if s < 1.0:
        bearing, slope = s, 1.0 / height
        force = stiffness * height * 0.5 * s * s
    else:
        bearing, slope = 1.0, 0.0
        force = stiffness * height * (s - 0.5)
    force += damping * bearing * v
    if force <= 0.0:
        return 0.0, 0.0, 0.0
    return force, stiffness * bearing + damping * slope * v, damping * bearing


@dataclass(frozen=True)
class RoughSurface(NodeLaw):
    r"""Rough surface with uniformly distributed asperity heights (4.1-16).

    .. math:: F = \max(0,\ c R_Z f(s) + \beta c\, h(s)\, v), \qquad s = u / R_Z

    with f = 0, s^2/2, s - 1/2 and h = f' = 0, s, 1 for s < 0, 0 <= s <= 1, s > 1: each asperity
    in contact is a spring with a parallel dashpot, and once all are in contact the law is linear.
    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        c: stiffness of the whole face when all asperities are in contact, or of each node [N/m].
    roughness_height : float or (n,) sequence
        R_Z: peak-to-valley height of the surface [m].
    damping : float or (n,) sequence
        beta c: damping of the whole face when all asperities are in contact, or of each
        node [N s/m].

    Raises
    ------
    InputError
        For a stiffness or roughness height that is not positive, or a negative damping.

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.1; the bearing-area curve of
    uniform heights.
    """

    kernel: ClassVar = _rough_surface
    extensive: ClassVar = frozenset({"stiffness", "damping"})

    stiffness: PerNode = 0.3e6
    roughness_height: PerNode = 5.2e-6
    damping: PerNode = 6.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("above zero", lambda x: x > 0, "stiffness", "roughness_height")
        self.require("zero or above", lambda x: x >= 0, "damping")

    def stored_energy(
        self, penetration: NDArray[np.float64], share: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Energy (..., n) stored in the asperities [J]: the integral of F(u, 0) from 0 to u."""
        stiffness, height, _ = self.table(share).T
        s = np.maximum(penetration / height, 0.0)
        below = np.minimum(s, 1.0)
        above = np.maximum(s - 1.0, 0.0)
        return stiffness * height**2 * (below**3 / 6.0 + above * (1.0 + above) / 2.0)


NormalLaw = RoughSurface
