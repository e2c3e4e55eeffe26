"""
Two masses on a belt: every vibration from one command
======================================================

A chain of two masses, each pressed on a moving belt; friction falls with the slip velocity (W.
Sextro, *Dynamical Contact Problems with Friction*, section 4.4). Steady sliding ends at Hopf
points; the vibrations that begin there turn at folds and double their period. The unstable one
between fold and Hopf point parts the starts that come to rest from those that go on vibrating.
"""

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    amplitude,
    contact_field,
    equilibrium_branch,
    orbit_branch,
)
from fecontact.laws import PrescribedForce, ProductFriction
from fecontact.plot import plot_branches
from fecontact.reduction import point_masses

# %%
# Masses in kg, springs in N/m, dashpots in N s/m, to the ground or between the masses. Both normal
# forces are one parameter, B.
basis = point_masses({"1": 2.5, "2": 1.0}, {("1", None): 2.0, ("1", "2"): 1.0},
                     dashpots={("1", None): 0.2, ("1", "2"): 0.2},
                     components="x", contact=["1", "2"])
system = fc.ContactSystem(basis, normal=PrescribedForce((0.3, 0.3)),
                          friction=ProductFriction(0.14, 1.14, 2.0, 100.0),
                          ground=fc.Ground(speed=1.0))
field = contact_field(system, {
    "B": (0.3, lambda given, B: given.with_({"normal.force": (B, B)}))})

# %%
# Steady sliding, then the vibration that begins at its first Hopf point, then the one of twice the
# period.
bounds, options = (0.3, 10.0), ContinuationOptions(step=0.01, largest_step=0.1)
sliding = equilibrium_branch(field, parameter="B", bounds=bounds)
orbits = orbit_branch(field, sliding.of_kind("Hopf")[0], options=options, bounds=bounds)
doubled = orbit_branch(field, orbits.of_kind("period doubling")[0], options=options, bounds=bounds)
for point in (*sliding.special, *orbits.special, *doubled.special):
    print(f"{point.kind} at B = {point.parameter:.4f}")
plot_branches([sliding, orbits, doubled], amplitude(field.displacement_row(1)), x_label="B [N]",
              y_label="amplitude of the second mass [m]",
              names=["steady sliding", "vibration", "twice the period"],
              path="two_masses_over_B.png")
