"""
Two elastic bodies: a block sheared on another
==============================================

A block of aluminium is pressed on a longer one of steel and then pulled along it. Pressure peaks at
its edges; from the edges on it slips, until all of it does. Meshes of the two faces need not match.
"""

import numpy as np

import fecontact as fc
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import COLOURS, new_figure, plot_stress

# %%
# Two rectangles on each other, the lower one held at its bottom.
model = fc.Assembly()
model.add("table", fc.ElasticBody(
    fc.Mesh.grid(np.linspace(0.0, 0.12, 61), np.linspace(-0.04, 0.0, 21)),
    fc.Material.named("steel"), thickness=0.02, fixed={"bottom": "xy"}))
model.add("block", fc.ElasticBody(
    fc.Mesh.grid(np.linspace(0.035, 0.085, 36), np.linspace(0.0, 0.03, 22)),
    fc.Material.named("aluminium"), thickness=0.02), C="top")
model.contact("joint", "block.bottom", "table.top", normal=LinearContact(1e11),
              friction=ConstantFriction(0.4))
system = model.system(modes=6, reduction="residual", tolerance=0.0, load=fc.Load(normal=10e3))

# %%
# 10 kN, then 90 % of the force at which the block slides.
history = fc.load_history(system, fc.LoadPath(forces={"C.x": (0.0, 3600.0)}, steps=18), rtol=1e-4)
slips = (history.contact_state == fc.ContactState.SLIP).mean(axis=1)
force = history.path.at_points(history.path.forces[0])
with new_figure(9.0, 3.8, "two_bodies.png") as figure:
    face, part = figure.subplots(1, 2)
    order, area = np.argsort(system.basis.contact_x), system.basis.tributary
    x = 1e3 * system.basis.contact_x[order]
    for values, colour, label in ((history.normal_force[-1], COLOURS[0], "pressure"),
                                  (np.abs(history.friction_force[-1]), COLOURS[1], "shear")):
        face.plot(x, 1e-6 * (values / area / 0.02)[order], "o-", ms=3.0, color=colour, label=label)
    face.set(xlabel="x [mm]", ylabel="pressure, shear [MPa]")
    face.legend()
    part.plot(1e-3 * force, 100.0 * slips, "o-", color=COLOURS[0])
    part.set(xlabel="pull [kN]", ylabel="part of the face that slips [%]")
print(f"at {force[-1]:.0f} N {slips[-1]:.0%} of the face slips")

# %%
# Stress at the end.
plot_stress(system.basis.fields(history.modal_coordinates[-1]), path="two_bodies_stress.png")
