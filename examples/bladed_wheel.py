"""
A wheel of blades from one sector: nodal diameters, rotation, friction between the blades
=========================================================================================

The sector of a plane wheel is a piece of a ring with one blade. Its modes are those of the whole
wheel, by nodal diameters; at speed, waves that run forwards and backwards differ. Then the blades
touch each other at their tips under an engine order: pressed lightly they slide, pressed hard they
stick, and in between friction takes most. One blade stands for the wheel.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    frequency_response,
)
from fecontact.fem import CyclicSymmetry, Rotation
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.plot import plot_diameters, plot_response, plot_wheel
from fecontact.reduction import PointPairing, cyclic_basis_from_bases, sector_modes

sectors, order, speed = 12, 4, 900.0  # engine order; rad/s

# %%
# The sector: a grid over angle and radius, of which the outer part is the blade alone.
radii = np.concatenate([np.linspace(0.175, 0.2, 4), np.linspace(0.2, 0.32, 9)[1:]])
grid = fc.Mesh.grid(np.linspace(0.0, 2.0 * np.pi / sectors, 9), radii)
angle, radius = grid.nodes.T
inside = (radius < 0.201) | (np.abs(angle - np.pi / sectors) < 1.1 * np.pi / 4.0 / sectors)
mesh = grid.part(inside[grid.cells].all(axis=1)).mapped(
    lambda at: at[:, 1:] * np.column_stack([np.cos(at[:, 0]), np.sin(at[:, 0])]))
body = fc.ElasticBody(mesh, thickness=0.02)

# %%
# Frequencies over the nodal diameter, at rest and at speed.
symmetry = CyclicSymmetry("left", "right", sectors)
wheel = sector_modes(body, symmetry, 3)
turning = sector_modes(body, symmetry, 16, rotation=Rotation(speed)).rotation
forward, backward = turning.frequencies_hz(speed)
print(f"diameter {order}: {forward[order, 0]:.1f} Hz forwards, {backward[order, 0]:.1f} Hz "
      f"backwards")
plot_diameters(wheel, speed=speed, path="wheel_diameters.png")
plot_wheel(wheel, [(2, 0), (4, 0), (6, 1)], path="wheel_modes.png")

# %%
# Blades that touch the next one at their tips, by an elastic Coulomb element.
blade = fc.modal_basis(
    fc.ElasticBody(fc.generate(fc.Beam(0.12, 0.008, 0.004)), thickness=0.02, fixed={"left": "xy"}),
    4, contact=(), B="", C="", damping=2e-3, points={"tip": (0.12, 0.004)})
tips = cyclic_basis_from_bases({"blade": blade}, sectors, {
    "tips": PointPairing("blade", "tip", "next_blade", "tip", normals=(1.0, 0.0))})
system = fc.ContactSystem(
    tips.basis, normal=PrescribedForce(1.0), friction=JenkinsFriction(2e4, 0.4),
    load=fc.Load(forces=(fc.PointLoad("blade.tip", "y", signal=Harmonic(1.0, 450.0)),)))

# %%
# Responses to the engine order for several normal forces.
responses = frequency_response(
    system, (430.0, 520.0), "load.forces.0.signal.frequency_hz", observe=("blade.tip", "y"),
    levels={"normal.force": [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 1000.0]},
    method=HarmonicBalance([0, 1, 3], 144, stability=None, repeats=EngineOrder(tips, order)),
    options=ContinuationOptions(points=1000, largest_step=0.03))
for level, force in enumerate(responses.levels):
    print(f"{force:6.1f} N: peak {1e6 * responses.amplitude(level).max():.2f} um at "
          f"{responses.peak(level).parameter:.2f} Hz")
plot_response(responses, path="blade_tips.png")
