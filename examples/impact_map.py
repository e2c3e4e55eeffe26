"""
Brute-force bifurcation diagram of an impact oscillator
=======================================================

A mass on a spring strikes a rough stop. Once per period of its drive the motion is marked, over the
frequency, upwards and downwards: periodic motions are lines, chaos is a cloud, and where both ways
differ two motions exist side by side. Eight hundred frequencies run in parallel lanes of the
processor.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import poincare_scan
from fecontact.laws import RoughSurface
from fecontact.plot import plot_poincare_scan

count = 800
y = [[0.0], [1.0], [0.0]]
system = fc.ContactSystem(
    fc.basis_from_matrices([[0.092]], [[0.0]], {"contact": [y], "B": y}),
    normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
    drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3, frequency_hz=4.0))

# %%
# 60 periods to settle, 32 to be seen.
scan = poincare_scan(system, "drive.frequency_hz", np.linspace(3.2, 8.0, count),
                     transient_periods=60, keep=32, initial=np.zeros(2))
for way, motion in zip(("up", "down"), scan.observed("B", "y"), strict=True):
    shares = [np.mean((np.abs(motion[:, k:] - motion[:, :-k]) < 1e-7).all(axis=1))
              for k in (1, 2, 4)]
    print(f"{way}: repeats after 1, 2 or 4 periods at "
          + ", ".join(f"{share:.0%}" for share in shares))
plot_poincare_scan(scan, "B", "y", x_label="frequency of the drive [Hz]",
                   y_label="y once a period [m]", path="impact_map.png")
