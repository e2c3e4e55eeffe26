"""Normal laws that are a power of the penetration, with damping proportional to the force.

Hertz: exponent 3/2 for a point contact; 10/9 approximates a line contact.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, get_args

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.simd.vectors import everywhere, select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import ONE_OR_ABOVE, NormalLaw, NotNegative, PerNode, Positive, UpToOne
from fecontact.laws.pieces import pieces_of
from fecontact.laws.signatures import normal_law

DampingModel = Literal["exact", "hunt-crossley", "lankarani-nikravesh", "flores"]

EXPONENTS = {"point": 1.5, "line": 10.0 / 9.0}
Exponent = Annotated[PerNode | Literal["point", "line"], ONE_OR_ABOVE]


@helper
def lower_power(x, exponent):
    """x^(exponent - 1) of x >= 0; exponents 1, 3/2 and 2 are much faster than others."""
    by_root, flat, usual = exponent == 1.5, exponent == 1.0, exponent == 2.0
    usual = usual | by_root | flat
    power = select(by_root, math.sqrt(x), select(flat, 1.0, x))
    if not everywhere(usual):
        power = select(usual, power, x ** (exponent - 1.0))
    return power


@normal_law
def _power(u, v, p):
    scale, length, exponent, factor = p[0], p[1], p[2], p[3]
    damped = 1.0 + factor * v
    away = (u <= 0.0) | (damped <= 0.0)
    if everywhere(away):
        return 0.0, 0.0, 0.0
    ratio = select(away, 0.0, u / length)
    lower = lower_power(ratio, exponent)
    elastic = scale * lower * ratio
    return (select(away, 0.0, elastic * damped),
            select(away, 0.0, exponent * scale * lower / length * damped),
            select(away, 0.0, elastic * factor))


@dataclass(frozen=True)
class _Power(NormalLaw):
    """Laws whose row of parameters is F_0, l, n, chi of F_0 (u / l)^n max(0, 1 + chi v).

    Parameters
    ----------
    stiffness : float or (n,) sequence
        Stiffness K of the whole face, or of each node, positive [N/m^n].
    exponent : float, (n,) sequence, "point" or "line"
        Exponent n, one or above; "point" is 3/2, "line" is 10/9.
    damping_factor : float or (n,) sequence
        Hunt-Crossley damping factor chi, zero or above [s/m].
    """

    kernel: ClassVar = _power


    @property
    def penetration_scale(self) -> float:
        """Penetration under 1 N on the whole face, or on each node [m], the smallest of all."""
        sizes = [np.size(value) for value in vars(self).values() if not isinstance(value, str)]
        table = self.table(np.ones(max(sizes)))
        return float(np.min(table[:, 1] * table[:, 0] ** (-1.0 / table[:, 2])))

    def untouched(self, nodes: int) -> Array:
        """Zero (n,): nodes that are open have no force."""
        return np.full(nodes, 0.0 if self.kernel is _power else -np.inf)

    def pieces(self, share: Array) -> Array | None:
        """Two pieces, no force for u < 0 and the force above, for n = 1 or n = 2; else None."""
        scale, length, exponent, factor = self.table(share).T
        if self.kernel is not _power or not np.isin(exponent, (1.0, 2.0)).all():
            return None
        K = scale / length**exponent
        e = [0.0 * K, np.where(exponent == 1.0, K, 0.0), np.where(exponent == 2.0, K, 0.0)]
        return pieces_of(len(share), [
            [-np.inf, 0.0],
            [0.0, np.inf, *e, *(factor * one for one in e), 1.0, 0.0, factor]])

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the contact [J]: the integral of F(u, 0) from 0 to u."""
        scale, length, exponent, _ = self.table(share).T
        s = np.maximum(penetration / length, 0.0)
        return np.asarray(scale * length / (exponent + 1.0) * s ** (exponent + 1.0))


