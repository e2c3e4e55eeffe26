"""Friction laws without memory whose coefficient falls with slip velocity and rises again."""

from dataclasses import dataclass
from typing import ClassVar

from fecontact.laws.base import NotNegative, PerNode, Positive
from fecontact.laws.friction import friction_kernels
from fecontact.laws.friction.base import SmoothedFriction, Smoothing, require_at_least


@dataclass(frozen=True)
class GalvanettoFriction(SmoothedFriction):
    r"""Dry friction that falls like a hyperbola and rises again with the square of velocity.

    .. math::

        R = F\, \mu(v)\, s(v), \qquad
        \mu(v) = \mu_k + \frac{\mu_s - \mu_k}{1 + \gamma |v|} + \eta v^2

    R [N] has the sign of the slip velocity v [m/s]. Friction is least where
    ``gamma (mu_s - mu_k) = 2 eta |v| (1 + gamma |v|)^2``.

    Parameters
    ----------
    static_coefficient, kinetic_coefficient : float or (n,) sequence
        mu_s and mu_k, zero or above; with mu_s below mu_k friction rises from rest on.
    decay : float or (n,) sequence
        gamma, zero or above [s/m].
    growth : float or (n,) sequence
        eta, zero or above [s^2/m^2].
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m].
    smoothing : {"arctan", "tanh", "square-root"}
        s(v), see :class:`~fecontact.laws.friction.base.SmoothedFriction`.

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    U. Galvanetto, S. R. Bishop, Dynamics of a simple damped oscillator undergoing stick-slip
    vibrations, Meccanica 34 (1999), for two blocks on a belt.
    """

    kernel: ClassVar = friction_kernels.galvanetto

    static_coefficient: NotNegative = 0.8
    kinetic_coefficient: NotNegative = 0.55
    decay: NotNegative = 1000.0
    growth: NotNegative = 0.0
    smoothing_slope: Positive = 1e6
    smoothing: Smoothing = "arctan"


@dataclass(frozen=True)
class CubicFriction(SmoothedFriction):
    r"""Dry friction that is a cubic parabola of slip velocity with one minimum.

    .. math::

        R = F\, \mu(v)\, s(v), \qquad
        \mu(v) = \mu_s - \tfrac{3}{2} (\mu_s - \mu_m)
        \left[\frac{|v|}{v_m} - \frac{1}{3} \left(\frac{|v|}{v_m}\right)^3\right]

    R [N] has the sign of the slip velocity v [m/s]. mu falls from mu_s at rest to mu_m at v_m, is
    back at mu_s at ``sqrt(3) v_m`` and grows without bound.

    Parameters
    ----------
    static_coefficient : float or (n,) sequence
        mu_s, at least mu_m.
    minimum_coefficient : float or (n,) sequence
        mu_m, zero or above.
    minimum_velocity : float or (n,) sequence
        v_m, positive [m/s].
    smoothing_slope : float or (n,) sequence
        k_s, positive [s/m].
    smoothing : {"arctan", "tanh", "square-root"}
        s(v), see :class:`~fecontact.laws.friction.base.SmoothedFriction`.

    Raises
    ------
    InputError
        For values outside these ranges.

    References
    ----------
    J. J. Thomsen, A. Fidlin, Analytical approximations for stick-slip vibration amplitudes,
    International Journal of Non-Linear Mechanics 38 (2003), unsmoothed.
    """

    kernel: ClassVar = friction_kernels.cubic

    static_coefficient: PerNode = 0.8
    minimum_coefficient: NotNegative = 0.55
    minimum_velocity: Positive = 1e-2
    smoothing_slope: Positive = 1e6
    smoothing: Smoothing = "arctan"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_at_least(self, "static_coefficient", "minimum_coefficient")
