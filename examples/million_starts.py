"""
Which motion a start leads to: basins of an impact oscillator
=============================================================

At 6.764 Hz an oscillator that strikes a stop has two motions side by side, of one period and of
two. Which one a run settles on depends on where it starts, in ever finer threads towards the stop:
a map of 22 500 starts, a hundred periods each. With ``count = 1000`` it is a million, in a quarter
of an hour on two cores; give ``folder=`` to go on after an interruption.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import Axis, basins
from fecontact.laws import RoughSurface
from fecontact.plot import plot_basins

count = 150
y = [[0.0], [1.0], [0.0]]
system = fc.ContactSystem(
    fc.basis_from_matrices([[0.092]], [[0.0]], {"contact": [y], "B": y}),
    normal=RoughSurface(stiffness=0.3e6, roughness_height=5.2e-6, damping=6.0),
    drive=fc.Drive(stiffness_y=99.085, damping_y=0.02046, amplitude_y=0.47e-3,
                   frequency_hz=6.764))

# %%
# Every start is a run of its own; eight of them share a core's vector registers.
place, speed = Axis("B", "y"), Axis("B", "y", "velocity")
found = basins(system, (place, np.linspace(-1e-4, 2e-3, count)),
               (speed, np.linspace(-0.08, 0.08, count)), transient_periods=100, keep=4)
for one in found.attractors:
    print(f"{one.kind}, {len(one.points)} states once a period: {one.share:.2%} of the starts")
plot_basins(found, x_label="y at the start [m]", y_label="y' at the start [m/s]",
            rows=[axis.row(system) for axis in (place, speed)], path="million_starts.png")
