"""
Stick and slip of a block on a belt
===================================

A block on a moving belt, held by a spring whose end swings (W. Sextro, *Dynamical Contact Problems
with Friction*, section 4.3). With its rigid modes alone the motion is one loop of stick and slip.
An elastic mode rings after each slip, and on a wavy belt slips have many lengths.
"""

import numpy as np

import fecontact as fc
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.plot import COLOURS, new_figure, plot_spectrogram

# %%
# Modes along the belt, across it, and an elastic one of 30 Hz with amplitudes of 0.5 where the
# spring pulls and -0.5 at the contact, relative to the rigid mode; all of 5.632 kg.
along, across, elastic = np.eye(3)
contact = [along - 0.5 * elastic, across, np.zeros(3)]
spring = [along + 0.5 * elastic, across, np.zeros(3)]
mass, stiffness = 5.632 * np.eye(3), 5.632 * np.diag([0.0, 0.0, (2.0 * np.pi * 30.0) ** 2])
basis = fc.basis_from_matrices(mass, stiffness, {"contact": [contact], "B": spring, "C": contact},
                               damping=(0.0, 0.0, 0.01))

# %%
# Friction falls from 0.8 to 0.55; the belt moves by 1 mm/s.
system = fc.ContactSystem(
    basis,
    normal=RoughSurface(stiffness=10e6, roughness_height=10e-6, damping=40.0),
    friction=ExponentialFriction(static_coefficient=0.8, kinetic_coefficient=0.55, decay=1000.0,
                                 smoothing_slope=1e6),
    ground=fc.Ground(speed=1e-3),
    drive=fc.Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                   frequency_hz=13.8 / (2.0 * np.pi)),
    load=fc.Load(normal=14.0))
waves = {"ground.amplitude": 0.2e-3, "ground.wavelength": 2.5e-3, "ground.normal": "vertical"}
cases = {"rigid modes": system.with_(basis=basis.select([0, 1])),
         "elastic mode": system,
         "elastic mode, wavy belt": system.with_(waves)}
runs = {name: fc.simulate(case, 40.0, outputs=40_001).between(15.0)
        for name, case in cases.items()}

# %%
# The phase planes of B after transients.
with new_figure(10.0, 3.6, "friction_oscillator.png") as figure:
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, (name, run) in zip(panels, runs.items(), strict=True):
        sticks = (run.contact_state == fc.ContactState.STICK).mean()
        print(f"{name}: sticks {sticks:.0%} of the time")
        axes.plot(1e3 * run.displacement("B")[:, 0], 1e3 * run.velocity("B")[:, 0], lw=0.8,
                  color=COLOURS[0])
        axes.set(title=name, xlabel="x of B [mm]")
    panels[0].set(ylabel="velocity of B [mm/s]")

# %%
# Frequencies that ring over time, during the last ten seconds.
plot_spectrogram(runs["elastic mode"].between(30.0), piece=1.0, highest_hz=60.0,
                 path="spectrogram.png")
