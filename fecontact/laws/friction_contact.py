"""Contact element of blade dynamics: linear normal contact and elastic Coulomb friction by name."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import FrictionLaw, NormalLaw, NotNegative, Positive
from fecontact.laws.friction.maxwell_slip import JenkinsFriction
from fecontact.laws.normal.linear import LinearContact


@dataclass(frozen=True)
class FrictionContact3D(NormalLaw):
    r"""Contact element of blade dynamics: elastic Coulomb friction, varying normal load.

    .. math::

        F = \max(0,\ N_0 + k_n u), \qquad R = k_t z, \quad |z| \le \frac{\mu F}{k_t}

    u is the penetration [m], z the deflection of the tangential spring [m]. It is given as a
    normal law and is both laws: a system stores it as :class:`LinearContact` with this stiffness
    and preload and :class:`JenkinsFriction`, and parameters of the system have their names,
    ``normal.stiffness``, ``normal.preload``, ``friction.stiffness`` and
    ``friction.friction_coefficient``. The contact opens at ``u = -N_0 / k_n`` and then has no
    friction. Friction acts along one tangent in the plane and along two in space.

    Parameters
    ----------
    normal_stiffness : float or (n,) sequence
        Normal stiffness k_n of the whole face, or of each node, positive [N/m].
    tangential_stiffness : float or (n,) sequence
        Tangential stiffness k_t of the whole face, or of each node, positive [N/m].
    friction_coefficient : float or (n,) sequence
        Friction coefficient mu, zero or above.
    preload : float or (n,) sequence
        Preload N_0 of the whole face, or of each node, zero or above [N].

    References
    ----------
    B. D. Yang, M. L. Chu and C. H. Menq, Stick-slip-separation analysis and non-linear stiffness
    and damping characterization of friction contacts having variable normal load, Journal of Sound
    and Vibration 210 (1998) 461-481.
    """

    kernel: ClassVar = LinearContact.kernel
    extensive: ClassVar = frozenset({"normal_stiffness", "tangential_stiffness", "preload"})

    normal_stiffness: Annotated[Positive, Unit("N/m")]
    tangential_stiffness: Annotated[Positive, Unit("N/m")]
    friction_coefficient: NotNegative
    preload: Annotated[NotNegative, Unit("N")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.normal

    @property
    def normal(self) -> LinearContact:
        """The law of the normal force."""
        return LinearContact(self.normal_stiffness, preload=self.preload)

    @property
    def friction(self) -> JenkinsFriction:
        """The law of friction."""
        return JenkinsFriction(self.tangential_stiffness, self.friction_coefficient)

    @property
    def penetration_scale(self) -> float:
        """Penetration under 1 N on the whole face, or on each node [m], the smallest of all."""
        return self.normal.penetration_scale

    def table(self, share: Array) -> Array:
        """Parameters (n, 3) of the normal law."""
        return self.normal.table(share)

    def onsets(self, nodes: int) -> Array:
        """Penetration -N_0 / k_n (1, n) at which the contact closes [m]."""
        return self.normal.onsets(nodes)

    def untouched(self, nodes: int) -> Array:
        """Penetration -N_0 / k_n (n,) up to which there is no force [m]."""
        return self.normal.untouched(nodes)

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored along the normal [J]: the integral of F from 0 to u."""
        return self.normal.stored_energy(penetration, share)


def separated(normal: Any, friction: Any, where: str) -> tuple[Any, Any]:
    """Normal and friction law, or mappings of them, with each FrictionContact3D taken apart.

    InputError for a friction law beside a FrictionContact3D.
    """
    if isinstance(normal, FrictionContact3D):
        if friction is not None:
            given = type(friction).__name__ if isinstance(friction, FrictionLaw) else friction
            raise InputError(f"{where}: normal is a FrictionContact3D, which has friction of its "
                             f"own; leave out friction = {given}, or give LinearContact instead.")
        return normal.normal, normal.friction
    if not isinstance(normal, Mapping) or not any(
            isinstance(one, FrictionContact3D) for one in normal.values()):
        return normal, friction
    laws = {}
    for name, one in normal.items():
        own = friction.get(name) if isinstance(friction, Mapping) else (
            None if isinstance(one, FrictionContact3D) else friction)
        laws[name] = separated(one, own, f"{where}: interface '{name}'")
    return ({name: one for name, (one, _) in laws.items()},
            {name: one for name, (_, one) in laws.items() if one is not None})
