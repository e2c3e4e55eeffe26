"""
Where stick-slip ends: set-valued friction
==========================================

A mass on a belt with static friction 1 and kinetic friction 1/2, without any smoothing: stick and
slip are events. Faster belts end stick-slip where the mass just reaches the speed of the belt once
more. The stick-slip motion is followed over the speed to that end, and the end itself over speed
and damping: the border between stick-slip and steady sliding.
"""

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    Shooting,
    codim2_curve,
    contact_field,
    orbit_branch,
    periodic_motion,
)
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction, PrescribedForce
from fecontact.plot import plot_branches


# %%
# Mass, stiffness and normal force are one.
def on_belt(dashpot, speed=0.5):
    x = [[1.0], [0.0], [0.0]]
    return fc.ContactSystem(
        fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": [x], "B": x}, damping=[[dashpot]]),
        normal=PrescribedForce(1.0), friction=ConstantFriction(0.5), ground=fc.Ground(speed=speed))


field = contact_field(on_belt(0.1), {
    "ground.speed": None,
    "dashpot": (0.1, lambda system, c: system.with_(basis=on_belt(c).basis))})
solver = SetValued(static_coefficient=1.0)

# %%
# From a run that has settled to both sides.
motion = periodic_motion(field.system(), initial=[0.9, 0.5], transient=40.0, longest_period=20.0,
                         solver=solver)
stick_slip = orbit_branch(field, motion, "ground.speed", method=Shooting(1, solver=solver),
                          bounds=(0.1, 1.0), both=True)
end = stick_slip.points[-1]
print(f"stick-slip ends at V = {end.parameter:.7f}, {end.kind}")
plot_branches(stick_slip, x_label="speed of the belt", y_label="x", path="stick_slip.png")

# %%
# The end of stick-slip over speed and dashpot.
border = codim2_curve(field, end, "dashpot",
                      bounds={"ground.speed": (0.15, 1.4), "dashpot": (0.02, 0.5)},
                      options=ContinuationOptions(largest_step=0.1))
for dashpot, speed in zip(border.column("dashpot")[::10], border.column("ground.speed")[::10],
                          strict=True):
    print(f"dashpot {dashpot:.3f}: V = {speed:.5f}")
plot_branches(border, "dashpot", x="ground.speed", x_label="speed of the belt", y_label="dashpot",
              path="sliding_borders.png")
