"""
Frequency responses with a friction damper, and of a hardening spring
=====================================================================

Left alone, the mass resonates at 0.159 Hz; while its friction damper sticks, at 0.195 Hz. In
between lies a force at which the damper works best. The spring that hardens bends its resonance
over: two stable responses at one frequency, an unstable one between them.
"""

import numpy as np

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, frequency_response, vector_field
from fecontact.laws import JenkinsFriction, PrescribedForce
from fecontact.plot import plot_response

# %%
# A mass on a spring whose end swings by 1 m; its damper, a spring of 0.5 N/m, slides at 1 N.
x = [[1.0], [0.0], [0.0]]
system = fc.ContactSystem(
    fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": [x], "B": x}),
    normal=PrescribedForce(1.0),
    friction=JenkinsFriction(stiffness=0.5, friction_coefficient=1.0),
    drive=fc.Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=1.0, frequency_hz=0.16))
damped = frequency_response(
    system, (0.11, 0.24), levels={"drive.amplitude_x": [0.2, 0.3, 0.5, 0.75, 1.0]},
    method=HarmonicBalance(harmonics=7, samples=512))
print("amplitude of the drive, frequency [Hz] and amplification of the peak")
for level, amplitude in enumerate(damped.levels):
    print(f"{amplitude:6.2f} {damped.peak(level).parameter:8.4f} "
          f"{damped.amplitude(level).max() / amplitude:8.3f}")
plot_response(damped, path="friction_damper_response.png")


# %%
# The same function follows equations of your own: x'' + 0.05 x' + x + 0.1 x^3 = P cos W t.
def hardening(t, x, p, out):
    out[0] = x[1]
    out[1] = p[1] * np.cos(p[0] * t) - 0.05 * x[1] - x[0] - 0.1 * x[0] ** 3


spring = vector_field(hardening, {"W": 0.8, "P": 0.18}, ["x", "v"],
                      period=lambda p: 2.0 * np.pi / p["W"])
hardened = frequency_response(spring, (0.6, 1.6), "W", levels={"P": [0.05, 0.1, 0.18]})
for level, force in enumerate(hardened.levels):
    folds = ", ".join(f"{point.parameter:.5f}" for point in hardened.branches[level].special)
    print(f"P = {force:g}: folds at W = {folds or 'none'}")
plot_response(hardened, path="hardening_response.png")
