"""
Orbits of an impact oscillator, stable and unstable
===================================================

Runs show the motions that attract. Followed over the frequency of the drive, orbits also show those
that do not: where they double their period, turn at folds, and how they hang together. The
oscillator is a pendulum in its rigid and first bending mode that strikes a rough stop.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    Shooting,
    contact_field,
    observe,
    orbit_branch,
    periodic_motion,
    poincare_scan,
)
from fecontact.laws import RoughSurface
from fecontact.plot import plot_branches

# %%
# The bending mode of 230 Hz has 0.6 of the rigid mode's amplitude at the tip; 0.092 kg.
tip = np.array([[0.0, 0.0], [1.0, 0.6], [0.0, 0.0]])
basis = fc.basis_from_matrices(
    0.092 * np.eye(2), 0.092 * np.diag([0.0, (2.0 * np.pi * 230.0) ** 2]),
    {"contact": [tip], "B": tip}, damping=(0.0, 0.03))
system = fc.ContactSystem(
    basis,
    normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
    drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3, frequency_hz=7.6))
field = contact_field(system, ["drive.frequency_hz"])

# %%
# From the motion of a run on to both sides by shooting, then the doubled orbits.
motion = periodic_motion(system, initial=np.zeros(4), longest_period=8.0 / 7.6)
options = ContinuationOptions(step=1e-3, largest_step=0.02, points=120)
single = orbit_branch(field, motion, method=Shooting(segments=1, rtol=1e-7), bounds=(5.4, 8.3),
                      both=True, scales=10.0 * np.ptp(motion.states, axis=0), width=4.0,
                      options=options)
branches = {"one period": single}
for point in single.of_kind("period doubling")[:1]:
    branches["two periods"] = orbit_branch(field, point, bounds=(5.4, 8.3), options=options)
for name, branch in branches.items():
    for point in branch.special:
        print(f"{name}: {point.kind} at {point.parameter:.5f} Hz")

# %%
# Beneath: the states of runs once a period.
runs = poincare_scan(system, "drive.frequency_hz", np.arange(5.4, 8.3, 0.02), transient_periods=100,
                     keep=24, initial=np.zeros(4))
plot_branches([observe(field, branch, "B", "y") for branch in branches.values()],
              "observed_section", x_label="frequency of the drive [Hz]",
              y_label="y of B once a period [m]", names=list(branches), beneath=runs,
              observe=("B", "y"), path="impact_orbits.png")
