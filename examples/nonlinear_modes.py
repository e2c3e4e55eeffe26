"""
Nonlinear modes: frequency and damping over the amplitude
=========================================================

A friction damper on the end of a cantilever sticks in small vibrations and slides in large ones:
the mode loses frequency over its amplitude, and its damping has a maximum. One computation of the
mode replaces responses for every force. Two masses with a hardening spring have an internal
resonance: at a third of its frequency the second mode takes the motion over.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, mode_response, nonlinear_mode
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.plot import plot_nonlinear_mode
from fecontact.reduction import PolynomialSpring, point_masses

# %%
# The cantilever; what its end does across is what the damper feels.
body = fc.ElasticBody(fc.generate(fc.Beam(0.3, 0.01, 0.005)), thickness=0.02, fixed={"left": "xy"})
beam = fc.modal_basis(body, 3, contact_nodes=2, points={"end": (0.3, 0.005)})
end = np.zeros((3, beam.modes))
end[0] = beam.point_row("end", "y")
basis = fc.basis_from_matrices(
    np.eye(3), np.diag(beam.angular_frequencies**2), {"contact": [end], "B": end}, damping=5e-4)
system = fc.ContactSystem(
    basis, normal=PrescribedForce(0.5), friction=JenkinsFriction(2000.0, 0.4),
    load=fc.Load(forces=(fc.PointLoad("B", "x", signal=Harmonic(0.1, 95.0)),)))
mode = nonlinear_mode(system, (2e-5, 3e-3), method=HarmonicBalance(5, 256))
print(f"{mode.frequency_hz[0]:.3f} Hz sticking, {mode.frequency_hz[-1]:.3f} Hz sliding, damping "
      f"ratio up to {mode.damping_ratio.max():.5f}")
plot_nonlinear_mode(mode, path="damped_beam_mode.png")

# %%
# Responses to any force follow from the mode at once.
forced = mode_response(mode, system, levels={"load.forces.0.signal.amplitude": [0.05, 0.1, 0.15]},
                       frequency="load.forces.0.signal.frequency_hz")
for level, force in enumerate(forced.levels):
    peak = forced.peak(level)
    print(f"{force:.2f} N: {1e3 * peak.amplitude:.4f} mm at {peak.frequency_hz:.3f} Hz")

# %%
# Two masses of 1 kg on three springs of 1 N/m, the first of which hardens.
up = (0.0, 1.0)
masses = fc.ContactSystem(
    bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 1.0})},
    links={"a": PolynomialSpring("a.p", None, 1.0, 0.5, direction=up),
           "b": PolynomialSpring("b.p", None, 1.0, direction=up),
           "ab": PolynomialSpring("a.p", "b.p", 1.0, direction=up)})
resonant = nonlinear_mode(masses, (1e-2, 200.0), observe=("b.p", "y"), method=HarmonicBalance(15))
third = np.abs(resonant.coordinates(3)[:, 0] / resonant.coordinates(1)[:, 0])
print(f"internal resonance at {resonant.frequency_hz[third.argmax()]:.4f} Hz")
plot_nonlinear_mode(resonant, path="internal_resonance.png")
