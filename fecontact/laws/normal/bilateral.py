"""Bilateral laws: nonlinear springs that push and pull, for links between two points.

Their elongation is e = -u, their tension N = -F: a spring that is stretched pulls both points
together. The kernels leave nodes out whose force is exactly zero, as contact that is open; where a
spring has stiffness but no force, the laws return a force that is too small to matter.
"""

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.errors import InputError
from fecontact.core.simd.vectors import select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import NormalLaw, NotNegative, PerNode, Positive
from fecontact.laws.signatures import normal_law

_NO_FORCE, _NOWHERE = 1e-300, 1e100


@helper
def _felt(tension, slope, damping):
    """F, dF/du, dF/dv of a spring with stiffness."""
    hidden = (tension == 0.0) & (abs(slope) + damping > 0.0)
    return select(hidden, _NO_FORCE, -tension), slope, damping


@dataclass(frozen=True)
class BilateralLaw(NormalLaw):
    """Law of a spring between two points; see :mod:`fecontact.laws.normal.bilateral`.

    Parameters
    ----------
    damping : float or (n,) sequence
        Damping b, zero or above [N s/m].
    preload : float or (n,) sequence
        Constant tension N_0 [N].
    shortening : float or (n,) sequence
        Prescribed shortening s [m].
    """

    bilateral: ClassVar = True
    _shortening: ClassVar = 4  # column of the table

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) stored in the spring [J], zero at u = 0."""
        table = self.table(share)
        shortening = table[:, self._shortening]
        return self._potential(shortening - penetration, table) - self._potential(
            shortening, table)

    def _potential(self, elongation: Array, table: Array) -> Array:
        """Integral (..., n) of the tension over the elongation (..., n)."""
        raise NotImplementedError


@normal_law
def _polynomial(u, v, p):
    e, w = p[4] - u, -v
    tension = (e * (p[0] + e * (p[5] + e * (p[1] + e * e * p[6]))) + p[3]
               + w * (p[2] + p[7] * abs(w) + p[8] * w * w))
    slope = p[0] + e * (2.0 * p[5] + e * (3.0 * p[1] + 5.0 * e * e * p[6]))
    return _felt(tension, slope, p[2] + 2.0 * p[7] * abs(w) + 3.0 * p[8] * w * w)


@dataclass(frozen=True)
class BilateralPolynomial(BilateralLaw):
    r"""Spring and dashpot whose forces are polynomials, for links.

    .. math::

        N = c\,\epsilon + c_2\,\epsilon^2 + c_3\,\epsilon^3 + c_5\,\epsilon^5 + N_0
        + b\,\dot e + b_2\,|\dot e|\,\dot e + b_3\,\dot e^3, \qquad F = -N, \quad
        \epsilon = e + s, \quad e = -u

    N is the tension [N], e the elongation [m]. The force never ends: it pushes and pulls.

    Parameters
    ----------
    stiffness, cubic_stiffness : float or (n,) sequence
        Stiffnesses c [N/m] and c_3 [N/m^3]. A negative c makes a spring with two positions of rest;
        the spring hardens with positive c_3 and softens with negative c_3.
    quadratic_stiffness, quintic_stiffness : float or (n,) sequence
        Stiffnesses c_2 [N/m^2] and c_5 [N/m^5], of any sign.
    quadratic_damping, cubic_damping : float or (n,) sequence
        Damping b_2 [N s^2/m^2] and b_3 [N s^3/m^3], zero or above.
    """

    kernel: ClassVar = _polynomial
    extensive: ClassVar = frozenset({
        "stiffness", "quadratic_stiffness", "cubic_stiffness", "quintic_stiffness", "damping",
        "quadratic_damping", "cubic_damping", "preload"})

    stiffness: Annotated[PerNode, Unit("N/m")]
    cubic_stiffness: Annotated[PerNode, Unit("N/m^3")] = 0.0
    damping: Annotated[NotNegative, Unit("N s/m")] = 0.0
    preload: Annotated[PerNode, Unit("N")] = 0.0
    shortening: Annotated[PerNode, Unit("m")] = 0.0
    quadratic_stiffness: Annotated[PerNode, Unit("N/m^2")] = field(default=0.0, kw_only=True)
    quintic_stiffness: Annotated[PerNode, Unit("N/m^5")] = field(default=0.0, kw_only=True)
    quadratic_damping: Annotated[NotNegative, Unit("N s^2/m^2")] = field(
        default=0.0, kw_only=True)
    cubic_damping: Annotated[NotNegative, Unit("N s^3/m^3")] = field(default=0.0, kw_only=True)

    @property
    def penetration_scale(self) -> float:
        """Elongation under about 1 N [m], the smallest of all nodes and terms."""
        terms = ((self.stiffness, 1), (self.quadratic_stiffness, 2), (self.cubic_stiffness, 3),
                 (self.quintic_stiffness, 5))
        stiffest = max(float(np.max(np.abs(np.asarray(c)))) ** (1.0 / power) for c, power in terms)
        return 1.0 / stiffest if stiffest > 0.0 else 1.0

    def onsets(self, nodes: int) -> Array:
        """None: a place (1, n) that no spring reaches [m]."""
        return np.full((1, nodes), _NOWHERE)

    def _potential(self, elongation: Array, table: Array) -> Array:
        c, cubic, _, preload, _, quadratic, quintic, *_ = table.T
        e, square = elongation, elongation**2
        return np.asarray(square * (0.5 * c + e * quadratic / 3.0 + 0.25 * cubic * square
                                    + quintic * square**2 / 6.0) + preload * e)


@normal_law
def _play(u, v, p):
    e = p[4] - u
    side = select(e > 0.0, 1.0, -1.0)
    depth = side * e - p[1]
    held = p[0] * depth - p[2] * side * v
    slack = (depth <= 0.0) | (held <= 0.0)
    force, slope, damping = _felt(side * held + p[3], p[0], p[2])
    return select(slack, -p[3], force), select(slack, 0.0, slope), select(slack, 0.0, damping)


@dataclass(frozen=True)
class BilateralPlay(BilateralLaw):
    r"""Spring with play: no force within a clearance, stiff beyond it on both sides, for links.

    .. math::

        N = \mathrm{sgn}(\epsilon) \max(0,\ c\,(|\epsilon| - h) + b\,\dot\epsilon\,
        \mathrm{sgn}\,\epsilon) + N_0 \quad (|\epsilon| > h), \qquad
        N = N_0 \quad (|\epsilon| \le h), \qquad \epsilon = e + s

    N = -F is the tension [N], e = -u the elongation [m]. The dashpot acts beyond the clearance
    only, and no side pulls back.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        Stiffness c beyond the clearance, positive [N/m].
    clearance : float or (n,) sequence
        Play h to either side, zero or above [m].
    damping : float or (n,) sequence
        Damping b beyond the clearance, zero or above [N s/m].
    shortening : float or (n,) sequence
        Prescribed shortening s [m]; it moves the middle of the play to e = -s.
    """

    kernel: ClassVar = _play
    extensive: ClassVar = frozenset({"stiffness", "damping", "preload"})

    stiffness: Annotated[Positive, Unit("N/m")]
    clearance: Annotated[NotNegative, Unit("m")]
    damping: Annotated[NotNegative, Unit("N s/m")] = 0.0
    preload: Annotated[PerNode, Unit("N")] = 0.0
    shortening: Annotated[PerNode, Unit("m")] = 0.0

    @property
    def penetration_scale(self) -> float:
        """Elongation beyond the clearance under 1 N [m], the smallest of all nodes."""
        return 1.0 / float(np.max(self.stiffness))

    def onsets(self, nodes: int) -> Array:
        """Both ends of the clearance (2, n) [m]."""
        middle, clearance = np.asarray(self.shortening), np.asarray(self.clearance)
        return np.array([np.broadcast_to(middle + side * clearance, nodes) for side in (-1, 1)])

    def _potential(self, elongation: Array, table: Array) -> Array:
        c, clearance, _, preload, _ = table.T
        depth = np.maximum(np.abs(elongation) - clearance, 0.0)
        return np.asarray(0.5 * c * depth**2 + preload * elongation)


@normal_law
def _piecewise(u, v, p):
    last = int(p[0]) - 2
    e = p[3] - u
    low, high = 0, last
    while low < high:
        middle = (low + high + 1) // 2
        if p[4 + 2 * middle] <= e:
            low = middle
        else:
            high = middle - 1
    i = 4 + 2 * low
    slope = (p[i + 3] - p[i + 1]) / (p[i + 2] - p[i])
    tension = p[i + 1] + slope * (e - p[i]) + p[2] - p[1] * v
    return _felt(tension, slope, p[1])


@dataclass(frozen=True)
class BilateralPiecewise(BilateralLaw):
    r"""Piecewise linear spring with a parallel dashpot, for links.

    .. math:: N = N(e + s) + b\,\dot e + N_0, \qquad F = -N,\quad e = -u

    N is the tension [N], e the elongation [m]; N(e) is linear between the given points and goes on
    as straight beyond the first and the last one.

    Parameters
    ----------
    elongations : sequence
        Elongations of the corners, at least two, ascending [m]; the same at all nodes.
    forces : sequence
        Tension at each corner [N].
    """

    kernel: ClassVar = _piecewise
    extensive: ClassVar = frozenset({"forces", "damping", "preload"})
    shared_fields: ClassVar = frozenset({"elongations", "forces"})
    _shortening: ClassVar = 3

    elongations: Annotated[tuple[float, ...], Unit("m")]
    forces: Annotated[tuple[float, ...], Unit("N")]
    damping: Annotated[NotNegative, Unit("N s/m")] = 0.0
    preload: Annotated[PerNode, Unit("N")] = 0.0
    shortening: Annotated[PerNode, Unit("m")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        e, N = np.atleast_1d(self.elongations), np.atleast_1d(self.forces)
        if len(e) < 2 or len(N) != len(e) or (np.diff(e) <= 0.0).any():
            raise InputError(f"{type(self).__name__}: elongations and forces must be as many "
                             f"numbers each, at least two, with ascending elongations; they are "
                             f"{self.elongations!r} and {self.forces!r}.")
        if not np.diff(N).any():
            raise InputError(f"{type(self).__name__}: forces = {self.forces!r} are all equal, "
                             f"which is no spring; give a constant force as preload or load.")

    @property
    def penetration_scale(self) -> float:
        """Elongation under 1 N along the steepest part [m]."""
        return 1.0 / float(np.abs(np.diff(self.forces) / np.diff(self.elongations)).max())

    def onsets(self, nodes: int) -> Array:
        """The corners of the table (k, n) [m]."""
        inner = np.asarray(self.elongations)[1:-1]
        if not len(inner):
            return np.full((1, nodes), _NOWHERE)
        return np.array([np.broadcast_to(np.asarray(self.shortening) - e, nodes) for e in inner])

    def table(self, share: Array) -> Array:
        """Parameters (n, 4 + 2 k): k, b, N_0, s, then e and N of the k points in turn."""
        rows = [BilateralPlay(1.0, 0.0, self.damping, self.preload, self.shortening).table(share)]
        points = np.empty((len(share), 2 * len(self.elongations)))
        points[:, ::2] = self.elongations
        points[:, 1::2] = np.asarray(self.forces) * share[:, None]
        count = np.full((len(share), 1), float(len(self.elongations)))
        return np.column_stack([count, rows[0][:, 2:], points])

    def _potential(self, elongation: Array, table: Array) -> Array:
        e = np.asarray(self.elongations)
        N = table[:, 5::2]  # (n, k)
        slope = np.diff(N, axis=1) / np.diff(e)
        before = np.concatenate([np.zeros((len(N), 1)), np.cumsum(
            0.5 * (N[:, 1:] + N[:, :-1]) * np.diff(e), axis=1)], axis=1)
        i = np.clip(np.searchsorted(e, elongation, side="right") - 1, 0, len(e) - 2)
        node = np.broadcast_to(np.arange(len(N)), elongation.shape)
        past = elongation - e[i]
        return np.asarray(before[node, i] + past * (N[node, i] + 0.5 * slope[node, i] * past)
                          + table[:, 2] * elongation)
