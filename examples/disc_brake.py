"""
A disc brake squeals
====================

An annular disc, fixed at its bore, turns between two pads that springs of a calliper press and
hold; all three are solids. Friction has a constant coefficient. Complex modes about steady sliding
tell which mode grows; a run from a small disturbance grows as they say, until the pads lift off and
the squeal keeps its size.
"""

import numpy as np

import fecontact as fc
from fecontact.analysis import amplitude_spectrum, complex_modes
from fecontact.bifurcation import contact_field, equilibrium_branch
from fecontact.fem import Ring, SolidBlock
from fecontact.integrate import initial_state
from fecontact.laws import ConstantFriction, LinearContact, SlidingRotation
from fecontact.plot import picture, plot_eigenvalues
from fecontact.reduction import Bushing, Spring

# %%
# A steel disc of 10 mm, and pads of a soft lining on both of its faces, which are pressed by 2 kN.
model = fc.Assembly()
model.add("disc", fc.ElasticBody(
    fc.generate(Ring(outer_radius=0.12, inner_radius=0.05, thickness=0.01, element_size=0.03,
                     layers=1)), fixed={"inner": "xyz"}), modes=12)
block = fc.generate(SolidBlock(0.03, 0.04, 0.012, drive_height=0.012, element_size=0.012))
lining = fc.Material(youngs_modulus=8e9, poisson_ratio=0.25, density=2500.0)
calliper = np.array([2e7, 2e7, 1e5, 2e3, 2e3, 2e2])  # N/m, N m
for name, mesh, face, outward in (
        ("pad1", block.placed((0.08, -0.02, 0.01)), "top", 1.0),
        ("pad2", block.placed((0.08, 0.02, 0.0), (180.0, 0.0, 0.0)), "contact", -1.0)):
    model.add(name, fc.ElasticBody(mesh, lining), modes=8, points={"back": "top"})
    model.contact(name, f"{name}.contact", f"disc.{face}", nodes=6,
                  normal=LinearContact(1e8, damping=20.0),
                  friction=ConstantFriction(0.0, smoothing_slope=1e4, smoothing="tanh"),
                  sliding=SlidingRotation(20.0))
    model.join(Bushing(f"{name}.back", stiffness=tuple(calliper), damping=tuple(2e-6 * calliper)))
    model.join(Spring(f"{name}.back", direction=(0.0, 0.0, outward), preload=2000.0))
brake = model.system(damping=0.001, tolerance=0.3)

# %%
# Steady sliding over the coefficient of friction of both pads.
def with_friction(system, value):
    return system.with_({f"interfaces.pad{k}.friction.friction_coefficient": value for k in (1, 2)})


branch = equilibrium_branch(contact_field(brake, {"friction": (0.0, with_friction)}),
                            parameter="friction", bounds=(0.0, 0.5))
plot_eigenvalues(branch, x_label="friction coefficient", range_hz=(7e3, 9.5e3),
                 path="disc_brake_modes.png")
squealing = with_friction(brake, 0.3)
modes = complex_modes(squealing, "sliding")
worst = modes.eigenvalues.real.argmax()
print(f"at 0.3 a mode of {modes.frequencies_hz[worst]:.2f} Hz grows by "
      f"{modes.eigenvalues[worst].real:.3f} 1/s")

# %%
# sphinx_gallery_thumbnail_number = 2
# From steady sliding and a little of this mode on.
start = initial_state(squealing, "sliding", 0.0)
shape = modes.right[:, worst].real
size = np.abs(shape[: brake.basis.modes]).max()
run = fc.simulate(squealing, 0.03, initial=start + 1e-5 / size * shape, outputs=6001)
late = run.between(0.02)
peak = amplitude_spectrum(late.time, late.velocity("pad1.back")[:, 1]).peaks(1)[0]
print(f"it squeals at {peak.frequency_hz:.0f} Hz")
picture(run, "disc_brake.png", view="above")
