"""Rough surfaces: beds of asperities with a given density of heights."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.simd.vectors import everywhere, select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import Bound, NormalLaw, NotNegative, PerNode, Positive
from fecontact.laws.pieces import pieces_of
from fecontact.laws.signatures import normal_law

_TAU = 2.0 * math.pi
_ROOT_HALF = math.sqrt(0.5)
_DENSITY = 1.0 / math.sqrt(_TAU)


@helper
def bed_of_asperities(v, p, compression, bearing, density):
    """F, dF/du, dF/dv from f(s), h = f' and h'; p begins with c, R_Z and beta c."""
    stiffness, height, damping = p[0], p[1], p[2]
    force = stiffness * height * compression + damping * bearing * v
    away = force <= 0.0
    if everywhere(away):
        return 0.0, 0.0, 0.0
    return (select(away, 0.0, force),
            select(away, 0.0, stiffness * bearing + damping * density / height * v),
            select(away, 0.0, damping * bearing))


@normal_law
def uniform(u, v, p):
    """Density 1."""
    if everywhere(u <= 0.0):
        return 0.0, 0.0, 0.0
    s = select(u <= 0.0, 0.0, u / p[1])
    partly = s < 1.0
    return bed_of_asperities(v, p, select(partly, 0.5 * s * s, s - 0.5),
                             select(partly, s, 1.0), select(partly, 1.0, 0.0))


@normal_law
def parabolic(u, v, p):
    """Density 6 s (1 - s)."""
    if everywhere(u <= 0.0):
        return 0.0, 0.0, 0.0
    s = select(u <= 0.0, 0.0, u / p[1])
    partly = s < 1.0
    return bed_of_asperities(v, p, select(partly, s * s * s * (1.0 - 0.5 * s), s - 0.5),
                             select(partly, s * s * (3.0 - 2.0 * s), 1.0),
                             select(partly, 6.0 * s * (1.0 - s), 0.0))


@normal_law
def cosine(u, v, p):
    """Density 1 - cos(2 pi s)."""
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    compression, bearing, density = s - 0.5, 1.0, 0.0
    if s < 1.0:
        x = _TAU * s
        cosine = math.cos(x)
        density = 1.0 - cosine
        if x > 0.5:
            bearing = s - math.sin(x) / _TAU
            compression = 0.5 * s * s - density / (_TAU * _TAU)
        else:
            # Series, to avoid cancellation in the differences above.
            y = x * x
            density = 2.0 * math.sin(0.5 * x) ** 2
            bearing = x * y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (
                1.0 - y / 110.0)))) / _TAU
            compression = y * y / 24.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * (1.0 - y / 90.0 * (
                1.0 - y / 132.0)))) / (_TAU * _TAU)
    return bed_of_asperities(v, p, compression, bearing, density)


@normal_law
def gaussian(u, v, p):
    """Density of a normal distribution within 0 <= s <= 1."""
    deviation, highest, first_moment, norm = p[3], p[4], p[5], p[6]
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    compression, bearing, density = s - 0.5, 1.0, 0.0
    if s < 1.0:
        t = (s - 0.5) / deviation
        y, b = s / deviation, 0.5 / deviation
        normal = _DENSITY * math.exp(-0.5 * t * t)
        density = norm * normal / deviation
        if y * (b + 1.0) > 0.1:
            part = 0.5 * math.erfc(-_ROOT_HALF * t)
            bearing = norm * (part - highest)
            compression = norm * (deviation * (t * part + normal - first_moment) - s * highest)
        else:
            # Series in Hermite polynomials, to avoid cancellation in the differences above.
            scale = norm * _DENSITY * math.exp(-0.5 * b * b)
            before, hermite, term = 0.0, 1.0, y
            bearing, compression = 0.0, 0.0
            for n in range(10):
                bearing += hermite * term
                compression += hermite * term * y / (n + 2.0)
                before, hermite = hermite, b * hermite - n * before
                term *= y / (n + 2.0)
            bearing *= scale
            compression *= scale * deviation
    return bed_of_asperities(v, p, compression, bearing, density)


# Laws that are zero for u <= 0.
_BEDS = (uniform, parabolic, cosine, gaussian)


@dataclass(frozen=True)
class RoughSurface(NormalLaw):
    r"""Rough surface with uniformly distributed asperity heights (4.1-16).

    .. math:: F = \max(0,\ c R_Z f(s) + \beta c\, h(s)\, v), \qquad s = u / R_Z

    with f = 0, s^2/2, s - 1/2 and h = f' = 0, s, 1 for s < 0, 0 <= s <= 1, s > 1: each asperity
    in contact is a spring with a parallel dashpot, and once all are in contact the law is linear.
    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile.

    For another density p(z) of the relative depth z of the peaks below the highest one, f(s) is the
    integral of (s - z) p(z) from 0 to s, and h = f' the bearing-area curve.

    How to choose. R_Z is measured by a profilometer: 1 to 10 um ground, 10 to 100 um milled. The
    stiffness is the ratio of load and approach of the two faces in a press; joints of machined
    metal have 1e12 to 1e14 N/m per m2 of nominal area, increasing with pressure. If it is unknown,
    choose a value at which the contact is much stiffer than the body (the report of a modal basis
    gives the body's compliance), and vary it by factors of two to see its influence. Damping: beta
    between 1e-6 and 1e-4 s, or from the restitution of an impact.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        Stiffness c of the whole face, or of each node, when all asperities are in contact, positive
        [N/m].
    roughness_height : float or (n,) sequence
        Peak-to-valley height R_Z of the surface, positive [m].
    damping : float or (n,) sequence
        Damping beta c of the whole face, or of each node, when all asperities are in contact, zero
        or above [N s/m].

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.1; the bearing-area curve of
    uniform heights.
    """

    kernel: ClassVar = uniform
    extensive: ClassVar = frozenset({"stiffness", "damping"})

    stiffness: Annotated[Positive, Unit("N/m")]
    roughness_height: Annotated[Positive, Unit("m")]
    damping: Annotated[NotNegative, Unit("N s/m")] = 0.0

    @property
    def penetration_scale(self) -> float:
        """Roughness height R_Z [m], the smallest of all nodes."""
        return float(np.min(self.roughness_height))

    def untouched(self, nodes: int) -> Array:
        """Zero (n,), the place of the highest peak."""
        return np.full(nodes, 0.0 if self.kernel in _BEDS else -np.inf)

    def pieces(self, share: Array) -> Array | None:
        """Three pieces for uniform heights: no asperity, a part, all in contact; else None."""
        if self.kernel is not uniform:
            return None
        c, R, d = self.table(share).T
        return pieces_of(len(share), [
            [-np.inf, 0.0],
            [0.0, R, 0.0, 0.0, 0.5 * c / R, 0.0, d / R, 0.0, 0.0, 0.5 * c, d],
            [R, np.inf, -0.5 * c * R, c, 0.0, d, 0.0, 0.0, -0.5 * c * R, c, d]])

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the asperities [J]: the integral of F(u, 0) from 0 to u."""
        table = self.table(share)
        stiffness, height = table[:, 0], table[:, 1]
        s = np.maximum(penetration / height, 0.0)
        above = np.maximum(s - 1.0, 0.0)
        partly = self._energy(np.minimum(s, 1.0), table)
        complete = above * (self._complete + above / 2.0)
        return np.asarray(stiffness * height**2 * (partly + complete))

    @property
    def _complete(self) -> float:
        """f(1): one minus the mean of the density."""
        return 0.5

    def _energy(self, s: Array, table: Array) -> Array:
        """Integral of f from 0 to s, for s within 0 ... 1."""
        return s**3 / 6.0


@dataclass(frozen=True)
class ParabolicSurface(RoughSurface):
    r"""Rough surface with few high peaks and few deep valleys: p = 6 z (1 - z).

    .. math:: F = \max(0,\ c R_Z f(s) + \beta c\, h(s)\, v), \qquad s = u / R_Z

    with f = s^3 - s^4/2, h = 3 s^2 - 2 s^3 for 0 <= s <= 1 and f = s - 1/2, h = 1 above; signs
    and units are those of :class:`RoughSurface`.
    """

    kernel: ClassVar = parabolic

    def _energy(self, s: Array, table: Array) -> Array:
        return s**4 * (0.25 - 0.1 * s)


@dataclass(frozen=True)
class CosineSurface(RoughSurface):
    r"""Rough surface with few high peaks and few deep valleys: p = 1 - cos(2 pi z).

    .. math:: F = \max(0,\ c R_Z f(s) + \beta c\, h(s)\, v), \qquad s = u / R_Z

    with f = s^2/2 - (1 - cos(2 pi s)) / (4 pi^2), h = s - sin(2 pi s) / (2 pi) for 0 <= s <= 1
    and f = s - 1/2, h = 1 above; signs and units are those of :class:`RoughSurface`.
    """

    kernel: ClassVar = cosine

    def _energy(self, s: Array, table: Array) -> Array:
        x = _TAU * s
        series = x**5 / 120.0 * (1.0 - x**2 / 42.0 * (1.0 - x**2 / 72.0 * (1.0 - x**2 / 110.0)))
        return np.where(x < 0.2, series, x**3 / 6.0 - x + np.sin(x)) / _TAU**3


@dataclass(frozen=True)
class GaussianSurface(RoughSurface):
    r"""Rough surface with normally distributed heights, truncated to the range R_Z.

    .. math:: F = \max(0,\ c R_Z f(s) + \beta c\, h(s)\, v), \qquad s = u / R_Z

    with the density :math:`p(z) \propto \exp(-(z - 1/2)^2 / (2 \sigma^2))` within 0 <= z <= 1,
    of unit area, f(s) the integral of (s - z) p(z) from 0 to s and h = f'; signs and units are
    those of :class:`RoughSurface`.

    Parameters
    ----------
    deviation : float or (n,) sequence
        Standard deviation sigma of the heights before truncation, divided by R_Z; from 0.02 to 1
        (nearly uniform).
    """

    kernel: ClassVar = gaussian

    deviation: Annotated[PerNode, Bound(
        "at least 0.02 and at most 1", lambda x: (x >= 0.02) & (x <= 1.0))] = 1.0 / 6.0

    def table(self, share: Array) -> Array:
        """Parameters (n, 7): the fields, and three integrals of the density at the highest peak."""
        from scipy.special import erf, ndtr

        table = super().table(share)
        b = 0.5 / table[:, 3]
        first_moment = _DENSITY * np.exp(-0.5 * b**2) - b * ndtr(-b)
        return np.column_stack([table, ndtr(-b), first_moment, 1.0 / erf(b * _ROOT_HALF)])

    def _energy(self, s: Array, table: Array) -> Array:
        from scipy.special import ndtr

        deviation, highest, first_moment, norm = table[:, 3:7].T

        def second(t: Array) -> Array:
            return np.asarray((t**2 + 1.0) * ndtr(t) + t * _DENSITY * np.exp(-0.5 * t**2)) / 2.0

        moments = second((s - 0.5) / deviation) - second(-0.5 / deviation)
        return np.asarray(norm * (deviation**2 * moments - deviation * first_moment * s
                                  - highest * s**2 / 2.0))
