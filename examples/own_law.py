"""A friction law of your own: twenty lines, at the speed of the built-in ones.

Rocks and polymers rub harder the faster they slip: mu(v) = mu_0 + a ln(1 + |v| / v_0). Here a beam
on a belt gets this law and settles, where falling friction keeps it sticking and slipping. In a
study file, beside this one, it is used by

    [friction]
    law = "own_law.py:LogarithmicFriction"
    rate_effect = 0.02

Usage: python examples/own_law.py [--quick]
"""

import math
import sys
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import fecontact as fc
from fecontact.laws import (
    ExponentialFriction,
    FrictionLaw,
    PerNode,
    RoughSurface,
    friction_law,
)


@friction_law
def _logarithmic(v, F, p):  # type: ignore[no-untyped-def]
    coefficient, effect, reference, slope = p[0], p[1], p[2], p[3]
    smooth = math.tanh(slope * v)
    rise = coefficient + effect * math.log1p(abs(v) / reference)
    growth = effect / (reference + abs(v)) * abs(smooth)
    return rise * smooth * F, (rise * slope * (1.0 - smooth**2) + growth) * F, rise * smooth


@dataclass(frozen=True)
class LogarithmicFriction(FrictionLaw):
    """Friction that grows with the logarithm of slip velocity; v_0 in m/s, slope in s/m."""

    kernel: ClassVar = _logarithmic

    coefficient: PerNode = 0.1
    rate_effect: PerNode = 0.01
    reference_velocity: PerNode = 1e-4
    smoothing_slope: PerNode = 1e4

    @property
    def velocity_scale(self) -> float:
        """Slip velocity over which the force rises [m/s]."""
        return 1.0 / float(np.max(self.smoothing_slope))


def main(end: float = 1.0) -> None:
    """Steady sliding with the law above, and with the falling law of the package."""
    body = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.02)), thickness=0.01)
    basis = fc.modal_basis(body, 12, contact_nodes=20, damping=0.01)
    for friction in (LogarithmicFriction(),
                     ExponentialFriction(0.2, 0.12, 1000.0, smoothing_slope=1e4)):
        system = fc.ContactSystem(
            basis, RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
            friction=friction, ground=fc.Ground(speed=0.01), load=fc.Load(normal=14.0),
            drive=fc.Drive(stiffness_x=5610.0, damping_x=5.0))
        run = fc.simulate(system, end, outputs=2001)
        late = slice(3 * len(run.time) // 4, None)
        stick = (run.contact_state[late] == fc.ContactState.STICK).mean()
        swing = np.ptp(run.displacement("B")[late, 0])
        print(f"{type(friction).__name__:22s} in the end sticks {stick:4.0%} of the time, "
              f"B swings by {1e6 * swing:7.1f} um")


if __name__ == "__main__":
    main(0.2 if "--quick" in sys.argv else 1.0)
