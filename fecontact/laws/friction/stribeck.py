"""Friction laws without memory whose coefficient is constant or falls with slip velocity."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fecontact.laws.base import NotNegative, Positive
from fecontact.laws.friction import friction_kernels
from fecontact.laws.friction.base import MemorylessFriction, SmoothedFriction, Smoothing


@dataclass(frozen=True)
class ExponentialFriction(SmoothedFriction):
    r"""Dry friction that falls exponentially with slip velocity (4.1-21..23).

    .. math::

        R = F\, [\mu(v)\, s(v) + c_v v], \qquad
        \mu(v) = (\mu_0 - \mu_\infty)\, e^{-\lambda |v|} + \mu_\infty

    v is the slip velocity of the body relative to the ground [m/s], F the normal force [N]; the
    friction force R [N] acts on the body in -x for v > 0. s(v) is the smoothed sign of v.

    Parameters
    ----------
    static_coefficient, kinetic_coefficient : float or (n,) sequence
        mu_0 and mu_inf, zero or above; with mu_0 below mu_inf friction rises with velocity.
    decay : float or (n,) sequence
        lambda, zero or above [s/m].
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m]. Below slip velocities of some 1/k_s the contact creeps instead of
        sticking.
    viscous_coefficient : float or (n,) sequence
        c_v, zero or above [s/m].
    smoothing : {"arctan", "tanh", "square-root"}
        s(v), see :class:`~fecontact.laws.friction.base.SmoothedFriction`.

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.1.
    """

    kernel: ClassVar = friction_kernels.exponential

    static_coefficient: NotNegative = 0.8
    kinetic_coefficient: NotNegative = 0.55
    decay: NotNegative = 1000.0
    smoothing_slope: Positive = 1e6
    viscous_coefficient: NotNegative = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class GaussianFriction(SmoothedFriction):
    r"""Dry friction that falls with slip velocity like a Gaussian bell (Stribeck curve).

    .. math::

        R = F\, [\mu(v)\, s(v) + c_v v], \qquad
        \mu(v) = (\mu_0 - \mu_\infty)\, e^{-(v/v_s)^2} + \mu_\infty

    R [N] has the sign of the slip velocity v [m/s]. Friction is flat near rest, steepest at
    ``v_s / sqrt(2)`` and has fallen by 63 % of the whole at v_s.

    Parameters
    ----------
    static_coefficient, kinetic_coefficient : float or (n,) sequence
        mu_0 and mu_inf, zero or above; with mu_0 below mu_inf friction rises with velocity.
    stribeck_velocity : float or (n,) sequence
        v_s, positive [m/s].
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m].
    viscous_coefficient : float or (n,) sequence
        c_v, zero or above [s/m].
    smoothing : {"arctan", "tanh", "square-root"}
        s(v), see :class:`~fecontact.laws.friction.base.SmoothedFriction`.

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and
    compensation methods for the control of machines with friction, Automatica 30 (1994).
    """

    kernel: ClassVar = friction_kernels.gaussian

    static_coefficient: NotNegative = 0.8
    kinetic_coefficient: NotNegative = 0.55
    stribeck_velocity: Positive = 1e-3
    smoothing_slope: Positive = 1e6
    viscous_coefficient: NotNegative = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class HyperbolicFriction(SmoothedFriction):
    r"""Dry friction that falls with slip velocity like a hyperbola.

    .. math::

        R = F\, [\mu(v)\, s(v) + c_v v], \qquad
        \mu(v) = \mu_\infty + \frac{\mu_0 - \mu_\infty}{1 + |v| / v_s}

    R [N] has the sign of the slip velocity v [m/s]. With ``mu_inf = 0`` and ``v_s = 1 / delta``
    it is Leine's law ``F_s / (1 + delta |v|)``.

    Parameters
    ----------
    static_coefficient, kinetic_coefficient : float or (n,) sequence
        mu_0 and mu_inf, zero or above; with mu_0 below mu_inf friction rises with velocity.
    stribeck_velocity : float or (n,) sequence
        v_s, positive: half of the fall is behind it [m/s].
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m].
    viscous_coefficient : float or (n,) sequence
        c_v, zero or above [s/m].
    smoothing : {"arctan", "tanh", "square-root"}
        s(v), see :class:`~fecontact.laws.friction.base.SmoothedFriction`.

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    R. I. Leine, D. H. van Campen, A. de Kraker, L. van den Steen, Stick-slip vibrations induced
    by alternate friction models, Nonlinear Dynamics 16 (1998).
    """

    kernel: ClassVar = friction_kernels.hyperbolic

    static_coefficient: NotNegative = 0.8
    kinetic_coefficient: NotNegative = 0.55
    stribeck_velocity: Positive = 1e-3
    smoothing_slope: Positive = 1e6
    viscous_coefficient: NotNegative = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class ConstantFriction(SmoothedFriction):
    r"""Coulomb's law with one coefficient, smoothed: ``R = F [mu s(v) + c_v v]``.

    R [N] has the sign of the slip velocity v [m/s], F is the normal force [N].

    Parameters
    ----------
    friction_coefficient : float or (n,) sequence
        mu, zero or above.
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m].
    viscous_coefficient : float or (n,) sequence
        c_v, zero or above [s/m].
    smoothing : {"arctan", "tanh", "square-root"}
        s(v), see :class:`~fecontact.laws.friction.base.SmoothedFriction`.

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    kernel: ClassVar = friction_kernels.constant

    friction_coefficient: NotNegative = 0.55
    smoothing_slope: Positive = 1e6
    viscous_coefficient: NotNegative = 0.0
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class ProductFriction(MemorylessFriction):
    r"""Friction as a product of an exponential fall and an arctan (4.4-9).

    .. math:: R = F\, a_1 (1 + a_2 e^{-b_1 |v|}) \arctan(b_2 v)

    R [N] has the sign of the slip velocity v [m/s]. At high velocities ``R / F = pi a_1 / 2``.
    The default values are those of section 4.4.

    Parameters
    ----------
    factor : float or (n,) sequence
        a_1, zero or above.
    excess : float or (n,) sequence
        a_2, zero or above: friction near rest over that at high velocities, less one.
    decay : float or (n,) sequence
        b_1, zero or above [s/m].
    smoothing_slope : float or (n,) sequence
        b_2, positive [s/m].

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    W. Sextro, Dynamical Contact Problems with Friction, section 4.4.
    """

    kernel: ClassVar = friction_kernels.product

    factor: NotNegative = 0.14
    excess: NotNegative = 1.14
    decay: NotNegative = 2.0
    smoothing_slope: Positive = 100.0

    @property
    def velocity_scale(self) -> float:
        """Width 1/b_2 of the arctan [m/s], the smallest of all nodes."""
        return 1.0 / float(np.max(self.smoothing_slope))
