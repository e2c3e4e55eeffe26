"""
A beam that slides over waves, from geometry to movie
=====================================================

A steel beam is pulled to and fro at its left end on a moving, wavy ground: its modes, its run in
time, where its face touches, what friction works, and a movie of the stressed beam.
"""

import fecontact as fc
from fecontact.laws import ArchardWear, ExponentialFriction, RoughSurface
from fecontact.plot import plot_contact_map, plot_energies, plot_friction_work, plot_history

# %%
# Geometry, mesh, and a basis of twelve modes with forty contact nodes. B is where the spring pulls,
# C where the load presses: patches of some millimetres, as in a test rig.
body = fc.ElasticBody(fc.generate(fc.Beam(length=0.2, height=0.01, element_size=2.5e-3)),
                      fc.Material.named("steel"), thickness=0.02)
basis = fc.modal_basis(body, 12, contact_nodes=40, B=fc.Patch("B", 0.004), C=fc.Patch("C", 0.01),
                       damping=0.02)
print(basis)

# %%
# Laws of contact, and what acts on the beam.
system = fc.ContactSystem(
    basis,
    normal=RoughSurface(stiffness=5e7, roughness_height=20e-6, damping=2e3),
    friction=ExponentialFriction(static_coefficient=0.5, kinetic_coefficient=0.35, decay=2.0,
                                 smoothing_slope=1e4),
    ground=fc.Ground(speed=2.0, amplitude=30e-6, wavelength=0.12),
    drive=fc.Drive(stiffness_x=2e5, damping_x=50.0, amplitude_x=0.3e-3, frequency_hz=60.0),
    load=fc.Load(normal=400.0))

# %%
# A run of 60 ms: one wave passes below the beam while its end swings 3.6 times.
run = fc.simulate(system, 0.06, outputs=1201)
energies = run.energies
print(f"friction takes {energies.friction[-1]:.3f} J; the balance of work is off by "
      f"{energies.imbalance:.0e}")
wear = run.wear_depth(ArchardWear(1e-14), 0.02)[-1]
print(f"in mild wear this takes off {1e9 * wear.min():.3f} to {1e9 * wear.max():.3f} nm")

# %%
# Pictures, and a movie.
plot_history(run, ("B", "C"), path="history.png")
plot_energies(run, path="energies.png")
plot_contact_map(run, path="contact.png")
plot_friction_work(run, path="friction_work.png")
fc.render(run, "sliding_beam.mp4", frames=60, colour="von_mises",
          title="Steel beam sliding over waves")
