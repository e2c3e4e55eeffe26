"""Friction laws."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fecontact.laws.contract import NodeLaw, PerNode, friction_law


@friction_law
def _exponential(v, F, p):  # type: ignore[no-untyped-def]
    static, kinetic, decay, slope = p[0], p[1], p[2], p[3]
    fall = (static - kinetic) * math.exp(-decay * abs(v))
    coefficient = fall + kinetic
    x = slope * v
    smooth = 2.0 / math.pi * math.atan(x)
    rate = 2.0 / math.pi * slope / (1.0 + x * x)
    sign = 1.0 if v >= 0.0 else -1.0
    ratio = coefficient * smooth
    return ratio * F, (coefficient * rate - decay * sign * fall * smooth) * F, ratio


@dataclass(frozen=True)
class ExponentialFriction(NodeLaw):
    r"""Dry friction that falls exponentially with slip velocity, smoothed by arctan (4.1-21..23).

    .. math::

        R = \mu(v)\, F\, \tfrac{2}{\pi} \arctan(k_s v), \qquad
        \mu(v) = (\mu_0 - \mu_\infty)\, e^{-\lambda |v|} + \mu_\infty

    v is the slip velocity of the body relative to the ground [m/s], F the normal force [N]; the
    friction force R [N] acts on the body in -x for v > 0.

    Parameters
    ----------
    static_coefficient : float or (n,) sequence
        mu_0, zero or above.
    kinetic_coefficient : float or (n,) sequence
        mu_inf, zero or above.
    decay : float or (n,) sequence
        lambda, zero or above [s/m].
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m]. Below slip velocities of some 1/k_s the contact creeps instead of
        sticking.

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.1.
    """

    kernel: ClassVar = _exponential

    static_coefficient: PerNode = 0.8
    kinetic_coefficient: PerNode = 0.55
    decay: PerNode = 1000.0
    smoothing_slope: PerNode = 1e6

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("zero or above", lambda x: x >= 0,
                     "static_coefficient", "kinetic_coefficient", "decay")
        self.require("above zero", lambda x: x > 0, "smoothing_slope")

    def stick_velocity(self, nodes: int) -> NDArray[np.float64]:
        """Slip velocity (n,) below which a node in contact counts as sticking [m/s].

        It is where the friction force is largest for a given normal force; where it has no
        maximum, 10 / k_s.
        """
        table = self.table(np.full(nodes, 1.0 / nodes))
        rows, inverse = np.unique(table, axis=0, return_inverse=True)
        return np.array([_largest_at(row) for row in rows])[inverse.reshape(-1)]

    @property
    def velocity_scale(self) -> float:
        """Width 1/k_s of the smoothing [m/s], the smallest of all nodes."""
        return 1.0 / float(np.max(self.smoothing_slope))


FrictionLaw = ExponentialFriction


def _largest_at(p: NDArray[np.float64]) -> float:
    from scipy.optimize import brentq

    law = _exponential.python
    speeds = np.geomspace(1e-3, 1e9, 2000) / max(p[2], p[3])
    force, slope = np.array([law(v, 1.0, p)[:2] for v in speeds]).T
    largest = int(np.argmax(force))
    if largest + 1 == len(speeds) or not (slope[: largest + 2] < 0.0).any():
        return 10.0 / float(p[3])
    low, high = speeds[max(largest - 1, 0)], speeds[largest + 1]
    return float(brentq(lambda v: law(v, 1.0, p)[1], low, high, xtol=1e-16, rtol=1e-12))

