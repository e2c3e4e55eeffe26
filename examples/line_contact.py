"""
Hertz's pressure and partial slip under a cylinder
==================================================

An elastic block with the gap x^2 / (2 R) of a cylinder of 50 mm is pressed on a rigid plane with 1
MN per metre, then sheared by half of the force at which it would slide. The pressure is Hertz's
ellipse; a strip in the middle sticks and its edges slip, as Cattaneo found.
"""

import numpy as np

import fecontact as fc
from fecontact.fem import Coupling
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import COLOURS, new_figure

radius, force, friction = 0.05, 1e6, 0.3
steel = fc.Material(210e9, 0.49)  # nearly incompressible: pressure and shear are not coupled
b = np.sqrt(4.0 * force * radius * (1.0 - 0.49**2) / (np.pi * 210e9))
peak = 2.0 * force / (np.pi * b)

# %%
# Elements of b / 16 at the contact grow by a quarter each, up to 60 b away.
near, growing = b / 16.0 * np.arange(33), b / 16.0 * 1.25 ** np.arange(1, 25)
half = np.concatenate([near, near[-1] + np.cumsum(growing)])
deep = np.concatenate([[0.0], np.cumsum(np.append(b / 16.0, growing))])
mesh = fc.Mesh.grid(np.concatenate([-half[:0:-1], half]), deep)
low = mesh.boundary("bottom")
mesh = fc.Mesh(mesh.nodes, mesh.cells, {
    **mesh.boundaries, "contact": low[np.abs(mesh.nodes[low, 0].mean(axis=1)) < 1.6 * b]})
# The tool that pushes the block on its top keeps it from tipping.
tool = Coupling("top", "tool", place=(0.0, deep[-1]), kind="distributing")
body = fc.ElasticBody(mesh, steel, plane="strain", constraints=[tool], fixed={"tool": "phi"})
basis = fc.modal_basis(body, 6, C="top", reduction="residual", tolerance=0.0)

# %%
# Pressed without friction first, then sheared in ten steps. The surface's own stiffness is so high
# that the block alone gives way.
system = fc.ContactSystem(
    basis, normal=LinearContact(1e6 * peak / b * basis.tributary.sum()),
    friction=ConstantFriction(friction, smoothing_slope=1e6),
    load=fc.Load(force), gap=basis.contact_x**2 / (2.0 * radius))
history = fc.load_history(system, fc.LoadPath(forces={"C.x": (0.0, 0.5 * friction * force)},
                                              steps=10))
pressure = history.normal_force[-1] / basis.tributary
shear = history.friction_force[-1] / basis.tributary
print(f"p_0 = {1e-9 * pressure.max():.4f} GPa, Hertz {1e-9 * peak:.4f} GPa")

# %%
order, x = np.argsort(basis.contact_x), np.linspace(-1.4, 1.4, 401)
ellipse, inner = (np.sqrt(np.maximum(part - x**2, 0.0)) for part in (1.0, 0.5))
with new_figure(7.0, 4.2, "line_contact.png") as figure:
    axes = figure.subplots()
    axes.plot(x, 1e-9 * peak * ellipse, color=COLOURS[0], label="Hertz")
    axes.plot(x, 1e-9 * peak * friction * (ellipse - inner), color=COLOURS[1], label="Cattaneo")
    for values, colour, label in ((pressure, COLOURS[0], "pressure"), (shear, COLOURS[1], "shear")):
        axes.plot(basis.contact_x[order] / b, 1e-9 * values[order], "o", ms=3.0, color=colour,
                  label=label)
    axes.set(xlabel="x / b", ylabel="pressure, shear [GPa]", xlim=(-1.4, 1.4))
    axes.legend()
