"""Friction laws of springs and sliders: Jenkins' element and Iwan's parallel arrangements."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.errors import (
    InputError,
    require_finite,
    require_not_negative,
    require_positive,
    shown,
)
from fecontact.core.simd.vectors import select
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import ONE_OR_ABOVE, ZERO_OR_ABOVE, Bound, NotNegative, Positive
from fecontact.laws.friction.base import LimitedFriction
from fecontact.laws.friction.planar import clear
from fecontact.laws.signatures import memory_friction_law, planar_friction_law

_MOST_ELEMENTS = 10_000  # of which each contact node has one internal variable
Elements = Annotated[int, Bound(f"a whole number from 1 to {_MOST_ELEMENTS}", lambda x: (
    x >= 1.0) & (x <= _MOST_ELEMENTS) & (x == np.floor(x)))]

# Time [s] within which elements return to their limits in equations that are solved as a whole.
RETURN_TIME = 1e-7
# Parts of its limit by which an element may be short of it and slide all the same.
AT_LIMIT = 1e-12
# An element turns as on the edge of a disc of at least this part of its deflection: its rate stays
# finite where the limit vanishes.
NARROWEST = 1e-5


@memory_friction_law
def _maxwell_slip(v, F, z, p, force, rates):
    """R = sum of k_i z_i, each within its limit.

    With a return time p[0] above zero, z_i returns from beyond its limit within that time. With
    zero, z_i' = v: a run returns an element to its limit when sliding ends, and the part of z_i
    beyond the limit is the distance that the element has slid.
    """
    count, return_time = len(z), p[0]
    returns, exact = return_time > 0.0, return_time == 0.0
    for entry in range(3):
        force[entry] = 0.0
    for i in range(count):
        spring, mu = p[1 + i], p[1 + count + i]
        limit = mu * F / spring
        sign = select(z[i] > 0.0, 1.0, -1.0)
        excess = abs(z[i]) - limit
        slides = (excess > 0.0) | (exact & (
            (F <= 0.0) | ((excess > -AT_LIMIT * limit) & (sign * v > 0.0))))
        force[0] += select(slides, sign * mu * F, spring * z[i])
        force[2] += select(slides, sign * mu, 0.0)
        force[3 + i] = select(slides, 0.0, spring)
        back = slides & returns
        for k in range(3 + count):
            rates[i, k] = 0.0
        rates[i, 0] = select(back, v - sign * excess / return_time, v)
        rates[i, 1] = 1.0
        rates[i, 2] = select(back, sign * mu / (spring * return_time), 0.0)
        rates[i, 3 + i] = select(back, -1.0 / return_time, 0.0)


@planar_friction_law
def _planar_maxwell_slip(law, v1, v2, F, z, p, force, rates):
    """Elements in two directions, each returned to the disc |c z| <= phi F along its own direction.

    With a return time of zero, an element that slides turns as on the edge of the disc:
    n' = (v - (n.v) n) / l with n = z / |z| and the limit l, at least NARROWEST |z|, while |z| grows
    by n.v.
    """
    clear(force, rates)
    count, second = len(z) // 2, 4 + len(rates)
    return_time = p[0]
    for i in range(count):
        spring, mu = p[1 + i], p[1 + count + i]
        first = 2 * i
        size = math.hypot(z[first], z[first + 1])
        limit = mu * F / spring
        excess = size - limit
        rates[first, 0], rates[first, 1] = v1, 1.0
        rates[first + 1, 0], rates[first + 1, second - 1] = v2, 1.0
        slides = excess > 0.0
        if return_time == 0.0:
            slides = slides or F <= 0.0 or (
                excess > -AT_LIMIT * limit and z[first] * v1 + z[first + 1] * v2 > 0.0)
        if not slides:
            for c in range(2):
                force[second * c] += spring * z[first + c]
                force[second * c + 3 + first + c] = spring
            continue
        if size == 0.0:
            continue
        n1, n2 = z[first] / size, z[first + 1] / size
        for c in range(2):
            a = n1 if c == 0 else n2
            force[second * c] += mu * F * a
            force[second * c + 2] += mu * a
            for k in range(2):
                b = n1 if k == 0 else n2
                turn = ((1.0 if c == k else 0.0) - a * b) / size
                force[second * c + 3 + first + k] = mu * F * turn
                if return_time > 0.0:
                    rates[first + c, 3 + first + k] = -(a * b + excess * turn) / return_time
            if return_time > 0.0:
                rates[first + c, 0] -= excess * a / return_time
                rates[first + c, 2] = mu * a / (spring * return_time)
        if return_time == 0.0 and limit > 0.0:
            narrow = limit < NARROWEST * size
            radial = n1 * v1 + n2 * v2
            times = 1.0 / NARROWEST if narrow else size / limit
            for c in range(2):
                a, v = (n1, v1) if c == 0 else (n2, v2)
                across = v - radial * a
                rates[first + c, 0] = radial * a + times * across
                if not narrow:
                    rates[first + c, 2] = -times * across / F
                for k in range(2):
                    b, u = (n1, v1) if k == 0 else (n2, v2)
                    same = 1.0 if c == k else 0.0
                    rates[first + c, 1 if k == 0 else second - 1] = (
                        a * b + times * (same - a * b))
                    rates[first + c, 3 + first + k] = (1.0 - times) / size * (
                        a * (u - radial * b) + radial * (same - a * b))
                    if not narrow:
                        rates[first + c, 3 + first + k] += across * b / limit


@dataclass(frozen=True)
class _MaxwellSlip(LimitedFriction):
    """``memory`` springs and sliders in parallel, between the body and the ground.

    Parameters
    ----------
    stiffness : float or (n,) sequence
        Presliding stiffness k of the whole face, or of each node, positive [N/m].
    """

    kernel: ClassVar = _maxwell_slip
    planar_kernel: ClassVar = _planar_maxwell_slip
    extensive: ClassVar = frozenset({"stiffness"})

    stiffness: Annotated[Positive, Unit("N/m")]
    friction_coefficient: NotNegative

    scales_with_force: ClassVar[bool] = True

    @property
    def shares(self) -> tuple[Array, Array]:
        """Fractions (s,) of the stiffness k, and of the limit mu F, that the elements have.

        Each element is a spring in series with a slider; both fractions add up to one.
        """
        count = self.memory
        return np.full(count, 1.0 / count), (2.0 * np.arange(count) + 1.0) / count**2

    def table(self, share: Array) -> Array:
        """Parameters (n, 1 + 2 s): return time, stiffness and coefficient of each element."""
        stiffness, coefficient = super().table(share).T[:2, :, None]
        springs, limits = self.shares
        return np.hstack([np.full_like(stiffness, RETURN_TIME), stiffness * springs,
                          coefficient * limits])

    def bristle_stiffness_of(self, share: Array) -> Array:
        """Stiffness a of the springs, whose deflections are the internal variables; b = 0."""
        stiffness = np.zeros((2, len(share), self.memory))
        stiffness[0] = self.table(share)[:, 1 : 1 + self.memory]
        return stiffness

    def sliders(self, share: Array) -> tuple[Array, Array]:
        """Stiffness (n, s) of the springs [N/m], and limits (n, s) of the sliders as parts of F."""
        _, stiffness, limits = np.split(self.table(share), [1, 1 + self.memory], axis=1)
        return stiffness, limits

    @property
    def state_scale(self) -> Array:
        """Deflections (s,) [m] at which the elements slide under 1 N on the whole face.

        The smallest of all nodes; for coefficient zero the same as for one. A system whose loads
        are below 1 N takes the part that they are of it.
        """
        mu = np.where(np.greater(self.friction_coefficient, 0.0), self.friction_coefficient, 1.0)
        nodes = np.size(self.stiffness)
        springs, limits = self.shares
        return limits / springs * float(np.min(mu / (nodes * np.asarray(self.stiffness))))


@dataclass(frozen=True)
class JenkinsFriction(_MaxwellSlip):
    r"""Jenkins' element: a spring in series with a slider of limit mu F (elastic - plastic).

    .. math::

        R = k z, \qquad |z| \le \frac{\mu F}{k}, \qquad
        z' = v \ \text{in stick}, \qquad z = \frac{\mu F}{k} \operatorname{sgn} v
        \ \text{in slip}

    z is the deflection of the spring [m], v the slip velocity [m/s], F the normal force [N]. The
    law is independent of the rate. In slip z follows the limit as the normal force varies, and
    vanishes with it. Slip ends when v falls below the rate of the limit; runs locate this time. A
    cycle of amplitude X > mu F / k dissipates ``4 mu F (X - mu F / k)``. In space z stays in the
    disc ``|z| <= mu F / k``, and the element slides along the direction of z.

    References
    ----------
    G. M. Jenkins, Analysis of the stress-strain relationships in reactor grade graphite, British
    Journal of Applied Physics 13 (1962).
    """


@dataclass(frozen=True)
class IwanFriction(_MaxwellSlip):
    r"""Iwan's law, uniform distribution: N Jenkins elements in parallel, of evenly spaced limits.

    .. math::

        R = \sum_{i=1}^{N} \min\left(\tfrac{k}{N} |z_i|,\ \phi_i\right) \operatorname{sgn} z_i,
        \qquad \phi_i = \frac{2 i - 1}{N^2}\, \mu F

    with z_i as in :class:`JenkinsFriction`, but with the limit ``phi_i N / k``. The elements begin
    to slide one after another: their limits are distributed uniformly from zero to ``2 mu F / N``,
    their sum is mu F and the sum of the stiffnesses k. One slides from the deflection
    ``mu F / (N k)`` on, all of them from ``(2 N - 1) mu F / (N k)`` on. For many elements, R on
    first loading is ``k x - (k x)^2 / (4 mu F)`` up to ``x = 2 mu F / k``.
    At constant normal force Masing's rules hold: unloading follows the curve of first loading,
    scaled by two. In small cycles of amplitude X the loss is ``k^2 X^3 / (3 mu F)``, of the
    exponent 3; :class:`FourParameterIwanFriction` takes others.

    Parameters
    ----------
    elements : int
        Number N of elements (internal variables) of each node, from 1 to 10,000.

    References
    ----------
    W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic response,
    Journal of Applied Mechanics 33 (1966).
    """

    elements: Elements = 8

    @property
    def memory(self) -> int:
        """One internal variable per element."""
        return self.elements


@dataclass(frozen=True)
class ParallelSliders(_MaxwellSlip):
    r"""Jenkins elements in parallel with given stiffnesses and limits (Maxwell slip, Masing).

    .. math:: R = \sum_i \min\left(k_i |z_i|,\ \phi_i\right) \operatorname{sgn} z_i, \qquad
        k_i = k\, \frac{s_i}{\sum_j s_j}, \quad \phi_i = \mu F\, \frac{l_i}{\sum_j l_j}

    with z_i as in :class:`JenkinsFriction`. Element i slides from the deflection ``phi_i / k_i``
    on. Two elements of equal springs and the limits 1 and 3 are :class:`IwanFriction` with two.

    Parameters
    ----------
    springs : sequence
        s_i: stiffnesses of the elements, above zero, in any unit.
    limits : sequence
        l_i: limits of the elements, above zero, in any unit; as many.

    References
    ----------
    G. Masing, Eigenspannungen und Verfestigung beim Messing, Proc. 2nd International Congress of
    Applied Mechanics, Zurich 1926.
    """

    shared_fields: ClassVar = frozenset({"springs", "limits"})

    springs: tuple[float, ...]
    limits: tuple[float, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        s, limits = np.asarray(self.springs), np.asarray(self.limits)
        if s.ndim != 1 or s.shape != limits.shape or not len(s) <= _MOST_ELEMENTS or not (
                (s > 0.0).all() and (limits > 0.0).all()):
            raise InputError(f"ParallelSliders: springs = {shown(self.springs)} and limits = "
                             f"{shown(self.limits)} must be lists of equal length of numbers "
                             f"above zero.")

    @property
    def memory(self) -> int:
        """One internal variable per element."""
        return len(self.springs)

    @property
    def shares(self) -> tuple[Array, Array]:
        """Fractions (s,) of the stiffness k, and of the limit mu F, that the elements have."""
        return (np.asarray(self.springs) / np.sum(self.springs),
                np.asarray(self.limits) / np.sum(self.limits))


@dataclass(frozen=True)
class FourParameterIwanFriction(_MaxwellSlip):
    r"""Four-parameter Iwan law (Segalman): a power-law distribution of sliders for bolted joints.

    .. math::

        R = \int_0^{\phi_{max}} \rho(\phi)\, z(\phi)\, d\phi, \qquad
        \rho = r \phi^\chi + s\, \delta(\phi - \phi_{max})

    An element of the distribution slides when its spring is deflected by phi [m]. The four
    parameters are the force of macroslip ``F_S = mu F``, the stiffness ``K_T = k`` at rest, chi and
    beta, the part of the stiffness that is left just before macroslip, as ratio of delta to
    power-law stiffness there:

    .. math::

        \phi_{max} = \frac{F_S (1 + \beta)}{K_T (\beta + \frac{\chi + 1}{\chi + 2})}, \quad
        r = \frac{F_S (\chi + 1)}{\phi_{max}^{\chi + 2} (\beta + \frac{\chi + 1}{\chi + 2})},
        \quad s = \frac{F_S}{\phi_{max}} \frac{\beta}{\beta + \frac{\chi + 1}{\chi + 2}}

    Up to phi_max, R on first loading by x is ``K_T x - r x^(chi+2) / ((chi + 1) (chi + 2))``, and a
    cycle of amplitude X loses ``4 r X^(chi+3) / ((chi + 2) (chi + 3))``, of the exponent 3 + chi
    over the amplitude. The normal force F scales F_S, and phi_max with it, while K_T stays.

    The distribution is cut into N intervals, each wider than the one before by the same ratio; an
    interval is one element, with all of its stiffness and all of its limit, so that K_T and F_S are
    exact. The delta is one more element. With 16 intervals of ratio 1.3 the loss is right to 6 %
    down to 0.02 phi_max, with 50 of ratio 1.1 to 1 % down to 0.01 phi_max. Below the first limit
    nothing is lost. Internal variables follow their limits as in :class:`JenkinsFriction`.

    Parameters
    ----------
    chi : float
        Exponent of the distribution, above -1 and at most 0: the loss exponent less 3.
    beta : float
        Ratio of stiffnesses of the delta and of the power law, zero or above.
    elements : int
        Number N of elements (internal variables) of each node, from 1 to 10,000; one more for beta
        > 0.
    spacing_ratio : float
        Width of an interval over that of the one before, one or above.

    References
    ----------
    D. J. Segalman, A four-parameter Iwan model for lap-type joints, Journal of Applied Mechanics
    72 (2005) 752-760.
    """

    chi: Annotated[float, Bound("above -1 and at most 0", lambda x: (x > -1.0) & (x <= 0.0))]
    beta: Annotated[float, ZERO_OR_ABOVE]
    elements: Elements = 16
    spacing_ratio: Annotated[float, ONE_OR_ABOVE] = 1.3

    @classmethod
    def from_distribution(
        cls, chi: float, phi_max: float, R: float, S: float, normal_force: float, *,
        elements: int = 16, spacing_ratio: float = 1.3,
    ) -> "FourParameterIwanFriction":
        """Law whose distribution is ``R phi^chi + S delta(phi - phi_max)`` under a normal force.

        phi_max [m], R [N/m^(2 + chi)] and the normal force [N] are positive, S [N/m] is zero or
        above. InputError for other values.
        """
        require_positive(cls.__name__, phi_max=phi_max, R=R, normal_force=normal_force)
        require_not_negative(cls.__name__, S=S)
        require_finite(cls.__name__, chi=chi)
        if not -1.0 < chi <= 0.0:
            raise InputError(f"{cls.__name__}: chi = {chi!r} must be above -1 and at most 0.")
        power = R * phi_max ** (chi + 1.0) / (chi + 1.0)
        macroslip = phi_max * (power * (chi + 1.0) / (chi + 2.0) + S)
        return cls(power + S, macroslip / normal_force, chi, S / power, elements, spacing_ratio)

    def distribution(self, normal_force: float) -> tuple[float, float, float, float]:
        """Segalman's parameters chi, phi_max [m], R [N/m^(2 + chi)] and S [N/m].

        ``normal_force`` is that on the whole face [N]. InputError for a law with parameters per
        node, or a force that is not positive.
        """
        require_positive(type(self).__name__, normal_force=normal_force)
        if np.ndim(self.stiffness) or np.ndim(self.friction_coefficient):
            raise InputError(f"{type(self).__name__}: a distribution belongs to one stiffness and "
                             f"one friction coefficient; give numbers for the whole face.")
        chi, beta = self.chi, self.beta
        macroslip = float(np.multiply(self.friction_coefficient, normal_force))
        arm = beta + (chi + 1.0) / (chi + 2.0)
        phi_max = macroslip * (1.0 + beta) / (float(np.asarray(self.stiffness)) * arm)
        return (chi, phi_max, macroslip * (chi + 1.0) / (phi_max ** (chi + 2.0) * arm),
                macroslip / phi_max * beta / arm)

    @property
    def memory(self) -> int:
        """One internal variable per interval, and one for the delta."""
        return self.elements + (self.beta > 0.0)

    @property
    def shares(self) -> tuple[Array, Array]:
        """Fractions (s,) of the stiffness, and of the limit mu F, that the elements have."""
        chi, beta = self.chi, self.beta
        edges = np.append(0.0, np.cumsum(self.spacing_ratio ** np.arange(self.elements)))
        edges /= edges[-1]
        # In the unit of length phi_max, of the power law alone: stiffness one, limit `arm`.
        arm = (chi + 1.0) / (chi + 2.0)
        springs, limits = np.diff(edges ** (chi + 1.0)), arm * np.diff(edges ** (chi + 2.0))
        if beta > 0.0:
            springs, limits = np.append(springs, beta), np.append(limits, beta)
        return springs / (1.0 + beta), limits / (arm + beta)
