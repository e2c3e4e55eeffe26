"""Compliance of the surfaces of isotropic half-spaces that touch each other.

A force at the origin of the surface of one half-space, P into it and Q along x, moves the surface
at (x, y), with r the distance (Boussinesq, Cerruti; Johnson, *Contact Mechanics*, 1985, 3.2, 3.6):

    u_z = (1 - nu^2) / (pi E) P / r + c / pi  Q x / r^2
    u_x = (1 - nu^2) / (pi E) Q / r + nu (1 + nu) / (pi E) Q x^2 / r^3 - c / pi  P x / r^2
    u_y = nu (1 + nu) / (pi E) Q x y / r^3,       c = (1 + nu) (1 - 2 nu) / (2 E)

where z points into the half-space. Relative displacements of two half-spaces have the sums of
these constants, but the difference of c: it is zero for equal materials (Goodman, 1962).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from fecontact.core.errors import InputError, shown
from fecontact.fem.material import Material


@dataclass(frozen=True)
class SurfaceCompliance:
    """Constants of relative displacements of two surfaces, each times pi [1/Pa].

    Attributes
    ----------
    direct : float
        ``sum (1 - nu^2) / E``, of 1 / r: the inverse of the contact modulus E*.
    along : float
        ``sum nu (1 + nu) / E``, of x^2 / r^3 along a tangential force.
    coupling : float
        ``(1 + nu) (1 - 2 nu) / (2 E)`` of the first body minus that of the other.
    """

    direct: float
    along: float
    coupling: float

    @classmethod
    def of(cls, materials: Material | Sequence[Material], owner: str) -> "SurfaceCompliance":
        """Compliance of one half-space on a rigid one, or of two; InputError for other things."""
        given = (materials,) if isinstance(materials, Material) else materials
        if not isinstance(given, Sequence) or len(given) not in (1, 2) or not all(
                isinstance(one, Material) for one in given):
            raise InputError(f"{owner}: materials = {shown(materials)} must be a Material, of one "
                             f"half-space on a rigid one, or two of them; materials must be "
                             f"isotropic.")
        signs = (1.0, -1.0)
        E, nu = ([getattr(one, name) for one in given]
                 for name in ("youngs_modulus", "poisson_ratio"))
        both = list(zip(E, nu, signs, strict=False))
        return cls(sum((1.0 - v * v) / e for e, v, _ in both),
                   sum(v * (1.0 + v) / e for e, v, _ in both),
                   sum(s * (1.0 + v) * (1.0 - 2.0 * v) / (2.0 * e) for e, v, s in both))

    @property
    def modulus(self) -> float:
        """Contact modulus E* [Pa]."""
        return 1.0 / self.direct
