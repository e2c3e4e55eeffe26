"""
Damping by slip between clamped layers
======================================

Two steel layers are pressed on each other and bent to and fro at their common end. They slip on
each other; how much energy a cycle takes depends on the pressure: none without friction, none where
nothing slips, most in between. Goodman and Klumpp (1956) found 4 F (P - 4 F / 3) / k per cycle for
the end load P, the stiffness k of the free layers and the friction F = mu p b h.
"""

import numpy as np

import fecontact as fc
from fecontact.laws import ConstantFriction, PrescribedForce
from fecontact.plot import COLOURS, new_figure

length, height, width, friction, end_load = 0.5, 0.01, 0.02, 0.3, 300.0
stiffness = 210e9 * width * height**3 / (2.0 * length**3)  # of the end, both layers apart

# %%
# Two layers clamped at their left ends; half of the end load acts on each.
model = fc.Assembly()
for name, low in (("lower", 0.0), ("upper", height)):
    mesh = fc.Mesh.grid(np.linspace(0.0, length, 41), low + np.linspace(0.0, height, 3))
    model.add(name, fc.ElasticBody(mesh, thickness=width, fixed={"left": "xy"}),
              loads=["top" if name == "upper" else "bottom", "end"], points={"end": "right"})
model.contact("joint", "upper.bottom", "lower.top", nodes=20, normal=PrescribedForce(1.0),
              friction=ConstantFriction(friction))
layers = model.system(modes=4, tolerance=0.0, load=fc.Load(boundaries=tuple(
    fc.BoundaryLoad(name, pressure=1.0) for name in ("upper.top", "lower.bottom"))))

# %%
# Loaded to P, then a cycle to -P and back, for several pressures.
cycle = (0.0, 0.5 * end_load, -0.5 * end_load, 0.5 * end_load)
parts, losses = np.array([0.05, 0.125, 0.2, 0.3, 0.375, 0.45, 0.55, 0.65, 0.75]), []
for part in parts:
    pressure = part * end_load / (friction * width * height)
    pressed = layers.with_({"interfaces.joint.normal.force": pressure * length * width})
    history = fc.load_history(
        pressed, fc.LoadPath(load_scale=pressure, steps=10,
                             forces={"upper.end.y": cycle, "lower.end.y": cycle}),
        tangential_stiffness=1e13 * length * width, rtol=1e-4)
    losses.append(history.loss[-1] - history.loss[history.row(1)])
    print(f"mu p b h / P = {part:.3f}: {losses[-1]:.4f} J")

# %%
fine = np.linspace(0.0, 0.75, 200)
F = fine * end_load
with new_figure(7.0, 4.2, "clamped_layers.png") as figure:
    axes = figure.subplots()
    axes.plot(fine, 4.0 * F * (end_load - 4.0 / 3.0 * F) / stiffness, color=COLOURS[0],
              label="slip theory")
    axes.plot(parts, losses, "o", color=COLOURS[1], label="two bodies")
    axes.set(xlabel="µ p b h / P", ylabel="loss per cycle [J]")
    axes.legend()
