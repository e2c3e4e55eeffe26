"""Linear contact, two-sided stops, and a prescribed normal force."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.errors import InputError, shown
from fecontact.core.simd.vectors import everywhere, select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import NormalLaw, NotNegative, OneOrAbove, Positive
from fecontact.laws.normal.power import lower_power
from fecontact.laws.pieces import pieces_of
from fecontact.laws.signatures import normal_law


@normal_law
def _linear(u, v, p):
    stiffness, damping, preload = p[0], p[1], p[2]
    elastic = stiffness * u + preload
    force = elastic + damping * v
    away = (elastic <= 0.0) | (force <= 0.0)
    return select(away, 0.0, force), select(away, 0.0, stiffness), select(away, 0.0, damping)


@dataclass(frozen=True)
class LinearContact(NormalLaw):
    r"""Smooth surface on a spring with a parallel dashpot.

    .. math:: F = \max(0,\ N_0 + c u + d v), \qquad u > -N_0 / c

    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile.
    It is the rough surface in the limit R_Z -> 0. A preload N_0 is the force at u = 0, from where
    displacements then count: the contact opens at u = -N_0 / c. With damping the force jumps at
    first contact, and derivatives of the motion with it (saltation; see
    :func:`fecontact.sensitivity`); multipliers of orbits by collocation and harmonic balance miss
    that. A rough surface has no such jump.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        Stiffness c of the whole face, or of each node, positive [N/m].
    damping : float or (n,) sequence
        Damping d of the whole face, or of each node, zero or above [N s/m].
    preload : float or (n,) sequence
        Preload N_0, zero or above [N]; of the whole face, or of each node if the stiffness is given
        for each.
    """

    kernel: ClassVar = _linear
    extensive: ClassVar = frozenset({"stiffness", "damping", "preload"})

    stiffness: Annotated[Positive, Unit("N/m")]
    damping: Annotated[NotNegative, Unit("N s/m")] = 0.0
    preload: Annotated[NotNegative, Unit("N")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.ndim(self.stiffness) != np.ndim(self.preload) and np.any(self.preload):
            raise InputError(f"{self._title('preload')} = {shown(self.preload)} and stiffness = "
                             f"{shown(self.stiffness)} must be both of the whole face or both of "
                             f"each node.")

    @property
    def penetration_scale(self) -> float:
        """Penetration under 1 N on the whole face, or on each node [m], the smallest of all."""
        return 1.0 / float(np.max(self.stiffness))

    def onsets(self, nodes: int) -> Array:
        """Penetration -N_0 / c (1, n) at which the contact closes [m]."""
        return np.zeros((1, nodes)) - np.divide(self.preload, self.stiffness)

    def untouched(self, nodes: int) -> Array:
        """Penetration -N_0 / c (n,): nodes that are open have no force."""
        return self.onsets(nodes)[0] if self.kernel is _linear else np.full(nodes, -np.inf)

    def pieces(self, share: Array) -> Array | None:
        """Two pieces: no force below the onset -N_0 / c, and N_0 + c u + d v above it."""
        if self.kernel is not _linear:
            return None
        c, d, preload = self.table(share).T
        onset = -preload / c
        return pieces_of(len(share), [[-np.inf, onset], [onset, np.inf, preload, c, 0.0, d, 0.0,
                                                         0.0, preload, c, d]])

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u."""
        c, _, preload = self.table(share).T
        u = np.maximum(penetration, -preload / c)
        return np.asarray((preload + 0.5 * c * u) * u)


@normal_law
def _two_sided(u, v, p):
    stiffness, clearance, exponent, factor = p[0], p[1], p[2], p[3]
    side, depth = select(u > 0.0, 1.0, -1.0), select(u > 0.0, u, -u - clearance)
    damped = 1.0 + factor * side * v
    away = (depth <= 0.0) | (damped <= 0.0)
    if everywhere(away):
        return 0.0, 0.0, 0.0
    lower = lower_power(select(away, 0.0, depth), exponent)
    elastic = stiffness * lower * depth
    return (select(away, 0.0, side * elastic * damped),
            select(away, 0.0, exponent * stiffness * lower * damped),
            select(away, 0.0, elastic * factor))


