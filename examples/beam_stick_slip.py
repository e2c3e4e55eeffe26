"""
Stick-slip of an elastic beam, followed over the speed of its belt
==================================================================

A steel beam with eight modes and twenty contact nodes rests on a belt; a spring at its left end
holds it. Below a certain speed steady sliding gives way to stick-slip. From a run that has settled
on the periodic motion is followed over the speed, stable or not.
"""

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    Shooting,
    contact_field,
    equilibrium_branch,
    observe,
    orbit_branch,
    periodic_motion,
)
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.plot import plot_branches

# %%
# The beam, pressed by 14 N; friction falls with the slip velocity.
body = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.02)), thickness=0.01)
basis = fc.modal_basis(body, 8, contact_nodes=20, B=(0.0, 0.01), C=(0.1, 0.02), damping=0.01)
system = fc.ContactSystem(
    basis,
    normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
    friction=ExponentialFriction(0.8, 0.55, decay=1000.0, smoothing_slope=1e6),
    ground=fc.Ground(speed=0.05),
    load=fc.Load(normal=14.0),
    drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768))
field = contact_field(system, ["ground.speed"])

# %%
# Steady sliding, from fast to slow belts: a vibration begins at its Hopf point.
sliding = observe(field, equilibrium_branch(field, bounds=(2e-3, 0.3), direction=-1.0), "B")
hopf, = sliding.of_kind("Hopf")
print(f"steady sliding is stable above {1e3 * hopf.parameter:.4f} mm/s")

# %%
# A run that has settled, and its motion over the speed by shooting.
motion = periodic_motion(system, transient=2.0, longest_period=0.3, rtol=1e-7)
print(f"a run at 50 mm/s repeats after {1e3 * motion.period:.3f} ms")
orbits = observe(field, orbit_branch(
    field, motion, method=Shooting(segments=1, rtol=1e-8, derivative_rtol=1e-2),
    bounds=(0.025, 0.3), both=True,
    options=ContinuationOptions(step=0.01, largest_step=0.03, points=60, locate=False)), "B")
plot_branches([sliding, orbits], "observed_amplitude", x_label="speed of the belt [m/s]",
              y_label="amplitude of B [m]", names=["steady sliding", "stick-slip"],
              path="beam_stick_slip.png")