class _Hertz(_Power):
    """Laws whose exponent may be given by the kind of contact."""

    def __post_init__(self) -> None:
        given = getattr(self, "exponent")  # noqa: B009 - the field of subclasses
        if isinstance(given, str):
            if given not in EXPONENTS:
                raise InputError(f"{type(self).__name__}: exponent = {given!r} must be a number or "
                                 f"{choices(EXPONENTS)}{nearest(given, EXPONENTS)}.")
            object.__setattr__(self, "exponent", EXPONENTS[given])
        super().__post_init__()


@dataclass(frozen=True)
class PowerContact(_Hertz):
    r"""Hertz-type point or line contact with Hunt-Crossley damping.

    .. math:: F = K u^n \max(0,\ 1 + \chi v), \qquad u > 0

    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile.
    n = 3/2 is Hertz's point contact, as of a sphere on a plane; n = 10/9, after Palmgren, is close
    to a line contact, as of a roller, whose approach has no exact power; n = 1 is a linear spring.
    Damping is proportional to the elastic force, so that F is continuous at first contact.

    A plane finite-element body already has the compliance of its own line contact, as far as its
    basis resolves it: a Hertz law on top counts it twice.

    References
    ----------
    K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in
    vibroimpact, J. Appl. Mech. 42 (1975) 440-445. T. A. Harris, M. N. Kotzalas, Essential Concepts
    of Bearing Technology, 5th ed., CRC Press (2006), for the exponent 10/9.
    """

    extensive: ClassVar = frozenset({"stiffness"})

    stiffness: Annotated[Positive, Unit("N/m^n")]
    exponent: Exponent = 1.5
    damping_factor: Annotated[NotNegative, Unit("s/m")] = 0.0

    def table(self, share: Array) -> Array:
        """Parameters (n, 4): K, 1, n, chi."""
        return np.insert(super().table(share), 1, 1.0, axis=1)


@dataclass(frozen=True)
class RestitutionContact(_Hertz):
    r"""Hertz-type point or line contact, damping given by a coefficient of restitution e.

    .. math:: F = K u^n \max(0,\ 1 + \chi v), \qquad u > 0

    with chi from e and the impact velocity v_r to which it applies, by the damping model:

    - ``exact``: an impact of one mass at v_r has the restitution e,
      chi v_r (1 + e) = ln[(1 + chi v_r) / (1 - chi e v_r)];
    - ``hunt-crossley``: chi = 3 (1 - e) / (2 v_r), as published, for e close to one;
    - ``lankarani-nikravesh``: chi = 3 (1 - e^2) / (4 v_r), for e close to one;
    - ``flores``: chi = 8 (1 - e) / (5 e v_r), approximate for all e.

    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile.
    For the exponent and finite-element bodies see :class:`PowerContact`.

    Parameters
    ----------
    restitution : float or (n,) sequence
        Coefficient of restitution e, above zero and at most 1; with Hunt-Crossley and
        Lankarani-Nikravesh also zero.
    reference_velocity : float or (n,) sequence
        Impact velocity v_r at which e holds, positive [m/s].
    damping_model : {"exact", "hunt-crossley", "lankarani-nikravesh", "flores"}
        Relation between chi and e.

    References
    ----------
    K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in
    vibroimpact, J. Appl. Mech. 42 (1975) 440-445. H. M. Lankarani, P. E. Nikravesh, A contact
    force model with hysteresis damping for impact analysis of multibody systems, J. Mech. Des. 112
    (1990) 369-376. P. Flores et al., On the continuous contact force models for soft materials in
    multibody dynamics, Multibody Syst. Dyn. 25 (2011) 357-375.
    """

    extensive: ClassVar = frozenset({"stiffness"})
    choices: ClassVar = {"damping_model": get_args(DampingModel)}

    stiffness: Annotated[Positive, Unit("N/m^n")]
    restitution: PerNode
    reference_velocity: Annotated[Positive, Unit("m/s")]
    exponent: Exponent = 1.5
    damping_model: DampingModel = "exact"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.damping_model in ("hunt-crossley", "lankarani-nikravesh"):
            self.require("zero to 1", lambda e: (e >= 0) & (e <= 1), "restitution")
        else:
            self.require("above zero and at most 1", lambda e: (e > 0) & (e <= 1), "restitution")

    @property
    def damping_factor(self) -> float | Array:
        """Damping factor chi [s/m], of the face or (n,) of each node."""
        e = np.asarray(self.restitution, dtype=float)
        if self.damping_model == "hunt-crossley":
            product = 1.5 * (1.0 - e)
        elif self.damping_model == "lankarani-nikravesh":
            product = 0.75 * (1.0 - e**2)
        elif self.damping_model == "flores":
            product = 1.6 * (1.0 - e) / e
        else:
            product = np.vectorize(_exact_product, otypes=[float])(e)
        factor = product / np.asarray(self.reference_velocity, dtype=float)
        return factor if factor.ndim else float(factor)

    def table(self, share: Array) -> Array:
        """Parameters (n, 4): K, 1, n, chi."""
        stiffness, _, _, exponent, _ = super().table(share).T
        factor = np.broadcast_to(self.damping_factor, share.shape)
        return np.column_stack([stiffness, np.ones_like(share), exponent, factor])


