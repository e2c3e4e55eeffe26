"""
A sphere pressed on a plane and sheared to and fro
==================================================

The lowest part of an elastic sphere of 50 mm is pressed on a rigid plane until the contact has a
radius of 1 mm, as Hertz computed, and then sheared to and fro by 0.9 times the force at which it
would slide. A ring slips, a circle in the middle sticks; friction takes energy in each cycle.
"""

import numpy as np

import fecontact as fc
from fecontact.fem import Coupling, SphereSegment
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import plot_loop, plot_shear

radius, width, friction = 0.05, 1e-3, 0.3  # of the sphere and of the contact [m]
modulus, ratio = 210e9, 0.49
load = 4.0 * modulus * width**3 / (3.0 * (1.0 - ratio**2) * radius)  # Hertz
peak = 1.5 * load / (np.pi * width**2)

# %%
# A segment five times as wide and high as the contact, with fine elements there; its top cannot
# turn.
mesh = fc.generate(SphereSegment(
    radius=radius, base_radius=5.0 * width, height=5.0 * width, contact_radius=width,
    contact_element_size=0.5 * width, element_size=4.0 * width))
tool = Coupling("top", "tool", place=(0.0, 0.0, 5.0 * width), kind="distributing")
body = fc.ElasticBody(mesh, fc.Material(modulus, ratio), constraints=[tool],
                      fixed={"tool": "phi_x phi_y phi_z"})
basis = fc.modal_basis(body, 12, C="top", reduction="residual", tolerance=0.0)

# %%
# The gap is the height of the sphere; first the load alone, then Q, -Q and Q.
system = fc.ContactSystem(
    basis, normal=LinearContact(1e5 * peak / width * basis.tributary.sum()),
    friction=ConstantFriction(friction), load=fc.Load(load), gap=basis.contact_places[:, 2])
Q = 0.9 * friction * load
history = fc.load_history(system, fc.LoadPath(forces={"C.x": (0.0, Q, -Q, Q)}, steps=5), rtol=1e-3)
forces, distance = history.normal_force[0], np.hypot(*basis.contact_places[:, :2].T)
found = np.sqrt(2.5 * forces @ distance**2 / forces.sum())
print(f"radius of contact {1e3 * found:.4f} mm, Hertz {1e3 * width:.4f} mm")
print(f"a cycle takes {1e3 * history.loop(1, 3).loss:.3f} mJ")
plot_shear(history, 1, path="pressed_sphere_shear.png")
plot_loop(history, path="pressed_sphere_loop.png")
