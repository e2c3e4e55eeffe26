"""
Friction vibration that beats on wavy ground
============================================

A block on a belt vibrates by itself, as friction falls with slip velocity. Waves of the belt shake
it with another frequency, speed over wavelength. The motion never repeats: it lies on a torus.
Higher waves entrain the vibration, and the torus shrinks to a periodic orbit.
"""

import matplotlib.pyplot as plt
import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    HarmonicBalance,
    TorusBalance,
    contact_field,
    orbit_branch,
    periodic_motion,
    torus_branch,
    torus_motion,
)
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.plot import plot_branches

# %%
# A block of 5.6 kg between a spring and the belt, which moves it up and down too.
rows = np.zeros((3, 2))
rows[0, 0] = rows[1, 1] = 1.0
basis = fc.basis_from_matrices(5.632 * np.eye(2), np.zeros((2, 2)),
                               {"contact": rows[None], "B": rows, "C": rows})
waves = "ground.amplitude"
system = fc.ContactSystem(
    basis, normal=RoughSurface(stiffness=10e6, roughness_height=10e-6, damping=40.0),
    friction=ExponentialFriction(0.8, 0.55, 50.0, smoothing_slope=1e3),
    ground=fc.Ground(speed=20e-3, amplitude=38e-6, wavelength=4.4e-3),
    drive=fc.Drive(stiffness_x=5610.0, damping_x=20.0), load=fc.Load(14.0))

# %%
# High waves: a periodic orbit. It loses stability at a Neimark-Sacker point, where tori are born.
field = contact_field(system, [waves])
start = periodic_motion(system, transient=60.0)
orbits = orbit_branch(field, start, bounds=(10e-6, 38e-6), direction=-1.0,
                      method=HarmonicBalance(9))
born = orbits.of_kind("Neimark-Sacker")[0]
tori = torus_branch(field, born, bounds=(2e-6, 38e-6), method=TorusBalance((6, 9)))
last = torus_motion(tori.points[-1])
print(f"tori from waves of {1e6 * born.parameter:.3f} um on")
print(f"waves of 2 um: {last.frequencies[0]:.4f} Hz and {last.frequencies.sum():.4f} Hz")
plot_branches([orbits, tori], lambda point: np.ptp([point.values["minimum"][0],
              point.values["maximum"][0]]) / 2.0 / np.sqrt(5.632), names=["orbits", "tori"],
              y_label="amplitude of the block [m]", path="tori.png")

# %%
# A run passes the start of a wave on the closed curve in which the torus meets it.
curve, period = last.section(400), 1.0 / last.frequencies[0]
times = period * np.arange(260.0)
run = fc.simulate(system.with_({waves: 2e-6}), times[-1], outputs=times).between(30.0)
figure, axis = plt.subplots()
axis.plot(*curve[:, [0, 2]].T / np.sqrt(5.632), label="torus")
axis.plot(*run.states[:, [0, 2]].T / np.sqrt(5.632), ".", label="run")
axis.set(xlabel="displacement of the block [m]", ylabel="velocity [m/s]")
axis.legend()
figure.savefig("tori_section.png")
