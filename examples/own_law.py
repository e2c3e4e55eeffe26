"""
A friction law of your own
==========================

Friction of rocks and polymers rises with slip velocity: ``mu(v) = mu_0 + a ln(1 + |v| / v_0)``.
Twenty lines make it a law at the speed of the built-in ones. A beam on a belt gets it and settles,
where falling friction keeps it sticking and slipping. In a study file beside this script the law is
used by ``law = "own_law.py:LogarithmicFriction"`` in ``[friction]``.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import fecontact as fc
from fecontact.laws import ExponentialFriction, FrictionLaw, PerNode, RoughSurface, friction_law
from fecontact.plot import plot_runs


# %%
# The force and its derivatives to slip velocity and normal force; v in m/s, F in N, p the
# parameters in the order of the class below.
@friction_law
def _logarithmic(v, F, p):
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


# %%
# The beam with this law, and with the falling one of the package.
if __name__ == "__main__":
    body = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.02)), thickness=0.01)
    system = fc.ContactSystem(
        fc.modal_basis(body, 12, contact_nodes=20, damping=0.01),
        normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
        friction=LogarithmicFriction(),
        ground=fc.Ground(speed=0.01), load=fc.Load(normal=14.0),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=5.0))
    falling = system.with_(friction=ExponentialFriction(0.2, 0.12, 1000.0, smoothing_slope=1e4))
    runs = {"logarithmic": fc.simulate(system, 0.4, outputs=2001),
            "falling": fc.simulate(falling, 0.4, outputs=2001)}
    for name, run in runs.items():
        late = run.between(0.3)
        sticks = (late.contact_state == fc.ContactState.STICK).mean()
        print(f"{name}: sticks {sticks:.0%} of the time, "
              f"B swings by {1e6 * np.ptp(late.displacement('B')[:, 0]):.1f} um")
    plot_runs({name: run.between(0.2) for name, run in runs.items()}, path="own_law.png")
