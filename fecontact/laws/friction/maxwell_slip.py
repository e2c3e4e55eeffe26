"""Friction laws of springs and sliders: Jenkins' element and Iwan's parallel arrangement."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import NotNegative, Positive
from fecontact.laws.friction.base import LimitedFriction
from fecontact.laws.signatures import memory_friction_law


@memory_friction_law
def _maxwell_slip(v, F, z, p, force, rates):
    count = len(z)
    spring, mu, relaxation = p[0] / count, p[1], p[2]
    force[0] = 0.0
    force[1] = 0.0
    force[2] = 0.0
    for i in range(count):
        part = mu * (2 * i + 1) / count**2
        limit = part * F / spring
        sign = 1.0 if z[i] > 0.0 else -1.0
        excess = abs(z[i]) - limit
        for k in range(3 + count):
            rates[i, k] = 0.0
        rates[i, 0] = v
        rates[i, 1] = 1.0
        if excess > 0.0:
            force[0] += sign * part * F
            force[2] += sign * part
            force[3 + i] = 0.0
            rates[i, 0] -= sign * excess / relaxation
            rates[i, 2] = sign * part / (spring * relaxation)
            rates[i, 3 + i] = -1.0 / relaxation
        else:
            force[0] += spring * z[i]
            force[3 + i] = spring


@dataclass(frozen=True)
class _MaxwellSlip(LimitedFriction):
    """``memory`` springs and sliders in parallel, between the body and the ground.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        k, positive: presliding stiffness of the whole face, or of each node [N/m].
    relaxation_time : float or (n,) sequence
        tau, positive: much shorter than the shortest period of the motion [s].
    """

    kernel: ClassVar = _maxwell_slip
    extensive: ClassVar = frozenset({"stiffness"})

    stiffness: Annotated[Positive, Unit("N/m")] = 1e7
    friction_coefficient: NotNegative = 0.55
    relaxation_time: Annotated[Positive, Unit("s")] = 1e-7

    def bristle_stiffness_of(self, share: Array) -> Array:
        """The springs', whose deflections the internal variables are."""
        stiffness = np.zeros((2, len(share), self.memory))
        stiffness[0] = self.table(share)[:, :1] / self.memory
        return stiffness

    def sliders(self, share: Array) -> tuple[Array, Array]:
        """Stiffness (n, s) of the springs [N/m], and limits (n, s) of the sliders as parts of F."""
        stiffness, coefficient = self.table(share)[:, :2].T
        part = (2.0 * np.arange(self.memory) + 1.0) / self.memory**2
        return (np.repeat(stiffness[:, None] / self.memory, self.memory, axis=1),
                coefficient[:, None] * part)

    @property
    def state_scale(self) -> Array:
        """Deflections (s,) [m] at which the elements slide under 1 N on the whole face.

        The smallest of all nodes; for coefficient zero the same as for one.
        """
        mu = np.where(np.greater(self.friction_coefficient, 0.0), self.friction_coefficient, 1.0)
        nodes = np.size(self.stiffness)
        part = (2.0 * np.arange(self.memory) + 1.0) / self.memory
        return part * float(np.min(mu / (nodes * np.asarray(self.stiffness))))


@dataclass(frozen=True)
class JenkinsFriction(_MaxwellSlip):
    r"""Jenkins' element: a spring in series with a slider of limit mu F (elastic - plastic).

    .. math::

        R = \min(k |z|,\ \mu F)\, \operatorname{sgn} z, \qquad
        z' = v - \frac{1}{\tau} \max\left(0,\ |z| - \frac{\mu F}{k}\right) \operatorname{sgn} z

    z is the deflection of the spring [m], v the slip velocity [m/s], F the normal force [N].
    Beyond its limit z relaxes to it within tau, so that it follows a decreasing normal force and
    vanishes with it; in sliding at v it exceeds the limit by ``v tau``, while R does not. A cycle
    of amplitude X > mu F / k dissipates ``4 mu F (X - mu F / k)``; tau changes that by about
    ``(w tau)^2``, relative, at the angular frequency w: 1e-4 at 16 kHz by default. With much
    shorter ones, stiff solvers may step over the end of sliding.

    References
    ----------
    G. M. Jenkins, Analysis of the stress-strain relationships in reactor grade graphite, British
    Journal of Applied Physics 13 (1962).
    """


@dataclass(frozen=True)
class IwanFriction(_MaxwellSlip):
    r"""Iwan's law: N Jenkins elements in parallel that begin to slide one after another.

    .. math::

        R = \sum_{i=1}^{N} \min\left(\tfrac{k}{N} |z_i|,\ \phi_i\right) \operatorname{sgn} z_i,
        \qquad \phi_i = \frac{2 i - 1}{N^2}\, \mu F

    with the rate of z_i as in :class:`JenkinsFriction`, but with the limit ``phi_i N / k``. The
    limits are uniformly distributed, their sum is mu F and the sum of the stiffnesses k. Elements
    slide from the deflection ``mu F / (N k)`` on, all of them from ``(2 N - 1) mu F / (N k)`` on.
    For many elements, R on first loading is ``k x - (k x)^2 / (4 mu F)`` up to ``x = 2 mu F / k``.
    At constant normal force Masing's rules hold: unloading follows the curve of first loading,
    scaled by two.

    Parameters
    ----------
    elements : int
        N, one or above: internal variables of each node.

    References
    ----------
    W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic response,
    Journal of Applied Mechanics 33 (1966).
    """

    elements: int = 8

    def __post_init__(self) -> None:
        given = self.elements
        super().__post_init__()
        if np.ndim(given) or given != int(given) or given < 1:
            raise InputError(f"IwanFriction: elements = {given!r} must be a whole number, one or "
                             f"above.")
        object.__setattr__(self, "elements", int(given))

    @property
    def memory(self) -> int:
        """One internal variable per element."""
        return self.elements
