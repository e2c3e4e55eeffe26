"""Friction laws with memory: bristles and hysteresis."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.compiled import helper
from fecontact.core.simd.vectors import select, somewhere
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import Bound, NotNegative, OneOrAbove, PerNode, Positive
from fecontact.laws.friction.base import LimitedFriction, MemoryFriction, require_at_least
from fecontact.laws.friction.planar import clear, direction
from fecontact.laws.signatures import memory_friction_law, planar_friction_law

# Time constant [s] of the decay of internal variables without normal force.
_FADING = 1e-7


@helper
def _fade(F, tangents, z, rates):
    """Let one internal variable along each tangent decay where there is no normal force."""
    is_open = F <= 0.0
    if somewhere(is_open):
        for i in range(tangents):
            for k in range(3 + tangents):
                rate, unit = rates[i, k], 1.0 if k == 3 + i else 0.0
                rates[i, k] = select(is_open, -unit / _FADING, rate)
            rates[i, 0] = select(is_open, -z[i] / _FADING, rates[i, 0])
            if tangents > 1:
                last = 3 + len(rates)
                rates[i, last] = select(is_open, 0.0, rates[i, last])


@memory_friction_law
def dahl(v, F, z, p, force, rates):
    """R = F sigma z."""
    mu, stiffness, exponent = p[0], p[1], p[2]
    force[0] = F * stiffness * z[0]
    force[1] = 0.0
    force[2] = stiffness * z[0]
    force[3] = F * stiffness
    sign = select(v >= 0.0, 1.0, -1.0)
    left = 1.0 - sign * stiffness * z[0] / mu
    power = abs(left) ** (exponent - 1.0)
    rates[0, 0] = v * power * left
    rates[0, 1] = power * left
    rates[0, 2] = 0.0
    rates[0, 3] = -abs(v) * exponent * power * stiffness / mu
    _fade(F, 1, z, rates)


@helper
def _approach(s, exponent):
    """h(s) = [1 - |1 - s|^(i-1) (1 - s)] / s of Dahl's law, and its derivative."""
    i = exponent
    if abs(s) < 1e-3:
        # Series, whose next term is below round-off of what is left.
        c2 = 0.5 * i * (i - 1.0)
        c3 = c2 * (i - 2.0) / 3.0
        c4 = c3 * (i - 3.0) / 4.0
        c5 = c4 * (i - 4.0) / 5.0
        return (i + s * (-c2 + s * (c3 + s * (-c4 + s * c5))),
                -c2 + s * (2.0 * c3 + s * (-3.0 * c4 + s * 4.0 * c5)))
    left = 1.0 - s
    power = abs(left) ** (i - 1.0)
    covered = 1.0 - power * left
    return covered / s, (i * power * s - covered) / (s * s)


@planar_friction_law
def _planar_dahl(law, v1, v2, F, z, p, force, rates):
    """R = F sigma z, z' = v - |v| h(s) sigma z / mu with s = sigma z.e / mu."""
    clear(force, rates)
    mu, stiffness, exponent = p[0], p[1], p[2]
    if F <= 0.0:
        _fade(F, 2, z, rates)
        return
    a = stiffness / mu
    speed, e1, e2 = direction(v1, v2, z[0], z[1])
    along = z[0] * e1 + z[1] * e2
    h, h_s = _approach(a * along, exponent)
    for i in range(2):
        row = i * (4 + len(rates))
        force[row] = F * stiffness * z[i]
        force[row + 2] = stiffness * z[i]
        force[row + 3 + i] = F * stiffness
        v = v1 if i == 0 else v2
        rates[i, 0] = v - speed * h * a * z[i]
        for k in range(2):
            e = e1 if k == 0 else e2
            unit = 1.0 if i == k else 0.0
            rates[i, 1 if k == 0 else 3 + len(rates)] = unit - a * z[i] * (
                h * e + h_s * a * (z[k] - along * e))
            rates[i, 3 + k] = -speed * a * (h * unit + z[i] * h_s * a * e)


