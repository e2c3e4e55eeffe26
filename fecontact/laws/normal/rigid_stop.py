"""A contact that does not give way."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fecontact.core.types import Array
from fecontact.laws.base import NormalLaw
from fecontact.laws.signatures import normal_law


@normal_law
def _rigid(u, v, p):
    return np.nan, np.nan, np.nan


@dataclass(frozen=True)
class RigidStop(NormalLaw):
    r"""Rigid stop: no penetration, and impulses where a node strikes it.

    .. math:: u \le 0, \qquad F \ge 0, \qquad u F = 0

    u is the penetration [m], F the normal force on the body [N]. There is no force to be computed
    from u: runs and orbits need ``solver=fecontact.integrate.SetValued(restitution=...)``, and a
    start without penetration. All contacts of the system are rigid then.

    Raises
    ------
    InputError
        In all that needs a force of the penetration: other solvers, equilibria, loading.

    Examples
    --------
    A ball of 1 kg falls by 0.1 m and keeps 0.8 of its velocity:

    >>> import fecontact as fc
    >>> y = [[0.0], [1.0], [0.0]]
    >>> ball = fc.ContactSystem(
    ...     fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [y], "C": y}),
    ...     normal=fc.laws.RigidStop(), load=fc.Load(9.81))
    >>> run = fc.simulate(ball, 0.3, initial=[0.1, 0.0], rtol=1e-9,
    ...                   solver=fc.integrate.SetValued(restitution=0.8))
    >>> print(f"{run.velocity(0)[:, 1].max():.3f} m/s")
    1.120 m/s
    """

    kernel: ClassVar = _rigid
    rigid: ClassVar[bool] = True

    @property
    def penetration_scale(self) -> float:
        """One micrometre, as the law itself has no scale [m]."""
        return 1e-6

    def stored_energy(self, penetration: Array, share: Array) -> Array:
        """Energy (..., n) [J]: zero."""
        return np.zeros_like(penetration)
