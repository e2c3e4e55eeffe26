"""
A block thrown across a belt
============================

A steel block lands on a moving belt with a velocity across it. Friction acts against the slip
velocity, not along the axes: in the frame of the belt the block runs straight on and stops after
v / (mu g), while in the room its path is a parabola.
"""

import numpy as np

import fecontact as fc
from fecontact.fem import SolidBlock
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.plot import COLOURS, new_figure

friction, g = 0.3, 9.81
belt, thrown = np.array([0.5, 0.0]), np.array([0.0, 1.0])  # velocities along x and y [m/s]

# %%
# A block with twelve modes and 24 contact nodes on a stiff belt, in which it sinks by a micrometre.
body = fc.ElasticBody(fc.generate(SolidBlock(0.06, 0.04, 0.02, element_size=0.01)))
basis = fc.modal_basis(body, 12, contact_nodes=24, damping=0.02)
stiffness = body.total_mass * g / 1e-6
system = fc.ContactSystem(
    basis, normal=LinearContact(stiffness, damping=0.2 * np.sqrt(stiffness * body.total_mass)),
    friction=ConstantFriction(friction, smoothing_slope=1e4), ground=fc.Ground(speed=belt[0]),
    load=fc.Load(gravity=(0.0, 0.0, -g)))

# %%
# It begins pressed by its weight, with the velocity of the throw.
rest = fc.equilibrium(system).modal_coordinates
start = np.concatenate([rest, thrown @ basis.inertia_rows[:2]])
slip = np.linalg.norm(thrown - belt)
stop = slip / (friction * g)
run = fc.simulate(system, 1.2 * stop, initial=start, outputs=601)
place = run.modal_coordinates @ basis.inertia_rows[:2].T / body.total_mass
velocity = run.modal_velocities @ basis.inertia_rows[:2].T / body.total_mass
sliding = np.linalg.norm(velocity - belt, axis=1)
slope, first = np.polyfit(run.time[sliding > 0.1 * slip], sliding[sliding > 0.1 * slip], 1)
print(f"sticks after {-first / slope:.4f} s, v / (mu g) = {stop:.4f} s")

# %%
t = np.linspace(0.0, stop, 200)[:, None]
exact = belt * t + (thrown - belt) * t * (1.0 - 0.5 * t / stop)
with new_figure(6.0, 4.2, "thrown_block.png") as figure:
    axes = figure.subplots()
    axes.plot(*(1e3 * exact.T), color=COLOURS[0], label="closed form")
    axes.plot(*(1e3 * place[::25].T), "o", color=COLOURS[1], label="block")
    axes.set(xlabel="x [mm], along the belt", ylabel="y [mm]", aspect="equal")
    axes.legend()
