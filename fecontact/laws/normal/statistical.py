"""Normal laws of surfaces with unbounded heights: exponential and Greenwood-Williamson."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.simd.vectors import everywhere, select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import NormalLaw, NotNegative, PerNode, Positive
from fecontact.laws.signatures import normal_law

_FARTHEST, _DEEPEST = -50.0, 60.0


@normal_law
def _exponential(u, v, p):
    scale, length, factor = p[0], p[1], p[2]
    s = u / length
    damped = 1.0 + factor * v
    away = (s < _FARTHEST) | (damped <= 0.0)
    if everywhere(away):
        return 0.0, 0.0, 0.0
    slope = scale * math.exp(min(s, _DEEPEST))
    elastic = slope * (1.0 + max(s - _DEEPEST, 0.0))
    return (select(away, 0.0, elastic * damped), select(away, 0.0, slope / length * damped),
            select(away, 0.0, elastic * factor))


@dataclass(frozen=True)
class ExponentialContact(NormalLaw):
    r"""Self-affine rough surface: force that increases exponentially with approach (Persson).

    .. math:: F = F_0\, e^{u / u_0} \max(0,\ 1 + \chi v)

    u is the penetration [m] from a reference plane, v its rate [m/s], F the normal force on the
    body [N], never tensile. High peaks touch above that plane: F decays smoothly for u < 0 and is
    set to zero below -50 u_0, where it is 2e-22 F_0. Above 60 u_0, far beyond complete contact, it
    continues linearly with the same slope.

    Parameters
    ----------
    force : float or (n,) sequence
        Force F_0 at u = 0 of the whole face, or of each node, positive [N].
    decay_length : float or (n,) sequence
        Decay length u_0, of the order of the rms roughness, positive [m].
    damping_factor : float or (n,) sequence
        Damping factor chi, zero or above [s/m]: damping is proportional to the real contact area,
        and so to the force.

    References
    ----------
    B. N. J. Persson, Relation between interfacial separation and load, Phys. Rev. Lett. 99 (2007)
    125502.
    """

    kernel: ClassVar = _exponential
    extensive: ClassVar = frozenset({"force"})

    force: Annotated[Positive, Unit("N")]
    decay_length: Annotated[Positive, Unit("m")]
    damping_factor: Annotated[NotNegative, Unit("s/m")] = 0.0

    @property
    def penetration_scale(self) -> float:
        """Decay length u_0 [m], the smallest of all nodes."""
        return float(np.min(self.decay_length))

    def onsets(self, nodes: int) -> Array:
        """Penetration (1, n) at which the force is exp(-10) times that at u = 0 [m]."""
        return np.full((1, nodes), -10.0 * np.asarray(self.decay_length))

    def untouched(self, nodes: int) -> Array:
        """Penetration (n,) below which the force is set to zero, -50 u_0 [m]."""
        if self.kernel is not _exponential:
            return super().untouched(nodes)
        # A little deeper than that, for rounding.
        return np.array(np.broadcast_to(1.001 * _FARTHEST * np.asarray(self.decay_length), nodes))

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u."""
        force, length, _ = self.table(share).T
        s = np.maximum(penetration / length, _FARTHEST)
        beyond = np.maximum(s - _DEEPEST, 0.0)
        return np.asarray(force * length * (np.expm1(np.minimum(s, _DEEPEST))
                                            + math.exp(_DEEPEST) * beyond * (1 + beyond / 2)))


_CLOSEST, _INTERVALS_PER_UNIT, _APART, _DEGREE = -10.0, 2.0, 9.0, 9


def _logarithm_of_loads() -> Array:
    """Polynomials (intervals, degree + 1) of ln F_3/2(h) in x = -1 ... 1, highest power first.

    F_3/2(h) is the integral of (s - h)^(3/2) phi(s) over s > h, phi the normal density. With
    s = h + x^2 its integrand is an even entire function of x, for which the trapezoidal rule is
    exact to rounding.
    """
    count = round((_APART - _CLOSEST) * _INTERVALS_PER_UNIT)
    nodes = -np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
    h = _CLOSEST + (np.arange(count)[:, None] + 0.5 * (nodes + 1.0)) / _INTERVALS_PER_UNIT
    step = 0.02
    x = step * np.arange(1, 240)
    integrand = x**4 * np.exp(-0.5 * (h[..., None] + x**2) ** 2)
    loads = math.sqrt(2.0 / math.pi) * step * integrand.sum(axis=-1)
    powers = np.vander(nodes)
    return np.ascontiguousarray(np.linalg.solve(powers, np.log(loads).T).T)


_LOADS = _logarithm_of_loads()


