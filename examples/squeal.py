"""
Why a sliding part squeals
==========================

A steel beam slides on a belt. Friction has a constant coefficient, so nothing falls with slip
velocity; still the beam starts to vibrate. Its bouncing and its rocking mode have nearly the same
frequency, friction couples them, and from some coefficient on one of the two grows.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import codim2_curve, contact_field, equilibrium_branch, stability_map
from fecontact.laws import ConstantFriction, RoughSurface
from fecontact.plot import plot_eigenvalues, plot_stability_map

# %%
# The beam is pressed on the belt and held by a spring at its left end.
body = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.02)), thickness=0.01)
basis = fc.modal_basis(body, 20, contact_nodes=40, B=(0.0, 0.01), C=(0.1, 0.02), damping=0.01)
system = fc.ContactSystem(
    basis,
    normal=RoughSurface(stiffness=10e6, roughness_height=10e-6, damping=40.0),
    friction=ConstantFriction(0.0, smoothing_slope=1e6),
    ground=fc.Ground(speed=0.05),
    load=fc.Load(normal=14.0),
    drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768))

# %%
# Steady sliding over the friction coefficient: at the Hopf point a vibration begins to grow.
friction, load = "friction.friction_coefficient", "load.normal"
field = contact_field(system, [friction, load])
branch = equilibrium_branch(field, parameter=friction, bounds=(0.0, 0.6))
hopf = branch.of_kind("Hopf")[0]
print(f"flutter from a friction coefficient of {hopf.parameter:.4f} on, "
      f"at {hopf.frequency_hz:.1f} Hz, {hopf.criticality}")
plot_eigenvalues(branch, x_label="friction coefficient", range_hz=(300.0, 1200.0),
                 path="squeal_modes.png")

# %%
# The border of squeal over friction and load, above a map of growth rates.
border = codim2_curve(field, hopf, load, bounds={friction: (0.0, 0.6), load: (2.0, 30.0)})
growth = stability_map(field, {friction: np.linspace(0.0, 0.6, 31),
                               load: np.linspace(2.0, 30.0, 29)})
plot_stability_map(growth, borders=[border], x_label="friction coefficient", y_label="load [N]",
                   path="squeal_map.png")
