"""Rough surfaces of elastic-plastic asperities with measured heights, and their friction."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.checks import as_count, as_floats
from fecontact.core.errors import InputError, require_not_negative, shown
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import (
    ABOVE_ZERO,
    ZERO_OR_ABOVE,
    Bound,
    NormalLaw,
    NotNegative,
    PerNode,
    Positive,
)
from fecontact.laws.friction.maxwell_slip import ParallelSliders
from fecontact.laws.signatures import normal_law

_INTERVALS, _HEAD = 96, 2
# Places of the table from 0 to 1, dense where the first asperities touch.
_PLACES = np.linspace(0.0, 1.0, _INTERVALS + 1) ** 2
_YIELDED = 1.9  # approach over that of first yield from which on asperities are plastic
_HARDNESS = 2.84  # over the yield stress, of asperities that are large beside their contact
_GAPS = 400  # gaps of an integral over the heights


@normal_law
def _asperities(u, v, p):
    damped = 1.0 + p[1] * v
    if u <= 0.0 or damped <= 0.0:
        return 0.0, 0.0, 0.0
    s = u / p[0]
    k = min(int(_INTERVALS * math.sqrt(s)), _INTERVALS - 1)
    start, width = k * k, 2 * k + 1
    length = width / (_INTERVALS * _INTERVALS)
    x = (s * _INTERVALS * _INTERVALS - start) / width
    i = _HEAD + 2 * k
    F, m = p[i], p[i + 1] * length * p[0]
    rise, end = p[i + 2] - F, p[i + 3] * length * p[0]
    if x > 1.0:
        force, slope = p[i + 2] + (x - 1.0) * end, end
    else:
        b, c = 3.0 * rise - 2.0 * m - end, m + end - 2.0 * rise
        force, slope = F + x * (m + x * (b + x * c)), m + x * (2.0 * b + x * 3.0 * c)
    return force * damped, slope / (length * p[0]) * damped, force * p[1]


@dataclass(frozen=True)
class AsperityContact(NormalLaw):
    r"""Elastic-plastic asperities of one radius, with measured heights.

    .. math:: F = N \int_0^{z_m} f(u - g)\, \rho(g)\, dg \cdot \max(0,\ 1 + \chi v)

    u is the penetration [m] since the first asperity touched, v its rate [m/s], F the normal force
    on the body [N], never tensile, g the gap of a pair of asperities from there, of density rho.
    Below 1.9 times the approach of first yield d_y a pair follows Hertz, beyond it Jackson and
    Green:

    .. math::

        f = \tfrac43 E^* \sqrt{R}\, \delta^{3/2}, \qquad
        f = f_c \big[e^{-s^{5/12} / 4} s^{3/2} + \tfrac{4 H}{C}
        (1 - e^{-s^{5/9} / 25})\, s\big], \quad s = \delta / \delta_y

    with d_y = (pi C S_y / (2 E*))^2 R, C = 1.295 exp(0.736 nu), f_c = 4/3 E* R^(1/2) d_y^(3/2) and
    the hardness H = 2.84. With ``deepest`` the asperities have been flattened by this penetration
    before, and are elastic, of radius R / r and shortened by d_m (1 - r), where r is the force at
    the deepest approach d_m over that of Hertz; see :meth:`flattened`. Loading by the law without
    ``deepest`` is plastic, unloading by it is not.

    Parameters
    ----------
    asperities : float or (n,) sequence
        N: pairs of asperities of the whole face, or of each node, positive.
    asperity_radius, composite_modulus : float
        R, E*, positive: 1/R = 1/R_1 + 1/R_2, 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 [m], [Pa].
    gap_range : float
        z_m, positive [m].
    density : sequence
        rho at equally spaced gaps from 0 to z_m, zero or above, in any unit.
    yield_stress : float
        S_y [Pa]; 0, the default, for elastic asperities.
    poisson_ratio : float
        nu, from 0 to 0.5.
    deepest : float or (n,) sequence
        Largest penetration before, zero or above [m]; 0 for a new surface.
    damping_factor : float or (n,) sequence
        chi, zero or above [s/m].

    References
    ----------
    R. L. Jackson, I. Green, A finite element study of elasto-plastic hemispherical contact against
    a rigid flat, Journal of Tribology 127 (2005); M. R. W. Brake, An analytical elastic plastic
    contact model with strain hardening and frictional effects for normal and oblique impacts,
    International Journal of Solids and Structures 62 (2015); J. H. Porter, M. R. W. Brake,
    Mechanical Systems and Signal Processing 192 (2023) 110210.
    """

    kernel: ClassVar = _asperities
    extensive: ClassVar = frozenset({"asperities"})
    shared_fields: ClassVar = frozenset({"density"})

    asperities: Positive
    asperity_radius: Annotated[float, ABOVE_ZERO, Unit("m")]
    composite_modulus: Annotated[float, ABOVE_ZERO, Unit("Pa")]
    gap_range: Annotated[float, ABOVE_ZERO, Unit("m")]
    density: tuple[float, ...] = (1.0, 1.0)
    yield_stress: Annotated[float, ZERO_OR_ABOVE, Unit("Pa")] = 0.0
    poisson_ratio: Annotated[float, Bound("from 0 to 0.5", lambda x: (x >= 0.0) & (x <= 0.5))] = 0.3
    deepest: Annotated[NotNegative, Unit("m")] = 0.0
    damping_factor: Annotated[NotNegative, Unit("s/m")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        rho = np.asarray(self.density)
        if rho.ndim != 1 or len(rho) < 2 or (rho < 0.0).any() or not rho.any():
            raise InputError(f"AsperityContact: density = {self.density!r} must be at least two "
                             f"numbers, zero or above and not all zero.")

    @property
    def yield_approach(self) -> float:
        """Approach d_y of first yield of a pair [m]; infinite for elastic asperities."""
        if not self.yield_stress:
            return math.inf
        C = 1.295 * math.exp(0.736 * self.poisson_ratio)
        strain = math.pi * C * self.yield_stress / (2.0 * self.composite_modulus)
        return strain**2 * self.asperity_radius

    def pair_force(self, approach: Array) -> Array:
        """Force f [N] of one new pair of asperities over its approach [m]."""
        d = np.maximum(approach, 0.0)
        hertz = 4.0 / 3.0 * self.composite_modulus * math.sqrt(self.asperity_radius) * d**1.5
        d_y = self.yield_approach
        if math.isinf(d_y):
            return np.asarray(hertz)
        s = np.maximum(d / d_y, _YIELDED)
        C = 1.295 * math.exp(0.736 * self.poisson_ratio)
        limit = 4.0 / 3.0 * self.composite_modulus * math.sqrt(self.asperity_radius) * d_y**1.5
        plastic = limit * (np.exp(-0.25 * s ** (5.0 / 12.0)) * s**1.5
                           + 4.0 * _HARDNESS / C * -np.expm1(-(s ** (5.0 / 9.0)) / 25.0) * s)
        return np.where(d < _YIELDED * d_y, hertz, np.minimum(plastic, hertz))

    def _flattening(self, deepest: Array, gaps: Array) -> tuple[Array, Array]:
        """Ratio r of force to that of Hertz at the deepest approach, and that approach; of pairs.

        Pairs that have not touched have the ratio one.
        """
        d = np.maximum(deepest[..., None] - gaps, 0.0)
        hertz = replace(self, yield_stress=0.0).pair_force(d)
        touched = d > 0.0
        return np.where(touched, self.pair_force(d) / np.where(touched, hertz, 1.0), 1.0), d

    def _quadrature(self, end: Array) -> tuple[Array, Array]:
        """Gaps (k, q) up to ``end`` (k,), and parts of all pairs (..., q) that have them."""
        share = np.clip(np.asarray(end)[:, None] / self.gap_range, 0.0, 1.0)
        middles = (np.arange(_GAPS) + 0.5) / _GAPS
        places = np.linspace(0.0, 1.0, len(self.density))
        rho = np.interp(share * middles, places, self.density)
        return share * middles * self.gap_range, share * rho / np.interp(
            middles, places, self.density).sum()

    def curve(self, penetration: Array, deepest: float = 0.0) -> tuple[Array, Array]:
        """Force per pair of the face [N] and its derivative [N/m] at penetrations (k,)."""
        gaps, parts = self._quadrature(penetration)
        approach = np.asarray(penetration)[:, None] - gaps
        if deepest > 0.0:
            ratio, d_m = self._flattening(np.asarray(deepest), gaps)
            left = np.maximum(approach - d_m * (1.0 - ratio), 0.0)
            stiff = 2.0 * self.composite_modulus * np.sqrt(self.asperity_radius / ratio * left)
            return 2.0 / 3.0 * (stiff * left * parts).sum(axis=1), (stiff * parts).sum(axis=1)
        step = 1e-4 * self.gap_range / _GAPS
        slope = (self.pair_force(approach + step) - self.pair_force(approach - step)) / (2.0 * step)
        return (self.pair_force(approach) * parts).sum(axis=1), (slope * parts).sum(axis=1)

    def table(self, share: Array) -> Array:
        """Parameters (n, 2 + 2 k): length of the table, chi, forces and slopes at its places."""
        rows = []
        for count, *_, deepest, factor in super().table(share):
            # Beyond all gaps, and the deepest penetration, pairs stiffen as one.
            end = 2.0 * max(self.gap_range, deepest)
            force, slope = self.curve(end * _PLACES, deepest)
            # Cubic pieces rise monotonically where slopes are at most three times the chord's.
            chord = 3.0 * np.diff(force) / (end * np.diff(_PLACES))
            for part in (slope[1:], slope[:-1]):
                np.minimum(part, chord, out=part)
            rows.append([end, factor, *(count * np.stack([force, slope], axis=1)).ravel()])
        return np.array(rows)

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u."""
        from scipy.interpolate import CubicHermiteSpline

        found = []
        for u, (end, _, *values) in zip(np.moveaxis(penetration, -1, 0), self.table(share),
                                        strict=True):
            force, slope = np.reshape(values, (-1, 2)).T
            curve = CubicHermiteSpline(end * _PLACES, force, slope).antiderivative()
            beyond = np.maximum(u - end, 0.0)
            found.append(curve(np.clip(u, 0.0, end))
                         + beyond * (force[-1] + 0.5 * beyond * slope[-1]))
        return np.stack(found, axis=-1)

    @property
    def penetration_scale(self) -> float:
        """Part of the gaps [m]: a hundredth of their range."""
        return 0.01 * self.gap_range

    def untouched(self, nodes: int) -> Array:
        """Zero (n,), where the first asperities touch."""
        return np.full(nodes, 0.0 if self.kernel is _asperities else -np.inf)

    def flattened(self, penetration: PerNode | Array) -> "AsperityContact":
        """The law after the face, or each node, has been pressed in so far [m]."""
        found = as_floats(penetration, "AsperityContact.flattened: penetration")
        given = np.maximum(found, 0.0)
        return replace(self, deepest=tuple(given.tolist()) if given.ndim else float(given))

    def friction(
        self, share: Array, penetration: Array, coefficient: float, elements: int = 6
    ) -> ParallelSliders:
        r"""Friction of the asperities at a state of rest, by Mindlin's stiffness.

        A pair with the contact radius a sticks with the stiffness ``8 G* a`` and slides at mu f,
        where ``4 G* / E* = 2 (1 - nu) / (2 - nu)``. Pairs are joined to elements of equal
        stiffness, in the order in which they begin to slide.

        Parameters
        ----------
        share : (n,) array
            Part of the face of each node.
        penetration : (n,) array
            Penetration of the nodes at rest [m], to which they have been flattened.
        coefficient : float
            Coefficient of friction mu.
        elements : int
            Number of elements of each node.

        Raises
        ------
        InputError
            If no node is in contact, for unequal numbers of nodes, or values out of range.
        """
        owner = "AsperityContact.friction"
        require_not_negative(owner, coefficient=coefficient)
        as_count(elements, f"{owner}: elements")
        u = as_floats(penetration, f"{owner}: penetration")
        if not np.isfinite(u).all():
            raise InputError(f"{owner}: penetration = {shown(penetration)} must be finite [m].")
        if u.shape != np.shape(share) or not (u > 0.0).any():
            raise InputError(f"AsperityContact.friction: penetration has the shape {u.shape}, "
                             f"share {np.shape(share)}; give one for each node, and one above "
                             f"zero at least.")
        gaps, parts = self._quadrature(u)
        count = super().table(np.asarray(share))[:, 0]
        nu = self.poisson_ratio
        ratio, d = self._flattening(u, gaps)
        left = ratio * d  # what is elastic of the approach
        stick = (2.0 * (1.0 - nu) / (2.0 - nu) * 2.0 * self.composite_modulus
                 * np.sqrt(self.asperity_radius / ratio * left)) * parts
        total = count * stick.sum(axis=1)
        # Pairs slide in the order of their approach; edges of elements by the sum of stiffness.
        weight, limits = 0.0, np.zeros(elements)
        for node in np.flatnonzero(total):
            order = np.argsort(left[node], kind="stable")
            k, f = stick[node, order], (stick[node] * left[node])[order]
            edges = np.linspace(0.0, k.sum(), elements + 1)
            below = np.interp(edges, np.append(0.0, np.cumsum(k)), np.append(0.0, np.cumsum(f)))
            limits += count[node] * np.diff(below)
            weight += count[node] * f.sum()
        # Nodes that are open have the least stiffness of the others.
        least = total[total > 0.0].min()
        return ParallelSliders(tuple(np.where(total > 0.0, total, least).tolist()), coefficient,
                               (1.0,) * elements, tuple((limits / weight).tolist()))