@normal_law
def _greenwood(u, v, p):
    scale, deviation, separation, factor = p[0], p[1], p[2], p[3]
    h = separation - u / deviation
    damped = 1.0 + factor * v
    if h >= _APART or damped <= 0.0:
        return 0.0, 0.0, 0.0
    if h > _CLOSEST:
        x = (h - _CLOSEST) * _INTERVALS_PER_UNIT
        k = min(int(x), len(_LOADS) - 1)
        x = 2.0 * (x - k) - 1.0
        value, slope = _LOADS[k, 0], 0.0
        for i in range(1, _DEGREE + 1):
            slope = slope * x + value
            value = value * x + _LOADS[k, i]
        load = math.exp(value)
        fall = -2.0 * _INTERVALS_PER_UNIT * slope * load
    else:
        # All asperities are in contact: moments of the normal density.
        w = 1.0 / (h * h)
        term, total, odd = 1.0, 1.0, 0.0
        for k in range(1, 8):
            term *= (3.5 - 2.0 * k) * (2.5 - 2.0 * k) / (2.0 * k) * w
            total += term
            odd += 2.0 * k * term
        root = math.sqrt(-h)
        load = -h * root * total
        fall = root * (1.5 * total - odd)
    elastic = scale * load
    return elastic * damped, scale * fall / deviation * damped, elastic * factor


@dataclass(frozen=True)
class GreenwoodWilliamson(NormalLaw):
    r"""Spherical elastic asperities with normally distributed heights (Greenwood-Williamson).

    .. math::

        F = \tfrac{4}{3} E^* \sqrt{R}\, N \sigma^{3/2} F_{3/2}(h) \max(0,\ 1 + \chi v), \qquad
        h = h_0 - u / \sigma, \qquad
        F_{3/2}(h) = \int_h^\infty (s - h)^{3/2} \frac{e^{-s^2/2}}{\sqrt{2\pi}}\, ds

    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile,
    h the distance of the other surface from the mean plane of the asperities, divided by sigma.
    The heights are unbounded, so that F decays smoothly for u < 0; the contact is open from h = 9
    on, where F is 1e-20 times that at h = 0.

    Parameters
    ----------
    asperities : float or (n,) sequence
        Number N of asperities of the whole face, or of each node, positive.
    asperity_radius : float or (n,) sequence
        Radius R of the summits of asperities, positive [m].
    composite_modulus : float or (n,) sequence
        Composite modulus E*, 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2, positive [Pa].
    height_deviation : float or (n,) sequence
        Standard deviation sigma of the asperity heights, positive [m].
    separation : float or (n,) sequence
        Distance h_0 of the mean planes at u = 0, divided by sigma.
    damping_factor : float or (n,) sequence
        Hunt-Crossley damping factor chi, zero or above [s/m].

    References
    ----------
    J. A. Greenwood, J. B. P. Williamson, Contact of nominally flat surfaces, Proc. R. Soc. A 295
    (1966) 300-319.
    """

    kernel: ClassVar = _greenwood
    extensive: ClassVar = frozenset({"asperities"})

    asperities: Positive
    asperity_radius: Annotated[Positive, Unit("m")]
    composite_modulus: Annotated[Positive, Unit("Pa")]
    height_deviation: Annotated[Positive, Unit("m")]
    separation: PerNode = 3.0
    damping_factor: Annotated[NotNegative, Unit("s/m")] = 0.0

    @property
    def penetration_scale(self) -> float:
        """Standard deviation sigma of the asperity heights [m], the smallest of all nodes."""
        return float(np.min(self.height_deviation))

    def onsets(self, nodes: int) -> Array:
        """Penetration (1, n) at h = 5, where the force is 1e-7 times that at h = 0 [m]."""
        away = np.asarray(self.separation) - 5.0
        return np.array(np.broadcast_to(np.asarray(self.height_deviation) * away, (1, nodes)))

    def untouched(self, nodes: int) -> Array:
        """Penetration (n,) at h = 9, from where on the force is set to zero [m]."""
        if self.kernel is not _greenwood:
            return super().untouched(nodes)
        away = np.asarray(self.separation) - 1.001 * _APART
        return np.array(np.broadcast_to(np.asarray(self.height_deviation) * away, nodes))

    def table(self, share: Array) -> Array:
        """Parameters (n, 4): 4/3 E* R^(1/2) N sigma^(3/2), sigma, h_0, chi."""
        count, radius, modulus, deviation, separation, factor = super().table(share).T
        scale = 4.0 / 3.0 * modulus * np.sqrt(radius) * count * deviation**1.5
        return np.column_stack([scale, deviation, separation, factor])
