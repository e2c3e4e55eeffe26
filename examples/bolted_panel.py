"""
A thin panel between bolted ends: hardening and slip in one nonlinear mode
==========================================================================

A steel strip, 0.3 m long and 1 mm thick, vibrates between two washers. Large deflections stretch
it: the frequency rises with the amplitude. The pull at its ends moves them in the washers, against
friction. Bolts that press hard hold the ends, and the panel hardens without loss; with less force
friction limits the pull, and from some amplitude on the ends slip in each cycle.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import ContinuationOptions, HarmonicBalance, nonlinear_mode
from fecontact.laws import JenkinsFriction, PrescribedForce
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import LargeDeflections

# %%
# One half of the strip, whose middle moves along y alone; washers hold 20 mm of its end along y.
x = np.concatenate([np.linspace(-0.02, 0.0, 5), np.linspace(0.0, 0.15, 13)[1:]])
mesh = fc.Mesh.grid(x, np.linspace(0.0, 1e-3, 3))
pressed = {name: mesh.boundary(side)[mesh.nodes[mesh.boundary(side), 0].max(axis=1) < 1e-9]
           for name, side in (("contact", "bottom"), ("washer", "top"))}
mesh = fc.Mesh(mesh.nodes, mesh.cells, {**mesh.boundaries, **pressed}, mesh.points)
body = fc.ElasticBody(mesh, fc.Material.named("steel"), thickness=0.05,
                      fixed={"washer": "y", "right": "x"})

# %%
# Three modes, residual vectors of friction at the end, and the forces of large deflections.
basis = fc.modal_basis(body, 3, contact_nodes=2, B="", C="", reduction="residual", damping=1e-3,
                       points={"middle": (0.15, 0.5e-3)},
                       large_deflections=LargeDeflections(2.5e-3))
print(basis.large_deflections[0])

# %%
# The first mode over its amplitude for several forces of the bolts.
with new_figure(9.0, 3.6, "bolted_panel.png") as figure:
    frequency, damping = figure.subplots(1, 2)
    for force, colour in zip((400.0, 800.0, 1600.0, 1e6), COLOURS, strict=False):
        system = fc.ContactSystem(basis, PrescribedForce(force), JenkinsFriction(5e7, 0.2))
        mode = nonlinear_mode(
            system, (2e-5, 2e-3), observe=("middle", "y"),
            method=HarmonicBalance(4, 128, stability=None),
            options=ContinuationOptions(points=400, step=0.05, largest_step=0.15))
        name = f"{force:g} N" if force < 1e5 else "held"
        print(f"{name}: {mode.frequency_hz[0]:.2f} Hz, at 2 mm {mode.frequency_hz[-1]:.2f} Hz "
              f"and a damping ratio of {mode.damping_ratio[-1]:.2%}")
        frequency.plot(1e3 * mode.amplitude, mode.frequency_hz, color=colour, label=name)
        damping.plot(1e3 * mode.amplitude, 100.0 * mode.damping_ratio, color=colour)
    frequency.set(xlabel="amplitude [mm]", ylabel="frequency [Hz]")
    damping.set(xlabel="amplitude [mm]", ylabel="damping ratio [%]")
    frequency.legend(title="force of a bolt")
