"""Friction laws without memory: constant coefficient and Stribeck curves."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from fecontact.core.compiled import helper
from fecontact.core.simd.vectors import select, somewhere
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import NotNegative, PerNode, Positive
from fecontact.laws.elementary import arctangent
from fecontact.laws.friction.base import (
    MemorylessFriction,
    SmoothedFriction,
    Smoothing,
    require_at_least,
)
from fecontact.laws.signatures import friction_law


@helper
def _smoothed_sign(v, slope, smoothing):
    """s(v) and s'(v); ``smoothing`` is the index of the choice."""
    rise = 2.0 / math.pi * slope
    by_tanh, by_root = smoothing == 1.0, smoothing == 2.0
    sign, rate = 0.0, 0.0
    if somewhere(smoothing == 0.0):
        x = slope * v
        sign, rate = 2.0 / math.pi * arctangent(x), rise / (1.0 + x * x)
    if somewhere(by_tanh):
        s = math.tanh(rise * v)
        sign, rate = select(by_tanh, s, sign), select(by_tanh, rise * (1.0 - s) * (1.0 + s), rate)
    if somewhere(by_root):
        x = rise * v
        root = 1.0 / math.sqrt(1.0 + x * x)
        sign = select(by_root, x * root, sign)
        rate = select(by_root, rise * root * root * root, rate)
    return sign, rate


@helper
def _force(v, F, coefficient, change, viscous, slope, smoothing):
    """R, dR/dv, dR/dF from mu and ``change``, its derivative with respect to speed."""
    s, rate = _smoothed_sign(v, slope, smoothing)
    sign = select(v >= 0.0, 1.0, -1.0)
    ratio = coefficient * s + viscous * v
    return ratio * F, (coefficient * rate + sign * change * s + viscous) * F, ratio


@friction_law
def exponential(v, F, p):
    """Coefficient mu_inf + (mu_0 - mu_inf) exp(-lambda |v|)."""
    static, kinetic, decay = p[0], p[1], p[2]
    excess = (static - kinetic) * math.exp(-decay * abs(v))
    return _force(v, F, kinetic + excess, -decay * excess, p[4], p[3], p[5])


@friction_law
def gaussian(v, F, p):
    """Coefficient mu_inf + (mu_0 - mu_inf) exp(-(v/v_s)^2)."""
    static, kinetic, stribeck = p[0], p[1], p[2]
    x = abs(v) / stribeck
    excess = (static - kinetic) * math.exp(-x * x)
    return _force(v, F, kinetic + excess, -2.0 * x / stribeck * excess, p[4], p[3], p[5])


@friction_law
def hyperbolic(v, F, p):
    """Coefficient mu_inf + (mu_0 - mu_inf) / (1 + |v|/v_s)."""
    static, kinetic, stribeck = p[0], p[1], p[2]
    ratio = stribeck / (stribeck + abs(v))
    excess = (static - kinetic) * ratio
    return _force(v, F, kinetic + excess, -excess * ratio / stribeck, p[4], p[3], p[5])


@friction_law
def constant(v, F, p):
    """Coefficient mu."""
    return _force(v, F, p[0], 0.0, p[2], p[1], p[3])


@friction_law
def galvanetto(v, F, p):
    """Coefficient mu_k + (mu_s - mu_k) / (1 + gamma |v|) + eta v^2."""
    static, kinetic, decay, growth = p[0], p[1], p[2], p[3]
    speed = abs(v)
    ratio = 1.0 / (1.0 + decay * speed)
    excess = (static - kinetic) * ratio
    return _force(v, F, kinetic + excess + growth * speed * speed,
                  2.0 * growth * speed - decay * ratio * excess, 0.0, p[4], p[5])


@friction_law
def cubic(v, F, p):
    """Coefficient mu_s - 3/2 (mu_s - mu_m) (x - x^3/3) with x = |v|/v_m."""
    static, least, velocity = p[0], p[1], p[2]
    x = abs(v) / velocity
    depth = 1.5 * (static - least)
    return _force(v, F, static - depth * x * (1.0 - x * x / 3.0),
                  -depth * (1.0 - x * x) / velocity, 0.0, p[3], p[4])


@friction_law
def product(v, F, p):
    """R/F a_1 (1 + a_2 exp(-b_1 |v|)) arctan(b_2 v)."""
    factor, excess, decay, slope = p[0], p[1], p[2], p[3]
    fall = excess * math.exp(-decay * abs(v))
    sign = select(v >= 0.0, 1.0, -1.0)
    x = slope * v
    bend = arctangent(x)
    ratio = factor * (1.0 + fall) * bend
    rate = factor * ((1.0 + fall) * slope / (1.0 + x * x) - sign * decay * fall * bend)
    return ratio * F, rate * F, ratio