@helper
def _lugre(v, e, speed, F, z, p, force, rates):
    """R = F [sigma_0 z + sigma_1(|v|) z' + sigma_2 v], z' = v - sigma_0 |v| z / g; v = |v| e."""
    static, kinetic, stribeck, exponent = p[0], p[1], p[2], p[3]
    stiffness, damping, viscous, decay = p[4], p[5], p[6], p[7]
    x = (speed / stribeck) ** exponent
    excess = (static - kinetic) * math.exp(-x)
    g = kinetic + excess
    # |v| g' / g: finite at rest for every exponent.
    fall = -exponent * x * excess / g
    fade = damping * math.exp(-((decay * speed) ** 2))
    for i in range(len(v)):
        row, u = i * (4 + len(rates)), stiffness * z[i] / g
        rate = v[i] - speed * u
        ratio = stiffness * z[i] + fade * rate + viscous * v[i]
        rates[i, 0], rates[i, 2] = rate, 0.0
        force[row], force[row + 2] = F * ratio, ratio
        for k in range(len(v)):
            unit, column = 1.0 if i == k else 0.0, 1 if k == 0 else 3 + len(rates)
            rate_v, rate_z = unit - u * e[k] * (1.0 - fall), -speed * stiffness / g * unit
            rates[i, column], rates[i, 3 + k] = rate_v, rate_z
            force[row + column] = F * (fade * (rate_v - 2.0 * decay * decay * v[k] * rate)
                                       + viscous * unit)
            force[row + 3 + k] = F * (stiffness * unit + fade * rate_z)
    _fade(F, len(v), z, rates)


@memory_friction_law
def lugre(v, F, z, p, force, rates):
    """LuGre friction along a line."""
    _lugre((v,), (select(v >= 0.0, 1.0, -1.0),), abs(v), F, z, p, force, rates)


@planar_friction_law
def _planar_lugre(law, v1, v2, F, z, p, force, rates):
    """LuGre friction in two directions."""
    clear(force, rates)
    speed, e1, e2 = direction(v1, v2, z[0], z[1])
    _lugre((v1, v2), (e1, e2), speed, F, z, p, force, rates)


@helper
def _bouc_wen(v, a, size, F, z, p, force, rates):
    """R = mu F z, u_s z' = v - (beta |v.a| + (1 - beta) v.a) |z|^n a with z = |z| a."""
    mu, yielding, beta, exponent = p[0], p[1], p[2], p[3]
    along = 0.0
    for i in range(len(v)):
        along += v[i] * a[i]
    share = beta * select(along >= 0.0, 1.0, -1.0) + 1.0 - beta
    power = size ** (exponent - 1.0)
    for i in range(len(v)):
        row = i * (4 + len(rates))
        force[row], force[row + 2] = mu * F * z[i], mu * z[i]
        rates[i, 0], rates[i, 2] = (v[i] - share * along * power * size * a[i]) / yielding, 0.0
        for k in range(len(v)):
            unit, column = 1.0 if i == k else 0.0, 1 if k == 0 else 3 + len(rates)
            force[row + column], force[row + 3 + k] = 0.0, mu * F * unit
            rates[i, column] = (unit - share * power * size * a[i] * a[k]) / yielding
            rates[i, 3 + k] = -share * power * (
                v[k] * a[i] + along * ((exponent - 2.0) * a[i] * a[k] + unit)) / yielding
    _fade(F, len(v), z, rates)


@memory_friction_law
def bouc_wen(v, F, z, p, force, rates):
    """Bouc-Wen hysteresis along a line."""
    _bouc_wen((v,), (select(z[0] >= 0.0, 1.0, -1.0),), abs(z[0]), F, z, p, force, rates)


@planar_friction_law
def _planar_bouc_wen(law, v1, v2, F, z, p, force, rates):
    """Bouc-Wen hysteresis in two directions."""
    clear(force, rates)
    size = math.hypot(z[0], z[1])
    a = (z[0] / size, z[1] / size) if size > 0.0 else (0.0, 0.0)
    _bouc_wen((v1, v2), a, size, F, z, p, force, rates)


