"""Base classes of friction laws: without memory, smoothed, with memory."""

from typing import ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.laws import base, friction_curve
from fecontact.laws.base import NodeLaw, Positive

Smoothing = Literal["arctan", "tanh", "square-root"]


class MemorylessFriction(base.FrictionLaw):
    """A friction law ``f(v, F, p)`` with the properties of its curve R/F over v.

    They are computed from the compiled law by the functions of the same names in
    :mod:`fecontact.laws.friction_curve`, which take any law without memory.
    """

    coefficient = friction_curve.coefficient
    slope = friction_curve.slope
    largest_coefficient = friction_curve.largest_coefficient
    velocity_of_minimum = friction_curve.velocity_of_minimum

    smoothing_slope: Positive

    @property
    def velocity_scale(self) -> float:
        """Width 1/k_s of the smoothing [m/s], the smallest of all nodes."""
        return 1.0 / float(np.max(self.smoothing_slope))


class SmoothedFriction(MemorylessFriction):
    r"""Friction R = F (mu(\|v\|) s(v) + viscous term), with the sign of v smoothed to s(v).

    All smoothings rise with the same slope ``2 k_s / pi`` at rest and tend to 1:

    ===============  ===========================================
    smoothing        s(v), with ``x = 2 k_s v / pi``
    ===============  ===========================================
    ``arctan``       ``(2 / pi) arctan(k_s v)`` (4.1-23)
    ``tanh``         ``tanh(x)``
    ``square-root``  ``x / sqrt(1 + x^2)``: ``v / sqrt(v^2 + eps^2)`` with
                     ``eps = pi / (2 k_s)``
    ===============  ===========================================

    At v = 10 / k_s they reach 0.937, 1 - 6e-6 and 0.988: contacts creep most with the arctan.

    Parameters
    ----------
    smoothing_slope : float or (n,) sequence
        Smoothing slope k_s, positive [s/m]. Below a slip velocity of about 1/k_s [m/s] the contact
        creeps instead of sticking.
    viscous_coefficient : float or (n,) sequence
        Viscous coefficient c_v, zero or above [s/m]: friction c_v v per normal force.
    smoothing : {"arctan", "tanh", "square-root"}
        Smoothed sign s(v) of the slip velocity, see
        :class:`~fecontact.laws.friction.base.SmoothedFriction`.
    """

    choices: ClassVar = {"smoothing": get_args(Smoothing)}


class MemoryFriction(base.FrictionLaw):
    """A friction law ``f(v, F, z, p, force, rates)`` with internal variables z.

    Subclasses define :attr:`state_scale`, :meth:`steady_coefficient` and, for more than one
    internal variable, :attr:`memory`.
    """

    @property
    def memory(self) -> int:
        """Number s of internal variables per node, one by default."""
        return 1

    @property
    def velocity_scale(self) -> float:
        """Slip velocity [m/s] that changes the first internal variable by its scale in 0.1 s.

        Friction with memory depends on displacement, not on velocity: much lower velocities do not
        change it within some oscillations.
        """
        return 10.0 * float(self.state_scale[0])

    def steady_coefficient(self, velocity: Array | float) -> Array:
        """R/F of steady sliding at slip velocities [m/s], with their sign; at v = 0 that of v > 0.

        With parameters per node, (n,) of them, velocities broadcast against (n,).
        """
        raise NotImplementedError

    def stick_velocity(self, nodes: int) -> Array:
        """Slip velocity (n,) of the order at which :meth:`sticks` may change [m/s].

        Whether a node sticks depends on its force, not on its slip velocity alone.
        """
        return np.full(nodes, self.velocity_scale)

    def sticks(self, slip_velocity: Array, normal_force: Array, friction_force: Array
               ) -> NDArray[np.bool_]:
        """Whether nodes in contact stick: abs(R) is below 0.95 times that of steady sliding."""
        steady = np.abs(self.steady_coefficient(slip_velocity)) * normal_force
        return np.asarray(np.abs(friction_force) < 0.95 * steady)


class LimitedFriction(MemoryFriction):
    """A friction law with memory whose force is mu F in steady sliding.

    Parameters
    ----------
    friction_coefficient : float or (n,) sequence
        Friction coefficient mu, zero or above.
    """

    friction_coefficient: base.PerNode

    def steady_coefficient(self, velocity: Array | float) -> Array:
        """Mu with the sign of the slip velocity; see :class:`MemoryFriction`."""
        v = as_floats(velocity, f"{type(self).__name__}: velocity")
        return np.asarray(np.where(v < 0.0, -1.0, 1.0) * self.friction_coefficient)


def require_at_least(law: NodeLaw, larger: str, smaller: str) -> None:
    """Raise :class:`InputError` if a parameter is smaller than another one at any node."""
    high, low = getattr(law, larger), getattr(law, smaller)
    counts = {len(value) for value in (high, low) if isinstance(value, tuple)}
    if len(counts) < 2 and np.any(np.asarray(high) < np.asarray(low)):
        raise InputError(f"{type(law).__name__}: {larger} = {high!r} must be at least "
                         f"{smaller} = {low!r}.")