@dataclass(frozen=True)
class _FallingFriction(SmoothedFriction):
    """Friction whose coefficient changes from one value at rest to another at high velocities.

    Parameters
    ----------
    static_coefficient, kinetic_coefficient : float or (n,) sequence
        Coefficients mu_0 at rest and mu_inf at high slip velocity, zero or above. Friction rises
        with velocity if mu_0 is below mu_inf.
    """

    static_coefficient: NotNegative
    kinetic_coefficient: NotNegative


@dataclass(frozen=True)
class ExponentialFriction(_FallingFriction):
    r"""Dry friction that decreases exponentially with slip velocity (4.1-21..23).

    .. math::

        R = F\, [\mu(v)\, s(v) + c_v v], \qquad
        \mu(v) = (\mu_0 - \mu_\infty)\, e^{-\lambda |v|} + \mu_\infty

    v is the slip velocity of the body relative to the ground [m/s], F the normal force [N]; the
    friction force R [N] acts on the body in -x for v > 0. s(v) is the smoothed sign of v.

    Parameters
    ----------
    decay : float or (n,) sequence
        Decay rate lambda of the coefficient over slip velocity, zero or above [s/m].

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.1.
    """

    kernel: ClassVar = exponential

    decay: Annotated[NotNegative, Unit("s/m")]
    smoothing_slope: Annotated[Positive, Unit("s/m")] = 1e6
    viscous_coefficient: Annotated[NotNegative, Unit("s/m")] = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class GaussianFriction(_FallingFriction):
    r"""Dry friction that decreases with slip velocity as a Gaussian (Stribeck curve).

    .. math::

        R = F\, [\mu(v)\, s(v) + c_v v], \qquad
        \mu(v) = (\mu_0 - \mu_\infty)\, e^{-(v/v_s)^2} + \mu_\infty

    R [N] has the sign of the slip velocity v [m/s]. The slope of mu is zero at rest and largest at
    ``v_s / sqrt(2)``; at v_s 63 % of the drop is reached.

    Parameters
    ----------
    stribeck_velocity : float or (n,) sequence
        Stribeck velocity v_s, at which 63 % of the drop from mu_0 to mu_inf is reached, positive
        [m/s].

    References
    ----------
    B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and
    compensation methods for the control of machines with friction, Automatica 30 (1994).
    """

    kernel: ClassVar = gaussian

    stribeck_velocity: Annotated[Positive, Unit("m/s")]
    smoothing_slope: Annotated[Positive, Unit("s/m")] = 1e6
    viscous_coefficient: Annotated[NotNegative, Unit("s/m")] = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class HyperbolicFriction(_FallingFriction):
    r"""Dry friction that decreases hyperbolically with slip velocity.

    .. math::

        R = F\, [\mu(v)\, s(v) + c_v v], \qquad
        \mu(v) = \mu_\infty + \frac{\mu_0 - \mu_\infty}{1 + |v| / v_s}

    R [N] has the sign of the slip velocity v [m/s]. With ``mu_inf = 0`` and ``v_s = 1 / delta``
    it is Leine's law ``F_s / (1 + delta |v|)``.

    Parameters
    ----------
    stribeck_velocity : float or (n,) sequence
        Stribeck velocity v_s, at which half of the drop from mu_0 to mu_inf is reached, positive
        [m/s].

    References
    ----------
    R. I. Leine, D. H. van Campen, A. de Kraker, L. van den Steen, Stick-slip vibrations induced
    by alternate friction models, Nonlinear Dynamics 16 (1998).
    """

    kernel: ClassVar = hyperbolic

    stribeck_velocity: Annotated[Positive, Unit("m/s")]
    smoothing_slope: Annotated[Positive, Unit("s/m")] = 1e6
    viscous_coefficient: Annotated[NotNegative, Unit("s/m")] = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class ConstantFriction(SmoothedFriction):
    r"""Coulomb's law with one coefficient, smoothed: ``R = F [mu s(v) + c_v v]``.

    R [N] has the sign of the slip velocity v [m/s], F is the normal force [N].

    Parameters
    ----------
    friction_coefficient : float or (n,) sequence
        Friction coefficient mu, zero or above.
    """

    kernel: ClassVar = constant

    friction_coefficient: NotNegative
    smoothing_slope: Annotated[Positive, Unit("s/m")] = 1e6
    viscous_coefficient: Annotated[NotNegative, Unit("s/m")] = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class Frictionless(ConstantFriction):
    """No friction, ``R = 0``: Coulomb's law with the coefficient zero; without parameters."""

    friction_coefficient: ClassVar[float] = 0.0  # type: ignore[misc]
    smoothing_slope: ClassVar[float] = 1e6  # type: ignore[misc]
    viscous_coefficient: ClassVar[float] = 0.0  # type: ignore[misc]
    smoothing: ClassVar[Smoothing] = "arctan"  # type: ignore[misc]

    def table(self, share: Array) -> Array:
        """Parameters (n, 4) of :class:`ConstantFriction` with the coefficient zero."""
        return ConstantFriction(0.0).table(share)


