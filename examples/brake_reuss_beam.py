"""
The Brake-Reuss beam, from a deck to its damping over the amplitude
===================================================================

Two steel beams overlap by 0.12 m and are held by three bolts: a test piece of the research on
joints. Its deck, in Abaqus' format, is published by Porter and Brake (Mechanical Systems and Signal
Processing 192, 2023, 110210) and is not part of this package. It is read, reduced and bolted; the
first bending mode is followed over its amplitude, with friction in the lap.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import ContinuationOptions, HarmonicBalance, nonlinear_mode
from fecontact.fem import pair_faces
from fecontact.laws import AsperityContact, IwanFriction
from fecontact.plot import plot_nonlinear_mode
from fecontact.reduction import assembled_basis, reduce_bodies

deck = Path("brake-reuss-beam.inp")
if not deck.exists():
    raise SystemExit(f"Put the deck of the Brake-Reuss beam beside this, as {deck}.")

# %%
# Both beams and their bolts in one body, whose faces in the lap are paired. Threads of bolts and
# nuts are reference points, at which forces act.
body = fc.ElasticBody(fc.read_mesh(deck), degree=1)
lap = pair_faces({"beam": body}, "beam.BOTBEAM_INSURF", "beam.TOPBEAM_INSURF", nodes=(12, 3))
threads = [(f"BPT-{k}_Set-1", f"NPT-{k}_Set-1") for k in (1, 2, 3)]
points = [name for pair in threads for name in pair]
bases = reduce_bodies({"beam": body}, [lap], modes=14, tolerance=1e-4, each={
    "beam": {"points": {name: name for name in points} | {"out": "OutNodes"}, "loads": points}})
basis = assembled_basis(bases, {"lap": lap}).select(range(90))
# Damping of the material: a ratio of 8.7e-4 at 168.5 Hz.
basis = replace(basis, damping=4.0 * np.pi * 168.5 * 8.7e-4 * np.eye(basis.modes))
free = basis.frequencies_hz[basis.frequencies_hz > 10.0]
print("free, without contact:", ", ".join(f"{hertz:.2f}" for hertz in free[:3]), "Hz")

# %%
# Bolts of 12.2 kN flatten the asperities, 1.37 for each square millimetre and 1.36 mm in radius,
# whose gaps have about a normal distribution. Then these are elastic, stick by Mindlin's stiffness
# and slide one after another.
tight = fc.Load(forces=tuple(
    fc.PointLoad(f"beam.{name}", "z", signal=sign * 12249.0)
    for pair in threads for name, sign in zip(pair, (1.0, -1.0), strict=True)))
gaps = np.linspace(0.0, 28e-6, 101)
new = AsperityContact(
    tuple(1.3713e6 * lap.tributary), 1.365e-3, 1.0567e11, gaps[-1],
    tuple(np.exp(-0.5 * ((gaps - 13.95e-6) / 3.17e-6) ** 2)), yield_stress=331.7e6)
pressed = fc.equilibrium(fc.ContactSystem(
    basis, new, IwanFriction(1.0, 0.03, 5), load=tight)).penetration
friction = new.friction(lap.tributary / lap.tributary.sum(), pressed, 0.03, elements=10)
system = fc.ContactSystem(basis, new.flattened(pressed), friction, load=tight)
rest = fc.load_history(system, fc.LoadPath(steps=1, load_scale=(1.0, 1.0)))
stuck = np.sort(fc.analysis.prestressed_modes(system, rest).frequencies_hz)
print(f"bolted, with stuck contacts: {stuck[stuck > 20.0][0]:.2f} Hz")

# %%
# Frequency and damping of the first bending mode over the amplitude of the end.
mode = nonlinear_mode(system, (1e-6, 1.6e-5), observe=("beam.out", "z"), preload=rest,
                      method=HarmonicBalance(1, 64),
                      options=ContinuationOptions(points=100, step=0.2, largest_step=1.0))
print(f"{mode.frequency_hz[0]:.2f} Hz and a damping ratio of {mode.damping_ratio[0]:.5f} at 1 um, "
      f"{mode.frequency_hz[-1]:.2f} Hz and {mode.damping_ratio[-1]:.5f} at 16 um")
plot_nonlinear_mode(mode, path="brake_reuss_backbone.png")