@dataclass(frozen=True)
class DahlFriction(LimitedFriction):
    r"""Dahl's law: a spring whose stiffness falls to zero as friction reaches mu F.

    .. math::

        R = F \sigma z, \qquad
        z' = v\, \left|1 - \tfrac{\sigma z}{\mu} \operatorname{sgn} v\right|^{i - 1}
        \left(1 - \tfrac{\sigma z}{\mu} \operatorname{sgn} v\right)

    z is a deflection [m], at most mu / sigma in magnitude, that does not depend on the normal
    force F [N]; the presliding stiffness sigma F [N/m] is proportional to F. v is the slip velocity
    [m/s]. While F = 0, z decays to zero.

    Parameters
    ----------
    friction_coefficient : float or (n,) sequence
        Friction coefficient mu, positive.
    presliding_stiffness : float or (n,) sequence
        Presliding stiffness sigma at R = 0 per normal force, positive [1/m].
    exponent : float or (n,) sequence
        Exponent i, one or above; with 1 friction approaches mu F exponentially.

    References
    ----------
    P. R. Dahl, A solid friction model, The Aerospace Corporation, TOR-0158(3107-18)-1 (1968).
    """

    kernel: ClassVar = dahl
    planar_kernel: ClassVar = _planar_dahl

    friction_coefficient: Positive
    presliding_stiffness: Annotated[Positive, Unit("1/m")]
    exponent: OneOrAbove = 1.0

    def bristle_stiffness_of(self, share: Array) -> Array:
        """Stiffness sigma F of the internal variable z: a = 0, b = sigma [1/m]."""
        stiffness = np.zeros((2, len(share), 1))
        stiffness[1, :, 0] = self.presliding_stiffness
        return stiffness

    @property
    def state_scale(self) -> Array:
        """Deflection mu / sigma at which the contact slides [m], the smallest of all nodes."""
        return np.array([np.min(np.divide(self.friction_coefficient, self.presliding_stiffness))])