@dataclass(frozen=True)
class ProductFriction(MemorylessFriction):
    r"""Friction as a product of an exponential decrease and an arctan (4.4-9).

    .. math:: R = F\, a_1 (1 + a_2 e^{-b_1 |v|}) \arctan(b_2 v)

    R [N] has the sign of the slip velocity v [m/s]. At high velocities ``R / F = pi a_1 / 2``.
    Section 4.4 has a_1 = 0.14, a_2 = 1.14, b_1 = 2 s/m and b_2 = 100 s/m.

    Parameters
    ----------
    factor : float or (n,) sequence
        Factor a_1, zero or above: 2 / pi times the coefficient at high slip velocity.
    excess : float or (n,) sequence
        Excess a_2, zero or above: friction near rest over friction at high velocities, minus one.
    decay : float or (n,) sequence
        Decay rate b_1 of the excess over slip velocity, zero or above [s/m].
    smoothing_slope : float or (n,) sequence
        Smoothing slope b_2 of the arctan, positive [s/m].

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.4.
    """

    kernel: ClassVar = product

    factor: NotNegative
    excess: NotNegative
    decay: Annotated[NotNegative, Unit("s/m")]
    smoothing_slope: Annotated[Positive, Unit("s/m")]


@dataclass(frozen=True)
class GalvanettoFriction(_FallingFriction):
    r"""Dry friction with a hyperbolic decrease and a quadratic increase in velocity.

    .. math::

        R = F\, \mu(v)\, s(v), \qquad
        \mu(v) = \mu_k + \frac{\mu_s - \mu_k}{1 + \gamma |v|} + \eta v^2

    R [N] has the sign of the slip velocity v [m/s]. Friction has its minimum at
    ``gamma (mu_s - mu_k) = 2 eta |v| (1 + gamma |v|)^2``.

    Parameters
    ----------
    static_coefficient, kinetic_coefficient : float or (n,) sequence
        Coefficients mu_s at rest and mu_k, zero or above. Friction rises from rest if mu_s is below
        mu_k.
    decay : float or (n,) sequence
        Decay rate gamma of the coefficient over slip velocity, zero or above [s/m].
    growth : float or (n,) sequence
        Factor eta of the increase with the square of slip velocity, zero or above [s^2/m^2].

    References
    ----------
    U. Galvanetto, S. R. Bishop, Dynamics of a simple damped oscillator undergoing stick-slip
    vibrations, Meccanica 34 (1999), for two blocks on a belt.
    """

    kernel: ClassVar = galvanetto

    decay: Annotated[NotNegative, Unit("s/m")]
    growth: Annotated[NotNegative, Unit("s^2/m^2")] = 0.0
    smoothing_slope: Annotated[Positive, Unit("s/m")] = 1e6
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class CubicFriction(SmoothedFriction):
    r"""Dry friction that is a cubic function of slip velocity with one minimum.

    .. math::

        R = F\, \mu(v)\, s(v), \qquad
        \mu(v) = \mu_s - \tfrac{3}{2} (\mu_s - \mu_m)
        \left[\frac{|v|}{v_m} - \frac{1}{3} \left(\frac{|v|}{v_m}\right)^3\right]

    R [N] has the sign of the slip velocity v [m/s]. mu decreases from mu_s at rest to mu_m at v_m,
    returns to mu_s at ``sqrt(3) v_m`` and then grows without bound.

    Parameters
    ----------
    static_coefficient : float or (n,) sequence
        Coefficient mu_s at rest, at least mu_m.
    minimum_coefficient : float or (n,) sequence
        Smallest coefficient mu_m, zero or above.
    minimum_velocity : float or (n,) sequence
        Slip velocity v_m of the smallest coefficient, positive [m/s].

    References
    ----------
    J. J. Thomsen, A. Fidlin, Analytical approximations for stick-slip vibration amplitudes,
    International Journal of Non-Linear Mechanics 38 (2003), unsmoothed.
    """

    kernel: ClassVar = cubic

    static_coefficient: PerNode
    minimum_coefficient: NotNegative
    minimum_velocity: Annotated[Positive, Unit("m/s")]
    smoothing_slope: Annotated[Positive, Unit("s/m")] = 1e6
    smoothing: Smoothing = "arctan"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_at_least(self, "static_coefficient", "minimum_coefficient")


@friction_law
def no_friction(v, F, p):
    """Return R = 0 for all parameters: for nodes that cannot slide, such as springs."""
    return 0.0, 0.0, 0.0
