"""
A bladed disc with underplatform dampers: amplitude over preload
================================================================

Each blade stands on its piece of the disc and has a platform. Between the platforms of two
neighbours lies a damper, a wedge that the centrifugal force presses outwards against both. With a
large force it sticks and stiffens the wheel, with a smaller one it slides and takes energy. One
sector stands for all twelve under an engine order: each harmonic has the modes of its own nodal
diameter.
"""

from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    contact_field,
    frequency_response,
    wheel_motion,
)
from fecontact.fem import CyclicSymmetry, pair_faces
from fecontact.laws import Harmonic, JenkinsFriction, LinearContact
from fecontact.plot import plot_response, render_wheel
from fecontact.reduction import cyclic_basis

sectors, order = 12, 3
meshes = Path(fc.__file__).parents[1] / "meshes"

# %%
# A blade on its piece of the disc, and a rigid wedge that touches its platform and the next one.
bodies = {"blade": fc.ElasticBody(fc.read_mesh(meshes / "blade_sector.msh"), thickness=0.03,
                                  fixed={"bore": "xy"}),
          "damper": fc.ElasticBody(fc.read_mesh(meshes / "platform_damper.msh"), thickness=0.03)}
symmetry = CyclicSymmetry("low", "high", sectors)
every = {**bodies, **symmetry.next_sector(bodies)}
faces = {"own": pair_faces(every, "damper.left", "blade.under_right", nodes=2, nodes_on="face"),
         "next": pair_faces(every, "damper.right", "next_blade.under_left", nodes=2,
                            nodes_on="face")}
wheel = cyclic_basis(bodies, symmetry, faces, modes={"blade": 8, "damper": 3}, rigid=["damper"],
                     damping=1e-3, points={"blade.tip": "tip", "damper.middle": "middle"},
                     diameters=[0, order])

# %%
# Excited at the tip by 2 N; the damper is pressed along the radius through its middle.
radius = (np.cos(np.pi / sectors), np.sin(np.pi / sectors))
system = fc.ContactSystem(
    wheel.basis, normal=dict.fromkeys(faces, LinearContact(4e7, damping=50.0)),
    friction=dict.fromkeys(faces, JenkinsFriction(2e7, 0.3)), gap=wheel.gaps,
    load=fc.Load(forces=(fc.PointLoad("blade.tip", "y", signal=Harmonic(2.0, 600.0)),
                         fc.PointLoad("damper.middle", radius, signal=100.0))))

# %%
# Responses for several forces of the dampers.
frequency, force = "load.forces.0.signal.frequency_hz", "load.forces.1.signal.value"
wave = EngineOrder(wheel, order)
responses = frequency_response(
    system, (530.0, 715.0), frequency, observe=("blade.tip", "y"),
    levels={force: [100.0, 300.0, 1000.0, 3000.0]},
    method=HarmonicBalance([0, 1, 3], 192, stability=None, repeats=wave),
    options=ContinuationOptions(points=400, largest_step=0.1))
for level, pressed in enumerate(responses.levels):
    print(f"{pressed:6.0f} N: {1e6 * responses.amplitude(level).max():.2f} um at "
          f"{responses.peak(level).parameter:.2f} Hz")
plot_response(responses, path="platform_damper.png")

# %%
# The whole wheel at the peak of the smallest force.
motion = wheel_motion(wave.field(contact_field(system, [frequency, force])), responses.peak(0))
render_wheel(motion, "platform_damper.mp4", frames=40)
