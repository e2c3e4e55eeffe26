"""
A pendulum strikes a stop: periodic, chaotic and chattering motions
===================================================================

A pendulum of aluminium, hinged at its left end and moved up and down through a spring, strikes a
stop (W. Sextro, *Dynamical Contact Problems with Friction*, section 4.2). At five frequencies of
the spring's end the motion repeats after one, two or four periods, never, or comes to rest on the
stop in each period after rebounds that accumulate.
"""

import numpy as np

import fecontact as fc
from fecontact.analysis import find_impacts, periodicity
from fecontact.laws import Frictionless, RoughSurface
from fecontact.plot import plot_phase

# %%
# The pendulum's mesh, its rotation and three bending modes.
shape = fc.Pendulum(arm_length=0.30447856, arm_height=0.0079768, bob_width=0.03239153,
                    bob_height=0.03239153, hinge_radius=0.002, contact_length=0.006)
body = fc.ElasticBody(fc.generate(shape), fc.Material.named("aluminium"), thickness=0.0196,
                      fixed={"pivot": "hinge"})
basis = fc.modal_basis(body, 4, contact_nodes=3, B="B", damping=0.03)
print("modes at", ", ".join(f"{value:.1f}" for value in basis.frequencies_hz), "Hz")
system = fc.ContactSystem(
    basis,
    normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
    friction=Frictionless(),
    drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3, frequency_hz=10.0))

# %%
# Each run begins at rest on the stop; what repeats is looked for in its last 26 periods.
print("  drive   repeats after   impacts a period")
for frequency in (10.237, 4.908, 5.954, 3.761, 1.567):
    driven = system.with_({"drive.frequency_hz": frequency})
    periods = 120 if frequency > 2.0 else 40
    run = fc.simulate(driven, periods / frequency, outputs=200 * periods + 1,
                      initial=fc.RigidStart(displacement=(0.0, 0.0, 0.0)))
    late = run.between((periods - 26) / frequency)
    found = periodicity(run, t_start=late.time[0], largest=8)
    impacts = len(find_impacts(late)) / (frequency * np.ptp(late.time))
    print(f"{frequency:7.3f}   {found.periods or 'never':>13}   {impacts:16.1f}")
    plot_phase(late, "B", "y", path=f"pendulum_{frequency:.2f}_hz.png")