@dataclass(frozen=True)
class LuGreFriction(MemoryFriction):
    r"""LuGre friction: bristles that deflect and slide.

    .. math::

        R = F\, [\sigma_0 z + \sigma_1(v)\, z' + \sigma_2 v], \qquad
        z' = v - \frac{\sigma_0 |v|}{g(v)} z

    .. math::

        g(v) = \mu_k + (\mu_s - \mu_k)\, e^{-(|v|/v_s)^a}, \qquad
        \sigma_1(v) = \sigma_1 e^{-(\lambda_1 v)^2}

    z is the deflection of the bristles [m], v the slip velocity [m/s], F the normal force [N], to
    which stiffness and damping are proportional. In steady sliding ``R = F [g(v) sgn v + sigma_2
    v]``. While F = 0, z decays to zero.

    Friction is dissipative in every motion if ``sigma_2 >= sigma_1 (mu_s / mu_k - 1)``, or if
    ``sigma_1 <= 9.3 mu_k lambda_1``; otherwise as long as ``sigma_1 |v| <= 4 mu_k``.

    Parameters
    ----------
    static_coefficient : float or (n,) sequence
        Coefficient mu_s at rest, at least mu_k.
    kinetic_coefficient : float or (n,) sequence
        Coefficient mu_k at high slip velocity, positive.
    stribeck_velocity : float or (n,) sequence
        Stribeck velocity v_s, positive [m/s].
    stribeck_exponent : float or (n,) sequence
        Exponent a of the Stribeck curve, positive; mostly 2 or 1.
    bristle_stiffness : float or (n,) sequence
        Bristle stiffness sigma_0 at rest per normal force, positive [1/m].
    bristle_damping : float or (n,) sequence
        Bristle damping sigma_1 at rest per normal force, zero or above [s/m].
    viscous_coefficient : float or (n,) sequence
        Viscous coefficient sigma_2 per normal force, zero or above [s/m].
    damping_decay : float or (n,) sequence
        Decay rate lambda_1 of the bristle damping, zero or above [s/m]: the damping falls to 1/e at
        the velocity 1 / lambda_1; with zero it is constant.

    References
    ----------
    C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, A new model for control of systems
    with friction, IEEE Transactions on Automatic Control 40 (1995). N. Barahanov, R. Ortega,
    Necessary and sufficient conditions for passivity of the LuGre friction model, ibid. 45 (2000).
    """

    kernel: ClassVar = lugre
    planar_kernel: ClassVar = _planar_lugre

    static_coefficient: PerNode
    kinetic_coefficient: Positive
    stribeck_velocity: Annotated[Positive, Unit("m/s")]
    stribeck_exponent: Positive
    bristle_stiffness: Annotated[Positive, Unit("1/m")]
    bristle_damping: Annotated[NotNegative, Unit("s/m")] = 0.0
    viscous_coefficient: Annotated[NotNegative, Unit("s/m")] = 0.0
    damping_decay: Annotated[NotNegative, Unit("s/m")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_at_least(self, "static_coefficient", "kinetic_coefficient")

    def bristle_stiffness_of(self, share: Array) -> Array:
        """Stiffness sigma_0 F of the internal variable z: a = 0, b = sigma_0 [1/m]."""
        stiffness = np.zeros((2, len(share), 1))
        stiffness[1, :, 0] = self.bristle_stiffness
        return stiffness

    @property
    def state_scale(self) -> Array:
        """Deflection mu_k / sigma_0 of sliding bristles [m], the smallest of all nodes."""
        return np.array([np.min(np.divide(self.kinetic_coefficient, self.bristle_stiffness))])

    @property
    def velocity_scale(self) -> float:
        """Stribeck velocity, or that of :class:`MemoryFriction` if it is lower [m/s]."""
        return min(super().velocity_scale, float(np.min(self.stribeck_velocity)))

    def steady_coefficient(self, velocity: Array | float) -> Array:
        """g(v) sgn(v) + sigma_2 v; see :class:`MemoryFriction`."""
        v = as_floats(velocity, f"{type(self).__name__}: velocity")
        kinetic = np.asarray(self.kinetic_coefficient)
        x = (np.abs(v) / self.stribeck_velocity) ** self.stribeck_exponent
        g = kinetic + (np.asarray(self.static_coefficient) - kinetic) * np.exp(-x)
        return np.asarray(np.where(v < 0.0, -g, g) + v * self.viscous_coefficient)


@dataclass(frozen=True)
class BoucWenFriction(LimitedFriction):
    r"""Bouc-Wen hysteresis between -mu F and mu F.

    .. math::

        R = \mu F z, \qquad
        z' = \frac{1}{u_s} \left[v - \beta\, |v|\, |z|^{n-1} z - (1 - \beta)\, v\, |z|^n\right]

    z is dimensionless, at most 1 in magnitude; the presliding stiffness ``mu F / u_s`` [N/m] is
    proportional to the normal force F [N]. v is the slip velocity [m/s]. While F = 0, z decays to
    zero.

    Parameters
    ----------
    yield_displacement : float or (n,) sequence
        Deflection u_s at which the initial stiffness would reach mu F, positive [m].
    beta : float or (n,) sequence
        beta, at least 1/2 so that loops dissipate energy; 1/2 unloads with the initial stiffness to
        R = 0, larger values make loops wider.
    exponent : float or (n,) sequence
        Exponent n, one or above: sharpness of the transition to sliding.

    References
    ----------
    Y.-K. Wen, Method for random vibration of hysteretic systems, Journal of the Engineering
    Mechanics Division 102 (1976); in the normal form of F. Ikhouane, J. Rodellar, Systems with
    Hysteresis (2007), with beta + gamma = 1.
    """

    kernel: ClassVar = bouc_wen
    planar_kernel: ClassVar = _planar_bouc_wen

    friction_coefficient: NotNegative
    yield_displacement: Annotated[Positive, Unit("m")]
    beta: Annotated[PerNode, Bound("0.5 or above", lambda x: x >= 0.5)] = 0.5
    exponent: OneOrAbove = 1.0

    def bristle_stiffness_of(self, share: Array) -> Array:
        """Stiffness mu F u_s of the internal variable z [J]: a = 0, b = mu u_s [m]."""
        stiffness = np.zeros((2, len(share), 1))
        stiffness[1, :, 0] = np.multiply(self.friction_coefficient, self.yield_displacement)
        return stiffness

    @property
    def state_scale(self) -> Array:
        """One: the internal variable of sliding."""
        return np.ones(1)

    @property
    def velocity_scale(self) -> float:
        """Slip velocity [m/s] that covers the smallest yield displacement in 0.1 s."""
        return 10.0 * float(np.min(self.yield_displacement))