@dataclass(frozen=True)
class TwoSidedStop(NormalLaw):
    r"""Clearance between a lower stop, at the ground, and an upper one.

    .. math::

        F = K u^n \max(0,\ 1 + \chi v) \quad (u > 0), \qquad
        F = -K w^n \max(0,\ 1 - \chi v), \quad w = -u - s \quad (u < -s)

    u is the penetration into the lower stop [m], v its rate [m/s], s the clearance. The force F [N]
    on the body is upward, F > 0, at the lower and downward, F < 0, at the upper stop, never
    adhesive, and zero within the clearance. n = 1 are linear springs.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        Stiffness K of each stop over the whole face, or at each node, positive [N/m^n].
    clearance : float or (n,) sequence
        Clearance s between the stops, zero or above [m].
    exponent : float or (n,) sequence
        Exponent n of the force over penetration, one or above.
    damping_factor : float or (n,) sequence
        Hunt-Crossley damping factor chi, zero or above [s/m].
    """

    kernel: ClassVar = _two_sided
    extensive: ClassVar = frozenset({"stiffness"})

    stiffness: Annotated[Positive, Unit("N/m^n")]
    clearance: Annotated[NotNegative, Unit("m")]
    exponent: OneOrAbove = 1.0
    damping_factor: Annotated[NotNegative, Unit("s/m")] = 0.0

    @property
    def penetration_scale(self) -> float:
        """Penetration under 1 N on the whole face, or on each node [m], the smallest of all."""
        stiffness, exponent = np.asarray(self.stiffness), np.asarray(self.exponent)
        return float(np.min(stiffness ** (-1.0 / exponent)))

    def onsets(self, nodes: int) -> Array:
        """Zero and minus the clearance (2, n) [m]."""
        return np.array([np.zeros(nodes), np.broadcast_to(-np.asarray(self.clearance), nodes)])

    def pieces(self, share: Array) -> Array | None:
        """Upper stop, nothing, lower stop, for n = 1 or n = 2; else None.

        Nothing is left out where no node has a clearance; None where only some have.
        """
        K, s, exponent, factor = self.table(share).T
        below = np.where(exponent == 1.0, [K * s, K, 0.0 * K], [-K * s * s, -2.0 * K * s, -K])
        above = np.where(exponent == 1.0, [0.0 * K, K, 0.0 * K], [0.0 * K, 0.0 * K, K])
        if self.kernel is not _two_sided or not np.isin(exponent, (1.0, 2.0)).all():
            return None
        # Without a clearance one stop begins where the other ends.
        if not s.all() and s.any():
            return None
        middle: list[list[Array | float]] = [[-s, 0.0]] if s.any() else []
        return pieces_of(len(share), [
            [-np.inf, -s, *below, *(-factor * below), 1.0, 0.0, -factor], *middle,
            [0.0, np.inf, *above, *(factor * above), 1.0, 0.0, factor]])

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in both stops [J]: the integral of F(u, 0) from 0 to u."""
        stiffness, clearance, exponent, _ = self.table(share).T
        depth = np.maximum(penetration, np.maximum(-penetration - clearance, 0.0))
        return np.asarray(stiffness / (exponent + 1.0) * depth ** (exponent + 1.0))


@normal_law
def _prescribed(u, v, p):
    return p[0], 0.0, 0.0


@dataclass(frozen=True)
class PrescribedForce(NormalLaw):
    r"""Constant normal force F = F_0 on the body [N], independent of the penetration.

    For friction oscillators that move along the ground only; the contact never opens.

    Parameters
    ----------
    force : float or (n,) sequence
        Normal force F_0 of the whole face, or of each node, zero or above [N].
    """

    kernel: ClassVar = _prescribed
    extensive: ClassVar = frozenset({"force"})

    force: Annotated[NotNegative, Unit("N")]

    @property
    def penetration_scale(self) -> float:
        """One micrometre, as the law itself has no scale [m]."""
        return 1e-6

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) of the force [J]: F_0 u, zero at u = 0."""
        return np.asarray(self.table(share)[:, 0] * penetration)
