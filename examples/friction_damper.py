"""
How hard to press a friction damper
===================================

A friction damper of stiffness k holds the end of a cantilever. Pressed too lightly it slides and
takes little, pressed too hard it sticks and takes nothing. The peak of the response is followed
over the normal load, without responses in between; the best load is near pi F / 2 divided by the
friction coefficient, for a force F.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    frequency_response,
    resonance_curve,
)
from fecontact.laws import Harmonic, JenkinsFriction, PrescribedForce
from fecontact.plot import plot_resonance_curve, plot_response

# %%
# A cantilever of 300 mm; what its end does across is what the damper feels.
body = fc.ElasticBody(fc.generate(fc.Beam(0.3, 0.01, 0.005)), thickness=0.02, fixed={"left": "xy"})
beam = fc.modal_basis(body, 3, contact_nodes=2, points={"end": (0.3, 0.005)})
end = np.zeros((3, beam.modes))
end[0] = beam.point_row("end", "y")
basis = fc.basis_from_matrices(
    np.eye(3), np.diag(beam.angular_frequencies**2), {"contact": [end], "B": end}, damping=5e-4)
force, coefficient = 0.1, 0.4
system = fc.ContactSystem(
    basis, normal=PrescribedForce(0.5), friction=JenkinsFriction(2000.0, coefficient),
    load=fc.Load(forces=(fc.PointLoad("B", "x", signal=Harmonic(force, 95.0)),)))

# %%
# Responses over the frequency for several loads ...
frequency, method = "load.forces.0.signal.frequency_hz", HarmonicBalance(5, 256)
responses = frequency_response(system, (89.0, 102.0), frequency, method=method,
                               levels={"normal.force": [0.25, 0.3, 0.4, 0.8, 2.0]})
for level, load in enumerate(responses.levels):
    print(f"{load:.2f} N: {1e6 * responses.amplitude(level).max():.1f} um at "
          f"{responses.peak(level).parameter:.2f} Hz")
plot_response(responses, path="friction_damper_responses.png")

# %%
# ... and their peaks alone.
peaks = resonance_curve(system, (0.3, 0.8), "normal.force", (89.0, 102.0), frequency=frequency,
                        condition="phase", method=method,
                        options=ContinuationOptions(points=80))
print(f"best load {peaks.optimum().parameter:.4f} N, classical estimate "
      f"{0.5 * np.pi * force / coefficient:.4f} N")
plot_resonance_curve(peaks, path="friction_damper.png")
