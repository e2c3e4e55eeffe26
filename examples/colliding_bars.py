"""
Two bars collide: where the energy of an impact goes
====================================================

A bar hits another one end to end. If both are equal they exchange their velocities; a long one goes
on with waves in it, so that the bodies part more slowly although nothing is lost: the coefficient
of restitution is the ratio of the lengths, without any dashpot.
"""

import numpy as np

import fecontact as fc
from fecontact.laws import Frictionless, LinearContact
from fecontact.plot import COLOURS, new_figure

steel = fc.Material(210e9, 0.0, 7850.0)  # without Poisson's ratio: longitudinal waves alone
speed = np.sqrt(210e9 / 7850.0)  # of waves [m/s]


# %%
# Strips of 10 mm that can neither bend nor widen.
def bar(start, length):
    x = start + np.linspace(0.0, length, round(80 * length) + 1)
    mesh = fc.Mesh.grid(x, [0.0, 0.01])
    return fc.ElasticBody(mesh, steel, fixed={"bottom": "y", "top": "y"})


# %%
# A stiff spring between the ends; the first bar comes with 1 m/s.
with new_figure(8.0, 4.2, "colliding_bars.png") as figure:
    axes = figure.subplots()
    for length, colour in zip((1.0, 2.0, 3.0), COLOURS, strict=False):
        model = fc.Assembly()
        model.add("first", bar(0.0, 1.0), modes=40)
        model.add("second", bar(1.0, length), modes=round(40 * length))
        model.contact("ends", "first.right", "second.left", nodes=1, normal=LinearContact(2.6e10),
                      friction=Frictionless())
        system = model.system(tolerance=0.0)
        first, _ = system.basis.parts
        coming = np.zeros(system.size)
        modes = slice(first.modes[0], sum(first.modes))
        inertia = system.basis.inertia_rows[0]  # momentum along x of each mode
        coming[system.basis.modes :][modes] = inertia[modes]
        run = fc.simulate(system, 2.4 * max(1.0, length) / speed, initial=coming, outputs=2001)
        momentum = run.modal_velocities * inertia
        before, after = (7850.0 * 0.01 * one for one in (1.0, length))
        v1 = momentum[-1, modes].sum() / before
        v2 = (momentum[-1].sum() - momentum[-1, modes].sum()) / after
        print(f"1 m on {length:g} m: restitution {v2 - v1:.4f}")
        axes.plot(1e6 * run.time, 1e-6 * run.normal_force[:, 0], color=colour,
                  label=f"1 m on {length:g} m")
    axes.set(xlabel="time [µs]", ylabel="force per thickness [MN/m]")
    axes.legend()
