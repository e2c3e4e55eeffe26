"""
A beam on a shaker, as its sensors see it
=========================================

A cantilever is driven by a swept voltage through an electrodynamic shaker, a stinger and a force
gauge; an accelerometer of 12 g sits at its end. The force drops where the beam resonates, and the
accelerance that sensors, filter and noise give is that of the beam with the accelerometer on it.
"""

import numpy as np

import fecontact as fc
from fecontact.analysis import power_spectral_density, receptance
from fecontact.laws import SweptSine
from fecontact.measured import (
    Accelerometer,
    Acquisition,
    ForceGauge,
    Shaker,
    averaged_responses,
    measure,
    with_sensors,
)
from fecontact.plot import new_figure

# %%
# The beam, the shaker at 60 mm of its length, and the sensors.
mesh = fc.generate(fc.Beam(length=0.3, height=0.01, element_size=0.005))
beam = fc.modal_basis(
    fc.ElasticBody(mesh, fc.Material(), 0.03, fixed={"left": "xy"}), modes=4,
    points={"tip": (0.3, 0.005), "drive": (0.06, 0.0)}, damping=0.01)
shaker = Shaker(0.05, suspension_stiffness=2e3, suspension_damping=2.0, stinger_stiffness=2e6,
                force_factor=8.0, resistance=3.0, inductance=3e-4)
links = {"stinger": shaker.stinger("beam.drive")}
gauge = ForceGauge(link="stinger", name="force", mass=0.006, noise_rms=5e-3)
tip = Accelerometer(point="beam.tip", direction="+y", name="tip", mass=0.012, resonance_hz=6e3,
                    noise_density=2e-3)
bodies = {"beam": beam, "shaker": shaker.basis()}
bare = fc.ContactSystem(bodies=bodies, links=links)
system = fc.ContactSystem(with_sensors(bare.basis, [gauge, tip], links), load=fc.Load(
    forces=[shaker.drive(SweptSine(2.0, 10.0, 1000.0, 8.0, "logarithmic"))]))

# %%
# A run with four outputs for each sample, and what is measured of it.
run = fc.simulate(system, 8.0, initial=np.zeros(system.size), outputs=131073)
test = measure(run, [gauge, tip], Acquisition(rate_hz=4096.0, seed=1), links=links)
print(test)

# %%
# Accelerance by averaged spectra of both channels (H1), beside that of the beam with the masses of
# accelerometer and gauge.
found = averaged_responses(test, "force", segment=2.0).between(40.0, 850.0)
hertz, measured = found.abscissa, found.values[:, 0]
true, alone = (receptance(one, hertz, [("drive", "y")], [("tip", "y")],
                          kind="accelerance").values[:, 0, 0] for one in (
    fc.reduction.with_masses(beam, {"tip": 0.012, "drive": 0.006}), beam))
off = np.abs(measured / true - 1.0)
print(f"highest peak at {hertz[np.argmax(np.abs(measured))]:.1f} Hz, without accelerometer at "
      f"{hertz[np.argmax(np.abs(alone))]:.1f} Hz")
print(f"accelerance off by {100.0 * np.median(off):.2f} % in the middle of all frequencies")
with new_figure(9.0, 3.6, "shaken_beam.png") as figure:
    left, right = figure.subplots(1, 2)
    force = power_spectral_density(test.abscissa, test.values[:, 0], piece=2.0)
    left.semilogy(force.frequency_hz, np.sqrt(force.values))
    left.set(xlabel="frequency [Hz]", ylabel="density of the force [N/√Hz]",
             xlim=(40.0, 850.0), ylim=(0.01, 1.0))
    for values, style, label in ((measured, "-", "measured"), (true, "--", "with sensors"),
                                 (alone, ":", "beam alone")):
        right.semilogy(hertz, np.abs(values), style, label=label)
    right.set(xlabel="frequency [Hz]", ylabel="accelerance [m/s²/N]")
    right.legend()