def _exact_product(e: float) -> float:
    """Solve x (1 + e) = ln[(1 + x) / (1 - e x)] for x = chi v > 0; zero for e = 1."""
    from scipy.optimize import brentq

    def excess(x: float) -> float:
        return float(x * (1.0 + e) - np.log1p(x) + np.log1p(-e * x))

    if e > 1.0 - 1e-5:
        return 1.5 * (1.0 - e)
    # The left side is larger up to x = (1 - e) / e; the right side is infinite at its pole 1 / e.
    low, high = (1.0 - e) / e, (1.0 - np.finfo(float).eps) / e
    if excess(high) >= 0.0:
        return high
    return float(brentq(excess, low, high, xtol=1e-15 * low, rtol=1e-14))


@dataclass(frozen=True)
class BackBurdekinContact(_Power):
    r"""Machined surfaces pressed together: approach as a power of the pressure (Back-Burdekin).

    .. math:: u = C p^m \quad\Rightarrow\quad F = A (u / C)^{1/m} \max(0,\ 1 + \chi v)

    u > 0 is the penetration [m], v its rate [m/s], p the pressure [Pa], F the normal force on the
    body [N], never tensile.

    Parameters
    ----------
    nominal_area : float or (n,) sequence
        Nominal area A of the whole face, or of each node, positive [m^2].
    coefficient : float or (n,) sequence
        Coefficient C, positive [m/Pa^m]; 1 um/MPa^0.5 is 1e-9 m/Pa^0.5.
    exponent : float or (n,) sequence
        Exponent m of the pressure, above zero and at most 1; about 0.5 for metals.

    References
    ----------
    N. Back, M. Burdekin, A. Cowley, Review of the research on fixed and sliding joints, Proc.
    13th MTDR Conf. (1973) 87-97.
    """

    extensive: ClassVar = frozenset({"nominal_area"})

    nominal_area: Annotated[Positive, Unit("m^2")]
    coefficient: Annotated[Positive, Unit("m/Pa^m")]
    exponent: UpToOne = 0.5
    damping_factor: Annotated[NotNegative, Unit("s/m")] = 0.0

    @property
    def penetration_scale(self) -> float:
        """Penetration under a pressure of 1 MPa [m], the smallest of all nodes."""
        return float(np.min(self.coefficient * np.power(1e6, self.exponent)))

    def table(self, share: Array) -> Array:
        """Parameters (n, 4): A, C, 1/m, chi."""
        area, coefficient, exponent, factor = super().table(share).T
        return np.column_stack([area, coefficient, 1.0 / exponent, factor])
